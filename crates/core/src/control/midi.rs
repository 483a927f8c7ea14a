//! Turns MIDI channel messages into events, for the plugin and for the offline renderer alike.
//!
//! The instrument has one voice, so all channels play it, and their breath is one stream. Breath comes from the
//! controllers that wind controllers use: breath controller (CC2, fine part CC34), expression (CC11, fine
//! part CC43) and channel pressure. A controller often sends several at once, so the sources are ranked, CC2 over CC11
//! over pressure: a source is heard until a higher one sends its first value above 0, and from then on only the higher
//! one, until [`reset`](MidiDecoder::reset). A source that has only sent 0 does not count: some hosts send every
//! controller once at the start. Once a source is in use, its 0 means that the player does not blow. Bend follows the sounding note's channel and its MPE zone, see [`bends`](super::bends);
//! RPN 0 sets a bend range, RPN 6 a zone. Left out: poly pressure, pedals, program and bank.
//!
//! Source: MIDI 1.0 Detailed Specification 4.2.1 (1996), control change numbers and registered parameters; RP-015 for
//! CC121; RP-053 for MPE. Data bytes above 127 are read as 127 and channels modulo 16, so that every
//! input is valid.
//!
//! ```
//! use chalumeau_core::{control::midi::MidiDecoder, event::Event};
//!
//! let mut midi = MidiDecoder::new();
//! // Breath controller (CC2) at 0 does not count as breath; at 64 it does.
//! assert_eq!(midi.controller(0, 2, 0), [None, None]);
//! assert_eq!(midi.controller(0, 2, 64), [Some(Event::Breath(64.0 / 127.0)), None]);
//! ```

use crate::control::bends::Bends;
use crate::event::Event;
use crate::units::SoundingNote;

const BREATH: u8 = 2;
const DATA_ENTRY: u8 = 6;
const EXPRESSION: u8 = 11;
const BREATH_FINE: u8 = BREATH + 32;
const DATA_ENTRY_FINE: u8 = DATA_ENTRY + 32;
const EXPRESSION_FINE: u8 = EXPRESSION + 32;
const NRPN_FINE: u8 = 98;
const NRPN: u8 = 99;
const RPN_FINE: u8 = 100;
const RPN: u8 = 101;
const ALL_SOUND_OFF: u8 = 120;
const RESET_CONTROLLERS: u8 = 121;
const ALL_NOTES_OFF: u8 = 123;

/// Registered parameter "none selected".
const RPN_NONE: [u8; 2] = [127, 127];
const RPN_BEND_RANGE: [u8; 2] = [0, 0];
const RPN_MPE_ZONE: [u8; 2] = [0, 6];

/// The events of one message: at most two, in order.
pub type Events = [Option<Event>; 2];

const NOTHING: Events = [None, None];

fn one(event: Event) -> Events {
    [Some(event), None]
}

/// Where breath can come from, the weakest claim first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Source {
    Nothing,
    Pressure,
    Expression,
    Breath,
}

/// A controller with a coarse and, on some devices, a fine part.
#[derive(Clone, Copy, Debug, Default)]
struct Fader {
    coarse: u8,
    /// `None` until the device has shown that it sends one.
    fine: Option<u8>,
}

impl Fader {
    fn set(&mut self, fine: bool, value: u8) {
        if fine {
            self.fine = Some(value);
        } else {
            self.coarse = value;
        }
    }

