//! The rate at which the lattice runs, chosen from the host's rate.

use crate::instrument::model::BuildError;
pub use crate::units::HOST_RATES_HZ;

/// The lattice's rate for a host rate, both Hz: 88.2 kHz for the 44.1 kHz family, 96 kHz for all others.
pub fn internal_rate_hz(host_rate_hz: f64) -> f64 {
    let family = |base: f64| {
        let ratio = host_rate_hz / base;
        (ratio - ratio.round()).abs() < 1e-9
    };
    if family(11_025.0) && !family(12_000.0) { 88_200.0 } else { 96_000.0 }
}

/// The lattice's two rates in [`Quality::Live`](super::Quality::Live), Hz.
pub const INTERNAL_RATES_HZ: [f64; 2] = [96_000.0, 88_200.0];

/// The lattice's rate for a host rate, both Hz; see [`internal_rate_hz`].
///
/// # Errors
/// [`BuildError::Rate`] if the host rate lies outside [`HOST_RATES_HZ`].
pub fn checked_rate_hz(host_rate_hz: f64) -> Result<f64, BuildError> {
    if (HOST_RATES_HZ.0..=HOST_RATES_HZ.1).contains(&host_rate_hz) {
        Ok(internal_rate_hz(host_rate_hz))
    } else {
        Err(BuildError::Rate(host_rate_hz))
    }
}
