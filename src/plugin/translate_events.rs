//! Translates the host's events into the instrument's. No other module knows both.
//!
//! The decoder is that of the offline renderer. It gets the raw integers that the host's 0..=1 values came from, so that
//! plugin and renderer hear the same. Note expressions have no MIDI form: pressure and expression set the breath, and
//! tuning bends its note, in addition to the wheel, until the key is struck again. Volume, pan, vibrato, brightness and
//! program change have no effect.

use nice_plug::midi::Key;
use nice_plug::prelude::*;

use chalumeau_core::control::midi::{Events, MidiDecoder};
use chalumeau_core::event::{Event, Timed};

/// The controller that ends all notes.
const ALL_NOTES_OFF: u8 = 123;

/// Translates one event at a time, and keeps the state between them. Real-time safe throughout.
#[derive(Clone, Debug, Default)]
pub struct EventTranslator {
    midi: MidiDecoder,
    /// Whether a note expression has set the breath yet. Some hosts send a zero with each note; a zero alone does not count.
    expression_live: bool,
}

impl EventTranslator {
    /// Returns at most two events, in order: a note may need a bend before it.
    pub fn translate<S>(&mut self, event: NoteEvent<S>, api: PluginApi) -> [Option<Timed<Event>>; 2] {
        let at = event.timing() as usize;
        let events: Events = match event {
            // The framework turns MIDI notes of velocity 0 into note-offs; a velocity that rounds to 0 here is a very soft note.
            NoteEvent::NoteOn { channel, key: Key::Number(key), velocity, .. } => {
                self.midi.note_on(channel.number().unwrap_or(0), key, raw7(velocity).max(1))
            }
            NoteEvent::NoteOff { channel, key: Key::Number(key), .. }
            | NoteEvent::Choke { channel, key: Key::Number(key), .. } => {
                self.midi.note_off(channel.number(), key)
            }
            NoteEvent::NoteOff { key: Key::Wildcard, .. } | NoteEvent::Choke { key: Key::Wildcard, .. } => {
                self.midi.controller(0, ALL_NOTES_OFF, 0)
            }
            NoteEvent::MidiCC { channel, cc, value, .. } => self.midi.controller(channel, cc, raw7(value)),
            NoteEvent::MidiChannelPressure { channel, pressure, .. } => {
                self.midi.pressure(channel, raw7(pressure))
            }
            NoteEvent::MidiPitchBend { channel, value, .. } => self.midi.bend(channel, raw14(value)),
            NoteEvent::PolyTuning { channel, key, tuning, .. } => {
                self.midi.tune(channel.number(), key.number(), 100.0 * tuning)
            }
            NoteEvent::PolyPressure { pressure, .. } => self.breathe(pressure),
            // The framework's VST3 wrapper (0.4.2) confuses expression and brightness.
            NoteEvent::PolyExpression { expression, .. } if api != PluginApi::Vst3 => {
                self.breathe(expression)
            }
            NoteEvent::PolyBrightness { brightness, .. } if api == PluginApi::Vst3 => {
                self.breathe(brightness)
            }
            _ => [None, None],
        };
        events.map(|event| event.map(|event| Timed { at, event }))
    }

    /// Sets how far the wheel bends until RPN 0 says otherwise, semitones. Returns at most one event. Real-time safe.
    pub fn bend_range(&mut self, semitones: i32) -> Option<Timed<Event>> {
        let [event, _] = self.midi.usual_bend_range(semitones.clamp(0, 127) as u8);
        event.map(|event| Timed { at: 0, event })
    }

    fn breathe(&mut self, unit: f32) -> Events {
        self.expression_live |= unit > 0.0;
        [self.expression_live.then_some(Event::Breath(unit.clamp(0.0, 1.0))), None]
    }
}

/// The MIDI data byte that a host's 0..=1 value came from.
fn raw7(value: f32) -> u8 {
    (value * 127.0).round().clamp(0.0, 127.0) as u8
}

/// The same for the bend wheel, 14 bits. A value of exactly 0.5 rounds to the centre too.
fn raw14(value: f32) -> u16 {
    (value * 16383.0).round().clamp(0.0, 16383.0) as u16
}

#[cfg(test)]
mod tests {
    use nice_plug::midi::{Channel, VoiceID};

    use super::*;
    use chalumeau_core::units::SoundingNote;

    type Host = NoteEvent<()>;

    fn one(translator: &mut EventTranslator, event: Host) -> Option<Event> {
        let [first, second] = translator.translate(event, PluginApi::Clap);
        assert!(first.is_none() || second.is_none(), "{first:?} and {second:?}");
        second.or(first).map(|timed| timed.event)
    }

