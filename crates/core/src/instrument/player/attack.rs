//! Attacks: how the dynamic gets to where it is asked to be when a note is tongued.
//!
//! The partials of a note bloom one after another because breath and lip rise: a soft attack begins well below the asked
//! dynamic, where there is hardly more than the fundamental. A hard one begins above it and eases off. A normal one is there
//! at once: the air column alone makes its growth.
//!
//! What the tongue lets go of strikes all modes of the bore. On the highest notes the low ones are struck hardest, and a soft note would
//! be heard as a grunt until it outgrows them. So the lip lets the reed swing more freely while such a note begins, which favours the mode
//! that is next to the reed's resonance.

use super::dynamics::high;
use super::lip_glide::LipHelp;
use crate::dsp::smooth::smooth;
use crate::maths;

/// How a tongued note begins where the breath is [played](crate::instrument::BreathResponse::Played).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Attack {
    /// The note grows: upper partials come a tenth of a second and more after the fundamental.
    Soft,
    /// The note is there as soon as the air column lets it.
    #[default]
    Normal,
    /// The note begins with an accent.
    Hard,
}

impl Attack {
    /// All, in the order of the parameter that chooses one.
    pub const ALL: [Self; 3] = [Self::Soft, Self::Normal, Self::Hard];
}

/// Soft: the share of the dynamic that the beginning lacks, and the time constant with which it comes, s: chosen for the delays of
/// recorded partials, see `docs/tone.md`.
const SOFT: (f64, f64) = (0.3, 0.18);
/// Soft: the time constant is at most this share of the time from the note before: who plays quickly attacks quickly.
const SOFT_OF_INTERVAL: f64 = 0.36;
/// Hard: what the dynamic begins above, and the time until that is gone, s.
const HARD: (f64, f64) = (0.2, 0.1);
/// Hard: how much more quickly the tongue lets go.
const HARD_RELEASE: f64 = 2.0;

/// What the lip takes from the factor on the reed's damping while a note begins: wholly from written E flat 6 on, nothing up to C6. With
/// 0.4, G6 begins more than 5 dB louder than it goes on.
const HIGH_FREEDOM: f64 = 0.35;
/// For how long, periods of the note: 0.029 s on written E flat 6 of a B flat clarinet, and 0.017 s on C7.
const HIGH_PERIODS: f64 = 32.0;

/// What a player's lip does while a tongued note at a [place](super::dynamics::PlayerModel::place) begins; `None` where nothing needs to be done.
pub fn lip_help(place: f64, note_hz: f64) -> Option<LipHelp> {
    let high = high(place);
    (high > 0.0).then(|| LipHelp { damping: 1.0 - HIGH_FREEDOM * high, length_s: HIGH_PERIODS / note_hz })
}

/// State: time since the tongue held the reed, and time from the note before to this one, s.
#[derive(Clone, Copy, Debug, Default)]
pub struct Onset {
    since_s: f64,
    interval_s: f64,
}

impl Attack {
    /// Factor on the speed with which the tongue lets go.
    pub fn release(self) -> f64 {
        if self == Self::Hard { HARD_RELEASE } else { 1.0 }
    }
}

impl Onset {
    /// Time goes on by a tick; while the tongue holds the reed before a note it stands still.
    pub fn tick(&mut self, tongue_holds: bool, interval_s: f64, tick_s: f64) {
        self.interval_s = interval_s;
        self.since_s = if tongue_holds { 0.0 } else { self.since_s + tick_s };
    }

    /// The dynamic to play now where `dynamic`, 0..=1, is asked for. Real-time safe.
    pub fn shaped(&self, attack: Attack, dynamic: f64) -> f64 {
        let tail = |time_s: f64| maths::exp(-self.since_s / time_s);
        let left = |time_s: f64| smooth(1.0 - self.since_s / time_s);
        match attack {
            Attack::Normal => dynamic,
            Attack::Soft => dynamic * (1.0 - SOFT.0 * tail(SOFT.1.min(SOFT_OF_INTERVAL * self.interval_s))),
            Attack::Hard => (dynamic + HARD.0 * left(HARD.1)).min(1.0),
        }
    }
}
