//! Ranges of the fields that have one. Values outside are refused with their frame, never bent.
//!
//! Compared in binary32, as the firmware does, so that both ends agree about the last bit.

/// Closed range of one field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
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
    /// What was given.
    pub value: f32,
    /// Least value allowed.
    pub low: f32,
    /// Greatest value allowed.
    pub high: f32,
}

impl Limit {
    const fn new(field: &'static str, low: f32, high: f32) -> Self {
        Self { field, low, high }
    }

    /// Whether `value` may be sent; what is not a number may not.
    pub fn contains(self, value: f32) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// `value` itself, or why it is refused.
    pub fn check(self, value: f32) -> Result<(), OutOfRange> {
        let Self { field, low, high } = self;
        if self.contains(value) { Ok(()) } else { Err(OutOfRange { field, value, low, high }) }
    }
}

/// Time of a morph, ms.
pub const MORPH_MS: Limit = Limit::new("morph_ms", 20.0, 1_000.0);
/// Rest opening, the seed's H.
pub const H: Limit = Limit::new("h", 0.5, 10.0);
/// Stiffness, the seed's k.
pub const K: Limit = Limit::new("k", 0.01, 20.0);
/// Product H k; its lower end follows from those of H and k.
pub const H_K: Limit = Limit::new("h*k", 0.0, 10.0);
/// Torque per unit of the law, mNm.
pub const SCALE_MNM: Limit = Limit::new("scale_mnm", 0.0, 450.0);
/// TorqueTuner's Stretch.
pub const STRETCH: Limit = Limit::new("stretch", 0.1, 30.0);
/// Origin of the law, degrees.
pub const OFFSET_DEG: Limit = Limit::new("offset_deg", -360.0, 360.0);
/// Felt threshold, degrees.
pub const A_ON_DEG: Limit = Limit::new("a_on_deg", 0.0, 3_600.0);
/// Felt extinction, degrees.
pub const A_OFF_DEG: Limit = Limit::new("a_off_deg", 0.0, 36_000.0);
/// Beginning of beating, degrees.
pub const A_BEAT_DEG: Limit = Limit::new("a_beat_deg", 0.0, 3_600.0);
/// End wall, degrees.
pub const WALL_DEG: Limit = Limit::new("wall_deg", 10.0, 36_000.0);
/// Stiffness of the end wall, mNm per degree.
pub const WALL_MNM_PER_DEG: Limit = Limit::new("wall_mnm_per_deg", 0.0, 100.0);
/// Spring of the slap region, mNm per degree.
pub const SLAP_MNM_PER_DEG: Limit = Limit::new("slap_mnm_per_deg", 0.0, 20.0);
/// Damping, mNm s/rad.
pub const DAMPING_MNMS: Limit = Limit::new("damping_mnms", 0.0, 20.0);
/// Coulomb friction, 0.1 mNm.
pub const FRICTION: Limit = Limit::new("friction", 0.0, 1_000.0);
/// Mark or step at the threshold, 0.1 mNm.
pub const DETENT: Limit = Limit::new("detent", 0.0, 1_000.0);
/// Torque ceiling of ARM and ALIVE, mNm.
pub const CEILING_MNM: Limit = Limit::new("ceiling_mnm", 0.0, 450.0);
/// Angle of ZERO, 0.01 degrees.
pub const ZERO_ANGLE: Limit = Limit::new("angle", -360_000.0, 360_000.0);
/// STATE a second.
pub const RATE_HZ: Limit = Limit::new("hz", 10.0, 1_000.0);
/// Laws.
pub const LAW: Limit = Limit::new("law", 0.0, 2.0);
/// Kinds of EVENT.
pub const KIND: Limit = Limit::new("kind", 1.0, 6.0);
/// Value of EVENT: any finite number.
pub const VALUE: Limit = Limit::new("value", f32::MIN, f32::MAX);
/// Serial number of a device, never 0.
pub const SERIAL: Limit = Limit::new("serial", 1.0, u64::MAX as f32);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_belong_to_the_range_and_their_neighbours_do_not() {
        for limit in [H, K, STRETCH, OFFSET_DEG, WALL_DEG] {
            assert_eq!(limit.check(limit.low), Ok(()));
            assert_eq!(limit.check(limit.high), Ok(()));
            assert!(!limit.contains(limit.low.next_down()), "{limit:?}");
            assert!(!limit.contains(limit.high.next_up()), "{limit:?}");
        }
    }

    #[test]
    fn no_range_holds_what_is_not_finite() {
        for limit in [H, WALL_DEG, VALUE] {
            for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                assert!(limit.check(value).is_err(), "{limit:?} {value}");
            }
        }
    }

    #[test]
    fn refusal_names_field_value_and_range() {
        let text = H.check(11.0).unwrap_err().to_string();
        assert_eq!(text, "h must lie in 0.5..=10, got 11");
    }
}
