//! Arguments for what is played: a MIDI file, a note or a scale, and its breath. `render` and `report` share them.

use crate::cli::Failure;
use crate::cli::controllers::{GivenMap, named_or_file};
use crate::cli::feel_args::FeelArgs;
use crate::cli::files::MaybeFile;
use crate::cli::render_job::RenderJob;
use crate::cli::settings::SettingsArgs;
use crate::cli::shared_args::{PlayedArgs, check_fingering, dynamics, note, rate, sounding, within};
use crate::cli::silent_keys::silent_notes;
use crate::cli::threshold::linear_threshold;
use crate::controllers::{ControllerMap, as_links};
use crate::parameters::Value;
use crate::presets::{self, Preset};
use crate::scale_file;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::control::knob::KnobDesign;
use chalumeau_core::control::midi::MidiDecoder;
use chalumeau_core::control::midi::breath::BreathFrom;
use chalumeau_core::control::midi::techniques::Wheel;
use chalumeau_core::control::parts::Parts;
use chalumeau_core::event::{Event, PartEvent, Timed};
use chalumeau_core::haptics::FeelDesign;
use chalumeau_core::instrument::{BreathResponse, KeyPitches, Model, Players, Settings, Split};
use chalumeau_core::score::Score;
use chalumeau_core::score::breath::BreathCurve;
use chalumeau_core::score::breath::GAMMA_MAX;
use chalumeau_core::score::midi_file;
use chalumeau_core::units::{SoundingNote, WrittenNote};
use chalumeau_knob::touch::breath_from_angle::{Blower, BlownEvents, BreathMapping};
use chalumeau_knob::touch::feel::{InstrumentFeel, NO_MOTOR};
use chalumeau_knob::touch::take::Take;
use clap::{ArgGroup, Args};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A reed with inertia begins up to a fifth below the threshold of one without (`chalumeau threshold --help`).
const INERTIA_LEAST: f64 = 0.8;
/// Gamma at which every note of a clarinet has begun, also under a firm lip (`chalumeau threshold --zeta 0.15`: 0.54 at most, less a fifth).
const ALL_BEGIN: f64 = 0.5;

/// Gamma where nothing else is said: a full, easy tone.
const GAMMA_DEFAULT: f32 = 0.5;

/// What a caller that is a program has in memory.
pub enum Given {
    /// A standard MIDI file.
    Midi(Vec<u8>),
    /// Notes, to be played at any rate.
    Notes(Vec<TimedNote>),
}

/// A note and when it sounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedNote {
    /// When it begins, s, at least 0.
    pub from_s: f64,
    /// How long it is held, s, at least 0.
    pub seconds: f64,
    /// Its sounding pitch.
    pub note: SoundingNote,
    /// Velocity, 0..=1.
    pub velocity: f32,
}

/// What to play, on what, and how.
#[derive(Args)]
#[command(group = ArgGroup::new("what").required(true).args(["midi", "written", "sounding", "scale"]))]
#[command(group = ArgGroup::new("note").args(["written", "sounding", "scale"]))]
#[command(group = ArgGroup::new("blown").args(["dynamic", "gamma", "breath", "crescendo", "replay"]))]
pub struct ScoreArgs {
    /// Standard MIDI file, format 0 or 1
    #[arg(value_name = "MIDI")]
    midi: Option<PathBuf>,
    /// The file is MPE: channel 1 is the manager, the other channels bend by 48 semitones
    #[arg(long, requires = "midi", conflicts_with = "note")]
    mpe: bool,
    /// Each track with notes has a player and a seat of its own; in a file of one such track, each channel. Seats and their
    /// width are those of several players, and pan (CC10) of a track moves its player
    #[arg(long, requires = "midi")]
    tracks: bool,
    /// Controllers of the file that move parameters: a device, see `chalumeau controllers list`, or a TOML file of links, as
    /// the window copies them
    #[arg(long, value_name = "DEVICE|FILE", requires = "midi", conflicts_with = "note", value_parser = named_or_file)]
    controllers: Option<GivenMap>,
    /// One note as a clarinettist reads it: MIDI number (60) or name (C4)
    #[arg(long, value_name = "NOTE", value_parser = note)]
    written: Option<u8>,
    /// One note by its sounding pitch
    #[arg(long, value_name = "NOTE", value_parser = note)]
    sounding: Option<u8>,
    /// Chromatic scale between two written notes, up or down, for example E3:C6; notes that the instrument does not have are
    /// left out
    #[arg(long, value_name = "FROM:TO", value_parser = interval)]
    scale: Option<(u8, u8)>,
    /// Slur the scale instead of tonguing each note
    #[arg(long, requires = "scale", conflicts_with_all = ["midi", "written", "sounding"])]
    slurred: bool,
    /// Length of the note, or of each note of the scale, s, 0.01..3600 [default: 2, scale 0.5]
    #[arg(long, value_name = "S", conflicts_with = "midi", value_parser = |s: &str| within(s, 0.01, 3600.0))]
    seconds: Option<f64>,
    /// Time to fade after the last event, s, 0..60 [default: 1, one note 0; more with a fall or a breath in]
    #[arg(long, value_name = "S", value_parser = |s: &str| within(s, 0.0, 60.0))]
    tail: Option<f64>,

