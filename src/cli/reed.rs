//! `chalumeau reed`: the tables and the flow law that sound, knob and firmware share, and their figures.

use crate::cli::Failure;
use crate::cli::csv_table::TableArgs;
use crate::cli::files;
use crate::cli::progress_bar::progress;
use crate::cli::reed_physical::{self, PhysicalReedArgs};
use crate::cli::shared_args::{PlayedArgs, note, sounding, within};
use crate::picture_file::PictureFile;
use chalumeau_core::instrument::Settings;
use chalumeau_core::measure::steady_period;
use chalumeau_core::reed::PhysicalReed;
use chalumeau_core::reed::ReedLaw;
use chalumeau_core::reed::ReedTables;
use chalumeau_core::reed::law::K_INIT;
use chalumeau_core::reed::physical::{DimensionlessReed, P_REF_PA, ZETA_REFERENCE};
use chalumeau_core::units::REFERENCE_RADIUS_M;
use chalumeau_core::units::WrittenNote;
use chalumeau_figure::Figure;
use chalumeau_figure::draw::Size;
use chalumeau_figure::reed::LawFigure;
use chalumeau_figure::reed_orbit::ReedOrbit;
use chalumeau_figure::reed_sweep::reed_sweep;
use clap::{Args, ValueEnum};
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  chalumeau reed --table --csv tables.csv
  chalumeau reed --law                        the reference reed
  chalumeau reed --law --H 3                  wider; k follows so that the peak flow stays 1
  chalumeau reed --law --H 3 --k 0.3849       wider, as stiff as before
  chalumeau reed --physical --H 3             the same reed in N/m and mm
  chalumeau reed --physical --reed-stiffness 1500 --reed-opening 0.6
  chalumeau reed --figure coupled --out coupled.svg
  chalumeau reed --figure orbit --written G4 --gamma 0.7 --out orbit.png
  chalumeau reed --figure sweep --out sweep.gif
  chalumeau reed --figure all --out figures   into a directory";

/// Host rate at which the note of the orbit is played, Hz.
const RATE: u32 = 48_000;
/// Note and mouth pressure of the orbit, unless others are given.
const ORBIT_NOTE: WrittenNote = WrittenNote(60);
const ORBIT_GAMMA: f64 = 0.8;
/// Frames of the sweep and how long each stands, s: ten seconds, smooth enough for the eye.
const FRAMES: usize = 199;
const FRAME_S: f64 = 0.05;

/// Said where an instrument would do nothing.
const IDLE_INSTRUMENT: &str =
    "--instrument, --quality and --untuned are for the orbit; leave them out, or take --figure orbit";

/// The figures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Which {
    /// The law with opening, stiffness and closing pressure 1, over -0.1..1
    Unit,
    /// The same over 0..360 degrees, normalised
    Angle,
    /// Rest openings H
    FamilyH,
    /// Stiffnesses k
    FamilyK,
    /// Openings with the stiffness that keeps the peak at 1
    Coupled,
    /// Amplitudes A
    Amplitude,
    /// Flow and opening when the air flows back
    Negative,
    /// Reeds in kPa and litres a second
    Physical,
    /// Animated: H from 5 to 2 with its stiffness (.gif)
    Sweep,
    /// One period of a played note over the curve of the reed
    Orbit,
    /// All of them, into a directory
    All,
}

/// File format of figures in a directory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Png,
    Svg,
    Json,
}

