//! The single reed: one set of tables, the law that reads them, the reed that moves, the reed on the bench.
//!
//! The tables are the ones the knob's firmware reads; sound, torque and the exported header all go through
//! [`ReedTables`]. Pressures are relative to a reference closing pressure, so that the tables' 0..=1 spans rest to
//! closure of the reference reed.

pub mod header;
pub mod law;
pub mod motion;
pub mod physical;
pub mod quasi_static;
pub mod tables;

pub use law::ReedLaw;
pub use motion::{ReedCoeffs, ReedState};
pub use physical::PhysicalReed;
pub use quasi_static::{QuasiStaticReed, QuasiStaticState};
pub use tables::ReedTables;
