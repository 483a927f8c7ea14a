//! The feel and the calibration that the knob's parameters describe.

use crate::plugin::params::KnobParams;
use crate::plugin::params::knob::{LawChoice, OrderChoice, SavedCalibration};
use chalumeau_core::haptics::{FeelDesign, NoteOrder};
use chalumeau_core::units::WrittenNote;
use chalumeau_knob::touch::angle::KnobDesign;
use chalumeau_knob::wire::TorqueLaw;

/// Highest torque of the reference note in a study, mNm. With it, both sides of every trial stay under the first ceiling
/// at the default contrast and mark (the test below checks this).
const STUDY_MNM: f64 = 45.0;

/// The feel that the parameters describe.
pub fn feel_design(knob: &KnobParams) -> FeelDesign {
    let calibration = knob.calibration.read().map_or_else(|_| SavedCalibration::default(), |c| c.mended());
    FeelDesign {
        law: match knob.law.value() {
            LawChoice::Flow => TorqueLaw::Flow,
            LawChoice::Pressure => TorqueLaw::Pressure,
            LawChoice::Free => TorqueLaw::Free,
        },
        reference: u8::try_from(knob.reference.value()).ok().map(WrittenNote),
        contrast: f64::from(knob.contrast.value()),
        place: f64::from(knob.place.value()),
        // So that the two sides of a trial differ in the reed, not in how far the hand has to turn.
        equal_travel: knob.study().is_some(),
        order: match knob.order.value() {
            OrderChoice::Physical => NoteOrder::Physical,
            OrderChoice::CoveredHoles => NoteOrder::CoveredHoles,
            OrderChoice::OpenHoles => NoteOrder::CoveredHolesReversed,
        },
        strength_mnm: match knob.study() {
            Some(_) => f64::from(knob.torque.value()).min(STUDY_MNM),
            None => f64::from(knob.torque.value()),
        },
        travel_deg: calibration.travel_deg,
        damping_mnms: f64::from(knob.damping.value()),
        friction_mnm: f64::from(knob.friction.value()),
        detent_mnm: match knob.law.value() {
            LawChoice::Flow => Some(f64::from(knob.mark.value())),
            LawChoice::Pressure => Some(f64::from(knob.detent.value())),
            LawChoice::Free => None,
        },
        ..FeelDesign::default()
    }
}

/// Rest angle, full-blow angle, dead zone and curve from the parameters.
pub fn knob_design(knob: &KnobParams) -> KnobDesign {
    let calibration = knob.calibration.read().map_or_else(|_| SavedCalibration::default(), |c| *c);
    calibration.design(f64::from(knob.curve.value()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::haptics::TorqueLimits;
    use chalumeau_core::instrument::Settings;
    use chalumeau_knob::touch::feel::InstrumentFeel;
    use chalumeau_knob::touch::study::{Condition, TRIALS, plan};

    #[test]
    fn both_sides_of_every_trial_can_be_felt_under_the_first_ceiling() {
        let feels = InstrumentFeel::built_in().unwrap();
        for trial in plan(1, 1).iter().chain(&plan(2, 1)) {
            for condition in [Condition::Coupled, Condition::Free] {
                let settings = Settings {
                    reed_h: trial.h as f32,
                    reed_k: condition.k(trial.h) as f32,
                    coupled: false,
                    ..Settings::default()
                };
                let design =
                    FeelDesign { strength_mnm: STUDY_MNM, equal_travel: true, ..FeelDesign::default() };
                let refused = feels.table(&settings, &design, &TorqueLimits::default()).err();
                assert_eq!(refused, None, "H {} {}", trial.h, condition.name());
            }
        }
        assert_eq!(plan(1, 1).len(), TRIALS);
    }
}