/// Print the reed's tables or flow law, or draw figures of them
///
/// The flow through a reed grows with the root of the pressure difference until the pressure closes the slit faster than
/// it drives the air: u = A (H sqrt(p) - p^1.5 / k), zero from p = H k on. p is the pressure difference over the closing
/// pressure of the reference reed.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
#[group(id = "what", required = true, multiple = false, args = ["table", "law", "physical", "figure"])]
pub struct ReedCommand {
    /// The 3601 table entries: i,p,x_a,x_b,sgn with x_a = sqrt(p), x_b = p^1.5
    #[arg(long)]
    table: bool,
    /// The flow law: p,u from p = -1 to beyond closure
    #[arg(long)]
    law: bool,
    /// Both descriptions of the reed: H, k, A and zeta; stiffness, area, width and opening
    #[arg(long)]
    physical: bool,
    /// A figure; needs --out
    #[arg(long, value_enum, value_name = "FIGURE", requires = "out")]
    figure: Option<Which>,
    /// Rest opening H, dimensionless, 0.5..10 [default: sqrt(27)/2]
    #[arg(long = "H", value_name = "H", conflicts_with_all = ["table", "figure"], value_parser = |s: &str| within(s, 0.5, 10.0))]
    h: Option<f64>,
    /// Stiffness k, dimensionless, 0.01..20 [default: 27/(4 H^3), which makes the peak flow A]
    #[arg(long = "k", value_name = "K", conflicts_with_all = ["table", "figure"], value_parser = |s: &str| within(s, 0.01, 20.0))]
    k: Option<f64>,
    /// Amplitude A of the flow, 0..10 [default: 1]
    #[arg(long = "A", value_name = "A", conflicts_with_all = ["table", "figure"], value_parser = |s: &str| within(s, 0.0, 10.0))]
    a: Option<f64>,
    // Before those under a heading, which would be its own, too.
    #[command(flatten)]
    table_args: TableArgs,
    #[command(flatten)]
    measured: PhysicalReedArgs,
    #[command(flatten)]
    drawing: Drawing,
}

/// Where a figure goes, and what the orbit plays.
#[derive(Args)]
#[command(next_help_heading = "Figures")]
struct Drawing {
    /// A new .png or .svg file (.json for its data, .gif for the sweep), or a directory; --figure all makes it if it does not exist
    #[arg(long, value_name = "PATH", requires = "figure", conflicts_with_all = ["table", "law", "physical"])]
    out: Option<PathBuf>,
    /// Kind of file made in a directory [default: png]
    #[arg(long, value_enum, value_name = "KIND", requires = "figure", conflicts_with_all = ["table", "law", "physical"])]
    format: Option<Format>,
    /// Size of a figure, pixels, 400..4000 each way, for example 1600x1000 [default: depends on the figure]
    #[arg(long, value_name = "WxH", requires = "figure", conflicts_with_all = ["table", "law", "physical"])]
    size: Option<Size>,
    /// Written note of the orbit: a MIDI number (60) or a name [default: C4]
    #[arg(long, value_name = "NOTE", requires = "figure", conflicts_with_all = ["table", "law", "physical"], value_parser = note)]
    written: Option<u8>,
    /// Mouth pressure of the orbit over closing pressure, 0..3 [default: 0.8]
    #[arg(long, value_name = "G", requires = "figure", conflicts_with_all = ["table", "law", "physical"], value_parser = |s: &str| within(s, 0.0, 3.0))]
    gamma: Option<f64>,
    /// Embouchure of the orbit, or of --physical: flow strength of the reed, 0.05..0.9 [default: 0.3]
    #[arg(long, value_name = "ZETA", conflicts_with_all = ["table", "law"], value_parser = |s: &str| within(s, 0.05, 0.9))]
    zeta: Option<f64>,
    #[command(flatten)]
    instrument: PlayedArgs,
}

impl Which {
    fn kind(self) -> Option<LawFigure> {
        match self {
            Self::Unit => Some(LawFigure::Unit),
            Self::Angle => Some(LawFigure::Angle),
            Self::FamilyH => Some(LawFigure::FamilyH),
            Self::FamilyK => Some(LawFigure::FamilyK),
            Self::Coupled => Some(LawFigure::Coupled),
            Self::Amplitude => Some(LawFigure::Amplitude),
            Self::Negative => Some(LawFigure::Negative),
            Self::Physical => Some(LawFigure::Physical),
            Self::Sweep | Self::Orbit | Self::All => None,
        }
    }

    /// As on the command line.
    fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

/// Whether who gives a name with this ending means a file.
fn is_of_a_file(ending: &OsStr) -> bool {
    ["png", "svg", "json", "gif"].iter().any(|of| ending.eq_ignore_ascii_case(of))
}

impl Drawing {
    fn zeta(&self) -> f64 {
        self.zeta.unwrap_or(ZETA_REFERENCE)
    }

