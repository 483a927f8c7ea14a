//! A score: events at sample positions, and how long to listen.

use crate::event::{Event, PartEvent, Played, Timed, To};
use crate::instrument::Settings;
use crate::score::breath::BreathCurve;
use crate::score::samples::{length_s, samples_in};
use crate::units::{SoundingNote, WrittenNote};

/// Silence before a tongued note of a scale, s: the time a tongue takes to touch the reed and leave it again, chosen by ear.
const TONGUE_GAP_S: f64 = 0.03;

/// Velocity of a note that no keyboard has played, 0..=1.
const PLAIN_VELOCITY: f32 = 0.8;

/// What is to be played: events in order of time, at one sample rate. Of several players, its events are [`PartEvent`]s.
///
/// Make one with [`note`](Self::note), [`scale`](Self::scale), a MIDI file (feature `midi`), or from your own events.
#[derive(Clone, Debug, PartialEq)]
pub struct Score<E = Event> {
    /// The events, in order of time; positions in samples from the start.
    pub events: Vec<Timed<E>>,
    /// Length of the score, with the time to fade, samples.
    pub samples: usize,
}

/// Why a score cannot be made.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum ScoreError {
    /// The sounding pitch of a written note would lie outside MIDI's 0 to 127.
    #[error("written note {0} sounds outside MIDI's 0..127; choose one nearer the middle")]
    OutsideMidi(WrittenNote),
}

impl<E> Default for Score<E> {
    /// Nothing.
    fn default() -> Self {
        Self { events: Vec::new(), samples: 0 }
    }
}

impl From<&Score> for Score<PartEvent> {
    /// The same score for the first player; in unison all play it.
    fn from(score: &Score) -> Self {
        let first = |event| PartEvent { to: To::Player(0), event };
        let events = score.events.iter().map(|&Timed { at, event }| Timed { at, event: first(event) });
        Self { events: events.collect(), samples: score.samples }
    }
}

impl From<&Score<PartEvent>> for Score {
    /// What all players play together, as one player would get it.
    fn from(score: &Score<PartEvent>) -> Self {
        let events = score.events.iter().map(|&Timed { at, event }| Timed { at, event: event.event });
        Self { events: events.collect(), samples: score.samples }
    }
}

impl Score {
    /// One note from the start, held for `seconds`, 0 to six hours: what lies outside counts as the nearest, NaN as 0. `rate` is the
    /// sample rate, Hz; 0 counts as 1.
    pub fn note(note: SoundingNote, seconds: f64, rate: u32) -> Self {
        let end = samples_in(length_s(seconds), rate);
        let events = vec![
            Timed { at: 0, event: Event::NoteOn { note, velocity: PLAIN_VELOCITY } },
            Timed { at: end, event: Event::NoteOff { note } },
        ];
        Self { events, samples: end }
    }

    /// Every semitone from one written note to another, up or down, each lasting `seconds` as in [`note`](Self::note); tongued or
    /// slurred.
    ///
    /// The instrument sounds `transposition` semitones below what is written (B flat clarinet: 2). `rate` is the sample rate,
    /// Hz.
    ///
    /// # Errors
    ///
    /// [`ScoreError::OutsideMidi`] if a note sounds outside MIDI's range.
    pub fn scale(
        from: WrittenNote,
        to: WrittenNote,
        transposition: i8,
        seconds: f64,
        slurred: bool,
        rate: u32,
    ) -> Result<Self, ScoreError> {
        let semitones: Vec<u8> =
            if from <= to { (from.0..=to.0).collect() } else { (to.0..=from.0).rev().collect() };
        let notes: Vec<_> = semitones.into_iter().map(WrittenNote).collect();
        Self::one_after_another(&notes, transposition, seconds, slurred, rate)
    }

    /// These written notes, each lasting `seconds`; the rest as for [`scale`](Self::scale).
    ///
    /// # Errors
    ///
    /// [`ScoreError::OutsideMidi`] if a note sounds outside MIDI's range.
    pub fn one_after_another(
        notes: &[WrittenNote],
        transposition: i8,
        seconds: f64,
        slurred: bool,
        rate: u32,
    ) -> Result<Self, ScoreError> {
        let seconds = length_s(seconds);
        let gap_s = if slurred { 0.0 } else { TONGUE_GAP_S.min(seconds / 4.0) };
        let (mut events, mut end, mut last) = (Vec::new(), 0, None);
        for (index, &written) in notes.iter().enumerate() {
            let note = written.sounding(transposition).ok_or(ScoreError::OutsideMidi(written))?;
            let start = samples_in(index as f64 * seconds, rate);
            // A note that is slurred to itself is held.
            if !slurred || last != Some(note) {
                events.push(Timed { at: start, event: Event::NoteOn { note, velocity: PLAIN_VELOCITY } });
                if let Some(note) = last.filter(|_| slurred) {
                    // The old key comes up after the next one is down: a slur, in which the reed keeps vibrating.
                    events.push(Timed { at: start, event: Event::NoteOff { note } });
                }
            }
            end = samples_in((index + 1) as f64 * seconds, rate);
            if !slurred {
                let up = samples_in((index + 1) as f64 * seconds - gap_s, rate);
                events.push(Timed { at: up, event: Event::NoteOff { note } });
            }
            last = Some(note);
        }
        if let Some(note) = last.filter(|_| slurred) {
            events.push(Timed { at: end, event: Event::NoteOff { note } });
        }
        Ok(Self { events, samples: end })
    }
}

