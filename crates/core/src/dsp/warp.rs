//! The converter's low-pass while the input's clock runs at another speed: the same filter in the host's time.
//!
//! At speed `s` the input is worth `s` times its rate. The window is stretched by `s` input samples per sample, so that
//! pass band, stop band and delay stay what they are at speed 1, seen from the host; it is never shorter than the input
//! itself needs, nor longer than the output needs. Stretched windows are tabulated in steps of 1.1 (whole lanes of taps), each at phases
//! close enough to mix two neighbours linearly (rest -96 dB at the pass edge, 12 dB less per octave below it); speeds
//! between two steps take the shorter window, whose stop band begins up to 1.2 times higher: -92 dB from there on.

use std::sync::Arc;

use crate::dsp::lanes::LANES;
use crate::dsp::low_pass::{Kernel, TapRow, dot, normalised, tap_rows};

/// Slowest and fastest clock: two octaves down and up.
pub const SPEEDS: (f64, f64) = (0.25, 4.0);
/// Phases of the window of speed 1; a stretched one is smoother and needs fewer.
const PHASES: usize = 128;
/// A window of more taps than this at speed 1, for a host rate below 12 kHz, is smoother in proportion.
const SMOOTH_TAPS: f64 = 256.0;
/// Windows shorter than that of speed 1 differ by one lane, or by this part of their length.
const FINEST: usize = 16;
/// Points per input sample of the table all windows are read from.
const POINTS: f64 = 256.0;
/// Places behind the newest input that taps of nothing may lie on.
pub const BEYOND: usize = 4;
/// One input sample of a position.
pub const ONE: u64 = 1 << 32;

/// One stretched window.
#[derive(Clone, Debug)]
struct Window {
    taps: usize,
    phases: u64,
    /// `phases + 1` rows, oldest tap first.
    rows: Box<[TapRow]>,
}

/// Windows for every speed, and the one in use.
#[derive(Clone, Debug)]
pub struct Warp {
    /// Shortest first. Shared with clones.
    windows: Arc<[Window]>,
    chosen: usize,
    /// Taps at speed 1.
    taps: f64,
    /// Delay at speed 1, input samples.
    delay: f64,
    /// Speed over stretch above [`least`](Self::least).
    stretch: f64,
    /// Least stretch.
    least: f64,
}

impl Warp {
    /// Windows for the low-pass of speed 1, from `in_hz` to `out_hz`. Allocates.
    pub fn new(kernel: &Kernel, in_hz: f64, out_hz: f64) -> Self {
        let taps = kernel.taps;
        let stretch = (in_hz / out_hz).min(1.0);
        let shortest = (taps as f64 * (out_hz / in_hz).min(1.0)).ceil() as usize;
        let shortest = shortest.next_multiple_of(LANES);
        let longest = (taps as f64 * (SPEEDS.1 * stretch).max(1.0)).ceil() as usize;
        let mut lengths = Vec::new();
        let mut length = shortest;
        while length < taps {
            lengths.push(length);
            length += (length / FINEST).next_multiple_of(LANES).max(LANES);
        }
        let mut length = taps;
        while length < longest {
            lengths.push(length);
            length = (length * 11 / 10).next_multiple_of(LANES);
        }
        lengths.push(longest.next_multiple_of(LANES));
        // The right half of the low-pass, and a point beyond for the interpolation.
        let table: Vec<f64> = (0..=(kernel.half * POINTS).ceil() as usize + 1)
            .map(|point| kernel.at((point as f64 / POINTS).min(kernel.half)))
            .collect();
        let windows = lengths.into_iter().map(|length| Window::new(kernel, &table, length)).collect();
        let least = shortest as f64 / taps as f64;
        let mut warp = Self { windows, chosen: 0, taps: taps as f64, delay: kernel.half, stretch, least };
        warp.choose(1.0);
        warp
    }

