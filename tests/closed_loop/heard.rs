//! Where a sound began, without the delay of the crescendo in which it was heard.
//!
//! Just above its threshold a sound grows so slowly that it is noticed late. While it is soft its amplitude A follows
//!
//! ```text
//! dA/dt = k A (gamma - gamma_on - a A - b A^2)
//! ```
//!
//! `b` is the reed's (the bifurcation is direct: A^2 grows as the pressure above the threshold), `a` that of the jets in
//! open holes, whose loss goes as A. With A, its growth and gamma measured this is linear in `gamma_on, a, b, 1/k`: least
//! squares over the crescendo, from where A leaves the breath noise, give the pressure at which nothing grows.

use chalumeau_core::instrument::Probe;
use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Probes, which come at 96 kHz, averaged into one sample.
const DECIMATION: usize = 16;
const RATE_HZ: f64 = 6_000.0;
/// Length of a window, some 12 periods of the lowest note, and the way to the next, samples.
const WINDOW: usize = 480;
const HOP: usize = 120;
/// Growth is told from the windows so many before and behind.
const HALF: usize = 4;
/// Amplitude over the closing pressure at which nobody doubts that something sounds.
const NOTICED: f64 = 0.02;
/// Over what the breath noise makes of the same line before anything sounds.
const OVER_NOISE: f64 = 8.0;
/// A line is the sound as long as all there is, is less than so many times as loud.
const WHOLE: f64 = 1.25;
/// Where lines are looked for, Hz.
const BAND_HZ: (f64, f64) = (100.0, 2_500.0);

/// Somebody who listens in the mouthpiece.
#[derive(Default)]
pub struct Ear {
    /// Pressures in mouthpiece and mouth over the closing pressure.
    sound: Vec<f64>,
    gamma: Vec<f64>,
    sums: (f64, f64, usize),
}

/// A sound that began.
#[derive(Clone, Copy, Debug)]
pub struct SoundOnset {
    /// Mouth pressure over the closing pressure from which it grew.
    pub gamma: f64,
    /// Mouth pressure at which it was as loud as `NOTICED`.
    pub noticed: f64,
    /// Its frequency while it was soft, Hz.
    pub soft_hz: f64,
    /// Strongest line in the end, Hz.
    pub loud_hz: f64,
    /// What the formula leaves over, rms, over `gamma`.
    pub rest: f64,
}

impl Ear {
    /// Takes in one probe of a reed that closes at `closing_pa`.
    pub fn hear(&mut self, probe: Probe, closing_pa: f64) {
        self.sums.0 += probe.p_mouthpiece_pa / closing_pa;
        self.sums.1 += probe.gamma;
        self.sums.2 += 1;
        if self.sums.2 == DECIMATION {
            self.sound.push(self.sums.0 / DECIMATION as f64);
            self.gamma.push(self.sums.1 / DECIMATION as f64);
            self.sums = (0.0, 0.0, 0);
        }
    }

    /// Mouth pressure over the closing pressure, mean of the last so many seconds.
    pub fn gamma(&self, seconds: f64) -> f64 {
        mean(last(&self.gamma, seconds))
    }

    /// Rms and strongest line, Hz, of the last so many seconds.
    pub fn strongest(&self, seconds: f64) -> (f64, f64) {
        let sound = last(&self.sound, seconds);
        (rms(sound), strongest_hz(sound))
    }

    /// What began in a slow crescendo; `None` if nothing did.
    pub fn onset(&self) -> Option<SoundOnset> {
        let windows: Vec<&[f64]> = self.sound.windows(WINDOW).step_by(HOP).collect();
        // The last crossing upwards: what the first breath stirs up dies away.
        let noticed = windows.iter().rposition(|sound| rms(sound) < NOTICED / 2_f64.sqrt())? + 1;
        let at = noticed * HOP;
        let soft_hz = strongest_hz(self.sound.get(at.saturating_sub(2 * WINDOW)..at + WINDOW)?);
        let line: Vec<f64> = windows.iter().map(|sound| amplitude(sound, soft_hz)).collect();
        let noise = median(&line[..noticed / 3]);
        let first = (0..noticed).rev().find(|&n| line[n] < OVER_NOISE * noise)? + 1;
        // While it is the sound: another register may take over.
        let used: Vec<usize> = (first.max(HALF)..line.len() - HALF)
            .filter(|&n| 2_f64.sqrt() * rms(windows[n]) < WHOLE * line[n])
            .collect();
        let rows: Vec<[f64; 4]> = used
            .iter()
            .map(|&n| {
                let growth = (line[n + HALF] / line[n - HALF]).ln() * RATE_HZ / (2 * HALF * HOP) as f64;
                [1.0, line[n], line[n] * line[n], growth]
            })
            .collect();
        let gammas: Vec<f64> = used.iter().map(|&n| mean(&self.gamma[n * HOP..n * HOP + WINDOW])).collect();
        let (found, rest) = least_squares(&rows, &gammas)?;
        let gamma = found[0];
        Some(SoundOnset {
            gamma,
            noticed: self.gamma[at + WINDOW / 2],
            soft_hz,
            loud_hz: self.strongest(0.2).1,
            rest: rest / gamma,
        })
    }
}

