//! Harmonic levels, centroid and level of a note, and what is between its harmonics.
//!
//! The first four follow a fixed recipe, so that figures can be laid beside those measured from recordings (one player,
//! TinySOL, Cella et al., Zenodo 3685367): the recipe works on mono at 44 100 Hz, and the caller converts to that. What
//! it leaves out: peak picking under-reads upper harmonics of an unsteady pitch by several dB; the centroid does not.
//! Levels in dB, full scale 1.0, frequencies in Hz.

use crate::analysis::{BLACKMAN_HARRIS, HANN, cosine_window, is_hz, rms, without_mean};
use crate::maths;
use chalumeau_fft as fft;
use std::ops::Range;

/// Harmonics measured by [`harmonic_levels_db`], unless 0.45 of the rate comes first.
pub const HARMONICS: usize = 12;

/// Length looked at from the start of a note, s.
const LONGEST_S: f64 = 4.0;
/// Cut from both ends of the segment, s.
const MARGIN_S: f64 = 0.1;
/// A shorter segment is none, s.
const SHORTEST_S: f64 = 0.2;
/// Window of the envelope, s.
const ENVELOPE_S: f64 = 0.01;

/// Seven-term Blackman-Harris window, side lobes -180 dB, main lobe +-7 bins. It leaves at most -161 dB of a tone beyond
/// 15 bins, the four-term one -101 dB (both computed), too much to read -110 dB. H.-H. Albrecht, A family of cosine-sum
/// windows for high-resolution measurements, ICASSP 2001; coefficients as commonly tabulated.
const BLACKMAN_HARRIS_7: [f64; 7] = [
    0.271_051_400_693_42,
    0.433_297_939_234_48,
    0.218_122_999_543_11,
    0.065_925_446_388_03,
    0.010_811_742_098_37,
    0.000_776_584_825_22,
    0.000_013_887_217_35,
];
/// Half of its main lobe with a little to spare, bins.
const MAIN_LOBE_7: f64 = 7.5;

/// A spectrum to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct PowerSpectrum {
    /// Distance between values, Hz; the first stands at 0.
    pub bin_hz: f64,
    /// Level, dB; a sine of amplitude 1 stands at 0 dB.
    pub level_db: Vec<f64>,
}

/// Moving root mean square over `window_s`, centred, one value per sample; at the edges over the samples there are.
/// At least one sample is seen, whatever the length and the rate, and at most all.
pub fn moving_rms(samples: &[f64], rate_hz: f64, window_s: f64) -> Vec<f64> {
    let window = ((window_s * rate_hz).round() as usize).clamp(1, 2 * samples.len() + 2);
    let mut sums = Vec::with_capacity(samples.len() + 1);
    let mut sum = 0.0;
    sums.push(sum);
    for sample in samples {
        sum += sample * sample;
        sums.push(sum);
    }
    (0..samples.len())
        .map(|n| {
            let (first, end) = (n.saturating_sub(window / 2), (n + window - window / 2).min(samples.len()));
            ((sums[end] - sums[first]).max(0.0) / (end - first) as f64).sqrt()
        })
        .collect()
}

/// The 10 ms envelope of the first 4 s of a note.
pub(crate) fn note_envelope(samples: &[f64], rate_hz: f64) -> Vec<f64> {
    let len = samples.len().min((LONGEST_S * rate_hz) as usize);
    moving_rms(&samples[..len], rate_hz, ENVELOPE_S)
}

/// Steady part of a note within its first 4 s: from the first to the last sample where the 10 ms envelope is at least
/// half its maximum, less 100 ms at both ends. `None` under 200 ms, and at a rate that is not above 0.
pub fn steady_segment(samples: &[f64], rate_hz: f64) -> Option<Range<usize>> {
    if !is_hz(rate_hz) {
        return None;
    }
    let envelope = note_envelope(samples, rate_hz);
    let half = 0.5 * envelope.iter().copied().fold(0.0, f64::max);
    if half <= 0.0 {
        return None;
    }
    let loud = |value: &f64| *value >= half;
    let margin = (MARGIN_S * rate_hz).round() as usize;
    let first = envelope.iter().position(loud)? + margin;
    let end = (envelope.iter().rposition(loud)? + 1).checked_sub(margin)?;
    (end >= first + (SHORTEST_S * rate_hz).round() as usize).then_some(first..end)
}

/// Levels of harmonics 1..=12 (fewer if 0.45 of the rate comes first) of a steady segment, dB relative to the strongest
/// of them: `[harmonic - 1]`, largest value 0. Empty for silence.
///
/// Mean removed, one periodic Hann window, zero-padded to the next power of two at or above four lengths; the largest
/// magnitude within 3 % of each multiple of `f0_hz`. Not rounded.
pub fn harmonic_levels_db(segment: &[f64], rate_hz: f64, f0_hz: f64) -> Vec<f64> {
    levels_of_harmonics_db(segment, rate_hz, f0_hz, HARMONICS)
}

