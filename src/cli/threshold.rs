//! `chalumeau threshold`: how hard to blow before a note speaks.

use crate::bore::transfer_matrix::TransferMatrix;
use crate::bore::transfer_matrix::threshold_gamma;
use crate::cli::Failure;
use crate::cli::args::{AirArg, InstrumentArg, NotesArg, within};
use crate::cli::table::TableArgs;
use crate::units::WrittenNote;
use clap::Args;

const EXAMPLES: &str = "\
Examples:
  chalumeau threshold --all --zeta 0.3
  chalumeau threshold --written G4 --zeta 0.2
  chalumeau threshold --all --instrument mine.toml --csv gamma_on.csv";

/// Mouth pressure at which each note begins to sound
///
/// gamma_on is that pressure over the closing pressure of the reed, from the height of the impedance peak the note plays
/// on (frequency-domain model, reed volume included) and the flow strength zeta of the embouchure. Never below 1/3, the
/// bore without losses. A note that no peak carries has nan.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Threshold {
    #[command(flatten)]
    notes: NotesArg,
    /// Embouchure: flow strength of the reed, 0.05..0.9
    #[arg(long, value_name = "ZETA", default_value = "0.3", value_parser = |s: &str| within(s, 0.05, 0.9))]
    zeta: f64,
    #[command(flatten)]
    air: AirArg,
    #[command(flatten)]
    instrument: InstrumentArg,
    #[command(flatten)]
    table: TableArgs,
}

impl Threshold {
    pub fn run(&self) -> Result<(), Failure> {
        let file = self.instrument.load()?;
        let notes = self.notes.notes(&file)?;
        let model = TransferMatrix::new(&file, self.air.air());
        let mut table = self.table.open("written_midi,gamma_on")?;
        table.comment(format_args!("{}; quasi-static reed, zeta {}", file.name, self.zeta))?;
        for WrittenNote(written) in notes {
            let gamma_on = file
                .fingering(WrittenNote(written))
                .zip(WrittenNote(written).sounding(file.transposition))
                .and_then(|(fingering, sounding)| {
                    let near_hz = sounding.frequency_hz(440.0);
                    model.playing_frequency(&fingering.open, file.reed_volume_m3, near_hz)
                })
                .filter(|&(_, height)| height > 0.0)
                .map(|(_, height)| threshold_gamma(height, self.zeta));
            match gamma_on {
                Some(gamma_on) => table.line(format_args!("{written},{gamma_on:.6}"))?,
                None => table.line(format_args!("{written},nan"))?,
            }
        }
        table.finish()
    }
}
