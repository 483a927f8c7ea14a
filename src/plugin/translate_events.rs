//! Translates the host's events into the instrument's. No other module knows both.
//!
//! The decoder is that of the offline renderer. It gets the raw integers that the host's 0..=1 values came from, so that
//! plugin and renderer hear the same. Note expressions belong to their note: pressure and expression set the breath, tuning
//! bends in addition to the wheel, volume and pan act after the instrument. Brightness changes the reed where it is chosen
//! for that, see [`reed_controllers`](super::reed_controllers). Vibrato has no effect. A program change makes no event; it chooses a
//! preset, see [`preset_keeper`](super::preset_keeper).

use nice_plug::midi::{Channel, Key, VoiceID};
use nice_plug::prelude::*;

use chalumeau_core::control::key_switches::KeySwitches;
use chalumeau_core::control::midi::BreathOrigin;
use chalumeau_core::control::midi::breath::BreathFrom;
use chalumeau_core::control::midi::links::{Link, Links, MOST};
use chalumeau_core::control::midi::techniques::Wheel;
use chalumeau_core::control::notes::{HeldNote, Note, NoteAddress, NoteExpression};
use chalumeau_core::control::parts::Parts;
use chalumeau_core::event::{Event, PartEvent};

/// The id of notes from the keys of the window. Those of a host are 0 or more.
pub const WINDOW_NOTE: Option<i32> = Some(-2);

/// Translates one event at a time, and keeps the state between them. Real-time safe throughout.
#[derive(Debug, Default)]
pub struct EventTranslator {
    midi: Parts,
}

impl EventTranslator {
    /// See [`Parts::reset`].
    pub fn reset(&mut self) {
        self.midi.reset();
    }

    /// Splits the notes into so many parts. The notes of parts that go are [over](Self::over). Whether this is another
    /// number.
    pub fn set_parts(&mut self, count: usize) -> bool {
        let is_other = count != self.midi.count();
        self.midi.set_count(count);
        is_other
    }

    /// See [`Parts::forget_repeats`].
    pub fn forget_repeats(&mut self) {
        self.midi.forget_repeats();
    }

    /// The events of a host's event, in order. `is_reeds`: it changes the reed, so that its pressure is no breath.
    pub fn translate<S>(&mut self, event: &NoteEvent<S>, is_reeds: bool) -> &[PartEvent] {
        match *event {
            NoteEvent::NoteOn { voice_id, channel, key: Key::Number(key), velocity, .. } => {
                let note = Note { id: voice_id.id(), channel: channel.number().unwrap_or(0), key };
                // The framework turns MIDI notes of velocity 0 into note-offs; a velocity that rounds to 0 here is a very
                // soft note.
                self.midi.strike(note, raw7(velocity).max(1))
            }
            NoteEvent::NoteOff { voice_id, channel, key, .. } => {
                self.midi.release(address(voice_id, channel, key))
            }
            NoteEvent::Choke { voice_id, channel, key, .. } => {
                self.midi.choke(address(voice_id, channel, key))
            }
            NoteEvent::MidiCC { channel, cc, value, .. } => self.midi.controller(channel, cc, raw7(value)),
            NoteEvent::MidiChannelPressure { channel, .. } if is_reeds => self.midi.other_pressure(channel),
            NoteEvent::MidiChannelPressure { channel, pressure, .. } => {
                self.midi.pressure(channel, raw7(pressure))
            }
            NoteEvent::MidiPitchBend { channel, value, .. } => self.midi.bend(channel, raw14(value)),
            _ => match expression(event, is_reeds) {
                Some((address, expression)) => self.midi.express(address, expression),
                // Nothing: what an earlier event has ended is told no more.
                None => self.midi.nothing(),
            },
        }
    }

    /// The events of a key of the window, which counts as on the first channel; `None` for what is no key.
    pub fn window_note(&mut self, event: &Event) -> Option<&[PartEvent]> {
        match *event {
            Event::NoteOn { note, velocity } => {
                let note = Note { id: WINDOW_NOTE, channel: 0, key: note.0 };
                Some(self.midi.strike(note, raw7(velocity).max(1)))
            }
            Event::NoteOff { note } => {
                let address = NoteAddress { id: WINDOW_NOTE, channel: Some(0), key: Some(note.0) };
                Some(self.midi.release(address))
            }
            _ => None,
        }
    }

