//! Vibrato: breath and lip swing together, regularly.
//!
//! At depth 1 the lip moves the pitch by [`DEEPEST_CENTS`] either way and the breath the level by [`DEEPEST_DB`], in phase, as
//! a sine. A player's vibrato is not a machine's: every cycle has a rate and a depth of its own. It grows after a tongued note
//! has begun, and goes on through slurs.

use super::sway::{SWAY_TICKS, Sway};
use crate::dsp::smooth::smooth;
use crate::dsp::white::White;
use crate::instrument::person::Person;
use crate::units::clamped_or;

/// Swing of the pitch at depth 1, cents either way.
pub const DEEPEST_CENTS: f64 = 25.0;
/// Swing of the level at depth 1, dB either way.
pub const DEEPEST_DB: f64 = 3.0;
/// Swing of the mouth pressure at depth 1 where the breath is physical, as a share of it (by judgement: 1 dB in the middle of
/// the dynamic range, more near the threshold).
const PHYSICAL_SWING: f64 = 0.08;
/// Standard deviations of the rate and of the depth of a cycle at unevenness 1, as shares (by judgement).
const UNEVEN: (f64, f64) = (0.1, 0.25);
/// Time constant with which the depth follows its controller, s: quick, but without steps.
const DEPTH_S: f64 = 0.04;
/// Seed of the unevenness: any constant does.
const SEED: u64 = 0x9FB2_1C65_1E98_DF25;

/// A regular swing of breath and lip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vibrato {
    /// Depth, 0 (none)..=1 (25 cents and 3 dB either way). [`Event::Vibrato`](crate::event::Event::Vibrato) adds to it. Default 0.
    pub depth: f32,
    /// Swings a second, 3..=8. Default 5.2.
    pub rate_hz: f32,
    /// Time after a tongued note has begun until the vibrato has its depth, s, 0..=2. Default 0.4.
    pub onset_s: f32,
    /// How much rate and depth differ from one swing to the next, 0 (a machine)..=1. Default 0.3.
    pub unevenness: f32,
}

impl Default for Vibrato {
    fn default() -> Self {
        Self { depth: 0.0, rate_hz: 5.2, onset_s: 0.4, unevenness: 0.3 }
    }
}

impl Vibrato {
    /// Every number inside its range; one that is not finite becomes its default. Real-time safe.
    pub fn clamped(self) -> Self {
        let d = Self::default();
        Self {
            depth: clamped_or(self.depth, 0.0, 1.0, d.depth),
            rate_hz: clamped_or(self.rate_hz, 3.0, 8.0, d.rate_hz),
            onset_s: clamped_or(self.onset_s, 0.0, 2.0, d.onset_s),
            unevenness: clamped_or(self.unevenness, 0.0, 1.0, d.unevenness),
        }
    }
}

/// State of the vibrato.
#[derive(Clone, Copy, Debug)]
pub struct Swing {
    /// What the controller adds to the depth, 0..=1.
    controller: f64,
    /// Depth now, before the onset of the note.
    depth: f64,
    /// Time since the tongued note began, s.
    since_s: f64,
    /// Turns since the cycle began, 0..1.
    turn: f64,
    /// Where the first cycle begins, turns, 0..1.
    begin: f64,
    /// Factors of this cycle on rate and depth, and the depth's of the cycle before.
    rate: f64,
    strength: [f64; 2],
    white: White,
}

impl Default for Swing {
    fn default() -> Self {
        Self::of(&Person::default())
    }
}

/// Sine of a whole `turn`, 0..1, by the formula of Bhaskara I (7th century): right within 0.002, with no kink.
fn sine(turn: f64) -> f64 {
    let (half, sign) = if turn < 0.5 { (2.0 * turn, 1.0) } else { (2.0 * turn - 1.0, -1.0) };
    let x = half * (1.0 - half);
    sign * 16.0 * x / (5.0 - 4.0 * x)
}

impl Swing {
    /// At rest, as this player swings.
    pub fn of(person: &Person) -> Self {
        Self {
            controller: 0.0,
            depth: 0.0,
            since_s: 0.0,
            turn: person.phase(),
            begin: person.phase(),
            rate: 1.0,
            strength: [1.0; 2],
            white: White::new(person.seed(SEED)),
        }
    }

    /// The controller adds to the depth of the settings, 0..=1; not a number counts as 0.
    pub fn set_controller(&mut self, depth: f32) {
        self.controller = f64::from(clamped_or(depth, 0.0, 1.0, 0.0));
    }

    /// The same controller for a player on another instrument.
    pub fn carried(&self, person: &Person) -> Self {
        Self { controller: self.controller, ..Self::of(person) }
    }

    /// Takes over the controller of another player.
    pub fn follow(&mut self, from: &Self) {
        self.controller = from.controller;
    }

    /// A note is tongued.
    pub fn begin_note(&mut self) {
        self.since_s = 0.0;
    }

    /// The swing of the next `SWAY_TICKS` of `tick_s` seconds, in dynamics of which one is `range_db`; `None` for a physical
    /// breath. Real-time safe.
    pub fn step(&mut self, vibrato: &Vibrato, range_db: Option<f64>, tick_s: f64) -> Sway {
        let wanted = (f64::from(vibrato.depth) + self.controller).min(1.0);
        if wanted == 0.0 && self.depth == 0.0 {
            (self.turn, self.strength) = (self.begin, [1.0; 2]);
            return Sway::default();
        }
        let step_s = f64::from(SWAY_TICKS) * tick_s;
        self.since_s += step_s;
        self.depth += (wanted - self.depth) * (step_s / DEPTH_S).min(1.0);
        if wanted == 0.0 && self.depth < 1e-3 {
            self.depth = 0.0;
        }
        self.turn += self.rate * f64::from(vibrato.rate_hz) * step_s;
        if self.turn >= 1.0 {
            self.turn -= 1.0;
            let uneven = f64::from(vibrato.unevenness);
            self.rate = 1.0 / (1.0 + uneven * UNEVEN.0 * self.white.next());
            self.strength = [self.strength[1], 1.0 + uneven * UNEVEN.1 * self.white.next()];
        }
        let onset = f64::from(vibrato.onset_s);
        let grown = if self.since_s < onset { smooth(self.since_s / onset) } else { 1.0 };
        let [before, now] = self.strength;
        let depth = self.depth * grown * (before + (now - before) * self.turn);
        let depth = depth.min(1.0 + UNEVEN.1);
        let swing = depth * sine(self.turn);
        let dynamic = range_db.map_or(PHYSICAL_SWING, |range_db| DEEPEST_DB / range_db);
        Sway {
            dynamic: swing * dynamic,
            room: if range_db.is_some() { depth * dynamic } else { 0.0 },
            reed_cents: 0.0,
            cents: swing * DEEPEST_CENTS,
        }
    }
}
