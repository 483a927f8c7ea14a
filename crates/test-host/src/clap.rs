//! A small CLAP host: loads one plugin in process and plays to it what a test or the demo says.

mod extensions;
mod host_side;

use std::ffi::CString;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, bail};
use clack_extensions::gui::{GuiApiType, GuiConfiguration, GuiSize, PluginGui, Window as Handle};
use clack_extensions::latency::PluginLatency;
pub use clack_extensions::note_ports::NoteDialects;
pub use clack_extensions::param_indication::ParamIndicationAutomation;
use clack_extensions::params::{ParamInfoBuffer, PluginParams};
pub use clack_extensions::params::{ParamInfoFlags, ParamRescanFlags};
use clack_extensions::render::{PluginRender, RenderMode};
use clack_extensions::state::PluginState;
pub use clack_extensions::state_context::StateContextType;
use clack_extensions::tail::PluginTail;
pub use clack_extensions::tail::TailLength;
use clack_extensions::voice_info::PluginVoiceInfo;
pub use clack_extensions::voice_info::{VoiceInfo, VoiceInfoFlags};
use clack_host::events::Match;
pub use clack_host::events::event_types::NoteExpressionType;
use clack_host::events::event_types::{
    MidiEvent, NoteChokeEvent, NoteExpressionEvent, NoteOffEvent, NoteOnEvent, ParamModEvent,
    ParamValueEvent, TransportEvent, TransportFlags,
};
use clack_host::events::spaces::CoreEventSpace;
use clack_host::events::{EventFlags, EventHeader};
pub use clack_host::prelude::ProcessStatus;
use clack_host::prelude::*;
use clack_host::utils::FixedPoint;
use clap_sys::events::clap_event_header;

pub use extensions::{Description, RemotePage};
use host_side::{Audio, Main};
pub use host_side::{Heard, Host, Shared};

/// A namespace that no host has registered.
const FOREIGN: u16 = 0xB33F;

/// Something said to the plugin at a sample position, counted from the start of playing.
#[derive(Clone, Copy, Debug)]
pub struct At(pub usize, pub Say);

/// What a CLAP host can say.
#[derive(Clone, Copy, Debug)]
pub enum Say {
    /// A MIDI 1 channel message.
    Midi([u8; 3]),
    /// A CLAP note, key and velocity 0..=1.
    NoteOn(u16, f64),
    /// Its end.
    NoteOff(u16),
    /// A note expression of a key.
    Express(u16, NoteExpressionType, f64),
    /// A CLAP note by its whole name, and its velocity 0..=1.
    Strike(NoteName, f64),
    /// The end of all notes that a name fits.
    Release(NoteName),
    /// Their immediate end.
    Choke(NoteName),
    /// An expression of all notes that a name fits.
    ExpressNotes(NoteName, NoteExpressionType, f64),
    /// A parameter moves; its plain CLAP value.
    Set(ClapId, f64),
    /// A modulator offsets a parameter by so much.
    Modulate(ClapId, f64),
    /// An event of no known namespace that looks like [`Set`](Self::Set).
    Foreign(ClapId, f64),
}

/// The name of CLAP notes. A part that is `None` is a wildcard; the port always is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoteName {
    pub id: Option<u32>,
    pub channel: Option<u16>,
    pub key: Option<u16>,
}

impl NoteName {
    fn pckn(self) -> Pckn {
        fn part<T>(part: Option<T>) -> Match<T> {
            part.map_or(Match::All, Match::Specific)
        }
        Pckn {
            port_index: Match::All,
            channel: part(self.channel),
            key: part(self.key),
            note_id: part(self.id),
        }
    }

    fn of(pckn: Pckn) -> Self {
        fn part<T>(part: Match<T>) -> Option<T> {
            match part {
                Match::Specific(part) => Some(part),
                Match::All => None,
            }
        }
        Self { id: part(pckn.note_id), channel: part(pckn.channel), key: part(pckn.key) }
    }
}

/// A parameter as the plugin describes it.
#[derive(Clone, Debug)]
pub struct Param {
    pub id: ClapId,
    pub name: String,
    pub module: String,
    pub min: f64,
    pub max: f64,
    pub default: f64,
    pub flags: ParamInfoFlags,
}

