//! Breath noise: turbulence of the jet through the reed channel, white noise between two corners that rides on the flow.

use super::control_tick::TICK;

/// Noise at amount 1: rms of the noise flow over the mean flow it rides on (by level: -40 dB under a mezzo-forte
/// fundamental at the default 0.3).
const NOISE_FLOW: f64 = 0.018;
/// Below this flow the jet is laminar and quiet: a Reynolds number of 25 in a channel 13 mm wide, about a hundredth of
/// the flow in a soft note. After the breath has ended, the flow in the bore decays only as 1 / t; it must not hiss.
const LAMINAR_FLOW: f64 = 0.002;
/// Corners of the noise band, Hz: turbulence in the channel is broad around a few kHz (physics notes, by judgement).
const NOISE_BAND_HZ: (f64, f64) = (600.0, 5_000.0);
/// Seed of the noise: any constant does; with a constant, renders repeat.
const NOISE_SEED: u64 = 0x9E37_79B9_7F4A_7C15;

/// The noise of one voice. Flows are over those of the reference reed.
pub(super) struct BreathNoise {
    /// Noise flow over mean flow.
    strength: f64,
    random: u64,
    low: f64,
    band: f64,
    /// Coefficients of the two corners.
    corners: (f64, f64),
    hiss: [f64; TICK],
}

impl BreathNoise {
    /// Silent, at a sample rate in Hz.
    pub fn new(rate_hz: f64) -> Self {
        let corner = |hz: f64| 1.0 - (-std::f64::consts::TAU * hz / rate_hz).exp();
        Self {
            strength: 0.0,
            random: NOISE_SEED,
            low: 0.0,
            band: 0.0,
            corners: (corner(NOISE_BAND_HZ.0), corner(NOISE_BAND_HZ.1)),
            hiss: [0.0; TICK],
        }
    }

    /// Starts the noise again from its seed.
    pub fn reset(&mut self) {
        (self.low, self.band) = (0.0, 0.0);
        self.random = NOISE_SEED;
    }

    /// Turbulence of the next tick at `amount`, 0..=1. Computed outside the loop over samples, which has no registers to
    /// spare.
    ///
    /// The white noise comes from a linear congruential generator (Knuth, The Art of Computer Programming 2, 3.3.4: MMIX);
    /// its upper bits are heard, uniform with unit variance.
    pub fn fill(&mut self, amount: f64) {
        self.strength = amount * NOISE_FLOW;
        if self.strength == 0.0 {
            return;
        }
        let (low, high) = self.corners;
        let unit = high * 1.732_050_807_568_877_2 / (1_u64 << 63) as f64;
        let (mut random, mut smooth, mut drift) = (self.random, self.low, self.band);
        for hiss in &mut self.hiss {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            smooth += unit * (random as i64) as f64 - high * smooth;
            drift += low * (smooth - drift);
            *hiss = smooth - drift;
        }
        (self.random, self.low, self.band) = (random, smooth, drift);
    }

    /// Noise flow of sample `at` of the tick on a jet of this flow: without flow there is no noise.
    #[inline(always)]
    pub fn flow(&self, jet_flow: f64, at: usize) -> f64 {
        let turbulent = (jet_flow.abs() - LAMINAR_FLOW).max(0.0);
        self.strength * turbulent * self.hiss[at & (TICK - 1)]
    }
}
