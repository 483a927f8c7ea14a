//! Fits a cut bore to its own transfer matrices, so that rounding to the grid is paid for by the neighbours.
//!
//! Free are the radii of all cells, the radius of the end, strengths and frequencies of the three loss poles, the vent's
//! resistance and the share of each chimney before its compliance, each held near where it started. Compared are, for
//! every fingering of the file, height and place of the first five impedance peaks (through the admittance at the true
//! peak, which is linear in both), and the level of its whole impedance curve to 6 kHz.
//! Levenberg-Marquardt on the lattice's own frequency response, not on an idealisation of it.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};
use num_complex::Complex64;

use crate::bore::cells::{Cells, CellsError};
use crate::bore::instrument_file::InstrumentFile;
use crate::bore::lattice::LatticeCoeffs;
use crate::bore::tone_hole::HoleNetwork;
use crate::bore::transfer_matrix::TransferMatrix;
use crate::units::{Air, SoundingNote};

/// A relative change of a radius or loss that costs as much as two cents on one peak.
const STIFFNESS: f64 = 0.15;
/// The curve is compared at so many points over these frequencies, Hz; decibels at one point count so much: as little as
/// keeps the curve of every fingering within 1 dB rms to 4 kHz.
const CURVE_POINTS: usize = 118;
const CURVE_HZ: (f64, f64) = (80.0, 6_000.0);
const CURVE_WEIGHT: f64 = 0.22;
/// Cents and decibels on one peak that count as one.
const CENTS: f64 = 2.0;
const DECIBELS: f64 = 0.4;

/// One impedance peak the lattice should have.
struct PeakTarget {
    fingering: usize,
    f_hz: f64,
    z: Complex64,
    q: f64,
    weight: f64,
}

/// Impedance the lattice should have at one frequency, peak or not.
struct CurveTarget {
    fingering: usize,
    f_hz: f64,
    z: Complex64,
    weight: f64,
}

/// Tone-hole networks of a file; viscous resistance taken at 2.4 times the lowest note (350 Hz on the B flat clarinet).
pub fn networks(file: &InstrumentFile, air: &Air, cells: &Cells) -> Vec<HoleNetwork> {
    let lowest_hz = lowest_hz(file);
    file.holes
        .iter()
        .map(|hole| {
            HoleNetwork::new(hole, file.radius_at(hole.x_m), cells.chimney_split, 2.4 * lowest_hz, air)
        })
        .collect()
}

/// Equal-tempered frequency of the lowest note in the file, A4 = 440 Hz.
pub fn lowest_hz(file: &InstrumentFile) -> f64 {
    file.lowest().sounding(file.transposition).unwrap_or(SoundingNote(50)).frequency_hz(440.0)
}

struct Problem<'a> {
    start: Cells,
    file: &'a InstrumentFile,
    air: &'a Air,
    openings: Vec<Vec<f64>>,
    peaks: Vec<PeakTarget>,
    curve: Vec<CurveTarget>,
    parameters: DVector<f64>,
}

