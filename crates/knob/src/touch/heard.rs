//! What was heard beside a take: level, pitch and onsets of the sound, on the clock of the take.
//!
//! The sound comes in blocks, each with the time at which its first sample was computed. A moment every 5 ms has the level of
//! the 10 ms about it and the pitch of the 60 ms about it ([`pitch_track`]). An onset is where the level rises above
//! [`HEARD_DB`] and stays there, or where it rises again by [`ATTACK_DB`] while a note sounds; slurred notes have none.
//! Times are microseconds. It allocates, and costs about a fiftieth of a core: not for the audio thread.

use chalumeau_core::analysis::pitch::{WINDOW_S, pitch_track};
use std::collections::VecDeque;

/// Level from which a sound counts as a note, dB (rms over full scale): 7 dB above the breath noise of the standard clarinet
/// just below its threshold (-52 dB), 14 dB below its softest steady notes (-31 dB).
pub const HEARD_DB: f64 = -45.0;
/// Rise of the level within 0.1 s that is a new attack, dB. Tongued notes fall and rise by 15 dB and more (by judgement).
pub const ATTACK_DB: f64 = 10.0;
/// Time over which the lowest level counts as what was before, s.
const FLOOR_S: f64 = 0.1;
/// A sound that falls below the level sooner is the knock of a reed that does not speak, s.
const STAYS_S: f64 = 0.08;
/// Time between two moments, s.
const MOMENT_S: f64 = 0.005;
/// Window of the level, s: more than one period of the lowest note.
const LEVEL_S: f64 = 0.01;
/// Sound is analysed in pieces of this length, s.
const PIECE_S: f64 = 0.05;
/// Silence, dB.
const SILENCE_DB: f64 = -120.0;
/// A block whose time is further from the end of the one before means that sound is missing, us.
const GAP_US: f64 = 20_000.0;
/// Moments kept: two seconds.
const KEPT: usize = 400;
const FLOOR: usize = (FLOOR_S / MOMENT_S) as usize;
const STAYS: usize = (STAYS_S / MOMENT_S) as usize;

/// What was heard at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Heard {
    /// Level, dB (rms over full scale).
    pub level_db: Option<f64>,
    /// Pitch, Hz; `None` where there is none.
    pub f0_hz: Option<f64>,
    /// When the latest onset was heard, us.
    pub onset_us: Option<u64>,
}

/// One moment of the sound.
#[derive(Clone, Copy, Debug)]
struct Moment {
    t_us: f64,
    level_db: f64,
    f0_hz: Option<f64>,
}

/// Follows a sound and remembers its last two seconds.
#[derive(Clone, Debug, Default)]
pub struct HeardTrack {
    rate_hz: f64,
    /// Sound that is not analysed yet, and the time of its first sample.
    sound: Vec<f64>,
    begins_us: f64,
    moments: VecDeque<Moment>,
    /// Moments since the sound began that have been searched for onsets, and whether a note sounds there.
    searched: usize,
    is_heard: bool,
    onsets_us: VecDeque<u64>,
}

impl HeardTrack {
    /// Takes the next block; `begins_us` is the time of its first sample.
    pub fn hear(&mut self, begins_us: i64, rate_hz: f64, block: &[f32]) {
        let length_us = |samples: usize| samples as f64 / rate_hz * 1e6;
        let expected_us = self.begins_us + length_us(self.sound.len());
        if rate_hz != self.rate_hz || (begins_us as f64 - expected_us).abs() > GAP_US {
            *self = Self { rate_hz, onsets_us: std::mem::take(&mut self.onsets_us), ..Self::default() };
        }
        self.begins_us = begins_us as f64 - length_us(self.sound.len());
        self.sound.extend(block.iter().map(|&x| if x.is_finite() { f64::from(x) } else { 0.0 }));
        while self.sound.len() > self.samples(PIECE_S + WINDOW_S) {
            self.analyse();
        }
    }

    /// Everything up to this time is known, us; `None` before the first moment.
    pub fn known_until_us(&self) -> Option<u64> {
        let last = self.moments.len().checked_sub(STAYS + 1)?;
        Some(self.moments[last].t_us.max(0.0) as u64)
    }

