//! Pitch and level of each note of a score, measured while the samples are rendered.
//!
//! [`Score::note_spans`](crate::score::Score::note_spans) says which note is heard when. Pitch and level are those of its
//! steady part, after the attack or the slur and before the release. A [`NoteMeter`] keeps the samples of one note at a time,
//! at most [`LONGEST_S`] of it.

use crate::analysis::pitch::OTHER_CENTS;
use crate::analysis::pitch::{fundamental_near_hz, periodicity, refine_hz};
use crate::analysis::spectrum::rms_dbfs;
use crate::score::NoteSpan;
use crate::units::cents;

/// Longest part of a note that is measured, s: ten times what a pitch within 0.1 cents needs.
pub const LONGEST_S: f64 = 3.0;

/// Softer notes have no pitch, dBFS at the usual gain. Without breath the click of the tongue rings on at -88 dBFS in a note of 0.2 s, and at
/// less than -120 in one of 0.5 s. The softest dynamic of a player is above -45.
pub const LEAST_DBFS: f64 = -75.0;

/// What repeats itself less than this from period to period has no pitch. Noise of a reed that is blown too softly does so by less than 0.1, also as the
/// bore colours it; notes with much air, growl or flutter tongue by more than 0.8.
const PERIODIC: f64 = 0.5;

/// How far [`refine_hz`] finds a pitch, cents.
const REFINED_CENTS: f64 = 50.0;

/// Pitch and level of one note.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredNote {
    /// Which note, and when it is heard.
    pub span: NoteSpan,
    /// Its pitch, Hz; `None` if it has none, or is too soft for one: see [`NoteMeter::new`].
    pub hz: Option<f64>,
    /// Its deviation from equal temperament, cents; `None` if it has no pitch.
    pub cents: Option<f64>,
    /// Root mean square of the measured part, dBFS; minus infinity for silence.
    pub level_dbfs: f64,
}

/// Measures the notes of a score while its samples are rendered.
pub struct NoteMeter {
    rate_hz: f64,
    a4_hz: f64,
    least_dbfs: f64,
    notes: std::vec::IntoIter<NoteSpan>,
    now: Option<NoteSpan>,
    kept: Vec<f64>,
    at: usize,
    measured: Vec<MeasuredNote>,
}

impl NoteMeter {
    /// A meter for the [`note_spans`](crate::score::Score::note_spans) of a score, which must be in order of time. `rate_hz` is
    /// that of the samples; `a4_hz` is the pitch of A4 for the deviation in cents. What is softer than [`LEAST_DBFS`] and `gain_db`,
    /// which lies above the usual gain, together has no pitch.
    pub fn new(notes: Vec<NoteSpan>, rate_hz: f64, a4_hz: f64, gain_db: f64) -> Self {
        let mut notes = notes.into_iter();
        let now = notes.next();
        let least_dbfs = LEAST_DBFS + gain_db;
        Self { rate_hz, a4_hz, least_dbfs, notes, now, kept: Vec::new(), at: 0, measured: Vec::new() }
    }

    /// Takes the next samples. Allocates.
    pub fn hear(&mut self, block: &[f32]) {
        let end = self.at + block.len();
        while let Some(span) = self.now {
            let (first, last) = self.range(&span);
            let part = first.clamp(self.at, end) - self.at..last.clamp(self.at, end) - self.at;
            self.kept.extend(block[part].iter().map(|&sample| f64::from(sample)));
            if last > end {
                break;
            }
            self.measure(span);
            self.now = self.notes.next();
        }
        self.at = end;
    }

    /// The measured notes. A note that was cut off is measured as far as it went.
    pub fn finish(mut self) -> Vec<MeasuredNote> {
        while let Some(span) = self.now {
            self.measure(span);
            self.now = self.notes.next();
        }
        self.measured
    }

    /// The samples to measure: the steady part of a note, or the middle of it if the note is long.
    fn range(&self, span: &NoteSpan) -> (usize, usize) {
        let (first, last) = span.steady();
        let longest = (LONGEST_S * self.rate_hz) as usize;
        let spare = (last - first).saturating_sub(longest) / 2;
        (first + spare, last - spare)
    }

