//! Sample-rate conversion from the instrument's own rate (96 000 or 88 200 Hz) to the host's (22 050..=384 000 Hz).
//!
//! A polyphase FIR: one Kaiser-windowed sinc, sampled at as many phases as the ratio of the two rates needs. It is
//! linear-phase and leaves out nothing but steepness: the transition runs from 5/12 to 7/12 of the lower of the two
//! rates, so what folds back lands above 5/12 of the host's rate (18.4 kHz at 44.1 kHz). Formulas for the window and
//! its length: J. F. Kaiser, Nonrecursive digital filter design using the I0-sinh window function, ISCAS 1974.
//! Designed in f64, run in f32; frequencies in Hz, positions counted in whole numbers, so nothing drifts.
//!
//! Measured by the tests below. *Ripple*: largest deviation from 0 dB for sines up to the pass edge. *Rest*: everything
//! in the output that is not the sine (images, aliases, rounding), largest over the same sines. *Alias*: largest output
//! for sines from the stop edge to half the input rate. The delay is constant to 0.01 sample.
//!
//! | in -> out, Hz | taps | latency, ms | pass, Hz | stop, Hz | ripple, dB | rest, dB | alias, dB |
//! |---|---|---|---|---|---|---|---|
//! | 96 000 -> 48 000 | 72 | 0.359 | 20 000 | 28 000 | 0.0002 | -145 | -95 |
//! | 96 000 -> 44 100 | 80 | 0.404 | 18 375 | 25 725 | 0.0002 | -111 | -96 |
//! | 88 200 -> 44 100 | 72 | 0.391 | 18 375 | 25 725 | 0.0001 | -145 | -95 |
//! | 88 200 -> 48 000 | 72 | 0.399 | 20 000 | 28 000 | 0.0001 | -115 | -103 |
//! | 96 000 -> 192 000 | 40 | 0.211 | 40 000 | 56 000 | 0.0001 | -112 | none |
//! | 96 000 -> 384 000 | 40 | 0.215 | 40 000 | 56 000 | 0.0001 | -115 | none |
//! | 88 200 -> 384 000 (mixed phases) | 40 | 0.235 | 36 750 | 51 450 | 0.0001 | -106 | none |
//! | 88 200 -> 22 050 | 144 | 0.777 | 9 188 | 12 862 | 0.0001 | -146 | -94 |
//! | 96 000 -> 32 000 | 112 | 0.557 | 13 333 | 18 667 | 0.0001 | -145 | -106 |
//! | 96 000 -> 50 000 | 72 | 0.365 | 20 833 | 29 167 | 0.0001 | -114 | -98 |
//! | 96 000 -> 47 999 (mixed phases) | 72 | 0.365 | 20 000 | 27 999 | 0.0002 | -115 | -94 |

use std::f64::consts::PI;

/// Largest number of phases stored exactly; above it, neighbouring phases are mixed linearly.
const PHASES: u64 = 512;
/// Lanes of the dot product; tap counts are multiples of it.
const LANES: usize = 8;
/// Width of the transition over the lower rate: 2:1 then costs 72 taps and passes 20 kHz to a host at 48 kHz.
const TRANSITION: f64 = 1.0 / 6.0;
/// Attenuation asked of the design, dB. Rounding the taps up gives more, never less.
const ATTENUATION_DB: f64 = 94.0;
/// What the length formula promises and the stop band does not quite keep at its edge, dB: the window is shaped for
/// this much less, which moves the edge where it should be.
const EDGE_DB: f64 = 2.0;
/// Room for new inputs behind the ones still heard.
const ROOM: usize = 1024;
/// Rates are reduced to a fraction after rounding to this part of a hertz.
const PARTS_PER_HZ: f64 = 1000.0;

