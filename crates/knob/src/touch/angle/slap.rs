//! Strength of a tongue slap that a knob reports. The link to the knob detects each slap once.

use chalumeau_core::units::clamped_or;

/// Speed of the hardest slap, rad/s: what a knob may turn at before it is switched off.
const FULL_SPEED_RAD_S: f32 = 60.0;
/// Softest slap: below this nothing would be heard (by judgement).
const LEAST_STRENGTH: f32 = 0.05;

/// Strength, 0..=1, of a slap with this peak speed in the slap region, rad/s of either sign. Real-time safe.
pub fn slap_strength(speed_rad_s: f32) -> f32 {
    let unit = speed_rad_s.abs() / FULL_SPEED_RAD_S;
    clamped_or(unit, LEAST_STRENGTH, 1.0, LEAST_STRENGTH)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faster_is_harder_within_bounds() {
        assert_eq!(slap_strength(-30.0), 0.5);
        assert_eq!(slap_strength(30.0), 0.5);
        assert_eq!((slap_strength(0.0), slap_strength(1e9)), (0.05, 1.0));
        assert_eq!((slap_strength(f32::NAN), slap_strength(f32::INFINITY)), (0.05, 0.05));
    }
}
