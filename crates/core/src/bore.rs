//! The bore: its measurements as data, its impedance in the frequency domain, its lattice in the time domain.

pub mod alternate_fingerings;
pub mod bundled;
pub mod cells;
pub mod check;
pub mod cylinder;
pub mod fit;
pub mod instrument_file;
pub mod lattice;
pub mod tone_hole;
pub mod transfer_matrix;
pub mod wall_loss;