    fn midi(translator: &mut EventTranslator, bytes: [u8; 3]) -> Option<Event> {
        one(translator, Host::from_midi(0, &bytes).expect("a channel message"))
    }

    fn last([_, event]: Events) -> Option<Event> {
        event
    }

    #[test]
    fn every_data_byte_arrives_as_it_was_sent() {
        for raw in 0..=127u8 {
            assert_eq!(raw7(f32::from(raw) / 127.0), raw);
        }
        for raw in 0..=16383u16 {
            assert_eq!(raw14(f32::from(raw) / 16383.0), raw);
            assert_eq!(raw14((f64::from(raw) / 16383.0) as f32), raw);
        }
    }

    #[test]
    fn a_wheel_at_rest_does_not_bend() {
        let mut translator = EventTranslator::default();
        assert_eq!(midi(&mut translator, [0xE0, 0, 64]), Some(Event::Bend { cents: 0.0 }));
        let half = Host::MidiPitchBend { timing: 0, channel: 0, value: 0.5 };
        assert_eq!(one(&mut translator, half), Some(Event::Bend { cents: 0.0 }));
    }

    #[test]
    fn plugin_and_renderer_hear_the_same_midi() {
        let mut translator = EventTranslator::default();
        let mut decoder = MidiDecoder::new();
        for value in 0..=127u8 {
            assert_eq!(midi(&mut translator, [0xB3, 2, value]), decoder.controller(3, 2, value)[0]);
            assert_eq!(
                midi(&mut translator, [0xE3, value, 127 - value]),
                decoder.bend(3, u16::from(127 - value) << 7 | u16::from(value))[0]
            );
            assert_eq!(midi(&mut translator, [0x93, value, 90]), last(decoder.note_on(3, value, 90)));
            assert_eq!(midi(&mut translator, [0x83, value, 90]), last(decoder.note_off(Some(3), value)));
        }
        let mut translator = EventTranslator::default();
        assert_eq!(midi(&mut translator, [0xD0, 64, 0]), MidiDecoder::new().pressure(0, 64)[0]);
    }

    #[test]
    fn tuning_adds_to_the_wheel_until_the_key_is_struck_again() {
        let mut translator = EventTranslator::default();
        let (voice_id, channel, key) = (VoiceID::Wildcard, Channel::Number(0), Key::Number(60));
        midi(&mut translator, [0xE0, 127, 127]);
        midi(&mut translator, [0x90, 60, 90]);
        let tuning = Host::PolyTuning { timing: 0, voice_id, channel, key, tuning: -0.5 };
        assert_eq!(one(&mut translator, tuning), Some(Event::Bend { cents: 150.0 }));
        let note = Host::NoteOn { timing: 7, voice_id, channel, key, velocity: 1.0 };
        let note_on = Event::NoteOn { note: SoundingNote(60), velocity: 1.0 };
        assert_eq!(
            translator.translate(note, PluginApi::Clap),
            [
                Some(Timed { at: 7, event: Event::Bend { cents: 200.0 } }),
                Some(Timed { at: 7, event: note_on })
            ]
        );
        assert_eq!(translator.translate(note, PluginApi::Clap)[0], None);
    }

    #[test]
    fn a_note_expression_of_zero_does_not_take_the_breath() {
        let mut translator = EventTranslator::default();
        let (voice_id, channel, key) = (VoiceID::Wildcard, Channel::Number(0), Key::Number(60));
        let press = |pressure| Host::PolyPressure { timing: 0, voice_id, channel, key, pressure };
        assert_eq!(one(&mut translator, press(0.0)), None);
        assert_eq!(one(&mut translator, press(0.6)), Some(Event::Breath(0.6)));
        assert_eq!(one(&mut translator, press(0.0)), Some(Event::Breath(0.0)));
        let express = Host::PolyExpression { timing: 0, voice_id, channel, key, expression: 2.0 };
        assert_eq!(one(&mut translator, express), Some(Event::Breath(1.0)));
    }

    #[test]
    fn a_wildcard_note_off_ends_all_notes() {
        let mut translator = EventTranslator::default();
        let off = Host::NoteOff {
            timing: 0,
            voice_id: VoiceID::Wildcard,
            channel: Channel::Wildcard,
            key: Key::Wildcard,
            velocity: 0.0,
        };
        assert_eq!(one(&mut translator, off), Some(Event::Panic));
    }
}
