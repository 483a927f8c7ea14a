//! From what a note asks to what the hand feels: the messages for the knob and the maps back, for all notes at once.
//!
//! One number carries a note: `r = (P / P_ref)^Contrast`, its requirement over that of a reference note. `A_on`, the
//! felt threshold, is `r` times that of the reference note, and the torque is `r` times as strong. Contrast 1 is what
//! the bore asks; above it is *exaggeration*, because the true spread (4 to 18 %) is near what fingers can just tell
//! apart on a knob. Under the flow law the threshold is the law's own peak, so closure lies at `3 A_on`; under the
//! pressure law closure is where the resting reed would shut, the same angle for every note.
//!
//! A request a device would refuse is refused here, with numbers and a way out; nothing is clipped.

use crate::haptics::law;
use crate::haptics::law::Extremes;
use crate::haptics::map::AngleMap;
use crate::haptics::parameters::{Feel, Law};
use crate::haptics::requirement::{PlayedReed, Requirement, Requirements};
use crate::haptics::torque_limits::TorqueLimits;
use crate::reed::physical::P_REF_PA;
use crate::units::WrittenNote;

/// Embouchure of the reference reed, which fixes how many degrees a pascal is.
const REFERENCE_ZETA: f64 = 0.3;
/// Reference note where the chart has it: written C5.
const REFERENCE: WrittenNote = WrittenNote(72);

/// Largest H k, and farthest closure, degrees, that the wire and the firmware know.
const CLOSING_MAX: f64 = 10.0;
const CLOSURE_MAX_DEG: f64 = 3_600.0;
/// Nearest a felt threshold may come to closure, so that some travel is left to play in (by judgement).
const START_TO_CLOSURE: f64 = 0.95;
/// H and k of the notebook's last line, sqrt(27 / 2) for sqrt(27) / 2, and how near it is meant.
const SLIP: (f64, f64) = (3.674_234_614_174_767, 0.136_082_763_487_954_2);
const SLIP_NEAR: f64 = 1e-4;

/// Which note feels harder than which.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// By the pressure the bore asks.
    #[default]
    Physical,
    /// By the length of closed tube, as the fingers see it: the longer, the harder. Spread as wide as the physical.
    CoveredHoles,
    /// The other way round: the longer, the easier.
    CoveredHolesReversed,
}

/// How a clarinet shall feel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeelDesign {
    /// Torque law.
    pub law: Law,
    /// The note exaggeration leaves alone; `None` is written C5, or the middle of the chart where there is no C5.
    ///
    /// C5 asks nearly the most of what is played often, so that Contrast mostly takes away and the ceiling stays clear.
    pub reference: Option<WrittenNote>,
    /// 1 (physical) ..=5. Default 3.
    pub contrast: f64,
    /// Which note feels harder.
    pub order: Order,
    /// Torque per unit of flow (flow) or at closure (pressure) on the reference note, mNm, 0..=450. Default 60, of a
    /// first ceiling of 100 (by judgement).
    pub strength_mnm: f64,
    /// Angle at which the reference reed closes on the reference note, degrees, 120..=1080. Default one turn, as in
    /// TorqueTuner at stretch 1.
    pub travel_deg: f64,
    /// Damping on top of the knob's own, mNm s/rad, 0..=20. Default 1 (by judgement).
    pub damping_mnms: f64,
    /// Friction, mNm, 0..=100. Default 1 (by judgement).
    pub friction_mnm: f64,
    /// End wall over closure, 0.5..=4. Default 1.15: a little more than shut.
    pub wall_share: f64,
    /// Stiffness of the wall, mNm per degree, 0..=100. Default 5.
    pub wall_mnm_per_deg: f64,
    /// Spring of the slap region, mNm per degree, 0..=20. Default 0.5.
    pub slap_mnm_per_deg: f64,
    /// Mark at the threshold, mNm, 0..=100. `None`: none under flow, whose peak is the mark; 6 under pressure, a
    /// tenth of the strength, which a hand can just tell on a knob (by judgement).
    pub detent_mnm: Option<f64>,
    /// Time in which one note's feel gives way to the next, ms, 20..=1000. Default 30.
    pub morph_ms: u16,
}