    fn measure(&mut self, span: NoteSpan) {
        let wanted_hz = span.note.frequency_hz(self.a4_hz);
        let level_dbfs = rms_dbfs(&self.kept);
        let hz =
            if level_dbfs < self.least_dbfs { None } else { pitch_hz(&self.kept, self.rate_hz, wanted_hz) };
        let hz = hz.filter(|&hz| periodicity(&self.kept, self.rate_hz, hz) >= PERIODIC);
        self.measured.push(MeasuredNote { span, hz, cents: hz.map(|hz| cents(hz, wanted_hz)), level_dbfs });
        self.kept.clear();
    }
}

/// The pitch of a note that is to be `wanted_hz`.
fn pitch_hz(samples: &[f64], rate_hz: f64, wanted_hz: f64) -> Option<f64> {
    // Found without a hint first: the harmonics of an overblown note are also harmonics of the wanted one, and those of a note a
    // twelfth too low hold it, so that refining would find what does not sound.
    let found = fundamental_near_hz(samples, rate_hz, wanted_hz)?;
    let is_near = cents(found, wanted_hz).abs() <= REFINED_CENTS;
    let refined = is_near.then(|| refine_hz(samples, rate_hz, wanted_hz)).flatten();
    Some(refined.unwrap_or(found))
}

/// How far the notes of a score lie from equal temperament.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Notes with a pitch.
    pub count: usize,
    /// Of those within [`OTHER_CENTS`]: mean of the absolute deviations, and the largest with its sign, cents. `None` if there
    /// is none.
    pub own: Option<(f64, f64)>,
    /// Those further off, which are other notes: how many, and the largest deviation with its sign, cents. `None` if there is
    /// none.
    pub others: Option<(usize, f64)>,
}

