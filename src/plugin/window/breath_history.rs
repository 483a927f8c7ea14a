//! The last seconds of breath, as the window shows them.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::editor::snapshot::Track;

/// Length of the history, s.
const HISTORY_S: f32 = 10.0;
/// Time between two values of the history, s.
const STEP_S: f32 = 0.05;
/// A longer pause clears the history, whose values would not show when they were.
const LONGEST_GAP: Duration = Duration::from_secs(2);

/// Mouth pressures at equal steps, oldest first.
pub struct BreathHistory {
    kpa: VecDeque<f32>,
    /// Time of the latest value.
    latest: Instant,
}

impl BreathHistory {
    /// Empty.
    pub fn new() -> Self {
        Self { kpa: VecDeque::new(), latest: Instant::now() }
    }

    /// Adds the mouth pressure of now, kPa, for every step since the latest value.
    pub fn extend(&mut self, kpa: f32) {
        let step = Duration::from_secs_f32(STEP_S);
        if self.latest.elapsed() > LONGEST_GAP {
            *self = Self::new();
        }
        while self.latest.elapsed() >= step {
            self.latest += step;
            self.kpa.push_back(kpa);
            if self.kpa.len() as f32 * STEP_S > HISTORY_S {
                self.kpa.pop_front();
            }
        }
    }

    /// The history as a snapshot shows it.
    pub fn track(&self) -> Track {
        Track { step_s: STEP_S, kpa: self.kpa.iter().copied().collect() }
    }
}