    /// How loud, as a player plays: pp, p, mp, mf, f, ff or a number in 0..1; or two with a colon, for example pp:ff, from the
    /// one to the other over the whole length
    #[arg(long, value_name = "D|FROM:TO", help_heading = "Breath (replaces that of a MIDI file)", value_parser = dynamics)]
    dynamic: Option<(f64, f64)>,
    /// Constant mouth pressure over closing pressure, 0..3 [default: 0.5 unless a MIDI file plays]
    #[arg(long, value_name = "G", help_heading = "Breath (replaces that of a MIDI file)", value_parser = |s: &str| within(s, 0.0, f64::from(GAMMA_MAX)))]
    gamma: Option<f64>,
    /// Mouth pressure over closing pressure over time: a CSV file t_s,gamma, or ramp:FROM:TO:SECONDS, then held, or one number.
    /// With --breath-response played the numbers are shares of full breath, 0..1
    #[arg(long, value_name = "FILE|RAMP|G", help_heading = "Breath (replaces that of a MIDI file)")]
    breath: Option<String>,
    /// Mouth pressure from one gamma to another over the whole length, for example 0.4:0.9; or shares of full breath, as
    /// with --breath
    #[arg(long, value_name = "FROM:TO", help_heading = "Breath (replaces that of a MIDI file)")]
    crescendo: Option<String>,
    /// Breath from a recorded take: a CSV file with t_us and angle_deg, from the plugin or `chalumeau knob`. Each note turns
    /// the angle into its own pressure
    #[arg(long, value_name = "FILE", help_heading = "Breath (replaces that of a MIDI file)")]
    replay: Option<PathBuf>,
    /// Sample rate, Hz, 1000..1536000
    #[arg(long, alias = "sr", value_name = "HZ", default_value = "48000", help_heading = "Output", value_parser = rate)]
    rate: u32,

    /// Play a preset, a factory preset or one of yours; other flags and --set change it. Its breath response counts, so
    /// that breath is mostly a share of full breath. The feel of the knob stays that of its own flags. `chalumeau presets
    /// list` lists them
    #[arg(long, value_name = "NAME", value_parser = preset_called)]
    preset: Option<Preset>,
    /// Scale of another tuning: a Scala file. Middle C stays; the keys go through the scale one after another
    #[arg(long, value_name = "FILE")]
    scl: Option<PathBuf>,
    /// Which key plays which degree of the scale, and at what pitch: a Scala keyboard mapping. --a4 moves all of it
    #[arg(long, value_name = "FILE", requires = "scl")]
    kbm: Option<PathBuf>,
    /// Move single written notes, cents, -50..50: for example E4=-12 or E4=-12,F#4=3.5. May be repeated
    #[arg(long, value_name = "NOTE=CENTS", value_delimiter = ',', value_parser = trim)]
    trim: Vec<(u8, f64)>,
    #[command(flatten)]
    pub instrument: PlayedArgs,
    #[command(flatten)]
    settings: SettingsArgs,
    #[command(flatten)]
    feel: FeelArgs,
    /// In place of the file that `midi` names.
    #[arg(skip)]
    pub given: Option<Given>,
}

/// Two notes with a colon between them.
fn interval(text: &str) -> Result<(u8, u8), String> {
    let (from, to) = text.split_once(':').ok_or("must be two notes, for example E3:C6 or 52:84")?;
    Ok((note(from)?, note(to)?))
}

