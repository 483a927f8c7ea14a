//! Sound radiation from an open end: bell and tone holes as unflanged pipes (Levine & Schwinger 1948).
//!
//! Lattice and transfer matrices take the same: a conductance beside a mass, which is the Pade form that openwind uses and has the
//! low-frequency limit of the exact solution.

use num_complex::Complex64;

use crate::units::Air;

/// Length correction of an unflanged end over its radius.
pub const END_CORRECTION: f64 = 0.6133;
/// Radiation resistance of an unflanged end over `(k r)^2` and its characteristic impedance.
pub const RESISTANCE: f64 = 0.25;

/// `ka` above which an unflanged end gives less power than a point of the same flow: by 3 dB here, then by 6 dB an octave.
/// That is the real part of its impedance below.
pub const BELL_CORNER: f64 = END_CORRECTION / RESISTANCE;

/// Radiation impedance of an unflanged pipe of `radius_m` at `omega` rad/s, Pa s/m3.
pub(super) fn impedance(omega: f64, radius_m: f64, air: &Air) -> Complex64 {
    let kr = omega * radius_m / air.c;
    let below = Complex64::new(1.0 / END_CORRECTION, kr * RESISTANCE / (END_CORRECTION * END_CORRECTION));
    Complex64::new(0.0, 1.0) * kr * air.z_c(radius_m) / below
}