/// Pull-model sample-rate converter, one channel. See the module's head for its figures.
///
/// The host asks for samples; [`inputs_needed`](Self::inputs_needed) says how many of the instrument's samples that
/// takes, and [`process`](Self::process) turns exactly those into exactly the ones asked for. Output does not depend
/// on how the calls are cut. Equal rates pass through untouched, without latency.
#[derive(Clone, Debug)]
pub struct Resampler {
    /// `out / in = l / m` in lowest terms.
    l: u64,
    m: u64,
    /// Position of the next output after the newest input, in parts of `1 / l` input samples; below `l`.
    phase: u64,
    taps: usize,
    /// `[phase][tap]`, oldest tap first. `l` rows, or `PHASES + 1` when mixed.
    coeffs: Box<[[f32; LANES]]>,
    /// The last inputs in order; when it is full, the last `taps` of them move to its beginning.
    history: Box<[f32]>,
    /// Where the next input is written; the `taps` before it are heard.
    next: usize,
    /// Group delay of the FIR, input samples.
    delay: f64,
    pass_hz: f64,
    stop_hz: f64,
}

impl Resampler {
    /// Converter from `in_hz` to `out_hz`, each held to 1000..=1 000 000 Hz and rounded to a thousandth of a hertz.
    /// Allocates.
    pub fn new(in_hz: f64, out_hz: f64) -> Self {
        // The cast turns NaN into 0, the last step that into the lowest rate.
        let parts = |hz: f64| ((hz.clamp(1e3, 1e6) * PARTS_PER_HZ).round() as u64).max(1_000_000);
        let (input, output) = (parts(in_hz), parts(out_hz));
        let common = gcd(input, output);
        let (l, m) = (output / common, input / common);
        let (in_hz, lower_hz) = (input as f64 / PARTS_PER_HZ, input.min(output) as f64 / PARTS_PER_HZ);
        if l == m {
            return Self {
                l,
                m,
                phase: 0,
                taps: 0,
                coeffs: Box::default(),
                history: Box::default(),
                next: 0,
                delay: 0.0,
                pass_hz: in_hz / 2.0,
                stop_hz: in_hz / 2.0,
            };
        }
        let width = TRANSITION * lower_hz / in_hz;
        let taps = ((ATTENUATION_DB - 7.95) / (14.36 * width)).ceil() as usize;
        let taps = taps.next_multiple_of(LANES);
        let beta = 0.1102 * (14.36 * width * taps as f64 + 7.95 - EDGE_DB - 8.7);
        // Exact phases 0..l stop short of a whole sample: centred between the first tap and the last, the set of all
        // of them is symmetric. Mixed phases include both ends.
        let (rows, steps, span) = if l <= PHASES {
            (l, l as f64, taps as f64 - 1.0 / l as f64)
        } else {
            (PHASES + 1, PHASES as f64, taps as f64)
        };
        let cutoff = lower_hz / in_hz;
        let mut coeffs = Vec::with_capacity(rows as usize * taps);
        let mut row = vec![0.0; taps];
        for phase in 0..rows {
            for (age, tap) in row.iter_mut().rev().enumerate() {
                let t = age as f64 + phase as f64 / steps - span / 2.0;
                *tap = sinc(cutoff * t) * kaiser(t / (span / 2.0), beta);
            }
            // Each phase passes a constant unchanged, so that breath pressure makes no whistle at the phase rate.
            let sum: f64 = row.iter().sum();
            coeffs.extend(row.iter().map(|tap| (tap / sum) as f32));
        }
        Self {
            l,
            m,
            phase: 0,
            taps,
            coeffs: coeffs.as_chunks().0.into(),
            history: vec![0.0; taps + ROOM].into_boxed_slice(),
            next: taps,
            delay: span / 2.0,
            pass_hz: lower_hz * (0.5 - TRANSITION / 2.0),
            stop_hz: lower_hz * (0.5 + TRANSITION / 2.0),
        }
    }

    /// Input samples the next `outputs` output samples consume. Depends on the state. Real-time safe.
    pub fn inputs_needed(&self, outputs: usize) -> usize {
        ((self.phase + outputs as u64 * self.m) / self.l) as usize
    }

    /// Most input samples any `outputs` output samples can consume: the size of the caller's buffer.
    pub fn inputs_needed_at_most(&self, outputs: usize) -> usize {
        (outputs as u64 * self.m).div_ceil(self.l) as usize
    }

