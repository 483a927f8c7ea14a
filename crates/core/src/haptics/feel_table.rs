//! From what each note requires to what the hand feels: the parameters for the knob and the maps from angle to mouth
//! pressure, for all notes at once.
//!
//! One number describes a note: `P / P_ref`, its required pressure over that of the reference note. The torque is
//! `(P / P_ref)^Contrast` times as strong, the felt threshold `A_on` lies at `(P / P_ref)^Place` times the angle. Exponents of 1
//! give the physical differences. A higher Contrast exaggerates them for the hand, because their true spread (4 to 19 %) is
//! close to the smallest difference that hands can tell apart; a higher Place also moves where notes speak. Under the flow law
//! the threshold is the peak of the law, so closure lies at `3 A_on`. Under the pressure law closure is the angle at which the
//! resting reed would shut, the same for every note.
//!
//! A feel that a device would refuse is refused here, with numbers and a way out. Nothing is clipped.

use crate::haptics::angle_map::AngleMap;
use crate::haptics::feel_design::{FeelDesign, NoteOrder};
use crate::haptics::feel_parameters::{Feel, STRETCH, TorqueLaw};
use crate::haptics::feel_refused::FeelRefused;
use crate::haptics::played_reed::PlayedReed;
use crate::haptics::requirement::{NoteRequirement, RequirementSolver};
use crate::haptics::torque_law;
use crate::haptics::torque_law::TorqueExtremes;
use crate::haptics::torque_limits::TorqueLimits;
use crate::maths;
use crate::reed::physical::{P_REF_PA, ZETA_REFERENCE};
use crate::units::WrittenNote;

/// Reference note of an instrument that has it: written C5.
const REFERENCE_NOTE: WrittenNote = WrittenNote(72);

/// Largest H k, and farthest closure, degrees, in the protocol and the firmware.
const CLOSING_MAX: f64 = 10.0;
const CLOSURE_MAX_DEG: f64 = 3_600.0;
/// Largest felt threshold over closure, so that some travel is left to play in (by judgement).
const START_TO_CLOSURE: f64 = 0.95;
/// H and k of the slip in the last line of the reference notebook, sqrt(27 / 2) for sqrt(27) / 2, and the relative distance
/// within which they are recognised.
const SLIP: (f64, f64) = (3.674_234_614_174_767, 0.136_082_763_487_954_2);
const SLIP_NEAR: f64 = 1e-4;

/// Where a note starts, beats, closes and stops on the knob, degrees from rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Landmarks {
    /// Felt threshold: the sound starts here.
    pub a_on_deg: f64,
    /// The reed begins to touch the lay.
    pub a_beat_deg: f64,
    /// The pressure here would shut the resting reed.
    pub a_close_deg: f64,
    /// Extinction: beyond it a shut reed no longer sounds.
    pub a_off_deg: f64,
}

/// The feel of one note.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoteFeel {
    /// The note as it is written.
    pub written: WrittenNote,
    /// The parameters for the knob. The sender sets `feel_id`.
    pub feel: Feel,
    /// Its landmarks on the knob, degrees.
    pub landmarks: Landmarks,
    /// Its map from angle to mouth pressure.
    pub map: AngleMap,
    /// What it requires; `None` for a note that cannot sound. Such a note feels like the reference note.
    pub requirement: Option<NoteRequirement>,
}

impl NoteFeel {
    /// The most torque between rest and wall, mNm, mark and friction included: what the ceiling must allow.
    pub fn most_mnm(&self) -> f64 {
        torque_law::extremes(&self.feel).torque_mnm + 0.1 * f64::from(self.feel.friction)
    }
}

/// The feel of every note of an instrument. Immutable and `Sync`: share it in an `Arc`.
///
/// Formulas and figures: `docs/feel.md`.
#[derive(Clone, Debug, PartialEq)]
pub struct FeelTable {
    notes: Box<[NoteFeel]>,
    /// Index into `notes`.
    reference: usize,
}

