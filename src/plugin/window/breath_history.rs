//! The last seconds of breath, level and pitch, as the window shows them.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::editor::snapshot::{PressureMarks, Track};
use chalumeau_core::units::cents;

/// Length of the history, s.
const HISTORY_S: f32 = 10.0;
/// Time between two values of the history, s.
const STEP_S: f32 = 0.05;
/// A longer pause clears the history, whose values would not show when they were.
const LONGEST_GAP: Duration = Duration::from_secs(2);

/// Mouth pressure and its marks, level and pitch at one time.
#[derive(Clone, Copy)]
struct HistoryEntry {
    kpa: f32,
    marks: PressureMarks,
    level_db: f32,
    pitch: Option<f32>,
}

/// The history at equal steps, oldest first.
pub struct BreathHistory {
    entries: VecDeque<HistoryEntry>,
    /// Time of the latest value.
    latest: Instant,
}

impl BreathHistory {
    /// Empty.
    pub fn new() -> Self {
        Self { entries: VecDeque::new(), latest: Instant::now() }
    }

    /// Adds mouth pressure, kPa, with its marks, level, dB, and pitch of now for every step since the latest value.
    pub fn extend(&mut self, kpa: f32, marks: PressureMarks, level_db: f32, f0_hz: Option<f32>) {
        let pitch = f0_hz.map(|f0_hz| 69.0 + 0.01 * cents(f64::from(f0_hz), 440.0) as f32);
        let entry = HistoryEntry { kpa, marks, level_db, pitch };
        let step = Duration::from_secs_f32(STEP_S);
        if self.latest.elapsed() > LONGEST_GAP {
            *self = Self::new();
        }
        while self.latest.elapsed() >= step {
            self.latest += step;
            self.entries.push_back(entry);
            if self.entries.len() as f32 * STEP_S > HISTORY_S {
                self.entries.pop_front();
            }
        }
    }

    /// The history as a snapshot shows it.
    pub fn track(&self) -> Track {
        Track {
            step_s: STEP_S,
            kpa: self.entries.iter().map(|entry| entry.kpa).collect(),
            marks: self.entries.iter().map(|entry| entry.marks).collect(),
            level_db: self.entries.iter().map(|entry| entry.level_db).collect(),
            pitch: self.entries.iter().map(|entry| entry.pitch).collect(),
        }
    }
}
