//! MIDI ports. The bytes of a port are MIDI messages; what they mean is the session's affair.
//!
//! midir calls back on a thread of its own and says nothing when a port goes away, so a second thread looks once a second
//! whether the port is still listed. Both end with the transport.

use crate::device::is_midi_name_of_knob;
use crate::device::transport::{Binding, Transport};
use midir::{MidiIO, MidiInput, MidiInputConnection, MidiOutput, MidiOutputConnection};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread;
use std::thread::{JoinHandle, Thread};
use std::time::Duration;

/// What our own ports are called; never a knob.
const CLIENT: &str = "Chalumeau link";

/// Messages between midir's thread and ours; more are dropped.
const QUEUE: usize = 1024;

/// Messages handed over in one poll.
const BUDGET: usize = 256;

/// How often the system is asked whether the port is still there.
const WATCH: Duration = Duration::from_secs(1);

/// Why MIDI cannot be had.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MidiError {
    /// No MIDI on this system at all.
    #[error("MIDI is not available: {0}")]
    Unavailable(String),
    /// No such port now.
    #[error("no MIDI port {0}")]
    Missing(String),
    /// The port is there and does not open.
    #[error("the MIDI port {name} does not open: {reason}")]
    Refused {
        /// Name of the port.
        name: String,
        /// What the system says.
        reason: String,
    },
}

/// A pair of MIDI ports of one name, open.
pub struct MidiTransport {
    name: String,
    incoming: Receiver<Vec<u8>>,
    _input: MidiInputConnection<()>,
    output: Option<MidiOutputConnection>,
    watch: PortWatch,
}

/// Names of the input ports behind which a knob may be; all of them with `any`.
pub fn ports(any: bool) -> Result<Vec<String>, MidiError> {
    let input = MidiInput::new(CLIENT).map_err(|e| MidiError::Unavailable(e.to_string()))?;
    Ok(names(&input).into_iter().filter(|name| any || is_midi_name_of_knob(name)).collect())
}

fn names<T: MidiIO>(io: &T) -> Vec<String> {
    let names = io.ports().iter().filter_map(|port| io.port_name(port).ok()).collect::<Vec<_>>();
    names.into_iter().filter(|name| !name.contains(CLIENT)).collect()
}

/// The port whose name is, or contains, the wanted one; without a wish the first known.
fn find<T: MidiIO>(io: &T, wanted: Option<&str>) -> Option<(T::Port, String)> {
    let names = |port: &T::Port| io.port_name(port).ok().filter(|name| !name.contains(CLIENT));
    let named: Vec<_> =
        io.ports().into_iter().filter_map(|port| names(&port).map(|name| (port, name))).collect();
    let exact = named.iter().find(|(_, name)| Some(name.as_str()) == wanted);
    let close = || {
        named.iter().find(|(_, name)| match wanted {
            Some(wanted) => name.to_lowercase().contains(&wanted.to_lowercase()),
            None => is_midi_name_of_knob(name),
        })
    };
    exact.or_else(close).cloned()
}

impl MidiTransport {
    /// Opens the input port whose name contains `wanted`, or the first that sounds like a knob, and the output port that
    /// goes with it if there is one.
    pub fn open(wanted: Option<&str>) -> Result<Self, MidiError> {
        let unavailable = |e: midir::InitError| MidiError::Unavailable(e.to_string());
        let mut input = MidiInput::new(CLIENT).map_err(unavailable)?;
        // SysEx carries the frames; clock and sensing carry nothing.
        input.ignore(midir::Ignore::TimeAndActiveSense);
        let missing = || match wanted {
            Some(name) => MidiError::Missing(format!("called {name}")),
            None => MidiError::Missing("called TorqueTuner or Chalumeau".into()),
        };
        let (port, name) = find(&input, wanted).ok_or_else(missing)?;
        let (sender, incoming) = sync_channel(QUEUE);
        let on_message = move |_stamp: u64, bytes: &[u8], _: &mut ()| {
            let _ = sender.try_send(bytes.to_vec());
        };
        let refused = |reason: String| MidiError::Refused { name: name.clone(), reason };
        let input = input.connect(&port, "from knob", on_message, ()).map_err(|e| refused(e.to_string()))?;
        let output = MidiOutput::new(CLIENT).map_err(unavailable)?;
        let output = match find_partner(&output, &name, wanted) {
            Some(port) => Some(output.connect(&port, "to knob").map_err(|e| refused(e.to_string()))?),
            None => None,
        };
        let watch = PortWatch::begin(name.clone());
        Ok(Self { name, incoming, _input: input, output, watch })
    }
}

