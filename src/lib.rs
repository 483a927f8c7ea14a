//! Chalumeau: a clarinet you play by touch.

pub mod analysis;
pub mod bore;
#[cfg(feature = "cli")]
pub mod cli;
pub mod control;
pub mod dsp;
pub mod event;
pub mod identity;
pub mod instrument;
#[cfg(feature = "plugin")]
pub mod plugin;
pub mod reed;
#[cfg(feature = "cli")]
pub mod render;
pub mod units;
