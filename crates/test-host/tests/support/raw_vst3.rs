//! A VST3 as a host holds it, call by call: what a friendly host would not do.
#![allow(dead_code, reason = "each user takes what it needs")]

use std::ffi::{c_char, c_void};
use std::path::PathBuf;
use std::ptr;
use std::sync::OnceLock;

use vst3::Steinberg::Vst::{
    AudioBusBuffers, AudioBusBuffers__type0, Event, Event_::EventTypes_, Event__type0, IAudioProcessor,
    IAudioProcessorTrait, IComponent, IComponentTrait, IEditController, IEditControllerTrait, IEventList,
    IEventListTrait, IParamValueQueue, IParamValueQueueTrait, IParameterChanges, IParameterChangesTrait,
    NoteExpressionValueEvent, NoteOffEvent, NoteOnEvent, ProcessData, ProcessSetup, ViewType,
};
use vst3::Steinberg::{
    IPlugView, IPlugViewTrait, IPluginBaseTrait, IPluginFactory, IPluginFactoryTrait, TUID, int32,
    kPlatformTypeX11EmbedWindowID, kResultFalse, kResultOk, tresult, uint32,
};
use vst3::{Class, ComPtr, ComWrapper, Interface};

/// Largest block, samples.
pub const BLOCK: usize = 512;
pub const RATE: f64 = 48_000.0;

/// The plugin that a project names first.
pub const CLARINET: [u8; 16] = *b"ChalumeauClarint";
/// The one with an audio input.
pub const MICROPHONE: [u8; 16] = *b"ChalumeauMicroph";

/// One instance, activated and processing.
pub struct Raw {
    component: ComPtr<IComponent>,
    processor: ComPtr<IAudioProcessor>,
    pub controller: ComPtr<IEditController>,
}

// SAFETY: VST3 allows `process` on another thread than the calls of the main thread; the tests keep to that.
unsafe impl Sync for Raw {}

/// Loads the library once and for good, as hosts do that scan in their own process.
fn factory() -> &'static ComPtr<IPluginFactory> {
    struct Shared(ComPtr<IPluginFactory>);
    // SAFETY: the factory has no state.
    unsafe impl Send for Shared {}
    // SAFETY: as above.
    unsafe impl Sync for Shared {}
    static FACTORY: OnceLock<Shared> = OnceLock::new();
    let load = || {
        let bundle = chalumeau_test_host::artefacts::vst3().unwrap();
        let name = format!("Contents/{}-linux", std::env::consts::ARCH);
        let folder = bundle.join(name);
        let binary: PathBuf = std::fs::read_dir(folder).unwrap().next().unwrap().unwrap().path();
        // SAFETY: the plugin's own entry points, with the types that VST3 gives them.
        unsafe {
            let library = Box::leak(Box::new(libloading::Library::new(binary).unwrap()));
            let entry: libloading::Symbol<unsafe extern "C" fn(*mut c_void) -> bool> =
                library.get(b"ModuleEntry").unwrap();
            assert!(entry(ptr::null_mut()));
            let get: libloading::Symbol<unsafe extern "C" fn() -> *mut IPluginFactory> =
                library.get(b"GetPluginFactory").unwrap();
            Shared(ComPtr::from_raw(get()).unwrap())
        }
    };
    &FACTORY.get_or_init(load).0
}

impl Raw {
    /// An instance of a class.
    pub fn load(class: [u8; 16]) -> Self {
        let id: TUID = class.map(|byte| byte as c_char);
        let interface = IComponent::IID;
        let mut object = ptr::null_mut();
        // SAFETY: a host's calls in the order that VST3 wants.
        unsafe {
            let result =
                factory().createInstance(id.as_ptr(), interface.as_ptr().cast::<c_char>(), &raw mut object);
            assert_eq!(result, kResultOk);
            let component = ComPtr::from_raw(object.cast::<IComponent>()).unwrap();
            assert_eq!(component.initialize(ptr::null_mut()), kResultOk);
            let processor = component.cast::<IAudioProcessor>().unwrap();
            let controller = component.cast::<IEditController>().unwrap();
            let mut setup = ProcessSetup {
                processMode: 0,
                symbolicSampleSize: 0,
                maxSamplesPerBlock: BLOCK as i32,
                sampleRate: RATE,
            };
            assert_eq!(processor.setupProcessing(&raw mut setup), kResultOk);
            assert_eq!(component.setActive(1), kResultOk);
            assert_eq!(processor.setProcessing(1), kResultOk);
            Self { component, processor, controller }
        }
    }

