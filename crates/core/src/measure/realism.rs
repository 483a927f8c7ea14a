//! How near played notes come to recorded ones: harmonics, centroid, level, for each note, dynamic and register.
//!
//! The recordings are TinySOL's B flat clarinet (one player, one take per note; Cella, Ghisi, Lostanlen, Levy, Fineberg,
//! Maresz 2020, CC BY 4.0), of which `data/recorded_spectra.csv` holds the levels of every other note. Played notes are
//! measured in the same way by [`SteadyNote`]. One take per note scatters: a recorded note differs from its recorded
//! neighbours by 2.7, 6.8 and 4.8 dB at pp, mf and ff. So an error of that size is as near as such data can tell.

use std::convert::Infallible;
use std::sync::Arc;

use crate::analysis::pitch::OTHER_CENTS;
use crate::analysis::steady_note::{RATE_HZ, SECONDS, SteadyNote};
use crate::analysis::to_f64;
use crate::instrument::player::dynamics::MEZZO_FORTE;
use crate::instrument::{Clarinet, Model, Players, Settings};
use crate::score::breath::BreathCurve;
use crate::score::{self, Score};
use crate::units::{SoundingNote, cents};

/// The committed half of the recorded notes.
const RECORDED: &str = include_str!("../../data/recorded_spectra.csv");
/// Below this level, re the strongest harmonic, recordings at pp hold noise; both sides are clipped there, dB.
const CLIP_DB: f64 = -60.0;
/// What a note counts that does not sound or sounds in another register, dB.
pub const FAIL_DB: f64 = 20.0;
/// What is compared is played this much softer, so that no peak meets the limiter, dB.
pub const HEADROOM_DB: f64 = 20.0;
/// Range of centroid ratios that counts as right.
pub const CENTROID_RATIOS: (f64, f64) = (0.8, 1.25);
/// Highest sounding note of which the third harmonic is compared with the second: sounding B3.
pub const ODD_UP_TO: u8 = 59;
/// Takes that are unsteady or far from their neighbours, by the notes on the recordings.
const ODD_TAKES: [(u8, Dynamic); 13] = [
    (69, Dynamic::Ff),
    (70, Dynamic::Ff),
    (71, Dynamic::Pp),
    (71, Dynamic::Mf),
    (71, Dynamic::Ff),
    (72, Dynamic::Mf),
    (72, Dynamic::Ff),
    (73, Dynamic::Ff),
    (74, Dynamic::Pp),
    (75, Dynamic::Pp),
    (87, Dynamic::Pp),
    (88, Dynamic::Pp),
    (89, Dynamic::Ff),
];

/// A recorded dynamic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Dynamic {
    /// Pianissimo.
    Pp,
    /// Mezzo-forte.
    Mf,
    /// Fortissimo.
    Ff,
}

impl Dynamic {
    /// All, soft to loud.
    pub const ALL: [Self; 3] = [Self::Pp, Self::Mf, Self::Ff];

    /// As it is written in the data.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pp => "pp",
            Self::Mf => "mf",
            Self::Ff => "ff",
        }
    }

    /// The player's dynamic that is compared with it, 0..=1.
    pub fn played(self) -> f64 {
        match self {
            Self::Pp => 0.0,
            Self::Mf => MEZZO_FORTE,
            Self::Ff => 1.0,
        }
    }
}

/// Registers of a B flat clarinet: name, lowest and highest sounding note.
pub const REGISTERS: [(&str, u8, u8); 4] =
    [("chalumeau", 50, 63), ("throat", 64, 68), ("clarion", 69, 82), ("altissimo", 83, 91)];

/// Register of a sounding note of the recordings.
pub fn register(midi: u8) -> &'static str {
    REGISTERS.iter().find(|(_, low, high)| (*low..=*high).contains(&midi)).map_or("", |(name, ..)| name)
}

/// What was read from one recorded note.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedNote {
    /// Sounding note, MIDI.
    pub midi: u8,
    /// How loud it was asked for.
    pub dynamic: Dynamic,
    /// Levels of harmonics 1..=12, dB re the strongest.
    pub levels_db: [f64; 12],
    /// Centroid, Hz.
    pub centroid_hz: f64,
    /// Level, dB; levels of different notes and dynamics can be compared.
    pub rms_dbfs: f64,
}

