//! One place: its ways from all sources, the filter of the bell at its angle, and presence.

use super::lines::Lines;
use crate::bore::lattice::{Real, TINY};
use crate::dsp::lanes::through_memory;
use crate::instrument::control_tick::TICK;
use crate::instrument::listening::{MAX_SOURCES, Paths};
use crate::instrument::presence::{Biquad, Presence};

/// A tick behind the samples before it, from where vectors can be read.
#[inline(always)]
fn behind<F: Real, const BEFORE: usize, const ALL: usize>(before: [F; BEFORE], tick: &[F; TICK]) -> [F; ALL] {
    const { assert!(ALL == BEFORE + TICK) };
    let mut all = [F::default(); ALL];
    all[..BEFORE].copy_from_slice(&before);
    all[BEFORE..].copy_from_slice(tick);
    through_memory(all)
}

/// One place.
#[derive(Clone)]
pub(super) struct ListeningPlace<F> {
    /// Of each hole and the bell: a line's length beyond where its delayed line begins when a tick is at 0, and its gain.
    taps: [(usize, F); MAX_SOURCES],
    bell: Shelf<F>,
    /// Sum of all flows in the last sample.
    last: F,
    presence: Option<(Shelf<F>, Resonance<F>)>,
}

/// A filter of first order: `y = b0 x + b1 x' + a1 y'`.
#[derive(Clone, Copy, Default)]
struct Shelf<F> {
    b0: F,
    b1: F,
    a1: F,
    x: F,
    y: F,
}

impl<F: Real> Shelf<F> {
    /// `(1 + b s) / (1 + a s)` at a sample rate, by the trapezoidal rule.
    fn new((b_s, a_s): (f64, f64), rate_hz: f64) -> Self {
        let (b, a) = (2.0 * rate_hz * b_s, 2.0 * rate_hz * a_s);
        let [b0, b1, a1] = [(1.0 + b) / (1.0 + a), (1.0 - b) / (1.0 + a), (a - 1.0) / (1.0 + a)].map(F::of);
        Self { b0, b1, a1, x: F::default(), y: F::default() }
    }

    #[inline(always)]
    fn run(&mut self, block: &mut [F; TICK]) {
        let x: [F; TICK + 1] = behind([self.x], block);
        for n in 0..TICK {
            block[n] = self.b0 * x[n + 1] + self.b1 * x[n];
        }
        self.x = x[TICK];
        *block = through_memory(*block);
        for y in block {
            *y = *y + self.a1 * self.y;
            self.y = *y;
        }
        // A filter at rest would stay on the smallest number there is, which is slow to compute with.
        if self.y.magnitude() < F::of(TINY) {
            self.y = F::default();
        }
    }
}

/// A filter of second order: `y = b0 x + b1 x' + b2 x'' + a1 y' + a2 y''`.
#[derive(Clone, Copy)]
struct Resonance<F> {
    forward: [F; 3],
    back: [F; 2],
    x: [F; 2],
    y: [F; 2],
}

impl<F: Real> Resonance<F> {
    fn new(biquad: Biquad) -> Self {
        let nothing = [F::default(); 2];
        Self { forward: biquad.forward.map(F::of), back: biquad.back.map(F::of), x: nothing, y: nothing }
    }

    #[inline(always)]
    fn run(&mut self, block: &mut [F; TICK]) {
        let ([b0, b1, b2], [a1, a2]) = (self.forward, self.back);
        let x: [F; TICK + 2] = behind([self.x[1], self.x[0]], block);
        for n in 0..TICK {
            block[n] = b0 * x[n + 2] + b1 * x[n + 1] + b2 * x[n];
        }
        self.x = [x[TICK + 1], x[TICK]];
        *block = through_memory(*block);
        let [mut before, mut earlier] = self.y;
        for y in block {
            // What is known first is added first.
            *y = *y + a2 * earlier + a1 * before;
            (before, earlier) = (*y, before);
        }
        // As in a shelf.
        let rests = before.magnitude() < F::of(TINY) && earlier.magnitude() < F::of(TINY);
        self.y = if rests { [F::default(); 2] } else { [before, earlier] };
    }
}

impl<F: Real> ListeningPlace<F> {
    /// Along these paths, at the internal rate, Hz. Real-time safe.
    pub(super) fn new(paths: &Paths, presence: Option<Presence>, lines: &Lines<F>, rate_hz: f64) -> Self {
        let mut taps = [(0, F::default()); MAX_SOURCES];
        for (number, (tap, path)) in taps.iter_mut().zip(&paths.paths).enumerate().take(lines.slots.len() + 1)
        {
            let delay = ((path.delay_s * rate_hz).round() as usize).min(lines.reach);
            *tap = ((number + 1) * lines.stride() - delay, F::of(path.gain));
        }
        let presence = presence.map(|presence| {
            (Shelf::new(presence.shelf_s(), rate_hz), Resonance::new(presence.bell(rate_hz)))
        });
        Self { taps, bell: Shelf::new(paths.bell_s, rate_hz), last: F::default(), presence }
    }

    /// Goes on from the flows in the lines, and with what the filter of the bell has heard in another ear, if there is one.
    pub(super) fn go_on(&mut self, other: Option<&Self>, lines: &Lines<F>) {
        let flow = |(begin, gain): (usize, F)| gain * lines.newest(begin);
        // A steady flow passes the filter as it is.
        let steady = flow(self.taps[lines.slots.len()]);
        (self.bell.x, self.bell.y) = other.map_or((steady, steady), |other| (other.bell.x, other.bell.y));
        let holes = lines.active[..lines.count].iter().map(|&hole| flow(self.taps[usize::from(hole)]));
        self.last = holes.fold(self.bell.y, |sum, flow| sum + flow);
        // A steady flow is silent.
        if let (Some(own), Some(Self { presence: Some(other), .. })) = (&mut self.presence, other) {
            *own = *other;
        }
    }

    /// Silence.
    pub(super) fn silence(&mut self) {
        (self.bell.x, self.bell.y, self.last) = (F::default(), F::default(), F::default());
        if let Some((shelf, bell)) = &mut self.presence {
            (shelf.x, shelf.y) = (F::default(), F::default());
            (bell.x, bell.y) = ([F::default(); 2], [F::default(); 2]);
        }
    }

    /// Adds up a tick: changes of flow.
    #[inline(always)]
    pub(super) fn listen(&mut self, lines: &Lines<F>) -> [F; TICK] {
        let mut sum = [F::default(); TICK];
        let (begin, gain) = self.taps[lines.slots.len().min(MAX_SOURCES - 1)];
        if let Some(past) = lines.tick(begin) {
            for n in 0..TICK {
                sum[n] = gain * past[n];
            }
        }
        self.bell.run(&mut sum);
        for &hole in lines.active.get(..lines.count).unwrap_or_default() {
            let Some(&(begin, gain)) = self.taps.get(usize::from(hole)) else { continue };
            if let Some(past) = lines.tick(begin) {
                for n in 0..TICK {
                    sum[n] = sum[n] + gain * past[n];
                }
            }
        }
        let sum: [F; TICK + 1] = behind([self.last], &sum);
        let mut changes = [F::default(); TICK];
        for n in 0..TICK {
            changes[n] = sum[n + 1] - sum[n];
        }
        self.last = sum[TICK];
        if let Some((shelf, bell)) = &mut self.presence {
            shelf.run(&mut changes);
            bell.run(&mut changes);
        }
        changes
    }
}
