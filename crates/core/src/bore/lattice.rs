//! The bore in the time domain: travelling waves between junctions on a half-sample grid.
//!
//! Junctions stand at whole ticks of half a sample, so one way along a cell of `d` ticks takes `d / 2` samples. Only
//! the round trip, `d` samples, must be right: each cell gives `f` rows to the wave going down and `d - f` to the wave
//! coming back, `f` as near to `d / 2` as whole rows allow. The rounding is carried along the bore, so no junction is
//! more than half a sample off its true time and what the holes radiate may be summed row by row. Every filter runs at
//! the sample rate; positions resolve to half of it (1.8 mm at 96 kHz).
//!
//! All junctions are processed eight at a time from one ring of past rows, as long as the longest cell and the tuning
//! delay need (32 rows for a B flat clarinet at 96 kHz), plain loops over arrays that the compiler
//! turns into vectors. The same source runs with SSE2 or AVX2 and gives the same bits: no fused multiply-add, sums in
//! fixed lanes. Holes begin round robin in their chunks; two holes one tick apart then lie in different chunks, and the
//! chunk evaluated first passes its wave on within the row. A chunk whose holes are all shut costs less, so while fingers rest
//! the shut ones come together (`layout`).
//!
//! After van Walstijn & Campbell 2003 (wave digital tone holes) and Kelly & Lochbaum 1962; the network of a hole is in
//! `bore::tone_hole`, losses in `bore::wall_loss`.
//!
//! Pressures over a reference pressure P, flows over P / Zc with Zc of the instrument's nominal bore.

pub mod choir;
mod coeffs;
mod diagnostics;
mod junctions;
mod layout;
mod real;
mod run;
#[cfg(feature = "fit")]
pub mod sensitivity;

pub use coeffs::{LatticeCoeffs, hole_chunks};
pub use real::Real;

use std::ops::{Deref, DerefMut};

use crate::dsp::lanes::has_avx2;
use junctions::{Chunk, Holes, Octet, Shut, Steps, flush};
use layout::Layout;

/// Junctions processed together.
pub const LANES: usize = 8;
/// Values of one row: 64 waves going down, 64 coming back.
const STRIDE: usize = 128;
/// Most values the ring can hold: every 16-bit index lies inside, so no access needs a check. Only the rows an instrument
/// needs are ever touched.
const SPACE: usize = 1 << 16;
/// Behind the rows in use stands the first one again: so the row that follows any row lies behind it.
type Ring<F> = [F; SPACE + STRIDE];
/// Fewest and most past rows the ring holds; a power of two.
const ROWS: (u32, u32) = (32, (SPACE / STRIDE) as u32);
/// Masks of the two shortest rings.
const LEAST_MASK: u16 = (ROWS.0 as usize * STRIDE - 1) as u16;
const NEXT_MASK: u16 = 2 * LEAST_MASK + 1;
/// Where a lane's returning wave is kept in a row.
const BACK: usize = 64;
/// Slot of the wave leaving the reed (among those going down) and of the bell's reflection (among those returning).
const END_SLOT: usize = 63;
/// Slot of the wave that has passed the tuning delay.
const TUNED_SLOT: usize = BACK + 62;
/// Slot that nobody writes, for lanes without a junction.
const IDLE_SLOT: usize = 61;
/// Longest cell, ticks: twice its half must fit the largest ring, because a tuned cell may be made twice as long.
pub const MAX_TICKS: u32 = ROWS.1 - 8;
/// Most tone holes and most changes of section together: lanes of seven groups of eight, of which holes and steps fill
/// whole ones each.
pub const MAX_CHUNKS: usize = 7;
/// Strength K of the jet's loss in open holes with sharp edges (Dalmont, Nederveen et al. 2002), at which the bundled instruments are tuned.
pub const JET_LOSS_REFERENCE: f64 = 2.0;
/// States below this are set to 0, so that no denormal number slows a held note.
pub const TINY: f64 = 1e-18;

/// Volume flows leaving through holes in one sample, by chunk and lane, see [`Tip::ended`]. A power of two chunks, one more than there may be: so it costs no multiplication to find a row of them.
pub type HoleFlows<F> = [[F; LANES]; MAX_CHUNKS.next_power_of_two()];

