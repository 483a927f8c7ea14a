//! A sound at a lower rate: for measurements that need little of its band, and cost less so.

use crate::analysis::{BLACKMAN_HARRIS, cosine_window};
use crate::maths;
use std::f64::consts::PI;

/// Length of the low-pass filter, samples of the lower rate.
const REACH: usize = 32;
/// Where the filter has half its gain, over the lower rate. The window of [`REACH`] samples takes an eighth of the rate from pass to stop on
/// either side. So everything below a third of the lower rate is kept, and what is folded down lies above 0.42 of it.
const CUTOFF: f64 = 0.45;
/// Numbers that are summed side by side: each sum alone waits for its last addition.
const SIDE_BY_SIDE: usize = 8;

/// The sound at the lowest whole part of its rate that is not below `least_hz`, and that rate, Hz. Below a third of it harmonics keep
/// their levels within 0.001 dB, and foreign ones lie 90 dB down; 16 samples of the lower rate are lost at either end. Allocates.
pub(crate) fn slower(samples: &[f64], rate_hz: f64, least_hz: f64) -> (Vec<f64>, f64) {
    let by = (rate_hz / least_hz) as usize;
    if by < 2 {
        return (samples.to_vec(), rate_hz);
    }
    let len = REACH * by;
    let middle = len as f64 / 2.0;
    let taps: Vec<f64> = cosine_window(len, &BLACKMAN_HARRIS)
        .zip(0..)
        .map(|(window, at)| {
            let x = 2.0 * PI * CUTOFF * (f64::from(at) - middle) / by as f64;
            let sinc = if x == 0.0 { 1.0 } else { maths::sin(x) / x };
            2.0 * CUTOFF / by as f64 * window * sinc
        })
        .collect();
    let sum = |part: &[f64]| {
        let mut sums = [0.0; SIDE_BY_SIDE];
        for (part, taps) in part.chunks_exact(SIDE_BY_SIDE).zip(taps.chunks_exact(SIDE_BY_SIDE)) {
            for ((sum, x), tap) in sums.iter_mut().zip(part).zip(taps) {
                *sum += x * tap;
            }
        }
        sums.iter().sum()
    };
    (samples.windows(len).step_by(by).map(sum).collect(), rate_hz / by as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::rms;
    use crate::analysis::synthetic::tone;

    /// The sound at 96 kHz, and at the lower rate.
    fn both(hz: f64) -> (Vec<f64>, Vec<f64>) {
        let sound = tone(hz, 96_000.0, 0.2, &[0.0]);
        let (low, rate_hz) = slower(&sound, 96_000.0, 22_000.0);
        assert_eq!(rate_hz, 24_000.0);
        assert_eq!(low.len(), (19_200 - 32 * 4) / 4 + 1);
        (sound, low)
    }

    #[test]
    fn a_third_of_the_lower_rate_stays_and_what_would_fold_there_goes() {
        for hz in [100.0, 1_000.0, 4_000.0, 7_000.0, 7_900.0] {
            let (sound, low) = both(hz);
            let off = low.iter().zip(sound[64..].iter().step_by(4)).map(|(low, here)| (low - here).abs());
            let worst = off.fold(0.0, f64::max);
            assert!(worst < 1e-4, "{hz} Hz: {worst}");
        }
        for hz in [14_000.0, 17_000.0, 24_000.0, 31_000.0, 47_000.0] {
            let left = rms(&both(hz).1);
            assert!(left < 2.2e-5, "{hz} Hz: {left}");
        }
    }

    #[test]
    fn a_rate_that_is_low_enough_stays() {
        let sound = tone(440.0, 30_000.0, 0.1, &[0.0]);
        assert_eq!(slower(&sound, 30_000.0, 22_000.0), (sound, 30_000.0));
        assert!(slower(&[0.0; 10], 96_000.0, 22_000.0).0.is_empty());
    }
}
