//! The sound outside: what leaves bell and holes, on its way to one or two places.
//!
//! The flows of one control tick are kept as the lattice gives them, eight lanes beside each other. At the end of the tick
//! those of the sources that are open are copied into a line each, every place adds up the lines along its [`Paths`](super::listening::Paths), and
//! a small source sounds as its flow changes. Delays are whole samples of the internal rate, 1.8 mm of way to either side.
//! A closed hole costs nothing. A new way of listening fades in.
//!
//! All of it is plain loops over arrays, compiled with the lattice's vector features; the same bits with and without AVX2.

mod lines;
mod listening_place;
#[cfg(test)]
mod tests;

use crate::bore::lattice::choir::LatticeChoir;
use crate::bore::lattice::{HoleFlows, LANES, LatticeCoeffs, Real};
use crate::bore::sound_sources::SoundSources;
use crate::dsp::smooth::smooth_single;
use crate::instrument::control_tick::TICK;
use crate::instrument::listening::{Listening, ListeningMode};
use crate::instrument::presence::Presence;
use crate::units::Air;
use lines::Lines;
use listening_place::ListeningPlace;

/// Ticks in which one way of listening fades into another: 13 ms at 96 kHz, too slow to click, and as long as the gain and the reed of another
/// preset take: the old reed is not heard in the new way with the new gain.
const FADE_TICKS: u32 = 80;

/// Flows of a tick, and the way to the listener.
pub(super) struct Outside<F> {
    /// Flows of the bell and of the holes in each sample of a tick.
    bell: [F; TICK],
    holes: [HoleFlows<F>; TICK],
    /// All flows together, while that is wanted.
    sums: [F; TICK],
    /// All flows together in the last sample of the tick before, while that is wanted.
    last: F,
    lines: Lines<F>,
    sources: SoundSources,
    air: Air,
    rate_hz: f64,
    /// Pressure at 1 m per change of flow in one sample, Pa.
    loudness: f64,
    /// How one shall listen, and whether there is a right channel; and what `now` was made for.
    wanted: (Listening, bool),
    chosen: (Listening, bool),
    now: Places<F>,
    before: Places<F>,
    /// Ticks until the former way of listening is gone.
    fading: u32,
    /// Ticks until the lines hold all that can be heard of them; they are not kept while everything is in one point.
    filling: u32,
    /// Nothing has sounded since the last silence: another way of listening need not fade in.
    fresh: bool,
    out: [[f32; TICK]; 2],
}

/// One or two places.
#[derive(Clone)]
struct Places<F> {
    /// Everything in one point instead.
    point: bool,
    two: bool,
    places: [ListeningPlace<F>; 2],
}

impl<F: Real> Places<F> {
    fn new(
        listening: &Listening,
        stereo: bool,
        (sources, air): (&SoundSources, &Air),
        lines: &Lines<F>,
        rate_hz: f64,
    ) -> Self {
        let two = stereo && listening.mode == ListeningMode::Position && listening.width_deg > 0.0;
        let place = |side: f64| {
            let (paths, presence) = match listening.mode {
                ListeningMode::Position => (listening.position(side, sources, air), None),
                _ => (Listening::everywhere(sources, air), Some(Presence::of(sources))),
            };
            ListeningPlace::new(&paths, presence, lines, rate_hz)
        };
        let places = if two { [place(-1.0), place(1.0)] } else { [place(0.0), place(0.0)] };
        Self { point: listening.mode == ListeningMode::Point, two, places }
    }
}

