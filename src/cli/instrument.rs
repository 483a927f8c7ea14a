//! `chalumeau instrument`: makes, imports, checks and shows instrument files.

use crate::cli::Failure;
use crate::cli::csv_table::{TableArgs, named, quoted};
use crate::cli::files::{self, MaybeFile};
use crate::cli::shared_args::{AirArg, InstrumentArg, counted, note, whole, within};
use crate::output::NewFile;
use crate::text_file;
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::check::{Check, Concern, NoteCheck};
use chalumeau_core::bore::cylinder::Cylinder;
use chalumeau_core::bore::instrument_file::{BoreSegment, ImportDetails, ImportError, InstrumentFile, Sheet};
use chalumeau_core::instrument::concert_pitch::A4_HZ;
use chalumeau_core::units::{Air, WrittenNote};
use clap::{Args, Subcommand};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const EXAMPLES: &str = "\
Examples:
  chalumeau instrument import --bore bore.csv --holes holes.csv --fingerings chart.csv --name \"My clarinet\" --out my.toml
  chalumeau instrument check my.toml
  chalumeau instrument show my.toml
  chalumeau instrument new --notes \"D3 E3 F3\" --diameter-mm 14.9 --out cylinder.toml
  chalumeau instrument new --scale 1.5 --transposition 9 --out alto.toml
  chalumeau render --instrument my.toml --written C4 --gamma 0.5 --seconds 1.5 --out c4.wav";

/// Make, import, check or show an instrument file
///
/// An instrument is one TOML file: bore, tone holes and fingering chart in millimetres (docs/instrument-file.md). Commands
/// that play or measure take it with --instrument.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct InstrumentCommand {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    Import(Box<Import>),
    Check(CheckFile),
    New(Box<New>),
    Show(Show),
}

impl InstrumentCommand {
    pub fn run(&self) -> Result<ExitCode, Failure> {
        match &self.what {
            What::Import(import) => import.run().map(|()| ExitCode::SUCCESS),
            What::Check(check) => check.run(),
            What::New(new) => new.run().map(|()| ExitCode::SUCCESS),
            What::Show(show) => show.run().map(|()| ExitCode::SUCCESS),
        }
    }
}

/// Output file, name and transposition, for `import` and `new`.
#[derive(Args)]
struct NewInstrument {
    /// Instrument file to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Replace an existing file
    #[arg(long)]
    force: bool,
    /// Name of the instrument
    #[arg(long, value_name = "TEXT")]
    name: Option<String>,
    /// Semitones it sounds below what is written: B flat 2, A 3, E flat -3, bass 14
    #[arg(long, value_name = "N", value_parser = |s: &str| whole::<i8>(s, -12, 36))]
    transposition: Option<i8>,
}

impl NewInstrument {
    /// Refuses a name for it that cannot be meant. `read` is what the command reads.
    fn check_files(&self, read: &[MaybeFile]) -> Result<(), Failure> {
        files::check(files::READ, read, &[Some(&self.out)], self.force)
    }

    /// Writes the instrument, after a check that it can be read again; then prints a summary and warnings for this A4, Hz.
    fn write(&self, file: &InstrumentFile, a4_hz: f64) -> Result<(), Failure> {
        let text = file.to_toml();
        // A scaled or calculated instrument may be outside the limits of the format.
        InstrumentFile::parse(&text)
            .map_err(|source| Failure::InstrumentFile { path: self.out.clone(), source })?;
        let mut out = NewFile::create(&self.out, self.force)?;
        out.write_all(text.as_bytes())?;
        out.keep()?;
        say!(
            "{}: {}, bore {:.1} mm, {}, {} {} to {}",
            self.out.display(),
            file.name,
            1e3 * file.length_m(),
            counted(file.holes.len(), "hole"),
            counted(file.fingerings.len(), "note"),
            file.lowest(),
            file.highest()
        );
        for concern in Check::new(file, Air::default(), a4_hz).concerns {
            say!("warning: {concern}");
        }
        Ok(())
    }
}