    /// The id of the parameter of this name.
    pub fn parameter(&self, name: &str) -> uint32 {
        // SAFETY: the controller lives.
        let count = unsafe { self.controller.getParameterCount() };
        let named = |at: i32| {
            // SAFETY: a structure of plain numbers, and a place for it.
            let info = unsafe {
                let mut info = std::mem::zeroed();
                assert_eq!(self.controller.getParameterInfo(at, &raw mut info), kResultOk);
                info
            };
            let length = info.title.iter().position(|&unit| unit == 0).unwrap_or(0);
            (String::from_utf16_lossy(&info.title[..length]) == name).then_some(info.id)
        };
        (0..count).find_map(named).unwrap()
    }

    /// One block; what comes out of the left channel, nothing where there is no output.
    pub fn process(&self, block: Block) -> Vec<f32> {
        let Block { samples, has_output, events, changes, left } = block;
        let mut sound = [left.to_vec(), left.to_vec()];
        sound.iter_mut().for_each(|channel| channel.resize(samples, 0.25));
        let mut channels = sound.each_mut().map(|channel| channel.as_mut_ptr());
        let mut output = AudioBusBuffers {
            numChannels: 2,
            silenceFlags: 0,
            __field0: AudioBusBuffers__type0 { channelBuffers32: channels.as_mut_ptr() },
        };
        let events = ComWrapper::new(Events(events.to_vec()));
        let changes = ComWrapper::new(Changes(
            changes.iter().map(|&(id, value)| ComWrapper::new(Points { id, value })).collect(),
        ));
        let mut data = ProcessData {
            processMode: 0,
            symbolicSampleSize: 0,
            numSamples: samples as i32,
            numInputs: 0,
            numOutputs: i32::from(has_output),
            inputs: ptr::null_mut(),
            outputs: if has_output { &raw mut output } else { ptr::null_mut() },
            inputParameterChanges: changes.as_com_ref::<IParameterChanges>().unwrap().as_ptr(),
            outputParameterChanges: ptr::null_mut(),
            inputEvents: events.as_com_ref::<IEventList>().unwrap().as_ptr(),
            outputEvents: ptr::null_mut(),
            processContext: ptr::null_mut(),
        };
        // SAFETY: all that `data` points to lives to the end of the call.
        assert_eq!(unsafe { self.processor.process(&raw mut data) }, kResultOk);
        if has_output { sound[0].clone() } else { Vec::new() }
    }

    /// A window of the plugin.
    pub fn view(&self) -> View {
        // SAFETY: the controller lives.
        let view = unsafe { ComPtr::from_raw(self.controller.createView(ViewType::kEditor)) };
        View(view.unwrap())
    }
}

impl Drop for Raw {
    fn drop(&mut self) {
        // SAFETY: a host's calls in the order that VST3 wants.
        unsafe {
            self.processor.setProcessing(0);
            self.component.setActive(0);
            self.component.terminate();
        }
    }
}

/// What a block has.
#[derive(Clone, Copy)]
pub struct Block<'a> {
    pub samples: usize,
    pub has_output: bool,
    pub events: &'a [Event],
    /// Values of parameters at the first sample.
    pub changes: &'a [(uint32, f64)],
    /// What was left in the host's buffers for the output; something else where it is too short.
    pub left: &'a [f32],
}

impl Default for Block<'_> {
    fn default() -> Self {
        Self { samples: BLOCK, has_output: true, events: &[], changes: &[], left: &[] }
    }
}

