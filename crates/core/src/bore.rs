//! The bore: its measurements as data, its impedance in the frequency domain, its lattice in the time domain.
//!
//! An [`InstrumentFile`](instrument_file::InstrumentFile) holds the measurements. A
//! [`TransferMatrix`](transfer_matrix::TransferMatrix) computes the input impedance from them. [`fit`] cuts the bore into
//! [`Cells`](cells::Cells) for the [`Lattice`](lattice::Lattice), which plays.
//!
//! ```
//! use chalumeau_core::bore::{instrument_file::InstrumentFile, transfer_matrix::TransferMatrix};
//! use chalumeau_core::units::{Air, WrittenNote};
//!
//! let clarinet = InstrumentFile::built_in();
//! let matrix = TransferMatrix::new(&clarinet, Air::default());
//! let low_e = clarinet.fingering(WrittenNote(52)).unwrap();
//! let peak = matrix.peaks(&low_e.open, clarinet.reed_volume_m3, 1)[0];
//! // Written E3 sounds D3, 146.8 Hz; the first impedance peak lies close to it.
//! assert!((peak.f_hz - 146.8).abs() < 2.0, "{peak:?}");
//! ```

pub mod alterations;
pub mod alternate_fingerings;
mod bessel;
pub mod bundled;
pub mod cells;
pub mod check;
pub mod context_fingerings;
pub mod cylinder;
pub mod fingering_finder;
#[cfg(feature = "fit")]
pub mod fit;
pub mod instrument_file;
pub mod lattice;
mod low_c;
pub mod moved_hole;
pub mod pulled_joint;
pub mod radiation;
pub mod sound_sources;
pub mod tone_hole;
pub mod transfer_matrix;
pub mod wall_loss;

/// Embouchure parameter zeta of the thresholds by which fingerings are judged: the reference reed's, of which the bore knows
/// nothing else.
pub(crate) const ZETA: f64 = 0.3;
