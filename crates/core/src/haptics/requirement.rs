//! What each note requires: the mouth pressures at which it starts, at which the reed begins to beat, and at which it stops.
//!
//! [`RequirementSolver`] analyses the bore once per instrument and air, about one second for 46 notes, and stores the
//! admittance of each fingering on a grid. The reed (zeta, H, k, A, lip) enters by algebra on those numbers. That takes a few
//! milliseconds for all notes, so a knob can follow a slider. Pressures of a note, over the closing pressure `p_M`:
//!
//! - `gamma_on`, the onset of a reed without inertia: [`threshold_gamma`] of the height of the peak, with the air volume of
//!   the reed. This is the pressure that the literature says a note requires.
//! - `gamma_sounding`, the onset of the moving reed under the lip, for the mode that starts first (`onset.rs`). This is where
//!   the sound starts. [`RequirementSolver::with_lattice`] makes it that of the lattice that sounds.
//! - `gamma_beat`, where the reed begins to touch the lay: in Raman's two states with losses, the shut state then lies at 1,
//!   so `zeta (1 - x) sqrt(x) = (1 - x) / Z` gives `gamma = (1 + (1 / zeta Z)^2) / 2`.
//! - `gamma_off`, the extinction (`extinction.rs`).
//!
//! `docs/feel.md` lists what this model leaves out and its errors against the played instrument.

use crate::bore::instrument_file::{InstrumentError, InstrumentFile};
use crate::bore::lattice::LatticeCoeffs;
use crate::bore::transfer_matrix::{TransferMatrix, threshold_gamma};
use crate::haptics::admittance::{AdmittanceGrid, swept_s};
use crate::haptics::extinction::EffectiveImpedance;
use crate::haptics::onset;
use crate::haptics::onset::OnsetReed;
use crate::haptics::played_reed::PlayedReed;
use crate::units::{A4_OF_THEORY_HZ, Air, WrittenNote, cents};

/// The grid of a note reaches from this share of the lowest note's frequency to the larger of two frequencies: this multiple
/// of the [lowest note without an extension](InstrumentFile::lowest_unextended) and this multiple of the note. The lip puts the resonance
/// of the reed there, above which nothing starts.
const FROM_LOWEST: f64 = 0.5;
const TO_LOWEST: f64 = 11.0;
const TO_NOTE: f64 = 1.6;
/// A mode at most this far from the note, cents, is the note's own: the reed under the lip lowers it by 70 cents at most.
const OWN_CENTS: f64 = 150.0;

/// What one note requires of the player.
///
/// A field `gamma_...` is a mouth pressure over the closing pressure `p_M` ([`PlayedReed::closing_pa`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoteRequirement {
    /// Onset of a reed without inertia, from 1/3 to 1.
    pub gamma_on: f64,
    /// Pressure at `gamma_on`, Pa.
    pub p_req_pa: f64,
    /// Where the sound starts: the lowest onset of any mode, with the reed as it moves under the lip.
    pub gamma_sounding: f64,
    /// Frequency of the oscillation that starts there, Hz.
    pub sounding_hz: f64,
    /// Onset of the note's own mode, with the moving reed; `None` if that mode does not start before the reed is shut.
    pub gamma_own: Option<f64>,
    /// Where the reed begins to touch the lay (beating); at least `gamma_sounding`.
    pub gamma_beat: f64,
    /// Extinction: a note that sounds chokes there as the pressure rises, because the reed stays shut. At least 1. As the pressure falls again,
    /// the reed stays silent until further down, near 1.2.
    pub gamma_off: f64,
}

/// The analysed bore of one instrument, from which the requirement of every note follows for any reed.
///
/// Immutable and `Sync`: make it once and share it.
#[derive(Clone, Debug)]
pub struct RequirementSolver {
    notes: Vec<BoreNote>,
    /// Flow made by the motion of the reference reed, per speed: V / (S c), s.
    swept_s: f64,
    /// Sample rate at which the reed moves, Hz, if it is that of the lattice.
    rate_hz: Option<f64>,
}

/// What is known of one fingering without the reed.
#[derive(Clone, Debug)]
struct BoreNote {
    written: WrittenNote,
    note_hz: f64,
    /// Length of the tube down to the first open tone hole (register holes aside), m.
    closed_tube_m: f64,
    /// Admittance from the transfer matrices.
    bore: AdmittanceGrid,
    /// Admittance of the lattice, if it was given.
    lattice: Option<AdmittanceGrid>,
    /// Frequency at which a reference reed without inertia plays, Hz, and the impedance that decides the extinction;
    /// `None` if the fingering has no resonance for the note.
    mode: Option<(f64, EffectiveImpedance)>,
}