    /// What was heard at a time, us.
    pub fn at(&self, t_us: u64) -> Heard {
        let onset_us = self.onsets_us.iter().rev().find(|&&onset_us| onset_us <= t_us).copied();
        let next = self.moments.partition_point(|moment| moment.t_us < t_us as f64);
        let near =
            |at: usize| self.moments.get(at).filter(|near| (near.t_us - t_us as f64).abs() < 1e6 * LEVEL_S);
        let nearest = [next.checked_sub(1).and_then(near), near(next)]
            .into_iter()
            .flatten()
            .min_by(|a, b| (a.t_us - t_us as f64).abs().total_cmp(&(b.t_us - t_us as f64).abs()));
        Heard {
            level_db: nearest.map(|moment| moment.level_db),
            f0_hz: nearest.and_then(|moment| moment.f0_hz),
            onset_us,
        }
    }

    fn samples(&self, seconds: f64) -> usize {
        (seconds * self.rate_hz).round() as usize
    }

    /// Analyses one piece of the sound and drops it.
    fn analyse(&mut self) {
        let (piece, half) = (self.samples(PIECE_S), self.samples(0.5 * WINDOW_S));
        let level_half = self.samples(0.5 * LEVEL_S);
        // A pitch for every second moment; its neighbour has the same.
        let pitches = pitch_track(&self.sound, self.rate_hz, 2.0 * MOMENT_S);
        for n in 0..(PIECE_S / MOMENT_S).round() as usize {
            let at = half + self.samples(MOMENT_S * n as f64);
            let near = &self.sound[at - level_half..at + level_half];
            let square = near.iter().map(|x| x * x).sum::<f64>() / near.len() as f64;
            self.moments.push_back(Moment {
                t_us: self.begins_us + at as f64 / self.rate_hz * 1e6,
                level_db: (10.0 * square.max(1e-300).log10()).max(SILENCE_DB),
                f0_hz: pitches.get(n / 2).and_then(|point| point.hz),
            });
        }
        self.sound.drain(..piece);
        self.begins_us += piece as f64 / self.rate_hz * 1e6;
        self.find_onsets();
        let surplus = self.moments.len().saturating_sub(KEPT);
        self.moments.drain(..surplus);
        self.searched -= surplus;
    }

