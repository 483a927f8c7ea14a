//! A long sound in the size of a picture: outline, spectrogram and pitch, gathered while the samples pass by.
//!
//! How many columns there are is fixed at the start and does not grow with the length, so an hour costs what a minute
//! costs; at most three windows of samples are kept, a quarter of a second at 48 kHz. Columns of a short sound overlap, those of a long one look at
//! one moment each: between them nothing is seen of the spectrum, but all of the outline.

use crate::analysis::pitch::{LOWEST_HZ, TrackPoint, drop_longer_periods, pitch_track_above, window_s};
use crate::analysis::spectrum::power_spectrum_db;
use crate::units::nearest_rate_hz;

/// Highest frequency of the spectrogram, Hz: above it a clarinet has no strong partials.
pub const HIGHEST_HZ: f64 = 6_000.0;
/// Shortest window of a spectrogram column, s; the next power of two samples is taken. Harmonics of the lowest note of a
/// bass clarinet, 58 Hz, stand apart.
const COLUMN_S: f64 = 0.08;
/// Shortest distance between two looks at the pitch, s: a sixth of what one sees.
const HOP_S: f64 = 0.01;

/// Lowest and highest value of equal stretches of something that runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Envelope {
    values: usize,
    count: usize,
    at: usize,
    bins: Vec<[f32; 2]>,
}

impl Envelope {
    /// For `values` values in at most `bins` stretches. Allocates.
    pub fn new(values: usize, bins: usize) -> Self {
        let count = bins.min(values).max(1);
        Self { values, count, at: 0, bins: Vec::with_capacity(count) }
    }

    /// The next value; more than were announced go into the last stretch.
    pub fn push(&mut self, value: f32) {
        let bin = (self.at as u128 * self.count as u128 / self.values.max(1) as u128) as usize;
        let bin = bin.min(self.count - 1);
        self.at += 1;
        match self.bins.get_mut(bin) {
            Some([low, high]) => (*low, *high) = (low.min(value), high.max(value)),
            None => self.bins.push([value, value]),
        }
    }

    /// `[lowest, highest]` of each stretch so far.
    pub fn bins(&self) -> &[[f32; 2]] {
        &self.bins
    }

    /// Middle of a stretch as a part of the whole, 0..=1.
    pub fn middle(&self, bin: usize) -> f64 {
        (bin as f64 + 0.5) / self.count as f64
    }

    /// The lowest and highest value of all; `None` for nothing.
    pub fn range(&self) -> Option<[f32; 2]> {
        self.bins.iter().copied().reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }
}

/// A sound as a picture shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Overview {
    /// Length, s.
    pub seconds: f64,
    /// Outline of the samples.
    pub outline: Envelope,
    /// Levels, dB re a sine of full scale: column by column, each from 0 Hz up.
    pub levels_db: Vec<f32>,
    /// Columns over the whole length.
    pub columns: usize,
    /// Rows, `row_hz` apart, the first about 0 Hz.
    pub rows: usize,
    /// Height of a row, Hz.
    pub row_hz: f64,
    /// Pitch and level.
    pub track: Vec<TrackPoint>,
}

/// Gathers an [`Overview`].
pub struct Watcher {
    rate_hz: f64,
    samples: usize,
    window: usize,
    hop: usize,
    /// Lowest pitch that is looked for, Hz.
    least_hz: f64,
    next_pitch: usize,
    next_column: usize,
    /// The last samples heard, the first of them sample `kept_from` of the sound.
    kept: Vec<f64>,
    kept_from: usize,
    overview: Overview,
}

