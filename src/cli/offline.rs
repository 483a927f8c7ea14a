//! What the commands do, for callers that are programs: the same names and values make the same job.
//!
//! The Python package stands on it. Names are flags without their dashes, or ids of parameters; values are texts as on the
//! command line. An error is the text that the command would print.

use crate::cli::batch::plan::Plan;
use crate::cli::bifurcation::refuse_silent;
use crate::cli::doubt::Doubt;
use crate::cli::haptic::{FeltReedArgs, ReedInAirArgs};
use crate::cli::parse;
use crate::cli::render::is_held_beyond;
use crate::cli::settings::SettingsArgs;
use crate::cli::shared_args::{PlayedArgs, rate, sounding};
use crate::cli::silent_keys::silent_keys;
use crate::cli::words::Names;
use crate::wav::{BEGINNING_S, Levels};
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::haptics::{FeelTable, PlayedReed, RequirementSolver};
use chalumeau_core::instrument::{Model, Settings};
use chalumeau_core::score::breath::BreathCurve;
use chalumeau_core::units::{SoundingNote, WrittenNote};
use clap::{Args, Parser};
use std::path::Path;

pub use crate::cli::render_job::RenderJob;
pub use crate::cli::score_args::{Given, TimedNote};
use crate::cli::score_args::{ScoreArgs, preset_called};
pub use crate::cli::shared_args::{Stop, note};

/// Why what such a job played, at these levels, may not be what was asked for: the warnings of `chalumeau render`.
pub fn doubts(job: &RenderJob, level: Levels) -> impl Iterator<Item = &'static str> {
    Doubt::all(level, 0, is_held_beyond(job, BEGINNING_S)).map(Doubt::text)
}

/// Names and their values.
pub type Pairs = [(String, String)];

/// Arguments alone, as a command of their own.
#[derive(Parser)]
struct Line<A: Args> {
    #[command(flatten)]
    args: A,
}

/// An instrument and its player, with nothing to play.
#[derive(Args)]
struct LiveArgs {
    /// Sample rate, Hz, 1000..1536000
    #[arg(long, default_value = "48000", value_parser = rate)]
    rate: u32,
    #[command(flatten)]
    instrument: PlayedArgs,
    #[command(flatten)]
    settings: SettingsArgs,
}

/// Reads names and values as the arguments of a command.
fn read<A: Args>(pairs: &Pairs) -> Result<A, String> {
    let words = Names::of::<A>().words_of_program(pairs)?;
    let line = std::iter::once("chalumeau".to_owned()).chain(words);
    parse::<Line<A>>(line).map(|line| line.args).map_err(|error| {
        // Clap's own text without its "error: ", usage and hint.
        let text = error.to_string();
        let said = text.split("\n\n").next().unwrap_or_default();
        said.trim_start_matches("error: ").split_whitespace().collect::<Vec<_>>().join(" ")
    })
}

/// The arguments of a rendering.
fn rendering(
    pairs: &Pairs,
    instrument: Option<InstrumentFile>,
    given: Option<Given>,
    stop: Option<Stop>,
) -> Result<ScoreArgs, String> {
    let mut pairs = pairs.to_vec();
    if given.is_some() {
        // The command asks for something to play; what is given is played in its place.
        pairs.push(("midi".to_owned(), "the given bytes".to_owned()));
    }
    let mut args: ScoreArgs = read(&pairs)?;
    (args.instrument.instrument.given, args.instrument.instrument.stop) = (instrument, stop);
    args.given = given;
    args.refuse_idle_feel().map_err(|failure| failure.to_string())?;
    Ok(args)
}

/// A rendering, as `chalumeau render` would play it. `instrument` and `given` are what the caller has in memory in place of
/// files. Takes up to a minute for an instrument file that is new; ends with an error soon after `stop` says so.
pub fn render_job(
    pairs: &Pairs,
    instrument: Option<InstrumentFile>,
    given: Option<Given>,
    stop: Option<Stop>,
) -> Result<RenderJob, String> {
    let args = rendering(pairs, instrument, given, stop)?;
    args.prepare().map_err(|failure| failure.to_string())
}

/// Whether all that can be known of a rendering without preparing its instrument is in order: its notes, values and files.
pub fn check_rendering(pairs: &Pairs) -> Result<(), String> {
    let args = rendering(pairs, None, None, None)?;
    args.check().map(drop).map_err(|failure| failure.to_string())
}

