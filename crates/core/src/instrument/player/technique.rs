//! Extended techniques: what settings and controllers ask for, reached smoothly.
//!
//! They act on the mouth pressure and on the lip at control ticks. A voice of 400 Hz has fifteen ticks in a period at the live
//! rate, and what a tick cannot carry lies above 3 kHz, where the glottis has little left. So they cost nothing per sample.

pub mod flutter;
pub mod growl;
pub mod subtone;

use super::known::Known;
use super::step_towards;
use crate::event::Technique;
use crate::instrument::person::Person;
use crate::instrument::settings::Settings;
use crate::instrument::techniques::GrowlPitch;
use crate::maths;
use crate::units::clamped_or;
use flutter::Flutter;
use growl::Growl;

/// Time constant with which a technique comes and goes, s: quick to a player, free of clicks.
const COME_S: f64 = 0.02;
/// A technique has gone below this amount: -80 dB.
const GONE: f64 = 1e-4;
/// Highest mouth over closing pressure that a technique may make. Above, a reed that is shut stays shut; but a technique does
/// not lower what the breath alone asks for.
const HIGHEST_GAMMA: f64 = 1.0;

/// A phase that has gone on, 0 or more, without its whole turns. It rarely has more than one, and the processors of the oldest kind
/// know no instruction for all of them.
#[inline(always)]
fn wrapped(phase: f64) -> f64 {
    if phase < 1.0 {
        phase
    } else if phase < 2.0 {
        phase - 1.0
    } else {
        phase.fract()
    }
}

/// State of the techniques.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlayedTechniques {
    /// What controllers add to the settings: growl, flutter, subtone.
    added: [f32; 3],
    /// Amounts now.
    amounts: [f64; 3],
    growl: Growl,
    flutter: Flutter,
    /// An interval, semitones, as a ratio of frequencies.
    interval: Known<f32, f64>,
}

impl PlayedTechniques {
    /// A controller's amount, 0..=1; it adds to that of the settings.
    pub fn set(&mut self, which: Technique, amount: f32) {
        self.added[which as usize] = clamped_or(amount, 0.0, 1.0, 0.0);
    }

    /// None, of this player.
    pub fn of(person: &Person) -> Self {
        let (growl, flutter) = (Growl::at(person.phase()), Flutter::at(person.phase()));
        Self { growl, flutter, ..Self::default() }
    }

    /// The same controllers for another instrument, whose techniques begin anew.
    pub fn carried(&self, person: &Person) -> Self {
        Self { added: self.added, ..Self::of(person) }
    }

    /// Takes over the controllers of another player.
    pub fn follow(&mut self, from: &Self) {
        self.added = from.added;
    }

    /// Moves the amounts towards what is asked; whether the lip's has changed.
    pub fn tick(&mut self, settings: &Settings, tick_s: f64) -> bool {
        let (set, [growl, flutter, subtone]) = (settings.techniques, self.added);
        let targets = [set.growl + growl, set.flutter + flutter, set.subtone + subtone];
        let targets = targets.map(|target| f64::from(target.min(1.0)));
        self.amounts != targets && self.go_on(targets, tick_s)
    }

    /// Moves the amounts on. Apart, so that those that have arrived need no lag.
    #[inline(never)]
    fn go_on(&mut self, targets: [f64; 3], tick_s: f64) -> bool {
        let (before, share) = (self.subtone(), step_towards(tick_s, COME_S));
        for (now, target) in self.amounts.iter_mut().zip(targets) {
            if *now != target {
                *now += (target - *now) * share;
                if (*now - target).abs() < GONE {
                    *now = target;
                }
            }
        }
        self.subtone() != before
    }

    /// How much the lip covers the reed, 0..=1.
    pub fn subtone(&self) -> f64 {
        self.amounts[Technique::Subtone as usize]
    }

    /// Whether voice or tongue move the mouth pressure, so that its mean is not what the ear should push.
    pub fn shakes(&self) -> bool {
        self.amounts[..2] != [0.0; 2]
    }

    /// Mouth over closing pressure with voice and tongue in it, for the breath's `gamma`. `note_hz` is the fingered note.
    pub fn shake(&mut self, gamma: f64, note_hz: f64, settings: &Settings, tick_s: f64) -> f64 {
        if !self.shakes() {
            return gamma;
        }
        let (set, [growl, flutter, _]) = (settings.techniques, self.amounts);
        let voice_hz = match set.growl_pitch {
            GrowlPitch::Fixed => f64::from(set.growl_hz),
            GrowlPitch::Interval => {
                let ratio = |semitones| maths::exp2(f64::from(semitones) / 12.0);
                note_hz * self.interval.of(set.growl_semitones, ratio)
            }
        };
        let voice = self.growl.tick(voice_hz, tick_s);
        self.flutter.tick(f64::from(set.flutter_hz), tick_s);
        // A tongue that does not flutter needs no sine: it changes nothing.
        let tongue = if flutter == 0.0 { 0.0 } else { flutter * self.flutter.swing() };
        let shaken = gamma * (1.0 + growl * voice).max(0.0) * (1.0 + tongue);
        shaken.min(HIGHEST_GAMMA.max(gamma))
    }
}