/// How far notes lie from equal temperament; `None` if no note has a pitch.
pub fn spread(measured: &[MeasuredNote]) -> Option<Spread> {
    let cents = measured.iter().filter_map(|note| note.cents);
    let (own, others): (Vec<f64>, Vec<f64>) = cents.partition(|cents| cents.abs() <= OTHER_CENTS);
    let largest = |of: &[f64]| of.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()));
    let mean = |of: &[f64]| of.iter().map(|cents| cents.abs()).sum::<f64>() / of.len() as f64;
    let count = own.len() + others.len();
    (count > 0).then(|| Spread {
        count,
        own: largest(&own).map(|largest| (mean(&own), largest)),
        others: largest(&others).map(|largest| (others.len(), largest)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dsp::white::White;
    use crate::units::SoundingNote;
    use std::f64::consts::TAU;

    /// Three tones, the middle one 20 cents sharp, the last one long and in silence afterwards.
    fn tones() -> (Vec<NoteSpan>, Vec<f32>) {
        let mut notes = Vec::new();
        let mut samples: Vec<f32> = Vec::new();
        for (note, off, length) in [(60, 0.0, 20_000), (64, 20.0, 24_000), (67, -5.0, 400_000)] {
            let note = SoundingNote(note);
            let hz = note.frequency_hz(440.0) * 2f64.powf(off / 1200.0);
            let from = samples.len();
            samples.extend((0..length).map(|n| (0.5 * (TAU * hz * f64::from(n) / 48_000.0).sin()) as f32));
            notes.push(NoteSpan { note, from, to: samples.len() });
        }
        (notes, samples)
    }

    #[test]
    fn noise_has_no_pitch_and_a_noisy_tone_has() {
        let mut white = White::new(1);
        let note = SoundingNote(58);
        let hz = note.frequency_hz(440.0);
        let mut heard = |tone: f64| {
            let sample =
                |n: u32| (tone * (TAU * hz * f64::from(n) / 48_000.0).sin() + 0.02 * white.next()) as f32;
            let samples: Vec<f32> = (0..48_000).map(sample).collect();
            let mut meter =
                NoteMeter::new(vec![NoteSpan { note, from: 0, to: samples.len() }], 48_000.0, 440.0, 0.0);
            meter.hear(&samples);
            meter.finish()[0].cents
        };
        assert_eq!(heard(0.0), None);
        assert!(heard(0.1).unwrap().abs() < 1.0);
    }

    /// Harmonics of the wanted note alone, and those of a note of which it is one, are the notes that sound.
    #[test]
    fn what_is_overblown_or_sounds_below_is_not_in_tune() {
        let note = SoundingNote(65);
        let wanted_hz = note.frequency_hz(440.0);
        let span = NoteSpan { note, from: 0, to: 48_000 };
        let mut all = Vec::new();
        for (times, harmonics) in [(3.0, 4), (5.0, 3), (1.0 / 3.0, 9), (1.0, 9)] {
            let f_hz = times * wanted_hz;
            let sample = |n: u32| {
                let sine =
                    |h: i32| (TAU * f64::from(h) * f_hz * f64::from(n) / 48_000.0).sin() / f64::from(h * h);
                (0.3 * (1..=harmonics).map(sine).sum::<f64>()) as f32
            };
            let samples: Vec<f32> = (0..48_000).map(sample).collect();
            let mut meter = NoteMeter::new(vec![span], 48_000.0, 440.0, 0.0);
            meter.hear(&samples);
            let heard = meter.finish()[0];
            let expected = 1_200.0 * times.log2();
            assert!((heard.cents.unwrap() - expected).abs() < 0.1, "{times}: {heard:?}");
            all.push(heard);
        }
        let Spread { count, own, others } = spread(&all).unwrap();
        let ((mean, _), (other, largest)) = (own.unwrap(), others.unwrap());
        assert!(count == 4 && other == 3 && mean < 0.1 && (largest - 2_786.3).abs() < 0.2, "{largest}");
        assert_eq!(spread(&all[..2]).unwrap().own, None);
    }

    /// A contrabass clarinet's lowest notes lie below what is looked for otherwise.
    #[test]
    fn the_lowest_notes_are_found() {
        let note = SoundingNote(26);
        let hz = note.frequency_hz(440.0);
        let samples: Vec<f32> = (0..96_000)
            .map(|n| {
                let phase = TAU * hz * f64::from(n) / 48_000.0;
                (0.2 * phase.sin() + 0.2 * (3.0 * phase).sin()) as f32
            })
            .collect();
        let mut meter =
            NoteMeter::new(vec![NoteSpan { note, from: 0, to: samples.len() }], 48_000.0, 440.0, 0.0);
        meter.hear(&samples);
        assert!(meter.finish()[0].cents.unwrap().abs() < 0.1);
    }

    #[test]
    fn cents_and_levels_are_those_of_the_tones_whatever_the_blocks() {
        let (notes, samples) = tones();
        let mut all = Vec::new();
        for block in [64, 4_800, 1_000_000] {
            let mut meter = NoteMeter::new(notes.clone(), 48_000.0, 440.0, 0.0);
            samples.chunks(block).for_each(|block| meter.hear(block));
            all.push(meter.finish());
        }
        assert!(all[0] == all[1] && all[1] == all[2]);
        for (heard, off) in all[0].iter().zip([0.0, 20.0, -5.0]) {
            assert!((heard.cents.unwrap() - off).abs() < 0.1, "{heard:?}");
            assert!((heard.level_dbfs - 20.0 * (0.5 / 2f64.sqrt()).log10()).abs() < 0.02, "{heard:?}");
        }
        let Spread { count, own, others } = spread(&all[0]).unwrap();
        let (mean, largest) = own.unwrap();
        assert!(count == 3 && (mean - 25.0 / 3.0).abs() < 0.1 && (largest - 20.0).abs() < 0.1);
        assert_eq!(others, None);
        assert_eq!(spread(&[]), None);
    }

    #[test]
    fn a_note_cut_off_is_measured_and_silence_has_no_pitch() {
        let (notes, samples) = tones();
        let mut meter = NoteMeter::new(notes, 48_000.0, 440.0, 0.0);
        meter.hear(&samples[..18_000]);
        let heard = meter.finish();
        assert!(heard[0].cents.is_some());
        assert_eq!((heard[1].hz, heard[2].cents), (None, None));
        assert_eq!(heard[2].level_dbfs, f64::NEG_INFINITY);
    }

    #[test]
    fn what_is_softer_than_any_note_has_no_pitch() {
        let (notes, samples) = tones();
        // The tones are at -9 dBFS.
        for (down_db, gain_db, pitches) in
            [(65.0, 0.0, 3), (67.0, 0.0, 0), (77.0, -12.0, 3), (79.0, -12.0, 0)]
        {
            let factor = 10f32.powf(-down_db / 20.0);
            let mut meter = NoteMeter::new(notes.clone(), 48_000.0, 440.0, gain_db);
            meter.hear(&samples.iter().map(|sample| factor * sample).collect::<Vec<_>>());
            let heard = meter.finish();
            assert_eq!(heard.iter().filter(|note| note.hz.is_some()).count(), pitches, "{heard:?}");
            assert!(heard.iter().all(|note| note.level_dbfs.is_finite()));
        }
    }
}
