//! What a knob accepts: torque and slopes.

/// Damping of a knob, N m s/rad, and period of its control loop, s, until the knob has sent its own: the defaults of the
/// firmware in this repository.
const ASSUMED: (f64, f64) = (5e-4, 1.0 / 2_000.0);

/// Limits of torque and slope for a feel. A device refuses a feel that exceeds its own limits; the host checks before it
/// sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueLimits {
    /// Largest torque, mNm.
    pub ceiling_mnm: f64,
    /// Steepest restoring slope, N m/rad.
    pub stiffness_nm_per_rad: f64,
    /// Steepest slope that pushes the hand along, N m/rad.
    pub push_nm_per_rad: f64,
}

impl Default for TorqueLimits {
    /// The default ceiling of 100 mNm, and the slopes that the firmware accepts: `b / (2 T)` (0.5 N m/rad) for restoring
    /// torque (b damping, T period of the loop), 0.2 N m/rad for torque that pushes.
    fn default() -> Self {
        let (damping, period_s) = ASSUMED;
        Self { ceiling_mnm: 100.0, stiffness_nm_per_rad: 0.5 * damping / period_s, push_nm_per_rad: 0.2 }
    }
}
