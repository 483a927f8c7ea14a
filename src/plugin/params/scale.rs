//! The scale that keys play. A project keeps the texts of its files, so that it sounds the same where the files are not.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, PoisonError, RwLock};

use nice_plug::params::persist::PersistentField;
use serde::{Deserialize, Serialize};

use crate::plugin::mts_esp::ReceivedTuning;
use crate::scale_file::{self, ScaleFault};
use chalumeau_core::instrument::KeyPitches;
use chalumeau_core::instrument::key_pitches::TRIM_MOST_CENTS;

/// Longest text that a project keeps, bytes; a scale of a thousand notes is shorter.
const BYTES_MOST: usize = 64 << 10;

/// A scale as a project keeps it; equal temperament without a text.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct SavedScale {
    /// Name of its file.
    pub name: String,
    /// Text of the scale, in Scala's format `.scl`.
    pub scl: String,
    /// Name of the file of the keyboard mapping; empty without one.
    pub mapping_name: String,
    /// Text of the keyboard mapping, in Scala's format `.kbm`; empty without one.
    pub kbm: String,
    /// Whether the keys of equal temperament leave the tuning of a tuning program alone, see
    /// [`mts_esp`](crate::plugin::mts_esp).
    pub ignores_tuning_program: bool,
    /// Tenths of a cent that a sounding note lies above its pitch in the scale.
    pub trims: Trims,
}

/// Tenths of a cent by sounding note.
pub type Trims = BTreeMap<u8, i16>;

/// Largest trim, tenths of a cent.
pub const TRIM_MOST: i16 = (10.0 * TRIM_MOST_CENTS) as i16;

impl SavedScale {
    /// What every key plays.
    fn key_pitches(&self) -> Result<KeyPitches, ScaleFault> {
        if self.scl.is_empty() {
            return Ok(KeyPitches::default());
        }
        scale_file::key_pitches(&self.scl, (!self.kbm.is_empty()).then_some(&self.kbm))
    }

    /// The same if it can be used, else equal temperament.
    pub fn mended(self) -> Self {
        let is_short = self.scl.len().max(self.kbm.len()) <= BYTES_MOST && self.name.len() <= 1_024;
        let mut mended = if is_short && self.key_pitches().is_ok() { self } else { self.equal() };
        mended.trims.retain(|&note, trim| note < 128 && *trim != 0);
        for trim in mended.trims.values_mut() {
            *trim = (*trim).clamp(-TRIM_MOST, TRIM_MOST);
        }
        mended
    }

    /// Equal temperament, with the same trims and the same attitude to tuning programs.
    pub fn equal(self) -> Self {
        let Self { ignores_tuning_program, trims, .. } = self;
        Self { ignores_tuning_program, trims, ..Self::default() }
    }

    /// `keys` with the trims.
    fn trimmed(&self, keys: &KeyPitches) -> KeyPitches {
        keys.trimmed(|note| 0.1 * f64::from(self.trims.get(&note.0).copied().unwrap_or(0)))
    }

    /// What lists show.
    pub fn title(&self) -> String {
        match (self.scl.is_empty(), self.kbm.is_empty()) {
            (true, _) => "Equal temperament".to_owned(),
            (false, true) => self.name.clone(),
            (false, false) => format!("{} with {}", self.name, self.mapping_name),
        }
    }

    /// The same with the scale or keyboard mapping of a file in it. The error is a message for the user.
    pub fn with_file(self, path: &Path) -> Result<Self, String> {
        let text = scale_file::text(path).map_err(|error| error.to_string())?;
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        if text.len() > BYTES_MOST {
            return Err(format!("{name} has {} bytes; a project keeps at most {BYTES_MOST}", text.len()));
        }
        let is_mapping = path.extension().is_some_and(|end| end.eq_ignore_ascii_case("kbm"));
        let scale = match is_mapping {
            true if self.scl.is_empty() => {
                return Err(format!("{name} maps the keys to a scale; open a scale (.scl) first"));
            }
            true => Self { mapping_name: name.clone(), kbm: text, ..self },
            false => Self { name: name.clone(), scl: text, ..self.equal() },
        };
        match scale.key_pitches() {
            Ok(_) => Ok(scale),
            Err(fault) => Err(format!("{name}: {}", fault.what)),
        }
    }
}

/// The scale of one plugin instance.
#[derive(Debug, Default)]
pub struct ScaleField {
    own: RwLock<(SavedScale, Arc<KeyPitches>)>,
    /// What a tuning program says, which no project keeps.
    received: RwLock<Option<ReceivedTuning>>,
}

impl ScaleField {
    /// The scale as it is saved.
    pub fn saved(&self) -> SavedScale {
        self.own.read().unwrap_or_else(PoisonError::into_inner).0.clone()
    }

    /// What lists show.
    pub fn title(&self) -> String {
        match self.followed() {
            Some(received) => format!("MTS-ESP: {}", received.name),
            None => self.own.read().unwrap_or_else(PoisonError::into_inner).0.title(),
        }
    }

    /// What every key plays.
    pub fn key_pitches(&self) -> Arc<KeyPitches> {
        match self.followed() {
            Some(received) => {
                let own = self.own.read().unwrap_or_else(PoisonError::into_inner);
                if own.0.trims.is_empty() { received.keys } else { Arc::new(own.0.trimmed(&received.keys)) }
            }
            None => self.own.read().unwrap_or_else(PoisonError::into_inner).1.clone(),
        }
    }

