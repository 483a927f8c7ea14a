//! White noise with a seed, so that every render repeats.

/// From a number of the generator, taken as signed, to white noise of variance 1.
pub const UNIT: f64 = 1.732_050_807_568_877_2 / (1_u64 << 63) as f64;

/// The number after this one: a linear congruential generator (Knuth, The Art of Computer Programming 2, 3.3.4: MMIX). Its upper
/// bits are heard, uniform. Real-time safe.
#[inline(always)]
pub const fn next(random: u64) -> u64 {
    random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407)
}

/// Numbers without a pattern that can be heard.
#[derive(Clone, Copy, Debug)]
pub struct White(u64);

impl White {
    /// From a seed; any will do.
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next number, uniform, with mean 0 and variance 1. Real-time safe.
    #[expect(clippy::should_implement_trait, reason = "it never ends")]
    pub fn next(&mut self) -> f64 {
        self.0 = next(self.0);
        UNIT * (self.0 as i64) as f64
    }

    /// The next number, uniform in 0..1. Real-time safe.
    pub fn unit(&mut self) -> f64 {
        self.0 = next(self.0);
        // All that a double has room for.
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_has_no_mean_the_variance_of_1_and_no_memory() {
        let mut white = White::new(1);
        let all: Vec<f64> = (0..100_000).map(|_| white.next()).collect();
        let mean = |f: &dyn Fn(usize) -> f64| (1..all.len()).map(f).sum::<f64>() / (all.len() - 1) as f64;
        assert!(mean(&|n| all[n]).abs() < 0.01);
        assert!((mean(&|n| all[n] * all[n]) - 1.0).abs() < 0.01);
        assert!(mean(&|n| all[n] * all[n - 1]).abs() < 0.01);
        let units: Vec<f64> = (0..100_000).map(|_| white.unit()).collect();
        assert!(units.iter().all(|unit| (0.0..1.0).contains(unit)));
        assert!((units.iter().sum::<f64>() / 1e5 - 0.5).abs() < 0.005);
    }
}