/// The window around a plugin's: of X11, or of Windows.
#[cfg(not(windows))]
pub type Around = u32;
/// The window around a plugin's: of X11, or of Windows.
#[cfg(windows)]
pub type Around = *mut std::ffi::c_void;

#[cfg(not(windows))]
fn handle_of(window: Around) -> Handle<'static, 'static> {
    Handle::from_x11_handle(window.into())
}

#[cfg(windows)]
fn handle_of(window: Around) -> Handle<'static, 'static> {
    // SAFETY: who opens a plugin's window keeps this one, as `Plugin::open_window` asks.
    unsafe { Handle::from_win32_hwnd(window) }
}

/// Left and right.
pub type Stereo = [Vec<f32>; 2];

/// Something the plugin's window has done to a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hand {
    /// Took hold of it.
    Begin(ClapId),
    /// Moved it there; the plain CLAP value.
    Move(ClapId, f64),
    /// Let go.
    End(ClapId),
}

/// One loaded plugin.
pub struct Plugin {
    // Before the library it comes from, so that it is dropped first.
    instance: PluginInstance<Host>,
    entry: PluginEntry,
}

impl Plugin {
    /// Loads the first plugin of a CLAP library.
    pub fn load(path: &Path) -> Result<Self> {
        Self::load_into(path, Shared::default())
    }

    /// The same in a host that opens no windows.
    pub fn load_blind(path: &Path) -> Result<Self> {
        Self::load_into(path, Shared::blind())
    }

    fn load_into(path: &Path, shared: Shared) -> Result<Self> {
        // SAFETY: the file is the plugin this project has just built.
        let entry = unsafe { PluginEntry::load(path) }
            .with_context(|| format!("cannot load {} as a CLAP", path.display()))?;
        // A Rust library leaves thread-local destructors behind in every thread that called it; unloading it pulls the
        // code from under them. Like most hosts, this one never unloads.
        std::mem::forget(entry.clone());
        let id: CString = {
            let factory = entry.get_plugin_factory().context("the library has no plugin factory")?;
            let first = factory.plugin_descriptors().next().context("the library holds no plugin")?;
            first.id().context("the plugin has no id")?.to_owned()
        };
        let info = HostInfo::new("Chalumeau xtask", "Chalumeau", "", env!("CARGO_PKG_VERSION"))?;
        let instance = PluginInstance::<Host>::new(|_| shared, |shared| Main(shared), &entry, &id, &info)?;
        Ok(Self { instance, entry })
    }

    /// Id and name, as the library states them.
    pub fn identity(&self) -> Result<(String, String)> {
        let factory = self.entry.get_plugin_factory().context("the library has no plugin factory")?;
        let first = factory.plugin_descriptors().next().context("the library holds no plugin")?;
        let text = |words: Option<&std::ffi::CStr>| words.unwrap_or_default().to_string_lossy().into_owned();
        Ok((text(first.id()), text(first.name())))
    }

    /// Activates the plugin for blocks of up to `block` samples; [`deactivate`](Self::deactivate) takes the session back.
    pub fn activate(&mut self, rate_hz: f64, block: usize) -> Result<Session> {
        let frames = u32::try_from(block)?;
        let config =
            PluginAudioConfiguration { sample_rate: rate_hz, min_frames_count: 1, max_frames_count: frames };
        let stopped = self.instance.activate(|shared, _| Audio(shared), config)?;
        match stopped.start_processing() {
            Ok(processor) => {
                let (answers, ends, hands) = (Vec::new(), Vec::new(), Vec::new());
                let status = ProcessStatus::Continue;
                Ok(Session {
                    processor,
                    block,
                    answers,
                    ends,
                    hands,
                    status,
                    played: 0,
                    transport: None,
                    side_chain: None,
                })
            }
            Err(_) => bail!("the plugin does not start at {rate_hz} Hz"),
        }
    }

    /// Ends a session.
    pub fn deactivate(&mut self, session: Session) {
        self.instance.deactivate(session.processor.stop_processing());
    }

    /// Activates the plugin for blocks of up to `block` samples, lets `body` play, and deactivates it.
    pub fn session<R>(
        &mut self,
        rate_hz: f64,
        block: usize,
        body: impl FnOnce(&mut Session) -> R,
    ) -> Result<R> {
        let mut session = self.activate(rate_hz, block)?;
        let result = body(&mut session);
        self.deactivate(session);
        Ok(result)
    }

