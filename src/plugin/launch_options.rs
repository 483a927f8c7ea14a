//! What the standalone program tells the plugin that it runs.
//!
//! The framework constructs the plugin by itself and passes nothing to it. These options are therefore the one global of
//! the plugin. The standalone sets them once, before it starts the framework, and tells of its connections while it plays. In a host
//! nobody sets them.

use std::sync::atomic::AtomicBool;
use std::sync::mpsc::Sender;
use std::sync::{Mutex, OnceLock, PoisonError};

use crate::editor::connections::{Connections, DeviceChoice};

use super::params::instrument::InstrumentChoice;

static LAUNCH_OPTIONS: OnceLock<LaunchOptions> = OnceLock::new();

/// What the window asks of the standalone program.
#[derive(Debug)]
pub enum DeviceTask {
    /// Look which devices there are.
    Look,
    /// Start again with these.
    Use(DeviceChoice),
}

/// Options of this process.
#[derive(Debug)]
pub struct LaunchOptions {
    /// Default of the parameter *Instrument*, and the path of the user's file, if the user has named an instrument.
    pub instrument: Option<(InstrumentChoice, String)>,
    /// Default of the parameter *A4*, Hz, if the user has given one.
    pub a4_hz: Option<f32>,
    /// The user has chosen a microphone, which the backend opens: it is on.
    pub microphone: AtomicBool,
    /// Whether the plugin has a window.
    pub has_window: bool,
    /// The user wants the program to end: the open window closes.
    pub quit: AtomicBool,
    /// The program starts again when it has ended.
    pub restart: AtomicBool,
    /// The plugin sets this when its window could not open.
    pub window_failed: AtomicBool,
    /// Where sound and MIDI go and come from, for the window.
    pub connections: Mutex<Connections>,
    /// Who does what the window asks for.
    pub device_tasks: Mutex<Option<Sender<DeviceTask>>>,
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

    /// Asks the program for something. In a host nobody does it.
    pub fn ask(task: DeviceTask) {
        let tasks =
            Self::get().map(|options| options.device_tasks.lock().unwrap_or_else(PoisonError::into_inner));
        if let Some(Some(tasks)) = tasks.as_deref() {
            // It ends with the program.
            let _ = tasks.send(task);
        }
    }

    /// The options of this process; `None` in a host.
    pub fn get() -> Option<&'static Self> {
        LAUNCH_OPTIONS.get()
    }
}