fn last(values: &[f64], seconds: f64) -> &[f64] {
    &values[values.len().saturating_sub((seconds * RATE_HZ) as usize)..]
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn rms(sound: &[f64]) -> f64 {
    let mean = mean(sound);
    (sound.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / sound.len() as f64).sqrt()
}

/// Amplitude of the line at `hz` through a Hann window.
fn amplitude(sound: &[f64], hz: f64) -> f64 {
    let (mean, len) = (mean(sound), sound.len() as f64);
    let (step, turn) =
        (Complex64::from_polar(1.0, -TAU * hz / RATE_HZ), Complex64::from_polar(1.0, TAU / len));
    // Complex products without their functions, which a test that is not optimised calls.
    let turned = |(re, im): (f64, f64), by: Complex64| (re * by.re - im * by.im, re * by.im + im * by.re);
    let (mut line, mut window, mut sum) = ((1.0, 0.0), (1.0, 0.0), (0.0, 0.0));
    for p in sound {
        let p = (0.5 - 0.5 * window.0) * (p - mean);
        sum = (sum.0 + line.0 * p, sum.1 + line.1 * p);
        line = turned(line, step);
        window = turned(window, turn);
    }
    f64::hypot(sum.0, sum.1) * 4.0 / len
}

/// Frequency of the strongest line: a grid of quarter bins, then its neighbourhood narrowed down.
fn strongest_hz(sound: &[f64]) -> f64 {
    let step = 0.25 * RATE_HZ / sound.len() as f64;
    let grid = (0..).map(|n| BAND_HZ.0 + step * f64::from(n)).take_while(|&hz| hz < BAND_HZ.1);
    let (near, _) = grid
        .map(|hz| (hz, amplitude(sound, hz)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .expect("the band is not empty");
    let (mut low, mut high) = (near - step, near + step);
    for _ in 0..25 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if amplitude(sound, a) > amplitude(sound, b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}

/// Coefficients of the columns that come nearest to `wanted`, and what is left over, rms.
pub fn least_squares<const N: usize>(rows: &[[f64; N]], wanted: &[f64]) -> Option<([f64; N], f64)> {
    if rows.len() <= N {
        return None;
    }
    // Columns of one length each, so that small cut-offs mean the same for all.
    let sizes: [f64; N] =
        std::array::from_fn(|column| rows.iter().map(|row| row[column] * row[column]).sum::<f64>().sqrt());
    let matrix = DMatrix::from_fn(rows.len(), N, |row, column| rows[row][column] / sizes[column]);
    let wanted = DVector::from_column_slice(wanted);
    let found = matrix.clone().svd(true, true).solve(&wanted, 1e-9).ok()?;
    let rest = (matrix * &found - wanted).norm() / (rows.len() as f64).sqrt();
    Some((std::array::from_fn(|column| found[column] / sizes[column]), rest))
}

#[test]
fn a_sound_that_follows_the_formula_is_found_where_it_began() {
    const STEP_S: f64 = 1.0 / 96_000.0;
    let (k, on, a, b) = (600.0, 0.37, 0.08, 0.4);
    let mut rng = fastrand::Rng::with_seed(1);
    let (mut ear, mut wave, mut gamma) = (Ear::default(), Complex64::ZERO, 0.35);
    while gamma < 0.39 {
        let loud = wave.norm();
        wave *= 1.0 + k * STEP_S * (gamma - on - a * loud - b * loud * loud);
        wave *= Complex64::from_polar(1.0, TAU * 210.0 * STEP_S);
        wave += 1e-5 * Complex64::new(rng.f64() - 0.5, rng.f64() - 0.5);
        ear.hear(Probe { gamma, p_mouthpiece_pa: 6_000.0 * wave.re, ..Probe::default() }, 6_000.0);
        gamma += 0.0037 * STEP_S;
    }
    let heard = ear.onset().unwrap();
    // Noise, which makes the growth look slower, costs a few thousandths.
    assert!((heard.gamma / on - 1.0).abs() < 5e-3, "{heard:?}");
    assert!(heard.noticed > 1.01 * on, "it is noticed later: {heard:?}");
    assert!((heard.soft_hz - 210.0).abs() < 0.1 && (heard.loud_hz - 210.0).abs() < 0.1, "{heard:?}");
}
