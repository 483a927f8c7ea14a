//! The checks of clap-validator 0.4.1 that a host of ours can make. Each test has the name of the check, with underscores.
//!
//! Eight checks of its list have nothing to check here, and it skips them: the plugin has no presets to discover
//! (preset-discovery-crawl, -descriptor-consistency, -load), no 64-bit ports (process-audio-double-out-of-place, -in-place),
//! no audio input that could be denormal (process-audio-denormals), and its one port is fixed
//! (layout-audio-ports-activation, layout-configurable-audio-ports). If it grows one of these, `what_is_skipped` fails.

#[path = "clap_checks/bench.rs"]
mod bench;
#[path = "clap_checks/keyboard.rs"]
mod keyboard;
#[path = "clap_checks/library.rs"]
mod library;
#[path = "clap_checks/params.rs"]
mod params;
#[path = "clap_checks/process.rs"]
mod process;
#[path = "clap_checks/state.rs"]
mod state;
