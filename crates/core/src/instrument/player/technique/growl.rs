//! Growl: the player sings, and the voice's pulses of air come into the mouth.
//!
//! The glottis opens and closes with the voice, and lets the breath through in pulses: a rise of 40 % of the period and a
//! fall of 16 %, both of trigonometric form (Rosenberg 1971, shape C, in JASA 49, 583), then closed. The mouth's air is a
//! compliance that the pulses fill and the reed empties, so that the mouth pressure swings about its mean `p` by `p m`:
//!
//! ```text
//! tau m' + m = g / mean(g) - 1        tau = V p / (rho c^2 U)
//! ```
//!
//! with the volume `V` of the mouth, and the mean flow `U` through the reed. What this leaves out: that pressure in the mouth
//! holds back the pulses themselves.

use crate::maths;
use std::f64::consts::PI;

use super::wrapped;

/// Shares of the period in which the glottis opens and closes: Rosenberg's listeners preferred these.
const OPENS: f64 = 0.4;
const CLOSES: f64 = 0.16;
/// Mean of the pulse over a period: half the opening, 2 / pi of the closing.
const MEAN: f64 = 0.5 * OPENS + 2.0 / PI * CLOSES;
/// Time in which the reed would empty the mouth, s: 60 cm3 at 3 kPa and 0.2 l/s.
const EMPTIES_S: f64 = 0.0063;

/// State of the voice.
#[derive(Clone, Copy, Debug, Default)]
pub struct Growl {
    /// Share of the period that has passed.
    phase: f64,
    /// Mouth pressure over its mean, less 1.
    swing: f64,
}

/// Opening of the glottis at a share of the period, 0..=1.
fn glottis(phase: f64) -> f64 {
    if phase < OPENS {
        0.5 * (1.0 - maths::cos(PI * phase / OPENS))
    } else if phase < OPENS + CLOSES {
        maths::cos(0.5 * PI * (phase - OPENS) / CLOSES)
    } else {
        0.0
    }
}

impl Growl {
    /// A voice that begins at a share of its period, 0..1.
    pub fn at(phase: f64) -> Self {
        Self { phase, swing: 0.0 }
    }

    /// One tick of a voice at `hz`: what it adds to the mouth pressure, over that pressure.
    pub fn tick(&mut self, hz: f64, tick_s: f64) -> f64 {
        self.phase = wrapped(self.phase + hz * tick_s);
        let source = glottis(self.phase) / MEAN - 1.0;
        let share = tick_s / EMPTIES_S;
        self.swing += (source - self.swing) * share / (1.0 + share);
        self.swing
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_swing_has_no_mean_and_is_that_of_the_mouths_volume() {
        for hz in [60.0, 110.0, 400.0] {
            let (mut growl, tick_s) = (Growl::default(), 1.0 / 6_000.0);
            let swings: Vec<f64> = (0..12_000).map(|_| growl.tick(hz, tick_s)).skip(6_000).collect();
            let mean = swings.iter().sum::<f64>() / swings.len() as f64;
            assert!(mean.abs() < 0.01, "{hz}: {mean}");
            let deepest = swings.iter().copied().fold(0.0, f64::min);
            assert!(deepest > -0.95, "{hz}: the breath never stops, {deepest}");
        }
        // A compliance: the swing falls with the voice's frequency.
        let depth = |hz: f64| {
            let mut growl = Growl::default();
            (0..12_000).map(|_| growl.tick(hz, 1.0 / 6_000.0)).skip(6_000).fold(0.0, f64::max)
        };
        assert!(depth(100.0) > 1.7 * depth(200.0) && depth(200.0) > 1.7 * depth(400.0));
    }
}
