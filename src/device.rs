//! Links to knobs.

pub mod clock;
pub mod discover;
pub mod feel_osc;
pub mod lock;
pub mod memory;
pub mod midi;
pub mod osc;
pub mod places;
pub mod reader;
pub mod serial;
pub mod session;
pub mod stats;
pub mod stock;
pub mod transport;
