//! The bores of several voices of one instrument, side by side: a lane is a voice, and all lanes of a junction are processed
//! at once.
//!
//! A [`Lattice`] alone has its junctions in lanes and gathers the arriving waves one by one. In a choir all voices have the
//! same delays, so that a junction's waves lie beside each other. Each lane does what a lattice does and gives the same bits.
//! Every wave has a line of its own, and a junction goes on for as many samples as its neighbours' waves allow, in the turns
//! that `plan` finds: its state then stays in registers, and its places are found once.
//!
//! A lattice lends its waves to a lane, and keeps what moves the holes and the delay. Only single precision.

mod lines;
mod plan;
mod tuned;

use super::junctions::{Holes, Shut, Steps};
use super::{LANES, Lattice, LatticeCoeffs, Real, TINY};
use lines::{Lines, Waves};
use plan::{Node, Turn, plan};
use tuned::Tuned;

/// Samples that a choir plays at once.
pub const TICK: usize = 16;
/// The reed ends of all lanes. Implementations mark all `#[inline(always)]`, as those of [`Tip`](super::Tip).
pub trait Tips<const N: usize> {
    /// A tick begins.
    #[inline(always)]
    fn begin(&mut self) {}
    /// Waves leaving into the bores in sample `at` of a tick, for the waves arriving from them.
    fn reflect(&mut self, at: usize, p_minus: &[f32; N]) -> [f32; N];
    /// The tick is done: its flows are there.
    #[inline(always)]
    fn ended(&mut self, _choir: &LatticeChoir<N>) {}
}

/// One junction of all voices.
#[derive(Clone)]
#[repr(C, align(64))]
struct Junction<T> {
    lanes: T,
    /// Which one it is in a lattice.
    slot: u16,
}

/// A tone hole of all voices.
#[derive(Clone)]
#[repr(C, align(64))]
struct Hole<const N: usize> {
    junction: Junction<Holes<f32, N>>,
    shut: Shut<f32, N>,
    /// Flows that leave in a tick.
    flows: Flows<N>,
    /// It is shut in all lanes where somebody plays.
    is_shut: bool,
}

/// One-pole loss at an end of the bore.
#[derive(Clone)]
struct End<const N: usize> {
    taken: [f32; N],
    q: [f32; N],
    state: [f32; N],
}

/// The bell, see [`Lattice`].
#[derive(Clone)]
struct Bell<const N: usize> {
    y: [f32; N],
    y2: [f32; N],
    share: [f32; N],
    g2: [f32; N],
    state: [f32; N],
    flows: Flows<N>,
}

/// Flows that leave in a tick, sample by sample.
pub type Flows<const N: usize> = [[f32; N]; TICK];

/// The bores of up to `N` voices.
#[derive(Clone)]
pub struct LatticeChoir<const N: usize> {
    lines: Lines<N>,
    /// Who goes on for how long, in this order, until the tick is done.
    turns: Box<[Turn]>,
    steps: Box<[Junction<Steps<f32, N>>]>,
    /// In the order in which they are processed.
    holes: Box<[Hole<N>]>,
    /// Which of these holes stands for each hole, in the order of the file, and chunk and lane of each in a lattice.
    places: Box<[(usize, usize, usize)]>,
    tip: End<N>,
    end: End<N>,
    bell: Bell<N>,
    /// All flows together in the last sample of the tick.
    sum: [f32; N],
    tuned: Tuned<N>,
    /// Lanes whose holes move in this tick.
    moving: [bool; N],
    avx2: bool,
}

