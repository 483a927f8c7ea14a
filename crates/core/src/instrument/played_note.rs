//! What a note asks of the player: the mouth pressure for each dynamic, the amplitude that it then has, and the trim that keeps
//! it in tune there.
//!
//! [`auto_tune`](super::prepare::auto_tune) finds them by playing, at a few dynamics; between them lie straight lines. Near
//! its threshold the power of a note is proportional to the excess of the mouth pressure over the threshold. So the
//! line is drawn through the logarithm of the excess, in which equal steps are equal steps of level.

use serde::{Deserialize, Serialize};

use crate::instrument::player::dynamics::{NODE_DYNAMICS, NODES};
use crate::maths;

/// The onset lies at least this far below the pressures of a note: some notes' first dynamics.
const LEAST_EXCESS: f64 = 2e-3;
/// Numbers are kept to one part in so many.
const DIGITS: f64 = 1e5;

/// Mouth pressures and trims of one note.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlayedNote {
    /// Mouth over closing pressure at which the note begins at dynamic 0, as far as its levels tell: below all of `gammas`.
    pub onset: f64,
    /// Mouth over closing pressure at [`NODE_DYNAMICS`]. It rises, but for the softest dynamics of some notes,
    /// where the lip alone makes the difference.
    pub gammas: [f64; NODES],
    /// Amplitudes of the steady note there, rms of the pressure in the mouthpiece over the closing pressure.
    pub amplitudes: [f64; NODES],
    /// Trims there, rows of round-trip delay.
    pub rows: [f64; NODES],
}

impl Default for PlayedNote {
    /// A note that nobody has played yet: the median over the bundled clarinet, without trims.
    fn default() -> Self {
        Self {
            onset: 0.39,
            gammas: [0.40, 0.41, 0.44, 0.49, 0.56, 0.65, 0.77, 0.92],
            amplitudes: [0.06, 0.12, 0.21, 0.31, 0.41, 0.49, 0.57, 0.63],
            rows: [0.0; NODES],
        }
    }
}

/// Segment and share of the way in it of a dynamic, clamped to 0..=1.
fn segment(dynamic: f64) -> (usize, f64) {
    let dynamic = dynamic.clamp(0.0, 1.0);
    let right = NODE_DYNAMICS[1..NODES - 1].partition_point(|&node| node < dynamic) + 1;
    let (from, to) = (NODE_DYNAMICS[right - 1], NODE_DYNAMICS[right]);
    (right - 1, (dynamic - from) / (to - from))
}

/// What lies `way`, 0..=1, between two levels in logarithms. Half the work of a power.
fn between(low: f64, high: f64, way: f64) -> f64 {
    low * maths::exp(way * maths::ln(high / low))
}

impl PlayedNote {
    /// From mouth pressures, amplitudes and trims; the onset follows from the two lowest pressures, as where a line through
    /// them and the squares of their amplitudes meets zero.
    pub fn new(gammas: [f64; NODES], amplitudes: [f64; NODES], rows: [f64; NODES]) -> Self {
        let ratio = (amplitudes[1] / amplitudes[0]).powi(2).max(1.5);
        // Where the lip alone makes the note softer, the pressures may even fall.
        let lowest = gammas.into_iter().fold(f64::INFINITY, f64::min);
        let onset = (gammas[0] - (gammas[1] - gammas[0]) / (ratio - 1.0)).min(lowest - LEAST_EXCESS);
        // More digits than anyone hears would make the files of the instruments large.
        let round = |x: f64| (x * DIGITS).round() / DIGITS;
        let [gammas, amplitudes, rows] = [gammas, amplitudes, rows].map(|numbers| numbers.map(round));
        Self { onset: round(onset), gammas, amplitudes, rows }
    }

    /// Mouth over closing pressure at a dynamic, 0..=1. Real-time safe.
    pub fn gamma(&self, dynamic: f64) -> f64 {
        let (left, way) = segment(dynamic);
        let [low, high] =
            [self.gammas[left], self.gammas[left + 1]].map(|gamma| (gamma - self.onset).max(1e-6));
        self.onset + between(low, high, way)
    }

    /// Amplitude of the steady note at a dynamic, rms of the pressure in the mouthpiece over the closing pressure. Real-time
    /// safe.
    pub fn amplitude(&self, dynamic: f64) -> f64 {
        let (left, way) = segment(dynamic);
        let [low, high] =
            [self.amplitudes[left], self.amplitudes[left + 1]].map(|amplitude| amplitude.max(1e-6));
        between(low, high, way)
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

    fn note() -> PlayedNote {
        PlayedNote::new(
            [0.38, 0.39, 0.42, 0.46, 0.5, 0.58, 0.7, 0.9],
            [0.05, 0.1, 0.2, 0.25, 0.32, 0.4, 0.5, 0.6],
            [1.0, 2.0, 4.0, 3.5, 3.0, 2.0, 1.0, 0.0],
        )
    }

    #[test]
    fn the_curve_passes_through_its_nodes_and_rises() {
        let note = note();
        for (node, dynamic) in NODE_DYNAMICS.into_iter().enumerate() {
            assert!((note.gamma(dynamic) - note.gammas[node]).abs() < 1e-12);
            assert!((note.amplitude(dynamic) - note.amplitudes[node]).abs() < 1e-12);
            assert!((note.rows(dynamic) - note.rows[node]).abs() < 1e-9);
        }
        let curve: Vec<f64> = (0..=1_000).map(|n| note.gamma(f64::from(n) / 1_000.0)).collect();
        assert!(curve.is_sorted_by(|a, b| a < b));
        assert_eq!((note.gamma(-1.0), note.gamma(2.0)), (note.gamma(0.0), note.gamma(1.0)));
    }

    #[test]
    fn near_the_onset_the_power_goes_with_the_excess() {
        let note = note();
        let excess = |dynamic: f64| note.gamma(dynamic) - note.onset;
        assert!((excess(0.2) / excess(0.0) - 4.0).abs() < 0.01, "as the squares of the amplitudes");
        assert!((excess(0.1) / excess(0.0) - excess(0.2) / excess(0.1)).abs() < 1e-9);
    }
}
