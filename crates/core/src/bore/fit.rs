//! Fits a cut bore to its own transfer matrices, so that rounding to the grid is paid for by the neighbours.
//!
//! Free are the radii of all cells, the radius of the end, strengths and frequencies of the three loss poles, the vent's
//! resistance and the share of each chimney before its compliance, each held near where it started. Compared are, for
//! every fingering of the maker's chart, height and place of the first five impedance peaks (through the admittance at the true
//! peak, which is linear in both), and the level of its whole impedance curve, to 6 kHz on a B flat clarinet and
//! accordingly on others. Levenberg-Marquardt on the lattice's own frequency response, not on an idealisation of it;
//! derivatives from one reverse sweep. Work is shared between cores; the result does not depend on their number.

use std::cell::RefCell;
use std::ops::ControlFlow;

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra::{DMatrix, DVector, Dyn, Owned};
use num_complex::Complex64;

use crate::bore::cells::networks;
use crate::bore::cells::{Cells, CellsError};
use crate::bore::instrument_file::{Fingering, InstrumentFile};
use crate::bore::lattice::LatticeCoeffs;
use crate::bore::lattice::sensitivity::{AtFrequency, Layout, Sweep, hole_admittances};
use crate::bore::transfer_matrix::TransferMatrix;
use crate::maths;
use crate::parallel::{self, each_part};
use crate::units::{Air, REFERENCE_LENGTH_M};

/// A relative change of a radius or loss that costs as much as two cents on one peak.
const STIFFNESS: f64 = 0.15;
/// The curve is compared at so many points over these frequencies, Hz, of a bore of [`REFERENCE_LENGTH_M`]; decibels at one point
/// count so much: as little as keeps the curve of every fingering of the B flat clarinet within 1 dB rms to 4 kHz.
const CURVE_POINTS: usize = 118;
const CURVE_HZ: (f64, f64) = (80.0, 6_000.0);
const CURVE_WEIGHT: f64 = 0.22;
/// Up to here the curve counts in full, Hz, of a bore of [`REFERENCE_LENGTH_M`].
const CURVE_FULL_HZ: f64 = 4_000.0;
/// Cents and decibels on one peak that count as one.
const CENTS: f64 = 2.0;
const DECIBELS: f64 = 0.4;
/// An instrument with fewer fingerings is also compared with its holes opened one after the other from the bell, at this
/// weight: so that the fit knows of every hole.
const FEW_FINGERINGS: (usize, f64) = (12, 0.5);
/// Share of the work that is done before the first step of the fit: the transfer matrices; and of what is left, the share
/// that each step does: fits take 8 to 25 of them.
const SHARES: (f64, f64) = (0.6, 0.15);

/// What the lattice should have at one frequency with one fingering.
struct Target {
    open: usize,
    z: Complex64,
    weight: f64,
    /// Quality factor where this is a peak.
    q: Option<f64>,
}

impl Target {
    fn rows(&self) -> usize {
        if self.q.is_some() { 2 } else { 1 }
    }

    /// Residuals for the admittance `y` and, linear in its small change `dy`, their changes.
    fn residuals(&self, y: Complex64, out: &mut [f64]) {
        match self.q {
            // Near a peak Y = (1 + 2 j Q df/f) / Z_peak.
            Some(q) => self.peak((y - 1.0 / self.z) * self.z, q, out),
            None => out[0] = -self.weight * 20.0 * maths::log10(maths::complex::norm(y * self.z)),
        }
    }

    fn changes(&self, y: Complex64, dy: Complex64, out: &mut [f64]) {
        match self.q {
            Some(q) => self.peak(dy * self.z, q, out),
            None => out[0] = -self.weight * 20.0 / std::f64::consts::LN_10 * (dy / y).re,
        }
    }

    fn peak(&self, error: Complex64, q: f64, out: &mut [f64]) {
        out[0] = self.weight * 1_200.0 / std::f64::consts::LN_2 * error.im / (2.0 * q) / CENTS;
        out[1] = self.weight * 20.0 / std::f64::consts::LN_10 * error.re / DECIBELS;
    }
}

/// All targets at one frequency.
struct Group {
    f_hz: f64,
    targets: Vec<Target>,
}

impl Group {
    fn rows(&self) -> usize {
        self.targets.iter().map(Target::rows).sum()
    }
}

