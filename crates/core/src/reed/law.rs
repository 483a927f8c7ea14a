//! The quasi-static flow law of the reed: the notebook's law, corrected for negative pressure.
//!
//! For a pressure difference `p >= 0` (mouth minus mouthpiece, over the reference closing pressure) the flow is
//! `u = A (H sqrt(p) - p^1.5 / k)` until the reed closes at `p_c = H k`, and 0 beyond. For `p < 0` the air flows back
//! and the reed is pushed *open*: `u = -A (H sqrt|p| + |p|^1.5 / k)`. The notebook's form multiplies the forward law by
//! the sign of `p` and so closes the reed at `p = -H k`, where a real one stands at twice its opening; a test below
//! shows the difference. Sources: Wilson & Beavers 1974 for the Bernoulli valve, the notebook's tables for the arithmetic.
//!
//! | notebook | here | meaning |
//! |---|---|---|
//! | H | `h` | rest opening, dimensionless; reference sqrt(27)/2 |
//! | k | `k` | stiffness, dimensionless; reference 27/(4 H^3) |
//! | A | `a` | amplitude of the flow, 1 |
//! | x_A, x_B | `ReedTables` | sqrt(p), p^1.5 |
//!
//! ```
//! use chalumeau_core::reed::{ReedLaw, ReedTables};
//!
//! // Twice the usual stiffness: the reed closes at twice the pressure, and more air passes before.
//! let (usual, stiff) = (ReedLaw::default(), ReedLaw::free(2.598, 2.0 * 0.3849, 1.0)?);
//! assert!((stiff.closing() / usual.closing() - 2.0).abs() < 1e-3);
//! assert!(stiff.flow(ReedTables::reference(), 0.5) > usual.flow(ReedTables::reference(), 0.5));
//! assert!(ReedLaw::free(0.0, 0.4, 1.0).is_err());
//! # Ok::<(), chalumeau_core::reed::law::ReedError>(())
//! ```

use crate::reed::tables::ReedTables;

/// The notebook's rest opening H, dimensionless: sqrt(27)/2. With [`K_INIT`] the closing pressure H k is 1.
pub const H_INIT: f64 = 2.598_076_211_353_316;
/// The notebook's stiffness k, dimensionless: 27/(4 H^3), which makes the peak flow 1.
pub const K_INIT: f64 = 0.384_900_179_459_750_5;

/// The reed's flow law in the notebook's dimensionless numbers H, k and A.
///
/// The default is the reference: [`H_INIT`], [`K_INIT`] and A = 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReedLaw {
    h: f64,
    k: f64,
    a: f64,
}

/// Range of the embouchure parameter zeta, the flow strength: from a reed that hardly speaks to one that hardly closes.
pub const ZETA_RANGE: (f64, f64) = (0.05, 0.9);

/// Why a law or a reed is refused: one of its numbers is out of range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ReedError {
    /// H outside its range.
    #[error("H (rest opening) must lie in 0.5..10, got {0}; the reference is sqrt(27)/2 = 2.598")]
    H(f64),
    /// k outside its range.
    #[error("k (stiffness) must lie in 0.01..20, got {0}; the reference is 27/(4 H^3) = 0.3849")]
    K(f64),
    /// A outside its range.
    #[error("A (amplitude) must lie in 0..10, got {0}; the reference is 1")]
    A(f64),
    /// zeta outside its range.
    #[error(
        "zeta (flow strength) must lie in {low}..{high}, got {0}; the reference is 0.3",
        low = ZETA_RANGE.0,
        high = ZETA_RANGE.1
    )]
    Zeta(f64),
}

impl ReedLaw {
    /// A law with H (0.5..=10), k (0.01..=20) and A (0..=10), each free: peak flow `A sqrt(4 H^3 k / 27)` at `H k / 3`, closure at `H k`.
    pub fn free(h: f64, k: f64, a: f64) -> Result<Self, ReedError> {
        if !(0.5..=10.0).contains(&h) {
            return Err(ReedError::H(h));
        }
        if !(0.01..=20.0).contains(&k) {
            return Err(ReedError::K(k));
        }
        if !(0.0..=10.0).contains(&a) {
            return Err(ReedError::A(a));
        }
        Ok(Self { h, k, a })
    }

    /// A law whose k follows from H, see [`coupled_k`], so that the peak flow stays A. Fails like [`free`](Self::free).
    pub fn coupled(h: f64, a: f64) -> Result<Self, ReedError> {
        Self::free(h, coupled_k(h), a)
    }

    /// Rest opening H, dimensionless.
    pub fn h(self) -> f64 {
        self.h
    }

    /// Stiffness k, dimensionless.
    pub fn k(self) -> f64 {
        self.k
    }

    /// Amplitude A of the flow, dimensionless.
    pub fn a(self) -> f64 {
        self.a
    }

