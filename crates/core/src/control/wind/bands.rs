//! The powers of a microphone's signal: of all above 40 Hz, of what is below 500 Hz and below 90 Hz; and the signal at a slow
//! rate, in which a period is looked for.

use crate::maths;

/// Rate at which a period is looked for, Hz.
pub const SLOW_HZ: f64 = 8_000.0;
/// The slow signal's flattening: the difference lifts high frequencies by 6 dB an octave, because the slope of wind noise would look
/// like a period.
const FLATTENING: f64 = 0.95;
/// Below this a filter's state is nothing: full scale is 1. Without it, denormal numbers would cost time in silence.
const NOTHING: f64 = 1e-100;

/// A filter of second order (R. Bristow-Johnson's cookbook).
#[derive(Clone, Copy, Debug)]
struct FilterCoeffs {
    b: [f64; 3],
    a: [f64; 2],
}

impl FilterCoeffs {
    /// Low or high pass of Butterworth.
    fn new(is_high: bool, corner_hz: f64, rate_hz: f64) -> Self {
        let w = std::f64::consts::TAU * (corner_hz / rate_hz).min(0.45);
        let (cos, alpha) = (maths::cos(w), maths::sin(w) * std::f64::consts::FRAC_1_SQRT_2);
        let a0 = 1.0 + alpha;
        let edge = 0.5 * if is_high { 1.0 + cos } else { 1.0 - cos };
        let middle = if is_high { -2.0 * edge } else { 2.0 * edge };
        Self { b: [edge / a0, middle / a0, edge / a0], a: [-2.0 * cos / a0, (1.0 - alpha) / a0] }
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Filter([f64; 2]);

impl Filter {
    fn tick(&mut self, FilterCoeffs { b, a }: &FilterCoeffs, x: f64) -> f64 {
        let [first, second] = &mut self.0;
        let y = b[0] * x + *first;
        *first = b[1] * x - a[0] * y + *second;
        *second = b[2] * x - a[1] * y;
        y
    }
}

/// The filters at one sample rate.
#[derive(Clone, Copy, Debug)]
pub struct BandCoeffs {
    rumble: FilterCoeffs,
    low: FilterCoeffs,
    deep: FilterCoeffs,
    slow: FilterCoeffs,
    rate_hz: f64,
    slow_hz: f64,
}

impl BandCoeffs {
    /// For a sample rate in Hz.
    pub fn new(rate_hz: f64) -> Self {
        Self {
            rumble: FilterCoeffs::new(true, 40.0, rate_hz),
            low: FilterCoeffs::new(false, 500.0, rate_hz),
            deep: FilterCoeffs::new(false, 90.0, rate_hz),
            slow: FilterCoeffs::new(false, 3_000.0, rate_hz),
            rate_hz,
            slow_hz: SLOW_HZ.min(rate_hz),
        }
    }
}

/// Filters and powers. Real-time safe.
#[derive(Clone, Debug, Default)]
pub struct Bands {
    rumble: Filter,
    low: Filter,
    deep: [Filter; 2],
    slow: [Filter; 2],
    power: [f64; 3],
    /// Time since the last slow sample, in slow samples times the rate.
    phase: f64,
    before: f64,
}

impl Bands {
    /// Takes a sample; gives one of the slow signal where one is due.
    pub fn tick(&mut self, coeffs: &BandCoeffs, sample: f64) -> Option<f32> {
        let x = self.rumble.tick(&coeffs.rumble, sample);
        let low = self.low.tick(&coeffs.low, x);
        let [first, second] = &mut self.deep;
        let deep = second.tick(&coeffs.deep, first.tick(&coeffs.deep, x));
        let [first, second] = &mut self.slow;
        let slow = second.tick(&coeffs.slow, first.tick(&coeffs.slow, x));
        for (power, y) in self.power.iter_mut().zip([x, low, deep]) {
            *power += y * y;
        }
        self.phase += coeffs.slow_hz;
        if self.phase < coeffs.rate_hz {
            return None;
        }
        self.phase -= coeffs.rate_hz;
        let flat = slow - FLATTENING * self.before;
        self.before = slow;
        Some(flat as f32)
    }

    /// The mean powers over the last `samples`.
    pub fn take_powers(&mut self, samples: u32) -> [f64; 3] {
        let filters =
            [&mut self.rumble, &mut self.low].into_iter().chain(&mut self.deep).chain(&mut self.slow);
        for state in filters.flat_map(|filter| &mut filter.0) {
            if state.abs() < NOTHING {
                *state = 0.0;
            }
        }
        std::mem::take(&mut self.power).map(|power| power / f64::from(samples))
    }
}