/// As [`harmonic_levels_db`], of harmonics 1..=`most`.
pub fn levels_of_harmonics_db(segment: &[f64], rate_hz: f64, f0_hz: f64, most: usize) -> Vec<f64> {
    let count = most.min((0.45 * rate_hz / f0_hz) as usize);
    let size = (4 * segment.len()).next_power_of_two();
    let bins = fft::forward(&hann(segment), size);
    let bin_hz = rate_hz / size as f64;
    let peaks: Vec<f64> = (1..=count)
        .map(|harmonic| {
            let hz = harmonic as f64 * f0_hz;
            let low = ((0.97 * hz / bin_hz).floor() as usize).min(bins.len() - 1);
            let high = ((1.03 * hz / bin_hz).ceil() as usize).min(bins.len() - 1);
            bins[low..=high].iter().map(|bin| bin.norm_sqr()).fold(0.0, f64::max)
        })
        .collect();
    let strongest = peaks.iter().copied().fold(0.0, f64::max);
    if strongest <= 0.0 {
        return Vec::new();
    }
    peaks.iter().map(|peak| 10.0 * maths::log10((peak / strongest).max(1e-30))).collect()
}

/// Spectral centroid: power-weighted mean frequency, Hz, from 20 Hz to half the rate, noise included; `None` for silence.
pub fn centroid_hz(segment: &[f64], rate_hz: f64) -> Option<f64> {
    let size = segment.len().next_power_of_two();
    let bins = fft::forward(&hann(segment), size);
    let bin_hz = rate_hz / size as f64;
    let (power, moment) = (bins.iter().enumerate().filter(|&(bin, _)| bin as f64 * bin_hz >= 20.0))
        .fold((0.0, 0.0), |(power, moment), (bin, x)| {
            (power + x.norm_sqr(), moment + x.norm_sqr() * bin as f64 * bin_hz)
        });
    (power > 0.0).then(|| moment / power)
}

/// Root mean square, dB re full scale 1.0 (a full-scale sine reads -3.01); minus infinity for silence.
pub fn rms_dbfs(samples: &[f64]) -> f64 {
    20.0 * maths::log10(rms(samples))
}

/// Power between the harmonics of `f0_hz` relative to all power, both from `low_hz` to `high_hz`, dB.
///
/// Seen through a seven-term Blackman-Harris window over the whole slice, mean removed. Bins within `exclude_hz` of a
/// harmonic are left out, and at least those within the window's main lobe (7.5 bins: 7.5 Hz for 1 s). Reads a clean tone
/// of 1 s at -150 dB or less. `f0_hz` must be right to a few hertz at the highest harmonic. Minus infinity for silence.
pub fn non_harmonic_db(
    samples: &[f64],
    rate_hz: f64,
    f0_hz: f64,
    low_hz: f64,
    high_hz: f64,
    exclude_hz: f64,
) -> f64 {
    // The mean as the window sees it: the plain mean of a broken period would itself show as a line at 0 Hz.
    let window: Vec<f64> = cosine_window(samples.len(), &BLACKMAN_HARRIS_7).collect();
    let mean = samples.iter().zip(&window).map(|(sample, window)| sample * window).sum::<f64>()
        / window.iter().sum::<f64>();
    let windowed: Vec<f64> =
        samples.iter().zip(&window).map(|(sample, window)| (sample - mean) * window).collect();
    if windowed.is_empty() {
        return f64::NEG_INFINITY;
    }
    let bins = fft::forward(&windowed, windowed.len());
    let bin_hz = rate_hz / windowed.len() as f64;
    let exclude_hz = exclude_hz.max(MAIN_LOBE_7 * bin_hz);
    let (mut all, mut between) = (0.0, 0.0);
    for (bin, x) in bins.iter().enumerate() {
        let hz = bin as f64 * bin_hz;
        if (low_hz..=high_hz).contains(&hz) {
            all += x.norm_sqr();
            let harmonic = (hz / f0_hz).round().max(1.0);
            if (hz - harmonic * f0_hz).abs() > exclude_hz {
                between += x.norm_sqr();
            }
        }
    }
    if all > 0.0 { 10.0 * maths::log10(between / all) } else { f64::NEG_INFINITY }
}