    /// A fresh activation that plays `said`, in order of time, for `samples` samples in blocks of `block`.
    pub fn play(&mut self, rate_hz: f64, block: usize, said: &[At], samples: usize) -> Result<Stereo> {
        self.session(rate_hz, block, |session| session.play(said, samples))?
    }

    pub fn params(&mut self) -> Result<Vec<Param>> {
        let handle = self.instance.plugin_handle();
        let params: PluginParams = handle.get_extension().context("no parameters")?;
        let mut all = Vec::new();
        for index in 0..params.count(&handle) {
            let mut buffer = ParamInfoBuffer::new();
            let info = params.get_info(&handle, index, &mut buffer).context("no such parameter")?;
            all.push(Param {
                id: info.id,
                name: String::from_utf8_lossy(info.name).into_owned(),
                module: String::from_utf8_lossy(info.module).into_owned(),
                min: info.min_value,
                max: info.max_value,
                default: info.default_value,
                flags: info.flags,
            });
        }
        Ok(all)
    }

    /// The parameter of that name.
    pub fn param(&mut self, name: &str) -> Result<Param> {
        self.params()?
            .into_iter()
            .find(|param| param.name == name)
            .with_context(|| format!("no parameter {name}"))
    }

    pub fn value(&mut self, id: ClapId) -> Result<f64> {
        let handle = self.instance.plugin_handle();
        let params: PluginParams = handle.get_extension().context("no parameters")?;
        params.get_value(&handle, id).context("no such parameter")
    }

    /// Sets a parameter of a plugin that is not active.
    pub fn set(&mut self, id: ClapId, value: f64) -> Result<()> {
        self.set_all(&[(id, value)]).map(drop)
    }

    /// The same for several; what the plugin answers about parameters.
    pub fn set_all(&mut self, values: &[(ClapId, f64)]) -> Result<Vec<Hand>> {
        let mut handle = self.instance.inactive_plugin_handle().context("the plugin is active")?;
        let params: PluginParams = handle.get_extension().context("no parameters")?;
        let (mut said, mut answered) = (EventBuffer::new(), EventBuffer::new());
        for &(id, value) in values {
            push(&mut said, 0, Say::Set(id, value));
        }
        params.flush(
            &mut handle,
            &InputEvents::from_buffer(&said),
            &mut OutputEvents::from_buffer(&mut answered),
        );
        Ok(answered.iter().filter_map(hand).collect())
    }

    /// Whether the plugin offers a window to this host.
    pub fn has_window(&mut self) -> bool {
        self.instance.plugin_handle().get_extension::<PluginGui>().is_some()
    }

    pub fn text(&mut self, id: ClapId, value: f64) -> Result<String> {
        let handle = self.instance.plugin_handle();
        let params: PluginParams = handle.get_extension().context("no parameters")?;
        let mut buffer = [0; 512];
        let text = params.value_to_text(&handle, id, value, &mut buffer).map_err(|_| anyhow!("no text"))?;
        Ok(String::from_utf8_lossy(text).into_owned())
    }

    pub fn read_text(&mut self, id: ClapId, text: &str) -> Result<Option<f64>> {
        let handle = self.instance.plugin_handle();
        let params: PluginParams = handle.get_extension().context("no parameters")?;
        Ok(params.text_to_value(&handle, id, &CString::new(text)?))
    }

    pub fn save(&mut self) -> Result<Vec<u8>> {
        let handle = self.instance.plugin_handle();
        let state: PluginState = handle.get_extension().context("no state")?;
        let mut bytes = Vec::new();
        state.save(&handle, &mut bytes)?;
        Ok(bytes)
    }

    pub fn restore(&mut self, mut bytes: &[u8]) -> Result<()> {
        let handle = self.instance.plugin_handle();
        let state: PluginState = handle.get_extension().context("no state")?;
        Ok(state.load(&handle, &mut bytes)?)
    }

