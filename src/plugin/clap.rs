//! The plugin as a CLAP, beyond what the framework does.
//!
//! The framework's wrapper (nice-plug 0.4.2) is a whole CLAP. This layer stands between it and the host: the host gets a
//! `clap_plugin` of ours, whose data is the framework's, so that every function of the framework still works on it. Some
//! functions and extensions are replaced:
//!
//! | file | replaces or adds | why |
//! |---|---|---|
//! | `instance` | `init`, `activate`, `process`, `get_extension`, `on_main_thread` | sleep, tail, waking, `clap.gui` only where the host has it (the framework aborts otherwise) |
//! | `params` | `clap.params` | whole numbers, flags, texts, controls of the moment |
//! | `out_events` | the host's list of output events | whole numbers, in order of time |
//! | `state` | `clap.state`, `clap.state-context` | controls of the moment are no state |
//! | `audio_ports` | `clap.audio-ports` | the ids of ports from before the side-chain, and hosts that connect none |
//! | `note_ports` | `clap.note-ports` | the MPE dialect |
//! | `note_names` | `clap.note-name` | the written note of each key |
//! | `presets` | `clap.preset-discovery-factory`, `clap.preset-load` | the host's own browser lists and loads presets |
//! | `indication` | `clap.param-indication` | the window shows what the host has mapped and automated |
//!
//! [`ClapPlugin::remote_controls`](nice_plug::prelude::ClapPlugin) is the framework's; its pages are in `remote_pages`.
//! Everything here that handles pointers of the host is `unsafe`. Outside this folder few places are, and each says why:
//! `grep -rn allow.unsafe_code src` lists them.
#![allow(unsafe_code)] // pointers that the host hands in and takes; each use says why it is sound

mod audio_ports;
mod factory;
mod host;
mod indication;
mod instance;
mod note_names;
mod note_ports;
mod out_events;
mod params;
mod presets;
mod remote_pages;
mod state;
mod text;

use std::sync::{Arc, mpsc};

pub use remote_pages::define as define_remote_pages;

use crate::plugin::instrument_loading::SharedInstrument;
use crate::plugin::params::ChalumeauParams;

/// What this layer needs of a plugin instance.
pub struct Introduced {
    /// Its parameters, with the link to the host.
    pub params: Arc<ChalumeauParams>,
    /// What it plays.
    pub instrument: Arc<SharedInstrument>,
}

/// Asks a plugin instance to introduce itself. The framework owns the instance and gives nobody a reference to it, but it
/// does hand tasks on.
pub struct Introduction(pub mpsc::Sender<Introduced>);
