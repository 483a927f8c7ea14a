//! Analysis for the sound view: spectrum, harmonics, pitch. It runs outside the audio thread, and only while a window is
//! open.
//!
//! The latest samples go through one Hann window of 2^13 samples (171 ms at 48 kHz, bins of 5.9 Hz); [`pitch`]
//! measures the pitch. Levels are levels of a sine: 0 dB is amplitude 1. There is no averaging.

use chalumeau_core::analysis::pitch;
use chalumeau_core::analysis::spectrum;
use chalumeau_core::units::cents;

/// Samples looked at.
pub const WINDOW: usize = 8192;
/// Least level shown, dB.
pub const FLOOR_DB: f32 = -120.0;
/// Highest frequency shown, Hz.
const HIGHEST_HZ: f64 = 12_000.0;
/// What is softer and has another pitch than the note is the air that streams through, dB: it is at most -75 dB at full gain below the
/// threshold, and a squeak is above.
const AIR_DBFS: f64 = -60.0;

/// Spectrum, harmonics and pitch of the latest sound.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SoundAnalysis {
    /// Distance of `level_db`, Hz.
    pub bin_hz: f32,
    /// Level of each bin from 0 Hz, dB.
    pub level_db: Vec<f32>,
    /// Levels of the harmonics from the first, over the strongest, dB; empty without a pitch.
    pub harmonics_db: Vec<f32>,
    /// Pitch, Hz; `None` without one.
    pub f0_hz: Option<f32>,
    /// Pitch over the note that is fingered, cents.
    pub cents: Option<f32>,
}

impl SoundAnalysis {
    /// Of the end of `samples`; missing samples at the front and those that are no numbers count as silence. `wanted_hz` is
    /// the pitch of the fingered note. Allocates.
    pub fn of(samples: &[f32], rate_hz: f64, wanted_hz: Option<f64>) -> Self {
        let (heard, length, blank) = Self::spectrum_of(samples, rate_hz);
        let steady = &heard[WINDOW - length..];
        let f0_hz = match wanted_hz {
            Some(wanted_hz) => pitch::fundamental_near_hz(steady, rate_hz, wanted_hz),
            None => pitch::fundamental_hz(steady, rate_hz),
        };
        // Breath alone has a period now and then.
        let is_air = |f0_hz: &f64| {
            let off = wanted_hz.map_or(0.0, |wanted_hz| cents(*f0_hz, wanted_hz).abs());
            off > pitch::OTHER_CENTS && spectrum::rms_dbfs(steady) < AIR_DBFS
        };
        let Some(f0_hz) = f0_hz.filter(|f0_hz| !is_air(f0_hz)) else { return blank };
        let harmonics = spectrum::harmonic_levels_db(steady, rate_hz, f0_hz);
        Self {
            harmonics_db: harmonics.into_iter().map(|db| db as f32).collect(),
            f0_hz: Some(f0_hz as f32),
            cents: wanted_hz.map(|wanted_hz| cents(f0_hz, wanted_hz) as f32),
            ..blank
        }
    }

    /// The same where others sound on other notes: its pitch is looked for near `wanted_hz` alone, and its harmonics lie among those
    /// of the others. Allocates.
    pub fn of_chord(samples: &[f32], rate_hz: f64, wanted_hz: f64) -> Self {
        let (heard, length, blank) = Self::spectrum_of(samples, rate_hz);
        let f0_hz = pitch::refine_hz(&heard[WINDOW - length..], rate_hz, wanted_hz);
        let off = f0_hz.map(|f0_hz| cents(f0_hz, wanted_hz) as f32);
        Self { f0_hz: f0_hz.map(|f0_hz| f0_hz as f32), cents: off, ..blank }
    }

    /// The spectrum alone. Allocates.
    pub fn without_pitch(samples: &[f32], rate_hz: f64) -> Self {
        Self::spectrum_of(samples, rate_hz).2
    }

