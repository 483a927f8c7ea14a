//! Subtone: the lower lip covers more of the reed.
//!
//! Rolled further in, the lip lays the reed on the curve of the mouthpiece earlier and softens its closure, and damps it. So
//! the flow loses its corners, and the sound the partials that these make. The rounder lay raises the pitch and the damping
//! lowers it; the two numbers here let the pitch stay.
//!
//! It is a technique of the chalumeau. Above the break so much damping silences a note, or leaves it to a lower mode, so a player covers little of
//! the reed there.

use crate::dsp::smooth::smooth;
use crate::maths;
use crate::reed::MovingReed;

/// Curve of the lay under a full subtone: the reed never quite shuts, even loud (measured: 1 takes too little of the partials
/// of low loud notes, 2.5 silences soft throat notes).
const LAY: f64 = 1.75;
/// Factor on the reed's damping under a full subtone: with it the pitch stays within 10 cents (measured).
const DAMPING: f64 = 1.6;

/// Places between which the lip covers less: written A4 and C5 of a B flat clarinet.
const BREAK: (f64, f64) = (-0.15, -0.05);
/// How much of it is left above, of the same setting. Measured: sounding C5 loses 2 dB at a fifth, and 11 dB at 0.44.
const LEFT_ABOVE: f64 = 0.2;

/// How much the lip covers a note at a [place](super::super::dynamics::PlayerModel::place) where the player is asked for `amount`, 0..=1.
pub fn at_place(amount: f64, place: f64) -> f64 {
    let above = smooth((place - BREAK.0) / (BREAK.1 - BREAK.0));
    amount * (1.0 - (1.0 - LEFT_ABOVE) * above)
}

/// The reed under a lip that covers it by `amount`, 0..=1.
pub fn covered(reed: MovingReed, amount: f64) -> MovingReed {
    if amount == 0.0 {
        return reed;
    }
    let lay = reed.lay + amount * (LAY - reed.lay).max(0.0);
    MovingReed { lay, damping: reed.damping * maths::pow(DAMPING, amount), ..reed }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn above_the_break_a_fifth_of_it_is_left() {
        for (place, left) in [(-1.0, 0.5), (-0.17, 0.5), (0.0, 0.1), (0.7, 0.1)] {
            assert!((at_place(0.5, place) - left).abs() < 1e-12, "{place}");
        }
        assert!((0.15..0.45).contains(&at_place(0.5, -0.1)));
    }
}
