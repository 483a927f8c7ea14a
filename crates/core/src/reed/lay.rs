//! The curved lay: how a reed closes that rolls onto its mouthpiece.

/// How far a reed is open, over its rest opening, and how much less for more pressure: `gap` is what a straight reed would be open, which goes to 0 at
/// the closing pressure, and `half` the half-width of the parabola that takes the place of that corner, above 0.
/// Above 1 the reed lies on the curve even at rest, where it is then open by `(1 + half)^2 / (4 half)`. Real-time safe.
///
/// ```
/// use chalumeau_core::reed::lay::opening;
///
/// assert_eq!(opening(0.75, 0.5), (0.75, 1.0)); // off the curve
/// assert_eq!(opening(0.0, 0.5), (0.125, 0.5)); // where a straight reed would just be shut
/// assert_eq!(opening(-0.5, 0.5), (0.0, 0.0));
/// ```
#[inline(always)]
pub fn opening(gap: f64, half: f64) -> (f64, f64) {
    if gap >= half {
        return (gap, 1.0);
    }
    let knee = (gap + half).max(0.0);
    (knee * knee / (4.0 * half), knee / (2.0 * half))
}
