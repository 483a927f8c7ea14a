//! The pitch of a trial note.

use crate::analysis::pitch;
use crate::analysis::slower::slower;

/// Least normalised autocorrelation of a note, 0..=1.
const PERIODIC: f64 = 0.9;
/// Lowest rate at which trial notes are heard, Hz. Up to a fundamental of 1500 Hz five harmonics lie below a third of it. A quarter of
/// 96 kHz costs a quarter of the work, and moves the pitch of a tone by less than 1e-4 cents.
const LEAST_RATE_HZ: f64 = 22_000.0;

/// Fundamental of a radiated sound of some tenths of a second that is to be `wanted_hz`, Hz; `None` if it is not periodic. Allocates.
pub(super) fn trial_pitch_hz(sound: &[f64], rate_hz: f64, wanted_hz: f64) -> Option<f64> {
    let (sound, rate_hz) = slower(sound, rate_hz, LEAST_RATE_HZ);
    let hz = pitch::fundamental_near_hz(&sound, rate_hz, wanted_hz)?;
    (pitch::periodicity(&sound, rate_hz, hz) > PERIODIC).then_some(hz)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::synthetic::{CLARINET_DB, noise, tone};
    use crate::units::cents;

    #[test]
    fn a_lower_rate_hears_the_same_pitch() {
        for rate_hz in [88_200.0, 96_000.0, 192_000.0] {
            for f0_hz in [29.1, 36.7, 69.3, 146.832, 233.08, 466.16, 932.3, 1_480.0, 2_093.0] {
                let sound = tone(f0_hz, rate_hz, if f0_hz < 50.0 { 0.6 } else { 0.3 }, &CLARINET_DB);
                let off = cents(trial_pitch_hz(&sound, rate_hz, f0_hz).unwrap(), f0_hz);
                assert!(off.abs() < 1e-4, "{f0_hz} Hz at {rate_hz}: {off} cents");
            }
        }
        assert_eq!(trial_pitch_hz(&noise(0.1, 28_800), 96_000.0, 146.8), None);
    }
}
