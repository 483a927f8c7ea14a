//! Moments inside the instrument, for a screen. Nothing is kept while nobody looks.
//!
//! A picture is a run of moments that holds at least one period of the lowest note. Between two pictures the voice goes
//! unprobed for three times as long as one takes: a screen needs no more, and the audio thread hardly notices.

use crate::instrument::voice::{Probe, TICK};
use crate::units::SoundingNote;

/// Moments of a picture.
pub const MOMENTS: usize = 672;
/// Periods of the lowest note in a picture, at least: a whole one from wherever it is to begin.
const PERIODS: f64 = 2.0;
/// So much longer than a picture is the pause after it.
const PAUSE: usize = 3;

/// One moment inside.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Pressure in the mouthpiece, kPa.
    pub mouthpiece_kpa: f32,
    /// Reed opening over the rest opening.
    pub opening: f32,
    /// Flow through the reed, cm3/s.
    pub flow_cm3s: f32,
}

/// What the player is at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Now {
    /// The note that is held, if any.
    pub sounding: Option<SoundingNote>,
    /// Index of the fingering in place.
    pub fingering: usize,
    /// Mouth pressure, kPa.
    pub mouth_kpa: f32,
}

/// Takes pictures. Real-time safe but for [`new`](Self::new).
pub struct Watch {
    moments: Box<[Moment; MOMENTS]>,
    taken: usize,
    /// Of so many samples one is kept.
    every: usize,
    /// Samples of the next tick that are passed over.
    skip: usize,
    /// Ticks of the pause that are left.
    pause: usize,
    pictures: u64,
}

impl Watch {
    /// For a voice at this rate whose lowest note is this, both Hz. Allocates.
    pub fn new(rate_hz: f64, lowest_hz: f64) -> Self {
        let every = (PERIODS * rate_hz / lowest_hz / MOMENTS as f64).ceil();
        Self {
            moments: Box::new([Moment::default(); MOMENTS]),
            taken: 0,
            every: (every as usize).max(1),
            skip: 0,
            pause: 0,
            pictures: 0,
        }
    }

    /// Takes what happened in a control tick; whether the picture is complete.
    pub fn take(&mut self, probes: &[Probe; TICK]) -> bool {
        let mut at = self.skip;
        while at < TICK && self.taken < MOMENTS {
            let probe = &probes[at];
            self.moments[self.taken] = Moment {
                mouthpiece_kpa: 1e-3 * probe.p_mouthpiece_pa as f32,
                opening: probe.opening as f32,
                flow_cm3s: 1e6 * probe.flow_m3s as f32,
            };
            self.taken += 1;
            at += self.every;
        }
        self.skip = at.saturating_sub(TICK);
        if self.taken < MOMENTS {
            return false;
        }
        self.pictures += 1;
        self.skip = 0;
        self.pause = PAUSE * MOMENTS * self.every / TICK;
        true
    }

    /// Lets a control tick pass; whether the next picture begins.
    pub fn rest(&mut self) -> bool {
        self.pause = self.pause.saturating_sub(1);
        if self.pause == 0 {
            self.taken = 0;
        }
        self.pause == 0
    }

    /// Begins a picture, whatever was.
    pub fn restart(&mut self) {
        (self.taken, self.skip, self.pause) = (0, 0, 0);
    }

    /// The latest picture with its number, oldest moment first; none while the next is taken.
    pub fn picture(&self) -> Option<(u64, &[Moment; MOMENTS])> {
        (self.taken == MOMENTS).then_some((self.pictures, &*self.moments))
    }

    /// Moments a second, for the rate of the voice.
    pub fn rate_hz(&self, voice_rate_hz: f64) -> f64 {
        voice_rate_hz / self.every as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(every: usize) -> (Vec<f32>, usize) {
        let mut watch = Watch::new((every * MOMENTS) as f64, PERIODS);
        assert_eq!(watch.every, every);
        let (mut tick, mut full) = (0, false);
        while !full {
            let probe = |n: usize| Probe { opening: (tick * TICK + n) as f64, ..Probe::default() };
            full = watch.take(&std::array::from_fn(probe));
            assert_eq!(watch.picture().is_some(), full);
            tick += 1;
        }
        let openings = watch.picture().unwrap().1.iter().map(|moment| moment.opening).collect();
        let mut pause = 1;
        while !watch.rest() {
            assert!(watch.picture().is_some());
            pause += 1;
        }
        assert!(watch.picture().is_none());
        (openings, pause)
    }

    #[test]
    fn moments_are_at_equal_steps_whatever_the_ticks() {
        for every in [1, 2, 3, 5, 16, 23] {
            let (openings, pause) = picture(every);
            assert_eq!(openings[0], 0.0);
            assert!(openings.windows(2).all(|pair| pair[1] - pair[0] == every as f32), "{every}");
            assert!((pause * TICK).abs_diff(PAUSE * MOMENTS * every) < TICK, "{every}");
        }
    }
}
