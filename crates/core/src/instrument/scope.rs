//! An oscilloscope inside the instrument, for a screen: pressure, opening and flow at the reed.
//!
//! One capture holds at least one period of the lowest note. After each capture the voice goes unprobed for three times
//! as long as the capture took: a screen needs no more, and the audio thread saves the work.

use crate::instrument::voice::{Probe, TICK};

/// Samples of one capture.
pub const SCOPE_SAMPLES: usize = 672;
/// Periods of the lowest note in a capture, at least: one whole period from any point where the drawing begins.
const PERIODS: f64 = 2.0;
/// Length of the pause after a capture, in captures.
const PAUSE: usize = 3;

/// One sample inside the instrument.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ScopeSample {
    /// Pressure in the mouthpiece, kPa.
    pub mouthpiece_kpa: f32,
    /// Reed opening over the rest opening.
    pub opening: f32,
    /// Flow through the reed, cm3/s.
    pub flow_cm3s: f32,
}

/// Records captures. Real-time safe except for [`new`](Self::new).
pub struct Scope {
    samples: Box<[ScopeSample; SCOPE_SAMPLES]>,
    taken: usize,
    /// One of so many samples of the voice is kept.
    every: usize,
    /// Samples to skip in the next tick.
    skip: usize,
    /// Ticks left of the pause.
    pause: usize,
    captures: u64,
}

impl Scope {
    /// For a voice at `rate_hz` on an instrument whose lowest note is `lowest_hz`. Allocates.
    pub fn new(rate_hz: f64, lowest_hz: f64) -> Self {
        let every = (PERIODS * rate_hz / lowest_hz / SCOPE_SAMPLES as f64).ceil();
        Self {
            samples: Box::new([ScopeSample::default(); SCOPE_SAMPLES]),
            taken: 0,
            every: (every as usize).max(1),
            skip: 0,
            pause: 0,
            captures: 0,
        }
    }

    /// Records one control tick; true if the capture is complete.
    pub fn record(&mut self, probes: &[Probe; TICK]) -> bool {
        let mut at = self.skip;
        while at < TICK && self.taken < SCOPE_SAMPLES {
            let probe = &probes[at];
            self.samples[self.taken] = ScopeSample {
                mouthpiece_kpa: 1e-3 * probe.p_mouthpiece_pa as f32,
                opening: probe.opening as f32,
                flow_cm3s: 1e6 * probe.flow_m3s as f32,
            };
            self.taken += 1;
            at += self.every;
        }
        self.skip = at.saturating_sub(TICK);
        if self.taken < SCOPE_SAMPLES {
            return false;
        }
        self.captures += 1;
        self.skip = 0;
        self.pause = PAUSE * SCOPE_SAMPLES * self.every / TICK;
        true
    }

    /// Lets one control tick of the pause pass; true if the next capture begins.
    pub fn rest(&mut self) -> bool {
        self.pause = self.pause.saturating_sub(1);
        if self.pause == 0 {
            self.taken = 0;
        }
        self.pause == 0
    }

    /// Discards what was recorded and begins a capture.
    pub fn restart(&mut self) {
        (self.taken, self.skip, self.pause) = (0, 0, 0);
    }

    /// The latest capture with its number, oldest sample first; `None` while the next one is recorded.
    pub fn capture(&self) -> Option<(u64, &[ScopeSample; SCOPE_SAMPLES])> {
        (self.taken == SCOPE_SAMPLES).then_some((self.captures, &*self.samples))
    }

    /// Samples of a capture per second, Hz, for a voice at `voice_rate_hz`.
    pub fn rate_hz(&self, voice_rate_hz: f64) -> f64 {
        voice_rate_hz / self.every as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn captured(every: usize) -> (Vec<f32>, usize) {
        let mut scope = Scope::new((every * SCOPE_SAMPLES) as f64, PERIODS);
        assert_eq!(scope.every, every);
        let (mut tick, mut full) = (0, false);
        while !full {
            let probe = |n: usize| Probe { opening: (tick * TICK + n) as f64, ..Probe::default() };
            full = scope.record(&std::array::from_fn(probe));
            assert_eq!(scope.capture().is_some(), full);
            tick += 1;
        }
        let openings = scope.capture().unwrap().1.iter().map(|sample| sample.opening).collect();
        let mut pause = 1;
        while !scope.rest() {
            assert!(scope.capture().is_some());
            pause += 1;
        }
        assert!(scope.capture().is_none());
        (openings, pause)
    }

    #[test]
    fn samples_are_at_equal_steps_whatever_the_ticks() {
        for every in [1, 2, 3, 5, 16, 23] {
            let (openings, pause) = captured(every);
            assert_eq!(openings[0], 0.0);
            assert!(openings.windows(2).all(|pair| pair[1] - pair[0] == every as f32), "{every}");
            assert!((pause * TICK).abs_diff(PAUSE * SCOPE_SAMPLES * every) < TICK, "{every}");
        }
    }
}