    /// Tells the plugin whether it plays for somebody or for a file. The plugin must not be active.
    pub fn set_offline(&mut self, offline: bool) -> Result<()> {
        let handle = self.instance.plugin_handle();
        let render: PluginRender = handle.get_extension().context("no render extension")?;
        Ok(render.set(&handle, if offline { RenderMode::Offline } else { RenderMode::Realtime })?)
    }

    /// Opens the plugin's window inside a window that `place` makes for the size it is told. The window must stay until
    /// [`close_window`](Self::close_window).
    pub fn open_window(&mut self, place: impl FnOnce(u32, u32) -> Result<Around>) -> Result<()> {
        let handle = self.instance.plugin_handle();
        let gui: PluginGui = handle.get_extension().context("no window")?;
        let api_type = if cfg!(windows) { GuiApiType::WIN32 } else { GuiApiType::X11 };
        let embedded = GuiConfiguration { api_type, is_floating: false };
        if !gui.is_api_supported(&handle, embedded) {
            bail!("the window does not go into a window of this system");
        }
        let size = gui.get_size(&handle).context("the window has no size")?;
        let parent = place(size.width, size.height)?;
        gui.create(&handle, embedded)?;
        // SAFETY: the caller keeps the window until it is closed.
        unsafe { gui.set_parent(&handle, handle_of(parent)) }?;
        Ok(gui.show(&handle)?)
    }

    /// Hides the window, or shows it again.
    pub fn show_window(&mut self, on: bool) -> Result<()> {
        let handle = self.instance.plugin_handle();
        let gui: PluginGui = handle.get_extension().context("no window")?;
        Ok(if on { gui.show(&handle) } else { gui.hide(&handle) }?)
    }

    /// Closes the window.
    pub fn close_window(&mut self) -> Result<()> {
        let handle = self.instance.plugin_handle();
        let gui: PluginGui = handle.get_extension().context("no window")?;
        gui.destroy(&handle);
        Ok(())
    }

    /// Size of the window, or of the next one, in pixels.
    pub fn window_size(&mut self) -> Result<(u32, u32)> {
        let handle = self.instance.plugin_handle();
        let gui: PluginGui = handle.get_extension().context("no window")?;
        let size = gui.get_size(&handle).context("the window has no size")?;
        Ok((size.width, size.height))
    }

    /// Gives the open window the size nearest to this one that it can have.
    pub fn resize_window(&mut self, (width, height): (u32, u32)) -> Result<(u32, u32)> {
        let handle = self.instance.plugin_handle();
        let gui: PluginGui = handle.get_extension().context("no window")?;
        if !gui.can_resize(&handle) {
            bail!("the window cannot be resized");
        }
        let wanted = GuiSize { width, height };
        let size = gui.adjust_size(&handle, wanted).context("the window does not adjust its size")?;
        gui.set_size(&handle, size)?;
        Ok((size.width, size.height))
    }

    /// Does on the main thread what the plugin has asked for; the size its window wants to have, if it wants another.
    pub fn attend(&mut self) -> Option<(u32, u32)> {
        if self.instance.access_shared_handler(|shared| shared.callback.swap(false, Ordering::AcqRel)) {
            self.instance.call_on_main_thread_callback();
        }
        let packed = self.instance.access_shared_handler(|shared| shared.size.swap(0, Ordering::AcqRel));
        let size = GuiSize::unpack_from_u64(packed);
        (packed != 0).then_some((size.width, size.height))
    }

    /// How many voices the plugin has.
    pub fn voice_info(&mut self) -> Result<VoiceInfo> {
        let handle = self.instance.plugin_handle();
        let voices: PluginVoiceInfo = handle.get_extension().context("no voice info")?;
        voices.get(&handle).context("the plugin does not say how many voices it has")
    }

    pub fn latency(&mut self) -> Result<u32> {
        let handle = self.instance.plugin_handle();
        let latency: PluginLatency = handle.get_extension().context("no latency")?;
        Ok(latency.get(&handle))
    }
}

/// A plugin between activation and deactivation.
pub struct Session {
    processor: StartedPluginAudioProcessor<Host>,
    block: usize,
    /// MIDI the plugin has sent, with the sample it belongs to since activation.
    answers: Vec<(usize, [u8; 3])>,
    /// Notes that the plugin has said to be over, with the sample since activation.
    ends: Vec<(usize, NoteName)>,
    /// What was done to parameters in the plugin's window.
    hands: Vec<Hand>,
    /// What the plugin said of going on, after the last block.
    status: ProcessStatus,
    played: usize,
    /// The host's transport, if it has one.
    transport: Option<TransportEvent>,
    /// What the side-chain gives next, if the host has connected it.
    side_chain: Option<Vec<f32>>,
}

