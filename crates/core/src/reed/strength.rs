//! Reed strength as printed on the box, and the stiffness it means.

use crate::maths;

/// The strength of the reference reed.
pub const REFERENCE_STRENGTH: f64 = 2.5;
/// Stiffness per half number, as a factor (makers' charts, by judgement).
const PER_HALF_NUMBER: f64 = 1.2;

/// Stiffness of a reed of this strength over the reference reed's.
///
/// ```
/// use chalumeau_core::reed::strength::stiffness;
///
/// assert!((stiffness(2.5) - 1.0).abs() < 1e-12);
/// assert!((stiffness(3.0) - 1.2).abs() < 1e-12);
/// ```
pub fn stiffness(strength: f64) -> f64 {
    maths::pow(PER_HALF_NUMBER, 2.0 * (strength - REFERENCE_STRENGTH))
}

/// Strength of a reed that is `stiffer` times as stiff as the reference; inverse of [`stiffness`].
pub fn of_stiffness(stiffer: f64) -> f64 {
    REFERENCE_STRENGTH + 0.5 * maths::ln(stiffer) / maths::ln(PER_HALF_NUMBER)
}
