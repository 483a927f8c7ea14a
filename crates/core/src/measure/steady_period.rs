//! One period of a steady note: the pressure difference across the reed, the flow through it, and its opening.
//!
//! Plotted against each other, they show the orbit of the reed around its static characteristic.

use crate::analysis::pitch;
use crate::instrument::{BreathResponse, Clarinet, Model, Probe, Settings};
use crate::measure::bifurcation::SOUNDING_RMS;
use crate::score::breath::BreathCurve;
use crate::score::{Score, play_probed};
use crate::units::SoundingNote;
use std::convert::Infallible;
use std::sync::Arc;

/// Time in which a note becomes steady, s.
const SETTLE_S: f64 = 1.2;
/// Time in which its period is measured, s, and in how many periods at least.
const MEASURE_S: f64 = 0.2;
const PERIODS: f64 = 12.0;

/// One period, sampled at the internal rate. It begins at the largest pressure difference.
#[derive(Clone, Debug, PartialEq)]
pub struct SteadyPeriod {
    /// Frequency of the note, Hz.
    pub f_hz: f64,
    /// Time between samples, s.
    pub step_s: f64,
    /// Mouth pressure over closing pressure, as it was reached.
    pub gamma: f64,
    /// For each sample: pressure in the mouth minus that in the mouthpiece, Pa; flow through the reed, m3/s; opening over the
    /// opening at rest.
    pub moments: Vec<[f64; 3]>,
}

/// Plays `note` at a constant `gamma` until it is steady, and returns one period; `None` if it does not sound. Allocates.
///
/// The breath is physical whatever `settings` say; they must let full breath reach `gamma` (`breath_full_kpa`). `rate` is the host's sample rate, Hz.
pub fn measure(
    model: &Arc<Model>,
    settings: &Settings,
    note: SoundingNote,
    gamma: f32,
    rate: u32,
) -> Option<SteadyPeriod> {
    let mut clarinet = Clarinet::new(model.clone(), f64::from(rate));
    let settings = &Settings { breath_response: BreathResponse::Physical, ..*settings };
    clarinet.set_settings(settings);
    clarinet.reset();
    let wanted_hz = note.frequency_hz(f64::from(settings.a4_hz));
    let score = Score::note(note, SETTLE_S + MEASURE_S.max(PERIODS / wanted_hz), rate);
    let score = score.blown(&BreathCurve::constant(gamma), settings, rate);
    let inner_hz = clarinet.internal_rate_hz();
    let closing_pa = settings.closing_pa();
    let (mut moments, mut seen, skip) = (Vec::new(), 0_usize, (SETTLE_S * inner_hz) as usize);
    let mut blown = 0.0;
    let mut probe = |probe: Probe| {
        seen += 1;
        if seen > skip {
            blown = probe.gamma;
            let p_delta = probe.gamma * closing_pa - probe.p_mouthpiece_pa;
            moments.push([p_delta, probe.flow_m3s, probe.opening]);
        }
    };
    let Ok(()) = play_probed(&mut clarinet, &score, 4096, &mut probe, |_| Ok::<_, Infallible>(()));
    let pressure: Vec<f64> = moments.iter().map(|moment| moment[0]).collect();
    // Without a note the tube still rings from the tongue, which is periodic as well.
    let count = pressure.len().max(1) as f64;
    let mean = pressure.iter().sum::<f64>() / count;
    let rms = (pressure.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / count).sqrt();
    if rms < SOUNDING_RMS * closing_pa {
        return None;
    }
    let f_hz = pitch::fundamental_near_hz(&pressure, inner_hz, wanted_hz)?;
    let count = (inner_hz / f_hz).round() as usize;
    // Half a period before the end of the note, where the tongue comes back.
    let last = moments.len().checked_sub(count / 2 + 1)?;
    let mut moments = moments.get(last.checked_sub(count)?..last)?.to_vec();
    let greatest = moments.iter().enumerate().max_by(|a, b| a.1[0].total_cmp(&b.1[0]))?.0;
    moments.rotate_left(greatest);
    Some(SteadyPeriod { f_hz, step_s: 1.0 / inner_hz, gamma: blown, moments })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_soft_note_stays_open_a_loud_one_beats() {
        let model = Arc::new(Model::built_in(48_000.0).unwrap());
        let settings = Settings { noise: 0.0, ..Settings::physical() };
        let shut = |gamma: f32| {
            let period = measure(&model, &settings, SoundingNote(58), gamma, 48_000).unwrap();
            assert!(
                (period.f_hz / SoundingNote(58).frequency_hz(440.0) - 1.0).abs() < 0.02,
                "{}",
                period.f_hz
            );
            assert!((period.gamma - f64::from(gamma)).abs() < 1e-3);
            // The mean pressure in the mouthpiece is small against that in the mouth.
            let mean = period.moments.iter().map(|m| m[0]).sum::<f64>() / period.moments.len() as f64;
            assert!((mean / 6_000.0 - period.gamma).abs() < 0.1, "{mean}");
            period.moments.iter().filter(|m| m[2] < 1e-3).count() as f64 / period.moments.len() as f64
        };
        assert_eq!(shut(0.4), 0.0);
        assert!((0.3..0.6).contains(&shut(0.8)), "{}", shut(0.8));
        assert!(measure(&model, &settings, SoundingNote(58), 0.2, 48_000).is_none());
    }
}