/// Why a bore is not analysed.
#[derive(Debug, thiserror::Error)]
pub enum RequirementError {
    /// A pitch of A4, Hz, outside [`A4_OF_THEORY_HZ`].
    #[error("A4 must lie in {low}..{high} Hz, got {0}", low = A4_OF_THEORY_HZ.0, high = A4_OF_THEORY_HZ.1)]
    A4(f64),
    /// An instrument made by hand that is none.
    #[error(transparent)]
    Instrument(#[from] InstrumentError),
}

impl RequirementSolver {
    /// Analyses the bore of an instrument that plays at `a4_hz`, 100..=1000 Hz: about one second for 46 notes. Allocates; not for the
    /// audio thread.
    ///
    /// # Errors
    /// [`RequirementError`] if A4 lies outside, or if [`InstrumentFile::check`] refuses the instrument.
    pub fn new(file: &InstrumentFile, air: Air, a4_hz: f64) -> Result<Self, RequirementError> {
        if !(A4_OF_THEORY_HZ.0..=A4_OF_THEORY_HZ.1).contains(&a4_hz) {
            return Err(RequirementError::A4(a4_hz));
        }
        file.check()?;
        Ok(Self::of_checked(file, air, a4_hz))
    }

    /// The same of an instrument and a pitch that were checked.
    pub(crate) fn of_checked(file: &InstrumentFile, air: Air, a4_hz: f64) -> Self {
        let matrix = TransferMatrix::new(file, air);
        let sounding_hz = |written: WrittenNote| file.sounding(written).frequency_hz(a4_hz);
        let (lowest_hz, size_hz) = (sounding_hz(file.lowest()), sounding_hz(file.lowest_unextended()));
        let notes = file
            .fingerings
            .iter()
            .map(|fingering| {
                let (open, note_hz) = (&fingering.open, sounding_hz(fingering.written));
                let range = (FROM_LOWEST * lowest_hz, (TO_LOWEST * size_hz).max(TO_NOTE * note_hz));
                let bore = AdmittanceGrid::new(range, |f_hz| matrix.impedance(f_hz, open, 0.0).inv());
                let playing = matrix.playing_frequency(open, file.reed_volume_m3, note_hz);
                let mode = playing
                    .filter(|&(_, height)| height > 0.0)
                    .map(|(f_hz, _)| (f_hz, EffectiveImpedance::new(&matrix, file, open, &air, f_hz)));
                let first_open = file
                    .holes
                    .iter()
                    .zip(open)
                    .find(|&(hole, &open)| open && !hole.register)
                    .map_or_else(|| file.length_m(), |(hole, _)| hole.x_m);
                BoreNote {
                    written: fingering.written,
                    note_hz,
                    closed_tube_m: first_open,
                    bore,
                    lattice: None,
                    mode,
                }
            })
            .collect();
        Self { notes, swept_s: swept_s(file, &air), rate_hz: None }
    }

    /// Takes the onsets from the lattice that makes the sound, instead of the transfer matrices.
    ///
    /// `coeffs` must be those of a lattice fitted to the same `file`; `tuning_rows` is the delay trim of each fingering, in
    /// rows of the lattice. Allocates.
    pub fn with_lattice(
        mut self,
        file: &InstrumentFile,
        coeffs: &LatticeCoeffs,
        tuning_rows: impl Fn(usize) -> f64,
    ) -> Self {
        for (index, (note, fingering)) in self.notes.iter_mut().zip(&file.fingerings).enumerate() {
            let opening = fingering.opening();
            let rows = tuning_rows(index);
            note.lattice = Some(AdmittanceGrid::new(note.bore.range_hz(), |f_hz| {
                let r = coeffs.reflectance(f_hz, &opening, rows);
                coeffs.tip_admittance() * (1.0 - r) / (1.0 + r)
            }));
        }
        self.rate_hz = Some(coeffs.rate_hz);
        self
    }

    /// Written notes, in the order of the fingerings in the instrument file.
    pub fn written(&self) -> impl ExactSizeIterator<Item = WrittenNote> + '_ {
        self.notes.iter().map(|note| note.written)
    }