impl<F: Real> Outside<F> {
    /// All in one point, silent. `loudness`: pressure at 1 m per change of flow in one sample, Pa. Allocates.
    pub fn new(coeffs: &LatticeCoeffs, sources: SoundSources, air: &Air, loudness: f64) -> Self {
        let rate_hz = coeffs.rate_hz;
        let reach = (Listening::longest_s(&sources, air) * rate_hz).ceil() as usize + 1;
        let wanted = (Listening::point(), false);
        let lines = Lines::new(coeffs, reach);
        let places = Places::new(&wanted.0, wanted.1, (&sources, air), &lines, rate_hz);
        Self {
            bell: [F::default(); TICK],
            holes: [HoleFlows::default(); TICK],
            sums: [F::default(); TICK],
            last: F::default(),
            lines,
            sources,
            air: *air,
            rate_hz,
            loudness,
            wanted,
            chosen: wanted,
            before: places.clone(),
            now: places,
            fading: 0,
            filling: 0,
            fresh: true,
            out: [[0.0; TICK]; 2],
        }
    }

    /// Listens in another way from the next tick on; `stereo` if there is a right channel. Real-time safe.
    pub fn listen(&mut self, listening: &Listening, stereo: bool) {
        self.wanted = (*listening, stereo);
    }

    /// Tells which holes are open or opening. Call it before each tick with `moved` if any hole moves. Real-time safe.
    #[inline(always)]
    pub fn heed(&mut self, moved: bool, is_open: impl Fn(usize) -> bool) {
        self.lines.heed(moved, is_open);
    }

    /// Takes the bell's flow in sample `at` of a tick.
    #[inline(always)]
    pub fn bell(&mut self, at: usize, flow: F) {
        self.bell[at & (TICK - 1)] = flow;
    }

    /// Room for the holes' flows in sample `at` of a tick.
    #[inline(always)]
    pub fn holes(&mut self, at: usize) -> &mut HoleFlows<F> {
        &mut self.holes[at & (TICK - 1)]
    }

    /// Sends a whole tick on its way; the flows of each hole were in this chunk and lane.
    #[inline(always)]
    pub fn radiate(&mut self, holes: &[(usize, usize)]) {
        self.turn();
        if self.keeps_lines() {
            let rows = &self.holes;
            self.lines.write(&self.bell, |hole, line| {
                let Some(&(chunk, lane)) = holes.get(hole) else { return };
                let slot = chunk * LANES + lane;
                for (flow, row) in line.iter_mut().zip(rows) {
                    let row = row.as_flattened();
                    *flow = row[slot & (row.len() - 1)];
                }
            });
        }
        if self.adds_up() {
            for at in 0..TICK {
                self.sums[at] = self.together(at, holes);
            }
        }
        self.hear();
    }

    /// As [`radiate`](Self::radiate), with the flows of a lane of a choir.
    #[inline(always)]
    pub fn radiate_lane<const N: usize>(&mut self, lane: usize, choir: &LatticeChoir<N>)
    where
        F: From<f32>,
    {
        self.turn();
        let bell = choir.bell_flows();
        let bell = std::array::from_fn(|at| F::from(bell[at][lane]));
        if self.keeps_lines() {
            self.lines.write(&bell, |hole, line| {
                let Some(flows) = choir.hole_flows(hole) else { return };
                for (flow, flows) in line.iter_mut().zip(flows) {
                    *flow = F::from(flows[lane]);
                }
            });
        }
        if self.adds_up() {
            for at in 0..TICK {
                self.sums[at] = F::from(choir.together(at, lane));
            }
        }
        self.hear();
    }

    /// Turns to another way of listening, if one is wanted.
    #[inline(always)]
    fn turn(&mut self) {
        if self.wanted != self.chosen && self.fading == 0 {
            self.change();
        }
        self.fresh = false;
    }

    #[inline(always)]
    fn keeps_lines(&self) -> bool {
        !self.now.point || self.fading > 0 || self.filling > 0
    }

    /// Whether the sum of all flows is wanted.
    #[inline(always)]
    fn adds_up(&self) -> bool {
        self.now.point || (self.fading > 0 && self.before.point)
    }

    /// The tick as it is heard.
    #[inline(always)]
    fn hear(&mut self) {
        self.out = self.hear_now();
        if self.fading > 0 {
            self.fade();
        }
        self.last = self.sums[TICK - 1];
    }

