//! Partials of a note over time: how they begin, and how a held note wanders.
//!
//! A partial is watched through a Hann window that moves in steps of 5 ms. Its magnitude is the partial's level, its phase
//! against that of a steady partial gives the pitch.

use num_complex::Complex64;
use std::f64::consts::TAU;

use crate::analysis::{HANN, cosine_window, is_hz};
use crate::maths;

/// Step of the windows, s.
pub const HOP_S: f64 = 0.005;
/// Length of the windows: at least so many periods of the fundamental, so that the neighbours stay outside, and at least so
/// long, s.
const PERIODS: f64 = 4.0;
const SHORTEST_S: f64 = 0.015;
/// Share of the steady level that counts as begun.
const BEGUN: f64 = 0.9;
/// A partial that stands less than this above what is beside it, dB, is noise, which has no beginning.
const CLEAR_DB: f64 = 10.0;
/// Bands in which a wander is measured, Hz: what a hand or lung does slowly, and what trembles.
pub const SLOW_HZ: (f64, f64) = (0.3, 3.0);
/// See [`SLOW_HZ`].
pub const FAST_HZ: (f64, f64) = (3.0, 9.0);
/// What is cut off at each end, s: three quarters of a period of the frequency between the bands.
const END_S: f64 = 0.25;

/// One partial over time: complex amplitude every [`HOP_S`].
#[derive(Clone, Debug)]
pub struct Partial {
    /// Frequency of the watching, Hz.
    hz: f64,
    /// Amplitude and phase against a steady partial of this frequency.
    values: Vec<Complex64>,
}

/// How far a held note wanders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wander {
    /// Range of the pitch below 3 Hz, cents.
    pub range_cents: f64,
    /// Standard deviation of the pitch in [`SLOW_HZ`], cents.
    pub slow_cents: f64,
    /// Standard deviation of the pitch in [`FAST_HZ`], cents.
    pub fast_cents: f64,
    /// Standard deviation of the levels of harmonics 1, 3 and 5 in [`SLOW_HZ`], dB.
    pub harmonics_db: [f64; 3],
    /// Standard deviation of the level of the whole tone in [`SLOW_HZ`], dB.
    pub level_db: f64,
}

impl Partial {
    /// Watches the partial near `harmonic * f0_hz`. Nothing is seen, and all that is asked is `None` or empty, where the samples are too
    /// few for a window, or rate and `f0_hz` are not above 0.
    pub fn watch(samples: &[f64], rate_hz: f64, f0_hz: f64, harmonic: usize) -> Self {
        Self::watch_at(samples, rate_hz, f0_hz, harmonic as f64 * f0_hz)
    }

    /// Watches `hz`, through windows for a tone of `f0_hz`.
    fn watch_at(samples: &[f64], rate_hz: f64, f0_hz: f64, hz: f64) -> Self {
        let len = ((PERIODS / f0_hz).max(SHORTEST_S) * rate_hz).round() as usize;
        if !is_hz(rate_hz) || !is_hz(f0_hz) || hop(rate_hz) == 0 || len > samples.len() {
            return Self { hz, values: Vec::new() };
        }
        let window: Vec<f64> = cosine_window(len, &HANN).collect();
        let sum: f64 = window.iter().sum();
        let hop = hop(rate_hz);
        let step = maths::complex::cis(-TAU * hz / rate_hz);
        let values = (0..)
            .map(|frame| frame * hop)
            .take_while(|start| start + len <= samples.len())
            .map(|start| {
                let mut turn = maths::complex::cis((-TAU * hz / rate_hz * start as f64) % TAU);
                let mut value = Complex64::default();
                for (x, w) in samples[start..].iter().zip(&window) {
                    value += turn * (x * w);
                    turn *= step;
                }
                2.0 * value / sum
            })
            .collect();
        Self { hz, values }
    }

    /// Time from the start of the slice to 90 % of the steady amplitude, the median over the last third, s; `None` for
    /// silence, and for what is there from the first moment.
    pub fn t90_s(&self) -> Option<f64> {
        let steady = self.steady()?;
        let begun = self.values.iter().position(|value| maths::complex::norm(*value) >= BEGUN * steady)?;
        (steady > 0.0 && begun > 0).then_some(begun as f64 * HOP_S)
    }

