//! Reed and bore married: the voice, how a player articulates, and what comes out at the host's rate.

pub mod bend;
mod clarinet;
pub mod embouchure;
pub mod felt;
pub mod held;
pub mod model;
pub mod player;
pub mod prepare;
mod scale;
mod settings;
mod slap;
pub mod store;
pub mod tuner;
pub mod tuning;
pub mod voice;
pub mod watch;

pub use clarinet::Clarinet;
pub use model::{BuildError, Model};
pub use prepare::{Quality, Wanted};
pub use settings::{Settings, Tuning};
pub use voice::{Probe, Voice};
