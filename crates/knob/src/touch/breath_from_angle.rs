//! Turns a knob's angle into breath, note by note.
//!
//! Breath goes out on a grid of samples counted from the start, so that it does not depend on the host's blocks, and in
//! the steps of a 14-bit controller, so that a host that records it plays the very same breath back.

use crate::touch::feel::PitchMaps;
use chalumeau_core::control::keys::Keys;
use chalumeau_core::control::knob::{KnobBreath, KnobDesign};
use chalumeau_core::event::{Event, Timed};
use chalumeau_core::units::SoundingNote;

/// Samples between two values of breath: 1.3 ms at 48 kHz, a quarter of the time the player's breath takes to follow.
pub const GRID: u64 = 64;
/// Samples in which one note's map gives way to the next's: 30 ms at 48 kHz, as the feel under the hand does. A hand needs
/// longer; without it a slur over the break would jump.
const GLIDE: u64 = 1_440;
/// Steps of a 14-bit controller.
const STEPS: f32 = 16_383.0;

/// Breath as a 14-bit controller sends it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Breath14(pub u16);

impl Breath14 {
    /// Share of full breath, 0..=1, exactly as [`MidiDecoder`](chalumeau_core::control::midi::MidiDecoder) reads the pair.
    pub fn unit(self) -> f32 {
        f32::from(self.0) / STEPS
    }

    /// Values of the coarse (CC 2) and the fine controller (CC 34), 0..=127.
    pub fn bytes(self) -> (u8, u8) {
        ((self.0 >> 7) as u8 & 127, self.0 as u8 & 127)
    }
}

/// How knob angles become breath. Plain numbers, which threads may copy.
#[derive(Clone, Copy, Debug, Default)]
pub struct BreathMapping {
    /// Map from angle to mouth pressure, for each note.
    pub maps: PitchMaps,
    /// Rest, full blow, dead zone and curve.
    pub design: KnobDesign,
    /// True if the knob gives the feel. Then angles count as they are, because the notes' landmarks lie on them. If
    /// false, the player's full-blow angle means the closure of the reference reed, and the curve shapes the way there.
    pub feels: bool,
}

/// Follows the notes and turns angles into breath. Real-time safe throughout.
#[derive(Clone, Debug, Default)]
pub struct Blower {
    keys: Keys,
    fingered: Option<SoundingNote>,
    /// The note before it, and when it gave way.
    before: Option<SoundingNote>,
    changed_at: u64,
    blowing: bool,
    unfelt: Option<KnobBreath>,
    sent: Option<Breath14>,
    /// Samples since the start.
    clock: u64,
}

impl Blower {
    /// Returns to the initial state.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Notes an event of the block that begins now.
    pub fn heed(&mut self, event: &Timed<Event>) {
        match event.event {
            Event::NoteOn { note, .. } => self.keys.press(note),
            Event::NoteOff { note } | Event::Choke { note } => self.keys.release(note),
            Event::Panic => self.keys = Keys::default(),
            _ => return,
        }
        let fingered = self.keys.last().or(self.fingered);
        if fingered != self.fingered {
            (self.before, self.fingered) = (self.fingered, fingered);
            self.changed_at = self.clock + event.at as u64;
        }
    }

    /// The fingered note; it stays after its key is released.
    pub fn fingered(&self) -> Option<SoundingNote> {
        self.fingered
    }

    /// Samples since the start.
    pub fn clock(&self) -> u64 {
        self.clock
    }

    /// Offset of the first grid point at or after `from` in the block that begins now.
    pub fn next_point(&self, from: usize) -> usize {
        let at = self.clock + from as u64;
        (at.next_multiple_of(GRID) - self.clock) as usize
    }

    /// Ends a block of `samples` samples.
    pub fn advance(&mut self, samples: usize) {
        self.clock += samples as u64;
    }

    /// Breath at a knob angle (degrees), at sample `at` of the block that begins now; `None` if it has not changed.
    /// `full_pa` is the mouth pressure of full breath, Pa.
    pub fn blow(
        &mut self,
        hand: &BreathMapping,
        at: usize,
        angle_deg: f64,
        full_pa: f64,
    ) -> Option<Breath14> {
        let angle_deg =
            if hand.feels { self.beyond_rest(hand, angle_deg) } else { self.unfelt(hand, angle_deg) };
        let mut pressure_pa = hand.maps.pressure_pa(self.fingered, angle_deg);
        let since = (self.clock + at as u64).saturating_sub(self.changed_at);
        if let (Some(before), true) = (self.before, since < GLIDE) {
            let before_pa = hand.maps.pressure_pa(Some(before), angle_deg);
            pressure_pa = before_pa + (pressure_pa - before_pa) * since as f64 / GLIDE as f64;
        }
        let unit = pressure_pa / full_pa;
        let breath = Breath14((unit.clamp(0.0, 1.0) * f64::from(STEPS)).round() as u16);
        (self.sent.replace(breath) != Some(breath)).then_some(breath)
    }

