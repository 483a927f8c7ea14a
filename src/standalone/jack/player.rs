//! Plays the plugin in the cycles of a JACK server. Real-time safe. [JACK thread]

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use jack::{
    AudioIn, AudioOut, Client, ClientStatus, Control, MidiIn, MidiIter, MidiOut, Port, ProcessScope, RawMidi,
};
use nice_plug::context::PluginApi;
use nice_plug::context::process::SendEventError;
use nice_plug::midi::MidiResult;
use nice_plug::prelude::*;

use crate::plugin::Chalumeau;
use crate::standalone::devices;
use chalumeau_knob::touch::breath_from_angle::GRID;

/// Longest cycle of a JACK server, samples.
pub const LONGEST_CYCLE: u32 = 8_192;
/// Events that one cycle can send: the breath of a knob, two for each value, in the longest cycle.
const SENT_MOST: usize = 2 * LONGEST_CYCLE as usize / GRID as usize;

/// The sustain pedal comes up, and all notes end. JACK does not say whose they are, so those of another device end, too.
const LET_GO: [[u8; 3]; 2] = [[0xB0, 64, 0], [0xB0, 123, 0]];

/// What the JACK thread tells the link thread.
#[derive(Debug, Default)]
pub struct JackSigns {
    /// Counts the cycles, and wraps.
    pub cycles: AtomicU32,
    /// The server has gone.
    pub is_over: AtomicBool,
    /// A device has gone that may have held keys.
    pub lets_go: AtomicBool,
    /// Ports that have come since the link thread last looked.
    pub new_ports: Mutex<Vec<String>>,
}

/// The ports of the plugin.
pub struct JackPlayerPorts {
    pub outputs: [Port<AudioOut>; 2],
    pub microphone: Port<AudioIn>,
    pub midi_input: Port<MidiIn>,
    pub midi_output: Port<MidiOut>,
}

/// Plays the plugin into its ports.
pub struct JackPlayer {
    plugin: Arc<Mutex<Chalumeau>>,
    signs: Arc<JackSigns>,
    ports: JackPlayerPorts,
    sent: Vec<NoteEvent<()>>,
    transport: Transport,
}

impl JackPlayer {
    /// Plays at `rate_hz`. Allocates. [link thread]
    pub fn new(
        plugin: Arc<Mutex<Chalumeau>>,
        signs: Arc<JackSigns>,
        ports: JackPlayerPorts,
        rate_hz: f32,
    ) -> Self {
        Self { plugin, signs, ports, sent: Vec::with_capacity(SENT_MOST), transport: Transport::new(rate_hz) }
    }

    fn play(&mut self, scope: &ProcessScope) {
        let JackPlayerPorts { outputs, microphone, midi_input, midi_output } = &mut self.ports;
        let mut channels = outputs.each_mut().map(|port| port.as_mut_slice(scope));
        self.sent.clear();
        // The link thread holds the lock while it starts the plugin.
        let plugin = self.plugin.try_lock();
        let lets_go = plugin.is_ok() && self.signs.lets_go.swap(false, Ordering::Relaxed);
        let mut context = CycleContext {
            endings: if lets_go { &LET_GO } else { &[] },
            incoming: midi_input.iter(scope),
            frames: scope.n_frames(),
            sent: &mut self.sent,
            transport: &self.transport,
        };
        let status = match plugin {
            Ok(mut plugin) => {
                plugin.hear(&[microphone.as_slice(scope)]);
                plugin.play::<Chalumeau>(&mut channels, &mut context)
            }
            Err(_) => ProcessStatus::Error("not started"),
        };
        if matches!(status, ProcessStatus::Error(_)) {
            channels.into_iter().for_each(|channel| channel.fill(0.0));
        }
        let mut writer = midi_output.writer(scope);
        for event in self.sent.drain(..) {
            if let Some(MidiResult::Basic(bytes)) = event.as_midi() {
                // A full buffer costs the listener a breath value; the next one is 64 samples away.
                let _ = writer.write(&RawMidi { time: event.timing(), bytes: &bytes });
            }
        }
    }
}

impl jack::ProcessHandler for JackPlayer {
    fn process(&mut self, _: &Client, scope: &ProcessScope) -> Control {
        self.signs.cycles.fetch_add(1, Ordering::Relaxed);
        devices::count_block();
        // A debug build checks this, as in the framework's own backends.
        nice_assert_no_alloc::assert_no_alloc(|| self.play(scope));
        Control::Continue
    }
}

/// Hears of the server's end, and of new ports.
pub struct JackNotices(pub Arc<JackSigns>);

impl jack::NotificationHandler for JackNotices {
    fn port_registration(&mut self, client: &Client, port: jack::PortId, is_new: bool) {
        let name = client.port_by_id(port).filter(|_| is_new).and_then(|port| port.name().ok());
        if let Some(name) = name {
            self.0.new_ports.lock().unwrap_or_else(PoisonError::into_inner).push(name);
        }
    }

    #[allow(unsafe_code)] // The trait demands it: this may run like a signal handler. It only sets a flag.
    unsafe fn shutdown(&mut self, _: ClientStatus, _: &str) {
        self.0.is_over.store(true, Ordering::Relaxed);
    }
}

/// One cycle, as the plugin sees it.
struct CycleContext<'a> {
    /// What comes before: it ends the notes of a device that has gone.
    endings: &'static [[u8; 3]],
    incoming: MidiIter<'a>,
    frames: u32,
    sent: &'a mut Vec<NoteEvent<()>>,
    transport: &'a Transport,
}

impl ProcessContext<Chalumeau> for CycleContext<'_> {
    fn plugin_api(&self) -> PluginApi {
        PluginApi::Standalone
    }

    // Only the framework's wrapper runs tasks.
    fn execute_background(&self, _: <Chalumeau as Plugin>::BackgroundTask) {}

    fn execute_gui(&self, _: <Chalumeau as Plugin>::BackgroundTask) {}

    fn transport(&self) -> &Transport {
        self.transport
    }

    fn next_event(&mut self) -> Option<NoteEvent<()>> {
        let last = self.frames.saturating_sub(1);
        if let Some(bytes) = self.endings.split_off_first() {
            return NoteEvent::from_midi(0, bytes).ok();
        }
        // What is no note event is skipped.
        self.incoming.find_map(|midi| NoteEvent::from_midi(midi.time.min(last), midi.bytes).ok())
    }

    fn try_send_event(&mut self, event: NoteEvent<()>) -> Result<(), (NoteEvent<()>, SendEventError)> {
        if self.sent.len() == self.sent.capacity() {
            return Err((event, SendEventError::HostBufferFull));
        }
        self.sent.push(event);
        Ok(())
    }

    fn set_latency_samples(&self, _: u32) {}

    fn request_restart(&self) {}

    fn set_current_voice_capacity(&self, _: u32) {}
}
