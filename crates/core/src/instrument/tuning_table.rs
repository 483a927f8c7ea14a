//! A table of small pitch corrections: a delay (trim) for each note, found by playing the instrument.
//!
//! Linear theory cannot supply the trims, because reed damping and saturation move every note by tens of cents. So
//! [`auto_tune`](super::prepare::auto_tune) plays each note and moves its delay until the pitch is right. The *natural*
//! trim is right at gamma 0.5. The *tempered* trims are given at four nodes over gamma, because the modes of a real bore
//! are not harmonic and the pitch sags as the reed begins to beat.

use crate::bore::instrument_file::{Fingering, InstrumentFile};
use crate::instrument::played_note::PlayedNote;
use crate::instrument::settings::Tuning;

/// Nodes of the tempered trims: mouth pressures over the closing pressure.
///
/// Of all places for four nodes with straight lines between them, these leave the smallest error.
pub const GAMMA_NODES: [f64; 4] = [0.45, 0.55, 0.725, 0.9];
/// Mouth pressure over the closing pressure at which the natural trim is right.
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
    /// Remaining error at [`NATURAL_GAMMA`] where the delay has no more to give, cents above the note; else 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub off_cents: f64,
    /// True if the note sounds in its register at one of these pressures or at none; its trims are those of its neighbours.
    #[serde(default, skip_serializing_if = "is_false")]
    pub silent: bool,
    /// Mouth pressures and trims at the dynamics of a player.
    #[serde(default)]
    pub played: PlayedNote,
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
    /// A table of zero trims. Allocates.
    pub fn untuned(file: &InstrumentFile) -> Self {
        let note = |fingering: &Fingering| NoteTuning {
            written: fingering.written.0,
            sensitivity: 1.0,
            ..NoteTuning::default()
        };
        Self { notes: file.fingerings.iter().map(note).collect() }
    }

    /// Trim of a fingering at a mouth pressure `gamma` (over the closing pressure), rows; 0 for a fingering that the table
    /// does not have. Outside the nodes the tempered trim is that of the nearest node. Real-time safe.
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
