//! The bore: its measurements as data, its impedance in the frequency domain, its lattice in the time domain.

pub mod instrument_file;
pub mod transfer_matrix;