    /// Sets how far the wheel bends until RPN 0 says otherwise, semitones.
    pub fn bend_range(&mut self, semitones: i32) -> &[PartEvent] {
        self.midi.usual_bend_range(semitones.clamp(0, 127) as u8)
    }

    /// Sets which controller blows.
    pub fn breath_from(&mut self, from: BreathFrom) -> &[PartEvent] {
        self.midi.set_breath_from(from)
    }

    /// Sets what the mod wheel does.
    pub fn wheel(&mut self, wheel: Wheel) -> &[PartEvent] {
        self.midi.set_wheel(wheel)
    }

    /// See [`Parts::set_key_switches`].
    pub fn set_key_switches(&mut self, key_switches: KeySwitches) {
        self.midi.set_key_switches(key_switches);
    }

    /// See [`Parts::set_playing_keys`].
    pub fn set_playing_keys(&mut self, playing: u128) {
        self.midi.set_playing_keys(playing);
    }

    /// See [`Parts::set_links`].
    pub fn set_links(&mut self, links: &[Option<Link>; MOST]) -> bool {
        self.midi.set_links(links)
    }

    /// See [`Parts::links`].
    pub fn links(&self) -> &Links {
        self.midi.links()
    }

    /// See [`Parts::links_of`].
    pub fn links_of(&self, part: usize) -> &Links {
        self.midi.links_of(part)
    }

    /// Ends all notes at once.
    pub fn silence(&mut self) -> &[PartEvent] {
        self.midi.silence()
    }

    /// See [`Parts::heard_by`].
    pub fn heard_by(&self, part: usize) -> Option<&HeldNote> {
        self.midi.heard_by(part)
    }

    /// See [`Parts::is_of_one_part`].
    pub fn is_of_one_part(&self, channel: u8) -> bool {
        self.midi.is_of_one_part(channel)
    }

    /// See [`Parts::over`].
    pub fn over(&self) -> &[Note] {
        self.midi.over()
    }

    /// See [`Parts::take_faded`].
    pub fn take_faded(&mut self, part: usize) -> Option<Note> {
        self.midi.take_faded(part)
    }

    /// How many parts there are.
    pub fn parts(&self) -> usize {
        self.midi.count()
    }

    /// See [`Parts::breath_origin`].
    pub fn breath_origin(&self) -> Option<BreathOrigin> {
        self.midi.breath_origin()
    }

    /// See [`Parts::is_snapshot`].
    pub fn is_snapshot(&self, channel: u8) -> bool {
        self.midi.is_snapshot(channel)
    }
}

/// An event as its name says. The framework's VST3 wrapper (0.4.2) confuses expression and brightness. And it guesses channel and
/// key of an expression, for which VST3 has the note's id alone.
pub fn untangled<S>(event: NoteEvent<S>, api: PluginApi) -> NoteEvent<S> {
    let mut event = match event {
        event if api != PluginApi::Vst3 => return event,
        NoteEvent::PolyExpression { timing, voice_id, channel, key, expression } => {
            NoteEvent::PolyBrightness { timing, voice_id, channel, key, brightness: expression }
        }
        NoteEvent::PolyBrightness { timing, voice_id, channel, key, brightness } => {
            NoteEvent::PolyExpression { timing, voice_id, channel, key, expression: brightness }
        }
        event => event,
    };
    match &mut event {
        NoteEvent::PolyPressure { voice_id: VoiceID::ID(_), channel, key, .. }
        | NoteEvent::PolyVolume { voice_id: VoiceID::ID(_), channel, key, .. }
        | NoteEvent::PolyPan { voice_id: VoiceID::ID(_), channel, key, .. }
        | NoteEvent::PolyTuning { voice_id: VoiceID::ID(_), channel, key, .. }
        | NoteEvent::PolyVibrato { voice_id: VoiceID::ID(_), channel, key, .. }
        | NoteEvent::PolyExpression { voice_id: VoiceID::ID(_), channel, key, .. }
        | NoteEvent::PolyBrightness { voice_id: VoiceID::ID(_), channel, key, .. } => {
            (*channel, *key) = (Channel::Wildcard, Key::Wildcard);
        }
        _ => {}
    }
    event
}

