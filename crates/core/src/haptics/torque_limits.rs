//! What a knob accepts.

/// A knob's own damping, N m s/rad, and the period of its loop, s: our firmware's defaults, assumed before a knob has said.
const ASSUMED: (f64, f64) = (5e-4, 1.0 / 2_000.0);

/// TorqueLimits a feel must keep: a device refuses what exceeds its own, and the host says so before it sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueLimits {
    /// Most torque, mNm.
    pub ceiling_mnm: f64,
    /// Steepest restoring slope, N m/rad.
    pub stiffness_nm_per_rad: f64,
    /// Steepest positive-feedback slope, N m/rad.
    pub push_nm_per_rad: f64,
}

impl Default for TorqueLimits {
    /// The first ceiling a user is offered, and the slopes our firmware accepts: `b / (2 T)` (0.5 N m/rad) towards rest,
    /// 0.2 N m/rad away from it.
    fn default() -> Self {
        let (damping, period_s) = ASSUMED;
        Self { ceiling_mnm: 100.0, stiffness_nm_per_rad: 0.5 * damping / period_s, push_nm_per_rad: 0.2 }
    }
}