    /// Length of the tube from the reed to the first open tone hole for each fingering, m; register holes do not count.
    pub fn closed_tube_m(&self) -> impl ExactSizeIterator<Item = f64> + '_ {
        self.notes.iter().map(|note| note.closed_tube_m)
    }

    /// The requirement of every note with this reed, in the order of the fingerings. Allocates.
    ///
    /// `None` marks a note that cannot sound: the fingering has no resonance for it, or none that starts before the reed is
    /// shut.
    pub fn with(&self, reed: &PlayedReed) -> Vec<Option<NoteRequirement>> {
        (0..self.notes.len()).map(|note| self.note(note, reed)).collect()
    }

    /// The requirement of one note, by the index of its fingering; `None` as in [`with`](Self::with), or if there is no such
    /// fingering.
    pub fn note(&self, fingering: usize, reed: &PlayedReed) -> Option<NoteRequirement> {
        let note = self.notes.get(fingering)?;
        let (near_hz, impedance) = note.mode.as_ref()?;
        let swept_s = self.swept_s * reed.compliance();
        let distance = |f_hz: f64| cents(f_hz, *near_hz).abs();
        let (f_hz, height) =
            note.bore.modes(swept_s).min_by(|a, b| distance(a.0).total_cmp(&distance(b.0)))?;
        let zeta = reed.flow_strength();
        let gamma_on = threshold_gamma(height, zeta);
        if gamma_on.is_nan() || gamma_on >= 1.0 {
            return None;
        }
        let (mut first, mut own) = ((gamma_on, f_hz), Some(gamma_on));
        let mut gamma_off = impedance.extinction(zeta, reed.jet_loss * reed.closing_pa());
        if let Some(&lip) = reed.lips.get(fingering) {
            let reed = OnsetReed { zeta, lay: reed.lay, lip, swept_s, rate_hz: self.rate_hz };
            let grid = note.lattice.as_ref().unwrap_or(&note.bore);
            let mut starts: Vec<(f64, f64)> =
                onset::onsets(grid, &reed).filter(|&(gamma, _)| gamma < 1.0).collect();
            starts.sort_by(|a, b| a.0.total_cmp(&b.0));
            first = *starts.first()?;
            let is_own = |&&(_, f_hz): &&(f64, f64)| cents(f_hz, note.note_hz).abs() < OWN_CENTS;
            if let Some((gamma, _)) = onset::shut(grid, &reed, f_hz) {
                gamma_off = gamma_off.max(gamma);
            }
            own = starts.iter().find(is_own).map(|&(gamma, _)| gamma);
        }
        let (gamma_sounding, sounding_hz) = first;
        let loss = 1.0 / (zeta * height);
        Some(NoteRequirement {
            gamma_on,
            p_req_pa: reed.closing_pa() * gamma_on,
            gamma_sounding,
            sounding_hz,
            gamma_own: own,
            gamma_beat: (0.5 * (1.0 + loss * loss)).max(gamma_sounding),
            gamma_off,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bore::bundled::Bundled;
    use crate::instrument::Settings;
    use crate::instrument::feel_inputs::played_reed;

    #[test]
    fn what_is_no_pitch_or_no_instrument_is_refused() {
        let (file, air) = (InstrumentFile::built_in(), Air::default());
        for a4_hz in [0.0, -440.0, f64::NAN, 1e9] {
            let said = RequirementSolver::new(&file, air, a4_hz).unwrap_err().to_string();
            assert!(said.contains("A4 must lie in 100..1000 Hz"), "{said}");
        }
        let silent = InstrumentFile { fingerings: Vec::new(), ..file };
        assert!(RequirementSolver::new(&silent, air, 440.0).unwrap_err().to_string().contains("fingering"));
    }

    #[test]
    fn the_grid_of_every_note_reaches_beyond_the_resonance_of_its_reed() {
        for bundled in Bundled::ALL {
            let file = bundled.file();
            let solver = RequirementSolver::of_checked(&file, Air::default(), 440.0);
            let reed = played_reed(&file, 440.0, &Settings::default());
            for (note, lip) in solver.notes.iter().zip(&reed.lips) {
                let end_hz = note.bore.range_hz().1;
                assert!(end_hz > lip.resonance_hz, "{bundled:?}, {}: {end_hz} Hz", note.written);
            }
        }
    }

    #[test]
    fn stored_admittance_is_the_bore() {
        let (file, air) = (InstrumentFile::built_in(), Air::default());
        let (bore, solver) =
            (TransferMatrix::new(&file, air), RequirementSolver::of_checked(&file, air, 440.0));
        for (fingering, note) in file.fingerings.iter().zip(&solver.notes) {
            let (near_hz, _) = note.mode.as_ref().unwrap();
            for off in [0.93, 0.971, 1.0, 1.017] {
                let f_hz = off * near_hz;
                let exact = bore.impedance(f_hz, &fingering.open, 0.0).inv();
                let error = (note.bore.at(f_hz).unwrap() - exact).norm() / exact.norm().max(0.02);
                assert!(error < 2e-3, "{} at {f_hz}: {error:e}", fingering.written);
            }
            let (f_exact, height_exact) =
                bore.playing_frequency(&fingering.open, file.reed_volume_m3, note.note_hz).unwrap();
            let (f_hz, height) = note
                .bore
                .modes(solver.swept_s)
                .find(|&(f_hz, _)| (f_hz / near_hz - 1.0).abs() < 0.01)
                .unwrap();
            assert!((f_hz / f_exact - 1.0).abs() < 1e-4 && (height / height_exact - 1.0).abs() < 2e-3);
        }
    }
}
