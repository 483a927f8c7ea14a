//! What a wandering pitch costs the upper harmonics, as recordings are measured: the peak of one window of seconds.
//!
//! Held notes of recordings wander by 0.59 cents at 0.3 to 3 Hz and by 0.30 cents at 3 to 9 Hz (standard deviations, medians).
//! Here the pitch is a sum of cosines of random phase whose power falls as 1/f, scaled to these two. A harmonic at a
//! frequency f then has the phase 2 pi f times the integral of the deviation, whatever note it belongs to. So the cost is a
//! function of frequency alone, the mean over a dozen such paths.

use std::f64::consts::TAU;

/// Standard deviation of the pitch, cents, between two frequencies, Hz.
const RECORDED: [(f64, f64, f64); 2] = [(0.3, 3.0, 0.59), (3.0, 9.0, 0.30)];
/// Lowest frequency of the wander, Hz: slower drifts are straight lines in the window.
const SLOWEST_HZ: f64 = 0.1;
/// Length of the window, s, and steps a second: a recorded note of 4 s less its ends.
const WINDOW_S: f64 = 3.6;
const STEPS_HZ: f64 = 200.0;
/// Number of paths.
const PATHS: u64 = 12;
/// Frequencies at which the cost is computed, Hz; between them straight lines.
const AT_HZ: [f64; 13] = [
    0.0, 200.0, 400.0, 700.0, 1_000.0, 1_500.0, 2_000.0, 3_000.0, 4_500.0, 6_500.0, 9_000.0, 13_000.0,
    20_000.0,
];

/// The cost over the frequency.
pub struct Loss {
    lost_db: Vec<f64>,
}

impl Loss {
    /// Of notes that wander as recorded ones.
    pub fn recorded() -> Self {
        let paths: Vec<Vec<f64>> = (1..=PATHS).map(path).collect();
        let lost_db = AT_HZ
            .iter()
            .map(|&hz| paths.iter().map(|path| lost_db(path, hz)).sum::<f64>() / paths.len() as f64)
            .collect();
        Self { lost_db }
    }

    /// What a harmonic at this frequency reads too low, dB.
    pub fn lost_db(&self, hz: f64) -> f64 {
        let right = AT_HZ.partition_point(|&at| at < hz).clamp(1, AT_HZ.len() - 1);
        let way = ((hz - AT_HZ[right - 1]) / (AT_HZ[right] - AT_HZ[right - 1])).clamp(0.0, 1.0);
        self.lost_db[right - 1] + way * (self.lost_db[right] - self.lost_db[right - 1])
    }
}

/// SplitMix64 (Steele, Lea, Flood, 2014): a number from 0 to 1.
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *seed;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z ^ (z >> 31)) as f64 / u64::MAX as f64
}

/// Integral over time of the relative deviation of the pitch, s, less a straight line: that of a mean pitch.
fn path(seed: u64) -> Vec<f64> {
    let mut seed = seed;
    let count = (WINDOW_S * STEPS_HZ) as usize;
    let step_hz = 0.05;
    let lines: Vec<(f64, f64, f64)> = (0..)
        .map(|line| SLOWEST_HZ + f64::from(line) * step_hz)
        .take_while(|&hz| hz <= RECORDED[1].1)
        .map(|hz| (hz, hz.powf(-0.5), TAU * random(&mut seed)))
        .collect();
    let scale = |(low, high, cents): (f64, f64, f64)| {
        let power: f64 =
            lines.iter().filter(|(hz, ..)| (low..high).contains(hz)).map(|(_, a, _)| 0.5 * a * a).sum();
        cents / power.sqrt()
    };
    let (slow, fast) = (scale(RECORDED[0]), scale(RECORDED[1]));
    let ratio_of_cents = std::f64::consts::LN_2 / 1_200.0;
    let mut sum = 0.0;
    let mut path: Vec<f64> = (0..count)
        .map(|n| n as f64 / STEPS_HZ)
        .map(|t| {
            let cents: f64 = lines
                .iter()
                .map(|&(hz, a, phase)| {
                    a * if hz < RECORDED[1].0 { slow } else { fast } * (TAU * hz * t + phase).cos()
                })
                .sum();
            sum += cents * ratio_of_cents / STEPS_HZ;
            sum
        })
        .collect();
    let middle = 0.5 * (count as f64 - 1.0);
    let (mut cross, mut square) = (0.0, 0.0);
    let mean = path.iter().sum::<f64>() / count as f64;
    for (n, value) in path.iter().enumerate() {
        cross += (n as f64 - middle) * (value - mean);
        square += (n as f64 - middle).powi(2);
    }
    for (n, value) in path.iter_mut().enumerate() {
        *value -= mean + cross / square * (n as f64 - middle);
    }
    path
}

/// How far the highest bin of a Hann window lies below that of a steady partial.
fn lost_db(path: &[f64], hz: f64) -> f64 {
    let len = path.len() as f64;
    let window: Vec<f64> = (0..path.len()).map(|n| 0.5 - 0.5 * (TAU * n as f64 / len).cos()).collect();
    let all: f64 = window.iter().sum();
    // A quarter of a bin apart, as far as the partial can move.
    let highest = (-80..=80)
        .map(|quarter| f64::from(quarter) * 0.25 / WINDOW_S)
        .map(|off_hz| {
            let (mut re, mut im) = (0.0, 0.0);
            for (n, (value, w)) in path.iter().zip(&window).enumerate() {
                let turn = TAU * (hz * value - off_hz * n as f64 / STEPS_HZ);
                re += w * turn.cos();
                im += w * turn.sin();
            }
            re.hypot(im)
        })
        .fold(0.0, f64::max);
    -20.0 * (highest / all).log10()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn high_harmonics_lose_more_and_low_ones_nothing() {
        let loss = Loss::recorded();
        let lost: Vec<f64> = [150.0, 500.0, 1_500.0, 4_000.0, 12_000.0].map(|hz| loss.lost_db(hz)).to_vec();
        assert!(
            lost.is_sorted() && lost[0] < 0.3 && (1.0..4.0).contains(&lost[2]) && lost[4] > 6.0,
            "{lost:?}"
        );
    }
}
