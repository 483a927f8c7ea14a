//! A small CLAP host: loads one plugin in process and plays to it what a test or the demo says.

use std::ffi::CString;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, bail};
use clack_extensions::gui::{
    GuiApiType, GuiConfiguration, GuiSize, HostGui, HostGuiImpl, PluginGui, Window as Handle,
};
use clack_extensions::latency::PluginLatency;
use clack_extensions::params::{ParamInfoBuffer, PluginParams};
use clack_extensions::render::{PluginRender, RenderMode};
use clack_extensions::state::{HostState, HostStateImpl, PluginState};
pub use clack_host::events::event_types::NoteExpressionType;
use clack_host::events::event_types::{
    MidiEvent, NoteExpressionEvent, NoteOffEvent, NoteOnEvent, ParamValueEvent,
};
use clack_host::events::spaces::CoreEventSpace;
use clack_host::prelude::*;

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
    /// A parameter moves; its plain CLAP value.
    Set(ClapId, f64),
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

/// What the plugin asks for, from whichever thread.
#[derive(Default)]
pub struct Shared {
    callback: AtomicBool,
    /// Size the window wants to have, packed; 0 when nothing is asked for.
    size: AtomicU64,
    /// The window has gone by itself.
    gone: AtomicBool,
}
pub struct Main;
pub struct Host;

impl SharedHandler<'_> for Shared {
    fn request_restart(&self) {}
    fn request_process(&self) {}
    fn request_callback(&self) {
        self.callback.store(true, Ordering::Release);
    }
}

impl HostGuiImpl for Shared {
    fn resize_hints_changed(&self) {}
    fn request_resize(&self, size: GuiSize) -> Result<(), HostError> {
        self.size.store(size.pack_to_u64(), Ordering::Release);
        Ok(())
    }
    fn request_show(&self) -> Result<(), HostError> {
        Ok(())
    }
    fn request_hide(&self) -> Result<(), HostError> {
        Ok(())
    }
    fn closed(&self, _: bool) {
        self.gone.store(true, Ordering::Release);
    }
}

impl MainThreadHandler<'_> for Main {}

impl HostStateImpl for Main {
    fn mark_dirty(&self) {}
}

impl HostHandlers for Host {
    type Shared<'a> = Shared;
    type MainThread<'a> = Main;
    type AudioProcessor<'a> = ();

    fn declare_extensions(builder: &mut HostExtensions<Self>, _: &Shared) {
        builder.register::<HostState>().register::<HostGui>();
    }
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
        let instance = PluginInstance::new(|_| Shared::default(), |_| Main, &entry, &id, &info)?;
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
        let stopped = self.instance.activate(|_, _| (), config)?;
        match stopped.start_processing() {
            Ok(processor) => {
                Ok(Session { processor, block, answers: Vec::new(), hands: Vec::new(), played: 0 })
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
        let mut handle = self.instance.inactive_plugin_handle().context("the plugin is active")?;
        let params: PluginParams = handle.get_extension().context("no parameters")?;
        let mut said = EventBuffer::new();
        said.push(&ParamValueEvent::new(0, id, Pckn::match_all(), value));
        let mut answered = EventBuffer::new();
        params.flush(
            &mut handle,
            &InputEvents::from_buffer(&said),
            &mut OutputEvents::from_buffer(&mut answered),
        );
        Ok(())
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

    /// Opens the plugin's window inside an X11 window that `place` makes for the size it is told. The window must stay
    /// until [`close_window`](Self::close_window).
    pub fn open_window(&mut self, place: impl FnOnce(u32, u32) -> Result<u32>) -> Result<()> {
        let handle = self.instance.plugin_handle();
        let gui: PluginGui = handle.get_extension().context("no window")?;
        let embedded = GuiConfiguration { api_type: GuiApiType::X11, is_floating: false };
        if !gui.is_api_supported(&handle, embedded) {
            bail!("the window does not go into an X11 window");
        }
        let size = gui.get_size(&handle).context("the window has no size")?;
        let parent = place(size.width, size.height)?;
        gui.create(&handle, embedded)?;
        // SAFETY: the caller keeps the window until it is closed.
        unsafe { gui.set_parent(&handle, Handle::from_x11_handle(parent.into())) }?;
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

    /// Whether the window has closed by itself.
    pub fn window_has_gone(&self) -> bool {
        self.instance.access_shared_handler(|shared| shared.gone.load(Ordering::Acquire))
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
    /// What was done to parameters in the plugin's window.
    hands: Vec<Hand>,
    played: usize,
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

    /// Samples played since activation.
    pub fn played(&self) -> usize {
        self.played
    }

    /// What the plugin has sent since activation.
    pub fn answers(&self) -> &[(usize, [u8; 3])] {
        &self.answers
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
        let mut no_ports = AudioPorts::with_capacity(0, 0);
        for start in (0..samples).step_by(self.block) {
            let end = samples.min(start + self.block);
            before(start);
            let mut events = EventBuffer::new();
            while let Some(At(at, say)) = said.next_if(|At(at, _)| *at < end) {
                push(&mut events, u32::try_from(at.saturating_sub(start))?, *say);
            }
            let mut answered = EventBuffer::new();
            let no_input = no_ports.with_input_buffers(std::iter::empty::<
                AudioPortBuffer<
                    std::iter::Empty<InputChannel<'_, f32>>,
                    std::iter::Empty<InputChannel<'_, f64>>,
                >,
            >());
            let mut out = ports.with_output_buffers([AudioPortBuffer {
                latency: 0,
                channels: AudioPortBufferType::f32_output_only(heard.iter_mut().map(|c| &mut c[start..end])),
            }]);
            self.processor.process(
                &no_input,
                &mut out,
                &InputEvents::from_buffer(&events),
                &mut OutputEvents::from_buffer(&mut answered),
                Some((self.played + start) as u64),
                None,
            )?;
            for event in &answered {
                let at = self.played + start + event.header().time() as usize;
                let hand = match event.as_core_event() {
                    Some(CoreEventSpace::Midi(midi)) => {
                        self.answers.push((at, midi.data()));
                        None
                    }
                    Some(CoreEventSpace::ParamGestureBegin(event)) => event.param_id().map(Hand::Begin),
                    Some(CoreEventSpace::ParamValue(event)) => {
                        event.param_id().map(|id| Hand::Move(id, event.value()))
                    }
                    Some(CoreEventSpace::ParamGestureEnd(event)) => event.param_id().map(Hand::End),
                    _ => None,
                };
                self.hands.extend(hand);
            }
        }
        self.played += samples;
        Ok(heard)
    }

    /// As when a host's transport jumps.
    pub fn reset(&mut self) {
        self.processor.reset();
    }
}

fn push(events: &mut EventBuffer, at: u32, say: Say) {
    let of = |key: u16| Pckn::new(0u16, 0u16, key, clack_host::events::Match::<u32>::All);
    match say {
        Say::Midi(bytes) => events.push(&MidiEvent::new(at, 0, bytes)),
        Say::NoteOn(key, velocity) => events.push(&NoteOnEvent::new(at, of(key), velocity)),
        Say::NoteOff(key) => events.push(&NoteOffEvent::new(at, of(key), 0.0)),
        Say::Express(key, kind, value) => events.push(&NoteExpressionEvent::new(at, of(key), kind, value)),
        Say::Set(id, value) => events.push(&ParamValueEvent::new(at, id, Pckn::match_all(), value)),
    };
}
