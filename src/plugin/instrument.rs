//! The plugin's instrument: which one, made ready where that may take its time, exchanged while it sounds.
//!
//! The *main* thread builds what can be had at once when the host activates the plugin. The *workshop* thread follows the
//! parameters from then on: it looks for another instrument in the program and the cache, else cuts it roughly so that
//! something sounds, then fits and tunes it, and hands over what is better each time. The *audio* thread finds a whole
//! instrument in a ring, lets it speak in silence beside the old one, fades over, and sends the old one back. Nothing is
//! allocated or freed there and nobody is waited for, except where a file is rendered: an offline render waits for what
//! its parameters ask for, so that two renders are the same.

pub mod bench;
pub mod choice;
pub mod workshop;

use std::sync::atomic::{AtomicBool, AtomicU32};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use chalumeau_core::instrument::{Clarinet, Model};
use choice::Order;

pub use bench::Bench;
pub use workshop::Workshop;

/// No choice has been served.
const NOBODY: u32 = u32::MAX;

/// Before anything plays: a B flat clarinet sounds two semitones lower than written.
const BUILT_IN_TRANSPOSITION: i8 = 2;

/// How good an instrument is, the worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Cut, not fitted: speaks, out of tune.
    Rough,
    /// Fitted, not tuned.
    Fitted,
    /// Tuned for another A4, which the player bridges.
    Near,
    /// As good as it gets.
    Tuned,
}

/// An instrument that was handed over.
#[derive(Clone, Debug)]
pub struct Placed {
    /// What was asked for.
    pub order: Order,
    /// How good it is.
    pub stage: Stage,
    /// The instrument.
    pub model: Arc<Model>,
}

/// What the host wants at the moment.
#[derive(Clone, Debug, Default)]
struct Job {
    /// Host rate, Hz; none before the first activation, and while the main thread builds.
    rate_hz: Option<f64>,
    offline: bool,
    /// What is on the bench, or on its way there.
    placed: Option<Placed>,
    /// Counts activations: what was begun for an earlier one is of no use.
    turn: u64,
}

/// What the threads tell each other. Only main, workshop and desk take the lock.
#[derive(Debug)]
pub struct Shared {
    job: Mutex<Job>,
    /// The choice that the workshop has done everything for, as the enum's number.
    served: AtomicU32,
    stop: AtomicBool,
}

impl Shared {
    fn new() -> Self {
        Self { job: Mutex::default(), served: AtomicU32::new(NOBODY), stop: AtomicBool::new(false) }
    }

    fn job(&self) -> MutexGuard<'_, Job> {
        self.job.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Written over sounding pitch of the instrument that plays, semitones.
    pub fn transposition(&self) -> i8 {
        let job = self.job();
        job.placed.as_ref().map_or(BUILT_IN_TRANSPOSITION, |placed| placed.model.file.transposition)
    }

    /// The instrument that plays, or is about to.
    pub fn placed(&self) -> Option<Placed> {
        self.job().placed.clone()
    }
}

/// An instrument on its way to the audio thread.
pub struct Parcel {
    turn: u64,
    clarinet: Box<Clarinet>,
}
