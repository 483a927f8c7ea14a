//! Everything the editor shows at one moment, as plain data.
//! The plugin fills it from atomics, triple buffers and rings. Tests fill it by hand or by playing the instrument offline.
//! The editor knows no voice, no link to the knob and no lock. It shows missing values as missing: every `Option` and every
//! empty list has its own look.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use crate::controllers::breath_input::BreathInput;
use crate::editor::connections::Connections;
use crate::editor::fingering_search::FingeringSearch;
use crate::editor::sound_analysis::SoundAnalysis;
use crate::folder_listing::FolderListing;
use crate::presets::PresetShelf;
use chalumeau_core::bore::alterations::Alterations;
use chalumeau_core::bore::instrument_file::{Fingering, InstrumentFile};
use chalumeau_core::event::Fingerings;
use chalumeau_core::haptics::{NoteFeel, NoteRequirement};
use chalumeau_core::instrument::player::dynamics::LipShape;
use chalumeau_core::instrument::{KeyPitches, Settings};
use chalumeau_core::units::{SoundingNote, WrittenNote, clamped_or};

/// Less mouth pressure than this is no breath, kPa.
pub const NO_BREATH_KPA: f32 = 0.02;

/// See the module.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// The instrument that sounds.
    pub instrument: Arc<InstrumentFile>,
    /// The same as its file has it, before any alteration and before scaling.
    pub as_built: Arc<InstrumentFile>,
    /// What names this instrument in a saved project.
    pub instrument_key: String,
    /// The file that *User file* stands for, whichever instrument plays; empty for the usual place.
    pub instrument_file: String,
    /// Whether it can be altered: not while another one comes.
    pub can_alter: bool,
    /// What the user has altered, in lengths of the file.
    pub alterations: Arc<Alterations>,
    /// Where the altered instrument was saved, or why it was not.
    pub saved: Option<Result<PathBuf, String>>,
    /// What each key plays.
    pub key_pitches: KeyPitches,
    /// The scale that the keys play, as lists show it.
    pub scale: String,
    /// Tenths of a cent by which notes, by sounding pitch, are moved.
    pub trims: BTreeMap<u8, i16>,
    /// Whether the keys follow a tuning program; `None` if none runs.
    pub follows_tuning_program: Option<bool>,
    /// Why the last file of a scale was not taken.
    pub scale_refused: Option<String>,
    /// The folder that the user chooses a file from.
    pub folder: Arc<FolderListing>,
    /// Notes within its range that it cannot play, see [`Model::speaks`](chalumeau_core::instrument::Model::speaks).
    pub silent: Vec<SoundingNote>,
    /// Instruments that can be chosen, by name; the chosen one may be none of them.
    pub instruments: Vec<String>,
    /// Index into `instruments`.
    pub chosen: Option<usize>,
    /// Presets to choose from.
    pub presets: Arc<PresetShelf>,
    /// Name of the preset that was chosen last; empty if there is none.
    pub preset: String,
    /// The key that is held, if any.
    pub key: Option<SoundingNote>,
    /// The note that it plays.
    pub sounding: Option<SoundingNote>,
    /// Index into the instrument's fingerings: the one in place, held or last held.
    pub fingering: usize,
    /// How far each hole is open, 0..=1, in the order of the file.
    pub openings: Vec<f32>,
    /// The fingerings that the user looks for.
    pub fingerings: FingeringSearch,
    /// Mouth pressure, kPa.
    pub mouth_kpa: f32,
    /// How the player's lip shapes the reed; `None` where the breath is physical.
    pub lip: Option<LipShape>,
    /// The dynamic that is played, 0 (pianissimo) to 1 (fortissimo); `None` where the breath is physical.
    pub dynamic: Option<f32>,
    /// The fingerings that a key switch has chosen, if one has.
    pub switched_fingerings: Option<Fingerings>,
    /// The pressures that this fingering needs with this reed; `None` if it cannot sound or is not known yet.
    pub requirement: Option<NoteRequirement>,
    /// The settings of the parameters.
    pub settings: Settings,
    /// Where breath can come from.
    pub sources: Vec<BreathSource>,
    /// What the microphone does.
    pub microphone: MicrophoneState,
    /// The last seconds.
    pub history: Track,
    /// The inside of the mouthpiece, two periods of the lowest note or more.
    pub scope: MouthpieceTraces,
    /// The sound that comes out.
    pub heard: SoundAnalysis,
    /// Highest magnitude of the output since the last snapshot, both channels, with pan and room; 1 is full scale.
    pub output_peak: f32,
    /// Whether notes or controllers of the host have arrived just now.
    pub hears_midi: bool,
    /// Standing wave of the fingering at the pitch of the note: place, m from the reed, and magnitude over that at the
    /// reed.
    pub standing: Vec<(f32, f32)>,
    /// What the user should know, most important first.
    pub status: Vec<Status>,
    /// The feel of this fingering, or the reason why there is none.
    pub feel: Result<NoteFeel, String>,
    /// The knob.
    pub knob: KnobState,
    /// Delay of the plugin, ms.
    pub latency_ms: f32,
    /// The largest window that the screen has room for, points at 100 %; `None` if that is not known.
    pub room: Option<(f32, f32)>,
    /// Where sound and MIDI go and come from, in a program without a host.
    pub connections: Option<Connections>,
}

