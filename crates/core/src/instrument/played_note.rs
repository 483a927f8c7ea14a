//! What a note asks of the player: the mouth pressure for each dynamic, and the trim that keeps it in tune there.
//!
//! [`auto_tune`](super::prepare::auto_tune) finds both by playing, at a few dynamics; between them lie straight lines. Near
//! its threshold the power of a note is proportional to the excess of the mouth pressure over the threshold. So the
//! line is drawn through the logarithm of the excess, in which equal steps are equal steps of level.

use serde::{Deserialize, Serialize};

use crate::instrument::player::dynamics::NODES;

/// Mouth pressures and trims of one note.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlayedNote {
    /// Mouth over closing pressure at which the note begins at dynamic 0, as far as its levels tell: below all of `gammas`.
    pub onset: f64,
    /// Mouth over closing pressure at dynamics evenly from 0 to 1, rising.
    pub gammas: [f64; NODES],
    /// Trims there, rows of round-trip delay.
    pub rows: [f64; NODES],
}

impl Default for PlayedNote {
    /// A note that nobody has played yet: the median over the bundled clarinet, without trims.
    fn default() -> Self {
        Self { onset: 0.39, gammas: [0.40, 0.42, 0.46, 0.54, 0.70, 0.92], rows: [0.0; NODES] }
    }
}

/// Segment and share of the way in it of a dynamic, clamped to 0..=1.
fn segment(dynamic: f64) -> (usize, f64) {
    let place = dynamic.clamp(0.0, 1.0) * (NODES - 1) as f64;
    let left = (place as usize).min(NODES - 2);
    (left, place - left as f64)
}

impl PlayedNote {
    /// With these mouth pressures and trims; the onset follows from the two lowest pressures, between which the level rises
    /// by `step_db`.
    pub fn new(gammas: [f64; NODES], rows: [f64; NODES], step_db: f64) -> Self {
        let ratio = 10.0_f64.powf(step_db / 10.0);
        let onset = gammas[0] - (gammas[1] - gammas[0]) / (ratio - 1.0);
        Self { onset, gammas, rows }
    }

    /// Mouth over closing pressure at a dynamic, 0..=1. Real-time safe.
    pub fn gamma(&self, dynamic: f64) -> f64 {
        let (left, way) = segment(dynamic);
        let [low, high] =
            [self.gammas[left], self.gammas[left + 1]].map(|gamma| (gamma - self.onset).max(1e-6));
        self.onset + low * (high / low).powf(way)
    }

    /// Trim at a dynamic, rows. Real-time safe.
    pub fn rows(&self, dynamic: f64) -> f64 {
        let (left, way) = segment(dynamic);
        self.rows[left] + way * (self.rows[left + 1] - self.rows[left])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_passes_through_its_nodes_and_rises() {
        let note = PlayedNote::new([0.38, 0.39, 0.42, 0.5, 0.65, 0.9], [1.0, 2.0, 4.0, 3.0, 2.0, 0.0], 5.4);
        for (node, (gamma, rows)) in note.gammas.into_iter().zip(note.rows).enumerate() {
            let dynamic = node as f64 / (NODES - 1) as f64;
            assert!((note.gamma(dynamic) - gamma).abs() < 1e-12 && (note.rows(dynamic) - rows).abs() < 1e-9);
        }
        let curve: Vec<f64> = (0..=1_000).map(|n| note.gamma(f64::from(n) / 1_000.0)).collect();
        assert!(curve.is_sorted_by(|a, b| a < b));
        assert_eq!((note.gamma(-1.0), note.gamma(2.0)), (note.gamma(0.0), note.gamma(1.0)));
    }

    #[test]
    fn near_the_onset_equal_steps_are_equal_ratios_of_the_excess() {
        let note = PlayedNote::new([0.38, 0.39, 0.42, 0.5, 0.65, 0.9], [0.0; NODES], 5.4);
        let excess = |dynamic: f64| note.gamma(dynamic) - note.onset;
        assert!((10.0 * (excess(0.2) / excess(0.0)).log10() - 5.4).abs() < 1e-9);
        assert!((excess(0.1) / excess(0.0) - excess(0.2) / excess(0.1)).abs() < 1e-9);
    }
}
