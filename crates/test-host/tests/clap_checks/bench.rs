//! A CLAP host that says what it likes, and looks at every answer.

use std::ffi::CString;

use chalumeau_test_host::artefacts;
use clack_extensions::params::{ParamInfoBuffer, PluginParams};
use clack_extensions::state::{HostState, HostStateImpl, PluginState};
use clack_host::events::event_types::{ParamValueEvent, TransportEvent};
use clack_host::prelude::*;
use clack_host::process::ProcessStatus;
use clack_host::utils::Cookie;

/// The rate of checks for which it does not matter, Hz.
pub const RATE_HZ: f64 = 44_100.0;
/// The block of checks for which it does not matter, samples.
pub const BLOCK: usize = 512;

pub struct Shared;
pub struct Main;
pub struct Host;

impl SharedHandler<'_> for Shared {
    fn request_restart(&self) {}
    fn request_process(&self) {}
    fn request_callback(&self) {}
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
        builder.register::<HostState>();
    }
}

/// The bundled library. It is never unloaded; see `chalumeau_test_host::clap::Plugin::load`.
pub fn library() -> PluginEntry {
    // SAFETY: the file is the plugin this project has just built.
    let entry = unsafe { PluginEntry::load(artefacts::clap().unwrap()) }.unwrap();
    std::mem::forget(entry.clone());
    entry
}

/// The id of the plugin in the library.
pub fn plugin_id(entry: &PluginEntry) -> CString {
    let factory = entry.get_plugin_factory().unwrap();
    factory.plugin_descriptors().next().unwrap().id().unwrap().to_owned()
}

/// An instance of the plugin of this id.
pub fn instance(entry: &PluginEntry, id: &CString) -> Result<PluginInstance<Host>, PluginInstanceError> {
    let info = HostInfo::new("checks", "Chalumeau", "", "1").unwrap();
    PluginInstance::new(|_| Shared, |_| Main, entry, id, &info)
}

/// A parameter, with everything the plugin says of it.
#[derive(Clone, Debug)]
pub struct Param {
    pub id: ClapId,
    pub name: String,
    pub cookie: Cookie,
    pub range: [f64; 2],
    pub default: f64,
    pub is_readonly: bool,
    pub is_stepped: bool,
    pub is_automatable: bool,
}

/// One block that the plugin has rendered.
pub struct Block {
    pub channels: [Vec<f32>; 2],
    pub status: ProcessStatus,
    pub constant_mask: u64,
}

/// The plugin on the bench.
pub struct Bench {
    pub instance: PluginInstance<Host>,
}

impl Bench {
    pub fn new() -> Self {
        let entry = library();
        let id = plugin_id(&entry);
        Self { instance: instance(&entry, &id).unwrap() }
    }

    pub fn params(&mut self) -> Vec<Param> {
        use clack_extensions::params::ParamInfoFlags as Flags;
        let handle = self.instance.plugin_handle();
        let params: PluginParams = handle.get_extension().unwrap();
        let param = |index| {
            let mut buffer = ParamInfoBuffer::new();
            let info = params.get_info(&handle, index, &mut buffer).unwrap();
            Param {
                id: info.id,
                name: String::from_utf8_lossy(info.name).into_owned(),
                cookie: info.cookie,
                range: [info.min_value, info.max_value],
                default: info.default_value,
                is_readonly: info.flags.contains(Flags::IS_READONLY),
                is_stepped: info.flags.contains(Flags::IS_STEPPED),
                is_automatable: info.flags.contains(Flags::IS_AUTOMATABLE),
            }
        };
        (0..params.count(&handle)).map(param).collect()
    }

    /// The values of all parameters, in the plugin's order.
    pub fn values(&mut self) -> Vec<f64> {
        let ids: Vec<_> = self.params().into_iter().map(|param| param.id).collect();
        let handle = self.instance.plugin_handle();
        let params: PluginParams = handle.get_extension().unwrap();
        ids.into_iter().map(|id| params.get_value(&handle, id).unwrap()).collect()
    }

