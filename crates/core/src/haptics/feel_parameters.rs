//! The parameters that shape a knob's torque, one set for each note, and the range of each.
//!
//! The knob computes its torque from these; `docs/protocol.md` specifies the same fields as bytes. Ranges are compared in
//! binary32, as the firmware does, so that both ends agree to the last bit.

use crate::reed::law::{H_INIT, K_INIT};

/// Most torque that any knob may make, mNm: the nominal force of the TorqueTuner, compiled into its firmware as well.
pub const HARD_CEILING_MNM: u16 = 450;

/// Range of one field, both ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldRange {
    /// Name of the field in `docs/protocol.md`.
    pub field: &'static str,
    /// Least value allowed.
    pub low: f32,
    /// Greatest value allowed.
    pub high: f32,
}

/// A field that lies outside its range, or is not a finite number.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{field} must lie in {low}..={high}, got {value}")]
pub struct OutOfRange {
    /// Name of the field in `docs/protocol.md`.
    pub field: &'static str,
    /// The value given.
    pub value: f32,
    /// Least value allowed.
    pub low: f32,
    /// Greatest value allowed.
    pub high: f32,
}

impl FieldRange {
    /// A range from `low` to `high`, both included.
    pub const fn new(field: &'static str, low: f32, high: f32) -> Self {
        Self { field, low, high }
    }

    /// Whether `value` lies in the range. NaN does not.
    pub fn contains(self, value: f32) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// Refuses a `value` outside the range.
    pub fn check(self, value: f32) -> Result<(), OutOfRange> {
        let Self { field, low, high } = self;
        if self.contains(value) { Ok(()) } else { Err(OutOfRange { field, value, low, high }) }
    }
}

/// Which torque law the knob follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum TorqueLaw {
    /// No torque but friction and damping.
    #[default]
    Free = 0,
    /// The flow of the reference notebook: rises to the threshold, falls to zero at closure.
    Flow = 1,
    /// A spring with a step at the threshold. A hand holds an angle more easily than under the flow law.
    Pressure = 2,
}

/// The feel of one note, as it is sent to the knob. [`torque_law`](crate::haptics::torque_law) gives its torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feel {
    /// Number of this feel; the knob repeats it in STATE once it has accepted the feel.
    pub feel_id: u8,
    /// Torque law.
    pub law: TorqueLaw,
    /// Time in which the torque changes from the old feel to this one, ms, 20..=1000.
    pub morph_ms: u16,
    /// Rest opening H of the reference law, 0.5..=10.
    pub h: f32,
    /// Stiffness k of the reference law, 0.01..=20.
    pub k: f32,
    /// Torque per unit of flow (flow law) or at closure (pressure law), mNm, 0..=450.
    pub scale_mnm: f32,
    /// Scale of the angle, 0.1..=30: with H k = 1 the law closes at 360 / stretch degrees.
    pub stretch: f32,
    /// Angle of the origin of the law, degrees, -360..=360.
    pub offset_deg: f32,
    /// Felt threshold, where the sound starts, degrees, 0..=3600.
    pub a_on_deg: f32,
    /// Felt extinction, degrees, 0..=36000.
    pub a_off_deg: f32,
    /// Angle at which the reed begins to beat, degrees, 0..=3600.
    pub a_beat_deg: f32,
    /// End wall, degrees, 10..=36000.
    pub wall_deg: f32,
    /// Stiffness of the end wall, mNm per degree, 0..=100.
    pub wall_mnm_per_deg: f32,
    /// Spring of the slap region below -100 degrees, mNm per degree, 0..=20.
    pub slap_mnm_per_deg: f32,
    /// Damping in addition to the knob's own, mNm s/rad, 0..=20.
    pub damping_mnms: f32,
    /// Smooth Coulomb friction, 0.1 mNm, 0..=1000.
    pub friction: u16,
    /// Height of the mark at `a_on` (flow) or of the step there (pressure), 0.1 mNm, 0..=1000.
    pub detent: u16,
}

/// No torque: law free, no friction, walls without stiffness. H and k are those of the reference (H k = 1). The landmarks
/// are those of a lossless reed on one turn: threshold at a third of the closing angle, beating from half of it.
impl Default for Feel {
    fn default() -> Self {
        Self {
            feel_id: 0,
            law: TorqueLaw::Free,
            morph_ms: 50,
            h: H_INIT as f32,
            k: K_INIT as f32,
            scale_mnm: 0.0,
            stretch: 1.0,
            offset_deg: 0.0,
            a_on_deg: 120.0,
            a_off_deg: 360.0,
            a_beat_deg: 180.0,
            wall_deg: 400.0,
            wall_mnm_per_deg: 0.0,
            slap_mnm_per_deg: 0.0,
            damping_mnms: 0.0,
            friction: 0,
            detent: 0,
        }
    }
}

