//! MIDI channel messages in, events out: the one translation shared by the plugin and the offline renderer.
//!
//! The instrument is one voice, so channels merge: a note is a note wherever it comes from, and breath is one stream.
//! Breath is looked for where wind controllers put it: breath controller (CC2, fine part CC34), expression (CC11, fine
//! part CC43) and channel pressure. A controller often sends several at once, so the sources are ranked, CC2 over CC11
//! over pressure: a source is heard until a higher one has sent its first message, and from then on only the higher
//! one, until [`reset`](MidiDecoder::reset). Any message counts as movement, a zero too: a controller at rest is a
//! player who does not blow. Bend follows RPN 0. Left out: MPE zones, poly pressure, pedals, program and bank.
//!
//! Source: MIDI 1.0 Detailed Specification 4.2.1 (1996), control change numbers and registered parameters; RP-015 for
//! CC121. Data bytes above 127 are read as 127 and channels modulo 16, so that no input is wrong.

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

/// The bend wheel at rest.
const BEND_CENTRE: u16 = 8192;
/// Registered parameter "none selected".
const RPN_NONE: [u8; 2] = [127, 127];
const RPN_BEND_RANGE: [u8; 2] = [0, 0];

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
    bend: u16,
    range_semitones: u8,
    range_cents: u8,
    /// Registered parameter that data entry would set, coarse then fine.
    rpn: [u8; 2],
}

impl Channel {
    const NEW: Self = Self {
        breath: Fader { coarse: 0, fine: None },
        expression: Fader { coarse: 0, fine: None },
        bend: BEND_CENTRE,
        range_semitones: 2,
        range_cents: 0,
        rpn: RPN_NONE,
    };

    /// The wheel has one step less above its centre than below; both ends reach the full range.
    fn bend(&self) -> Event {
        let offset = f32::from(self.bend) - f32::from(BEND_CENTRE);
        let steps = if offset < 0.0 { 8192.0 } else { 8191.0 };
        let range_cents = 100.0 * f32::from(self.range_semitones) + f32::from(self.range_cents);
        Event::Bend { cents: offset / steps * range_cents }
    }

    /// A new bend range is heard at once if the wheel is off its centre.
    fn rebend(&self) -> Option<Event> {
        (self.bend != BEND_CENTRE).then(|| self.bend())
    }
}

/// Remembers what running controllers need remembered; each message gives at most one event. Real-time safe.
#[derive(Clone, Debug)]
pub struct MidiDecoder {
    channels: [Channel; 16],
    source: Source,
}

impl Default for MidiDecoder {
    fn default() -> Self {
        Self::new()
    }
}

impl MidiDecoder {
    /// As after switching on: no breath source known, bend range two semitones. Does not allocate.
    pub fn new() -> Self {
        Self { channels: [Channel::NEW; 16], source: Source::Nothing }
    }

    /// Forgets every controller, the breath source and the bend ranges. Real-time safe.
    pub fn reset(&mut self) {
        *self = Self::new();
    }

    /// A key goes down; with velocity 0 it comes up, as running status has it. Real-time safe.
    pub fn note_on(&mut self, channel: u8, key: u8, velocity: u8) -> Option<Event> {
        if velocity == 0 {
            return self.note_off(channel, key);
        }
        let velocity = f32::from(velocity.min(127)) / 127.0;
        Some(Event::NoteOn { note: SoundingNote(key.min(127)), velocity })
    }

    /// A key comes up. Real-time safe.
    pub fn note_off(&mut self, _channel: u8, key: u8) -> Option<Event> {
        Some(Event::NoteOff { note: SoundingNote(key.min(127)) })
    }

