//! Eight junctions at a time: arriving waves and their losses, changes of section, tone holes.

use super::real::Real;
use super::{BACK, LANES, SPACE, TINY};
use crate::bore::tone_hole::HoleCoeffs;

pub(super) type Octet<F> = [F; LANES];

/// One-pole loss of both waves arriving at eight junctions, and where they come from: `y = x - m (x - s)` with
/// `m = A (1 - q)`, then `s += q (x - s)`.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Arrivals<F> {
    pub(super) offset: [[u16; LANES]; 2],
    /// m, see above.
    pub(super) taken: [Octet<F>; 2],
    pub(super) q: [Octet<F>; 2],
    pub(super) state: [Octet<F>; 2],
}

impl<F: Real> Arrivals<F> {
    pub(super) fn idle(slot: usize) -> Self {
        let nothing = [Octet::default(); 2];
        Self { offset: [[slot as u16; LANES]; 2], taken: nothing, q: nothing, state: nothing }
    }

    /// Waves arriving at eight junctions on one side, after their cell's loss.
    #[inline(always)]
    pub(super) fn gather<const SIDE: usize>(&mut self, ring: &[F; SPACE], base: u16, mask: u16) -> Octet<F> {
        let mut wave = Octet::<F>::default();
        for (wave, offset) in wave.iter_mut().zip(self.offset[SIDE]) {
            *wave = ring[usize::from(base.wrapping_add(offset) & mask)];
        }
        let (taken, q, state) = (&self.taken[SIDE], &self.q[SIDE], &mut self.state[SIDE]);
        for k in 0..LANES {
            let difference = wave[k] - state[k];
            state[k] = state[k] + q[k] * difference;
            wave[k] = wave[k] - taken[k] * difference;
        }
        wave
    }

    #[inline(always)]
    pub(super) fn flush(&mut self) {
        self.state.iter_mut().flatten().for_each(flush);
    }
}

/// Written unconditionally: only so do loops over it become vectors.
#[inline(always)]
pub(super) fn flush<F: Real>(x: &mut F) {
    *x = if x.magnitude() < F::of(TINY) { F::default() } else { *x };
}

/// Writes the waves leaving eight junctions, down the bore and back.
#[inline(always)]
pub(super) fn leave<F: Real>(ring: &mut [F; SPACE], row: usize, down: &Octet<F>, back: &Octet<F>) {
    let row = row & (SPACE - 1) & !(LANES - 1);
    for (side, wave) in [(row, down), (row | BACK, back)] {
        if let Some(slots) = ring.get_mut(side..side + LANES) {
            slots.copy_from_slice(wave);
        }
    }
}

/// Eight changes of section.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Steps<F> {
    pub(super) arrivals: Arrivals<F>,
    /// Weight of the left wave in the pressure, 2 Y_left / (Y_left + Y_right); 2 less this is that of the right one.
    pub(super) weight: Octet<F>,
}

impl<F: Real> Steps<F> {
    /// Eight lanes without a junction; `slot` is one that nobody writes.
    pub(super) fn idle(slot: usize) -> Self {
        Self { arrivals: Arrivals::idle(slot), weight: [F::of(1.0); LANES] }
    }

    #[inline(always)]
    pub(super) fn tick(&mut self, ring: &mut [F; SPACE], base: u16, mask: u16, slot: usize) {
        let left = self.arrivals.gather::<0>(ring, base, mask);
        let right = self.arrivals.gather::<1>(ring, base, mask);
        let (mut down, mut back) = (Octet::<F>::default(), Octet::<F>::default());
        for k in 0..LANES {
            let difference = left[k] - right[k];
            down[k] = right[k] + self.weight[k] * difference;
            back[k] = down[k] - difference;
        }
        leave(ring, base as usize + slot, &down, &back);
    }
}

/// Eight tone holes.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Holes<F> {
    pub(super) arrivals: Arrivals<F>,
    pub(super) y_left: Octet<F>,
    pub(super) y_right: Octet<F>,
    pub(super) y_sum: Octet<F>,
    pub(super) r1: Octet<F>,
    pub(super) minus_r1: Octet<F>,
    pub(super) gc: Octet<F>,
    pub(super) minus_gc2: Octet<F>,
    pub(super) gl2: Octet<F>,
    pub(super) outside: Octet<F>,
    pub(super) rs0: Octet<F>,
    /// Jet resistance per flow of the open hole, and as it stands.
    pub(super) jet_open: Octet<F>,
    pub(super) jet: Octet<F>,
    /// Openings, 0 closed ..= 1 open, and their change per sample, 0 at rest. No opening leaves its `range` (low, high): the
    /// way from where the hole began to where it goes.
    pub(super) opening: Octet<F>,
    glide: Octet<F>,
    range: [Octet<F>; 2],
    /// Squares of the openings.
    area: Octet<F>,
    pub(super) resistance: Octet<F>,
    pub(super) outer: Octet<F>,
    pub(super) compliance: Octet<F>,
    pub(super) inner: Octet<F>,
}

impl<F: Real> Holes<F> {
    /// Eight lanes without a hole; `slot` is one that nobody writes.
    pub(super) fn idle(slot: usize) -> Self {
        let none = Octet::<F>::default();
        Self {
            arrivals: Arrivals::idle(slot),
            y_left: none,
            y_right: none,
            y_sum: [F::of(1.0); LANES],
            r1: none,
            minus_r1: none,
            gc: none,
            minus_gc2: none,
            gl2: none,
            outside: none,
            rs0: none,
            jet_open: none,
            jet: none,
            opening: none,
            glide: none,
            range: [none; 2],
            area: none,
            resistance: none,
            outer: none,
            compliance: none,
            inner: none,
        }
    }

