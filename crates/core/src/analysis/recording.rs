//! The notes of a recording: where each begins and ends, its pitch, level, attack and harmonics.
//!
//! For one voice at a time. A note ends where the sound does, where the pitch moves on, or where the level dips as the tongue
//! makes it. What two notes share (a glide, a click of the fingers) belongs to neither.

use crate::analysis::pitch::{TrackPoint, pitch_track, refine_hz};
use crate::analysis::spectrum::{HARMONICS, centroid_hz, levels_of_harmonics_db, moving_rms, rms_dbfs};
use crate::analysis::{is_hz, onset, upper_median};
use crate::units::cents;
use std::ops::Range;

/// Distance between moments looked at, s.
const HOP_S: f64 = 0.01;
/// What is softer than the loudest moment by more is no note: -45 dB, under most rooms' noise relative to a mezzo-forte.
const SILENT: f64 = 0.0056;
/// Less than full scale by more is no note in any file: -80 dB.
const QUIET: f64 = 1e-4;
/// A moment further from a note's mean is of another note, cents: more than a wide vibrato, less than a semitone.
const OTHER_CENTS: f64 = 70.0;
/// Shorter sounds are no notes, s.
const SHORTEST_S: f64 = 0.05;
/// Moments without pitch that a note survives, s.
const GAP_S: f64 = 0.03;
/// Window of the envelope in which the tongue is looked for, s: two periods of 100 Hz.
const ENVELOPE_S: f64 = 0.02;
/// How far before and after a dip the level must be back, s.
const AROUND_S: f64 = 0.15;
/// A dip below this share of the level on both sides is the tongue's: -8 dB.
const DIP: f64 = 0.4;
/// A note begins and ends at this share of its steady level.
const EDGE: f64 = 0.1;
/// How far from its first and last pitch that may be, s: half a window of the track and what a hall adds at most.
const EDGE_S: (f64, f64) = (0.06, 0.1);
/// In a shorter sound, an octave or a twelfth below its neighbour is that neighbour, whose period is also found twice and three
/// times as long while another note dies away, s: a window of the track and half as much.
const DOUBTFUL_S: f64 = 0.09;
/// What is cut from both ends before a note is measured: this share of it, at most so much, s.
const MARGIN: (f64, f64) = (0.25, 0.1);
/// Later parts of a long note are not measured, s; that of the [recipe](super::steady_note) for recordings.
const LONGEST_S: f64 = 4.0;

/// A note of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Note {
    /// Where it begins, s.
    pub start_s: f64,
    /// Where it ends, s.
    pub end_s: f64,
    /// Mean fundamental of the steady part, Hz.
    pub f0_hz: f64,
    /// Level of the steady part, dB re full scale 1.0 (a full-scale sine reads -3.01).
    pub level_dbfs: f64,
    /// Time from the beginning until 90 % of the steady level, s; short in a slur.
    pub attack_s: f64,
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
    let track = pitch_track(samples, rate_hz, HOP_S);
    let envelope = moving_rms(samples, rate_hz, ENVELOPE_S);
    let loudest = track.iter().map(|point| point.rms).fold(0.0, f64::max);
    let floor = (SILENT * loudest).max(QUIET);
    let pitched: Vec<_> =
        track.iter().filter_map(|point| Some((point.t_s, point.hz.filter(|_| point.rms > floor)?))).collect();
    let parts = tongued(without_longer_periods(parts(&pitched)), &envelope, rate_hz);
    let mut notes: Vec<Note> = Vec::new();
    for (at, part) in parts.iter().enumerate() {
        let after = notes.last().map_or(0.0, |note| note.end_s);
        let before = parts.get(at + 1).map_or(f64::INFINITY, |next| 0.5 * (part.to_s + next.from_s));
        let within = part.edges(&envelope, rate_hz, after, before);
        notes.extend(measured(samples, rate_hz, within, part.hz));
    }
    (notes, track)
}

/// Moments of one pitch.
#[derive(Clone, Copy, Debug)]
struct Part {
    from_s: f64,
    to_s: f64,
    hz: f64,
}

/// Runs of one pitch that last.
fn parts(pitched: &[(f64, f64)]) -> Vec<Part> {
    let mut found: Vec<Part> = Vec::new();
    let mut run: Vec<(f64, f64)> = Vec::new();
    let mut mean = 0.0;
    let close = |run: &mut Vec<(f64, f64)>, found: &mut Vec<Part>| {
        let (Some(first), Some(last)) = (run.first(), run.last()) else { return };
        let hz = upper_median(run.iter().map(|(_, hz)| *hz)).unwrap_or(first.1);
        let part = Part { from_s: first.0, to_s: last.0, hz };
        match found.last_mut() {
            // What lies between two parts of one note did not last.
            Some(before) if part.from_s - before.to_s <= GAP_S + HOP_S && is_near(part.hz, before.hz) => {
                before.to_s = part.to_s;
            }
            _ if part.to_s - part.from_s + HOP_S >= SHORTEST_S => found.push(part),
            _ => {}
        }
        run.clear();
    };
    for &(t_s, hz) in pitched {
        let goes_on = run.last().is_some_and(|(last_s, _)| t_s - last_s <= GAP_S + HOP_S);
        if !(goes_on && is_near(hz, mean)) {
            close(&mut run, &mut found);
            mean = hz;
        }
        run.push((t_s, hz));
        mean += (hz - mean) / run.len() as f64;
    }
    close(&mut run, &mut found);
    found
}

