//! Two ends of a wire in memory, for tests and for a simulator within the program.
//!
//! As a serial line the wire is a stream of bytes; as MIDI or OSC each sent chunk arrives whole. Dropping one end is what
//! pulling a cable is to the other.

use crate::device::transport::{Binding, Transport};
use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError, TrySendError, sync_channel};
use std::time::Duration;

/// Chunks under way in one direction; more are dropped, as a serial driver does.
const CAPACITY: usize = 4096;

/// Chunks handed over in one poll.
const BUDGET: usize = 256;

/// One end of a wire in memory.
pub struct MemoryPort {
    binding: Binding,
    name: String,
    incoming: Receiver<Vec<u8>>,
    outgoing: SyncSender<Vec<u8>>,
}

/// Both ends of a new wire.
pub fn pair(binding: Binding, name: &str) -> (MemoryPort, MemoryPort) {
    let (to_right, from_left) = sync_channel(CAPACITY);
    let (to_left, from_right) = sync_channel(CAPACITY);
    let end = |incoming, outgoing| MemoryPort { binding, name: name.into(), incoming, outgoing };
    (end(from_right, to_right), end(from_left, to_left))
}

impl Transport for MemoryPort {
    fn binding(&self) -> Binding {
        self.binding
    }

    fn poll(&mut self, wait: Duration, sink: &mut dyn FnMut(&[u8])) -> io::Result<()> {
        match self.incoming.recv_timeout(wait) {
            Ok(chunk) => sink(&chunk),
            Err(RecvTimeoutError::Timeout) => return Ok(()),
            Err(RecvTimeoutError::Disconnected) => return Err(io::ErrorKind::BrokenPipe.into()),
        }
        for _ in 1..BUDGET {
            match self.incoming.try_recv() {
                Ok(chunk) => sink(&chunk),
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => break,
            }
        }
        Ok(())
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.outgoing.try_send(bytes.into()).map_err(|e| match e {
            TrySendError::Full(_) => io::ErrorKind::WouldBlock.into(),
            TrySendError::Disconnected(_) => io::ErrorKind::BrokenPipe.into(),
        })
    }

    fn describe(&self) -> String {
        self.name.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dropped_end_is_a_pulled_cable() {
        let (mut host, mut knob) = pair(Binding::Serial, "memory");
        knob.send(b"last words").unwrap();
        drop(knob);
        let mut heard = Vec::new();
        host.poll(Duration::ZERO, &mut |chunk| heard.extend_from_slice(chunk)).unwrap();
        assert_eq!(heard, b"last words", "what was sent before still arrives");
        assert_eq!(host.poll(Duration::ZERO, &mut |_| {}).unwrap_err().kind(), io::ErrorKind::BrokenPipe);
        assert_eq!(host.send(b"x").unwrap_err().kind(), io::ErrorKind::BrokenPipe);
    }

    #[test]
    fn nobody_reading_fills_the_wire_and_blocks_nobody() {
        let (mut host, _knob) = pair(Binding::Serial, "memory");
        let refused = (0..2 * CAPACITY).find_map(|_| host.send(b"x").err());
        assert_eq!(refused.unwrap().kind(), io::ErrorKind::WouldBlock);
    }
}
