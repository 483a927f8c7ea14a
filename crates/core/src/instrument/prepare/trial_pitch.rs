//! The pitch of a trial note.

use crate::analysis::pitch;
use crate::analysis::slower::slower;

/// Least normalised autocorrelation of a note, 0..=1.
const PERIODIC: f64 = 0.9;
/// Lowest rate at which trial notes are heard, Hz. Up to a fundamental of 1500 Hz five harmonics lie below a third of it. A quarter of
/// 96 kHz costs a quarter of the work, and moves the pitch of a trial note by less than 1e-4 cents.
const LEAST_RATE_HZ: f64 = 22_000.0;

/// Fundamental of a radiated sound of some tenths of a second, Hz; `None` if it is not periodic. Allocates.
pub(super) fn trial_pitch_hz(sound: &[f64], rate_hz: f64) -> Option<f64> {
    let (sound, rate_hz) = slower(sound, rate_hz, LEAST_RATE_HZ);
    let hz = pitch::fundamental_hz(&sound, rate_hz)?;
    (pitch::periodicity(&sound, rate_hz, hz) > PERIODIC).then_some(hz)
}