    /// The same for a harmonic of a note, if it stands clear of the noise beside it, half-way to its neighbours; `None` otherwise.
    pub fn clear_t90_s(samples: &[f64], rate_hz: f64, f0_hz: f64, harmonic: usize) -> Option<f64> {
        let partial = Self::watch(samples, rate_hz, f0_hz, harmonic);
        let beside =
            |part: f64| Self::watch_at(samples, rate_hz, f0_hz, (harmonic as f64 + part) * f0_hz).steady();
        let noise = beside(-0.5)?.max(beside(0.5)?);
        let is_clear = partial.steady()? >= noise * maths::pow(10.0, CLEAR_DB / 20.0);
        is_clear.then(|| partial.t90_s()).flatten()
    }

    /// Median amplitude over the last third.
    fn steady(&self) -> Option<f64> {
        let last = &self.values[self.values.len() * 2 / 3..];
        super::upper_median(last.iter().map(|value| maths::complex::norm(*value)))
    }

    /// Level, dB.
    pub fn level_db(&self) -> impl Iterator<Item = f64> + '_ {
        self.values.iter().map(|value| 10.0 * maths::log10(value.norm_sqr().max(1e-30)))
    }

    /// Pitch between two windows, cents above the frequency of the watching.
    pub fn cents(&self) -> impl Iterator<Item = f64> + '_ {
        self.values.windows(2).map(|pair| {
            let hz = maths::complex::arg(pair[1] * pair[0].conj()) / TAU / HOP_S;
            1_200.0 * maths::log2((1.0 + hz / self.hz).max(1e-3))
        })
    }
}

/// The step of the windows, samples; 0 at a rate that is too low.
fn hop(rate_hz: f64) -> usize {
    (HOP_S * rate_hz).round() as usize
}

impl Wander {
    /// Of a steady segment of at least 1 s with the fundamental `f0_hz`; `None` if it is shorter or silent, or if rate and `f0_hz` are not
    /// above 0. Allocates.
    pub fn measure(segment: &[f64], rate_hz: f64, f0_hz: f64) -> Option<Self> {
        if (segment.len() as f64) < rate_hz {
            return None;
        }
        let [first, third, fifth] = [1, 3, 5].map(|h| Partial::watch(segment, rate_hz, f0_hz, h));
        if first.values.is_empty() {
            return None;
        }
        let cents: Vec<f64> = first.cents().collect();
        let slow = band(&cents, (0.0, SLOW_HZ.1));
        let range_cents = slow.iter().copied().fold(f64::NEG_INFINITY, f64::max)
            - slow.iter().copied().fold(f64::INFINITY, f64::min);
        let of = |partial: &Partial| deviation(&band(&partial.level_db().collect::<Vec<_>>(), SLOW_HZ));
        let hop = hop(rate_hz);
        let level: Vec<f64> = segment
            .chunks_exact(4 * hop)
            .map(|part| {
                10.0 * maths::log10((part.iter().map(|x| x * x).sum::<f64>() / part.len() as f64).max(1e-30))
            })
            .flat_map(|db| [db; 4])
            .collect();
        Some(Self {
            range_cents,
            slow_cents: deviation(&band(&cents, SLOW_HZ)),
            fast_cents: deviation(&band(&cents, FAST_HZ)),
            harmonics_db: [of(&first), of(&third), of(&fifth)],
            level_db: deviation(&band(&level, SLOW_HZ)),
        })
    }
}

/// What a sequence in steps of [`HOP_S`] has between two frequencies, Hz: cosine series over its length, so that a drift
/// makes no jump at the ends. A kink is left there, which every band hears: the ends, [`END_S`] each, are cut off.
fn band(values: &[f64], (low_hz, high_hz): (f64, f64)) -> Vec<f64> {
    let len = values.len();
    let basis = |k: usize, n: usize| maths::cos(TAU / 2.0 * k as f64 * (n as f64 + 0.5) / len as f64);
    let mut out = vec![0.0; len];
    for k in 1..len {
        let hz = k as f64 / (2.0 * len as f64 * HOP_S);
        if hz > high_hz {
            break;
        }
        if hz >= low_hz {
            let weight =
                2.0 / len as f64 * values.iter().enumerate().map(|(n, x)| x * basis(k, n)).sum::<f64>();
            out.iter_mut().enumerate().for_each(|(n, out)| *out += weight * basis(k, n));
        }
    }
    let end = ((END_S / HOP_S) as usize).min(len / 4);
    out[end..len - end].to_vec()
}