    /// Angle from rest, 0 inside the dead zone; what lies beyond is not moved, it has been felt there.
    fn beyond_rest(&mut self, hand: &BreathMapping, angle_deg: f64) -> f64 {
        let KnobDesign { zero_deg, dead_on_deg, dead_off_deg, .. } = hand.design;
        let from_rest = angle_deg - zero_deg;
        // Not a number is no breath.
        self.blowing = from_rest > if self.blowing { dead_off_deg } else { dead_on_deg };
        if self.blowing { from_rest } else { 0.0 }
    }

    /// The share of full blow as an angle on the reference reed's travel.
    fn unfelt(&mut self, hand: &BreathMapping, angle_deg: f64) -> f64 {
        if self.unfelt.is_none_or(|knob| *knob.design() != hand.design) {
            self.unfelt = KnobBreath::new(hand.design).ok();
        }
        let travel_deg = hand.design.full_deg - hand.design.zero_deg;
        self.unfelt.as_mut().map_or(0.0, |knob| travel_deg * f64::from(knob.pressure_unit(angle_deg)))
    }

    /// Call it when the knob is gone: returns breath 0 if breath was sent before.
    pub fn fall_silent(&mut self) -> Option<Breath14> {
        self.sent.take().filter(|&sent| sent != Breath14(0)).map(|_| Breath14(0))
    }
}

/// Iterator over the host's events in order of time, with the knob's breath between them.
pub struct BlownEvents<'a, I: Iterator<Item = Timed<Event>>, A: FnMut(usize) -> Option<f64>> {
    host: std::iter::Peekable<I>,
    blower: &'a mut Blower,
    hand: &'a BreathMapping,
    full_pa: f64,
    /// Angle at a sample of the block.
    angle: A,
    /// Where breath comes next.
    next: usize,
    samples: usize,
    heard: &'a mut dyn FnMut(usize, Breath14),
}

impl<'a, I: Iterator<Item = Timed<Event>>, A: FnMut(usize) -> Option<f64>> BlownEvents<'a, I, A> {
    /// `angle` gives the knob's angle at a sample of the block, degrees; `heard` is called with the sample and value of each
    /// breath.
    pub fn new(
        host: I,
        blower: &'a mut Blower,
        hand: &'a BreathMapping,
        full_pa: f64,
        samples: usize,
        angle: A,
        heard: &'a mut dyn FnMut(usize, Breath14),
    ) -> Self {
        let next = blower.next_point(0);
        Self { host: host.peekable(), blower, hand, full_pa, angle, next, samples, heard }
    }
}

