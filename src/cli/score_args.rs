//! Arguments for what is played: a MIDI file, a note or a scale, and its breath. `render` and `report` share them.

mod breath_args;
mod given;
mod replay;

use crate::cli::Failure;
use crate::cli::controllers::{GivenMap, named_or_file, only_in_the_plugin, set_by_map};
use crate::cli::feel_args::FeelArgs;
use crate::cli::files::MaybeFile;
use crate::cli::idle_settings::{self, Idle};
use crate::cli::render_job::RenderJob;
use crate::cli::settings::SettingsArgs;
use crate::cli::shared_args::{PlayedArgs, check_fingering, note, rate, sounding, within};
use crate::cli::silent_keys::{never_heard, silent_notes};
use crate::controllers::{ControllerMap, as_links};
use crate::presets::{self, Preset};
use crate::scale_file;
use chalumeau_core::bore::fingering_finder;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::control::midi::MidiDecoder;
use chalumeau_core::control::parts::Parts;
use chalumeau_core::control::parts::Unplayed;
use chalumeau_core::event::{Event, PartEvent, Timed, To};
use chalumeau_core::haptics::{FeelDesign, RequirementSolver};
use chalumeau_core::instrument::feel_inputs::played_reed;
use chalumeau_core::instrument::key_pitches::{KeyPitches, TRIM_MOST_CENTS};
use chalumeau_core::instrument::{BreathResponse, Players, Settings, Split};
use chalumeau_core::score::Score;
use chalumeau_core::score::breath::BreathCurve;
use chalumeau_core::score::midi_file;
use chalumeau_core::score::midi_file::Tracks;
use chalumeau_core::units::{Air, SoundingNote, WrittenNote};
use chalumeau_knob::touch::take::Take;
use clap::{ArgGroup, Args};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use breath_args::BreathArgs;
pub use breath_args::{BreathSource, GAMMA_DEFAULT};
use given::score_of_parts;
pub use given::{Given, TimedNote};

/// Least and greatest length of a note, s.
const NOTE_S: (f64, f64) = (0.01, 3600.0);
/// Length of a note where nothing says another, s.
const USUAL_NOTE_S: f64 = 2.0;
/// The waveguide that is played may begin so much below the threshold of the transfer-matrix model.
const MODELS_APART: f64 = 0.98;
/// Gamma at which every note of a clarinet has begun, also under a firm lip (`chalumeau threshold --zeta 0.15`: 0.54 at most, less a fifth).
const ALL_BEGIN: f64 = 0.5;

/// By so much a breath may be longer than the piece without a word, s.
const LEFT_OVER_S: f64 = 0.1;

/// What to play, on what, and how.
#[derive(Args)]
#[command(group = ArgGroup::new("what").required(true).args(["midi", "written", "sounding", "scale"]))]
#[command(group = ArgGroup::new("note").args(["written", "sounding", "scale"]))]
pub struct ScoreArgs {
    /// Standard MIDI file, format 0 or 1
    #[arg(value_name = "MIDI")]
    midi: Option<PathBuf>,
    /// The file is MPE: channel 1 is the manager, the other channels bend by 48 semitones
    #[arg(long, requires = "midi", conflicts_with = "note")]
    mpe: bool,
    /// Give each track with notes its own player and seat. If only one track has notes, give each channel its own player.
    /// --seats sets the width, and the pan (CC10) of a track moves its player
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
    /// Chromatic scale between two written notes of the instrument, up or down, for example E3:C6; notes between them that it
    /// does not have are left out
    #[arg(long, value_name = "FROM:TO", value_parser = interval)]
    scale: Option<(u8, u8)>,
    /// Slur the scale instead of tonguing each note
    #[arg(long, requires = "scale", conflicts_with_all = ["midi", "written", "sounding"])]
    slurred: bool,
    /// Fingering of the note instead of the chart's: names of the open holes, as `fingerings` lists them, for example "REG L3 R3 E_PAD";
    /// all others are shut, and "" shuts all. The tuning stays that of the note
    #[arg(long, value_name = "HOLES", conflicts_with_all = ["midi", "scale"])]
    open_holes: Option<String>,
    /// Length of the note, or of each note of the scale, s, 0.01..3600 [default: 2; for a note of a scale 0.5;
    /// with --replay the length of the take; with a longer --breath its length]
    #[arg(long, value_name = "S", conflicts_with = "midi", value_parser = |s: &str| within(s, NOTE_S.0, NOTE_S.1))]
    seconds: Option<f64>,
    /// Time to fade after the last event, s, 0..60 [default: 1; for a single note 0; longer with
    /// --fall, --breath-in and --room]
    #[arg(long, value_name = "S", value_parser = |s: &str| within(s, 0.0, 60.0))]
    tail: Option<f64>,