    /// A control change. Real-time safe.
    pub fn controller(&mut self, channel: u8, cc: u8, value: u8) -> Option<Event> {
        let value = value.min(127);
        let state = &mut self.channels[usize::from(channel % 16)];
        match cc {
            BREATH => state.breath.coarse = value,
            BREATH_FINE => state.breath.fine = Some(value),
            EXPRESSION => state.expression.coarse = value,
            EXPRESSION_FINE => state.expression.fine = Some(value),
            RPN => state.rpn[0] = value,
            RPN_FINE => state.rpn[1] = value,
            NRPN | NRPN_FINE => state.rpn = RPN_NONE,
            DATA_ENTRY if state.rpn == RPN_BEND_RANGE => state.range_semitones = value,
            DATA_ENTRY_FINE if state.rpn == RPN_BEND_RANGE => state.range_cents = value,
            RESET_CONTROLLERS => {
                // RP-015 also puts expression to full, which on a wind instrument would be a blast: breath stays.
                state.rpn = RPN_NONE;
                state.bend = BEND_CENTRE;
            }
            _ => {}
        }
        match cc {
            BREATH | BREATH_FINE => {
                let unit = state.breath.unit();
                self.breathe(Source::Breath, unit)
            }
            EXPRESSION | EXPRESSION_FINE => {
                let unit = state.expression.unit();
                self.breathe(Source::Expression, unit)
            }
            DATA_ENTRY | DATA_ENTRY_FINE if state.rpn == RPN_BEND_RANGE => state.rebend(),
            RESET_CONTROLLERS => Some(state.bend()),
            ALL_SOUND_OFF | ALL_NOTES_OFF => Some(Event::Panic),
            _ => None,
        }
    }

    /// Channel pressure (aftertouch). Real-time safe.
    pub fn pressure(&mut self, _channel: u8, value: u8) -> Option<Event> {
        self.breathe(Source::Pressure, f32::from(value.min(127)) / 127.0)
    }

    /// The bend wheel, 0..=16383, 8192 at rest. Real-time safe.
    pub fn bend(&mut self, channel: u8, value14: u16) -> Option<Event> {
        let state = &mut self.channels[usize::from(channel % 16)];
        state.bend = value14.min(16383);
        Some(state.bend())
    }