    /// Most input samples before the newest that an output can hear, and a sample more.
    pub fn reach(&self) -> usize {
        let longest = self.windows.iter().map(|window| window.taps).max().unwrap_or(0);
        (self.delay * SPEEDS.1).ceil() as usize + longest / 2 + 2
    }

    /// Takes the longest window that fits at this speed and all above it. Real-time safe.
    pub fn choose(&mut self, speed: f64) {
        let most = (self.taps * (speed * self.stretch).max(self.least) * (1.0 + 1e-9)) as usize;
        self.chosen = self.windows.iter().rposition(|window| window.taps <= most).unwrap_or(0);
    }

    /// Takes the window that another one between the same rates has. Real-time safe.
    pub fn follow(&mut self, other: &Self) {
        self.chosen = other.chosen;
    }

    /// The output at `fraction` (parts of [`ONE`]) of an input sample after the input before `end`, at a speed no lower
    /// than the chosen one. Inputs from `end` on, of which there must be [`BEYOND`], count for nothing. Real-time safe.
    #[inline(always)]
    pub fn output(&self, history: &[f32], end: usize, fraction: u64, speed: f64) -> f32 {
        let window = &self.windows[self.chosen];
        let delay = (self.delay * speed.max(self.least) * ONE as f64) as u64;
        let middle = ((end as u64 - 1) << 32) + fraction - delay;
        let begin = (middle >> 32) as usize + 1 - window.taps / 2;
        let heard = &history[begin..begin + window.taps];
        let position = (middle & (ONE - 1)) * window.phases;
        let (phase, mix) = ((position >> 32) as usize, (position & (ONE - 1)) as f32 / ONE as f32);
        let chunks = window.taps / LANES;
        let (before, after) = window.rows[phase * chunks..][..2 * chunks].split_at(chunks);
        let (before, after) = (dot(heard, before), dot(heard, after));
        before + mix * (after - before)
    }
}

