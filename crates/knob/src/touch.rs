//! The clarinet played by a knob: what its angle blows, what its hand shall feel, takes and studies.
//!
//! This is where the instrument's settings and the feel meet; plugin and command line both play through it.

pub mod blower;
pub mod feel;
pub mod study;
pub mod take;
pub mod take_csv;