impl RecordedNote {
    /// The committed notes, low to high, pp to ff. Allocates.
    pub fn all() -> Vec<Self> {
        let rows = RECORDED.lines().filter(|line| !line.starts_with('#')).skip(1);
        rows.filter_map(Self::parse).collect()
    }

    fn parse(line: &str) -> Option<Self> {
        let mut fields = line.split(',');
        let midi = fields.next()?.parse().ok()?;
        let name = fields.next()?;
        let dynamic = Dynamic::ALL.into_iter().find(|dynamic| dynamic.name() == name)?;
        let numbers: Vec<f64> = fields.map(str::parse).collect::<Result<_, _>>().ok()?;
        // f0, attack, rms, centroid, another program's error, h1..h12
        let [_, _, rms_dbfs, centroid_hz, _, levels @ ..] = numbers.as_slice() else { return None };
        Some(Self {
            midi,
            dynamic,
            levels_db: levels.try_into().ok()?,
            centroid_hz: *centroid_hz,
            rms_dbfs: *rms_dbfs,
        })
    }

    /// Whether the take is unsteady or far from its neighbours: weak evidence.
    pub fn is_odd_take(&self) -> bool {
        ODD_TAKES.contains(&(self.midi, self.dynamic))
    }
}

/// Plays a note for as long as a recording is measured, at [`RATE_HZ`]. The breath is constant, 0..=1 under the settings' breath curve.
/// Each take, by number, has breath noise and *Life* of its own, as a recorded note is a take of its own. Notes that all wandered alike would
/// stray from their dynamic together: the mean error of a dynamic over the notes then differs by 0.06 to 0.13 dB from one seed to
/// another. Allocates.
pub fn render(
    model: &Arc<Model>,
    settings: &Settings,
    note: SoundingNote,
    breath: f32,
    take: usize,
) -> Vec<f64> {
    let rate = RATE_HZ as u32;
    let mut clarinet = Clarinet::of_player(model.clone(), RATE_HZ, (take % 256) as u8);
    // One player, in tune.
    let players = Players { spread_cents: 0.0, ..settings.players };
    clarinet.set_settings(&Settings { players, ..*settings });
    clarinet.reset();
    let score = Score::note(note, SECONDS, rate).blown(&BreathCurve::constant(breath), settings, rate);
    let mut samples = Vec::with_capacity(score.samples);
    let Ok(()) = score::play(&mut clarinet, &score, 4096, |block| {
        samples.extend(to_f64(block));
        Ok::<_, Infallible>(())
    });
    samples
}

/// Difference of each harmonic h1..h10, played less recorded, dB: each spectrum re the strongest of its own h1..h10,
/// clipped at -60 dB.
pub fn differences_db(played_db: &[f64], recorded_db: &[f64]) -> Vec<f64> {
    let count = played_db.len().min(recorded_db.len()).min(10);
    let clipped = |levels: &[f64]| -> Vec<f64> {
        let strongest = levels[..count].iter().copied().fold(f64::NEG_INFINITY, f64::max);
        levels[..count].iter().map(|level| (level - strongest).max(CLIP_DB)).collect()
    };
    let (played, recorded) = (clipped(played_db), clipped(recorded_db));
    played.iter().zip(recorded).map(|(played, recorded)| played - recorded).collect()
}

/// A played note against its recording.
#[derive(Clone, Debug, PartialEq)]
pub struct NoteScore {
    /// The recording.
    pub recorded: RecordedNote,
    /// What was played; `None` if nothing sounded, or another note.
    pub played: Option<SteadyNote>,
    /// Mean distance of h2..h10, dB; 20 for a note that failed.
    pub error_db: f64,
    /// Difference of h1..h10, played less recorded, dB; empty for a note that failed.
    pub differences_db: Vec<f64>,
}

