//! What a player's lip does without being asked: reed resonance and damping for the note in hand.
//!
//! The rule is relative to the instrument (lowest note) and the note, so that scaled instruments speak without a
//! change. Found by mapping which (resonance, damping) pairs hold which note in its register: low damping squeaks in
//! the chalumeau, high damping loses everything above written B5, where the reed's gain must lift mode 3 over mode 1.

/// Reed resonance and damping under the lip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Embouchure {
    /// Resonance of the reed with the lip on it, Hz.
    pub resonance_hz: f64,
    /// Damping q of the reed, 1 / Q; 0.25..=0.8.
    pub damping: f64,
}

/// Embouchure for a note sounding at `note_hz` on an instrument whose lowest note sounds at `lowest_hz`.
///
/// `f_r = max(10.2 f_low, 1.55 f)`, `q` from 0.8 to 0.25 while f / f_r goes from 0.36 to 0.54.
pub fn embouchure(note_hz: f64, lowest_hz: f64) -> Embouchure {
    let resonance_hz = (10.2 * lowest_hz).max(1.55 * note_hz);
    let way = ((note_hz / resonance_hz - 0.36) / (0.54 - 0.36)).clamp(0.0, 1.0);
    Embouchure { resonance_hz, damping: 0.8 + way * (0.25 - 0.8) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn low_notes_are_damped_high_ones_follow_the_reed() {
        let low = embouchure(147.0, 147.0);
        assert_eq!((low.resonance_hz, low.damping), (10.2 * 147.0, 0.8));
        let high = embouchure(1_480.0, 147.0);
        assert!((high.resonance_hz - 1.55 * 1_480.0).abs() < 1e-9 && (high.damping - 0.25).abs() < 1e-12);
    }

    #[test]
    fn rule_scales_with_the_instrument() {
        let (a, b) = (embouchure(600.0, 147.0), embouchure(300.0, 73.5));
        assert!((a.resonance_hz / b.resonance_hz - 2.0).abs() < 1e-12 && a.damping == b.damping);
    }
}
