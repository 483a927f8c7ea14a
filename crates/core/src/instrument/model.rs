//! An instrument that is ready to play at one internal rate: cells, coefficients, tuning.
//!
//! [`prepare`](super::prepare) makes models from instrument files.

use std::sync::Arc;

use crate::bore::cells::Cells;
use crate::bore::cells::CellsError;
use crate::bore::cells::networks;
use crate::bore::context_fingerings::ContextFingerings;
use crate::bore::instrument_file::{Fingering, InstrumentError, InstrumentFile};
use crate::bore::lattice::LatticeCoeffs;
use crate::instrument::concert_pitch::A4_HZ;
use crate::instrument::concert_pitch::A4_RANGE_HZ;
use crate::instrument::key_pitches::KeyPitches;
use crate::instrument::player::dynamics::PlayerModel;
use crate::instrument::tuning_table::TuningTable;
use crate::maths;
use crate::reed::PhysicalReed;
use crate::reed::physical::{P_REF_PA, REFERENCE_VOLUME_M3};
use crate::units::{Air, SoundingNote};

/// Up to this rate of the lattice, Hz, single precision is enough. The noise that rounding leaves between the harmonics
/// grows with the rate over the note: at twice the live rate a bass clarinet had -78 dB; with double precision it has
/// -126 dB and less (`docs/findings.md`).
const SINGLE_BELOW_HZ: f64 = 100_000.0;

/// Largest error of a note that is played, cents. A note further off that the delay cannot mend also leaves its register
/// at most pressures: with the maker's fingering, written A#6 of the built-in clarinets is 14 to 40 cents flat and speaks at one
/// pressure of five.
pub const IN_TUNE_CENTS: f64 = 10.0;

/// An instrument at one internal rate. It does not change: share it in an [`Arc`].
///
/// ```
/// use chalumeau_core::instrument::Model;
/// use chalumeau_core::units::SoundingNote;
///
/// let model = Model::built_in(48_000.0)?;
/// // Sounding D3 is the lowest note of the B flat clarinet, written E3.
/// assert_eq!(model.fingering_for(SoundingNote(50)), Some(0));
/// assert!((model.notes_hz[0] - 146.83).abs() < 0.01);
/// # Ok::<(), chalumeau_core::instrument::BuildError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Model {
    /// The measurements, after scaling.
    pub file: InstrumentFile,
    /// The bore as cells.
    pub cells: Cells,
    /// The lattice's coefficients.
    pub coeffs: Arc<LatticeCoeffs>,
    /// Delay trims of each note, for [`a4_hz`](Self::a4_hz).
    pub tuning: TuningTable,
    /// What lip and breath do at a dynamic.
    pub player: PlayerModel,
    /// What each key plays. Equal temperament unless it is set.
    pub keys: KeyPitches,
    /// Pitch of A4 that the instrument is tuned to, Hz.
    pub a4_hz: f64,
    /// Length of the bore over that of its file. Other than 1 for another A4, or where the delay alone could not tune the
    /// instrument.
    pub scale: f64,
    /// Air that the coefficients hold for.
    pub air: Air,
    /// Equal-tempered frequency of the [lowest note without an extension](InstrumentFile::lowest_unextended) at
    /// [`a4_hz`](Self::a4_hz), Hz: how large the instrument is.
    pub size_hz: f64,
    /// Sounding frequency of each fingering of the file at [`a4_hz`](Self::a4_hz), Hz.
    pub notes_hz: Vec<f64>,
    /// Register of each fingering: 1 chalumeau and throat, 2 clarion, 3 altissimo.
    pub registers: Vec<u8>,
    /// How fast the susceptance of the bore, over that of the nominal bore, rises at each fingering's note with the logarithm of the frequency.
    pub susceptance_slopes: Vec<f64>,
    /// Alternate fingerings, and when a player takes them.
    pub alternates: ContextFingerings,
    /// Volume that the instrument's reed displaces, over the cross-section of the nominal bore and the speed of sound, s.
    pub swept_s: f64,
}

/// Why an instrument cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// The host rate, Hz, lies outside [`HOST_RATES_HZ`](super::internal_rate::HOST_RATES_HZ).
    #[error("sample rate must lie in 1000..1536000 Hz, got {0}")]
    Rate(f64),
    /// The pitch of A4, Hz, lies outside [`A4_RANGE_HZ`].
    #[error("A4 must lie in {low}..{high} Hz, got {0}", low = A4_RANGE_HZ.0, high = A4_RANGE_HZ.1)]
    A4(f64),
    /// The caller ended the preparation.
    #[error("cancelled")]
    Cancelled,
    /// An instrument made by hand that [`InstrumentFile::check`] refuses.
    #[error(transparent)]
    Instrument(#[from] InstrumentError),
    /// The bore cannot be cut into cells of the lattice.
    #[error(transparent)]
    Cells(#[from] CellsError),
    /// A generated file that comes with the program is damaged.
    #[error(
        "generated data of the built-in instrument: {0}; run `cargo xtask fit-bore` and `cargo xtask tune`"
    )]
    Data(String),
}