impl Watcher {
    /// For a sound of `samples` samples in `columns` columns. A rate outside 1000..=1536000 Hz counts as the nearest that is inside, NaN as
    /// 48000 Hz. Allocates.
    pub fn new(samples: usize, rate_hz: f64, columns: usize) -> Self {
        // Others would make windows of no sample, or of all memory.
        let rate_hz = nearest_rate_hz(rate_hz);
        let window = ((COLUMN_S * rate_hz) as usize).next_power_of_two();
        let row_hz = rate_hz / window as f64;
        let rows = ((HIGHEST_HZ.min(0.5 * rate_hz) / row_hz) as usize).min(window / 2) + 1;
        let columns = columns.clamp(1, samples.max(1));
        let overview = Overview {
            seconds: samples as f64 / rate_hz,
            outline: Envelope::new(samples, columns),
            levels_db: Vec::with_capacity(columns * rows),
            columns,
            rows,
            row_hz,
            track: Vec::new(),
        };
        let hop = ((HOP_S * rate_hz) as usize).max(samples / columns).max(1);
        Self {
            rate_hz,
            samples,
            window,
            hop,
            least_hz: LOWEST_HZ,
            next_pitch: 0,
            next_column: 0,
            kept: Vec::new(),
            kept_from: 0,
            overview,
        }
    }

    /// The same for a sound with notes from `lowest_hz` on, which may lie below what is looked for otherwise.
    pub fn with_notes_from(self, lowest_hz: f64) -> Self {
        // Down to a little less than the note: it may be flat.
        Self { least_hz: LOWEST_HZ.min(0.9 * lowest_hz), ..self }
    }

    /// Sees the next samples. Allocates.
    pub fn see(&mut self, block: &[f32]) {
        for part in block.chunks(self.window) {
            part.iter().for_each(|&sample| self.overview.outline.push(sample));
            self.kept.extend(part.iter().map(|&sample| f64::from(sample)));
            self.advance(self.kept_from + self.kept.len());
        }
    }

    /// The whole. What was announced and did not come is silence.
    pub fn finish(mut self) -> Overview {
        let end = self.kept_from + self.kept.len();
        self.kept.resize(self.kept.len() + self.window, 0.0);
        self.advance(end.max(self.samples) + self.window);
        drop_longer_periods(&mut self.overview.track);
        self.overview
    }

    /// Does what can be done when all samples before `end` are known.
    fn advance(&mut self, end: usize) {
        while self.next_column < self.overview.columns {
            let middle = (2 * self.next_column + 1) as u128 * self.samples as u128;
            let middle = (middle / (2 * self.overview.columns as u128)) as usize;
            if middle + self.window / 2 > end {
                break;
            }
            self.column(middle);
            self.next_column += 1;
        }
        let longest_s = window_s(self.least_hz);
        let window = (longest_s * self.rate_hz).round() as usize;
        // The pitch of the end is that of the sound, not of the silence after it.
        while self.next_pitch + window <= end.min(self.samples) {
            let frame = self.part(self.next_pitch, window);
            let from_s = self.next_pitch as f64 / self.rate_hz;
            let points = pitch_track_above(&frame, self.rate_hz, longest_s, self.least_hz);
            self.overview.track.extend(points.into_iter().map(|p| TrackPoint { t_s: p.t_s + from_s, ..p }));
            self.next_pitch += self.hop;
        }
        let keeps = (2 * self.window).max(self.window + window);
        let spare = (self.kept_from + self.kept.len()).saturating_sub(keeps).max(self.kept_from);
        self.kept.drain(..spare - self.kept_from);
        self.kept_from = spare;
    }

    fn column(&mut self, middle: usize) {
        // Before the start there was silence.
        let early = (self.window / 2).saturating_sub(middle);
        let mut frame = vec![0.0; early];
        frame.extend(self.part(middle + early - self.window / 2, self.window - early));
        let spectrum = power_spectrum_db(&frame, self.rate_hz);
        let rows =
            (0..self.overview.rows).map(|row| spectrum.level_db.get(row).map_or(-200.0, |&db| db as f32));
        self.overview.levels_db.extend(rows);
    }