/// A written note and its trim, cents.
fn trim(text: &str) -> Result<(u8, f64), String> {
    let (name, cents) = text.split_once('=').ok_or("must be a note and its cents, for example E4=-12")?;
    Ok((note(name)?, within(cents, -50.0, 50.0)?))
}

/// Finds a preset.
pub(super) fn preset_called(name: &str) -> Result<Preset, String> {
    presets::find(name, &presets::user()).cloned()
}

/// What is known before the instrument is prepared.
struct Planned {
    file: InstrumentFile,
    settings: Settings,
    parts: Score<PartEvent>,
    /// Of another tuning.
    keys: Option<KeyPitches>,
    /// The trim of each note by its sounding pitch, cents.
    trims: BTreeMap<u8, f64>,
    take: Option<Take>,
    warnings: Vec<String>,
}

impl ScoreArgs {
    /// Reads and checks the arguments and all files that they name.
    pub fn check(&self) -> Result<(), Failure> {
        self.plan().map(|_| ())
    }

    fn plan(&self) -> Result<Planned, Failure> {
        let file = self.instrument.load_for(self.preset.as_ref())?;
        let mut curve = self.curve()?;
        let map = self.controllers.clone().unwrap_or_default().map;
        let mut base = self.preset.as_ref().map(Preset::settings);
        if !map.values.is_empty() {
            // Over a preset, and under what the user has given.
            let mut under = base.map_or_else(|| self.settings.usual(curve.is_some()), Ok)?;
            map.values.iter().for_each(|(parameter, value)| parameter.set(&mut under, *value));
            base = Some(under);
        }
        let mut settings = match (&curve, &base) {
            (Some(curve), base) => self.settings.blown_in_either(base.as_ref(), curve, &file)?,
            (None, base) if self.dynamic.is_some() => self.settings.with_dynamics(base.as_ref(), &file)?,
            (None, Some(base)) => self.settings.over_preset(base, &file)?,
            (None, None) => self.settings.played(&file)?,
        };
        if let Some(typed) = self.settings.unison_given()?.filter(|_| settings.players.count == 1) {
            return Err(Failure::Usage(format!(
                "{typed} is for several players, and one plays; add --players, or leave it out"
            )));
        }
        let mut warnings: Vec<_> = only_in_the_plugin(&map).into_iter().collect();
        if let Some((from, to)) = self.dynamic {
            curve = Some(BreathCurve::dynamics(from, to, &settings));
        }
        warnings.extend(self.scale.and_then(|ends| left_out_of_scale(ends, &file)));
        let trims = self.trims(&file)?;
        let mut parts = self.score(&file, &map, &mut settings)?;
        if let Some(curve) = &curve {
            parts = parts.blown(curve, &settings, self.rate);
        }
        let keys = self.scl.as_ref().map(|scl| scale_file::read(scl, self.kbm.as_deref())).transpose()?;
        let take = self.replay.as_deref().map(read_take).transpose()?;
        Ok(Planned { file, settings, parts, keys, trims, take, warnings })
    }

    /// Reads and checks the arguments and prepares the instrument. Takes seconds for an instrument file.
    pub fn prepare(&self) -> Result<RenderJob, Failure> {
        let Planned { file, settings, mut parts, keys, trims, take, mut warnings } = self.plan()?;
        let mut model = self.instrument.model(file, self.rate, settings.a4_hz)?;
        if let Some(keys) = keys {
            Arc::make_mut(&mut model).keys = keys;
        }
        if !trims.is_empty() {
            let cents = |note: SoundingNote| trims.get(&note.0).copied().unwrap_or(0.0);
            let keys = model.keys.trimmed(cents);
            Arc::make_mut(&mut model).keys = keys;
        }
        warnings.extend(silent_notes(&parts.events, &model, settings.reach));
        if let Some(take) = &take {
            parts.events = self.replayed(take, &model, &settings, &parts)?;
        }
        // A single note lasts as long as was asked; a melody gets time to fade.
        let one_note = self.written.is_some() || self.sounding.is_some();
        let usual = if one_note { 0.0 } else { 1.0 } + settings.articulation.tail_s();
        let parts = parts.with_tail(self.tail.unwrap_or(usual), self.rate);
        Ok(RenderJob { model, settings, score: (&parts).into(), parts, rate: self.rate, warnings })
    }

