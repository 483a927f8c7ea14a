//! The noises of several voices during a tick: a lane is a voice. Each does what a [`BreathNoise`] does alone, in the same order,
//! and gives the same bits.

use super::{BreathNoise, FLOOR, Jet, still};
use crate::dsp::white::{UNIT, next};
use crate::instrument::control_tick::TICK;

/// See [`BreathNoise`].
#[derive(Clone)]
pub(in crate::instrument) struct NoiseLanes<const N: usize> {
    strength: [f64; N],
    keep: [f64; N],
    built: [f64; N],
    mean: [f64; N],
    quiet: [f64; N],
    whisper: [f64; N],
    random: [u64; N],
    high: [f64; N],
    low: [[f64; N]; 2],
    /// Coefficients of the corners of a pulsed jet: all voices have the same rate.
    corners: (f64, f64),
    hiss: [[f64; N]; TICK],
}

/// A whole number of 64 bits with a sign as the nearest number of double precision: its halves are exact, so their sum is rounded
/// once, as the processor's own conversion is. That has no vectors without AVX-512.
#[inline(always)]
fn nearest(number: u64) -> f64 {
    let (high, low) = ((number >> 32) as u32 as i32, number as u32);
    f64::from(high) * 4_294_967_296.0 + f64::from(low)
}

impl<const N: usize> NoiseLanes<N> {
    /// Silent.
    pub fn new() -> Self {
        let none = [0.0; N];
        Self {
            strength: none,
            keep: none,
            built: none,
            mean: none,
            quiet: none,
            whisper: none,
            random: [0; N],
            high: none,
            low: [none; 2],
            corners: (0.0, 0.0),
            hiss: [none; TICK],
        }
    }

    /// Takes a voice that has begun a tick into a lane. `together`: its turbulence is to be [filled](Self::fill) in with that of the
    /// others, which must be [turbulent](BreathNoise::is_turbulent) too.
    pub fn take(&mut self, lane: usize, noise: &mut BreathNoise, together: bool) {
        self.strength[lane] = noise.strength;
        (self.keep[lane], self.built[lane]) = (noise.keep, noise.built);
        self.mean[lane] = noise.mean;
        self.quiet[lane] = noise.quiet;
        self.whisper[lane] = noise.whisper;
        if together {
            self.random[lane] = noise.random;
            self.high[lane] = noise.high;
            [self.low[0][lane], self.low[1][lane]] = noise.low;
            self.corners = noise.corners[Jet::Pulsed as usize];
            return;
        }
        noise.fill();
        for (lanes, hiss) in self.hiss.iter_mut().zip(&noise.hiss) {
            lanes[lane] = *hiss;
        }
    }

    /// See [`BreathNoise::fill`]: that of a pulsed jet, in all lanes.
    #[inline(always)]
    pub fn fill(&mut self) {
        let (low, high) = self.corners;
        let unit = high * UNIT;
        let (mut random, mut smooth, [mut once, mut twice]) = (self.random, self.high, self.low);
        for hiss in &mut self.hiss {
            for k in 0..N {
                random[k] = next(random[k]);
                smooth[k] += unit * nearest(random[k]) - high * smooth[k];
                once[k] += low * (smooth[k] - once[k]);
                twice[k] += low * (once[k] - twice[k]);
                hiss[k] = twice[k] + FLOOR * smooth[k];
            }
        }
        (self.random, self.high, self.low) = (random, smooth, [once, twice]);
    }

    /// A voice takes its noise back, which has been filled in `together` with others or alone.
    pub fn give_back(&self, lane: usize, noise: &mut BreathNoise, together: bool) {
        noise.built = self.built[lane];
        if !together {
            return;
        }
        noise.random = self.random[lane];
        noise.high = self.high[lane];
        noise.low = [self.low[0][lane], self.low[1][lane]];
    }

    /// Numbers that have become too small to compute with are 0 again, in empty lanes too.
    pub fn flush(&mut self) {
        self.built = self.built.map(still);
    }

    /// See [`BreathNoise::flow`].
    #[inline(always)]
    pub fn flow(&mut self, jet_flow: &[f64; N], at: usize) -> [f64; N] {
        let mut flow = [0.0; N];
        for k in 0..N {
            let moved = (jet_flow[k] - self.mean[k]).abs() - self.quiet[k];
            let turbulent = if moved > 0.0 { moved } else { 0.0 };
            self.built[k] = turbulent + self.keep[k] * self.built[k];
            flow[k] = (self.strength[k] * self.built[k] + self.whisper[k]) * self.hiss[at & (TICK - 1)][k];
        }
        flow
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_add_up_to_the_nearest_number() {
        let mut random = 1;
        let edges = [0, 1, u64::MAX, 1 << 63, (1 << 63) - 1, (1 << 53) + 1, 0xFFFF_FFFF, 1 << 32];
        for number in edges.into_iter().chain(
            std::iter::from_fn(|| {
                random = next(random);
                Some(random)
            })
            .take(100_000),
        ) {
            assert_eq!(nearest(number).to_bits(), (number as i64 as f64).to_bits(), "{number:x}");
        }
    }
}
