//! Listens to what the host sends, to tell people which law is in force: STATE only carries the number of a feel.

use crate::wire::midi::{FromKnob, MidiReceiver};
use crate::wire::{Decoder, Message, TorqueLaw};

enum TapDecoder {
    Serial(Box<Decoder>),
    Midi(Box<MidiReceiver>),
}

/// An ear on the line to the device.
pub struct Tap {
    listener: TapDecoder,
    /// Law of every feel number seen.
    laws: [Option<TorqueLaw>; 256],
}

impl Tap {
    /// Has heard nothing.
    pub fn new(is_midi: bool) -> Self {
        let listener =
            if is_midi { TapDecoder::Midi(Box::default()) } else { TapDecoder::Serial(Box::default()) };
        Self { listener, laws: [None; 256] }
    }

    /// Bytes the device gets.
    pub fn hear(&mut self, bytes: &[u8]) {
        let laws = &mut self.laws;
        let mut note = |message| {
            if let Message::Feel(feel) = message {
                laws[usize::from(feel.feel_id)] = Some(feel.law);
            }
        };
        match &mut self.listener {
            TapDecoder::Serial(decoder) => {
                decoder.feed(bytes).flatten().for_each(|(_, message)| note(message))
            }
            // Time only matters for control changes, which a host does not send.
            TapDecoder::Midi(receiver) => receiver.feed(bytes, 0, |heard| {
                if let FromKnob::Frame(Ok((_, message))) = heard {
                    note(message);
                }
            }),
        }
    }

    /// Law of a feel by its number, if it was heard.
    pub fn law(&self, feel_id: u8) -> Option<TorqueLaw> {
        self.laws[usize::from(feel_id)]
    }
}
