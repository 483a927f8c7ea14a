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
    /// From the clock of the readings to the time since `began`, s: the least that was seen, so that readings that come late, many
    /// at once, keep the times at which they were made.
    lead_s: f64,
    latest_s: f64,
}

impl Calibrator {
    pub(super) fn new() -> Self {
        Self {
            measurement: knob::Calibration::default(),
            began: Instant::now(),
            lead_s: f64::INFINITY,
            latest_s: 0.0,
        }
    }

    /// Begins to measure the rest angle.
    pub fn rest(&mut self) {
        self.lead_s = f64::INFINITY;
        self.measurement.rest();
    }

    /// Begins to measure the full-blow angle.
    pub fn blow(&mut self, design: &KnobDesign) {
        self.lead_s = f64::INFINITY;
        self.measurement.blow(design);
    }

    /// When a reading was made, or that nothing came until now: time since `began`, s, which never goes back.
    fn time_s(&mut self, made_us: Option<u64>) -> f64 {
        let now_s = self.began.elapsed().as_secs_f64();
        let at_s = made_us.map_or(now_s, |made_us| {
            let made_s = 1e-6 * made_us as f64;
            self.lead_s = self.lead_s.min(now_s - made_s);
            made_s + self.lead_s
        });
        self.latest_s = self.latest_s.max(at_s);
        self.latest_s
    }

    /// Takes one angle in degrees and when it was made, us, or `None` if the knob sent nothing. When the measurement ends, stores the result in the
    /// parameters and returns a message for the user. A knob that `feels` gets its zero at the new rest angle.
    pub fn tick(
        &mut self,
        reading: Option<(u64, f64)>,
        knob: &KnobParams,
        link: Option<&KnobLink>,
        feels: bool,
    ) -> Option<String> {
        let at_s = self.time_s(reading.map(|(made_us, _)| made_us));
        let taken = match self.measurement.tick(at_s, reading.map(|(_, angle_deg)| angle_deg))? {
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