    /// Begins to fade into the way that is wanted. Not inlined: it is seldom called.
    #[inline(never)]
    fn change(&mut self) {
        let (listening, stereo) = self.wanted;
        let of = (&self.sources, &self.air);
        let mut next = Places::new(&listening, stereo, of, &self.lines, self.rate_hz);
        if self.now.point && !next.point && !self.fresh {
            // What is in the lines is old: one point needs none.
            if self.filling == 0 {
                self.lines.clear();
                self.filling = self.lines.ticks() + 1;
            }
            self.filling -= 1;
            if self.filling > 0 {
                return;
            }
        }
        if next.point && !self.now.point {
            // Until now nobody wanted it.
            self.last = self.lines.together();
        }
        for (next, now) in next.places.iter_mut().zip(&self.now.places) {
            next.go_on((!self.now.point).then_some(now), &self.lines);
        }
        self.before = std::mem::replace(&mut self.now, next);
        self.chosen = self.wanted;
        self.filling = 0;
        self.fading = if self.fresh { 0 } else { FADE_TICKS };
    }

    /// What is heard: the left or only place, and the right one if there are two.
    pub fn heard(&self) -> (&[f32; TICK], Option<&[f32; TICK]>) {
        let two = self.now.two || (self.fading > 0 && self.before.two);
        (&self.out[0], two.then_some(&self.out[1]))
    }

    /// Silence, and at once the way of listening that is wanted. Real-time safe.
    pub fn silence(&mut self) {
        self.last = F::default();
        self.lines.clear();
        self.out = [[0.0; TICK]; 2];
        (self.fresh, self.fading, self.filling) = (true, 0, 0);
        self.now.places.iter_mut().chain(&mut self.before.places).for_each(ListeningPlace::silence);
    }

    /// All flows together in a sample of the tick.
    #[inline(always)]
    fn together(&self, at: usize, holes: &[(usize, usize)]) -> F {
        let row = self.holes[at].as_flattened();
        self.lines.add_up(self.bell[at], |hole| {
            holes
                .get(hole)
                .map_or(F::default(), |&(chunk, lane)| row[(chunk * LANES + lane) & (row.len() - 1)])
        })
    }

    /// All flows in one point.
    #[inline(always)]
    fn point(&self) -> [f32; TICK] {
        let (mut before, mut pressure) = (self.last.wide(), [0.0; TICK]);
        for (pressure, flow) in pressure.iter_mut().zip(&self.sums) {
            let flow = flow.wide();
            *pressure = ((flow - before) * self.loudness) as f32;
            before = flow;
        }
        pressure
    }

    #[inline(always)]
    fn hear_now(&mut self) -> [[f32; TICK]; 2] {
        if self.now.point {
            return [self.point(); 2];
        }
        let loudness = F::of(self.loudness);
        let pressure = |changes: [F; TICK]| changes.map(|change| (change * loudness).wide() as f32);
        let [left, right] = &mut self.now.places;
        let heard = pressure(left.listen(&self.lines));
        [heard, if self.now.two { pressure(right.listen(&self.lines)) } else { heard }]
    }

    /// Mixes in what the former way of listening hears. Not inlined: it is seldom called.
    #[inline(never)]
    fn fade(&mut self) {
        std::mem::swap(&mut self.now, &mut self.before);
        let old = self.hear_now();
        std::mem::swap(&mut self.now, &mut self.before);
        let ticks = FADE_TICKS as usize;
        let done = (ticks - self.fading as usize) * TICK;
        for (new, old) in self.out.iter_mut().zip(old) {
            for (n, (new, old)) in new.iter_mut().zip(old).enumerate() {
                // Without a kink at either end, which would be heard as a faint click.
                let part = smooth_single((done + n + 1) as f32 / (ticks * TICK) as f32);
                *new = old + part * (*new - old);
            }
        }
        self.fading -= 1;
    }
}