    /// The file of one figure, open before anything is measured.
    fn sheet(&self, which: Which, out: &Path, force: bool) -> Result<(Which, PictureFile), Failure> {
        let mut path = out.to_owned();
        if out.is_dir() {
            let ending = match (which, self.format.unwrap_or(Format::Png)) {
                (Which::Sweep, _) => "gif",
                (_, Format::Png) => "png",
                (_, Format::Svg) => "svg",
                (_, Format::Json) => "json",
            };
            path.push(format!("reed-{}.{ending}", which.name()));
        }
        let sheet = match which {
            Which::Sweep => PictureFile::moving(&path, force, self.size)?,
            _ => PictureFile::still(&path, force, self.size)?,
        };
        Ok((which, sheet))
    }

    fn run(&self, which: Which, out: &Path, force: bool) -> Result<(), Failure> {
        let wanted: Vec<Which> = match which {
            Which::All if out.is_file() || out.extension().is_some_and(is_of_a_file) => {
                return Err(Failure::Usage(format!(
                    "--figure all makes ten files; --out must be a directory, got {}",
                    out.display()
                )));
            }
            Which::All => Which::value_variants().iter().copied().filter(|&w| w != Which::All).collect(),
            one => vec![one],
        };
        let of_the_orbit = self.written.is_some() || self.gamma.is_some() || self.zeta.is_some();
        if of_the_orbit && !wanted.contains(&Which::Orbit) {
            return Err(Failure::Usage(format!(
                "--written, --gamma and --zeta are for the orbit, which --figure {} does not draw; leave them out, or take --figure orbit",
                which.name()
            )));
        }
        if self.instrument.is_given() && !wanted.contains(&Which::Orbit) {
            return Err(Failure::Usage(IDLE_INSTRUMENT.to_owned()));
        }
        if self.format.is_some() && which != Which::All && !out.is_dir() {
            return Err(Failure::Usage(format!(
                "--format is for files in a directory; {} is a file, whose name says what it is",
                out.display()
            )));
        }
        files::keep_apart(files::READ, &[self.instrument.instrument.file()], &[Some(out)])?;
        let orbit = wanted.contains(&Which::Orbit).then(|| self.prepare_orbit()).transpose()?;
        if which == Which::All {
            fs::create_dir_all(out).map_err(|source| Failure::Folder { path: out.to_owned(), source })?;
        }
        let sheets =
            wanted.iter().map(|&which| self.sheet(which, out, force)).collect::<Result<Vec<_>, _>>()?;
        let orbit = orbit.map(|play| play()).transpose()?;
        let warn = |sheet: &PictureFile, figure: &Figure| {
            if let Some(warning) = sheet.too_small_for(figure) {
                say!("warning: {}: {warning}", sheet.path().display());
            }
        };
        for (which, sheet) in sheets {
            let path = sheet.path().to_owned();
            let still = match (which.kind(), &orbit) {
                (Some(kind), _) => Some(kind.figure()?),
                (None, Some(orbit)) if which == Which::Orbit => Some(orbit.figure()),
                _ => None,
            };
            match still {
                Some(figure) => {
                    warn(&sheet, &figure);
                    sheet.draw(&figure)?;
                }
                None => {
                    let frames = reed_sweep(FRAMES)?;
                    frames.iter().take(1).for_each(|figure| warn(&sheet, figure));
                    let bar = progress(FRAMES);
                    sheet.animate(&frames, FRAME_S, || bar.inc(1))?;
                    bar.finish_and_clear();
                }
            }
            say!("{}: drawn", path.display());
        }
        Ok(())
    }