    #[command(flatten)]
    breath: BreathArgs,
    /// Sample rate, Hz, 1000..1536000
    #[arg(long, alias = "sr", value_name = "HZ", default_value = "48000", help_heading = "Output", value_parser = rate)]
    rate: u32,

    /// Play a preset, a factory preset or one of yours; other flags and --set change it. Its breath response counts, so
    /// that --breath and --crescendo are mostly shares of full breath; --gamma is a pressure with every preset. The feel of the knob stays that of its own flags. `chalumeau presets
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
    Ok((note(name)?, within(cents, -TRIM_MOST_CENTS, TRIM_MOST_CENTS)?))
}

/// Which holes are open, by their names.
pub fn open_holes(names: &str, file: &InstrumentFile) -> Result<Vec<bool>, Failure> {
    let mut open = vec![false; file.holes.len()];
    for name in names.split([' ', ',']).filter(|name| !name.is_empty()) {
        let hole = file.holes.iter().position(|hole| hole.name.eq_ignore_ascii_case(name));
        let Some(hole) = hole else {
            let all: Vec<&str> = file.holes.iter().map(|hole| hole.name.as_str()).collect();
            return Err(Failure::Usage(format!(
                "--open-holes: this instrument has no hole {name:?}; its holes are {}",
                all.join(" ")
            )));
        };
        open[hole] = true;
    }
    Ok(open)
}

/// Most players who hold keys at the same time, where the same instant is none.
fn at_once(score: &Score<PartEvent>) -> usize {
    let (mut held, mut most, mut now) = (BTreeMap::<usize, usize>::new(), 0, 0);
    for timed in &score.events {
        if timed.at > now {
            most = most.max(held.values().filter(|&&keys| keys > 0).count());
            now = timed.at;
        }
        let To::Player(player) = timed.event.to else { continue };
        let keys = held.entry(usize::from(player)).or_default();
        match timed.event.event {
            Event::NoteOn { .. } => *keys += 1,
            Event::NoteOff { .. } | Event::Choke { .. } => *keys = keys.saturating_sub(1),
            _ => {}
        }
    }
    most
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
    /// Keys of a MIDI file that play nothing.
    unplayed: Unplayed,
    /// Of another tuning.
    keys: Option<KeyPitches>,
    /// The trim of each note by its sounding pitch, cents.
    trims: BTreeMap<u8, f64>,
    take: Option<Take>,
    warnings: Vec<String>,
    /// Given settings that have no effect.
    idle: Vec<Idle>,
}

impl ScoreArgs {
    /// Reads and checks the arguments and all files that they name. Gives back the settings that have no effect.
    pub fn check(&self) -> Result<Vec<Idle>, Failure> {
        self.plan().map(|planned| planned.idle)
    }