impl<const N: usize> LatticeChoir<N> {
    /// Silent bores. Allocates.
    pub fn new(coeffs: &LatticeCoeffs) -> Self {
        let junctions = coeffs.ticks.len() - 1;
        let lines = Lines::new(coeffs);
        let (mut steps, mut holes) = (Vec::new(), Vec::new());
        // Each with the places where its waves come from, from left and right, and where they go, down the bore and back.
        let mut nodes = vec![(Node::Tip, [lines.back(0).begin, 0, lines.down(0).end(), 0]); junctions + 2];
        let [at_bell, from_bell] = [lines.down(junctions).begin, lines.back(junctions).end()];
        nodes[junctions + 1] = (Node::Bell, [at_bell, 0, from_bell, 0]);
        let mut by_lane: Vec<usize> = (0..junctions).collect();
        by_lane.sort_by_key(|&junction| coeffs.lane_of(junction));
        for junction in by_lane {
            let slot = coeffs.lane_of(junction) as u16;
            let [down_here, down_next] = [lines.down(junction), lines.down(junction + 1)];
            let [back_here, back_next] = [lines.back(junction), lines.back(junction + 1)];
            let is_tuned = junction + 1 == coeffs.tuned_cell();
            let from_right = if is_tuned { lines.tuned() } else { back_next.begin };
            let places = [down_here.begin, from_right, down_next.end(), back_here.end()];
            if coeffs.hole_junctions.contains(&junction) {
                let mut lanes = Holes::<f32, N>::idle();
                (0..N).for_each(|lane| lanes.place(lane, coeffs, junction));
                let shut = Shut::new(&lanes);
                nodes[junction + 1] = (Node::Hole(holes.len() as u16), places);
                let junction = Junction { lanes, slot };
                holes.push(Hole { junction, shut, flows: [[0.0; N]; TICK], is_shut: false });
            } else {
                let mut lanes = Steps::<f32, N>::idle();
                (0..N).for_each(|lane| lanes.place(lane, coeffs, junction));
                nodes[junction + 1] = (Node::Step(steps.len() as u16), places);
                steps.push(Junction { lanes, slot });
            }
        }
        let first_hole = coeffs.step_chunks() * LANES;
        let places = coeffs.hole_slots().map(|(chunk, lane)| {
            let slot = first_hole + chunk * LANES + lane;
            let at =
                holes.iter().position(|hole| usize::from(hole.junction.slot) == slot).unwrap_or_default();
            (at, chunk, lane)
        });
        let places = places.collect();
        let own = Lattice::<f32>::new(coeffs);
        let end = |end: &super::EndLoss<f32>| {
            let [taken, q, state] = [end.taken, end.q, 0.0].map(|of_all| [of_all; N]);
            End { taken, q, state }
        };
        let mut choir = Self {
            turns: plan(coeffs, &nodes, lines.tuned()).into(),
            steps: steps.into(),
            holes: holes.into(),
            places,
            tip: end(&own.tip),
            end: end(&own.end),
            bell: Bell {
                y: [own.bell_y; N],
                y2: [own.bell_y2; N],
                share: [own.bell_share; N],
                g2: [own.bell_g2; N],
                state: [0.0; N],
                flows: [[0.0; N]; TICK],
            },
            sum: [0.0; N],
            tuned: Tuned::new(lines.back(coeffs.tuned_cell()), own.delay),
            lines,
            moving: [false; N],
            avx2: own.avx2,
        };
        // A lattice that is new has all holes closed.
        (0..N).for_each(|lane| choir.move_holes(lane, &own));
        choir
    }

    /// Keeps to the code path without AVX2.
    pub fn without_avx2(mut self) -> Self {
        self.avx2 = false;
        self
    }

    /// Before [`begin`](Self::begin) of the first lane: nobody plays. Real-time safe.
    pub fn clear(&mut self) {
        self.moving = [false; N];
        self.tuned.crossing = false;
    }

    /// A lattice lends its waves to a lane. Real-time safe.
    pub fn borrow(&mut self, lane: usize, lattice: &mut Lattice<f32>) {
        // From now on each of its holes is where it was at first.
        lattice.lay_as_at_first();
        let ring = |place: u16| lattice.ring[usize::from(lattice.base.wrapping_add(place) & lattice.mask)];
        self.lines.each_heard_mut(|place, wave| wave[lane] = ring(place));
        for junction in &mut self.steps {
            let (chunk, k) = (usize::from(junction.slot) / LANES, usize::from(junction.slot) % LANES);
            let Some(own) = lattice.steps.get(chunk) else { continue };
            for (lanes, own) in junction.lanes.arrivals.state.iter_mut().zip(&own.arrivals.state) {
                lanes[lane] = own[k];
            }
        }
        for &(at, chunk, k) in &self.places {
            let (Some(hole), Some(own)) = (self.holes.get_mut(at), lattice.holes.get(chunk)) else {
                continue;
            };
            let lanes = &mut hole.junction.lanes;
            for (lanes, own) in lanes.arrivals.state.iter_mut().zip(&own.arrivals.state) {
                lanes[lane] = own[k];
            }
            lanes.outer[lane] = own.outer[k];
            lanes.compliance[lane] = own.compliance[k];
            lanes.inner[lane] = own.inner[k];
            lanes.resistance[lane] = own.resistance[k];
        }
        self.tip.state[lane] = lattice.tip.state;
        self.end.state[lane] = lattice.end.state;
        self.bell.state[lane] = lattice.bell_state;
        self.move_holes(lane, lattice);
        lattice.lent = true;
    }

