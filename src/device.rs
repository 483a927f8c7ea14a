//! Links to knobs.

pub mod clock;
pub mod memory;
pub mod reader;
pub mod serial;
pub mod session;
pub mod stats;
pub mod transport;
