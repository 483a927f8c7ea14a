//! The notes of a score as they are heard, and what each one played: measured while the samples pass by.
//!
//! A note is heard from its key to the next one's, or to its own release: the last key wins, and when it comes up the one
//! held before it is heard again. Pitch and level are those of its steady part, after the attack or the slur and before
//! the release. Keeps the samples of one note at a time, at most [`LONGEST_S`] of it.

use crate::analysis::pitch::{fundamental_hz, refine_hz};
use crate::analysis::spectrum::rms_dbfs;
use crate::event::Event;
use crate::score::Score;
use crate::units::{SoundingNote, cents};

/// Measured of a note at most, s: ten times what a pitch to 0.1 cent needs.
pub const LONGEST_S: f64 = 3.0;

/// A note as it is heard, samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sounding {
    /// Which one.
    pub note: SoundingNote,
    /// First sample.
    pub from: usize,
    /// First sample that is no longer its own.
    pub to: usize,
}

/// What a note played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heard {
    /// Which one, and when.
    pub sounding: Sounding,
    /// Its pitch, Hz; `None` where there is none.
    pub hz: Option<f64>,
    /// Its distance from equal temperament, cents.
    pub cents: Option<f64>,
    /// Root mean square of the steady part, dBFS; minus infinity for silence.
    pub level_dbfs: f64,
}

impl Score {
    /// The notes that are heard, in order of time.
    pub fn soundings(&self) -> Vec<Sounding> {
        let (mut held, mut all): (Vec<SoundingNote>, Vec<Sounding>) = (Vec::new(), Vec::new());
        let mut now: Option<(SoundingNote, usize)> = None;
        for event in &self.events {
            match event.event {
                Event::NoteOn { note, .. } => {
                    held.retain(|&other| other != note);
                    held.push(note);
                }
                Event::NoteOff { note } => held.retain(|&other| other != note),
                Event::Panic => held.clear(),
                _ => continue,
            }
            let next = held.last().copied();
            if next == now.map(|(note, _)| note) && !matches!(event.event, Event::NoteOn { .. }) {
                continue;
            }
            if let Some((note, from)) = now.filter(|&(_, from)| from < event.at) {
                all.push(Sounding { note, from, to: event.at });
            }
            now = next.map(|note| (note, event.at));
        }
        // Held to the end.
        if let Some((note, from)) = now.filter(|&(_, from)| from < self.samples) {
            all.push(Sounding { note, from, to: self.samples });
        }
        all
    }
}

impl Sounding {
    /// Its steady part: without the first three tenths and the last one.
    pub fn steady(&self) -> (usize, usize) {
        let length = self.to - self.from;
        (self.from + length * 3 / 10, self.to - length / 10)
    }
}

/// Measures notes as the samples go by.
pub struct Listener {
    rate_hz: f64,
    a4_hz: f64,
    notes: std::vec::IntoIter<Sounding>,
    now: Option<Sounding>,
    kept: Vec<f64>,
    at: usize,
    heard: Vec<Heard>,
}

impl Listener {
    /// For a score's [`soundings`](Score::soundings), which must be in order of time.
    pub fn new(notes: Vec<Sounding>, rate_hz: f64, a4_hz: f64) -> Self {
        let mut notes = notes.into_iter();
        let now = notes.next();
        Self { rate_hz, a4_hz, notes, now, kept: Vec::new(), at: 0, heard: Vec::new() }
    }

    /// Hears the next samples. Allocates.
    pub fn hear(&mut self, block: &[f32]) {
        let end = self.at + block.len();
        while let Some(sounding) = self.now {
            let (first, last) = self.range(&sounding);
            let part = first.clamp(self.at, end) - self.at..last.clamp(self.at, end) - self.at;
            self.kept.extend(block[part].iter().map(|&sample| f64::from(sample)));
            if last > end {
                break;
            }
            self.measure(sounding);
            self.now = self.notes.next();
        }
        self.at = end;
    }

    /// What was heard. A note that was cut off is measured as far as it went.
    pub fn finish(mut self) -> Vec<Heard> {
        while let Some(sounding) = self.now {
            self.measure(sounding);
            self.now = self.notes.next();
        }
        self.heard
    }