impl NoteScore {
    /// Compares a note with its recording. Allocates.
    pub fn new(recorded: RecordedNote, played: Option<SteadyNote>) -> Self {
        let wanted_hz = SoundingNote(recorded.midi).frequency_hz(440.0);
        let played = played.filter(|played| cents(played.f0_hz, wanted_hz).abs() <= OTHER_CENTS);
        let differences_db = played
            .as_ref()
            .map_or_else(Vec::new, |played| differences_db(&played.levels_db, &recorded.levels_db));
        let error_db = match differences_db.get(1..) {
            Some(upper) if !upper.is_empty() => {
                upper.iter().map(|difference| difference.abs()).sum::<f64>() / upper.len() as f64
            }
            _ => FAIL_DB,
        };
        Self { recorded, played, error_db, differences_db }
    }

    /// Centroid over the recorded one; `None` for a note that failed.
    pub fn centroid_ratio(&self) -> Option<f64> {
        self.played.as_ref().map(|played| played.centroid_hz / self.recorded.centroid_hz)
    }

    /// Whether the centroid lies within [`CENTROID_RATIOS`] of the recorded one.
    pub fn is_centroid_right(&self) -> bool {
        self.centroid_ratio().is_some_and(|ratio| (CENTROID_RATIOS.0..=CENTROID_RATIOS.1).contains(&ratio))
    }

    /// Level of the third harmonic over the second, dB: played and recorded.
    pub fn third_over_second_db(&self) -> (Option<f64>, f64) {
        let over = |levels: &[f64]| Some(levels.get(2)? - levels.get(1)?);
        (
            self.played.as_ref().and_then(|played| over(&played.levels_db)),
            over(&self.recorded.levels_db).unwrap_or(f64::NAN),
        )
    }
}

/// Notes of one dynamic, or some of them, in one line.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Number of notes.
    pub notes: usize,
    /// Mean harmonic error, dB.
    pub error_db: f64,
    /// The same without odd takes, dB.
    pub clean_error_db: f64,
    /// Notes that did not sound in their register.
    pub failed: usize,
    /// Share of notes whose centroid is right, 0..=1.
    pub centroid_share: f64,
    /// Median centroid ratio.
    pub centroid_ratio: f64,
    /// Median of the third harmonic over the second up to sounding B3, dB: played and recorded.
    pub third_over_second_db: (f64, f64),
    /// Mean level, dB: played and recorded.
    pub level_db: (f64, f64),
}

impl Summary {
    /// Of scores, which must not be none. Allocates.
    pub fn of<'a>(scores: impl IntoIterator<Item = &'a NoteScore>) -> Self {
        let scores: Vec<&NoteScore> = scores.into_iter().collect();
        let clean = || scores.iter().filter(|score| !score.recorded.is_odd_take());
        let low = || scores.iter().filter(|score| score.recorded.midi <= ODD_UP_TO);
        let right = scores.iter().filter(|score| score.is_centroid_right()).count();
        Self {
            notes: scores.len(),
            error_db: mean(scores.iter().map(|score| score.error_db)),
            clean_error_db: mean(clean().map(|score| score.error_db)),
            failed: scores.iter().filter(|score| score.played.is_none()).count(),
            centroid_share: right as f64 / scores.len() as f64,
            centroid_ratio: median(scores.iter().filter_map(|score| score.centroid_ratio())),
            third_over_second_db: (
                median(low().filter_map(|score| score.third_over_second_db().0)),
                median(low().map(|score| score.third_over_second_db().1)),
            ),
            level_db: (
                mean(scores.iter().filter_map(|score| score.played.as_ref()).map(|played| played.rms_dbfs)),
                mean(scores.iter().map(|score| score.recorded.rms_dbfs)),
            ),
        }
    }
}

