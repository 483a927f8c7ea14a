//! How hard each note is to blow: the pressures at which it starts, beats and stops.
//!
//! The bore is asked once per instrument and air (a second for 46 notes): [`Requirements`] keeps each fingering's
//! admittance on a grid. Everything the reed adds (zeta, H, k, A, lip) is then algebra on those numbers, some
//! milliseconds for all notes, so that a knob can follow a slider. Pressures per note, over the closing pressure `p_M`:
//!
//! - `gamma_on`, onset of a reed without inertia: [`threshold_gamma`] of the height of the peak, the reed's air volume
//!   included. What a note is said to require.
//! - `gamma_sounding`, onset of the reed as it moves under the lip, of whichever mode starts first: where the sound
//!   starts (see `onset`). Given the lattice, it is that of the very instrument that sounds.
//! - `gamma_beat`, where the reed begins to touch: Raman's two states with losses, of which the shut one then lies at 1,
//!   so that `zeta (1 - x) sqrt(x) = (1 - x) / Z` gives `gamma = (1 + (1 / zeta Z)^2) / 2`.
//! - `gamma_off`, extinction (see `extinction`).
//!
//! What this leaves out, and the errors against the instrument played: `docs/feel.md`.

use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

use crate::bore::instrument_file::InstrumentFile;
use crate::bore::lattice::LatticeCoeffs;
use crate::bore::transfer_matrix::{TransferMatrix, threshold_gamma};
use crate::haptics::extinction::Swing;
use crate::haptics::onset;
use crate::reed::ReedLaw;
use crate::reed::law::K_INIT;
use crate::reed::physical::P_REF_PA;
use crate::units::{Air, SoundingNote, WrittenNote, cents};

/// Grid of the stored admittance, Hz: the one [`TransferMatrix::playing_frequency`] keeps.
const STEP_HZ: f64 = 2.0;
/// It reaches from this share of the lowest note up to the larger of these multiples of the lowest note and the note:
/// above the reed's resonance, which the lip puts there, nothing starts.
const FROM_LOWEST: f64 = 0.5;
const TO_LOWEST: f64 = 11.0;
const TO_NOTE: f64 = 1.6;
/// A mode this near the note is the note's own, cents: the lip's reed pulls it down by 70 at most.
const OWN_CENTS: f64 = 150.0;

/// Reed resonance and damping under the lip, for one fingering. The rule lives with the player, who passes it in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lip {
    /// Resonance of the reed with the lip on it, Hz.
    pub resonance_hz: f64,
    /// Damping q, 1 / Q.
    pub damping: f64,
}

/// The reed as it is played: one law in sound and feel.
#[derive(Clone, Debug, PartialEq)]
pub struct PlayedReed {
    /// H, k, A.
    pub law: ReedLaw,
    /// Flow strength of the reference reed; what this reed's is follows from the law.
    pub zeta: f64,
    /// Half-width of the lay's knee, over the rest opening.
    pub lay: f64,
    /// Loss K of the jets in open holes; 0 without.
    pub jet_loss: f64,
    /// Lip for each fingering of the file; a fingering without one gets a reed without inertia.
    pub lips: Vec<Lip>,
}

impl PlayedReed {
    /// The reference reed without inertia, on a bore without jets, under an embouchure `zeta`.
    pub fn quasi_static(zeta: f64) -> Self {
        Self { law: ReedLaw::default(), zeta, lay: 0.0, jet_loss: 0.0, lips: Vec::new() }
    }

    /// Closing pressure p_M, Pa.
    pub fn closing_pa(&self) -> f64 {
        P_REF_PA * self.law.closing()
    }

    /// Compliance over the reference reed's.
    pub fn compliance(&self) -> f64 {
        K_INIT / self.law.k()
    }

    /// Flow strength of this reed over its own closing pressure: `zeta A H k_ref / sqrt(H k)`. Equals `zeta` for the
    /// reference; a wider reed is stronger (as H^2 coupled, as sqrt(H) free), a stiffer one weaker.
    pub fn flow_strength(&self) -> f64 {
        self.zeta * self.law.a() * self.law.h() * K_INIT / self.law.closing().sqrt()
    }
}

/// What one note asks of the player. Pressures over `p_M` unless a name says otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Requirement {
    /// Onset of a reed without inertia, 1/3 ..1.
    pub gamma_on: f64,
    /// Pressure at `gamma_on`, Pa.
    pub p_req_pa: f64,
    /// Where the sound starts: the first onset of any mode, with the reed as it moves under the lip.
    pub gamma_sounding: f64,
    /// Frequency that starts there, Hz.
    pub sounding_hz: f64,
    /// Onset of the note's own mode, likewise; `None` if the note has none before the reed is shut.
    pub gamma_own: Option<f64>,
    /// Where the reed begins to touch the lay.
    pub gamma_beat: f64,
    /// Above this the blown-shut reed no longer sounds; at least 1.
    pub gamma_off: f64,
}