impl Default for FeelDesign {
    fn default() -> Self {
        Self {
            law: Law::Flow,
            reference: None,
            contrast: 3.0,
            order: Order::Physical,
            strength_mnm: 60.0,
            travel_deg: 360.0,
            damping_mnms: 1.0,
            friction_mnm: 1.0,
            wall_share: 1.15,
            wall_mnm_per_deg: 5.0,
            slap_mnm_per_deg: 0.5,
            detent_mnm: None,
            morph_ms: 30,
        }
    }
}

impl FeelDesign {
    /// Height of the mark at the threshold, mNm.
    pub fn mark_mnm(&self) -> f64 {
        self.detent_mnm.unwrap_or(if self.law == Law::Pressure { 6.0 } else { 0.0 })
    }
}

/// Why a feel cannot be.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FeelRefused {
    /// A setting outside its range.
    #[error("{name} must lie in {low}..{high}, got {given}")]
    Range {
        /// Which.
        name: &'static str,
        /// What was given.
        given: f64,
        /// Least.
        low: f64,
        /// Most.
        high: f64,
    },
    /// The reference note has no fingering or does not sound.
    #[error("the reference note {0} does not sound on this instrument with this reed; choose another")]
    Reference(WrittenNote),
    /// No note of the instrument sounds.
    #[error("no note sounds with this reed: zeta {zeta:.3} is too weak for the bore; raise zeta, A or H")]
    Silent {
        /// Flow strength of the reed as it is.
        zeta: f64,
    },
    /// H k out of the wire's range.
    #[error("the reed closes at {0:.3} times the reference pressure; a knob can follow H k up to 10")]
    Closing(f64),
    /// The notebook's slip of the pen.
    #[error(
        "H = sqrt(27/2) = 3.674 with k = 0.1361 closes at half the travel and is refused as a slip: \
         the reference is H = sqrt(27)/2 = 2.598; set k apart from H if this reed is meant"
    )]
    Slip,
    /// Farther than a knob counts.
    #[error(
        "{note} would close at {wanted_deg:.0} degrees, the knob goes to {limit_deg:.0}; shorten the travel"
    )]
    Travel {
        /// Farthest note.
        note: WrittenNote,
        /// Its closure, degrees.
        wanted_deg: f64,
        /// Most, degrees.
        limit_deg: f64,
    },
    /// Exaggerated past closure.
    #[error(
        "{note} would be felt to start at {a_on_deg:.0} degrees, behind closure at {a_close_deg:.0}; \
         lower Contrast, raise zeta, or use the flow law"
    )]
    Crossed {
        /// Hardest note.
        note: WrittenNote,
        /// Its felt threshold, degrees.
        a_on_deg: f64,
        /// Its closure, degrees.
        a_close_deg: f64,
    },
    /// More torque than the ceiling.
    #[error(
        "{note} would need {wanted_mnm:.0} mNm, the ceiling is {ceiling_mnm:.0}; \
         lower the strength to {strength_mnm:.0} mNm or less, lower Contrast, or allow more torque"
    )]
    Ceiling {
        /// Hardest note.
        note: WrittenNote,
        /// Its largest torque.
        wanted_mnm: f64,
        /// What is allowed.
        ceiling_mnm: f64,
        /// Strength that would just be allowed.
        strength_mnm: f64,
    },
    /// Steeper than a sampled knob can hold still.
    #[error(
        "{note} would be as steep as {wanted:.3} N m/rad, the knob stays still up to {limit:.3}; \
         lower the strength, soften the wall, or lengthen the travel"
    )]
    Stiffness {
        /// Steepest note.
        note: WrittenNote,
        /// Its slope, N m/rad.
        wanted: f64,
        /// What is allowed, N m/rad.
        limit: f64,
    },
    /// Falls more steeply than a hand could hold.
    #[error(
        "{note} would push the hand along with {wanted:.3} N m/rad, the limit is {limit:.3}; \
         lower the strength, lengthen the travel, or use the pressure law"
    )]
    Push {
        /// Note that pushes most.
        note: WrittenNote,
        /// Its slope, N m/rad.
        wanted: f64,
        /// What is allowed, N m/rad.
        limit: f64,
    },
}