/// The reed end of the bore: takes the arriving wave, gives the leaving one, and is told what radiates.
///
/// Implementations mark all `#[inline(always)]` so that they are compiled with the lattice's vector features.
pub trait Tip<F> {
    /// Wave leaving into the bore, for the wave arriving from it.
    fn reflect(&mut self, p_minus: F) -> F;
    /// The volume flow that leaves through the bell in the same sample.
    #[inline(always)]
    fn radiated(&mut self, _bell: F) {}
    /// Room for the volume flows that leave through the holes in the latest sample, or in one before; none if they are not asked for.
    /// A lane without a hole gets 0, a chunk without holes nothing.
    #[inline(always)]
    fn holes(&mut self, _before: usize) -> Option<&mut HoleFlows<F>> {
        None
    }
    /// The last sample of a [`run`](Lattice::run) is done. In all of its samples, the flows of each hole, in the order of the
    /// file, were in this chunk and lane.
    #[inline(always)]
    fn ended(&mut self, _holes: &[(usize, usize)]) {}
}

/// A tip that is asked through a table of its functions.
struct Asked<'a, F>(&'a mut dyn Tip<F>);

impl<F> Tip<F> for Asked<'_, F> {
    #[inline(always)]
    fn reflect(&mut self, p_minus: F) -> F {
        self.0.reflect(p_minus)
    }

    #[inline(always)]
    fn radiated(&mut self, bell: F) {
        self.0.radiated(bell);
    }

    #[inline(always)]
    fn holes(&mut self, before: usize) -> Option<&mut HoleFlows<F>> {
        self.0.holes(before)
    }

    #[inline(always)]
    fn ended(&mut self, holes: &[(usize, usize)]) {
        self.0.ended(holes);
    }
}

/// The playing lattice: state, and the coefficients that move with the fingers.
#[derive(Clone)]
pub struct Lattice<F> {
    ring: Box<Ring<F>>,
    /// Part of the ring in use, less one: indices wrap with it.
    mask: u16,
    steps: Box<[Chunk<Steps<F>>]>,
    holes: Box<[HoleChunk<F>]>,
    /// Chunk and lane of each hole.
    hole_lanes: Box<[(usize, usize)]>,
    layout: Layout,
    jets: Box<[f64]>,
    /// Where the present row begins in the ring.
    base: u16,
    tip: EndLoss<F>,
    end: EndLoss<F>,
    bell_y: F,
    bell_y2: F,
    bell_share: F,
    bell_g2: F,
    bell_state: F,
    tuned_source: u16,
    tuned_rows: u16,
    /// Rows the returning wave of the tuned cell takes, and their change per row.
    delay: F,
    delay_glide: F,
    /// Samples until the delay has arrived; 0 while it rests.
    delay_left: usize,
    /// Openings or jets have changed since they were last matched.
    moved: bool,
    /// A lane of a [choir](choir::LatticeChoir) has the waves.
    lent: bool,
    avx2: bool,
}

/// Eight tone holes.
#[derive(Clone)]
#[repr(C)]
struct HoleChunk<F> {
    junctions: Chunk<Holes<F>>,
    shut: Shut<F, LANES>,
    /// All are shut.
    is_shut: bool,
}

impl<F> Deref for HoleChunk<F> {
    type Target = Holes<F>;

    #[inline(always)]
    fn deref(&self) -> &Holes<F> {
        &self.junctions.lanes
    }
}

impl<F> DerefMut for HoleChunk<F> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut Holes<F> {
        &mut self.junctions.lanes
    }
}

impl<F: Real> HoleChunk<F> {
    fn new(junctions: Chunk<Holes<F>>) -> Self {
        let shut = Shut::new(&junctions.lanes);
        Self { junctions, shut, is_shut: false }
    }

    /// Other holes may be in the lanes.
    fn heed(&mut self) {
        self.shut = Shut::new(self);
        self.is_shut = (0..LANES).all(|k| self.junctions.lanes.is_shut(k));
    }

    /// One sample: waves that leave downwards and back, and flows.
    #[inline(always)]
    fn scatter(&mut self, ring: &Ring<F>, base: u16, mask: u16) -> ([Octet<F>; 2], Octet<F>) {
        let Self { junctions: Chunk { sources, lanes }, shut, is_shut } = self;
        if *is_shut {
            // In another order than below: otherwise the compiler takes both gathers together, and loads that could be operands
            // become instructions.
            let right = sources.gather::<F, 1>(ring, base, mask);
            let left = sources.gather::<F, 0>(ring, base, mask);
            let mut still = lanes.still();
            let leaving = lanes.scatter_shut(&mut still, shut, [left, right]);
            lanes.stay(still);
            return (leaving, Octet::default());
        }
        let left = sources.gather::<F, 0>(ring, base, mask);
        let right = sources.gather::<F, 1>(ring, base, mask);
        lanes.scatter([left, right])
    }
}

