//! Junctions in lanes: arriving waves and their losses, changes of section, tone holes.
//!
//! In a lattice a lane is one of eight junctions. In a [choir](super::choir) it is a voice, and all lanes are the same
//! junction. Each lane computes the same either way.

use super::real::Real;
use std::ops::{Deref, DerefMut};

use super::coeffs::LatticeCoeffs;
use super::{BACK, LANES, Ring, STRIDE, TINY};

pub(super) type Octet<F> = [F; LANES];

/// Eight junctions of a lattice, and where the waves that arrive at them come from.
#[derive(Clone)]
#[repr(C)]
pub(super) struct Chunk<T> {
    pub(super) sources: Sources,
    pub(super) lanes: T,
}

impl<T> Chunk<T> {
    /// Without a junction; `slot` is one that nobody writes.
    pub(super) fn idle(lanes: T, slot: usize) -> Self {
        Self { sources: Sources { offset: [[slot as u16; LANES]; 2] }, lanes }
    }
}

impl<T> Deref for Chunk<T> {
    type Target = T;

    #[inline(always)]
    fn deref(&self) -> &T {
        &self.lanes
    }
}

impl<T> DerefMut for Chunk<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut T {
        &mut self.lanes
    }
}

/// Where the waves arriving at eight junctions on both sides come from.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Sources {
    pub(super) offset: [[u16; LANES]; 2],
}

impl Sources {
    /// Waves arriving at eight junctions on one side.
    #[inline(always)]
    pub(super) fn gather<F: Real, const SIDE: usize>(
        &self,
        ring: &Ring<F>,
        base: u16,
        mask: u16,
    ) -> Octet<F> {
        let mut wave = Octet::<F>::default();
        for (wave, offset) in wave.iter_mut().zip(self.offset[SIDE]) {
            *wave = ring[usize::from(base.wrapping_add(offset) & mask)];
        }
        wave
    }

    /// Where these waves are in the ring, whose present row begins at `base`.
    #[inline(always)]
    pub(super) fn places(&self, base: u16, mask: u16) -> [[u16; LANES]; 2] {
        let mut places = self.offset;
        for place in places.as_flattened_mut() {
            *place = base.wrapping_add(*place) & mask;
        }
        places
    }
}

/// Waves at these places, or so many rows behind them: one at most.
#[inline(always)]
pub(super) fn gather<F: Real, const ROW: usize>(ring: &Ring<F>, places: &[u16; LANES]) -> Octet<F> {
    let behind = ROW.min(1) * STRIDE;
    let mut wave = Octet::<F>::default();
    for (wave, &place) in wave.iter_mut().zip(places) {
        *wave = ring[usize::from(place) + behind];
    }
    wave
}

/// One-pole loss of both waves arriving at junctions: `y = x - m (x - s)` with `m = A (1 - q)`, then `s += q (x - s)`.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Arrivals<F, const N: usize = LANES> {
    /// m, see above.
    pub(super) taken: [[F; N]; 2],
    pub(super) q: [[F; N]; 2],
    pub(super) state: [[F; N]; 2],
}

impl<F: Real, const N: usize> Arrivals<F, N> {
    pub(super) fn idle() -> Self {
        let nothing = [[F::default(); N]; 2];
        Self { taken: nothing, q: nothing, state: nothing }
    }

    /// Puts the losses on both sides of a junction into lane `k`.
    fn place(&mut self, k: usize, coeffs: &LatticeCoeffs, junction: usize) {
        for side in 0..2 {
            let (amount, q) = coeffs.loss[junction + side];
            self.taken[side][k] = F::of(amount * (1.0 - q));
            self.q[side][k] = F::of(q);
        }
    }

    /// Waves arriving on one side, after their cell's loss.
    #[inline(always)]
    pub(super) fn lose<const SIDE: usize>(&mut self, wave: [F; N]) -> [F; N] {
        lose(&self.taken[SIDE], &self.q[SIDE], &mut self.state[SIDE], wave)
    }

    /// As [`lose`](Self::lose), with a state that is kept elsewhere.
    #[inline(always)]
    fn lose_from(
        &self,
        [state_left, state_right]: &mut [[F; N]; 2],
        [left, right]: [[F; N]; 2],
    ) -> [[F; N]; 2] {
        [
            lose(&self.taken[0], &self.q[0], state_left, left),
            lose(&self.taken[1], &self.q[1], state_right, right),
        ]
    }

