//! Turns what controllers send into [`Event`](crate::event::Event)s. Nothing here depends on an instrument.

pub mod bends;
pub mod key_switches;
pub mod keys;
pub mod midi;
pub mod notes;
pub mod parts;
pub mod wind;
