//! `chalumeau impedance`: the input impedance of the bore, as a curve or as its peaks.

use crate::cli::Failure;
use crate::cli::csv_table::{TableArgs, named};
use crate::cli::plot_args::PlotArgs;
use crate::cli::score_args::open_holes;
use crate::cli::shared_args::{AirArg, InstrumentArg, NotesArg, QualityArg, counted, whole, within};
use chalumeau_core::analysis::impedance::cutoff_hz;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::bore::transfer_matrix::{Peak, TransferMatrix, find_peaks};

use chalumeau_core::instrument;
use chalumeau_core::units::{Air, SoundingNote, WrittenNote, cents};
use chalumeau_figure::Figure;
use chalumeau_figure::impedance::{Curve, NotePeaks};
use clap::{Args, ValueEnum};
use num_complex::Complex64;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Longest curve, points.
const POINTS_MAX: f64 = 1e6;

const EXAMPLES: &str = "\
Examples:
  chalumeau impedance --written F4 --csv f4.csv          the curve, 20 Hz to 4 kHz
  chalumeau impedance --all --peaks 8                    eight resonances of every fingering
  chalumeau impedance --written F4 --plot f4.svg         the curve as a figure, with modes and cut-off, beside the other model
  chalumeau impedance --all --peaks 6 --plot peaks.png   where the peaks of all notes are
  chalumeau impedance --open-holes \"THUMB L1 L2\" --peaks 4   a fingering that is not in the chart
  chalumeau impedance --written 52 --from 100 --to 200 --step 0.1 --reed-volume";

/// Which model calculates the impedance.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Model {
    /// The lattice that plays at 48 kHz (96 kHz internally, 192 kHz with --quality high)
    Lattice,
    /// Transfer matrices with exact wall losses: the reference
    Tmm,
}

/// Frequencies of the curve.
#[derive(Args)]
struct CurveRange {
    /// First frequency of the curve, Hz [default: 20]
    #[arg(long, value_name = "HZ", value_parser = |s: &str| within(s, 1.0, 20_000.0))]
    from: Option<f64>,
    /// Last frequency of the curve, Hz [default: 4000]
    #[arg(long, value_name = "HZ", value_parser = |s: &str| within(s, 1.0, 20_000.0))]
    to: Option<f64>,
    /// Step of the curve, Hz [default: 1]
    #[arg(long, value_name = "HZ", value_parser = |s: &str| within(s, 0.001, 1_000.0))]
    step: Option<f64>,
}

impl CurveRange {
    fn is_given(&self) -> bool {
        self.from.or(self.to).or(self.step).is_some()
    }

    fn first_hz(&self) -> f64 {
        self.from.unwrap_or(20.0)
    }

    fn last_hz(&self) -> f64 {
        self.to.unwrap_or(4_000.0)
    }

    fn step_hz(&self) -> f64 {
        self.step.unwrap_or(1.0)
    }

    fn steps(&self) -> f64 {
        ((self.last_hz() - self.first_hz()) / self.step_hz() + 1e-9).floor()
    }
}

/// Calculate the input impedance of a fingering at the reed: a curve, or its peaks
///
/// Values are over Zc = rho c / S of the nominal bore, 14.9 mm wide unless the instrument file names another. A clarinet sounds near a peak of its impedance; the register key
/// weakens the first one and shifts it, so the second sounds, a twelfth higher. The reed itself adds a little volume that lowers the
/// peaks; it is left out unless --reed-volume is given.
///
/// A curve is of one fingering: choose a note with --written, or name the open holes. All notes need --peaks.
///
/// Columns: f_hz,re_z_over_zc,im_z_over_zc, or with --peaks written,written_midi,n,f_hz,mag_over_zc,q: the note (empty with --open-holes), the number of the peak from 1, its
/// frequency, height and quality factor.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct ImpedanceCommand {
    #[command(flatten)]
    notes: NotesArg,
    /// A fingering that is not in the chart, instead of a note: names of the open holes, as `fingerings` lists them, for example
    /// "REG L3 R3 E_PAD"; all others are shut, and "" shuts all
    #[arg(long, value_name = "HOLES", conflicts_with_all = ["all", "written"])]
    open_holes: Option<String>,
    /// Table of the first N peaks instead of the curve, 1..30
    #[arg(long, value_name = "N", value_parser = |s: &str| whole::<u8>(s, 1, 30))]
    peaks: Option<u8>,
    /// Which model calculates the impedance
    #[arg(long, value_enum, default_value_t = Model::Lattice)]
    model: Model,
    /// Put the reed's equivalent volume in parallel, as when the clarinet is played
    #[arg(long)]
    reed_volume: bool,
    #[command(flatten)]
    range: CurveRange,
    #[command(flatten)]
    air: AirArg,
    #[command(flatten)]
    instrument: InstrumentArg,
    /// Resolution of the lattice [default: live]
    #[arg(long, value_enum)]
    quality: Option<QualityArg>,
    #[command(flatten)]
    table: TableArgs,
    #[command(flatten)]
    plot: PlotArgs,
}

