//! Arguments for the breath that a score is blown with.

use crate::cli::Failure;
use crate::cli::shared_args::{dynamics, within};
use chalumeau_core::score::breath::{BreathCurve, GAMMA_MAX};
use chalumeau_knob::touch::take::Take;
use clap::{ArgGroup, Args};
use std::path::{Path, PathBuf};
use std::{fs, io};

/// Gamma where nothing else is said: a full, easy tone.
pub const GAMMA_DEFAULT: f32 = 0.5;

/// Where the breath comes from.
#[derive(Args)]
#[command(next_help_heading = "Breath (replaces that of a MIDI file)")]
#[command(group = ArgGroup::new("blown").args(["dynamic", "gamma", "breath", "crescendo", "replay"]))]
pub(super) struct BreathArgs {
    /// How loud, as a player plays: pp, p, mp, mf, f, ff or a number in 0..1; or two with a colon, for example pp:ff, from the
    /// one to the other over the whole length
    #[arg(long, value_name = "D|FROM:TO", value_parser = dynamics)]
    pub dynamic: Option<(f64, f64)>,
    /// Constant mouth pressure over closing pressure, 0..3 [default: 0.5 unless a MIDI file plays]. With --breath-response played:
    /// a share of full breath, 0..1
    #[arg(long, value_name = "G", value_parser = |s: &str| within(s, 0.0, f64::from(GAMMA_MAX)))]
    pub gamma: Option<f64>,
    /// Mouth pressure over closing pressure over time: a CSV file t_s,gamma, or ramp:FROM:TO:SECONDS, then held, or one number.
    /// With --breath-response played, and with most presets, the numbers are shares of full breath, 0..1
    #[arg(long, value_name = "FILE|RAMP|G")]
    pub breath: Option<String>,
    /// Mouth pressure from one gamma to another over the whole length, for example 0.4:0.9; or shares of full breath, as
    /// with --breath
    #[arg(long, value_name = "FROM:TO")]
    pub crescendo: Option<String>,
    /// Breath from a recorded take: a CSV file with t_us and angle_deg, from the plugin or `chalumeau knob`. Each note turns
    /// the angle into its own pressure. The take's own feel is used; flags of the feel replace it. The column gamma is the
    /// pressure that the hand felt. With --breath-response physical, the reed is blown with exactly this pressure
    #[arg(long, value_name = "FILE")]
    pub replay: Option<PathBuf>,
}

/// What blows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BreathSource {
    /// A take of a knob.
    Take,
    /// A curve, a dynamic or a MIDI file.
    Other,
}

impl BreathArgs {
    /// What blows.
    pub fn source(&self) -> BreathSource {
        if self.replay.is_some() { BreathSource::Take } else { BreathSource::Other }
    }

    /// The breath over time; `None` if a take or a dynamic sets it, or nothing does and `is_midi`, which has its own.
    pub fn curve(&self, is_midi: bool) -> Result<Option<BreathCurve>, Failure> {
        if self.replay.is_some() || self.dynamic.is_some() {
            return Ok(None);
        }
        if let Some(text) = &self.crescendo {
            return Ok(Some(BreathCurve::parse_crescendo(text)?));
        }
        if let Some(gamma) = self.gamma {
            return Ok(Some(BreathCurve::constant(gamma as f32)));
        }
        let Some(text) = &self.breath else {
            return Ok((!is_midi).then(|| BreathCurve::constant(GAMMA_DEFAULT)));
        };
        if text.trim().is_empty() {
            let right = "give a number, ramp:FROM:TO:SECONDS or a CSV file";
            return Err(Failure::Usage(format!("--breath is empty; {right}")));
        }
        if text.parse::<f32>().is_ok() {
            let gamma = within(text, 0.0, f64::from(GAMMA_MAX));
            let gamma = gamma.map_err(|wrong| Failure::Usage(format!("--breath {text}: {wrong}")))?;
            return Ok(Some(BreathCurve::constant(gamma as f32)));
        }
        if text.starts_with("ramp:") {
            // What is too large for single precision is told as it was typed.
            let is_too_large = |field: &&str| {
                let number = field.trim().parse::<f64>();
                number.is_ok_and(|number| number.is_finite() && (number as f32).is_infinite())
            };
            if let Some(field) = text.split(':').skip(1).take(2).find(is_too_large) {
                return Err(Failure::Usage(format!(
                    "--breath {text}: gamma must lie in 0..{GAMMA_MAX}, got {field}"
                )));
            }
            return Ok(Some(BreathCurve::parse_ramp(text)?));
        }
        if dynamics(text).is_ok() {
            return Err(Failure::Usage(format!("--breath {text}: for a dynamic give --dynamic {text}")));
        }
        let path = PathBuf::from(text);
        let from = fs::File::open(&path).map_err(|source| no_such_breath(path.clone(), source))?;
        match BreathCurve::read_csv(from) {
            Ok(curve) => Ok(Some(curve)),
            Err(source) => Err(Failure::BreathFile { path, source }),
        }
    }

    /// The recorded take whose angles blow.
    pub fn take(&self) -> Result<Option<Take>, Failure> {
        self.replay.as_deref().map(read_take).transpose()
    }

    /// The files that are read. A number and a ramp are none.
    pub fn read_files(&self) -> [Option<&Path>; 2] {
        let is_file = |text: &&str| text.parse::<f32>().is_err() && !text.starts_with("ramp:");
        [self.breath.as_deref().filter(is_file).map(Path::new), self.replay.as_deref()]
    }
}

/// Why a file cannot be read. A text without an extension was perhaps not meant as a file.
fn no_such_breath(path: PathBuf, source: io::Error) -> Failure {
    if source.kind() == io::ErrorKind::NotFound && path.extension().is_none() {
        return Failure::Usage(format!(
            "--breath {}: there is no such file; give a number, which is gamma, 0..{GAMMA_MAX}, or ramp:FROM:TO:SECONDS, or a CSV file \
             t_s,gamma",
            path.display()
        ));
    }
    Failure::Read { path, source }
}

/// Reads a recorded take.
fn read_take(path: &Path) -> Result<Take, Failure> {
    let from = fs::File::open(path).map_err(|source| Failure::Read { path: path.to_owned(), source })?;
    Take::read(from).map_err(|source| Failure::TakeFile { path: path.to_owned(), source })
}