    fn plan(&self) -> Result<Planned, Failure> {
        let file = self.instrument.load_for(self.preset.as_ref())?;
        let mut curve = self.breath.curve(self.midi.is_some())?;
        let map = self.controllers.clone().unwrap_or_default().map;
        let mut base = self.preset.as_ref().map(Preset::settings);
        if !map.values.is_empty() {
            // Over a preset, and under what the user has given.
            let mut under = base.map_or_else(|| self.settings.usual(curve.is_some()), Ok)?;
            map.values.iter().for_each(|(parameter, value)| parameter.set(&mut under, *value));
            base = Some(under);
        }
        let is_pressure = self.breath.gamma.is_some() && !self.settings.is_played_chosen()?;
        let mut settings = match (&curve, &base) {
            (Some(curve), base) if is_pressure => self.settings.blown_by(base.as_ref(), curve, &file)?,
            (Some(curve), base) => self.settings.blown_in_either(base.as_ref(), curve, &file)?,
            (None, base) if self.breath.dynamic.is_some() => {
                self.settings.with_dynamics(base.as_ref(), &file)?
            }
            (None, Some(base)) => self.settings.over_preset(base, &file)?,
            (None, None) => self.settings.played(&file)?,
        };
        if let Some(typed) = self.settings.unison_given()?.filter(|_| settings.players.count == 1) {
            return Err(Failure::Usage(format!(
                "{typed} is for several players, and {}",
                if self.tracks {
                    "--tracks gives each track a player of its own; leave it out"
                } else {
                    "one plays; add --players, or leave it out"
                }
            )));
        }
        let mut warnings: Vec<_> = only_in_the_plugin(&map).into_iter().collect();
        if let Some((from, to)) = self.breath.dynamic {
            curve = Some(BreathCurve::dynamics(from, to, &settings));
        }
        warnings.extend(self.scale.and_then(|ends| left_out_of_scale(ends, &file)));
        let trims = self.trims(&file)?;
        let keys = self.scl.as_ref().map(|scl| scale_file::read(scl, self.kbm.as_deref())).transpose()?;
        let take = self.breath.take()?;
        let breath_s = curve.as_ref().and_then(BreathCurve::ends_s).unwrap_or(0.0);
        let note_s = take.as_ref().map_or(breath_s.max(USUAL_NOTE_S), Take::seconds);
        let (mut parts, unplayed) =
            self.score(&file, &map, keys.as_ref(), &mut settings, note_s, &mut warnings)?;
        if let Some(names) = &self.open_holes {
            let open = open_holes(names, &file)?;
            let event = Event::TryHoles(Some(fingering_finder::bits(&open)));
            parts.events.insert(0, Timed { at: 0, event: event.into() });
        }
        warnings.extend(self.breath_left_over(breath_s, &parts));
        if let Some(curve) = &curve {
            parts = parts.blown(curve, &settings, self.rate);
        }
        let has_controllers = self.midi.is_some() && !matches!(self.given, Some(Given::Notes(_)));
        // Links of a device may move anything.
        let idle = match self.controllers {
            Some(_) => Vec::new(),
            None => self.settings.idle(&settings, self.breath.source(), has_controllers)?,
        };
        Ok(Planned { file, settings, parts, unplayed, keys, trims, take, warnings, idle })
    }

    /// Says that breath remains at the end, unless the user chose that.
    fn breath_left_over(&self, breath_s: f64, parts: &Score<PartEvent>) -> Option<String> {
        let piece_s = parts.samples as f64 / f64::from(self.rate);
        let is_chosen = self.seconds.is_some() && self.scale.is_none();
        (breath_s > piece_s + LEFT_OVER_S && !is_chosen).then(|| {
            format!("the breath ends after {breath_s:.1} s, and the piece after {piece_s:.1} s: the rest of the breath is not played")
        })
    }

    /// Reads and checks the arguments and prepares the instrument. Takes seconds for an instrument file.
    pub fn prepare(&self) -> Result<RenderJob, Failure> {
        let Planned { file, settings, mut parts, unplayed, keys, trims, take, mut warnings, idle } =
            self.plan()?;
        let mut model = self.instrument.model(file, self.rate, settings.a4_hz)?;
        if let Some(keys) = keys {
            Arc::make_mut(&mut model).keys = keys;
        }
        if !trims.is_empty() {
            let cents = |note: SoundingNote| trims.get(&note.0).copied().unwrap_or(0.0);
            let keys = model.keys.trimmed(cents);
            Arc::make_mut(&mut model).keys = keys;
        }
        warnings.extend(silent_notes(&parts.events, &unplayed, &model, settings.reach));
        warnings.extend(never_heard(&parts.events, &model, settings.reach));
        if let Some(take) = &take {
            let design = replay::feel(&self.feel, Some(take), &model.file)?;
            warnings.extend(replay::too_short(take, &parts, self.rate));
            let is_given = self.feel.given().is_some();
            warnings.extend(replay::differences(take, (&design, is_given), &model, &settings)?);
            parts.events = replay::events(take, &design, &model, &settings, &parts, self.rate)?;
        }
        // A single note lasts as long as was asked; a melody gets time to fade, and a room to die away.
        let one_note = self.written.is_some() || self.sounding.is_some();
        let room_s = if settings.room.amount > 0.0 { f64::from(settings.room.decay_s) } else { 0.0 };
        let usual = if one_note { 0.0 } else { 1.0 } + settings.articulation.tail_s() + room_s;
        let parts = parts.with_tail(self.tail.unwrap_or(usual), self.rate);
        Ok(RenderJob {
            model,
            settings,
            score: (&parts).into(),
            parts,
            rate: self.rate,
            warnings,
            idle: idle_settings::in_words(&idle),
        })
    }

