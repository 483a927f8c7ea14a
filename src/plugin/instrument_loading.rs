//! Loads the instrument that the parameters ask for, and exchanges it while it sounds.
//!
//! Three threads take part.
//! - The *main* thread builds what is available at once when the host activates the plugin.
//! - The *loader* thread then follows the parameters. It takes another instrument from the program or the cache. If it
//!   finds none, it builds a rough one so that something sounds, then fits and tunes it, and hands over each better one.
//! - The *audio* thread receives a complete instrument through a ring. The new instrument first plays unheard beside the
//!   old one, then the two crossfade, and the old one goes back through another ring. The audio thread allocates and frees
//!   nothing. It waits for nobody but in an offline render, which waits for the instrument and the preset that its parameters
//!   ask for, so that two renders are the same.

pub mod instrument_loader;
pub mod instrument_request;
pub mod instrument_swap;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use chalumeau_core::instrument::{Ensemble, Model};
use instrument_request::InstrumentRequest;

pub use instrument_loader::InstrumentLoader;
pub use instrument_swap::InstrumentSwap;

/// Transposition before the first activation: a B flat clarinet sounds two semitones lower than written.
const BUILT_IN_TRANSPOSITION: i8 = 2;

/// How far an instrument is built, the worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Readiness {
    /// Not fitted: it speaks, but out of tune.
    Rough,
    /// Fitted, not tuned.
    Fitted,
    /// Tuned for another A4; the player corrects the difference.
    OtherA4,
    /// Fitted and tuned for the A4 of the request.
    Tuned,
}

/// The instrument that plays, or that is on its way to the audio thread.
#[derive(Clone, Debug)]
pub struct CurrentInstrument {
    /// The request it answers.
    pub request: InstrumentRequest,
    /// How far it is built.
    pub readiness: Readiness,
    /// The instrument.
    pub model: Arc<Model>,
}

/// The host's latest activation of the plugin.
#[derive(Clone, Debug, Default)]
struct Activation {
    /// Host rate, Hz; `None` before the first activation and while the main thread builds an instrument.
    host_rate_hz: Option<f64>,
    /// Whether the host renders a file.
    offline: bool,
    current: Option<CurrentInstrument>,
    /// Counts activations. Work that began under an earlier number is discarded.
    number: u64,
    /// What [`SharedInstrument::asked`] was when the host activated the plugin.
    asked_before: u64,
}

/// What the threads share about the instrument. The audio thread never takes the lock.
#[derive(Debug, Default)]
pub struct SharedInstrument {
    activation: Mutex<Activation>,
    /// How often the audio thread of an offline render has asked the loader to do all that the parameters ask for.
    asked: AtomicU64,
    /// The latest of these questions that the loader has answered.
    answered: AtomicU64,
    /// The latest request was refused, and the instrument before it plays on.
    is_refused: AtomicBool,
    /// The loader's thread is to end, has ended or never began.
    stop: AtomicBool,
}

impl SharedInstrument {
    fn activation(&self) -> MutexGuard<'_, Activation> {
        self.activation.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Written pitch minus sounding pitch of the current instrument, semitones.
    pub fn transposition(&self) -> i8 {
        let activation = self.activation();
        activation.current.as_ref().map_or(BUILT_IN_TRANSPOSITION, |current| current.model.file.transposition)
    }

    /// Whether the latest request was refused, so that the instrument before it plays on.
    pub fn is_refused(&self) -> bool {
        self.is_refused.load(Ordering::Relaxed)
    }

    /// The current instrument; `None` before the first activation.
    pub fn current(&self) -> Option<CurrentInstrument> {
        self.activation().current.clone()
    }
}

/// An instrument on its way to the audio thread.
pub struct SwapCandidate {
    /// Number of the activation that it was built for.
    activation: u64,
    ensemble: Box<Ensemble>,
}