/// What hears how much is done, 0..=1, and may end it; and the same, kept.
type OnProgress<'a> = &'a mut (dyn FnMut(f64) -> ControlFlow<()> + 'a);
type Listener<'a> = Box<dyn FnMut(f64) -> ControlFlow<()> + 'a>;

struct Problem<'a> {
    start: Cells,
    file: &'a InstrumentFile,
    air: &'a Air,
    open: Vec<Vec<bool>>,
    groups: Vec<Group>,
    parameters: DVector<f64>,
    /// Told at every step; the count of them.
    progress: RefCell<(Listener<'a>, i32)>,
}

impl Problem<'_> {
    fn cells(&self, parameters: &DVector<f64>) -> Cells {
        let mut cells = self.start.clone();
        let count = cells.cells.len();
        for (cell, change) in cells.cells.iter_mut().zip(parameters.iter()) {
            cell.radius_m *= maths::exp(*change);
        }
        cells.end_radius_m *= maths::exp(parameters[count]);
        let losses = cells.loss_strengths.iter_mut().chain(&mut cells.loss_poles_hz);
        for (loss, change) in losses.zip(parameters.iter().skip(count + 1)) {
            *loss *= maths::exp(*change);
        }
        cells.vent_resistance *= maths::exp(parameters[count + 7]);
        cells.chimney_split = (cells.chimney_split + parameters[count + 8]).clamp(0.2, 0.6);
        cells
    }

    fn coeffs(&self, parameters: &DVector<f64>) -> LatticeCoeffs {
        let cells = self.cells(parameters);
        LatticeCoeffs::new(&cells, &networks(self.file, self.air, &cells), 1.0, self.air)
    }

    fn rows(&self) -> usize {
        self.groups.iter().map(Group::rows).sum()
    }

    /// How much a change of a parameter weighs: losses, the vent's resistance and the chimneys' split are stand-ins and
    /// may move more freely.
    fn stiffness(&self, parameter: usize) -> f64 {
        let loose = parameter + 8 >= self.parameters.len();
        if loose { 0.2 / STIFFNESS } else { 1.0 / STIFFNESS }
    }

    fn residuals_at(&self, parameters: &DVector<f64>) -> DVector<f64> {
        let coeffs = self.coeffs(parameters);
        let mut out = vec![0.0; self.rows()];
        let open = &self.open;
        each_part(&self.groups, Group::rows, &mut out, |group, out| {
            let at = AtFrequency::new(&coeffs, group.f_hz);
            let (mut sweep, mut row) = (Sweep::default(), 0);
            for target in &group.targets {
                let y = at.admittance(&open[target.open], &mut sweep);
                target.residuals(y, &mut out[row..row + target.rows()]);
                row += target.rows();
            }
        });
        out.extend(parameters.iter().enumerate().map(|(index, change)| change * self.stiffness(index)));
        DVector::from_vec(out)
    }

    /// All derivatives of the residuals: the lattice's own sensitivities times what the parameters do to its numbers.
    fn jacobian_at(&self, parameters: &DVector<f64>) -> DMatrix<f64> {
        const STEP: f64 = 1e-6;
        let (count, rows) = (parameters.len(), self.rows());
        let here = self.coeffs(parameters);
        let layout = Layout::of(&here);
        let numbers = layout.values(&here);
        let moved: Vec<LatticeCoeffs> = (0..count)
            .map(|parameter| {
                let mut moved = parameters.clone();
                moved[parameter] += STEP;
                self.coeffs(&moved)
            })
            .collect();
        // What each parameter does to the numbers that are not holes: few of them each.
        let links: Vec<Vec<(usize, f64)>> = moved
            .iter()
            .map(|moved| {
                let changes =
                    layout.values(moved).into_iter().zip(&numbers).map(|(new, old)| (new - old) / STEP);
                changes.enumerate().filter(|(_, change)| change.abs() > 1e-12).collect()
            })
            .collect();
        let moves_holes: Vec<usize> =
            (0..count).filter(|&parameter| !moved[parameter].same_holes(&here)).collect();
        let mut out = vec![0.0; rows * count];
        let fingerings = &self.open;
        each_part(
            &self.groups,
            |group| group.rows() * count,
            &mut out,
            |group, out| {
                let at = AtFrequency::new(&here, group.f_hz);
                let holes = hole_admittances(&here, group.f_hz);
                let hole_changes: Vec<Vec<[Complex64; 2]>> = moves_holes
                    .iter()
                    .map(|&parameter| hole_admittances(&moved[parameter], group.f_hz))
                    .collect();
                let (mut sweep, mut row) = (Sweep::default(), 0);
                for target in &group.targets {
                    let open = &fingerings[target.open];
                    let y = at.admittance(open, &mut sweep);
                    let by = &sweep.by;
                    let mut changes = vec![Complex64::ZERO; count];
                    for (change, links) in changes.iter_mut().zip(&links) {
                        *change = links.iter().map(|&(number, change)| by[number] * change).sum();
                    }
                    for (&parameter, moved) in moves_holes.iter().zip(&hole_changes) {
                        for (hole, &open) in open.iter().enumerate() {
                            let open = usize::from(open);
                            changes[parameter] +=
                                by[layout.numbers() + hole] * (moved[hole][open] - holes[hole][open]) / STEP;
                        }
                    }
                    let mut both = [0.0; 2];
                    for (parameter, dy) in changes.into_iter().enumerate() {
                        target.changes(y, dy, &mut both);
                        for (n, value) in both.iter().take(target.rows()).enumerate() {
                            out[(row + n) * count + parameter] = *value;
                        }
                    }
                    row += target.rows();
                }
            },
        );
        let mut jacobian = DMatrix::zeros(rows + count, count);
        for (row, values) in out.chunks(count).enumerate() {
            jacobian.row_mut(row).copy_from_slice(values);
        }
        for parameter in 0..count {
            jacobian[(rows + parameter, parameter)] = self.stiffness(parameter);
        }
        jacobian
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
        let (on, step) = &mut *self.progress.borrow_mut();
        let share = 1.0 - (1.0 - SHARES.0) * (1.0 - SHARES.1).powi(*step);
        *step += 1;
        // Without a Jacobian the solver ends.
        on(share).is_continue().then(|| self.jacobian_at(&self.parameters))
    }
}

