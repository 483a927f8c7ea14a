//! The room at one sample rate: delays, gains and filters. Made while playing, without allocating.

use crate::maths;
use std::f64::consts::TAU;

use super::Room;
use super::shoebox::{IMAGES, Image, Shoebox};

/// Lines of the feedback delay network. Sixteen of the lengths below have more than 0.2 s together, that is one resonance in
/// 5 Hz; Jot & Chaigne (1991) ask for 0.15 resonances per hertz and second of decay. In a small room with a long decay they are fewer: at 3 m from 1.4 s on.
pub const LINES: usize = 16;
/// Lengths of the lines over their unit: spread evenly in logarithm over a factor of three, so that echoes do not meet.
/// `3^((i - 7.5) / 15)`.
const LENGTHS: [f64; LINES] = [
    0.577, 0.621, 0.668, 0.719, 0.774, 0.833, 0.896, 0.964, 1.037, 1.116, 1.201, 1.292, 1.390, 1.496, 1.610,
    1.732,
];
/// The unit of the lengths is the mean free time, but not longer or shorter, s: in a smaller room shorter lines would ring,
/// in a larger one the tail would be grainy.
const UNIT_S: [f64; 2] = [0.012, 0.03];
/// And at most this part of the decay, so that the tail decays in many small steps.
const UNIT_OF_DECAY: f64 = 0.1;
/// The frequency of *tone*, Hz.
const BRIGHT_HZ: f64 = 5_000.0;
/// Longest delay of an image, s: one of order 2 along a room of 40 m is 90 m away, 79 m farther than the player.
pub const LONGEST_EARLY_S: f64 = 0.24;

/// A low-pass of first order: `y = pole y + gain x`.
#[derive(Clone, Copy, Debug, Default)]
pub struct OnePole {
    pub gain: f32,
    pub pole: f32,
}

impl OnePole {
    /// With these amplitudes at 0 and at `w` rad per sample; `high` is at most `low`.
    fn new(low: f64, high: f64, w: f64) -> Self {
        let q = (high / low).powi(2);
        if q > 1.0 - 1e-9 {
            return Self { gain: low as f32, pole: 0.0 };
        }
        // (1 - p)^2 = q (1 - 2 p cos w + p^2)
        let m = (1.0 - q * maths::cos(w)) / (1.0 - q);
        let pole = m - (m * m - 1.0).sqrt();
        Self { gain: (low * (1.0 - pole)) as f32, pole: pole as f32 }
    }
}

/// One image, as one ear hears it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tap {
    pub delay: usize,
    pub gain: f32,
}

/// A room at one sample rate.
#[derive(Clone, Copy, Debug)]
pub struct RoomCoeffs {
    /// Images for the left and the right ear.
    pub early: [[Tap; IMAGES]; 2],
    /// The same of who sits at the left and the right end of several players.
    pub ends: [[[Tap; IMAGES]; 2]; 2],
    /// Pole of what a wall takes away from high tones, a low-pass that leaves the low ones.
    pub wall_pole: f32,
    /// Samples after which the sound enters the lines.
    pub into_lines: usize,
    pub delays: [usize; LINES],
    /// What is lost in the time of each line.
    pub losses: [OnePole; LINES],
    /// Factor of the sound out of the lines.
    pub late: f32,
    /// Samples that it takes until everything in the delays has been heard once.
    pub reach: usize,
}

impl RoomCoeffs {
    /// Of clamped settings. Real-time safe.
    pub fn new(room: &Room, rate_hz: f64) -> Self {
        let decay_s = f64::from(room.decay_s);
        let bright_s = decay_s * 0.25 * maths::pow(4.0, f64::from(room.tone));
        let w = TAU * BRIGHT_HZ.min(0.4 * rate_hz) / rate_hz;
        let box_ = Shoebox::new(room);

        let unit_s = box_.mean_free_s().clamp(UNIT_S[0], UNIT_S[1]).min(UNIT_OF_DECAY * decay_s);
        let mut delays = [0; LINES];
        let mut above = 1;
        for (delay, length) in delays.iter_mut().zip(LENGTHS) {
            *delay = next_prime(((length * unit_s * rate_hz) as usize).max(above));
            above = *delay + 1;
        }
        let after = |delay: usize, decay_s: f64| maths::pow(10.0, -3.0 * delay as f64 / (rate_hz * decay_s));
        let losses = delays.map(|delay| OnePole::new(after(delay, decay_s), after(delay, bright_s), w));

        let images = [box_.images(-1.0), box_.images(1.0)];
        let early: f64 = images.iter().flatten().map(|image| 0.5 * image.gain.powi(2)).sum();
        let all = box_.reverberant_energy();
        // In a dead room the early reflections alone may be more than a diffuse field: a tail remains.
        let late = (all - early).max(0.1 * all);
        let fit = (all / (early + late)).sqrt();
        // Each pass through the lines leaves this share of the energy; all passes together are heard.
        let kept = delays.iter().map(|&delay| after(delay, decay_s).powi(2)).sum::<f64>() / LINES as f64;
        let out = (late * (1.0 - kept) / kept).sqrt();

        let samples = |delay_s: f64| (delay_s * rate_hz).round() as usize;
        let tap = |image: Image| Tap { delay: samples(image.delay_s), gain: (fit * image.gain) as f32 };
        // The lines take over where the images end: half of these are past.
        let mut times = images[0].map(|image| image.delay_s);
        times.sort_unstable_by(f64::total_cmp);
        let early = images.map(|ear| ear.map(tap));
        let ends = [-1.0, 1.0].map(|end| [-1.0, 1.0].map(|side| box_.images_of_end(end, side).map(tap)));
        let into_lines = samples(times[IMAGES / 2]).saturating_sub(delays[0]);
        let all_taps = early.iter().flatten().chain(ends.iter().flatten().flatten());
        let longest = all_taps.map(|tap| tap.delay).fold(into_lines, usize::max);
        Self {
            early,
            ends,
            wall_pole: OnePole::new(1.0, box_.reflection(bright_s) / box_.reflection(decay_s), w).pole,
            into_lines,
            delays,
            losses,
            late: (fit * out) as f32,
            reach: longest + delays[LINES - 1],
        }
    }

    /// Longest delay of a line at a rate, samples.
    pub fn longest_line(rate_hz: f64) -> usize {
        // Room for the next primes, which are nearer than this at all rates.
        (LENGTHS[LINES - 1] * UNIT_S[1] * rate_hz) as usize + 512
    }
}

/// The smallest prime that is not less than `n`: delays without a common factor.
fn next_prime(n: usize) -> usize {
    let is_prime = |n: usize| n > 1 && (2..).take_while(|d| d * d <= n).all(|d| !n.is_multiple_of(d));
    (n..).find(|&n| is_prime(n)).unwrap_or(n)
}
