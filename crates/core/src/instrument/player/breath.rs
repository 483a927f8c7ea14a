//! The breath: a breath source moves it; without one, key velocity sets it.
//!
//! Without breath input, a key blows constantly, as its velocity chooses. The first breath event makes the breath *live*:
//! from then on breath events alone set it, and velocity only shapes the attack. [`response`](super::response) makes a mouth
//! pressure of it.

use super::TickContext;
use crate::instrument::settings::{BreathResponse, Settings};
use crate::units::clamped_or;

/// Time constant of breath that rises behind the tongue, s.
pub const BREATH_RISE_S: f64 = 0.002;
/// Time constant of breath that follows a breath source, s.
pub const BREATH_FOLLOW_S: f64 = 0.005;
/// Time constant of breath that ends, s.
pub const BREATH_END_S: f64 = 0.012;
/// Where the breath is physical, a slur of an octave or more is helped by a dip; the limit leaves room below the octave, cents.
/// A player's [`slur`](super::slur) needs none.
const LEAP_CENTS: f64 = 1_150.0;
/// The highest register that a slur enters or leaves without a dip: the clarion.
const CLARION: u8 = 2;
/// The dip that helps a difficult slur: factor on the pressure, length in s.
const DIP: (f64, f64) = (0.3, 0.025);
/// A note is over when its mouth pressure is below this share of the closing pressure.
const NO_BREATH: f64 = 1e-6;

/// What the breath is asked to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Asked {
    /// Nothing: no key is down.
    Nothing,
    /// What a breath source says, 0..=1.
    Level(f64),
    /// What the velocity of the key says, 0..=1.
    Velocity(f64),
}

/// State of the breath.
#[derive(Clone, Copy, Debug, Default)]
pub struct Breath {
    /// Velocity of the last key, 0..=1.
    velocity: f64,
    /// How far the keys are pressed on, 0..=1.
    pressed: f64,
    /// Whether any breath event has arrived.
    live: bool,
    /// The last breath event, 0..=1 of full breath.
    level: f64,
    /// Mouth pressure over the closing pressure of the reed.
    gamma: f64,
    /// What is left of the dip, s; 0 or less for none.
    dip_s: f64,
}

impl Breath {
    /// A breath event, 0..=1 of full breath; not a number counts as 0. The breath follows one that leaves a band of half the
    /// width of the settings, at its edge: what a restless sensor does within the band is not heard. Towards the softest and the
    /// loudest breath of the settings the band narrows to nothing, so that both stay what they are. Rest is rest.
    pub fn set_level(&mut self, level: f32, settings: &Settings) {
        self.live = true;
        let level = f64::from(clamped_or(level, 0.0, 1.0, 0.0));
        let (softest, loudest) = match settings.breath_response {
            BreathResponse::Played => (settings.breath_softest.into(), settings.breath_loudest.into()),
            BreathResponse::Physical => (0.0, 1.0),
        };
        let half = 0.5 * f64::from(settings.breath_deadband);
        let half = half.min(level - softest).min(loudest - level).max(0.0);
        self.level = if level > 0.0 { self.level.clamp(level - half, level + half) } else { 0.0 };
    }

    /// Velocity sets the breath again, until the next breath event.
    pub fn forget_source(&mut self) {
        (self.live, self.level) = (false, 0.0);
    }

    /// The velocity of a new key, 0..=1; not a number counts as 0.5.
    pub fn set_velocity(&mut self, velocity: f32) {
        self.velocity = f64::from(clamped_or(velocity, 0.0, 1.0, 0.5));
    }

    /// The keys are pressed on, 0..=1; not a number counts as 0.
    pub fn press(&mut self, pressure: f32) {
        self.pressed = f64::from(clamped_or(pressure, 0.0, 1.0, 0.0));
    }

    /// A machine slurs over an interval, cents, from one register to another: a difficult slur begins a short dip of the
    /// pressure.
    pub fn slur(&mut self, interval_cents: f64, from: u8, to: u8) {
        if interval_cents.abs() > LEAP_CENTS || (from != to && from.max(to) > CLARION) {
            self.dip_s = DIP.1;
        }
    }

    /// Whether a dip helps a slur now.
    pub fn is_dipping(&self) -> bool {
        self.dip_s > 0.0
    }