    /// Refuses flags of the knob's feel where no take is replayed: they would do nothing.
    pub fn refuse_idle_feel(&self) -> Result<(), Failure> {
        match self.feel.given() {
            Some(flag) if self.replay.is_none() => Err(Failure::Usage(format!(
                "{flag} is of the knob whose take is replayed; add --replay, or leave it out"
            ))),
            _ => Ok(()),
        }
    }

    /// The files that are read.
    pub fn read_files(&self) -> Vec<MaybeFile<'_>> {
        let controllers = self.controllers.as_ref().and_then(|map| map.path.as_deref());
        let breath = self.breath.as_deref().map(Path::new);
        let files = [&self.midi, &self.replay, &self.scl, &self.kbm].map(Option::as_deref);
        files.into_iter().chain([breath, controllers, self.instrument.instrument.file()]).collect()
    }

    /// Says which notes of the command line begin above all that a curve of gamma reaches. Takes some 30 ms for each note, so a batch
    /// does not ask.
    pub fn too_little_breath(&self) -> Option<String> {
        let curve = self.curve().ok()??;
        let reaches = f64::from(curve.gamma_max());
        if reaches >= ALL_BEGIN {
            return None;
        }
        let Planned { file, settings, .. } = self.plan().ok()?;
        let of_sounding = |note: u8| SoundingNote(note).written(file.transposition).map(|note| note.0);
        let notes = match (self.scale, self.written.or_else(|| of_sounding(self.sounding?))) {
            (Some((from, to)), _) => from.min(to)..=from.max(to),
            (None, note) => note.map(|note| note..=note)?,
        };
        if settings.breath_response != BreathResponse::Physical {
            return None;
        }
        let begin = |note| linear_threshold(&file, WrittenNote(note), &settings).map(|gamma| (note, gamma));
        let mut late = notes.filter_map(begin).filter(|&(_, gamma)| reaches < INERTIA_LEAST * gamma);
        let (note, gamma) = late.next()?;
        let others = late.count();
        let others = if others > 0 { format!(" (and {others} more)") } else { String::new() };
        Some(format!(
            "{}{others} begins to sound at gamma {gamma:.2}, and the breath reaches {}: only air is heard",
            WrittenNote(note),
            curve.gamma_max()
        ))
    }

    /// The trim of each note by its sounding pitch, cents.
    fn trims(&self, file: &InstrumentFile) -> Result<BTreeMap<u8, f64>, Failure> {
        let mut trims = BTreeMap::new();
        for &(written, cents) in &self.trim {
            let note = sounding(file, WrittenNote(written))?;
            if trims.insert(note.0, cents).is_some() {
                return Err(Failure::Usage(format!("--trim has two values for {}", WrittenNote(written))));
            }
        }
        Ok(trims)
    }

    /// The instrument and the player's settings, with nothing to play.
    pub fn without_score(&self) -> Result<RenderJob, Failure> {
        RenderJob::without_score(&self.instrument, &self.settings, self.rate)
    }

    /// The feel of the knob.
    pub fn feel(&self, file: &InstrumentFile) -> Result<FeelDesign, Failure> {
        self.feel.design(file)
    }

    /// What is played, in a few words.
    pub fn title(&self) -> String {
        match (&self.midi, self.written, self.sounding, self.scale) {
            (Some(path), ..) => path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned(),
            (_, Some(written), ..) => format!("written {}", WrittenNote(written)),
            (_, _, Some(sounding), _) => format!("sounding {}", SoundingNote(sounding)),
            (.., Some((from, to))) => format!("scale {} to {}", WrittenNote(from), WrittenNote(to)),
            // clap asks for one of the four.
            (None, None, None, None) => String::new(),
        }
    }

    /// The events of a score with the breath of a take.
    fn replayed(
        &self,
        take: &Take,
        model: &Model,
        settings: &Settings,
        score: &Score<PartEvent>,
    ) -> Result<Vec<Timed<PartEvent>>, Failure> {
        let feels = InstrumentFeel::new(model);
        let design = self.feel.design(&model.file)?;
        let table = feels.table(settings, &design, &NO_MOTOR)?;
        let knob = KnobDesign { full_deg: design.travel_deg, ..KnobDesign::default() };
        let hand = BreathMapping { maps: feels.maps_for(&table, settings), design: knob, feels: true };
        let rate_hz = f64::from(self.rate);
        let full_pa = 1e3 * f64::from(settings.breath_full_kpa);
        let events = BlownEvents::new(
            score.events.iter().copied(),
            &mut Blower::default(),
            &hand,
            full_pa,
            score.samples,
            |at| Some(take.angle_deg(at as f64 / rate_hz)),
            &mut |_, _| {},
        )
        .collect();
        Ok(events)
    }

    fn curve(&self) -> Result<Option<BreathCurve>, Failure> {
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
            return Ok(self.midi.is_none().then(|| BreathCurve::constant(GAMMA_DEFAULT)));
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
        let from = fs::File::open(&path).map_err(|source| Failure::Read { path: path.clone(), source })?;
        match BreathCurve::read_csv(from) {
            Ok(curve) => Ok(Some(curve)),
            Err(source) => Err(Failure::BreathFile { path, source }),
        }
    }

    fn score(
        &self,
        file: &InstrumentFile,
        map: &ControllerMap,
        settings: &mut Settings,
    ) -> Result<Score<PartEvent>, Failure> {
        let links = as_links(&map.links, settings);
        let transposition = file.transposition;
        let (players, key_switches) = (&mut settings.players, settings.reach.key_switches);
        if self.tracks && (self.midi.is_none() || matches!(self.given, Some(Given::Notes(_)))) {
            return Err(Failure::Usage(
                "--tracks needs a MIDI file, each track of which has a player".to_owned(),
            ));
        }
        if self.tracks && self.settings.players_given() {
            let usage = "--tracks gives each track a player of its own; leave it out, or the number and split of players";
            return Err(Failure::Usage(usage.to_owned()));
        }
        if let Some(path) = &self.midi {
            let bytes = match &self.given {
                Some(Given::Notes(notes)) => return Ok((&score_of(notes, self.rate)).into()),
                Some(Given::Midi(bytes)) => bytes.clone(),
                None => fs::read(path).map_err(|source| no_such_piece(path, source))?,
            };
            let mut decoder = if self.mpe { MidiDecoder::new().with_mpe() } else { MidiDecoder::new() };
            decoder.set_links(&links);
            if let Some(preset) = &self.preset {
                // Nothing sounds yet, so this bends nothing.
                decoder.usual_bend_range(preset.bend_range());
                decoder.set_wheel(preset.wheel());
                decoder.set_breath_from(preset.breath_from());
            }
            set_by_map(&mut decoder, map);
            let refused = |source| Failure::MidiFile { path: path.clone(), source };
            if self.tracks {
                let (score, count) =
                    midi_file::read_tracks(&decoder, key_switches, &bytes, self.rate).map_err(refused)?;
                *players = Players { count: count as i32, split: Split::Chords, ..*players };
                return Ok(score);
            }
            let mut parts = Parts::of(decoder, players.parts());
            parts.set_key_switches(key_switches);
            return midi_file::read_parts(parts, &bytes, self.rate).map_err(refused);
        }
        if let Some((from, to)) = self.scale {
            for end in [from, to] {
                check_fingering(file, WrittenNote(end))?;
            }
            let (mut notes, _) = scale_of_chart((from, to), file);
            if from > to {
                notes.reverse();
            }
            let seconds = self.seconds.unwrap_or(0.5);
            let scale = Score::one_after_another(&notes, transposition, seconds, self.slurred, self.rate)?;
            return Ok((&scale).into());
        }
        let seconds = self.seconds.unwrap_or(2.0);
        let sounding = match (self.written.map(WrittenNote), self.sounding.map(SoundingNote)) {
            (Some(written), _) => {
                check_fingering(file, written)?;
                written.sounding(transposition)
            }
            (None, sounding) => sounding,
        };
        let written = sounding.and_then(|note| note.written(transposition));
        match (sounding, written) {
            (Some(sounding), Some(written)) => {
                check_fingering(file, written)?;
                Ok((&Score::note(sounding, seconds, self.rate)).into())
            }
            _ => {
                let given = sounding.or(self.sounding.map(SoundingNote));
                let name = given.map_or_else(String::new, |note| format!("sounding {} ({note})", note.0));
                let ends = [file.lowest(), file.highest()].map(|note| note.sounding(transposition));
                let [low, high] =
                    ends.map(|note| note.map_or_else(String::new, |note| format!("{} ({note})", note.0)));
                Err(Failure::Usage(format!(
                    "{name} has no fingering; this instrument sounds {low} to {high}"
                )))
            }
        }
    }
}

