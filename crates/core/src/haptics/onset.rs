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
//! Two real equations for w and P, solved by Newton's method from every resonance of the bore. (Wilson & Beavers 1974 is
//! the source of the problem; the equations are written down here for the reed of `reed::motion`.) Above the reed's
//! resonance nothing starts; below it the reed's phase helps, so that high notes start earlier than a reed without
//! inertia would.
//!
//! A lattice moves its reed in samples of length T. With `z = exp(j w T)`, `d = 1 / (1 + q w_r T)`, `A = d (T w_r)^2`:
//! `D = A z / ((z - 1)(z - d) + A z)` and `(1 - 1/z) / T` for `j w`, which is worth 1 % at 1 kHz and 5 % at 1.8 kHz.
//!
//! Left out: the loss of jets in holes, which is second order in amplitude once the steady flow has found its way out
//! of the bell.

use num_complex::Complex64;
use std::f64::consts::TAU;

use crate::bore::transfer_matrix::threshold_gamma;
use crate::haptics::requirement::{Grid, Lip};

/// Newton steps at most; ten are plenty where there is a solution.
const STEPS: usize = 60;
/// Longest step, over the value: keeps a bad slope from leaving for another mode at once.
const LONGEST: f64 = 0.02;
/// The search begins at the onset without inertia, but not above this, and a second time here: far below, where
/// the reed's resonance carries the mode.
const START: (f64, f64) = (0.9, 0.35);
/// The search for the upper end of the unstable range begins at this share of the lay's knee beyond closure.
const SHUT: f64 = 0.8;
/// The reed's resonance is kept this far below the sample rate, as `reed::motion` keeps it.
const RESONANCE_TO_RATE: f64 = 0.15;

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
    /// Rate at which it moves, Hz; `None`: continuously.
    pub(super) rate_hz: Option<f64>,
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

    /// How the reed follows a pressure difference, and the factor of its speed.
    fn answer(&self, f_hz: f64) -> (Complex64, Complex64) {
        let Lip { resonance_hz, damping } = self.lip;
        match self.rate_hz {
            None => {
                let ratio = f_hz / resonance_hz;
                (Complex64::new(1.0 - ratio * ratio, damping * ratio).inv(), Complex64::I * (TAU * f_hz))
            }
            Some(rate_hz) => {
                let turn = TAU * resonance_hz.min(RESONANCE_TO_RATE * rate_hz) / rate_hz;
                let z = Complex64::from_polar(1.0, TAU * f_hz / rate_hz);
                let kept = 1.0 / (1.0 + damping * turn);
                let drive = kept * turn * turn;
                (drive * z / ((z - 1.0) * (z - kept) + drive * z), rate_hz * (1.0 - z.inv()))
            }
        }
    }

    /// Admittance of bore and reed together; zero at an onset.
    fn balance(&self, grid: &Grid, f_hz: f64, gamma: f64) -> Option<Complex64> {
        let (answer, speed) = self.answer(f_hz);
        let (opening, closing) = self.opening(gamma);
        let root = gamma.sqrt();
        let channel = self.zeta * (opening / (2.0 * root) - root * closing * answer);
        Some(grid.at(f_hz)? + channel + self.swept_s * speed * answer)
    }
}

/// Every `(gamma, frequency in Hz)` at which a small oscillation neither grows nor dies, one or two for each resonance.
pub(super) fn onsets<'a>(grid: &'a Grid, reed: &'a Reed) -> impl Iterator<Item = (f64, f64)> + 'a {
    grid.modes(reed.swept_s).flat_map(move |(f_hz, height)| {
        let without_inertia = threshold_gamma(height, reed.zeta).min(START.0);
        [without_inertia, START.1].into_iter().filter_map(move |gamma| onset(grid, reed, f_hz, gamma))
    })
}

/// Where the steady state, blown nearly shut on the curve of the lay, becomes stable again: `gamma` and frequency, from a
/// mode near `f_hz`. `None` on a sharp lay, where that is closure itself.
pub(super) fn shut(grid: &Grid, reed: &Reed, f_hz: f64) -> Option<(f64, f64)> {
    onset(grid, reed, f_hz, 1.0 + SHUT * reed.lay).filter(|&(gamma, _)| gamma > 1.0)
}

fn onset(grid: &Grid, reed: &Reed, mut f_hz: f64, mut gamma: f64) -> Option<(f64, f64)> {
    for _ in 0..STEPS {
        let off = reed.balance(grid, f_hz, gamma)?;
        let (df, dg) = (1e-4 * f_hz, 1e-4 * gamma);
        let by_f =
            (reed.balance(grid, f_hz + df, gamma)? - reed.balance(grid, f_hz - df, gamma)?) / (2.0 * df);
        let by_gamma =
            (reed.balance(grid, f_hz, gamma + dg)? - reed.balance(grid, f_hz, gamma - dg)?) / (2.0 * dg);
        let determinant = by_f.re * by_gamma.im - by_f.im * by_gamma.re;
        let step_f = (off.im * by_gamma.re - off.re * by_gamma.im) / determinant;
        let step_gamma = (off.re * by_f.im - off.im * by_f.re) / determinant;
        if !(step_f.is_finite() && step_gamma.is_finite()) {
            return None;
        }
        f_hz += step_f.clamp(-LONGEST * f_hz, LONGEST * f_hz);
        gamma = (gamma + step_gamma.clamp(-LONGEST, LONGEST)).clamp(0.05, 2.0);
        if step_f.abs() < 1e-8 * f_hz && step_gamma.abs() < 1e-8 {
            return Some((gamma, f_hz));
        }
    }
    None
}