    /// Checks the arguments of the orbit; the returned function plays it.
    fn prepare_orbit(&self) -> Result<impl FnOnce() -> Result<ReedOrbit, Failure> + '_, Failure> {
        let file = self.instrument.load()?;
        let written = self.written.map_or(ORBIT_NOTE, WrittenNote);
        let gamma = self.gamma.unwrap_or(ORBIT_GAMMA);
        let zeta = self.zeta();
        let sounding = sounding(&file, written)?;
        Ok(move || {
            let breath_full_kpa = 20.0;
            let settings =
                Settings { zeta: zeta as f32, noise: 0.0, breath_full_kpa, ..Settings::physical() };
            let name = file.name.clone();
            let model = self.instrument.model(file, RATE, settings.a4_hz)?;
            let period = steady_period::measure(&model, &settings, sounding, gamma as f32, RATE).ok_or_else(|| {
                Failure::Usage(format!(
                    "written {written} does not sound at gamma {gamma} and zeta {zeta}; `chalumeau threshold` and `chalumeau \
                     bifurcation` show where it does"
                ))
            })?;
            let law = settings.reed_law();
            let flow_unit_m3s = P_REF_PA / model.air.z_c(model.file.nominal_radius_m);
            Ok(ReedOrbit {
                title: format!("{name}, written {written}"),
                note: format!(
                    "gamma {gamma}, zeta {zeta}, lay {}; {:.1} Hz. The reed has inertia and damping, so it leaves its curve.",
                    settings.lay, period.f_hz
                ),
                closing_pa: settings.closing_pa(),
                peak_m3s: K_INIT * zeta * law.peak_flow() * flow_unit_m3s,
                lay: f64::from(settings.lay),
                gamma: period.gamma,
                step_s: period.step_s,
                period: period.moments,
            })
        })
    }
}

impl ReedCommand {
    pub fn run(&self) -> Result<(), Failure> {
        let tables = ReedTables::reference();
        if (self.table || self.figure.is_some()) && self.measured.reed(REFERENCE_RADIUS_M).is_some() {
            return Err(Failure::Usage(
                "a reed as measured is for --law and --physical; leave --reed-stiffness, --reed-area, --reed-width and --reed-opening out"
                    .to_owned(),
            ));
        }
        if let (Some(which), Some(out)) = (self.figure, &self.drawing.out) {
            if self.table_args.to_file() {
                return Err(Failure::Usage(
                    "--csv goes with --table or --law; a figure goes to --out".to_owned(),
                ));
            }
            return self.drawing.run(which, out, self.table_args.force());
        }
        if self.drawing.instrument.is_given() {
            return Err(Failure::Usage(IDLE_INSTRUMENT.to_owned()));
        }
        if self.table {
            let mut table = self.table_args.open("i,p,x_a,x_b,sgn")?;
            let columns =
                tables.x.iter().zip(tables.x_a.iter()).zip(tables.x_b.iter()).zip(tables.sgn.iter());
            for (i, (((p, x_a), x_b), sgn)) in columns.enumerate() {
                table.line(format_args!("{i},{p},{x_a},{x_b},{sgn}"))?;
            }
            return table.finish();
        }
        let (reference, a) = (PhysicalReed::reference(), self.a.unwrap_or(1.0));
        let measured = self.measured.reed(REFERENCE_RADIUS_M);
        if measured.is_some() && a == 0.0 {
            return Err(Failure::Usage(
                "with --A 0 no air flows through a measured reed; give a larger A".to_owned(),
            ));
        }
        let measured = measured.map(|reed| reed.dimensionless(&reference, a));
        let h = measured.map(|seed| seed.h).or(self.h).unwrap_or(ReedLaw::default().h());
        let law = match measured.map(|seed| seed.k).or(self.k) {
            Some(k) => ReedLaw::free(h, k, a)?,
            None => ReedLaw::coupled(h, a)?,
        };
        if self.physical {
            let zeta = self.drawing.zeta();
            let seed = measured.unwrap_or(DimensionlessReed { h, k: law.k(), a, zeta, area: 1.0 });
            let reed = PhysicalReed::from_dimensionless(&seed, &reference);
            let lay = f64::from(Settings::default().lay);
            return reed_physical::both_faces(&seed, &reed, lay, &self.table_args);
        }
        let mut table = self.table_args.open("p,u")?;
        table.comment(format_args!(
            "H = {}, k = {}, A = {}: peak flow {:.6} at p = {:.6}, closed from p = {:.6}",
            law.h(),
            law.k(),
            law.a(),
            law.peak_flow(),
            law.peak_at(),
            law.closing()
        ))?;
        // From the blown-open side to a fifth beyond closure, fine enough to plot.
        let steps = (1000.0 * (1.0 + 1.2 * law.closing())).ceil() as i32;
        for step in 0..=steps {
            let p = f64::from(step - 1000) / 1000.0;
            table.line(format_args!("{p},{}", law.flow(tables, p)))?;
        }
        table.finish()
    }
}
