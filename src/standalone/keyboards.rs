//! MIDI keyboards and wind controllers at the system's own MIDI: all that are plugged in play, at once, also those that come
//! later. (A JACK server has ports of its own: [`jack`](super::jack).)
//!
//! midir calls back on a thread for each port. All of them push into one queue, which the audio thread empties at the
//! beginning of each block. The *keyboards* thread looks five times a second which ports have come and gone.

use std::collections::HashSet;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::JoinHandle;
use std::time::Duration;

use chalumeau_knob::device::is_midi_name_of_knob;
use midir::{Ignore, MidiInput, MidiInputConnection, MidiInputPort};
use nice_plug::context::PluginApi;
use nice_plug::context::process::SendEventError;
use nice_plug::prelude::*;
use rtrb::{Consumer, Producer, RingBuffer};

use super::held_keys::HeldKeys;
use crate::plugin::launch_options::LaunchOptions;

/// What our own ports are called.
pub(super) const CLIENT: &str = "Chalumeau keyboards";
/// In the name of the system's port that sends back what it gets.
const THROUGH: &str = "midi through";

/// How often the thread looks. A device that is away for less than that keeps its name, and is not heard when it is back.
const LOOK: Duration = Duration::from_millis(200);
/// How long the program waits at its start for the first look.
const BEGINNING: Duration = Duration::from_secs(2);
/// Messages between two blocks; more are dropped.
const QUEUE: usize = 1024;

/// All notes off, on the first channel. The plugin heeds it on any.
const ALL_NOTES_OFF: [u8; 3] = [0xB0, 123, 0];

/// What keyboards have sent since the last block. The framework makes the plugin and passes nothing to it; so this is a
/// global.
static INCOMING: Mutex<Option<Consumer<Sent>>> = Mutex::new(None);

type Held = Arc<Mutex<HeldKeys>>;

/// A message of up to three bytes, and how many they are.
type Sent = ([u8; 3], usize);

/// Whether a port of this name, or one of its other names, is a keyboard that plays without being asked for.
pub fn plays_unasked<'a>(names: impl IntoIterator<Item = &'a str>) -> bool {
    names.into_iter().all(|name| !is_midi_name_of_knob(name) && !name.to_lowercase().contains(THROUGH))
}

/// The open keyboards. They close when this is dropped.
pub struct Keyboards {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Keyboards {
    /// Opens those whose name contains `wanted`, without a wish all. Waits until those that are there are open.
    pub fn open(wanted: Option<String>) -> Self {
        let (producer, consumer) = RingBuffer::new(QUEUE);
        *INCOMING.lock().unwrap_or_else(PoisonError::into_inner) = Some(consumer);
        let (stop, stopped) = channel();
        let (tell, told) = channel();
        let run = move || {
            // The one that lists ports. It stays: to some systems, each new one is a change of all connections.
            let list = match MidiInput::new(CLIENT) {
                Ok(list) => list,
                Err(reason) => return say(&format!("no MIDI: {reason}")),
            };
            let mut state = State {
                list,
                wanted,
                queue: Arc::new(Mutex::new(producer)),
                open: Vec::new(),
                refused: HashSet::new(),
            };
            state.look();
            state.say_if_none();
            // By now, nobody may wait any more.
            let _ = tell.send(());
            while stopped.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                state.look();
            }
        };
        let thread = std::thread::Builder::new().name("keyboards".to_owned()).spawn(run).ok();
        let _ = told.recv_timeout(BEGINNING);
        Self { stop: Some(stop), thread }
    }
}

impl Drop for Keyboards {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // a panic has been reported already
        }
    }
}

fn say(text: &str) {
    tell!("chalumeau-standalone: {text}");
}

/// The keyboards thread's state.
struct State {
    list: MidiInput,
    wanted: Option<String>,
    queue: Arc<Mutex<Producer<Sent>>>,
    open: Vec<Keyboard>,
    /// Ports that do not open, by their ids. They are tried again when they have been unplugged.
    refused: HashSet<String>,
}

/// One open port.
struct Keyboard {
    id: String,
    name: String,
    held: Held,
    _connection: MidiInputConnection<()>,
}