/// The notes between these two, with them, that the chart has, and those that it does not have, both low to high.
fn scale_of_chart((from, to): (u8, u8), file: &InstrumentFile) -> (Vec<WrittenNote>, Vec<WrittenNote>) {
    (from.min(to)..=from.max(to)).map(WrittenNote).partition(|&note| file.fingering(note).is_some())
}

/// Says which notes of a scale the chart does not have.
fn left_out_of_scale(ends: (u8, u8), file: &InstrumentFile) -> Option<String> {
    let (_, missing) = scale_of_chart(ends, file);
    let names: Vec<_> = missing.iter().map(WrittenNote::to_string).collect();
    (!names.is_empty())
        .then(|| format!("this instrument has no {}; the scale leaves them out", names.join(" ")))
}

/// Values of a map that the decoder of MIDI takes, and no instrument.
const OF_THE_DECODER: [&str; 3] = ["wheel", "bfrom", "bendr"];

/// Sets what a map says of the wheel, of the controller that blows, and of the bend range. Nothing sounds yet, so this bends nothing.
fn set_by_map(decoder: &mut MidiDecoder, map: &ControllerMap) {
    for &(parameter, value) in &map.values {
        match (parameter.id, value) {
            ("wheel", Value::Choice(at)) => {
                decoder.set_wheel(Wheel::ALL.get(at).copied().unwrap_or_default());
            }
            ("bfrom", Value::Choice(at)) => {
                decoder.set_breath_from(BreathFrom::ALL.get(at).copied().unwrap_or_default());
            }
            ("bendr", Value::Whole(semitones)) => {
                decoder.usual_bend_range(semitones.clamp(0, 127) as u8);
            }
            _ => {}
        }
    }
}

