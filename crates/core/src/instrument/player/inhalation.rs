//! The breath in after a phrase: air that rushes into the mouth, heard beside the instrument.
//!
//! Nobody knows when the next phrase begins. So the player breathes when the last has ended and the breath has rested for a moment.
//! A note that begins ends the breath.
//!
//! The noise of a breath is broad, between some 200 and 2000 Hz (by judgement), and its amplitude grows with the flow to the power
//! of 1.66 (Gavriely & Cugell 1996). The flow here is half a sine.

use std::f64::consts::{PI, TAU};

use super::step_towards;
use crate::dsp::white::White;
use crate::instrument::control_tick::TICK;
use crate::instrument::slap::BREATH_GAMMA;
use crate::maths;

/// How long the player rests before breathing, s: longer than between the notes of a phrase.
const REST_S: f64 = 0.25;
/// How long a breath takes, s: a quick one, between phrases.
const BREATH_S: f64 = 0.4;
/// Corners of the band, Hz.
const BAND_HZ: (f64, f64) = (200.0, 2_000.0);
/// Power of the flow that the amplitude grows with.
const POWER: f64 = 1.66;
/// Amplitude at the strongest flow and the fullest amount, rms, Pa at 1 m. A mezzo-forte is 40 dB louder.
const LOUDEST_PA: f64 = 1.3e-3;
/// Time constant with which a note ends the breath, s.
const CUT_S: f64 = 0.005;
/// Share that a breath which is cut off may leave: -60 dB of what is soft already.
const GONE: f64 = 1e-3;
/// Seed of the noise: any constant does.
const SEED: u64 = 0x3C79_AC49_2BA7_B653;

/// What the lungs do.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Phase {
    /// They are full.
    #[default]
    Full,
    /// A phrase has needed their air, or needs it still.
    Spent,
    /// The player has rested for so many seconds.
    Rests(f64),
    /// Air comes in, for so many seconds, at an amplitude, Pa rms; what a note that has begun leaves of it.
    Breathes { passed_s: f64, loudest: f64, left: f64 },
}

/// State of the breath in.
#[derive(Clone, Copy, Debug)]
pub struct Inhalation {
    phase: Phase,
    white: White,
    high: f64,
    low: f64,
    /// Amplitude at the end of the tick before.
    before: f64,
    noise: [f32; TICK],
}

impl Default for Inhalation {
    fn default() -> Self {
        Self {
            phase: Phase::Full,
            white: White::new(SEED),
            high: 0.0,
            low: 0.0,
            before: 0.0,
            noise: [0.0; TICK],
        }
    }
}

impl Inhalation {
    /// Whether the player breathes or still has to.
    pub fn is_due(&self) -> bool {
        self.phase != Phase::Full
    }

    /// What is heard in this tick, Pa at 1 m; `None` while no air comes in.
    pub fn heard(&self) -> Option<&[f32; TICK]> {
        matches!(self.phase, Phase::Breathes { .. }).then_some(&self.noise)
    }

    /// One tick of `tick_s` seconds with a breath in of this `amount`, 0..=1. `rests`: nobody blows and nobody asks for it; `gamma` is
    /// the mouth pressure over the closing pressure. Real-time safe.
    #[inline(always)] // most of the time nothing is due
    pub fn tick(&mut self, amount: f32, rests: bool, gamma: f64, tick_s: f64) {
        if amount != 0.0 || self.is_due() {
            self.go_on(amount, rests, gamma, tick_s);
        }
    }

    #[inline(never)]
    fn go_on(&mut self, amount: f32, rests: bool, gamma: f64, tick_s: f64) {
        self.phase = match self.phase {
            Phase::Breathes { passed_s, loudest, left } => {
                self.breathe(passed_s + tick_s, loudest, left, rests, tick_s)
            }
            _ if amount == 0.0 => Phase::Full,
            Phase::Full if gamma > BREATH_GAMMA => Phase::Spent,
            Phase::Full => Phase::Full,
            _ if !rests => Phase::Spent,
            Phase::Spent => Phase::Rests(0.0),
            Phase::Rests(so_far_s) if so_far_s < REST_S => Phase::Rests(so_far_s + tick_s),
            Phase::Rests(_) => {
                (self.high, self.low, self.before) = (0.0, 0.0, 0.0);
                self.breathe(0.0, LOUDEST_PA * f64::from(amount), 1.0, rests, tick_s)
            }
        };
    }

