//! Prints the framework's log to standard error, and keeps its last error.

use std::fmt::Write;
use std::sync::{Arc, Mutex, PoisonError};

use tracing::field::{Field, Visit};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::layer::{Context, Layer, SubscriberExt};

/// How the framework (nice-plug 0.4.2) begins its message that a backend does not open.
const BACKEND_FAILED: &str = "Could not initialize the ";

/// How it begins its message that it plays without a window.
const NO_WINDOW: &str = "No GUI available";

/// How it begins its message that it cannot catch Ctrl-C, which [`quit`](super::quit) does.
const SIGNALS_TAKEN: &str = "Error setting close signal callback";

/// How it begins its advice to name a MIDI port. The program opens inputs by itself.
const MIDI_ADVICE: &str = "Use the '--midi-";

/// The last error in the log, if there was one.
#[derive(Clone, Debug, Default)]
pub struct LastError(Arc<Mutex<Option<String>>>);

impl LastError {
    /// Forgets the error.
    pub fn clear(&self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    fn set(&self, text: &str) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(text.to_owned());
    }

    /// The last error since [`clear`](Self::clear).
    pub fn get(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Starts to print and keep the log, for the rest of the process.
pub fn start() -> LastError {
    let last_error = LastError::default();
    let subscriber = tracing_subscriber::registry().with(LogLayer(last_error.clone()));
    // This fails only if there is a subscriber already, which then prints the log.
    let _ = tracing::subscriber::set_global_default(subscriber);
    last_error
}

struct LogLayer(LastError);

impl<S: Subscriber> Layer<S> for LogLayer {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let level = *event.metadata().level();
        // Debug and trace messages come from the libraries.
        if level > Level::INFO {
            return;
        }
        let mut message = LoggedText(String::new());
        event.record(&mut message);
        let LoggedText(text) = message;
        // The caller explains a backend that does not open. Everything else is printed at once.
        match text.split_once(BACKEND_FAILED).and_then(|(_, rest)| rest.split_once(": ")) {
            Some((_, reason)) => self.0.set(reason),
            None if text.starts_with(NO_WINDOW) => tell!("playing; press Ctrl-C to quit"),
            None if [SIGNALS_TAKEN, MIDI_ADVICE].iter().any(|begin| text.starts_with(begin)) => {}
            None => {
                tell!("{text}");
                if level == Level::ERROR {
                    self.0.set(&text);
                }
            }
        }
    }
}

struct LoggedText(String);

impl Visit for LoggedText {
    fn record_debug(&mut self, field: &Field, value: &dyn std::fmt::Debug) {
        if field.name() == "message" {
            // Writing into a String cannot fail.
            let _ = write!(self.0, "{value:?}");
        }
    }
}