    /// Puts a closed hole into lane `k`, between cells of these admittances (over the reference).
    pub(super) fn place(&mut self, k: usize, hole: &HoleCoeffs, y_left: f64, y_right: f64) {
        self.y_left[k] = F::of(2.0 * y_left);
        self.y_right[k] = F::of(2.0 * y_right);
        self.y_sum[k] = F::of(y_left + y_right);
        self.r1[k] = F::of(hole.r1);
        self.minus_r1[k] = F::of(-hole.r1);
        self.gc[k] = F::of(hole.gc);
        self.minus_gc2[k] = F::of(-2.0 * hole.gc);
        self.gl2[k] = F::of(2.0 * hole.gl);
        self.outside[k] = F::of(hole.gl + hole.gp);
        self.rs0[k] = F::of(hole.rs);
        self.resistance[k] = F::of(hole.rs);
    }

    /// Puts the hole in lane `k` at an opening, 0..=1.
    pub(super) fn set_opening(&mut self, k: usize, opening: f64) {
        let opening = F::of(opening);
        self.opening[k] = opening;
        self.area[k] = opening * opening;
        self.glide[k] = F::default();
        self.range.iter_mut().for_each(|bound| bound[k] = opening);
    }

    /// Sends the hole in lane `k` to an opening, 0..=1, within `samples`.
    pub(super) fn glide_opening(&mut self, k: usize, opening: f64, samples: usize) {
        let (from, to) = (self.opening[k], F::of(opening));
        self.glide[k] = F::of((opening - from.wide()) / samples.max(1) as f64);
        let (low, high) = if from < to { (from, to) } else { (to, from) };
        self.range[0][k] = low;
        self.range[1][k] = high;
    }

    /// Whether the hole in lane `k` is on its way.
    pub(super) fn is_gliding(&self, k: usize) -> bool {
        self.glide[k] != F::default()
    }

    /// Whether the hole in lane `k` is open at all, or on its way there.
    pub(super) fn is_open(&self, k: usize) -> bool {
        self.opening[k] != F::default() || self.glide[k] != F::default()
    }

    /// A hole opened by `a` passes its jet through `a^2` of its area (its mass, too, is 1 / a^2 of the open one's). Seen
    /// behind the transformer the loss is then 1 / a^2 of the open hole's: it is what quietens the air column when the
    /// fingers leave many holes at once. Held below a bound where no air passes anyway.
    ///
    /// Stops the holes that have arrived, and is true if a hole is on its way. Seldom called, hence not inlined: it would
    /// crowd the loop over samples.
    #[inline(never)]
    pub(super) fn throttle(&mut self) -> bool {
        for k in 0..LANES {
            let area = self.area[k];
            self.jet[k] = self.jet_open[k] / (area + F::of(0.02) * (F::of(1.0) - area));
            let going_up = self.glide[k] > F::default();
            let there = self.opening[k] == self.range[usize::from(going_up)][k];
            self.glide[k] = if there { F::default() } else { self.glide[k] };
        }
        self.glide != Octet::default()
    }

    #[inline(always)]
    pub(super) fn glide(&mut self) {
        let [low, high] = &self.range;
        for k in 0..LANES {
            let next = self.opening[k] + self.glide[k];
            let next = if next < low[k] { low[k] } else { next };
            let next = if next > high[k] { high[k] } else { next };
            self.opening[k] = next;
            self.area[k] = next * next;
        }
    }

    /// The network of [`tone_hole`](crate::bore::tone_hole) at eight junctions, one sample; the flows leaving outside.
    #[inline(always)]
    pub(super) fn tick(&mut self, ring: &mut [F; SPACE], base: u16, mask: u16, slot: usize) -> Octet<F> {
        let left = self.arrivals.gather::<0>(ring, base, mask);
        let right = self.arrivals.gather::<1>(ring, base, mask);
        let one = F::of(1.0);
        let (mut down, mut back, mut radiated) = (Octet::default(), Octet::default(), Octet::default());
        for k in 0..LANES {
            let a = self.opening[k];
            let rs = self.resistance[k];
            let k2 = one / (one + rs * self.outside[k]);
            let g2 = self.outside[k] * k2;
            let gp = self.gc[k] + self.area[k] * g2;
            let w = one + gp * self.r1[k];

            let h2 = self.outer[k] * k2;
            let inner = self.inner[k];
            let source = self.compliance[k] + a * h2 - gp * inner;
            let arriving = self.y_left[k] * left[k] + self.y_right[k] * right[k];
            let p = (arriving * w - source) / (self.y_sum[k] * w + gp);
            // The flow into the hole is also arriving - y_sum p, but in single precision that difference is noise.
            let rise = self.minus_r1[k] / w * (gp * p + source);
            let node = p - inner + rise;
            let outside = a * node;
            let flow = g2 * outside + h2;
            self.outer[k] = self.outer[k] + self.gl2[k] * (outside - rs * flow);
            self.compliance[k] = self.minus_gc2[k] * node - self.compliance[k];
            self.inner[k] = rise + rise - inner;
            let leaving = a * flow;
            radiated[k] = leaving;
            self.resistance[k] = self.rs0[k] + self.jet[k] * leaving.magnitude();
            down[k] = p - right[k];
            back[k] = p - left[k];
        }
        leave(ring, base as usize + slot, &down, &back);
        radiated
    }
}
