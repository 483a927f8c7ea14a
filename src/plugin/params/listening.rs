//! Where the instrument is heard from.

use nice_plug::prelude::*;

use super::entry::choice;
use super::settled;
use chalumeau_core::instrument::{Listening, ListeningMode};

/// Where it is heard from.
#[derive(Params)]
pub struct ListeningParams {
    /// [`Listening::mode`].
    #[id = "heard"]
    pub mode: EnumParam<ListeningChoice>,
    /// [`Listening::distance_m`].
    #[id = "ldist"]
    pub distance: FloatParam,
    /// [`Listening::angle_deg`].
    #[id = "langle"]
    pub angle: FloatParam,
    /// [`Listening::height_m`].
    #[id = "lheigh"]
    pub height: FloatParam,
    /// [`Listening::width_deg`].
    #[id = "lwidth"]
    pub width: FloatParam,
}

/// [`ListeningMode`] as hosts see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum ListeningChoice {
    /// [`ListeningMode::Everywhere`].
    #[id = "all"]
    Everywhere,
    /// [`ListeningMode::Position`].
    #[id = "place"]
    Position,
    /// [`ListeningMode::Point`].
    #[id = "point"]
    #[name = "One point"]
    Point,
}

impl From<ListeningChoice> for ListeningMode {
    fn from(choice: ListeningChoice) -> Self {
        Self::ALL[choice.to_index()]
    }
}

impl ListeningParams {
    /// The table's parameters; `number` makes one from its id.
    pub(super) fn new(number: &dyn Fn(&str) -> FloatParam) -> Self {
        Self {
            mode: choice("heard"),
            distance: number("ldist"),
            angle: number("langle"),
            height: number("lheigh"),
            width: number("lwidth"),
        }
    }

    /// As the instrument reads them. Real-time safe.
    pub(super) fn listening(&self) -> Listening {
        Listening {
            mode: self.mode.value().into(),
            distance_m: settled(&self.distance),
            angle_deg: settled(&self.angle),
            height_m: settled(&self.height),
            width_deg: settled(&self.width),
        }
    }
}