impl FeelTable {
    /// Computes the feel of all notes, in about 10 ms. Allocates; not for the audio thread.
    ///
    /// # Errors
    ///
    /// [`FeelRefused`] if `design` lies outside its ranges, if no note (or not the chosen reference note) sounds with this
    /// reed, or if any note would exceed the limits of the protocol or `limits`.
    pub fn new(
        bore: &RequirementSolver,
        design: &FeelDesign,
        reed: &PlayedReed,
        limits: &TorqueLimits,
    ) -> Result<Self, FeelRefused> {
        let table = Self::unlimited(bore, design, reed)?;
        refuse(&table.notes, design, limits)?;
        Ok(table)
    }

    /// The same, whatever the notes would ask of a knob; [`accepts`](Self::accepts) checks one of them.
    ///
    /// # Errors
    ///
    /// [`FeelRefused`] if `design` lies outside its ranges, or if no note (or not the chosen reference note) sounds with this reed.
    pub fn unlimited(
        bore: &RequirementSolver,
        design: &FeelDesign,
        reed: &PlayedReed,
    ) -> Result<Self, FeelRefused> {
        design.check()?;
        let (h, k, closing) = (reed.law.h(), reed.law.k(), reed.law.closing());
        if closing > CLOSING_MAX {
            return Err(FeelRefused::Closing(closing));
        }
        if (h / SLIP.0 - 1.0).abs() < SLIP_NEAR && (k / SLIP.1 - 1.0).abs() < SLIP_NEAR {
            return Err(FeelRefused::Slip);
        }
        let asked = bore.with(reed);
        let reference = reference(bore, design, reed, &asked)?;
        let Some(own) = asked.get(reference).copied().flatten() else {
            return Err(FeelRefused::Silent { zeta: reed.flow_strength() });
        };
        let standard_reed = PlayedReed::of_zeta(ZETA_REFERENCE);
        // How many degrees a pascal is belongs to the knob. The reference reed fixes it, whatever reed is played.
        let degrees_per_pa = match design.law {
            TorqueLaw::Flow => {
                let standard = bore.note(reference, &standard_reed).unwrap_or(own);
                design.travel_deg / 3.0 / standard.p_req_pa
            }
            TorqueLaw::Pressure | TorqueLaw::Free => design.travel_deg / P_REF_PA,
        };
        // The reed whose pressures lay out the travel.
        let of_travel = design.equal_travel.then(|| bore.with(&standard_reed));
        let (laid_out, travel_reed) = match &of_travel {
            Some(standard) => (standard, &standard_reed),
            None => (&asked, reed),
        };
        let p_ref_pa = laid_out[reference].map_or(own.p_req_pa, |required| required.p_req_pa);
        let a_ref_deg = degrees_per_pa * p_ref_pa;
        let felt = felt_pressures(bore, design, laid_out);
        let felt_ref = felt[reference].unwrap_or(p_ref_pa);
        let notes: Box<[NoteFeel]> = bore
            .written()
            .zip(asked.iter().zip(&felt))
            .map(|(written, (&asked, &felt))| {
                let ratio = felt.unwrap_or(felt_ref) / felt_ref;
                let a_on_deg = a_ref_deg * maths::pow(ratio, design.place);
                let a_close_deg = match design.law {
                    TorqueLaw::Flow => 3.0 * a_on_deg,
                    TorqueLaw::Pressure | TorqueLaw::Free => degrees_per_pa * travel_reed.closing_pa(),
                };
                let torque = maths::pow(ratio, design.contrast);
                note(written, asked, asked.unwrap_or(own), design, reed, (torque, a_on_deg, a_close_deg))
            })
            .collect();
        Ok(Self { notes, reference })
    }

    /// One note, by the index of its fingering in the instrument file.
    pub fn note(&self, fingering: usize) -> Option<&NoteFeel> {
        self.notes.get(fingering)
    }

    /// All notes, in the order of the fingerings in the instrument file.
    pub fn notes(&self) -> &[NoteFeel] {
        &self.notes
    }