impl<I: Iterator<Item = Timed<Event>>, A: FnMut(usize) -> Option<f64>> Iterator for BlownEvents<'_, I, A> {
    type Item = Timed<Event>;

    fn next(&mut self) -> Option<Timed<Event>> {
        loop {
            let until = if self.next < self.samples { self.next } else { usize::MAX };
            if let Some(event) = self.host.next_if(|event| event.at <= until) {
                self.blower.heed(&event);
                // One breath at a time: while the knob blows, nothing else does.
                if !matches!(event.event, Event::Breath(_)) {
                    return Some(event);
                }
                continue;
            }
            let at = self.next;
            if at >= self.samples {
                return None;
            }
            self.next = at + GRID as usize;
            let blown =
                (self.angle)(at).and_then(|angle| self.blower.blow(self.hand, at, angle, self.full_pa));
            if let Some(breath) = blown {
                (self.heard)(at, breath);
                return Some(Timed { at, event: Event::Breath(breath.unit()) });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::touch::feel::{InstrumentFeel, NO_MOTOR};
    use chalumeau_core::control::midi::MidiDecoder;
    use chalumeau_core::haptics::FeelDesign;
    use chalumeau_core::instrument::Settings;
    use std::sync::LazyLock;

    static HAND: LazyLock<BreathMapping> = LazyLock::new(|| {
        let feels = InstrumentFeel::built_in().unwrap();
        let table = feels.table(&Settings::default(), &FeelDesign::default(), &NO_MOTOR).unwrap();
        BreathMapping { maps: feels.maps(&table), design: KnobDesign::default(), feels: true }
    });

    fn note_on(at: usize, note: u8) -> Timed<Event> {
        Timed { at, event: Event::NoteOn { note: SoundingNote(note), velocity: 0.8 } }
    }

    /// A phrase of two notes under a turning knob, in blocks of so many samples.
    fn phrase(block: usize) -> Vec<(usize, Event)> {
        let host = [note_on(100, 50), note_on(5_000, 69), Timed { at: 5_001, event: Event::Breath(0.9) }];
        let (mut blower, mut all) = (Blower::default(), Vec::new());
        for start in (0..9_600).step_by(block) {
            let samples = block.min(9_600 - start);
            let here = host.iter().filter(|event| (start..start + samples).contains(&event.at));
            let here = here.map(|event| Timed { at: event.at - start, event: event.event });
            let angle = |at: usize| Some(0.04 * (start + at) as f64);
            let mut ignore = |_, _| {};
            let events = BlownEvents::new(here, &mut blower, &HAND, 6_000.0, samples, angle, &mut ignore);
            all.extend(events.map(|event| (start + event.at, event.event)));
            blower.advance(samples);
        }
        all
    }

    #[test]
    fn blocks_make_no_difference() {
        let whole = phrase(9_600);
        assert!(whole.len() > 100, "{}", whole.len());
        for block in [1, 17, 64, 511, 4_096] {
            assert_eq!(phrase(block), whole, "blocks of {block}");
        }
        assert!(whole.is_sorted_by_key(|(at, _)| *at));
    }

    #[test]
    fn while_the_knob_blows_nothing_else_does() {
        assert!(!phrase(512).contains(&(5_001, Event::Breath(0.9))));
    }

    #[test]
    fn each_note_makes_its_own_pressure_of_the_angle() {
        let full_pa = 6_000.0;
        let blown = |note: u8| {
            let mut blower = Blower::default();
            blower.heed(&note_on(0, note));
            blower.blow(&HAND, 0, 200.0, full_pa).unwrap().unit()
        };
        // Sounding G4 needs less than sounding A5 (clarion): at one angle it is blown harder.
        assert!(
            (f64::from(blown(65)) - HAND.maps.pressure_pa(Some(SoundingNote(65)), 200.0) / full_pa).abs()
                < 1e-4
        );
        assert!(blown(65) > blown(69), "{} {}", blown(65), blown(69));
    }

    #[test]
    fn one_notes_map_gives_way_to_the_next_without_a_jump() {
        let mut blower = Blower::default();
        blower.heed(&note_on(0, 65));
        blower.advance(10_000);
        let low = blower.blow(&HAND, 0, 200.0, 6_000.0).unwrap().0;
        blower.heed(&note_on(0, 69));
        let (mut last, mut largest) = (low, 0);
        for at in (0..=GLIDE as usize).step_by(GRID as usize) {
            let now = blower.blow(&HAND, at, 200.0, 6_000.0).map_or(last, |breath| breath.0);
            (largest, last) = (now.abs_diff(last).max(largest), now);
        }
        let all = low.abs_diff(blower.blow(&HAND, 9_999, 200.0, 6_000.0).map_or(last, |breath| breath.0));
        assert!(all > 500 && u32::from(largest) < u32::from(all) / 15, "{largest} of {all}");
    }

    #[test]
    fn rest_is_quiet_though_the_hand_shakes() {
        let mut blower = Blower::default();
        let mut sent = 0;
        for n in 0..1_000 {
            let tremor_deg = 0.9 * f64::from(n).sin();
            sent += u32::from(blower.blow(&HAND, 0, tremor_deg, 6_000.0).is_some_and(|breath| breath.0 > 0));
        }
        assert_eq!(sent, 0);
        assert!(blower.blow(&HAND, 0, 3.0, 6_000.0).unwrap().0 > 0);
        assert!(blower.blow(&HAND, 0, 0.8, 6_000.0).unwrap().0 > 0, "breath ends later than it begins");
        assert_eq!(blower.blow(&HAND, 0, 0.2, 6_000.0), Some(Breath14(0)));
        assert_eq!(blower.blow(&HAND, 0, f64::NAN, 6_000.0), None, "what is no angle is no breath");
        assert_eq!(blower.fall_silent(), None);
    }

    #[test]
    fn a_knob_that_feels_nothing_reaches_full_blow_where_the_player_has_put_it() {
        let hand = BreathMapping {
            feels: false,
            design: KnobDesign { full_deg: 180.0, ..KnobDesign::default() },
            ..*HAND
        };
        let mut blower = Blower::default();
        let travel = hand.maps.pressure_pa(None, 180.0);
        let full = blower.blow(&hand, 0, 180.0, 6_000.0).unwrap();
        assert!((f64::from(full.unit()) - travel / 6_000.0).abs() < 1e-3);
        assert_eq!(blower.blow(&hand, 0, 500.0, 6_000.0), None, "full is full");
    }

    #[test]
    fn a_recording_of_the_controllers_is_the_breath() {
        let mut midi = MidiDecoder::new();
        midi.controller(0, 34, 1);
        for raw in (0..=16_383).step_by(7) {
            let (coarse, fine) = Breath14(raw).bytes();
            midi.controller(0, 2, coarse);
            let event = midi.controller(0, 34, fine);
            if raw > 0 {
                assert_eq!(event, [Event::Breath(Breath14(raw).unit())], "{raw}");
            }
        }
    }
}