/// The notes that an expression is for, and what it says.
pub fn expression<S>(event: &NoteEvent<S>, is_reeds: bool) -> Option<(NoteAddress, NoteExpression)> {
    let (voice_id, channel, key, expression) = match *event {
        NoteEvent::PolyTuning { voice_id, channel, key, tuning, .. } => {
            (voice_id, channel, key, NoteExpression::Tuning(100.0 * tuning))
        }
        NoteEvent::PolyPressure { voice_id, channel, key, pressure, .. } if is_reeds => {
            (voice_id, channel, key, NoteExpression::Press(pressure))
        }
        NoteEvent::PolyPressure { voice_id, channel, key, pressure: breath, .. }
        | NoteEvent::PolyExpression { voice_id, channel, key, expression: breath, .. } => {
            (voice_id, channel, key, NoteExpression::Breath(breath))
        }
        NoteEvent::PolyVolume { voice_id, channel, key, gain, .. } => {
            (voice_id, channel, key, NoteExpression::Volume(gain))
        }
        NoteEvent::PolyPan { voice_id, channel, key, pan, .. } => {
            (voice_id, channel, key, NoteExpression::Pan(pan))
        }
        NoteEvent::PolyBrightness { voice_id, channel, key, brightness, .. } => {
            (voice_id, channel, key, NoteExpression::Brightness(brightness))
        }
        _ => return None,
    };
    Some((address(voice_id, channel, key), expression))
}

fn address(voice_id: VoiceID, channel: Channel, key: Key) -> NoteAddress {
    NoteAddress { id: voice_id.id(), channel: channel.number(), key: key.number() }
}

/// The MIDI data byte that a host's 0..=1 value came from.
pub fn raw7(value: f32) -> u8 {
    (value * 127.0).round().clamp(0.0, 127.0) as u8
}

