#![doc = include_str!("../README.md")]
//!
//! # Modules
//!
//! | module | what it holds |
//! |---|---|
//! | [`units`] | the air, written and sounding notes, cents |
//! | [`event`] | what a player does: notes, breath, bend, tongue |
//! | [`instrument`] | the playable [`Clarinet`](instrument::Clarinet), its [`Settings`](instrument::Settings), and the [`Model`](instrument::Model) of any instrument file |
//! | [`reed`] | the law of the reed, its tables, and the moving reed |
//! | [`bore`] | instrument files, transfer matrices, and the waveguide lattice fitted to them |
//! | [`dsp`] | resampler and limiter |
//! | [`control`] | from MIDI and wind at a microphone to events |
//! | [`score`] | what to play: notes, scales, breath curves, MIDI files; offline rendering |
//! | [`measure`] | measurements of played notes: pitch and level, bifurcation diagram, one period of the reed |
//! | [`analysis`] | methods for samples: pitch, spectrum, onset, impedance |
//! | [`haptics`] | the pressure that each note requires, and the torque with which a knob lets a hand feel it |
//! | [`maths`] | functions with the same bits on every system |
//! | [`parallel`] | work on independent items, on all cores with the feature `threads` |
//!
//! # Units and conventions
//!
//! - SI units, unless a name ends in another: `_hz`, `_pa`, `_kpa`, `_m`, `_mm`, `_deg`, `_mnm`, `_cents`.
//! - *Sounding* and *written* pitch are different types, [`SoundingNote`](units::SoundingNote) and
//!   [`WrittenNote`](units::WrittenNote). Events, MIDI and hosts use sounding notes; fingering charts use written ones. A B flat
//!   clarinet sounds two semitones below what is written.
//! - `gamma` is mouth pressure over the closing pressure of the reed; `zeta` is the dimensionless embouchure parameter. H, k and
//!   A are the rest opening, stiffness and amplitude of the reed.
//! - Breath, velocity and controllers run from 0 to 1, full scale of the samples is 1.0.
//!
//! # Design, Coeffs, State
//!
//! Each part of the sound comes in three layers. The *design* is what a person chooses: an instrument file, the
//! [`Settings`](instrument::Settings), a [`FeelDesign`](haptics::FeelDesign). From it follow the *coefficients*, once and with
//! time to allocate: [`LatticeCoeffs`](bore::lattice::LatticeCoeffs), [`ReedCoeffs`](reed::ReedCoeffs), all those of one
//! instrument in a [`Model`](instrument::Model). They are immutable and shared. The *state* changes with every sample:
//! [`Lattice`](bore::lattice::Lattice), [`Voice`](instrument::Voice), [`Clarinet`](instrument::Clarinet). It never allocates
//! while it plays.

// The exceptions, each with its proof, are the calls of AVX2 code in `bore::lattice`, its `choir` and `dsp::resampler`.
#![deny(unsafe_code)]
#![warn(missing_docs)]
// `maths` says why. Tests may call the standard library's.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

pub mod analysis;
pub mod bore;
pub mod control;
pub mod dsp;
pub mod event;
pub mod haptics;
pub mod instrument;
pub mod maths;
pub mod measure;
pub mod parallel;
pub mod reed;
pub mod score;
pub mod units;
