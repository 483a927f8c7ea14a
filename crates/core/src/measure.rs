//! Measurements of played notes: pitch and level, the bifurcation diagram, one steady period of the reed; and of what
//! the instrument sends out.
//!
//! These functions play a [`Score`](crate::score::Score) or watch one being played. [`analysis`](crate::analysis) holds the
//! methods that know only samples.

pub mod bifurcation;
pub mod multiphonics;
pub mod notes;
pub mod radiated_bands;
pub mod realism;
pub mod shelf;
pub mod steady_period;
