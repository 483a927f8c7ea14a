//! Reed and bore married: the voice, how a player articulates, and what comes out at the host's rate.

mod clarinet;
mod settings;

pub use clarinet::{Clarinet, Probe};
pub use settings::{Settings, Tuning};