    /// The window that is analysed, how many of its last samples are known, and the analysis without a pitch.
    fn spectrum_of(samples: &[f32], rate_hz: f64) -> (Vec<f64>, usize, Self) {
        let latest = &samples[samples.len().saturating_sub(WINDOW)..];
        let mut heard = vec![0.0; WINDOW - latest.len()];
        heard.extend(latest.iter().map(|&sample| if sample.is_finite() { f64::from(sample) } else { 0.0 }));
        let spectrum = spectrum::hann_spectrum_db(&heard, rate_hz);
        let count = (HIGHEST_HZ / spectrum.bin_hz) as usize;
        let level_db = spectrum.level_db.iter().take(count).map(|&db| (db as f32).max(FLOOR_DB)).collect();
        let blank = Self { bin_hz: spectrum.bin_hz as f32, level_db, ..Self::default() };
        (heard, latest.len(), blank)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tone(f0_hz: f64, rate_hz: f64, parts: &[f32]) -> Vec<f32> {
        (0..WINDOW)
            .map(|n| {
                let phase = std::f64::consts::TAU * f0_hz * n as f64 / rate_hz;
                parts.iter().zip(1..).map(|(part, k)| part * (phase * f64::from(k)).sin() as f32).sum()
            })
            .collect()
    }

    #[test]
    fn in_a_chord_the_pitch_is_that_of_the_wanted_note() {
        let rate_hz = 48_000.0;
        let [low, high] = [tone(146.8, rate_hz, &[0.3, 0.0, 0.1]), tone(221.0, rate_hz, &[0.3, 0.0, 0.1])];
        let both: Vec<f32> = low.iter().zip(&high).map(|(a, b)| a + b).collect();
        for (wanted_hz, hz) in [(146.83, 146.8), (220.0, 221.0)] {
            let heard = SoundAnalysis::of_chord(&both, rate_hz, wanted_hz);
            assert!((heard.f0_hz.unwrap() - hz).abs() < 0.2, "{:?}", heard.f0_hz);
            assert!((f64::from(heard.cents.unwrap()) - cents(f64::from(hz), wanted_hz)).abs() < 2.0);
            assert!(heard.harmonics_db.is_empty());
        }
        assert_eq!(SoundAnalysis::of_chord(&[], rate_hz, 220.0).f0_hz, None);
        assert_eq!(SoundAnalysis::without_pitch(&both, rate_hz).f0_hz, None);
    }

    #[test]
    fn a_tone_is_heard_at_its_level_and_pitch() {
        for rate_hz in [44_100.0, 48_000.0, 96_000.0] {
            let heard = SoundAnalysis::of(&tone(233.0, rate_hz, &[0.5, 0.0, 0.05]), rate_hz, Some(233.082));
            let f0_hz = heard.f0_hz.unwrap();
            assert!((f0_hz - 233.0).abs() < 0.1, "{f0_hz}");
            assert!((heard.cents.unwrap() + 0.6).abs() < 0.7, "{:?}", heard.cents);
            let strongest = heard.level_db.iter().copied().fold(FLOOR_DB, f32::max);
            // The tone may fall between two bins: 1.4 dB of a Hann window at most.
            assert!((-7.5..-5.9).contains(&strongest), "{strongest}");
            let third = heard.harmonics_db[2];
            assert!((third + 20.0).abs() < 1.0, "{third}");
            assert!(heard.harmonics_db[1] < -40.0);
        }
    }

    #[test]
    fn the_lowest_note_of_a_contrabass_has_a_pitch() {
        let heard = SoundAnalysis::of(&tone(36.7, 48_000.0, &[0.3, 0.0, 0.3]), 48_000.0, Some(36.71));
        assert!((heard.f0_hz.unwrap() - 36.7).abs() < 0.1, "{:?}", heard.f0_hz);
    }

    #[test]
    fn silence_and_rubbish_have_no_pitch() {
        for samples in [vec![], vec![0.0; 100], vec![0.0; 3 * WINDOW], vec![f32::NAN; WINDOW]] {
            let heard = SoundAnalysis::of(&samples, 48_000.0, Some(440.0));
            assert_eq!((heard.f0_hz, heard.cents), (None, None));
            assert!(heard.level_db.iter().all(|&db| db == FLOOR_DB), "{}", samples.len());
        }
    }
}
