//! Calibrates rest and full blow from the knob's angles.

use std::time::Instant;

use super::feel_design::knob_design;
use crate::plugin::params::KnobParams;
use crate::plugin::params::knob::SavedCalibration;
use chalumeau_knob::device::{KnobLink, LinkStatus};
use chalumeau_knob::touch::angle::{self, KnobDesign, Taken};

/// When it was made, us on any clock, and the angle, degrees.
pub type Reading = (u64, f64);

/// How long a knob has to show its new zero, s: ZERO is said for 0.2 s, and may wait 0.5 s for an end of torque.
const SHOWN_WITHIN_S: f64 = 1.5;

/// A rest that counts once the knob shows its new zero.
struct Awaited {
    measured: SavedCalibration,
    text: String,
    /// Zeros that the knob had taken before.
    zeros: u32,
    until_s: f64,
}

/// The measurement of *Rest here* or *Blow hard here*.
pub struct Calibrator {
    measurement: angle::Calibration,
    began: Instant,
    /// From the clock of the readings to the time since `began`, s: the least that was seen, so that readings that come late, many
    /// at once, keep the times at which they were made.
    lead_s: f64,
    latest_s: f64,
    awaited: Option<Awaited>,
}

impl Calibrator {
    pub(super) fn new() -> Self {
        Self {
            measurement: angle::Calibration::default(),
            began: Instant::now(),
            lead_s: f64::INFINITY,
            latest_s: 0.0,
            awaited: None,
        }
    }

    /// Whether it measures, or waits for the knob's new zero.
    pub fn is_busy(&self) -> bool {
        self.awaited.is_some() || self.measurement.progress(self.latest_s).is_some()
    }

    /// Begins to measure the rest angle.
    pub fn rest(&mut self) {
        self.awaited = None;
        self.lead_s = f64::INFINITY;
        self.measurement.rest();
    }

    /// Begins to measure the full-blow angle.
    pub fn blow(&mut self, design: &KnobDesign) {
        self.awaited = None;
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

    /// Takes one reading, or `None` if the knob sent nothing. When the measurement ends, stores the result in the parameters and
    /// returns a message for the user. A knob that feels gets its zero at the new rest angle, and the rest counts when the knob
    /// shows it.
    pub fn tick(
        &mut self,
        reading: Option<Reading>,
        knob: &KnobParams,
        link: Option<&KnobLink>,
        status: Option<&LinkStatus>,
    ) -> Option<String> {
        let at_s = self.time_s(reading.map(|(made_us, _)| made_us));
        if let Some(text) = self.seen(status, knob) {
            return Some(text);
        }
        let taken = match self.measurement.tick(at_s, reading.map(|(_, angle_deg)| angle_deg))? {
            Ok(taken) => taken,
            Err(reason) => return Some(reason.to_string()),
        };
        let mut design = taken.applied_to(knob_design(knob));
        let SavedCalibration { travel_deg, dead_deg, .. } = SavedCalibration::of(&design);
        let text = match taken {
            Taken::Rest { .. } => format!("rest is set; breath begins {:.1} degrees from here", dead_deg.0),
            Taken::Blow { .. } => format!("full blow is {travel_deg:.0} degrees from rest"),
        };
        let felt = status.filter(|status| status.tier > 0);
        if let (Taken::Rest { .. }, Some(link), Some(status)) = (taken, link, felt) {
            // The torque law counts its angles from the knob's own zero.
            link.zero();
            design = design.from_zero();
            let (measured, zeros) = (SavedCalibration::of(&design), status.zeros);
            let until_s = self.began.elapsed().as_secs_f64() + SHOWN_WITHIN_S;
            self.awaited = Some(Awaited { measured, text, zeros, until_s });
            return None;
        }
        store(knob, SavedCalibration::of(&design));
        Some(text)
    }

    /// What to say once the knob shows its new zero, or does not.
    fn seen(&mut self, status: Option<&LinkStatus>, knob: &KnobParams) -> Option<String> {
        let awaited = self.awaited.as_ref()?;
        if status.is_some_and(|status| status.zeros == awaited.zeros.wrapping_add(1)) {
            store(knob, awaited.measured);
            return self.awaited.take().map(|awaited| awaited.text);
        }
        if self.began.elapsed().as_secs_f64() > awaited.until_s {
            self.awaited = None;
            return Some(
                "rest is not set: the knob has not taken its new zero; press Rest here again".to_owned(),
            );
        }
        None
    }
}

fn store(knob: &KnobParams, measured: SavedCalibration) {
    if let Ok(mut calibration) = knob.calibration.write() {
        *calibration = measured;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plugin::params::ChalumeauParams;
    use chalumeau_knob::device::Hooks;
    use std::time::Duration;

    /// A calibrator that has measured a rest at 40 degrees on a knob that feels, and what it has said.
    fn measured(knob: &KnobParams, link: &KnobLink, status: &LinkStatus) -> (Calibrator, Option<String>) {
        let mut calibrator = Calibrator::new();
        calibrator.rest();
        assert!(calibrator.is_busy());
        let said = (0..1_500).find_map(|ms| {
            // Time passes as the readings say.
            calibrator.began = Instant::now() - Duration::from_millis(ms);
            calibrator.tick(Some((1_000 * ms, 40.0)), knob, Some(link), Some(status))
        });
        (calibrator, said)
    }

    #[test]
    fn a_rest_is_set_when_the_knob_shows_its_zero_and_not_before() {
        let params = ChalumeauParams::default();
        let (link, _reader) = KnobLink::spawn("test", Hooks::default());
        let status = |zeros| LinkStatus { tier: 2, zeros, ..LinkStatus::default() };
        let knob = &params.knob;
        *knob.calibration.write().unwrap() =
            SavedCalibration { rest_deg: 25.0, ..SavedCalibration::default() };
        let rest_deg = || knob.calibration.read().unwrap().rest_deg;
        let (mut calibrator, said) = measured(knob, &link, &status(3));
        assert_eq!((said, rest_deg()), (None, 25.0));
        assert!(calibrator.is_busy());
        assert_eq!(calibrator.tick(None, knob, Some(&link), Some(&status(3))), None);
        // Another connection counts anew.
        assert_eq!(calibrator.tick(None, knob, Some(&link), Some(&status(0))), None);
        let said = calibrator.tick(None, knob, Some(&link), Some(&status(4))).unwrap();
        assert!(said.starts_with("rest is set"), "{said}");
        assert!(rest_deg() == 0.0 && !calibrator.is_busy());

        let (mut calibrator, _) = measured(knob, &link, &status(3));
        if let Some(awaited) = &mut calibrator.awaited {
            awaited.until_s = 0.0;
        }
        let said = calibrator.tick(None, knob, Some(&link), Some(&status(3))).unwrap();
        assert!(said.starts_with("rest is not set") && !calibrator.is_busy(), "{said}");
    }

    #[test]
    fn a_knob_that_only_sends_keeps_its_rest_in_the_project() {
        let params = ChalumeauParams::default();
        let (link, _reader) = KnobLink::spawn("test", Hooks::default());
        let (_, said) = measured(&params.knob, &link, &LinkStatus::default());
        assert!(said.is_some_and(|said| said.starts_with("rest is set")));
        assert!((params.knob.calibration.read().unwrap().rest_deg - 40.0).abs() < 0.1);
    }
}
