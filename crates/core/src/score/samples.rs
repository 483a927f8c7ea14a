//! From seconds to samples.

/// The sample nearest to a time, s, at `rate` Hz; 0 for a negative time.
pub fn samples_in(seconds: f64, rate: u32) -> usize {
    (seconds * f64::from(rate)).round().max(0.0) as usize
}
