//! The plugin's end of the knob.
//!
//! Three threads share it. The *audio* thread reads angles from a ring, sends breath, and says which note is fingered.
//! The *link* thread (in [`device`](chalumeau_knob::device)) asks at every turn what that note shall feel like. The *desk*
//! thread does what may take time: it follows the parameters, works out feels, writes takes, and words the status.
//! Everything between them is an atomic, a triple buffer or a ring; the audio thread never waits and frees nothing.

mod audio;
mod desk;
mod felt;
mod takes;

use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

pub use audio::{Audio, Stage};
pub use desk::design;

use crate::plugin::instrument;
use crate::plugin::params::ChalumeauParams;
use chalumeau_core::haptics::FeelTable;
use chalumeau_core::units::SoundingNote;
use chalumeau_knob::device::LinkStatus;
use chalumeau_knob::touch::blower::Hand;
use chalumeau_knob::touch::feel::Feels;
use chalumeau_knob::touch::take::Take;
use chalumeau_knob::wire::message;

/// No note is fingered.
const NO_NOTE: u8 = 255;

/// An instrument's feel, and the table that design and limits make of it.
type Feel = (Arc<Feels>, FeelTable);

/// What the threads tell each other.
#[derive(Debug)]
pub struct Shared {
    /// Sounding note in the fingers, or [`NO_NOTE`].
    note: AtomicU8,
    /// Mouth pressure over closing pressure, bits of an f32.
    gamma: AtomicU32,
    /// Factors on H and k from controllers, bits of f32s.
    reed: [AtomicU32; 2],
    /// The feel in force, with the instrument it is of. Only desk and link lock it.
    feel: Mutex<Option<Arc<Feel>>>,
    /// A feel that is tried, whatever is played. Only window, desk and link lock it.
    test: Mutex<Option<message::Feel>>,
    /// The user has chosen a device: what is remembered counts as new.
    chosen: AtomicBool,
    /// How the link is. Only desk and window lock it.
    status: Mutex<Option<LinkStatus>>,
    /// The instance has been activated: one that has never played leaves the knob to those that do.
    plays: AtomicBool,
    stop: AtomicBool,
}

impl Shared {
    fn new() -> Self {
        let one = || AtomicU32::new(1.0_f32.to_bits());
        Self {
            note: AtomicU8::new(NO_NOTE),
            gamma: AtomicU32::new(0),
            reed: [one(), one()],
            feel: Mutex::new(None),
            test: Mutex::default(),
            chosen: AtomicBool::new(false),
            status: Mutex::default(),
            plays: AtomicBool::new(false),
            stop: AtomicBool::new(false),
        }
    }

    fn note(&self) -> Option<SoundingNote> {
        Some(self.note.load(Ordering::Relaxed)).filter(|&note| note != NO_NOTE).map(SoundingNote)
    }

    /// What the knob shall feel like for a test; `None` ends it.
    pub fn test(&self, feel: Option<message::Feel>) {
        if let Ok(mut test) = self.test.lock() {
            *test = feel;
        }
    }

    /// The user has chosen a device of the list, even if it is of the kind that was chosen already.
    pub fn choose_anew(&self) {
        self.chosen.store(true, Ordering::Relaxed);
    }

    /// How the link was when the desk last looked.
    pub fn status(&self) -> Option<LinkStatus> {
        self.status.lock().ok()?.clone()
    }

    fn gamma(&self) -> f32 {
        f32::from_bits(self.gamma.load(Ordering::Relaxed))
    }

    fn reed(&self) -> [f32; 2] {
        [0, 1].map(|which| f32::from_bits(self.reed[which].load(Ordering::Relaxed)))
    }
}

/// Desk and link of one plugin instance; both end when it is dropped.
pub struct Knob {
    shared: Arc<Shared>,
    desk: Option<JoinHandle<()>>,
}

impl Knob {
    /// Starts the desk; the link follows when the user wants a knob. Allocates.
    pub fn start(params: Arc<ChalumeauParams>, instruments: Arc<instrument::Shared>) -> (Self, Audio) {
        let shared = Arc::new(Shared::new());
        let (hand_in, hand) = triple_buffer::triple_buffer(&Hand::default());
        let (take_in, take) = triple_buffer::triple_buffer(&None::<Arc<Take>>);
        let (readers_in, readers) = rtrb::RingBuffer::new(1);
        let desk = desk::Desk::new(params, shared.clone(), instruments, readers_in, hand_in, take_in);
        let desk = std::thread::Builder::new().name("chalumeau knob".to_owned()).spawn(move || desk.run());
        let audio = Audio::new(shared.clone(), readers, hand, take);
        // Without a thread there is no knob; the instrument plays all the same.
        (Self { shared, desk: desk.ok() }, audio)
    }

    /// What the window asks and tells.
    pub fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }
}

impl Drop for Knob {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(desk) = self.desk.take() {
            // A desk that has panicked has been reported already.
            let _ = desk.join();
        }
    }
}
