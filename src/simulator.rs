//! A simulated TorqueTuner: the real firmware, a knob with friction and an encoder, and a hand that turns it.

pub mod fault;
pub mod hand;
pub mod line;
pub mod osc;
pub mod plant;
pub mod script;
pub mod stock;
