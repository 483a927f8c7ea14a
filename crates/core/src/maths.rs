//! Functions whose results have the same bits on every system.
//!
//! The standard library's call those of the system, which differ in their last bits among systems, and within one among
//! processors. A sound that is computed from them may then differ, too: a reed at its threshold makes much of little. These
//! are computed by the crate `libm` in additions, multiplications, divisions and square roots, which IEEE 754 defines to the
//! bit. In the library only these are allowed (`clippy.toml`).
//!
//! ```
//! use chalumeau_core::maths;
//!
//! assert_eq!(maths::exp2(-3.0), 0.125);
//! assert!((maths::exp(maths::ln(7.0)) - 7.0).abs() < 1e-14);
//! ```

pub use libm::{acos, asin, atan2, cos, exp, exp2, hypot, log2, log10, pow, sin, tan};

/// `exp(x) - 1`, exact for small `x`, too.
pub use libm::expm1 as exp_m1;
/// Natural logarithm.
pub use libm::log as ln;
/// Sine and cosine.
pub use libm::sincos as sin_cos;

/// In single precision.
pub mod single {
    pub use libm::{powf as pow, sincosf as sin_cos};
}

/// Of complex numbers.
///
/// ```
/// use chalumeau_core::maths::complex;
/// use num_complex::Complex64;
///
/// let z = Complex64::new(0.0, 2.0);
/// assert_eq!((complex::norm(z), complex::arg(z)), (2.0, std::f64::consts::FRAC_PI_2));
/// assert!((complex::exp(z) - complex::cis(2.0)).norm() < 1e-15);
/// ```
pub mod complex {
    use num_complex::Complex64;

    /// Absolute value, without overflow on the way.
    pub fn norm(z: Complex64) -> f64 {
        super::hypot(z.re, z.im)
    }

    /// Angle from the positive real axis, -pi..=pi rad.
    pub fn arg(z: Complex64) -> f64 {
        super::atan2(z.im, z.re)
    }

    /// `exp(j angle)`.
    pub fn cis(angle_rad: f64) -> Complex64 {
        let (sine, cosine) = super::sin_cos(angle_rad);
        Complex64::new(cosine, sine)
    }

    /// Exponential.
    pub fn exp(z: Complex64) -> Complex64 {
        super::exp(z.re) * cis(z.im)
    }

    /// The square root that does not lie left of the imaginary axis.
    ///
    /// ```
    /// use chalumeau_core::maths::complex::sqrt;
    /// use num_complex::Complex64;
    ///
    /// assert_eq!(sqrt(Complex64::new(-3.0, 4.0)), Complex64::new(1.0, 2.0));
    /// ```
    pub fn sqrt(z: Complex64) -> Complex64 {
        let half = (0.5 * (norm(z) + z.re.abs())).sqrt();
        if half == 0.0 {
            return Complex64::ZERO;
        }
        let other = 0.5 * z.im.abs() / half;
        let (re, im) = if z.re >= 0.0 { (half, other) } else { (other, half) };
        Complex64::new(re, im.copysign(z.im))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;
    use proptest::prelude::*;

    /// What both round, and no more: the two differ in the last bit or two.
    const CLOSE: f64 = 5e-16;

    proptest! {
        #[test]
        fn they_are_those_of_the_standard_library_but_for_the_last_bits(x in -20.0..20.0_f64, y in 1e-6..1e6_f64) {
            let near = |ours: f64, theirs: f64| (ours - theirs).abs() <= CLOSE * theirs.abs().max(f64::MIN_POSITIVE);
            prop_assert!(near(exp(x), x.exp()) && near(exp2(x), x.exp2()) && near(ln(y), y.ln()));
            prop_assert!(near(log2(y), y.log2()) && near(log10(y), y.log10()) && near(pow(y, 0.1 * x), y.powf(0.1 * x)));
            prop_assert!(near(sin(x), x.sin()) && near(cos(x), x.cos()) && near(tan(x), x.tan()));
            prop_assert!(near(exp_m1(x), x.exp_m1()) && near(hypot(x, y), x.hypot(y)) && near(atan2(x, y), x.atan2(y)));
        }

        #[test]
        fn a_complex_root_squared_is_the_number(re in -1e3..1e3_f64, im in -1e3..1e3_f64) {
            let z = Complex64::new(re, im);
            let root = complex::sqrt(z);
            prop_assert!(root.re >= 0.0 && (root * root - z).norm() <= 4.0 * CLOSE * z.norm());
            prop_assert!((root - z.sqrt()).norm() <= 4.0 * CLOSE * root.norm());
        }
    }
}