/// The output port of the device whose input port is called `name`: the one of the same name, else one that `wanted`, or
/// the sound of its name, makes likely.
fn find_partner(output: &MidiOutput, name: &str, wanted: Option<&str>) -> Option<midir::MidiOutputPort> {
    let ports = output.ports();
    let is_same =
        |port: &&midir::MidiOutputPort| output.port_name(port).is_ok_and(|other| stem(&other) == stem(name));
    ports.iter().find(is_same).cloned().or_else(|| Some(find(output, wanted)?.0))
}

/// A port's name without the numbers that differ between both ports of a device: ALSA's ` 28:0` at the end, JACK's `-01`
/// after the first of two clients of one name.
fn stem(name: &str) -> String {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let without_alsa = match name.rsplit_once(' ') {
        Some((rest, numbers)) if numbers.split(':').all(is_number) && numbers.contains(':') => rest,
        _ => name,
    };
    let (client, port) = without_alsa.split_once(':').unwrap_or((without_alsa, ""));
    let client = match client.rsplit_once('-') {
        Some((rest, number)) if number.len() == 2 && is_number(number) => rest,
        _ => client,
    };
    format!("{client}:{port}")
}

impl Transport for MidiTransport {
    fn binding(&self) -> Binding {
        Binding::Midi
    }

    fn poll(&mut self, wait: Duration, sink: &mut dyn FnMut(&[u8])) -> io::Result<()> {
        if self.watch.is_gone() {
            return Err(io::Error::new(
                io::ErrorKind::NotConnected,
                format!("{} is no longer listed", self.name),
            ));
        }
        match self.incoming.recv_timeout(wait) {
            Ok(message) => sink(&message),
            Err(RecvTimeoutError::Timeout) => return Ok(()),
            Err(RecvTimeoutError::Disconnected) => return Err(io::ErrorKind::BrokenPipe.into()),
        }
        self.incoming.try_iter().take(BUDGET - 1).for_each(|message| sink(&message));
        Ok(())
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        match &mut self.output {
            Some(output) => output.send(bytes).map_err(io::Error::other),
            // Such a device can be played and not felt.
            None => Ok(()),
        }
    }

    fn describe(&self) -> String {
        self.name.clone()
    }
}

/// Looks whether a port is still listed, on a thread that ends when this is dropped.
struct PortWatch {
    stop: Arc<AtomicBool>,
    gone: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl PortWatch {
    fn begin(name: String) -> Self {
        let (stop, gone) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
        let flags = (stop.clone(), gone.clone());
        let look = move || {
            let (stop, gone) = flags;
            // One for all looks: to JACK each new one is a change of all its connections.
            let mut list = None;
            while !stop.load(Ordering::Relaxed) {
                thread::park_timeout(WATCH);
                list = list.or_else(|| MidiInput::new(CLIENT).ok());
                // Without a list nothing is known; if MIDI itself has gone the silence tells.
                let is_missing = |list: &MidiInput| !names(list).contains(&name);
                if list.as_ref().is_some_and(is_missing) {
                    return gone.store(true, Ordering::Relaxed);
                }
            }
        };
        // Without the thread the port is used all the same; then only its silence tells.
        let thread = thread::Builder::new().name("chalumeau midi watch".into()).spawn(look).ok();
        Self { stop, gone, thread }
    }

    fn is_gone(&self) -> bool {
        self.gone.load(Ordering::Relaxed)
    }
}

impl Drop for PortWatch {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            Thread::unpark(thread.thread());
            let _ = thread.join(); // a panicked watcher has already been reported
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knobs_are_known_by_name_and_we_are_none() {
        assert!(is_midi_name_of_knob("TorqueTuner_001 MIDI 1") && is_midi_name_of_knob("CHALUMEAU knob"));
        assert!(!is_midi_name_of_knob("Midi Through Port-0"));
    }

    #[test]
    fn both_ports_of_a_device_have_one_stem_whatever_numbers_they_are_given() {
        for (input, output) in [
            ("TorqueTuner:TorqueTuner MIDI 1 28:0", "TorqueTuner:TorqueTuner MIDI 1 28:1"),
            ("TorqueTuner sim-01:TorqueTuner sim", "TorqueTuner sim:TorqueTuner sim"),
            ("TorqueTuner", "TorqueTuner"),
        ] {
            assert_eq!(stem(input), stem(output));
        }
        assert_ne!(stem("TorqueTuner_001:MIDI 1 28:0"), stem("TorqueTuner_002:MIDI 1 29:0"));
        assert_ne!(stem("TorqueTuner:MIDI 1 28:0"), stem("TorqueTuner:MIDI 2 28:1"));
    }
}
