//! A simulated TorqueTuner: the real firmware, a knob with friction and an encoder, and a hand that turns it.
//!
//! [`knob::SimulatedKnob`] runs in simulated time, for tests; [`serve::Server`] in real time at a pseudo-terminal, a MIDI
//! port or as OSC, for everybody without hardware. `docs/simulator.md` says what the model leaves out. It has not been compared with
//! a real TorqueTuner.

pub mod fault;
pub mod hand;
pub mod knob;
pub mod line;
pub mod midi;
pub mod osc;
pub mod plant;
#[cfg(unix)]
pub mod pty;
pub mod script;
pub mod serve;
pub mod stock;
mod tap;
