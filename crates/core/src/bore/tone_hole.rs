//! A tone hole as a small network that is passive however its opening moves.
//!
//! Seen from the bore: the inner mass `M1` in series; to ground the compliance `C` of the chimney; behind it an ideal
//! transformer of ratio `a` (the opening, 0 closed .. 1 open), then the viscous resistance `R_s`, and the outer mass
//! `M2` in parallel with the radiation resistance `R_p`, which gives the radiated power its square-of-frequency law.
//! A transformer neither stores nor makes energy, so any movement of the opening is safe. Lengths after Dubos et al.
//! (1999) as openwind uses them; unflanged end 0.6133 b (Levine & Schwinger 1948). In a fast jet the outside loses
//! `K rho v |v| / 2` (Dalmont, Nederveen, Dubos, Ollivier, Meserette & te Sligte 2002, *Experimental determination of the equivalent
//! circuit of an open side hole: linear and non linear behaviour*, Acta Acustica united with Acustica 88, 567): a resistance proportional to the flow, refreshed every sample, and larger
//! for a hole that is only partly open.

use num_complex::Complex64;

use crate::bore::bessel::bessel_ratio;
use crate::bore::instrument_file::ToneHole;
use crate::bore::radiation::{END_CORRECTION, RESISTANCE};
use crate::maths;
use crate::units::Air;

/// Design of one hole's network, SI units (acoustic: Pa, m3/s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HoleNetwork {
    /// Inner mass and the first part of the chimney, kg/m4.
    pub m1: f64,
    /// Chimney compliance, m3/Pa.
    pub c: f64,
    /// Outer part of the chimney and end correction, kg/m4.
    pub m2: f64,
    /// Radiation resistance in parallel with `m2`, Pa s/m3.
    pub r_p: f64,
    /// Viscous resistance, Pa s/m3.
    pub r_s: f64,
    /// Opening area, m2.
    pub area_m2: f64,
    /// Whether it is a register hole.
    pub register: bool,
}

impl HoleNetwork {
    /// Network of a hole on a bore of radius `bore_radius_m`; its viscous resistance is taken at
    /// `loss_hz`, and `split` of the chimney lies before the compliance (see [`Cells`](crate::bore::cells::Cells)).
    pub fn new(hole: &ToneHole, bore_radius_m: f64, split: f64, loss_hz: f64, air: &Air) -> Self {
        let (b, h) = (hole.radius_m, hole.chimney_m);
        let area_m2 = std::f64::consts::PI * b * b;
        let d = b / bore_radius_m;
        let inner = b * (0.82 - 0.193 * d - 1.09 * d.powi(2) + 1.27 * d.powi(3) - 0.71 * d.powi(4));
        let outer = END_CORRECTION * b;
        let omega = std::f64::consts::TAU * loss_hz;
        let z = maths::complex::sqrt(Complex64::new(0.0, -omega * air.rho / air.mu)) * b;
        let mass = air.rho / area_m2;
        let series = Complex64::new(0.0, omega * mass) / (1.0 - 2.0 * bessel_ratio(z) / z);
        let viscous = series.im / (omega * mass);
        let m2 = mass * (h * (viscous - split) + outer);
        // Resistance of the end in parallel with its own mass is r0 = (0.6133^2 / 0.25) rho c / S; in parallel with the
        // larger m2 the same power is radiated by r0 (m2 / m_end)^2.
        let r_end = END_CORRECTION * END_CORRECTION / RESISTANCE * air.rho * air.c / area_m2;
        Self {
            m1: mass * (inner + split * h),
            c: area_m2 * h / (air.rho * air.c * air.c),
            m2,
            r_p: r_end * (m2 / (mass * outer)).powi(2),
            r_s: series.re * h,
            area_m2,
            register: hole.register,
        }
    }

    /// The network at one sample rate (trapezoidal rule), admittances over that of a bore of radius `nominal_radius_m`.
    pub fn coeffs(&self, rate_hz: f64, nominal_radius_m: f64, air: &Air) -> HoleCoeffs {
        let y_ref = 1.0 / air.z_c(nominal_radius_m);
        HoleCoeffs {
            r1: 2.0 * rate_hz * self.m1 * y_ref,
            gc: 2.0 * rate_hz * self.c / y_ref,
            gl: 1.0 / (2.0 * rate_hz * self.m2 * y_ref),
            gp: 1.0 / (self.r_p * y_ref),
            rs: self.r_s * y_ref,
        }
    }

    /// Resistance per flow of the jet, for pressures over `p_ref_pa` and flows over `p_ref Zc^-1`, at `K` = 1;
    /// Zc of a bore of radius `nominal_radius_m`.
    pub fn jet(&self, p_ref_pa: f64, nominal_radius_m: f64, air: &Air) -> f64 {
        let z_c = air.z_c(nominal_radius_m);
        air.rho * p_ref_pa / (2.0 * z_c * z_c * self.area_m2 * self.area_m2)
    }
}

/// Negative series length correction `t_a` of a hole (Dubos et al. 1999), m: what the bore loses in mass at the hole.
pub fn series_correction_m(radius_m: f64, bore_radius_m: f64) -> f64 {
    let d = radius_m / bore_radius_m;
    radius_m * (-0.37 + 0.087 * d) * d * d
}

/// Coeffs of a hole at one rate; dimensionless, see [`HoleNetwork::coeffs`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HoleCoeffs {
    /// Resistance of `M1`.
    pub r1: f64,
    /// Conductance of `C`.
    pub gc: f64,
    /// Conductance of `M2`.
    pub gl: f64,
    /// Conductance of `R_p`.
    pub gp: f64,
    /// Resistance `R_s`.
    pub rs: f64,
}

impl HoleCoeffs {
    /// Admittance of the discrete network at `z1 = z^-1` and opening `a`, 0 (shut)..=1 (open), over that of the
    /// nominal bore.
    pub fn admittance(&self, z1: Complex64, a: f64) -> Complex64 {
        let trapezoid = (1.0 + z1) / (1.0 - z1);
        let outside = 1.0 / (self.rs + 1.0 / (self.gl * trapezoid + self.gp));
        1.0 / (self.r1 / trapezoid + 1.0 / (self.gc / trapezoid + a * a * outside))
    }
}
