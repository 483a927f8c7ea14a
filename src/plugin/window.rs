//! The plugin's window: the [`editor`](crate::editor) in the host's frame, and what it is told.
//!
//! Three threads. The *audio* thread leaves, while the window is open, what is inside the instrument and the last of what
//! was heard, and takes the keys that were pressed in the window. A *looker* thread makes a [`Snapshot`] of all that, of
//! the instrument and of the knob; nothing that takes time is done where the window is drawn. The *main* thread draws the
//! latest snapshot. While nothing moves the window is drawn five times a second.

mod hands;
mod looker;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use nice_plug::context::gui::GuiContext;
use nice_plug::editor::ResizeHint;
use nice_plug_egui::baseview::HandlerError;
use nice_plug_egui::{
    EguiEditor, EguiEditorState, EguiNiceSettings, Frame, NiceEguiApp, RepaintNotifier, create_egui_editor,
};

use crate::editor::{self, Action, Controls, Kept, Snapshot, State};
use crate::event::{Event, Timed};
use crate::identity;
use crate::instrument::watch::{MOMENTS, Moment, Now};
use crate::plugin::instrument::{self, Bench};
#[cfg(feature = "devices")]
use crate::plugin::knob;
use crate::plugin::params::ChalumeauParams;
use crate::plugin::params::instrument::InstrumentChoice;
use hands::HostControls;
use looker::Looker;

/// Samples of sound on their way to the looker: a second at 48 kHz.
const SOUND: usize = 65_536;
/// Keys of the window on their way to the audio thread.
const KEYS: usize = 256;
/// Keys taken in one block; more come with the next.
const KEYS_A_BLOCK: usize = 8;

/// The inside of the instrument at one moment.
#[derive(Clone)]
struct Inside {
    now: Now,
    moments: Box<[Moment; MOMENTS]>,
    moments_hz: f64,
    host_rate_hz: f64,
    latency_samples: u32,
}

impl Default for Inside {
    fn default() -> Self {
        Self {
            now: Now { sounding: None, fingering: 0, mouth_kpa: 0.0 },
            moments: Box::new([Moment::default(); MOMENTS]),
            moments_hz: 48_000.0,
            host_rate_hz: 48_000.0,
            latency_samples: 0,
        }
    }
}

/// What the threads of the window share. The audio thread takes no lock of it.
struct Shared {
    state: Arc<EguiEditorState>,
    repaint: RepaintNotifier,
    latest: Mutex<Arc<Snapshot>>,
    /// Holes that are tried, if any: what the looker draws as open.
    tried: Mutex<Option<Vec<bool>>>,
    stop: AtomicBool,
}

impl Shared {
    fn latest(&self) -> Arc<Snapshot> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// The audio thread's end. [audio thread]
pub struct Audio {
    shared: Arc<Shared>,
    inside: triple_buffer::Input<Inside>,
    sound: rtrb::Producer<f32>,
    keys: rtrb::Consumer<Event>,
    /// Number of the last picture.
    shown: u64,
}

impl Audio {
    /// Keys that were pressed in the window since the last block. Real-time safe.
    pub fn keys(&mut self) -> [Option<Timed<Event>>; KEYS_A_BLOCK] {
        std::array::from_fn(|_| self.keys.pop().ok().map(|event| Timed { at: 0, event }))
    }

    /// Leaves what was heard and what is inside, while the window is open. Real-time safe.
    pub fn show(&mut self, bench: &mut Bench, heard: &[f32]) {
        let open = self.shared.state.is_open();
        bench.set_watched(open);
        if !open {
            return;
        }
        let room = self.sound.slots().min(heard.len());
        if let Ok(chunk) = self.sound.write_chunk_uninit(room) {
            chunk.fill_from_iter(heard[heard.len() - room..].iter().copied());
        }
        let clarinet = bench.clarinet();
        let watch = clarinet.watch();
        let Some((number, moments)) = watch.picture().filter(|&(number, _)| number != self.shown) else {
            return;
        };
        self.shown = number;
        let inside = self.inside.input_buffer_mut();
        inside.now = clarinet.now();
        inside.moments.copy_from_slice(moments);
        inside.moments_hz = watch.rate_hz(clarinet.internal_rate_hz());
        inside.host_rate_hz = bench.rate_hz();
        inside.latency_samples = clarinet.latency_samples();
        self.inside.publish();
    }
}

/// The window of one plugin instance; its looker ends with it.
pub struct Window {
    shared: Arc<Shared>,
    params: Arc<ChalumeauParams>,
    keys: Option<rtrb::Producer<Event>>,
    #[cfg(feature = "devices")]
    knob: Arc<knob::Shared>,
    looker: Option<JoinHandle<()>>,
}

impl Window {
    /// Starts the looker, which does nothing while the window is closed. Allocates.
    pub fn start(
        params: Arc<ChalumeauParams>,
        instruments: Arc<instrument::Shared>,
        #[cfg(feature = "devices")] knob: Arc<knob::Shared>,
    ) -> (Self, Audio) {
        let kept = kept(&params);
        let (width, height) = kept.size;
        let size = nice_plug::editor::dpi::LogicalSize::new(width, height);
        let shared = Arc::new(Shared {
            state: EguiEditorState::from_size(size, kept.zoom),
            repaint: RepaintNotifier::new(),
            latest: Mutex::new(Arc::new(Snapshot::default())),
            tried: Mutex::default(),
            stop: AtomicBool::new(false),
        });
        let (inside_in, inside) = triple_buffer::triple_buffer(&Inside::default());
        let (sound_in, sound) = rtrb::RingBuffer::new(SOUND);
        let (keys_in, keys) = rtrb::RingBuffer::new(KEYS);
        let looker = Looker::new(
            shared.clone(),
            params.clone(),
            instruments,
            #[cfg(feature = "devices")]
            knob.clone(),
            inside,
            sound,
        );
        let looker =
            std::thread::Builder::new().name("chalumeau looker".to_owned()).spawn(move || looker.run());
        let audio = Audio { shared: shared.clone(), inside: inside_in, sound: sound_in, keys, shown: 0 };
        // Without a thread the window shows parameters only.
        let window = Self {
            shared,
            params,
            keys: Some(keys_in),
            #[cfg(feature = "devices")]
            knob,
            looker: looker.ok(),
        };
        (window, audio)
    }

