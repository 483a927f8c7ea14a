//! The input admittance of the bore for one fingering, stored on a grid of frequencies, and its modes.

use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

use crate::bore::instrument_file::InstrumentFile;
use crate::units::Air;

/// Step of the grid, Hz. The search for peaks in [`crate::bore::transfer_matrix`] uses the same step.
const STEP_HZ: f64 = 2.0;

/// `Zc / Z` of the bore without the reed, on a grid of frequencies.
#[derive(Clone, Debug)]
pub(super) struct AdmittanceGrid {
    /// Index of the first entry: its frequency divided by the step.
    first: usize,
    admittance: Vec<Complex64>,
}

impl AdmittanceGrid {
    /// Evaluates `admittance` at every grid point of the range.
    pub(super) fn new((from_hz, to_hz): (f64, f64), admittance: impl FnMut(f64) -> Complex64) -> Self {
        let (first, last) = ((from_hz / STEP_HZ).floor() as usize, (to_hz / STEP_HZ).ceil() as usize);
        let grid = (first..=last).map(|k| k as f64 * STEP_HZ);
        Self { first, admittance: grid.map(admittance).collect() }
    }

    /// Lowest and highest frequency of the grid, Hz.
    pub(super) fn range_hz(&self) -> (f64, f64) {
        let from_hz = self.first as f64 * STEP_HZ;
        (from_hz, from_hz + (self.admittance.len() - 1) as f64 * STEP_HZ)
    }

    /// The admittance at `f_hz`, by cubic interpolation; `None` outside the grid.
    pub(super) fn at(&self, f_hz: f64) -> Option<Complex64> {
        let position = f_hz / STEP_HZ - self.first as f64;
        let last = self.admittance.len().checked_sub(4)?;
        if !(1.0..=(last + 1) as f64).contains(&position) {
            return None;
        }
        let i = (position as usize - 1).min(last);
        let t = position - (i + 1) as f64;
        let y = &self.admittance[i..i + 4];
        let (a, b, c) = (t + 1.0, t - 1.0, t - 2.0);
        Some(
            y[0] * (-t * b * c / 6.0)
                + y[1] * (a * b * c / 2.0)
                + y[2] * (-a * t * c / 2.0)
                + y[3] * (a * t * b / 6.0),
        )
    }

    /// The modes of the bore with an air volume `swept_s` at the tip: frequency, Hz, where the susceptance rises through
    /// zero, and height Re Z / Zc of the peak.
    pub(super) fn modes(&self, swept_s: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        let loaded = move |f_hz: f64| Some(self.at(f_hz)? + Complex64::I * (TAU * f_hz * swept_s));
        let im = move |k: usize| self.admittance[k].im + TAU * (self.first + k) as f64 * STEP_HZ * swept_s;
        (2..self.admittance.len().saturating_sub(2)).filter_map(move |k| {
            if im(k - 1) > 0.0 || im(k) <= 0.0 {
                return None;
            }
            let (mut low, mut high) =
                ((self.first + k - 1) as f64 * STEP_HZ, (self.first + k) as f64 * STEP_HZ);
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if loaded(middle)?.im <= 0.0 { low = middle } else { high = middle }
            }
            let f_hz = 0.5 * (low + high);
            let conductance = loaded(f_hz)?.re;
            (conductance > 0.0).then(|| (f_hz, conductance.recip()))
        })
    }
}

/// Flow that the motion of the instrument's reference reed makes, per speed: V / (S c), s.
pub(super) fn swept_s(file: &InstrumentFile, air: &Air) -> f64 {
    file.reed_volume_m3 / (PI * file.nominal_radius_m * file.nominal_radius_m * air.c)
}
