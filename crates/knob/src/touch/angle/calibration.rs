//! Calibration of the knob: *Rest* finds zero and the dead zone, *Blow hard* finds full blow.
//!
//! Each step collects readings for a moment and then either takes them or says what to do differently. Times are those
//! of the readings, so nothing here waits or asks a clock. The thresholds are by judgement, for a knob that reads in
//! steps of 0.1 degrees and a hand whose tremor moves it by half a degree.

use chalumeau_core::haptics::FeelDesign;
use chalumeau_core::maths;

use crate::touch::angle::KnobDesign;

/// How long *Rest* listens, s.
pub const REST_S: f64 = 1.0;
/// How long *Blow hard* listens, s.
pub const BLOW_S: f64 = 3.0;
/// Readings without which neither is believed: unmodified firmware gives 25 a second.
const LEAST_READINGS: u32 = 10;
/// Greatest spread of a knob at rest, degrees.
const REST_SPREAD_DEG: f64 = 3.0;
/// Least dead zone, degrees: three steps of the encoder.
const LEAST_DEAD_DEG: f64 = 0.3;
/// Dead zone over the standard deviation at rest: breath ends within 4, begins beyond 8.
const DEAD_DEVIATIONS: f64 = 4.0;
/// Full blow is what is held this long, s, not the peak of a jerk.
const HELD_S: f64 = 0.02;

/// What a step found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Taken {
    /// The knob's rest.
    Rest {
        /// Mean angle, degrees.
        zero_deg: f64,
        /// How far from it breath begins, degrees.
        dead_on_deg: f64,
        /// How far from it breath ends, degrees.
        dead_off_deg: f64,
    },
    /// Full blow.
    Blow {
        /// Furthest angle held, degrees.
        full_deg: f64,
    },
}

impl Taken {
    /// `design` with what was found. After a new rest, full blow keeps its distance from zero.
    #[must_use]
    pub fn applied_to(self, design: KnobDesign) -> KnobDesign {
        match self {
            Self::Rest { zero_deg, dead_on_deg, dead_off_deg } => {
                let full_deg = design.full_deg - design.zero_deg + zero_deg;
                KnobDesign { zero_deg, full_deg, dead_on_deg, dead_off_deg, ..design }
            }
            Self::Blow { full_deg } => KnobDesign { full_deg, ..design },
        }
    }
}

/// Why a step was not taken, and what to do.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// The knob moved while at rest.
    #[error(
        "the knob moved by {spread_deg:.1} degrees; let go of it, or hold it still, and press Rest again"
    )]
    Moving {
        /// Between the least and the greatest angle, degrees.
        spread_deg: f64,
    },
    /// Full blow too near to rest.
    #[error(
        "the knob went {travel_deg:.1} degrees from its rest, too little to blow with; press Blow hard again and turn \
         it to where your loudest note should be, at least {least_deg:.0} degrees"
    )]
    TooLittleTravel {
        /// From rest, degrees.
        travel_deg: f64,
        /// What is needed, degrees.
        least_deg: f64,
    },
    /// Full blow further than a hand turns.
    #[error(
        "the knob went {travel_deg:.0} degrees from its rest; full blow may lie at most {:.0} degrees away: press Blow \
         hard again and turn it less far",
        FeelDesign::TRAVEL_DEG.1
    )]
    TooFar {
        /// From rest, degrees.
        travel_deg: f64,
    },
    /// The knob says too little.
    #[error("only {readings} readings came from the knob; check that it is connected, then try again")]
    TooFewReadings {
        /// How many came.
        readings: u32,
    },
}

#[derive(Clone, Copy, Debug)]
enum Step {
    Rest,
    Blow { zero_deg: f64 },
}

/// Readings being collected.
#[derive(Clone, Copy, Debug)]
struct Collecting {
    step: Step,
    /// Time of the first call, s.
    since_s: Option<f64>,
    readings: u32,
    /// Running mean and sum of squared deviations (Welford 1962).
    mean_deg: f64,
    squares: f64,
    least_deg: f64,
    greatest_deg: f64,
    /// The angle, lagging by `HELD_S`, and when it was last read.
    held_deg: f64,
    held_at_s: f64,
    furthest_held_deg: f64,
}

/// A calibration in progress, or none. Real-time safe, though meant for the link's thread.
#[derive(Clone, Copy, Debug, Default)]
pub struct Calibration(Option<Collecting>);

