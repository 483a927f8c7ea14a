//! Reed and bore married: the voice, how a player articulates, and what comes out at the host's rate.

mod clarinet;
pub mod embouchure;
pub mod felt;
pub mod held;
pub mod model;
pub mod player;
mod settings;
mod slap;
pub mod tuning;
pub mod voice;

pub use clarinet::Clarinet;
pub use model::{BuildError, Model};
pub use settings::{Settings, Tuning};
pub use voice::{Probe, Voice};
