//! The notes of a recording: where each begins and ends, its pitch, level, attack and harmonics.
//!
//! For one voice at a time. A note ends where the sound does, where the pitch moves on, or where the level dips as the tongue
//! makes it. What two notes share (a glide, a click of the fingers) belongs to neither.

use crate::analysis::pitch::{TrackPoint, drop_longer_periods, pitch_track, refine_hz};
use crate::analysis::spectrum::{HARMONICS, centroid_hz, levels_of_harmonics_db, moving_rms, rms_dbfs};
use crate::analysis::{is_hz, onset, upper_median, without_mean};
use crate::units::cents;
use std::ops::Range;

/// Distance between moments looked at, s: six in a window of the track.
const HOP_S: f64 = 0.01;
/// A moment further below the loudest is no note: -45 dB, which is above the noise of most rooms beside a mezzo-forte (by judgement).
const SILENT: f64 = 0.0056;
/// A moment below this is no note in any file: -80 dB re full scale.
const QUIET: f64 = 1e-4;
/// A moment further from a note's mean is of another note, cents: a vibrato reaches 40 to each side, a semitone is 100.
const APART_CENTS: f64 = 70.0;
/// Fewer moments are no note.
const FEWEST: usize = 5;
/// As many moments without pitch, or of another, do not end a note.
const GAP: usize = 3;
/// Window of the envelope in which the tongue is looked for, s: two periods of 100 Hz.
const ENVELOPE_S: f64 = 0.02;
/// Distance between its values, s.
const STEP_S: f64 = 0.001;
/// How far before and after a dip the level must be back, s: that of quick tonguing (by judgement).
const AROUND_S: f64 = 0.15;
/// What a note begins with is over after this time, s, and has less of its seeming fundamental than this, dB re the strongest harmonic. Of
/// chromatic scales over the whole compass, in which the attacks of some of the highest notes read as notes two octaves lower for 0.05 to 0.07 s,
/// these fundamentals lie 13 to 24 dB down (by judgement).
const ATTACK_S: f64 = 0.1;
/// See [`ATTACK_S`].
const NO_FUNDAMENTAL_DB: f64 = -10.0;
/// A dip below this share of the level on both sides is the tongue's: -8 dB, deeper than a vibrato's (by judgement).
const DIP: f64 = 0.4;
/// A note begins and ends at this share of its steady level, as in [`onset::attack_s`]; over noise, at twice the level beside it and at
/// most at half of its own.
const EDGE: f64 = 0.1;
/// What is softer than this share of a note's loudest moment is not held any more: -10 dB (by judgement).
const LOUD: f64 = 0.316;
/// How far from its first and last moment that may be, s: half a window of the track and a hop, and what a room adds at most (by
/// judgement).
const EDGE_S: (f64, f64) = (0.05, 0.1);
/// What is cut from both ends before a note is measured: this share of it, at most so much, s.
const MARGIN: (f64, f64) = (0.25, 0.1);
/// Later parts of a long note are not measured, s; that of the [recipe](super::steady_note) for recordings.
const LONGEST_S: f64 = 4.0;

/// A note of a recording. Of a note of more than four seconds, what is said of its steady part is of the first four.
#[derive(Clone, Debug, PartialEq)]
pub struct Note {
    /// Where it begins, s.
    pub start_s: f64,
    /// Where it ends, s.
    pub end_s: f64,
    /// Mean fundamental of the steady part, Hz; of fewer than ten periods, the median of the track.
    pub f0_hz: f64,
    /// Level of the steady part, dB re full scale 1.0 (a full-scale sine reads -3.01).
    pub level_dbfs: f64,
    /// Time from the beginning until 90 % of the steady level, s, as [`onset::t90_s`] has it; short in a slur.
    pub t90_s: f64,
    /// Power-weighted mean frequency of the steady part, noise included, Hz.
    pub centroid_hz: f64,
    /// Levels of harmonics 1..=12 (fewer if 0.45 of the rate comes first), dB re the strongest of them.
    pub levels_db: Vec<f64>,
}