/// The text of a preset; of the user's own first.
pub fn preset_text(name: &str) -> Result<String, String> {
    preset_called(name).map(|preset| preset.to_text())
}

/// Whether these names and values are arguments of `chalumeau render`. Reads no file and prepares nothing.
pub fn check(pairs: &Pairs) -> Result<(), String> {
    read::<ScoreArgs>(pairs).map(drop)
}

/// An instrument ready to be played live, with the player's settings. Takes up to a minute for an instrument file that is
/// new; ends with an error soon after `stop` says so.
pub fn live(
    pairs: &Pairs,
    instrument: Option<InstrumentFile>,
    stop: Option<Stop>,
) -> Result<RenderJob, String> {
    let mut args: LiveArgs = read(pairs)?;
    (args.instrument.instrument.given, args.instrument.instrument.stop) = (instrument, stop);
    RenderJob::without_score(&args.instrument, &args.settings, args.rate)
        .map_err(|failure| failure.to_string())
}

/// The same for a written note and a breath that rises to `gamma`: a pressure, which full breath reaches. Refuses a note whose
/// key is silent.
pub fn blown(
    pairs: &Pairs,
    instrument: InstrumentFile,
    written: WrittenNote,
    gamma: f64,
    stop: Option<Stop>,
) -> Result<RenderJob, String> {
    let mut args: LiveArgs = read(pairs)?;
    args.instrument.instrument.stop = stop;
    let said = |failure: crate::cli::Failure| failure.to_string();
    args.settings.refuse_room_players_and_keys().map_err(said)?;
    let settings =
        args.settings.blown_by(None, &BreathCurve::constant(gamma as f32), &instrument).map_err(said)?;
    let sounding = sounding(&instrument, written).map_err(said)?;
    let model = args.instrument.model(instrument, args.rate, settings.a4_hz).map_err(said)?;
    refuse_silent(written, sounding, &model, &settings).map_err(said)?;
    Ok(RenderJob::to_play_later(model, settings, args.rate))
}

/// The player's settings alone, on an instrument whose bore measured reeds refer to.
pub fn settings(pairs: &Pairs, instrument: &InstrumentFile) -> Result<Settings, String> {
    let args: LiveArgs = read(pairs)?;
    args.settings.played(instrument).map_err(|failure| failure.to_string())
}

/// What the user should know of a key that is struck on this instrument: that it stays silent.
pub fn silent(key: SoundingNote, model: &Model, settings: &Settings) -> Vec<String> {
    silent_keys(&[key], model, settings.reach)
}

/// The feel of every note, as `chalumeau haptic` has it. Takes a second.
pub fn feel(pairs: &Pairs, instrument: InstrumentFile) -> Result<FeelTable, String> {
    let args: FeltReedArgs = read(pairs)?;
    args.feel(&instrument, None).map_err(|failure| failure.to_string())
}

/// A bore and the reed that is played on it, from which thresholds follow, as `chalumeau haptic` has them. Takes a second.
pub fn bore_and_reed(
    pairs: &Pairs,
    instrument: &InstrumentFile,
) -> Result<(RequirementSolver, PlayedReed), String> {
    read::<ReedInAirArgs>(pairs)?.bore_and_reed(instrument).map_err(|failure| failure.to_string())
}

/// The rows of a plan of `chalumeau batch`, in the order of its files: for each row the names and values.
pub struct Rows {
    /// Names, in the order of the columns.
    pub names: Vec<String>,
    /// Values of each row; an empty one leaves its name out.
    pub values: Vec<Vec<String>>,
}

impl Rows {
    /// Of a TOML or CSV file.
    pub fn read(path: &Path) -> Result<Self, String> {
        Plan::read(path).map(Self::of).map_err(|what| format!("{}: {what}", path.display()))
    }

    /// Of the text of a TOML plan.
    pub fn parse(text: &str) -> Result<Self, String> {
        Plan::from_toml(text).map(Self::of)
    }