/// Spectrum of the whole slice through a four-term Blackman-Harris window, floor -200 dB. Allocates.
///
/// ```
/// use chalumeau_core::analysis::spectrum::power_spectrum_db;
///
/// // 32 cycles in 1024 samples at half of full scale: -6 dB in bin 32.
/// let sine = |n: u32| 0.5 * (std::f64::consts::TAU * 32.0 * f64::from(n) / 1024.0).sin();
/// let spectrum = power_spectrum_db(&(0..1024).map(sine).collect::<Vec<f64>>(), 48_000.0);
/// assert_eq!(spectrum.bin_hz, 46.875);
/// assert!((spectrum.level_db[32] + 6.02).abs() < 0.01);
/// ```
pub fn power_spectrum_db(samples: &[f64], rate_hz: f64) -> PowerSpectrum {
    windowed_spectrum_db(samples, rate_hz, &BLACKMAN_HARRIS)
}

/// As [`power_spectrum_db`], through a Hann window: lines are half as wide, and what is much weaker beside them is hidden. Allocates.
///
/// ```
/// use chalumeau_core::analysis::spectrum::hann_spectrum_db;
///
/// let sine = |n: u32| 0.5 * (std::f64::consts::TAU * 32.0 * f64::from(n) / 1024.0).sin();
/// let spectrum = hann_spectrum_db(&(0..1024).map(sine).collect::<Vec<f64>>(), 48_000.0);
/// assert!((spectrum.level_db[32] + 6.02).abs() < 0.01);
/// // Half of that in the bins beside it, and nothing two bins away.
/// assert!((spectrum.level_db[33] + 12.04).abs() < 0.01 && spectrum.level_db[34] < -190.0);
/// ```
pub fn hann_spectrum_db(samples: &[f64], rate_hz: f64) -> PowerSpectrum {
    windowed_spectrum_db(samples, rate_hz, &HANN)
}

fn windowed_spectrum_db(samples: &[f64], rate_hz: f64, terms: &[f64]) -> PowerSpectrum {
    let len = samples.len().max(1);
    let windowed: Vec<f64> =
        samples.iter().zip(cosine_window(len, terms)).map(|(sample, window)| sample * window).collect();
    let size = len.next_power_of_two();
    // A sine of amplitude 1 has half its height in the bin, and the window its mean of that.
    let gain = 2.0 / (terms[0] * len as f64);
    let level_db = fft::forward(&windowed, size)
        .iter()
        .map(|bin| 20.0 * maths::log10((gain * maths::complex::norm(*bin)).max(1e-10)))
        .collect();
    PowerSpectrum { bin_hz: rate_hz / size as f64, level_db }
}

