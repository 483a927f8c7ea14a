//! What a caller that is a program plays: bytes of a MIDI file, or notes and their times.

use chalumeau_core::control::parts::{Parts, Unplayed};
use chalumeau_core::event::{Event, PartEvent, Timed};
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

/// The score of notes for so many players, of whom each plays a part of a chord, and what they do not play.
pub(super) fn score_of_parts(
    notes: &[TimedNote],
    rate: u32,
    players: usize,
    playing: u128,
) -> (Score<PartEvent>, Unplayed) {
    let mut score = score_of(notes, rate);
    let mut parts = Parts::new(players.max(1));
    if players > 1 {
        parts.set_playing_keys(playing);
        // As files have it: a key that comes up leaves its player to the next one. Otherwise a melody would go from player to player.
        score.events.sort_by_key(|timed| (timed.at, !matches!(timed.event, Event::NoteOff { .. })));
    }
    let mut events = Vec::new();
    for Timed { at, event } in score.events {
        match event {
            Event::NoteOn { note, velocity: struck } => {
                // As MIDI tells it, the velocity is rounded; as the list tells it, it is not.
                let told = parts.note_on(0, note.0, (127.0 * struck).round().clamp(1.0, 127.0) as u8);
                events.extend(told.iter().map(|said| {
                    let event = match said.event {
                        Event::NoteOn { note, .. } => Event::NoteOn { note, velocity: struck },
                        other => other,
                    };
                    Timed { at, event: PartEvent { event, ..*said } }
                }));
            }
            Event::NoteOff { note } => {
                events.extend(parts.note_off(0, note.0).iter().map(|&event| Timed { at, event }));
            }
            other => events.push(Timed { at, event: other.into() }),
        }
    }
    (Score { events, samples: score.samples }, *parts.unplayed())
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