/// Says which values of a map have no effect offline.
fn only_in_the_plugin(map: &ControllerMap) -> Option<String> {
    let ids = map.values.iter().map(|(parameter, _)| *parameter);
    let idle = ids.filter(|of| of.sets.is_none() && !OF_THE_DECODER.contains(&of.id));
    let names: Vec<_> = idle.map(|of| format!("{} ({})", of.name, of.id)).collect();
    (!names.is_empty()).then(|| {
        format!("--controllers sets {}, which only the plugin has: no effect here", names.join(", "))
    })
}

/// Reads a recorded take.
fn read_take(path: &Path) -> Result<Take, Failure> {
    let from = fs::File::open(path).map_err(|source| Failure::Read { path: path.to_owned(), source })?;
    Take::read(from).map_err(|source| Failure::TakeFile { path: path.to_owned(), source })
}

/// The score of notes. A key that comes up where another goes down comes up after it: a slur.
fn score_of(notes: &[TimedNote], rate: u32) -> Score {
    let at = |seconds: f64| (seconds * f64::from(rate)).round() as usize;
    let on = notes.iter().map(|one| {
        let event = Event::NoteOn { note: one.note, velocity: one.velocity };
        Timed { at: at(one.from_s), event }
    });
    let off = notes.iter().map(|one| {
        let event = Event::NoteOff { note: one.note };
        Timed { at: at(one.from_s + one.seconds), event }
    });
    let mut events: Vec<_> = on.chain(off).collect();
    // A note struck again at the moment of its end: its own end comes first.
    let order = |timed: &Timed<Event>| match timed.event {
        Event::NoteOff { note } => {
            u8::from(!notes.iter().any(|one| one.note == note && at(one.from_s) == timed.at))
        }
        _ => 1,
    };
    events.sort_by_key(|timed| (timed.at, order(timed)));
    let samples = events.last().map_or(0, |last| last.at);
    Score { events, samples }
}

/// Why a piece cannot be read; who gives the name of a note means one note.
fn no_such_piece(path: &Path, source: std::io::Error) -> Failure {
    match path.to_str().filter(|name| note(name).is_ok() && source.kind() == std::io::ErrorKind::NotFound) {
        Some(name) => Failure::Usage(format!("there is no file {name}; for one note give --written {name}")),
        None => Failure::Read { path: path.to_owned(), source },
    }
}