fn deviation(values: &[f64]) -> f64 {
    super::rms(&super::without_mean(values))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::synthetic::{CLARINET_DB, glide, tone};

    const RATE_HZ: f64 = 44_100.0;

    #[test]
    fn a_steady_tone_does_not_wander() {
        let wander = Wander::measure(&tone(233.1, RATE_HZ, 3.0, &CLARINET_DB), RATE_HZ, 233.1).unwrap();
        assert!(wander.range_cents < 0.01 && wander.slow_cents < 0.003 && wander.fast_cents < 0.003);
        assert!(wander.level_db < 0.05 && wander.harmonics_db[2] < 0.01, "{wander:?}");
        assert_eq!(Wander::measure(&[0.0; 100], RATE_HZ, 233.1), None);
        let second = tone(233.1, RATE_HZ, 1.0, &CLARINET_DB);
        for no_hz in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300] {
            assert_eq!(Wander::measure(&second, no_hz, 233.1), None, "{no_hz}");
            assert_eq!(Wander::measure(&second, RATE_HZ, no_hz), None, "{no_hz}");
            assert_eq!(Partial::watch(&second, no_hz, 233.1, 1).t90_s(), None, "{no_hz}");
            assert_eq!(Partial::watch(&second, RATE_HZ, no_hz, 1).t90_s(), None, "{no_hz}");
        }
    }

    #[test]
    fn a_vibrato_is_read_at_its_depth_in_its_band() {
        let (depth_cents, f0_hz) = (5.0, 300.0);
        for (rate, slow) in [(1.0, true), (6.0, false)] {
            // Frequency f0 (1 + e sin 2 pi r t), e = cents * ln 2 / 1200.
            let e = depth_cents * std::f64::consts::LN_2 / 1_200.0;
            let cycles = |t: f64| f0_hz * t - f0_hz * e / (TAU * rate) * (TAU * rate * t).cos();
            let wander = Wander::measure(&glide(cycles, RATE_HZ, 4.0, &CLARINET_DB), RATE_HZ, f0_hz).unwrap();
            let (inside, outside) = if slow {
                (wander.slow_cents, wander.fast_cents)
            } else {
                (wander.fast_cents, wander.slow_cents)
            };
            assert!((inside - depth_cents / 2.0_f64.sqrt()).abs() < 0.2, "{rate} Hz: {wander:?}");
            // 4 % of the other band remain, from the kinks at the ends.
            assert!(outside < 0.15, "{rate} Hz: {wander:?}");
        }
    }

    /// What is there all the time, or hardly more than noise, has no beginning.
    #[test]
    fn what_does_not_begin_has_no_time() {
        let rate = RATE_HZ;
        let mut white = crate::dsp::white::White::new(3);
        let note: Vec<f64> = (0..88_200)
            .map(|n| {
                let t = f64::from(n) / rate;
                let rise = (t / 0.1).min(1.0);
                let third = 0.02 * (TAU * 600.0 * t).sin();
                rise * (TAU * 200.0 * t).sin() + third + 0.01 * white.next()
            })
            .collect();
        let t90 = |harmonic| Partial::clear_t90_s(&note, rate, 200.0, harmonic);
        assert!((t90(1).unwrap() - 0.08).abs() < 0.012, "{:?}", t90(1));
        assert_eq!((t90(3), t90(5), t90(7)), (None, None, None));
    }

    #[test]
    fn a_late_partial_is_read_late() {
        let rate = RATE_HZ;
        let note: Vec<f64> = (0..88_200)
            .map(|n| {
                let t = f64::from(n) / rate;
                let rise = |s: f64| (t / s).min(1.0);
                rise(0.1) * (TAU * 200.0 * t).sin() + 0.3 * rise(0.3) * (TAU * 600.0 * t).sin()
            })
            .collect();
        let t90 = [1, 3].map(|h| Partial::watch(&note, rate, 200.0, h).t90_s().unwrap());
        // A window of 20 ms sees the end of the rise half its length early.
        assert!((t90[0] - 0.08).abs() < 0.012 && (t90[1] - 0.26).abs() < 0.012, "{t90:?}");
    }
}
