//! What the framework logs goes to standard error, and its last error is kept to be explained.

use std::fmt::Write;
use std::sync::{Arc, Mutex, PoisonError};

use tracing::field::{Field, Visit};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::layer::{Context, Layer, SubscriberExt};

/// How the framework (nice-plug 0.4.2) begins to say that a backend does not open.
const UNOPENED: &str = "Could not initialize the ";

/// How it says that it plays without a window.
const RUNNING: &str = "No GUI available";

/// The last error, if there was one.
#[derive(Clone, Debug, Default)]
pub struct Heard(Arc<Mutex<Option<String>>>);

impl Heard {
    /// Begins anew.
    pub fn forget(&self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    fn keep(&self, text: &str) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(text.to_owned());
    }

    /// The last error since.
    pub fn last_error(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Listens for the rest of the program. The first to listen hears all.
pub fn listen() -> Heard {
    let heard = Heard::default();
    let subscriber = tracing_subscriber::registry().with(Listener(heard.clone()));
    // Somebody who listens already has printed what there is to print.
    let _ = tracing::subscriber::set_global_default(subscriber);
    heard
}

struct Listener(Heard);

impl<S: Subscriber> Layer<S> for Listener {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let level = *event.metadata().level();
        // Below that it is the libraries' own talk.
        if level > Level::INFO {
            return;
        }
        let mut message = Message(String::new());
        event.record(&mut message);
        let Message(text) = message;
        // What does not open is explained by whoever tried it; all else is said when it happens.
        match text.split_once(UNOPENED).and_then(|(_, rest)| rest.split_once(": ")) {
            Some((_, reason)) => self.0.keep(reason),
            None if text.starts_with(RUNNING) => eprintln!("playing; Ctrl-C ends it"),
            None => {
                eprintln!("{text}");
                if level == Level::ERROR {
                    self.0.keep(&text);
                }
            }
        }
    }
}

struct Message(String);

impl Visit for Message {
    fn record_debug(&mut self, field: &Field, value: &dyn std::fmt::Debug) {
        if field.name() == "message" {
            // A String takes everything.
            let _ = write!(self.0, "{value:?}");
        }
    }
}
