//! The single reed: its flow tables, its flow law, its motion, and its physical measurements.
//!
//! Sound, torque of the knob and firmware read the same tables ([`ReedTables`]). Pressures are relative to a reference
//! closing pressure: in the tables 0 is rest and 1 is closure of the reference reed.
//!
//! ```
//! use chalumeau_core::reed::{ReedLaw, ReedTables};
//!
//! let (law, tables) = (ReedLaw::default(), ReedTables::reference());
//! // The flow rises to its peak at a third of the closing pressure and is 0 from closure on.
//! assert!((law.flow(tables, 1.0 / 3.0) - 1.0).abs() < 1e-3);
//! assert_eq!(law.flow(tables, 1.2), 0.0);
//! // Suction opens the reed instead: the air flows back.
//! assert!(law.flow(tables, -0.5) < 0.0);
//! ```

pub mod firmware_header;
pub mod law;
pub mod lay;
mod lip;
pub mod motion;
pub mod physical;
pub mod quasi_static;
pub mod strength;
pub mod tables;

pub use law::ReedLaw;
pub use lip::Lip;
pub use motion::{MovingReed, ReedCoeffs, ReedLoad, ReedState};
pub use physical::PhysicalReed;
pub use quasi_static::{QuasiStaticReed, QuasiStaticState};
pub use tables::ReedTables;
