//! From seconds to samples.

/// Longest note, pause or MIDI file, s: six hours. Sample positions stay far below the largest integer.
pub(super) const SECONDS_MAX: u32 = 6 * 3600;

/// The sample nearest to a time, s, at `rate` Hz; 0 for a negative time and for NaN. A rate of 0 counts as 1 Hz.
pub fn samples_in(seconds: f64, rate: u32) -> usize {
    (seconds * f64::from(rate.max(1))).round().max(0.0) as usize
}

/// A length of at most [`SECONDS_MAX`], s; 0 for a negative one and for NaN.
pub(super) fn length_s(seconds: f64) -> f64 {
    if seconds.is_nan() { 0.0 } else { seconds.clamp(0.0, f64::from(SECONDS_MAX)) }
}