impl Problem<'_> {
    fn cells(&self, parameters: &DVector<f64>) -> Cells {
        let mut cells = self.start.clone();
        let count = cells.cells.len();
        for (cell, change) in cells.cells.iter_mut().zip(parameters.iter()) {
            cell.radius_m *= change.exp();
        }
        cells.end_radius_m *= parameters[count].exp();
        let losses = cells.loss_strengths.iter_mut().chain(&mut cells.loss_poles_hz);
        for (loss, change) in losses.zip(parameters.iter().skip(count + 1)) {
            *loss *= change.exp();
        }
        cells.vent_resistance *= parameters[count + 7].exp();
        cells.chimney_split = (cells.chimney_split + parameters[count + 8]).clamp(0.2, 0.6);
        cells
    }

    fn residuals_at(&self, parameters: &DVector<f64>) -> DVector<f64> {
        let cells = self.cells(parameters);
        let coeffs = LatticeCoeffs::new(&cells, &networks(self.file, self.air, &cells), 1.0, self.air);
        let mut out = Vec::with_capacity(2 * (self.peaks.len() + self.curve.len()) + parameters.len());
        for peak in &self.peaks {
            let z = coeffs.impedance(peak.f_hz, &self.openings[peak.fingering]);
            // Near a peak Y = (1 + 2 j Q df/f) / Z_peak.
            let error = (1.0 / z - 1.0 / peak.z) * peak.z;
            out.push(peak.weight * 1_200.0 / std::f64::consts::LN_2 * error.im / (2.0 * peak.q) / CENTS);
            out.push(peak.weight * 20.0 / std::f64::consts::LN_10 * error.re / DECIBELS);
        }
        for point in &self.curve {
            let z = coeffs.impedance(point.f_hz, &self.openings[point.fingering]);
            out.push(point.weight * 20.0 * (z / point.z).norm().log10());
        }
        out.extend(parameters.iter().map(|change| change / STIFFNESS));
        // Losses, the vent's resistance and the chimneys' split are stand-ins and may move more freely.
        for loose in out.iter_mut().rev().take(8) {
            *loose *= 0.2;
        }
        DVector::from_vec(out)
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, parameters: &DVector<f64>) {
        self.parameters.copy_from(parameters);
    }

    fn params(&self) -> DVector<f64> {
        self.parameters.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(self.residuals_at(&self.parameters))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        const STEP: f64 = 1e-6;
        let here = self.residuals_at(&self.parameters);
        let mut jacobian = DMatrix::zeros(here.len(), self.parameters.len());
        for column in 0..self.parameters.len() {
            let mut moved = self.parameters.clone();
            moved[column] += STEP;
            jacobian.set_column(column, &((self.residuals_at(&moved) - &here) / STEP));
        }
        Some(jacobian)
    }
}

/// Cuts and fits a bore for the lattice at `rate_hz`. Takes seconds. Allocates.
pub fn fit(file: &InstrumentFile, air: &Air, rate_hz: f64) -> Result<Cells, CellsError> {
    let start = Cells::cut(file, air, rate_hz)?;
    let model = TransferMatrix::new(file, *air);
    let (mut peaks, mut curve) = (Vec::new(), Vec::new());
    for (index, fingering) in file.fingerings.iter().enumerate() {
        let register = if fingering.mode <= 2 { 1.0 } else { 0.5 };
        for (n, peak) in model.peaks(&fingering.open, 0.0, 5).iter().enumerate() {
            let weight = register * if n < 3 { 1.0 } else { 0.2 };
            // A peak lower than a few Zc is a shoulder of its neighbour: nothing sounds there.
            if peak.mag_over_zc > 3.0 {
                let z = model.impedance(peak.f_hz, &fingering.open, 0.0);
                peaks.push(PeakTarget { fingering: index, f_hz: peak.f_hz, z, q: peak.q, weight });
            }
        }
        for n in 0..CURVE_POINTS {
            let f_hz = CURVE_HZ.0 + (CURVE_HZ.1 - CURVE_HZ.0) * (n as f64 + 0.5) / CURVE_POINTS as f64;
            let z = model.impedance(f_hz, &fingering.open, 0.0);
            let weight = CURVE_WEIGHT * if f_hz < 4_000.0 { 1.0 } else { 0.3 };
            curve.push(CurveTarget { fingering: index, f_hz, z, weight });
        }
    }
    let openings = file
        .fingerings
        .iter()
        .map(|f| f.open.iter().map(|&open| f64::from(u8::from(open))).collect())
        .collect();
    let parameters = DVector::zeros(start.cells.len() + 9);
    let problem = Problem { file, start, air, openings, peaks, curve, parameters };
    let solver = LevenbergMarquardt::new().with_ftol(1e-5).with_xtol(1e-5).with_gtol(1e-9).with_patience(2);
    let (problem, _report) = solver.minimize(problem);
    Ok(problem.cells(&problem.parameters))
}
