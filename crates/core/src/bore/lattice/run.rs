//! The samples of a run.
//!
//! Changes of section go on for two samples at once, where no wave gets to them or to the ends sooner: then places are found once
//! for both, and the second row of a pair lies right behind the first. Tone holes are nearer to each other.

use super::junctions::{Chunk, Steps, gather, leave};
use super::real::Real;
use super::{
    BACK, END_SLOT, EndLoss, HoleChunk, HoleFlows, LANES, Lattice, MAX_CHUNKS, Ring, STRIDE, TUNED_SLOT, Tip,
};

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
pub(super) fn run_avx2<F: Real, T: Tip<F>, const MASK: u16>(
    lattice: &mut Lattice<F>,
    samples: usize,
    tip: &mut T,
) {
    run_body::<F, T, MASK>(lattice, samples, tip);
}

#[inline(always)]
pub(super) fn run_body<F: Real, T: Tip<F>, const MASK: u16>(
    lattice: &mut Lattice<F>,
    samples: usize,
    tip: &mut T,
) {
    let moving = lattice.moved;
    if moving {
        lattice.rest();
    }
    let mask = if MASK == 0 { lattice.mask } else { MASK };
    let last_row = mask & !(STRIDE as u16 - 1);
    let mut ends = Ends::of(lattice, samples);
    let in_pairs = lattice.layout.in_pairs && ends.least > 1;
    let (mut base, mut left) = (lattice.base, samples);
    let (ring, steps, holes) = (&mut *lattice.ring, &mut *lattice.steps, &mut *lattice.holes);
    while left > 0 {
        base = base.wrapping_add(STRIDE as u16) & last_row;
        let is_first = base == 0;
        if in_pairs && left > 1 && base != last_row {
            advance::<F, T, 2>((ring, steps, holes), &mut ends, (base, mask), moving, tip);
            base += STRIDE as u16;
            left -= 2;
        } else {
            advance::<F, T, 1>((ring, steps, holes), &mut ends, (base, mask), moving, tip);
            left -= 1;
        }
        if is_first {
            ring.copy_within(..STRIDE, usize::from(mask) + 1);
        }
    }
    lattice.base = base;
    ends.stay(lattice);
    tip.ended(&lattice.hole_lanes);
}

/// Both ends of the bore and the tuning delay in a run: by themselves, so that the compiler need not put them back for each sample.
struct Ends<F> {
    tip: EndLoss<F>,
    end: EndLoss<F>,
    bell_y: F,
    bell_y2: F,
    bell_share: F,
    bell_g2: F,
    bell_state: F,
    tuned_source: u16,
    delay: F,
    glide: F,
    /// The delay crosses a row, so that its whole rows must be found anew in each sample.
    crossing: bool,
    /// Whole rows of the delay, where the wave is that has taken so many, and the wave a row before it.
    whole: F,
    place: u16,
    before: F,
    /// Fewest whole rows of the delay.
    least: u16,
}

/// Whole rows of a delay. Rounding may take a delay that ends at one row, the shortest, below it; the wave of this row is not
/// there yet.
#[inline(always)]
fn rows_of<F: Real>(delay: F) -> u16 {
    delay.whole().max(1)
}

impl<F: Real> Ends<F> {
    #[inline(always)]
    fn of(lattice: &Lattice<F>, samples: usize) -> Self {
        let (delay, glide) = (lattice.delay, lattice.delay_glide);
        // The delay goes one way, so that its ends tell whether it crosses a row.
        let mut last = delay;
        for _ in 0..samples {
            last = last + glide;
        }
        let (first, last) = (rows_of(delay + glide), rows_of(last));
        let place = lattice.tuned_source.wrapping_sub(first.wrapping_mul(STRIDE as u16));
        Self {
            tip: lattice.tip,
            end: lattice.end,
            bell_y: lattice.bell_y,
            bell_y2: lattice.bell_y2,
            bell_share: lattice.bell_share,
            bell_g2: lattice.bell_g2,
            bell_state: lattice.bell_state,
            tuned_source: lattice.tuned_source,
            delay,
            glide,
            crossing: first != last,
            whole: F::from(first),
            place,
            before: lattice.ring[usize::from(lattice.base.wrapping_add(place) & lattice.mask)],
            least: first.min(last),
        }
    }

    /// Gives back what has changed.
    #[inline(always)]
    fn stay(self, lattice: &mut Lattice<F>) {
        lattice.tip.state = self.tip.state;
        lattice.end.state = self.end.state;
        lattice.bell_state = self.bell_state;
        lattice.delay = self.delay;
    }