/// What the bore says about every fingering, whatever the reed. Share it.
#[derive(Clone, Debug)]
pub struct Requirements {
    notes: Vec<BoreNote>,
    /// Flow made by the reference reed's own motion, per speed: V / (S c), s.
    swept_s: f64,
    /// Rate at which the reed moves, Hz, if it is the lattice's.
    rate_hz: Option<f64>,
}

/// One fingering.
#[derive(Clone, Debug)]
struct BoreNote {
    written: WrittenNote,
    note_hz: f64,
    /// Length of the tube down to the first open tone hole (register holes aside), m.
    closed_tube_m: f64,
    /// Of the measurements: what the note requires.
    bore: Grid,
    /// Of the lattice: what sounds.
    heard: Option<Grid>,
    /// Where a reference reed without inertia plays, Hz, and how loud it can be; `None` where no resonance carries the
    /// note.
    mode: Option<(f64, Swing)>,
}

/// `Zc / Z` of the bore alone, on a grid.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// Index of the first entry: its frequency over the step.
    first: usize,
    admittance: Vec<Complex64>,
}

impl Grid {
    fn new((from_hz, to_hz): (f64, f64), admittance: impl FnMut(f64) -> Complex64) -> Self {
        let (first, last) = ((from_hz / STEP_HZ).floor() as usize, (to_hz / STEP_HZ).ceil() as usize);
        let grid = (first..=last).map(|k| k as f64 * STEP_HZ);
        Self { first, admittance: grid.map(admittance).collect() }
    }

    /// At any frequency inside the grid, cubic between its points.
    pub(super) fn at(&self, f_hz: f64) -> Option<Complex64> {
        let position = f_hz / STEP_HZ - self.first as f64;
        let last = self.admittance.len().checked_sub(4)?;
        if !(1.0..=(last + 1) as f64).contains(&position) {
            return None;
        }
        let i = (position as usize - 1).min(last);
        let t = position - (i + 1) as f64;
        let y = &self.admittance[i..i + 4];
        let (a, b, c) = (t + 1.0, t - 1.0, t - 2.0);
        Some(
            y[0] * (-t * b * c / 6.0)
                + y[1] * (a * b * c / 2.0)
                + y[2] * (-a * t * c / 2.0)
                + y[3] * (a * t * b / 6.0),
        )
    }

    /// Where the susceptance rises through zero, with an air volume `swept_s` at the tip: the modes, Hz, and their
    /// height Re Z / Zc.
    pub(super) fn modes(&self, swept_s: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        let loaded = move |f_hz: f64| Some(self.at(f_hz)? + Complex64::I * (TAU * f_hz * swept_s));
        let im = move |k: usize| self.admittance[k].im + TAU * (self.first + k) as f64 * STEP_HZ * swept_s;
        (2..self.admittance.len().saturating_sub(2)).filter_map(move |k| {
            if im(k - 1) > 0.0 || im(k) <= 0.0 {
                return None;
            }
            let (mut low, mut high) =
                ((self.first + k - 1) as f64 * STEP_HZ, (self.first + k) as f64 * STEP_HZ);
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if loaded(middle)?.im <= 0.0 { low = middle } else { high = middle }
            }
            let f_hz = 0.5 * (low + high);
            let conductance = loaded(f_hz)?.re;
            (conductance > 0.0).then(|| (f_hz, conductance.recip()))
        })
    }
}

