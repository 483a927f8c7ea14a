//! Which hole sits in which lane: shut holes come together while fingers rest.
//!
//! A chunk whose eight holes are all shut costs three quarters of one with an open hole in it. A fingering leaves most holes
//! shut, but round robin nearly every chunk has an open one. So when fingers rest, holes change lanes, with their states and the
//! waves that they have sent. What a hole computes does not depend on its lane, so the sound keeps its bits.

use super::coeffs::LatticeCoeffs;
use super::real::Real;
use super::{BACK, END_SLOT, IDLE_SLOT, LANES, Lattice, MAX_CHUNKS, STRIDE, TUNED_SLOT, back_rows};

/// Lanes for tone holes: as many holes can be laid out, more than a file may have.
const LAID_HOLES: usize = MAX_CHUNKS * LANES;

/// A chunk for each hole, in the order of the file.
type HoleChunks = [u8; LAID_HOLES];

/// A junction.
#[derive(Clone, Copy)]
enum Seat {
    /// A change of section, and its lane.
    Step(u16),
    /// The tone hole of this number.
    Hole(u16),
}

/// What does not change when holes change lanes.
#[derive(Clone)]
pub(super) struct Layout {
    /// Rows that each cell gives to the wave going down and to the one coming back.
    rows: Box<[(u32, u32)]>,
    tuned: usize,
    seats: Box<[Seat]>,
    /// Chunk and lane of each hole at first.
    first: Box<[(usize, usize)]>,
    /// Holes one tick apart: the first passes its wave on within the row, so its chunk must come before that of the second.
    hops: Box<[[u8; 2]]>,
    /// All holes: those with hops first, and each behind those whose chunks must come before its own.
    order: Box<[u8]>,
    chunks: usize,
    /// Changes of section and ends may go on for two samples at once: no wave gets there sooner.
    pub(super) in_pairs: bool,
}

impl Layout {
    /// Allocates.
    pub(super) fn new(coeffs: &LatticeCoeffs) -> Self {
        let rows: Box<[_]> = coeffs.all_rows().collect();
        let first: Box<[_]> = coeffs.hole_slots().collect();
        let seat = |junction: usize| match coeffs.hole_junctions.binary_search(&junction) {
            Ok(hole) => Seat::Hole(hole as u16),
            Err(_) => Seat::Step(coeffs.lane_of(junction) as u16),
        };
        let seats: Box<[_]> = (0..rows.len() - 1).map(seat).collect();
        let mut hops = Vec::new();
        for (pair, rows) in seats.windows(2).zip(&rows[1..]) {
            // All changes of section come before the holes in any case.
            if let &[Seat::Hole(left), Seat::Hole(right)] = pair {
                let [left, right] = [left as u8, right as u8];
                hops.extend((rows.0 == 0).then_some([left, right]));
                hops.extend((rows.1 == 0).then_some([right, left]));
            }
        }
        let mut order: Vec<u8> = (0..first.len() as u8).collect();
        order.sort_by_key(|hole| (!hops.as_flattened().contains(hole), first[usize::from(*hole)].0));
        // A cell between two holes may be shorter.
        let is_inner = |cell: usize| {
            cell > 0
                && seats
                    .get(cell - 1..=cell)
                    .is_some_and(|pair| matches!(pair, [Seat::Hole(_), Seat::Hole(_)]))
        };
        let in_pairs = rows.iter().enumerate().all(|(cell, rows)| rows.0.min(rows.1) > 1 || is_inner(cell));
        Self {
            in_pairs,
            rows,
            tuned: coeffs.tuned_cell(),
            seats,
            first,
            hops: hops.into(),
            order: order.into(),
            chunks: coeffs.hole_chunks(),
        }
    }

    /// Chunks for all holes in which more than `least` chunks have none but shut holes, and as many as can be.
    fn arrange(&self, is_shut: &[bool; LAID_HOLES], least: u32) -> Option<HoleChunks> {
        let open = is_shut.iter().take(self.first.len()).filter(|is_shut| !**is_shut).count();
        let most = (self.chunks - open.div_ceil(LANES).min(self.chunks)) as u32;
        (least + 1..=most).rev().find_map(|count| {
            let sets = (0..1_u32 << self.chunks).filter(|set| set.count_ones() == count);
            sets.into_iter().find_map(|set| self.fill(is_shut, set))
        })
    }

    /// Chunks for all holes, where the chunks of a set have none but shut holes; there may be none.
    fn fill(&self, is_shut: &[bool; LAID_HOLES], set: u32) -> Option<HoleChunks> {
        let (mut chunks, mut taken) = ([0; LAID_HOLES], [0; MAX_CHUNKS]);
        for &hole in &self.order {
            let before =
                self.hops.iter().filter(|hop| hop[1] == hole).map(|hop| chunks[usize::from(hop[0])] + 1);
            let least = usize::from(before.max().unwrap_or(0));
            let has_room = |for_shut: bool| {
                (least..self.chunks)
                    .find(|&chunk| taken[chunk] < LANES && (set >> chunk & 1 == 1) == for_shut)
            };
            let chunk = if is_shut[usize::from(hole)] {
                has_room(true).or(has_room(false))
            } else {
                has_room(false)
            }?;
            chunks[usize::from(hole)] = chunk as u8;
            taken[chunk] += 1;
        }
        Some(chunks)
    }
}