    /// Hands events to the inactive plugin.
    pub fn flush(&mut self, said: &EventBuffer) {
        let mut handle = self.instance.inactive_plugin_handle().unwrap();
        let params: PluginParams = handle.get_extension().unwrap();
        let mut answered = EventBuffer::new();
        params.flush(
            &mut handle,
            &InputEvents::from_buffer(said),
            &mut OutputEvents::from_buffer(&mut answered),
        );
    }

    pub fn save(&mut self, mut to: impl std::io::Write) {
        let handle = self.instance.plugin_handle();
        let state: PluginState = handle.get_extension().unwrap();
        state.save(&handle, &mut to).unwrap();
    }

    /// Whether the plugin takes the state.
    pub fn load(&mut self, mut from: impl std::io::Read) -> bool {
        let handle = self.instance.plugin_handle();
        let state: PluginState = handle.get_extension().unwrap();
        state.load(&handle, &mut from).is_ok()
    }

    /// Activates the plugin, lets `body` play, and deactivates it.
    #[track_caller]
    pub fn session<R>(&mut self, rate_hz: f64, block_most: usize, body: impl FnOnce(&mut Session) -> R) -> R {
        let config = PluginAudioConfiguration {
            sample_rate: rate_hz,
            min_frames_count: 1,
            max_frames_count: u32::try_from(block_most).unwrap(),
        };
        let stopped = self.instance.activate(|_, _| (), config);
        let stopped = stopped.unwrap_or_else(|reason| panic!("activate at {rate_hz} Hz: {reason}"));
        let processor = stopped.start_processing().ok().expect("starts processing");
        let mut session = Session { processor, played: 0 };
        let result = body(&mut session);
        let stopped = session.processor.stop_processing();
        self.instance.deactivate(stopped);
        result
    }
}

/// A plugin that processes.
pub struct Session {
    pub processor: StartedPluginAudioProcessor<Host>,
    played: u64,
}

impl Session {
    /// Processes one block, and asserts that every sample is a number and none is subnormal.
    #[track_caller]
    pub fn block(&mut self, frames: usize, said: &EventBuffer, transport: Option<&TransportEvent>) -> Block {
        let mut channels = [vec![0.0_f32; frames], vec![0.0; frames]];
        let mut ports = AudioPorts::with_capacity(2, 1);
        let mut out = ports.with_output_buffers([AudioPortBuffer {
            latency: 0,
            channels: AudioPortBufferType::f32_output_only(channels.iter_mut().map(Vec::as_mut_slice)),
        }]);
        let mut answered = EventBuffer::new();
        let status = self.processor.process(
            &InputAudioBuffers::empty(),
            &mut out,
            &InputEvents::from_buffer(said),
            &mut OutputEvents::from_buffer(&mut answered),
            Some(self.played),
            transport,
        );
        let constant_mask = out.as_raw_buffers()[0].constant_mask;
        self.played += frames as u64;
        let mut before = 0;
        for event in &answered {
            let at = event.header().time();
            assert!((before..frames as u32).contains(&at), "an event at {at} of {frames}, after {before}");
            before = at;
        }
        for sample in channels.iter().flatten() {
            assert!(sample.is_finite() && !sample.is_subnormal(), "{sample}");
        }
        Block { channels, status: status.unwrap(), constant_mask }
    }
}

/// A new value for a parameter, with the cookie that the plugin gave.
#[allow(unsafe_code)]
pub fn set(at: u32, param: &Param, value: f64) -> ParamValueEvent {
    // SAFETY: the cookie is the plugin's own, of this parameter.
    unsafe { ParamValueEvent::new(at, param.id, Pckn::match_all(), value).with_cookie(param.cookie) }
}

/// A random value that the parameter can have.
pub fn random_value(rng: &mut fastrand::Rng, param: &Param) -> f64 {
    let [low, high] = param.range;
    let value = low + (high - low) * rng.f64();
    if param.is_stepped { value.round() } else { value }
}

pub fn random_values(rng: &mut fastrand::Rng, params: &[Param], at: u32) -> EventBuffer {
    let mut said = EventBuffer::new();
    for param in params.iter().filter(|param| !param.is_readonly) {
        said.push(&set(at, param, random_value(rng, param)));
    }
    said
}

/// No events.
pub fn nothing() -> EventBuffer {
    EventBuffer::new()
}