    /// Fills `out` from `input`, of which there must be [`inputs_needed`](Self::inputs_needed)`(out.len())`; missing
    /// samples count as silence, surplus ones are dropped (both refused in debug builds). Real-time safe.
    pub fn process(&mut self, input: &[f32], out: &mut [f32]) {
        debug_assert_eq!(input.len(), self.inputs_needed(out.len()));
        if self.l == self.m {
            let shared = input.len().min(out.len());
            out[..shared].copy_from_slice(&input[..shared]);
            out[shared..].fill(0.0);
            return;
        }
        let mut input = input;
        // Rates differ by 1000 at most, so there is always room for what one output takes.
        let piece = ((ROOM as u64 * self.l / self.m) as usize).max(1);
        for out in out.chunks_mut(piece) {
            let needed = self.inputs_needed(out.len());
            let (now, later) = input.split_at(needed.min(input.len()));
            input = later;
            let mut end = self.take(now, needed);
            for out in out {
                self.phase += self.m;
                while self.phase >= self.l {
                    self.phase -= self.l;
                    end += 1;
                }
                *out = self.output(end);
            }
        }
    }

    /// Silence, and the position of a new converter. Real-time safe.
    pub fn reset(&mut self) {
        self.phase = 0;
        self.next = self.taps;
        self.history.fill(0.0);
    }

    /// Delay of the output behind the input, output samples: a signal at input time 0 comes out around this index.
    pub fn latency_out_samples(&self) -> f64 {
        if self.l == self.m {
            return 0.0;
        }
        (self.delay + 1.0) * self.l as f64 / self.m as f64 - 1.0
    }

    /// Upper edge of the pass band and lower edge of the stop band, Hz. Both half the rate for equal rates.
    pub fn transition_hz(&self) -> (f64, f64) {
        (self.pass_hz, self.stop_hz)
    }

    /// Length of one output's dot product; 0 for equal rates. Ratios above 512 phases do two.
    pub fn taps(&self) -> usize {
        self.taps
    }

    /// Writes `needed` inputs behind those there are; returns where the new ones begin.
    fn take(&mut self, input: &[f32], needed: usize) -> usize {
        if self.next + needed > self.history.len() {
            self.history.copy_within(self.next - self.taps..self.next, 0);
            self.next = self.taps;
        }
        let begin = self.next;
        self.next += needed;
        let (given, missing) = self.history[begin..self.next].split_at_mut(input.len());
        given.copy_from_slice(input);
        missing.fill(0.0);
        begin
    }

    /// The output that hears the `taps` inputs before `end`.
    #[inline]
    fn output(&self, end: usize) -> f32 {
        let heard = &self.history[end - self.taps..end];
        if self.l <= PHASES {
            return dot(heard, self.row(self.phase as usize));
        }
        let position = self.phase * PHASES;
        let (row, mix) = ((position / self.l) as usize, (position % self.l) as f32 / self.l as f32);
        let (before, after) = (dot(heard, self.row(row)), dot(heard, self.row(row + 1)));
        before + mix * (after - before)
    }

    #[inline]
    fn row(&self, phase: usize) -> &[[f32; LANES]] {
        let chunks = self.taps / LANES;
        &self.coeffs[phase * chunks..][..chunks]
    }
}

/// Sum of products in eight lanes, then of the lanes one by one: the same order on every machine. (Added pairwise, the
/// compiler would split the lanes into pairs.)
#[inline]
fn dot(a: &[f32], b: &[[f32; LANES]]) -> f32 {
    let mut lanes = [0.0f32; LANES];
    for (a, b) in a.as_chunks::<LANES>().0.iter().zip(b) {
        for k in 0..LANES {
            lanes[k] += a[k] * b[k];
        }
    }
    lanes.iter().sum()
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { (PI * x).sin() / (PI * x) }
}

/// Kaiser window at `x` in -1..=1, 1 in the middle.
fn kaiser(x: f64, beta: f64) -> f64 {
    bessel_i0(beta * (1.0 - x * x).max(0.0).sqrt()) / bessel_i0(beta)
}

