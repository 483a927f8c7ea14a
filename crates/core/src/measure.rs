//! Measurements of played notes: pitch and level, the bifurcation diagram, one steady period of the reed.
//!
//! These functions play a [`Score`](crate::score::Score) or watch one being played. [`analysis`](crate::analysis) holds the
//! methods that know only samples.

pub mod bifurcation;
pub mod notes;
pub mod steady_period;
