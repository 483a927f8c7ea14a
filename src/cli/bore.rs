//! `chalumeau bore`: an instrument's geometry as a table and as a drawing to scale.

use crate::cli::Failure;
use crate::cli::csv_table::{TableArgs, quoted};
use crate::cli::plot_args::PlotArgs;
use crate::cli::shared_args::{InstrumentArg, check_fingering, note};
use chalumeau_core::bore::instrument_file::{Fingering, InstrumentFile};

use chalumeau_core::units::WrittenNote;
use clap::Args;

const EXAMPLES: &str = "\
Examples:
  chalumeau bore --plot bore.svg
  chalumeau bore --written C5 --plot c5.png          which holes are open for C5
  chalumeau bore --written C5 --csv c5.csv
  chalumeau bore --instrument mine.toml --plot mine.png";

/// Print or draw bore, tone holes and fingering of an instrument
///
/// The table has a row for each end of a cone of the bore and one for each hole: kind (bore or hole), name (of the part or
/// the hole), distance from the tip of the reed, diameter, height of the chimney, and with --written whether the hole is
/// open (1) or closed (0). Fields that do not apply are empty. The drawing shows the instrument from the side, to scale.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct BoreCommand {
    /// Finger this written note: a MIDI number (72) or a name (C5)
    #[arg(long, value_name = "NOTE", value_parser = note)]
    written: Option<u8>,
    #[command(flatten)]
    instrument: InstrumentArg,
    #[command(flatten)]
    table: TableArgs,
    #[command(flatten)]
    plot: PlotArgs,
}

impl BoreCommand {
    pub fn run(&self) -> Result<(), Failure> {
        self.table.check_files(&[self.instrument.file()], &[self.plot.path()])?;
        let file = self.instrument.load()?;
        let fingering = self.fingering(&file)?;
        let plot = self.plot.open(self.table.force())?;
        let mut table = self.table.open_beside(&plot, "kind,name,x_mm,diameter_mm,chimney_mm,open")?;
        table.comment(format_args!("{}; mm from the tip of the reed", file.name))?;
        let mut last = None;
        for segment in &file.bore {
            let part = quoted(&segment.part);
            for (x_m, r_m) in [(segment.x_start_m, segment.r_start_m), (segment.x_end_m, segment.r_end_m)] {
                let row = format!("bore,{part},{},{},,", mm(x_m), mm(2.0 * r_m));
                if last.as_ref() != Some(&row) {
                    table.line(format_args!("{row}"))?;
                }
                last = Some(row);
            }
        }
        for (index, hole) in file.holes.iter().enumerate() {
            let name = quoted(&hole.name);
            let open = fingering.map_or("", |fingering| {
                if fingering.open.get(index).copied().unwrap_or(false) { "1" } else { "0" }
            });
            table.line(format_args!(
                "hole,{name},{},{},{},{open}",
                mm(hole.x_m),
                mm(2.0 * hole.radius_m),
                mm(hole.chimney_m)
            ))?;
        }
        table.finish()?;
        plot.draw(|| chalumeau_figure::bore::profile(&file, fingering))
    }

    fn fingering<'a>(&self, file: &'a InstrumentFile) -> Result<Option<&'a Fingering>, Failure> {
        let Some(written) = self.written.map(WrittenNote) else { return Ok(None) };
        check_fingering(file, written)?;
        Ok(file.fingering(written))
    }
}

/// Metres as millimetres, rounded to the nanometre to remove errors of binary fractions.
fn mm(metres: f64) -> f64 {
    (metres * 1e9).round() / 1e6
}
