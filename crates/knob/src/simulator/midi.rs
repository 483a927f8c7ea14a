//! MIDI: bytes cut into whole messages, and a virtual port of the system where it has them.

#[cfg(unix)]
use midir::os::unix::{VirtualInput, VirtualOutput};
#[cfg(unix)]
use midir::{Ignore, MidiInput, MidiInputConnection, MidiOutput, MidiOutputConnection};
#[cfg(unix)]
use std::sync::mpsc::{Receiver, sync_channel};

/// Longest message; a SysEx of TTLink has 80 bytes.
const MESSAGE_MAX: usize = 256;

/// Messages from the host that may wait between two periods.
#[cfg(unix)]
const WAITING_MAX: usize = 1024;

/// Cuts a stream of bytes, as the firmware writes it, into messages, as ports want them. Running status is not used there.
#[derive(Debug, Default)]
pub struct MidiSplitter {
    message: Vec<u8>,
}

impl MidiSplitter {
    /// Hands over each message `bytes` complete.
    pub fn split(&mut self, bytes: &[u8], mut sink: impl FnMut(&[u8])) {
        for &byte in bytes {
            if byte >= 0x80 && byte != 0xF7 {
                self.message.clear();
            }
            self.message.push(byte);
            let is_complete = match self.message[0] {
                0xF0 => byte == 0xF7,
                0x80..=0xBF | 0xE0..=0xEF => self.message.len() == 3,
                0xC0..=0xDF => self.message.len() == 2,
                _ => self.message.len() > 1, // nothing the firmware sends
            };
            if is_complete && self.message[0] >= 0x80 {
                sink(&self.message);
            }
            if is_complete || self.message.len() > MESSAGE_MAX {
                self.message.clear();
            }
        }
    }
}

/// Why there is no virtual port.
#[derive(Debug, thiserror::Error)]
#[error(
    "no virtual MIDI port ({0}). On Linux this needs ALSA's sequencer (`modprobe snd-seq`, and permission for \
     /dev/snd/seq); without a sound card, build with `--features midi-jack` and start `jackd -d dummy`"
)]
pub struct VirtualMidiError(String);

/// A knob among the MIDI ports of the system.
#[cfg(unix)]
pub struct VirtualMidi {
    name: String,
    ports: Option<Ports>,
}

/// What the system shows while the cable is in.
#[cfg(unix)]
struct Ports {
    from_host: Receiver<Vec<u8>>,
    to_host: MidiOutputConnection,
    // Closes the port when dropped.
    _input: MidiInputConnection<()>,
}

#[cfg(unix)]
impl VirtualMidi {
    /// Opens an input and an output of this name.
    pub fn open(name: &str) -> Result<Self, VirtualMidiError> {
        Ok(Self { name: name.to_owned(), ports: Some(Ports::open(name)?) })
    }

    /// Takes the ports away, or brings them back.
    pub fn plug(&mut self, is_in: bool) -> Result<(), VirtualMidiError> {
        if is_in != self.ports.is_some() {
            self.ports = if is_in { Some(Ports::open(&self.name)?) } else { None };
        }
        Ok(())
    }

    /// Appends what hosts have sent.
    pub fn read(&mut self, into: &mut Vec<u8>) {
        let Some(ports) = &self.ports else { return };
        ports.from_host.try_iter().take(WAITING_MAX).for_each(|message| into.extend(message));
    }

    /// Sends one message to whoever listens.
    pub fn write(&mut self, message: &[u8]) {
        let Some(ports) = &mut self.ports else { return };
        // Nobody listening, or a full queue: the next STATE comes soon.
        let _ = ports.to_host.send(message);
    }
}

#[cfg(unix)]
impl Ports {
    fn open(name: &str) -> Result<Self, VirtualMidiError> {
        let failed = |e: &dyn std::fmt::Display| VirtualMidiError(e.to_string());
        let mut input = MidiInput::new(name).map_err(|e| failed(&e))?;
        input.ignore(Ignore::TimeAndActiveSense);
        let (sender, from_host) = sync_channel(WAITING_MAX);
        let _input = input
            // A full queue means that nobody runs the knob; what comes then is lost.
            .create_virtual(name, move |_, message, ()| _ = sender.try_send(message.to_vec()), ())
            .map_err(|e| failed(&e))?;
        let output = MidiOutput::new(name).map_err(|e| failed(&e))?;
        let to_host = output.create_virtual(name).map_err(|e| failed(&e))?;
        Ok(Self { from_host, to_host, _input })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stream_is_cut_into_whole_messages() {
        let mut splitter = MidiSplitter::default();
        let stream = [0xB0, 2, 64, 0xB0, 34, 1, 0xF0, 0x7D, 0x54, 0xF7, 0x12, 0xB0, 80, 127];
        let mut messages = Vec::new();
        for piece in stream.chunks(4) {
            splitter.split(piece, |message| messages.push(message.to_vec()));
        }
        let expected: [&[u8]; 4] =
            [&[0xB0, 2, 64], &[0xB0, 34, 1], &[0xF0, 0x7D, 0x54, 0xF7], &[0xB0, 80, 127]];
        assert_eq!(messages, expected);
    }

    #[test]
    fn endless_message_is_given_up() {
        let mut splitter = MidiSplitter::default();
        splitter.split(&[0xF0], |_| panic!());
        for _ in 0..100_000 {
            splitter.split(&[1], |_| panic!());
        }
        assert!(splitter.message.capacity() <= 4 * MESSAGE_MAX);
    }
}