/// Make an instrument file from three CSV tables
///
/// The tables have one line for each cone of the bore, each tone hole and each note. The first line names the columns;
/// lines that begin with # are comments. Column names contain the unit, and radius or diameter: bore x_start_m, x_end_m, r_start_m, r_end_m [part];
/// holes hole, x_m, hole_radius_m, chimney_height_m [kind, register, description]; fingerings written_note and
/// one column of 0 (closed) and 1 (open) for each hole [register, mode, fingers, sounding_note]. Any length may be in _mm, any radius
/// a diameter (diameter_start_mm).
#[derive(Args)]
struct Import {
    /// Table of the bore
    #[arg(long, value_name = "CSV")]
    bore: PathBuf,
    /// Table of the tone holes
    #[arg(long, value_name = "CSV")]
    holes: PathBuf,
    /// Fingering chart
    #[arg(long, value_name = "CSV")]
    fingerings: PathBuf,
    /// Where the measurements come from [default: the comments at the head of the bore's table]
    #[arg(long, value_name = "TEXT")]
    source: Option<String>,
    /// Volume of air that moves with the reed, mm3: 0, or 20..20000
    #[arg(long, value_name = "MM3", default_value = "1200", value_parser = |s: &str| within(s, 0.0, 20_000.0))]
    reed_volume: f64,
    /// Bore that zeta and the reed's size refer to, mm, 1..200 [default: 14.9, a B flat clarinet's]
    #[arg(long, value_name = "MM", value_parser = |s: &str| within(s, 1.0, 200.0))]
    nominal_diameter_mm: Option<f64>,
    #[command(flatten)]
    new: NewInstrument,
}

impl Import {
    fn run(&self) -> Result<(), Failure> {
        self.new.check_files(&[Some(&self.bore), Some(&self.holes), Some(&self.fingerings)])?;
        let read = |path: &Path| {
            text_file::read(path).map_err(|source| Failure::Read { path: path.to_owned(), source })
        };
        let texts = [read(&self.bore)?, read(&self.holes)?, read(&self.fingerings)?];
        let names = [&self.bore, &self.holes, &self.fingerings].map(|path| path.display().to_string());
        let [bore, holes, fingerings] =
            [0, 1, 2].map(|table| Sheet { name: &names[table], text: &texts[table] });
        let stem = || self.new.out.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let details = ImportDetails {
            name: self.new.name.clone().or_else(stem).unwrap_or_default(),
            source: self.source.clone().unwrap_or_else(|| head_comments(bore.text)),
            transposition: self.new.transposition,
            reed_volume_mm3: self.reed_volume,
            nominal_diameter_mm: self.nominal_diameter_mm,
        };
        let file = InstrumentFile::from_csv(bore, holes, fingerings, &details)?;
        self.new.write(&file, A4_HZ)?;
        if self.nominal_diameter_mm.is_none() {
            self.say_nominal_diameter(&file);
        }
        Ok(())
    }

    /// Says which bore zeta and the reed's size refer to. The file does not tell which of its cones a maker would name.
    fn say_nominal_diameter(&self, file: &InstrumentFile) {
        let length_m = |cone: &BoreSegment| cone.x_end_m - cone.x_start_m;
        let longest = file.bore.iter().max_by(|a, b| length_m(a).total_cmp(&length_m(b)));
        let Some(longest) = longest else { return };
        let (taken_mm, wide_mm) = (2e3 * file.nominal_radius_m, 1e3 * (longest.r_start_m + longest.r_end_m));
        say!(
            "note: zeta and the reed's size refer to a bore of {taken_mm:.1} mm, a B flat clarinet's; the longest part of this one is \
             {wide_mm:.1} mm wide, see --nominal-diameter-mm"
        );
    }
}

/// A note whose resonance is farther away is another one.
const FAR_CENTS: f64 = 300.0;

/// The comments a table begins with.
fn head_comments(text: &str) -> String {
    let lines: Vec<&str> = text
        .lines()
        .map_while(|line| line.trim_start_matches('\u{feff}').strip_prefix('#'))
        .map(str::trim)
        .collect();
    lines.join("\n")
}

/// Check an instrument file for mistakes
///
/// Prints for every note the resonance it plays on (with the reed's volume) and its distance from equal temperament, then
/// warnings. The exit code is 2 if the instrument cannot be played, else 0, with or without warnings.
///
/// Columns: written,written_midi,register,mode,wanted_hz,peak_hz,cents,mag_over_zc,q.
#[derive(Args)]
struct CheckFile {
    #[command(flatten)]
    which: Which,
    /// Pitch of A4, Hz, 380..500
    #[arg(long, value_name = "HZ", default_value = "440", value_parser = |s: &str| within(s, 380.0, 500.0))]
    a4: f64,
    #[command(flatten)]
    air: AirArg,
    #[command(flatten)]
    table: TableArgs,
}

