//! What a caller that is a program plays: bytes of a MIDI file, or notes and their times.

use chalumeau_core::event::{Event, Timed};
use chalumeau_core::score::Score;
use chalumeau_core::units::SoundingNote;
use std::path::PathBuf;

/// What a caller that is a program has in memory.
pub enum Given {
    /// A standard MIDI file.
    Midi {
        /// What is in it.
        bytes: Vec<u8>,
        /// Where it was read from, for messages.
        path: Option<PathBuf>,
    },
    /// Notes, to be played at any rate.
    Notes(Vec<TimedNote>),
}

/// A note and when it sounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedNote {
    /// When it begins, s, at least 0.
    pub from_s: f64,
    /// How long it is held, s, at least 0.
    pub seconds: f64,
    /// Its sounding pitch.
    pub note: SoundingNote,
    /// Velocity, 0..=1.
    pub velocity: f32,
}

/// The score of notes. A key that comes up where another goes down comes up after it: a slur.
pub(super) fn score_of(notes: &[TimedNote], rate: u32) -> Score {
    let at = |seconds: f64| (seconds * f64::from(rate)).round() as usize;
    let on = notes.iter().map(|one| {
        let event = Event::NoteOn { note: one.note, velocity: one.velocity };
        Timed { at: at(one.from_s), event }
    });
    let off = notes.iter().map(|one| {
        let event = Event::NoteOff { note: one.note };
        Timed { at: at(one.from_s + one.seconds), event }
    });
    let mut events: Vec<_> = on.chain(off).collect();
    // A note struck again at the moment of its end: its own end comes first.
    let order = |timed: &Timed<Event>| match timed.event {
        Event::NoteOff { note } => {
            u8::from(!notes.iter().any(|one| one.note == note && at(one.from_s) == timed.at))
        }
        _ => 1,
    };
    events.sort_by_key(|timed| (timed.at, order(timed)));
    let samples = events.last().map_or(0, |last| last.at);
    Score { events, samples }
}
