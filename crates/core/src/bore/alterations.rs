//! What a user changes on an instrument: holes moved, joints pulled.

use serde::{Deserialize, Serialize};

use super::instrument_file::InstrumentFile;
use super::moved_hole::MovedHole;
use super::pulled_joint::PulledJoint;

/// Changes to an instrument, in lengths of its file before any of them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Alterations {
    /// Tone holes elsewhere, wider or narrower.
    #[serde(rename = "moved")]
    pub holes: Vec<MovedHole>,
    /// Parts longer or shorter.
    #[serde(rename = "pulled")]
    pub joints: Vec<PulledJoint>,
}

impl Alterations {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.holes.is_empty() && self.joints.is_empty()
    }

    /// How many things they change.
    pub fn count(&self) -> usize {
        self.holes.len() + self.joints.len()
    }

    /// Names of what they change, holes before parts.
    pub fn names(&self) -> Vec<&str> {
        let holes = self.holes.iter().map(|hole| hole.name.as_str());
        holes.chain(self.joints.iter().map(|joint| joint.part.as_str())).collect()
    }
}

impl InstrumentFile {
    /// The instrument with these changes: holes first, which move with the joints above them.
    #[must_use]
    pub fn altered(&self, by: &Alterations) -> Self {
        self.with_holes_moved(&by.holes).with_joints_pulled(&by.joints)
    }
}
