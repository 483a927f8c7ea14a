//! How notes begin.
//!
//! Two readings of the beginning: [`attack_s`] is the one recordings are measured with (10 ms envelope, 10 to 90 % of the
//! loudest moment, swells included); [`t90_s`] asks how soon a note that was just tongued speaks, through a window of one
//! period so that low notes do not ripple. Times in seconds.

use crate::analysis::pitch::fundamental_hz;
use crate::analysis::spectrum::{moving_rms, note_envelope};
use crate::analysis::{is_hz, upper_median};

/// Share of the steady level that counts as speaking.
const SPEAKING: f64 = 0.9;
/// Window where no period is found, s.
const WINDOW_S: f64 = 0.01;

/// Time from 10 % to 90 % of the global maximum of the 10 ms envelope within the first 4 s. `None` for silence, and at a
/// rate that is not above 0.
pub fn attack_s(samples: &[f64], rate_hz: f64) -> Option<f64> {
    if !is_hz(rate_hz) {
        return None;
    }
    let envelope = note_envelope(samples, rate_hz);
    let loudest = envelope.iter().copied().fold(0.0, f64::max);
    if loudest <= 0.0 {
        return None;
    }
    let first = |share: f64| envelope.iter().position(|&value| value >= share * loudest);
    Some((first(0.9)? - first(0.1)?) as f64 / rate_hz)
}

/// Time from `from_s` until the envelope first reaches 90 % of its steady level, the median over the last quarter of what
/// follows `from_s`. The slice should end before the release. `None` if that is silence or nothing is left, and at a rate that is not
/// above 0.
///
/// The envelope is a moving rms over one period, centred (the period as found in that last quarter, 10 ms if none is):
/// good to half a period.
pub fn t90_s(samples: &[f64], rate_hz: f64, from_s: f64) -> Option<f64> {
    if !is_hz(rate_hz) {
        return None;
    }
    let from = (from_s.max(0.0) * rate_hz).round() as usize;
    let note = samples.get(from..)?;
    let tail = note.len() - note.len() / 4;
    let envelope = moving_rms(note, rate_hz, window_s(&note[tail..], rate_hz));
    let steady = upper_median(envelope[tail..].iter().copied())?;
    if steady <= 0.0 {
        return None;
    }
    envelope.iter().position(|&value| value >= SPEAKING * steady).map(|n| n as f64 / rate_hz)
}

fn window_s(samples: &[f64], rate_hz: f64) -> f64 {
    fundamental_hz(samples, rate_hz).map_or(WINDOW_S, f64::recip)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::synthetic::{CLARINET_DB, tone};

    const RATE_HZ: f64 = 48_000.0;

    fn shaped(f0_hz: f64, len_s: f64, gain: impl Fn(f64) -> f64) -> Vec<f64> {
        let clean = tone(f0_hz, RATE_HZ, len_s, &CLARINET_DB);
        clean.iter().enumerate().map(|(n, x)| x * gain(n as f64 / RATE_HZ)).collect()
    }

    /// 0.1 s of silence, then a straight rise over 0.4 s: 80 % of it is the attack.
    #[test]
    fn attack_of_a_ramp_is_four_fifths_of_it() {
        let samples = shaped(440.0, 1.5, |t| ((t - 0.1) / 0.4).clamp(0.0, 1.0));
        let attack = attack_s(&samples, RATE_HZ).unwrap();
        assert!((attack - 0.32).abs() < 0.006, "{attack}");
        assert_eq!(attack_s(&[0.0; 48_000], RATE_HZ), None);
    }

    /// An exponential approach reaches 90 % after ln 10 time constants, whatever the pitch and wherever it starts.
    #[test]
    fn t90_of_an_exponential_rise_is_ln_10_time_constants() {
        for f0_hz in [147.0, 150.0, 440.0, 1200.0] {
            for (from_s, tau_s) in [(0.0, 0.02), (0.25, 0.02), (0.25, 0.06)] {
                let samples =
                    shaped(f0_hz, 1.5, |t| if t < from_s { 0.0 } else { 1.0 - ((from_s - t) / tau_s).exp() });
                let t90 = t90_s(&samples, RATE_HZ, from_s).unwrap();
                let expected = tau_s * 10f64.ln();
                assert!(
                    (t90 - expected).abs() < 0.5 / f0_hz,
                    "{f0_hz} Hz, {tau_s} s: {t90}, expected {expected}"
                );
            }
        }
    }

    #[test]
    fn t90_of_a_step_is_within_half_a_period() {
        let samples = shaped(150.0, 1.0, |t| if t < 0.3 { 0.0 } else { 1.0 });
        let t90 = t90_s(&samples, RATE_HZ, 0.3).unwrap();
        assert!(t90 < 0.5 / 150.0, "{t90}");
        let late = t90_s(&samples, RATE_HZ, 0.1).unwrap();
        assert!((late - 0.2).abs() < 0.5 / 150.0, "{late}");
    }

    #[test]
    fn t90_needs_a_note() {
        assert_eq!(t90_s(&[0.0; 48_000], RATE_HZ, 0.1), None);
        assert_eq!(t90_s(&[0.0; 4800], RATE_HZ, 0.2), None);
    }
}
