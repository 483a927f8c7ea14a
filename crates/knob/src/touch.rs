//! Plays the clarinet by a knob: turns angles into breath, computes the feel of each note, and keeps takes and studies.
//!
//! This module joins the instrument's settings with the feel. Plugin and command line both play through it.

pub mod angle;
pub mod breath_from_angle;
pub mod feel;
pub mod heard;
pub mod study;
pub mod take;
pub mod take_csv;
