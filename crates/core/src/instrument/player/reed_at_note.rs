//! The reed at one frequency, for a small oscillation: what it gives to a note and what it takes.
//!
//! For the reed of `reed::motion` the admittance that feeds the bore is
//!
//! ```text
//! Y(gamma) = zeta (sqrt(gamma) B' D - B / (2 sqrt(gamma))) - j w s D      D = 1 / (1 - (w/w_r)^2 + j q w/w_r)
//! ```
//!
//! with the opening `B` at `gamma`, `B' = -dB/dgamma` and the flow `s` of the reed's motion. At the onset its real part, the conductance, equals what the
//! bore takes ([`haptics`](crate::haptics) solves the same balance with the whole bore). Its imaginary part with the other sign is the
//! susceptance that the reed takes, and with it the pitch goes.

use num_complex::Complex64;

use std::f64::consts::SQRT_2;

use crate::reed::lay::opening;

/// The onset is looked for between these mouth pressures over the closing pressure.
const RANGE: (f64, f64) = (0.2, 0.95);
/// Halvings of the range: to 1e-6.
const HALVINGS: usize = 20;
/// Step of the resonance for a slope over it, as a share: [`life`](super::life) moves it about as far.
const STEP: f64 = 0.02;
/// Step of the frequency for a slope over it, as a share.
const FREQUENCY_STEP: f64 = 0.005;
/// Cosines of the phases, `(2 n + 1) / 16` of half a period, at which a strong oscillation is looked at.
const COSINES: [f64; 8] = [
    0.980_785_280_403_230_4,
    0.831_469_612_302_545_2,
    0.555_570_233_019_602_2,
    0.195_090_322_016_128_3,
    -0.195_090_322_016_128_3,
    -0.555_570_233_019_602_2,
    -0.831_469_612_302_545_2,
    -0.980_785_280_403_230_4,
];

/// A reed at one frequency, with pressures over its own closing pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
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

    /// Conductance that the reed gives at a mouth pressure, with its [`response`](Self::response).
    fn conductance(&self, gamma: f64, response: Complex64) -> f64 {
        let (opening, slope) = self.opening(gamma);
        let root = gamma.sqrt();
        self.zeta * (root * slope * response.re - opening / (2.0 * root)) + self.swept * response.im
    }

    /// Susceptance of the reed's motion: the air that it displaces makes the bore larger.
    pub fn swept_susceptance(&self) -> f64 {
        self.swept * self.response().re
    }

    /// Susceptance of the flow through the reed at a mouth pressure, which lags behind the pressure.
    pub fn flow_susceptance(&self, gamma: f64) -> f64 {
        let (_, slope) = self.opening(gamma);
        -self.zeta * gamma.sqrt() * slope * self.response().im
    }

    /// Susceptance that the reed takes at a mouth pressure.
    fn susceptance(&self, gamma: f64) -> f64 {
        self.swept_susceptance() + self.flow_susceptance(gamma)
    }

    /// What is added to the susceptance of the flow when the reed is damped as `other` and not as this one, in an oscillation with this amplitude, rms over
    /// the closing pressure: the mean over a period, since a reed that is shut does not lag. Real-time safe.
    pub fn lag_of(&self, other: &Self, gamma: f64, amplitude: f64) -> f64 {
        let later = other.response().im - self.response().im;
        if later == 0.0 {
            return 0.0;
        }
        let peak = SQRT_2 * amplitude;
        let moments = COSINES.map(|cosine| {
            let difference = gamma - peak * cosine;
            let (_, slope) = self.opening(difference);
            difference.abs().sqrt().copysign(difference) * slope * (1.0 - cosine * cosine)
        });
        -self.zeta * later * 2.0 * moments.iter().sum::<f64>() / COSINES.len() as f64
    }

    /// How fast the susceptance that the reed takes rises with the logarithm of the frequency. Real-time safe.
    pub fn susceptance_slope(&self, gamma: f64) -> f64 {
        let at = |higher: f64| {
            Self { ratio: self.ratio * higher, swept: self.swept * higher, ..*self }.susceptance(gamma)
        };
        (at(1.0 + FREQUENCY_STEP) - at(1.0 - FREQUENCY_STEP)) / (2.0 * FREQUENCY_STEP)
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
        let wanted = reference.conductance(onset, reference.response());
        let response = self.response();
        let (mut low, mut high) = RANGE;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if self.conductance(middle, response) < wanted { low = middle } else { high = middle }
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
    fn a_weak_oscillation_lags_as_a_small_one_and_one_that_shuts_the_reed_less() {
        let reed = ReedAtNote { zeta: 0.3, lay: 0.4, ratio: 0.3, damping: 0.5, swept: 0.05 };
        let damped = ReedAtNote { damping: 0.8, ..reed };
        let small = damped.flow_susceptance(0.45) - reed.flow_susceptance(0.45);
        assert!(small > 0.0 && (reed.lag_of(&damped, 0.45, 1e-4) / small - 1.0).abs() < 1e-3);
        assert!(reed.lag_of(&damped, 0.45, 0.5) < 0.8 * small);
        assert_eq!(reed.lag_of(&reed, 0.45, 0.5), 0.0);
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
