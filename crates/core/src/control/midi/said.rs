//! The events of one message, in order. No allocation: a message has a few, and never more than fit.

use super::links;
use crate::control::notes;
use crate::event::Event;

/// Bend, breath, volume, pan, vibrato, three techniques, a new key and the one that it pushes out, a choke, a release of every held key, and
/// every link.
const MOST: usize = notes::MOST + 13 + links::MOST;

/// The events of the latest message.
#[derive(Clone, Debug)]
pub struct Said {
    events: [Event; MOST],
    count: usize,
}

impl Default for Said {
    fn default() -> Self {
        // What lies beyond `count` is never read.
        Self { events: [Event::Panic; MOST], count: 0 }
    }
}

impl Said {
    /// Forgets the events of the message before.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds one.
    pub fn push(&mut self, event: Event) {
        debug_assert!(self.count < MOST, "a message has more events than it can");
        if let Some(place) = self.events.get_mut(self.count) {
            *place = event;
            self.count += 1;
        }
    }

    /// All, in order.
    pub fn events(&self) -> &[Event] {
        &self.events[..self.count]
    }
}
