//! Pitch by YIN (A. de Cheveigne & H. Kawahara, JASA 111, 1917, 2002), as the recordings were measured.
//!
//! [`pitch`](super::pitch) is more exact and is used everywhere else. This estimator exists because a comparison with
//! recordings must find the same period in the same way.

use crate::analysis::{is_hz, without_mean};
use chalumeau_fft as fft;
use num_complex::Complex64;

/// Range looked at, Hz.
const LOWEST_HZ: f64 = 50.0;
const HIGHEST_HZ: f64 = 2_500.0;
/// The first dip of the normalised difference below this is the period.
const DIP: f64 = 0.1;
/// Without such a dip, the deepest one counts up to this.
const DEEPEST: f64 = 0.3;

/// Fundamental of a slice of about 1 s, Hz: the first dip of the cumulative-mean-normalised difference below 0.1, followed
/// down to its minimum (else the deepest one, if at most 0.3), refined by a parabola on the difference. `None` if there is
/// neither, if the slice is too short, if a sample is not finite, or if the rate is not a number of Hz. Allocates.
///
/// ```
/// use chalumeau_core::analysis::yin;
///
/// let tone: Vec<f64> = (0..44_100).map(|n| (std::f64::consts::TAU * 440.0 * f64::from(n) / 44_100.0).sin()).collect();
/// assert!((yin::fundamental_hz(&tone, 44_100.0).unwrap() - 440.0).abs() < 0.05);
/// ```
pub fn fundamental_hz(samples: &[f64], rate_hz: f64) -> Option<f64> {
    if !is_hz(rate_hz) || !samples.iter().all(|sample| sample.is_finite()) {
        return None;
    }
    let longest = (rate_hz / LOWEST_HZ) as usize + 2;
    let window = samples.len().checked_sub(longest).filter(|window| *window >= longest)?;
    let difference = difference(&without_mean(samples), window, longest);
    let mut sum = 0.0;
    let normalised: Vec<f64> = difference
        .iter()
        .enumerate()
        .map(|(lag, value)| {
            sum += value;
            if lag == 0 { 1.0 } else { value * lag as f64 / sum.max(1e-30) }
        })
        .collect();
    let shortest = (rate_hz / HIGHEST_HZ) as usize;
    let lag = match (shortest..longest).find(|&lag| normalised[lag] < DIP) {
        Some(mut lag) => {
            while lag + 1 < longest && normalised[lag + 1] < normalised[lag] {
                lag += 1;
            }
            lag
        }
        None => {
            let deepest = (shortest..longest).min_by(|&a, &b| normalised[a].total_cmp(&normalised[b]))?;
            Some(deepest).filter(|&lag| normalised[lag] <= DEEPEST)?
        }
    };
    let (left, middle, right) = (difference[lag - 1], difference[lag], difference[lag + 1]);
    let bend = left - 2.0 * middle + right;
    let part = if bend > 0.0 { 0.5 * (left - right) / bend } else { 0.0 };
    Some(rate_hz / (lag as f64 + part))
}

/// Sum over `window` samples of the squared difference between the slice and itself `lag` samples later, for lags up to
/// `longest`.
fn difference(samples: &[f64], window: usize, longest: usize) -> Vec<f64> {
    let size = (samples.len() + window).next_power_of_two();
    let first = fft::forward(&samples[..window], size);
    let all = fft::forward(samples, size);
    let product: Vec<Complex64> = first.iter().zip(&all).map(|(a, b)| a.conj() * b).collect();
    let correlation = fft::inverse(product, size);
    let mut energy = Vec::with_capacity(samples.len() + 1);
    energy.push(0.0);
    let mut sum = 0.0;
    energy.extend(samples.iter().map(|sample| {
        sum += sample * sample;
        sum
    }));
    let power = |lag: usize| energy[window + lag] - energy[lag];
    (0..=longest).map(|lag| (power(0) + power(lag) - 2.0 * correlation[lag] / size as f64).max(0.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::synthetic::{CLARINET_DB, mix, noise, tone};
    use crate::units::cents;

    #[test]
    fn clarinet_tones_are_found_within_three_cents() {
        for f0_hz in [146.83, 233.1, 466.2, 932.3, 1_568.0] {
            let heard = fundamental_hz(&tone(f0_hz, 44_100.0, 1.0, &CLARINET_DB), 44_100.0).unwrap();
            assert!(cents(heard, f0_hz).abs() < 3.0, "{f0_hz}: {heard}");
        }
    }

    #[test]
    fn noise_and_silence_have_no_pitch() {
        assert_eq!(fundamental_hz(&noise(0.1, 44_100), 44_100.0), None);
        assert_eq!(fundamental_hz(&[0.0; 100], 44_100.0), None);
        assert_eq!(fundamental_hz(&[f64::NAN; 44_100], 44_100.0), None);
        assert_eq!(fundamental_hz(&[0.0; 44_100], f64::INFINITY), None);
        let clean = tone(220.0, 44_100.0, 1.0, &CLARINET_DB);
        let noisy = mix(&clean, &noise(0.02, clean.len()));
        assert!(cents(fundamental_hz(&noisy, 44_100.0).unwrap(), 220.0).abs() < 5.0);
    }
}
