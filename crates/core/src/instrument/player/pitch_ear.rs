//! The ear for pitch: how high the note is that sounds, while the player leads it from note to note.
//!
//! The pressure in the mouthpiece is brought down to its fundamental by a filter that follows the wanted pitch. The time from one
//! upward crossing of its mean to the next is the period. A period that is far from the wanted one is a disturbance, and is not
//! listened to.

use std::f64::consts::TAU;

use super::step_towards;
use crate::units::cents;

/// What lies below the wanted pitch by this factor is the mean, and not the note.
const MEAN: f64 = 6.0;
/// The pressure crosses only after it has been below this share of its root mean square: noise around the mean is no period.
const ARMED: f64 = 0.3;
/// A period farther from the wanted one is not the note's, cents: less than from the second mode to the first.
const STRAY_CENTS: f64 = 400.0;
/// Share of a new period in what is heard: the mean of two or three.
const NEW: f64 = 0.5;

/// State of the ear for pitch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PitchEar {
    mean: f64,
    low_passed: [f64; 2],
    power: f64,
    armed: bool,
    /// Time since the last crossing, s; none before the first.
    since_s: Option<f64>,
    /// What is heard over what was wanted, cents; none while nothing is heard.
    off_cents: Option<f64>,
}

impl PitchEar {
    /// Hears the pressure at the end of a tick of `tick_s` seconds. How much higher the note is than `wanted_hz`, cents; `None`
    /// while there is no such note. Real-time safe.
    pub fn hear(&mut self, pressure: f64, wanted_hz: f64, tick_s: f64) -> Option<f64> {
        let share = step_towards(tick_s, 1.0 / (TAU * wanted_hz));
        self.mean += (pressure - self.mean) * share / MEAN;
        let before = self.low_passed[1];
        self.low_passed[0] += (pressure - self.mean - self.low_passed[0]) * share;
        self.low_passed[1] += (self.low_passed[0] - before) * share;
        let now = self.low_passed[1];
        self.power += (now * now - self.power) * share / MEAN;
        self.armed |= now < -ARMED * self.power.sqrt();
        let passed_s = self.since_s.map(|since_s| since_s + tick_s);
        if self.armed && now >= 0.0 && before < 0.0 {
            self.armed = false;
            let after_s = tick_s * now / (now - before);
            let off = passed_s.map(|passed_s| cents(1.0 / (passed_s - after_s), wanted_hz));
            self.off_cents = off.filter(|off| off.abs() < STRAY_CENTS).map(|off| {
                let heard = self.off_cents.unwrap_or(off);
                heard + NEW * (off - heard)
            });
            self.since_s = Some(after_s);
        } else {
            self.since_s = passed_s;
            if passed_s.is_some_and(|passed_s| passed_s * wanted_hz > 2.0) {
                self.off_cents = None;
            }
        }
        self.off_cents
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_note_with_partials_is_heard_within_ten_cents_and_another_not_at_all() {
        let tick_s = 16.0 / 96_000.0;
        for hz in [150.0, 320.0, 700.0, 930.0] {
            for off in [-80.0, 0.0, 150.0, 900.0] {
                let note_hz = hz * f64::exp2(off / 1_200.0);
                let mut ear = PitchEar::default();
                let mut heard = None;
                for n in 0..3_000 {
                    let turn = TAU * (note_hz * tick_s * f64::from(n)).fract();
                    heard = ear.hear(0.2 + turn.sin() + 0.3 * (3.0 * turn).sin(), hz, tick_s);
                }
                match heard {
                    Some(heard) => assert!((heard - off).abs() < 10.0, "{hz} {off}: {heard}"),
                    None => assert!(off > STRAY_CENTS, "{hz} {off}"),
                }
            }
        }
    }
}
