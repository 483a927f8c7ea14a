//! The link to the JACK server: begins to play, watches the server, and waits for the next one when it has gone.

use std::collections::HashSet;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nice_plug::context::PluginApi;
use nice_plug::prelude::*;

use super::client::{
    Connection, Health, JackClient, MICROPHONE, MIDI_INPUT, MIDI_OUTPUT, OUTPUTS, PlayingClient,
};
use super::player::LONGEST_CYCLE;
use crate::plugin::Chalumeau;
use crate::plugin::launch_options::LaunchOptions;

/// How often the link looks at the server.
const POLL: Duration = Duration::from_millis(50);
/// How often it tries to open a client while no server answers.
const RETRY: Duration = Duration::from_millis(300);
/// How often it notes or makes connections.
const CONNECTING: Duration = Duration::from_secs(1);
/// How long the program waits at its start for the server to begin. A busy server takes a few tenths of a second.
const BEGINNING: Duration = Duration::from_secs(2);
/// How long the program waits for the client to close when it ends.
const CLOSING: Duration = Duration::from_millis(800);

const GONE: &str = "the JACK server has ended; no sound until it runs again";
const STALLED: &str = "the JACK server does not call; no sound until it does";
/// On the terminal, after the two.
const QUIT: &str = "(Ctrl-C quits)";
const BACK: &str = "the JACK server is back; playing";

/// An opened client on its way from `main` to the plugin, which the framework makes by itself.
static OFFERED: Mutex<Option<(JackClient, JackPorts)>> = Mutex::new(None);

/// Ports of other programs that the user wants to be connected.
#[derive(Clone, Debug, Default)]
pub struct JackPorts {
    /// Wind there blows.
    pub microphone: Option<String>,
    /// Its MIDI plays the plugin. Without one, all devices do.
    pub midi_input: Option<String>,
    /// It receives a knob's breath.
    pub midi_output: Option<String>,
}

impl JackPorts {
    fn connections(self) -> Vec<Connection> {
        let named =
            [(MICROPHONE, self.microphone), (MIDI_INPUT, self.midi_input), (MIDI_OUTPUT, self.midi_output)];
        let named = named.into_iter().filter_map(|(own, other)| Some(Connection { own, other: other? }));
        Connection::to_sound_card().chain(named).collect()
    }
}

/// The link of one plugin to the JACK server. Dropping it closes the client.
pub struct JackLink {
    plugin: Arc<Mutex<Chalumeau>>,
    shared: Arc<LinkShared>,
    first: Mutex<Option<(JackClient, JackPorts)>>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

/// What the link thread shares with the main thread.
struct LinkShared {
    /// The server's sample rate, the bits of an f32, Hz.
    rate_hz: AtomicU32,
    stop: AtomicBool,
}

impl LinkShared {
    fn rate_hz(&self) -> f32 {
        f32::from_bits(self.rate_hz.load(Ordering::Relaxed))
    }
}

impl JackLink {
    /// Offers a client to the plugin that is made next.
    pub fn offer(client: JackClient, ports: JackPorts) {
        *OFFERED.lock().unwrap_or_else(PoisonError::into_inner) = Some((client, ports));
    }

    /// Takes the offered client; `None` if JACK does not play this plugin.
    pub fn claim(plugin: &Arc<Mutex<Chalumeau>>) -> Option<Self> {
        let offered = OFFERED.lock().unwrap_or_else(PoisonError::into_inner).take()?;
        let rate_hz = AtomicU32::new(offered.0.rate_hz().to_bits());
        Some(Self {
            plugin: plugin.clone(),
            shared: Arc::new(LinkShared { rate_hz, stop: AtomicBool::new(false) }),
            first: Mutex::new(Some(offered)),
            thread: Mutex::default(),
        })
    }

