//! Onset with the reed as it moves: linear stability of the bore behind a resonant, damped reed.
//!
//! Small oscillations `exp(j w t)` about the steady state at pressure difference P (over the closing pressure): the
//! channel gives `F_p + F_x D` per unit of pressure difference, with `F_p` from Bernoulli at fixed opening, `F_x` from
//! the opening at fixed pressure and `D = 1 / (1 - (w/w_r)^2 + j q w/w_r)` the reed's own answer; its motion displaces
//! `j w V D` on top. The note neither grows nor dies where
//!
//! ```text
//! Y(w) + zeta [B / (2 sqrt(P)) - sqrt(P) B' D(w)] + j w s D(w) = 0       B: opening at P, B' = -dB/dP, s = V / (S c)
//! ```
//!
//! Two real equations for w and P, solved by Newton's method from the onset without inertia, to which it reduces at
//! D = 1. (Wilson & Beavers 1974 is the source of the problem; the equations are written down here for the reed of
//! `reed::motion`.) Left out: the loss of jets in holes, which is second order in amplitude, and sampling.

use num_complex::Complex64;
use std::f64::consts::TAU;

use crate::haptics::requirement::{Lip, Mode};

/// Newton steps at most; ten are plenty where there is a solution.
const STEPS: usize = 60;
/// Longest step, over the value: keeps a bad slope from leaving the window of the mode at once.
const LONGEST: f64 = 0.02;

/// What the reed is like, over its own closing pressure.
pub(super) struct Reed {
    /// Flow strength of this reed.
    pub(super) zeta: f64,
    /// Half-width of the lay's knee.
    pub(super) lay: f64,
    /// Resonance and damping.
    pub(super) lip: Lip,
    /// Flow by its motion, s.
    pub(super) swept_s: f64,
}

impl Reed {
    /// Opening at a steady pressure difference and how fast it closes.
    fn opening(&self, gamma: f64) -> (f64, f64) {
        let gap = 1.0 - gamma;
        if gap >= self.lay {
            (gap, 1.0)
        } else {
            let knee = (gap + self.lay).max(0.0);
            (knee * knee / (4.0 * self.lay), knee / (2.0 * self.lay))
        }
    }

    /// Admittance of bore and reed together; zero at the onset.
    fn balance(&self, mode: &Mode, f_hz: f64, gamma: f64) -> Option<Complex64> {
        let ratio = f_hz / self.lip.resonance_hz;
        let answer = Complex64::new(1.0 - ratio * ratio, self.lip.damping * ratio).inv();
        let (opening, closing) = self.opening(gamma);
        let root = gamma.sqrt();
        let channel = self.zeta * (opening / (2.0 * root) - root * closing * answer);
        Some(mode.admittance(f_hz)? + channel + Complex64::I * (TAU * f_hz * self.swept_s) * answer)
    }
}

/// Frequency, Hz, and mouth pressure over the closing pressure at which a small oscillation neither grows nor dies.
/// `None` if there is no such pressure in reach of the mode.
pub(super) fn onset(mode: &Mode, reed: &Reed, start: (f64, f64)) -> Option<(f64, f64)> {
    let (mut f_hz, mut gamma) = start;
    for _ in 0..STEPS {
        let off = reed.balance(mode, f_hz, gamma)?;
        let (df, dg) = (1e-4 * f_hz, 1e-4 * gamma);
        let by_f =
            (reed.balance(mode, f_hz + df, gamma)? - reed.balance(mode, f_hz - df, gamma)?) / (2.0 * df);
        let by_gamma =
            (reed.balance(mode, f_hz, gamma + dg)? - reed.balance(mode, f_hz, gamma - dg)?) / (2.0 * dg);
        let determinant = by_f.re * by_gamma.im - by_f.im * by_gamma.re;
        let step_f = (off.im * by_gamma.re - off.re * by_gamma.im) / determinant;
        let step_gamma = (off.re * by_f.im - off.im * by_f.re) / determinant;
        if !(step_f.is_finite() && step_gamma.is_finite()) {
            return None;
        }
        f_hz += step_f.clamp(-LONGEST * f_hz, LONGEST * f_hz);
        gamma = (gamma + step_gamma.clamp(-LONGEST, LONGEST)).clamp(0.05, 2.0);
        if step_f.abs() < 1e-9 * f_hz && step_gamma.abs() < 1e-10 {
            return Some((f_hz, gamma));
        }
    }
    None
}
