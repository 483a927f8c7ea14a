//! Measurements of sound: pitch, spectrum, onset, and the impedance behind a reflectance.
//!
//! Pure functions of slices of f64 samples (full scale 1.0) at a rate in Hz. A rate or a pitch that is not a number above 0 and up to
//! 1 GHz has no result: `None`, or nothing. They allocate and take milliseconds: for
//! renders, tests and plots, never for the audio thread.
//!
//! ```
//! use chalumeau_core::analysis::{pitch, spectrum};
//!
//! // Half a second of a tone of 220 Hz with a third harmonic of half the amplitude.
//! let phase = |n: u32| std::f64::consts::TAU * 220.0 * f64::from(n) / 44_100.0;
//! let tone: Vec<f64> = (0..22_050).map(|n| phase(n).sin() + 0.5 * (3.0 * phase(n)).sin()).collect();
//! let f0_hz = pitch::fundamental_hz(&tone, 44_100.0).unwrap();
//! assert!((f0_hz - 220.0).abs() < 1e-3);
//! let levels_db = spectrum::harmonic_levels_db(&tone, 44_100.0, f0_hz);
//! assert!((levels_db[2] + 6.02).abs() < 0.1);
//! ```

use crate::maths;
use std::f64::consts::PI;

pub mod impedance;
pub mod noise_bands;
pub mod onset;
pub mod overview;
pub mod partials;
pub mod pitch;
pub mod recording;
#[cfg(feature = "fit")]
pub(crate) mod slower;
pub mod spectrum;
pub mod steady_note;
pub mod yin;

/// Whether a number can be a sample rate or a pitch, Hz: above 0, and at most 1 GHz, so that counts of samples fit. All others, NaN among
/// them, belong to no sound, and what is measured with them is `None`, empty or 0.
pub(crate) fn is_hz(hz: f64) -> bool {
    hz > 0.0 && hz <= 1e9
}

/// Samples as the functions here want them. Allocates.
pub fn to_f64(samples: &[f32]) -> Vec<f64> {
    samples.iter().map(|&sample| f64::from(sample)).collect()
}

/// Four-term Blackman-Harris window, side lobes -92 dB, main lobe +-4 bins. F. J. Harris, Proc. IEEE 66 (1978), table 1.
pub(crate) const BLACKMAN_HARRIS: [f64; 4] = [0.358_75, 0.488_29, 0.141_28, 0.011_68];

/// Hann's window.
pub(crate) const HANN: [f64; 2] = [0.5, 0.5];

/// Periodic window of `len` samples made of cosines: `sum (-1)^k c_k cos(2 pi k n / len)`.
pub(crate) fn cosine_window(len: usize, terms: &[f64]) -> impl Iterator<Item = f64> {
    (0..len).map(move |n| {
        let turn = 2.0 * PI * n as f64 / len as f64;
        let mut sign = 1.0;
        terms.iter().enumerate().fold(0.0, |sum, (k, term)| {
            let cosine = if k == 0 { 1.0 } else { maths::cos(turn * k as f64) };
            let value = sum + sign * term * cosine;
            sign = -sign;
            value
        })
    })
}

/// The samples less their mean.
pub(crate) fn without_mean(samples: &[f64]) -> Vec<f64> {
    let mean = samples.iter().sum::<f64>() / samples.len().max(1) as f64;
    samples.iter().map(|sample| sample - mean).collect()
}

/// Root mean square; 0 for nothing.
pub(crate) fn rms(samples: &[f64]) -> f64 {
    (samples.iter().map(|sample| sample * sample).sum::<f64>() / samples.len().max(1) as f64).sqrt()
}

/// The value in the middle, of an even number the higher of the two; `None` for nothing. Allocates.
pub(crate) fn upper_median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Largest sample position of a parabola through three equally spaced values, relative to the middle one, -0.5..=0.5,
/// and the value there. `None` unless the middle one is a maximum.
pub(crate) fn parabola(left: f64, middle: f64, right: f64) -> Option<(f64, f64)> {
    if middle < left || middle < right {
        return None;
    }
    let bend = left - 2.0 * middle + right;
    if bend == 0.0 {
        return Some((0.0, middle));
    }
    let at = 0.5 * (left - right) / bend;
    Some((at, middle - 0.25 * (left - right) * at))
}

#[cfg(test)]
pub(crate) mod synthetic {
    //! Tones whose every figure is known.

    use std::f64::consts::PI;

    /// A clarinet's chalumeau, roughly: odd harmonics strong, the third 10 dB above the first.
    pub const CLARINET_DB: [f64; 12] =
        [-10.0, -45.0, 0.0, -38.0, -3.0, -30.0, -8.0, -20.0, -14.0, -22.0, -20.0, -28.0];

    /// Sum of harmonics, levels in dB, phases scattered, over `len_s`.
    pub fn tone(f0_hz: f64, rate_hz: f64, len_s: f64, levels_db: &[f64]) -> Vec<f64> {
        glide(|t| f0_hz * t, rate_hz, len_s, levels_db)
    }

    /// The same with the fundamental's phase, in cycles, as a function of time.
    pub fn glide(cycles: impl Fn(f64) -> f64, rate_hz: f64, len_s: f64, levels_db: &[f64]) -> Vec<f64> {
        let amplitudes: Vec<f64> = levels_db.iter().map(|db| 10f64.powf(db / 20.0)).collect();
        (0..(len_s * rate_hz).round() as usize)
            .map(|n| {
                let cycles = cycles(n as f64 / rate_hz);
                (amplitudes.iter().zip(1..))
                    .map(|(a, h)| a * (2.0 * PI * (f64::from(h) * cycles + 0.37 * f64::from(h * h))).sin())
                    .sum()
            })
            .collect()
    }

    /// Uniform noise of the given rms, seeded.
    pub fn noise(rms: f64, len: usize) -> Vec<f64> {
        let mut seed = 0x2545_f491_4f6c_dd1du64;
        (0..len)
            .map(|_| {
                seed ^= seed << 13;
                seed ^= seed >> 7;
                seed ^= seed << 17;
                ((seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5) * rms * 12f64.sqrt()
            })
            .collect()
    }

    pub fn mix(a: &[f64], b: &[f64]) -> Vec<f64> {
        a.iter().zip(b).map(|(a, b)| a + b).collect()
    }
}
