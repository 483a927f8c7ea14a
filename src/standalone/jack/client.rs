//! One client of a JACK server: its ports, and what they are connected to. [link thread]

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use jack::{AsyncClient, AudioIn, AudioOut, Client, ClientOptions, Error, MidiIn, MidiOut, PortFlags};

use super::player::{JackNotices, JackPlayer, JackPlayerPorts, JackSigns};
use crate::plugin::Chalumeau;
use crate::standalone::keyboards::plays_unasked;

/// The client's name, unless another program has it.
const NAME: &str = "chalumeau";
/// The ports of the sound.
pub const OUTPUTS: [&str; 2] = ["output_1", "output_2"];
/// The port of a microphone.
pub const MICROPHONE: &str = "microphone";
/// The port whose MIDI plays the plugin.
pub const MIDI_INPUT: &str = "midi_input";
/// The port that sends a knob's breath.
pub const MIDI_OUTPUT: &str = "midi_output";

/// A server that calls this seldom does not play. The longest cycle, 8192 samples at 22050 Hz, takes 0.4 s.
const STALLED: Duration = Duration::from_secs(2);

/// A port of this program, by its short name, and a port of another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Connection {
    pub own: &'static str,
    pub other: String,
}

impl Connection {
    /// The outputs to the first two ports of the sound card.
    pub fn to_sound_card() -> impl Iterator<Item = Self> {
        OUTPUTS
            .into_iter()
            .zip(1..)
            .map(|(own, number)| Self { own, other: format!("system:playback_{number}") })
    }

    /// Whether the user has named it.
    pub fn is_named(&self) -> bool {
        !OUTPUTS.contains(&self.own)
    }
}

/// A client that does not play yet.
pub struct JackClient {
    client: Client,
    ports: JackPlayerPorts,
}

impl JackClient {
    /// Opens a client of a server that runs.
    ///
    /// # Errors
    /// Why there is none, for the user.
    pub fn open() -> Result<Self, String> {
        let (client, _) = Client::new(NAME, ClientOptions::NO_START_SERVER).map_err(reason)?;
        let register = |name| client.register_port(name, AudioOut::default());
        let [left, right] = OUTPUTS;
        let ports = JackPlayerPorts {
            outputs: [register(left).map_err(reason)?, register(right).map_err(reason)?],
            microphone: client.register_port(MICROPHONE, AudioIn::default()).map_err(reason)?,
            midi_input: client.register_port(MIDI_INPUT, MidiIn::default()).map_err(reason)?,
            midi_output: client.register_port(MIDI_OUTPUT, MidiOut::default()).map_err(reason)?,
        };
        Ok(Self { client, ports })
    }

    /// The server's sample rate, Hz.
    pub fn rate_hz(&self) -> f32 {
        self.client.sample_rate() as f32
    }

    /// Begins to play the plugin, which must have been started at the server's rate.
    pub fn play(self, plugin: Arc<Mutex<Chalumeau>>) -> Result<PlayingClient, String> {
        let signs = Arc::new(JackSigns::default());
        let rate_hz = self.rate_hz();
        let player = JackPlayer::new(plugin, signs.clone(), self.ports, rate_hz);
        let client = self.client.activate_async(JackNotices(signs.clone()), player).map_err(reason)?;
        Ok(PlayingClient { client, signs, last_cycle: (0, Instant::now()) })
    }
}

/// What the server does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Health {
    /// It calls.
    Plays,
    /// It is there, but does not call.
    Stalls,
    /// It has gone.
    IsOver,
}

/// A client that plays. It closes when dropped.
pub struct PlayingClient {
    client: AsyncClient<JackNotices, JackPlayer>,
    signs: Arc<JackSigns>,
    /// The last number of cycles, and when it was new.
    last_cycle: (u32, Instant),
}

impl PlayingClient {
    /// What the server does now.
    pub fn health(&mut self) -> Health {
        if self.signs.is_over.load(Ordering::Relaxed) {
            return Health::IsOver;
        }
        let cycles = self.signs.cycles.load(Ordering::Relaxed);
        if cycles != self.last_cycle.0 {
            self.last_cycle = (cycles, Instant::now());
        }
        if self.last_cycle.1.elapsed() < STALLED { Health::Plays } else { Health::Stalls }
    }

    /// Makes a connection. `false` if the other port is not there.
    pub fn connect(&self, connection: &Connection) -> bool {
        let client = self.client.as_client();
        let own = self.full_name(connection.own);
        let (from, to) = if [MICROPHONE, MIDI_INPUT].contains(&connection.own) {
            (connection.other.as_str(), own.as_str())
        } else {
            (own.as_str(), connection.other.as_str())
        };
        client.port_by_name(&connection.other).is_some()
            && matches!(client.connect_ports_by_name(from, to), Ok(()) | Err(Error::PortAlreadyConnected(..)))
    }

    /// Ports of MIDI devices that play without being asked for.
    pub fn keyboards(&self) -> Vec<String> {
        let client = self.client.as_client();
        // Those of other programs are theirs to connect.
        let devices = client.ports(
            None,
            Some(jack::jack_sys::RAW_MIDI_TYPE),
            PortFlags::IS_OUTPUT | PortFlags::IS_PHYSICAL,
        );
        let plays = |name: &String| {
            // A server names its ports by numbers; the name of the device is an alias.
            let port = client.port_by_name(name);
            let aliases = port.and_then(|port| port.aliases().ok()).unwrap_or_default();
            plays_unasked(aliases.iter().chain([name]).map(String::as_str))
        };
        devices.into_iter().filter(plays).collect()
    }

    /// Ports of other programs and devices that have come since this was last asked.
    pub fn new_ports(&self) -> Vec<String> {
        std::mem::take(&mut self.signs.new_ports.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Ends the notes that are held: whoever played them has gone.
    pub fn let_go(&self) {
        self.signs.lets_go.store(true, Ordering::Relaxed);
    }

    /// Everything that the ports are connected to.
    pub fn connections(&self) -> Vec<Connection> {
        let client = self.client.as_client();
        let own = OUTPUTS.into_iter().chain([MICROPHONE, MIDI_INPUT, MIDI_OUTPUT]);
        own.flat_map(|own| {
            let port = client.port_by_name(&self.full_name(own));
            let others = port.map(|port| port.get_connections()).unwrap_or_default();
            others.into_iter().map(move |other| Connection { own, other })
        })
        .collect()
    }

    fn full_name(&self, own: &str) -> String {
        format!("{}:{own}", self.client.as_client().name())
    }
}

/// A reason in words, where the library gives only the names of status bits.
fn reason(error: Error) -> String {
    match error {
        Error::ClientError(status) if status.contains(jack::ClientStatus::SERVER_FAILED) => {
            "no JACK server is running".to_owned()
        }
        Error::LibraryError(reason) => format!("JACK is not installed: {reason}"),
        other => other.to_string(),
    }
}