impl ImpedanceCommand {
    pub fn run(&self) -> Result<(), Failure> {
        self.table.check_files(&[self.instrument.file()], &[self.plot.path()])?;
        let file = self.instrument.load()?;
        let given = self.open_holes.as_deref().map(|names| open_holes(names, &file)).transpose()?;
        let notes = self.notes.notes(&file)?;
        let of_chart = || notes.iter().filter_map(|&written| file.fingering(written));
        let fingerings: Vec<(Option<WrittenNote>, &[bool])> = match &given {
            Some(open) => vec![(None, open)],
            None => of_chart().map(|of| (Some(of.written), &of.open[..])).collect(),
        };
        let is_one = given.is_some() || self.notes.one().is_some();
        let (air, volume_m3) = (self.air.air(), if self.reed_volume { file.reed_volume_m3 } else { 0.0 });
        let steps = self.range.steps();
        if self.peaks.is_none() && !is_one {
            let right = "add --peaks 8 for the peaks of all notes, or choose one fingering with --written or --open-holes";
            return Err(Failure::Usage(format!("a table holds one curve only; {right}")));
        }
        let curve = self.peaks.is_none() || (is_one && self.plot.wanted());
        if !curve && self.range.is_given() {
            return Err(Failure::Usage(
                "--from, --to and --step are for a curve, and --peaks finds peaks wherever they are; leave them out, or draw the curve of one fingering, too: --plot, with --written or --open-holes"
                    .to_owned(),
            ));
        }
        if curve && !(0.0..=POINTS_MAX).contains(&steps) {
            return Err(Failure::Usage(format!(
                "--from {} --to {} --step {} is {} points; expected 1 to {POINTS_MAX}, with --to above --from",
                self.range.first_hz(),
                self.range.last_hz(),
                self.range.step_hz(),
                steps + 1.0
            )));
        }
        if self.model == Model::Tmm && self.quality.is_some() && !self.plot.wanted() {
            return Err(Failure::Usage(
                "--quality is the resolution of the lattice, and --model tmm is calculated without it; leave --quality out, or compare both models with --plot"
                    .to_owned(),
            ));
        }
        let about = format!(
            "{}; transposition {} semitones, {}, {} C, reed volume {} m3, Zc {:.6e} Pa s/m3",
            file.name,
            file.transposition,
            match (self.model, self.quality()) {
                (Model::Tmm, _) => "transfer matrices",
                (Model::Lattice, QualityArg::Live) => "lattice at 96 kHz",
                (Model::Lattice, QualityArg::High) => "lattice at 192 kHz",
            },
            air.temperature_c,
            volume_m3,
            air.z_c(file.nominal_radius_m)
        );
        let header = if self.peaks.is_some() {
            "written,written_midi,n,f_hz,mag_over_zc,q"
        } else {
            "f_hz,re_z_over_zc,im_z_over_zc"
        };
        let plot = self.plot.open(self.table.force())?;
        let bore = self.bore(&file)?;
        let mut table = self.table.open_beside(&plot, header)?;
        table.comment(format_args!("{about}"))?;
        for (note, open) in fingerings {
            if let Some(count) = self.peaks {
                let peaks = bore.peaks(open, volume_m3, usize::from(count));
                let note = note.map_or_else(|| ",".to_owned(), |note| format!("{},{}", named(note), note.0));
                for (n, Peak { f_hz, mag_over_zc, q, .. }) in (1..).zip(peaks) {
                    table.line(format_args!("{note},{n},{f_hz:.4},{mag_over_zc:.6},{q:.4}"))?;
                }
            } else {
                for (f_hz, z) in self.curve(&bore, open, volume_m3) {
                    table.line(format_args!("{f_hz},{:.8},{:.8}", z.re, z.im))?;
                }
            }
        }
        table.finish()?;
        let one = || self.notes.one().and_then(|written| file.fingering(written));
        plot.draw(|| match (&given, one()) {
            (Some(open), _) => self.fingering(&bore, &file, (None, open), volume_m3),
            (None, Some(of)) => self.fingering(&bore, &file, (Some(of.written), &of.open), volume_m3),
            (None, None) => self.chart(&bore, &file, &notes, volume_m3),
        })
    }