/// Share of the steps from one dynamic to the next, of one note, with which the centroid rises; steps between notes that
/// failed do not count. `scores` holds each note at most once per dynamic. NaN for none.
pub fn louder_is_brighter(scores: &[NoteScore]) -> f64 {
    let centroid = |midi: u8, dynamic: Dynamic| {
        let is_it = |score: &&NoteScore| score.recorded.midi == midi && score.recorded.dynamic == dynamic;
        scores.iter().find(is_it)?.played.as_ref().map(|played| played.centroid_hz)
    };
    let steps = [(Dynamic::Pp, Dynamic::Mf), (Dynamic::Mf, Dynamic::Ff)];
    let rises = scores.iter().filter(|score| score.recorded.dynamic == Dynamic::Mf).flat_map(|score| {
        let midi = score.recorded.midi;
        steps.into_iter().filter_map(move |(from, to)| Some((centroid(midi, from)?, centroid(midi, to)?)))
    });
    mean(rises.map(|(from, to)| f64::from(u8::from(to > from))))
}

/// Arithmetic mean; NaN for none.
pub fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0_usize, 0.0), |(count, sum), value| (count + 1, sum + value));
    sum / count as f64
}

/// Median, the mean of the middle two where their number is even; NaN for none. Allocates.
pub fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        count => 0.5 * (values[(count - 1) / 2] + values[count / 2]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn played(f0_hz: f64, levels_db: &[f64], centroid_hz: f64) -> SteadyNote {
        SteadyNote { f0_hz, levels_db: levels_db.to_vec(), centroid_hz, rms_dbfs: -20.0, attack_s: 0.1 }
    }

    #[test]
    fn the_committed_half_is_complete() {
        let all = RecordedNote::all();
        assert_eq!(all.len(), 63);
        assert!(all.iter().all(|note| note.midi % 2 == 1 && (51..=91).contains(&note.midi)));
        assert!(all.iter().all(|note| note.levels_db.iter().copied().fold(f64::MIN, f64::max) == 0.0));
        assert_eq!(all.iter().filter(|note| note.is_odd_take()).count(), 8);
        let low = &all[1];
        assert_eq!((low.midi, low.dynamic, low.rms_dbfs, low.centroid_hz), (51, Dynamic::Mf, -43.9, 697.7));
        assert!(all.iter().all(|note| !register(note.midi).is_empty()));
    }

    #[test]
    fn a_recording_is_itself_and_another_note_fails() {
        for recorded in RecordedNote::all() {
            let hz = SoundingNote(recorded.midi).frequency_hz(440.0);
            let same = played(hz, &recorded.levels_db, recorded.centroid_hz);
            let score = NoteScore::new(recorded.clone(), Some(same.clone()));
            assert!(score.error_db == 0.0 && score.is_centroid_right());
            let twelfth = SteadyNote { f0_hz: 3.0 * hz, ..same };
            let failed = NoteScore::new(recorded, Some(twelfth));
            assert!(failed.error_db == FAIL_DB && failed.played.is_none() && !failed.is_centroid_right());
        }
    }

    #[test]
    fn levels_are_compared_re_their_strongest_and_clipped() {
        // The played one is 5 dB up as a whole, its second harmonic 3 dB strong, its third in the noise of the recording.
        let differences = differences_db(&[5.0, -7.0, -85.0], &[0.0, -15.0, -66.0]);
        assert_eq!(differences, [0.0, 3.0, 0.0]);
    }

    #[test]
    fn brighter_steps_are_counted() {
        let mut all: Vec<RecordedNote> =
            RecordedNote::all().into_iter().filter(|note| note.midi <= 53).collect();
        all.sort_by_key(|note| note.dynamic);
        let scores: Vec<NoteScore> = all
            .into_iter()
            .map(|recorded| {
                let hz = SoundingNote(recorded.midi).frequency_hz(440.0);
                let dull = recorded.dynamic == Dynamic::Ff && recorded.midi == 53;
                let centroid_hz = if dull { 1.0 } else { recorded.centroid_hz };
                NoteScore::new(recorded.clone(), Some(played(hz, &recorded.levels_db, centroid_hz)))
            })
            .collect();
        assert_eq!(louder_is_brighter(&scores), 0.75);
        let summary = Summary::of(&scores);
        assert_eq!((summary.notes, summary.failed, summary.error_db), (6, 0, 0.0));
        assert!((summary.centroid_share - 5.0 / 6.0).abs() < 1e-12 && summary.level_db.0 == -20.0);
    }
}