impl CheckFile {
    fn run(&self) -> Result<ExitCode, Failure> {
        self.table.check_files(&[self.which.file()], &[])?;
        let file = self.which.load()?;
        let check = Check::new(&file, self.air.air(), self.a4);
        let mut table =
            self.table.open("written,written_midi,register,mode,wanted_hz,peak_hz,cents,mag_over_zc,q")?;
        table.comment(format_args!("{}, reed volume {:.0} mm3", file.name, 1e9 * file.reed_volume_m3))?;
        for note in &check.notes {
            let register = file.fingering(note.written).map_or("", |fingering| fingering.register.as_str());
            let peak = match (note.peak, note.cents) {
                (Some(peak), Some(cents)) => {
                    format!("{:.2},{cents:+.1},{:.2},{:.1}", peak.f_hz, peak.mag_over_zc, peak.q)
                }
                _ => "nan,nan,nan,nan".to_owned(),
            };
            table.line(format_args!(
                "{},{},{register},{},{:.2},{peak}",
                named(note.written),
                note.written.0,
                note.mode,
                note.wanted_hz
            ))?;
        }
        table.finish()?;
        for concern in &check.concerns {
            let weight = if concern.is_fatal() { "error" } else { "warning" };
            say!("{weight}: {concern}");
        }
        let is_said = |concern: &Concern| matches!(concern, Concern::AllOff { .. });
        if let Some(cents) = check.common_cents().filter(|_| !check.concerns.iter().any(is_said)) {
            let how = if cents > 0.0 { "sharp" } else { "flat" };
            say!(
                "note: nearly all resonances are some {:.0} cents {how}; look at the length of the bore, the reed's volume and --a4",
                cents.abs()
            );
        }
        let (named, count) = (self.which.named(&file), check.concerns.len());
        if !check.is_usable() {
            say!("{named}: cannot be played");
            return Ok(ExitCode::from(2));
        }
        super::fingerings::say_contrary(&file);
        // A resonance so far away is not the note's.
        let is_far = |note: &NoteCheck| note.cents.is_none_or(|cents| cents.abs() > FAR_CENTS);
        let but = if check.notes.iter().all(is_far) { ", but probably no note will speak" } else { "" };
        say!("{named}: can be loaded, {}{but}; `chalumeau tune` plays its notes", counted(count, "warning"));
        Ok(ExitCode::SUCCESS)
    }
}

/// Make an instrument: a cylinder that plays given notes, or another one scaled
///
/// With --notes: the lowest note sounds with every hole closed, each further one opens the next hole from the bell; length
/// and holes are placed so that the resonances, with the reed's volume, are in tune. A note that is played lies some 20 to 50 cents lower:
/// `chalumeau tune --untuned` shows by how much, and commands that play the file correct it, as `chalumeau tune` shows. With --scale: every length is X times as large, so that all frequencies are X times lower; set
/// --transposition for how the instrument is then read.
#[derive(Args)]
#[group(id = "kind", required = true, multiple = false, args = ["notes", "scale"])]
struct New {
    /// Notes of a cylinder, lowest first, e.g. "D3 E3 F3"
    #[arg(long, value_name = "NOTES")]
    notes: Option<String>,
    /// Scale factor, 0.2..5; 1.5 is a fifth lower. The limits of the file format may allow less: the B flat clarinet can be
    /// scaled by 0.26 to 2.55
    #[arg(long, value_name = "X", value_parser = |s: &str| within(s, LIMITS_OF_SCALE[0], LIMITS_OF_SCALE[1]))]
    scale: Option<f64>,
    /// Bore of the cylinder, mm, 4..60
    #[arg(long, value_name = "MM", default_value = "14.9", conflicts_with = "scale", value_parser = |s: &str| within(s, 4.0, 60.0))]
    diameter_mm: f64,
    /// Tone holes of the cylinder, mm, 1..40
    #[arg(long, value_name = "MM", default_value = "8", conflicts_with = "scale", value_parser = |s: &str| within(s, 1.0, 40.0))]
    hole_mm: f64,
    /// Height of its chimneys, mm, 1..50
    #[arg(long, value_name = "MM", default_value = "8", conflicts_with = "scale", value_parser = |s: &str| within(s, 1.0, 50.0))]
    chimney_mm: f64,
    /// Give the cylinder a register hole this wide, mm, 0.5..6, and the twelfths of its notes
    #[arg(long, value_name = "MM", conflicts_with = "scale", value_parser = |s: &str| within(s, 0.5, 6.0))]
    vent_mm: Option<f64>,
    /// Volume of air that moves with the reed of the cylinder, mm3: 0, or 20..20000
    #[arg(long, value_name = "MM3", default_value = "1200", conflicts_with = "scale", value_parser = |s: &str| within(s, 0.0, 20_000.0))]
    reed_volume: f64,
    /// Pitch of A4 the cylinder is made for, Hz, 380..500
    #[arg(long, value_name = "HZ", default_value = "440", conflicts_with = "scale", value_parser = |s: &str| within(s, 380.0, 500.0))]
    a4: f64,
    #[command(flatten)]
    from: InstrumentArg,
    #[command(flatten)]
    new: NewInstrument,
}

