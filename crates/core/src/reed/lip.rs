//! The lip on the reed.

/// Resonance and damping of the reed under the lip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lip {
    /// Resonance of the reed with the lip on it, Hz.
    pub resonance_hz: f64,
    /// Damping q of the reed, the inverse of the quality factor.
    pub damping: f64,
}
