//! An instrument file made ready to play at one internal rate: cells, coefficients, tuning.

use std::sync::Arc;

use crate::bore::bundled::Bundled;
use crate::bore::cells::Cells;
use crate::bore::cells::CellsError;
use crate::bore::fit;
use crate::bore::instrument_file::InstrumentFile;
use crate::bore::lattice::LatticeCoeffs;
use crate::instrument::prepare::{self, Wanted};
use crate::instrument::tuning::TuningTable;
use crate::reed::PhysicalReed;
use crate::reed::physical::{P_REF_PA, REFERENCE_VOLUME_M3};
use crate::units::{Air, SoundingNote};

/// Lowest and highest host rate, Hz.
pub const HOST_RATES_HZ: (f64, f64) = (22_050.0, 384_000.0);

/// Pitch of A4 that instruments are made for unless another is asked for, Hz.
pub const A4_HZ: f64 = 440.0;

/// An instrument at one internal rate. Immutable; share it.
#[derive(Clone, Debug)]
pub struct Model {
    /// The measurements, after scaling.
    pub file: InstrumentFile,
    /// The bore as cells.
    pub cells: Cells,
    /// The lattice's coefficients.
    pub coeffs: Arc<LatticeCoeffs>,
    /// Delay trims per note, right at [`a4_hz`](Self::a4_hz).
    pub tuning: TuningTable,
    /// Pitch of A4 that it is tuned to, Hz.
    pub a4_hz: f64,
    /// How much longer the bore is than its file says, because the delay alone could not tune it; mostly 1.
    pub scale: f64,
    /// Air the coefficients were made for.
    pub air: Air,
    /// Equal-tempered frequency of the lowest note at [`a4_hz`](Self::a4_hz), Hz.
    pub lowest_hz: f64,
    /// Sounding frequency of each fingering of the file at [`a4_hz`](Self::a4_hz).
    pub notes_hz: Vec<f64>,
    /// Register of each fingering: 1 chalumeau and throat, 2 clarion, 3 altissimo.
    pub registers: Vec<u8>,
    /// Volume that the instrument's reed displaces, over the nominal bore's section and the speed of sound, s.
    pub swept_s: f64,
}

/// Why an instrument cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// Host rate out of range.
    #[error("sample rate must lie in 22050..384000 Hz, got {0}")]
    Rate(f64),
    /// Reference pitch out of range.
    #[error("A4 must lie in 415..466 Hz, got {0}")]
    A4(f64),
    /// Whoever waited for it does not want it any more.
    #[error("cancelled")]
    Cancelled,
    /// The bore does not fit the lattice.
    #[error(transparent)]
    Cells(#[from] CellsError),
    /// A generated file of the repository is damaged.
    #[error(
        "generated data of the built-in instrument: {0}; run `cargo xtask fit-bore` and `cargo xtask tune`"
    )]
    Data(String),
}

/// The lattice's rate for a host rate: 88.2 kHz for the 44.1 kHz family, 96 kHz for all others.
pub fn internal_rate_hz(host_rate_hz: f64) -> f64 {
    let family = |base: f64| {
        let ratio = host_rate_hz / base;
        (ratio - ratio.round()).abs() < 1e-9
    };
    if family(11_025.0) && !family(12_000.0) { 88_200.0 } else { 96_000.0 }
}

/// The two rates that tables exist for, Hz.
pub const INTERNAL_RATES_HZ: [f64; 2] = [96_000.0, 88_200.0];

impl Model {
    /// The built-in B flat clarinet, cells and tuning from the repository's generated data. Allocates.
    pub fn built_in(host_rate_hz: f64) -> Result<Self, BuildError> {
        prepare::ready(&Wanted::new(Bundled::BFlat.file(), host_rate_hz), None)?
            .ok_or_else(|| BuildError::Data(format!("nothing for {host_rate_hz} Hz")))
    }

    /// From parts; `file` already scaled by `scale`, to be played at `a4_hz`.
    pub fn assemble(file: InstrumentFile, cells: Cells, tuning: TuningTable, a4_hz: f64, scale: f64) -> Self {
        let air = Air::default();
        let coeffs =
            Arc::new(LatticeCoeffs::new(&cells, &fit::networks(&file, &air, &cells), P_REF_PA, &air));
        let notes_hz = file
            .fingerings
            .iter()
            .map(|fingering| fingering.written.sounding(file.transposition).unwrap_or(SoundingNote(0)))
            .map(|note| note.frequency_hz(a4_hz))
            .collect();
        let registers = file
            .fingerings
            .iter()
            .map(|fingering| match fingering.register.as_str() {
                "clarion" => 2,
                "altissimo" => 3,
                _ => 1,
            })
            .collect();
        let section = std::f64::consts::PI * file.nominal_radius_m * file.nominal_radius_m;
        // The instrument's own reed, by the ratio to the reference: exactly that of the reference on a B flat clarinet.
        let larger = file.reed_volume_m3 / REFERENCE_VOLUME_M3;
        let swept_s = PhysicalReed::reference().equivalent_volume_m3(&air) / (section * air.c) * larger;
        Self {
            lowest_hz: fit::lowest_hz(&file) * a4_hz / A4_HZ,
            notes_hz,
            registers,
            swept_s,
            coeffs,
            cells,
            tuning,
            a4_hz,
            scale,
            air,
            file,
        }
    }

    /// Index of the fingering for a sounding pitch.
    pub fn fingering_for(&self, note: SoundingNote) -> Option<usize> {
        let written = note.written(self.file.transposition)?;
        self.file.fingerings.iter().position(|fingering| fingering.written == written)
    }

    /// Rows of delay that move a note by `cents`, counted from the note's own quarter-wave length.
    pub fn rows_for_cents(&self, fingering: usize, cents: f64) -> f64 {
        let quarter_waves = f64::from(2 * self.registers[fingering] - 1);
        let quarter_rows = quarter_waves * self.coeffs.rate_hz / (4.0 * self.notes_hz[fingering]);
        2.0 * quarter_rows * ((-cents / 1_200.0).exp2() - 1.0)
    }
}

/// The lattice's rate for a host rate, see [`internal_rate_hz`], if there is one.
pub fn checked_rate_hz(host_rate_hz: f64) -> Result<f64, BuildError> {
    if (HOST_RATES_HZ.0..=HOST_RATES_HZ.1).contains(&host_rate_hz) {
        Ok(internal_rate_hz(host_rate_hz))
    } else {
        Err(BuildError::Rate(host_rate_hz))
    }
}