    #[inline(always)]
    pub(super) fn flush(&mut self) {
        self.state.iter_mut().flatten().for_each(flush);
    }
}

/// One side of [`Arrivals`].
#[inline(always)]
fn lose<F: Real, const N: usize>(taken: &[F; N], q: &[F; N], state: &mut [F; N], mut wave: [F; N]) -> [F; N] {
    for k in 0..N {
        let difference = wave[k] - state[k];
        state[k] = state[k] + q[k] * difference;
        wave[k] = wave[k] - taken[k] * difference;
    }
    wave
}

/// Written unconditionally: only so do loops over it become vectors.
#[inline(always)]
pub(super) fn flush<F: Real>(x: &mut F) {
    *x = if x.magnitude() < F::of(TINY) { F::default() } else { *x };
}

/// Writes the waves leaving the eight junctions of a chunk, down the bore and back, into a row.
#[inline(always)]
pub(super) fn leave<F: Real>(ring: &mut Ring<F>, row: u16, chunk: usize, [down, back]: &[Octet<F>; 2]) {
    let slots = ring.as_chunks_mut::<LANES>().0;
    let at = usize::from(row) / LANES + chunk % (BACK / LANES);
    slots[at] = *down;
    slots[at + BACK / LANES] = *back;
}

/// Changes of section.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Steps<F, const N: usize = LANES> {
    pub(super) arrivals: Arrivals<F, N>,
    /// Weight of the left wave in the pressure, 2 Y_left / (Y_left + Y_right); 2 less this is that of the right one.
    pub(super) weight: [F; N],
}

impl<F: Real, const N: usize> Steps<F, N> {
    /// Lanes without a junction.
    pub(super) fn idle() -> Self {
        Self { arrivals: Arrivals::idle(), weight: [F::of(1.0); N] }
    }

    /// Puts a junction into lane `k`.
    pub(super) fn place(&mut self, k: usize, coeffs: &LatticeCoeffs, junction: usize) {
        let (y_left, y_right) = (coeffs.admittance[junction], coeffs.admittance[junction + 1]);
        self.arrivals.place(k, coeffs, junction);
        self.weight[k] = F::of(2.0 * y_left / (y_left + y_right));
    }

    /// Waves that arrive from left and right leave downwards and back.
    #[inline(always)]
    pub(super) fn scatter(&mut self, arriving: [[F; N]; 2]) -> [[F; N]; 2] {
        let mut state = self.arrivals.state;
        let leaving = self.scatter_from(&mut state, arriving);
        self.arrivals.state = state;
        leaving
    }

    /// As [`scatter`](Self::scatter), with a state that is kept elsewhere.
    #[inline(always)]
    pub(super) fn scatter_from(&self, state: &mut [[F; N]; 2], arriving: [[F; N]; 2]) -> [[F; N]; 2] {
        let [left, right] = self.arrivals.lose_from(state, arriving);
        let (mut down, mut back) = ([F::default(); N], [F::default(); N]);
        for k in 0..N {
            let difference = left[k] - right[k];
            down[k] = right[k] + self.weight[k] * difference;
            back[k] = down[k] - difference;
        }
        [down, back]
    }
}

/// Tone holes.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Holes<F, const N: usize = LANES> {
    pub(super) arrivals: Arrivals<F, N>,
    pub(super) y_left: [F; N],
    pub(super) y_right: [F; N],
    pub(super) y_sum: [F; N],
    pub(super) r1: [F; N],
    pub(super) minus_r1: [F; N],
    pub(super) gc: [F; N],
    pub(super) minus_gc2: [F; N],
    pub(super) gl2: [F; N],
    pub(super) outside: [F; N],
    pub(super) rs0: [F; N],
    /// Jet resistance per flow of the open hole, and as it stands.
    pub(super) jet_open: [F; N],
    pub(super) jet: [F; N],
    /// Openings, 0 closed ..= 1 open, and their change per sample, 0 at rest. No opening leaves its `range` (low, high): the
    /// way from where the hole began to where it goes.
    pub(super) opening: [F; N],
    glide: [F; N],
    range: [[F; N]; 2],
    /// Squares of the openings.
    area: [F; N],
    pub(super) resistance: [F; N],
    pub(super) outer: [F; N],
    pub(super) compliance: [F; N],
    pub(super) inner: [F; N],
}

