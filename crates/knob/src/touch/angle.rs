//! Turns the angle of the knob into breath: rest, dead zone, curve, and full blow.
//!
//! Angles are degrees since the device's zero, positive is blowing, and may be any number of turns. This
//! module does not depend on the note or on the torque; `breath_from_angle` adapts the result for knobs with a motor.
//!
//! ```
//! use chalumeau_knob::touch::angle::{KnobBreath, KnobDesign};
//!
//! // One turn from rest to full blow, with a dead zone of 0.5 to 1 degree.
//! let mut knob = KnobBreath::new(KnobDesign::default())?;
//! assert_eq!([0.4, 360.0].map(|angle_deg| knob.pressure_unit(angle_deg)), [0.0, 1.0]);
//! # Ok::<(), chalumeau_knob::touch::angle::KnobError>(())
//! ```

use chalumeau_core::maths;

pub mod calibration;
pub mod slap;

pub use calibration::{Calibration, CalibrationError, Taken};
pub use slap::slap_strength;

/// Exponent of the curve, from quick at the start to slow at the start (by judgement).
pub const CURVE: std::ops::RangeInclusive<f64> = 0.25..=4.0;
/// Least way from the end of the dead zone to full blow, degrees: less is fewer than a hundred steps of 0.1 degrees.
pub const LEAST_TRAVEL_DEG: f64 = 10.0;

/// How the knob is blown with: what a player sets or calibrates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnobDesign {
    /// Angle at which the player does not blow, degrees.
    pub zero_deg: f64,
    /// Angle of full blow, degrees; beyond `zero_deg`.
    pub full_deg: f64,
    /// Exponent of the curve, 0.25..=4; 1 is straight, more is finer at the start.
    pub curve: f64,
    /// How far from `zero_deg` breath begins, degrees.
    pub dead_on_deg: f64,
    /// How far from `zero_deg` it ends again, degrees; less than `dead_on_deg`. Breath is measured from here.
    pub dead_off_deg: f64,
}

impl KnobDesign {
    /// The same way to full blow, from zero: for a knob that counts its angles from where the player does not blow.
    #[must_use]
    pub fn from_zero(self) -> Self {
        Self { zero_deg: 0.0, full_deg: self.full_deg - self.zero_deg, ..self }
    }
}

/// One turn without a curve; the dead zone is a few steps of an encoder of 0.1 degrees.
impl Default for KnobDesign {
    fn default() -> Self {
        Self { zero_deg: 0.0, full_deg: 360.0, curve: 1.0, dead_on_deg: 1.0, dead_off_deg: 0.5 }
    }
}

/// Why a design is refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum KnobError {
    /// A number is not finite.
    #[error("{field} must be a finite number, got {value}")]
    NotFinite {
        /// Name of the field.
        field: &'static str,
        /// What was given.
        value: f64,
    },
    /// The curve's exponent.
    #[error("curve must lie in 0.25..=4, got {0}")]
    Curve(f64),
    /// The dead zone's ends.
    #[error("the dead zone must begin at 0 degrees or more and end before {on} degrees, got {off}")]
    DeadZone {
        /// Where breath begins.
        on: f64,
        /// Where it ends again.
        off: f64,
    },
    /// Too little way to blow with.
    #[error(
        "full blow must lie at least {LEAST_TRAVEL_DEG} degrees beyond the dead zone, got {0:.1}; \
         turn further for full blow"
    )]
    Travel(f64),
}

impl KnobDesign {
    /// Checks all fields. The error names the first field that is out of range.
    pub fn check(&self) -> Result<(), KnobError> {
        for (field, value) in [
            ("zero_deg", self.zero_deg),
            ("full_deg", self.full_deg),
            ("dead_on_deg", self.dead_on_deg),
            ("dead_off_deg", self.dead_off_deg),
        ] {
            if !value.is_finite() {
                return Err(KnobError::NotFinite { field, value });
            }
        }
        if !CURVE.contains(&self.curve) {
            return Err(KnobError::Curve(self.curve));
        }
        let (on, off) = (self.dead_on_deg, self.dead_off_deg);
        if !(0.0..on).contains(&off) {
            return Err(KnobError::DeadZone { on, off });
        }
        let travel = self.full_deg - self.zero_deg - on;
        if travel >= LEAST_TRAVEL_DEG { Ok(()) } else { Err(KnobError::Travel(travel)) }
    }
}

/// Breath from the angle of a knob.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnobBreath {
    design: KnobDesign,
    /// Where breath is measured from, degrees.
    origin_deg: f64,
    /// 1 / way from there to full blow.
    per_travel: f64,
    blowing: bool,
}

impl KnobBreath {
    /// A knob at rest. Fails if the design does not pass [`check`](KnobDesign::check).
    pub fn new(design: KnobDesign) -> Result<Self, KnobError> {
        design.check()?;
        let origin_deg = design.zero_deg + design.dead_off_deg;
        Ok(Self { design, origin_deg, per_travel: 1.0 / (design.full_deg - origin_deg), blowing: false })
    }

