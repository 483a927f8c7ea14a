//! A way from 0 to 1 without a corner at either end.

/// Where one is on the way, 0..=1, with a slope of 0 at both ends; before and behind it stays at 0 and 1. Real-time safe.
///
/// ```
/// use chalumeau_core::dsp::smooth::smooth;
///
/// assert_eq!([-1.0, 0.0, 0.5, 1.0, 2.0].map(smooth), [0.0, 0.0, 0.5, 1.0, 1.0]);
/// ```
#[inline(always)]
pub fn smooth(way: f64) -> f64 {
    let way = way.clamp(0.0, 1.0);
    way * way * (3.0 - 2.0 * way)
}

/// [`smooth`] in single precision.
#[inline(always)]
pub fn smooth_single(way: f32) -> f32 {
    let way = way.clamp(0.0, 1.0);
    way * way * (3.0 - 2.0 * way)
}
