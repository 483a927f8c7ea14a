//! `chalumeau study`: the trials of one participant, for the experimenter.

use crate::cli::Failure;
use crate::cli::csv_table::TableArgs;
use crate::cli::shared_args::whole;
use chalumeau_knob::touch::study::{StudySide, plan};
use clap::Args;

const EXAMPLES: &str = "\
Examples:
  chalumeau study --participant 7
  chalumeau study --participant 7 --seed 3 --csv participant7.csv";

/// Print the order of trials of a listening and touch study
///
/// Sixteen trials compare a reed whose stiffness k follows its opening H (coupled, peak flow stays 1) with one whose k
/// stays (free), as sides A and B of the plugin's parameter *Study side*, both in sound and in feel. Participant and seed fix the
/// order. The plugin's parameters Participant, Study seed and Trial select the same order. Do not show the table to the
/// participant: it says which side is which.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct StudyCommand {
    /// Number of the participant, 1..9999
    #[arg(long, value_name = "N", value_parser = |s: &str| whole::<u32>(s, 1, 9_999))]
    participant: u32,
    /// Seed of the study, 1..9999: the same for all participants
    #[arg(long, value_name = "N", default_value = "1", value_parser = |s: &str| whole::<u32>(s, 1, 9_999))]
    seed: u32,
    #[command(flatten)]
    table: TableArgs,
}

impl StudyCommand {
    pub fn run(&self) -> Result<(), Failure> {
        let mut table = self.table.open("participant,seed,trial,h,a,k_a,b,k_b")?;
        table.comment(format_args!(
            "k of the coupled side is 27/(4 H^3), of the free side the reference 0.3849"
        ))?;
        for trial in plan(self.participant, self.seed) {
            let [a, b] = [StudySide::A, StudySide::B].map(|side| trial.condition(side));
            table.line(format_args!(
                "{},{},{},{},{},{:.5},{},{:.5}",
                self.participant,
                self.seed,
                trial.number,
                trial.h,
                a.name(),
                a.k(trial.h),
                b.name(),
                b.k(trial.h)
            ))?;
        }
        table.finish()
    }
}