impl Requirements {
    /// Asks the bore of an instrument. A second for 46 notes. Allocates.
    pub fn new(file: &InstrumentFile, air: Air) -> Self {
        let matrix = TransferMatrix::new(file, air);
        let sounding_hz = |written: WrittenNote| {
            written.sounding(file.transposition).unwrap_or(SoundingNote(0)).frequency_hz(440.0)
        };
        let lowest_hz = sounding_hz(file.lowest());
        let notes = file
            .fingerings
            .iter()
            .map(|fingering| {
                let (open, note_hz) = (&fingering.open, sounding_hz(fingering.written));
                let range = (FROM_LOWEST * lowest_hz, (TO_LOWEST * lowest_hz).max(TO_NOTE * note_hz));
                let bore = Grid::new(range, |f_hz| matrix.impedance(f_hz, open, 0.0).inv());
                let playing = matrix.playing_frequency(open, file.reed_volume_m3, note_hz);
                let mode = playing
                    .filter(|&(_, height)| height > 0.0)
                    .map(|(f_hz, _)| (f_hz, Swing::new(&matrix, file, open, &air, f_hz)));
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
                    heard: None,
                    mode,
                }
            })
            .collect();
        Self { notes, swept_s: swept_s(file, &air), rate_hz: None }
    }

    /// The same, with the onset of the lattice that sounds: `tuning_rows` is the delay trim of each fingering. Allocates.
    pub fn heard_through(
        mut self,
        file: &InstrumentFile,
        coeffs: &LatticeCoeffs,
        tuning_rows: impl Fn(usize) -> f64,
    ) -> Self {
        for (index, (note, fingering)) in self.notes.iter_mut().zip(&file.fingerings).enumerate() {
            let opening: Vec<f64> = fingering.open.iter().map(|&open| f64::from(u8::from(open))).collect();
            let rows = tuning_rows(index);
            let from_hz = note.bore.first as f64 * STEP_HZ;
            let to_hz = from_hz + (note.bore.admittance.len() - 1) as f64 * STEP_HZ;
            note.heard = Some(Grid::new((from_hz, to_hz), |f_hz| {
                let r = coeffs.reflectance(f_hz, &opening, rows);
                coeffs.tip_admittance() * (1.0 - r) / (1.0 + r)
            }));
        }
        self.rate_hz = Some(coeffs.rate_hz);
        self
    }

    /// Written notes, in the order of the file's fingerings.
    pub fn written(&self) -> impl ExactSizeIterator<Item = WrittenNote> + '_ {
        self.notes.iter().map(|note| note.written)
    }

    /// Length of the closed part of the tube for each fingering, m.
    pub fn closed_tube_m(&self) -> impl ExactSizeIterator<Item = f64> + '_ {
        self.notes.iter().map(|note| note.closed_tube_m)
    }

    /// What every note asks of this reed, in the order of the fingerings; `None` where it cannot sound: no resonance, or
    /// none strong enough to start before the reed is shut.
    pub fn with(&self, reed: &PlayedReed) -> Vec<Option<Requirement>> {
        (0..self.notes.len()).map(|note| self.note(note, reed)).collect()
    }

    /// One note of [`with`](Self::with).
    pub fn note(&self, fingering: usize, reed: &PlayedReed) -> Option<Requirement> {
        let note = self.notes.get(fingering)?;
        let (near_hz, swing) = note.mode.as_ref()?;
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
        let mut gamma_off = swing.extinction(zeta, reed.jet_loss * reed.closing_pa());
        if let Some(&lip) = reed.lips.get(fingering) {
            let reed = onset::Reed { zeta, lay: reed.lay, lip, swept_s, rate_hz: self.rate_hz };
            let grid = note.heard.as_ref().unwrap_or(&note.bore);
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
        Some(Requirement {
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

/// Flow that the instrument's reed's own motion makes, per speed: V / (S c), s.
pub(super) fn swept_s(file: &InstrumentFile, air: &Air) -> f64 {
    file.reed_volume_m3 / (PI * file.nominal_radius_m * file.nominal_radius_m * air.c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reference_reed_has_the_strength_it_was_given() {
        assert!((PlayedReed::quasi_static(0.3).flow_strength() - 0.3).abs() < 1e-12);
        let wide = PlayedReed { law: ReedLaw::coupled(3.0, 1.0).unwrap(), ..PlayedReed::quasi_static(0.3) };
        let ratio = 3.0 / crate::reed::law::H_INIT;
        assert!((wide.flow_strength() - 0.3 * ratio * ratio).abs() < 1e-12);
        let loud = PlayedReed { law: ReedLaw::coupled(3.0, 2.0).unwrap(), ..wide.clone() };
        assert!((loud.flow_strength() - 2.0 * wide.flow_strength()).abs() < 1e-12);
    }

    #[test]
    fn stored_admittance_is_the_bore() {
        let (file, air) = (InstrumentFile::built_in(), Air::default());
        let (bore, requirements) = (TransferMatrix::new(&file, air), Requirements::new(&file, air));
        for (fingering, note) in file.fingerings.iter().zip(&requirements.notes) {
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
                .modes(requirements.swept_s)
                .find(|&(f_hz, _)| (f_hz / near_hz - 1.0).abs() < 0.01)
                .unwrap();
            assert!((f_hz / f_exact - 1.0).abs() < 1e-4 && (height / height_exact - 1.0).abs() < 2e-3);
        }
    }
}
