//! The command line: reads arguments, writes files and tables. Other modules measure and play.
//!
//! Each subcommand is one file. Tables go to standard output or a file as CSV: the header first, then lines beginning
//! with `#` that say what was measured, then data. After a user's mistake the exit code is 2, a message
//! says what was given and what would be right, and no file is written. A reader that closes the pipe early is no error.

/// Tells the user a line on standard error. If that is closed or full, the line is lost, and no result.
macro_rules! say {
    ($($text:tt)*) => { $crate::cli::say_line(format_args!($($text)*)) };
}

mod batch;
mod bifurcation;
mod bore;
mod controllers;
mod csv_table;
#[cfg(feature = "devices")]
mod doctor;
mod doubt;
mod feel_args;
mod files;
mod fingerings;
mod haptic;
mod idle_settings;
mod impedance;
mod instrument;
#[cfg(feature = "devices")]
mod knob;
#[cfg(feature = "simulator")]
mod knob_sim;
mod measure;
pub mod offline;
mod parameters;
mod plot_args;
mod presets;
mod progress_bar;
mod radiation;
mod realism;
mod reed;
mod reed_physical;
mod render;
mod render_job;
mod render_monitor;
mod report;
mod score_args;
mod settings;
mod shared_args;
mod silent_keys;
mod study;
mod threshold;
mod tune;
mod words;

use crate::output::{OutputError, remove_unfinished_and_exit};
use crate::picture_file::PictureError;
use crate::wav::WavError;
use chalumeau_core::bore::cylinder::CylinderError;
use chalumeau_core::bore::instrument_file::{ImportError, InstrumentError};
use chalumeau_core::haptics::FeelRefused;
use chalumeau_core::instrument::BuildError;
use chalumeau_core::reed::law::ReedError;
use chalumeau_core::score::ScoreError;
use chalumeau_core::score::breath::BreathError;
use chalumeau_core::score::midi_file::MidiFileError;
use chalumeau_figure::report::ReportError;
use chalumeau_knob::touch::take_csv::TakeError;
use clap::{Parser, Subcommand};
use std::ffi::{OsStr, OsString};
use std::fmt;
use std::io;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::OnceLock;

/// Exit code that a shell expects of a program that was interrupted.
const INTERRUPTED: i32 = 130;

const EXAMPLES: &str = "\
Examples:
  chalumeau render examples/melody.mid --out melody.wav
  chalumeau render --written C4 --dynamic mf --seconds 1.5 --out c4.wav
  chalumeau impedance --all --peaks 8 --csv peaks.csv
  chalumeau bore --written C5 --plot c5.svg
  chalumeau threshold --all --zeta 0.3
  chalumeau tune --rate 48000 --gamma 0.5
  chalumeau measure recording.wav --plot recording.png
  chalumeau haptic --all --contrast 1

Notes are MIDI numbers (60) or names (C4, F#5, Bb3). The player of a B flat clarinet reads written notes, which \
sound two semitones lower. Gamma is the mouth pressure over the pressure that closes the reed. Notes begin at a gamma \
of 0.30 to 0.41. From 0.5 to 0.7 on, the reed beats against the facing. At 1, a reed that does not vibrate would be \
closed on a straight facing (--lay 0), on a curved facing somewhat later. Far above 1, there is no sound. Instead of \
gamma, --dynamic pp to ff sets the loudness as a player does.";

/// Plays, measures and draws a clarinet whose sound is computed from physics.
#[derive(Parser)]
#[command(name = "chalumeau", version, after_help = EXAMPLES, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Render(Box<render::RenderCommand>),
    Batch(batch::BatchCommand),
    Report(Box<report::ReportCommand>),
    Impedance(Box<impedance::ImpedanceCommand>),
    Radiation(Box<radiation::RadiationCommand>),
    Bore(Box<bore::BoreCommand>),
    Instrument(Box<instrument::InstrumentCommand>),
    Threshold(threshold::ThresholdCommand),
    Fingerings(fingerings::FingeringsCommand),
    Bifurcation(Box<bifurcation::BifurcationCommand>),
    Tune(Box<tune::TuneCommand>),
    Realism(Box<realism::RealismCommand>),
    Measure(measure::MeasureCommand),
    Reed(reed::ReedCommand),
    Study(study::StudyCommand),
    Parameters(parameters::ParametersCommand),
    Presets(presets::PresetsCommand),
    Controllers(controllers::ControllersCommand),
    #[cfg(feature = "devices")]
    Knob(Box<knob::KnobCommand>),
    #[cfg(feature = "simulator")]
    KnobSim(Box<knob_sim::KnobSimCommand>),
    Haptic(Box<haptic::HapticCommand>),
    #[cfg(feature = "devices")]
    Doctor(doctor::DoctorCommand),
}

