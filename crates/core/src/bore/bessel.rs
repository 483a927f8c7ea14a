//! The ratio of Bessel functions of which boundary layers in tubes are made.

use crate::maths;
use num_complex::Complex64;

/// J1(z)/J0(z) for complex z of moderate size (both parts below about 1e4), what boundary layers in tubes are made of;
/// relative error below 1e-13 away from its poles on the real axis.
///
/// Up to |z| = 25 the continued fraction 1/(2/z - 1/(4/z - ...)) by the method of Lentz; beyond, the Hankel expansions
/// of both functions (DLMF 10.10.1 and 10.17.5/6), of which one exponential is left far from the real axis.
pub fn bessel_ratio(z: Complex64) -> Complex64 {
    const CROSSOVER: f64 = 25.0;
    if z.re < 0.0 {
        return -bessel_ratio(-z);
    }
    if z.im > 0.0 {
        return bessel_ratio(z.conj()).conj();
    }
    if maths::complex::norm(z) < CROSSOVER { ratio_by_fraction(z) } else { ratio_by_expansion(z) }
}

fn ratio_by_fraction(z: Complex64) -> Complex64 {
    if z == Complex64::ZERO {
        return z;
    }
    const TINY: Complex64 = Complex64::new(1e-300, 0.0);
    let safe = |value: Complex64| if value == Complex64::ZERO { TINY } else { value };
    let two_over_z = 2.0 / z;
    // Denominator of 1 / (2/z - 1/(4/z - 1/(6/z - ...))).
    let mut fraction = two_over_z;
    let mut c = fraction;
    let mut d = Complex64::ZERO;
    for k in 2..200 {
        let b = two_over_z * f64::from(k);
        d = safe(b - d).inv();
        c = safe(b - c.inv());
        let change = c * d;
        fraction *= change;
        if (change - 1.0).norm_sqr() < 1e-31 {
            break;
        }
    }
    safe(fraction).inv()
}

/// For Re z >= 0, Im z <= 0, |z| >= 25.
fn ratio_by_expansion(z: Complex64) -> Complex64 {
    // Sums of (+-j)^k a_k(order) / z^k.
    let step = Complex64::I / (8.0 * z);
    let sums = |order: f64| {
        let (mut plus, mut minus, mut term) = (Complex64::ONE, Complex64::ONE, Complex64::ONE);
        for k in 1..30 {
            let odd = f64::from(2 * k - 1);
            term *= step * ((4.0 * order * order - odd * odd) / f64::from(k));
            plus += term;
            minus += if k % 2 == 0 { term } else { -term };
            if term.norm_sqr() < 1e-34 {
                break;
            }
        }
        (plus, minus)
    };
    let ((plus_0, minus_0), (plus_1, minus_1)) = (sums(0.0), sums(1.0));
    // exp(-2j(z - pi/4)), at most 1 in this quadrant.
    let other = Complex64::I * maths::complex::exp(-2.0 * Complex64::I * z);
    Complex64::I * (other * minus_1 - plus_1) / (plus_0 + other * minus_0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against mpmath (30 digits).
    #[test]
    fn bessel_ratio_is_that_of_mpmath() {
        let cases = [
            ([0.001, -0.001], [0.0004999998749999583, -0.0005000001249999583]),
            ([0.5, -0.5], [0.23319357751878375, -0.2642214402469063]),
            ([1.7, -1.7], [0.23226879711986625, -0.8717393191227187]),
            ([5.0, -5.0], [0.052799806066648934, -0.9503859560201866]),
            ([14.0, -14.0], [0.018187295266211895, -0.9821556086241254]),
            ([17.6, -17.6], [0.014412011792797441, -0.9858017251067006]),
            ([17.8, -17.8], [0.014247712409359226, -0.9859611115841213]),
            ([40.0, -40.0], [0.006289550252139817, -0.9937505078493043]),
            ([300.0, -300.0], [0.000834028935164107, -0.9991666678301231]),
            ([3.0, 0.5], [-0.6234172132514337, 0.9799427079362115]),
            ([26.0, -2.0], [0.024561779419476154, -0.9631629653806216]),
            ([30.0, 0.3], [1.0913838647660885, 0.7164690670813585]),
            ([-4.0, -4.0], [-0.06688225859811267, -0.9375597736008432]),
            ([17.5, 17.7], [0.01433093766363248, 0.9857190879710848]),
        ];
        for ([re, im], [expected_re, expected_im]) in cases {
            let (got, expected) =
                (bessel_ratio(Complex64::new(re, im)), Complex64::new(expected_re, expected_im));
            let error = (got - expected).norm() / expected.norm();
            assert!(error < 1e-13, "{re} {im}: {got}, {expected}, relative error {error:e}");
        }
        assert_eq!(bessel_ratio(Complex64::ZERO), Complex64::ZERO);
    }
}
