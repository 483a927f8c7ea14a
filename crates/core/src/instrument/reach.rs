//! Which note a key plays: transposed, and what becomes of keys outside the instrument's range.

use crate::control::key_switches::KeySwitches;
use crate::instrument::key_pitches::{KeyPitch, KeyPitches};
use crate::instrument::model::Model;
use crate::units::SoundingNote;

const OCTAVE: i16 = 12;
/// Octaves within which a note is looked for: MIDI has no more.
const OCTAVES: usize = 10;
/// Farthest transposition, semitones either way.
const TRANSPOSE_MOST: i32 = 24;

/// What a key outside the instrument's range plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Beyond {
    /// Nothing.
    #[default]
    Silent,
    /// The same note in the nearest octave that the instrument plays.
    Octave,
}

impl Beyond {
    /// All, in the order of the parameter that chooses one.
    pub const ALL: [Self; 2] = [Self::Silent, Self::Octave];
}

/// Which note each key plays, for what follows the keys of a player and is none: a knob, a measurement.
///
/// ```
/// use chalumeau_core::instrument::{KeyNotes, Model, Reach};
/// use chalumeau_core::units::SoundingNote;
///
/// let model = Model::built_in(48_000.0)?;
/// let notes = Reach { transpose: -2, ..Reach::default() }.key_notes(&model);
/// assert_eq!(notes.of(SoundingNote(60)), Some(SoundingNote(58)));
/// assert_eq!(notes.of(SoundingNote(20)), None, "the clarinet has no such note");
/// assert_eq!(KeyNotes::default().of(SoundingNote(20)), Some(SoundingNote(20)));
/// # Ok::<(), chalumeau_core::instrument::BuildError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeyNotes([Option<SoundingNote>; 128]);

impl Default for KeyNotes {
    /// Every key plays its own note.
    fn default() -> Self {
        Self(std::array::from_fn(|key| u8::try_from(key).ok().map(SoundingNote)))
    }
}

impl KeyNotes {
    /// The note that a key plays; `None` if it plays nothing. Real-time safe.
    pub fn of(&self, key: SoundingNote) -> Option<SoundingNote> {
        self.0.get(usize::from(key.0)).copied().flatten()
    }

    /// The keys that play a note, one bit each from key 0.
    pub fn playing(&self) -> u128 {
        (0..128).map(|key| u128::from(self.0[key].is_some()) << key).sum()
    }
}

/// Which note a key plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Reach {
    /// Semitones from the key to the note that sounds, -24..=24. Default 0.
    pub transpose: i32,
    /// What a key outside the instrument's range plays. Default [`Beyond::Silent`].
    pub beyond: Beyond,
    /// Keys that choose fingerings and play nothing. Default [`KeySwitches::Off`].
    pub key_switches: KeySwitches,
}

impl Reach {
    /// The same with a transposition inside its range.
    pub fn clamped(self) -> Self {
        Self { transpose: self.transpose.clamp(-TRANSPOSE_MOST, TRANSPOSE_MOST), ..self }
    }

    /// Index of the fingering that a key plays; `None` if it plays nothing. Real-time safe.
    ///
    /// ```
    /// use chalumeau_core::instrument::{Beyond, Model, Reach};
    /// use chalumeau_core::units::SoundingNote;
    ///
    /// let model = Model::built_in(48_000.0)?;
    /// // A C two octaves below the lowest C of the clarinet.
    /// let key = SoundingNote(36);
    /// assert_eq!(Reach::default().fingering(key, &model), None);
    /// let folded = Reach { beyond: Beyond::Octave, ..Reach::default() };
    /// assert_eq!(folded.fingering(key, &model), model.fingering_for(SoundingNote(60)));
    /// # Ok::<(), chalumeau_core::instrument::BuildError>(())
    /// ```
    pub fn fingering(self, key: SoundingNote, model: &Model) -> Option<usize> {
        self.find(key, &model.keys, |note| model.fingering_for(note)).map(|(_, fingering)| fingering)
    }

    /// The notes of all keys on an instrument. Real-time safe.
    pub fn key_notes(self, model: &Model) -> KeyNotes {
        self.key_notes_among(&model.keys, |note| model.fingering_for(note).is_some())
    }