    fn quality(&self) -> QualityArg {
        self.quality.unwrap_or(QualityArg::Live)
    }

    /// Frequencies from first to last, and Z/Zc.
    fn curve<'a>(
        &'a self,
        bore: &'a Bore,
        open: &'a [bool],
        volume_m3: f64,
    ) -> impl Iterator<Item = (f64, Complex64)> + 'a {
        let steps = self.range.steps() as u32;
        (0..=steps).map(move |step| {
            let f_hz = self.range.first_hz() + f64::from(step) * self.range.step_hz();
            ((f_hz * 1e6).round() / 1e6, bore.impedance(f_hz, open, volume_m3))
        })
    }

    /// The figure of one fingering, with the other model beside the chosen one.
    fn fingering(
        &self,
        bore: &Bore,
        file: &InstrumentFile,
        (written, open): (Option<WrittenNote>, &[bool]),
        volume_m3: f64,
    ) -> Figure {
        let air = self.air.air();
        let count = usize::from(self.peaks.unwrap_or(30));
        let modes = bore.peaks(open, volume_m3, count);
        let mut curves =
            vec![Curve { name: bore.name().to_owned(), z: self.curve(bore, open, volume_m3).collect() }];
        let mut notes = vec![format!(
            "{:.0} C, {}; Zc of a bore {:.1} mm wide",
            air.temperature_c,
            if self.reed_volume { "with the reed's volume" } else { "without the reed's volume" },
            2e3 * file.nominal_radius_m
        )];
        let exact = TransferMatrix::new(file, air);
        let first = (open.iter().zip(&file.holes)).position(|(&open, hole)| open && !hole.register);
        let cutoff_hz = first.and_then(|hole| cutoff_hz(|f_hz| exact.reflectance_below(f_hz, open, hole)));
        // The lattice is made for one air, and takes a fit for an instrument of one's own: beside the transfer matrices
        // it is drawn only where it was asked for.
        if matches!(bore, Bore::Lattice(_)) {
            let exact = Bore::Tmm(exact);
            let theirs = exact.peaks(open, volume_m3, count);
            let range = self.range.first_hz()..=self.range.last_hz();
            let shown: Vec<&Peak> = modes.iter().filter(|mode| range.contains(&mode.f_hz)).collect();
            let apart: Vec<(f64, f64)> = shown
                .iter()
                .filter_map(|a| {
                    let b = partner(a, &modes, &theirs)?;
                    Some((cents(a.f_hz, b.f_hz).abs(), 20.0 * (a.mag_over_zc / b.mag_over_zc).log10().abs()))
                })
                .collect();
            if !apart.is_empty() {
                let mean =
                    |value: fn(&(f64, f64)) -> f64| apart.iter().map(value).sum::<f64>() / apart.len() as f64;
                let alone = match shown.len() - apart.len() {
                    0 => String::new(),
                    alone => format!("; {alone} more in the lattice alone"),
                };
                notes.push(format!(
                    "{}, lattice against transfer matrices: mean {:.1} cents, {:.2} dB{alone}",
                    counted(apart.len(), "mode"),
                    mean(|&(cents, _)| cents),
                    mean(|&(_, db)| db)
                ));
            }
            let z = self.curve(&exact, open, volume_m3).collect();
            curves.push(Curve { name: exact.name().to_owned(), z });
        }
        chalumeau_figure::impedance::fingering(&chalumeau_figure::impedance::FingeringImpedance {
            instrument: &file.name,
            notes,
            fingering: match written {
                Some(written) => format!("written {written}"),
                None => match self.open_holes.as_deref().unwrap_or_default() {
                    "" => "all holes shut".to_owned(),
                    names => format!("{names} open"),
                },
            },
            sounding_hz: written.map_or_else(
                || modes.first().map_or(1.0, |mode| mode.f_hz),
                |written| sounding_hz(file, written),
            ),
            pitch: if written.is_some() { "the note" } else { "the lowest peak" },
            curves,
            modes,
            cutoff_hz,
        })
    }

    /// The figure of the peaks of all notes.
    fn chart(&self, bore: &Bore, file: &InstrumentFile, notes: &[WrittenNote], volume_m3: f64) -> Figure {
        let count = usize::from(self.peaks.unwrap_or(8));
        let rows: Vec<NotePeaks> = notes
            .iter()
            .filter_map(|&written| file.fingering(written))
            .map(|of| NotePeaks {
                written: of.written,
                sounding_hz: sounding_hz(file, of.written),
                // The one that sounds shall be among them, also where a model has more peaks below it.
                peaks: bore.peaks(&of.open, volume_m3, count.max(of.mode + MORE)),
                shown: count,
            })
            .collect();
        let about = format!(
            "{}, {:.0} C, {}",
            bore.name(),
            self.air.air().temperature_c,
            if self.reed_volume {
                "with the reed's volume"
            } else {
                "without the reed's volume, which lowers them"
            }
        );
        chalumeau_figure::impedance::chart(&file.name, vec![about], &rows)
    }

    fn bore(&self, file: &InstrumentFile) -> Result<Bore, Failure> {
        if self.model == Model::Tmm {
            return Ok(Bore::Tmm(TransferMatrix::new(file, self.air.air())));
        }
        if !self.air.is_reference() {
            let right = "leave --temperature out or add --model tmm";
            return Err(Failure::Usage(format!("the lattice is made for air of 25 C; {right}")));
        }
        Ok(Bore::Lattice(self.instrument.bore(file, 48_000, self.quality())?))
    }
}