/// The notes of a recording of one voice, in their order, and the track of pitch and level in which they were found, every
/// 10 ms. No notes at a rate that is not above 0. Allocates.
///
/// ```
/// use chalumeau_core::analysis::recording;
///
/// // A4 and, after 0.2 s of silence, C5.
/// let tone = |hz: f64, n: u32| (std::f64::consts::TAU * hz * f64::from(n) / 44_100.0).sin();
/// let a4 = (0..22_050).map(|n| tone(440.0, n));
/// let c5 = (0..22_050).map(|n| tone(523.25, n));
/// let samples: Vec<f64> = a4.chain((0..8_820).map(|_| 0.0)).chain(c5).collect();
/// let (notes, _) = recording::notes(&samples, 44_100.0);
/// assert_eq!(notes.len(), 2);
/// assert!((notes[1].f0_hz - 523.25).abs() < 0.01 && (notes[1].start_s - 0.7).abs() < 0.02);
/// ```
pub fn notes(samples: &[f64], rate_hz: f64) -> (Vec<Note>, Vec<TrackPoint>) {
    if !is_hz(rate_hz) {
        return (Vec::new(), Vec::new());
    }
    let samples = &without_mean(samples);
    let mut track = pitch_track(samples, rate_hz, HOP_S);
    drop_longer_periods(&mut track);
    let envelope = Envelope::new(samples, rate_hz);
    let loudest = track.iter().map(|point| point.rms).fold(0.0, f64::max);
    let floor = (SILENT * loudest).max(QUIET);
    let pitched = track.iter().enumerate().filter(|(_, point)| point.rms > floor);
    let pitched: Vec<_> = pitched.filter_map(|(at, point)| Some((at, point.hz?))).collect();
    let timed = |run: Run| Part { from_s: track[run.from].t_s, to_s: track[run.to].t_s, hz: run.hz };
    let parts = runs(&pitched).into_iter().map(timed);
    let parts = tongued(parts, &envelope);
    let mut notes: Vec<Note> = Vec::new();
    for (at, part) in parts.iter().enumerate() {
        let after_s = notes.last().map_or(0.0, |note| note.end_s);
        let next = parts.get(at + 1);
        let before_s = next.map_or(f64::INFINITY, |next| 0.5 * (part.to_s + next.from_s));
        let within = part.edges(samples, rate_hz, &envelope, (after_s, before_s));
        let found = measured(samples, rate_hz, within, part.hz);
        notes.extend(found.filter(|note| !next.is_some_and(|next| part.begins(next, note))));
    }
    (notes, track)
}

/// Moments of one pitch, by their places in the track.
#[derive(Clone, Copy, Debug)]
struct Run {
    from: usize,
    /// The last one.
    to: usize,
    hz: f64,
}

impl Run {
    /// The run of these moments; `None` for a glide.
    fn of(moments: &[(usize, f64)]) -> Option<Self> {
        let median = |moments: &[(usize, f64)]| upper_median(moments.iter().map(|(_, hz)| *hz));
        let run = Self { from: moments.first()?.0, to: moments.last()?.0, hz: median(moments)? };
        let third = moments.len().div_ceil(3);
        let (first, last) = (median(&moments[..third])?, median(&moments[moments.len() - third..])?);
        is_near(first, last).then_some(run)
    }

    fn moments(&self) -> usize {
        self.to - self.from + 1
    }

    /// Whether nothing long is between this run and a later one.
    fn touches(&self, next: &Self) -> bool {
        next.from - self.to <= GAP + 1
    }
}

/// Runs of one pitch that last.
fn runs(pitched: &[(usize, f64)]) -> Vec<Run> {
    let mut found: Vec<Run> = Vec::new();
    let mut close = |moments: &[(usize, f64)]| {
        let Some(run) = Run::of(moments) else { return };
        match found.last_mut() {
            // What lies between two runs of one note did not last.
            Some(before) if before.touches(&run) && is_near(run.hz, before.hz) => before.to = run.to,
            _ if run.moments() >= FEWEST => found.push(run),
            _ => {}
        }
    };
    let (mut first, mut mean) = (0, 0.0);
    for (now, &(at, hz)) in pitched.iter().enumerate() {
        let goes_on = now > first && at - pitched[now - 1].0 <= GAP + 1 && is_near(hz, mean);
        if !goes_on {
            close(&pitched[first..now]);
            (first, mean) = (now, hz);
        }
        mean += (hz - mean) / (now - first + 1) as f64;
    }
    close(&pitched[first..]);
    found
}

fn is_near(hz: f64, other_hz: f64) -> bool {
    cents(hz, other_hz).abs() <= APART_CENTS
}

/// Values that follow each other this fast, from the time 0 on.
struct Envelope {
    values: Vec<f64>,
    per_s: f64,
}

impl Envelope {
    fn new(samples: &[f64], rate_hz: f64) -> Self {
        let every = ((STEP_S * rate_hz) as usize).max(1);
        let values = moving_rms(samples, rate_hz, ENVELOPE_S).into_iter().step_by(every);
        Self { values: values.collect(), per_s: rate_hz / every as f64 }
    }