    /// Mouth pressure over the closing pressure of the reed.
    pub fn gamma(&self) -> f64 {
        self.gamma
    }

    /// How quickly the tongue lets go, as a factor on the time that is set: velocity hardens the attack by half either
    /// way once the breath is live, because it then does not set the pressure.
    pub fn attack_hardness(&self) -> f64 {
        if self.live { 0.5 + self.velocity } else { 1.0 }
    }

    /// Whether a breath source sets the breath, and rests.
    pub fn is_at_rest(&self) -> bool {
        self.live && self.level == 0.0
    }

    /// Whether the pressure has gone and none is asked for.
    pub fn is_resting(&self, key_down: bool) -> bool {
        self.gamma < NO_BREATH && (!key_down || self.is_at_rest())
    }

    /// The same velocity and breath level for another instrument, whose pressure begins at 0.
    pub fn carried(&self) -> Self {
        Self { gamma: 0.0, dip_s: 0.0, ..*self }
    }

    /// Takes over velocity and breath level of another player; the pressure follows as it does any breath.
    pub fn follow(&mut self, from: &Self) {
        *self = Self { gamma: self.gamma, dip_s: self.dip_s, ..*from };
    }

    /// What breath source or velocity ask for.
    pub fn asked(&self, key_down: bool) -> Asked {
        match (key_down, self.live) {
            (false, _) => Asked::Nothing,
            (true, true) => Asked::Level(self.level),
            (true, false) => Asked::Velocity(self.velocity + (1.0 - self.velocity) * self.pressed),
        }
    }

    /// Moves the pressure towards `target`, over the closing pressure. `tongue_holds`: the tongue holds the reed before a
    /// note, so that the pressure may rise behind it at once.
    pub fn tick(&mut self, target: f64, key_down: bool, tongue_holds: bool, context: &TickContext<'_>) {
        let posture = context.posture;
        let dipping = self.is_dipping();
        let target = if dipping { target * DIP.0 } else { target };
        self.dip_s -= context.tick_s;
        let share = if !key_down {
            posture.lags.breath_end
        } else if tongue_holds || dipping {
            posture.lags.breath_rise
        } else {
            posture.lags.breath_follow
        };
        self.gamma += (target - self.gamma) * share;
        if target == 0.0 && self.gamma < NO_BREATH {
            self.gamma = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_band(breath_deadband: f32) -> Settings {
        Settings { breath_deadband, ..Settings::default() }
    }

    #[test]
    fn what_is_restless_within_the_deadband_is_still() {
        let (mut breath, band) = (Breath::default(), with_band(0.04));
        breath.set_level(0.52, &band);
        let still = breath.level;
        for restless in [0.51, 0.485, 0.5, 0.515] {
            breath.set_level(restless, &band);
            assert_eq!(breath.level, still, "{restless}");
        }
        breath.set_level(0.6, &band);
        assert!((breath.level - 0.58).abs() < 1e-6, "it follows at the edge of the band");
        breath.set_level(0.0, &band);
        assert_eq!(breath.level, 0.0, "rest is rest");
        for level in [0.1, 0.7, 1.0] {
            breath.set_level(level, &with_band(0.0));
            assert_eq!(breath.level, f64::from(level), "without a band");
        }
    }

    #[test]
    fn the_softest_and_the_loudest_breath_are_reached_whatever_the_deadband() {
        let (mut breath, band) = (Breath::default(), with_band(0.1));
        for value in 0..=127_u8 {
            let level = f32::from(value) / 127.0;
            breath.set_level(level, &band);
            if level <= band.breath_softest {
                assert_eq!(breath.level, f64::from(level));
            }
        }
        assert_eq!(breath.level, 1.0);
        (4..127_u8).rev().for_each(|value| breath.set_level(f32::from(value) / 127.0, &band));
        assert_eq!(breath.level, f64::from(4.0_f32 / 127.0));
    }

    #[test]
    fn velocity_blows_again_once_the_source_is_forgotten() {
        let mut breath = Breath::default();
        breath.set_velocity(0.7);
        breath.set_level(0.0, &Settings::default());
        assert_eq!(breath.asked(true), Asked::Level(0.0));
        breath.forget_source();
        assert_eq!(breath.asked(true), Asked::Velocity(f64::from(0.7_f32)));
    }
}
