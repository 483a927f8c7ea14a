//! The room around the instrument.

use nice_plug::prelude::*;

use super::settled;
use chalumeau_core::instrument::Room;

/// The room.
#[derive(Params)]
pub struct RoomParams {
    /// [`Room::amount`].
    #[id = "room"]
    pub amount: FloatParam,
    /// [`Room::size_m`].
    #[id = "rsize"]
    pub size: FloatParam,
    /// [`Room::decay_s`].
    #[id = "rdecay"]
    pub decay: FloatParam,
    /// [`Room::tone`].
    #[id = "rtone"]
    pub tone: FloatParam,
}

impl RoomParams {
    /// The table's parameters; `number` makes one from its id.
    pub(super) fn new(number: &dyn Fn(&str) -> FloatParam) -> Self {
        Self { amount: number("room"), size: number("rsize"), decay: number("rdecay"), tone: number("rtone") }
    }

    /// As the instrument reads them. Real-time safe.
    pub(super) fn room(&self) -> Room {
        Room {
            amount: settled(&self.amount),
            size_m: settled(&self.size),
            decay_s: settled(&self.decay),
            tone: settled(&self.tone),
        }
    }
}
