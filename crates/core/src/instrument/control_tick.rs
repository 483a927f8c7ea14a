//! The grid on which a player moves.

/// Samples of one control tick. Everything a player moves, moves on this grid, counted from the last reset.
pub use crate::bore::lattice::choir::TICK;