impl<E> Score<E> {
    /// The same notes with the breath of `curve`, which replaces all breath events of the score.
    pub fn blown(mut self, curve: &BreathCurve, settings: &Settings, rate: u32) -> Self
    where
        E: Played,
    {
        self.events.retain(|e| !matches!(e.event.event(), Event::Breath(_) | Event::BreathFromKeys));
        let blown = curve.events(self.samples, rate, settings).into_iter();
        let mut events: Vec<_> = blown.map(|Timed { at, event }| Timed { at, event: event.into() }).collect();
        events.append(&mut self.events);
        // The sort is stable. At one sample breath comes before notes, so that the tongue releases a blown reed.
        events.sort_by_key(|e| e.at);
        Self { events, samples: self.samples }
    }

    /// The same score with `seconds` more at its end, at most six hours, in which the sound fades.
    pub fn with_tail(mut self, seconds: f64, rate: u32) -> Self {
        self.samples = self.samples.saturating_add(samples_in(length_s(seconds), rate));
        self
    }

    /// Length of the score, s. A rate of 0 counts as 1 Hz.
    pub fn seconds(&self, rate: u32) -> f64 {
        self.samples as f64 / f64::from(rate.max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::breath::BreathCurve;

    #[test]
    fn breath_comes_before_the_note_it_sounds() {
        let score = Score::note(SoundingNote(60), 1.0, 48_000).blown(
            &BreathCurve::constant(0.5),
            &Settings::physical(),
            48_000,
        );
        assert!(matches!(score.events[0].event, Event::Breath(breath) if (breath - 0.5).abs() < 1e-6));
        assert!(matches!(score.events[1].event, Event::NoteOn { .. }));
        assert_eq!((score.events.len(), score.samples), (3, 48_000));
    }

    #[test]
    fn slurred_notes_overlap_and_tongued_ones_do_not() {
        for slurred in [false, true] {
            let scale = Score::scale(WrittenNote(52), WrittenNote(64), 2, 0.25, slurred, 48_000).unwrap();
            let (mut held, mut empty) = (0, 0);
            for event in &scale.events[..scale.events.len() - 1] {
                match event.event {
                    Event::NoteOn { .. } => held += 1,
                    Event::NoteOff { .. } => held -= 1,
                    _ => {}
                }
                empty += u32::from(held == 0);
            }
            assert_eq!(empty, if slurred { 0 } else { 12 });
            assert_eq!(scale.events.len(), 26);
            assert_eq!(scale.samples, 13 * 12_000);
            assert!(scale.events.is_sorted_by_key(|e| e.at));
        }
    }

    #[test]
    fn a_note_that_is_slurred_to_itself_is_held() {
        let notes = [60, 60, 62].map(WrittenNote);
        let score = Score::one_after_another(&notes, 0, 0.5, true, 1_000).unwrap();
        let heard: Vec<(usize, bool, u8)> = score
            .events
            .iter()
            .filter_map(|timed| match timed.event {
                Event::NoteOn { note, .. } => Some((timed.at, true, note.0)),
                Event::NoteOff { note } => Some((timed.at, false, note.0)),
                _ => None,
            })
            .collect();
        let wanted = [(0, true, 60), (1_000, true, 62), (1_000, false, 60), (1_500, false, 62)];
        assert_eq!(heard, wanted);
    }

    #[test]
    fn no_score_is_endless() {
        let six_hours = 6 * 3_600 * 48_000;
        for (seconds, samples) in
            [(0.5, 24_000), (-1.0, 0), (f64::NAN, 0), (1e300, six_hours), (f64::INFINITY, six_hours)]
        {
            assert_eq!(Score::note(SoundingNote(60), seconds, 48_000).samples, samples, "{seconds}");
            assert_eq!(Score::<Event>::default().with_tail(seconds, 48_000).samples, samples, "{seconds}");
            let scale = Score::scale(WrittenNote(60), WrittenNote(61), 2, seconds, false, 48_000).unwrap();
            assert!(scale.samples == 2 * samples && scale.events.is_sorted_by_key(|e| e.at), "{seconds}");
        }
        let note = Score::note(SoundingNote(60), 2.0, 0);
        assert_eq!((note.samples, note.seconds(0)), (2, 2.0));
        let blown = note.with_tail(1.0, 1).blown(&BreathCurve::constant(0.5), &Settings::physical(), 0);
        assert_eq!(blown.events.len(), 3);
    }

    #[test]
    fn a_scale_can_fall() {
        let scale = Score::scale(WrittenNote(64), WrittenNote(52), 2, 0.1, true, 48_000).unwrap();
        assert!(matches!(scale.events[0].event, Event::NoteOn { note: SoundingNote(62), .. }));
        assert!(Score::scale(WrittenNote(0), WrittenNote(5), 2, 0.1, true, 48_000).is_err());
    }
}