impl Model {
    /// Assembles a model from its parts. `file` is already scaled by `scale`; the model plays at `a4_hz`. Allocates.
    pub fn assemble(file: InstrumentFile, cells: Cells, tuning: TuningTable, a4_hz: f64, scale: f64) -> Self {
        let air = Air::default();
        let coeffs = Arc::new(LatticeCoeffs::new(&cells, &networks(&file, &air, &cells), P_REF_PA, &air));
        let notes_hz: Vec<f64> = file
            .fingerings
            .iter()
            .map(|fingering| file.sounding(fingering.written).frequency_hz(a4_hz))
            .collect();
        let slope = |(fingering, &note_hz): (&Fingering, &f64)| {
            // Fewer digits than differ between one system's sine and another's.
            (1e3 * coeffs.susceptance_slope(note_hz, &fingering.opening())).round() * 1e-3
        };
        let susceptance_slopes = file.fingerings.iter().zip(&notes_hz).map(slope).collect();
        let registers = file
            .fingerings
            .iter()
            .map(|fingering| match fingering.register.as_str() {
                "clarion" => 2,
                "altissimo" => 3,
                _ => 1,
            })
            .collect();
        let alternates = ContextFingerings::new(&file, &air, a4_hz);
        let section = std::f64::consts::PI * file.nominal_radius_m * file.nominal_radius_m;
        // The instrument's own reed by its ratio to the reference, so that a B flat clarinet has exactly the reference.
        let larger = file.reed_volume_m3 / REFERENCE_VOLUME_M3;
        let swept_s = PhysicalReed::reference().equivalent_volume_m3(&air) / (section * air.c) * larger;
        Self {
            size_hz: file.size_hz() * a4_hz / A4_HZ,
            notes_hz,
            registers,
            susceptance_slopes,
            alternates,
            swept_s,
            coeffs,
            cells,
            tuning,
            player: PlayerModel::FITTED,
            keys: KeyPitches::default(),
            a4_hz,
            scale,
            air,
            file,
        }
    }

    /// Whether single precision is enough for it.
    pub(super) fn is_single(&self) -> bool {
        self.coeffs.rate_hz <= SINGLE_BELOW_HZ
    }

    /// Index of the fingering that plays a sounding note; `None` if the instrument has none, or if the fingering does not
    /// [speak in tune](Self::speaks). A player who asks for such a note hears nothing, not another note. Real-time safe.
    pub fn fingering_for(&self, note: SoundingNote) -> Option<usize> {
        let written = note.written(self.file.transposition)?;
        let fingering = self.file.fingerings.iter().position(|fingering| fingering.written == written)?;
        self.speaks(fingering).then_some(fingering)
    }

    /// Whether a fingering speaks in its own register within [`IN_TUNE_CENTS`], as the tuning found. True before an
    /// instrument is tuned, and for a fingering that the tuning does not have. Real-time safe.
    pub fn speaks(&self, fingering: usize) -> bool {
        let tuned = self.tuning.notes.get(fingering);
        tuned.is_none_or(|note| !note.silent && note.off_cents.abs() <= IN_TUNE_CENTS)
    }

    /// Sounding notes that have a fingering which does not [speak in tune](Self::speaks), in the order of the file.
    /// Allocates.
    pub fn silent_notes(&self) -> Vec<SoundingNote> {
        let silent = (0..self.file.fingerings.len()).filter(|&fingering| !self.speaks(fingering));
        silent.map(|fingering| self.file.sounding(self.file.fingerings[fingering].written)).collect()
    }

    /// Place of a fingering's note in the compass of an instrument of this size, see [`PlayerModel::place`]. Real-time safe.
    pub fn place(&self, fingering: usize) -> f64 {
        PlayerModel::place(self.notes_hz[fingering], self.size_hz)
    }

    /// Rows of round-trip delay that move a fingering's note by `cents`, estimated from the note's quarter-wave length.
    /// Positive cents are up and give negative rows. Real-time safe.
    ///
    /// # Panics
    /// If the file has no such fingering.
    pub fn rows_for_cents(&self, fingering: usize, cents: f64) -> f64 {
        let quarter_waves = f64::from(2 * self.registers[fingering] - 1);
        let quarter_rows = quarter_waves * self.coeffs.rate_hz / (4.0 * self.notes_hz[fingering]);
        2.0 * quarter_rows * (maths::exp2(-cents / 1_200.0) - 1.0)
    }
}