    fn between(&self, from_s: f64, to_s: f64) -> impl Iterator<Item = f64> + '_ {
        self.values[seen(self.values.len(), self.per_s, from_s, to_s)].iter().copied()
    }

    fn lowest(&self, from_s: f64, to_s: f64) -> f64 {
        self.between(from_s, to_s).fold(f64::INFINITY, f64::min)
    }

    fn highest(&self, from_s: f64, to_s: f64) -> f64 {
        self.between(from_s, to_s).fold(0.0, f64::max)
    }
}

/// Places of what lies between two times, s.
fn seen(len: usize, per_s: f64, from_s: f64, to_s: f64) -> Range<usize> {
    let at = |s: f64| ((s.max(0.0) * per_s).round() as usize).min(len);
    at(from_s)..at(to_s).max(at(from_s))
}

/// A sound of one pitch, from its first to its last moment.
#[derive(Clone, Copy, Debug)]
struct Part {
    from_s: f64,
    to_s: f64,
    hz: f64,
}

/// The parts, each divided where the tongue interrupts it.
fn tongued(parts: impl Iterator<Item = Part>, envelope: &Envelope) -> Vec<Part> {
    let least_s = FEWEST as f64 * HOP_S;
    let mut divided = Vec::new();
    for mut part in parts {
        let mut t_s = part.from_s + least_s;
        while t_s <= part.to_s - least_s {
            let dip = envelope.lowest(t_s - 0.5 * HOP_S, t_s + 0.5 * HOP_S);
            let before = envelope.highest((t_s - AROUND_S).max(part.from_s), t_s);
            let after = envelope.highest(t_s, (t_s + AROUND_S).min(part.to_s));
            if dip < DIP * before.min(after) && dip <= envelope.lowest(t_s - least_s, t_s + least_s) {
                divided.push(Part { to_s: t_s, ..part });
                part.from_s = t_s;
                t_s += least_s;
            } else {
                t_s += HOP_S;
            }
        }
        divided.push(part);
    }
    divided
}

impl Part {
    /// Whether this is no note, but how a higher one begins: partials that are in no harmonic ratio have a common period which nothing
    /// sounds, and which ends with the attack.
    fn begins(&self, next: &Self, measured: &Note) -> bool {
        let goes_on = next.from_s - self.to_s <= (GAP + 1) as f64 * HOP_S;
        let is_brief = self.to_s - self.from_s < ATTACK_S;
        let lacks_fundamental = measured.levels_db.first().is_some_and(|&db| db < NO_FUNDAMENTAL_DB);
        goes_on && is_brief && lacks_fundamental && cents(next.hz, self.hz) > 1_200.0 - APART_CENTS
    }

    /// Where the sound of this note begins and ends, s, between its neighbours: through windows of one period.
    fn edges(
        &self,
        samples: &[f64],
        rate_hz: f64,
        envelope: &Envelope,
        (after_s, before_s): (f64, f64),
    ) -> (f64, f64) {
        // Without what dies away: it may have a pitch for as long as the note.
        let loud = LOUD * envelope.highest(self.from_s, self.to_s);
        let held = envelope.between(self.from_s, self.to_s).filter(|level| *level >= loud);
        let steady = upper_median(held).unwrap_or(0.0);
        let (head_s, tail_s) = (self.from_s - EDGE_S.0, self.to_s + EDGE_S.1);
        // What is heard of the note itself on its first or last moment is no noise.
        let edge = |beside: f64| (EDGE * steady).max(2.0 * beside).min(0.5 * steady);
        let first = edge(envelope.lowest(head_s, self.from_s));
        let last = edge(envelope.lowest(self.to_s, tail_s));
        let level = |from_s: f64, to_s: f64| {
            let range = seen(samples.len(), rate_hz, from_s, to_s);
            (range.start, moving_rms(&samples[range], rate_hz, 1.0 / self.hz))
        };
        let (from, levels) = level(head_s.max(after_s), self.from_s + EDGE_S.0);
        let start = from + levels.iter().position(|level| *level >= first).unwrap_or(0);
        // What rings on may have a pitch long after the note has ended.
        let (from, levels) = level(self.from_s, tail_s.min(before_s.max(self.to_s)));
        let end = from + levels.iter().rposition(|level| *level >= last).map_or(levels.len(), |at| at + 1);
        (start as f64 / rate_hz, end.max(start) as f64 / rate_hz)
    }
}

