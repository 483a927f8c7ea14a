//! What a knob accepts.

use crate::wire::message::Info;

/// A knob's own damping, N m s/rad, and the period of its loop, s: our firmware's defaults, assumed before a knob has said.
const ASSUMED: (f64, f64) = (5e-4, 1.0 / 2_000.0);

/// Limits a feel must keep: a device refuses what exceeds its own, and the host says so before it sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Most torque, mNm.
    pub ceiling_mnm: f64,
    /// Steepest restoring slope, N m/rad.
    pub stiffness_nm_per_rad: f64,
    /// Steepest positive-feedback slope, N m/rad.
    pub push_nm_per_rad: f64,
}

impl Limits {
    /// What a device declares, under a ceiling the user allows.
    pub fn of_device(info: &Info, allowed_mnm: u16) -> Self {
        Self {
            ceiling_mnm: f64::from(info.ceiling_mnm.min(allowed_mnm)),
            stiffness_nm_per_rad: 1e-3 * f64::from(info.stiffness_limit),
            push_nm_per_rad: 1e-3 * f64::from(info.push_limit),
        }
    }
}

impl Default for Limits {
    /// The first ceiling a user is offered, and the slopes our firmware accepts: `b / (2 T)` (0.5 N m/rad) towards rest,
    /// 0.2 N m/rad away from it.
    fn default() -> Self {
        let (damping, period_s) = ASSUMED;
        Self { ceiling_mnm: 100.0, stiffness_nm_per_rad: 0.5 * damping / period_s, push_nm_per_rad: 0.2 }
    }
}
