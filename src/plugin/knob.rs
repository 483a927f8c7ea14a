//! The plugin's side of the knob.
//!
//! Four threads share it.
//! - The *audio* thread reads angles from a ring, renders the breath, and tells which note is fingered.
//! - The *link* thread (see [`device`](chalumeau_knob::device)) asks at each cycle for the feel of that note.
//! - The *knob controller* thread carries out the switches and composes the status text. It waits for nothing that takes long.
//! - The thread of the *slow work* computes feels, and reads and writes takes.
//!
//! They exchange data through atomics, triple buffers and rings. The audio thread never waits and frees nothing.

mod calibrator;
mod feel_design;
mod feel_in_force;
mod feels_cache;
mod heard_sound;
mod knob_audio;
mod knob_controller;
mod knob_switches;
mod main_pulse;
mod slow_work;
mod take_recorder;

use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, OnceLock, mpsc};
use std::thread::JoinHandle;
use std::time::Duration;

pub use feel_design::feel_design;
pub use knob_audio::{BlockContext, KnobAudio};
pub use main_pulse::MainPulse;

use crate::plugin::instrument_loading::SharedInstrument;
use crate::plugin::params::ChalumeauParams;
use chalumeau_core::units::SoundingNote;
use chalumeau_knob::device::{Heartbeat, LinkStatus, Release};
use chalumeau_knob::touch::breath_from_angle::BreathMapping;
use chalumeau_knob::touch::take::Take;
use chalumeau_knob::wire::message;
use feel_in_force::FeelInForce;
use knob_controller::KnobController;
use main_pulse::MainPulseAsker;
use slow_work::{SlowWork, WorkTexts};

/// Number that stands for no note.
const NO_NOTE: u8 = 255;

/// Time between two cycles of controller and slow work.
const CYCLE: Duration = Duration::from_millis(10);

/// What the threads share about the knob.
#[derive(Debug)]
pub struct SharedKnob {
    /// The fingered note, sounding pitch, or [`NO_NOTE`].
    note: AtomicU8,
    /// Share of full breath, the bits of an f32.
    breath: AtomicU32,
    /// Factors that controllers put on H and k, the bits of f32s.
    reed_factors: [AtomicU32; 2],
    /// The feel in force. The slow work and the link lock it.
    feel: Mutex<Option<Arc<FeelInForce>>>,
    /// What the angles blow: the feel in force or, where no motor makes torque, the one that the parameters describe.
    blown: Mutex<Option<Arc<FeelInForce>>>,
    /// A test feel, which replaces the feel of any note. The window and the link lock it.
    test: Mutex<Option<message::Feel>>,
    /// The user has chosen a device, so that even the same choice counts as new.
    device_chosen: AtomicBool,
    /// The sign of life of the audio thread, once there is a link.
    audio_heart: OnceLock<Heartbeat>,
    /// The sign of life of the host's main thread.
    main_pulse: Arc<MainPulse>,
    /// The state of the link. The controller, the slow work and the window lock it.
    status: Mutex<Option<LinkStatus>>,
    /// What the slow work tells the user. It and the controller lock it.
    work_texts: Mutex<WorkTexts>,
    /// A take is recorded, so the audio thread sends its sound.
    is_recording: AtomicBool,
    /// The host has activated this instance. An instance that was never active leaves the knob to the others.
    is_active: AtomicBool,
    stop: AtomicBool,
}

impl SharedKnob {
    fn new(main_pulse: Arc<MainPulse>) -> Self {
        let one = || AtomicU32::new(1.0_f32.to_bits());
        Self {
            note: AtomicU8::new(NO_NOTE),
            breath: AtomicU32::new(0),
            reed_factors: [one(), one()],
            feel: Mutex::new(None),
            blown: Mutex::new(None),
            test: Mutex::default(),
            device_chosen: AtomicBool::new(false),
            audio_heart: OnceLock::new(),
            main_pulse,
            status: Mutex::default(),
            work_texts: Mutex::default(),
            is_recording: AtomicBool::new(false),
            is_active: AtomicBool::new(false),
            stop: AtomicBool::new(false),
        }
    }

    fn note(&self) -> Option<SoundingNote> {
        Some(self.note.load(Ordering::Relaxed)).filter(|&note| note != NO_NOTE).map(SoundingNote)
    }

    /// Makes the knob feel like `feel`, whatever note is fingered; `None` ends the test.
    pub fn test(&self, feel: Option<message::Feel>) {
        if let Ok(mut test) = self.test.lock() {
            *test = feel;
        }
    }