impl Command {
    /// Ctrl-C leaves no unfinished file behind. Commands that hold a knob have their own way to stop.
    fn listen_for_interrupts(&self) {
        match self {
            #[cfg(feature = "devices")]
            Self::Knob(_) => return,
            #[cfg(feature = "simulator")]
            Self::KnobSim(_) => return,
            _ => {}
        }
        // Without it the process still stops, and leaves what it has begun.
        let _ = ctrlc::set_handler(|| remove_unfinished_and_exit(INTERRUPTED));
    }
}

/// Why a command ended early.
#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error("cannot read {}: {source}", path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("{}: {source}", path.display())]
    MidiFile { path: PathBuf, source: MidiFileError },
    #[error("{}: {source}", path.display())]
    TakeFile { path: PathBuf, source: TakeError },
    #[error("{}: {source}", path.display())]
    BreathFile { path: PathBuf, source: BreathError },
    #[error("{}: {source}", path.display())]
    InstrumentFile { path: PathBuf, source: InstrumentError },
    #[error("{}: {source}", path.display())]
    Instrument { path: PathBuf, source: BuildError },
    #[error("cannot make the directory {}: {source}", path.display())]
    Folder { path: PathBuf, source: io::Error },
    #[error("cannot write {}: {source}", path.display())]
    Write { path: PathBuf, source: io::Error },
    #[error(transparent)]
    Scale(#[from] crate::scale_file::ScaleError),
    #[error(transparent)]
    Import(Box<ImportError>),
    #[error(transparent)]
    Cylinder(#[from] CylinderError),
    #[error(transparent)]
    Build(#[from] BuildError),
    #[error(transparent)]
    Breath(#[from] BreathError),
    #[error(transparent)]
    Score(#[from] ScoreError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error(transparent)]
    Draw(#[from] PictureError),
    #[error("{}: {source}", path.display())]
    Report { path: PathBuf, source: ReportError },
    #[error(transparent)]
    Wav(#[from] WavError),
    #[error("{}: {source}", path.display())]
    WavFile { path: PathBuf, source: crate::wav::Unreadable },
    #[error(transparent)]
    Reed(#[from] ReedError),
    #[cfg(feature = "simulator")]
    #[error("{}: {source}", path.display())]
    HandScript { path: PathBuf, source: chalumeau_knob::simulator::script::ScriptError },
    #[cfg(feature = "simulator")]
    #[error("the simulated knob stopped: {0}")]
    Knob(io::Error),
    #[cfg(feature = "devices")]
    #[error("the knob was lost after {seconds:.1} s and did not come back: {text}")]
    KnobLost { seconds: f64, text: String },
    #[error(transparent)]
    Feel(#[from] FeelRefused),
    #[error("cannot write the table: {0}")]
    Table(#[from] io::Error),
    #[error("{0}")]
    Usage(String),
}

impl Failure {
    /// `chalumeau reed --table | head` has done what it should.
    fn is_closed_pipe(&self) -> bool {
        matches!(self, Self::Table(e) if e.kind() == io::ErrorKind::BrokenPipe)
    }
}

/// Checks that these words, without the program's name, are a valid command. Runs nothing. A test checks the commands in
/// the documents with it.
pub fn understands<'a>(words: impl IntoIterator<Item = &'a str>) -> Result<(), String> {
    match parse::<Cli>(std::iter::once("chalumeau").chain(words)) {
        Err(error) if error.use_stderr() => Err(error.to_string()),
        // Help and version are answers too.
        _ => Ok(()),
    }
}

/// As [`Parser::try_parse_from`], but hears negative numbers as values.
fn parse<P: Parser>(words: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> Result<P, clap::Error> {
    let mut command = hearing_negative_numbers(P::command());
    let words: Vec<OsString> = words.into_iter().map(Into::into).collect();
    let matches = command.try_get_matches_from_mut(words.clone()).map_err(|error| {
        let asked = words.iter().skip(1).find_map(|word| command.find_subcommand(word));
        words::advised(error, asked.unwrap_or(&command))
    })?;
    P::from_arg_matches(&matches).map_err(|error| error.format(&mut command))
}

/// The command, in which a negative number after an option is its value, so that a range can refuse it. Otherwise it would
/// be taken for another option.
fn hearing_negative_numbers(command: clap::Command) -> clap::Command {
    command
        .mut_args(|arg| {
            let takes_value = arg.get_action().takes_values() && !arg.is_positional();
            if takes_value { arg.allow_negative_numbers(true) } else { arg }
        })
        .mut_subcommands(hearing_negative_numbers)
}

/// Commands that this build lacks.
const LEFT_OUT: &[&str] = &[
    #[cfg(not(feature = "devices"))]
    "doctor",
    #[cfg(not(feature = "devices"))]
    "knob",
    #[cfg(not(feature = "simulator"))]
    "knob-sim",
];

/// Reads the arguments and does what they say.
pub fn main() -> ExitCode {
    let first = std::env::args_os().nth(1);
    if let Some(command) = first.as_deref().and_then(OsStr::to_str).filter(|name| LEFT_OUT.contains(name)) {
        return failed(&Failure::Usage(format!(
            "{command} is not in this build, which has no devices; `cargo build --release` builds all commands"
        )));
    }
    let command = match parse::<Cli>(std::env::args_os()) {
        Ok(parsed) => parsed.command,
        Err(error) => error.exit(),
    };
    command.listen_for_interrupts();
    let done = match command {
        Command::Render(command) => command.run(),
        Command::Batch(command) => command.run(),
        Command::Report(command) => command.run(),
        Command::Impedance(command) => command.run(),
        Command::Radiation(command) => command.run(),
        Command::Bore(command) => command.run(),
        Command::Instrument(command) => {
            return command.run().unwrap_or_else(|failure| failed(&failure));
        }
        Command::Threshold(command) => command.run(),
        Command::Fingerings(command) => command.run(),
        Command::Bifurcation(command) => command.run(),
        Command::Tune(command) => command.run(),
        Command::Realism(command) => command.run(),
        Command::Measure(command) => command.run(),
        Command::Reed(command) => command.run(),
        Command::Study(command) => command.run(),
        Command::Parameters(command) => command.run(),
        Command::Presets(command) => command.run(),
        Command::Controllers(command) => command.run(),
        #[cfg(feature = "devices")]
        Command::Knob(command) => command.run(),
        #[cfg(feature = "simulator")]
        Command::KnobSim(command) => command.run(),
        Command::Haptic(command) => command.run(),
        #[cfg(feature = "devices")]
        Command::Doctor(command) => {
            return command.run().unwrap_or_else(|failure| failed(&failure));
        }
    };
    match done {
        Err(failure) => failed(&failure),
        Ok(()) => ExitCode::SUCCESS,
    }
}

fn failed(failure: &Failure) -> ExitCode {
    if failure.is_closed_pipe() {
        return ExitCode::SUCCESS;
    }
    say!("error: {failure}");
    ExitCode::from(2)
}

/// Who hears what is said in place of the terminal.
static LISTENER: OnceLock<fn(&str)> = OnceLock::new();

/// Tells what the code of the commands says to `listener`, for a program that calls it. The first one stays.
pub fn say_to(listener: fn(&str)) {
    let _ = LISTENER.set(listener);
}

/// See `say!`.
fn say_line(text: fmt::Arguments) {
    if let Some(listener) = LISTENER.get() {
        return listener(&text.to_string());
    }
    crate::stderr::line(text);
}