    /// The same where `plays` knows which notes an instrument has, and `keys` what keys ask for.
    pub fn key_notes_among(self, keys: &KeyPitches, plays: impl Fn(SoundingNote) -> bool) -> KeyNotes {
        let of = |key| self.find(SoundingNote(key), keys, |note| plays(note).then_some(()));
        KeyNotes(std::array::from_fn(|key| {
            u8::try_from(key).ok().and_then(of).map(|(KeyPitch { note, .. }, _)| note)
        }))
    }

    /// What a key plays, and what `find` knows of its note, where `find` knows which notes an instrument plays. Real-time
    /// safe.
    pub fn find<T>(
        self,
        key: SoundingNote,
        keys: &KeyPitches,
        find: impl Fn(SoundingNote) -> Option<T>,
    ) -> Option<(KeyPitch, T)> {
        if self.key_switches.chosen(key.0).is_some() {
            return None;
        }
        let key = i32::from(key.0) + self.clamped().transpose;
        let KeyPitch { note, cents } = keys.of(SoundingNote(u8::try_from(key).ok()?))?;
        let wanted = i16::from(note.0);
        let at = |note: i16| {
            let note = SoundingNote(u8::try_from(note).ok().filter(|&note| note < 128)?);
            find(note).map(|found| (KeyPitch { note, cents }, found))
        };
        match self.beyond {
            Beyond::Silent => at(wanted),
            Beyond::Octave => (0..OCTAVES as i16)
                .flat_map(|octaves| [wanted - octaves * OCTAVE, wanted + octaves * OCTAVE])
                .find_map(at),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An instrument from 50 to 94 that lacks 90.
    fn plays(note: SoundingNote) -> Option<()> {
        ((50..=94).contains(&note.0) && note.0 != 90).then_some(())
    }

    fn note(transpose: i32, beyond: Beyond, key: u8) -> Option<u8> {
        let reach = Reach { transpose, beyond, ..Reach::default() };
        let found = reach.find(SoundingNote(key), &KeyPitches::default(), plays);
        found.map(|(pitch, ())| pitch.note.0)
    }

    #[test]
    fn a_key_is_transposed_and_silent_outside() {
        assert_eq!(note(0, Beyond::Silent, 60), Some(60));
        assert_eq!(note(-2, Beyond::Silent, 60), Some(58));
        assert_eq!(note(-24, Beyond::Silent, 60), None);
        assert_eq!(note(99, Beyond::Silent, 60), Some(84), "clamped");
        assert_eq!(note(24, Beyond::Silent, 120), None, "no such note");
        assert_eq!(note(-24, Beyond::Silent, 3), None);
    }

    #[test]
    fn key_switches_play_nothing_wherever_they_are() {
        let plays = |key_switches, key| {
            let reach = Reach { transpose: 24, beyond: Beyond::Octave, key_switches };
            reach.find(SoundingNote(key), &KeyPitches::default(), plays).is_some()
        };
        for key in 0..100 {
            assert!(plays(KeySwitches::Off, key));
            assert_eq!(plays(KeySwitches::C1, key), !(24..=28).contains(&key), "{key}");
            assert_eq!(plays(KeySwitches::C2, key), !(36..=40).contains(&key), "{key}");
        }
    }

    #[test]
    fn a_key_outside_plays_its_note_in_the_nearest_octave() {
        for key in 0..128 {
            let played = note(0, Beyond::Octave, key).unwrap();
            assert!(plays(SoundingNote(played)).is_some() && played % 12 == key % 12, "{key}: {played}");
            let nearer = i16::from(played) + if played < key { 12 } else { -12 };
            let is_between = (nearer - i16::from(key)).abs() < (i16::from(played) - i16::from(key)).abs();
            assert!(!is_between || u8::try_from(nearer).ok().and_then(|n| plays(SoundingNote(n))).is_none());
        }
        assert_eq!(note(0, Beyond::Octave, 90), Some(78), "it does not speak: the octave below does");
        assert_eq!(note(12, Beyond::Octave, 38), Some(50));
    }
}