/// Where on the knob a note's events lie, degrees from rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Landmarks {
    /// Felt threshold.
    pub a_on_deg: f64,
    /// The reed begins to touch.
    pub a_beat_deg: f64,
    /// The resting reed would be shut.
    pub a_close_deg: f64,
    /// A shut reed no longer sounds.
    pub a_off_deg: f64,
}

/// Everything about one note.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoteFeel {
    /// The note.
    pub written: WrittenNote,
    /// What goes to the knob; `feel_id` is the sender's to set.
    pub feel: Feel,
    /// In degrees.
    pub landmarks: Landmarks,
    /// Angle to mouth pressure.
    pub map: AngleMap,
    /// What the bore asks; `None` for a note that cannot sound, which then feels like the reference note.
    pub requirement: Option<Requirement>,
}

/// The feel of every note of an instrument. Immutable and `Sync`: share it in an `Arc`.
#[derive(Clone, Debug, PartialEq)]
pub struct FeelTable {
    notes: Box<[NoteFeel]>,
    /// Index into `notes`.
    reference: usize,
}

impl FeelTable {
    /// Works out all notes: some 10 ms, so not on the audio thread. Allocates.
    pub fn new(
        bore: &Requirements,
        design: &FeelDesign,
        reed: &PlayedReed,
        limits: &TorqueLimits,
    ) -> Result<Self, FeelRefused> {
        check(design)?;
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
        // The angle of a pascal belongs to the knob: the reference reed fixes it, whatever reed is played.
        let degrees_per_pa = match design.law {
            Law::Flow => {
                let reed = PlayedReed::quasi_static(REFERENCE_ZETA);
                let standard = bore.note(reference, &reed).unwrap_or(own);
                design.travel_deg / 3.0 / standard.p_req_pa
            }
            Law::Pressure | Law::Free => design.travel_deg / P_REF_PA,
        };
        let a_ref_deg = degrees_per_pa * own.p_req_pa;
        let felt = felt_pressures(bore, design, &asked);
        let felt_ref = felt[reference].unwrap_or(own.p_req_pa);
        let notes: Box<[NoteFeel]> = bore
            .written()
            .zip(asked.iter().zip(&felt))
            .map(|(written, (&asked, &felt))| {
                let r = (felt.unwrap_or(felt_ref) / felt_ref).powf(design.contrast);
                let a_on_deg = a_ref_deg * r;
                let a_close_deg = match design.law {
                    Law::Flow => 3.0 * a_on_deg,
                    Law::Pressure | Law::Free => degrees_per_pa * reed.closing_pa(),
                };
                note(written, asked, asked.unwrap_or(own), design, reed, (r, a_on_deg, a_close_deg))
            })
            .collect();
        refuse(&notes, design, limits)?;
        Ok(Self { notes, reference })
    }

    /// One note, by its index in the instrument file.
    pub fn note(&self, fingering: usize) -> Option<&NoteFeel> {
        self.notes.get(fingering)
    }

    /// All notes, in the order of the instrument file.
    pub fn notes(&self) -> &[NoteFeel] {
        &self.notes
    }

    /// Whether one note keeps to limits that the whole table may not have been held to: for a knob that is told no other.
    pub fn accepts(
        &self,
        fingering: usize,
        design: &FeelDesign,
        limits: &TorqueLimits,
    ) -> Result<(), FeelRefused> {
        let note = self.notes.get(fingering).unwrap_or(self.reference());
        refuse(std::slice::from_ref(note), design, limits)
    }

    /// The note exaggeration leaves alone.
    pub fn reference(&self) -> &NoteFeel {
        &self.notes[self.reference]
    }
}