/// The parts without those that are a longer period of a neighbour.
fn without_longer_periods(mut parts: Vec<Part>) -> Vec<Part> {
    let mut at = 0;
    while let Some(&part) = parts.get(at) {
        let is_of = |hz: f64| [2.0, 3.0].iter().any(|times| is_near(times * part.hz, hz));
        let touches = |gap_s: f64| gap_s <= GAP_S + HOP_S;
        let doubtful = part.to_s - part.from_s + HOP_S < DOUBTFUL_S;
        let next = parts.get(at + 1).copied();
        let before = at.checked_sub(1).map(|at| parts[at]);
        if doubtful && next.is_some_and(|next| is_of(next.hz) && touches(next.from_s - part.to_s)) {
            parts[at + 1].from_s = part.from_s;
        } else if doubtful && before.is_some_and(|last| is_of(last.hz) && touches(part.from_s - last.to_s)) {
            parts[at - 1].to_s = part.to_s;
        } else {
            at += 1;
            continue;
        }
        parts.remove(at);
    }
    parts
}

fn is_near(hz: f64, other_hz: f64) -> bool {
    cents(hz, other_hz).abs() <= OTHER_CENTS
}

/// The parts, each divided where the tongue interrupts it.
fn tongued(parts: Vec<Part>, envelope: &[f64], rate_hz: f64) -> Vec<Part> {
    let mut divided = Vec::new();
    for mut part in parts {
        let mut t_s = part.from_s + SHORTEST_S;
        while t_s <= part.to_s - SHORTEST_S {
            let dip = lowest(envelope, rate_hz, t_s - 0.5 * HOP_S, t_s + 0.5 * HOP_S);
            let before = highest(envelope, rate_hz, (t_s - AROUND_S).max(part.from_s), t_s);
            let after = highest(envelope, rate_hz, t_s, (t_s + AROUND_S).min(part.to_s));
            let is_lowest = dip <= lowest(envelope, rate_hz, t_s - SHORTEST_S, t_s + SHORTEST_S);
            if is_lowest && dip < DIP * before.min(after) {
                divided.push(Part { to_s: t_s, ..part });
                part.from_s = t_s;
                t_s += SHORTEST_S;
            } else {
                t_s += HOP_S;
            }
        }
        divided.push(part);
    }
    divided
}

fn seen(len: usize, rate_hz: f64, from_s: f64, to_s: f64) -> Range<usize> {
    let at = |s: f64| ((s.max(0.0) * rate_hz).round() as usize).min(len);
    at(from_s)..at(to_s)
}

fn lowest(envelope: &[f64], rate_hz: f64, from_s: f64, to_s: f64) -> f64 {
    envelope[seen(envelope.len(), rate_hz, from_s, to_s)].iter().copied().fold(f64::INFINITY, f64::min)
}

fn highest(envelope: &[f64], rate_hz: f64, from_s: f64, to_s: f64) -> f64 {
    envelope[seen(envelope.len(), rate_hz, from_s, to_s)].iter().copied().fold(0.0, f64::max)
}

impl Part {
    /// Where the sound of this note begins and ends, s, between its neighbours.
    fn edges(&self, envelope: &[f64], rate_hz: f64, after_s: f64, before_s: f64) -> (f64, f64) {
        let inner = seen(envelope.len(), rate_hz, self.from_s, self.to_s);
        let steady = upper_median(envelope[inner].iter().copied()).unwrap_or(0.0);
        let loud = |value: &f64| *value >= EDGE * steady;
        let head = seen(envelope.len(), rate_hz, (self.from_s - EDGE_S.0).max(after_s), self.to_s);
        let tail =
            seen(envelope.len(), rate_hz, self.from_s, (self.to_s + EDGE_S.1).min(before_s.max(self.to_s)));
        let start = envelope[head.clone()].iter().position(loud).map_or(head.start, |n| head.start + n);
        let end = envelope[tail.clone()].iter().rposition(loud).map_or(tail.end, |n| tail.start + n + 1);
        (start as f64 / rate_hz, end as f64 / rate_hz)
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
        attack_s: onset::t90_s(spoken, rate_hz, 0.0)?,
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
    fn an_attack_takes_its_time() {
        let swell = tone(300.0, RATE_HZ, 1.5, &CLARINET_DB).into_iter().enumerate();
        let swell: Vec<f64> = swell.map(|(n, x)| x * (n as f64 / RATE_HZ / 0.3).min(1.0)).collect();
        let (found, _) = notes(&swell, RATE_HZ);
        assert_eq!(found.len(), 1);
        // From 10 to 90 %.
        assert!((found[0].attack_s - 0.24).abs() < 0.02, "{found:?}");
    }

    #[test]
    fn what_is_no_note_is_none() {
        for samples in [Vec::new(), rests(1.0), noise(0.1, 48_000), vec![0.5; 48_000], vec![f64::NAN; 48_000]]
        {
            assert_eq!(notes(&samples, RATE_HZ).0, []);
        }
        assert_eq!(notes(&tone(220.0, RATE_HZ, 1.0, &[0.0]), 0.0).0, []);
    }
}
