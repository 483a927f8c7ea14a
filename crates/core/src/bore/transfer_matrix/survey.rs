//! The resonances of very many fingerings: everything on one grid of frequencies, and what two fingerings share below a hole
//! is worked out once.

use std::ops::ControlFlow;

use num_complex::Complex64;

use super::{J, Matrix, TransferMatrix};
use crate::parallel;

/// Where a reed without inertia can play.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resonance {
    /// Where the phase of the impedance falls through zero, Hz.
    pub f_hz: f32,
    /// Re Z/Zc there.
    pub height: f32,
}

/// Step of the grid over its lowest frequency. Between its points the admittance is taken as straight: half a cent off at the lowest
/// note (see the test).
const STEP: f64 = 0.04;
/// Resonances lower than this are none: the threshold of a reed would be above its closing pressure.
const LEAST_HEIGHT: f32 = 2.0;
/// Fingerings that one item of work holds.
const BATCH: usize = 1_024;

/// What does not depend on the fingering, `[frequency]`.
struct Grid {
    /// Lowest frequency, and step, Hz.
    at_hz: (f64, f64),
    /// `[holes + 1]`
    spans: Vec<Vec<Matrix>>,
    /// `[hole][closed, open]`
    shunts: Vec<[Vec<Complex64>; 2]>,
    bell: Vec<Complex64>,
    /// Admittance of the reed's volume.
    reed: Vec<Complex64>,
}

type Waves = Vec<(Complex64, Complex64)>;

impl TransferMatrix {
    /// The resonances within `range_hz` of each fingering, lowest first, on all cores. A fingering is one bit a hole, set if
    /// it is open, in the order of the file from the lowest bit. `on` hears the share done and may end it, then the answer is
    /// `None`.
    pub fn survey(
        &self,
        fingerings: &[u64],
        reed_volume_m3: f64,
        range_hz: (f64, f64),
        on: &mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Option<Vec<Vec<Resonance>>> {
        let grid = self.grid(reed_volume_m3, range_hz);
        // Sorted by what is open near the bell: neighbours share most.
        let mut order: Vec<usize> = (0..fingerings.len()).collect();
        order.sort_by_key(|&at| fingerings[at]);
        let batches: Vec<&[usize]> = order.chunks(BATCH).collect();
        let found = parallel::each(
            batches.len(),
            |batch| {
                let mut climb = Climb::new(&grid);
                batches[batch].iter().map(|&at| climb.resonances(fingerings[at])).collect::<Vec<_>>()
            },
            on,
        )?;
        let mut all = vec![Vec::new(); fingerings.len()];
        for (&at, resonances) in order.iter().zip(found.into_iter().flatten()) {
            all[at] = resonances;
        }
        Some(all)
    }

    fn grid(&self, reed_volume_m3: f64, (lowest_hz, highest_hz): (f64, f64)) -> Grid {
        let step_hz = STEP * lowest_hz;
        let steps = ((highest_hz - lowest_hz) / step_hz) as usize + 1;
        let at: Vec<_> = (0..steps).map(|k| self.at(lowest_hz + step_hz * k as f64)).collect();
        let compliance = reed_volume_m3 / (self.air.rho * self.air.c * self.air.c);
        let z_c = self.air.z_c(self.nominal_radius_m);
        // Pressures over Zc from here on.
        Grid {
            at_hz: (lowest_hz, step_hz),
            spans: (0..=self.holes.len()).map(|span| at.iter().map(|at| at.spans[span]).collect()).collect(),
            shunts: (0..self.holes.len())
                .map(|hole| [0, 1].map(|open| at.iter().map(|at| at.shunts[hole][open]).collect()))
                .collect(),
            bell: at.iter().map(|at| at.bell).collect(),
            reed: at.iter().map(|at| J * at.omega * compliance * z_c).collect(),
        }
        .over(z_c)
    }
}

impl Grid {
    /// With impedances over `z_c`.
    fn over(mut self, z_c: f64) -> Self {
        for matrix in self.spans.iter_mut().flatten() {
            matrix.pu /= z_c;
            matrix.up *= z_c;
        }
        self.shunts.iter_mut().flatten().flatten().for_each(|shunt| *shunt *= z_c);
        self.bell.iter_mut().for_each(|bell| *bell /= z_c);
        self
    }
}

/// The way from the bell up to the reed, for one fingering after the other.
struct Climb<'a> {
    grid: &'a Grid,
    /// Pressure and flow above each hole, `[hole]`, and at the bell.
    above: Vec<Waves>,
    before: Option<u64>,
}

