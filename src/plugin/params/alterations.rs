//! Holes that the user has moved and joints that the user has pulled. A project keeps them.

use std::sync::{Arc, PoisonError, RwLock};

use nice_plug::params::persist::PersistentField;
use serde::{Deserialize, Serialize};

use chalumeau_core::bore::alterations::Alterations;

/// Most holes, and most joints, that a project keeps: more than any instrument has.
const MOST: usize = 64;

/// Alterations as a project keeps them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SavedAlterations {
    /// The instrument that they belong to, see [`InstrumentParams::key`](super::InstrumentParams::key).
    pub instrument: String,
    /// What is altered.
    #[serde(flatten)]
    pub alterations: Alterations,
}

/// The alterations of one plugin instance.
#[derive(Debug, Default)]
pub struct AlterationsField(RwLock<(String, Arc<Alterations>)>);

impl AlterationsField {
    /// What is altered on an instrument.
    pub fn of(&self, instrument: &str) -> Arc<Alterations> {
        let kept = self.0.read().unwrap_or_else(PoisonError::into_inner);
        if kept.0 == instrument { kept.1.clone() } else { Arc::default() }
    }

    /// Alters an instrument. Another one is as built again.
    pub fn put(&self, instrument: String, Alterations { mut holes, mut joints }: Alterations) {
        holes.retain(|hole| hole.x_m.is_finite() && hole.radius_m.is_finite());
        joints.retain(|joint| joint.by_m.is_finite());
        holes.truncate(MOST);
        joints.truncate(MOST);
        *self.0.write().unwrap_or_else(PoisonError::into_inner) =
            (instrument, Arc::new(Alterations { holes, joints }));
    }
}

impl PersistentField<'_, SavedAlterations> for AlterationsField {
    fn set(&self, SavedAlterations { instrument, alterations }: SavedAlterations) {
        self.put(instrument, alterations);
    }

    fn map<F, R>(&self, f: F) -> R
    where
        F: Fn(&SavedAlterations) -> R,
    {
        let (instrument, alterations) = self.0.read().unwrap_or_else(PoisonError::into_inner).clone();
        f(&SavedAlterations { instrument, alterations: Arc::unwrap_or_clone(alterations) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::bore::moved_hole::MovedHole;
    use chalumeau_core::bore::pulled_joint::PulledJoint;

    #[test]
    fn alterations_belong_to_their_instrument_and_a_project_keeps_them() {
        let (field, again) = (AlterationsField::default(), AlterationsField::default());
        let hole = |x_m| MovedHole { name: "F".to_owned(), x_m, radius_m: 3e-3 };
        let joint = |by_m| PulledJoint { part: "barrel".to_owned(), by_m };
        let given = Alterations {
            holes: vec![hole(0.2), hole(f64::NAN)],
            joints: vec![joint(f64::NAN), joint(1e-3)],
        };
        field.put("bflat".to_owned(), given);
        assert_eq!(*field.of("bflat"), Alterations { holes: vec![hole(0.2)], joints: vec![joint(1e-3)] });
        assert!(field.of("a").is_empty());
        let text = field.map(|saved| serde_json::to_string(saved).unwrap());
        again.set(serde_json::from_str(&text).unwrap());
        assert_eq!(again.of("bflat"), field.of("bflat"));
        // As a project was saved before joints could be pulled.
        let before = r#"{"instrument":"bflat","moved":[{"name":"F","x_m":0.2,"radius_m":0.003}]}"#;
        again.set(serde_json::from_str(before).unwrap());
        assert_eq!(*again.of("bflat"), Alterations { holes: vec![hole(0.2)], joints: Vec::new() });
        again.set(serde_json::from_str("{}").unwrap());
        assert!(again.of("bflat").is_empty());
    }
}
