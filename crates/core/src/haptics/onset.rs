//! Onset with a moving reed: linear stability of a bore driven by a reed with resonance and damping.
//!
//! Consider a small oscillation `exp(j w t)` about the steady state at the pressure difference P (over the closing
//! pressure). Per unit of pressure difference, the flow through the channel is `F_p + F_x D`. `F_p` follows from Bernoulli
//! at a fixed opening, `F_x` from the opening at a fixed pressure, and `D = 1 / (1 - (w/w_r)^2 + j q w/w_r)` is the response
//! of the reed. The motion of the reed adds the flow `j w V D`. The oscillation neither grows nor decays where
//!
//! ```text
//! Y(w) + zeta [B / (2 sqrt(P)) - sqrt(P) B' D(w)] + j w s D(w) = 0       B: opening at P, B' = -dB/dP, s = V / (S c)
//! ```
//!
//! These are two real equations for w and P. Newton's method solves them, starting from every resonance of the bore. The
//! problem is that of Wilson & Beavers (1974), written here for the reed of `reed::motion`. Above the resonance of the reed
//! no oscillation starts. Below it the phase of the reed helps, so that high notes start earlier than with a reed without
//! inertia.
//!
//! The lattice moves its reed in samples of length T. With `z = exp(j w T)`, `d = 1 / (1 + q w_r T)`, `A = d (T w_r)^2`, its
//! response is `D = A z / ((z - 1)(z - d) + A z)`, and `(z - 1/z) / 2 T` takes the place of `j w`: its flow is that
//! of the mean speed of the sample. A continuous reed would start up to 0.45 % later, at 1.8 kHz.
//!
//! The loss of jets in open holes is left out: once the steady flow leaves through the bell, it is of second order in the
//! amplitude.

use num_complex::Complex64;
use std::f64::consts::TAU;

use crate::bore::transfer_matrix::threshold_gamma;
use crate::haptics::admittance::AdmittanceGrid;
use crate::maths;
use crate::reed::Lip;
use crate::reed::lay::opening;
use crate::reed::motion::RESONANCE_TO_RATE;

/// Most Newton steps. Where there is a solution, ten are enough.
const STEPS: usize = 60;
/// Longest Newton step, over the value. It keeps one bad slope from jumping to another mode.
const LONGEST: f64 = 0.02;
/// The search begins at the onset without inertia, but at most at the first value. It begins again at the second value,
/// far below, where a mode near the resonance of the reed starts.
const START: (f64, f64) = (0.9, 0.35);
/// The search for the upper end of the unstable range begins beyond closure, by this share of the lay's half-width.
const BEYOND_CLOSURE: f64 = 0.8;

/// The reed, with pressures over its own closing pressure.
pub(super) struct OnsetReed {
    /// Embouchure parameter of this reed.
    pub(super) zeta: f64,
    /// Half-width of the rounded part of the lay.
    pub(super) lay: f64,
    /// Resonance and damping.
    pub(super) lip: Lip,
    /// Flow made by its motion, per speed, s.
    pub(super) swept_s: f64,
    /// Sample rate at which it moves, Hz; `None` if it moves continuously.
    pub(super) rate_hz: Option<f64>,
}

impl OnsetReed {
    /// Opening at a steady pressure difference, and minus its slope.
    fn opening(&self, gamma: f64) -> (f64, f64) {
        opening(1.0 - gamma, self.lay)
    }

    /// Response of the reed to a pressure difference, and the factor that turns a position into a speed, 1/s.
    fn response(&self, f_hz: f64) -> (Complex64, Complex64) {
        let Lip { resonance_hz, damping } = self.lip;
        match self.rate_hz {
            None => {
                let ratio = f_hz / resonance_hz;
                (Complex64::new(1.0 - ratio * ratio, damping * ratio).inv(), Complex64::I * (TAU * f_hz))
            }
            Some(rate_hz) => {
                let turn = TAU * resonance_hz.min(RESONANCE_TO_RATE * rate_hz) / rate_hz;
                let z = maths::complex::cis(TAU * f_hz / rate_hz);
                let kept = 1.0 / (1.0 + damping * turn);
                let drive = kept * turn * turn;
                (drive * z / ((z - 1.0) * (z - kept) + drive * z), 0.5 * rate_hz * (z - z.inv()))
            }
        }
    }

    /// Admittance of bore and reed together, which is zero at an onset; `None` outside the grid.
    fn balance(&self, grid: &AdmittanceGrid, f_hz: f64, gamma: f64) -> Option<Complex64> {
        let (response, speed) = self.response(f_hz);
        let (opening, closing) = self.opening(gamma);
        let root = gamma.sqrt();
        let channel = self.zeta * (opening / (2.0 * root) - root * closing * response);
        Some(grid.at(f_hz)? + channel + self.swept_s * speed * response)
    }
}

/// Every `(gamma, frequency in Hz)` at which a small oscillation neither grows nor decays: at most two for each resonance.
pub(super) fn onsets<'a>(
    grid: &'a AdmittanceGrid,
    reed: &'a OnsetReed,
) -> impl Iterator<Item = (f64, f64)> + 'a {
    grid.modes(reed.swept_s).flat_map(move |(f_hz, height)| {
        let without_inertia = threshold_gamma(height, reed.zeta).min(START.0);
        [without_inertia, START.1].into_iter().filter_map(move |gamma| onset(grid, reed, f_hz, gamma))
    })
}

/// `(gamma, frequency in Hz)` at which the steady state becomes stable again, with the reed nearly shut on the curve of the
/// lay; the search starts at `f_hz`. `None` on a sharp lay, where it becomes stable at closure.
pub(super) fn shut(grid: &AdmittanceGrid, reed: &OnsetReed, f_hz: f64) -> Option<(f64, f64)> {
    onset(grid, reed, f_hz, 1.0 + BEYOND_CLOSURE * reed.lay).filter(|&(gamma, _)| gamma > 1.0)
}

/// One onset, by Newton's method from a first guess; `None` if the search finds none.
fn onset(grid: &AdmittanceGrid, reed: &OnsetReed, mut f_hz: f64, mut gamma: f64) -> Option<(f64, f64)> {
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
