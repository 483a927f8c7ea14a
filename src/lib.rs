//! Chalumeau: a clarinet you play by touch.

pub mod analysis;
pub mod bore;
#[cfg(feature = "cli")]
pub mod cli;
pub mod control;
#[cfg(feature = "devices")]
pub mod device;
pub mod dsp;
pub mod event;
pub mod figure;
pub mod haptics;
pub mod identity;
pub mod instrument;
pub mod output;
#[cfg(feature = "plugin")]
pub mod plugin;
pub mod reed;
#[cfg(feature = "cli")]
pub mod render;
#[cfg(feature = "simulator")]
pub mod simulator;
pub mod touch;
pub mod units;
pub mod wire;
