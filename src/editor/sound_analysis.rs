//! Analysis for the sound view: spectrum, harmonics, pitch. It runs outside the audio thread, and only while a window is
//! open.
//!
//! The latest samples go through one Hann window of 2^13 samples (171 ms at 48 kHz, bins of 5.9 Hz); [`pitch`]
//! measures the pitch. Levels are levels of a sine: 0 dB is amplitude 1. There is no averaging.

use std::sync::Arc;

use realfft::num_complex::Complex32;
use realfft::{RealFftPlanner, RealToComplex};

use chalumeau_core::analysis::pitch;
use chalumeau_core::analysis::spectrum;
use chalumeau_core::units::cents;

/// Samples looked at.
pub const WINDOW: usize = 8192;
/// Least level shown, dB.
pub const FLOOR_DB: f32 = -120.0;
/// Highest frequency shown, Hz.
const HIGHEST_HZ: f64 = 12_000.0;

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

/// Analyses the sound. Allocates when made; each analysis allocates its result.
pub struct SoundAnalyser {
    rate_hz: f64,
    fft: Arc<dyn RealToComplex<f32>>,
    window: Vec<f32>,
    input: Vec<f32>,
    bins: Vec<Complex32>,
}

impl SoundAnalyser {
    /// For samples at this rate.
    pub fn new(rate_hz: f64) -> Self {
        let fft = RealFftPlanner::new().plan_fft_forward(WINDOW);
        let turn = std::f32::consts::TAU / WINDOW as f32;
        Self {
            rate_hz,
            window: (0..WINDOW).map(|n| 0.5 - 0.5 * (turn * n as f32).cos()).collect(),
            input: fft.make_input_vec(),
            bins: fft.make_output_vec(),
            fft,
        }
    }

    /// Analyses the end of `samples`; missing samples at the front count as silence. `wanted_hz` is the pitch of the fingered
    /// note.
    pub fn hear(&mut self, samples: &[f32], wanted_hz: Option<f64>) -> SoundAnalysis {
        let latest = &samples[samples.len().saturating_sub(WINDOW)..];
        let missing = WINDOW - latest.len();
        self.input[..missing].fill(0.0);
        for ((to, from), window) in self.input[missing..].iter_mut().zip(latest).zip(&self.window[missing..])
        {
            *to = if from.is_finite() { from * window } else { 0.0 };
        }
        // A sine of amplitude 1 has half its height in the bin, and the window half of that.
        let gain = 4.0 / WINDOW as f32;
        let count = (HIGHEST_HZ / self.rate_hz * WINDOW as f64) as usize;
        let level_db = match self.fft.process(&mut self.input, &mut self.bins) {
            Ok(()) => self
                .bins
                .iter()
                .take(count)
                .map(|bin| (20.0 * (gain * bin.norm()).max(1e-12).log10()).max(FLOOR_DB))
                .collect(),
            Err(_) => Vec::new(),
        };
        let bin_hz = (self.rate_hz / WINDOW as f64) as f32;
        let steady: Vec<f64> = latest.iter().map(|&sample| f64::from(sample)).collect();
        let Some(f0_hz) = pitch::fundamental_hz(&steady, self.rate_hz) else {
            return SoundAnalysis { bin_hz, level_db, ..SoundAnalysis::default() };
        };
        let harmonics = spectrum::harmonic_levels_db(&steady, self.rate_hz, f0_hz);
        SoundAnalysis {
            bin_hz,
            level_db,
            harmonics_db: harmonics.into_iter().map(|db| db as f32).collect(),
            f0_hz: Some(f0_hz as f32),
            cents: wanted_hz.map(|wanted_hz| cents(f0_hz, wanted_hz) as f32),
        }
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
    fn a_tone_is_heard_at_its_level_and_pitch() {
        for rate_hz in [44_100.0, 48_000.0, 96_000.0] {
            let heard =
                SoundAnalyser::new(rate_hz).hear(&tone(233.0, rate_hz, &[0.5, 0.0, 0.05]), Some(233.082));
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
    fn silence_and_rubbish_have_no_pitch() {
        let mut listener = SoundAnalyser::new(48_000.0);
        for samples in [vec![], vec![0.0; 100], vec![0.0; 3 * WINDOW], vec![f32::NAN; WINDOW]] {
            let heard = listener.hear(&samples, Some(440.0));
            assert_eq!((heard.f0_hz, heard.cents), (None, None));
            assert!(heard.level_db.iter().all(|&db| db == FLOOR_DB), "{}", samples.len());
        }
    }
}
