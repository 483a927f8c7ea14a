//! How the input admittance of a lattice answers to each of its numbers: what a fit needs, at the price of one response.
//!
//! The response is a chain: the admittance seen at the top of a cell follows from that at its bottom. Going up once gives
//! the response and every intermediate admittance, going down once more multiplies the derivatives together (the adjoint
//! or reverse sweep). In the words of `coeffs`: cell of admittance Y with round trip T = E P^2 (E the delay, P = 1 -
//! A (1 - F) its loss, F the pole's low-pass), load y: rho = (Y - y) / (Y + y), r = rho T, and Y (1 - r) / (1 + r) above.

use crate::maths;
use num_complex::Complex64;

use super::coeffs::LatticeCoeffs;

/// Numbers of a lattice that a fit may move, in one list.
///
/// Admittances of the cells, amounts of their losses, coefficients of the three poles, conductance and mass of the bell;
/// then the admittances of the holes themselves, whose own numbers stay with [`HoleCoeffs`](crate::bore::tone_hole).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    cells: usize,
    holes: usize,
}

impl Layout {
    /// Of a lattice.
    pub fn of(coeffs: &LatticeCoeffs) -> Self {
        Self { cells: coeffs.ticks.len(), holes: coeffs.holes.len() }
    }

    /// Numbers before the holes.
    pub fn numbers(&self) -> usize {
        2 * self.cells + 5
    }

    /// Numbers and holes.
    pub fn len(&self) -> usize {
        self.numbers() + self.holes
    }

    /// Never: a lattice has cells.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The numbers of `coeffs`, all but the holes.
    pub fn values(&self, coeffs: &LatticeCoeffs) -> Vec<f64> {
        let pole = |pole: usize| coeffs.loss.get(pole).map_or(0.0, |loss| loss.1);
        let losses = coeffs.loss.iter().map(|loss| loss.0);
        let admittances = coeffs.admittance.iter().copied();
        admittances.chain(losses).chain((0..3).map(pole)).chain([coeffs.bell.0, coeffs.bell.1]).collect()
    }
}

/// Everything of a lattice at one frequency that does not depend on the fingering.
pub struct AtFrequency<'a> {
    coeffs: &'a LatticeCoeffs,
    layout: Layout,
    /// F of each pole and its derivative by the coefficient.
    low_pass: [(Complex64, Complex64); 3],
    /// E and P of each cell.
    trips: Vec<(Complex64, Complex64)>,
    /// `(1 + z^-1) / (1 - z^-1)`.
    trapezoid: Complex64,
    /// Admittance of each hole, closed and open.
    holes: Vec<[Complex64; 2]>,
}

/// Room for one sweep, to be used again.
#[derive(Default)]
pub struct Sweep {
    /// Derivative of the input admittance by each number of the [`Layout`].
    pub by: Vec<Complex64>,
    /// Load and reflectance of each cell.
    seen: Vec<(Complex64, Complex64)>,
}

impl<'a> AtFrequency<'a> {
    /// A lattice at `f_hz`.
    pub fn new(coeffs: &'a LatticeCoeffs, f_hz: f64) -> Self {
        let z1 = maths::complex::cis(-std::f64::consts::TAU * f_hz / coeffs.rate_hz);
        let low_pass = std::array::from_fn(|pole| {
            let q = coeffs.loss.get(pole).map_or(0.0, |loss| loss.1);
            let below = 1.0 - (1.0 - q) * z1;
            (q / below, (1.0 - z1) / (below * below))
        });
        let trip = |(cell, &ticks): (usize, &u32)| {
            let turn = -std::f64::consts::TAU * f_hz / coeffs.rate_hz * f64::from(ticks);
            (maths::complex::cis(turn), 1.0 - coeffs.loss[cell].0 * (1.0 - low_pass[cell % 3].0))
        };
        Self {
            coeffs,
            layout: Layout::of(coeffs),
            low_pass,
            trips: coeffs.ticks.iter().enumerate().map(trip).collect(),
            trapezoid: (1.0 + z1) / (1.0 - z1),
            holes: hole_admittances(coeffs, f_hz),
        }
    }

    /// Admittance at the tip, over the reference, `open[hole]` holes open; what it does when the numbers move is left in
    /// `sweep`.
    pub fn admittance(&self, open: &[bool], sweep: &mut Sweep) -> Complex64 {
        let coeffs = self.coeffs;
        let cells = self.layout.cells;
        sweep.seen.resize(cells, Default::default());
        let mut hole = coeffs.holes.len();
        let mut y = coeffs.bell.0 + coeffs.bell.1 * self.trapezoid;
        for cell in (0..cells).rev() {
            let own = coeffs.admittance[cell];
            let (delay, pass) = self.trips[cell];
            let r = (own - y) / (own + y) * delay * pass * pass;
            sweep.seen[cell] = (y, r);
            y = own * (1.0 - r) / (1.0 + r);
            if hole > 0 && cell > 0 && coeffs.hole_junctions[hole - 1] == cell - 1 {
                hole -= 1;
                y += self.holes[hole][usize::from(open[hole])];
            }
        }
        self.sweep_down(sweep);
        y
    }

