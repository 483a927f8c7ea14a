//! The protocol TTLink 1: encodes messages as bytes and decodes bytes into messages. `docs/protocol.md` is the
//! specification.
//!
//! The code here uses no ports, clock or threads. It does not allocate, and no input makes it panic.

pub mod codes;
pub mod frame;
pub mod limits;
pub mod message;
pub mod midi;
mod payload;
pub mod plain_text;

pub use codes::{FaultCode, RefusedCode};
pub use frame::{Decoder, EncodedFrame, FrameError, WireStats, encode};
pub use limits::{FieldRange, OutOfRange};
pub use message::{
    Arm, Capabilities, Counters, DeviceEvent, DeviceState, EventKind, Feel, Flags, Info, Message, Stamp,
    TorqueLaw, UNCALIBRATED_CEILING_MNM, UNDATED_CEILING_MNM,
};

/// Version of the protocol spoken here: another major one is never armed.
pub const MAJOR: u8 = 1;
/// Of two minor versions the lower one is spoken.
pub const MINOR: u8 = 1;
