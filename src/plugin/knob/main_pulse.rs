//! Whether the host's main thread lives, on which the user presses buttons: the controller asks it ten times a second to
//! answer, and each answer is a beat of its heart.
//!
//! A host that never lets the main thread answer is not waited for: only a thread that has answered once can fall silent.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use chalumeau_knob::device::{Heartbeat, KnobLink};

/// Time between two questions.
const EVERY: Duration = Duration::from_millis(100);

/// What main thread and controller share.
#[derive(Debug, Default)]
pub struct MainPulse {
    is_asked: AtomicBool,
    has_answered: AtomicBool,
    heart: OnceLock<Heartbeat>,
}

impl MainPulse {
    /// The main thread is here. [main thread]
    pub fn answer(&self) {
        self.is_asked.store(false, Ordering::Relaxed);
        self.has_answered.store(true, Ordering::Relaxed);
        if let Some(heart) = self.heart.get() {
            heart.beat();
        }
    }
}

/// The controller's side.
pub struct MainPulseAsker {
    /// Makes the main thread call [`MainPulse::answer`]; `None` where nothing can.
    ask: Option<Box<dyn Fn() + Send>>,
    asked: Instant,
}

impl MainPulseAsker {
    /// Asks by this function.
    pub fn new(ask: Option<Box<dyn Fn() + Send>>) -> Self {
        Self { ask, asked: Instant::now() }
    }

    /// Asks when it is time, one question after the other.
    pub fn cycle(&mut self, pulse: &MainPulse, link: &KnobLink) {
        if pulse.has_answered.load(Ordering::Relaxed) {
            pulse.heart.get_or_init(|| link.heartbeat("the host's main thread"));
        }
        if self.asked.elapsed() >= EVERY
            && let Some(ask) = &self.ask
            && !pulse.is_asked.swap(true, Ordering::Relaxed)
        {
            self.asked = Instant::now();
            ask();
        }
    }
}
