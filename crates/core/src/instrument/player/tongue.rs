//! The tongue: it holds the reed before a note, lets go, stops the note, and slaps.

use super::ear::Ear;
use super::retongued::{IN_TIME_S, LONGEST_WAIT_S};
use super::{TickContext, step_towards};
use crate::instrument::slap::{BREATH_GAMMA, Slap};
use crate::reed::motion::TONGUE_FORCE;

/// How long the tongue holds the reed before a tongued note, s: long enough for the breath to rise behind it.
const HOLD_S: f64 = 0.008;
/// The tongue stays away from the reed for this long at least, s, however short a key is held: about the shortest staccato (by
/// judgement). Landing earlier, it would find a reed that it has hardly let go.
const SHORTEST_S: f64 = 0.02;
/// It stays away for this long at most to let a note speak whose key is up, s: with a key of 50 ms, notes above the break were 5 to
/// 15 dB softer than with longer keys. With 0.06, some in the altissimo still are, by 9 dB.
const LATEST_S: f64 = 0.08;
/// Mouth pressure over the closing pressure below which the tongue moves less quickly, in proportion and down to the least share of its
/// speed: without breath, a reed that is let go pops as loud as 20 dB below a note.
const QUIET_GAMMA: f64 = 0.15;
/// See [`QUIET_GAMMA`].
const LEAST_SPEED: f64 = 0.05;
/// The tongue takes at most this share of the time since the note before to let go: who plays quickly tongues quickly. With a tongue of 18 ms
/// and a damped reed, sounding C5 to G5 at a velocity of 50 every 0.14 s were up to 11 dB softer than when held; with this, 1 dB.
const OF_INTERVAL: f64 = 0.1;
/// Intervals that count, s. A note that the next one followed sooner was none: a key may be struck twice in one moment. Longer ones count as the
/// longest.
const INTERVALS_S: (f64, f64) = (0.01, 1.0);
/// How long the tongue takes to reach the reed when it stops a note, s.
const STOP_S: f64 = 0.005;
/// Time constant with which the force on the reed grows, s, so that the tongue lands softly.
const PRESS_S: f64 = 0.001;

/// Where the tongue is. Between notes it rests on the reed, so that the reed does not slam shut when the next note is
/// prepared.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Position {
    /// On the reed.
    Resting,
    /// Away from the reed.
    Away,
    /// On the reed before a note, for so many more seconds.
    Holding(f64),
    /// On the reed until the pressure of the note before rises through zero, for so many more seconds at most.
    Listening(f64),
    /// On the reed in time with what rings, for so many more seconds.
    InTime(f64),
    /// Letting go; share of the force that is left, 1..0.
    Leaving(f64),
    /// Pressing to stop a note; share of the force that is reached, 0..1.
    Stopping(f64),
    /// On the reed after a slap under a held key, until the breath is strong enough for the note.
    AwaitingBreath,
}

/// State of the tongue.
#[derive(Clone, Copy, Debug)]
pub struct Tongue {
    position: Position,
    /// Time for which it has been away, s, up to [`LATEST_S`].
    away_s: f64,
    /// Time since it went to the reed before a note, s, and from then to the time before, within [`INTERVALS_S`].
    since_s: f64,
    interval_s: f64,
    /// The note before still rings, and it lets go in time with that.
    is_in_time: bool,
    /// The key has come up: it lands as soon as it may.
    is_due: bool,
    /// Its last movement was a slap.
    has_slapped: bool,
    /// The slap that pulls at the reed, if there is one; it overrides the position.
    slap: Option<Slap>,
    /// Force on the reed, smoothed so that the tongue never slaps by accident; negative while a slap pulls.
    force: f64,
}

impl Default for Tongue {
    fn default() -> Self {
        Self {
            position: Position::Resting,
            away_s: LATEST_S,
            since_s: INTERVALS_S.1,
            interval_s: INTERVALS_S.1,
            is_in_time: false,
            is_due: false,
            has_slapped: false,
            slap: None,
            force: TONGUE_FORCE,
        }
    }
}

