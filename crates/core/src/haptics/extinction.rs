//! Where the note goes out: the pressure above which a reed that has been blown shut stays shut.
//!
//! Raman's two states with losses (Dalmont, Gilbert, Kergomard & Ollivier 2005 treat them with one loss for all
//! harmonics; read at second hand, the algebra is done here). Open, the pressure difference is x and the flow
//! `zeta (1 - x) sqrt(x)`; shut, the flow is 0. Near its maximum at x = 1/3 the flow hardly depends on x, so the reed is
//! a source of *flow*, a square wave of half that height: each odd harmonic n makes the pressure `Z(n f)` times its
//! share, and over the open half period the pressure in the mouthpiece averages
//!
//! ```text
//! a = zeta (1 - x) sqrt(x) Z_e / 2        Z_e = 8/pi^2 sum Re Z(n f) / n^2, n odd        gamma = x + a
//! ```
//!
//! A harmonic that fits no resonance has a small `Z` and is simply weak. The largest gamma over x is the extinction.
//!
//! So loud a note loses most in the jets of its open holes: `R = K rho |v| / (2 S)` of the lattice, for a sine of
//! amplitude V the resistance `K rho (8 / 3 pi) V / (2 S)` in series with each hole. The hole's flow is proportional to
//! the pressure at the tip, so `Z_e` depends on K times that pressure alone and is kept as a table of it.

use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

use crate::bore::instrument_file::InstrumentFile;
use crate::bore::transfer_matrix::TransferMatrix;
use crate::haptics::requirement::swept_s;
use crate::units::Air;

/// Harmonics above this are left out, Hz: their weight is below 1/n^2.
const HARMONICS_TO_HZ: f64 = 6_000.0;
/// K times the amplitude of the fundamental at the tip, Pa: 0, then this and twice as much each time.
const FIRST_PA: f64 = 500.0;
const LEVELS: usize = 12;

/// `Z_e` of one fingering, by how loud it is.
#[derive(Clone, Debug)]
pub(super) struct Swing {
    z_e: [f64; LEVELS],
}

impl Swing {
    /// Works out the impedances at the harmonics of `f_hz`, the volume of the reference reed included.
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
            // The resistances limit the flows that make them: halving the change each time settles quickly.
            for _ in 0..12 {
                matrix.impedance_with_jets(f_hz, open, &resistances, &mut flows);
                for ((resistance, flow), per_pa) in resistances.iter_mut().zip(&flows).zip(&per_pa) {
                    *resistance = 0.5 * (*resistance + per_pa * flow.norm() * loud_pa);
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

    fn at(&self, loud_pa: f64) -> f64 {
        let position =
            if loud_pa < FIRST_PA { loud_pa / FIRST_PA } else { 1.0 + (loud_pa / FIRST_PA).log2() };
        let i = (position as usize).min(LEVELS - 2);
        let t = (position - i as f64).min(1.0);
        self.z_e[i] + t * (self.z_e[i + 1] - self.z_e[i])
    }

    /// Extinction over the closing pressure, at least 1: below it the shut reed is not at rest. `jet_pa` is K times the
    /// closing pressure, Pa.
    pub(super) fn extinction(&self, zeta: f64, jet_pa: f64) -> f64 {
        const STEPS: u32 = 100;
        let gamma = |x: f64| {
            let half_flow = 0.5 * zeta * (1.0 - x) * x.sqrt();
            // a = half_flow Z_e(a): the right side falls with a.
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
            let swing = Swing { z_e: [z_e; LEVELS] };
            let slope = 2.0 / (0.3 * z_e);
            let root = ((slope + (slope * slope + 3.0_f64).sqrt()) / 3.0).min(1.0);
            let exact = root * root + 0.15 * z_e * (1.0 - root * root) * root;
            assert!((swing.extinction(0.3, 0.0) - exact).abs() < 1e-3, "{z_e}");
        }
        // A bore too weak to swing goes out where the reed shuts.
        assert_eq!(Swing { z_e: [1.0; LEVELS] }.extinction(0.3, 0.0), 1.0);
    }

    #[test]
    fn jets_put_a_loud_note_out_earlier_and_leave_the_closed_tube_alone() {
        let file = InstrumentFile::built_in();
        let air = Air::default();
        let matrix = TransferMatrix::new(&file, air);
        let swing = |fingering: usize, f_hz: f64| {
            Swing::new(&matrix, &file, &file.fingerings[fingering].open, &air, f_hz)
        };
        let (e3, e4) = (swing(0, 147.6), swing(12, 296.4));
        assert_eq!(e3.extinction(0.3, 12_000.0), e3.extinction(0.3, 0.0));
        assert!(e4.extinction(0.3, 12_000.0) < 0.7 * e4.extinction(0.3, 0.0));
        assert!(e4.z_e.windows(2).all(|pair| pair[1] < pair[0]), "{:?}", e4.z_e);
    }
}
