//! Which note of a score is heard when.

use crate::event::Event;
use crate::instrument::KeyNotes;
use crate::score::timeline::Score;
use crate::units::SoundingNote;

/// The time in which one note of a score is heard.
///
/// A note is heard from its key to the key of the next note, or to its own release. The last key wins; when it is released,
/// the note held before it is heard again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoteSpan {
    /// The note.
    pub note: SoundingNote,
    /// First sample.
    pub from: usize,
    /// First sample after it.
    pub to: usize,
}

impl Score {
    /// The notes that are heard, in order of time; `notes` says which one a key plays. Allocates.
    pub fn note_spans(&self, notes: &KeyNotes) -> Vec<NoteSpan> {
        // By key: two keys may play one note.
        let (mut held, mut all): (Vec<SoundingNote>, Vec<NoteSpan>) = (Vec::new(), Vec::new());
        let mut now: Option<(SoundingNote, usize)> = None;
        for event in &self.events {
            match event.event {
                Event::NoteOn { note, .. } if notes.of(note).is_none() => continue,
                Event::NoteOn { note, .. } => {
                    held.retain(|&other| other != note);
                    held.push(note);
                }
                Event::NoteOff { note } | Event::Choke { note } => held.retain(|&other| other != note),
                Event::Panic => held.clear(),
                _ => continue,
            }
            let next = held.last().copied();
            if next == now.map(|(note, _)| note) && !matches!(event.event, Event::NoteOn { .. }) {
                continue;
            }
            let span = |(key, from), to| Some(NoteSpan { note: notes.of(key)?, from, to });
            all.extend(now.filter(|&(_, from)| from < event.at).and_then(|now| span(now, event.at)));
            now = next.map(|note| (note, event.at));
        }
        // A note that is held to the end.
        let last = now.filter(|&(_, from)| from < self.samples);
        all.extend(
            last.and_then(|(key, from)| Some(NoteSpan { note: notes.of(key)?, from, to: self.samples })),
        );
        all
    }
}

impl NoteSpan {
    /// First sample of its steady part, and first sample after it: all but the first three tenths and the last tenth.
    pub fn steady(&self) -> (usize, usize) {
        let length = self.to - self.from;
        (self.from + length * 3 / 10, self.to - length / 10)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::Timed;
    use crate::instrument::{Model, Reach};

    #[test]
    fn the_last_key_is_the_note_heard() {
        let on = |at, key| Timed { at, event: Event::NoteOn { note: SoundingNote(key), velocity: 1.0 } };
        let off = |at, key| Timed { at, event: Event::NoteOff { note: SoundingNote(key) } };
        let events = vec![
            on(0, 60),
            on(10, 62),
            off(12, 60),
            off(20, 62),
            on(30, 64),
            on(40, 65),
            off(50, 65),
            off(60, 64),
            on(90, 70),
        ];
        let score = Score { events, samples: 99 };
        let heard = |notes: &KeyNotes| -> Vec<_> {
            score.note_spans(notes).iter().map(|s| (s.note.0, s.from, s.to)).collect()
        };
        assert_eq!(
            heard(&KeyNotes::default()),
            [(60, 0, 10), (62, 10, 20), (64, 30, 40), (65, 40, 50), (64, 50, 60), (70, 90, 99)]
        );
        // An instrument from 50 on: 62 plays 52, and 60 plays 50; written a tenth lower, 60 plays nothing.
        let model = Model::built_in(48_000.0).unwrap();
        let lower = |transpose| Reach { transpose, ..Reach::default() }.key_notes(&model);
        assert_eq!(
            heard(&lower(-10)),
            [(50, 0, 10), (52, 10, 20), (54, 30, 40), (55, 40, 50), (54, 50, 60), (60, 90, 99)]
        );
        assert_eq!(
            heard(&lower(-12)),
            [(50, 10, 20), (52, 30, 40), (53, 40, 50), (52, 50, 60), (58, 90, 99)]
        );
    }
}
