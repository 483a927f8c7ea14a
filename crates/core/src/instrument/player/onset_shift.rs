//! How far settings move the onset of a note: the player adapts the breath to another reed as to another note.
//!
//! At the onset, the conductance that the reed gives equals what the bore takes. For the reed of `reed::motion` it is
//!
//! ```text
//! G(gamma) = Re [ zeta (sqrt(gamma) B' D - B / (2 sqrt(gamma))) - j w s D ]      D = 1 / (1 - (w/w_r)^2 + j q w/w_r)
//! ```
//!
//! with the opening `B` at `gamma`, `B' = -dB/dgamma` and the flow `s` of the reed's motion ([`haptics`](crate::haptics) solves
//! the same balance with the whole bore). What the bore takes follows from the onset that was found by playing with the
//! reference settings. So only the reed is computed, at the note's frequency. What this leaves out: that the other reed
//! also moves the frequency a little.

use num_complex::Complex64;

/// The onset is looked for between these mouth pressures over the closing pressure.
const RANGE: (f64, f64) = (0.2, 0.95);
/// Halvings of the range: to 1e-6.
const HALVINGS: usize = 20;

/// A reed at one frequency, with pressures over its own closing pressure.
#[derive(Clone, Copy, Debug)]
pub struct ReedAtNote {
    /// Flow strength.
    pub zeta: f64,
    /// Half-width of the rounded part of the lay.
    pub lay: f64,
    /// Frequency of the note over the resonance of the reed.
    pub ratio: f64,
    /// Damping of the resonance.
    pub damping: f64,
    /// Flow of its motion: angular frequency times equivalent volume over section and speed of sound.
    pub swept: f64,
}

impl ReedAtNote {
    /// Conductance that the reed gives at a mouth pressure.
    fn conductance(&self, gamma: f64) -> f64 {
        let gap = 1.0 - gamma;
        let (opening, slope) = if gap >= self.lay {
            (gap, 1.0)
        } else {
            let knee = (gap + self.lay).max(0.0);
            (knee * knee / (4.0 * self.lay), knee / (2.0 * self.lay))
        };
        let response = Complex64::new(1.0 - self.ratio * self.ratio, self.damping * self.ratio).inv();
        let root = gamma.sqrt();
        self.zeta * (root * slope * response.re - opening / (2.0 * root)) + self.swept * response.im
    }

    /// What must be added to the mouth over closing pressure of a note that begins at `onset` with the reed `reference`, for
    /// this reed to do the same. Real-time safe.
    pub fn shift_from(&self, reference: &Self, onset: f64) -> f64 {
        let wanted = reference.conductance(onset);
        let (mut low, mut high) = RANGE;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if self.conductance(middle) < wanted { low = middle } else { high = middle }
        }
        0.5 * (low + high) - onset
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bore::transfer_matrix::threshold_gamma;

    fn still(zeta: f64) -> ReedAtNote {
        ReedAtNote { zeta, lay: 0.4, ratio: 0.0, damping: 0.8, swept: 0.0 }
    }

    #[test]
    fn without_inertia_it_is_the_textbooks_onset() {
        for height in [20.0, 35.0, 60.0] {
            let onset = threshold_gamma(height, 0.3);
            for zeta in [0.15, 0.3, 0.6] {
                let shifted = onset + still(zeta).shift_from(&still(0.3), onset);
                assert!((shifted - threshold_gamma(height, zeta)).abs() < 2e-6, "{height} {zeta}: {shifted}");
            }
        }
    }

    #[test]
    fn the_same_reed_needs_the_same_breath_and_a_damped_one_more() {
        let reed = ReedAtNote { zeta: 0.3, lay: 0.4, ratio: 0.3, damping: 0.5, swept: 0.05 };
        assert!(reed.shift_from(&reed, 0.38).abs() < 2e-6);
        let damped = ReedAtNote { damping: 1.0, ..reed };
        assert!(damped.shift_from(&reed, 0.38) > 0.005);
    }
}
