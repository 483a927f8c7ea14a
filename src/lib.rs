//! Chalumeau: a clarinet you play by touch.

pub mod analysis;
pub mod control;
pub mod event;
pub mod instrument;
pub mod reed;
pub mod units;