impl New {
    fn run(&self) -> Result<(), Failure> {
        self.new.check_files(&[self.from.file()])?;
        if self.notes.is_some() && self.from.path().is_some() {
            let right = "leave it out, or give --scale in place of --notes";
            return Err(Failure::Usage(format!(
                "--instrument names what --scale makes larger or smaller; {right}"
            )));
        }
        let file = match (&self.notes, self.scale) {
            (Some(notes), _) => self.cylinder(notes)?,
            (None, Some(factor)) => self.scaled(factor)?,
            (None, None) => {
                return Err(Failure::Usage("one of --notes and --scale must be given".to_owned()));
            }
        };
        self.new.write(&file, self.a4)
    }

    fn cylinder(&self, notes: &str) -> Result<InstrumentFile, Failure> {
        let notes = notes
            .split([' ', ','])
            .filter(|name| !name.is_empty())
            .map(|name| {
                note(name).map(WrittenNote).map_err(|why| Failure::Usage(format!("--notes: {name:?} {why}")))
            })
            .collect::<Result<Vec<_>, _>>()?;
        let cylinder = Cylinder {
            name: self.new.name.clone().unwrap_or_else(|| format!("Cylinder of {} mm", self.diameter_mm)),
            notes,
            transposition: self.new.transposition.unwrap_or(0),
            a4_hz: self.a4,
            radius_m: self.diameter_mm / 2e3,
            hole_radius_m: self.hole_mm / 2e3,
            chimney_m: self.chimney_mm / 1e3,
            vent_radius_m: self.vent_mm.map(|mm| mm / 2e3),
            reed_volume_m3: self.reed_volume / 1e9,
        };
        Ok(cylinder.build(Air::default())?)
    }

    fn scaled(&self, factor: f64) -> Result<InstrumentFile, Failure> {
        let original = self.from.load()?;
        let fits = |factor: f64| InstrumentFile::parse(&original.scaled(factor).to_toml());
        if let Err(why) = fits(factor) {
            let [least, most] = LIMITS_OF_SCALE.map(|limit| nearest_to_limit(limit, |f| fits(f).is_ok()));
            // What a person who typed the number may have meant does not help here.
            let why = why.to_string();
            let why = why.split("; this looks like").next().unwrap_or_default();
            return Err(Failure::Usage(format!(
                "--scale {factor} makes an instrument that no file can hold: {why}; this instrument can be scaled by {least} to {most}"
            )));
        }
        let mut file = original.scaled(factor);
        file.name = self.new.name.clone().unwrap_or_else(|| format!("{} x {factor}", original.name));
        file.source =
            format!("{}\nScaled by {factor} in every direction.", original.source).trim().to_owned();
        if let Some(transposition) = self.new.transposition {
            file.transposition = transposition;
        }
        Ok(file)
    }
}

/// Least and largest scale factor.
const LIMITS_OF_SCALE: [f64; 2] = [0.2, 5.0];

