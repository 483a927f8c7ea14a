//! Calibrates rest and full blow from the knob's angles.

use std::time::Instant;

use super::feel_design::knob_design;
use crate::plugin::params::KnobParams;
use crate::plugin::params::knob::SavedCalibration;
use chalumeau_core::control::knob::{self, KnobDesign, Taken};
use chalumeau_knob::device::KnobLink;

/// The measurement of *Rest here* or *Blow hard here*.
pub struct Calibrator {
    measurement: knob::Calibration,
    began: Instant,
}

impl Calibrator {
    pub(super) fn new() -> Self {
        Self { measurement: knob::Calibration::default(), began: Instant::now() }
    }

    /// Begins to measure the rest angle.
    pub fn rest(&mut self) {
        self.measurement.rest();
    }

    /// Begins to measure the full-blow angle.
    pub fn blow(&mut self, design: &KnobDesign) {
        self.measurement.blow(design);
    }

    /// Takes one angle, or `None` if the knob sent nothing. When the measurement ends, stores the result in the
    /// parameters and returns a message for the user. A knob that `feels` gets its zero at the new rest angle.
    pub fn tick(
        &mut self,
        angle_deg: Option<f64>,
        knob: &KnobParams,
        link: Option<&KnobLink>,
        feels: bool,
    ) -> Option<String> {
        let taken = match self.measurement.tick(self.began.elapsed().as_secs_f64(), angle_deg)? {
            Ok(taken) => taken,
            Err(reason) => return Some(reason.to_string()),
        };
        let mut design = taken.applied_to(knob_design(knob));
        if let (Taken::Rest { .. }, Some(link), true) = (taken, link, feels) {
            // The torque law counts its angles from the knob's own zero.
            link.zero();
            (design.zero_deg, design.full_deg) = (0.0, design.full_deg - design.zero_deg);
        }
        let measured = SavedCalibration::of(&design);
        if let Ok(mut calibration) = knob.calibration.write() {
            *calibration = measured;
        }
        let SavedCalibration { travel_deg, dead_deg, .. } = measured;
        Some(match taken {
            Taken::Rest { .. } => format!("rest is set; breath begins {:.1} degrees from here", dead_deg.0),
            Taken::Blow { .. } => format!("full blow is {travel_deg:.0} degrees from rest"),
        })
    }
}