impl Default for Snapshot {
    fn default() -> Self {
        let instrument = Arc::new(InstrumentFile::built_in());
        let openings = vec![0.0; instrument.holes.len()];
        Self {
            as_built: instrument.clone(),
            instrument,
            instrument_key: String::new(),
            instrument_file: String::new(),
            can_alter: true,
            alterations: Arc::default(),
            saved: None,
            key_pitches: KeyPitches::default(),
            scale: "Equal temperament".to_owned(),
            trims: BTreeMap::new(),
            follows_tuning_program: None,
            scale_refused: None,
            folder: Arc::default(),
            silent: Vec::new(),
            instruments: Vec::new(),
            chosen: None,
            presets: Arc::default(),
            preset: String::new(),
            key: None,
            sounding: None,
            fingering: 0,
            openings,
            fingerings: FingeringSearch::Resting,
            mouth_kpa: 0.0,
            lip: None,
            dynamic: None,
            switched_fingerings: None,
            requirement: None,
            settings: Settings::default(),
            sources: Vec::new(),
            microphone: MicrophoneState::Off,
            history: Track::default(),
            scope: MouthpieceTraces::default(),
            heard: SoundAnalysis::default(),
            output_peak: 0.0,
            hears_midi: false,
            standing: Vec::new(),
            status: Vec::new(),
            feel: Err("no knob feel yet".into()),
            knob: KnobState::default(),
            latency_ms: 0.0,
            room: None,
            connections: None,
        }
    }
}

impl Snapshot {
    /// What names the instrument whose moved holes can be undone and redone now.
    pub fn altered_key(&self) -> Option<&str> {
        self.can_alter.then_some(&*self.instrument_key)
    }

    /// The settings with the reed as the lip has it now.
    pub fn played(&self) -> Settings {
        self.settings.under_lip(self.lip)
    }

    /// Closing pressure of the reed as the lip has it now, kPa.
    pub fn closing_kpa(&self) -> f32 {
        (self.played().closing_pa() * 1e-3) as f32
    }

    /// Mouth pressure, kPa, limited to 0..=100.
    pub fn mouth_now_kpa(&self) -> f32 {
        clamped_or(self.mouth_kpa, 0.0, 100.0, 0.0)
    }

    /// The fingering in place.
    pub fn fingering(&self) -> Option<&Fingering> {
        self.instrument.fingerings.get(self.fingering)
    }

    /// The lowest and the highest key of the keyboard: those of the instrument's range, before transposition.
    pub fn keys(&self) -> Option<(SoundingNote, SoundingNote)> {
        let transpose = self.settings.reach.transpose;
        let key = |note: WrittenNote| {
            let key = i32::from(note.sounding(self.instrument.transposition)?.0) - transpose;
            Some(SoundingNote(u8::try_from(key).ok().filter(|&key| key < 128)?))
        };
        Some((key(self.instrument.lowest())?, key(self.instrument.highest())?))
    }

    /// The note that a key plays, if any.
    pub fn plays(&self, key: SoundingNote) -> Option<SoundingNote> {
        let transposition = self.instrument.transposition;
        let range =
            [self.instrument.lowest(), self.instrument.highest()].map(|note| note.sounding(transposition));
        let [Some(lowest), Some(highest)] = range else { return None };
        let find = |note: SoundingNote| {
            ((lowest..=highest).contains(&note) && !self.silent.contains(&note)).then_some(())
        };
        self.settings.reach.find(key, &self.key_pitches, find).map(|(pitch, ())| pitch.note)
    }

