//! While the tract or the fingers slide, bore and radiation no longer make the level that the player is used to. The player
//! hears the sound outside and blows so that the level stays: harder or softer, and with a looser lip where breath alone is
//! not enough. The level to keep is that of the note before, moved by the player's own dynamics.

use super::dynamics::LOWEST_ONSET;
use super::known::Known;
use super::step_towards;
use crate::maths;

/// Window in which the level is heard, s.
const WINDOW_S: f64 = 0.02;
/// Time over which the note before is remembered, s.
const MEMORY_S: f64 = 0.08;
/// Time constant with which breath follows a distance of 1 neper, s: slower than the window, so that it does not hunt.
const FOLLOW_S: f64 = 0.05;
/// Time constant with which it goes back to the note's own breath, s.
const BACK_S: f64 = 0.05;
/// Lead above which the level is kept, and below which it is learnt.
const LEADS: f64 = 0.05;
/// Mouth over closing pressure of a note led by the tract at least, and to begin with: below, the bore's own low modes take
/// over (measured).
const TRACT_GAMMAS: (f64, f64) = (0.6, 0.75);
/// The same of one led by the fingers: half open holes take more breath (measured).
const FINGERS_GAMMAS: (f64, f64) = (0.45, 0.55);
/// The same at most: above, the reed stays shut.
const MOST: f64 = 1.05;
/// Below this mean square, Pa^2, there is nothing to hear.
const SILENCE: f64 = 1e-12;

/// What leads a note away from the bore's own pitch, each 0..=1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Led {
    /// The vocal tract.
    tract: f64,
    /// Sliding fingers.
    fingers: f64,
}

impl Led {
    /// By a tract with this lead, 0..=1, and perhaps by sliding fingers.
    pub fn new(tract: f64, slides: bool) -> Self {
        Self { tract, fingers: f64::from(u8::from(slides)) }
    }
}

/// How fast the level is heard and learnt, and the breath goes back, for one length of tick.
#[derive(Clone, Copy, Debug)]
pub struct KeeperLags {
    tick_s: f64,
    window: f64,
    memory: f64,
    back: f64,
}

impl KeeperLags {
    /// For ticks of `tick_s` seconds.
    pub fn new(tick_s: f64) -> Self {
        let [window, memory, back] = [WINDOW_S, MEMORY_S, BACK_S].map(|time_s| step_towards(tick_s, time_s));
        Self { tick_s, window, memory, back }
    }
}

/// State of the player's ear for level.
#[derive(Clone, Copy, Debug, Default)]
pub struct LevelKeeper {
    /// Mean square of the sound, Pa^2.
    power: f64,
    /// The same of the note before, over that of the rule at its dynamic.
    learnt: f64,
    /// Logarithm of the factor on the led breath.
    push: f64,
    /// A level of the rule, dB, and its power: it seldom changes.
    rule: (f64, f64),
    /// How far the breath may go, for the note's own and what leads it.
    range: Known<(f64, Led), Range>,
}

/// How far a led breath may go.
#[derive(Clone, Copy, Debug)]
struct Range {
    /// Where it begins, mouth over closing pressure.
    base: f64,
    /// Logarithms of the least and the greatest factor on that.
    lowest: f64,
    highest: f64,
}

impl Range {
    /// For a note's own mouth over closing pressure, and what leads it.
    fn new(gamma: f64, led: Led) -> Self {
        let raised = |tract: f64, fingers: f64| {
            gamma + ((tract - gamma).max(0.0) * led.tract).max((fingers - gamma).max(0.0) * led.fingers)
        };
        let low = raised(TRACT_GAMMAS.0, FINGERS_GAMMAS.0);
        let base = raised(TRACT_GAMMAS.1, FINGERS_GAMMAS.1);
        Self { base, lowest: maths::ln(low / base).min(0.0), highest: maths::ln(base.max(MOST) / base) }
    }
}

/// What keeps the level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kept {
    /// Mouth over closing pressure.
    pub gamma: f64,
    /// How far the lip goes from its dynamic to the loudest, 0..=1.
    pub lip: f64,
}

impl LevelKeeper {
    /// One tick: hears a mean square of the sound, Pa^2. `gamma` is the note's own, `level_db` the rule's level at its dynamic,
    /// `led` what leads the note away from the bore's own. Real-time safe.
    pub fn tick(&mut self, heard: f64, gamma: f64, level_db: f64, led: Led, lags: &KeeperLags) -> Kept {
        let lead = led.tract.max(led.fingers);
        self.power += (heard - self.power) * lags.window;
        if self.rule.1 == 0.0 || self.rule.0 != level_db {
            self.rule = (level_db, power(level_db));
        }
        if lead == 0.0 && self.push == 0.0 {
            self.learn(lags);
            return Kept { gamma, lip: 0.0 };
        }
        if gamma < LOWEST_ONSET {
            // The breath ends: nothing is kept.
            self.push = 0.0;
            return Kept { gamma, lip: 0.0 };
        }
        let Range { base, lowest, highest } =
            self.range.of((gamma, led), |(gamma, led)| Range::new(gamma, led));
        if lead < LEADS {
            self.learn(lags);
            self.push -= self.push * lags.back;
            if self.push.abs() < 1e-3 {
                self.push = 0.0;
            }
        } else if self.learnt > SILENCE && self.power > SILENCE {
            let wanted = self.learnt * self.rule.1;
            let distance = 0.5 * maths::ln(wanted / self.power);
            self.push += lead * lags.tick_s / FOLLOW_S * distance.clamp(-1.0, 1.0);
        }
        self.push = self.push.clamp(lowest, highest);
        // The lip begins to help where the breath goes beyond its beginning.
        let lip = if highest > 0.0 { lead * (self.push / highest).clamp(0.0, 1.0) } else { 0.0 };
        Kept { gamma: base * maths::exp(self.push), lip }
    }

    fn learn(&mut self, lags: &KeeperLags) {
        self.learnt += (self.power / self.rule.1 - self.learnt) * lags.memory;
    }
}

fn power(db: f64) -> f64 {
    maths::exp(db * (std::f64::consts::LN_10 / 10.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a sound whose level is proportional to the breath and that loses 4 dB when led, the level comes back.
    #[test]
    fn a_led_note_comes_back_to_its_level() {
        let (mut keeper, lags) = (LevelKeeper::default(), KeeperLags::new(1.0 / 6_000.0));
        let mut heard = 0.0;
        let mut play = |lead: f64, loss: f64, ticks: usize| {
            for _ in 0..ticks {
                let kept = keeper.tick(heard, 0.6, -8.0, Led::new(lead, false), &lags);
                heard = (loss * kept.gamma * (1.0 + kept.lip)).powi(2);
            }
            heard.sqrt()
        };
        let alone = play(0.0, 1.0, 6_000);
        assert!((alone - 0.6).abs() < 1e-6);
        assert!((play(1.0, 0.63, 6_000) / alone - 1.0).abs() < 0.01);
        assert!((play(0.0, 1.0, 12_000) / alone - 1.0).abs() < 1e-3);
    }
}
