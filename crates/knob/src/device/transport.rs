//! The one socket every knob fits into: bytes in, bytes out, never a long wait.
//!
//! A transport knows ports, not messages. What a chunk of bytes is depends on the binding: any piece of the stream for a
//! serial line, one whole MIDI message, one whole datagram.

use std::io;
use std::time::Duration;

/// Speed of a serial line.
pub const BAUD: u32 = 921_600;

/// Speed for lines that do not carry the first, and of unmodified firmware.
pub const SLOW_BAUD: u32 = 115_200;

/// How messages travel over a transport.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binding {
    /// TTLink frames in a byte stream.
    Serial,
    /// Control changes, and TTLink frames in SysEx.
    Midi,
    /// Datagrams of unmodified firmware; nothing can be sent back.
    Osc,
}

/// An open port.
pub trait Transport: Send {
    /// Which binding its bytes follow.
    fn binding(&self) -> Binding;

    /// Hands what has arrived to `sink`, one chunk at a time; with nothing there, waits `wait` at most. How much one call
    /// hands over is bounded, so that a flood cannot hold the caller. An error means that the port is gone.
    fn poll(&mut self, wait: Duration, sink: &mut dyn FnMut(&[u8])) -> io::Result<()>;

    /// Sends one frame whole or not at all, never waiting longer than a few ms. A port too full to take the frame drops it
    /// and says `WouldBlock`: every message is repeated sooner or later. Any other error means that the port is gone.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Changes the speed of the line where there is one; what was received at the old speed and not read is dropped.
    fn set_baud(&mut self, baud: u32) -> io::Result<()> {
        let _ = baud;
        Ok(())
    }

    /// What people call it: path or port name.
    fn describe(&self) -> String;
}
