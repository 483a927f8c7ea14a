//! What a smooth curve through the recordings themselves says of a note that is left out: how smooth in pitch they are. It is no bound for a
//! rule, which plays through an instrument whose notes are not smooth in pitch.
//!
//! The logarithm of the recorded centroid is fitted over pitch without one note, and asked for that note: by polynomials, and by
//! polynomials near the note with Gaussian weights (local regression; Cleveland 1979). The best curve of all is chosen with a view to all notes, so
//! one that was chosen beforehand would do worse.

use chalumeau_core::measure::realism::{CENTROID_RATIOS, RecordedNote};
use nalgebra::{DMatrix, DVector};

/// Degrees of polynomials over the whole compass.
const DEGREES: std::ops::RangeInclusive<usize> = 0..=7;
/// Degrees near the note, and standard deviations of the weights, in steps of so many semitones.
const LOCAL_DEGREES: std::ops::RangeInclusive<usize> = 0..=2;
const WIDTHS: std::ops::Range<u8> = 6..64;
const WIDTH_STEP: f64 = 0.25;
/// Semitones that count as 1 in a polynomial, so that its powers are of one size.
const UNIT: f64 = 20.0;

/// Greatest share of these recordings, all of one dynamic, whose centroid lies within [`CENTROID_RATIOS`] of what one of the curves through the others
/// says, 0..=1.
pub(super) fn best_share(recorded: &[&RecordedNote]) -> f64 {
    let points: Vec<(f64, f64)> =
        recorded.iter().map(|note| (f64::from(note.midi), note.centroid_hz.ln())).collect();
    let whole = DEGREES.map(|degree| share(&points, degree, f64::INFINITY));
    let local = LOCAL_DEGREES.flat_map(|degree| {
        let points = &points;
        WIDTHS.map(move |width| share(points, degree, WIDTH_STEP * f64::from(width)))
    });
    whole.chain(local).fold(0.0, f64::max)
}

fn share(points: &[(f64, f64)], degree: usize, width: f64) -> f64 {
    let right = (0..points.len()).filter(|&at| {
        let ratio = (without(points, at, degree, width) - points[at].1).exp();
        (CENTROID_RATIOS.0..=CENTROID_RATIOS.1).contains(&ratio)
    });
    right.count() as f64 / points.len() as f64
}

/// What the other points say of a point; NaN if they do not suffice.
fn without(points: &[(f64, f64)], at: usize, degree: usize, width: f64) -> f64 {
    let others: Vec<(f64, f64)> = points
        .iter()
        .enumerate()
        .filter(|(other, _)| *other != at)
        .map(|(_, &(x, y))| (x - points[at].0, y))
        .collect();
    // Square roots, since squares are summed.
    let root = |x: f64| (-0.25 * (x / width).powi(2)).exp();
    let powers = DMatrix::from_fn(others.len(), degree + 1, |row, power| {
        let x = others[row].0;
        root(x) * (x / UNIT).powi(power as i32)
    });
    let wanted = DVector::from_iterator(others.len(), others.iter().map(|&(x, y)| root(x) * y));
    powers.svd(true, true).solve(&wanted, 1e-12).map_or(f64::NAN, |found| found[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_curve_is_foretold_and_a_jump_is_not() {
        let smooth: Vec<(f64, f64)> =
            (0..21).map(|n| (f64::from(n), 6.0 + 0.01 * f64::from(n * n))).collect();
        assert!((without(&smooth, 7, 2, f64::INFINITY) - smooth[7].1).abs() < 1e-9);
        assert!((without(&smooth, 7, 2, 3.0) - smooth[7].1).abs() < 1e-9);
        assert_eq!(share(&smooth, 2, f64::INFINITY), 1.0);
        let mut jumps = smooth;
        for point in jumps.iter_mut().step_by(2) {
            point.1 += 1.0;
        }
        assert!(share(&jumps, 2, f64::INFINITY) < 0.2);
    }
}
