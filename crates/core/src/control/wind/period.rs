//! Whether a signal has a period, by the normalised square difference of McLeod & Wyvill (A Smarter Way to Find Pitch, 2005).

/// Samples that are looked at, at [`SLOW_HZ`](super::bands::SLOW_HZ): two periods of a low voice.
const WINDOW: usize = 256;
/// Periods of voices, samples: 80 to 400 Hz.
const PERIODS: std::ops::RangeInclusive<usize> = 20..=100;

/// The last 32 ms. Real-time safe.
#[derive(Clone, Debug)]
pub struct PeriodFinder {
    window: [f32; WINDOW],
    at: usize,
}

impl Default for PeriodFinder {
    fn default() -> Self {
        Self { window: [0.0; WINDOW], at: 0 }
    }
}

impl PeriodFinder {
    /// Takes a sample.
    pub fn push(&mut self, sample: f32) {
        self.window[self.at] = sample;
        self.at = (self.at + 1) % WINDOW;
    }

    /// How periodic the last samples are: 1 for a period that repeats, about 0 for noise.
    pub fn periodicity(&self) -> f64 {
        let mut ordered = [0.0; WINDOW];
        let (last, first) = self.window.split_at(self.at);
        ordered[..first.len()].copy_from_slice(first);
        ordered[first.len()..].copy_from_slice(last);
        let likeness = |lag: usize| {
            let (mut product, mut squares) = (0.0, 1e-12);
            for (&a, &b) in ordered.iter().zip(&ordered[lag..]) {
                let (a, b) = (f64::from(a), f64::from(b));
                product += a * b;
                squares += a * a + b * b;
            }
            2.0 * product / squares
        };
        PERIODS.map(likeness).fold(0.0, f64::max)
    }
}
