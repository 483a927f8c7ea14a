//! Turns a knob's angle into breath, note by note.
//!
//! Breath goes out on a grid of samples counted from the start, so that it does not depend on the host's blocks, and in
//! the steps of a 14-bit controller, so that a host that records it plays the very same breath back. A new note takes over the
//! pressure that the hand blows with (`carry`).

mod carry;

use crate::touch::angle::{KnobBreath, KnobDesign};
use crate::touch::breath_from_angle::carry::Carry;
use crate::touch::feel::PitchMaps;
use chalumeau_core::control::keys::Keys;
use chalumeau_core::event::{Event, Played, Timed};
use chalumeau_core::instrument::KeyNotes;
use chalumeau_core::units::SoundingNote;

/// Samples between two values of breath: 1.3 ms at 48 kHz, a quarter of the time the player's breath takes to follow.
pub const GRID: u64 = 64;
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
    /// Which note each key plays.
    notes: KeyNotes,
    keys: Keys,
    fingered: Option<SoundingNote>,
    /// The note whose map made the latest breath, once a note has been fingered.
    blown: Option<SoundingNote>,
    carry: Carry,
    blowing: bool,
    unfelt: Option<KnobBreath>,
    sent: Option<Breath14>,
    /// Samples since the start.
    clock: u64,
}

impl Blower {
    /// Returns to the initial state; keys play the same notes as before.
    pub fn reset(&mut self) {
        *self = Self { notes: self.notes, ..Self::default() };
    }

    /// Which note each key plays from now on; at first its own.
    pub fn set_notes(&mut self, notes: KeyNotes) {
        self.notes = notes;
    }