impl<F: Real> Lattice<F> {
    /// Lane of a junction now, among all.
    pub(super) fn lane_of(&self, junction: usize) -> usize {
        match self.layout.seats[junction] {
            Seat::Step(lane) => usize::from(lane),
            Seat::Hole(hole) => {
                let (chunk, k) = self.hole_lanes[usize::from(hole)];
                (self.steps.len() + chunk) * LANES + k
            }
        }
    }

    /// Has all junctions and ends take their waves from where the others are now.
    pub(super) fn connect(&mut self) {
        for holes in &mut self.holes {
            holes.junctions.sources.offset = [[IDLE_SLOT as u16; LANES]; 2];
        }
        let last = self.layout.seats.len();
        for junction in 0..last {
            let [from_left, from_right] = self.sources_of(junction);
            let lane = self.lane_of(junction);
            let (chunk, k) = (lane / LANES, lane % LANES);
            let sources = match chunk.checked_sub(self.steps.len()) {
                None => &mut self.steps[chunk].sources,
                Some(chunk) => &mut self.holes[chunk].junctions.sources,
            };
            (sources.offset[0][k], sources.offset[1][k]) = (from_left, from_right);
        }
        let rows = &self.layout.rows;
        self.tip.offset = back_rows(rows[0].1, BACK + self.lane_of(0));
        self.end.offset = back_rows(rows[last].0, self.lane_of(last - 1));
        let tuned = self.layout.tuned;
        self.tuned_source = (BACK + if tuned == last { END_SLOT } else { self.lane_of(tuned) }) as u16;
    }

    /// Where the waves that arrive at a junction from left and right come from, from the beginning of the present row.
    fn sources_of(&self, junction: usize) -> [u16; 2] {
        let Layout { rows, seats, tuned, .. } = &self.layout;
        let (left, right) = (junction, junction + 1);
        let from_left = if junction == 0 { END_SLOT } else { self.lane_of(junction - 1) };
        let from_right = BACK + if right == seats.len() { END_SLOT } else { self.lane_of(right) };
        let from_right =
            if right == *tuned { TUNED_SLOT as u16 } else { back_rows(rows[right].1, from_right) };
        [back_rows(rows[left].0, from_left), from_right]
    }

    /// Puts shut holes together if all holes rest, and if that is of use. Real-time safe.
    pub(super) fn lay(&mut self) {
        if self.moved {
            return;
        }
        for holes in &mut self.holes {
            holes.is_shut = (0..LANES).all(|k| holes.junctions.lanes.is_shut(k));
        }
        let mut is_shut = [false; LAID_HOLES];
        for (is_shut, &(chunk, k)) in is_shut.iter_mut().zip(&self.hole_lanes) {
            *is_shut = self.holes[chunk].junctions.lanes.is_shut(k);
        }
        let now = self.holes.iter().filter(|holes| holes.is_shut).count();
        if let Some(chunks) = self.layout.arrange(&is_shut, now as u32) {
            let places = self.places_in(&chunks);
            self.change_places(|_, hole| places[hole]);
        }
    }

    /// Every hole goes to where it was when the lattice was new. Real-time safe.
    pub(super) fn lay_as_at_first(&mut self) {
        self.change_places(|layout, hole| layout.first[hole]);
    }

    /// Lanes in these chunks: who stays in a chunk keeps the lane.
    fn places_in(&self, chunks: &HoleChunks) -> [(usize, usize); LAID_HOLES] {
        let (mut places, mut taken) = ([(0, 0); LAID_HOLES], [[false; LANES]; MAX_CHUNKS]);
        for (hole, &(chunk, k)) in self.hole_lanes.iter().enumerate() {
            if usize::from(chunks[hole]) == chunk {
                (places[hole], taken[chunk][k]) = ((chunk, k), true);
            }
        }
        for (hole, place) in self.hole_lanes.iter().enumerate() {
            let chunk = usize::from(chunks[hole]);
            if chunk != place.0 {
                let k = taken[chunk].iter().position(|taken| !taken).unwrap_or_default();
                (places[hole], taken[chunk][k]) = ((chunk, k), true);
            }
        }
        places
    }

    fn change_places(&mut self, to: impl Fn(&Layout, usize) -> (usize, usize)) {
        let mut changed = false;
        for hole in 0..self.hole_lanes.len() {
            let (from, to) = (self.hole_lanes[hole], to(&self.layout, hole));
            if from == to {
                continue;
            }
            if let Some(other) = self.hole_lanes.iter().position(|&place| place == to) {
                self.hole_lanes[other] = from;
            }
            self.hole_lanes[hole] = to;
            self.swap_lanes(from, to);
            changed = true;
        }
        if changed {
            self.connect();
            for holes in &mut self.holes {
                holes.heed();
            }
        }
    }

    /// Two lanes of holes change places, with the waves that have left them.
    fn swap_lanes(&mut self, (chunk, k): (usize, usize), (other_chunk, other_k): (usize, usize)) {
        if chunk == other_chunk {
            self.holes[chunk].swap_within(k, other_k);
        } else if let Ok([holes, others]) = self.holes.get_disjoint_mut([chunk, other_chunk]) {
            holes.swap(k, others, other_k);
        }
        let first = self.steps.len();
        let [slot, other] = [(first + chunk) * LANES + k, (first + other_chunk) * LANES + other_k];
        for row in self.ring[..=usize::from(self.mask)].as_chunks_mut::<STRIDE>().0 {
            row.swap(slot, other);
            row.swap(BACK + slot, BACK + other);
        }
        self.close_ring();
    }
}

#[cfg(test)]
mod tests;