    /// Checks a single note against other limits than those of the whole table, for a knob that gets only this note.
    /// A `fingering` that does not exist stands for the reference note.
    ///
    /// # Errors
    ///
    /// [`FeelRefused`] if the note exceeds `limits`.
    pub fn accepts(
        &self,
        fingering: usize,
        design: &FeelDesign,
        limits: &TorqueLimits,
    ) -> Result<(), FeelRefused> {
        let note = self.notes.get(fingering).unwrap_or(self.reference());
        refuse(std::slice::from_ref(note), design, limits)
    }

    /// The reference note, which Contrast and Place do not change.
    pub fn reference(&self) -> &NoteFeel {
        &self.notes[self.reference]
    }
}

/// Index of the reference note: the chosen one, else written C5, else the note of median requirement.
fn reference(
    bore: &RequirementSolver,
    design: &FeelDesign,
    reed: &PlayedReed,
    asked: &[Option<NoteRequirement>],
) -> Result<usize, FeelRefused> {
    let sounding = |written: WrittenNote| {
        bore.written().zip(asked).position(|(note, asked)| note == written && asked.is_some())
    };
    if let Some(written) = design.reference {
        return sounding(written).ok_or(FeelRefused::Reference(written));
    }
    if let Some(found) = sounding(REFERENCE_NOTE) {
        return Ok(found);
    }
    let mut by_need: Vec<(usize, f64)> = asked
        .iter()
        .enumerate()
        .filter_map(|(note, asked)| asked.map(|asked| (note, asked.p_req_pa)))
        .collect();
    by_need.sort_by(|a, b| a.1.total_cmp(&b.1));
    let middle = by_need.get(by_need.len() / 2);
    middle.map(|&(note, _)| note).ok_or(FeelRefused::Silent { zeta: reed.flow_strength() })
}

/// The pressure that each note shall seem to require, Pa: its own, or one by the length of closed tube in the same range.
fn felt_pressures(
    bore: &RequirementSolver,
    design: &FeelDesign,
    asked: &[Option<NoteRequirement>],
) -> Vec<Option<f64>> {
    let own = || asked.iter().map(|asked| asked.map(|asked| asked.p_req_pa));
    if design.order == NoteOrder::Physical {
        return own().collect();
    }
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)))
    };
    let (p_low, p_high) = range(&mut own().flatten());
    let (short, long) =
        range(&mut bore.closed_tube_m().zip(asked).filter(|(_, asked)| asked.is_some()).map(|(x, _)| x));
    bore.closed_tube_m()
        .zip(asked)
        .map(|(length, asked)| {
            let share = if long > short { (length - short) / (long - short) } else { 0.5 };
            let share = if design.order == NoteOrder::CoveredHoles { share } else { 1.0 - share };
            asked.map(|_| p_low * maths::pow(p_high / p_low, share))
        })
        .collect()
}

/// The feel of one note. `sounds_like` is its own requirement, or the reference note's for a note that cannot sound; `torque`
/// is its torque over that of the reference note.
fn note(
    written: WrittenNote,
    requirement: Option<NoteRequirement>,
    sounds_like: NoteRequirement,
    design: &FeelDesign,
    reed: &PlayedReed,
    (torque, a_on_deg, a_close_deg): (f64, f64, f64),
) -> NoteFeel {
    let p_close = reed.closing_pa();
    let a_off_deg = a_close_deg * sounds_like.gamma_off;
    let map = AngleMap::new([
        (a_on_deg, p_close * sounds_like.gamma_sounding),
        (a_close_deg, p_close),
        (a_off_deg, p_close * sounds_like.gamma_off),
    ]);
    let landmarks = Landmarks {
        a_on_deg,
        a_beat_deg: map.angle_deg(p_close * sounds_like.gamma_beat),
        a_close_deg,
        a_off_deg,
    };
    let (h, k) = (reed.law.h(), reed.law.k());
    // A free knob makes no torque, whatever the strength.
    let scale_mnm = if design.law == TorqueLaw::Free { 0.0 } else { design.strength_mnm * torque };
    let feel = Feel {
        feel_id: 0,
        law: design.law,
        morph_ms: design.morph_ms,
        h: h as f32,
        k: k as f32,
        scale_mnm: scale_mnm as f32,
        stretch: (360.0 * h * k / a_close_deg) as f32,
        offset_deg: 0.0,
        a_on_deg: a_on_deg as f32,
        a_off_deg: a_off_deg as f32,
        a_beat_deg: landmarks.a_beat_deg as f32,
        wall_deg: (design.wall_share * a_close_deg) as f32,
        wall_mnm_per_deg: design.wall_mnm_per_deg as f32,
        slap_mnm_per_deg: design.slap_mnm_per_deg as f32,
        damping_mnms: design.damping_mnms as f32,
        friction: (10.0 * design.friction_mnm).round() as u16,
        detent: (10.0 * design.mark_mnm()).round() as u16,
    };
    NoteFeel { written, feel, landmarks, map, requirement }
}