impl State {
    fn look(&mut self) {
        let ports = self.list.ports();
        let ids: HashSet<_> = ports.iter().map(MidiInputPort::id).collect();
        self.refused.retain(|id| ids.contains(id));
        let (stay, gone): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.open).into_iter().partition(|keyboard| ids.contains(&keyboard.id));
        self.open = stay;
        for Keyboard { name, held, .. } in gone {
            say(&format!("MIDI input gone: {name}"));
            // Whoever played these notes cannot release them any more. Those of other keyboards go on.
            let down = |held: &Held| *held.lock().unwrap_or_else(PoisonError::into_inner);
            let others: Vec<HeldKeys> = self.open.iter().map(|other| down(&other.held)).collect();
            for message in down(&held).endings(&others) {
                push(&self.queue, &message);
            }
            if self.open.is_empty() {
                push(&self.queue, &ALL_NOTES_OFF);
            }
        }
        for port in ports {
            let id = port.id();
            let is_known = self.refused.contains(&id) || self.open.iter().any(|keyboard| keyboard.id == id);
            match self.list.port_name(&port) {
                Ok(name) if !is_known && self.is_wanted(&name) => match connected(&port, &self.queue) {
                    Ok((connection, held)) => {
                        say(&format!("MIDI input: {name}"));
                        self.open.push(Keyboard { id, name, held, _connection: connection });
                    }
                    Err(reason) => {
                        say(&format!("the MIDI input {name} does not open: {reason}"));
                        self.refused.insert(id);
                    }
                },
                // What has no name has gone again.
                _ => {}
            }
        }
        let names = self.open.iter().map(|keyboard| keyboard.name.clone()).collect();
        LaunchOptions::connect(|now| now.midi = names);
    }

    fn is_wanted(&self, name: &str) -> bool {
        let is_own = name.contains(CLIENT);
        !is_own
            && match &self.wanted {
                Some(wanted) => name.to_lowercase().contains(&wanted.to_lowercase()),
                None => plays_unasked([name]),
            }
    }

    fn say_if_none(&self) {
        match &self.wanted {
            _ if !self.open.is_empty() => {}
            Some(wanted) => {
                let names = self.list.ports().into_iter().filter_map(|port| self.list.port_name(&port).ok());
                let there: Vec<_> = names.filter(|name| !name.contains(CLIENT)).collect();
                let there = if there.is_empty() { "none".to_owned() } else { there.join(", ") };
                say(&format!(
                    "no MIDI input has {wanted:?} in its name yet; it plays when it comes. There now: {there}"
                ));
            }
            None => say("no MIDI input yet; a keyboard plays as soon as you plug it in"),
        }
    }
}

/// A port whose messages go into the queue, and the keys that are down there.
fn connected(
    port: &MidiInputPort,
    queue: &Arc<Mutex<Producer<Sent>>>,
) -> Result<(MidiInputConnection<()>, Held), String> {
    let mut input = MidiInput::new(CLIENT).map_err(|reason| reason.to_string())?;
    input.ignore(Ignore::All);
    let queue = queue.clone();
    let held = Held::default();
    let hears = held.clone();
    let hear = move |_stamp: u64, bytes: &[u8], _: &mut ()| {
        hears.lock().unwrap_or_else(PoisonError::into_inner).hear(bytes);
        push(&queue, bytes);
    };
    let connection = input.connect(port, "keyboard", hear, ()).map_err(|reason| reason.to_string())?;
    Ok((connection, held))
}

/// Only threads of MIDI wait here for each other.
fn push(queue: &Mutex<Producer<Sent>>, bytes: &[u8]) {
    let mut message = [0; 3];
    if let Some(place) = message.get_mut(..bytes.len()) {
        place.copy_from_slice(bytes);
        // A full queue means that no sound is made.
        let _ = queue.lock().unwrap_or_else(PoisonError::into_inner).push((message, bytes.len()));
    }
}

/// A block in which keyboards play before what the framework has. Real-time safe. [audio thread]
pub struct WithKeyboards<'a, C> {
    context: &'a mut C,
    /// `None` for a block in which the program opens the keyboards, and if there are none.
    incoming: Option<MutexGuard<'static, Option<Consumer<Sent>>>>,
}

impl<'a, C> WithKeyboards<'a, C> {
    /// Adds what keyboards have sent since the last block.
    pub fn new(context: &'a mut C) -> Self {
        let incoming = match INCOMING.try_lock() {
            Ok(incoming) => Some(incoming),
            Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        };
        Self { context, incoming }
    }

    fn next_of_keyboards(&mut self) -> Option<NoteEvent<()>> {
        let incoming = self.incoming.as_mut()?.as_mut()?;
        // What is no note event is skipped.
        std::iter::from_fn(|| incoming.pop().ok())
            .find_map(|(bytes, length)| NoteEvent::from_midi(0, &bytes[..length]).ok())
    }
}

impl<P: Plugin<SysExMessage = ()>, C: ProcessContext<P>> ProcessContext<P> for WithKeyboards<'_, C> {
    fn plugin_api(&self) -> PluginApi {
        self.context.plugin_api()
    }

    fn execute_background(&self, task: P::BackgroundTask) {
        self.context.execute_background(task);
    }

    fn execute_gui(&self, task: P::BackgroundTask) {
        self.context.execute_gui(task);
    }

    fn transport(&self) -> &Transport {
        self.context.transport()
    }

    fn next_event(&mut self) -> Option<NoteEvent<()>> {
        self.next_of_keyboards().or_else(|| self.context.next_event())
    }

    fn try_send_event(&mut self, event: NoteEvent<()>) -> Result<(), (NoteEvent<()>, SendEventError)> {
        self.context.try_send_event(event)
    }

    fn set_latency_samples(&self, samples: u32) {
        self.context.set_latency_samples(samples);
    }

    fn request_restart(&self) {
        self.context.request_restart();
    }

    fn set_current_voice_capacity(&self, capacity: u32) {
        self.context.set_current_voice_capacity(capacity);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keyboards_play_unasked_and_knobs_and_loops_do_not() {
        assert!(plays_unasked(["Arturia KeyStep 32:Arturia KeyStep 32 MIDI 1 28:0"]));
        assert!(!plays_unasked(["Midi Through:Midi Through Port-0 14:0"]));
        assert!(!plays_unasked(["system:midi_capture_2", "alsa_pcm:TorqueTuner/midi_capture_1"]));
    }
}
