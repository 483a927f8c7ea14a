//! Haptics: how hard each note is to blow, and what a force-feedback knob does so that the hand feels it.
//!
//! 1. A [`RequirementSolver`] analyses the bore of an instrument once. With a [`PlayedReed`] it gives the mouth pressures of
//!    each note ([`NoteRequirement`]).
//! 2. A [`FeelDesign`] holds the choices of the user: torque law, strength, travel, Contrast, Place.
//! 3. A [`FeelTable`] joins the two. For each note ([`NoteFeel`]) it holds the parameters for the knob ([`Feel`]), the angles
//!    at which the note starts, beats, closes and stops ([`Landmarks`]), and the map from angle to mouth pressure
//!    ([`AngleMap`]). A feel that a knob would refuse is an error ([`FeelRefused`]).
//! 4. [`torque_law`] computes the torque of a [`Feel`] at any angle, as the firmware does.
//!
//! Angles are in degrees from rest, torques in mNm, pressures in Pa; `gamma` is mouth pressure over closing pressure.
//! [`AngleMap`] and [`torque_law`] are safe on an audio thread; the rest allocates. Model, formulas and figures:
//! `docs/feel.md`.
//!
//! ```
//! use chalumeau_core::bore::instrument_file::InstrumentFile;
//! use chalumeau_core::haptics::{FeelDesign, FeelTable, PlayedReed, RequirementSolver, TorqueLimits};
//! use chalumeau_core::units::Air;
//!
//! // About one second: the bore of the built-in clarinet.
//! let bore = RequirementSolver::new(&InstrumentFile::built_in(), Air::default(), 440.0)?;
//! // Milliseconds: any reed and any design.
//! let reed = PlayedReed::quasi_static(0.3)?;
//! let design = FeelDesign { contrast: 2.0, ..FeelDesign::default() };
//! let table = FeelTable::new(&bore, &design, &reed, &TorqueLimits::default())?;
//!
//! for note in table.notes() {
//!     println!("{}: starts at {:.0} degrees", note.written, note.landmarks.a_on_deg);
//! }
//! // The reference note, written C5, closes after one turn. A third of a turn gives its onset pressure.
//! let c5 = table.reference();
//! let onset_pa = c5.requirement.map(|required| required.p_req_pa);
//! assert!((c5.map.pressure_pa(120.0) - onset_pa.unwrap_or_default()).abs() < 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod admittance;
mod angle_map;
mod extinction;
mod feel_design;
pub mod feel_parameters;
mod feel_refused;
mod feel_table;
mod onset;
mod played_reed;
mod requirement;
pub mod torque_law;
mod torque_limits;

pub use angle_map::AngleMap;
pub use feel_design::{FeelDesign, NoteOrder};
pub use feel_parameters::{Feel, FieldRange, OutOfRange, TorqueLaw};
pub use feel_refused::FeelRefused;
pub use feel_table::{FeelTable, Landmarks, NoteFeel};
pub use played_reed::PlayedReed;
pub use requirement::{NoteRequirement, RequirementError, RequirementSolver};
pub use torque_limits::TorqueLimits;
