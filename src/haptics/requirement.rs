//! How hard each note is to blow: the pressures at which it starts, beats and stops.
//!
//! The bore is asked once per instrument and air (half a second for 46 notes): [`Requirements`] keeps, for each
//! fingering, the admittance around the mode it plays on and the impedance at the harmonics. Everything the reed adds
//! (zeta, H, k, A, lip) is then algebra on those numbers, so that a knob can follow a slider.
//!
//! Three pressures per note, over the closing pressure `p_M`:
//! - `gamma_on`, quasi-static onset: [`threshold_gamma`] of the height of the peak, the reed's air volume included.
//! - `gamma_beat`, where the reed begins to touch, and `gamma_off`, extinction: Raman's two-state oscillation with
//!   losses (Dalmont, Gilbert, Kergomard & Ollivier 2005 treat it with one loss for all harmonics; read at second
//!   hand, the algebra below is done here). Open, the pressure difference is x and the flow `zeta (1 - x) sqrt(x)`;
//!   shut, the flow is 0. The flow is then a square wave of half that height, and since near its maximum at x = 1/3 it
//!   hardly depends on x the reed is a source of *flow*: each odd harmonic n makes the pressure `Z(n f)` times its
//!   share, and over the open half period the pressure in the mouthpiece averages `Z_e` times the half height, with
//!   `Z_e = 8/pi^2 sum Re Z(n f) / n^2`. So `gamma(x) = x + zeta (1 - x) sqrt(x) Z_e / 2`, and its maximum is the
//!   extinction. A harmonic that fits no resonance has a small `Z` and is simply weak.
//!
//! What this leaves out: `docs/feel.md`, with the errors against the instrument played.

use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

use crate::bore::instrument_file::InstrumentFile;
use crate::bore::transfer_matrix::{TransferMatrix, threshold_gamma};
use crate::haptics::onset;
use crate::reed::ReedLaw;
use crate::reed::law::K_INIT;
use crate::reed::physical::P_REF_PA;
use crate::units::{Air, REFERENCE_RADIUS_M, SoundingNote, WrittenNote};

/// Grid of the stored admittance, Hz: the one [`TransferMatrix::playing_frequency`] keeps, so that it costs nothing.
const STEP_HZ: f64 = 2.0;
/// The admittance is stored from this share of the playing frequency to this: modes are shifted down by the reed.
const WINDOW: (f64, f64) = (0.75, 1.25);
/// Harmonics above this are left out of the extinction, Hz: their weight is below 1/n^2 = 1/500.
const HARMONICS_TO_HZ: f64 = 6_000.0;

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
    /// Lip for each fingering of the file; a fingering without one gets a reed without inertia.
    pub lips: Vec<Lip>,
}

