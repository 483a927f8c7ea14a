//! Hosts for the tests of the plugin, the standalone and the knob, and for `cargo xtask demo`.
//!
//! Nothing here builds anything: `cargo xtask` builds, and [`artefacts`] says where the results are. See README.md for
//! the list of tests and how to run one.

#[cfg(target_os = "linux")]
pub mod ardour;
pub mod artefacts;
pub mod clap;
#[cfg(target_os = "linux")]
pub mod display;
#[cfg(windows)]
pub mod frame;
pub mod jack;
pub mod knob_setup;
pub mod machine;
pub mod midi;
#[cfg(target_os = "linux")]
pub mod screen;
pub mod simulator;