    /// `length` samples from sample `from` on; beyond what there is, silence.
    fn part(&self, from: usize, length: usize) -> Vec<f64> {
        let first = from.saturating_sub(self.kept_from).min(self.kept.len());
        let mut part: Vec<f64> = self.kept[first..].iter().copied().take(length).collect();
        part.resize(length, 0.0);
        part
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const RATE_HZ: f64 = 48_000.0;

    /// Two tones, a second each, 440 Hz at half and 880 Hz at a quarter of full scale.
    fn tones() -> Vec<f32> {
        let tone = |n: u32, hz: f64, a: f64| (a * (TAU * hz * f64::from(n) / RATE_HZ).sin()) as f32;
        (0..96_000).map(|n| if n < 48_000 { tone(n, 440.0, 0.5) } else { tone(n, 880.0, 0.25) }).collect()
    }

    fn seen(samples: &[f32], block: usize, columns: usize) -> Overview {
        let mut watcher = Watcher::new(samples.len(), RATE_HZ, columns);
        samples.chunks(block).for_each(|block| watcher.see(block));
        watcher.finish()
    }

    #[test]
    fn blocks_are_not_seen() {
        let samples = tones();
        let whole = seen(&samples, 96_000, 50);
        assert!(whole == seen(&samples, 64, 50) && whole == seen(&samples, 777, 50));
    }

    #[test]
    fn each_column_shows_the_tone_of_its_moment() {
        let overview = seen(&tones(), 512, 40);
        assert_eq!((overview.columns, overview.levels_db.len()), (40, 40 * overview.rows));
        for (column, levels) in overview.levels_db.chunks(overview.rows).enumerate() {
            // The four columns about the change and the ends see two things at once.
            if [0, 18, 19, 20, 21, 39].contains(&column) {
                continue;
            }
            let (hz, db) = if column < 20 { (440.0, -6.02) } else { (880.0, -12.04) };
            let loudest = (0..levels.len()).max_by(|&a, &b| levels[a].total_cmp(&levels[b])).unwrap();
            assert!((loudest as f64 * overview.row_hz - hz).abs() <= overview.row_hz, "{column}");
            // Between two bins a Blackman-Harris window loses 0.83 dB.
            assert!((f64::from(levels[loudest]) - db).abs() < 0.9, "{column}: {}", levels[loudest]);
        }
        for point in &overview.track {
            if (point.t_s - 1.0).abs() > 0.04 {
                let hz = if point.t_s < 1.0 { 440.0 } else { 880.0 };
                assert!((point.hz.unwrap() / hz - 1.0).abs() < 0.005, "{point:?}");
            }
        }
        // A look every fortieth of 2 s through 60 ms: the last whole one is at most that and half a window before the end.
        let last = overview.track.last().unwrap().t_s;
        assert!((1.92..1.97).contains(&last), "{last}");
    }

    #[test]
    fn the_lowest_notes_have_a_pitch_where_they_are_looked_for() {
        let tone = |n: u32| (0.3 * (TAU * 36.7 * f64::from(n) / RATE_HZ).sin()) as f32;
        let samples: Vec<f32> = (0..96_000).map(tone).collect();
        let mut watcher = Watcher::new(samples.len(), RATE_HZ, 40).with_notes_from(36.7);
        samples.chunks(512).for_each(|block| watcher.see(block));
        let track = watcher.finish().track;
        assert!(track.len() > 30);
        assert!(track.iter().all(|point| (point.hz.unwrap() / 36.7 - 1.0).abs() < 0.01), "{track:?}");
    }

    #[test]
    fn the_outline_misses_no_peak() {
        let mut samples = vec![0.0f32; 100_000];
        (samples[12_345], samples[99_999]) = (0.9, -0.8);
        let outline = seen(&samples, 100, 10).outline;
        assert_eq!(outline.bins().len(), 10);
        assert_eq!((outline.bins()[1], outline.bins()[9]), ([0.0, 0.9], [-0.8, 0.0]));
        assert_eq!((outline.range(), outline.middle(9)), (Some([-0.8, 0.9]), 0.95));
    }

    #[test]
    fn any_rate_makes_a_picture() {
        for rate_hz in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300] {
            let mut watcher = Watcher::new(1_000, rate_hz, 10);
            watcher.see(&[0.1; 1_000]);
            assert_eq!(watcher.finish().columns, 10, "{rate_hz}");
        }
    }

    #[test]
    fn a_click_is_a_picture_too() {
        let overview = seen(&[0.5], 1, 100);
        assert_eq!((overview.columns, overview.outline.bins().len()), (1, 1));
        assert!(overview.track.is_empty());
        assert!(seen(&[], 1, 100).outline.range().is_none());
    }
}