#[derive(Clone, Copy)]
struct EndLoss<F> {
    offset: u16,
    taken: F,
    q: F,
    state: F,
}

impl<F: Real> EndLoss<F> {
    #[inline(always)]
    fn take(&mut self, ring: &Ring<F>, base: u16, mask: u16) -> F {
        let wave = ring[usize::from(base.wrapping_add(self.offset) & mask)];
        let difference = wave - self.state;
        self.state = self.state + self.q * difference;
        wave - self.taken * difference
    }
}

fn back_rows(rows: u32, slot: usize) -> u16 {
    (slot as u16).wrapping_sub(rows as u16 * STRIDE as u16)
}

/// An opening within its range; closed is never a negative zero, which would change signs of zeros.
fn held_opening(opening: f64) -> f64 {
    opening.clamp(0.0, 1.0) + 0.0
}

/// Chunks of changes of section, and of tone holes.
type Chunks<F> = (Box<[Chunk<Steps<F>>]>, Box<[HoleChunk<F>]>);

/// All chunks of a lattice, silent, each junction in its lane, but not yet [connected](Lattice::connect).
fn junction_chunks<F: Real>(coeffs: &LatticeCoeffs) -> Chunks<F> {
    let junctions = coeffs.ticks.len() - 1;
    let mut steps = vec![Chunk::idle(Steps::idle(), IDLE_SLOT); coeffs.step_chunks()];
    let mut holes = vec![Chunk::idle(Holes::idle(), IDLE_SLOT); coeffs.hole_chunks()];
    for junction in 0..junctions {
        let lane = coeffs.lane_of(junction);
        let (chunk, k) = (lane / LANES, lane % LANES);
        match chunk.checked_sub(steps.len()) {
            None => steps[chunk].place(k, coeffs, junction),
            Some(chunk) => holes[chunk].place(k, coeffs, junction),
        }
    }
    (steps.into(), holes.into_iter().map(HoleChunk::new).collect())
}

/// A ring of zeros whose first `mask + 1` values are in memory; `other` is any other value.
fn silent_ring<T: Copy>(mask: u16, zero: T, other: T) -> Box<Ring<T>> {
    // PANIC: the vector has exactly as many elements as the ring.
    let mut ring: Box<Ring<T>> =
        vec![zero; SPACE + STRIDE].into_boxed_slice().try_into().unwrap_or_else(|_| unreachable!());
    // The system only promises fresh memory. Writing it here makes sure that it is there before the audio thread reads it.
    for value in [other, zero] {
        ring[..=usize::from(mask) + STRIDE].fill(value);
        std::hint::black_box(&mut ring);
    }
    ring
}

impl<F: Real> Lattice<F> {
    /// A silent lattice with all holes closed. Allocates.
    pub fn new(coeffs: &LatticeCoeffs) -> Self {
        let junctions = coeffs.ticks.len() - 1;
        let (steps, holes) = junction_chunks(coeffs);
        let tuned = coeffs.tuned_cell();
        let end = |cell: usize| EndLoss {
            offset: 0,
            taken: F::of(coeffs.loss[cell].0 * (1.0 - coeffs.loss[cell].1)),
            q: F::of(coeffs.loss[cell].1),
            state: F::default(),
        };
        let bell_y = coeffs.admittance[junctions];
        let mask = (coeffs.ring_rows() * STRIDE as u32 - 1) as u16;
        let mut lattice = Self {
            ring: silent_ring(mask, F::default(), F::of(1.0)),
            mask,
            steps,
            holes,
            hole_lanes: coeffs.hole_slots().collect(),
            layout: Layout::new(coeffs),
            jets: coeffs.jets.clone().into(),
            base: mask & !(STRIDE as u16 - 1),
            tip: end(0),
            end: end(junctions),
            bell_y: F::of(bell_y),
            bell_y2: F::of(2.0 * bell_y),
            bell_share: F::of(1.0 / (bell_y + coeffs.bell.0 + coeffs.bell.1)),
            bell_g2: F::of(2.0 * coeffs.bell.1),
            bell_state: F::default(),
            tuned_source: 0,
            tuned_rows: coeffs.rows(tuned).1 as u16,
            delay: F::of(f64::from(coeffs.rows(tuned).1)),
            delay_glide: F::default(),
            delay_left: 0,
            moved: true,
            lent: false,
            avx2: has_avx2(),
        };
        lattice.connect();
        lattice
    }

