//! The player's small corrections: a delay per note, found by playing the instrument itself.
//!
//! Linear theory cannot supply them (reed damping and saturation move every note by tens of cents), so
//! [`tuner`](super::tuner) plays each note and moves its delay until it is right. *Natural* is the trim at gamma 0.5; *tempered* has four nodes
//! over gamma, because a real bore's modes are not harmonic and pitch sags as the reed begins to beat.

use crate::bore::instrument_file::{Fingering, InstrumentFile};
use crate::instrument::settings::Tuning;

/// Mouth pressures over the closing pressure at which tempered trims are given.
///
/// Of all places for four straight-line nodes these leave the least between them: 1.9 cents at most.
pub const GAMMA_NODES: [f64; 4] = [0.45, 0.55, 0.725, 0.9];
/// Mouth pressure of the natural trim.
pub const NATURAL_GAMMA: f64 = 0.5;

/// Trims of one note, rows of round-trip delay.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct NoteTuning {
    /// Written MIDI note.
    pub written: u8,
    /// Trim at [`NATURAL_GAMMA`].
    pub natural: f64,
    /// Trims at [`GAMMA_NODES`].
    pub tempered: [f64; 4],
    /// Rows that lower the note by one cent, over the quarter-wave estimate of
    /// [`Model::rows_for_cents`](super::Model::rows_for_cents).
    pub sensitivity: f64,
    /// How far above its pitch it is at [`NATURAL_GAMMA`] all the same, because the delay has no more to give, cents.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub off_cents: f64,
    /// It does not sound in its register at any of these pressures: its trims are its neighbours'.
    #[serde(default, skip_serializing_if = "is_false")]
    pub silent: bool,
}

fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

fn is_false(x: &bool) -> bool {
    !x
}

/// Trims of all fingerings of an instrument at one internal rate.
#[derive(Clone, Debug, PartialEq)]
pub struct TuningTable {
    /// In the order of the file's fingerings.
    pub notes: Vec<NoteTuning>,
}

impl TuningTable {
    /// No trims.
    pub fn untuned(file: &InstrumentFile) -> Self {
        let note = |fingering: &Fingering| NoteTuning {
            written: fingering.written.0,
            sensitivity: 1.0,
            ..NoteTuning::default()
        };
        Self { notes: file.fingerings.iter().map(note).collect() }
    }

    /// Trim of a note at a mouth pressure, rows. Real-time safe.
    pub fn rows(&self, fingering: usize, tuning: Tuning, gamma: f64) -> f64 {
        let Some(note) = self.notes.get(fingering) else { return 0.0 };
        match tuning {
            Tuning::Natural => note.natural,
            Tuning::Tempered => {
                let gamma = gamma.clamp(GAMMA_NODES[0], GAMMA_NODES[3]);
                let right = GAMMA_NODES[1..3].partition_point(|&node| node < gamma) + 1;
                let (g0, g1) = (GAMMA_NODES[right - 1], GAMMA_NODES[right]);
                let way = (gamma - g0) / (g1 - g0);
                note.tempered[right - 1] + way * (note.tempered[right] - note.tempered[right - 1])
            }
        }
    }
}