    /// One sample, into the row that begins at `base`.
    #[inline(always)]
    fn advance<T: Tip<F>>(&mut self, ring: &mut Ring<F>, base: u16, mask: u16, tip: &mut T) {
        // The returning wave of the tuned cell, delayed by whole rows and a linear part between two.
        self.delay = self.delay + self.glide;
        if self.crossing {
            let whole = rows_of(self.delay);
            self.whole = F::from(whole);
            self.place = self.tuned_source.wrapping_sub(whole.wrapping_mul(STRIDE as u16));
            let far = self.place.wrapping_sub(STRIDE as u16);
            self.before = ring[usize::from(base.wrapping_add(far) & mask)];
        }
        let near = ring[usize::from(base.wrapping_add(self.place) & mask)];
        let wave = near + (self.delay - self.whole) * (self.before - near);
        self.before = near;
        ring[usize::from(base | TUNED_SLOT as u16)] = wave;

        let p_minus = self.tip.take(ring, base, mask);
        ring[usize::from(base | END_SLOT as u16)] = tip.reflect(p_minus);

        // The open end: radiation conductance and mass in parallel.
        let arriving = self.end.take(ring, base, mask);
        let p_end = (self.bell_y2 * arriving - self.bell_state) * self.bell_share;
        self.bell_state = self.bell_state + self.bell_g2 * p_end;
        let reflected = p_end - arriving;
        ring[usize::from(base | (BACK + END_SLOT) as u16)] = reflected;
        tip.radiated(self.bell_y * (arriving - reflected));
    }
}

/// The ring, and all junctions.
type Parts<'a, F> = (&'a mut Ring<F>, &'a mut [Chunk<Steps<F>>], &'a mut [HoleChunk<F>]);

/// One sample or two, into the rows from `base` on.
///
/// What is done twice stands here twice: before a loop of two rounds, the compiler would copy all that the reed needs.
#[inline(always)]
fn advance<F: Real, T: Tip<F>, const COUNT: usize>(
    (ring, steps, holes): Parts<F>,
    ends: &mut Ends<F>,
    (base, mask): (u16, u16),
    moving: bool,
    tip: &mut T,
) {
    let is_pair = COUNT == 2;
    let next = base.wrapping_add(STRIDE as u16);
    ends.advance(ring, base, mask, tip);
    if is_pair {
        ends.advance(ring, next, mask, tip);
    }
    let step_slots = (steps.len() * LANES) as u16;
    let rows = (base, mask);
    match steps {
        // As many as most instruments have: written out, their places are known.
        [first, second] => {
            advance_steps::<F, COUNT>(ring, first, 0, rows);
            advance_steps::<F, COUNT>(ring, second, 1, rows);
        }
        _ => {
            for (chunk, steps) in steps.iter_mut().enumerate() {
                advance_steps::<F, COUNT>(ring, steps, chunk, rows);
            }
        }
    }
    pass(ring, holes, (base, mask, step_slots), moving, tip.holes(COUNT - 1));
    if is_pair {
        pass(ring, holes, (next, mask, step_slots), moving, tip.holes(0));
    }
}

/// A chunk of changes of section goes on for one sample or two.
#[inline(always)]
fn advance_steps<F: Real, const COUNT: usize>(
    ring: &mut Ring<F>,
    steps: &mut Chunk<Steps<F>>,
    chunk: usize,
    (base, mask): (u16, u16),
) {
    let [left, right] = &steps.sources.places(base, mask);
    let arriving = [gather::<F, 0>(ring, left), gather::<F, 0>(ring, right)];
    if COUNT == 2 {
        let second = [gather::<F, 1>(ring, left), gather::<F, 1>(ring, right)];
        leave(ring, base, chunk, &steps.scatter(arriving));
        leave(ring, base.wrapping_add(STRIDE as u16), chunk, &steps.scatter(second));
    } else {
        leave(ring, base, chunk, &steps.scatter(arriving));
    }
}

/// The holes go on for a sample.
#[inline(always)]
fn pass<F: Real>(
    ring: &mut Ring<F>,
    holes: &mut [HoleChunk<F>],
    (base, mask, first_slot): (u16, u16, u16),
    moving: bool,
    flows: Option<&mut HoleFlows<F>>,
) {
    if moving {
        holes.iter_mut().filter(|holes| !holes.is_shut).for_each(|holes| holes.glide());
    }
    let mut unheard = HoleFlows::default();
    let flows = flows.unwrap_or(&mut unheard);
    let places = (base, mask, first_slot);
    match holes {
        // As many as most instruments have: written out, their places are known.
        [first, second, third] => {
            pass_chunk(ring, first, 0, places, flows);
            pass_chunk(ring, second, 1, places, flows);
            pass_chunk(ring, third, 2, places, flows);
        }
        // No lattice has more than `MAX_CHUNKS`; to say so spares a check of `flows`.
        _ => {
            for (chunk, holes) in holes.iter_mut().take(MAX_CHUNKS).enumerate() {
                pass_chunk(ring, holes, chunk, places, flows);
            }
        }
    }
}

/// A chunk of holes goes on for a sample.
#[inline(always)]
fn pass_chunk<F: Real>(
    ring: &mut Ring<F>,
    holes: &mut HoleChunk<F>,
    chunk: usize,
    (base, mask, first_slot): (u16, u16, u16),
    flows: &mut HoleFlows<F>,
) {
    let leaving;
    (leaving, flows[chunk]) = holes.scatter(ring, base, mask);
    leave(ring, base + first_slot, chunk, &leaving);
}
