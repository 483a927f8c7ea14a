//! Breath noise: turbulence of the jet through the reed channel, which breaks up where its flow is pulsed.
//!
//! A steady jet is quiet. The noise rides on what the flow does beside its own slow mean. So it pulsates with the reed, twice
//! a period, grows with the speed to which the reed drives the jet, and below the threshold there is hardly any: a
//! whisper on the mean flow, as a player's mouth makes. Band and level are those of recorded notes, see `docs/tone.md`.

use super::control_tick::TICK;

/// Noise at amount 1: noise flow over the flow it rides on, for turbulence of rms 1 before its band. At the default amount of
/// 0.3, held notes have the noise of recorded ones at mezzo-forte.
const NOISE_FLOW: f64 = 0.30;
/// Share of the mean flow that whispers although nothing is pulsed: -78 dBFS below the threshold (by judgement).
const WHISPER: f64 = 0.012;
/// Below this flow the jet is laminar and silent: a Reynolds number of 25 in a channel 13 mm wide, about a hundredth of
/// the flow in a soft note. After the breath has ended, the flow in the bore decays only as 1 / t; it must not hiss.
const LAMINAR_FLOW: f64 = 0.002;
/// The band, Hz: above the low corner turbulence falls with 12 dB an octave down to a floor, which ends at the high one.
/// Fitted to the recorded noise in five bands from 0.3 to 15 kHz, all met within 3 dB.
const NOISE_BAND_HZ: (f64, f64) = (600.0, 12_000.0);
/// The floor over the level below the low corner.
const FLOOR: f64 = 0.04;
/// Time constant of the slow mean of the flow, s: longer than a period of the lowest note, shorter than a tongued one.
const MEAN_S: f64 = 0.03;
/// Seed of the noise: any constant does; with a constant, renders repeat.
const NOISE_SEED: u64 = 0x9E37_79B9_7F4A_7C15;

/// The noise of one voice. Flows are over those of the reference reed.
pub(super) struct BreathNoise {
    /// Noise flow over pulsed flow.
    strength: f64,
    /// Noise flow of the whisper.
    whisper: f64,
    /// Slow mean of the flow.
    mean: f64,
    /// Share of the way that the mean goes in one tick.
    mean_share: f64,
    random: u64,
    high: f64,
    low: [f64; 2],
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
            whisper: 0.0,
            mean: 0.0,
            mean_share: 1.0 - (-(TICK as f64) / (MEAN_S * rate_hz)).exp(),
            random: NOISE_SEED,
            high: 0.0,
            low: [0.0; 2],
            corners: (corner(NOISE_BAND_HZ.0), corner(NOISE_BAND_HZ.1)),
            hiss: [0.0; TICK],
        }
    }

    /// Starts the noise again from its seed.
    pub fn reset(&mut self) {
        (self.mean, self.high, self.low) = (0.0, 0.0, [0.0; 2]);
        self.random = NOISE_SEED;
    }

    /// Turbulence of the next tick at `amount`, 0..=1, after a tick that ended with this flow. Computed outside the loop over
    /// samples, which has no registers to spare.
    ///
    /// The white noise comes from a linear congruential generator (Knuth, The Art of Computer Programming 2, 3.3.4: MMIX);
    /// its upper bits are heard, uniform with unit variance.
    pub fn fill(&mut self, amount: f64, jet_flow: f64) {
        self.mean += self.mean_share * (jet_flow - self.mean);
        self.strength = amount * NOISE_FLOW;
        self.whisper = self.strength * WHISPER * (self.mean.abs() - LAMINAR_FLOW).max(0.0);
        if self.strength == 0.0 {
            return;
        }
        let (low, high) = self.corners;
        let unit = high * 1.732_050_807_568_877_2 / (1_u64 << 63) as f64;
        let (mut random, mut smooth, [mut once, mut twice]) = (self.random, self.high, self.low);
        for hiss in &mut self.hiss {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            smooth += unit * (random as i64) as f64 - high * smooth;
            once += low * (smooth - once);
            twice += low * (once - twice);
            *hiss = twice + FLOOR * smooth;
        }
        (self.random, self.high, self.low) = (random, smooth, [once, twice]);
    }

    /// Noise flow of sample `at` of the tick on a jet of this flow.
    #[inline(always)]
    pub fn flow(&self, jet_flow: f64, at: usize) -> f64 {
        (self.strength * (jet_flow - self.mean).abs() + self.whisper) * self.hiss[at & (TICK - 1)]
    }
}
