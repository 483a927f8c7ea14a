//! Tone holes that the user has moved. A project keeps them.

use std::sync::{Arc, PoisonError, RwLock};

use nice_plug::params::persist::PersistentField;
use serde::{Deserialize, Serialize};

use chalumeau_core::bore::moved_hole::MovedHole;

/// Most holes that a project keeps: more than any instrument has.
const HOLES_MOST: usize = 64;

/// Moved holes as a project keeps them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SavedHoles {
    /// The instrument that they belong to, see [`InstrumentParams::key`](super::InstrumentParams::key).
    pub instrument: String,
    /// Its moved holes.
    pub moved: Vec<MovedHole>,
}

/// The moved holes of one plugin instance.
#[derive(Debug, Default)]
pub struct HolesField(RwLock<(String, Arc<Vec<MovedHole>>)>);

impl HolesField {
    /// The moved holes of an instrument.
    pub fn of(&self, instrument: &str) -> Arc<Vec<MovedHole>> {
        let kept = self.0.read().unwrap_or_else(PoisonError::into_inner);
        if kept.0 == instrument { kept.1.clone() } else { Arc::default() }
    }

    /// Moves the holes of an instrument. Those of another instrument go back.
    pub fn put(&self, instrument: String, moved: Vec<MovedHole>) {
        let moved: Vec<_> = moved
            .into_iter()
            .filter(|hole| hole.x_m.is_finite() && hole.radius_m.is_finite())
            .take(HOLES_MOST)
            .collect();
        *self.0.write().unwrap_or_else(PoisonError::into_inner) = (instrument, Arc::new(moved));
    }
}

impl PersistentField<'_, SavedHoles> for HolesField {
    fn set(&self, SavedHoles { instrument, moved }: SavedHoles) {
        self.put(instrument, moved);
    }

    fn map<F, R>(&self, f: F) -> R
    where
        F: Fn(&SavedHoles) -> R,
    {
        let (instrument, moved) = self.0.read().unwrap_or_else(PoisonError::into_inner).clone();
        f(&SavedHoles { instrument, moved: moved.to_vec() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_belong_to_their_instrument_and_a_project_keeps_them() {
        let (field, again) = (HolesField::default(), HolesField::default());
        let hole = |x_m| MovedHole { name: "F".to_owned(), x_m, radius_m: 3e-3 };
        field.put("bflat".to_owned(), vec![hole(0.2), hole(f64::NAN)]);
        assert_eq!(*field.of("bflat"), [hole(0.2)]);
        assert!(field.of("a").is_empty());
        let text = field.map(|saved| serde_json::to_string(saved).unwrap());
        again.set(serde_json::from_str(&text).unwrap());
        assert_eq!(again.of("bflat"), field.of("bflat"));
        again.set(serde_json::from_str("{}").unwrap());
        assert!(again.of("bflat").is_empty());
    }
}
