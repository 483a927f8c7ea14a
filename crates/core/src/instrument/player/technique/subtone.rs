//! Subtone: the lower lip covers more of the reed.
//!
//! Rolled further in, the lip lays the reed on the curve of the mouthpiece earlier and softens its closure, and damps it. So
//! the flow loses its corners, and the sound the partials that these make. The rounder lay raises the pitch and the damping
//! lowers it; the two numbers here let the pitch stay.

use crate::reed::MovingReed;

/// Curve of the lay under a full subtone: the reed never quite shuts, even loud (measured: 1 takes too little of the partials
/// of low loud notes, 2.5 silences soft throat notes).
const LAY: f64 = 1.75;
/// Factor on the reed's damping under a full subtone: with it the pitch stays within 10 cents (measured).
const DAMPING: f64 = 1.6;

/// The reed under a lip that covers it by `amount`, 0..=1.
pub fn covered(reed: MovingReed, amount: f64) -> MovingReed {
    if amount == 0.0 {
        return reed;
    }
    let lay = reed.lay + amount * (LAY - reed.lay).max(0.0);
    MovingReed { lay, damping: reed.damping * DAMPING.powf(amount), ..reed }
}