    /// Past rows the ring holds.
    fn rows(&self) -> u32 {
        u32::from(self.mask / STRIDE as u16) + 1
    }

    /// Back to the beginning: silence, all holes closed, the tuning delay at 0; the loss of the jets stays. Real-time safe.
    pub fn reset(&mut self) {
        self.silence();
        for hole in 0..self.hole_lanes.len() {
            self.set_opening(hole, 0.0);
        }
        self.glide_delay(0.0, 0);
    }

    /// Takes all waves away; openings, delay and what moves them stay. Real-time safe.
    pub fn silence(&mut self) {
        self.ring[..=usize::from(self.mask) + STRIDE].fill(F::default());
        self.steps.iter_mut().for_each(|steps| steps.arrivals.state = Default::default());
        for holes in &mut *self.holes {
            let holes = &mut holes.junctions.lanes;
            holes.arrivals.state = Default::default();
            holes.resistance = holes.rs0;
            for state in [&mut holes.outer, &mut holes.compliance, &mut holes.inner] {
                *state = Octet::default();
            }
        }
        self.tip.state = F::default();
        self.end.state = F::default();
        self.bell_state = F::default();
        // The next row is the first.
        self.base = self.mask & !(STRIDE as u16 - 1);
        self.lent = false;
    }

    /// Use the plain code path even where AVX2 is there (to prove that both give the same bits).
    pub fn without_avx2(mut self) -> Self {
        self.avx2 = false;
        self
    }

    /// Opening of a hole, 0 closed ..= 1 open, at once. Real-time safe.
    pub fn set_opening(&mut self, hole: usize, opening: f64) {
        let (chunk, lane) = self.hole_lanes[hole];
        self.holes[chunk].set_opening(lane, held_opening(opening));
        self.holes[chunk].is_shut = false;
        self.moved = true;
    }

    /// Starts a hole towards an opening, 0..=1, where it arrives after `samples` and rests. Real-time safe.
    pub fn glide_opening(&mut self, hole: usize, opening: f64, samples: usize) {
        let (chunk, lane) = self.hole_lanes[hole];
        self.holes[chunk].glide_opening(lane, held_opening(opening), samples);
        self.holes[chunk].is_shut = false;
        self.moved = true;
    }

    /// Pushes air into the chimney of a hole: a volume flow during one sample. The chimney's spring holds what has been pushed until
    /// it flows on. Real-time safe.
    pub fn push(&mut self, hole: usize, flow: f64) {
        let (chunk, lane) = self.hole_lanes[hole];
        let state = &mut self.holes[chunk].compliance[lane];
        // By the trapezoidal rule a flow acts half in the sample before and half in this one.
        *state = *state - F::of(2.0 * flow);
    }

    /// Opening of a hole now, 0 closed ..= 1 open.
    pub fn opening(&self, hole: usize) -> f64 {
        let (chunk, lane) = self.hole_lanes[hole];
        self.holes[chunk].opening[lane].wide()
    }

    /// Whether a hole is open at all, or on its way there.
    pub fn is_open(&self, hole: usize) -> bool {
        let (chunk, lane) = self.hole_lanes[hole];
        self.holes[chunk].is_open(lane)
    }

    /// Whether a hole is on its way.
    pub fn is_gliding(&self, hole: usize) -> bool {
        let (chunk, lane) = self.hole_lanes[hole];
        self.holes[chunk].is_gliding(lane)
    }

    /// Whether holes move, or have moved since the last [`run`](Self::run).
    pub fn is_moving(&self) -> bool {
        self.moved
    }

    /// Strength of the jet's loss in all holes: K, 0 (linear) ..= 4; [`JET_LOSS_REFERENCE`] is physical for sharp edges. Real-time safe.
    pub fn set_jet_loss(&mut self, k: f64) {
        for (&(chunk, lane), jet) in self.hole_lanes.iter().zip(&*self.jets) {
            self.holes[chunk].jet_open[lane] = F::of(k * jet);
        }
        self.moved = true;
    }

