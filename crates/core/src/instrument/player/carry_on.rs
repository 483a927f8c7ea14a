//! A player goes on on another instrument.

use super::Player;
use super::fingers::Fingers;
use crate::bore::lattice::Real;
use crate::instrument::model::Model;
use crate::instrument::person::Person;
use crate::instrument::voice::Voice;

impl Player {
    /// Takes over keys, breath, lip and bend from the player of another instrument, as if the player had always held
    /// this one; the note has yet to speak. Keys that this instrument does not have are released. Holes that are held stay so where
    /// the other one, `before`, has the same holes. Settings stay. Real-time safe.
    pub fn carry_on<F: Real>(&mut self, from: &Self, before: &Model, model: &Model, voice: &mut Voice<F>) {
        let has_same = before.file.holes.iter().map(|hole| &hole.name).eq(model
            .file
            .holes
            .iter()
            .map(|hole| &hole.name));
        *self = Self {
            settings: self.settings,
            fingers: if has_same { from.fingers.lifted() } else { Fingers::default() },
            keys: from.keys,
            velocities: from.velocities,
            inflection: from.inflection.carried(),
            inhalation: from.inhalation,
            ..from.controlled(self.person)
        };
        if let Some(fingering) = self.take_up_last(model) {
            self.finger(fingering, false, model, voice);
            self.tongue.carry_on(&from.tongue);
        }
    }

    /// The player at rest, without keys. What controllers, key switches and fingers on trial have set stays: hosts silence everything
    /// wherever they stop, and a controller that rests does not say again where it is. Real-time safe.
    pub(super) fn silenced(&self) -> Self {
        Self { settings: self.settings, fingers: self.fingers.lifted(), ..self.controlled(self.person) }
    }

    /// A player at rest under the same controllers, breath sources and key switches.
    fn controlled(&self, person: Person) -> Self {
        Self {
            breath: self.breath.carried(),
            bend_cents: self.bend_cents,
            reed: self.reed,
            techniques: self.techniques.carried(&person),
            swaying: self.swaying.carried(&person),
            chosen: self.chosen,
            ..Self::new(person)
        }
    }

    /// Takes over breath, bend and controllers of another player, without keys. What plays goes on and follows them.
    /// Real-time safe.
    pub fn follow(&mut self, from: &Self) {
        self.breath.follow(&from.breath);
        self.bend_cents = from.bend_cents;
        self.reed = from.reed;
        self.techniques.follow(&from.techniques);
        self.swaying.swing.follow(&from.swaying.swing);
        self.chosen = from.chosen;
        self.fingers.follow(&from.fingers);
        self.posture = None;
    }
}

#[cfg(test)]
mod tests {
    use crate::event::Event;
    use crate::instrument::{Clarinet, Reach, Settings};
    use crate::units::SoundingNote;

    #[test]
    fn holes_on_trial_stay_on_trial_on_another_instrument_with_the_same_holes() {
        let [mut first, mut other] = [(); 2].map(|()| Clarinet::built_in(48_000.0).unwrap());
        first.apply(Event::TryHoles(Some(0b101)));
        other.carry_on(&first);
        other.apply(Event::NoteOn { note: SoundingNote(58), velocity: 0.7 });
        let mut sound = vec![0.0; 9_600];
        other.render(&mut sound);
        let open: Vec<usize> =
            (0..24).filter(|&hole| other.voice_mut().lattice().opening(hole) > 0.5).collect();
        assert_eq!(open, [0, 2]);
    }

    #[test]
    fn a_transposed_key_plays_its_note_on_the_other_instrument_too() {
        let [mut first, mut other] = [(); 2].map(|()| Clarinet::built_in(48_000.0).unwrap());
        // The lowest note is D3, 50: this key has no fingering of its own.
        let settings = Settings { reach: Reach { transpose: 12, ..Reach::default() }, ..Settings::default() };
        first.set_settings(&settings);
        other.set_settings(&settings);
        first.apply(Event::NoteOn { note: SoundingNote(46), velocity: 0.7 });
        other.carry_on(&first);
        let state = other.player_state();
        assert_eq!((state.key, state.sounding), (Some(SoundingNote(46)), Some(SoundingNote(58))));
    }
}