    /// Takes notice of an event of the block that begins now. A key that plays nothing changes nothing, as for the player.
    pub fn heed(&mut self, event: &Timed<Event>) {
        match event.event {
            Event::NoteOn { note, .. } if self.notes.of(note).is_none() => return,
            Event::NoteOn { note, .. } => _ = self.keys.press(note),
            Event::NoteOff { note } | Event::Choke { note } => self.keys.release(note),
            Event::Panic => self.keys = Keys::default(),
            _ => return,
        }
        self.fingered = self.keys.last().and_then(|key| self.notes.of(key)).or(self.fingered);
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

    /// Breath at a knob angle, degrees; `None` if it has not changed. `full_pa` is the mouth pressure of full breath, Pa.
    pub fn blow(&mut self, hand: &BreathMapping, angle_deg: f64, full_pa: f64) -> Option<Breath14> {
        let angle_deg =
            if hand.feels { self.beyond_rest(hand, angle_deg) } else { self.unfelt(hand, angle_deg) };
        if self.fingered != self.blown {
            // Before the first note nothing sounded, and while no breath is sent none can be taken over.
            if let (Some(before), Some(_)) = (self.blown, self.sent) {
                let pressure_pa = hand.maps.pressure_pa(Some(before), self.carry.effective_deg(angle_deg));
                self.carry = Carry::new(angle_deg, hand.maps.angle_deg(self.fingered, pressure_pa));
            }
            self.blown = self.fingered;
        }
        let pressure_pa = hand.maps.pressure_pa(self.fingered, self.carry.effective_deg(angle_deg));
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
        self.carry = Carry::default();
        self.sent.take().filter(|&sent| sent != Breath14(0)).map(|_| Breath14(0))
    }
}

/// Iterator over the host's events in order of time, with the knob's breath between them. Of several players, the first one's
/// note makes a pressure of the angle, and all blow it.
pub struct BlownEvents<'a, E: Played, I: Iterator<Item = Timed<E>>, A: FnMut(usize) -> Option<f64>> {
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

impl<'a, E: Played, I: Iterator<Item = Timed<E>>, A: FnMut(usize) -> Option<f64>> BlownEvents<'a, E, I, A> {
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

impl<E: Played, I: Iterator<Item = Timed<E>>, A: FnMut(usize) -> Option<f64>> Iterator
    for BlownEvents<'_, E, I, A>
{
    type Item = Timed<E>;

    fn next(&mut self) -> Option<Timed<E>> {
        loop {
            let until = if self.next < self.samples { self.next } else { usize::MAX };
            if let Some(event) = self.host.next_if(|event| event.at <= until) {
                if let Some(first) = event.event.of_first() {
                    self.blower.heed(&Timed { at: event.at, event: first });
                }
                // One breath at a time: while the knob blows, nothing else does, keys without breath neither.
                if !matches!(event.event.event(), Event::Breath(_) | Event::BreathFromKeys) {
                    return Some(event);
                }
                continue;
            }
            let at = self.next;
            if at >= self.samples {
                return None;
            }
            self.next = at + GRID as usize;
            let blown = (self.angle)(at).and_then(|angle| self.blower.blow(self.hand, angle, self.full_pa));
            if let Some(breath) = blown {
                (self.heard)(at, breath);
                return Some(Timed { at, event: Event::Breath(breath.unit()).into() });
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
    use chalumeau_core::instrument::{Model, Reach, Settings};
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
    fn the_hand_follows_the_note_that_a_key_plays() {
        let model = Model::built_in(48_000.0).unwrap();
        let mut blower = Blower::default();
        blower.set_notes(Reach { transpose: -2, ..Reach::default() }.key_notes(&model));
        blower.heed(&note_on(0, 60));
        assert_eq!(blower.fingered(), Some(SoundingNote(58)));
        // The clarinet has no such note: the player goes on with the one before.
        blower.heed(&note_on(0, 40));
        assert_eq!(blower.fingered(), Some(SoundingNote(58)));
        blower.heed(&note_on(0, 64));
        blower.heed(&Timed { at: 0, event: Event::NoteOff { note: SoundingNote(64) } });
        assert_eq!(blower.fingered(), Some(SoundingNote(58)));
        blower.reset();
        blower.heed(&note_on(0, 60));
        assert_eq!(blower.fingered(), Some(SoundingNote(58)));
    }

    #[test]
    fn each_note_makes_its_own_pressure_of_the_angle() {
        let full_pa = 6_000.0;
        let blown = |note: u8| {
            let mut blower = Blower::default();
            blower.heed(&note_on(0, note));
            blower.blow(&HAND, 200.0, full_pa).unwrap().unit()
        };
        // Sounding G4 needs less than sounding A5 (clarion): at one angle it is blown harder.
        assert!(
            (f64::from(blown(65)) - HAND.maps.pressure_pa(Some(SoundingNote(65)), 200.0) / full_pa).abs()
                < 1e-4
        );
        assert!(blown(65) > blown(69), "{} {}", blown(65), blown(69));
    }

    /// Written A4 and B4, across the break: easy and hard.
    const SLUR: [u8; 2] = [67, 69];

    fn hand(place: f64) -> BreathMapping {
        let feels = InstrumentFeel::built_in().unwrap();
        let design = FeelDesign { place, ..FeelDesign::default() };
        let table = feels.table(&Settings::default(), &design, &NO_MOTOR).unwrap();
        BreathMapping { maps: feels.maps(&table), ..*HAND }
    }

    /// A blower that blew the first note of [`SLUR`] at an angle and now blows the second, and the breath of the first.
    fn slurred(hand: &BreathMapping, angle_deg: f64) -> (Blower, f64) {
        let mut blower = Blower::default();
        blower.heed(&note_on(0, SLUR[0]));
        let before = f64::from(blower.blow(hand, angle_deg, 6_000.0).unwrap().unit());
        blower.heed(&note_on(0, SLUR[1]));
        blower.blow(hand, angle_deg, 6_000.0);
        (blower, before)
    }

    #[test]
    fn a_still_hand_keeps_its_pressure_at_any_place() {
        for place in [1.0, 3.0, 5.0] {
            let hand = hand(place);
            for angle_deg in [20.0, 130.0, 180.0, 300.0] {
                let (mut blower, before) = slurred(&hand, angle_deg);
                for n in 0..2_000 {
                    let tremor_deg = 0.3 * f64::from(n).sin();
                    let Some(now) = blower.blow(&hand, angle_deg + tremor_deg, 6_000.0) else { continue };
                    let off = f64::from(now.unit()) - before;
                    assert!(off.abs() < 0.01, "Place {place}, {angle_deg} degrees: {off}");
                }
                // There and back again it is the same pressure.
                blower.heed(&Timed { at: 0, event: Event::NoteOff { note: SoundingNote(SLUR[1]) } });
                let back = blower.blow(&hand, angle_deg, 6_000.0).map_or(before, |now| f64::from(now.unit()));
                assert!((back - before).abs() < 0.01, "{back} {before}");
            }
        }
    }

    #[test]
    fn a_hand_that_has_moved_blows_the_notes_own_map() {
        let (hand, full_pa) = (hand(3.0), 6_000.0);
        let own = |angle_deg: f64| hand.maps.pressure_pa(Some(SoundingNote(SLUR[1])), angle_deg) / full_pa;
        let (blower, before) = slurred(&hand, 150.0);
        assert!(before - own(150.0) > 0.05, "the second note is the harder one: {before}");
        let caught_deg = hand.maps.angle_deg(Some(SoundingNote(SLUR[1])), before * full_pa);
        for (to_deg, step_deg) in [(caught_deg + 40.0, 0.5), (2.0, -0.5), (60.0, -40.0), (caught_deg, 90.0)] {
            let (mut blower, mut angle_deg, mut last) = (blower.clone(), 150.0_f64, before);
            while (angle_deg - to_deg).abs() > 1e-9 {
                angle_deg += (to_deg - angle_deg).clamp(-f64::abs(step_deg), f64::abs(step_deg));
                let now = blower.blow(&hand, angle_deg, full_pa).map_or(last, |now| f64::from(now.unit()));
                assert!((now - last) * step_deg >= -1e-4, "turning {step_deg} at {angle_deg}: {last} {now}");
                last = now;
            }
            assert!((last - own(to_deg)).abs() < 1e-3, "{to_deg}: {last} {}", own(to_deg));
        }
        // On the way to where the note has this pressure nothing changes.
        let mut blower = blower;
        let halfway_deg = 0.5 * (150.0 + caught_deg);
        let halfway = blower.blow(&hand, halfway_deg, full_pa).map_or(before, |now| f64::from(now.unit()));
        assert!((halfway - before).abs() < 1e-3, "{halfway} {before}");
    }

    #[test]
    fn a_note_that_follows_no_breath_takes_nothing_over() {
        let hand = hand(3.0);
        let own = hand.maps.pressure_pa(Some(SoundingNote(SLUR[1])), 150.0) / 6_000.0;
        let mut at_rest = Blower::default();
        at_rest.heed(&note_on(0, SLUR[0]));
        at_rest.blow(&hand, 0.0, 6_000.0);
        at_rest.heed(&note_on(0, SLUR[1]));
        at_rest.blow(&hand, 0.0, 6_000.0);
        let (mut unplugged, _) = slurred(&hand, 150.0);
        unplugged.fall_silent();
        for mut blower in [at_rest, unplugged] {
            let blown = f64::from(blower.blow(&hand, 150.0, 6_000.0).unwrap().unit());
            assert!((blown - own).abs() < 1e-4, "{blown} {own}");
        }
    }

    #[test]
    fn rest_is_quiet_though_the_hand_shakes() {
        let mut blower = Blower::default();
        let mut sent = 0;
        for n in 0..1_000 {
            let tremor_deg = 0.9 * f64::from(n).sin();
            sent += u32::from(blower.blow(&HAND, tremor_deg, 6_000.0).is_some_and(|breath| breath.0 > 0));
        }
        assert_eq!(sent, 0);
        assert!(blower.blow(&HAND, 3.0, 6_000.0).unwrap().0 > 0);
        assert!(blower.blow(&HAND, 0.8, 6_000.0).unwrap().0 > 0, "breath ends later than it begins");
        assert_eq!(blower.blow(&HAND, 0.2, 6_000.0), Some(Breath14(0)));
        assert_eq!(blower.blow(&HAND, f64::NAN, 6_000.0), None, "what is no angle is no breath");
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
        let full = blower.blow(&hand, 180.0, 6_000.0).unwrap();
        assert!((f64::from(full.unit()) - travel / 6_000.0).abs() < 1e-3);
        assert_eq!(blower.blow(&hand, 500.0, 6_000.0), None, "full is full");
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
