//! How far the lip opens the reed on the highest notes.
//!
//! Below and above a high note lie modes of its fingering. Where two lie as far below it as above, as on written E flat 6 at 0.70 and 1.30 of the
//! note, the reed takes both along: what it mixes of the note and one of them feeds the other. Between soft and loud they grew to 17 to 20 dB below the
//! note, an undertone that stayed as long as the note. A reed that opens further, and is blown as much harder as keeps the level, mixes less.

use super::lip_glide::{AT_BETWEEN, AT_PLACE, NoteLip};
use crate::dsp::smooth::smooth;

/// [Places](super::dynamics::PlayerModel::place) over which the opening comes: written C6 and E flat 6.
const PLACES: (f64, f64) = (0.57, 0.7);
/// Most that is added to the logarithm of opening and closing pressure, halfway between soft and loud; nothing at either end. Half of it is taken back from the
/// mouth pressure over the closing pressure, as on the way of a lip from note to note. Measured on the B flat and bass clarinets: the undertone of E flat 6 lies 33 and 26 dB under the note with
/// 0.25, 33 and 30 with 0.3, 35 and 34 with 0.35. With 0.3 the levels of high notes move by -0.6 to 0.5 dB, and their pitches by up to 0.8 cents.
const MOST: f64 = 0.3;

/// Opens the reed further, for the place where the lip is. Real-time safe.
pub fn open(note_lip: &mut NoteLip) {
    let (from, to) = PLACES;
    note_lip[AT_BETWEEN] += MOST * smooth((note_lip[AT_PLACE] - from) / (to - from));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_comes_smoothly_above_c6() {
        let opened = |place: f64| {
            let mut lip: NoteLip = [1_500.0, 0.8, place, -0.1, -1.3, 0.1, 1.0, 0.03];
            open(&mut lip);
            lip[AT_BETWEEN]
        };
        assert_eq!((opened(-0.5), opened(0.56)), (-0.1, -0.1));
        assert!((opened(0.71) - (MOST - 0.1)).abs() < 1e-12);
        assert!((0..100).all(|n| {
            let place = 0.5 + 0.003 * f64::from(n);
            (0.0..0.02).contains(&(opened(place + 0.003) - opened(place)))
        }));
    }
}
