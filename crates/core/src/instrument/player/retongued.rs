//! Notes that the tongue begins while the air column still rings from the note before.
//!
//! From rest a low note always begins in its own register. What still rings of the note before may cancel the beginning of the first mode
//! and leave the lead to the second, which a beating reed holds as well. So the lip damps the reed while it begins, which
//! weakens the second mode more than the first, as in a difficult [`slur`](super::slur).
//!
//! In quick repetitions what rings is as strong as the beginning of the note. If the two have opposite phases, the note has to grow from little: one note
//! of a row is up to 18 dB softer than its neighbours. So the tongue lets go in time with what rings.

use super::lip_glide::LipHelp;
use super::slur::LOW_PLACE;

/// Amplitude in the mouthpiece above which the air column rings, rms over the closing pressure.
const RINGS: f64 = 0.01;
/// What the lip does. Of 8208 notes in four rhythms, written E3 to A#4 at nine values of CC 2, 40 are not in their register without it, 2 with a
/// factor of 3, and none with 4 (`docs/tone.md`).
const DAMPED: LipHelp = LipHelp { damping: 4.0, length_s: 0.015 };

/// The tongue waits for the pressure of what rings at most so long, s: a period of written E3 of a B flat clarinet.
pub const LONGEST_WAIT_S: f64 = 0.007;
/// From where that pressure rises through zero until the tongue lets go, s: the reed opens some 0.7 ms after that. Of 192 rows of ten notes, written B4 to
/// E5 at 8 to 11 a second, the notes of 21 differed by more than 4 dB with 1 ms, of 5 with 1.3, 8 with 1.6, and 23 with 2, where 31 did without
/// waiting; of 228 from E3 to B flat 4, of 1, 0, 0 and 0, and of 8. Measured with a first version, at a velocity of 0.6.
pub const IN_TIME_S: f64 = 0.0013;

/// Whether the column rings, by the amplitude in the mouthpiece when the key goes down. Later, what leaks past the tongue as the breath rises rings too,
/// on a soft reed with up to 0.05.
pub fn rings(amplitude: f64) -> bool {
    amplitude > RINGS
}

/// What a player's lip does for a tongued note at a [place](super::dynamics::PlayerModel::place) after which so much still rings; `None` where
/// nothing needs to be done.
pub fn lip_help(ringing: f64, place: f64) -> Option<LipHelp> {
    (rings(ringing) && place < LOW_PLACE).then_some(DAMPED)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_low_notes_that_ring_need_help() {
        assert!(lip_help(0.1, -0.8).is_some());
        assert_eq!((lip_help(0.0, -0.8), lip_help(0.1, -0.4)), (None, None));
    }
}