    fn sweep_down(&self, Sweep { by, seen }: &mut Sweep) {
        let coeffs = self.coeffs;
        let cells = self.layout.cells;
        by.clear();
        by.resize(self.layout.len(), Complex64::ZERO);
        let (mut by_top, mut hole) = (Complex64::ONE, 0);
        for cell in 0..cells {
            let own = coeffs.admittance[cell];
            let ((y, r), (delay, pass)) = (seen[cell], self.trips[cell]);
            let sum = own + y;
            let round = delay * pass * pass;
            let by_r = by_top * (-2.0 * own) / ((1.0 + r) * (1.0 + r));
            let by_rho = by_r * round * 2.0 / (sum * sum);
            by[cell] = by_top * (1.0 - r) / (1.0 + r) + by_rho * y;
            let by_pass = by_r * (own - y) / sum * delay * pass * 2.0;
            let (low, by_coefficient) = self.low_pass[cell % 3];
            by[cells + cell] = by_pass * (low - 1.0);
            by[2 * cells + cell % 3] += by_pass * coeffs.loss[cell].0 * by_coefficient;
            by_top = -by_rho * own;
            if coeffs.hole_junctions.get(hole) == Some(&cell) {
                by[self.layout.numbers() + hole] = by_top;
                hole += 1;
            }
        }
        by[2 * cells + 3] = by_top;
        by[2 * cells + 4] = by_top * self.trapezoid;
    }
}

/// Admittance of each hole of a lattice at `f_hz`, closed and open, over the reference.
pub fn hole_admittances(coeffs: &LatticeCoeffs, f_hz: f64) -> Vec<[Complex64; 2]> {
    let z1 = maths::complex::cis(-std::f64::consts::TAU * f_hz / coeffs.rate_hz);
    coeffs.holes.iter().map(|hole| [0.0, 1.0].map(|opening| hole.admittance(z1, opening))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bore::cells::Cells;
    use crate::bore::cells::networks;
    use crate::bore::instrument_file::InstrumentFile;
    use crate::units::Air;

    /// Every derivative against a difference, at frequencies on and off resonance.
    #[test]
    fn derivatives_are_those_of_the_response() {
        let (file, air) = (InstrumentFile::built_in(), Air::default());
        let cells = Cells::cut(&file, &air, 96_000.0).unwrap();
        let coeffs = LatticeCoeffs::new(&cells, &networks(&file, &air, &cells), 1.0, &air);
        let layout = Layout::of(&coeffs);
        let mut worst = 0.0_f64;
        for (fingering, f_hz) in [(0, 147.0), (7, 900.0), (20, 2_345.0), (40, 5_900.0)] {
            let open = &file.fingerings[fingering].open;
            let opening: Vec<f64> = open.iter().map(|&open| f64::from(u8::from(open))).collect();
            let mut sweep = Sweep::default();
            let y = AtFrequency::new(&coeffs, f_hz).admittance(open, &mut sweep);
            let by = std::mem::take(&mut sweep.by);
            assert!((y * coeffs.impedance(f_hz, &opening) - 1.0).norm() < 1e-12);
            for (number, &expected) in by.iter().enumerate().take(layout.numbers()) {
                let step = 1e-6;
                let moved = |step: f64| {
                    let mut coeffs = coeffs.clone();
                    let count = coeffs.ticks.len();
                    match number {
                        n if n < count => coeffs.admittance[n] += step,
                        n if n < 2 * count => coeffs.loss[n - count].0 += step,
                        n if n < 2 * count + 3 => {
                            (0..count)
                                .filter(|cell| cell % 3 == n - 2 * count)
                                .for_each(|cell| coeffs.loss[cell].1 += step);
                        }
                        n if n == 2 * count + 3 => coeffs.bell.0 += step,
                        _ => coeffs.bell.1 += step,
                    }
                    AtFrequency::new(&coeffs, f_hz).admittance(open, &mut Sweep::default())
                };
                let difference = (moved(step) - moved(-step)) / (2.0 * step);
                let error = (difference - expected).norm() / (expected.norm() + 1e-3 * y.norm());
                worst = worst.max(error);
                assert!(error < 1e-4, "{number} at {f_hz} Hz: {expected} {difference}");
            }
            for hole in 0..file.holes.len() {
                let mut at = AtFrequency::new(&coeffs, f_hz);
                let step = Complex64::new(1e-7, 1e-7);
                at.holes[hole].iter_mut().for_each(|y| *y += step);
                let difference = (at.admittance(open, &mut sweep) - y) / step;
                let expected = by[layout.numbers() + hole];
                assert!(
                    (difference - expected).norm() < 1e-4 * (expected.norm() + 1e-3 * y.norm()),
                    "hole {hole}"
                );
            }
        }
        println!("derivatives of the response: within {worst:.1e}");
    }
}
