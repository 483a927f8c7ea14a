//! How far settings move the onset of a note: the player adapts the breath to another reed as to another note.
//!
//! At the onset, the conductance that the reed gives equals what the bore takes. For the reed of `reed::motion` it is
//!
//! ```text
//! G(gamma) = Re [ zeta (sqrt(gamma) B' D - B / (2 sqrt(gamma))) - j w s D ]      D = 1 / (1 - (w/w_r)^2 + j q w/w_r)
//! ```
//!
//! with the opening `B` at `gamma`, `B' = -dB/dgamma` and the flow `s` of the reed's motion ([`haptics`](crate::haptics) solves
//! the same balance with the whole bore). The imaginary part of the same is the susceptance that the reed takes, and with it the pitch goes.
//! What the bore takes follows from the onset that was found by playing with the
//! reference settings. So only the reed is computed, at the note's frequency. What this leaves out: that the other reed
//! also moves the frequency a little.

use num_complex::Complex64;

use crate::reed::lay::opening;

/// The onset is looked for between these mouth pressures over the closing pressure.
const RANGE: (f64, f64) = (0.2, 0.95);
/// Halvings of the range: to 1e-6.
const HALVINGS: usize = 20;
/// Step of the resonance for a slope over it, as a share: [`life`](super::life) moves it about as far.
const STEP: f64 = 0.02;

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
    /// Opening of the reed at a mouth pressure, and how it falls with the pressure.
    fn opening(&self, gamma: f64) -> (f64, f64) {
        opening(1.0 - gamma, self.lay)
    }

    /// What the reed yields to an oscillating pressure, over what it yields to a steady one.
    fn response(&self) -> Complex64 {
        Complex64::new(1.0 - self.ratio * self.ratio, self.damping * self.ratio).inv()
    }

    /// Conductance that the reed gives at a mouth pressure.
    fn conductance(&self, gamma: f64) -> f64 {
        let ((opening, slope), response) = (self.opening(gamma), self.response());
        let root = gamma.sqrt();
        self.zeta * (root * slope * response.re - opening / (2.0 * root)) + self.swept * response.im
    }

    /// Susceptance that the reed takes at a mouth pressure.
    fn susceptance(&self, gamma: f64) -> f64 {
        let ((_, slope), response) = (self.opening(gamma), self.response());
        self.swept * response.re - self.zeta * gamma.sqrt() * slope * response.im
    }

    /// How fast the susceptance that the reed takes at a mouth pressure falls while its resonance rises, over the logarithm of the
    /// resonance. Real-time safe.
    pub fn pull(&self, gamma: f64) -> f64 {
        let at = |resonance: f64| Self { ratio: self.ratio / resonance, ..*self }.susceptance(gamma);
        (at(1.0 - STEP) - at(1.0 + STEP)) / (2.0 * STEP)
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
    fn a_resonance_that_rises_takes_less_and_the_more_so_the_nearer_it_is() {
        let pulls = [0.1, 0.3, 0.5, 0.645].map(|ratio| {
            let reed = ReedAtNote { zeta: 0.25, lay: 0.4, ratio, damping: 0.25, swept: 0.2 * ratio };
            let away = |resonance: f64| ReedAtNote { ratio: ratio / resonance, ..reed }.susceptance(0.5);
            assert!(away(1.01) < away(0.99));
            reed.pull(0.5)
        });
        assert!(pulls[0] > 0.0 && pulls.is_sorted_by(|far, near| 2.0 * far < *near), "{pulls:?}");
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
