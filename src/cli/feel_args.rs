//! Arguments for the feel of the knob.

use crate::cli::Failure;
use crate::cli::shared_args::{check_fingering, note, within};
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::haptics::{FeelDesign, FeelRefused, NoteOrder};
use chalumeau_core::units::WrittenNote;
use chalumeau_knob::wire::message::TorqueLaw;
use clap::{Args, ValueEnum};

fn inside(text: &str, (low, high): (f64, f64)) -> Result<f64, String> {
    within(text, low, high)
}

/// Torque laws by name.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum LawArg {
    /// Rises to the threshold, falls to zero where the reed shuts
    Flow,
    /// A spring with a step at the threshold: easy to hold
    Pressure,
}

/// Orders by name.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum OrderArg {
    /// By the pressure that the bore needs
    Physical,
    /// The longer the closed tube, the harder
    CoveredHoles,
    /// The longer the closed tube, the easier
    CoveredHolesReversed,
}

/// The parts of the feel that a user chooses.
#[derive(Args)]
#[command(next_help_heading = "Feel of the knob")]
pub struct FeelArgs {
    /// Torque law [default: flow]
    #[arg(long, value_enum)]
    law: Option<LawArg>,
    /// Exaggeration of the differences in torque between notes, 1 (physical) ..5 [default: 3]
    #[arg(long, value_name = "X", value_parser = |s: &str| inside(s, FeelDesign::EXAGGERATION))]
    contrast: Option<f64>,
    /// Exaggeration of the differences in angle at which notes speak, 1 (physical) ..5 [default: 1]
    #[arg(long, value_name = "X", value_parser = |s: &str| inside(s, FeelDesign::EXAGGERATION))]
    place: Option<f64>,
    /// Notes speak and close at the angles of the reference reed, whatever reed is played: as in a study
    #[arg(long)]
    equal_travel: bool,
    /// Which note feels harder [default: physical]
    #[arg(long, value_enum)]
    order: Option<OrderArg>,
    /// Written note that contrast and place do not change [default: C5 or, without one, the note that requires a medium pressure]
    #[arg(long, value_name = "NOTE", value_parser = note)]
    reference: Option<u8>,
    /// Torque per unit of flow (flow) or at closure (pressure) on the reference note, mNm, 0..450 [default: 55]
    #[arg(long, value_name = "MNM", value_parser = |s: &str| inside(s, FeelDesign::STRENGTH_MNM))]
    torque: Option<f64>,
    /// Angle at which the reference reed closes on the reference note, degrees, 120..1080 [default: 360]
    #[arg(long, value_name = "DEG", value_parser = |s: &str| inside(s, FeelDesign::TRAVEL_DEG))]
    travel: Option<f64>,
    /// Height of the mark (flow law) or the step (pressure law) at the threshold, mNm, 0..100 [default: 9 under flow, 6 under pressure]
    #[arg(long, value_name = "MNM", value_parser = |s: &str| inside(s, FeelDesign::MARK_MNM))]
    detent: Option<f64>,
}

impl FeelArgs {
    /// The feel these arguments describe, on this instrument.
    pub fn design(&self, file: &InstrumentFile) -> Result<FeelDesign, Failure> {
        self.over(&FeelDesign::default(), file)
    }

    /// The same where another feel stands in place of the defaults.
    pub fn over(&self, base: &FeelDesign, file: &InstrumentFile) -> Result<FeelDesign, Failure> {
        if let Some(reference) = self.reference {
            check_fingering(file, WrittenNote(reference))?;
        }
        let law = self.law.map_or(base.law, |law| match law {
            LawArg::Flow => TorqueLaw::Flow,
            LawArg::Pressure => TorqueLaw::Pressure,
        });
        Ok(FeelDesign {
            law,
            reference: self.reference.map(WrittenNote).or(base.reference),
            contrast: self.contrast.unwrap_or(base.contrast),
            place: self.place.unwrap_or(base.place),
            equal_travel: self.equal_travel || base.equal_travel,
            order: self.order.map_or(base.order, |order| match order {
                OrderArg::Physical => NoteOrder::Physical,
                OrderArg::CoveredHoles => NoteOrder::CoveredHoles,
                OrderArg::CoveredHolesReversed => NoteOrder::CoveredHolesReversed,
            }),
            strength_mnm: self.torque.unwrap_or(base.strength_mnm),
            travel_deg: self.travel.unwrap_or(base.travel_deg),
            // Each law has a mark of its own.
            detent_mnm: self.detent.or(base.detent_mnm.filter(|_| law == base.law)),
            ..*base
        })
    }