/// Share of its speed with which the tongue moves at this mouth pressure over the closing pressure.
fn speed(gamma: f64) -> f64 {
    (gamma / QUIET_GAMMA).clamp(LEAST_SPEED, 1.0)
}

impl Tongue {
    /// Prepares a tongued note, which begins in time with what rings if the note before does.
    pub fn hold(&mut self, is_in_time: bool) {
        self.is_in_time = is_in_time;
        self.position = Position::Holding(HOLD_S);
        if self.since_s >= INTERVALS_S.0 {
            self.interval_s = self.since_s;
        }
        self.since_s = 0.0;
        (self.away_s, self.is_due, self.has_slapped) = (0.0, false, false);
    }

    /// Time from the note before to this one, s, within [`INTERVALS_S`].
    pub fn interval_s(&self) -> f64 {
        self.interval_s
    }

    /// Stops the note; one that has hardly begun is played until it speaks, for [`LATEST_S`] at most. Until then it [is due](Self::is_due).
    pub fn stop(&mut self) {
        match self.position {
            // On the reed, where it stays.
            Position::Resting | Position::AwaitingBreath => self.position = Position::Resting,
            Position::Stopping(_) => {}
            _ if self.away_s < LATEST_S => self.is_due = true,
            _ => self.position = Position::Stopping(0.0),
        }
    }

    /// Lands at once, whatever has been heard of the note.
    pub fn land(&mut self) {
        self.is_due = false;
        self.position = match self.position {
            Position::Leaving(left) => Position::Stopping(left),
            Position::Away => Position::Stopping(0.0),
            Position::Stopping(reached) => Position::Stopping(reached),
            // On the reed, where it stays.
            _ => Position::Resting,
        };
    }

    /// Begins a slap of a strength in 0..=1; false if there is nothing to begin. `closing` is the closing pressure of
    /// the reed over the reference, before a player's lip shapes it, `gamma` the mouth pressure over the closing pressure.
    pub fn slap(&mut self, strength: f32, closing: f64, key_down: bool, gamma: f64) -> bool {
        let Some(slap) = Slap::begin(strength, self.force / closing, self.slap) else { return false };
        self.slap = Some(slap);
        (self.away_s, self.is_due, self.has_slapped) = (LATEST_S, false, true);
        self.position = match key_down {
            false => Position::Resting,
            true if gamma < BREATH_GAMMA => Position::AwaitingBreath,
            true => Position::Away,
        };
        true
    }

    /// Rests on another reed, with this closing pressure: the force with which it does, if it rests.
    pub fn rest_on(&mut self, free_closing: f64) -> Option<f64> {
        if self.position != Position::Resting || self.slap.is_some() {
            return None;
        }
        self.force = TONGUE_FORCE * free_closing;
        Some(self.force)
    }

    /// Whether the tongue holds the reed before a note.
    pub fn is_holding(&self) -> bool {
        matches!(self.position, Position::Holding(_) | Position::Listening(_) | Position::InTime(_))
    }

    /// Whether the key has come up and the note is still to be played.
    pub fn is_due(&self) -> bool {
        self.is_due
    }

    /// Whether the tongue is away from the reed and leaves it alone.
    pub fn is_away(&self) -> bool {
        self.position == Position::Away && self.slap.is_none()
    }

    /// Whether a slap pulls at the reed.
    pub fn is_slapping(&self) -> bool {
        self.slap.is_some()
    }

    /// Takes over from the tongue of a player of another instrument, under a held key: a movement goes on, but a tongue
    /// that rested or was about to rest stays away.
    pub fn carry_on(&mut self, from: &Self) {
        self.position = match from.position {
            Position::Resting | Position::Stopping(_) => Position::Away,
            position => position,
        };
        (self.away_s, self.is_due) = (from.away_s, from.is_due);
        if self.position == Position::Away {
            self.force = 0.0;
        }
    }

