//! Output level: from radiated pressure to full scale, the gain on top of it, and the volume of controllers and notes.

use crate::dsp::glide::Glide;
use crate::instrument::channels::Channels;
use crate::instrument::settings::Settings;
use crate::maths;
use crate::units::{REFERENCE_RADIUS_M, clamped_or};

/// Full scale per pascal at 1 m from a B flat clarinet: 1 Pa is -6 dBFS. A larger instrument is heard from further away,
/// in proportion to its nominal bore. So two instruments that differ only in size are equally loud, and a bass does not
/// drive the limiter all the time.
const FULL_SCALE_PER_PA: f64 = 0.501_187_233_627_272_2;
/// Time constant with which the gain goes to its setting, s: of first order.
const GAIN_S: f64 = 0.02;
/// Time that a change of the volume takes, s.
const VOLUME_S: f64 = 0.010;
/// Largest factor of the volume: that of a CLAP note expression.
const VOLUME_MOST: f32 = 4.0;

/// The gain of one instrument, which follows its setting without a click, and the volume.
pub(super) struct OutputLevel {
    full_scale_per_pa: f64,
    gain: f32,
    target: f32,
    step: f32,
    volume: Glide,
    /// No sample has passed since [`settle`](Self::settle): a new gain cannot click, so it holds from the first sample on.
    is_fresh: bool,
}

impl OutputLevel {
    /// At the default setting, for an instrument of this nominal radius, m, and the host's rate, Hz.
    pub fn new(nominal_radius_m: f64, host_rate_hz: f64) -> Self {
        let full_scale_per_pa = FULL_SCALE_PER_PA * (REFERENCE_RADIUS_M / nominal_radius_m);
        let gain = gain(&Settings::default(), full_scale_per_pa);
        Self {
            full_scale_per_pa,
            gain,
            target: gain,
            step: (1.0 / (GAIN_S * host_rate_hz)) as f32,
            volume: Glide::new(1.0, VOLUME_S, host_rate_hz),
            is_fresh: false,
        }
    }

    /// Goes to a volume, a factor of 0..=4.
    pub fn set_volume(&mut self, volume: f32) {
        self.volume.go_to(clamped_or(volume, 0.0, VOLUME_MOST, 1.0));
    }

    /// Takes over the volume of the instrument that this one replaces.
    pub fn carry_on(&mut self, from: &Self) {
        self.settle();
        self.volume = from.volume;
    }

    /// Goes to the volume of another player.
    pub fn follow(&mut self, from: &Self) {
        self.volume.go_to(from.volume.target());
    }

    /// Arrives at once, with the volume at 1.
    pub fn reset(&mut self) {
        self.settle();
        self.volume.set(1.0);
    }

    /// Goes to the gain of these settings.
    pub fn set(&mut self, settings: &Settings) {
        self.target = gain(settings, self.full_scale_per_pa);
        if self.is_fresh {
            self.gain = self.target;
        }
    }

    /// Arrives at once.
    pub fn settle(&mut self) {
        self.gain = self.target;
        self.is_fresh = true;
    }

    /// How many times larger samples are than without the user's gain; 1 where the gain makes them smaller.
    pub fn boost(&self) -> f32 {
        (self.gain / self.full_scale_per_pa as f32).max(1.0)
    }

    /// Pascals become samples.
    pub fn apply(&mut self, mut out: Channels) {
        self.is_fresh = false;
        if self.gain == self.target {
            out.each(|channel| channel.iter_mut().for_each(|sample| *sample *= self.gain));
        } else {
            out.each_moment(|| {
                if self.gain != self.target {
                    let next = self.gain + (self.target - self.gain) * self.step;
                    // A step that no longer changes the number would never arrive.
                    let is_there = next == self.gain || (next - self.gain).abs() < 1e-9;
                    self.gain = if is_there { self.target } else { next };
                }
                self.gain
            });
        }
        if !self.volume.rests_at(1.0) {
            out.each_moment(|| self.volume.next());
        }
    }
}

fn gain(settings: &Settings, full_scale_per_pa: f64) -> f32 {
    (full_scale_per_pa * maths::pow(10.0, f64::from(settings.gain_db) / 20.0)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn applied(level: &mut OutputLevel) -> [f32; 4] {
        let mut out = [1.0; 4];
        level.apply(Channels::one(&mut out));
        out
    }

    #[test]
    fn after_a_reset_it_does_not_matter_whether_the_gain_came_before_or_after() {
        let quiet = Settings { gain_db: -12.0, ..Settings::default() };
        let fresh = || OutputLevel::new(REFERENCE_RADIUS_M, 48_000.0);
        let (mut before, mut after) = (fresh(), fresh());
        before.set(&quiet);
        before.settle();
        after.settle();
        after.set(&quiet);
        let first = applied(&mut before);
        assert_eq!(applied(&mut after), first);
        assert_eq!(first[0], first[3], "it does not glide");
        // While it plays, it glides.
        after.set(&Settings::default());
        let gliding = applied(&mut after);
        assert!(gliding[0] < gliding[3], "{gliding:?}");
    }

    #[test]
    fn a_gain_arrives() {
        for (from, to) in [(-10.0, -2.5), (0.0, -20.0), (-60.0, 24.0)] {
            let at = |gain_db| Settings { gain_db, ..Settings::default() };
            let mut level = OutputLevel::new(REFERENCE_RADIUS_M, 192_000.0);
            level.set(&at(from));
            level.settle();
            applied(&mut level);
            level.set(&at(to));
            (0..40_000).for_each(|_| _ = applied(&mut level));
            assert_eq!(level.gain, level.target, "{from} to {to} dB");
        }
    }
}