    /// A source at rest has not moved yet: hosts that send every controller once at the start do not take the breath away
    /// from the keys.
    fn breathe(&mut self, source: Source, unit: f32) -> Option<Event> {
        if source > self.source && unit == 0.0 {
            return None;
        }
        self.source = self.source.max(source);
        (source == self.source).then_some(Event::Breath(unit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocity_zero_is_note_off() {
        let mut midi = MidiDecoder::new();
        assert_eq!(midi.note_on(0, 60, 127), Some(Event::NoteOn { note: SoundingNote(60), velocity: 1.0 }));
        assert_eq!(midi.note_on(0, 60, 0), Some(Event::NoteOff { note: SoundingNote(60) }));
    }

    #[test]
    fn a_source_at_rest_has_not_moved() {
        let mut midi = MidiDecoder::new();
        assert_eq!(midi.controller(0, 2, 0), None);
        assert_eq!(midi.pressure(0, 0), None);
        assert_eq!(midi.controller(0, 11, 1), Some(Event::Breath(1.0 / 127.0)));
        assert_eq!(midi.controller(0, 2, 0), None, "CC2 has yet to move");
        assert_eq!(midi.controller(0, 11, 0), Some(Event::Breath(0.0)));
    }

    #[test]
    fn breath_is_exact_in_7_bits_and_in_14() {
        let mut midi = MidiDecoder::new();
        assert_eq!(midi.controller(0, 2, 127), Some(Event::Breath(1.0)));
        assert_eq!(midi.controller(0, 2, 64), Some(Event::Breath(64.0 / 127.0)));
        assert_eq!(midi.controller(0, 34, 1), Some(Event::Breath(8193.0 / 16383.0)));
        assert_eq!(midi.controller(1, 2, 64), Some(Event::Breath(64.0 / 127.0)), "fine part is per channel");
        midi.controller(0, 2, 127);
        assert_eq!(midi.controller(0, 34, 127), Some(Event::Breath(1.0)));
        midi.reset();
        assert_eq!(midi.controller(0, 2, 127), Some(Event::Breath(1.0)));
    }

    #[test]
    fn fine_breath_rises_with_every_step() {
        let mut midi = MidiDecoder::new();
        let mut last = 0.0;
        for value in 1..16384u16 {
            midi.controller(0, 2, (value >> 7) as u8);
            let Some(Event::Breath(unit)) = midi.controller(0, 34, (value & 127) as u8) else { panic!() };
            assert!(unit > last && unit <= 1.0);
            last = unit;
        }
        assert_eq!(last, 1.0);
    }

    #[test]
    fn the_highest_source_that_has_moved_is_heard() {
        let mut midi = MidiDecoder::new();
        assert_eq!(midi.pressure(0, 127), Some(Event::Breath(1.0)));
        assert_eq!(midi.controller(3, 11, 1), Some(Event::Breath(1.0 / 127.0)));
        assert_eq!(midi.pressure(0, 100), None);
        assert!(midi.controller(0, 2, 10).is_some());
        assert_eq!(midi.controller(3, 11, 80), None);
        assert_eq!(midi.controller(3, 43, 80), None);
        midi.reset();
        assert!(midi.pressure(0, 100).is_some());
    }

    #[test]
    fn bend_reaches_both_ends_and_follows_rpn_0() {
        let mut midi = MidiDecoder::new();
        assert_eq!(midi.bend(0, 8192), Some(Event::Bend { cents: 0.0 }));
        assert_eq!(midi.bend(0, 16383), Some(Event::Bend { cents: 200.0 }));
        assert_eq!(midi.bend(0, 0), Some(Event::Bend { cents: -200.0 }));
        assert_eq!(midi.controller(0, 6, 12), None, "no parameter selected");
        midi.controller(0, 101, 0);
        midi.controller(0, 100, 0);
        assert_eq!(midi.controller(0, 6, 12), Some(Event::Bend { cents: -1200.0 }));
        assert_eq!(midi.controller(0, 38, 50), Some(Event::Bend { cents: -1250.0 }));
        midi.controller(0, 101, 127);
        midi.controller(0, 100, 127);
        midi.controller(0, 6, 1);
        assert_eq!(midi.bend(0, 0), Some(Event::Bend { cents: -1250.0 }));
        assert_eq!(midi.bend(1, 0), Some(Event::Bend { cents: -200.0 }), "range is per channel");
        assert_eq!(midi.controller(0, 121, 0), Some(Event::Bend { cents: 0.0 }));
    }

    #[test]
    fn an_unregistered_parameter_is_not_the_bend_range() {
        let mut midi = MidiDecoder::new();
        midi.controller(0, 101, 0);
        midi.controller(0, 100, 0);
        midi.controller(0, 99, 0);
        midi.controller(0, 6, 24);
        assert_eq!(midi.bend(0, 16383), Some(Event::Bend { cents: 200.0 }));
    }

    #[test]
    fn no_input_is_wrong() {
        let mut midi = MidiDecoder::new();
        for a in 0..=255u8 {
            for b in 0..=255u8 {
                for event in [
                    midi.note_on(a, b, b),
                    midi.note_off(a, b),
                    midi.controller(a, b, a ^ b),
                    midi.pressure(a, b),
                    midi.bend(a, u16::from(a) << 8 | u16::from(b)),
                ] {
                    match event {
                        Some(Event::Breath(x)) => assert!((0.0..=1.0).contains(&x)),
                        Some(Event::Bend { cents }) => assert!(cents.abs() <= 12_827.0),
                        Some(Event::NoteOn { velocity, .. }) => assert!(velocity > 0.0 && velocity <= 1.0),
                        _ => {}
                    }
                }
            }
        }
        assert_eq!(midi.controller(0, 120, 0), Some(Event::Panic));
        assert_eq!(midi.controller(0, 123, 0), Some(Event::Panic));
    }
}