fn check(design: &FeelDesign) -> Result<(), FeelRefused> {
    for (name, given, low, high) in [
        ("Contrast", design.contrast, 1.0, 5.0),
        ("strength (mNm)", design.strength_mnm, 0.0, 450.0),
        ("travel (degrees)", design.travel_deg, 120.0, 1_080.0),
        ("damping (mNm s/rad)", design.damping_mnms, 0.0, 20.0),
        ("friction (mNm)", design.friction_mnm, 0.0, 100.0),
        ("wall (over closure)", design.wall_share, 0.5, 4.0),
        ("stiffness of the wall (mNm per degree)", design.wall_mnm_per_deg, 0.0, 100.0),
        ("spring of the slap (mNm per degree)", design.slap_mnm_per_deg, 0.0, 20.0),
        ("mark (mNm)", design.mark_mnm(), 0.0, 100.0),
        ("morph (ms)", f64::from(design.morph_ms), 20.0, 1_000.0),
    ] {
        if !(low..=high).contains(&given) {
            return Err(FeelRefused::Range { name, given, low, high });
        }
    }
    Ok(())
}

fn reference(
    bore: &Requirements,
    design: &FeelDesign,
    reed: &PlayedReed,
    asked: &[Option<Requirement>],
) -> Result<usize, FeelRefused> {
    let sounding = |written: WrittenNote| {
        bore.written().zip(asked).position(|(note, asked)| note == written && asked.is_some())
    };
    if let Some(written) = design.reference {
        return sounding(written).ok_or(FeelRefused::Reference(written));
    }
    if let Some(found) = sounding(REFERENCE) {
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

/// The pressure each note shall seem to ask, Pa: its own, or by the length of closed tube within the same spread.
fn felt_pressures(
    bore: &Requirements,
    design: &FeelDesign,
    asked: &[Option<Requirement>],
) -> Vec<Option<f64>> {
    let own = || asked.iter().map(|asked| asked.map(|asked| asked.p_req_pa));
    if design.order == Order::Physical {
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
            let way = if long > short { (length - short) / (long - short) } else { 0.5 };
            let way = if design.order == Order::CoveredHoles { way } else { 1.0 - way };
            asked.map(|_| p_low * (p_high / p_low).powf(way))
        })
        .collect()
}

/// Puts one note together. `sounds_like` is its own requirement, or the reference's for a note that has none.
fn note(
    written: WrittenNote,
    requirement: Option<Requirement>,
    sounds_like: Requirement,
    design: &FeelDesign,
    reed: &PlayedReed,
    (r, a_on_deg, a_close_deg): (f64, f64, f64),
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
    let feel = Feel {
        feel_id: 0,
        law: design.law,
        morph_ms: design.morph_ms,
        h: h as f32,
        k: k as f32,
        scale_mnm: (design.strength_mnm * r) as f32,
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

/// Holds the whole table to what the knob accepts.
fn refuse(notes: &[NoteFeel], design: &FeelDesign, limits: &TorqueLimits) -> Result<(), FeelRefused> {
    let extremes: Vec<(WrittenNote, f64, Extremes)> = notes
        .iter()
        .map(|note| (note.written, note.landmarks.a_close_deg, law::extremes(&note.feel)))
        .collect();
    let worst = |value: fn(f64, &Extremes) -> f64| {
        let each = extremes.iter().map(|(note, close_deg, extremes)| (*note, value(*close_deg, extremes)));
        each.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((WrittenNote(0), 0.0))
    };
    let (note, wanted_deg) = worst(|close_deg, _| close_deg);
    if wanted_deg > CLOSURE_MAX_DEG {
        return Err(FeelRefused::Travel { note, wanted_deg, limit_deg: CLOSURE_MAX_DEG });
    }
    // Under the pressure law closure stays where it is while Contrast moves the threshold.
    let latest = |a: &&NoteFeel, b: &&NoteFeel| a.landmarks.a_on_deg.total_cmp(&b.landmarks.a_on_deg);
    if let Some(note) = notes.iter().max_by(latest)
        && note.landmarks.a_on_deg > START_TO_CLOSURE * note.landmarks.a_close_deg
    {
        let Landmarks { a_on_deg, a_close_deg, .. } = note.landmarks;
        return Err(FeelRefused::Crossed { note: note.written, a_on_deg, a_close_deg });
    }
    let (note, peak_mnm) = worst(|_, extremes| extremes.torque_mnm);
    let (wanted_mnm, ceiling_mnm) = (peak_mnm + design.friction_mnm, limits.ceiling_mnm);
    if design.law != Law::Free && wanted_mnm > ceiling_mnm {
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
    Ok(())
}
