//! What breath and lip do beside what is asked: the sum of [`life`](super::life) and [`vibrato`](super::vibrato).

use super::life::{Life, LifeLags};
use super::vibrato::Swing;
use crate::instrument::person::Person;
use crate::instrument::settings::{BreathResponse, Settings};

/// Ticks between two values: 0.7 ms. The breath's own lag smooths their steps; the lip's are below 0.1 dB.
pub const SWAY_TICKS: u32 = 4;

/// How far breath and lip are from where they are asked to be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sway {
    /// What is added to the dynamic of breath and lip. Where the breath is physical: to the mouth pressure, as a share of it.
    pub dynamic: f64,
    /// Room that `dynamic` needs on either side: the asked dynamic keeps so far from 0 and from 1.
    pub room: f64,
    /// What the lip adds to the pitch by the reed's resonance, cents.
    pub reed_cents: f64,
    /// What it adds by the tuning delay, cents.
    pub cents: f64,
}

impl Sway {
    /// A dynamic, 0..=1, that sways, to 1 at most: a note has neither pressure nor trim for a lip that opens further. Softer than 0 it
    /// may become, where only the lip follows and the pitch hardly moves.
    pub fn of(&self, dynamic: f64) -> f64 {
        (dynamic.clamp(self.room, 1.0 - self.room) + self.dynamic).min(1.0)
    }
}

impl std::ops::Add for Sway {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            dynamic: self.dynamic + other.dynamic,
            room: self.room.max(other.room),
            reed_cents: self.reed_cents + other.reed_cents,
            cents: self.cents + other.cents,
        }
    }
}

/// State: life and vibrato of one player, and how far they move breath and lip now.
#[derive(Clone, Copy, Debug, Default)]
pub struct Swaying {
    life: Life,
    /// The vibrato.
    pub swing: Swing,
    now: Sway,
    /// Ticks until `now` moves on.
    left: u32,
}

impl Swaying {
    /// At rest, as this player sways.
    pub fn of(person: &Person) -> Self {
        Self { life: Life::of(person), swing: Swing::of(person), ..Self::default() }
    }

    /// The same under its controller, for a player on another instrument.
    pub fn carried(&self, person: &Person) -> Self {
        Self { swing: self.swing.carried(person), ..Self::of(person) }
    }

    /// The sway of this tick of `tick_s` seconds; a dynamic of 1 is `range_db` above 0. Real-time safe.
    pub fn tick(
        &mut self,
        is_idle: bool,
        settings: &Settings,
        lags: &LifeLags,
        tick_s: f64,
        range_db: f64,
    ) -> Sway {
        self.left = match self.left {
            // Nobody sways what nobody holds; a bore that is moved does not fall silent.
            _ if is_idle => 0,
            0 => {
                let (amount, range_db) = match settings.breath_response {
                    // A blowing machine does not live.
                    BreathResponse::Physical => (0.0, None),
                    BreathResponse::Played => (f64::from(settings.life), Some(range_db)),
                };
                self.now =
                    self.life.step(amount, lags) + self.swing.step(&settings.vibrato, range_db, tick_s);
                SWAY_TICKS - 1
            }
            left => left - 1,
        };
        self.now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_louder_than_the_loudest() {
        let [up, down] = [0.02, -0.02].map(|dynamic| Sway { dynamic, ..Sway::default() });
        assert_eq!((up.of(1.0), up.of(0.5), down.of(1.0)), (1.0, 0.52, 0.98));
        assert_eq!(Sway { room: 0.1, ..up }.of(1.0), 0.92);
    }
}