impl Window {
    fn new(kernel: &Kernel, table: &[f64], taps: usize) -> Self {
        let stretch = taps as f64 / kernel.taps as f64;
        let smoother = (kernel.taps as f64 / SMOOTH_TAPS).max(1.0);
        let phases = (PHASES as f64 / (stretch * smoother)).ceil() as usize;
        // Nothing is heard in the last phase's width and a bit: taps on inputs that have not come are 0 in both rows.
        let silent = kernel.half - 1.5 / (phases as f64 * stretch);
        let height = |t: f64| {
            let t = t.abs() / stretch;
            if t >= silent {
                return 0.0;
            }
            let (point, way) = ((t * POINTS) as usize, (t * POINTS).fract());
            table[point] + way * (table[point + 1] - table[point])
        };
        let mut rows = Vec::with_capacity((phases + 1) * taps);
        let mut row = vec![0.0; taps];
        for phase in 0..=phases {
            let first = 1.0 - taps as f64 / 2.0 - phase as f64 / phases as f64;
            row.iter_mut().enumerate().for_each(|(tap, value)| *value = height(first + tap as f64));
            rows.extend(normalised(&row));
        }
        Self { taps, phases: phases as u64, rows: tap_rows(&rows).collect() }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use crate::dsp::resampler::Resampler;

    /// Rates of an instrument and its hosts.
    const PAIRS: [(f64, f64); 5] =
        [(96e3, 48e3), (88.2e3, 44.1e3), (96e3, 96e3), (96e3, 192e3), (88.2e3, 22.05e3)];
    const SPEEDS: [f64; 9] = [0.25, 0.5, 0.8, 0.944, 1.059, 1.33, 1.9, 2.0, 4.0];

    /// What the clock at `speed` makes of `input`: `len` outputs, pulled 37 at a time.
    fn warped(pair: (f64, f64), speed: f64, input: impl Fn(usize) -> f32, len: usize) -> Vec<f32> {
        warped_by(Resampler::new(pair.0, pair.1), speed, input, len)
    }

    fn warped_by(mut resampler: Resampler, speed: f64, input: impl Fn(usize) -> f32, len: usize) -> Vec<f32> {
        let (mut out, mut at) = (vec![0.0; len], 0);
        for part in out.chunks_mut(37) {
            let mut made = resampler.pull(part);
            while made < part.len() {
                let inputs: [f32; 16] = std::array::from_fn(|n| input(at + n));
                at += 16;
                resampler.push(&inputs, speed);
                made += resampler.pull(&mut part[made..]);
            }
        }
        out
    }

    fn sine(hz: f64, rate_hz: f64) -> impl Fn(usize) -> f32 {
        move |n| (TAU * hz * n as f64 / rate_hz).sin() as f32
    }

    /// Gain of the best sine at `hz` and rms of the rest over it, dB.
    fn heard(sound: &[f32], hz: f64, rate_hz: f64) -> (f64, f64) {
        let (mut ss, mut cc, mut sc, mut ys, mut yc) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let angle = |n: usize| TAU * hz * n as f64 / rate_hz;
        for (n, &y) in sound.iter().enumerate() {
            let ((s, c), y) = (angle(n).sin_cos(), f64::from(y));
            (ss, cc, sc, ys, yc) = (ss + s * s, cc + c * c, sc + s * c, ys + y * s, yc + y * c);
        }
        let det = ss * cc - sc * sc;
        let (a, b) = ((ys * cc - yc * sc) / det, (yc * ss - ys * sc) / det);
        let rest: f64 = sound
            .iter()
            .enumerate()
            .map(|(n, &y)| (f64::from(y) - a * angle(n).sin() - b * angle(n).cos()).powi(2))
            .sum();
        let rest_db = 10.0 * (2.0 * rest / sound.len() as f64 / (a * a + b * b)).log10();
        (20.0 * a.hypot(b).log10(), rest_db)
    }

    #[test]
    fn what_is_heard_is_the_input_faster_or_slower_and_nothing_else() {
        for pair in PAIRS {
            let (mut ripple, mut rest) = (0.0_f64, f64::MIN);
            for speed in SPEEDS {
                // Up to the pass edge of the lower rate, as the host hears it, less what whole lanes of taps cost.
                let pass_hz = 5.0 / 12.0 * pair.1.min(0.88 * pair.0 * speed);
                for hz in [300.0, 2_000.0, 0.5 * pass_hz, 0.98 * pass_hz] {
                    let out = warped(pair, speed, sine(hz / speed, pair.0), 9_000);
                    let (gain_db, rest_db) = heard(&out[1_500..], hz, pair.1);
                    ripple = ripple.max(gain_db.abs());
                    rest = rest.max(rest_db);
                    assert!(gain_db.abs() < 2e-3, "{pair:?} at {speed}: {hz} Hz {gain_db} dB");
                    assert!(rest_db < -92.0, "{pair:?} at {speed}: {hz} Hz, rest {rest_db} dB");
                }
            }
            println!("{pair:?}: ripple {ripple:.4} dB, rest {rest:.1} dB");
        }
    }

    #[test]
    fn with_and_without_avx2_the_bits_are_the_same() {
        for pair in PAIRS {
            for speed in SPEEDS {
                let resampler = Resampler::new(pair.0, pair.1);
                let input = sine(700.0, pair.0);
                let fast = warped_by(resampler.clone(), speed, &input, 2_000);
                let plain = warped_by(resampler.without_avx2(), speed, &input, 2_000);
                assert!(fast.iter().any(|y| y.abs() > 0.5));
                assert!(
                    fast.iter().zip(&plain).all(|(a, b)| a.to_bits() == b.to_bits()),
                    "{pair:?} at {speed}"
                );
            }
        }
    }

    /// From 1.2 times the stop edge on, for what a step between two windows costs.
    #[test]
    fn what_the_host_cannot_hear_does_not_fold_into_what_it_can() {
        for pair in PAIRS {
            let mut worst = f64::MIN;
            for speed in SPEEDS {
                let (stop_hz, top_hz) = (1.2 * 7.0 / 12.0 * pair.1, 0.499 * pair.0 * speed);
                for step in 0..12 {
                    let hz = stop_hz + (top_hz - stop_hz) * f64::from(step) / 11.0;
                    if stop_hz < top_hz {
                        let out = warped(pair, speed, sine(hz / speed, pair.0), 4_000);
                        let power: f64 = out[1_000..].iter().map(|&y| f64::from(y).powi(2)).sum();
                        worst = worst.max(10.0 * (2.0 * power / 3_000.0).log10());
                    }
                }
            }
            println!("{pair:?}: at most {worst:.1} dB");
            assert!(worst < -88.0, "{pair:?}: {worst} dB");
        }
    }

    #[test]
    fn delay_stays_while_the_hosts_rate_is_the_lower() {
        for pair in PAIRS {
            let stated = Resampler::new(pair.0, pair.1).latency_out_samples();
            for speed in SPEEDS {
                // A slow sine's phase; the instrument's time runs at the speed from the first sample on.
                let hz = 50.0;
                let out = warped(pair, speed, sine(hz / speed, pair.0), 30_000);
                let (mut s, mut c) = (0.0, 0.0);
                let period = pair.1 / hz;
                let whole = (20_000.0 / period).floor() * period;
                for (n, &y) in out[8_000..8_000 + whole.round() as usize].iter().enumerate() {
                    let (sin, cos) = (TAU * (n + 8_000) as f64 / period).sin_cos();
                    (s, c) = (s + f64::from(y) * sin, c + f64::from(y) * cos);
                }
                // The first 16 inputs took the way from speed 1.
                let begun = 16.0 * pair.1 / pair.0 * (speed.ln() / (speed - 1.0) - 1.0 / speed);
                let delay = -c.atan2(s) / TAU * period - begun;
                if speed >= (1.2 * pair.1 / pair.0).min(1.0) {
                    assert!((delay - stated).abs() < 1.5, "{pair:?} at {speed}: {delay}, stated {stated}");
                } else {
                    assert!(delay < 1.5 + stated / speed, "{pair:?} at {speed}: {delay}");
                }
            }
        }
    }

    #[test]
    fn back_at_speed_one_the_clock_finds_its_grid_and_nothing_is_heard_of_it() {
        for pair in PAIRS {
            let mut resampler = Resampler::new(pair.0, pair.1);
            let (mut out, mut phase) = (vec![0.0; pair.1 as usize / 2], 0.0);
            let mut made = 0;
            for tick in 0.. {
                made += resampler.pull(&mut out[made..]);
                if made == out.len() {
                    break;
                }
                // Up and down again in 8 ms each.
                let way = f64::from(50 - i32::abs(tick - 150)).max(0.0) / 50.0;
                let speed = 1.0 + 0.3 * way;
                let inputs: [f32; 16] = std::array::from_fn(|_| {
                    phase += TAU * 500.0 / pair.0;
                    f64::sin(phase) as f32
                });
                resampler.push(&inputs, speed);
            }
            // The end of it is the plain converter's: a sine at the input's pitch, without even the drift's.
            let tail = &out[out.len() * 3 / 4..];
            let (gain_db, rest_db) = heard(tail, 500.0, pair.1);
            println!("{pair:?}: gain {gain_db:.5}, rest {rest_db:.1} dB");
            assert!(rest_db < -105.0 && gain_db.abs() < 1e-3);
            // No sample of the whole is further from its neighbours' middle than 500 Hz at 1.3 times the speed has it.
            let bound = 1.1 * (TAU * 650.0 / pair.1).powi(2);
            let from = resampler.latency_out_samples() as usize * 4 + 50;
            for (at, three) in out[from..].windows(3).enumerate() {
                let bent = f64::from(three[0] - 2.0 * three[1] + three[2]).abs();
                // Where one window follows another the gain moves by 3e-5.
                assert!(bent < bound + 1e-4, "{pair:?}, sample {}: {bent}, at most {bound}", at + from);
            }
        }
    }
}