/// Refuses the notes if any of them exceeds what the knob accepts.
fn refuse(notes: &[NoteFeel], design: &FeelDesign, limits: &TorqueLimits) -> Result<(), FeelRefused> {
    let extremes: Vec<(WrittenNote, f64, TorqueExtremes)> = notes
        .iter()
        .map(|note| (note.written, note.landmarks.a_close_deg, torque_law::extremes(&note.feel)))
        .collect();
    let worst = |value: fn(f64, &TorqueExtremes) -> f64| {
        let each = extremes.iter().map(|(note, close_deg, extremes)| (*note, value(*close_deg, extremes)));
        each.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((WrittenNote(0), 0.0))
    };
    let (note, wanted_deg) = worst(|close_deg, _| close_deg);
    // The stretch of the law has a least value, too.
    let longest_deg = |note: &NoteFeel| 360.0 * f64::from(note.feel.h * note.feel.k / STRETCH.low);
    let limit_deg = notes.iter().map(longest_deg).fold(CLOSURE_MAX_DEG, f64::min);
    if wanted_deg > limit_deg {
        return Err(FeelRefused::Travel { note, wanted_deg, limit_deg });
    }
    // Under the pressure law closure stays where it is while Place moves the threshold.
    let latest = |a: &&NoteFeel, b: &&NoteFeel| a.landmarks.a_on_deg.total_cmp(&b.landmarks.a_on_deg);
    if let Some(note) = notes.iter().max_by(latest)
        && note.landmarks.a_on_deg > START_TO_CLOSURE * note.landmarks.a_close_deg
    {
        let Landmarks { a_on_deg, a_close_deg, .. } = note.landmarks;
        return Err(FeelRefused::Crossed { note: note.written, a_on_deg, a_close_deg });
    }
    let (note, peak_mnm) = worst(|_, extremes| extremes.torque_mnm);
    let (wanted_mnm, ceiling_mnm) = (peak_mnm + design.friction_mnm, limits.ceiling_mnm);
    if design.law != TorqueLaw::Free && wanted_mnm > ceiling_mnm {
        let fixed = design.mark_mnm() + design.friction_mnm;
        let share = (ceiling_mnm - fixed) / (wanted_mnm - fixed).max(1e-9);
        let strength_mnm = (design.strength_mnm * share).max(0.0).floor();
        return Err(FeelRefused::Ceiling { note, wanted_mnm, ceiling_mnm, strength_mnm });
    }
    let (note, wanted) = worst(|_, extremes| extremes.stiffness_nm_per_rad);
    if wanted > limits.stiffness_nm_per_rad {
        return Err(FeelRefused::Stiffness { note, wanted, limit: limits.stiffness_nm_per_rad });
    }
    let (note, wanted) = worst(|_, extremes| extremes.push_nm_per_rad);
    if wanted > limits.push_nm_per_rad {
        return Err(FeelRefused::Push { note, wanted, limit: limits.push_nm_per_rad });
    }
    for note in notes {
        if let Err(out_of_range) = note.feel.check() {
            return Err(FeelRefused::Field { note: note.written, out_of_range });
        }
    }
    Ok(())
}