    fn of(plan: Plan) -> Self {
        let values = plan.variations.into_iter().map(|variation| variation.values).collect();
        Self { names: plan.names, values }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::instrument::Split;

    fn pairs(all: &[(&str, &str)]) -> Vec<(String, String)> {
        all.iter().map(|&(name, value)| (name.to_owned(), value.to_owned())).collect()
    }

    #[test]
    fn names_of_programs_hosts_and_flags_set_the_same() {
        let settings = |name: &str| live(&pairs(&[(name, "3")]), None, None).map(|job| job.settings);
        let by_flag = settings("strength").unwrap();
        assert_eq!(by_flag.strength, 3.0);
        for name in ["stren", "Reed strength", "reed strength"] {
            assert_eq!(settings(name), Ok(by_flag), "{name}");
        }
        let kpa = |name: &str| live(&pairs(&[(name, "7")]), None, None).unwrap().settings.breath_full_kpa;
        assert_eq!((kpa("breath_full"), kpa("breath-full")), (7.0, 7.0));
        let job = live(&pairs(&[("breath_full", "7 kPa"), ("noise", "40 %")]), None, None).unwrap();
        assert_eq!((job.settings.breath_full_kpa, job.settings.noise), (7.0, 0.4));
        let job =
            live(&pairs(&[("Breath noise", "40"), ("no_noise", "false"), ("unison", "true")]), None, None)
                .unwrap();
        assert_eq!((job.settings.noise, job.settings.players.split), (0.4, Split::Unison));
        assert!(
            live(&pairs(&[("noise", ""), ("no-noise", "true")]), None, None).unwrap().settings.noise == 0.0
        );
    }

    #[test]
    fn mistakes_are_told_in_one_line() {
        for (all, says) in [
            (&[("strenght", "3")][..], "do you mean strength"),
            (&[("strength", "9")], "must lie in 1.5..5"),
            (&[("zeta", "0.4"), ("Embouchure", "0.5")], "both set Embouchure"),
            (&[("no_noise", "maybe")], "must be true or false"),
        ] {
            let said = live(&pairs(all), None, None).map(|_| ()).unwrap_err();
            assert!(said.contains(says) && !said.contains('\n'), "{said}");
        }
        let said = render_job(&pairs(&[("seconds", "1")]), None, None, None).map(|_| ()).unwrap_err();
        assert!(said.contains("required"), "{said}");
        // What the command refuses is refused.
        let said = check_rendering(&pairs(&[("written", "C4"), ("contrast", "2")])).unwrap_err();
        assert!(said.contains("--contrast is of the knob's feel"), "{said}");
        let damaged = Given::Midi { bytes: b"none".to_vec(), path: Some("songs/x.mid".into()) };
        let said = render_job(&[], None, Some(damaged), None).map(|_| ()).unwrap_err();
        assert!(said.starts_with("songs/x.mid"), "{said}");
        // The feel of a knob changes no threshold.
        let contrast = pairs(&[("contrast", "2")]);
        assert!(bore_and_reed(&contrast, &InstrumentFile::built_in()).unwrap_err().contains("contrast"));
    }

    #[test]
    fn a_caller_gives_up_an_instrument_that_is_being_prepared() {
        let file = InstrumentFile::parse(include_str!("../../examples/instruments/cylinder.toml")).unwrap();
        // A size that nobody has asked for before: nothing of it is kept. From 430 to 450 Hz the size is that of 440 Hz.
        let size = [("a4", "453.71")];
        let said = live(&pairs(&size), Some(file), Some(|| true)).map(|_| ()).unwrap_err();
        assert!(said.contains("cancelled"), "{said}");
    }

    #[test]
    fn notes_that_touch_are_slurred_and_a_repeated_one_ends_first() {
        use chalumeau_core::event::Event;
        use chalumeau_core::units::SoundingNote;
        let note = |from_s, note| TimedNote { from_s, seconds: 0.5, note: SoundingNote(note), velocity: 0.8 };
        let ons = |notes: Vec<TimedNote>| -> Vec<bool> {
            let job = render_job(&[], None, Some(Given::Notes(notes)), None).unwrap();
            job.score.events.iter().map(|e| matches!(e.event, Event::NoteOn { .. })).collect()
        };
        assert_eq!(ons(vec![note(0.0, 60), note(0.5, 62)]), [true, true, false, false]);
        assert_eq!(ons(vec![note(0.0, 60), note(0.5, 60)]), [true, false, true, false]);
        let job = render_job(&[], None, Some(Given::Notes(vec![note(0.5, 60)])), None).unwrap();
        // With the time to fade of a melody.
        assert_eq!(job.score.samples, 2 * 48_000);
    }
}