    /// Gives a lattice its waves back, unless it has others by now. Real-time safe.
    pub fn give_back(&self, lane: usize, lattice: &mut Lattice<f32>) {
        if !std::mem::take(&mut lattice.lent) {
            return;
        }
        let (base, mask) = (lattice.base, lattice.mask);
        self.lines.each_heard(|place, wave| {
            lattice.ring[usize::from(base.wrapping_add(place) & mask)] = wave[lane];
        });
        for junction in &self.steps {
            let (chunk, k) = (usize::from(junction.slot) / LANES, usize::from(junction.slot) % LANES);
            let Some(own) = lattice.steps.get_mut(chunk) else { continue };
            for (own, lanes) in own.arrivals.state.iter_mut().zip(&junction.lanes.arrivals.state) {
                own[k] = lanes[lane];
            }
        }
        for &(at, chunk, k) in &self.places {
            let (Some(hole), Some(own)) = (self.holes.get(at), lattice.holes.get_mut(chunk)) else {
                continue;
            };
            let lanes = &hole.junction.lanes;
            for (own, lanes) in own.arrivals.state.iter_mut().zip(&lanes.arrivals.state) {
                own[k] = lanes[lane];
            }
            own.outer[k] = lanes.outer[lane];
            own.compliance[k] = lanes.compliance[lane];
            own.inner[k] = lanes.inner[lane];
            own.resistance[k] = lanes.resistance[lane];
        }
        lattice.close_ring();
        lattice.tip.state = self.tip.state[lane];
        lattice.end.state = self.end.state[lane];
        lattice.bell_state = self.bell.state[lane];
    }

    /// Takes over what moves a lane's holes.
    fn move_holes(&mut self, lane: usize, lattice: &Lattice<f32>) {
        for &(at, chunk, k) in &self.places {
            if let (Some(hole), Some(own)) = (self.holes.get_mut(at), lattice.holes.get(chunk)) {
                hole.junction.lanes.move_as(lane, own, k);
                hole.is_shut &= hole.junction.lanes.is_shut(lane);
            }
        }
    }

    /// Prepares a lane for the next tick of its lattice: holes and delay move on. Real-time safe.
    pub fn begin(&mut self, lane: usize, lattice: &mut Lattice<f32>) {
        if !lattice.lent {
            self.borrow(lane, lattice);
        }
        self.moving[lane] = lattice.moved;
        if lattice.moved {
            lattice.rest();
            self.move_holes(lane, lattice);
        }
        self.tuned.begin(lane, lattice, &self.lines);
    }

    /// Ends the tick of a lane. Real-time safe.
    pub fn end(&mut self, lane: usize, lattice: &mut Lattice<f32>) {
        if self.moving[lane] {
            for &(at, chunk, k) in &self.places {
                if let (Some(hole), Some(own)) = (self.holes.get(at), lattice.holes.get_mut(chunk)) {
                    own.arrive_as(k, &hole.junction.lanes, lane);
                }
            }
        }
        lattice.delay = self.tuned.delay[lane];
        lattice.end_delay(TICK);
    }

    /// Plays a tick of all lanes that have [begun](Self::begin) it; what the others do is of no account. Real-time safe.
    /// [audio thread]
    pub fn run<T: Tips<N>>(&mut self, tips: &mut T) {
        #[cfg(target_arch = "x86_64")]
        if self.avx2 {
            #[allow(unsafe_code)]
            // SAFETY: `avx2` is only set where the processor has AVX2.
            unsafe {
                run_avx2::<T, N>(self, tips)
            };
            return;
        }
        run_body::<T, N>(self, tips);
    }

