//! `chalumeau threshold`: the mouth pressure at which each note begins to sound.

use crate::cli::Failure;
use crate::cli::csv_table::{TableArgs, named};
use crate::cli::plot_args::PlotArgs;
use crate::cli::shared_args::{AirArg, InstrumentArg, NotesArg, within};
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::bore::transfer_matrix::{TransferMatrix, threshold_gamma};
use chalumeau_core::instrument::Settings;
use chalumeau_core::reed::physical::ZETA_REFERENCE;
use chalumeau_core::units::{Air, WrittenNote};
use chalumeau_figure::threshold::{self, Strength, Thresholds};
use clap::Args;

const EXAMPLES: &str = "\
Examples:
  chalumeau threshold --all --zeta 0.3
  chalumeau threshold --written G4 --zeta 0.2
  chalumeau threshold --all --instrument mine.toml --csv gamma_on.csv
  chalumeau threshold --plot threshold.png --csv gamma_on.csv";

/// Embouchures drawn beside the one asked for, from firm to loose.
const ZETAS: [f64; 5] = [0.15, 0.2, 0.3, 0.4, 0.6];
/// Reeds drawn, by the number on their box.
const STRENGTHS: [f32; 5] = [2.0, 2.5, 3.0, 3.5, 4.0];

/// Calculate the mouth pressure at which each note begins to sound
///
/// gamma_on is that pressure over the closing pressure of the reed, from the height of the impedance peak the note plays
/// on (frequency-domain model, reed volume included) and the flow strength zeta of the embouchure. That is the theory of a reed without inertia; it is never below 1/3, the value of a bore
/// without losses. As the reed has inertia, some high notes begin up to 19 % below
/// gamma_on, and D5 and E flat 5 some 5 % above it: gamma_sounding of `chalumeau haptic`. A note without an impedance peak has nan.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct ThresholdCommand {
    #[command(flatten)]
    notes: NotesArg,
    /// Embouchure: flow strength of the reed, 0.05..0.9
    #[arg(long, value_name = "ZETA", default_value_t = ZETA_REFERENCE, value_parser = |s: &str| within(s, 0.05, 0.9))]
    zeta: f64,
    #[command(flatten)]
    air: AirArg,
    #[command(flatten)]
    instrument: InstrumentArg,
    #[command(flatten)]
    table: TableArgs,
    #[command(flatten)]
    plot: PlotArgs,
}

impl ThresholdCommand {
    pub fn run(&self) -> Result<(), Failure> {
        self.table.check_files(&[self.instrument.file()], &[self.plot.path()])?;
        let file = self.instrument.load()?;
        let notes = self.notes.notes(&file)?;
        let model = TransferMatrix::new(&file, self.air.air());
        let plot = self.plot.open(self.table.force())?;
        let mut table = self.table.open_beside(&plot, "written,written_midi,gamma_on")?;
        table.comment(format_args!(
            "{}; quasi-static reed, zeta {}; {:.1} C",
            file.name,
            self.zeta,
            self.air.air().temperature_c
        ))?;
        // Height of the peak each note plays on: the same for every embouchure.
        let heights: Vec<(u8, Option<f64>)> = notes
            .into_iter()
            .map(|written| {
                let height = file
                    .fingering(written)
                    .zip(written.sounding(file.transposition))
                    .and_then(|(fingering, sounding)| {
                        let near_hz = sounding.frequency_hz(440.0);
                        model.playing_frequency(&fingering.open, file.reed_volume_m3, near_hz)
                    })
                    .map(|(_, height)| height);
                (written.0, height.filter(|&height| height > 0.0))
            })
            .collect();
        let thresholds = |zeta: f64| Thresholds {
            zeta,
            gamma_on: heights
                .iter()
                .map(|&(written, height)| {
                    (written, height.map_or(f64::NAN, |height| threshold_gamma(height, zeta)))
                })
                .collect(),
        };
        for (written, gamma_on) in thresholds(self.zeta).gamma_on {
            let name = named(WrittenNote(written));
            match gamma_on.is_finite() {
                true => table.line(format_args!("{name},{written},{gamma_on:.6}"))?,
                false => table.line(format_args!("{name},{written},nan"))?,
            }
        }
        table.finish()?;
        plot.draw(|| {
            let mut zetas: Vec<f64> =
                ZETAS.into_iter().filter(|zeta| (zeta - self.zeta).abs() > 0.01).collect();
            zetas.push(self.zeta);
            zetas.sort_by(f64::total_cmp);
            let chosen = zetas.iter().position(|&zeta| zeta == self.zeta).unwrap_or(0);
            let reference_pa = Settings::default().closing_pa();
            let reeds = STRENGTHS.map(|strength| {
                let closing_pa = Settings { strength, ..Settings::default() }.closing_pa();
                // Stiffer with the same opening: zeta goes with the root of the pressure that closes it.
                let zeta = self.zeta * (reference_pa / closing_pa).sqrt();
                let (number, closing_kpa) = (f64::from(strength), 1e-3 * closing_pa);
                Strength { number, closing_kpa, thresholds: thresholds(zeta) }
            });
            let embouchures: Vec<Thresholds> = zetas.into_iter().map(thresholds).collect();
            threshold::figure(&file.name, &embouchures, chosen, &reeds)
        })
    }
}

/// Gamma at which the linear theory lets the note begin; `None` where no impedance peak carries it.
pub fn linear_threshold(file: &InstrumentFile, written: WrittenNote, settings: &Settings) -> Option<f64> {
    // Flow strength of the reed as strength, lip and H, k, A make it: what the linear theory asks for.
    let zeta = settings.reed_law().flow_strength(f64::from(settings.zeta));
    let fingering = file.fingering(written)?;
    let model = TransferMatrix::new(file, Air::at(f64::from(settings.temperature_c)));
    let near_hz = written.sounding(file.transposition)?.frequency_hz(f64::from(settings.a4_hz));
    let (_, height) = model.playing_frequency(&fingering.open, file.reed_volume_m3, near_hz)?;
    // Without any flow no breath is enough.
    (height > 0.0).then(|| threshold_gamma(height, zeta)).filter(|gamma| gamma.is_finite())
}
