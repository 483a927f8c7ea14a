//! The last moments inside the instrument, kept for a screen. Nothing is kept while nobody looks.

use crate::instrument::voice::{Probe, TICK};
use crate::units::SoundingNote;

/// Moments kept: 43 ms at every second sample of 96 kHz, six periods of the lowest note.
pub const MOMENTS: usize = 2_048;
/// Of so many samples one is kept.
const EVERY: usize = 2;

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

/// The last [`MOMENTS`] moments. Real-time safe but for [`new`](Self::new).
pub struct Watch {
    moments: Box<[Moment]>,
    next: usize,
}

impl Default for Watch {
    fn default() -> Self {
        Self { moments: vec![Moment::default(); MOMENTS].into(), next: 0 }
    }
}

impl Watch {
    /// Takes what happened in a control tick.
    pub fn take(&mut self, probes: &[Probe; TICK]) {
        for probe in probes.iter().step_by(EVERY) {
            self.moments[self.next % MOMENTS] = Moment {
                mouthpiece_kpa: 1e-3 * probe.p_mouthpiece_pa as f32,
                opening: probe.opening as f32,
                flow_cm3s: 1e6 * probe.flow_m3s as f32,
            };
            self.next = (self.next + 1) % MOMENTS;
        }
    }

    /// Moments a second, for the rate of the voice.
    pub fn rate_hz(voice_rate_hz: f64) -> f64 {
        voice_rate_hz / EVERY as f64
    }

    /// All moments, oldest first.
    pub fn copy_to(&self, all: &mut [Moment; MOMENTS]) {
        let (newest, oldest) = self.moments.split_at(self.next);
        all[..oldest.len()].copy_from_slice(oldest);
        all[oldest.len()..].copy_from_slice(newest);
    }

    /// As new.
    pub fn clear(&mut self) {
        self.moments.fill(Moment::default());
        self.next = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_come_oldest_first_whatever_has_been_overwritten() {
        let mut watch = Watch::default();
        let mut all = [Moment::default(); MOMENTS];
        let ticks = 3 * MOMENTS / TICK + 5;
        for tick in 0..ticks {
            let probe = |n: usize| Probe { opening: (tick * TICK + n) as f64, ..Probe::default() };
            watch.take(&std::array::from_fn(probe));
        }
        watch.copy_to(&mut all);
        assert_eq!(all[MOMENTS - 1].opening, (ticks * TICK - EVERY) as f32);
        assert!(all.windows(2).all(|pair| pair[1].opening - pair[0].opening == EVERY as f32));
    }
}