impl<F: Real, const N: usize> Holes<F, N> {
    /// Lanes without a hole.
    pub(super) fn idle() -> Self {
        let none = [F::default(); N];
        Self {
            arrivals: Arrivals::idle(),
            y_left: none,
            y_right: none,
            y_sum: [F::of(1.0); N],
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

    /// Puts the hole at a junction into lane `k`, closed.
    pub(super) fn place(&mut self, k: usize, coeffs: &LatticeCoeffs, junction: usize) {
        let hole = &coeffs.holes[coeffs.hole_junctions.partition_point(|&hole| hole < junction)];
        let (y_left, y_right) = (coeffs.admittance[junction], coeffs.admittance[junction + 1]);
        self.arrivals.place(k, coeffs, junction);
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

    /// Lane `k` and one of others change places.
    pub(super) fn swap(&mut self, k: usize, others: &mut Self, other: usize) {
        for (own, others) in self.all_lanes().into_iter().zip(others.all_lanes()) {
            std::mem::swap(&mut own[k], &mut others[other]);
        }
    }

    /// Two lanes change places.
    pub(super) fn swap_within(&mut self, k: usize, other: usize) {
        self.all_lanes().into_iter().for_each(|lanes| lanes.swap(k, other));
    }

    /// All that lanes hold.
    fn all_lanes(&mut self) -> [&mut [F; N]; 27] {
        let Arrivals { taken: [taken_left, taken_right], q: [q_left, q_right], state: [left, right] } =
            &mut self.arrivals;
        let [low, high] = &mut self.range;
        [
            taken_left,
            taken_right,
            q_left,
            q_right,
            left,
            right,
            &mut self.y_left,
            &mut self.y_right,
            &mut self.y_sum,
            &mut self.r1,
            &mut self.minus_r1,
            &mut self.gc,
            &mut self.minus_gc2,
            &mut self.gl2,
            &mut self.outside,
            &mut self.rs0,
            &mut self.jet_open,
            &mut self.jet,
            &mut self.opening,
            &mut self.glide,
            low,
            high,
            &mut self.area,
            &mut self.resistance,
            &mut self.outer,
            &mut self.compliance,
            &mut self.inner,
        ]
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
        let step = F::of((opening - from.wide()) / samples.max(1) as f64);
        if from + step == from {
            // Less than the last digit: it would never arrive.
            return self.set_opening(k, opening);
        }
        self.glide[k] = step;
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

    /// Stops the holes that have arrived, and is true if a hole is on its way. Seldom called, hence not inlined: it would
    /// crowd the loop over samples.
    #[inline(never)]
    pub(super) fn rest(&mut self) -> bool {
        for k in 0..N {
            let going_up = self.glide[k] > F::default();
            let there = self.opening[k] == self.range[usize::from(going_up)][k];
            self.glide[k] = if there { F::default() } else { self.glide[k] };
        }
        self.glide != [F::default(); N]
    }

    /// Lane `k` moves as lane `from` of others does.
    pub(super) fn move_as<const M: usize>(&mut self, k: usize, others: &Holes<F, M>, from: usize) {
        self.arrive_as(k, others, from);
        self.jet_open[k] = others.jet_open[from];
        self.glide[k] = others.glide[from];
        for (own, other) in self.range.iter_mut().zip(&others.range) {
            own[k] = other[from];
        }
    }

    /// The hole in lane `k` is where lane `from` of others is.
    pub(super) fn arrive_as<const M: usize>(&mut self, k: usize, others: &Holes<F, M>, from: usize) {
        (self.opening[k], self.area[k], self.jet[k]) =
            (others.opening[from], others.area[from], others.jet[from]);
    }

    /// Holes on their way move on by a sample.
    ///
    /// A hole opened by `a` passes its jet through `a^2` of its area (its mass, too, is 1 / a^2 of the open one's). Seen
    /// behind the transformer the loss is then 1 / a^2 of the open hole's: it is what quietens the air column when the
    /// fingers leave many holes at once. Held below a bound where no air passes anyway. It follows the opening in each
    /// sample: in a slur it changes by up to a third within a control tick, and such steps clicked.
    #[inline(always)]
    pub(super) fn glide(&mut self) {
        let [low, high] = &self.range;
        for k in 0..N {
            let next = self.opening[k] + self.glide[k];
            let next = if next < low[k] { low[k] } else { next };
            let next = if next > high[k] { high[k] } else { next };
            let area = next * next;
            self.opening[k] = next;
            self.area[k] = area;
            self.jet[k] = self.jet_open[k] / (area + F::of(0.02) * (F::of(1.0) - area));
        }
    }

    /// Whether the hole in lane `k` is closed, at rest, and nothing flows outside any more: what [`Shut`] takes for granted.
    pub(super) fn is_shut(&self, k: usize) -> bool {
        let is_still = self.outer[k].wide().to_bits() == 0 && self.resistance[k] == self.rs0[k];
        is_still && !self.is_open(k)
    }

    /// What changes in lanes that are all [shut](Self::is_shut).
    #[inline(always)]
    pub(super) fn still(&self) -> Still<F, N> {
        Still { arrivals: self.arrivals.state, compliance: self.compliance, inner: self.inner }
    }

    /// Takes over what has changed in lanes that are all shut.
    #[inline(always)]
    pub(super) fn stay(&mut self, still: Still<F, N>) {
        (self.arrivals.state, self.compliance, self.inner) = (still.arrivals, still.compliance, still.inner);
    }

    /// As [`scatter`](Self::scatter) for lanes that are all [shut](Self::is_shut), to the bit: nothing leaves outside.
    #[inline(always)]
    pub(super) fn scatter_shut(
        &self,
        still: &mut Still<F, N>,
        shut: &Shut<F, N>,
        arriving: [[F; N]; 2],
    ) -> [[F; N]; 2] {
        let [left, right] = self.arrivals.lose_from(&mut still.arrivals, arriving);
        let [mut down, mut back] = [[F::default(); N]; 2];
        for k in 0..N {
            let (gp, w, inner) = (self.gc[k], shut.w[k], still.inner[k]);
            // What flows outside is a positive zero, which takes the sign from a negative one.
            let source = still.compliance[k] + F::default() - gp * inner;
            let arriving = self.y_left[k] * left[k] + self.y_right[k] * right[k];
            let p = (arriving * w - source) / shut.divisor[k];
            let rise = shut.rise[k] * (gp * p + source);
            let node = p - inner + rise;
            still.compliance[k] = self.minus_gc2[k] * node - still.compliance[k];
            still.inner[k] = rise + rise - inner;
            down[k] = p - right[k];
            back[k] = p - left[k];
        }
        [down, back]
    }

    /// The network of [`tone_hole`](crate::bore::tone_hole), one sample: waves that arrive from left and right leave downwards
    /// and back, and flows leave outside.
    #[inline(always)]
    pub(super) fn scatter(&mut self, [left, right]: [[F; N]; 2]) -> ([[F; N]; 2], [F; N]) {
        let left = self.arrivals.lose::<0>(left);
        let right = self.arrivals.lose::<1>(right);
        let one = F::of(1.0);
        let [mut down, mut back, mut radiated] = [[F::default(); N]; 3];
        for k in 0..N {
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
        ([down, back], radiated)
    }
}

/// What changes in shut holes.
pub(super) struct Still<F, const N: usize> {
    arrivals: [[F; N]; 2],
    compliance: [F; N],
    inner: [F; N],
}

/// What closed holes have in common with themselves: results of [`Holes::scatter`] that do not change while they are shut.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Shut<F, const N: usize> {
    w: [F; N],
    /// Of the pressure at the junction.
    divisor: [F; N],
    /// Of the pressure over the inner mass.
    rise: [F; N],
}

impl<F: Real, const N: usize> Shut<F, N> {
    pub(super) fn new(holes: &Holes<F, N>) -> Self {
        let w = std::array::from_fn(|k| F::of(1.0) + holes.gc[k] * holes.r1[k]);
        let divisor = std::array::from_fn(|k| holes.y_sum[k] * w[k] + holes.gc[k]);
        Self { w, divisor, rise: std::array::from_fn(|k| holes.minus_r1[k] / w[k]) }
    }
}
