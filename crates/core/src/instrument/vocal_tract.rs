//! The vocal tract: one resonance of the player's mouth, in series with the mouth pressure.
//!
//! What flows through the reed comes out of the mouth. There it meets the input impedance of the vocal tract, and the mouth
//! pressure at the reed is `p_static - Z u`. Players tune one resonance of `Z` near a note, or below it, and make it as high
//! as the bore's: then the two in series decide what sounds, and a note can be bent down by an octave (Scavone, Lefebvre & da
//! Silva 2008; Chen, Smith & Wolfe 2009). The resonance is a parallel circuit,
//!
//! ```text
//! Z(s) = Z_p (w/Q) s / (s^2 + (w/Q) s + w^2)
//! ```
//!
//! by the trapezoidal rule, prewarped at `w`. Its two states are normalised to energy: a quarter of their squares' sum is what
//! the air in the mouth holds. So no movement of the tract makes energy, however quick: in each sample the circuit takes up
//! exactly what the flow gives it, less its loss. Only the part `b0` of the impedance acts at once, and it joins the bore's in
//! the reed's equation, which stays closed. The model leaves out all other resonances of the tract, and its walls.
//!
//! Pressures over the reference closing pressure P, flows over P / Zc, impedances over Zc.

use crate::maths;

/// A resonance of the vocal tract.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TractResonance {
    /// Its frequency on the clock of the bore, Hz.
    pub hz: f64,
    /// Its quality.
    pub q: f64,
    /// Its impedance at the peak, over Zc; 0 or more. 15 is 35 MPa s/m3 on a B flat clarinet.
    pub peak: f64,
}

/// The coefficients of a resonance at one sample rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TractCoeffs {
    /// tan(w T / 2): what the circuit turns in half a sample.
    turn: f64,
    /// Twice that.
    whole_turn: f64,
    /// Pressure per state, and state per flow: sqrt(Z_p tan(w T / 2) / Q).
    couple: f64,
    /// 1 / (1 + turn / Q + turn^2).
    share: f64,
    /// `couple` times `share`.
    shared: f64,
    /// The part of the impedance that acts at once.
    at_once: f64,
}

/// Highest resonance over the sample rate: far above any note, far below the warping's pole.
const HIGHEST: f64 = 0.2;

impl TractCoeffs {
    /// A resonance at `rate_hz`. Real-time safe.
    pub fn new(resonance: TractResonance, rate_hz: f64) -> Self {
        let TractResonance { hz, q, peak } = resonance;
        let turn = maths::tan(std::f64::consts::PI * (hz / rate_hz).clamp(1e-6, HIGHEST));
        let loss = turn / q.max(0.1);
        let share = 1.0 / (1.0 + loss + turn * turn);
        let squared = peak.max(0.0) * loss;
        let couple = squared.sqrt();
        let (whole_turn, shared) = (2.0 * turn, couple * share);
        Self { turn, whole_turn, couple, share, shared, at_once: squared * share }
    }

    /// The part of the impedance that acts at once, over Zc.
    #[inline(always)]
    pub fn at_once(&self) -> f64 {
        self.at_once
    }
}

/// The air in the mouth: pressure and flow of the resonance, normalised to energy.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TractState {
    pressure: f64,
    flow: f64,
}

impl TractState {
    /// Pressure over P that this sample's flow does not change.
    #[inline(always)]
    pub fn pressure(&self, coeffs: &TractCoeffs) -> f64 {
        coeffs.shared * (self.pressure - coeffs.turn * self.flow)
    }

    /// One sample with this flow out of the mouth, over P / Zc. Real-time safe. [audio thread]
    #[inline(always)]
    pub fn tick(&mut self, coeffs: &TractCoeffs, flow: f64) {
        let TractCoeffs { turn, whole_turn, couple, share, .. } = *coeffs;
        let mean = share * (self.pressure - turn * self.flow + couple * flow);
        self.pressure = 2.0 * mean - self.pressure;
        self.flow += whole_turn * mean;
    }

    /// Energy that the circuit holds; in a sample it grows by the mean pressure times the flow, less the loss.
    pub fn stored_energy(&self) -> f64 {
        0.25 * (self.pressure * self.pressure + self.flow * self.flow)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;
    use std::f64::consts::TAU;

    fn random() -> impl FnMut() -> f64 {
        let mut seed = 1_u64;
        move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    /// A tract that moves at random from sample to sample never gives back more than it got.
    #[test]
    fn no_movement_makes_energy() {
        let mut random = random();
        for rate_hz in [88_200.0, 96_000.0, 192_000.0] {
            let (mut state, mut given) = (TractState::default(), 0.0);
            for n in 0..200_000 {
                let resonance = TractResonance {
                    hz: 100.0 * 20.0_f64.powf(random()),
                    q: 1.0 + 20.0 * random(),
                    peak: 40.0 * random(),
                };
                let coeffs = TractCoeffs::new(resonance, rate_hz);
                let flow = if n < 100_000 { 2.0 * random() - 1.0 } else { 0.0 };
                let pressure = state.pressure(&coeffs) + coeffs.at_once() * flow;
                given += pressure * flow;
                state.tick(&coeffs, flow);
                let held = state.stored_energy();
                assert!(held <= given * (1.0 + 1e-9) + 1e-12, "sample {n}: holds {held}, was given {given}");
            }
        }
    }

    /// The impedance is the analogue circuit's, exactly at the resonance and closely around it.
    #[test]
    fn impedance_is_the_circuits() {
        for rate_hz in [88_200.0, 192_000.0] {
            let resonance = TractResonance { hz: 700.0, q: 6.0, peak: 15.0 };
            let coeffs = TractCoeffs::new(resonance, rate_hz);
            for hz in [350.0, 650.0, 700.0, 750.0, 1_400.0] {
                let (mut state, mut heard) = (TractState::default(), Complex64::default());
                let (settle, count) = (rate_hz as usize / 2, (rate_hz / 50.0) as usize * 50);
                for n in 0..settle + count {
                    let turn = Complex64::cis(-TAU * (hz * n as f64 / rate_hz).fract());
                    let flow = turn.re;
                    let pressure = state.pressure(&coeffs) + coeffs.at_once() * flow;
                    if n >= settle {
                        heard += 2.0 / count as f64 * pressure * turn;
                    }
                    state.tick(&coeffs, flow);
                }
                let s = Complex64::new(0.0, hz / 700.0);
                let expected = 15.0 / 6.0 * s / (s * s + s / 6.0 + 1.0);
                assert!((heard - expected).norm() < 0.02 * expected.norm(), "{hz}: {heard} {expected}");
            }
        }
    }
}
