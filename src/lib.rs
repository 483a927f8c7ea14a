//! The programs of Chalumeau: command line, plugin, its window, and the standalone. The instrument itself is in
//! `chalumeau-core`.

pub mod cache;
#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "editor")]
pub mod editor;
pub mod identity;
pub mod instrument_path;
pub mod output;
pub mod parameters;
#[cfg(feature = "cli")]
pub mod picture_file;
#[cfg(feature = "plugin")]
pub mod plugin;
pub mod take_file;
#[cfg(feature = "cli")]
pub mod wav;
