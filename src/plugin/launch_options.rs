//! What the standalone program tells the plugin that it runs.
//!
//! The framework constructs the plugin by itself and passes nothing to it. These options are therefore the one global of
//! the plugin. The standalone sets them once, before it starts the framework, and tells of its connections while it plays. In a host
//! nobody sets them.

use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, OnceLock, PoisonError};

use crate::editor::snapshot::Connections;

use super::params::instrument::InstrumentChoice;

static LAUNCH_OPTIONS: OnceLock<LaunchOptions> = OnceLock::new();

/// Options of this process.
#[derive(Debug)]
pub struct LaunchOptions {
    /// Default of the parameter *Instrument*, and the path of the user's file, if the user has named an instrument.
    pub instrument: Option<(InstrumentChoice, String)>,
    /// Default of the parameter *A4*, Hz, if the user has given one.
    pub a4_hz: Option<f32>,
    /// The user has named a microphone: it is on.
    pub microphone: bool,
    /// Whether the plugin has a window.
    pub has_window: bool,
    /// The user wants the program to end: the open window closes.
    pub quit: AtomicBool,
    /// The plugin sets this when its window could not open.
    pub window_failed: AtomicBool,
    /// Where sound and MIDI go and come from, for the window.
    pub connections: Mutex<Connections>,
}

impl LaunchOptions {
    /// Sets the options of this process and returns them. Only the first call has an effect.
    pub fn set(self) -> &'static Self {
        LAUNCH_OPTIONS.get_or_init(|| self)
    }

    /// Whether they change what a new instance plays.
    pub fn has_changes(&self) -> bool {
        self.instrument.is_some() || self.a4_hz.is_some()
    }

    /// Tells the window of a change of the connections.
    pub fn connect(change: impl FnOnce(&mut Connections)) {
        if let Some(options) = Self::get() {
            change(&mut options.connections.lock().unwrap_or_else(PoisonError::into_inner));
        }
    }

    /// Where sound and MIDI go and come from; `None` in a host.
    pub fn connections() -> Option<Connections> {
        Self::get().map(|options| options.connections.lock().unwrap_or_else(PoisonError::into_inner).clone())
    }

    /// The options of this process; `None` in a host.
    pub fn get() -> Option<&'static Self> {
        LAUNCH_OPTIONS.get()
    }
}
