//! The lip on the reed: the reed's resonance and damping for each note, which a player sets without thinking.
//!
//! The rule is relative to the note and to the instrument's lowest note, so that it holds for instruments of every size.
//! It comes from a map of the (resonance, damping) pairs that hold each note in its register: low damping squeaks in the
//! chalumeau register; high damping loses everything above written B5, where the reed must favour mode 3 over mode 1.

use crate::maths;
use crate::reed::Lip;

/// The lip for a note sounding at `note_hz` on an instrument whose lowest note sounds at `lowest_hz`. Real-time safe.
///
/// The resonance is `f_r = max(10.2 f_low, 1.55 f)`; the damping `q` goes from 0.8 to 0.25 while `f / f_r` goes from 0.36
/// to 0.54, and on to 0.13 while `f / f_low` goes from 7.6 to 11, written E flat 6 to A6: the highest notes only begin and hold softly on a reed
/// that favours them over the modes below (Wilson and Beavers 1974), whose thresholds are lower.
///
/// ```
/// use chalumeau_core::instrument::lip::embouchure;
///
/// // E3 and C6 (written) of a B flat clarinet: a low note is damped, a high one is not.
/// let (low, high) = (embouchure(146.8, 146.8), embouchure(932.3, 146.8));
/// assert!(low.damping == 0.8 && high.damping < 0.3);
/// ```
pub fn embouchure(note_hz: f64, lowest_hz: f64) -> Lip {
    let resonance_hz = (10.2 * lowest_hz).max(1.55 * note_hz);
    let way = ((note_hz / resonance_hz - 0.36) / (0.54 - 0.36)).clamp(0.0, 1.0);
    let highest = ((note_hz / lowest_hz - 7.6) / (11.0 - 7.6)).clamp(0.0, 1.0);
    Lip { resonance_hz, damping: 0.8 + way * (0.25 - 0.8) + highest * (0.13 - 0.25) }
}

/// Written C6 over the lowest note, 32 semitones: up to here a factor on the damping counts wholly. From here on notes were lost with a factor
/// of 1.4 and little breath: written F#6 for 0.75 s and longer, E flat 6 for 0.5 s.
const WHOLE_FACTOR: f64 = 6.35;
/// Written E flat 6, 35 semitones: from here on it does not count.
const NO_FACTOR: f64 = 7.55;
/// Exponent of a reed's power with which the damping of the highest notes goes. Measured on written C6 to C7 of 17 presets, at five to eight
/// velocities: without it the most powerful reeds (1.5 and more) jump from loud E6 and F6 to a mode at 1.25 of them, and the weakest (0.7 and less) stay on modes
/// below, or are silent. With 0.5 some of both are left, and with 1 the most powerful are late or lost when soft.
const WITH_POWER: f64 = 0.75;
/// Powers that were measured.
const POWERS: (f64, f64) = (0.3, 3.5);

/// What the player sets besides the note.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    /// Factor on the damping.
    pub damping: f64,
    /// Power of the reed over that of the default reed: closing pressure times flow strength.
    pub power: f64,
}

/// The same for a player who holds another reed, or holds it in another way. Real-time safe.
///
/// Into the altissimo, up to written E flat 6, a factor on the damping fades, because a damped reed cannot hold these notes. There the damping goes with
/// the power of the reed: a powerful one, damped too little, favours a mode above the note, and a weak one, damped too much, gives the note too little.
pub fn held(note_hz: f64, lowest_hz: f64, hold: Hold) -> Lip {
    let lip = embouchure(note_hz, lowest_hz);
    let left = ((NO_FACTOR - note_hz / lowest_hz) / (NO_FACTOR - WHOLE_FACTOR)).clamp(0.0, 1.0);
    let power = hold.power.clamp(POWERS.0, POWERS.1);
    let is_usual = left == 1.0 || power == 1.0;
    let with_power = if is_usual { 1.0 } else { maths::pow(power, WITH_POWER * (1.0 - left)) };
    Lip { damping: lip.damping * (1.0 + left * (hold.damping - 1.0)) * with_power, ..lip }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn low_notes_are_damped_high_ones_follow_the_reed() {
        let low = embouchure(147.0, 147.0);
        assert_eq!((low.resonance_hz, low.damping), (10.2 * 147.0, 0.8));
        let high = embouchure(1_100.0, 147.0);
        assert!((high.resonance_hz - 1.55 * 1_100.0).abs() < 1e-9 && (high.damping - 0.25).abs() < 1e-12);
        assert!((embouchure(1_700.0, 147.0).damping - 0.13).abs() < 1e-12);
    }

    #[test]
    fn a_factor_on_the_damping_fades_into_the_altissimo() {
        let hold = Hold { damping: 1.4, power: 1.0 };
        let factor =
            |ratio: f64| held(147.0 * ratio, 147.0, hold).damping / embouchure(147.0 * ratio, 147.0).damping;
        assert!((factor(6.3) - 1.4).abs() < 1e-12 && (factor(7.6) - 1.0).abs() < 1e-12);
        assert!((1.1..1.3).contains(&factor(7.0)));
        let usual = Hold { damping: 1.0, power: 1.0 };
        assert_eq!(held(400.0, 147.0, usual), embouchure(400.0, 147.0));
        assert_eq!(held(1_400.0, 147.0, usual), embouchure(1_400.0, 147.0));
    }

    #[test]
    fn in_the_altissimo_the_damping_goes_with_the_power_of_the_reed() {
        let factor = |ratio: f64, power: f64| {
            let hold = Hold { damping: 1.0, power };
            held(147.0 * ratio, 147.0, hold).damping / embouchure(147.0 * ratio, 147.0).damping
        };
        assert_eq!([factor(6.3, 2.0), factor(6.3, 0.5), factor(9.0, 1.0)], [1.0; 3]);
        for power in [0.5_f64, 2.0] {
            assert!((factor(7.6, power) - power.powf(WITH_POWER)).abs() < 1e-12);
            assert!((factor(7.0, power).ln() / factor(7.6, power).ln() - 0.5).abs() < 0.1);
        }
    }

    #[test]
    fn rule_scales_with_the_instrument() {
        let (a, b) = (embouchure(600.0, 147.0), embouchure(300.0, 73.5));
        assert!((a.resonance_hz / b.resonance_hz - 2.0).abs() < 1e-12 && a.damping == b.damping);
    }
}
