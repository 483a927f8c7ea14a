//! Breath noise: turbulence of the jet through the reed channel.
//!
//! Two models of the jet. A [steady](Jet::Steady) one hisses in proportion to its flow, as it does in projects from before there
//! was another. A [pulsed](Jet::Pulsed) one is quiet while it is steady and breaks up where its flow is pulsed: its noise
//! rides on what the flow does beside its own slow mean. So the noise pulsates with the reed, grows with the speed to which the
//! reed drives the jet, and below the threshold there is hardly any: a whisper on the mean flow, as a player's mouth makes.
//! Where tongue, breath or lip change the flow, the mean follows at once, by as much as the flow of a reed at rest changes. A mean that only
//! followed slowly took the beginning and the end of a note for pulses, and soft notes puffed.
//! Band and level of the pulsed jet are those of recorded notes, see `docs/tone.md`.

mod lanes;

use super::control_tick::TICK;
use super::person::Person;
use crate::dsp::white::{UNIT, next};
use crate::maths;
pub(super) use lanes::NoiseLanes;

/// How the jet makes noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Jet {
    /// In proportion to its flow.
    #[default]
    Steady,
    /// Where its flow is pulsed.
    Pulsed,
}

/// Steady: noise flow at amount 1, rms over the mean flow that it rides on (by level: -40 dB under a mezzo-forte fundamental
/// at an amount of 0.3).
const STEADY_NOISE: f64 = 0.018;
/// Steady: corners of the band, Hz; turbulence in the channel is broad around a few kHz (by judgement).
const STEADY_BAND_HZ: (f64, f64) = (600.0, 5_000.0);
/// Pulsed: noise flow at amount 1 over the flow that it rides on, for turbulence of rms 1 before its band. At the default
/// amount of 0.3, held notes have the noise of recorded ones at mezzo-forte, within 4.5 dB in five bands from 0.3 to 15 kHz.
const PULSED_NOISE: f64 = 0.88;
/// Pulsed: the band, Hz. Above the low corner turbulence falls with 12 dB an octave down to a floor, which ends at the high one.
const PULSED_BAND_HZ: (f64, f64) = (600.0, 12_000.0);
/// Pulsed: the floor over the level below the low corner.
const FLOOR: f64 = 0.035;
/// Pulsed: share of the mean flow that whispers although nothing is pulsed: -78 dBFS below the threshold (by judgement).
const WHISPER: f64 = 0.009;
/// Pulsed: time constant of the slow mean of the flow, s: longer than a period of the lowest note, shorter than a tongued one.
const MEAN_S: f64 = 0.03;
/// Pulsed: time constant with which turbulence follows the flow, s: a jet 0.5 to 1 mm high takes some ten heights downstream to break up, 5 to
/// 10 mm, and its eddies travel at half its speed of 30 m/s or less. Without it the corners of the pulses put too much of the noise above 1 kHz.
const BREAK_UP_S: f64 = 0.5e-3;
/// Turbulence below this is none: smaller numbers are slow to compute with.
const STILL: f64 = 1e-30;
/// Below this flow the jet is laminar and silent: a Reynolds number of 25 in a channel 13 mm wide, about a hundredth of
/// the flow in a soft note. After the breath has ended, the flow in the bore decays only as 1 / t; it must not hiss.
const LAMINAR_FLOW: f64 = 0.002;
/// Seed of the noise: any constant does; with a constant, renders repeat.
const NOISE_SEED: u64 = 0x9E37_79B9_7F4A_7C15;

/// Turbulence that is not too small to compute with.
fn still(built: f64) -> f64 {
    if built < STILL { 0.0 } else { built }
}

/// The noise of one voice. Flows are over those of the reference reed.
pub(super) struct BreathNoise {
    jet: Jet,
    /// Coefficients of the two corners, for the steady and the pulsed jet.
    corners: [(f64, f64); 2],
    /// Share of the way that the mean goes in one tick.
    mean_share: f64,
    /// Noise flow over the flow that it rides on.
    strength: f64,
    /// Share of the turbulence that is left after a sample.
    keep: f64,
    /// The same for a pulsed jet.
    pulsed_keep: f64,
    /// Turbulence: the flow that makes noise, summed over the samples in which it breaks up.
    built: f64,
    /// Flow beside which noise rides: the slow mean of a pulsed jet.
    mean: f64,
    /// Flow of the reed at rest, up to which the mean has followed.
    rest: f64,
    /// Flow that makes no noise.
    quiet: f64,
    /// Noise flow without pulses.
    whisper: f64,
    seed: u64,
    random: u64,
    high: f64,
    low: [f64; 2],
    hiss: [f64; TICK],
}