impl Feel {
    /// Refuses a feel with a field, or a product H k, outside its range. A device also refuses slopes that are too steep and
    /// torque above its own ceiling; see [`torque_law::extremes`](crate::haptics::torque_law::extremes).
    pub fn check(&self) -> Result<(), OutOfRange> {
        MORPH_MS.check(self.morph_ms.into())?;
        H.check(self.h)?;
        K.check(self.k)?;
        H_K.check(self.h * self.k)?;
        SCALE_MNM.check(self.scale_mnm)?;
        STRETCH.check(self.stretch)?;
        OFFSET_DEG.check(self.offset_deg)?;
        A_ON_DEG.check(self.a_on_deg)?;
        A_OFF_DEG.check(self.a_off_deg)?;
        A_BEAT_DEG.check(self.a_beat_deg)?;
        WALL_DEG.check(self.wall_deg)?;
        WALL_MNM_PER_DEG.check(self.wall_mnm_per_deg)?;
        SLAP_MNM_PER_DEG.check(self.slap_mnm_per_deg)?;
        DAMPING_MNMS.check(self.damping_mnms)?;
        FRICTION.check(self.friction.into())?;
        DETENT.check(self.detent.into())
    }
}

/// Time in which the torque changes from one feel to the next, ms.
pub const MORPH_MS: FieldRange = FieldRange::new("morph_ms", 20.0, 1_000.0);
/// Rest opening H of the reference law.
pub const H: FieldRange = FieldRange::new("h", 0.5, 10.0);
/// Stiffness k of the reference law.
pub const K: FieldRange = FieldRange::new("k", 0.01, 20.0);
/// Product H k. The ranges of H and k imply its lower end.
pub const H_K: FieldRange = FieldRange::new("h*k", 0.0, 10.0);
/// Torque per unit of flow (flow law) or at closure (pressure law), mNm.
pub const SCALE_MNM: FieldRange = FieldRange::new("scale_mnm", 0.0, HARD_CEILING_MNM as f32);
/// Scale of the angle, TorqueTuner's Stretch.
pub const STRETCH: FieldRange = FieldRange::new("stretch", 0.1, 30.0);
/// Origin of the law, degrees.
pub const OFFSET_DEG: FieldRange = FieldRange::new("offset_deg", -360.0, 360.0);
/// Felt threshold, degrees.
pub const A_ON_DEG: FieldRange = FieldRange::new("a_on_deg", 0.0, 3_600.0);
/// Felt extinction, degrees.
pub const A_OFF_DEG: FieldRange = FieldRange::new("a_off_deg", 0.0, 36_000.0);
/// Angle at which the reed begins to beat, degrees.
pub const A_BEAT_DEG: FieldRange = FieldRange::new("a_beat_deg", 0.0, 3_600.0);
/// End wall, degrees.
pub const WALL_DEG: FieldRange = FieldRange::new("wall_deg", 10.0, 36_000.0);
/// Stiffness of the end wall, mNm per degree.
pub const WALL_MNM_PER_DEG: FieldRange = FieldRange::new("wall_mnm_per_deg", 0.0, 100.0);
/// Spring of the slap region, mNm per degree.
pub const SLAP_MNM_PER_DEG: FieldRange = FieldRange::new("slap_mnm_per_deg", 0.0, 20.0);
/// Damping in addition to the knob's own, mNm s/rad.
pub const DAMPING_MNMS: FieldRange = FieldRange::new("damping_mnms", 0.0, 20.0);
/// Smooth Coulomb friction, 0.1 mNm.
pub const FRICTION: FieldRange = FieldRange::new("friction", 0.0, 1_000.0);
/// Height of the mark (flow law) or step (pressure law) at the threshold, 0.1 mNm.
pub const DETENT: FieldRange = FieldRange::new("detent", 0.0, 1_000.0);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_belong_to_the_range_and_their_neighbours_do_not() {
        for range in [H, K, STRETCH, OFFSET_DEG, WALL_DEG] {
            assert_eq!(range.check(range.low), Ok(()));
            assert_eq!(range.check(range.high), Ok(()));
            assert!(!range.contains(range.low.next_down()), "{range:?}");
            assert!(!range.contains(range.high.next_up()), "{range:?}");
        }
    }

    #[test]
    fn no_range_holds_what_is_not_finite() {
        for range in [H, WALL_DEG, SCALE_MNM] {
            for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                assert!(range.check(value).is_err(), "{range:?} {value}");
            }
        }
    }

    #[test]
    fn refusal_names_field_value_and_range() {
        let text = H.check(11.0).unwrap_err().to_string();
        assert_eq!(text, "h must lie in 0.5..=10, got 11");
    }

    #[test]
    fn feel_at_rest_is_allowed_and_makes_no_torque() {
        let feel = Feel::default();
        assert_eq!(feel.check(), Ok(()));
        assert_eq!((feel.law, feel.scale_mnm, feel.wall_mnm_per_deg), (TorqueLaw::Free, 0.0, 0.0));
        assert!((feel.h * feel.k - 1.0).abs() < 1e-6);
    }

    #[test]
    fn product_of_h_and_k_is_limited_though_each_is_allowed() {
        let feel = Feel { h: 10.0, k: 2.0, ..Feel::default() };
        let error = feel.check().unwrap_err();
        assert_eq!((error.field, error.value, error.high), ("h*k", 20.0, 10.0));
    }
}
