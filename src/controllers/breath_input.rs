//! The inputs that breath can come from, as the window names them.

use chalumeau_core::control::midi::BreathOrigin;
use chalumeau_core::control::midi::breath::BreathController;

/// An input that breath can come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BreathInput {
    /// Velocity of the keys, until another input moves.
    Keys,
    /// The parameter *Breath*, which hosts automate.
    Parameter,
    /// Breath controller, CC2.
    Breath,
    /// Expression, CC11.
    Expression,
    /// Channel pressure.
    Pressure,
    /// Pressure or expression of a note.
    Note,
    /// The knob's angle.
    Knob,
    /// A controller that the user has linked to the breath.
    Link,
    /// Wind at a microphone.
    Microphone,
}

impl BreathInput {
    /// All inputs, in the order the window shows them.
    pub const ALL: [Self; 9] = [
        Self::Keys,
        Self::Parameter,
        Self::Breath,
        Self::Expression,
        Self::Pressure,
        Self::Note,
        Self::Knob,
        Self::Link,
        Self::Microphone,
    ];

    /// Its name in the window.
    pub fn title(self) -> &'static str {
        match self {
            Self::Keys => "Keys, by velocity",
            Self::Parameter => "Breath parameter",
            Self::Breath => "CC2 breath",
            Self::Expression => "CC11 expression",
            Self::Pressure => "Channel pressure",
            Self::Note => "Note expression",
            Self::Knob => "Knob",
            Self::Link => "Linked controller",
            Self::Microphone => "Microphone",
        }
    }
}

impl From<BreathOrigin> for BreathInput {
    fn from(origin: BreathOrigin) -> Self {
        match origin {
            BreathOrigin::Controller(BreathController::Breath) => Self::Breath,
            BreathOrigin::Controller(BreathController::Expression) => Self::Expression,
            BreathOrigin::Controller(BreathController::Pressure) => Self::Pressure,
            BreathOrigin::Note => Self::Note,
            BreathOrigin::Link => Self::Link,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_input_is_shown_once() {
        for (place, input) in BreathInput::ALL.into_iter().enumerate() {
            assert_eq!(input as usize, place);
        }
    }
}
