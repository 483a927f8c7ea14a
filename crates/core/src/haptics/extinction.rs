//! Extinction: the mouth pressure at which a note that sounds chokes, because the reed stays shut. As the pressure falls again, the reed opens further
//! down, and the note returns there.
//!
//! The model is Raman's two states with losses. Dalmont, Gilbert, Kergomard & Ollivier (2005) treat them with one loss for
//! all harmonics; their result is known here from citations, and the algebra is derived here. While the reed is open, the
//! pressure difference is x and the flow `zeta (1 - x) sqrt(x)`; while it is shut, the flow is 0. Near its maximum at
//! x = 1/3 the flow hardly depends on x. The reed is therefore a source of *flow*, a square wave of half that height. Each
//! odd harmonic n makes the pressure `Z(n f)` times its share of the flow, and over the open half period the pressure in
//! the mouthpiece averages
//!
//! ```text
//! a = zeta (1 - x) sqrt(x) Z_e / 2        Z_e = 8/pi^2 sum Re Z(n f) / n^2, n odd        gamma = x + a
//! ```
//!
//! A harmonic that fits no resonance has a small `Z` and adds little. The largest gamma over all x is the extinction.
//!
//! A note near extinction is so loud that it loses most of its energy in the jets of its open holes. The lattice has
//! `R = K rho |v| / (2 S)`; for a sine of amplitude V this is the resistance `K rho (8 / 3 pi) V / (2 S)` in series with
//! each hole. The flow in the hole is proportional to the pressure at the tip. `Z_e` therefore depends only on K times that
//! pressure, and is stored as a table of it.

use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

use crate::bore::instrument_file::InstrumentFile;
use crate::bore::transfer_matrix::TransferMatrix;
use crate::haptics::admittance::swept_s;
use crate::maths;
use crate::units::Air;

/// Harmonics above this frequency, Hz, are left out: the weight of harmonic n is 1/n^2.
const HARMONICS_TO_HZ: f64 = 6_000.0;
/// The table's levels, K times the amplitude of the fundamental at the tip, Pa: 0, then this, then twice the level before.
const FIRST_PA: f64 = 500.0;
const LEVELS: usize = 12;

/// `Z_e` of one fingering as a function of level.
#[derive(Clone, Debug)]
pub(super) struct EffectiveImpedance {
    z_e: [f64; LEVELS],
}

impl EffectiveImpedance {
    /// Computes `Z_e` for a note of the frequency `f_hz`, with the air volume of the reference reed. Allocates.
    pub(super) fn new(
        matrix: &TransferMatrix,
        file: &InstrumentFile,
        open: &[bool],
        air: &Air,
        f_hz: f64,
    ) -> Self {
        let swept_s = swept_s(file, air);
        let mut flows = vec![Complex64::ZERO; file.holes.len()];
        let mut resistances = vec![0.0; file.holes.len()];
        let per_pa: Vec<f64> = file
            .holes
            .iter()
            .map(|hole| {
                let section = PI * hole.radius_m * hole.radius_m;
                air.rho * 8.0 / (3.0 * PI) / (2.0 * section * section)
            })
            .collect();
        let z_e = std::array::from_fn(|level| {
            let loud_pa = if level == 0 { 0.0 } else { FIRST_PA * (1_u32 << (level - 1)) as f64 };
            // Each resistance limits the flow that causes it. Moving half way each time converges quickly.
            for _ in 0..12 {
                matrix.impedance_with_jets(f_hz, open, &resistances, &mut flows);
                for ((resistance, flow), per_pa) in resistances.iter_mut().zip(&flows).zip(&per_pa) {
                    *resistance = 0.5 * (*resistance + per_pa * maths::complex::norm(*flow) * loud_pa);
                }
            }
            let sum: f64 = (1_u32..)
                .step_by(2)
                .map(f64::from)
                .take_while(|n| n * f_hz < HARMONICS_TO_HZ)
                .map(|n| {
                    let z = matrix.impedance_with_jets(n * f_hz, open, &resistances, &mut flows);
                    (z / (1.0 + z * Complex64::I * (TAU * n * f_hz * swept_s))).re / (n * n)
                })
                .sum();
            8.0 / (PI * PI) * sum
        });
        Self { z_e }
    }

    /// `Z_e` at a level, linear between the levels of the table.
    fn at(&self, loud_pa: f64) -> f64 {
        let position =
            if loud_pa < FIRST_PA { loud_pa / FIRST_PA } else { 1.0 + maths::log2(loud_pa / FIRST_PA) };
        let i = (position as usize).min(LEVELS - 2);
        let t = (position - i as f64).min(1.0);
        self.z_e[i] + t * (self.z_e[i + 1] - self.z_e[i])
    }

    /// Extinction over the closing pressure. It is at least 1, because below the closing pressure the reed opens again.
    /// `jet_pa` is K times the closing pressure, Pa.
    pub(super) fn extinction(&self, zeta: f64, jet_pa: f64) -> f64 {
        const STEPS: u32 = 100;
        let gamma = |x: f64| {
            let half_flow = 0.5 * zeta * (1.0 - x) * x.sqrt();
            // Solves a = half_flow Z_e(a) by bisection: the right side falls as a grows.
            let (mut low, mut high) = (0.0, half_flow * self.z_e[0]);
            for _ in 0..40 {
                let a = 0.5 * (low + high);
                if half_flow * self.at(4.0 / PI * jet_pa * a) > a { low = a } else { high = a }
            }
            x + 0.5 * (low + high)
        };
        (1..STEPS).map(|n| gamma(f64::from(n) / f64::from(STEPS))).fold(1.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_jets_extinction_is_the_maximum_in_closed_form() {
        for z_e in [10.0, 30.0, 50.0] {
            let bore = EffectiveImpedance { z_e: [z_e; LEVELS] };
            let slope = 2.0 / (0.3 * z_e);
            let root = ((slope + (slope * slope + 3.0_f64).sqrt()) / 3.0).min(1.0);
            let exact = root * root + 0.15 * z_e * (1.0 - root * root) * root;
            assert!((bore.extinction(0.3, 0.0) - exact).abs() < 1e-3, "{z_e}");
        }
        // On a bore with too low an impedance the note stops where the reed shuts.
        assert_eq!(EffectiveImpedance { z_e: [1.0; LEVELS] }.extinction(0.3, 0.0), 1.0);
    }

    #[test]
    fn jets_lower_the_extinction_only_where_a_hole_is_open() {
        let file = InstrumentFile::built_in();
        let air = Air::default();
        let matrix = TransferMatrix::new(&file, air);
        let bore = |fingering: usize, f_hz: f64| {
            EffectiveImpedance::new(&matrix, &file, &file.fingerings[fingering].open, &air, f_hz)
        };
        let (e3, e4) = (bore(0, 147.6), bore(12, 296.4));
        assert_eq!(e3.extinction(0.3, 12_000.0), e3.extinction(0.3, 0.0));
        assert!(e4.extinction(0.3, 12_000.0) < 0.7 * e4.extinction(0.3, 0.0));
        assert!(e4.z_e.windows(2).all(|pair| pair[1] < pair[0]), "{:?}", e4.z_e);
    }
}
