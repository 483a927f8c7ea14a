//! Chalumeau's physics: a clarinet in numbers, without a host, files, threads or clock.

pub mod analysis;
pub mod bore;
pub mod control;
pub mod dsp;
pub mod event;
pub mod haptics;
pub mod instrument;
pub mod parallel;
pub mod reed;
pub mod score;
pub mod units;
