//! Life: the slow wander of a player's breath and lip, without which a held note stands still.
//!
//! Recorded held notes wander with a spectrum near 1/f. Here it is made of three first-order processes (of Ornstein and
//! Uhlenbeck) with corners a factor of six apart, whose spectra add up to nearly that. One such sum moves the dynamic, and with
//! it breath and lip together; another moves the reed's resonance under the lip, and with it the pitch and the upper partials.
//! The resonance lies near high notes and far from low ones, so the pitch of a high note goes twelve times as far with it as that of the
//! lowest. A player hears the pitch and not the resonance: the sum is one of cents, and the lip moves the resonance as far as the reed and the bore
//! of the note [ask for](super::posture::Posture::note_lip). The white noise behind the sums has a seed, so every render repeats. Left out: that
//! a player corrects what wanders too far.

use super::sway::{SWAY_TICKS, Sway};
use crate::dsp::white::White;
use crate::instrument::person::Person;
use crate::maths;

/// Corners of the processes, Hz.
const CORNERS_HZ: [f64; 3] = [0.12, 0.8, 5.0];
/// Their variances in the sum that moves the dynamic.
const BREATH_VARIANCES: [f64; 3] = [4.0, 1.0, 0.3];
/// Their variances in the sum that moves the reed's resonance: recorded pitch trembles half as far at 3 to 9 Hz as it wanders at 0.3 to 3 Hz.
const LIP_VARIANCES: [f64; 3] = [8.0, 1.0, 1.3];
/// The sum goes through a low-pass of this corner, Hz, so that no step of it is heard.
const SMOOTH_HZ: f64 = 12.0;
/// What a unit of the sum moves: the dynamic, and the pitch by the reed's resonance, cents. Chosen for the medians of recorded held notes, see
/// `docs/tone.md`.
const DYNAMIC: f64 = 0.0117;
/// See [`DYNAMIC`].
const REED_CENTS: f64 = 0.46;
/// Seed of the noise: any constant does.
const SEED: u64 = 0x2545_F491_4F6C_DD1D;

/// Share of the way back to 0, and noise that is added, in one step of a process.
type Lag = (f64, f64);

/// How the processes move in one step of [`SWAY_TICKS`].
#[derive(Clone, Copy, Debug)]
pub struct LifeLags {
    breath: [Lag; 3],
    lip: [Lag; 3],
    smooth: f64,
}

impl LifeLags {
    /// For ticks of `tick_s` seconds.
    pub fn new(tick_s: f64) -> Self {
        let share = |hz: f64| -maths::exp_m1(-std::f64::consts::TAU * hz * f64::from(SWAY_TICKS) * tick_s);
        let backs = CORNERS_HZ.map(share);
        let lags = |variances: [f64; 3]| {
            std::array::from_fn(|n| (backs[n], (variances[n] * backs[n] * (2.0 - backs[n])).sqrt()))
        };
        Self { breath: lags(BREATH_VARIANCES), lip: lags(LIP_VARIANCES), smooth: share(SMOOTH_HZ) }
    }
}

/// One wandering quantity.
#[derive(Clone, Copy, Debug, Default)]
struct Wander {
    processes: [f64; 3],
    smooth: f64,
}

impl Wander {
    fn step(&mut self, lags: &[Lag; 3], smooth: f64, white: &mut White) -> f64 {
        for (x, (back, noise)) in self.processes.iter_mut().zip(lags) {
            *x += noise * white.next() - back * *x;
        }
        self.smooth += (self.processes.iter().sum::<f64>() - self.smooth) * smooth;
        self.smooth
    }
}

/// State of the wander.
#[derive(Clone, Copy, Debug)]
pub struct Life {
    white: White,
    breath: Wander,
    lip: Wander,
}

impl Default for Life {
    fn default() -> Self {
        Self::of(&Person::default())
    }
}

impl Life {
    /// At rest, with this player's own noise.
    pub fn of(person: &Person) -> Self {
        Self { white: White::new(person.seed(SEED)), breath: Wander::default(), lip: Wander::default() }
    }

    /// The wander of the next `SWAY_TICKS` at `amount`, 0..=1; at 0 nothing moves. Real-time safe.
    pub fn step(&mut self, amount: f64, lags: &LifeLags) -> Sway {
        if amount == 0.0 {
            return Sway::default();
        }
        let white = &mut self.white;
        Sway {
            dynamic: amount * DYNAMIC * self.breath.step(&lags.breath, lags.smooth, white),
            room: 0.0,
            reed_cents: amount * REED_CENTS * self.lip.step(&lags.lip, lags.smooth, white),
            cents: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wander_is_slow_repeats_and_has_the_variance_of_its_processes() {
        let lags = LifeLags::new(16.0 / 96_000.0);
        let play = || {
            let mut life = Life::default();
            (0..2_000_000).map(|_| life.step(1.0, &lags).dynamic / DYNAMIC).collect::<Vec<f64>>()
        };
        let values = play();
        assert_eq!(values, play());
        let variance = values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64;
        // Half an hour holds a thousand turns of the slowest process; the low-pass takes a little of the fastest.
        let wanted: f64 = BREATH_VARIANCES.iter().sum();
        assert!((variance / wanted - 1.0).abs() < 0.2, "{variance} for {wanted}");
        let steepest = values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        // A step of 0.15 moves the level by 0.05 dB, 375 times a second.
        assert!(steepest < 0.15, "{steepest}: no step is heard");
        assert_eq!(Life::default().step(0.0, &lags), Sway::default());
    }
}