fn event(type_: i32, at: usize, body: Event__type0) -> Event {
    Event {
        busIndex: 0,
        sampleOffset: at as i32,
        ppqPosition: 0.0,
        flags: 0,
        r#type: type_ as u16,
        __field0: body,
    }
}

pub fn note_on(at: usize, key: i16, id: i32) -> Event {
    let note = NoteOnEvent { channel: 0, pitch: key, tuning: 0.0, velocity: 0.8, length: 0, noteId: id };
    event(EventTypes_::kNoteOnEvent as i32, at, Event__type0 { noteOn: note })
}

pub fn note_off(at: usize, key: i16, id: i32) -> Event {
    let note = NoteOffEvent { channel: 0, pitch: key, velocity: 0.0, noteId: id, tuning: 0.0 };
    event(EventTypes_::kNoteOffEvent as i32, at, Event__type0 { noteOff: note })
}

/// How loud a note is: 0.25 is a gain of 1.
pub fn volume(at: usize, id: i32, value: f64) -> Event {
    let said = NoteExpressionValueEvent { typeId: 0, noteId: id, value };
    event(EventTypes_::kNoteExpressionValueEvent as i32, at, Event__type0 { noteExpressionValue: said })
}

/// A window of the plugin in a host that has no run loop for it.
pub struct View(ComPtr<IPlugView>);

impl View {
    /// Opens it inside a window of X11.
    pub fn open(&self, window: u32) {
        let parent = ptr::without_provenance_mut::<c_void>(window as usize);
        // SAFETY: the window lives until the view is closed.
        assert_eq!(unsafe { self.0.attached(parent, kPlatformTypeX11EmbedWindowID) }, kResultOk);
    }

    pub fn close(&self) {
        // SAFETY: it is open.
        assert_eq!(unsafe { self.0.removed() }, kResultOk);
    }
}

struct Events(Vec<Event>);

impl Class for Events {
    type Interfaces = (IEventList,);
}

impl IEventListTrait for Events {
    unsafe fn getEventCount(&self) -> int32 {
        self.0.len() as i32
    }
    unsafe fn getEvent(&self, index: int32, to: *mut Event) -> tresult {
        let Some(event) = self.0.get(index as usize) else { return kResultFalse };
        // SAFETY: the plugin's place for an event.
        unsafe { *to = *event };
        kResultOk
    }
    unsafe fn addEvent(&self, _: *mut Event) -> tresult {
        kResultFalse
    }
}

struct Points {
    id: uint32,
    value: f64,
}

impl Class for Points {
    type Interfaces = (IParamValueQueue,);
}

impl IParamValueQueueTrait for Points {
    unsafe fn getParameterId(&self) -> uint32 {
        self.id
    }
    unsafe fn getPointCount(&self) -> int32 {
        1
    }
    unsafe fn getPoint(&self, _: int32, at: *mut int32, value: *mut f64) -> tresult {
        // SAFETY: the plugin's places for both.
        unsafe { (*at, *value) = (0, self.value) };
        kResultOk
    }
    unsafe fn addPoint(&self, _: int32, _: f64, _: *mut int32) -> tresult {
        kResultFalse
    }
}

struct Changes(Vec<ComWrapper<Points>>);

impl Class for Changes {
    type Interfaces = (IParameterChanges,);
}

impl IParameterChangesTrait for Changes {
    unsafe fn getParameterCount(&self) -> int32 {
        self.0.len() as i32
    }
    unsafe fn getParameterData(&self, index: int32) -> *mut IParamValueQueue {
        let queue = self.0.get(index as usize).and_then(|queue| queue.as_com_ref::<IParamValueQueue>());
        queue.map_or(ptr::null_mut(), |queue| queue.as_ptr())
    }
    unsafe fn addParameterData(&self, _: *const uint32, _: *mut int32) -> *mut IParamValueQueue {
        ptr::null_mut()
    }
}