    /// Moves the tongue. `gamma` is the mouth pressure over the closing pressure, `hardness` the factor of
    /// [`Breath::attack_hardness`](super::breath::Breath::attack_hardness), `heard` is the ear, which hears what rings, and
    /// whether a note that [is due](Self::is_due) is as loud as it should be. Gives the pressure at the reed's tip and the force on the reed, both
    /// over the reference closing pressure.
    pub fn tick(
        &mut self,
        gamma: f64,
        hardness: f64,
        heard: (&Ear, bool),
        context: &TickContext<'_>,
    ) -> (f64, f64) {
        let (tick_s, closing) = (context.tick_s, context.posture.closing);
        let free_closing = context.posture.free_closing;
        let share = self.move_on(gamma, hardness, heard, context);
        let p_mouth = gamma * closing;
        let force = TONGUE_FORCE * free_closing * share;
        let Some(slap) = &mut self.slap else {
            // Letting go is as quick as asked; pressing takes a moment. After a slap it shuts the reed, with breath or without.
            let press_s = if self.has_slapped { PRESS_S } else { PRESS_S / speed(gamma) };
            self.force = if force <= self.force {
                force
            } else {
                self.force + step_towards(tick_s, press_s) * (force - self.force)
            };
            return (p_mouth, self.force);
        };
        match slap.tick(tick_s) {
            Some(pull) => {
                self.force = pull.force * free_closing;
                (p_mouth * (1.0 - pull.seal) + pull.suction * closing, self.force)
            }
            // The tongue comes off within one tick; its next movement begins at the free reed.
            None => {
                self.slap = None;
                self.force = 0.0;
                (p_mouth, self.force)
            }
        }
    }

    /// Moves on to the next position; gives the share of the full force that the position asks for.
    fn move_on(
        &mut self,
        gamma: f64,
        hardness: f64,
        (ear, speaks): (&Ear, bool),
        context: &TickContext<'_>,
    ) -> f64 {
        let tick_s = context.tick_s;
        let speed = speed(gamma);
        self.since_s = (self.since_s + tick_s).min(INTERVALS_S.1);
        let (position, share) = match self.position {
            Position::Resting => (Position::Resting, 1.0),
            Position::Away => {
                self.away_s = (self.away_s + tick_s).min(LATEST_S);
                let lands = self.is_due && self.away_s >= SHORTEST_S && (speaks || self.away_s == LATEST_S);
                self.is_due &= !lands;
                (if lands { Position::Stopping(0.0) } else { Position::Away }, 0.0)
            }
            Position::Holding(left_s) if left_s > tick_s => (Position::Holding(left_s - tick_s), 1.0),
            Position::Holding(_) if self.is_in_time => (Position::Listening(LONGEST_WAIT_S), 1.0),
            Position::Listening(_) if ear.rises_through_zero() => (Position::InTime(IN_TIME_S), 1.0),
            Position::Listening(left_s) if left_s > tick_s => (Position::Listening(left_s - tick_s), 1.0),
            Position::InTime(left_s) if left_s > tick_s => (Position::InTime(left_s - tick_s), 1.0),
            Position::Holding(_) | Position::Listening(_) | Position::InTime(_) => {
                (Position::Leaving(1.0), 1.0)
            }
            Position::Leaving(share) => {
                let leaving_s = 1e-3 * f64::from(context.settings.tongue_ms) / hardness;
                let share = share - tick_s * speed / leaving_s.min(OF_INTERVAL * self.interval_s);
                if share > 0.0 { (Position::Leaving(share), share) } else { (Position::Away, 0.0) }
            }
            Position::Stopping(share) => {
                let share = (share + tick_s * speed / STOP_S).min(1.0);
                (if share < 1.0 { Position::Stopping(share) } else { Position::Resting }, share)
            }
            Position::AwaitingBreath if gamma < BREATH_GAMMA => (Position::AwaitingBreath, 1.0),
            Position::AwaitingBreath => (Position::Leaving(1.0), 1.0),
        };
        self.position = position;
        share
    }
}