fn hann(segment: &[f64]) -> Vec<f64> {
    without_mean(segment)
        .iter()
        .zip(cosine_window(segment.len(), &HANN))
        .map(|(x, window)| x * window)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::synthetic::{CLARINET_DB, mix, noise, tone};

    const RATE_HZ: f64 = 44_100.0;

    #[test]
    fn steady_segment_keeps_dips_and_cuts_a_tenth_of_a_second() {
        // Silence 0.5 s, loud 0.5 s, a dip to -20 dB 0.2 s, loud 0.5 s, quiet tail.
        let gains = [(0.5, 0.0), (0.5, 1.0), (0.2, 0.1), (0.5, 1.0), (0.4, 0.2)];
        let samples: Vec<f64> = (gains.iter())
            .flat_map(|&(len_s, gain)| tone(440.0, RATE_HZ, len_s, &[0.0]).into_iter().map(move |x| gain * x))
            .collect();
        let segment = steady_segment(&samples, RATE_HZ).unwrap();
        assert!((segment.start as f64 / RATE_HZ - 0.6).abs() < 0.005, "{segment:?}");
        assert!((segment.end as f64 / RATE_HZ - 1.6).abs() < 0.005, "{segment:?}");
    }

    #[test]
    fn short_or_silent_notes_have_no_steady_segment() {
        assert_eq!(steady_segment(&tone(440.0, RATE_HZ, 0.39, &[0.0]), RATE_HZ), None);
        assert_eq!(steady_segment(&vec![0.0; 44_100], RATE_HZ), None);
        assert_eq!(steady_segment(&[], RATE_HZ), None);
        let sound = tone(440.0, RATE_HZ, 0.5, &[0.0]);
        for no_hz in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300] {
            assert_eq!(steady_segment(&sound, no_hz), None, "{no_hz}");
            assert_eq!(moving_rms(&sound, no_hz, 0.01).len(), sound.len(), "{no_hz}");
            assert_eq!(moving_rms(&sound, RATE_HZ, no_hz).len(), sound.len(), "{no_hz}");
        }
        assert!(steady_segment(&tone(440.0, RATE_HZ, 0.41, &[0.0]), RATE_HZ).is_some());
    }

    #[test]
    fn only_the_first_four_seconds_count() {
        let segment = steady_segment(&tone(440.0, RATE_HZ, 6.0, &[0.0]), RATE_HZ).unwrap();
        assert_eq!(segment, 4410..171_990);
    }

    #[test]
    fn harmonic_levels_are_those_put_in() {
        for f0_hz in [146.9, 233.3, 587.1, 1480.3] {
            let heard = harmonic_levels_db(&tone(f0_hz, RATE_HZ, 0.5, &CLARINET_DB), RATE_HZ, f0_hz);
            assert_eq!(heard.len(), 12);
            for (heard, put_in) in heard.iter().zip(CLARINET_DB) {
                assert!((heard - put_in).abs() < 0.1, "{f0_hz}: {heard} for {put_in}");
            }
        }
    }

    #[test]
    fn levels_stop_below_half_the_rate() {
        assert_eq!(harmonic_levels_db(&tone(2000.0, RATE_HZ, 0.5, &[0.0, -6.0]), RATE_HZ, 2000.0).len(), 9);
        assert!(harmonic_levels_db(&vec![0.0; 20_000], RATE_HZ, 200.0).is_empty());
    }

    #[test]
    fn centroid_is_the_power_weighted_mean() {
        // 0 and -6 dB: powers 1 and 0.251; a constant and a hum below 20 Hz do not count.
        let samples: Vec<f64> =
            mix(&tone(500.0, RATE_HZ, 1.0, &[0.0, -6.0]), &tone(8.0, RATE_HZ, 1.0, &[0.0]))
                .iter()
                .map(|x| x + 0.3)
                .collect();
        let weight = 10f64.powf(-0.6);
        let expected_hz = (500.0 + 1000.0 * weight) / (1.0 + weight);
        let heard_hz = centroid_hz(&samples, RATE_HZ).unwrap();
        assert!((heard_hz - expected_hz).abs() < 0.5, "{heard_hz}, expected {expected_hz}");
        assert_eq!(centroid_hz(&[0.0; 100], RATE_HZ), None);
    }

    #[test]
    fn full_scale_sine_is_three_below() {
        assert!((rms_dbfs(&tone(441.0, RATE_HZ, 1.0, &[0.0])) + 3.0103).abs() < 1e-3);
    }

    #[test]
    fn clean_tone_reads_below_minus_150_db() {
        for f0_hz in [146.83, 440.37, 1000.5] {
            let samples = tone(f0_hz, 96_000.0, 1.0, &CLARINET_DB);
            let read_db = non_harmonic_db(&samples, 96_000.0, f0_hz, 20.0, 8000.0, 15.0);
            assert!(read_db < -150.0, "{f0_hz}: {read_db} dB");
        }
    }

    #[test]
    fn foreign_sine_and_noise_are_read_at_their_level() {
        let f0_hz = 146.83;
        let clean = tone(f0_hz, 96_000.0, 1.0, &CLARINET_DB);
        let total_db = 20.0 * rms(&clean).log10();
        for level_db in [-60.0, -110.0, -130.0] {
            let foreign = tone(1.5 * f0_hz, 96_000.0, 1.0, &[level_db]);
            let read_db = non_harmonic_db(&mix(&clean, &foreign), 96_000.0, f0_hz, 20.0, 8000.0, 15.0);
            let expected_db = level_db - 3.01 - total_db;
            assert!((read_db - expected_db).abs() < 0.2, "{read_db}, expected {expected_db}");
        }
        // White noise: the share inside 20..8000 Hz and outside the exclusions, 1 - 30 / 146.83.
        let noisy = mix(&clean, &noise(1e-3, clean.len()));
        let read_db = non_harmonic_db(&noisy, 96_000.0, f0_hz, 20.0, 8000.0, 15.0);
        let expected_db = -60.0 - total_db + 10.0 * (7980.0 / 48_000.0 * (1.0 - 30.0 / f0_hz)).log10();
        assert!((read_db - expected_db).abs() < 0.5, "{read_db}, expected {expected_db}");
    }

    #[test]
    fn short_slices_widen_the_exclusion_to_the_main_lobe() {
        let samples = tone(440.37, 96_000.0, 0.1, &CLARINET_DB);
        assert!(non_harmonic_db(&samples, 96_000.0, 440.37, 20.0, 8000.0, 15.0) < -140.0);
    }

    #[test]
    fn power_spectrum_shows_a_sine_at_its_amplitude() {
        let spectrum = power_spectrum_db(&tone(1000.0, 48_000.0, 1.0, &[-20.0]), 48_000.0);
        let (bin, level_db) =
            (spectrum.level_db.iter().enumerate()).max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
        assert!((bin as f64 * spectrum.bin_hz - 1000.0).abs() < 1.0);
        assert!((level_db + 20.0).abs() < 0.3, "{level_db}");
    }
}
