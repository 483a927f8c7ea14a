//! TTLink 1: bytes become messages and messages bytes. `docs/protocol.md` is the specification.
//!
//! Nothing here knows of ports, time or threads, allocates, or can be brought to panic by what it is fed.

pub mod codes;
pub mod frame;
pub mod limits;
pub mod message;
pub mod midi;
mod payload;

pub use codes::{FaultCode, RefusedCode};
pub use frame::{Decoder, EncodedFrame, FrameError, WireStats, encode};
pub use limits::{FieldRange, OutOfRange};
pub use message::{Arm, Capabilities, DeviceEvent, DeviceState, EventKind, Feel, Flags, Info, Law, Message};

/// Version of the protocol spoken here: another major one is never armed.
pub const MAJOR: u8 = 1;
/// Of two minor versions the lower one is spoken.
pub const MINOR: u8 = 0;
