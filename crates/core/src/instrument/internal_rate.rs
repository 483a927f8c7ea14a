//! The rate at which the lattice runs, chosen from the host's rate.

use crate::instrument::model::BuildError;

/// Lowest and highest host rate, Hz: the widest range that a validator of plugins was seen to ask for. A low rate cannot
/// carry high notes.
pub const HOST_RATES_HZ: (f64, f64) = (1_000.0, 1_536_000.0);

/// The host rate that is played where none can be: the nearest within [`HOST_RATES_HZ`], and 48 kHz for NaN. Hz.
pub(super) fn nearest_rate_hz(host_rate_hz: f64) -> f64 {
    if host_rate_hz.is_nan() { 48_000.0 } else { host_rate_hz.clamp(HOST_RATES_HZ.0, HOST_RATES_HZ.1) }
}

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
