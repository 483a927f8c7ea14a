//! Controllers that open and stiffen the reed: H and k, in the sound and under the hand.
//!
//! A controller with a middle (CC74, the y of a Linnstrument) leaves the parameter alone there and goes both ways; one
//! that rests at zero (wheel, pressure) leaves it alone there and only raises it. Full travel is a factor of 1.6 (by
//! judgement: on coupled reeds that is closing pressures from 2/5 to 2 1/2 times). A source that drives the reed no
//! longer does anything else.

use nice_plug::prelude::NoteEvent;

use super::params::knob::ReedSource;
use chalumeau_core::event::Event;

/// Factor at the end of the travel.
const SPAN: f32 = 1.6;
const CC_SLIDE: u8 = 74;

/// What has been heard from each controller. Real-time safe.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReedSources {
    /// Controllers 1, 16, 17, 74 and pressure, 0..=1, `None` until they move.
    heard: [Option<f32>; 5],
    sent: Option<[f32; 2]>,
}

fn place(source: ReedSource) -> Option<usize> {
    match source {
        ReedSource::Parameter => None,
        ReedSource::Wheel => Some(0),
        ReedSource::Cc16 => Some(1),
        ReedSource::Cc17 => Some(2),
        ReedSource::Slide => Some(3),
        ReedSource::Pressure => Some(4),
    }
}

impl ReedSources {
    /// Forgets what was heard.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Takes an event if it drives H or k.
    pub fn take<S>(&mut self, event: &NoteEvent<S>, sources: [ReedSource; 2]) -> bool {
        let (at, value) = match *event {
            NoteEvent::MidiCC { cc: 1, value, .. } => (0, value),
            NoteEvent::MidiCC { cc: 16, value, .. } => (1, value),
            NoteEvent::MidiCC { cc: 17, value, .. } => (2, value),
            NoteEvent::MidiCC { cc: CC_SLIDE, value, .. } => (3, value),
            NoteEvent::PolyBrightness { brightness, .. } => (3, brightness),
            NoteEvent::MidiChannelPressure { pressure, .. } | NoteEvent::PolyPressure { pressure, .. } => {
                (4, pressure)
            }
            _ => return false,
        };
        if !sources.map(place).contains(&Some(at)) {
            return false;
        }
        self.heard[at] = Some(if value.is_finite() { value.clamp(0.0, 1.0) } else { 0.0 });
        true
    }

    /// Factors on H and k.
    pub fn factors(&self, sources: [ReedSource; 2]) -> [f32; 2] {
        sources.map(|source| {
            let Some(value) = place(source).and_then(|at| self.heard[at]) else { return 1.0 };
            // The middle of seven bits is 64.
            let way = if source == ReedSource::Slide { (value * 127.0 - 64.0) / 63.0 } else { value };
            SPAN.powf(way.clamp(-1.0, 1.0))
        })
    }

    /// The event that brings the voice up to date, if it is not.
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

    #[test]
    fn a_linnstrument_opens_with_y_and_stiffens_with_z() {
        let mut reed = ReedSources::default();
        let sources = [ReedSource::Slide, ReedSource::Pressure];
        assert_eq!(reed.changed(sources), None, "nothing has moved");
        assert!(reed.take(&cc(74, 64), sources));
        assert_eq!(reed.changed(sources), None, "the middle leaves the parameter alone");
        assert!(reed.take(&cc(74, 127), sources));
        let z = NoteEvent::<()>::MidiChannelPressure { timing: 0, channel: 3, pressure: 0.5 };
        assert!(reed.take(&z, sources));
        let [h, k] = reed.factors(sources);
        assert!((h - 1.6).abs() < 1e-6 && (k - 1.6_f32.sqrt()).abs() < 1e-6, "{h} {k}");
        assert!(reed.take(&cc(74, 0), sources));
        assert!(reed.factors(sources)[0] < 1.0 / 1.59);
        assert!(reed.changed(sources).is_some());
        assert_eq!(reed.changed(sources), None);
    }

    #[test]
    fn what_drives_nothing_is_left_to_the_breath() {
        let mut reed = ReedSources::default();
        let pressure = NoteEvent::<()>::MidiChannelPressure { timing: 0, channel: 0, pressure: 0.5 };
        assert!(!reed.take(&pressure, [ReedSource::Slide, ReedSource::Parameter]));
        assert!(!reed.take(&cc(2, 9), [ReedSource::Slide, ReedSource::Pressure]));
        assert_eq!(reed.factors([ReedSource::Parameter; 2]), [1.0, 1.0]);
    }
}
