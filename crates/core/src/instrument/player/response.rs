//! From breath to mouth pressure and lip: physical or played.
//!
//! Physical, breath is a mouth pressure. Played, it is a dynamic: every note begins at the same breath, the *softest* of the
//! settings, and from there to the *loudest* the dynamic goes from 0 to 1 along a curve; [`dynamics`](super::dynamics) has the
//! rule. Below the softest the pressure is below the onset of any note and falls to zero in proportion: nothing begins, and what sounded dies in a
//! tenth of a second.

use super::attack::{Attack, Onset};
use super::breath::Asked;
use super::dynamics::LOWEST_ONSET;
use super::ear::Ear;
use super::known::Known;
use super::lip_glide::NoteLip;
use super::posture::{PlayedBreath, Posture};
use super::sway::Sway;
use crate::instrument::settings::{BreathResponse, Settings};
use crate::maths;
use crate::reed::physical::P_REF_PA;

/// Breath at which every note begins unless another is set, 0..1: the controller value 4 of 127, above what a sensor at rest sends. Breath comes in
/// single precision; in double precision this would lie just above the controller's 4.
pub const ONSET: f64 = (4.0_f32 / 127.0) as f64;
/// Mouth pressure over the closing pressure for velocity 0 and 1 where the breath is physical: just above the threshold, and
/// loud (by ear).
pub const VELOCITY_GAMMA: (f64, f64) = (0.43, 0.85);
/// Dynamic for velocity 0 and 1: soft and loud (by ear).
pub const VELOCITY_DYNAMIC: (f64, f64) = (0.15, 1.0);
/// Time constant with which the lip follows the dynamic, s: slower than the breath, as muscles are, but not heard as late.
pub const LIP_S: f64 = 0.01;
/// How much more slowly the tongue lets go at dynamic 0 than at 1, as a factor less 1: the release is then as loud as the note
/// (measured).
const SOFT_RELEASE: f64 = 2.0;
/// The lip stays where it is for a smaller change of the dynamic: 0.003 dB.
const STILL: f64 = 1e-4;

/// A note speaks from this share of the amplitude that is expected: 2 dB less (by judgement).
const SPEAKS: f64 = 0.8;
/// No amplitude that is expected is below this, over the closing pressure.
const QUIETEST: f64 = 1e-6;

/// What a player's body does beside what is asked.
pub struct Bodily<'a> {
    /// The tongued note that begins.
    pub onset: &'a Onset,
    /// The lip on its way to the note.
    pub note_lip: NoteLip,
    /// How breath and lip sway.
    pub sway: &'a Sway,
    /// Nothing sounds yet, so that the lip may be in place at once.
    pub settles: bool,
    /// Share of its dynamic that a note keeps while it falls, 0..=1; 1 otherwise.
    pub fade: f64,
}

/// Where the lip is.
#[derive(Clone, Copy, Debug, Default)]
pub struct Response {
    /// Dynamic of lip and trim, 0..=1; `None` before the first note.
    lip: Option<f64>,
    /// Logarithm of the amplitude that the player expects to hear, and of that to which it goes.
    expected: f64,
    wanted: Known<f64, f64>,
    /// The breath is too soft for any note.
    is_below: bool,
}

/// Breath, 0..=1, that a dynamic of 0..=1 asks for; inverse of [`dynamic`].
pub fn breath_of_dynamic(dynamic: f64, settings: &Settings) -> f64 {
    let [softest, loudest, curve] =
        [settings.breath_softest, settings.breath_loudest, settings.breath_curve].map(f64::from);
    let above = if curve == 1.0 { dynamic } else { maths::pow(dynamic, 1.0 / curve) };
    softest + (loudest - softest) * above
}

/// Breath, 0..=1, as a dynamic, and its share of the softest breath where it is below.
pub fn dynamic(breath: f64, settings: &Settings) -> (f64, f64) {
    let [softest, loudest, curve] =
        [settings.breath_softest, settings.breath_loudest, settings.breath_curve].map(f64::from);
    let above = ((breath - softest) / (loudest - softest)).clamp(0.0, 1.0);
    let above = if curve == 1.0 { above } else { maths::pow(above, curve) };
    (above, if softest > 0.0 { (breath / softest).min(1.0) } else { 1.0 })
}

impl Response {
    /// Mouth over closing pressure that is asked for, and the posture's lip moved towards it. `ear`: what the player
    /// hears, if anything is to be heard of the note. Real-time safe.
    pub fn tick(
        &mut self,
        asked: Asked,
        ear: Option<&Ear>,
        bodily: &Bodily<'_>,
        settings: &Settings,
        posture: &mut Posture,
    ) -> f64 {
        match settings.breath_response {
            BreathResponse::Physical => {
                (self.lip, self.is_below) = (None, false);
                let gamma = physical(asked, settings, posture.closing) * (1.0 + bodily.sway.dynamic);
                // A note that falls fades as far as it holds.
                if bodily.fade < 1.0 { gamma.min(faded(gamma, bodily.fade)) } else { gamma }
            }
            BreathResponse::Played => self.played(asked, ear, bodily, settings, posture),
        }
    }

    /// Whether the note is about as loud as the player expects it to be; always, where the breath is physical.
    pub fn hears(&self, ear: &Ear) -> bool {
        self.lip.is_none() || ear.amplitude() >= SPEAKS * maths::exp(self.expected)
    }

    /// Whether the breath is softer than that from which notes begin.
    pub fn is_below(&self) -> bool {
        self.is_below
    }

    /// How much faster the tongue lets go for an attack, as a factor.
    pub fn haste(&self, attack: Attack) -> f64 {
        self.lip.map_or(1.0, |_| attack.release())
    }

