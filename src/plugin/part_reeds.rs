//! The controllers that drive H and k, for each part of several players: what comes on a member channel of an MPE zone, or for
//! a note, moves the reed of who plays there, and of a note that begins there later.

use nice_plug::prelude::NoteEvent;

use super::params::knob::ReedSource;
use super::reed_controllers::ReedControllers;
use super::translate_events::{EventTranslator, expression};
use chalumeau_core::control::notes::{Note, NoteAddress};
use chalumeau_core::control::parts::MOST;
use chalumeau_core::event::{PartEvent, To};

/// What drives the reeds of all parts. Real-time safe.
#[derive(Clone, Copy, Debug, Default)]
pub struct PartReeds {
    parts: [ReedControllers; MOST],
    /// The note of each part whose expressions its reed follows.
    heard: [Option<Note>; MOST],
    /// What member channels have said, for notes that begin on them.
    channels: [ReedControllers; 16],
}

/// Whom an event is for.
#[derive(Clone, Copy)]
enum Target {
    All,
    Channel(u8),
    Notes(NoteAddress),
}

impl Target {
    fn of(event: &NoteEvent<()>, translator: &EventTranslator) -> Self {
        if let Some((address, _)) = expression(event, true) {
            return Self::Notes(address);
        }
        match *event {
            NoteEvent::MidiCC { channel, .. } | NoteEvent::MidiChannelPressure { channel, .. }
                if translator.is_of_one_part(channel) =>
            {
                Self::Channel(channel % 16)
            }
            _ => Self::All,
        }
    }
}

impl PartReeds {
    /// The factors on H and k of the first part.
    #[cfg(any(feature = "devices", test))]
    pub fn factors(&self, drives: [ReedSource; 2]) -> [f32; 2] {
        self.parts[0].factors(drives)
    }

    /// A part that comes knows what the first one has heard.
    pub fn follow_first(&mut self, from: usize) {
        let first = self.parts[0];
        self.parts[from.min(MOST)..].fill(first);
        self.heard[from.min(MOST)..].fill(None);
    }

    /// What moved since the last note was a snapshot.
    pub fn go_back(&mut self) {
        self.parts.iter_mut().for_each(ReedControllers::go_back);
    }

    /// A controller or an expression, which the translator has heard already, moves the reeds that it is for.
    pub fn set(&mut self, event: &NoteEvent<()>, moved: (usize, f32), translator: &EventTranslator) {
        let target = Target::of(event, translator);
        if let Target::Channel(channel) = target {
            self.channels[usize::from(channel)].set(moved);
        }
        for part in 0..translator.parts() {
            let note = translator.heard_by(part).map(|heard| heard.note);
            let is_meant = match target {
                Target::All => true,
                Target::Channel(channel) => note.is_some_and(|note| note.channel == channel),
                Target::Notes(address) => note.is_some_and(|note| address.fits(note)),
            };
            if is_meant {
                self.parts[part].set(moved);
            }
        }
    }

    /// After each event: who hears another note now follows that one. `is_note`: a note has begun.
    pub fn follow(&mut self, is_note: bool, translator: &EventTranslator) {
        for part in 0..translator.parts() {
            let reed = &mut self.parts[part];
            if is_note {
                reed.keep();
            }
            let Some(heard) = translator.heard_by(part) else { continue };
            if self.heard[part].replace(heard.note) != Some(heard.note) {
                if translator.is_of_one_part(heard.note.channel) {
                    reed.take(&self.channels[usize::from(heard.note.channel) % 16]);
                }
                reed.follow(heard);
            }
        }
    }

    /// The reeds that have changed since the last call.
    pub fn changed(&mut self, drives: [ReedSource; 2], parts: usize) -> impl Iterator<Item = PartEvent> + '_ {
        self.parts.iter_mut().take(parts).enumerate().filter_map(move |(part, reed)| {
            let event = reed.changed(drives)?;
            Some(PartEvent { to: To::Player(part as u8), event })
        })
    }
}
