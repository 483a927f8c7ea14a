//! The pitch of each key, where that is not equal temperament: a scale and how keys are mapped to it.

use crate::instrument::concert_pitch::A4_HZ;
use crate::units::{SoundingNote, cents};

/// Most by which scale and trim together move a note from equal temperament, cents: half a semitone.
pub const TRIM_MOST_CENTS: f64 = 50.0;

/// What a key plays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyPitch {
    /// Note of equal temperament that is nearest: its fingering plays the key.
    pub note: SoundingNote,
    /// Pitch of the key over that note, cents.
    pub cents: f64,
}

/// What every key plays. Equal temperament by default.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyPitches([Option<KeyPitch>; 128]);

impl Default for KeyPitches {
    fn default() -> Self {
        Self(std::array::from_fn(|key| Some(KeyPitch { note: SoundingNote(key as u8), cents: 0.0 })))
    }
}

impl KeyPitches {
    /// From the frequency of each key where A4 is 440 Hz; a key that has none plays nothing. Another A4 moves all of them by
    /// the same interval.
    ///
    /// ```
    /// use chalumeau_core::instrument::KeyPitches;
    /// use chalumeau_core::units::SoundingNote;
    ///
    /// // Quarter tones, with middle C where it was.
    /// let quarter_tones = KeyPitches::from_hz(|key| Some(261.6256 * ((f64::from(key) - 60.0) / 24.0).exp2()));
    /// let next = quarter_tones.of(SoundingNote(62)).unwrap();
    /// assert_eq!(next.note, SoundingNote(61));
    /// assert!(next.cents.abs() < 0.01);
    /// ```
    pub fn from_hz(hz: impl Fn(u8) -> Option<f64>) -> Self {
        Self(std::array::from_fn(|key| {
            let semitones =
                69.0 + 0.01 * cents(hz(key as u8).filter(|hz| hz.is_finite() && *hz > 0.0)?, A4_HZ);
            let note = semitones.round();
            let is_note = (0.0..128.0).contains(&note);
            is_note.then_some(KeyPitch { note: SoundingNote(note as u8), cents: 100.0 * (semitones - note) })
        }))
    }

    /// The same with every note moved by so many cents, whichever key plays it. No key comes to lie more than half a semitone
    /// beside its note.
    #[must_use]
    pub fn trimmed(&self, cents_of: impl Fn(SoundingNote) -> f64) -> Self {
        let trimmed = |KeyPitch { note, cents }| {
            let trim = Some(cents_of(note)).filter(|trim| trim.is_finite()).unwrap_or(0.0);
            KeyPitch { note, cents: (cents + trim).clamp(-TRIM_MOST_CENTS, TRIM_MOST_CENTS) }
        };
        Self(self.0.map(|key| key.map(trimmed)))
    }

    /// What a key plays; `None` if nothing. Real-time safe.
    pub fn of(&self, key: SoundingNote) -> Option<KeyPitch> {
        self.0.get(usize::from(key.0)).copied().flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_temperament_is_exact_and_absurd_pitches_play_nothing() {
        let equal = KeyPitches::from_hz(|key| Some(SoundingNote(key).frequency_hz(440.0)));
        for key in 0..128 {
            let pitch = equal.of(SoundingNote(key)).unwrap();
            assert_eq!(pitch.note.0, key);
            assert!(pitch.cents.abs() < 1e-9);
            assert_eq!(KeyPitches::default().of(SoundingNote(key)).unwrap().cents, 0.0);
        }
        let absurd =
            KeyPitches::from_hz(|key| [f64::NAN, 0.0, -1.0, 1e9, 1e-9].get(usize::from(key)).copied());
        assert!((0..128).all(|key| absurd.of(SoundingNote(key)).is_none()));
        assert_eq!(absurd.of(SoundingNote(200)), None);
    }

    #[test]
    fn a_trim_belongs_to_its_note() {
        let trimmed = KeyPitches::default().trimmed(|note| match note.0 {
            60 => 12.5,
            61 => -200.0,
            62 => f64::NAN,
            _ => 0.0,
        });
        let cents = |key| trimmed.of(SoundingNote(key)).unwrap().cents;
        assert_eq!([59, 60, 61, 62].map(cents), [0.0, 12.5, -50.0, 0.0]);
    }

    #[test]
    fn no_key_is_more_than_half_a_semitone_beside_its_note() {
        let thirds = KeyPitches::from_hz(|key| Some(20.0 * (f64::from(key) * 0.05).exp()));
        for pitch in (0..128).filter_map(|key| thirds.of(SoundingNote(key))) {
            assert!(pitch.cents.abs() <= 50.0 + 1e-9, "{pitch:?}");
        }
    }
}
