//! Ranges of the fields that have one. A value outside is refused with its frame, never clamped.

pub use chalumeau_core::haptics::feel_parameters::*;

/// Torque ceiling of ARM and ALIVE, mNm.
pub const CEILING_MNM: FieldRange = FieldRange::new("ceiling_mnm", 0.0, HARD_CEILING_MNM as f32);
/// Angle of ZERO, 0.01 degrees.
pub const ZERO_ANGLE: FieldRange = FieldRange::new("angle", -360_000.0, 360_000.0);
/// STATE a second.
pub const RATE_HZ: FieldRange = FieldRange::new("hz", 10.0, 1_000.0);
/// Laws.
pub const LAW: FieldRange = FieldRange::new("law", 0.0, 2.0);
/// Kinds of EVENT.
pub const KIND: FieldRange = FieldRange::new("kind", 1.0, 6.0);
/// Value of EVENT: any finite number.
pub const VALUE: FieldRange = FieldRange::new("value", f32::MIN, f32::MAX);
/// Serial number of a device, never 0.
pub const SERIAL: FieldRange = FieldRange::new("serial", 1.0, u64::MAX as f32);
