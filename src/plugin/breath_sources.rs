//! Which input each breath value came from, for the window. The decoder and the voice decide which input blows; this only
//! records it.

use nice_plug::prelude::NoteEvent;

use crate::controllers::breath_input::BreathInput;

/// The latest value of each input, and the input that blows now. Real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BreathSources {
    values: [Option<f32>; BreathInput::ALL.len()],
    live: Option<BreathInput>,
    /// How many events the host has sent; it wraps around.
    messages: u32,
}

impl BreathSources {
    /// No input blows now but the keys.
    pub fn forget(&mut self) {
        self.live = None;
    }

    /// Records a host's event. Whether it is breath the decoder says.
    pub fn record<S>(&mut self, event: &NoteEvent<S>) {
        self.messages = self.messages.wrapping_add(1);
        match input_of(event) {
            Some((BreathInput::Keys, velocity)) => self.key(velocity),
            Some((input, value)) => self.set(input, value),
            None => {}
        }
    }

    /// Records a key, which blows until another input has.
    pub fn key(&mut self, velocity: f32) {
        self.set(BreathInput::Keys, velocity);
        self.live.get_or_insert(BreathInput::Keys);
    }

    /// Records breath, 0..=1, and makes its input the live one.
    pub fn blow(&mut self, input: BreathInput, breath: f32) {
        self.set(input, breath);
        self.live = Some(input);
    }

    fn set(&mut self, input: BreathInput, value: f32) {
        self.values[input as usize] = Some(value.clamp(0.0, 1.0));
    }

    /// The latest value of an input, 0..=1; `None` if it has sent nothing.
    pub fn value(&self, input: BreathInput) -> Option<f32> {
        self.values[input as usize]
    }

    /// How many events the host has sent; it wraps around.
    pub fn messages(&self) -> u32 {
        self.messages
    }

    /// Whether this input blows now.
    pub fn is_live(&self, input: BreathInput) -> bool {
        self.live == Some(input)
    }
}

/// The input of a host's event, and its value.
fn input_of<S>(event: &NoteEvent<S>) -> Option<(BreathInput, f32)> {
    Some(match *event {
        NoteEvent::NoteOn { velocity, .. } => (BreathInput::Keys, velocity),
        NoteEvent::MidiCC { cc: 2, value, .. } => (BreathInput::Breath, value),
        NoteEvent::MidiCC { cc: 11, value, .. } => (BreathInput::Expression, value),
        NoteEvent::MidiChannelPressure { pressure, .. } => (BreathInput::Pressure, pressure),
        NoteEvent::PolyPressure { pressure: value, .. }
        | NoteEvent::PolyExpression { expression: value, .. } => (BreathInput::Note, value),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use chalumeau_core::control::midi::BreathOrigin;
    use chalumeau_core::control::midi::breath::BreathController;

    use super::*;

    fn controller(cc: u8, value: f32) -> NoteEvent<()> {
        NoteEvent::MidiCC { timing: 0, channel: 0, cc, value }
    }

    #[test]
    fn the_latest_breath_is_live_and_an_overruled_value_is_shown() {
        let mut sources = BreathSources::default();
        sources.key(0.9);
        assert!(sources.is_live(BreathInput::Keys));
        sources.blow(BreathOrigin::Controller(BreathController::Expression).into(), 0.25);
        assert!(sources.is_live(BreathInput::Expression));
        sources.record(&controller(2, 0.5));
        assert!(sources.is_live(BreathInput::Expression), "it came, and the decoder did not take it");
        sources.blow(BreathOrigin::Controller(BreathController::Breath).into(), 0.5);
        sources.record(&controller(11, 0.75));
        assert!(sources.is_live(BreathInput::Breath) && !sources.is_live(BreathInput::Expression));
        assert_eq!(sources.value(BreathInput::Expression), Some(0.75));
        assert_eq!(sources.value(BreathInput::Knob), None);
        sources.blow(BreathInput::Knob, 2.0);
        assert!(sources.is_live(BreathInput::Knob));
        assert_eq!(sources.value(BreathInput::Knob), Some(1.0));
        sources.record(&controller(1, 1.0));
        sources.key(0.9);
        assert!(sources.is_live(BreathInput::Knob));
    }
}
