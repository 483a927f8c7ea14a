//! MIDI controllers that change the reed's opening H and stiffness k, in the sound and in the feel.
//!
//! A controller with a middle (CC74, the y of a Linnstrument) has no effect at its middle, and raises or lowers the
//! parameter from there. A controller that rests at zero (wheel, pressure) has no effect at zero and only raises the
//! parameter. What belongs to a note (brightness, pressure) acts while that note is heard. A snapshot of all controllers at the
//! start of a project changes nothing. Full travel is a factor of 1.6, chosen by judgement: on the opening it makes closing pressures of 0.63 to
//! 1.6 times, since k stays (`Settings::with_reed_factors`). A controller that drives the reed does nothing else.

use nice_plug::prelude::NoteEvent;

use super::params::knob::ReedSource;
use chalumeau_core::control::notes::HeldNote;
use chalumeau_core::event::Event;
use chalumeau_core::maths;
use chalumeau_core::units::clamped_or;

/// Factor at full travel.
const FULL_FACTOR: f32 = 1.6;
const CC_SLIDE: u8 = 74;

/// The latest value of each controller. Real-time safe.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReedControllers {
    /// Controllers 1, 16, 17, 74 and pressure, 0..=1; `None` until they move.
    values: [Option<f32>; 5],
    /// The same at the last note.
    kept: [Option<f32>; 5],
    /// The factors that were sent last.
    sent: Option<[f32; 2]>,
}

fn index(source: ReedSource) -> Option<usize> {
    match source {
        ReedSource::Parameter => None,
        ReedSource::Wheel => Some(0),
        ReedSource::Cc16 => Some(1),
        ReedSource::Cc17 => Some(2),
        ReedSource::Slide => Some(3),
        ReedSource::Pressure => Some(4),
    }
}

impl ReedControllers {
    /// What an event moves if it drives H or k: the place of a controller, and its value.
    pub fn of<S>(event: &NoteEvent<S>, sources: [ReedSource; 2]) -> Option<(usize, f32)> {
        let (at, value) = match *event {
            NoteEvent::MidiCC { cc: 1, value, .. } => (0, value),
            NoteEvent::MidiCC { cc: 16, value, .. } => (1, value),
            NoteEvent::MidiCC { cc: 17, value, .. } => (2, value),
            NoteEvent::MidiCC { cc: CC_SLIDE, value, .. } => (3, value),
            NoteEvent::PolyBrightness { brightness, .. } => (3, brightness),
            NoteEvent::MidiChannelPressure { pressure, .. } | NoteEvent::PolyPressure { pressure, .. } => {
                (4, pressure)
            }
            _ => return None,
        };
        sources.map(index).contains(&Some(at)).then_some((at, value))
    }

    /// A controller moves.
    pub fn set(&mut self, (at, value): (usize, f32)) {
        self.values[at] = Some(clamped_or(value, 0.0, 1.0, 0.0));
    }

    /// Takes the values that another has heard.
    pub fn take(&mut self, other: &Self) {
        for (value, other) in self.values.iter_mut().zip(other.values) {
            *value = other.or(*value);
        }
    }

    /// Another note is heard: what belongs to it acts now.
    pub fn follow(&mut self, heard: &HeldNote) {
        let [.., slide, pressure] = &mut self.values;
        (*slide, *pressure) = (heard.brightness.or(*slide), heard.press.or(*pressure));
    }

    /// Keeps the values of now; call it at each note.
    pub fn keep(&mut self) {
        self.kept = self.values;
    }

    /// Goes back to the values that were kept: what came since was a snapshot.
    pub fn go_back(&mut self) {
        self.values = self.kept;
    }

    /// The factors on H and k.
    pub fn factors(&self, sources: [ReedSource; 2]) -> [f32; 2] {
        sources.map(|source| {
            let Some(value) = index(source).and_then(|at| self.values[at]) else { return 1.0 };
            // The middle of a 7-bit value is 64.
            let travel = if source == ReedSource::Slide { (value * 127.0 - 64.0) / 63.0 } else { value };
            maths::single::pow(FULL_FACTOR, travel.clamp(-1.0, 1.0))
        })
    }

    /// An event with the new factors, if they have changed since the last call.
    pub fn changed(&mut self, sources: [ReedSource; 2]) -> Option<Event> {
        let [h, k] = self.factors(sources);
        let before = self.sent.replace([h, k]).unwrap_or([1.0, 1.0]);
        (before != [h, k]).then_some(Event::Reed { h, k })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cc(cc: u8, raw: u8) -> NoteEvent<()> {
        NoteEvent::MidiCC { timing: 0, channel: 3, cc, value: f32::from(raw) / 127.0 }
    }

    fn take(reed: &mut ReedControllers, event: &NoteEvent<()>, sources: [ReedSource; 2]) -> bool {
        let moved = ReedControllers::of(event, sources);
        moved.into_iter().for_each(|moved| reed.set(moved));
        moved.is_some()
    }

    #[test]
    fn y_of_a_linnstrument_opens_the_reed_and_z_stiffens_it() {
        let mut reed = ReedControllers::default();
        let sources = [ReedSource::Slide, ReedSource::Pressure];
        assert_eq!(reed.changed(sources), None, "no controller has moved");
        assert!(take(&mut reed, &cc(74, 64), sources));
        assert_eq!(reed.changed(sources), None, "the middle has no effect");
        assert!(take(&mut reed, &cc(74, 127), sources));
        let z = NoteEvent::<()>::MidiChannelPressure { timing: 0, channel: 3, pressure: 0.5 };
        assert!(take(&mut reed, &z, sources));
        let [h, k] = reed.factors(sources);
        assert!((h - 1.6).abs() < 1e-6 && (k - 1.6_f32.sqrt()).abs() < 1e-6, "{h} {k}");
        assert!(take(&mut reed, &cc(74, 0), sources));
        assert!(reed.factors(sources)[0] < 1.0 / 1.59);
        assert!(reed.changed(sources).is_some());
        assert_eq!(reed.changed(sources), None);
    }

    #[test]
    fn an_event_that_drives_nothing_is_not_taken() {
        let mut reed = ReedControllers::default();
        let pressure = NoteEvent::<()>::MidiChannelPressure { timing: 0, channel: 0, pressure: 0.5 };
        assert!(!take(&mut reed, &pressure, [ReedSource::Slide, ReedSource::Parameter]));
        assert!(!take(&mut reed, &cc(2, 9), [ReedSource::Slide, ReedSource::Pressure]));
        assert_eq!(reed.factors([ReedSource::Parameter; 2]), [1.0, 1.0]);
    }
}
