//! MIDI ports. The bytes of a port are MIDI messages; what they mean is the session's affair.
//!
//! midir calls back on a thread of its own and says nothing when a port goes away, so a second thread looks once a second
//! whether the port is still listed. Both end with the transport.

use crate::device::transport::{Binding, Transport};
use midir::{MidiIO, MidiInput, MidiInputConnection, MidiOutput, MidiOutputConnection};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread;
use std::thread::{JoinHandle, Thread};
use std::time::Duration;

/// Names under which a knob is taken without being chosen.
const KNOWN: [&str; 2] = ["torquetuner", "chalumeau"];

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
    #[error("no MIDI port {0} that a knob could be behind")]
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
    watch: Watch,
}

/// Names of the input ports behind which a knob may be; all of them with `any`.
pub fn ports(any: bool) -> Result<Vec<String>, MidiError> {
    let input = MidiInput::new(CLIENT).map_err(|e| MidiError::Unavailable(e.to_string()))?;
    Ok(named(&input).into_iter().map(|(_, name)| name).filter(|name| any || is_known(name)).collect())
}

fn is_known(name: &str) -> bool {
    let name = name.to_lowercase();
    KNOWN.iter().any(|known| name.contains(known))
}

/// Every port but our own, with its name.
fn named<T: MidiIO>(io: &T) -> Vec<(T::Port, String)> {
    let named = |port: T::Port| io.port_name(&port).ok().map(|name| (port, name));
    io.ports().into_iter().filter_map(named).filter(|(_, name)| !name.contains(CLIENT)).collect()
}

/// Which of these names is, or contains, the wanted one; without a wish the first known.
fn choose(names: &[&str], wanted: Option<&str>) -> Option<usize> {
    let close = |name: &&str| match wanted {
        Some(wanted) => name.to_lowercase().contains(&wanted.to_lowercase()),
        None => is_known(name),
    };
    names.iter().position(|name| Some(*name) == wanted).or_else(|| names.iter().position(close))
}

/// Which of these names belongs to the same device as `name`.
fn choose_partner(names: &[&str], name: &str) -> Option<usize> {
    let twin = names.iter().position(|other| device(other) == device(name));
    twin.or_else(|| choose(names, Some(device(name).1)))
}

fn find<T: MidiIO>(io: &T, choice: impl FnOnce(&[&str]) -> Option<usize>) -> Option<(T::Port, String)> {
    let mut named = named(io);
    let names: Vec<&str> = named.iter().map(|(_, name)| name.as_str()).collect();
    choice(&names).map(|index| named.swap_remove(index))
}

/// Client and port without what tells two ports of one device apart: ALSA appends the numbers of client and port to the
/// name (`Knob:Knob MIDI 1 28:0`), JACK a number to the client, as programs open one for each direction
/// (`Knob-01:Knob`). On other systems a port is its name.
fn device(name: &str) -> (&str, &str) {
    let end = name.rfind(' ').filter(|at| name[at + 1..].contains(':'));
    let name = &name[..end.unwrap_or(name.len())];
    let Some((client, port)) = name.split_once(':') else { return ("", name) };
    let is_number = |text: &str| text.len() == 2 && text.bytes().all(|byte| byte.is_ascii_digit());
    let client = client.rsplit_once('-').filter(|(_, number)| is_number(number)).map_or(client, |(of, _)| of);
    (client, port)
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
        let (port, name) = find(&input, |names| choose(names, wanted)).ok_or_else(missing)?;
        let (sender, incoming) = sync_channel(QUEUE);
        let on_message = move |_stamp: u64, bytes: &[u8], _: &mut ()| {
            let _ = sender.try_send(bytes.to_vec());
        };
        let refused = |reason: String| MidiError::Refused { name: name.clone(), reason };
        let input = input.connect(&port, "from knob", on_message, ()).map_err(|e| refused(e.to_string()))?;
        let output = MidiOutput::new(CLIENT).map_err(unavailable)?;
        let output = match find(&output, |names| choose_partner(names, &name)) {
            Some((port, _)) => Some(output.connect(&port, "to knob").map_err(|e| refused(e.to_string()))?),
            None => None,
        };
        let watch = Watch::begin(name.clone());
        Ok(Self { name, incoming, _input: input, output, watch })
    }
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
struct Watch {
    stop: Arc<AtomicBool>,
    gone: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    fn begin(name: String) -> Self {
        let (stop, gone) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
        let flags = (stop.clone(), gone.clone());
        let look = move || {
            let (stop, gone) = flags;
            while !stop.load(Ordering::Relaxed) {
                thread::park_timeout(WATCH);
                if !ports(true).is_ok_and(|ports| ports.contains(&name)) {
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

impl Drop for Watch {
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
        assert!(is_known("TorqueTuner_001 MIDI 1") && is_known("CHALUMEAU knob"));
        assert!(!is_known("Midi Through Port-0"));
    }

    #[test]
    fn the_other_port_is_found_whatever_the_system_appends() {
        for (input, outputs, expected) in [
            (
                "Knob:Knob MIDI 1 28:0",
                ["Thru:Thru 14:0", "Knob:Knob MIDI 2 28:1", "Knob:Knob MIDI 1 29:0"],
                2,
            ),
            ("Knob-01:Knob", ["system:midi_playback_1", "Other-01:Other", "Knob:Knob"], 2),
            ("Knob MIDI 1", ["Synth", "Knob MIDI 1", "Knob MIDI 2"], 1),
            ("Knob", ["Synth", "2- Knob", "Piano"], 1),
        ] {
            assert_eq!(choose_partner(&outputs, input), Some(expected), "{input}");
        }
        assert_eq!(choose_partner(&["Synth", "Thru:Thru 14:0"], "Knob:Knob 28:0"), None);
    }

    #[test]
    fn the_name_asked_for_goes_before_one_that_contains_it() {
        let names = ["My TorqueTuner", "TorqueTuner", "Thru"];
        assert_eq!(choose(&names, Some("TorqueTuner")), Some(1));
        assert_eq!(choose(&names, Some("thru")), Some(2));
        assert_eq!(choose(&names, Some("my")), Some(0));
        assert_eq!(choose(&names, Some("Synth")), None);
        assert_eq!(choose(&names, None), Some(0));
        assert_eq!(choose(&["Thru"], None), None);
    }
}
