//! A shelf of first order: what a microphone at one place may add to what the instrument sends everywhere.

use crate::maths;
use std::f64::consts::PI;

/// A filter that leaves lows as they are and lifts highs.
///
/// `H(s) = (1 + s/z) / (1 + s/p)` with `z = w / sqrt G`, `p = w sqrt G`, by the bilinear transform, which is right at `w`: the
/// middle is prewarped.
///
/// ```
/// use chalumeau_core::measure::shelf::Shelf;
///
/// let mut sound = vec![1.0, 0.0, 0.0, 0.0];
/// Shelf { middle_hz: 4_000.0, lift_db: 0.0 }.apply(&mut sound, 44_100.0);
/// assert_eq!(sound, [1.0, 0.0, 0.0, 0.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shelf {
    /// Where half of the lift is reached, Hz; below half the rate.
    pub middle_hz: f64,
    /// Gain of the highs, dB; negative cuts.
    pub lift_db: f64,
}

impl Shelf {
    /// Filters samples at `rate_hz`, from rest.
    pub fn apply(&self, samples: &mut [f64], rate_hz: f64) {
        let root = maths::pow(10.0, self.lift_db / 40.0);
        let half = PI * self.middle_hz / rate_hz;
        let turn = maths::cos(half) / maths::sin(half);
        let (zero, pole) = (turn * root, turn / root);
        let scale = 1.0 / (1.0 + pole);
        let (now, before, back) = ((1.0 + zero) * scale, (1.0 - zero) * scale, (1.0 - pole) * scale);
        let (mut last_in, mut last_out) = (0.0, 0.0);
        for sample in samples {
            let out = now * *sample + before * last_in - back * last_out;
            (last_in, last_out) = (*sample, out);
            *sample = out;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::rms;

    #[test]
    fn lows_stay_highs_rise_and_half_the_lift_is_in_the_middle() {
        const RATE_HZ: f64 = 44_100.0;
        let shelf = Shelf { middle_hz: 3_000.0, lift_db: 4.0 };
        for (hz, wanted_db) in [(30.0, 0.0), (3_000.0, 2.0), (21_000.0, 4.0)] {
            let mut sound: Vec<f64> =
                (0..44_100).map(|n| (2.0 * PI * hz * f64::from(n) / RATE_HZ).sin()).collect();
            let before = rms(&sound);
            shelf.apply(&mut sound, RATE_HZ);
            let gain_db = 20.0 * (rms(&sound) / before).log10();
            assert!((gain_db - wanted_db).abs() < 0.1, "{hz} Hz: {gain_db} dB");
        }
    }

    #[test]
    fn the_middle_is_in_the_middle_near_half_the_rate_too() {
        const RATE_HZ: f64 = 44_100.0;
        for middle_hz in [8_000.0, 15_000.0, 20_000.0] {
            let mut sound: Vec<f64> =
                (0..44_100).map(|n| (2.0 * PI * middle_hz * f64::from(n) / RATE_HZ).sin()).collect();
            let before = rms(&sound);
            Shelf { middle_hz, lift_db: 4.0 }.apply(&mut sound, RATE_HZ);
            let gain_db = 20.0 * (rms(&sound) / before).log10();
            assert!((gain_db - 2.0).abs() < 0.02, "{middle_hz} Hz: {gain_db} dB");
        }
    }
}