    /// Looks for onsets in the moments of which it is known whether they last.
    fn find_onsets(&mut self) {
        while self.searched + STAYS < self.moments.len() {
            let (at, level_db) = (self.searched, |n: usize| self.moments[n].level_db);
            let floor_db =
                (at.saturating_sub(FLOOR)..at).map(level_db).fold(f64::INFINITY, f64::min).min(level_db(at));
            let stays = (at..=at + STAYS).all(|n| level_db(n) >= HEARD_DB);
            let is_attack = level_db(at) >= floor_db + ATTACK_DB;
            let now_us = self.moments[at].t_us.max(0.0) as u64;
            let is_new = self.onsets_us.back().is_none_or(|last| now_us > last + (1e6 * FLOOR_S) as u64);
            if stays && is_new && (!self.is_heard || is_attack) {
                self.onsets_us.push_back(now_us);
                if self.onsets_us.len() > KEPT {
                    self.onsets_us.pop_front();
                }
            }
            self.is_heard = stays || (self.is_heard && level_db(at) >= HEARD_DB);
            self.searched += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 48_000.0;

    /// A track that has heard a sound which began at `begins_us`, in blocks of so many samples.
    fn track(begins_us: i64, block: usize, sound: &[f32]) -> HeardTrack {
        let mut track = HeardTrack::default();
        for (n, part) in sound.chunks(block).enumerate() {
            track.hear(begins_us + (1e6 * (n * block) as f64 / RATE_HZ) as i64, RATE_HZ, part);
        }
        track
    }

    /// Harmonics 1 and 3 at an amplitude that depends on time, over a soft noise.
    fn tone(hz: f64, seconds: f64, amplitude: impl Fn(f64) -> f64) -> Vec<f32> {
        let mut rng = 1_u32;
        (0..(seconds * RATE_HZ) as usize)
            .map(|n| {
                rng = rng.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let noise = 2e-3 * (f64::from(rng >> 8) / f64::from(1 << 24) - 0.5);
                let t = n as f64 / RATE_HZ;
                let turn = std::f64::consts::TAU * hz * t;
                (noise + amplitude(t) * (turn.sin() + 0.4 * (3.0 * turn).sin())) as f32
            })
            .collect()
    }

    #[test]
    fn level_and_pitch_are_the_sounds_on_its_clock() {
        let sound = tone(147.0, 1.5, |t| if t < 0.5 { 0.0 } else { 0.1 });
        let heard = track(10_000_000, 512, &sound);
        let before = heard.at(10_300_000);
        assert!(before.level_db.unwrap() < -55.0 && before.onset_us.is_none(), "{before:?}");
        let steady = heard.at(11_000_000);
        let rms_db = 20.0 * (0.1 * (0.5_f64 * 1.16).sqrt()).log10();
        assert!((steady.level_db.unwrap() - rms_db).abs() < 0.6, "{steady:?}, not {rms_db}");
        assert!((steady.f0_hz.unwrap() / 147.0 - 1.0).abs() < 0.003, "{steady:?}");
        let onset_us = steady.onset_us.unwrap();
        assert!(onset_us.abs_diff(10_500_000) < 6_000, "{onset_us}");
        assert!(heard.known_until_us().unwrap() > 11_200_000, "{:?}", heard.known_until_us());
        assert_eq!(heard.at(20_000_000).level_db, None, "nothing is known of the future");
    }

    #[test]
    fn blocks_make_no_difference() {
        let sound = tone(440.0, 1.0, |t| 0.05 * t);
        let whole = track(0, 48_000, &sound);
        for block in [64, 1_000, 4_096] {
            let parts = track(0, block, &sound);
            for t_us in (200_000..800_000).step_by(50_000) {
                let (a, b) = (whole.at(t_us), parts.at(t_us));
                assert!((a.level_db.unwrap() - b.level_db.unwrap()).abs() < 0.1, "{t_us}: {a:?} {b:?}");
                let apart_us = a.onset_us.unwrap().abs_diff(b.onset_us.unwrap());
                assert!(apart_us < 10, "{t_us}: {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn a_knock_is_no_onset_and_a_tongued_note_is_one() {
        // A knock at 0.3 s, a note at 0.6 s, tongued again at 1.0 s, a slur at 1.4 s (nothing falls), the end at 1.8 s.
        let amplitude = |t: f64| match t {
            t if t < 0.3 => 0.0,
            t if t < 0.6 => 0.05 * (-(t - 0.3) / 0.02).exp(),
            t if (0.97..1.0).contains(&t) => 0.004,
            t if t < 1.4 => 0.1,
            t if t < 1.8 => 0.12,
            _ => 0.0,
        };
        let heard = track(0, 256, &tone(233.0, 2.2, amplitude));
        let onsets: Vec<f64> = heard.onsets_us.iter().map(|&us| 1e-6 * us as f64).collect();
        assert_eq!(onsets.len(), 2, "{onsets:?}");
        assert!((onsets[0] - 0.6).abs() < 0.01 && (onsets[1] - 1.0).abs() < 0.015, "{onsets:?}");
    }

    #[test]
    fn a_slow_crescendo_is_heard_once() {
        let heard = track(0, 512, &tone(200.0, 3.0, |t| 0.02 * (t / 3.0).powi(2)));
        assert_eq!(heard.onsets_us.len(), 1);
        let level_db = heard.at(heard.onsets_us[0]).level_db.unwrap();
        assert!((HEARD_DB..HEARD_DB + 1.0).contains(&level_db), "{level_db}");
    }

    #[test]
    fn missing_sound_begins_anew() {
        let sound = tone(300.0, 0.5, |_| 0.1);
        let mut heard = track(0, 512, &sound);
        for (n, part) in sound.chunks(512).enumerate() {
            heard.hear(2_000_000 + (1e6 * (n * 512) as f64 / RATE_HZ) as i64, RATE_HZ, part);
        }
        assert_eq!(heard.at(1_000_000).level_db, None);
        assert!(heard.at(2_200_000).level_db.is_some());
    }
}