impl Session {
    /// Plays on from where the last call ended; positions count from there.
    pub fn play(&mut self, said: &[At], samples: usize) -> Result<Stereo> {
        self.play_blocks(said, samples, |_| ())
    }

    /// The same at the pace of a sound card of `rate_hz`: a device at the other end has its time.
    pub fn play_live(&mut self, said: &[At], samples: usize, rate_hz: f64) -> Result<Stereo> {
        let began = Instant::now();
        self.play_blocks(said, samples, |start| {
            let due = began + Duration::from_secs_f64(start as f64 / rate_hz);
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        })
    }

    /// Connects the side-chain, which gives these samples, and then silence.
    pub fn connect(&mut self, samples: Vec<f32>) {
        self.side_chain = Some(samples);
    }

    /// Samples played since activation.
    pub fn played(&self) -> usize {
        self.played
    }

    /// What the plugin has sent since activation.
    pub fn answers(&self) -> &[(usize, [u8; 3])] {
        &self.answers
    }

    /// What the plugin said of going on, after the last block.
    pub fn status(&self) -> ProcessStatus {
        self.status
    }

    /// How long the plugin sounds on.
    pub fn tail(&mut self) -> TailLength {
        let handle = self.processor.plugin_handle();
        handle.get_extension::<PluginTail>().map_or(TailLength::Finite(0), |tail| tail.get(&handle))
    }

    /// The notes that the plugin has said to be over since activation.
    pub fn ends(&self) -> &[(usize, NoteName)] {
        &self.ends
    }

    /// What was done to parameters in the window since activation.
    pub fn hands(&self) -> &[Hand] {
        &self.hands
    }

    /// Plays, calling `before` with the position of each block.
    pub fn play_blocks(
        &mut self,
        said: &[At],
        samples: usize,
        mut before: impl FnMut(usize),
    ) -> Result<Stereo> {
        let mut heard = [vec![0.0; samples], vec![0.0; samples]];
        let mut said = said.iter().peekable();
        let mut ports = AudioPorts::with_capacity(2, 1);
        let mut in_ports = AudioPorts::with_capacity(1, 1);
        for start in (0..samples).step_by(self.block) {
            let end = samples.min(start + self.block);
            before(start);
            let mut events = EventBuffer::new();
            while let Some(At(at, say)) = said.next_if(|At(at, _)| *at < end) {
                push(&mut events, u32::try_from(at.saturating_sub(start))?, *say);
            }
            let mut answered = EventBuffer::new();
            let mut given = self.side_chain.as_mut().map(|side_chain| {
                let left = side_chain.split_off(side_chain.len().min(end - start));
                let mut given = std::mem::replace(side_chain, left);
                given.resize(end - start, 0.0);
                given
            });
            let input = in_ports.with_input_buffers(given.iter_mut().map(|given| AudioPortBuffer {
                latency: 0,
                channels: AudioPortBufferType::f32_input_only([InputChannel::variable(given)].into_iter()),
            }));
            let mut out = ports.with_output_buffers([AudioPortBuffer {
                latency: 0,
                channels: AudioPortBufferType::f32_output_only(heard.iter_mut().map(|c| &mut c[start..end])),
            }]);
            self.status = self.processor.process(
                &input,
                &mut out,
                &InputEvents::from_buffer(&events),
                &mut OutputEvents::from_buffer(&mut answered),
                Some((self.played + start) as u64),
                self.transport.as_ref(),
            )?;
            let mut latest = 0;
            for event in &answered {
                let time = event.header().time();
                anyhow::ensure!(
                    latest <= time && (time as usize) < end - start,
                    "an answer at {time} after {latest}"
                );
                latest = time;
                let at = self.played + start + time as usize;
                match event.as_core_event() {
                    Some(CoreEventSpace::Midi(midi)) => self.answers.push((at, midi.data())),
                    Some(CoreEventSpace::NoteEnd(end)) => self.ends.push((at, NoteName::of(end.pckn()))),
                    _ => {}
                }
                self.hands.extend(hand(event));
            }
        }
        self.played += samples;
        Ok(heard)
    }

