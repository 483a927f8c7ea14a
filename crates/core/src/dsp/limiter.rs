//! A safety limiter: it changes nothing below full scale and lowers the gain above it, without distorting the waveform.
//!
//! The gain follows the envelope of the peaks: it falls at once and recovers slowly, so that a steady loud note is
//! turned down without being distorted. Nothing ever leaves -1..=1.

use super::lanes::any_above;
use crate::maths;

/// Peaks up to here pass untouched.
pub const CEILING: f32 = 0.98;
/// Time in which the gain recovers by a factor e, s.
const RECOVERY_S: f64 = 0.2;

/// A limiter with its envelope.
///
/// ```
/// use chalumeau_core::dsp::limiter::Limiter;
///
/// let mut samples = [0.5, 3.0, -3.0];
/// Limiter::new(48_000.0).process(&mut samples);
/// assert!(samples[0] == 0.5 && samples.iter().all(|sample| sample.abs() <= 1.0));
/// ```
#[derive(Clone, Debug)]
pub struct Limiter {
    envelope: f32,
    recovery: f32,
}

impl Limiter {
    /// A limiter at a sample rate.
    pub fn new(rate_hz: f64) -> Self {
        Self { envelope: 0.0, recovery: maths::exp(-1.0 / (RECOVERY_S * rate_hz)) as f32 }
    }

    /// Turns down what is too loud; samples must be finite. Real-time safe.
    pub fn process(&mut self, samples: &mut [f32]) {
        // The usual case. An envelope below the ceiling does nothing, now or later, and need not be followed.
        if self.envelope <= CEILING && !any_above(samples, CEILING) {
            return;
        }
        for sample in samples {
            self.envelope = (self.envelope * self.recovery).max(sample.abs());
            if self.envelope > CEILING {
                *sample *= CEILING / self.envelope;
            }
        }
    }

    /// Turns down one moment of two channels alike. Real-time safe.
    pub fn process_pair(&mut self, left: &mut f32, right: &mut f32) {
        self.envelope = (self.envelope * self.recovery).max(left.abs()).max(right.abs());
        if self.envelope > CEILING {
            *left *= CEILING / self.envelope;
            *right *= CEILING / self.envelope;
        }
    }

    /// Whether nothing has been too loud of late.
    pub fn is_idle(&self) -> bool {
        self.envelope <= CEILING
    }

    /// As [`process`](Self::process) for two channels of the same length, which keep their balance. Real-time safe.
    pub fn process_two(&mut self, left: &mut [f32], right: &mut [f32]) {
        if self.envelope <= CEILING && !any_above(left, CEILING) && !any_above(right, CEILING) {
            return;
        }
        for (left, right) in left.iter_mut().zip(right) {
            self.process_pair(left, right);
        }
    }

    /// Forgets the envelope, as after [`new`](Self::new). Real-time safe.
    pub fn reset(&mut self) {
        self.envelope = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(level: f64) -> Vec<f32> {
        (0..48_000).map(|n| (level * (f64::from(n) * 0.13).sin()) as f32).collect()
    }

    #[test]
    fn below_the_ceiling_nothing_changes() {
        let (mut limiter, tone) = (Limiter::new(48_000.0), sine(0.97));
        let mut out = tone.clone();
        limiter.process(&mut out);
        assert_eq!(out, tone);
    }

    #[test]
    fn nothing_leaves_full_scale_and_a_steady_tone_stays_a_sine() {
        let (mut limiter, mut out) = (Limiter::new(48_000.0), sine(4.0));
        limiter.process(&mut out);
        assert!(out.iter().all(|x| x.abs() <= 1.0));
        // What is left after taking the best sine out of the second half.
        let (mut s, mut c) = (0.0, 0.0);
        let tail = &out[24_000..];
        let phase = |n: usize| (n + 24_000) as f64 * 0.13;
        for (n, &x) in tail.iter().enumerate() {
            s += f64::from(x) * phase(n).sin() * 2.0 / tail.len() as f64;
            c += f64::from(x) * phase(n).cos() * 2.0 / tail.len() as f64;
        }
        let rest: f64 = tail
            .iter()
            .enumerate()
            .map(|(n, &x)| (f64::from(x) - s * phase(n).sin() - c * phase(n).cos()).powi(2))
            .sum();
        let whole: f64 = tail.iter().map(|&x| f64::from(x).powi(2)).sum();
        assert!(rest / whole < 1e-5, "{}", rest / whole);
    }

    #[test]
    fn two_channels_keep_their_balance_and_equal_ones_sound_as_one() {
        let (mut one, mut two) = (Limiter::new(48_000.0), Limiter::new(48_000.0));
        let (mut mono, mut left, mut right) = (sine(4.0), sine(4.0), sine(4.0));
        one.process(&mut mono);
        two.process_two(&mut left, &mut right);
        assert!(left == mono && right == mono);
        let (mut left, mut right) = (sine(4.0), sine(1.0));
        two.process_two(&mut left, &mut right);
        for (left, right) in left.iter().zip(&right) {
            assert!(left.abs() <= 1.0 && (left - 4.0 * right).abs() < 1e-5);
        }
    }

    #[test]
    fn a_spike_is_caught_at_once_and_forgotten() {
        let mut limiter = Limiter::new(48_000.0);
        let mut out = vec![0.0, 100.0, 0.5];
        limiter.process(&mut out);
        assert!(out[1] <= 1.0 && out[2] < 0.5);
        let mut later = sine(0.5);
        limiter.process(&mut later);
        limiter.process(&mut later);
        assert!(limiter.envelope <= CEILING);
    }
}