    /// Flows out of a hole in the last tick, by its number in the file.
    pub fn hole_flows(&self, hole: usize) -> Option<&Flows<N>> {
        Some(&self.holes.get(self.places.get(hole)?.0)?.flows)
    }

    /// Flows out of the bell in the last tick.
    pub fn bell_flows(&self) -> &Flows<N> {
        &self.bell.flows
    }

    /// All flows of a lane together in a sample of the last tick.
    #[inline(always)]
    pub fn together(&self, at: usize, lane: usize) -> f32 {
        if at == TICK - 1 { self.sum[lane] } else { self.add(at)[lane] }
    }

    /// All flows together in a sample of the tick, added in the order of a single voice.
    #[inline(always)]
    fn add(&self, at: usize) -> [f32; N] {
        let at = at & (TICK - 1);
        let mut sums = [[0.0; N]; LANES];
        // In this order, chunk comes after chunk.
        for hole in &self.holes {
            let (sum, flows) = (&mut sums[usize::from(hole.junction.slot) % LANES], &hole.flows[at]);
            for k in 0..N {
                sum[k] += flows[k];
            }
        }
        let mut all = self.bell.flows[at];
        for sum in sums {
            for k in 0..N {
                all[k] += sum[k];
            }
        }
        all
    }

    /// As [`Lattice::flush`], for some of the lanes; `playing` are those where somebody plays. Real-time safe.
    pub fn flush(&mut self, flushed: [bool; N], playing: [bool; N]) {
        let least = flushed.map(|flushed| if flushed { TINY as f32 } else { 0.0 });
        let flush = |of: &mut [f32; N]| {
            for k in 0..N {
                of[k] = if of[k].abs() < least[k] { 0.0 } else { of[k] };
            }
        };
        self.lines.each_heard_mut(|_, wave| flush(wave));
        self.steps.iter_mut().for_each(|steps| steps.lanes.arrivals.state.iter_mut().for_each(flush));
        for Hole { junction: Junction { lanes, .. }, flows, is_shut, .. } in &mut self.holes {
            lanes.arrivals.state.iter_mut().for_each(flush);
            [&mut lanes.outer, &mut lanes.compliance, &mut lanes.inner].into_iter().for_each(flush);
            // A hole that has closed is shut when nothing flows outside any more.
            if !*is_shut && (0..N).all(|lane| !playing[lane] || lanes.is_shut(lane)) {
                *is_shut = true;
                *flows = [[0.0; N]; TICK];
            }
        }
        [&mut self.tip.state, &mut self.end.state, &mut self.bell.state].into_iter().for_each(flush);
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<T: Tips<N>, const N: usize>(choir: &mut LatticeChoir<N>, tips: &mut T) {
    run_body::<T, N>(choir, tips);
}

impl<const N: usize> End<N> {
    #[inline(always)]
    fn take(&mut self, mut wave: [f32; N]) -> [f32; N] {
        let (taken, q, state) = (&self.taken, &self.q, &mut self.state);
        for k in 0..N {
            let difference = wave[k] - state[k];
            state[k] += q[k] * difference;
            wave[k] -= taken[k] * difference;
        }
        wave
    }
}

impl<const N: usize> Bell<N> {
    /// Waves that the bell reflects.
    #[inline(always)]
    fn reflect(&mut self, at: usize, arriving: [f32; N]) -> [f32; N] {
        let mut reflected = [0.0; N];
        for k in 0..N {
            let p_end = (self.y2[k] * arriving[k] - self.state[k]) * self.share[k];
            self.state[k] += self.g2[k] * p_end;
            reflected[k] = p_end - arriving[k];
        }
        let flows = &mut self.flows[at];
        for k in 0..N {
            flows[k] = self.y[k] * (arriving[k] - reflected[k]);
        }
        reflected
    }
}

impl<const N: usize> Junction<Steps<f32, N>> {
    /// Goes on for a turn.
    #[inline(always)]
    fn go_on(&mut self, waves: &mut Waves<N>, turn: &Turn) {
        let [left, right, down, back] = turn.places();
        let mut state = self.lanes.arrivals.state;
        for n in 0..turn.samples() {
            [waves[down + n], waves[back + n]] =
                self.lanes.scatter_from(&mut state, [waves[left + n], waves[right + n]]);
        }
        self.lanes.arrivals.state = state;
    }
}

impl<const N: usize> Hole<N> {
    /// Goes on for a turn.
    #[inline(always)]
    fn go_on(&mut self, waves: &mut Waves<N>, turn: &Turn, moving: bool) {
        let Self { junction: Junction { lanes, .. }, shut, flows, is_shut } = self;
        let [left, right, down, back] = turn.places();
        if *is_shut {
            let mut state = lanes.still();
            for n in 0..turn.samples() {
                let arriving = [waves[left + n], waves[right + n]];
                [waves[down + n], waves[back + n]] = lanes.scatter_shut(&mut state, shut, arriving);
            }
            lanes.stay(state);
            return;
        }
        for n in 0..turn.samples() {
            if moving {
                lanes.glide();
            }
            let (leaving, flow) = lanes.scatter([waves[left + n], waves[right + n]]);
            [waves[down + n], waves[back + n]] = leaving;
            flows[turn.at(n)] = flow;
        }
    }

    /// Goes on for a turn, and so does a neighbour, sample by sample after it.
    #[inline(always)]
    fn go_on_with(
        &mut self,
        next: &mut Self,
        waves: &mut Waves<N>,
        [turn, next_turn]: [&Turn; 2],
        moving: bool,
    ) {
        if !(self.is_shut && next.is_shut) {
            for n in 0..turn.samples() {
                self.go_on(waves, &turn.sample(n), moving);
                next.go_on(waves, &next_turn.sample(n), moving);
            }
            return;
        }
        let (lanes, next_lanes) = (&mut self.junction.lanes, &mut next.junction.lanes);
        let (mut state, mut next_state) = (lanes.still(), next_lanes.still());
        let ([left, right, down, back], [next_left, next_right, next_down, next_back]) =
            (turn.places(), next_turn.places());
        for n in 0..turn.samples() {
            let arriving = [waves[left + n], waves[right + n]];
            [waves[down + n], waves[back + n]] = lanes.scatter_shut(&mut state, &self.shut, arriving);
            let arriving = [waves[next_left + n], waves[next_right + n]];
            [waves[next_down + n], waves[next_back + n]] =
                next_lanes.scatter_shut(&mut next_state, &next.shut, arriving);
        }
        lanes.stay(state);
        next_lanes.stay(next_state);
    }
}

#[inline(always)]
fn run_body<T: Tips<N>, const N: usize>(choir: &mut LatticeChoir<N>, tips: &mut T) {
    tips.begin();
    let moving = choir.moving.iter().any(|moving| *moving);
    let waves = choir.lines.waves_mut();
    let mut turns = choir.turns.iter();
    while let Some(turn) = turns.next() {
        match turn.node {
            Node::Step(step) => {
                if let Some(step) = choir.steps.get_mut(usize::from(step)) {
                    step.go_on(waves, turn);
                }
            }
            Node::Hole(hole) => {
                if let Some(hole) = choir.holes.get_mut(usize::from(hole)) {
                    hole.go_on(waves, turn, moving);
                }
            }
            Node::Pair(hole) => {
                if let Some(next) = turns.next()
                    && let Node::Hole(neighbour) = next.node
                    && let Ok([hole, neighbour]) =
                        choir.holes.get_disjoint_mut([usize::from(hole), usize::from(neighbour)])
                {
                    hole.go_on_with(neighbour, waves, [turn, next], moving);
                }
            }
            Node::Tuned => {
                choir.tuned.go_on(waves, turn);
            }
            Node::Tip => {
                let [source, _, target, _] = turn.places();
                for n in 0..turn.samples() {
                    let p_minus = choir.tip.take(waves[source + n]);
                    waves[target + n] = tips.reflect(turn.at(n), &p_minus);
                }
            }
            Node::Bell => {
                let [source, _, target, _] = turn.places();
                for n in 0..turn.samples() {
                    let arriving = choir.end.take(waves[source + n]);
                    waves[target + n] = choir.bell.reflect(turn.at(n), arriving);
                }
            }
        }
    }
    choir.lines.advance();
    choir.sum = choir.add(TICK - 1);
    tips.ended(choir);
}