    /// Moves parameters without processing.
    pub fn flush(&mut self, values: &[(ClapId, f64)]) -> Result<Vec<Hand>> {
        let mut handle = self.processor.plugin_handle();
        let params: PluginParams = handle.get_extension().context("no parameters")?;
        let (mut said, mut answered) = (EventBuffer::new(), EventBuffer::new());
        for &(id, value) in values {
            push(&mut said, 0, Say::Set(id, value));
        }
        params.flush_active(
            &mut handle,
            &InputEvents::from_buffer(&said),
            &mut OutputEvents::from_buffer(&mut answered),
        );
        Ok(answered.iter().filter_map(hand).collect())
    }

    /// Gives the host a transport, which plays or stands.
    pub fn set_playing(&mut self, is_playing: bool) {
        let flags = if is_playing { TransportFlags::IS_PLAYING } else { TransportFlags::empty() };
        self.transport = Some(TransportEvent {
            header: EventHeader::new_core(0, EventFlags::empty()),
            flags,
            song_pos_beats: FixedPoint::from_int(0),
            song_pos_seconds: FixedPoint::from_int(0),
            tempo: 120.0,
            tempo_inc: 0.0,
            loop_start_beats: FixedPoint::from_int(0),
            loop_end_beats: FixedPoint::from_int(0),
            loop_start_seconds: FixedPoint::from_int(0),
            loop_end_seconds: FixedPoint::from_int(0),
            bar_start: FixedPoint::from_int(0),
            bar_number: 0,
            time_signature_numerator: 4,
            time_signature_denominator: 4,
        });
    }

    /// As when a host's transport jumps.
    pub fn reset(&mut self) {
        self.processor.reset();
    }
}

/// What an answer of the plugin says of a parameter.
fn hand(event: &UnknownEvent) -> Option<Hand> {
    match event.as_core_event() {
        Some(CoreEventSpace::ParamGestureBegin(event)) => event.param_id().map(Hand::Begin),
        Some(CoreEventSpace::ParamValue(event)) => event.param_id().map(|id| Hand::Move(id, event.value())),
        Some(CoreEventSpace::ParamGestureEnd(event)) => event.param_id().map(Hand::End),
        _ => None,
    }
}

fn push(events: &mut EventBuffer, at: u32, say: Say) {
    let of = |key: u16| Pckn::new(0u16, 0u16, key, clack_host::events::Match::<u32>::All);
    match say {
        Say::Midi(bytes) => events.push(&MidiEvent::new(at, 0, bytes)),
        Say::NoteOn(key, velocity) => events.push(&NoteOnEvent::new(at, of(key), velocity)),
        Say::NoteOff(key) => events.push(&NoteOffEvent::new(at, of(key), 0.0)),
        Say::Express(key, kind, value) => events.push(&NoteExpressionEvent::new(at, of(key), kind, value)),
        Say::Strike(name, velocity) => {
            // A new note needs a port.
            let pckn = Pckn { port_index: Match::Specific(0), ..name.pckn() };
            events.push(&NoteOnEvent::new(at, pckn, velocity))
        }
        Say::Release(name) => events.push(&NoteOffEvent::new(at, name.pckn(), 0.0)),
        Say::Choke(name) => events.push(&NoteChokeEvent::new(at, name.pckn())),
        Say::ExpressNotes(name, kind, value) => {
            events.push(&NoteExpressionEvent::new(at, name.pckn(), kind, value))
        }
        Say::Set(id, value) => events.push(&ParamValueEvent::new(at, id, Pckn::match_all(), value)),
        Say::Modulate(id, amount) => events.push(&ParamModEvent::new(at, id, Pckn::match_all(), amount)),
        Say::Foreign(id, value) => {
            let mut event = ParamValueEvent::new(at, id, Pckn::match_all(), value);
            let raw: *mut clap_event_header = (&raw mut event).cast();
            // SAFETY: every event begins with its header; the event is copied whole before it ends.
            unsafe {
                (*raw).space_id = FOREIGN;
                events.push(UnknownEvent::from_raw(raw));
            }
        }
    };
}