    /// The window for the host; there is one.
    pub fn editor(&mut self) -> Option<EguiEditor<App>> {
        let keys = self.keys.take()?;
        let app = App {
            shared: self.shared.clone(),
            controls: HostControls::new(self.params.clone()),
            params: self.params.clone(),
            state: State::new(kept(&self.params)),
            keys,
            #[cfg(feature = "devices")]
            knob: self.knob.clone(),
            gui: None,
        };
        let settings =
            EguiNiceSettings::new().with_tile(identity::NAME).with_resize_hint(ResizeHint::resizable());
        create_egui_editor(self.shared.state.clone(), self.shared.repaint.clone(), settings, app)
    }
}

impl Drop for Window {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(looker) = self.looker.take() {
            // A looker that has panicked has been reported already.
            let _ = looker.join();
        }
    }
}

/// What the state of the plugin keeps of the window.
fn kept(params: &ChalumeauParams) -> Kept {
    params.window.read().map_or_else(|_| Kept::default(), |kept| kept.clone()).mended()
}

/// Draws, and does what was done. [main thread]
pub struct App {
    shared: Arc<Shared>,
    controls: HostControls,
    params: Arc<ChalumeauParams>,
    state: State,
    keys: rtrb::Producer<Event>,
    #[cfg(feature = "devices")]
    knob: Arc<knob::Shared>,
    gui: Option<GuiContext>,
}

impl App {
    fn act(&mut self, action: Action) {
        match action {
            // A full ring loses a key, not the window.
            Action::NoteOn { note, velocity } => {
                let _ = self.keys.push(Event::NoteOn { note, velocity });
            }
            Action::NoteOff { note } => {
                let _ = self.keys.push(Event::NoteOff { note });
            }
            Action::TryFingering(open) => {
                let bits = open.iter().enumerate().map(|(hole, &open)| u64::from(open) << hole).sum();
                let _ = self.keys.push(Event::TryHoles(Some(bits)));
                self.set_tried(Some(open));
            }
            Action::EndTry => {
                let _ = self.keys.push(Event::TryHoles(None));
                self.set_tried(None);
            }
            Action::ChooseInstrument(index) => self.choose_instrument(index),
            Action::OpenInstrument(path) => {
                if let Ok(mut file) = self.params.instrument.file.write() {
                    *file = path.display().to_string();
                }
                self.choose_instrument(InstrumentChoice::ALL.len() - 1);
            }
            #[cfg(feature = "devices")]
            Action::ChooseDevice(key) => {
                if let Ok(mut serial) = self.params.knob.serial.write() {
                    *serial = key;
                }
            }
            #[cfg(feature = "devices")]
            Action::FeelTest(feel) => self.knob.test(feel),
            #[cfg(not(feature = "devices"))]
            Action::ChooseDevice(_) | Action::FeelTest(_) => {}
        }
    }

    fn choose_instrument(&self, index: usize) {
        let Some(gui) = &self.gui else { return };
        let most = (InstrumentChoice::ALL.len() - 1) as f32;
        let controls = self.controls.with(gui);
        controls.begin("instr");
        controls.set("instr", index as f32 / most);
        controls.end("instr");
    }

    fn set_tried(&self, tried: Option<Vec<bool>>) {
        *self.shared.tried.lock().unwrap_or_else(PoisonError::into_inner) = tried;
    }
}

impl NiceEguiApp for App {
    fn build(&mut self, _: egui::Context, gui: GuiContext, _: &mut Frame) -> Result<(), HandlerError> {
        // The framework does not say when a window closes: what it left held is let go of here.
        self.gui = Some(gui.clone());
        for action in self.state.close(&self.controls.with(&gui)) {
            self.act(action);
        }
        Ok(())
    }

    fn ui(&mut self, ui: &mut egui::Ui, _: &mut Frame) {
        let Some(gui) = self.gui.clone() else { return };
        let mut snapshot = Snapshot::clone(&self.shared.latest());
        // A handle under the mouse must follow in this very frame.
        snapshot.settings = self.params.settings();
        ui.ctx().set_zoom_factor(self.state.kept.zoom);
        let controls = self.controls.with(&gui);
        let actions = editor::draw(ui, &mut self.state, &controls, &snapshot);
        drop(controls);
        for action in actions {
            self.act(action);
        }
        let size = ui.ctx().content_rect().size();
        self.state.kept.size = (size.x, size.y);
        let now = self.state.kept.clone().mended();
        if let Ok(mut kept) = self.params.window.write()
            && *kept != now
        {
            *kept = now;
        }
    }
}