    /// Tuning delay, rows of the round trip, clamped to what the cell can give; it arrives after `samples` and rests, 0 for
    /// at once. Real-time safe.
    pub fn glide_delay(&mut self, rows: f64, samples: usize) {
        let rows = (rows + f64::from(self.tuned_rows)).clamp(1.0, f64::from(self.rows() - 2));
        self.delay_left = samples;
        if samples == 0 {
            self.delay = F::of(rows);
            self.delay_glide = F::default();
        } else {
            self.delay_glide = F::of((rows - self.delay.wide()) / samples as f64);
        }
    }

    /// Whether the delay arrives before the end of so many samples: then it rests for the others. Real-time safe.
    pub fn delay_arrives_within(&self, samples: usize) -> bool {
        (1..samples).contains(&self.delay_left)
    }

    /// Runs `samples` samples (a control tick) with `tip` at the reed end; holes that have arrived come to rest once a
    /// call. Real-time safe. [audio thread]
    pub fn run<T: Tip<F>>(&mut self, samples: usize, tip: &mut T) {
        self.in_parts(samples, tip, F::run_part);
    }

    /// The same for measurements: slower, because the tip is asked through a table of its functions, and compiled once for all of them. The
    /// same bits. Real-time safe.
    pub fn run_any(&mut self, samples: usize, tip: &mut dyn Tip<F>) {
        F::run_any(self, samples, tip);
    }

    /// Runs in parts, none of them further than to where the delay arrives.
    #[inline(always)]
    fn in_parts<T: Tip<F>>(&mut self, samples: usize, tip: &mut T, run: impl Fn(&mut Self, usize, &mut T)) {
        let mut left = samples;
        loop {
            // A delay that arrives on the way rests from there on.
            let part = if self.delay_arrives_within(left) { self.delay_left } else { left };
            run(self, part, tip);
            self.end_delay(part);
            left -= part;
            if left == 0 {
                return;
            }
        }
    }

    /// The delay has been on its way for so many samples.
    fn end_delay(&mut self, samples: usize) {
        self.delay_left = self.delay_left.saturating_sub(samples);
        if self.delay_left == 0 {
            self.delay_glide = F::default();
        }
    }

    /// Stops the holes that have arrived.
    #[inline(always)]
    fn rest(&mut self) {
        self.moved = self.holes.iter_mut().fold(false, |moving, holes| holes.rest() | moving);
    }

    /// `MASK` is that of the ring, 0 for any.
    #[inline(always)]
    fn run_masked<T: Tip<F>, const MASK: u16>(&mut self, samples: usize, tip: &mut T) {
        #[cfg(target_arch = "x86_64")]
        if self.avx2 {
            // The feature was checked when the lattice was built.
            #[allow(unsafe_code)]
            // SAFETY: `avx2` is only set where the processor has AVX2.
            unsafe {
                run::run_avx2::<F, T, MASK>(self, samples, tip)
            };
            return;
        }
        run::run_body::<F, T, MASK>(self, samples, tip);
    }

    /// Zeroes states too small to hear before they become denormal, and puts shut holes together while fingers rest. Call every few
    /// hundred samples. Real-time safe.
    pub fn flush(&mut self) {
        if self.lent {
            // Who has the waves does it.
            return;
        }
        self.flush_states();
        self.lay();
    }

    fn flush_states(&mut self) {
        // The slots of the junctions and those at the ends; nobody writes the others.
        let slots = LANES * (self.steps.len() + self.holes.len());
        for half_row in self.ring[..=usize::from(self.mask)].as_chunks_mut::<BACK>().0 {
            half_row[..slots].iter_mut().for_each(flush);
            half_row[BACK - LANES..].iter_mut().for_each(flush);
        }
        self.steps.iter_mut().for_each(|steps| steps.arrivals.flush());
        for holes in &mut *self.holes {
            let holes = &mut holes.junctions.lanes;
            holes.arrivals.flush();
            for state in [&mut holes.outer, &mut holes.compliance, &mut holes.inner] {
                state.iter_mut().for_each(flush);
            }
        }
        flush(&mut self.tip.state);
        flush(&mut self.end.state);
        flush(&mut self.bell_state);
        self.close_ring();
    }

    /// Has the first row stand behind the last one, too.
    #[inline(always)]
    fn close_ring(&mut self) {
        self.ring.copy_within(..STRIDE, usize::from(self.mask) + 1);
    }
}
