//! The programs of Chalumeau: command line, plugin, editor (what the plugin's window shows), standalone.
//!
//! The instrument itself is in `chalumeau-core`, the knob in `chalumeau-knob`, figures in `chalumeau-figure`. Only this
//! package knows a host, a file system and a user.
//!
//! Four parts stand on small modules for files:
//! - `cli` and `editor` use neither each other nor the plugin. The editor knows no host, no thread and no knob link.
//! - `plugin` uses the editor, and puts it into the host's window.
//! - `standalone` uses the plugin, and runs it without a host. The plugin does not use the standalone.
//! - `tour` is what the listening pages of the command line and of the browser play.
//! - `cache`, `controllers`, `feel_flags`, `folder_listing`, `instrument_path`, `output`, `picture_file`, `presets`, `scale_file`, `take_file` and `wav` read and write files for them;
//!   `stderr` writes their messages, and `identity` has the names that hosts know the plugin by. They use none of the four.

#[macro_use]
mod stderr;

pub mod cache;
#[cfg(feature = "cli")]
pub mod cli;
pub mod controllers;
pub mod data_folder;
#[cfg(feature = "editor")]
pub mod editor;
pub mod feel_flags;
pub mod folder_listing;
pub mod identity;
pub mod instrument_path;
pub mod output;
pub mod parameters;
#[cfg(feature = "cli")]
pub mod picture_file;
#[cfg(feature = "plugin")]
pub mod plugin;
pub mod presets;
#[cfg(any(feature = "cli", feature = "plugin"))]
pub mod scale_file;
#[cfg(feature = "standalone")]
pub mod standalone;
#[cfg(feature = "devices")]
pub mod take_file;
pub mod text_file;
pub mod tour;
#[cfg(feature = "cli")]
pub mod wav;