/// Modified Bessel function of the first kind, order 0, by its power series (all terms positive).
fn bessel_i0(x: f64) -> f64 {
    let quarter = x * x / 4.0;
    let (mut sum, mut term, mut k) = (1.0, 1.0, 1.0);
    while term > 1e-17 * sum {
        term *= quarter / (k * k);
        sum += term;
        k += 1.0;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAIRS: [(f64, f64); 11] = [
        (96e3, 48e3),
        (96e3, 44.1e3),
        (88.2e3, 44.1e3),
        (88.2e3, 48e3),
        (96e3, 192e3),
        (96e3, 384e3),
        (88.2e3, 384e3),
        (88.2e3, 22.05e3),
        (96e3, 32e3),
        (96e3, 50e3),
        (96e3, 47_999.0),
    ];

    fn sine(f_hz: f64, rate_hz: f64, len: usize) -> Vec<f32> {
        (0..len).map(|n| (2.0 * PI * f_hz * n as f64 / rate_hz).sin() as f32).collect()
    }

    fn convert(resampler: &mut Resampler, input: &[f32], blocks: impl Iterator<Item = usize>) -> Vec<f32> {
        let (mut out, mut at) = (Vec::new(), 0);
        for block in blocks {
            let needed = resampler.inputs_needed(block);
            assert!(needed <= resampler.inputs_needed_at_most(block));
            if at + needed > input.len() {
                break;
            }
            let mut part = vec![0.0; block];
            resampler.process(&input[at..at + needed], &mut part);
            at += needed;
            out.extend(part);
        }
        out
    }

    /// What came of a unit sine: its amplitude, its delay in output samples (modulo its period) and the rms of
    /// everything else over that of the sine.
    struct Heard {
        gain_db: f64,
        delay: f64,
        rest_db: f64,
    }

    fn heard(in_hz: f64, out_hz: f64, f_hz: f64) -> Heard {
        let mut resampler = Resampler::new(in_hz, out_hz);
        let out = convert(&mut resampler, &sine(f_hz, in_hz, (in_hz * 0.3) as usize), std::iter::repeat(64));
        let skip = 400;
        // Least squares on sine and cosine: the two are not quite orthogonal over a slice of any length.
        let (mut ss, mut cc, mut sc, mut ys, mut yc) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let angle = |n: usize| 2.0 * PI * f_hz * n as f64 / out_hz;
        for (n, &y) in out.iter().enumerate().skip(skip) {
            let (s, c) = angle(n).sin_cos();
            let y = f64::from(y);
            (ss, cc, sc, ys, yc) = (ss + s * s, cc + c * c, sc + s * c, ys + y * s, yc + y * c);
        }
        let det = ss * cc - sc * sc;
        let (a, b) = ((ys * cc - yc * sc) / det, (yc * ss - ys * sc) / det);
        let rest: f64 = (out.iter().enumerate().skip(skip))
            .map(|(n, &y)| (f64::from(y) - a * angle(n).sin() - b * angle(n).cos()).powi(2))
            .sum();
        let rest = rest / (out.len() - skip) as f64;
        Heard {
            gain_db: 20.0 * a.hypot(b).log10(),
            delay: -b.atan2(a) / (2.0 * PI) * out_hz / f_hz,
            rest_db: 10.0 * (2.0 * rest).log10(),
        }
    }

    /// Level at the output, dB relative to the sine at the input.
    fn level_db(in_hz: f64, out_hz: f64, f_hz: f64) -> f64 {
        let mut resampler = Resampler::new(in_hz, out_hz);
        let out = convert(&mut resampler, &sine(f_hz, in_hz, (in_hz * 0.2) as usize), std::iter::repeat(64));
        let tail = &out[400..];
        10.0 * (2.0 * tail.iter().map(|&y| f64::from(y).powi(2)).sum::<f64>() / tail.len() as f64).log10()
    }

    /// Everything the module's table claims, for every pair in it.
    #[test]
    fn pass_band_is_flat_and_nothing_folds_into_it() {
        for (in_hz, out_hz) in PAIRS {
            let (pass_hz, stop_hz) = Resampler::new(in_hz, out_hz).transition_hz();
            let (mut ripple, mut rest, mut alias) = (0.0f64, f64::MIN, f64::MIN);
            for f_hz in [100.0, 1e3, 5e3, 10e3, 18e3, pass_hz].into_iter().filter(|&f_hz| f_hz <= pass_hz) {
                let heard = heard(in_hz, out_hz, f_hz);
                ripple = ripple.max(heard.gain_db.abs());
                rest = rest.max(heard.rest_db);
            }
            for step in 0..40 {
                let f_hz = stop_hz + 7.0 + (in_hz / 2.0 - stop_hz) * f64::from(step) / 40.0;
                if f_hz < in_hz / 2.0 {
                    alias = alias.max(level_db(in_hz, out_hz, f_hz));
                }
            }
            assert!(out_hz < 44.1e3 || pass_hz > 18e3);
            assert!(ripple < 3e-4, "{in_hz} -> {out_hz}: {ripple} dB");
            assert!(rest < -105.0, "{in_hz} -> {out_hz}: {rest} dB");
            assert!(alias < -93.5, "{in_hz} -> {out_hz}: {alias} dB");
        }
    }

    #[test]
    fn ultrasound_does_not_fold_at_48k() {
        for f_hz in [30e3, 40e3, 47e3] {
            let alias = level_db(96e3, 48e3, f_hz);
            assert!(alias < -90.0, "{f_hz}: {alias} dB");
        }
    }

    #[test]
    fn two_to_one_costs_72_taps_and_whole_blocks() {
        let resampler = Resampler::new(96e3, 48e3);
        assert_eq!(resampler.taps(), 72);
        assert_eq!(resampler.inputs_needed(64), 128);
        assert_eq!(resampler.latency_out_samples(), 17.25);
    }

    #[test]
    fn latency_is_as_stated() {
        for (in_hz, out_hz) in PAIRS {
            let latency = Resampler::new(in_hz, out_hz).latency_out_samples();
            // 50 Hz: the period is longer than any latency, so the phase says all.
            let delay = heard(in_hz, out_hz, 50.0).delay;
            assert!((delay - latency).abs() < 0.01, "{in_hz} -> {out_hz}: {delay}, stated {latency}");
        }
    }

    #[test]
    fn block_size_and_reset_are_inaudible() {
        let input: Vec<f32> = {
            let mut seed = 1u32;
            std::iter::repeat_with(|| {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (seed >> 8) as f32 / (1 << 23) as f32 - 1.0
            })
            .take(40_000)
            .collect()
        };
        for (in_hz, out_hz) in PAIRS {
            let mut resampler = Resampler::new(in_hz, out_hz);
            let whole = convert(&mut resampler, &input, std::iter::once(8192));
            assert_eq!(whole.len(), 8192);
            let mut seed = 7usize;
            let random: Vec<usize> = std::iter::repeat_with(|| {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (seed >> 33) % 700
            })
            .take(40)
            .collect();
            let cuts: [Vec<usize>; 5] = [vec![1; 8192], vec![17; 482], vec![64; 128], vec![512; 16], random];
            for cut in cuts {
                resampler.reset();
                let parts = convert(&mut resampler, &input, cut.iter().copied());
                let shared = parts.len().min(whole.len());
                assert!(shared > 8000);
                assert_eq!(parts[..shared], whole[..shared], "{in_hz} -> {out_hz}, blocks of {}", cut[0]);
            }
        }
    }

    #[test]
    fn nonsense_rates_are_held_to_the_range() {
        for (in_hz, out_hz) in [(f64::NAN, 48e3), (96e3, f64::INFINITY), (0.0, -1.0)] {
            let mut resampler = Resampler::new(in_hz, out_hz);
            let input = vec![0.5; resampler.inputs_needed(100)];
            let mut out = vec![0.0; 100];
            resampler.process(&input, &mut out);
            assert!(out.iter().all(|y| y.is_finite()));
        }
    }

    #[test]
    fn equal_rates_pass_through() {
        let mut resampler = Resampler::new(96e3, 96e3);
        let input = sine(1e3, 96e3, 100);
        let mut out = vec![0.0; 100];
        resampler.process(&input, &mut out);
        assert_eq!(input, out);
        assert_eq!(resampler.latency_out_samples(), 0.0);
    }

    /// A second of output takes a second of input: nothing drifts, even where phases are mixed.
    #[test]
    fn a_second_is_a_second() {
        for (in_hz, out_hz) in PAIRS {
            assert_eq!(Resampler::new(in_hz, out_hz).inputs_needed(out_hz as usize), in_hz as usize);
        }
    }

    #[test]
    fn a_constant_stays_constant() {
        for (in_hz, out_hz) in PAIRS {
            let mut resampler = Resampler::new(in_hz, out_hz);
            let out = convert(&mut resampler, &[1.0; 20_000], std::iter::once(4000));
            assert!(out[1000..].iter().all(|y| (y - 1.0).abs() < 1e-6), "{in_hz} -> {out_hz}");
        }
    }
}
