//! A whole note as the recordings were measured: pitch, twelve harmonics, centroid, level, attack.
//!
//! The recipe is fixed (`tests/reference/clarinet_spectra_method.md`): mono at 44.1 kHz, the first 4 s from the start of the
//! file, the steady part as [`steady_segment`] has it, YIN on its last second.

use crate::analysis::onset::attack_s;
use crate::analysis::spectrum::{centroid_hz, harmonic_levels_db, rms_dbfs, steady_segment};
use crate::analysis::yin;

/// The rate of the recipe, Hz.
pub const RATE_HZ: f64 = 44_100.0;
/// Length of the recipe, s: later samples do not count.
pub const SECONDS: f64 = 4.0;

/// What the recipe finds in a note.
#[derive(Clone, Debug, PartialEq)]
pub struct SteadyNote {
    /// Fundamental by YIN, Hz.
    pub f0_hz: f64,
    /// Levels of harmonics 1..=12, dB re the strongest of them.
    pub levels_db: Vec<f64>,
    /// Power-weighted mean frequency, noise included, Hz.
    pub centroid_hz: f64,
    /// Level of the steady part, dB re full scale 1.0.
    pub rms_dbfs: f64,
    /// Time from 10 to 90 % of the loudest moment, s; swells count.
    pub attack_s: f64,
}

impl SteadyNote {
    /// Measures a note at [`RATE_HZ`]; `None` if it has no steady part of 200 ms or no pitch. Allocates.
    pub fn measure(samples: &[f64]) -> Option<Self> {
        let samples = &samples[..samples.len().min((SECONDS * RATE_HZ) as usize)];
        let segment = &samples[steady_segment(samples, RATE_HZ)?];
        let last_second = &segment[segment.len().saturating_sub(RATE_HZ as usize)..];
        let f0_hz = yin::fundamental_hz(last_second, RATE_HZ)?;
        Some(Self {
            f0_hz,
            levels_db: harmonic_levels_db(segment, RATE_HZ, f0_hz),
            centroid_hz: centroid_hz(segment, RATE_HZ)?,
            rms_dbfs: rms_dbfs(segment),
            attack_s: attack_s(samples, RATE_HZ)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::synthetic::{CLARINET_DB, tone};

    #[test]
    fn a_tone_reads_as_it_was_made() {
        let tone = tone(220.0, RATE_HZ, 5.0, &CLARINET_DB);
        let note = SteadyNote::measure(&tone).unwrap();
        assert!((note.f0_hz - 220.0).abs() < 0.3);
        for (heard, put_in) in note.levels_db.iter().zip(CLARINET_DB) {
            assert!((heard - put_in).abs() < 0.1, "{heard} for {put_in}");
        }
        let power: f64 = CLARINET_DB.iter().map(|db| 0.5 * 10.0_f64.powf(db / 10.0)).sum();
        assert!((note.rms_dbfs - 10.0 * power.log10()).abs() < 0.05);
        assert_eq!(SteadyNote::measure(&vec![0.0; 44_100]), None);
    }
}