    /// The design it was made from.
    pub fn design(&self) -> &KnobDesign {
        &self.design
    }

    /// Breath, 0..=1 of full blow, for an angle in degrees. An angle that is not finite is no breath. Real-time safe.
    ///
    /// Inside the dead zone it stays what it was: silent until `dead_on_deg`, and blowing down to `dead_off_deg`.
    pub fn pressure_unit(&mut self, angle_deg: f64) -> f32 {
        if !angle_deg.is_finite() {
            self.blowing = false;
            return 0.0;
        }
        let beyond_deg = angle_deg - self.origin_deg;
        self.blowing = if self.blowing {
            beyond_deg > 0.0
        } else {
            beyond_deg >= self.design.dead_on_deg - self.design.dead_off_deg
        };
        if !self.blowing {
            return 0.0;
        }
        maths::pow((beyond_deg * self.per_travel).clamp(0.0, 1.0), self.design.curve) as f32
    }

    /// The angle at which `pressure_unit` gives this breath while blowing, degrees.
    pub fn angle_deg(&self, pressure_unit: f64) -> f64 {
        self.origin_deg + maths::pow(pressure_unit.clamp(0.0, 1.0), 1.0 / self.design.curve) / self.per_travel
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn breath_begins_later_than_it_ends() {
        let mut knob = KnobBreath::new(KnobDesign::default()).unwrap();
        let heard = [0.0, 0.7, 0.99, 1.0, 0.7, 0.51, 0.5, 0.7].map(|deg| knob.pressure_unit(deg) > 0.0);
        assert_eq!(heard, [false, false, false, true, true, true, false, false]);
    }

    #[test]
    fn noise_within_the_dead_zone_never_chatters() {
        let mut knob = KnobBreath::new(KnobDesign::default()).unwrap();
        let mut changes = 0;
        let mut was = false;
        for i in 0..10_000 {
            // Slowly up to the edge, with two encoder steps of noise on top.
            let deg = 1e-4 * f64::from(i) + if i % 2 == 0 { 0.2 } else { -0.2 };
            let is = knob.pressure_unit(deg) > 0.0;
            changes += i32::from(is != was);
            was = is;
        }
        assert_eq!(changes, 1);
    }

    #[test]
    fn full_blow_is_one_and_stays_one_for_turns_beyond() {
        let mut knob =
            KnobBreath::new(KnobDesign { zero_deg: -500.0, full_deg: -200.0, ..KnobDesign::default() })
                .unwrap();
        assert_eq!([-200.0, 0.0, 1e6].map(|deg| knob.pressure_unit(deg)), [1.0; 3]);
        assert_eq!([-500.0, -1e6, f64::NAN].map(|deg| knob.pressure_unit(deg)), [0.0; 3]);
    }

    #[test]
    fn refusals_say_what_was_given() {
        let refusal = |design: KnobDesign| KnobBreath::new(design).unwrap_err().to_string();
        let plain = KnobDesign::default();
        assert!(refusal(KnobDesign { curve: 5.0, ..plain }).contains("got 5"));
        assert!(refusal(KnobDesign { curve: f64::NAN, ..plain }).contains("curve"));
        assert!(refusal(KnobDesign { full_deg: 9.0, ..plain }).contains("got 8.0"));
        assert!(refusal(KnobDesign { full_deg: -360.0, ..plain }).contains("further"));
        assert!(refusal(KnobDesign { dead_off_deg: 1.0, ..plain }).contains("dead zone"));
        assert!(refusal(KnobDesign { zero_deg: f64::INFINITY, ..plain }).contains("zero_deg"));
    }

    proptest! {
        #[test]
        fn angle_of_a_breath_gives_that_breath(
            zero_deg in -3_600.0..3_600.0, travel in 20.0..3_600.0, curve in 0.25..=4.0, breath in 0.0..=1.0,
        ) {
            let design = KnobDesign { zero_deg, full_deg: zero_deg + travel, curve, ..KnobDesign::default() };
            let mut knob = KnobBreath::new(design).unwrap();
            knob.pressure_unit(design.full_deg);
            let again = f64::from(knob.pressure_unit(knob.angle_deg(breath)));
            prop_assert!((again - breath).abs() < 1e-4, "{} for {}", again, breath);
        }

        #[test]
        fn more_angle_is_never_less_breath(curve in 0.25..=4.0, low in 0.0..400.0, step in 0.0..50.0) {
            let mut knob = KnobBreath::new(KnobDesign { curve, ..KnobDesign::default() }).unwrap();
            let (less, more) = (knob.pressure_unit(low), knob.pressure_unit(low + step));
            prop_assert!(less <= more && (0.0..=1.0).contains(&less) && more <= 1.0);
        }
    }
}