impl Calibration {
    /// Begins *Rest*: the player lets go, or holds still where no breath shall be.
    pub fn rest(&mut self) {
        self.begin(Step::Rest);
    }

    /// Begins *Blow hard*: the player turns as far as the loudest note shall be, and holds it for a moment. `design`
    /// says where the rest is.
    pub fn blow(&mut self, design: &KnobDesign) {
        self.begin(Step::Blow { zero_deg: design.zero_deg });
    }

    fn begin(&mut self, step: Step) {
        self.0 = Some(Collecting {
            step,
            since_s: None,
            readings: 0,
            mean_deg: 0.0,
            squares: 0.0,
            least_deg: f64::INFINITY,
            greatest_deg: f64::NEG_INFINITY,
            held_deg: 0.0,
            held_at_s: 0.0,
            furthest_held_deg: f64::NEG_INFINITY,
        });
    }

    /// How much of the step is done, 0..=1, or `None` while there is none.
    pub fn progress(&self, t_s: f64) -> Option<f64> {
        let collecting = self.0.as_ref()?;
        let since_s = collecting.since_s.unwrap_or(t_s);
        Some(((t_s - since_s) / collecting.length_s()).clamp(0.0, 1.0))
    }

    /// Takes the angle in degrees read at `t_s`, or the news that none came by then (`None`), and gives the outcome once
    /// the time is up. To be called about as often as readings come, and ten times a second if none do.
    pub fn tick(&mut self, t_s: f64, angle_deg: Option<f64>) -> Option<Result<Taken, CalibrationError>> {
        let collecting = self.0.as_mut()?;
        let since_s = *collecting.since_s.get_or_insert(t_s);
        if let Some(angle_deg) = angle_deg.filter(|angle| angle.is_finite()) {
            collecting.read(t_s, angle_deg);
        }
        if t_s - since_s < collecting.length_s() {
            return None;
        }
        let outcome = collecting.outcome();
        self.0 = None;
        Some(outcome)
    }
}

impl Collecting {
    fn length_s(&self) -> f64 {
        match self.step {
            Step::Rest => REST_S,
            Step::Blow { .. } => BLOW_S,
        }
    }

    fn read(&mut self, t_s: f64, angle_deg: f64) {
        if self.readings == 0 {
            (self.held_deg, self.held_at_s) = (angle_deg, t_s);
        }
        self.readings = self.readings.saturating_add(1);
        let off = angle_deg - self.mean_deg;
        self.mean_deg += off / f64::from(self.readings);
        self.squares += off * (angle_deg - self.mean_deg);
        self.least_deg = self.least_deg.min(angle_deg);
        self.greatest_deg = self.greatest_deg.max(angle_deg);
        let lag = 1.0 - maths::exp(-(t_s - self.held_at_s).max(0.0) / HELD_S);
        self.held_deg += lag * (angle_deg - self.held_deg);
        self.held_at_s = t_s;
        self.furthest_held_deg = self.furthest_held_deg.max(self.held_deg);
    }

