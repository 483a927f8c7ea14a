//! The last flows of all sources, to be heard later.

use crate::bore::lattice::{LANES, LatticeCoeffs, Real};
use crate::instrument::control_tick::TICK;
use crate::instrument::listening::MAX_SOURCES;

/// Room in each line for what comes, samples: so large that moving the rest costs little. Not a power of two, so that the
/// lines lie at different places of a cache.
const ROOM: usize = 1_040;

/// The last flows of each source, beside each other. When the lines are full, what can still be heard moves to their
/// beginning.
pub(super) struct Lines<F> {
    past: Box<[F]>,
    /// Longest delay, samples.
    pub(super) reach: usize,
    /// Where this tick stands in each line.
    at: usize,
    /// Place of each hole among the flows of a sample at first, in the order of the file: it says in which order flows are added.
    pub(super) slots: Box<[usize]>,
    /// Holes whose lines are not all 0.
    pub(super) active: [u16; MAX_SOURCES],
    pub(super) count: usize,
    /// Ticks until the lines of holes that have closed are all 0; 0 when they have been left out.
    emptying: u32,
}

impl<F: Real> Lines<F> {
    /// Silent lines that reach back so many samples. Allocates.
    pub(super) fn new(coeffs: &LatticeCoeffs, reach: usize) -> Self {
        let slots: Box<[usize]> = coeffs.hole_slots().map(|(chunk, lane)| chunk * LANES + lane).collect();
        let mut lines = Self {
            past: [].into(),
            reach,
            at: reach,
            slots,
            active: [0; MAX_SOURCES],
            count: 0,
            emptying: 0,
        };
        lines.past = vec![F::default(); (lines.slots.len() + 1) * lines.stride()].into();
        lines
    }

    /// From the beginning of one line to that of the next: what can be heard, and room for what comes.
    #[inline(always)]
    pub(super) fn stride(&self) -> usize {
        self.reach + ROOM
    }

    /// Ticks after which a line holds nothing of what it held.
    pub(super) fn ticks(&self) -> u32 {
        (self.stride() / TICK) as u32 + 1
    }

    /// The tick that `tap` hears.
    #[inline(always)]
    pub(super) fn tick(&self, tap: usize) -> Option<&[F; TICK]> {
        let begin = (tap + self.at).wrapping_sub(self.stride());
        self.past.get(begin..)?.first_chunk()
    }

    /// The sample that `tap` hears before the tick that is written next.
    pub(super) fn newest(&self, tap: usize) -> F {
        let next = (tap + self.at + TICK).wrapping_sub(self.stride());
        self.past.get(next.wrapping_sub(1)).copied().unwrap_or_default()
    }

    /// See [`Outside::heed`](super::Outside::heed).
    #[inline(always)]
    pub(super) fn heed(&mut self, moved: bool, is_open: impl Fn(usize) -> bool) {
        if moved {
            self.emptying = 0;
            self.keep(is_open);
        } else if self.emptying > 1 {
            self.emptying -= 1;
        } else if self.emptying == 1 {
            self.keep(is_open);
        }
    }

    /// Keeps the lines of the holes that are open now, and of those that have been until they are empty.
    fn keep(&mut self, is_open: impl Fn(usize) -> bool) {
        let mut kept = [false; MAX_SOURCES];
        if self.emptying != 1 {
            for &hole in &self.active[..self.count] {
                kept[usize::from(hole)] = true;
            }
        }
        self.count = 0;
        for (hole, kept) in kept.iter().enumerate().take(self.slots.len()) {
            if *kept || is_open(hole) {
                self.active[self.count] = hole as u16;
                self.count += 1;
            }
        }
        // The tick in which a hole closes, and then a whole line.
        self.emptying = if self.emptying == 1 { 0 } else { self.ticks() + 2 };
    }

    /// The flow of the bell and those of all holes, as `flow` gives them for their numbers, together. They are added in the same
    /// order wherever the holes are: nothing comes out of those that are not active.
    #[inline(always)]
    pub(super) fn add_up(&self, bell: F, flow: impl Fn(usize) -> F) -> F {
        let mut lanes = [F::default(); LANES];
        for &hole in self.active.get(..self.count).unwrap_or_default() {
            let Some(slot) = self.slots.get(usize::from(hole)) else { continue };
            let sum = &mut lanes[slot % LANES];
            *sum = *sum + flow(usize::from(hole));
        }
        lanes.into_iter().fold(bell, |sum, lane| sum + lane)
    }

    /// All flows of the sample before the tick that is written next, together.
    pub(super) fn together(&self) -> F {
        let newest = |number: usize| self.newest((number + 1) * self.stride());
        self.add_up(newest(self.slots.len()), newest)
    }

    /// Writes the flows of a tick: those of the bell, and those of a hole as `fill` gives them for its number.
    #[inline(always)]
    pub(super) fn write(&mut self, bell: &[F; TICK], fill: impl Fn(usize, &mut [F; TICK])) {
        self.at += TICK;
        if self.at + TICK > self.stride() {
            self.begin_again();
        }
        let (stride, at) = (self.stride(), self.at);
        for &hole in self.active.get(..self.count).unwrap_or_default() {
            let hole = usize::from(hole);
            let begin = hole * stride + at;
            if let Some(place) = self.past.get_mut(begin..).and_then(|past| past.first_chunk_mut::<TICK>()) {
                fill(hole, place);
            }
        }
        let begin = self.slots.len() * stride + at;
        if let Some(place) = self.past.get_mut(begin..begin + TICK) {
            place.copy_from_slice(bell);
        }
    }

    /// Moves what can still be heard to the beginning of the lines.
    #[inline(never)]
    fn begin_again(&mut self) {
        let (stride, heard) = (self.stride(), self.at - self.reach);
        for line in self.past.chunks_exact_mut(stride) {
            line.copy_within(heard..heard + self.reach, 0);
        }
        self.at = self.reach;
    }

    /// Silence.
    pub(super) fn clear(&mut self) {
        self.past.fill(F::default());
    }
}
