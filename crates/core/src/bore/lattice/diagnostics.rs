//! Reads and fills the whole state of a lattice: stored energy, largest wave, subnormal numbers.
//!
//! The integration tests of energy, passivity and denormals need this. It is compiled into the crate because the state is
//! private and those tests live in other packages. None of it is for the audio thread.

use super::coeffs::LatticeCoeffs;
use super::junctions::Octet;
use super::real::Real;
use super::{BACK, END_SLOT, LANES, Lattice, STRIDE};

impl<F: Real> Lattice<F> {
    /// True when every state is finite.
    pub fn is_finite(&self) -> bool {
        self.waves().iter().all(|x| x.wide().is_finite())
            && self.holes.iter().all(|h| h.outer.iter().chain(&h.compliance).all(|x| x.wide().is_finite()))
    }

    /// Largest magnitude of any wave still travelling.
    pub fn peak(&self) -> f64 {
        self.waves().iter().map(|x| x.wide().abs()).fold(0.0, f64::max)
    }

    /// True if any state is subnormal.
    pub fn has_subnormal(&self) -> bool {
        let tiny = |x: &F| x.wide() != 0.0 && x.wide().abs() < f64::from(f32::MIN_POSITIVE);
        self.waves().iter().any(tiny)
            || self.holes.iter().any(|h| h.outer.iter().chain(&h.compliance).chain(&h.inner).any(tiny))
            || self.holes.iter().any(|h| h.arrivals.state.iter().flatten().any(tiny))
            || self.steps.iter().any(|s| s.arrivals.state.iter().flatten().any(tiny))
            || [self.tip.state, self.end.state, self.bell_state].iter().any(tiny)
    }

    /// Energy of everything in the bore, in units of a wave of pressure 1 passing the reference section for one sample;
    /// `coeffs` are those the lattice was made from.
    ///
    /// Waves in flight count with their cell's admittance, and the row that a fractional tuning delay has half read with
    /// the part still to come. A loss filter holds `Y A (1 - q) / q l^2`; a trapezoidal element of conductance G or
    /// resistance R with state s holds `s^2 / 4G`, `s^2 / 4R`. Without sources this never grows while the delay rests.
    pub fn stored_energy(&self, coeffs: &LatticeCoeffs) -> f64 {
        F::stored_energy(self, coeffs)
    }

    /// Compiled in this crate, which is optimised where tests are not.
    pub(super) fn energy(&self, coeffs: &LatticeCoeffs) -> f64 {
        let last = coeffs.ticks.len() - 1;
        let tuned = coeffs.tuned_cell();
        let row = u32::from(self.base) / STRIDE as u32;
        let square = |slot: usize, age: u32| {
            let wave = self.ring[(row.wrapping_sub(age) & (self.rows() - 1)) as usize * STRIDE + slot].wide();
            wave * wave
        };
        let mut energy = 0.0;
        for (cell, (down, back)) in coeffs.all_rows().enumerate() {
            let from_left = if cell == 0 { END_SLOT } else { self.lane_of(cell - 1) };
            let from_right = BACK + if cell == last { END_SLOT } else { self.lane_of(cell) };
            let mut waves: f64 = (0..down).map(|age| square(from_left, age)).sum();
            if cell == tuned {
                let rows = self.delay.wide();
                let whole = rows as u32;
                waves += (0..whole).map(|age| square(from_right, age)).sum::<f64>();
                waves += (rows - f64::from(whole)) * square(from_right, whole);
            } else {
                waves += (0..back).map(|age| square(from_right, age)).sum::<f64>();
            }
            let (amount, q) = coeffs.loss[cell];
            let at_right = if cell == last { self.end.state } else { self.arrivals(self.lane_of(cell), 0) };
            let at_left = if cell == 0 { self.tip.state } else { self.arrivals(self.lane_of(cell - 1), 1) };
            let filters = at_right.wide().powi(2) + at_left.wide().powi(2);
            energy += coeffs.admittance[cell] * (waves + amount * (1.0 - q) / q * filters);
        }
        for (hole, &(chunk, lane)) in coeffs.holes.iter().zip(&*self.hole_lanes) {
            let state = |of: &Octet<F>| of[lane].wide() * of[lane].wide() / 4.0;
            let lanes = &self.holes[chunk];
            energy += state(&lanes.outer) / hole.gl
                + state(&lanes.compliance) / hole.gc
                + state(&lanes.inner) / hole.r1;
        }
        energy + self.bell_state.wide().powi(2) / (4.0 * coeffs.bell.1)
    }

    /// The part of the ring in use.
    fn waves(&self) -> &[F] {
        &self.ring[..=usize::from(self.mask)]
    }

    /// State of the loss filter on one side of a junction.
    fn arrivals(&self, lane: usize, side: usize) -> F {
        let (chunk, lane) = (lane / LANES, lane % LANES);
        let arrivals = match chunk.checked_sub(self.steps.len()) {
            None => &self.steps[chunk].arrivals,
            Some(chunk) => &self.holes[chunk].arrivals,
        };
        arrivals.state[side][lane]
    }

    /// Fills every state with `value()`, so that a test can start from any state.
    pub fn scatter(&mut self, mut value: impl FnMut() -> f64) {
        let mut next = || F::of(value());
        for chunk in 0..self.steps.len() + self.holes.len() {
            for row in 0..self.rows() as usize {
                for slot in [row * STRIDE + chunk * LANES, row * STRIDE + BACK + chunk * LANES] {
                    self.ring[slot..slot + LANES].iter_mut().for_each(|x| *x = next());
                }
            }
        }
        for row in 0..self.rows() as usize {
            self.ring[row * STRIDE + END_SLOT] = next();
            self.ring[row * STRIDE + BACK + END_SLOT] = next();
        }
        self.close_ring();
        for holes in &mut *self.holes {
            holes.is_shut = false;
            for k in 0..LANES {
                (holes.outer[k], holes.compliance[k], holes.inner[k]) = (next(), next(), next());
            }
            holes.arrivals.state.iter_mut().flatten().for_each(|x| *x = next());
        }
        self.steps.iter_mut().for_each(|s| s.arrivals.state.iter_mut().flatten().for_each(|x| *x = next()));
        (self.tip.state, self.end.state, self.bell_state) = (next(), next(), next());
    }
}