    /// Starts the plugin at the server's rate and, at the first call, begins to play. `false` if that fails.
    pub fn start(&self) -> bool {
        if !start_plugin(&self.plugin, self.shared.rate_hz()) {
            return false;
        }
        let Some((client, ports)) = self.first.lock().unwrap_or_else(PoisonError::into_inner).take() else {
            return true;
        };
        let link = LinkThread {
            plugin: self.plugin.clone(),
            shared: self.shared.clone(),
            keyboards: ports.midi_input.is_none().then(HashSet::new),
            pending: ports.connections(),
            noted: [const { Vec::new() }; 2],
            connected_at: None,
            stalls: false,
            last_words: String::new(),
        };
        let (tell, told) = channel();
        let thread =
            std::thread::Builder::new().name("JackLink".to_owned()).spawn(move || link.run(client, tell));
        let is_running = thread.is_ok();
        // A program that says that it plays shall do so. A server that hangs is said here: the thread waits for it.
        if told.recv_timeout(BEGINNING) == Err(RecvTimeoutError::Timeout) {
            tell!("chalumeau-standalone: {STALLED} {QUIT}");
        }
        *self.thread.lock().unwrap_or_else(PoisonError::into_inner) = thread.ok();
        is_running
    }
}

impl Drop for JackLink {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        let thread = self.thread.get_mut().unwrap_or_else(PoisonError::into_inner).take();
        let began = Instant::now();
        // A server that hangs never answers, so the thread is left to end with the program.
        while thread.as_ref().is_some_and(|thread| !thread.is_finished()) && began.elapsed() < CLOSING {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

/// Starts the plugin at a rate, Hz.
fn start_plugin(plugin: &Mutex<Chalumeau>, sample_rate: f32) -> bool {
    let config = BufferConfig {
        sample_rate,
        min_buffer_size: None,
        max_buffer_size: LONGEST_CYCLE,
        process_mode: ProcessMode::Realtime,
    };
    plugin.lock().unwrap_or_else(PoisonError::into_inner).start::<Chalumeau>(&config, &mut NoHost)
}

/// The link thread's state.
struct LinkThread {
    plugin: Arc<Mutex<Chalumeau>>,
    shared: Arc<LinkShared>,
    /// Connections to make as soon as the other port is there.
    pending: Vec<Connection>,
    /// The connections of the last looks, the latest last. A server that ends breaks them one by one, so the older look
    /// counts.
    noted: [Vec<Connection>; 2],
    connected_at: Option<Instant>,
    /// Devices that were connected when they came; `None` if the user has named one.
    keyboards: Option<HashSet<String>>,
    stalls: bool,
    /// What was said last.
    last_words: String,
}

impl LinkThread {
    /// Plays until it is told to stop. `begun` hears when the first client plays and is connected, or cannot play.
    fn run(mut self, first: JackClient, begun: Sender<()>) {
        let asked_at = Instant::now();
        let mut playing = self.play(first);
        if let Some(client) = &playing {
            self.connect_first(client);
        }
        // By now, nobody may wait any more.
        let _ = begun.send(());
        if playing.is_some() {
            if asked_at.elapsed() > BEGINNING {
                self.say(BACK);
            }
            // A server without a sound card lacks the others, which is no mistake of the user.
            for Connection { other, .. } in self.pending.iter().filter(|connection| connection.is_named()) {
                tell!("chalumeau-standalone: JACK has no port {other:?} yet; `jack_lsp` lists what it has");
            }
        }
        let mut tried_at = Instant::now();
        while !self.shared.stop.load(Ordering::Relaxed) {
            playing = match playing {
                Some(client) => self.watch(client),
                None if tried_at.elapsed() >= RETRY => {
                    tried_at = Instant::now();
                    JackClient::open().ok().and_then(|client| self.play_again(client))
                }
                None => None,
            };
            std::thread::sleep(POLL);
        }
    }

    /// Says something, unless it was just said.
    fn say(&mut self, text: &str) {
        if self.last_words != text {
            tell!("chalumeau-standalone: {text}");
            text.clone_into(&mut self.last_words);
        }
    }

    fn play(&mut self, client: JackClient) -> Option<PlayingClient> {
        match client.play(self.plugin.clone()) {
            Ok(client) => Some(client),
            Err(reason) => {
                self.say(&format!("the JACK server lets nobody play: {reason}"));
                None
            }
        }
    }

    /// Plays to a new server, whose rate may be another.
    fn play_again(&mut self, client: JackClient) -> Option<PlayingClient> {
        let rate_hz = client.rate_hz();
        if !start_plugin(&self.plugin, rate_hz) {
            self.say(&format!("cannot play at the JACK server's rate of {rate_hz} Hz"));
            return None;
        }
        self.shared.rate_hz.store(rate_hz.to_bits(), Ordering::Relaxed);
        let client = self.play(client)?;
        self.connect_first(&client);
        self.say(BACK);
        Some(client)
    }

    /// Looks at the server; `None` once it has gone.
    fn watch(&mut self, mut client: PlayingClient) -> Option<PlayingClient> {
        match client.health() {
            Health::Plays => {
                if std::mem::take(&mut self.stalls) {
                    self.say(BACK);
                }
                self.look_after_connections(&client);
            }
            Health::Stalls => {
                if !std::mem::replace(&mut self.stalls, true) {
                    self.forget();
                    self.say(&format!("{STALLED} {QUIT}"));
                    LaunchOptions::connect(|now| now.sound = STALLED.to_owned());
                }
            }
            Health::IsOver => {
                self.stalls = false;
                self.forget();
                // Those of the next server are new.
                self.keyboards.as_mut().map(HashSet::clear);
                self.say(&format!("{GONE} {QUIT}"));
                LaunchOptions::connect(|now| {
                    (now.sound, now.midi) = (GONE.to_owned(), vec!["none".to_owned()])
                });
                self.keep_connections();
                return None;
            }
        }
        Some(client)
    }

    /// Ends the notes: whoever played them cannot release them any more.
    fn forget(&self) {
        self.plugin.lock().unwrap_or_else(PoisonError::into_inner).forget();
    }

    fn look_after_connections(&mut self, client: &PlayingClient) {
        if self.connected_at.is_some_and(|at| at.elapsed() < CONNECTING) {
            return;
        }
        let before = self.noted[1].clone();
        let is_back = self.connect(client);
        self.noted.swap(0, 1);
        self.noted[1] = client.connections();
        // A device has gone, or has been taken apart.
        let is_lost = |old: &Connection| old.own == MIDI_INPUT && !self.noted[1].contains(old);
        if is_back || before.iter().any(is_lost) {
            client.let_go();
        }
        self.tell_window();
    }

    /// Makes the connections of a new client.
    fn connect_first(&mut self, client: &PlayingClient) {
        self.connect(client);
        self.noted = [client.connections(), client.connections()];
        self.tell_window();
    }

    /// Tells the window what the ports are connected to.
    fn tell_window(&self) {
        let others = |own: &[&str]| -> Vec<String> {
            let wanted = self.noted[1].iter().filter(|connection| own.contains(&connection.own));
            wanted.map(|connection| connection.other.clone()).collect()
        };
        let (outputs, midi) = (others(&OUTPUTS), others(&[MIDI_INPUT]));
        let rate_hz = self.shared.rate_hz();
        LaunchOptions::connect(|now| {
            let outputs = if outputs.is_empty() { "not connected".to_owned() } else { outputs.join(", ") };
            (now.sound, now.midi) = (format!("JACK, {rate_hz} Hz: {outputs}"), midi);
        });
    }

    /// Makes the connections whose ports are there. They are wanted again even if the server ends before the next look. Returns
    /// whether a device that was connected has been away meanwhile.
    fn connect(&mut self, client: &PlayingClient) -> bool {
        self.connected_at = Some(Instant::now());
        let is_back = self.want_keyboards(client);
        let pending = std::mem::take(&mut self.pending);
        let (made, pending): (Vec<_>, _) =
            pending.into_iter().partition(|connection| client.connect(connection));
        self.pending = pending;
        for noted in &mut self.noted {
            noted.extend(made.iter().filter(|made| !noted.contains(made)).cloned().collect::<Vec<_>>());
        }
        is_back
    }

    /// Wants devices that are new. What the user takes apart stays apart until the device is plugged in again. Returns whether one
    /// that was connected has been away: by its name alone it would be the same.
    fn want_keyboards(&mut self, client: &PlayingClient) -> bool {
        let new = client.new_ports();
        let was_connected =
            |name: &String| self.noted[1].iter().any(|noted| noted.own == MIDI_INPUT && noted.other == *name);
        let is_back = new.iter().any(was_connected);
        let Some(known) = &mut self.keyboards else {
            let back =
                self.noted[1].iter().filter(|noted| noted.own == MIDI_INPUT && new.contains(&noted.other));
            self.pending.extend(back.cloned());
            return is_back;
        };
        known.retain(|name| !new.contains(name));
        let there: HashSet<_> = client.keyboards().into_iter().collect();
        for other in there.difference(known) {
            tell!("chalumeau-standalone: MIDI input: {other}");
            self.pending.push(Connection { own: MIDI_INPUT, other: other.clone() });
        }
        *known = there;
        is_back
    }

    /// Wants what was connected to be connected again.
    fn keep_connections(&mut self) {
        for connection in std::mem::take(&mut self.noted).into_iter().next().unwrap_or_default() {
            if !self.pending.contains(&connection) {
                self.pending.push(connection);
            }
        }
    }
}

/// Nobody is told of a latency.
struct NoHost;

impl ActivateContext<Chalumeau> for NoHost {
    fn plugin_api(&self) -> PluginApi {
        PluginApi::Standalone
    }

    fn execute(&self, _: <Chalumeau as Plugin>::BackgroundTask) {}

    fn set_latency_samples(&self, _: u32) {}

    fn set_current_voice_capacity(&self, _: u32) {}
}