/// The fingerings to compare, as holes open, with their weights. Those of the maker's chart: a player who takes another
/// fingering for a note does not change the bore.
fn fingerings(file: &InstrumentFile) -> Vec<(Vec<bool>, f64)> {
    let register = |mode: usize| if mode <= 2 { 1.0 } else { 0.5 };
    let compared = |fingering: &Fingering| (fingering.of_maker().to_vec(), register(fingering.mode));
    let mut all: Vec<(Vec<bool>, f64)> = file.fingerings.iter().map(compared).collect();
    if all.len() < FEW_FINGERINGS.0 {
        for first in (0..=file.holes.len()).rev() {
            let open: Vec<bool> = (0..file.holes.len()).map(|hole| hole >= first).collect();
            if all.iter().all(|(known, _)| *known != open) {
                all.push((open, FEW_FINGERINGS.1));
            }
        }
    }
    all
}

/// What the transfer matrices say; `None` if `on` ended it.
fn targets(
    file: &InstrumentFile,
    air: &Air,
    fingerings: &[(Vec<bool>, f64)],
    on: OnProgress<'_>,
) -> Option<Vec<Group>> {
    let model = TransferMatrix::new(file, *air);
    model.prepare_peaks(&mut |share| on(SHARES.0 * 0.9 * share))?;
    let on = &mut |share: f64| on(SHARES.0 * (0.9 + 0.1 * share));
    let size = file.length_m() / REFERENCE_LENGTH_M;
    let groups = parallel::each(
        fingerings.len() + CURVE_POINTS,
        |at| match fingerings.get(at) {
            Some((holes, weight)) => peak_groups(&model, at, holes, *weight),
            None => vec![curve_group(&model, at - fingerings.len(), size, fingerings)],
        },
        on,
    )?;
    Some(groups.into_iter().flatten().collect())
}

/// One group for each of the first five peaks of a fingering.
fn peak_groups(model: &TransferMatrix, open: usize, holes: &[bool], weight: f64) -> Vec<Group> {
    let peaks = model.peaks(holes, 0.0, 5);
    // A peak lower than a few Zc is a shoulder of its neighbour: nothing sounds there.
    let heard = peaks.iter().enumerate().filter(|(_, peak)| peak.mag_over_zc > 3.0);
    heard
        .map(|(n, peak)| {
            let z = model.impedance(peak.f_hz, holes, 0.0);
            let weight = weight * if n < 3 { 1.0 } else { 0.2 };
            Group { f_hz: peak.f_hz, targets: vec![Target { open, z, weight, q: Some(peak.q) }] }
        })
        .collect()
}

/// Point `n` of the impedance curve, for all fingerings.
fn curve_group(model: &TransferMatrix, n: usize, size: f64, fingerings: &[(Vec<bool>, f64)]) -> Group {
    let nominal_hz = CURVE_HZ.0 + (CURVE_HZ.1 - CURVE_HZ.0) * (n as f64 + 0.5) / CURVE_POINTS as f64;
    let f_hz = nominal_hz / size;
    let weight = CURVE_WEIGHT * if nominal_hz < CURVE_FULL_HZ { 1.0 } else { 0.3 };
    let target = |(open, (holes, _)): (usize, &(Vec<bool>, f64))| {
        let z = model.impedance(f_hz, holes, 0.0);
        Target { open, z, weight, q: None }
    };
    Group { f_hz, targets: fingerings.iter().enumerate().map(target).collect() }
}

/// Cuts and fits a bore for the lattice at `rate_hz`; `on` hears the share done and may end it, then there is no result.
/// Takes seconds, on all cores. Allocates.
pub fn fit(
    file: &InstrumentFile,
    air: &Air,
    rate_hz: f64,
    on: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Option<Cells>, CellsError> {
    let start = Cells::cut(file, air, rate_hz)?;
    let fingerings = fingerings(file);
    let Some(groups) = targets(file, air, &fingerings, on) else { return Ok(None) };
    let parameters = DVector::zeros(start.cells.len() + 9);
    let open = fingerings.into_iter().map(|(open, _)| open).collect();
    let progress = RefCell::new((Box::new(&mut *on) as _, 0));
    let problem = Problem { file, start, air, open, groups, parameters, progress };
    let solver = LevenbergMarquardt::new().with_ftol(1e-5).with_xtol(1e-5).with_gtol(1e-9).with_patience(2);
    let (problem, report) = solver.minimize(problem);
    if matches!(report.termination, TerminationReason::User(_)) {
        return Ok(None);
    }
    let cells = problem.cells(&problem.parameters);
    let (mut on, _) = problem.progress.into_inner();
    Ok(on(1.0).is_continue().then_some(cells))
}
