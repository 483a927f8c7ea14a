//! Noise of a steady note in bands of frequency, relative to the whole tone.
//!
//! The power between the harmonics is measured where no harmonic is near, and stands for the whole band: the median of its
//! bins times their number. So neither the share of the band that harmonics hide nor a foreign line counts. The median of
//! noise lies 1.6 dB below its mean; recordings were read in the same way.

use crate::analysis::{BLACKMAN_HARRIS, cosine_window, upper_median, without_mean};
use crate::maths;
use chalumeau_fft as fft;

/// Bands in which the breath noise of recorded notes was measured, Hz.
pub const BANDS_HZ: [(f64, f64); 5] =
    [(300.0, 1_000.0), (1_000.0, 2_000.0), (2_000.0, 4_000.0), (4_000.0, 8_000.0), (8_000.0, 15_000.0)];

/// Share of the distance between two harmonics that is measured, around the middle: far from both even where the pitch
/// wanders by some cents at the highest harmonic.
const MIDDLE: f64 = 0.4;

/// Level of the noise in each of `bands_hz`, dB re the power of the whole slice; minus infinity where nothing can be
/// measured. `f0_hz` must be right to about a cent. Allocates.
pub fn noise_db(samples: &[f64], rate_hz: f64, f0_hz: f64, bands_hz: &[(f64, f64)]) -> Vec<f64> {
    let samples = without_mean(samples);
    let window: Vec<f64> = cosine_window(samples.len(), &BLACKMAN_HARRIS).collect();
    let gain: f64 = window.iter().map(|w| w * w).sum();
    let total = samples.iter().map(|x| x * x).sum::<f64>() / samples.len().max(1) as f64;
    let windowed: Vec<f64> = samples.iter().zip(&window).map(|(x, w)| x * w).collect();
    if windowed.is_empty() || total <= 0.0 {
        return vec![f64::NEG_INFINITY; bands_hz.len()];
    }
    let bins = fft::forward(&windowed, windowed.len());
    let bin_hz = rate_hz / windowed.len() as f64;
    let between = |hz: f64| {
        let place = (hz / f0_hz).fract();
        (place - 0.5).abs() < 0.5 * MIDDLE
    };
    bands_hz
        .iter()
        .map(|&(low_hz, high_hz)| {
            let (first, last) = ((low_hz / bin_hz).ceil() as usize, (high_hz / bin_hz) as usize);
            let measured = (first..=last.min(bins.len().saturating_sub(1)))
                .filter(|&bin| between(bin as f64 * bin_hz))
                .map(|bin| bins[bin].norm_sqr());
            let Some(power) = upper_median(measured) else { return f64::NEG_INFINITY };
            // One-sided power per bin of white noise with variance v: v times the sum of the squared window.
            let per_bin = 2.0 * power / gain / windowed.len() as f64;
            let whole = per_bin * (high_hz - low_hz) / bin_hz;
            if whole > 0.0 { 10.0 * maths::log10(whole / total) } else { f64::NEG_INFINITY }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::synthetic::{CLARINET_DB, mix, noise, tone};

    #[test]
    fn white_noise_reads_at_its_level_in_every_band() {
        let clean = tone(196.0, 44_100.0, 3.0, &CLARINET_DB);
        let noisy = mix(&clean, &noise(0.01, clean.len()));
        let total = clean.iter().map(|x| x * x).sum::<f64>() / clean.len() as f64;
        for ((low_hz, high_hz), heard) in
            BANDS_HZ.into_iter().zip(noise_db(&noisy, 44_100.0, 196.0, &BANDS_HZ))
        {
            let median = std::f64::consts::LN_2;
            let expected = 10.0 * (1e-4 * median * (high_hz - low_hz) / 22_050.0 / total).log10();
            assert!((heard - expected).abs() < 0.7, "{low_hz}: {heard}, expected {expected}");
        }
        let silent = noise_db(&clean, 44_100.0, 196.0, &BANDS_HZ);
        assert!(silent.iter().all(|db| *db < -90.0), "{silent:?}");
    }
}