    /// Refuses flags of the knob's feel where no take is replayed: they would do nothing.
    pub fn refuse_idle_feel(&self) -> Result<(), Failure> {
        match self.breath.replay {
            Some(_) => Ok(()),
            None => self.refuse_feel("only a take of a knob that is replayed has one: add --replay"),
        }
    }

    /// Refuses holes of the user's choice, where what is shown is of the chart's.
    pub fn refuse_open_holes(&self) -> Result<(), Failure> {
        match self.open_holes {
            Some(_) => Err(Failure::Usage(
                "--open-holes is for `render`: a report shows the fingerings of the chart; leave it out"
                    .to_owned(),
            )),
            None => Ok(()),
        }
    }

    /// Refuses flags of the knob's feel; `why` they would do nothing.
    pub fn refuse_feel(&self, why: &str) -> Result<(), Failure> {
        match self.feel.given() {
            Some(flag) => {
                Err(Failure::Usage(format!("{flag} is of the knob's feel, and {why}; leave it out")))
            }
            None => Ok(()),
        }
    }

    /// The files that are read.
    pub fn read_files(&self) -> Vec<MaybeFile<'_>> {
        let controllers = self.controllers.as_ref().and_then(|map| map.path.as_deref());
        let files = [&self.midi, &self.scl, &self.kbm].map(Option::as_deref);
        let own = files.into_iter().chain(self.breath.read_files());
        own.chain([controllers, self.instrument.instrument.file()]).collect()
    }

    /// The text of the preset that is played: a name may stand for another one by now.
    pub fn preset_text(&self) -> Option<String> {
        self.preset.as_ref().map(Preset::to_text)
    }

    /// Says which notes begin above all that a curve of gamma reaches. Works out the whole bore, so a batch does not
    /// ask.
    pub fn too_little_breath(&self) -> Option<String> {
        if self.open_holes.is_some() {
            // The thresholds are those of the chart's fingerings.
            return None;
        }
        let curve = self.breath.curve(self.midi.is_some()).ok()??;
        let reaches = f64::from(curve.gamma_max());
        if reaches >= ALL_BEGIN {
            return None;
        }
        let Planned { file, settings, parts, .. } = self.plan().ok()?;
        let struck = parts.events.iter().filter_map(|timed| match timed.event.event {
            Event::NoteOn { note, .. } => note.written(file.transposition),
            _ => None,
        });
        let notes: BTreeSet<WrittenNote> = struck.collect();
        if settings.breath_response != BreathResponse::Physical {
            return None;
        }
        let a4_hz = f64::from(settings.a4_hz);
        let bore = RequirementSolver::new(&file, Air::at(f64::from(settings.temperature_c)), a4_hz).ok()?;
        let reed = played_reed(&file, a4_hz, &settings);
        let begin = |note: WrittenNote| {
            let fingering = bore.written().position(|written| written == note)?;
            Some((note, bore.note(fingering, &reed)?.gamma_sounding))
        };
        let mut late =
            notes.into_iter().filter_map(begin).filter(|&(_, gamma)| reaches < MODELS_APART * gamma);
        let (note, gamma) = late.next()?;
        let others = late.count();
        let others = if others > 0 { format!(" (and {others} more)") } else { String::new() };
        Some(format!(
            "{note}{others} begins to sound at gamma {gamma:.2}, and the breath reaches {}: only the tongue and air are heard",
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

    /// The feel of the knob: where no flag says otherwise, the one with which the take was recorded that is replayed.
    pub fn feel(&self, file: &InstrumentFile) -> Result<FeelDesign, Failure> {
        replay::feel(&self.feel, self.breath.take()?.as_ref(), file)
    }

    /// What is played, in a few words.
    pub fn title(&self) -> String {
        match (&self.midi, self.written, self.sounding, self.scale) {
            (Some(path), ..) => path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned(),
            (_, Some(written), ..) => match &self.open_holes {
                Some(holes) => format!("written {}, open: {holes}", WrittenNote(written)),
                None => format!("written {}", WrittenNote(written)),
            },
            (_, _, Some(sounding), _) => format!("sounding {}", SoundingNote(sounding)),
            (.., Some((from, to))) => format!("scale {} to {}", WrittenNote(from), WrittenNote(to)),
            // clap asks for one of the four.
            (None, None, None, None) => String::new(),
        }
    }

    fn score(
        &self,
        file: &InstrumentFile,
        map: &ControllerMap,
        keys: Option<&KeyPitches>,
        settings: &mut Settings,
        note_s: f64,
        warnings: &mut Vec<String>,
    ) -> Result<(Score<PartEvent>, Unplayed), Failure> {
        let links = as_links(&map.links, settings);
        let transposition = file.transposition;
        let has_note = |note: SoundingNote| {
            note.written(transposition).is_some_and(|note| file.fingering(note).is_some())
        };
        let playing =
            settings.reach.key_notes_among(keys.unwrap_or(&KeyPitches::default()), has_note).playing();
        let (players, key_switches) = (&mut settings.players, settings.reach.key_switches);
        if self.tracks && (self.midi.is_none() || matches!(self.given, Some(Given::Notes(_)))) {
            return Err(Failure::Usage(
                "--tracks needs a MIDI file, each track of which has a player".to_owned(),
            ));
        }
        if matches!(self.given, Some(Given::Notes(_))) && (self.mpe || self.controllers.is_some()) {
            let usage = "mpe and controllers are for a MIDI file; a list of notes has no controllers";
            return Err(Failure::Usage(usage.to_owned()));
        }
        if self.tracks && self.settings.players_given() {
            let usage = "--tracks gives each track a player of its own; leave it out, or the number and split of players";
            return Err(Failure::Usage(usage.to_owned()));
        }
        if let Some(path) = &self.midi {
            let bytes = match &self.given {
                Some(Given::Notes(notes)) => {
                    return Ok(score_of_parts(notes, self.rate, players.parts(), playing));
                }
                Some(Given::Midi { bytes, .. }) => bytes.clone(),
                None => fs::read(path).map_err(|source| no_such_piece(path, source))?,
            };
            let path = match &self.given {
                Some(Given::Midi { path: Some(path), .. }) => path,
                _ => path,
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
                let Tracks { score, players: count, unplayed } =
                    midi_file::read_tracks(&decoder, (key_switches, playing), &bytes, self.rate)
                        .map_err(refused)?;
                *players = Players { count: count as i32, split: Split::Chords, ..*players };
                return Ok((score, unplayed));
            }
            let lines = (players.parts() == 1 && !self.mpe)
                .then(|| midi_file::read_tracks(&decoder, (key_switches, playing), &bytes, self.rate).ok());
            if let Some(at_once) = lines.flatten().map(|tracks| at_once(&tracks.score)).filter(|&n| n > 1) {
                warnings.push(format!(
                    "{at_once} tracks or channels of the file play at once, and one player plays them all: add --tracks for a player each"
                ));
            }
            let mut parts = Parts::of(decoder, players.parts());
            parts.set_key_switches(key_switches);
            parts.set_playing_keys(playing);
            let score = midi_file::read_parts(&mut parts, &bytes, self.rate).map_err(refused)?;
            return Ok((score, *parts.unplayed()));
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
            return Ok(((&scale).into(), [0; 128]));
        }
        let seconds = self.seconds.unwrap_or(note_s.clamp(NOTE_S.0, NOTE_S.1));
        let sounding = match (self.written.map(WrittenNote), self.sounding.map(SoundingNote)) {
            (Some(written), _) => {
                check_fingering(file, written)?;
                written.sounding(transposition)
            }
            (None, sounding) => sounding,
        };
        let written = sounding.and_then(|note| note.written(transposition));
        match (sounding, written) {
            (Some(sounding), Some(written)) if file.fingering(written).is_some() => {
                Ok(((&Score::note(sounding, seconds, self.rate)).into(), [0; 128]))
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
        .then(|| format!("the scale leaves out what this instrument does not have: {}", names.join(" ")))
}

/// Why a piece cannot be read; who gives the name of a note means one note.
fn no_such_piece(path: &Path, source: std::io::Error) -> Failure {
    match path.to_str().filter(|name| note(name).is_ok() && source.kind() == std::io::ErrorKind::NotFound) {
        Some(name) => Failure::Usage(format!("there is no file {name}; for one note give --written {name}")),
        None => Failure::Read { path: path.to_owned(), source },
    }
}