    fn outcome(&self) -> Result<Taken, CalibrationError> {
        let readings = self.readings;
        if readings < LEAST_READINGS {
            return Err(CalibrationError::TooFewReadings { readings });
        }
        match self.step {
            Step::Rest => {
                let spread_deg = self.greatest_deg - self.least_deg;
                if spread_deg > REST_SPREAD_DEG {
                    return Err(CalibrationError::Moving { spread_deg });
                }
                let deviation_deg = (self.squares / f64::from(readings)).sqrt();
                let dead_off_deg = (DEAD_DEVIATIONS * deviation_deg).max(LEAST_DEAD_DEG);
                Ok(Taken::Rest { zero_deg: self.mean_deg, dead_on_deg: 2.0 * dead_off_deg, dead_off_deg })
            }
            Step::Blow { zero_deg } => {
                let travel_deg = self.furthest_held_deg - zero_deg;
                let (least_deg, furthest_deg) = FeelDesign::TRAVEL_DEG;
                if travel_deg < least_deg {
                    return Err(CalibrationError::TooLittleTravel { travel_deg, least_deg });
                }
                if travel_deg > furthest_deg {
                    return Err(CalibrationError::TooFar { travel_deg });
                }
                Ok(Taken::Blow { full_deg: self.furthest_held_deg })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::touch::angle::KnobBreath;

    /// Feeds `angle` of time at `hz` until there is an outcome.
    fn run(
        mut calibration: Calibration,
        hz: f64,
        angle: impl Fn(f64) -> f64,
    ) -> Result<Taken, CalibrationError> {
        (0..)
            .find_map(|i| {
                let t_s = f64::from(i) / hz;
                assert!(t_s < 10.0, "no outcome");
                calibration.tick(100.0 + t_s, Some(angle(t_s)))
            })
            .unwrap()
    }

    fn rest(hz: f64, angle: impl Fn(f64) -> f64) -> Result<Taken, CalibrationError> {
        let mut calibration = Calibration::default();
        calibration.rest();
        run(calibration, hz, angle)
    }

    fn blow(design: &KnobDesign, hz: f64, angle: impl Fn(f64) -> f64) -> Result<Taken, CalibrationError> {
        let mut calibration = Calibration::default();
        calibration.blow(design);
        run(calibration, hz, angle)
    }

    #[test]
    fn rest_then_blow_gives_a_playable_knob() {
        for hz in [25.0, 500.0] {
            let tremor = |t: f64| 0.4 * (57.0 * t).sin();
            let rested = rest(hz, |t| -1_234.0 + tremor(t)).unwrap().applied_to(KnobDesign::default());
            assert!((rested.zero_deg + 1_234.0).abs() < 0.1, "{rested:?}");
            let blown =
                blow(&rested, hz, |t| -1_234.0 + 180.0 * (2.0 * t).min(1.0)).unwrap().applied_to(rested);
            assert!((blown.full_deg + 1_054.0).abs() < 1.0, "{blown:?}");
            let mut knob = KnobBreath::new(blown).unwrap();
            for i in 0..1_000 {
                let deg = -1_234.0 + tremor(0.002 * f64::from(i));
                assert_eq!(knob.pressure_unit(deg), 0.0, "tremor is no breath");
            }
            assert!(knob.pressure_unit(-1_055.0) > 0.97);
        }
    }

    #[test]
    fn still_knob_has_the_least_dead_zone() {
        let found = rest(500.0, |_| 12.3).unwrap();
        let Taken::Rest { zero_deg, dead_on_deg, dead_off_deg } = found else { panic!("{found:?}") };
        assert!((zero_deg - 12.3).abs() < 1e-9);
        assert_eq!((dead_on_deg, dead_off_deg), (0.6, 0.3));
    }

    #[test]
    fn moving_knob_is_no_rest() {
        let error = rest(500.0, |t| 10.0 * t).unwrap_err();
        assert!(
            matches!(error, CalibrationError::Moving { spread_deg } if (9.0..11.0).contains(&spread_deg))
        );
        assert!(error.to_string().contains("press Rest again"));
    }

    #[test]
    fn timid_blow_is_refused_with_the_way_it_went() {
        let error = blow(&KnobDesign::default(), 500.0, |_| 80.0).unwrap_err();
        assert_eq!(error, CalibrationError::TooLittleTravel { travel_deg: 80.0, least_deg: 120.0 });
        let other_way = blow(&KnobDesign::default(), 500.0, |t| -90.0 * t).unwrap_err();
        assert!(matches!(other_way, CalibrationError::TooLittleTravel { .. }), "{other_way}");
        assert!(matches!(
            blow(&KnobDesign::default(), 500.0, |_| 1_200.0),
            Err(CalibrationError::TooFar { .. })
        ));
    }

    #[test]
    fn jerk_of_one_reading_is_not_full_blow() {
        let found =
            blow(&KnobDesign::default(), 500.0, |t| if (t - 1.0).abs() < 1e-3 { 900.0 } else { 160.0 });
        let Ok(Taken::Blow { full_deg }) = found else { panic!("{found:?}") };
        assert!((160.0..260.0).contains(&full_deg), "{full_deg}");
    }

    #[test]
    fn silent_knob_ends_in_a_sentence() {
        let mut calibration = Calibration::default();
        calibration.rest();
        let outcome = (0..).find_map(|i| calibration.tick(0.1 * f64::from(i), None)).unwrap();
        assert_eq!(outcome, Err(CalibrationError::TooFewReadings { readings: 0 }));
        assert_eq!(calibration.progress(5.0), None);
    }

    #[test]
    fn readings_that_are_no_numbers_do_not_count() {
        let found = rest(500.0, |t| if t < 0.5 { f64::NAN } else { 1.0 }).unwrap();
        assert!(matches!(found, Taken::Rest { zero_deg, .. } if zero_deg == 1.0));
    }
}