    fn contrast(&self) -> f64 {
        self.contrast.unwrap_or(FeelDesign::default().contrast)
    }

    fn place(&self) -> f64 {
        self.place.unwrap_or(FeelDesign::default().place)
    }

    /// The first of its flags that is given.
    pub fn given(&self) -> Option<&'static str> {
        let flags = [
            ("--law", self.law.is_some()),
            ("--contrast", self.contrast.is_some()),
            ("--place", self.place.is_some()),
            ("--equal-travel", self.equal_travel),
            ("--order", self.order.is_some()),
            ("--reference", self.reference.is_some()),
            ("--torque", self.torque.is_some()),
            ("--travel", self.travel.is_some()),
            ("--detent", self.detent.is_some()),
        ];
        flags.into_iter().find_map(|(flag, is_given)| is_given.then_some(flag))
    }

    /// Whether the strength was left to the program.
    #[cfg(feature = "devices")]
    pub fn may_weaken(&self) -> bool {
        self.torque.is_none()
    }

    /// Contrast and Place in words.
    pub fn exaggeration(&self) -> String {
        format!("Contrast {}, Place {}", self.contrast(), self.place())
    }
}

/// What is refused, with what helps as flags. `ceiling` is the flag that allows more torque.
pub fn refused_in_flags(refused: FeelRefused, ceiling: &str) -> Failure {
    let helps = match &refused {
        FeelRefused::Silent { .. } => "raise --zeta or --H".to_owned(),
        FeelRefused::Reference(_) => "choose another --reference".to_owned(),
        FeelRefused::Travel { .. } => "shorten --travel".to_owned(),
        FeelRefused::Crossed { .. } => "lower --place, raise --zeta, or take --law flow".to_owned(),
        FeelRefused::Ceiling { strength_mnm: 0.0, .. } => {
            format!("lower the mark (--detent), or raise {ceiling}")
        }
        FeelRefused::Ceiling { strength_mnm, .. } => {
            format!("lower --torque to {strength_mnm:.0} mNm or less, lower --contrast, or raise {ceiling}")
        }
        FeelRefused::Stiffness { .. } => {
            "lower --torque or the mark (--detent), or lengthen --travel".to_owned()
        }
        FeelRefused::Push { .. } => {
            "lower the mark (--detent) or --torque, lengthen --travel, or take --law pressure".to_owned()
        }
        FeelRefused::Field { .. } => "lower --torque, --contrast or --place, or lengthen --travel".to_owned(),
        _ => return refused.into(),
    };
    Failure::Usage(format!("{}; {helps}", refused.reason()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feel_flags;

    #[derive(clap::Parser)]
    struct Flags {
        #[command(flatten)]
        feel: FeelArgs,
    }

    #[test]
    fn flags_are_those_that_takes_keep_and_replace_them() {
        let file = InstrumentFile::built_in();
        let given = |flags: &str| {
            let words = std::iter::once("feel").chain(flags.split_whitespace());
            <Flags as clap::Parser>::parse_from(words).feel
        };
        for flags in [
            feel_flags::in_flags(&FeelDesign::default()),
            "--law pressure --contrast 2.3 --place 5 --order covered-holes --torque 260 --travel 120 --detent 0 --reference A#4"
                .to_owned(),
        ] {
            let design = given(&flags).design(&file).ok().unwrap();
            assert_eq!(feel_flags::in_flags(&design), flags);
        }
        let base = feel_flags::read("--law pressure --place 5 --detent 2").unwrap();
        let design = given("--place 2 --reference E3").over(&base, &file).ok().unwrap();
        assert_eq!((design.place, design.law), (2.0, TorqueLaw::Pressure));
        assert_eq!((design.reference, design.mark_mnm()), (Some(WrittenNote(52)), 2.0));
        assert_eq!(given("--law flow").over(&base, &file).ok().unwrap().mark_mnm(), 9.0);
    }

    #[test]
    fn the_help_says_the_ranges() {
        let command = FeelArgs::augment_args(clap::Command::new("feel"));
        for (flag, (low, high)) in [
            ("contrast", FeelDesign::EXAGGERATION),
            ("place", FeelDesign::EXAGGERATION),
            ("torque", FeelDesign::STRENGTH_MNM),
            ("travel", FeelDesign::TRAVEL_DEG),
            ("detent", FeelDesign::MARK_MNM),
        ] {
            let arg = command.get_arguments().find(|arg| arg.get_id() == flag).unwrap();
            let help = arg.get_help().unwrap().to_string().replace(" (physical) ", "");
            assert!(help.contains(&format!("{low}..{high}")), "{flag}: {help}");
        }
    }
}
