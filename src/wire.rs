//! TTLink 1: bytes become messages and messages bytes. `docs/protocol.md` is the specification.
//!
//! Nothing here knows of ports, time or threads.

pub mod message;

pub use message::{Arm, Capabilities, Event, EventKind, Feel, Flags, Info, Law, Message, State};