/// The factor nearest to a limit, in hundredths, that `fits`, as 1 does and those between 1 and it.
fn nearest_to_limit(limit: f64, fits: impl Fn(f64) -> bool) -> f64 {
    let hundredths = |factor: f64| (100.0 * factor).round() as i32;
    let (mut good, mut tried) = (100, hundredths(limit));
    let mut bad = None;
    while bad.is_none_or(|bad: i32| (bad - good).abs() > 1) {
        if fits(f64::from(tried) / 100.0) {
            good = tried;
        } else {
            bad = Some(tried);
        }
        match bad {
            Some(bad) => tried = (good + bad) / 2,
            None => break,
        }
    }
    f64::from(good) / 100.0
}

/// Print an instrument as one table: cones, holes, notes
///
/// Columns: what,name,x_mm,length_mm,diameter_mm,end_diameter_mm,detail.
#[derive(Args)]
struct Show {
    #[command(flatten)]
    which: Which,
    #[command(flatten)]
    table: TableArgs,
}

/// Which instrument `check` and `show` look at: with or without --instrument before it.
#[derive(Args)]
struct Which {
    /// As --instrument
    #[arg(value_name = "NAME|FILE", conflicts_with = "instrument")]
    file: Option<PathBuf>,
    #[command(flatten)]
    instrument: InstrumentArg,
}

impl Which {
    fn load(&self) -> Result<InstrumentFile, Failure> {
        match &self.file {
            Some(path) => InstrumentArg::named(path.clone()).load(),
            None => self.instrument.load(),
        }
    }

    /// The file that is read.
    fn file(&self) -> MaybeFile<'_> {
        let of_name = self.file.as_deref().filter(|path| path.to_str().and_then(Bundled::named).is_none());
        of_name.or_else(|| self.instrument.file())
    }

    /// As the user has called it; a name of its own if the user has not.
    fn named(&self, loaded: &InstrumentFile) -> String {
        let given = self.file.as_ref().or_else(|| self.instrument.path());
        given.map_or_else(|| loaded.name.clone(), |path| path.display().to_string())
    }
}

/// How far an instrument of this transposition sounds below what is written, or above it.
fn below_what_is_written(transposition: i8) -> String {
    let semitones = counted(usize::from(transposition.unsigned_abs()), "semitone");
    match transposition {
        0 => "what is written".to_owned(),
        1.. => format!("{semitones} below what is written"),
        _ => format!("{semitones} above what is written"),
    }
}

impl Show {
    fn run(&self) -> Result<(), Failure> {
        self.table.check_files(&[self.which.file()], &[])?;
        let file = self.which.load()?;
        let mut table = self.table.open("what,name,x_mm,length_mm,diameter_mm,end_diameter_mm,detail")?;
        table.comment(format_args!("{}", file.name))?;
        table.comment(format_args!(
            "sounds {}, {} to {}; reed volume {:.0} mm3",
            below_what_is_written(file.transposition),
            file.lowest(),
            file.highest(),
            1e9 * file.reed_volume_m3
        ))?;
        for cone in &file.bore {
            table.line(format_args!(
                "cone,{},{:.4},{:.4},{:.4},{:.4},",
                quoted(&cone.part),
                1e3 * cone.x_start_m,
                1e3 * (cone.x_end_m - cone.x_start_m),
                2e3 * cone.r_start_m,
                2e3 * cone.r_end_m
            ))?;
        }
        for hole in &file.holes {
            table.line(format_args!(
                "hole,{},{:.4},{:.4},{:.4},,{}",
                quoted(&hole.name),
                1e3 * hole.x_m,
                1e3 * hole.chimney_m,
                2e3 * hole.radius_m,
                quoted(&format!(
                    "{}{}",
                    hole.kind.name(),
                    if hole.register { ", register hole" } else { "" }
                ))
            ))?;
        }
        for fingering in &file.fingerings {
            let open: Vec<&str> = (file.holes.iter().zip(&fingering.open))
                .filter_map(|(hole, open)| open.then_some(hole.name.as_str()))
                .collect();
            let open = if open.is_empty() { "all closed".to_owned() } else { open.join(" ") };
            let detail = format!("{} peak {}: {open}", fingering.register, fingering.mode);
            table.line(format_args!("note,{},,,,,{}", named(fingering.written), quoted(&detail)))?;
        }
        table.finish()
    }
}

impl From<ImportError> for Failure {
    fn from(error: ImportError) -> Self {
        Self::Import(Box::new(error))
    }
}