/// The figures of a note between these times, s, about this pitch; `None` for what has no spectrum.
fn measured(samples: &[f64], rate_hz: f64, (start_s, end_s): (f64, f64), near_hz: f64) -> Option<Note> {
    let margin = (MARGIN.0 * (end_s - start_s)).min(MARGIN.1);
    let last_s = (end_s - margin).min(start_s + margin + LONGEST_S);
    let steady = &samples[seen(samples.len(), rate_hz, start_s + margin, last_s)];
    let f0_hz = refine_hz(steady, rate_hz, near_hz).unwrap_or(near_hz);
    let spoken = &samples[seen(samples.len(), rate_hz, start_s, last_s)];
    Some(Note {
        start_s,
        end_s,
        f0_hz,
        level_dbfs: rms_dbfs(steady),
        t90_s: onset::t90_s(spoken, rate_hz, 0.0)?,
        centroid_hz: centroid_hz(steady, rate_hz)?,
        levels_db: levels_of_harmonics_db(steady, rate_hz, f0_hz, HARMONICS),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::synthetic::{CLARINET_DB, glide, mix, noise, tone};

    const RATE_HZ: f64 = 48_000.0;

    fn rests(seconds: f64) -> Vec<f64> {
        vec![0.0; (seconds * RATE_HZ) as usize]
    }

    #[test]
    fn a_scale_over_noise_is_found_note_by_note() {
        let midi = [50, 52, 53, 57, 62, 69, 76, 81, 88];
        let hz = |midi: i32| 440.0 * 2f64.powf(f64::from(midi - 69) / 12.0);
        let mut samples = rests(0.3);
        for note in midi {
            samples.extend(tone(hz(note), RATE_HZ, 0.4, &CLARINET_DB));
        }
        samples.extend(rests(0.5));
        let samples = mix(&samples, &noise(1e-3, samples.len()));
        let (notes, track) = notes(&samples, RATE_HZ);
        assert_eq!(notes.len(), midi.len(), "{notes:#?}");
        for (at, (note, midi)) in notes.iter().zip(midi).enumerate() {
            let from_s = 0.3 + 0.4 * at as f64;
            assert!(cents(note.f0_hz, hz(midi)).abs() < 0.5, "{note:?}");
            assert!(
                (note.start_s - from_s).abs() < 0.04 && (note.end_s - from_s - 0.4).abs() < 0.04,
                "{note:?}"
            );
            for (heard, put_in) in note.levels_db.iter().zip(CLARINET_DB) {
                assert!((heard - put_in).abs() < 0.7, "{heard} for {put_in} of {midi}");
            }
        }
        assert!(track.len() > 300);
    }

    #[test]
    fn tongued_repetitions_are_notes_and_vibrato_is_one() {
        let repeated: Vec<f64> = tone(220.0, RATE_HZ, 1.6, &CLARINET_DB)
            .into_iter()
            .enumerate()
            .map(|(n, x)| x * if n as f64 / RATE_HZ % 0.2 < 0.03 { 0.05 } else { 1.0 })
            .collect();
        let (found, _) = notes(&repeated, RATE_HZ);
        assert_eq!(found.len(), 8, "{found:#?}");
        // 30 cents to both sides, five times a second.
        let deep = 220.0 * (2f64.powf(30.0 / 1_200.0) - 1.0);
        let turn = std::f64::consts::TAU * 5.0;
        let vibrato = glide(|t| 220.0 * t - deep / turn * (turn * t).cos(), RATE_HZ, 3.0, &CLARINET_DB);
        let (found, _) = notes(&vibrato, RATE_HZ);
        assert_eq!(found.len(), 1, "{found:#?}");
        assert!(cents(found[0].f0_hz, 220.0).abs() < 3.0, "{found:?}");
    }

    /// Two octaves below for 0.07 s, as the attacks of high notes sound, and as a grace note does.
    #[test]
    fn what_lacks_its_fundamental_is_the_beginning_of_the_next_note() {
        for (fundamental_db, count) in [(-15.0, 1), (0.0, 2)] {
            let mut samples = tone(311.0, RATE_HZ, 0.07, &[fundamental_db, -50.0, -17.0, 0.0]);
            samples.extend(tone(1_244.0, RATE_HZ, 0.4, &CLARINET_DB));
            let (found, _) = notes(&samples, RATE_HZ);
            assert_eq!(found.len(), count, "{fundamental_db} dB: {found:#?}");
            assert!(cents(found[count - 1].f0_hz, 1_244.0).abs() < 1.0);
        }
    }

    /// A touch of the period twice as long, as when the note before dies away.
    #[test]
    fn a_moment_an_octave_below_is_no_note_and_a_long_one_is() {
        for (seconds, count) in [(0.07, 2), (0.3, 3)] {
            let lower = tone(220.0, RATE_HZ, seconds, &CLARINET_DB);
            let both =
                [tone(392.0, RATE_HZ, 0.4, &CLARINET_DB), lower, tone(440.0, RATE_HZ, 0.4, &CLARINET_DB)];
            let (found, _) = notes(&both.concat(), RATE_HZ);
            assert_eq!(found.len(), count, "{found:#?}");
            assert!(
                (found[0].f0_hz - 392.0).abs() < 0.1 && (found[count - 1].f0_hz - 440.0).abs() < 0.3,
                "{found:#?}"
            );
        }
    }

    #[test]
    fn an_attack_takes_its_time_also_over_noise_and_an_offset() {
        for (hz, ramp_s, within_s) in [(440.0, 0.01, 0.001), (440.0, 0.3, 0.01), (147.0, 0.1, 0.004)] {
            for (offset, hiss) in [(0.0, 0.0), (0.005, 1e-4)] {
                let samples = tone(hz, RATE_HZ, 1.5, &CLARINET_DB).into_iter().enumerate();
                let at = |n: usize| n as f64 / RATE_HZ - 0.5;
                let samples = samples.map(|(n, x)| 0.1 * x * (at(n) / ramp_s).clamp(0.0, 1.0) + offset);
                let samples = mix(&samples.collect::<Vec<_>>(), &noise(hiss, 72_000));
                let (found, _) = notes(&samples, RATE_HZ);
                assert_eq!(found.len(), 1, "{found:#?}");
                // From 10 to 90 %.
                assert!((found[0].t90_s - 0.8 * ramp_s).abs() < within_s, "{hz} Hz, {ramp_s} s: {found:?}");
                assert!(
                    (found[0].start_s - 0.5 - 0.1 * ramp_s).abs() < within_s,
                    "{hz} Hz, {ramp_s} s: {found:?}"
                );
            }
        }
        // 19 dB under the note.
        let loud = mix(&[rests(0.5), tone(440.0, RATE_HZ, 1.0, &[-3.0])].concat(), &noise(0.056, 72_000));
        let (found, _) = notes(&loud, RATE_HZ);
        assert!(found.len() == 1 && (found[0].start_s - 0.5).abs() < 0.01, "{found:?}");
    }

    /// An octave in that time: what glides is no note, what is held before and after it is.
    #[test]
    fn a_glide_is_no_ladder() {
        for glide_s in [0.3, 0.5, 1.0, 2.0] {
            let sweep = |t: f64| glide_s / 2f64.ln() * 220.0 * (2f64.powf(t / glide_s) - 1.0);
            let cycles = move |t: f64| match t {
                ..0.5 => 220.0 * t,
                t if t < 0.5 + glide_s => 110.0 + sweep(t - 0.5),
                t => 110.0 + sweep(glide_s) + 440.0 * (t - 0.5 - glide_s),
            };
            let (found, _) = notes(&glide(cycles, RATE_HZ, glide_s + 1.0, &CLARINET_DB), RATE_HZ);
            assert_eq!(found.len(), 2, "{glide_s} s: {found:#?}");
        }
    }

    #[test]
    fn quick_notes_are_all_found() {
        for note_s in [0.08, 0.1] {
            for steps in [[0, 1, 2, 3, 4, 5, 6, 7, 8, 9], [0, 2, 0, 2, 0, 2, 0, 2, 0, 2]] {
                let hz = |step: i32| 220.0 * 2f64.powf(f64::from(step) / 12.0);
                let run: Vec<_> =
                    steps.iter().map(|&step| tone(hz(step), RATE_HZ, note_s, &CLARINET_DB)).collect();
                // Wherever it begins between two moments of the track.
                for begins in 0..4 {
                    let samples =
                        [rests(0.1 + 0.0023 * f64::from(begins)), run.concat(), rests(0.2)].concat();
                    let (found, _) = notes(&samples, RATE_HZ);
                    assert_eq!(found.len(), 10, "{note_s} s, {steps:?}: {found:#?}");
                }
            }
        }
    }

    #[test]
    fn what_is_no_note_is_none() {
        for samples in [
            Vec::new(),
            rests(1.0),
            noise(0.1, 48_000),
            vec![0.5; 48_000],
            vec![0.005; 48_000],
            vec![f64::NAN; 48_000],
        ] {
            assert_eq!(notes(&samples, RATE_HZ).0, []);
        }
        assert_eq!(notes(&tone(220.0, RATE_HZ, 1.0, &[0.0]), 0.0).0, []);
    }
}