impl<'a> Climb<'a> {
    fn new(grid: &'a Grid) -> Self {
        let bell: Waves = grid.bell.iter().map(|&bell| (bell, Complex64::ONE)).collect();
        Self { grid, above: vec![bell; grid.shunts.len() + 1], before: None }
    }

    fn resonances(&mut self, open: u64) -> Vec<Resonance> {
        let holes = self.grid.shunts.len();
        let changed = self.before.map_or(u64::MAX, |before| before ^ open);
        self.before = Some(open);
        // From the lowest hole that changed upwards.
        let from = (0..holes).rev().find(|hole| changed >> hole & 1 == 1).map_or(0, |hole| hole + 1);
        for hole in (0..from).rev() {
            let (above, below) = self.above.split_at_mut(hole + 1);
            let shunts = &self.grid.shunts[hole][(open >> hole & 1) as usize];
            let terms = self.grid.spans[hole + 1].iter().zip(shunts).zip(&below[0]);
            for (above, ((span, shunt), &(pressure, flow))) in above[hole].iter_mut().zip(terms) {
                let (pressure, flow) = span.apply(pressure, flow);
                *above = (pressure, flow + pressure * shunt);
            }
        }
        let (lowest_hz, step_hz) = self.grid.at_hz;
        let mut found = Vec::new();
        let mut before: Option<Complex64> = None;
        let terms = self.grid.spans[0].iter().zip(&self.grid.reed).zip(&self.above[0]);
        for (k, ((span, reed), &(pressure, flow))) in terms.enumerate() {
            let (pressure, flow) = span.apply(pressure, flow);
            let here = flow / pressure + reed;
            if let Some(before) = before
                && before.im < 0.0
                && here.im >= 0.0
            {
                let part = before.im / (before.im - here.im);
                let height = 1.0 / (before.re + part * (here.re - before.re));
                let f_hz = lowest_hz + step_hz * (k as f64 - 1.0 + part);
                if height as f32 >= LEAST_HEIGHT {
                    found.push(Resonance { f_hz: f_hz as f32, height: height as f32 });
                }
            }
            before = Some(here);
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bore::instrument_file::InstrumentFile;
    use crate::units::{Air, cents};

    #[test]
    fn the_survey_finds_what_the_slow_search_finds() {
        let file = InstrumentFile::built_in();
        let model = TransferMatrix::new(&file, Air::default());
        let bits = |open: &[bool]| open.iter().rev().fold(0, |bits, &open| bits << 1 | u64::from(open));
        let charts: Vec<u64> = file.fingerings.iter().map(|fingering| bits(&fingering.open)).collect();
        let all = model
            .survey(&charts, file.reed_volume_m3, (100.0, 2_600.0), &mut |_| ControlFlow::Continue(()))
            .unwrap();
        for (fingering, found) in file.fingerings.iter().zip(&all) {
            let near_hz = fingering.written.sounding(file.transposition).unwrap().frequency_hz(440.0);
            let (f_hz, height) =
                model.playing_frequency(&fingering.open, file.reed_volume_m3, near_hz).unwrap();
            let off = |r: &&Resonance| cents(f64::from(r.f_hz), f_hz).abs();
            let nearest = found.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
            assert!(off(&nearest) < 1.0, "{}: {nearest:?} {f_hz}", fingering.written);
            assert!((f64::from(nearest.height) / height - 1.0).abs() < 0.05, "{}", fingering.written);
        }
    }
}
