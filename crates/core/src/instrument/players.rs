//! How many players play, and how they sit and share the notes.

use crate::control::parts::MOST;
use crate::units::clamped_or;

/// Most players of one instrument.
pub const MOST_PLAYERS: usize = MOST;

/// What several players do with the notes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Split {
    /// Keys that are held together are played by different players, see [`Parts`](crate::control::parts::Parts).
    #[default]
    Chords,
    /// All play every note.
    Unison,
}

impl Split {
    /// All, in the order of the parameter that chooses one.
    pub const ALL: [Self; 2] = [Self::Chords, Self::Unison];
}

/// The players of an [`Ensemble`](super::Ensemble).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Players {
    /// How many, 1..=16. Default 1.
    pub count: i32,
    /// What they do with the notes. Default [`Split::Chords`].
    pub split: Split,
    /// How far out of tune they are, cents either way, 0..=25; the first one is in tune. Default 6 (by judgement).
    pub spread_cents: f32,
    /// In unison, how much later than the first one the others begin their notes at most, ms, 0..=60; each note differs. Default
    /// 25 (by judgement; `ensemble/lateness.rs`).
    pub onset_spread_ms: f32,
    /// How wide they sit, 0 (all in the middle)..=1 (from side to side). Default 0.7 (by judgement).
    pub width: f32,
}

impl Default for Players {
    fn default() -> Self {
        Self { count: 1, split: Split::Chords, spread_cents: 6.0, onset_spread_ms: 25.0, width: 0.7 }
    }
}

impl Players {
    /// Every number inside its range; one that is not finite becomes its default. Real-time safe.
    pub fn clamped(self) -> Self {
        let d = Self::default();
        Self {
            count: self.count.clamp(1, MOST_PLAYERS as i32),
            split: self.split,
            spread_cents: clamped_or(self.spread_cents, 0.0, 25.0, d.spread_cents),
            onset_spread_ms: clamped_or(self.onset_spread_ms, 0.0, 60.0, d.onset_spread_ms),
            width: clamped_or(self.width, 0.0, 1.0, d.width),
        }
    }

    /// Into how many parts the notes are split: as many as there are players, or one that all play.
    pub fn parts(&self) -> usize {
        match self.split {
            Split::Chords => self.number(),
            Split::Unison => 1,
        }
    }

    /// Whether there are several who do not all sit in the middle.
    pub fn sit_apart(&self) -> bool {
        self.number() > 1 && self.clamped().width > 0.0
    }

    /// How many, at least one.
    pub(super) fn number(&self) -> usize {
        self.clamped().count as usize
    }
}