    /// Closing pressure `H k` over the reference closing pressure.
    pub fn closing(self) -> f64 {
        self.h * self.k
    }

    /// Compliance over that of the reference reed, `k_ref / k`.
    pub fn compliance(self) -> f64 {
        K_INIT / self.k
    }

    /// Embouchure parameter over the reed's own closing pressure, `zeta A H k_ref / sqrt(H k)`, where the reference reed has `zeta`. A
    /// wider reed is stronger (as H^2 if k follows H, as sqrt(H) if k is free), a stiffer one weaker.
    pub fn flow_strength(self, zeta: f64) -> f64 {
        zeta * self.a * self.h * K_INIT / self.closing().sqrt()
    }

    /// Pressure difference where the flow peaks, `H k / 3`, over the reference closing pressure.
    pub fn peak_at(self) -> f64 {
        self.closing() / 3.0
    }

    /// Peak flow `A sqrt(4 H^3 k / 27)`.
    pub fn peak_flow(self) -> f64 {
        self.a * (4.0 * self.h.powi(3) * self.k / 27.0).sqrt()
    }

    /// Flow at pressure difference `p` (mouth minus mouthpiece, over the reference closing pressure), read from the
    /// tables; dimensionless, the reference peaks at 1. Real-time safe.
    pub fn flow(self, tables: &ReedTables, p: f64) -> f64 {
        let (x_a, x_b) = tables.at(p.abs());
        if p < 0.0 {
            -self.a * (self.h * x_a + x_b / self.k)
        } else if p < self.closing() {
            self.a * (self.h * x_a - x_b / self.k)
        } else {
            0.0
        }
    }
}

impl Default for ReedLaw {
    fn default() -> Self {
        Self { h: H_INIT, k: K_INIT, a: 1.0 }
    }
}

/// The stiffness `27 / (4 H^3)` that gives a reed of rest opening `h` the peak flow 1.
pub fn coupled_k(h: f64) -> f64 {
    27.0 / (h.powi(3) * 4.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_are_the_notebooks() {
        assert_eq!(27.0_f64.sqrt() / 2.0, H_INIT);
        assert_eq!(27.0 / (H_INIT.powi(3) * 4.0), K_INIT);
        // The firmware's own, in single precision.
        assert_eq!((H_INIT as f32, K_INIT as f32), (2.598_076, 0.384_900_18));
        assert!((ReedLaw::default().closing() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn coupled_keeps_the_peak_free_moves_it() {
        let tables = ReedTables::reference();
        for h in [1.5, 2.0, H_INIT, 3.0, 5.0] {
            let law = ReedLaw::coupled(h, 1.0).unwrap();
            assert!((law.peak_flow() - 1.0).abs() < 1e-12);
            assert!((law.flow(tables, law.peak_at()) - 1.0).abs() < 1e-4, "h {h}");
        }
        let law = ReedLaw::free(2.0, 0.4, 1.5).unwrap();
        assert!((law.flow(tables, law.peak_at()) - 1.5 * (4.0 * 8.0 * 0.4_f64 / 27.0).sqrt()).abs() < 1e-5);
        assert_eq!(law.flow(tables, 0.8), 0.0);
        assert!(law.flow(tables, 0.799) > 0.0);
    }

    #[test]
    fn notebooks_sign_form_errs_for_negative_pressure() {
        let (law, tables) = (ReedLaw::default(), ReedTables::reference());
        let notebook = |p: f64| (law.h() * p.abs().sqrt() - p.abs().powf(1.5) / law.k()) * p.signum();
        // Physics: at p = -1 the reed stands at twice its rest opening, u = -(H + 1/k). The notebook closes it.
        assert!((law.flow(tables, -1.0) + law.h() + 1.0 / law.k()).abs() < 1e-12);
        assert!(notebook(-1.0).abs() < 1e-12);
        assert!(
            (law.flow(tables, 0.5) - notebook(0.5)).abs() < 1e-6,
            "they agree where the notebook is right"
        );
    }

    #[test]
    fn table_error_is_below_two_thousandths_of_the_peak() {
        let (law, tables) = (ReedLaw::default(), ReedTables::reference());
        let worst = (0..100_000)
            .map(|n| f64::from(n) / 100_000.0)
            .map(|p| (law.flow(tables, p) - (law.h() * p.sqrt() - p.powf(1.5) / law.k())).abs())
            .fold(0.0, f64::max);
        assert!(worst < 8e-4, "{worst:e}");
    }

    #[test]
    fn wrong_numbers_are_named() {
        assert!(ReedLaw::free(f64::NAN, 0.4, 1.0).unwrap_err().to_string().contains("NaN"));
        assert!(ReedLaw::free(2.0, 0.0, 1.0).is_err() && ReedLaw::free(2.0, 0.4, -1.0).is_err());
    }
}