    /// Of a long note the middle of its steady part.
    fn range(&self, sounding: &Sounding) -> (usize, usize) {
        let (first, last) = sounding.steady();
        let longest = (LONGEST_S * self.rate_hz) as usize;
        let spare = (last - first).saturating_sub(longest) / 2;
        (first + spare, last - spare)
    }

    fn measure(&mut self, sounding: Sounding) {
        let wanted_hz = sounding.note.frequency_hz(self.a4_hz);
        let hz = refine_hz(&self.kept, self.rate_hz, wanted_hz)
            .or_else(|| fundamental_hz(&self.kept, self.rate_hz));
        self.heard.push(Heard {
            sounding,
            hz,
            cents: hz.map(|hz| cents(hz, wanted_hz)),
            level_dbfs: rms_dbfs(&self.kept),
        });
        self.kept.clear();
    }
}

/// Number of notes with a pitch, mean of their distances from equal temperament and the largest one, cents.
pub fn spread(heard: &[Heard]) -> Option<(usize, f64, f64)> {
    let cents: Vec<f64> = heard.iter().filter_map(|heard| heard.cents).collect();
    let largest = cents.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
    let mean = cents.iter().map(|cents| cents.abs()).sum::<f64>() / cents.len() as f64;
    Some((cents.len(), mean, largest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::Timed;
    use std::f64::consts::TAU;

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
        let heard: Vec<_> = score.soundings().iter().map(|s| (s.note.0, s.from, s.to)).collect();
        assert_eq!(
            heard,
            [(60, 0, 10), (62, 10, 20), (64, 30, 40), (65, 40, 50), (64, 50, 60), (70, 90, 99)]
        );
    }

    /// Three tones, the middle one 20 cents sharp, the last one long and in silence afterwards.
    fn tones() -> (Vec<Sounding>, Vec<f32>) {
        let mut notes = Vec::new();
        let mut samples: Vec<f32> = Vec::new();
        for (note, off, length) in [(60, 0.0, 20_000), (64, 20.0, 24_000), (67, -5.0, 400_000)] {
            let note = SoundingNote(note);
            let hz = note.frequency_hz(440.0) * 2f64.powf(off / 1200.0);
            let from = samples.len();
            samples.extend((0..length).map(|n| (0.5 * (TAU * hz * f64::from(n) / 48_000.0).sin()) as f32));
            notes.push(Sounding { note, from, to: samples.len() });
        }
        (notes, samples)
    }

    #[test]
    fn cents_and_levels_are_those_of_the_tones_whatever_the_blocks() {
        let (notes, samples) = tones();
        let mut all = Vec::new();
        for block in [64, 4_800, 1_000_000] {
            let mut listener = Listener::new(notes.clone(), 48_000.0, 440.0);
            samples.chunks(block).for_each(|block| listener.hear(block));
            all.push(listener.finish());
        }
        assert!(all[0] == all[1] && all[1] == all[2]);
        for (heard, off) in all[0].iter().zip([0.0, 20.0, -5.0]) {
            assert!((heard.cents.unwrap() - off).abs() < 0.1, "{heard:?}");
            assert!((heard.level_dbfs - 20.0 * (0.5 / 2f64.sqrt()).log10()).abs() < 0.02, "{heard:?}");
        }
        let (count, mean, largest) = spread(&all[0]).unwrap();
        assert!(count == 3 && (mean - 25.0 / 3.0).abs() < 0.1 && (largest - 20.0).abs() < 0.1);
        assert_eq!(spread(&[]), None);
    }

    #[test]
    fn a_note_cut_off_is_measured_and_silence_has_no_pitch() {
        let (notes, samples) = tones();
        let mut listener = Listener::new(notes, 48_000.0, 440.0);
        listener.hear(&samples[..18_000]);
        let heard = listener.finish();
        assert!(heard[0].cents.is_some());
        assert_eq!((heard[1].hz, heard[2].cents), (None, None));
        assert_eq!(heard[2].level_dbfs, f64::NEG_INFINITY);
    }
}