    /// How much more slowly the tongue lets go of a soft note than of a loud one, as a factor: a quick release would be louder
    /// than the note.
    pub fn release(&self) -> f64 {
        self.lip.map_or(1.0, |lip| 1.0 + SOFT_RELEASE * (1.0 - lip))
    }

    /// The dynamic that lip and breath have now, 0..=1; `None` where the breath is physical or before the first note.
    pub fn dynamic(&self) -> Option<f64> {
        self.lip
    }

    fn played(
        &mut self,
        asked: Asked,
        ear: Option<&Ear>,
        bodily: &Bodily<'_>,
        settings: &Settings,
        posture: &mut Posture,
    ) -> f64 {
        let shaped = |dynamic: f64| bodily.fade * bodily.onset.shaped(settings.attack, dynamic);
        let (wanted, of_softest) = match asked {
            // The lip stays while the breath ends.
            Asked::Nothing => (self.lip.unwrap_or(0.0), 0.0),
            Asked::Level(level) => {
                let (dynamic, of_softest) = dynamic(level, settings);
                (shaped(dynamic), of_softest)
            }
            Asked::Velocity(velocity) => {
                let (soft, loud) = VELOCITY_DYNAMIC;
                (shaped(soft + (loud - soft) * velocity), 1.0)
            }
        };
        self.is_below = of_softest < 1.0;
        let lip = match self.lip {
            Some(lip) if !bodily.settles => lip + (wanted - lip) * posture.lags.lip,
            _ => wanted,
        };
        let lip = if (lip - wanted).abs() < STILL { wanted } else { lip };
        self.lip = Some(lip);
        let mut note_lip = bodily.note_lip;
        let place = note_lip.place;
        note_lip.resonance_hz *= 1.0 + bodily.sway.reed_cents * note_lip.resonance_per_cent;
        posture.shape_lip(bodily.sway.of(lip), note_lip);
        let breath = posture.played_breath(bodily.sway.of(wanted));
        // The lip is on its way, and the mouth pressure is half the way ahead of it, in logarithms: with that of the new note at once, a slur
        // to a firmer lip would be loud on the way; with the old note's, one to a looser lip would.
        let ahead = posture.closing_ahead().sqrt();
        // What a change does is heard as late as everything else.
        let amplitude = self.wanted.of((ahead * breath.amplitude).max(QUIETEST), maths::ln);
        let heard = if bodily.settles { 1.0 } else { posture.lags.ear };
        self.expected += (amplitude - self.expected) * heard;
        let breath = PlayedBreath { gamma: ahead * breath.gamma, amplitude: maths::exp(self.expected) };
        match ear {
            _ if of_softest < 1.0 => of_softest * LOWEST_ONSET,
            Some(ear) => ear.pushed(breath.gamma, breath.amplitude, place),
            None => breath.gamma,
        }
    }
}

/// A mouth over closing pressure that goes down to that of the softest key.
fn faded(gamma: f64, fade: f64) -> f64 {
    VELOCITY_GAMMA.0 + (gamma - VELOCITY_GAMMA.0) * fade
}

fn physical(asked: Asked, settings: &Settings, closing: f64) -> f64 {
    match asked {
        Asked::Nothing => 0.0,
        Asked::Level(level) => level * 1e3 * f64::from(settings.breath_full_kpa) / (P_REF_PA * closing),
        Asked::Velocity(velocity) => {
            let (soft, loud) = VELOCITY_GAMMA;
            soft + (loud - soft) * velocity
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn breath_begins_at_four_and_ends_at_127() {
        let d = Settings::default();
        for breath_curve in [0.5, 1.0, 2.0] {
            let settings = Settings { breath_curve, ..d };
            assert_eq!(dynamic(ONSET, &settings), (0.0, 1.0));
            assert_eq!(dynamic(1.0, &settings).0, 1.0);
            let curve: Vec<f64> = (4..=127).map(|cc| dynamic(f64::from(cc) / 127.0, &settings).0).collect();
            assert!(curve.is_sorted_by(|a, b| a < b));
        }
        assert_eq!(
            dynamic(f64::from(4.0_f32 / 127.0), &d),
            (0.0, 1.0),
            "the controller's own 4 begins the note"
        );
        let curved = Settings { breath_softest: 0.1, breath_loudest: 0.8, breath_curve: 1.5, ..d };
        for settings in [d, curved] {
            for wanted in [0.0, 0.3, 1.0] {
                assert!((dynamic(breath_of_dynamic(wanted, &settings), &settings).0 - wanted).abs() < 1e-12);
            }
        }
        assert_eq!(dynamic(0.5 * ONSET, &d), (0.0, 0.5));
        assert_eq!(dynamic(0.0, &d), (0.0, 0.0));
    }

    #[test]
    fn a_controller_that_never_reaches_its_ends_plays_all_dynamics() {
        let settings = Settings { breath_softest: 0.125, breath_loudest: 0.75, ..Settings::default() };
        assert_eq!(dynamic(0.125, &settings), (0.0, 1.0));
        assert_eq!(dynamic(0.0625, &settings), (0.0, 0.5));
        assert_eq!(dynamic(0.4375, &settings).0, 0.5);
        assert_eq!(dynamic(0.75, &settings).0, 1.0);
        assert_eq!(dynamic(1.0, &settings).0, 1.0);
        let no_rest = Settings { breath_softest: 0.0, ..settings };
        assert_eq!(dynamic(0.0, &no_rest), (0.0, 1.0), "every breath sounds");
        // Ends the wrong way round are apart all the same.
        let crossed = Settings { breath_softest: 0.5, breath_loudest: 0.2, ..settings }.clamped();
        assert!(crossed.breath_loudest > crossed.breath_softest);
    }
}
