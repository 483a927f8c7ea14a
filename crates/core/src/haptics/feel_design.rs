//! How a clarinet shall feel: the choices of the user, with their ranges and defaults.

use crate::haptics::feel_parameters::{HARD_CEILING_MNM, TorqueLaw};
use crate::haptics::feel_refused::FeelRefused;
use crate::units::WrittenNote;

/// What decides which note feels harder to blow than which.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NoteOrder {
    /// The pressure that the note requires: the higher, the harder.
    #[default]
    Physical,
    /// The length of closed tube above the first open hole: the longer, the harder. The spread is that of
    /// [`Physical`](Self::Physical).
    CoveredHoles,
    /// The length of closed tube, reversed: the longer, the easier.
    CoveredHolesReversed,
}

/// How a clarinet shall feel.
///
/// [`FeelTable::new`](crate::haptics::FeelTable::new) refuses a value outside the range given here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeelDesign {
    /// Torque law. Default: flow.
    pub law: TorqueLaw,
    /// The reference note, which Contrast and Place do not change. `None` is written C5, or the note of median requirement if
    /// the instrument has no C5.
    ///
    /// C5 requires nearly the most of the notes that are played often. Contrast therefore mostly lowers torque, and stays
    /// below the ceiling.
    pub reference: Option<WrittenNote>,
    /// Contrast: the exponent of the differences in torque between notes, 1 (physical) to 5. Default 3. It changes no
    /// pressure.
    pub contrast: f64,
    /// Place: the exponent of the differences in angle at which notes speak, 1 (physical) to 5. Default 1. Above 1 a hand
    /// that stays where it is blows the next note with another pressure, once it has moved.
    pub place: f64,
    /// Every note speaks and closes at the angle of the reference reed, whatever reed is played. Default false. For
    /// comparing reeds: with equal travel, a movement of the hand means the same on both.
    pub equal_travel: bool,
    /// What decides which note feels harder. Default: the physical order.
    pub order: NoteOrder,
    /// Torque per unit of flow (flow law) or at closure (pressure law) on the reference note, mNm, 0 to 450. Default 55: with
    /// mark and friction, the hardest note at Contrast 5 stays under a first ceiling of 100.
    pub strength_mnm: f64,
    /// Angle at which the reference reed closes on the reference note, degrees, 120 to 1080. Default one turn, as
    /// TorqueTuner has it at stretch 1.
    pub travel_deg: f64,
    /// Damping in addition to the knob's own, mNm s/rad, 0 to 20. Default 1 (by judgement).
    pub damping_mnms: f64,
    /// Friction, mNm, 0 to 100. Default 1 (by judgement).
    pub friction_mnm: f64,
    /// Angle of the end wall over that of closure, 0.5 to 4. Default 1.15: a little beyond closure.
    pub wall_share: f64,
    /// Stiffness of the end wall, mNm per degree, 0 to 100. Default 5.
    pub wall_mnm_per_deg: f64,
    /// Spring of the slap region, mNm per degree, 0 to 20. Default 0.5.
    pub slap_mnm_per_deg: f64,
    /// Height of the mark at the threshold, mNm, 0 to 100. `None` is 9 under the flow law and 6 under the pressure law; see
    /// [`mark_mnm`](Self::mark_mnm).
    pub detent_mnm: Option<f64>,
    /// Time in which the feel of one note changes into that of the next, ms, 20 to 1000. Default 30.
    pub morph_ms: u16,
}

impl Default for FeelDesign {
    fn default() -> Self {
        Self {
            law: TorqueLaw::Flow,
            reference: None,
            contrast: 3.0,
            place: 1.0,
            equal_travel: false,
            order: NoteOrder::Physical,
            strength_mnm: 55.0,
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
    /// Range of Contrast and of Place, from physical.
    pub const EXAGGERATION: (f64, f64) = (1.0, 5.0);
    /// Range of the strength, mNm: up to what any knob may make.
    pub const STRENGTH_MNM: (f64, f64) = (0.0, HARD_CEILING_MNM as f64);
    /// Range of the angle of closure, degrees: what a hand can turn comfortably, by judgement.
    pub const TRAVEL_DEG: (f64, f64) = (120.0, 1_080.0);
    /// Range of the mark's height, mNm.
    pub const MARK_MNM: (f64, f64) = (0.0, 100.0);

    /// Height of the mark at the threshold, mNm: `detent_mnm`, or the default of the torque law.
    ///
    /// Under the flow law the torque about the peak is flat: it stays within 12.7 % of the peak, the smallest difference that
    /// hands tell apart (Jandura and Srinivasan 1994; see `docs/feel.md`), over more than a third of the travel. A mark of 9
    /// mNm is 16 % of the default strength, so that a hand finds the threshold, and its slope is 0.13 N m/rad, below the limit
    /// of 0.2 for torque that pushes. Under the pressure law the step of 6 mNm stands on a spring that is still weak there.
    pub fn mark_mnm(&self) -> f64 {
        self.detent_mnm.unwrap_or(match self.law {
            TorqueLaw::Flow => 9.0,
            TorqueLaw::Pressure => 6.0,
            TorqueLaw::Free => 0.0,
        })
    }

    /// Whether every value lies in its range.
    pub(super) fn check(&self) -> Result<(), FeelRefused> {
        for (name, given, (low, high)) in [
            ("Contrast", self.contrast, Self::EXAGGERATION),
            ("Place", self.place, Self::EXAGGERATION),
            ("strength (mNm)", self.strength_mnm, Self::STRENGTH_MNM),
            ("travel (degrees)", self.travel_deg, Self::TRAVEL_DEG),
            ("damping (mNm s/rad)", self.damping_mnms, (0.0, 20.0)),
            ("friction (mNm)", self.friction_mnm, (0.0, 100.0)),
            ("wall (over closure)", self.wall_share, (0.5, 4.0)),
            ("stiffness of the wall (mNm per degree)", self.wall_mnm_per_deg, (0.0, 100.0)),
            ("spring of the slap (mNm per degree)", self.slap_mnm_per_deg, (0.0, 20.0)),
            ("mark (mNm)", self.mark_mnm(), Self::MARK_MNM),
            ("morph (ms)", f64::from(self.morph_ms), (20.0, 1_000.0)),
        ] {
            if !(low..=high).contains(&given) {
                return Err(FeelRefused::Range { name, given, low, high });
            }
        }
        Ok(())
    }
}