    /// The note as it is written, of the held key or of the fingering in place.
    pub fn written(&self) -> Option<WrittenNote> {
        self.sounding
            .and_then(|note| note.written(self.instrument.transposition))
            .or_else(|| self.fingering().map(|fingering| fingering.written))
    }

    /// Which fingerings the next note takes.
    pub fn next_fingerings(&self) -> Fingerings {
        self.settings.fingerings(self.switched_fingerings)
    }

    /// The pressures that matter for this note.
    pub fn marks(&self) -> PressureMarks {
        let closing_kpa = self.closing_kpa();
        let of = |gamma: f64| gamma as f32 * closing_kpa;
        PressureMarks {
            speaks_kpa: self.requirement.map(|r| of(r.gamma_sounding)),
            beats_kpa: self.requirement.map(|r| of(r.gamma_beat)),
            closes_kpa: closing_kpa,
            chokes_kpa: self.requirement.map(|r| of(r.gamma_off)),
        }
    }
}

/// Mouth pressures of the current note, kPa.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressureMarks {
    /// The note begins to sound.
    pub speaks_kpa: Option<f32>,
    /// The reed begins to touch the lay.
    pub beats_kpa: Option<f32>,
    /// The reed at rest would be shut.
    pub closes_kpa: f32,
    /// The sound stops.
    pub chokes_kpa: Option<f32>,
}

/// A source of breath.
#[derive(Clone, Debug, PartialEq)]
pub struct BreathSource {
    /// Which it is.
    pub input: BreathInput,
    /// Its value, 0..=1.
    pub value: f32,
    /// It sets the breath.
    pub is_live: bool,
    /// It has sent a value since the start.
    pub is_seen: bool,
}

/// What the microphone does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MicrophoneState {
    /// It is switched off, or nothing plays.
    #[default]
    Off,
    /// Exact zeros come in: nothing is connected.
    Unconnected,
    /// It measures the room.
    Measuring {
        /// Time left, s.
        left_s: f32,
    },
    /// It listens for wind.
    Listening {
        /// Level of the room, dBFS.
        floor_dbfs: f32,
    },
}

/// Values at equal steps of time, oldest first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Track {
    /// Between two values, s.
    pub step_s: f32,
    /// Mouth pressure, kPa.
    pub kpa: Vec<f32>,
    /// The pressures that mattered for the note of that time.
    pub marks: Vec<PressureMarks>,
    /// Level of the sound, dB over full scale, root mean square.
    pub level_db: Vec<f32>,
    /// Pitch as a MIDI number with its fraction at A4 = 440 Hz; `None` without one.
    pub pitch: Vec<Option<f32>>,
}

/// The inside of the mouthpiece at equal steps, oldest first; all of one length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MouthpieceTraces {
    /// Values a second.
    pub rate_hz: f32,
    /// Pressure in the mouthpiece, kPa.
    pub mouthpiece_kpa: Vec<f32>,
    /// Reed opening over the rest opening: 0 closed.
    pub opening: Vec<f32>,
    /// Flow through the reed, cm3/s.
    pub flow_cm3s: Vec<f32>,
}

impl MouthpieceTraces {
    /// Indices of the latest whole period at `f0_hz`.
    pub fn last_period(&self, f0_hz: f32) -> std::ops::Range<usize> {
        let length = self.mouthpiece_kpa.len().min(self.opening.len()).min(self.flow_cm3s.len());
        let period = if f0_hz > 0.0 { (self.rate_hz / f0_hz).ceil() as usize + 1 } else { length };
        length.saturating_sub(period)..length
    }

    /// Indices of at most `most` whole periods at `f0_hz`, from where the pressure rises through its mean: a picture of
    /// them stands still. Everything where there is no such.
    pub fn standing_periods(&self, f0_hz: f32, most: usize) -> std::ops::Range<usize> {
        let length = self.mouthpiece_kpa.len().min(self.opening.len()).min(self.flow_cm3s.len());
        let period = self.rate_hz / f0_hz;
        if !(period.is_finite() && period >= 1.0 && period <= length as f32) {
            return 0..length;
        }
        let whole = (length as f32 / period) as usize;
        // Over whole periods, or the mean would depend on when they begin.
        let wave = &self.mouthpiece_kpa[..(whole as f32 * period) as usize];
        let mean = wave.iter().sum::<f32>() / wave.len() as f32;
        let Some(rise) = wave.windows(2).position(|pair| pair[0] < mean && pair[1] >= mean) else {
            return 0..length;
        };
        // It rises somewhere in the first of them.
        let shown = whole.saturating_sub(1).clamp(1, most.max(1)) as f32 * period;
        let end = rise + shown.ceil() as usize + 1;
        if end > length + 1 { 0..length } else { rise..end.min(length) }
    }
}

