//! Where breath has come from, for a screen. What blows is decided elsewhere; here it is only remembered.

use nice_plug::prelude::NoteEvent;

use crate::editor::snapshot::Source;

/// A way breath comes in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Velocity of the keys, while nothing else has moved.
    Keys,
    /// The parameter, as hosts automate it.
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
}

impl Way {
    /// In the order they are shown.
    pub const ALL: [Self; 7] =
        [Self::Keys, Self::Parameter, Self::Breath, Self::Expression, Self::Pressure, Self::Note, Self::Knob];

    /// As players call it.
    pub fn title(self) -> &'static str {
        match self {
            Self::Keys => "Keys, by velocity",
            Self::Parameter => "Breath parameter",
            Self::Breath => "CC2 breath",
            Self::Expression => "CC11 expression",
            Self::Pressure => "Channel pressure",
            Self::Note => "Note expression",
            Self::Knob => Source::KNOB,
        }
    }

    /// Of a host's event, with its value.
    fn of<S>(event: &NoteEvent<S>) -> Option<(Self, f32)> {
        Some(match *event {
            NoteEvent::NoteOn { velocity, .. } => (Self::Keys, velocity),
            NoteEvent::MidiCC { cc: 2, value, .. } => (Self::Breath, value),
            NoteEvent::MidiCC { cc: 11, value, .. } => (Self::Expression, value),
            NoteEvent::MidiChannelPressure { pressure, .. } => (Self::Pressure, pressure),
            NoteEvent::PolyPressure { pressure: value, .. }
            | NoteEvent::PolyExpression { expression: value, .. }
            | NoteEvent::PolyBrightness { brightness: value, .. } => (Self::Note, value),
            _ => return None,
        })
    }
}

/// What each way said last. Real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Breaths {
    said: [Option<f32>; Way::ALL.len()],
    blows: Option<Way>,
}

impl Breaths {
    /// Takes notice of a host's event; `blew` if breath came of it.
    pub fn hear<S>(&mut self, event: &NoteEvent<S>, blew: bool) {
        match Way::of(event) {
            Some((Way::Keys, velocity)) => self.press(velocity),
            Some((way, value)) if blew => self.blow(way, value),
            Some((way, value)) => self.say(way, value),
            None => {}
        }
    }

    /// Takes notice of a key; it blows while nothing else has.
    pub fn press(&mut self, velocity: f32) {
        self.say(Way::Keys, velocity);
        self.blows.get_or_insert(Way::Keys);
    }

    /// Takes notice of breath that is no host's event.
    pub fn blow(&mut self, way: Way, unit: f32) {
        self.say(way, unit);
        self.blows = Some(way);
    }

    fn say(&mut self, way: Way, unit: f32) {
        self.said[way as usize] = Some(unit.clamp(0.0, 1.0));
    }

    /// What a way said last, 0..=1, if anything.
    pub fn said(&self, way: Way) -> Option<f32> {
        self.said[way as usize]
    }

    /// Whether it is the one that blows.
    pub fn is_live(&self, way: Way) -> bool {
        self.blows == Some(way)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn controller(cc: u8, value: f32) -> NoteEvent<()> {
        NoteEvent::MidiCC { timing: 0, channel: 0, cc, value }
    }

    #[test]
    fn what_blew_last_is_live_and_what_was_outranked_is_shown() {
        let mut breaths = Breaths::default();
        breaths.press(0.9);
        assert!(breaths.is_live(Way::Keys));
        breaths.hear(&controller(11, 0.25), true);
        assert!(breaths.is_live(Way::Expression));
        breaths.hear(&controller(2, 0.5), true);
        breaths.hear(&controller(11, 0.75), false);
        assert!(breaths.is_live(Way::Breath) && !breaths.is_live(Way::Expression));
        assert_eq!(breaths.said(Way::Expression), Some(0.75));
        assert_eq!(breaths.said(Way::Knob), None);
        breaths.blow(Way::Knob, 2.0);
        assert!(breaths.is_live(Way::Knob));
        assert_eq!(breaths.said(Way::Knob), Some(1.0));
        breaths.hear(&controller(1, 1.0), false);
        breaths.press(0.9);
        assert!(breaths.is_live(Way::Knob));
    }

    #[test]
    fn ways_are_shown_once_each() {
        for (place, way) in Way::ALL.into_iter().enumerate() {
            assert_eq!(way as usize, place);
        }
    }
}