impl BreathNoise {
    /// Silent, with a steady jet, at a sample rate in Hz.
    pub fn new(rate_hz: f64) -> Self {
        let corner = |hz: f64| 1.0 - maths::exp(-std::f64::consts::TAU * hz / rate_hz);
        Self {
            jet: Jet::Steady,
            corners: [STEADY_BAND_HZ, PULSED_BAND_HZ].map(|(low, high)| (corner(low), corner(high))),
            mean_share: 1.0 - maths::exp(-(TICK as f64) / (MEAN_S * rate_hz)),
            strength: 0.0,
            keep: 0.0,
            pulsed_keep: maths::exp(-1.0 / (BREAK_UP_S * rate_hz)),
            built: 0.0,
            mean: 0.0,
            rest: 0.0,
            quiet: LAMINAR_FLOW,
            whisper: 0.0,
            seed: NOISE_SEED,
            random: NOISE_SEED,
            high: 0.0,
            low: [0.0; 2],
            hiss: [0.0; TICK],
        }
    }

    /// Starts the noise again from its seed; the jet stays.
    pub fn reset(&mut self) {
        (self.built, self.mean, self.rest) = (0.0, 0.0, 0.0);
        (self.whisper, self.high, self.low) = (0.0, 0.0, [0.0; 2]);
        self.random = self.seed;
    }

    /// Makes the noise of another player, from its beginning.
    pub fn play_as(&mut self, person: &Person) {
        self.seed = person.seed(NOISE_SEED);
        self.reset();
    }

    /// Chooses how the jet makes noise. Real-time safe.
    pub fn set_jet(&mut self, jet: Jet) {
        if jet != self.jet {
            self.jet = jet;
            (self.built, self.mean, self.rest) = (0.0, 0.0, 0.0);
            (self.whisper, self.low) = (0.0, [0.0; 2]);
            (self.quiet, self.keep) = match jet {
                Jet::Steady => (LAMINAR_FLOW, 0.0),
                Jet::Pulsed => (0.0, self.pulsed_keep),
            };
        }
    }

    /// A tick begins at `amount`, 0..=1, after one that ended with the flow `jet_flow`; through a reed at rest `rest_flow` would
    /// flow, both over P / Zc. Its turbulence is [filled](Self::fill) in before its samples, here or in a lane of [`NoiseLanes`].
    pub fn begin(&mut self, amount: f64, jet_flow: f64, rest_flow: f64) {
        match self.jet {
            Jet::Steady => self.strength = amount * STEADY_NOISE,
            Jet::Pulsed => {
                let strength = amount * PULSED_NOISE;
                self.strength = strength * (1.0 - self.keep);
                self.built = still(self.built);
                let led = self.mean + (rest_flow - self.rest);
                self.rest = rest_flow;
                self.mean = (led + self.mean_share * (jet_flow - led)).max(0.0);
                self.whisper = strength * WHISPER * (self.mean.abs() - LAMINAR_FLOW).max(0.0);
            }
        }
    }

    /// Whether the turbulence of the tick that has begun may be filled in together with that of other voices.
    pub fn is_turbulent(&self) -> bool {
        self.jet == Jet::Pulsed && self.strength != 0.0
    }

    /// Turbulence of the tick that has begun. Computed outside the loop over samples, which has no registers to spare.
    pub fn fill(&mut self) {
        if self.strength == 0.0 {
            self.hiss = [0.0; TICK];
            return;
        }
        let (low, high) = self.corners[self.jet as usize];
        let unit = high * UNIT;
        let (mut random, mut smooth, [mut once, mut twice]) = (self.random, self.high, self.low);
        let mut white = || {
            random = next(random);
            unit * (random as i64) as f64
        };
        match self.jet {
            Jet::Steady => {
                for hiss in &mut self.hiss {
                    smooth += white() - high * smooth;
                    once += low * (smooth - once);
                    *hiss = smooth - once;
                }
            }
            Jet::Pulsed => {
                for hiss in &mut self.hiss {
                    smooth += white() - high * smooth;
                    once += low * (smooth - once);
                    twice += low * (once - twice);
                    *hiss = twice + FLOOR * smooth;
                }
            }
        }
        (self.random, self.high, self.low) = (random, smooth, [once, twice]);
    }

    /// Noise flow of sample `at` of the tick on a jet of this flow, both over P / Zc.
    #[inline(always)]
    pub fn flow(&mut self, jet_flow: f64, at: usize) -> f64 {
        let turbulent = ((jet_flow - self.mean).abs() - self.quiet).max(0.0);
        self.built = turbulent + self.keep * self.built;
        (self.strength * self.built + self.whisper) * self.hiss[at & (TICK - 1)]
    }
}