    /// The tuning of a tuning program, where the keys follow it: a scale of the user's own comes first.
    fn followed(&self) -> Option<ReceivedTuning> {
        let own = self.own.read().unwrap_or_else(PoisonError::into_inner);
        if !own.0.scl.is_empty() || own.0.ignores_tuning_program {
            return None;
        }
        self.received.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Whether a tuning program runs; `Some(true)` if the keys are to follow it where they have no scale of their own.
    pub fn follows_tuning_program(&self) -> Option<bool> {
        let own = self.own.read().unwrap_or_else(PoisonError::into_inner);
        let received = self.received.read().unwrap_or_else(PoisonError::into_inner);
        received.as_ref().map(|_| !own.0.ignores_tuning_program)
    }

    /// The trims of notes.
    pub fn trims(&self) -> Trims {
        self.own.read().unwrap_or_else(PoisonError::into_inner).0.trims.clone()
    }

    /// What a tuning program says now; `None` if none runs.
    pub fn receive(&self, tuning: Option<ReceivedTuning>) {
        *self.received.write().unwrap_or_else(PoisonError::into_inner) = tuning;
    }

    /// Another scale; one that cannot be used is equal temperament.
    pub fn put(&self, scale: SavedScale) {
        let scale = scale.mended();
        let pitches = scale.trimmed(&scale.key_pitches().unwrap_or_default());
        *self.own.write().unwrap_or_else(PoisonError::into_inner) = (scale, Arc::new(pitches));
    }
}

impl PersistentField<'_, SavedScale> for ScaleField {
    fn set(&self, scale: SavedScale) {
        self.put(scale);
    }

    fn map<F, R>(&self, f: F) -> R
    where
        F: Fn(&SavedScale) -> R,
    {
        f(&self.saved())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::units::SoundingNote;
    use std::fs;

    #[test]
    fn a_project_keeps_scale_and_mapping_and_what_is_damaged_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, text: &str| {
            let path = folder.path().join(name);
            fs::write(&path, text).unwrap();
            path
        };
        let scl = file("fifths.scl", "pure fifths\n1\n3/2\n");
        let kbm = file("from_a.KBM", "0\n0\n127\n69\n69\n440.0\n0\n");
        let refused = SavedScale::default().with_file(&kbm).unwrap_err();
        assert!(refused.contains("open a scale"), "{refused}");
        let scale = SavedScale::default().with_file(&scl).unwrap();
        assert_eq!(scale.title(), "fifths.scl");
        let both = scale.clone().with_file(&kbm).unwrap();
        assert_eq!(both.title(), "fifths.scl with from_a.KBM");
        let field = ScaleField::default();
        assert_eq!(*field.key_pitches(), KeyPitches::default());
        field.put(both.clone());
        assert_eq!(field.key_pitches().of(SoundingNote(70)).unwrap().note, SoundingNote(76));
        let text = serde_json::to_string(&field.saved()).unwrap();
        assert_eq!(serde_json::from_str::<SavedScale>(&text).unwrap().mended(), both);

        let damaged = file("damaged.scl", "three\n3\n100.0\nhundred\n");
        let refused = both.clone().with_file(&damaged).unwrap_err();
        assert!(refused.contains("damaged.scl: line 4"), "{refused}");
        let refused = both.clone().with_file(&folder.path().join("none.scl")).unwrap_err();
        assert!(refused.contains("none.scl"), "{refused}");
        let long = file("long.scl", &format!("{}\n1\n2/1\n", "x".repeat(BYTES_MOST)));
        assert!(both.with_file(&long).unwrap_err().contains("bytes"));
        let broken = SavedScale { scl: "rubbish".to_owned(), ..scale };
        assert_eq!(broken.mended(), SavedScale::default());
    }

    #[test]
    fn trims_outlive_the_scale_and_add_to_it() {
        let field = ScaleField::default();
        let trims = Trims::from([(60, 125), (61, 0), (62, 9_000), (200, 10)]);
        field.put(SavedScale { trims, ..SavedScale::default() });
        assert_eq!(field.trims(), Trims::from([(60, 125), (62, 500)]));
        let cents = |field: &ScaleField, key| field.key_pitches().of(SoundingNote(key)).unwrap().cents;
        assert_eq!([60, 61, 62].map(|key| cents(&field, key)), [12.5, 0.0, 50.0]);
        let text = serde_json::to_string(&field.saved().equal()).unwrap();
        field.put(serde_json::from_str(&text).unwrap());
        assert_eq!(cents(&field, 60), 12.5);
        // A tuning program's pitches are trimmed too.
        let keys = KeyPitches::from_hz(|key| Some(SoundingNote(key).frequency_hz(440.0) * 1.001));
        field.receive(Some(ReceivedTuning { name: "high".to_owned(), keys: Arc::new(keys.clone()) }));
        assert_eq!(cents(&field, 60), keys.of(SoundingNote(60)).unwrap().cents + 12.5);
        assert_eq!(field.title(), "MTS-ESP: high");
        field.put(SavedScale { ignores_tuning_program: true, ..field.saved() });
        assert_eq!((cents(&field, 61), field.follows_tuning_program()), (0.0, Some(false)));
    }
}