/// A line for the user.
#[derive(Clone, Debug, PartialEq)]
pub struct Status {
    /// How much it matters.
    pub level: Severity,
    /// The line.
    pub text: String,
}

/// How much something matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// All is well.
    Good,
    /// Worth knowing.
    Note,
    /// Something the user should fix.
    Warn,
}

/// The knob and the connection to it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KnobState {
    /// What there is to choose from.
    pub devices: Vec<KnobDevice>,
    /// State of the connection, in one line.
    pub text: String,
    /// It answers and can be armed.
    pub is_live: bool,
    /// It makes torque.
    pub is_armed: bool,
    /// It has been told to arm, and may turn a little to test its signs.
    pub is_arming: bool,
    /// Most torque the last arming allowed, mNm.
    pub ceiling_mnm: f32,
    /// Position, degrees.
    pub angle_deg: Option<f32>,
    /// Torque that it reports, mNm; positive resists.
    pub torque_mnm: Option<f32>,
    /// What the knob says of faults, or why something did not happen.
    pub notice: Option<String>,
    /// Positions a second.
    pub rate_hz: f32,
    /// Lateness of the positions, median and 99th percentile, us.
    pub jitter_us: (u32, u32),
    /// From a new feel to its echo, us.
    pub round_trip_us: Option<u32>,
    /// Frames lost, and frames damaged, since the port was opened.
    pub lost: u64,
    /// See `lost`.
    pub damaged: u64,
    /// Times the knob went away.
    pub losses: u32,
}

/// One device in the list.
#[derive(Clone, Debug, PartialEq)]
pub struct KnobDevice {
    /// What to give back in [`Action::ChooseDevice`](crate::editor::Action::ChooseDevice).
    pub key: String,
    /// Name and serial number.
    pub name: String,
    /// "ready", "in use by ...", "no permission: ...".
    pub state: String,
    /// It is the one in use.
    pub is_chosen: bool,
    /// Nothing stands in the way.
    pub is_free: bool,
    /// It is surely a knob. A MIDI port, a board with a common chip and the entry for OSC may be one or not.
    pub is_knob: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scope(f0_hz: f32, length: usize, phase: f32) -> MouthpieceTraces {
        let turn = std::f32::consts::TAU * f0_hz / 48_000.0;
        let wave: Vec<f32> = (0..length).map(|n| 1.0 + (turn * n as f32 + phase).sin()).collect();
        MouthpieceTraces {
            rate_hz: 48_000.0,
            opening: wave.clone(),
            flow_cm3s: wave.clone(),
            mouthpiece_kpa: wave,
        }
    }

    #[test]
    fn a_picture_of_whole_periods_stands_still_whenever_it_is_taken() {
        let periods = |f0_hz: f32, length: usize| -> Vec<usize> {
            let lengths = (0..40).map(|step| {
                let scope = scope(f0_hz, length, 0.3 * step as f32);
                let shown = scope.standing_periods(f0_hz, 6);
                assert!((scope.mouthpiece_kpa[shown.start] - 1.0).abs() < 0.2, "begins where it rises");
                assert!(
                    scope.mouthpiece_kpa[shown.start] < scope.mouthpiece_kpa[shown.start + 1],
                    "and rises"
                );
                ((shown.len() as f32) * f0_hz / 48_000.0).round() as usize
            });
            lengths.collect()
        };
        // The lowest note of a clarinet in what the audio thread leaves: one period always fits.
        assert!(periods(146.8, 672).iter().all(|&periods| periods == 1));
        assert!(periods(1_400.0, 672).iter().all(|&periods| periods == 6));
    }

    #[test]
    fn what_has_no_period_is_shown_whole() {
        assert_eq!(scope(100.0, 672, 0.0).standing_periods(0.0, 6), 0..672);
        assert_eq!(scope(0.0, 672, 0.0).standing_periods(200.0, 6), 0..672);
        assert_eq!(MouthpieceTraces::default().standing_periods(200.0, 6), 0..0);
    }
}