/// Peaks that a model may have below the one that sounds, beyond those that the instrument's file counts.
const MORE: usize = 3;

/// Peaks of two models that are farther apart are not the same one, cents: a hump that is double in one model is single in the other.
const PARTNERS_CENTS: f64 = 50.0;

/// The peak of another model that is this one: each is the nearest to the other.
fn partner<'a>(peak: &Peak, ours: &[Peak], theirs: &'a [Peak]) -> Option<&'a Peak> {
    let nearest = nearest(peak.f_hz, theirs)?;
    let is_mutual = self::nearest(nearest.f_hz, ours).is_some_and(|back| back.f_hz == peak.f_hz);
    (is_mutual && cents(peak.f_hz, nearest.f_hz).abs() <= PARTNERS_CENTS).then_some(nearest)
}

/// The peak nearest to a frequency, by interval.
fn nearest(f_hz: f64, peaks: &[Peak]) -> Option<&Peak> {
    let apart = |peak: &Peak| cents(peak.f_hz, f_hz).abs();
    peaks.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)))
}

enum Bore {
    Tmm(TransferMatrix),
    Lattice(Arc<instrument::Model>),
}

impl Bore {
    fn name(&self) -> &'static str {
        match self {
            Self::Tmm(_) => "transfer matrices",
            Self::Lattice(_) => "lattice that sounds",
        }
    }

    fn impedance(&self, f_hz: f64, open: &[bool], volume_m3: f64) -> Complex64 {
        match self {
            Self::Tmm(model) => model.impedance(f_hz, open, volume_m3),
            Self::Lattice(model) => {
                let z_c = model.air.z_c(model.file.nominal_radius_m);
                beside_reed(lattice(model, f_hz, open), f_hz, volume_m3, z_c, &model.air)
            }
        }
    }

    fn peaks(&self, open: &[bool], volume_m3: f64, count: usize) -> Vec<Peak> {
        match self {
            Self::Tmm(model) => model.peaks(open, volume_m3, count),
            Self::Lattice(_) => find_peaks(|f_hz| self.impedance(f_hz, open, volume_m3), count),
        }
    }
}

/// Pitch of a note at A4 = 440 Hz, Hz. Every note of an instrument file has a sounding pitch.
fn sounding_hz(file: &InstrumentFile, written: WrittenNote) -> f64 {
    written.sounding(file.transposition).unwrap_or(SoundingNote(written.0)).frequency_hz(440.0)
}

fn lattice(model: &instrument::Model, f_hz: f64, open: &[bool]) -> Complex64 {
    let opening: Vec<f64> = open.iter().map(|&open| f64::from(u8::from(open))).collect();
    model.coeffs.impedance(f_hz, &opening)
}

/// Z/Zc with a volume in parallel, `z_c` the Zc.
fn beside_reed(z: Complex64, f_hz: f64, volume_m3: f64, z_c: f64, air: &Air) -> Complex64 {
    let compliance = volume_m3 / (air.rho * air.c * air.c);
    z / (1.0 + z * Complex64::I * TAU * f_hz * compliance * z_c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_double_hump_has_one_partner() {
        let peaks = |all: &[f64]| -> Vec<Peak> {
            all.iter().map(|&f_hz| Peak { f_hz, mag_over_zc: 1.0, q: 10.0 }).collect()
        };
        let (ours, theirs) = (peaks(&[500.0, 1200.0, 1215.0, 1600.0]), peaks(&[501.0, 1210.0, 1700.0]));
        let found: Vec<_> =
            ours.iter().map(|peak| partner(peak, &ours, &theirs).map(|peak| peak.f_hz)).collect();
        assert_eq!(found, [Some(501.0), None, Some(1210.0), None]);
    }
}