/// The same for the bend wheel, 14 bits. A value of exactly 0.5 rounds to the centre too.
fn raw14(value: f32) -> u16 {
    (value * 16383.0).round().clamp(0.0, 16383.0) as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::control::midi::MidiDecoder;
    use chalumeau_core::units::SoundingNote;

    type Host = NoteEvent<()>;

    const OF_60: (VoiceID, Channel, Key) = (VoiceID::Wildcard, Channel::Number(0), Key::Number(60));

    fn plain(events: &[PartEvent]) -> Vec<Event> {
        events.iter().map(|event| event.event).collect()
    }

    fn midi(translator: &mut EventTranslator, bytes: [u8; 3]) -> Vec<Event> {
        plain(translator.translate(&Host::from_midi(0, &bytes).expect("a channel message"), false))
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
        assert_eq!(midi(&mut translator, [0xE0, 0, 64]), [Event::Bend { cents: 0.0 }]);
        let half = Host::MidiPitchBend { timing: 0, channel: 0, value: 0.5 };
        assert_eq!(plain(translator.translate(&half, false)), [Event::Bend { cents: 0.0 }]);
    }

    #[test]
    fn plugin_and_renderer_hear_the_same_midi() {
        let mut translator = EventTranslator::default();
        let mut decoder = MidiDecoder::new();
        for value in 0..=127u8 {
            for cc in [2, 7, 10, 11, 34, 64, 123] {
                assert_eq!(midi(&mut translator, [0xB3, cc, value]), decoder.controller(3, cc, value));
            }
            assert_eq!(
                midi(&mut translator, [0xE3, value, 127 - value]),
                decoder.bend(3, u16::from(127 - value) << 7 | u16::from(value))
            );
            assert_eq!(midi(&mut translator, [0x93, value, 90]), decoder.note_on(3, value, 90));
            assert_eq!(midi(&mut translator, [0xD3, value, 0]), decoder.pressure(3, value));
            let pressed = NoteExpression::Breath(f32::from(value) / 127.0);
            assert_eq!(
                midi(&mut translator, [0xA3, value, value]),
                decoder.express(NoteAddress::of_key(3, value), pressed)
            );
            assert_eq!(midi(&mut translator, [0x83, value, 90]), decoder.note_off(3, value));
        }
    }

    #[test]
    fn tuning_adds_to_the_wheel_until_the_key_is_struck_again() {
        let mut translator = EventTranslator::default();
        let (voice_id, channel, key) = OF_60;
        midi(&mut translator, [0xE0, 127, 127]);
        midi(&mut translator, [0x90, 60, 90]);
        let tuning = Host::PolyTuning { timing: 0, voice_id, channel, key, tuning: -0.5 };
        assert_eq!(plain(translator.translate(&tuning, false)), [Event::Bend { cents: 150.0 }]);
        let note = Host::NoteOn { timing: 7, voice_id, channel, key, velocity: 1.0 };
        let note_on = Event::NoteOn { note: SoundingNote(60), velocity: 1.0 };
        let up = Event::NoteOff { note: SoundingNote(60) };
        assert_eq!(plain(translator.translate(&note, false)), [Event::Bend { cents: 200.0 }, up, note_on]);
        assert_eq!(plain(translator.translate(&note, false)), [up, note_on]);
    }

    #[test]
    fn a_note_expression_of_zero_does_not_take_the_breath() {
        let mut translator = EventTranslator::default();
        let (voice_id, channel, key) = OF_60;
        let press = |pressure| Host::PolyPressure { timing: 0, voice_id, channel, key, pressure };
        midi(&mut translator, [0x90, 60, 90]);
        assert_eq!(plain(translator.translate(&press(0.0), false)), []);
        assert_eq!(plain(translator.translate(&press(0.6), true)), [], "it moves the reed");
        assert_eq!(plain(translator.translate(&press(0.6), false)), [Event::Breath(0.6)]);
        assert_eq!(plain(translator.translate(&press(0.0), false)), [Event::Breath(0.0)]);
        let express = Host::PolyExpression { timing: 0, voice_id, channel, key, expression: 2.0 };
        assert_eq!(plain(translator.translate(&express, false)), [Event::Breath(1.0)]);
        // The framework says brightness where a VST3 host said expression.
        let bright = Host::PolyBrightness { timing: 0, voice_id, channel, key, brightness: 0.25 };
        assert_eq!(plain(translator.translate(&bright, false)), []);
        assert_eq!(
            plain(translator.translate(&untangled(bright, PluginApi::Vst3), false)),
            [Event::Breath(0.25)]
        );
        assert_eq!(plain(translator.translate(&untangled(express, PluginApi::Vst3), false)), []);
    }

    #[test]
    fn an_expression_of_vst3_is_of_its_id_whatever_key_the_framework_guesses() {
        let mut translator = EventTranslator::default();
        let (voice_id, channel) = (VoiceID::ID(7), Channel::Number(0));
        let on = Host::NoteOn { timing: 0, voice_id, channel, key: Key::Number(60), velocity: 0.8 };
        translator.translate(&on, false);
        let key = Key::Number(64);
        let tuned = Host::PolyTuning { timing: 0, voice_id, channel, key, tuning: 0.5 };
        let clap = untangled(tuned, PluginApi::Clap);
        assert_eq!(plain(translator.translate(&clap, false)), [], "a CLAP host means both");
        let vst3 = untangled(tuned, PluginApi::Vst3);
        assert_eq!(plain(translator.translate(&vst3, false)), [Event::Bend { cents: 50.0 }]);
        // Without an id, channel and key are all there is.
        let voice_id = VoiceID::Wildcard;
        let pressed = Host::PolyPressure { timing: 0, voice_id, channel, key, pressure: 0.5 };
        assert_eq!(plain(translator.translate(&untangled(pressed, PluginApi::Vst3), false)), []);
    }

    #[test]
    fn a_wildcard_note_off_releases_all_notes_and_an_id_alone_one() {
        let mut translator = EventTranslator::default();
        let off = |voice_id| Host::NoteOff {
            timing: 0,
            voice_id,
            channel: Channel::Wildcard,
            key: Key::Wildcard,
            velocity: 0.0,
        };
        for (id, key) in [(7, 60), (64, 62)] {
            let (voice_id, key) = (VoiceID::ID(id), Key::Number(key));
            let on = Host::NoteOn { timing: 0, voice_id, channel: Channel::Number(2), key, velocity: 1.0 };
            translator.translate(&on, false);
        }
        let up = |key| Event::NoteOff { note: SoundingNote(key) };
        assert_eq!(plain(translator.translate(&off(VoiceID::ID(64)), false)), [up(62)]);
        assert_eq!(plain(translator.translate(&off(VoiceID::ID(64)), false)), []);
        assert_eq!(plain(translator.translate(&off(VoiceID::Wildcard), false)), [up(60)]);
    }
}
