//! What a knob should feel: how hard a note is to blow, and what that means in degrees and millinewton metres.
//!
//! [`Requirements`] asks the bore once what each fingering needs; with a [`PlayedReed`] that becomes pressures
//! ([`Requirement`]), with a [`FeelDesign`] the messages for the knob and the map back from its angle to mouth pressure
//! ([`FeelTable`]). Model, formulas and figures: `docs/feel.md`. Nothing here runs on the audio thread but
//! [`AngleMap`], which is a handful of numbers.

mod extinction;
mod feel;
pub mod law;
mod map;
mod onset;
pub mod parameters;
mod requirement;
mod torque_limits;

pub use feel::{FeelDesign, FeelRefused, FeelTable, Landmarks, NoteFeel, Order};
pub use map::AngleMap;
pub use parameters::{Feel, FieldRange, Law, OutOfRange};
pub use requirement::{Lip, PlayedReed, Requirement, Requirements};
pub use torque_limits::TorqueLimits;