impl PlayedReed {
    /// The reference reed without inertia, under an embouchure `zeta`.
    pub fn quasi_static(zeta: f64) -> Self {
        Self { law: ReedLaw::default(), zeta, lay: 0.0, lips: Vec::new() }
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
    /// Onset with the reed as it moves under the lip: where the sound starts.
    pub gamma_sounding: f64,
    /// Where the reed begins to touch the lay.
    pub gamma_beat: f64,
    /// Above this the blown-shut reed no longer sounds; at least 1.
    pub gamma_off: f64,
    /// Pressure at `gamma_on`, Pa.
    pub p_req_pa: f64,
    /// Frequency of the onset, Hz.
    pub onset_hz: f64,
}

/// What the bore says about every fingering, whatever the reed. Share it.
#[derive(Clone, Debug)]
pub struct Requirements {
    notes: Vec<BoreNote>,
    /// Flow made by the reference reed's own motion, per speed: V / (S c), s.
    swept_s: f64,
}

/// One fingering.
#[derive(Clone, Debug)]
pub(super) struct BoreNote {
    written: WrittenNote,
    /// Length of the tube down to the first open tone hole (register holes aside), m.
    closed_tube_m: f64,
    /// `None` where no resonance carries the note.
    mode: Option<Mode>,
}

/// The mode a note plays on.
#[derive(Clone, Debug)]
pub(super) struct Mode {
    /// Where a reference reed without inertia plays, Hz.
    pub(super) f_hz: f64,
    /// First frequency of `admittance`, Hz.
    from_hz: f64,
    /// `Zc / Z` of the bore alone on the grid.
    admittance: Vec<Complex64>,
    /// `Z / Zc` of the bore alone at the odd harmonics of `f_hz`, 1, 3, 5...
    harmonics: Vec<Complex64>,
}

impl Mode {
    /// `Zc / Z` of the bore at a frequency inside the window, cubic between grid points.
    pub(super) fn admittance(&self, f_hz: f64) -> Option<Complex64> {
        let position = (f_hz - self.from_hz) / STEP_HZ;
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

    /// Height of the peak, Re Z / Zc, with an air volume `swept_s` moving at the tip, and its frequency, Hz.
    fn peak(&self, swept_s: f64) -> Option<(f64, f64)> {
        let loaded = |f_hz: f64| Some(self.admittance(f_hz)? + Complex64::I * (TAU * f_hz * swept_s));
        // Im Y rises through zero at a peak. From the reference's, step outwards until it is bracketed.
        let im = |f_hz: f64| loaded(f_hz).map(|y| y.im);
        let (mut low, mut high) = (self.f_hz, self.f_hz);
        let step = 0.003 * self.f_hz;
        while im(low)? > 0.0 {
            low -= step;
        }
        while im(high)? < 0.0 {
            high += step;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if im(middle)? < 0.0 { low = middle } else { high = middle }
        }
        let f_hz = 0.5 * (low + high);
        let conductance = loaded(f_hz)?.re;
        (conductance > 0.0).then(|| (f_hz, conductance.recip()))
    }

    /// `Z_e` of the two-state oscillation, see the head of this module.
    fn swing(&self, swept_s: f64) -> f64 {
        let sum: f64 = self
            .harmonics
            .iter()
            .zip((1_u32..).step_by(2).map(f64::from))
            .map(|(&z, n)| (z / (1.0 + z * Complex64::I * (TAU * n * self.f_hz * swept_s))).re / (n * n))
            .sum();
        8.0 / (PI * PI) * sum
    }
}

impl Requirements {
    /// Asks the bore of an instrument. Half a second for 46 notes. Allocates.
    pub fn new(file: &InstrumentFile, air: Air) -> Self {
        let matrix = TransferMatrix::new(file, air);
        let volume_m3 = file.reed_volume_m3;
        let notes = file
            .fingerings
            .iter()
            .map(|fingering| {
                let near_hz = fingering
                    .written
                    .sounding(file.transposition)
                    .unwrap_or(SoundingNote(0))
                    .frequency_hz(440.0);
                let playing = matrix.playing_frequency(&fingering.open, volume_m3, near_hz);
                let mode = playing.filter(|&(_, height)| height > 0.0).map(|(f_hz, _)| {
                    let first = (WINDOW.0 * f_hz / STEP_HZ).floor();
                    let last = (WINDOW.1 * f_hz / STEP_HZ).ceil();
                    let admittance = (first as usize..=last as usize)
                        .map(|k| matrix.impedance(k as f64 * STEP_HZ, &fingering.open, 0.0).inv())
                        .collect();
                    let harmonics = (1_u32..)
                        .step_by(2)
                        .map(|n| f64::from(n) * f_hz)
                        .take_while(|&f_hz| f_hz < HARMONICS_TO_HZ)
                        .map(|f_hz| matrix.impedance(f_hz, &fingering.open, 0.0))
                        .collect();
                    Mode { f_hz, from_hz: first * STEP_HZ, admittance, harmonics }
                });
                let first_open = file
                    .holes
                    .iter()
                    .zip(&fingering.open)
                    .find(|&(hole, &open)| open && !hole.register)
                    .map_or_else(|| file.length_m(), |(hole, _)| hole.x_m);
                BoreNote { written: fingering.written, closed_tube_m: first_open, mode }
            })
            .collect();
        let section = PI * REFERENCE_RADIUS_M * REFERENCE_RADIUS_M;
        Self { notes, swept_s: volume_m3 / (section * air.c) }
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
        let mode = self.notes.get(fingering)?.mode.as_ref()?;
        let swept_s = self.swept_s * reed.compliance();
        let (f_hz, height) = mode.peak(swept_s)?;
        let zeta = reed.flow_strength();
        let gamma_on = threshold_gamma(height, zeta);
        if gamma_on.is_nan() || gamma_on >= 1.0 {
            return None;
        }
        let moving = reed.lips.get(fingering).map(|&lip| {
            let reed = onset::Reed { zeta, lay: reed.lay, lip, swept_s };
            onset::onset(mode, &reed, (f_hz, gamma_on))
        });
        let (onset_hz, gamma_sounding) = match moving {
            Some(found) => found.filter(|&(_, gamma)| gamma < 1.0)?,
            None => (f_hz, gamma_on),
        };
        let loss = 1.0 / (zeta * height);
        Some(Requirement {
            gamma_on,
            gamma_sounding,
            gamma_beat: (0.5 * (1.0 + loss * loss)).max(gamma_on),
            gamma_off: extinction(zeta * mode.swing(swept_s)).max(1.0),
            p_req_pa: reed.closing_pa() * gamma_on,
            onset_hz,
        })
    }
}

/// Maximum over 0 < x < 1 of `x + strength (1 - x) sqrt(x) / 2`, `strength` = zeta Z_e.
fn extinction(strength: f64) -> f64 {
    // 1 + s/2 (1/(2 r) - 3 r / 2) = 0 with r = sqrt(x): 3 r^2 - (4/s) r - 1 = 0, so r = (2/s + sqrt(4/s^2 + 3)) / 3.
    let slope = 2.0 / strength;
    let root = ((slope + (slope * slope + 3.0).sqrt()) / 3.0).min(1.0);
    root * root + 0.5 * strength * (1.0 - root * root) * root
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extinction_is_the_largest_pressure_that_still_swings() {
        for strength in [2.5, 5.0, 10.0, 15.0] {
            let searched = (1..100_000)
                .map(|n| f64::from(n) / 100_000.0)
                .map(|x| x + 0.5 * strength * (1.0 - x) * x.sqrt())
                .fold(0.0, f64::max);
            assert!((extinction(strength) - searched).abs() < 1e-8, "{strength}");
        }
        // A bore too weak to swing goes out where the reed shuts.
        assert_eq!(extinction(0.5), 1.0);
    }

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
            let mode = note.mode.as_ref().unwrap();
            for off in [0.93, 0.971, 1.0, 1.017] {
                let f_hz = off * mode.f_hz;
                let exact = bore.impedance(f_hz, &fingering.open, 0.0).inv();
                let error = (mode.admittance(f_hz).unwrap() - exact).norm() / exact.norm().max(0.02);
                assert!(error < 2e-3, "{} at {f_hz}: {error:e}", fingering.written);
            }
            let (f_hz, height) = mode.peak(requirements.swept_s).unwrap();
            let (f_exact, height_exact) =
                bore.playing_frequency(&fingering.open, file.reed_volume_m3, mode.f_hz).unwrap();
            assert!((f_hz / f_exact - 1.0).abs() < 1e-4 && (height / height_exact - 1.0).abs() < 2e-3);
        }
    }
}
