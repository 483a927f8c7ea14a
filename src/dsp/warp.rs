//! The converter's low-pass while the input's clock runs at another speed: the same filter in the host's time.
//!
//! At speed `s` the input is worth `s` times its rate. The window is stretched by `s` input samples per sample, so that
//! pass band, stop band and delay stay what they are at speed 1, seen from the host; it is never shorter than the input
//! itself needs, nor longer than the output needs. Stretched windows are tabulated in steps of 1.1, each at phases
//! close enough to mix two neighbours linearly (rms error -98 dB at the pass edge, 12 dB less per octave below it);
//! speeds between two steps take the shorter window, whose stop band begins up to 1.1 times higher.

use crate::dsp::kernel::{Kernel, LANES, dot, normalised};

/// Slowest and fastest clock: two octaves down and up.
pub const SPEEDS: (f64, f64) = (0.25, 4.0);
/// Phases of the window of speed 1; a stretched one is smoother and needs fewer.
const PHASES: usize = 128;
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
    rows: Box<[[f32; LANES]]>,
}

/// Windows for every speed, and the one in use.
#[derive(Clone, Debug)]
pub struct Warp {
    /// Shortest first.
    windows: Box<[Window]>,
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
        let mut lengths: Vec<usize> = (shortest..taps).step_by(LANES).collect();
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

    /// The output at `fraction` (parts of [`ONE`]) of an input sample after the input before `end`, at a speed no lower
    /// than the chosen one. Inputs from `end` on, of which there must be [`BEYOND`], count for nothing. Real-time safe.
    #[inline]
    pub fn output(&self, history: &[f32], end: usize, fraction: u64, speed: f64) -> f32 {
        let window = &self.windows[self.chosen];
        let delay = (self.delay * speed.max(self.least) * ONE as f64) as u64;
        let middle = ((end as u64 - 1) << 32) + fraction - delay;
        let begin = (middle >> 32) as usize + 1 - window.taps / 2;
        let heard = &history[begin..begin + window.taps];
        let position = (middle & (ONE - 1)) * window.phases;
        let (phase, mix) = ((position >> 32) as usize, (position & (ONE - 1)) as f32 / ONE as f32);
        let chunks = window.taps / LANES;
        let row = |phase: usize| &window.rows[phase * chunks..][..chunks];
        let (before, after) = (dot(heard, row(phase)), dot(heard, row(phase + 1)));
        before + mix * (after - before)
    }
}

impl Window {
    fn new(kernel: &Kernel, table: &[f64], taps: usize) -> Self {
        let stretch = taps as f64 / kernel.taps as f64;
        let phases = (PHASES as f64 / stretch).ceil() as usize;
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
        Self { taps, phases: phases as u64, rows: rows.as_chunks().0.into() }
    }
}