    /// The feel of a test, if one is on.
    fn tested(&self) -> Option<message::Feel> {
        self.test.lock().ok().and_then(|test| *test)
    }

    /// Torque off, now. Real-time safe.
    pub fn let_go(&self, reason: Release) {
        if let Some(heart) = self.audio_heart.get() {
            heart.let_go(reason);
        }
    }

    /// Says that the user has chosen a device from the list, even if its kind was already chosen.
    pub fn choose_device_again(&self) {
        self.device_chosen.store(true, Ordering::Relaxed);
    }

    /// The state of the link at the controller's last cycle; `None` without a link.
    pub fn status(&self) -> Option<LinkStatus> {
        self.status.lock().ok()?.clone()
    }

    /// The slow work tells the user something.
    fn tell(&self, texts: &WorkTexts) {
        if let Ok(mut told) = self.work_texts.lock()
            && *told != *texts
        {
            told.clone_from(texts);
        }
    }

    fn work_texts(&self) -> WorkTexts {
        self.work_texts.lock().map(|texts| texts.clone()).unwrap_or_default()
    }

    fn breath(&self) -> f32 {
        f32::from_bits(self.breath.load(Ordering::Relaxed))
    }

    fn feel_in_force(&self) -> Option<Arc<FeelInForce>> {
        self.feel.lock().ok()?.clone()
    }

    fn set_feel(&self, in_force: Arc<FeelInForce>) {
        if let Ok(mut feel) = self.feel.lock() {
            *feel = Some(in_force);
        }
    }

    fn blown(&self) -> Option<Arc<FeelInForce>> {
        self.blown.lock().ok()?.clone()
    }

    fn set_blown(&self, now: Arc<FeelInForce>) {
        if let Ok(mut blown) = self.blown.lock() {
            *blown = Some(now);
        }
    }

    fn reed_factors(&self) -> [f32; 2] {
        [0, 1].map(|which| f32::from_bits(self.reed_factors[which].load(Ordering::Relaxed)))
    }
}

/// The knob of one plugin instance. Dropping it ends the controller and the link.
pub struct PluginKnob {
    shared: Arc<SharedKnob>,
    threads: Vec<JoinHandle<()>>,
}

impl PluginKnob {
    /// Starts the controller, which starts the link when the user wants a knob, and the slow work. `ask_main` makes the host's main thread
    /// answer to `main_pulse`. Allocates.
    pub fn start(
        params: Arc<ChalumeauParams>,
        instrument: Arc<SharedInstrument>,
        main_pulse: Arc<MainPulse>,
        ask_main: Option<Box<dyn Fn() + Send>>,
    ) -> (Self, KnobAudio) {
        let shared = Arc::new(SharedKnob::new(main_pulse));
        let (hand_in, hand) = triple_buffer::triple_buffer(&BreathMapping::default());
        let (take_in, take) = triple_buffer::triple_buffer(&None::<Arc<Take>>);
        let (readers_in, readers) = rtrb::RingBuffer::new(1);
        let asker = MainPulseAsker::new(ask_main);
        let (sound, listener) = heard_sound::sound_channel(shared.clone());
        let (rows_in, rows) = mpsc::channel();
        let (of_work, of_controller) = (params.clone(), params);
        let work =
            SlowWork::new(of_work, shared.clone(), instrument.clone(), hand_in, take_in, listener, rows);
        let controller =
            KnobController::new(of_controller, shared.clone(), instrument, asker, readers_in, rows_in);
        let threads = [
            std::thread::Builder::new().name("KnobController".to_owned()).spawn(move || controller.run()),
            std::thread::Builder::new().name("KnobWork".to_owned()).spawn(move || work.run()),
        ];
        let audio = KnobAudio::new(shared.clone(), readers, hand, take, sound);
        // Without a thread there is no knob, but the instrument plays.
        (Self { shared, threads: threads.into_iter().flatten().collect() }, audio)
    }

    /// What the window reads and sets.
    pub fn shared(&self) -> &Arc<SharedKnob> {
        &self.shared
    }
}

impl Drop for PluginKnob {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        // The controller asks the host's main thread through the plugin's frame, and may be the last to hold it.
        let is_other = |thread: &JoinHandle<()>| thread.thread().id() != std::thread::current().id();
        for thread in self.threads.drain(..).filter(is_other) {
            // The panic of a thread was reported when it happened.
            let _ = thread.join();
        }
    }
}
