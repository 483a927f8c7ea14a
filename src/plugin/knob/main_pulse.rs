//! Whether the host's main thread lives, on which the user presses buttons: the controller asks it ten times a second to
//! answer, and each answer is a beat of its heart.
//!
//! A host that never lets the main thread answer is not waited for: only a thread that has answered once can fall silent. On Linux
//! the framework of a VST3 answers on a thread of its own where the window is closed or the host has no run loop: that says
//! nothing of the main thread, and does not count.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::ThreadId;
use std::time::{Duration, Instant};

use chalumeau_knob::device::{Heartbeat, KnobLink};

/// Time between two questions.
const EVERY: Duration = Duration::from_millis(100);

/// What main thread and controller share.
#[derive(Debug, Default)]
pub struct MainPulse {
    is_asked: AtomicBool,
    has_answered: AtomicBool,
    heart: Mutex<Option<Heartbeat>>,
    /// The thread on which the host creates the plugin.
    main: OnceLock<ThreadId>,
}

impl MainPulse {
    /// The host's main thread is this one. [main thread]
    pub fn begin_here(&self) {
        let _ = self.main.set(std::thread::current().id());
    }

    /// Somebody answers for the main thread; it counts if it is the main thread. If it is not, nobody can tell whether that lives,
    /// as after a window was closed, and the link waits for it no longer.
    pub fn answer(&self) {
        self.is_asked.store(false, Ordering::Relaxed);
        let is_main = self.main.get() == Some(&std::thread::current().id());
        self.has_answered.store(is_main, Ordering::Relaxed);
        let mut heart = self.heart();
        if !is_main {
            *heart = None;
        } else if let Some(heart) = &*heart {
            heart.beat();
        }
    }

    fn heart(&self) -> MutexGuard<'_, Option<Heartbeat>> {
        self.heart.lock().unwrap_or_else(PoisonError::into_inner)
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
            pulse.heart().get_or_insert_with(|| link.heartbeat("the host's main thread"));
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[test]
    fn only_the_main_thread_answers_for_itself() {
        let pulse = Arc::new(MainPulse::default());
        pulse.answer();
        assert!(!pulse.has_answered.load(Ordering::Relaxed), "nobody knows the main thread yet");
        pulse.begin_here();
        let other = pulse.clone();
        pulse.is_asked.store(true, Ordering::Relaxed);
        std::thread::spawn(move || other.answer()).join().unwrap();
        assert!(!pulse.has_answered.load(Ordering::Relaxed), "a worker of the framework");
        assert!(!pulse.is_asked.load(Ordering::Relaxed), "it may be asked again");
        pulse.answer();
        assert!(pulse.has_answered.load(Ordering::Relaxed));
    }

    #[test]
    fn a_main_thread_that_answers_no_longer_by_itself_is_not_waited_for() {
        let (link, _reader) = KnobLink::spawn("test", chalumeau_knob::device::Hooks::default());
        let (pulse, mut asker) = (Arc::new(MainPulse::default()), MainPulseAsker::new(None));
        pulse.begin_here();
        pulse.answer();
        asker.cycle(&pulse, &link);
        assert!(pulse.heart().is_some());
        // The window is closed: the framework's worker answers.
        let other = pulse.clone();
        std::thread::spawn(move || other.answer()).join().unwrap();
        asker.cycle(&pulse, &link);
        assert!(pulse.heart().is_none());
        pulse.answer();
        asker.cycle(&pulse, &link);
        assert!(pulse.heart().is_some(), "the window is open again");
    }
}
