//! What controllers send, made into events. Nothing here knows the instrument behind them.

pub mod bends;
pub mod keys;
pub mod knob;
pub mod midi;
