//! The tuning delay of a choir: the one wave that does not take the same time in all lanes.

use super::lines::{Line, Lines, Waves};
use super::plan::Turn;
use super::{Lattice, Real, TICK};

/// The returning wave of the tuned cell.
#[derive(Clone)]
pub(super) struct Tuned<const N: usize> {
    cell: Line,
    /// Rows that it takes, and their change per row.
    pub(super) delay: [f32; N],
    glide: [f32; N],
    /// Where it comes from, whole rows of the delay, and the wave a row before it, while no delay crosses a row in the tick.
    places: [u16; N],
    whole: [f32; N],
    before: [f32; N],
    /// Some delay crosses a row in this tick.
    pub(super) crossing: bool,
}

impl<const N: usize> Tuned<N> {
    /// Along a cell, all lanes with the same delay, rows.
    pub(super) fn new(cell: Line, delay: f32) -> Self {
        let none = [0.0; N];
        let (places, crossing) = ([cell.begin; N], false);
        Self { cell, delay: [delay; N], glide: none, places, whole: none, before: none, crossing }
    }

    /// Prepares a lane for the next tick of its lattice.
    pub(super) fn begin(&mut self, lane: usize, lattice: &Lattice<f32>, lines: &Lines<N>) {
        let (delay, glide) = (lattice.delay, lattice.delay_glide);
        (self.delay[lane], self.glide[lane]) = (delay, glide);
        // The delay goes one way, so that its ends tell whether it crosses a row.
        let mut last = delay;
        (0..TICK).for_each(|_| last += glide);
        let whole = (delay + glide).whole().max(1);
        self.crossing |= whole != last.whole().max(1);
        self.whole[lane] = f32::from(whole);
        self.places[lane] = self.cell.behind(whole);
        self.before[lane] = lines.waves()[usize::from(self.cell.behind(whole + 1))][lane];
    }

    /// Goes on for a turn.
    #[inline(always)]
    pub(super) fn go_on(&mut self, waves: &mut Waves<N>, turn: &Turn) {
        if self.crossing {
            return self.cross(waves, turn);
        }
        let [_, _, target, _] = turn.places();
        let (places, glide, whole) = (self.places.map(|place| turn.place(place)), self.glide, self.whole);
        // What goes from sample to sample stays in registers.
        let (mut delay, mut before) = (self.delay, self.before);
        for n in 0..turn.samples() {
            let mut near = [0.0; N];
            for k in 0..N {
                delay[k] += glide[k];
                near[k] = waves[places[k] + n][k];
            }
            waves[target + n] = between(&delay, &whole, &near, &before);
            before = near;
        }
        (self.delay, self.before) = (delay, before);
    }

    /// Goes on for a turn of a tick in which some delay crosses a row. Not inlined: that is seldom.
    #[inline(never)]
    fn cross(&mut self, waves: &mut Waves<N>, turn: &Turn) {
        let [_, _, target, _] = turn.places();
        for n in 0..turn.samples() {
            let [mut near, mut far] = [[0.0; N]; 2];
            for k in 0..N {
                self.delay[k] += self.glide[k];
                let whole = self.delay[k].whole().max(1);
                self.whole[k] = f32::from(whole);
                near[k] = waves[turn.place(self.cell.behind(whole)) + n][k];
                far[k] = waves[turn.place(self.cell.behind(whole + 1)) + n][k];
            }
            waves[target + n] = between(&self.delay, &self.whole, &near, &far);
            self.before = near;
        }
    }
}

/// Waves after so many rows, between those after the whole ones and those a row before.
#[inline(always)]
fn between<const N: usize>(delay: &[f32; N], whole: &[f32; N], near: &[f32; N], far: &[f32; N]) -> [f32; N] {
    let mut tuned = *near;
    for k in 0..N {
        let part = delay[k] - whole[k];
        tuned[k] += part * (far[k] - near[k]);
    }
    tuned
}