    /// 0..=1: 127ths as long as only the coarse part is known, 16383rds afterwards. The fine part is kept when a coarse
    /// part follows (the specification would zero it), so that devices sending the fine part first end right too.
    fn unit(self) -> f32 {
        match self.fine {
            None => f32::from(self.coarse) / 127.0,
            Some(fine) => f32::from(u16::from(self.coarse) * 128 + u16::from(fine)) / 16383.0,
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Channel {
    breath: Fader,
    expression: Fader,
    /// Registered parameter that data entry would set, coarse then fine.
    rpn: [u8; 2],
}

impl Channel {
    const NEW: Self = Self {
        breath: Fader { coarse: 0, fine: None },
        expression: Fader { coarse: 0, fine: None },
        rpn: RPN_NONE,
    };
}

/// Decodes MIDI messages; it keeps the state of controllers, bend wheels and zones. Real-time safe.
#[derive(Clone, Debug)]
pub struct MidiDecoder {
    channels: [Channel; 16],
    source: Source,
    bends: Bends,
    /// The last bend there was an event for.
    bent_cents: f32,
}

impl Default for MidiDecoder {
    fn default() -> Self {
        Self::new()
    }
}

impl MidiDecoder {
    /// As after switching on: no breath source known, no MPE zone, bend range two semitones. Does not allocate.
    pub fn new() -> Self {
        Self {
            channels: [Channel::NEW; 16],
            source: Source::Nothing,
            bends: Bends::default(),
            bent_cents: 0.0,
        }
    }

    /// The same with MPE's usual lower zone, for what was played on an MPE controller that did not announce itself: channel 1
    /// manages the other fifteen, which bend by 48 semitones until RPN 0 says otherwise.
    #[must_use]
    pub fn with_mpe(mut self) -> Self {
        self.bends.set_zone(0, 15);
        self
    }

    /// Forgets every controller, the breath source, the zones and the bend ranges. Real-time safe.
    pub fn reset(&mut self) {
        *self = Self::new();
    }

    /// Bend range until RPN 0 says otherwise, semitones; of MPE members it is 48. Real-time safe.
    pub fn usual_bend_range(&mut self, semitones: u8) -> Events {
        self.bends.set_usual_range(semitones);
        [self.rebend(), None]
    }

    /// A key goes down; with velocity 0 it comes up, as running status has it. Its channel's bend comes before the note.
    /// Real-time safe.
    pub fn note_on(&mut self, channel: u8, key: u8, velocity: u8) -> Events {
        if velocity == 0 {
            return self.note_off(Some(channel), key);
        }
        let velocity = f32::from(velocity.min(127)) / 127.0;
        self.bends.press(usize::from(channel % 16), key.min(127));
        [self.rebend(), Some(Event::NoteOn { note: SoundingNote(key.min(127)), velocity })]
    }

    /// A key comes up, on one channel or on all. Nothing happens to a note that another channel still holds, but the bend
    /// may be another one's now. Real-time safe.
    pub fn note_off(&mut self, channel: Option<u8>, key: u8) -> Events {
        let up = self.bends.release(channel.map(|channel| usize::from(channel % 16)), key.min(127));
        [self.rebend(), up.then_some(Event::NoteOff { note: SoundingNote(key.min(127)) })]
    }

    /// Tuning of a note above its key, cents, until it is struck anew: all notes of a channel, or one key. Real-time safe.
    pub fn tune(&mut self, channel: Option<u8>, key: Option<u8>, cents: f32) -> Events {
        let cents = if cents.is_finite() { cents } else { 0.0 };
        let channel = channel.map(|channel| usize::from(channel % 16));
        if self.bends.tune(channel, key.map(|key| key.min(127)), cents) { one(self.bent()) } else { NOTHING }
    }

    /// A control change. Real-time safe.
    pub fn controller(&mut self, channel: u8, cc: u8, value: u8) -> Events {
        let value = value.min(127);
        let at = usize::from(channel % 16);
        let state = &mut self.channels[at];
        match cc {
            BREATH | BREATH_FINE => {
                state.breath.set(cc == BREATH_FINE, value);
                let unit = state.breath.unit();
                self.breathe(Source::Breath, unit)
            }
            EXPRESSION | EXPRESSION_FINE => {
                state.expression.set(cc == EXPRESSION_FINE, value);
                let unit = state.expression.unit();
                self.breathe(Source::Expression, unit)
            }
            RPN | RPN_FINE => {
                state.rpn[usize::from(cc == RPN_FINE)] = value;
                NOTHING
            }
            NRPN | NRPN_FINE => {
                state.rpn = RPN_NONE;
                NOTHING
            }
            DATA_ENTRY | DATA_ENTRY_FINE => {
                match (state.rpn, cc) {
                    (RPN_BEND_RANGE, DATA_ENTRY) => self.bends.set_range(at, Some(value), None),
                    (RPN_BEND_RANGE, _) => self.bends.set_range(at, None, Some(value)),
                    (RPN_MPE_ZONE, DATA_ENTRY) => self.bends.set_zone(at, value),
                    _ => {}
                }
                [self.rebend(), None]
            }
            RESET_CONTROLLERS => {
                // RP-015 also puts expression to full, which on a wind instrument would be a blast: breath stays.
                state.rpn = RPN_NONE;
                self.bends.rest(at);
                [self.bends.is_heard(at).then(|| self.bent()), None]
            }
            ALL_SOUND_OFF | ALL_NOTES_OFF => {
                // The instrument forgets its bend, wheels do not.
                self.bends.release_all();
                self.bent_cents = 0.0;
                [Some(Event::Panic), self.rebend()]
            }
            _ => NOTHING,
        }
    }

    /// Channel pressure (aftertouch). Real-time safe.
    pub fn pressure(&mut self, _channel: u8, value: u8) -> Events {
        self.breathe(Source::Pressure, f32::from(value.min(127)) / 127.0)
    }

    /// The bend wheel, 0..=16383, 8192 at rest. Real-time safe.
    pub fn bend(&mut self, channel: u8, value14: u16) -> Events {
        let at = usize::from(channel % 16);
        self.bends.turn(at, value14);
        [self.bends.is_heard(at).then(|| self.bent()), None]
    }

    fn bent(&mut self) -> Event {
        self.bent_cents = self.bends.cents();
        Event::Bend { cents: self.bent_cents }
    }

    /// A bend, if it has changed.
    fn rebend(&mut self) -> Option<Event> {
        (self.bends.cents() != self.bent_cents).then(|| self.bent())
    }

    /// A source that has only sent 0 is not in use yet. Otherwise hosts that send every controller once at the start would
    /// take the breath away from the keys.
    fn breathe(&mut self, source: Source, unit: f32) -> Events {
        if source > self.source && unit == 0.0 {
            return NOTHING;
        }
        self.source = self.source.max(source);
        [(source == self.source).then_some(Event::Breath(unit)), None]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The event of a message that has at most one.
    fn only([event, none]: Events) -> Option<Event> {
        assert_eq!(none, None);
        event
    }

    #[test]
    fn velocity_zero_is_note_off() {
        let mut midi = MidiDecoder::new();
        let note = SoundingNote(60);
        assert_eq!(midi.note_on(0, 60, 127), [None, Some(Event::NoteOn { note, velocity: 1.0 })]);
        assert_eq!(midi.note_on(0, 60, 0), [None, Some(Event::NoteOff { note })]);
    }

    #[test]
    fn a_source_at_rest_has_not_moved() {
        let mut midi = MidiDecoder::new();
        assert_eq!(only(midi.controller(0, 2, 0)), None);
        assert_eq!(only(midi.pressure(0, 0)), None);
        assert_eq!(only(midi.controller(0, 11, 1)), Some(Event::Breath(1.0 / 127.0)));
        assert_eq!(only(midi.controller(0, 2, 0)), None, "CC2 has yet to move");
        assert_eq!(only(midi.controller(0, 11, 0)), Some(Event::Breath(0.0)));
    }

    #[test]
    fn breath_is_exact_in_7_bits_and_in_14() {
        let mut midi = MidiDecoder::new();
        assert_eq!(only(midi.controller(0, 2, 127)), Some(Event::Breath(1.0)));
        assert_eq!(only(midi.controller(0, 2, 64)), Some(Event::Breath(64.0 / 127.0)));
        assert_eq!(only(midi.controller(0, 34, 1)), Some(Event::Breath(8193.0 / 16383.0)));
        assert_eq!(
            only(midi.controller(1, 2, 64)),
            Some(Event::Breath(64.0 / 127.0)),
            "fine part is per channel"
        );
        midi.controller(0, 2, 127);
        assert_eq!(only(midi.controller(0, 34, 127)), Some(Event::Breath(1.0)));
        midi.reset();
        assert_eq!(only(midi.controller(0, 2, 127)), Some(Event::Breath(1.0)));
    }

    #[test]
    fn fine_breath_rises_with_every_step() {
        let mut midi = MidiDecoder::new();
        let mut last = 0.0;
        for value in 1..16384u16 {
            midi.controller(0, 2, (value >> 7) as u8);
            let [Some(Event::Breath(unit)), None] = midi.controller(0, 34, (value & 127) as u8) else {
                panic!()
            };
            assert!(unit > last && unit <= 1.0);
            last = unit;
        }
        assert_eq!(last, 1.0);
    }

    #[test]
    fn the_highest_source_that_has_moved_is_heard() {
        let mut midi = MidiDecoder::new();
        assert_eq!(only(midi.pressure(0, 127)), Some(Event::Breath(1.0)));
        assert_eq!(only(midi.controller(3, 11, 1)), Some(Event::Breath(1.0 / 127.0)));
        assert_eq!(only(midi.pressure(0, 100)), None);
        assert!(only(midi.controller(0, 2, 10)).is_some());
        assert_eq!(only(midi.controller(3, 11, 80)), None);
        assert_eq!(only(midi.controller(3, 43, 80)), None);
        midi.reset();
        assert!(only(midi.pressure(0, 100)).is_some());
    }

    #[test]
    fn bend_reaches_both_ends_and_follows_rpn_0() {
        let mut midi = MidiDecoder::new();
        assert_eq!(only(midi.bend(0, 8192)), Some(Event::Bend { cents: 0.0 }));
        assert_eq!(only(midi.bend(0, 16383)), Some(Event::Bend { cents: 200.0 }));
        assert_eq!(only(midi.bend(0, 0)), Some(Event::Bend { cents: -200.0 }));
        assert_eq!(only(midi.controller(0, 6, 12)), None, "no parameter selected");
        midi.controller(0, 101, 0);
        midi.controller(0, 100, 0);
        assert_eq!(only(midi.controller(0, 6, 12)), Some(Event::Bend { cents: -1200.0 }));
        assert_eq!(only(midi.controller(0, 38, 50)), Some(Event::Bend { cents: -1250.0 }));
        midi.controller(0, 101, 127);
        midi.controller(0, 100, 127);
        midi.controller(0, 6, 1);
        assert_eq!(only(midi.bend(0, 0)), Some(Event::Bend { cents: -1250.0 }));
        assert_eq!(only(midi.bend(1, 0)), Some(Event::Bend { cents: -200.0 }), "range is per channel");
        assert_eq!(only(midi.controller(0, 121, 0)), Some(Event::Bend { cents: 0.0 }));
    }

    #[test]
    fn the_usual_bend_range_is_that_of_who_was_told_nothing() {
        let mut midi = MidiDecoder::new();
        assert_eq!(midi.usual_bend_range(2), [None, None], "as it is from the start");
        midi.bend(0, 0);
        assert_eq!(midi.usual_bend_range(12), [Some(Event::Bend { cents: -1_200.0 }), None]);
        for (cc, value) in [(101, 0), (100, 0), (6, 7)] {
            midi.controller(0, cc, value);
        }
        assert_eq!(midi.usual_bend_range(24), [None, None], "RPN 0 has spoken");
        assert_eq!(midi.bend(0, 0)[0], Some(Event::Bend { cents: -700.0 }));
    }

    #[test]
    fn an_unregistered_parameter_is_not_the_bend_range() {
        let mut midi = MidiDecoder::new();
        midi.controller(0, 101, 0);
        midi.controller(0, 100, 0);
        midi.controller(0, 99, 0);
        midi.controller(0, 6, 24);
        assert_eq!(only(midi.bend(0, 16383)), Some(Event::Bend { cents: 200.0 }));
    }

    #[test]
    fn no_input_is_wrong() {
        let mut midi = MidiDecoder::new();
        for a in 0..=255u8 {
            for b in 0..=255u8 {
                for event in [
                    midi.note_on(a, b, b),
                    midi.note_off(Some(a), b),
                    midi.controller(a, b, a ^ b),
                    midi.pressure(a, b),
                    midi.bend(a, u16::from(a) << 8 | u16::from(b)),
                    midi.tune(Some(a), Some(b), f32::from(a) - f32::from(b)),
                ]
                .into_iter()
                .flatten()
                {
                    match event {
                        Some(Event::Breath(x)) => assert!((0.0..=1.0).contains(&x)),
                        Some(Event::Bend { cents }) => assert!(cents.abs() <= 26_000.0),
                        Some(Event::NoteOn { velocity, .. }) => assert!(velocity > 0.0 && velocity <= 1.0),
                        _ => {}
                    }
                }
            }
        }
        assert_eq!(midi.controller(0, 120, 0)[0], Some(Event::Panic));
        assert_eq!(midi.controller(0, 123, 0)[0], Some(Event::Panic));
    }

    /// A member's full wheel, and a manager's.
    const FULL: [f32; 2] = [4_800.0, 200.0];

    #[test]
    fn an_announced_zone_bends_by_48_semitones_and_its_manager_by_2() {
        let mut midi = MidiDecoder::new();
        for (cc, value) in [(101, 0), (100, 6), (6, 7)] {
            assert_eq!(midi.controller(0, cc, value), NOTHING);
        }
        midi.note_on(3, 60, 90);
        assert_eq!(only(midi.bend(3, 16383)), Some(Event::Bend { cents: FULL[0] }));
        assert_eq!(only(midi.bend(0, 0)), Some(Event::Bend { cents: FULL[0] - FULL[1] }));
        assert_eq!(only(midi.bend(4, 0)), None, "another finger's wheel");
        assert_eq!(only(midi.bend(9, 0)), None, "outside the zone");
        // The range of one member is that of all.
        for (cc, value) in [(101, 0), (100, 0), (6, 24)] {
            midi.controller(5, cc, value);
        }
        assert_eq!(only(midi.bend(3, 16383)), Some(Event::Bend { cents: FULL[0] / 2.0 - FULL[1] }));
        // No members, no zone.
        for (cc, value) in [(101, 0), (100, 6), (6, 0)] {
            midi.controller(0, cc, value);
        }
        assert_eq!(only(midi.bend(3, 16383)), Some(Event::Bend { cents: 200.0 }));
    }

    #[test]
    fn the_upper_zone_counts_down_and_gives_way() {
        let mut midi = MidiDecoder::new().with_mpe();
        for (cc, value) in [(101, 0), (100, 6), (6, 5)] {
            midi.controller(15, cc, value);
        }
        midi.note_on(10, 60, 90);
        assert_eq!(only(midi.bend(10, 16383)), Some(Event::Bend { cents: FULL[0] }));
        assert_eq!(only(midi.bend(15, 16383)), Some(Event::Bend { cents: FULL[0] + FULL[1] }));
        assert_eq!(only(midi.bend(0, 16383)), None, "the other zone's manager");
        midi.note_on(9, 62, 90);
        assert_eq!(only(midi.bend(9, 16383)), Some(Event::Bend { cents: FULL[0] + FULL[1] }));
    }

    #[test]
    fn each_note_has_its_own_channels_bend() {
        let mut midi = MidiDecoder::new().with_mpe();
        midi.note_on(1, 60, 90);
        midi.bend(1, 16383);
        let low = Event::NoteOn { note: SoundingNote(62), velocity: 1.0 };
        assert_eq!(midi.note_on(2, 62, 127), [Some(Event::Bend { cents: 0.0 }), Some(low)]);
        assert_eq!(only(midi.bend(1, 8192 + 4096)), None, "the key below slides on, unheard");
        let [Some(Event::Bend { cents }), Some(Event::NoteOff { note })] = midi.note_off(Some(2), 62) else {
            panic!("back to the lower key")
        };
        assert!((cents - FULL[0] * 4096.0 / 8191.0).abs() < 1e-2 && note == SoundingNote(62));
        assert_eq!(midi.note_off(Some(1), 60)[0], None, "a fading note keeps its bend");
        assert_eq!(only(midi.bend(1, 8192)), Some(Event::Bend { cents: 0.0 }), "and follows its wheel");
    }

    #[test]
    fn without_a_zone_the_wheel_of_a_channel_without_notes_is_for_all() {
        let mut midi = MidiDecoder::new();
        midi.note_on(4, 60, 90);
        assert_eq!(only(midi.bend(0, 16383)), Some(Event::Bend { cents: 200.0 }));
        assert_eq!(only(midi.bend(4, 16383)), Some(Event::Bend { cents: 400.0 }));
        // It plays now: its wheel is its own.
        assert_eq!(midi.note_on(0, 64, 90)[0], Some(Event::Bend { cents: 200.0 }));
        assert_eq!(only(midi.bend(4, 0)), None);
    }

    #[test]
    fn a_key_two_channels_hold_comes_up_with_the_second() {
        let mut midi = MidiDecoder::new().with_mpe();
        midi.note_on(1, 60, 90);
        midi.bend(2, 16383);
        assert_eq!(midi.note_on(2, 60, 90)[0], Some(Event::Bend { cents: FULL[0] }));
        assert_eq!(midi.note_off(Some(2), 60), [Some(Event::Bend { cents: 0.0 }), None]);
        assert_eq!(midi.note_off(Some(1), 60), [None, Some(Event::NoteOff { note: SoundingNote(60) })]);
        midi.note_on(3, 60, 90);
        midi.note_on(4, 60, 90);
        assert_eq!(midi.note_off(None, 60)[1], Some(Event::NoteOff { note: SoundingNote(60) }));
    }

    #[test]
    fn a_panic_leaves_the_wheels_where_they_are() {
        let mut midi = MidiDecoder::new();
        midi.note_on(0, 60, 90);
        midi.bend(0, 16383);
        assert_eq!(midi.controller(0, 123, 0), [Some(Event::Panic), Some(Event::Bend { cents: 200.0 })]);
    }
}