    /// Makes the noise of a tick that ends `passed_s` after the breath has begun.
    fn breathe(&mut self, passed_s: f64, loudest: f64, left: f64, rests: bool, tick_s: f64) -> Phase {
        let left = if rests { left } else { left * (1.0 - step_towards(tick_s, CUT_S)) };
        if passed_s >= BREATH_S || left < GONE {
            // One that was cut off has brought too little.
            return if rests { Phase::Full } else { Phase::Spent };
        }
        let amplitude = left * maths::pow(maths::sin(PI * passed_s / BREATH_S), POWER);
        let rate_hz = TICK as f64 / tick_s;
        let (low_hz, high_hz) = BAND_HZ;
        let [low, high] = [low_hz, high_hz].map(|hz| 1.0 - maths::exp(-TAU * hz / rate_hz));
        // White noise of variance 1 behind both corners has the power pi f_high^2 / (rate (f_low + f_high)).
        let unit = loudest * (rate_hz * (low_hz + high_hz) / PI).sqrt() / high_hz;
        let step = (amplitude - self.before) / TICK as f64;
        for (n, noise) in self.noise.iter_mut().enumerate() {
            self.high += (self.white.next() - self.high) * high;
            self.low += (self.high - self.low) * low;
            *noise = (unit * (self.before + step * (n + 1) as f64) * (self.high - self.low)) as f32;
        }
        self.before = amplitude;
        Phase::Breathes { passed_s, loudest, left }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_S: f64 = 16.0 / 96_000.0;

    /// Ticks in which air comes in, when the first of them is, and their loudest stretch of 50 ms, Pa rms.
    fn breathed(inhalation: &mut Inhalation, ticks: usize, amount: f32) -> (usize, usize, f64) {
        let (mut count, mut first, mut heard) = (0, ticks, vec![]);
        for n in 0..ticks {
            inhalation.tick(amount, true, 0.0, TICK_S);
            let noise = inhalation.heard().copied();
            if noise.is_some() {
                (count, first) = (count + 1, first.min(n));
            }
            heard.extend(noise.unwrap_or_default().map(f64::from));
        }
        let rms = |part: &[f64]| (part.iter().map(|x| x * x).sum::<f64>() / part.len() as f64).sqrt();
        (count, first, heard.chunks(4_800).map(rms).fold(0.0, f64::max))
    }

    #[test]
    fn a_phrase_is_followed_by_one_breath_of_the_level_that_is_meant() {
        let mut inhalation = Inhalation::default();
        assert_eq!(breathed(&mut inhalation, 6_000, 1.0).0, 0, "no phrase, no breath");
        inhalation.tick(1.0, false, 0.5, TICK_S);
        assert!(inhalation.is_due());
        let (count, first, loudest) = breathed(&mut inhalation, 6_000, 1.0);
        assert!((2_398..2_403).contains(&count) && (1_499..1_504).contains(&first), "{count} {first}");
        assert!((loudest / LOUDEST_PA - 1.0).abs() < 0.15, "{loudest}");
        assert!(!inhalation.is_due());
        assert_eq!(breathed(&mut inhalation, 6_000, 1.0).0, 0, "lungs are filled once");
    }

    #[test]
    fn a_note_ends_the_breath_softly_and_it_comes_again_later() {
        let mut inhalation = Inhalation::default();
        inhalation.tick(1.0, false, 0.5, TICK_S);
        breathed(&mut inhalation, 2_500, 1.0);
        assert!(inhalation.heard().is_some());
        let mut ticks = 0;
        while inhalation.heard().is_some() {
            inhalation.tick(1.0, false, 0.0, TICK_S);
            ticks += 1;
        }
        assert!((100..300).contains(&ticks), "{ticks}");
        assert!(breathed(&mut inhalation, 6_000, 1.0).0 > 2_000);
    }
}
