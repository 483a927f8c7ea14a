//! How many players play, and how they sit and share the notes.

use nice_plug::prelude::*;

use super::entry::{choice, whole};
use super::settled;
use chalumeau_core::instrument::{Players, Split};

/// The players.
#[derive(Params)]
pub struct PlayersParams {
    /// [`Players::count`].
    #[id = "player"]
    pub count: IntParam,
    /// [`Players::split`].
    #[id = "split"]
    pub split: EnumParam<SplitChoice>,
    /// [`Players::spread_cents`].
    #[id = "spread"]
    pub spread: FloatParam,
    /// [`Players::onset_spread_ms`].
    #[id = "late"]
    pub onset_spread: FloatParam,
    /// [`Players::width`].
    #[id = "seats"]
    pub seats: FloatParam,
}

/// [`Split`] as hosts see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum SplitChoice {
    /// [`Split::Chords`].
    #[id = "chords"]
    Chords,
    /// [`Split::Unison`].
    #[id = "unison"]
    Unison,
}

impl From<SplitChoice> for Split {
    fn from(choice: SplitChoice) -> Self {
        Self::ALL[choice.to_index()]
    }
}

impl PlayersParams {
    /// The table's parameters; `number` makes one from its id.
    pub(super) fn new(number: &dyn Fn(&str) -> FloatParam) -> Self {
        Self {
            count: whole("player"),
            split: choice("split"),
            spread: number("spread"),
            onset_spread: number("late"),
            seats: number("seats"),
        }
    }

    /// As the instrument reads them. Real-time safe.
    pub(super) fn players(&self) -> Players {
        Players {
            count: self.count.value(),
            split: self.split.value().into(),
            spread_cents: settled(&self.spread),
            onset_spread_ms: settled(&self.onset_spread),
            width: settled(&self.seats),
        }
    }
}
