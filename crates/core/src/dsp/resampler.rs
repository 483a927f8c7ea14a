//! Sample-rate conversion from the instrument's own rate (96 000 or 88 200 Hz; 192 000 or 176 400 Hz in high quality) to the host's
//! (1 000..=1 536 000 Hz).
//!
//! A polyphase FIR: one Kaiser-windowed sinc, sampled at as many phases as the ratio of the two rates needs. It is
//! linear-phase and leaves out nothing but steepness: the transition runs from 5/12 to 7/12 of the lower of the two
//! rates, so what folds back lands above 5/12 of the host's rate (18.4 kHz at 44.1 kHz).
//! Designed in f64, run in f32; frequencies in Hz, positions counted in whole numbers, so nothing drifts.
//!
//! The input's clock may run faster or slower than its rate says, gliding from one speed to another: then positions are
//! counted in parts of 2^-32 input samples and [`warp`](super::warp) supplies the taps. Once the speed is 1 again, the
//! position drifts onto the grid of the plain conversion, inaudibly slowly, and that is what goes on.
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

use std::sync::Arc;

use crate::dsp::lanes::{LANES, has_avx2};
use crate::dsp::low_pass::{Kernel, TapRow, dot, dot_of, normalised, tap_rows};
use crate::dsp::warp::{BEYOND, ONE, SPEEDS, Warp};

/// Largest number of phases stored exactly; above it, neighbouring phases are mixed linearly.
const PHASES: u64 = 512;
/// Room for new inputs behind the ones still heard.
const ROOM: usize = 1024;
/// Rows of taps at the host's usual rates: half the internal ones, 48 000 and 44 100 Hz.
const USUAL_ROWS: usize = 72 / LANES;
/// Rates are reduced to a fraction after rounding to this part of a hertz.
const PARTS_PER_HZ: f64 = 1000.0;
/// How fast a clock of speed 1 drifts back onto the grid, of its speed: a sixth of a cent, half a sample in 50 ms.
const DRIFT: f64 = 1e-4;

/// Sample-rate converter, one channel. See the module's head for its figures.
///
/// The host asks for samples: [`pull`](Self::pull) makes as many as its inputs allow, and when it comes back short,
/// [`push`](Self::push) gives it more. Output does not depend on how the pulls are cut. Equal rates are a pure delay.
///
/// ```
/// use chalumeau_core::dsp::resampler::Resampler;
///
/// let mut resampler = Resampler::new(96_000.0, 48_000.0);
/// let mut out = [0.0; 200];
/// let mut made = resampler.pull(&mut out);
/// while made < out.len() {
///     resampler.push(&[1.0; 16], 1.0);
///     made += resampler.pull(&mut out[made..]);
/// }
/// // A constant stays constant once the filter is full.
/// assert!((out[199] - 1.0).abs() < 1e-6);
/// ```
#[derive(Clone, Debug)]
pub struct Resampler {
    /// `out / in = l / m` in lowest terms.
    l: u64,
    m: u64,
    /// `m / l` as whole inputs and parts of `1 / l`.
    whole: usize,
    part: u64,
    /// Position of the next output after the newest input it hears, in parts of `1 / l` input samples; below `l`.
    phase: u64,
    taps: usize,
    /// `[phase][tap]`, oldest tap first. `l` rows, or `PHASES + 1` when mixed; none for equal rates. Shared with clones.
    coeffs: Arc<[TapRow]>,
    /// The last inputs in order; when it is full, what can still be heard moves to its beginning.
    history: Box<[f32]>,
    /// Inputs that can still be heard.
    reach: usize,
    /// Where the next input is written.
    next: usize,
    /// The next output hears the inputs before this one, which may not have come yet.
    end: usize,
    /// Group delay of the FIR, input samples.
    delay: f64,
    warp: Warp,
    /// The clock is off its speed or off the grid: `fraction` counts, not `phase`.
    warping: bool,
    /// Position of the next output after the newest input it hears, in parts of [`ONE`].
    fraction: u64,
    /// Speed of the clock at input `from`, and how it changes per input.
    speed: f64,
    speed_glide: f64,
    from: usize,
    /// Speed the clock glides to.
    speed_wanted: f64,
    avx2: bool,
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn pull_plain_avx2(resampler: &mut Resampler, out: &mut [f32]) -> usize {
    resampler.pull_plain_body(out)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn pull_warped_avx2(resampler: &mut Resampler, out: &mut [f32]) -> usize {
    resampler.pull_warped_body(out)
}

impl Resampler {
    /// Most inputs that may be pushed at once.
    pub const PUSH_MOST: usize = ROOM / 2;

    /// Converter from `in_hz` to `out_hz`, each held to 1000..=2 000 000 Hz and rounded to a thousandth of a hertz.
    /// Allocates.
    pub fn new(in_hz: f64, out_hz: f64) -> Self {
        // The cast turns NaN into 0, the last step that into the lowest rate.
        let parts = |hz: f64| ((hz.clamp(1e3, 2e6) * PARTS_PER_HZ).round() as u64).max(1_000_000);
        let (input, output) = (parts(in_hz), parts(out_hz));
        let common = gcd(input, output);
        let (l, m) = (output / common, input / common);
        let (in_hz, lower_hz) = (input as f64 / PARTS_PER_HZ, input.min(output) as f64 / PARTS_PER_HZ);
        // Exact phases 0..l stop short of a whole sample: centred between the first tap and the last, the set of all
        // of them is symmetric. Mixed phases include both ends. Equal rates want a delay of whole samples.
        let exact = l <= PHASES && l != m;
        let (rows, steps) = if exact { (l, l as f64) } else { (PHASES + 1, PHASES as f64) };
        let kernel = Kernel::new(in_hz, lower_hz, if exact { 1.0 / l as f64 } else { 0.0 });
        let taps = kernel.taps;
        let mut coeffs = Vec::with_capacity(rows as usize * taps);
        let mut row = vec![0.0; taps];
        for phase in 0..if l == m { 0 } else { rows } {
            for (age, tap) in row.iter_mut().rev().enumerate() {
                *tap = kernel.at(age as f64 + phase as f64 / steps - kernel.half);
            }
            coeffs.extend(normalised(&row));
        }
        let warp = Warp::new(&kernel, in_hz, output as f64 / PARTS_PER_HZ);
        let (whole, part) = ((m / l) as usize, m % l);
        // One output's step beyond what is heard: where the next one stands may be that far ahead of the inputs.
        let reach = warp.reach() + (SPEEDS.1 * m as f64 / l as f64).ceil() as usize;
        let mut resampler = Self {
            l,
            m,
            whole,
            part,
            phase: 0,
            taps,
            coeffs: tap_rows(&coeffs).collect(),
            history: vec![0.0; reach + ROOM].into_boxed_slice(),
            reach,
            next: 0,
            end: 0,
            delay: kernel.half,
            warp,
            warping: false,
            fraction: 0,
            speed: 1.0,
            speed_glide: 0.0,
            from: 0,
            speed_wanted: 1.0,
            avx2: has_avx2(),
        };
        resampler.reset();
        resampler
    }

    /// Keeps to the code path without AVX2, which gives the same bits.
    pub fn without_avx2(mut self) -> Self {
        self.avx2 = false;
        self
    }

    /// More inputs, while whose clock glides to `speed` (0.25..=4, 1 is their rate). At most
    /// [`PUSH_MOST`](Self::PUSH_MOST), and only after [`pull`](Self::pull) came back short. Real-time safe.
    ///
    /// # Panics
    /// With debug assertions, if there are more inputs, or if `pull` has not come back short. Without them, what is more is dropped.
    // A call would cost a voice an instruction a sample.
    #[inline(always)]
    pub fn push(&mut self, input: &[f32], speed: f64) {
        debug_assert!(
            input.len() <= Self::PUSH_MOST && self.end > self.next,
            "push takes at most PUSH_MOST inputs, and only after pull came back short"
        );
        let input = &input[..input.len().min(Self::PUSH_MOST)];
        if self.next + input.len() + BEYOND > self.history.len() {
            let gone = self.next - self.reach;
            self.history.copy_within(gone..self.next, 0);
            self.next -= gone;
            self.end -= gone;
            // Far behind while the clock is plain, and not looked at.
            self.from = self.from.saturating_sub(gone);
        }
        if speed != 1.0 || self.warping {
            self.glide(input.len(), speed);
        }
        self.history[self.next..self.next + input.len()].copy_from_slice(input);
        self.next += input.len();
    }

    /// Lets the clock glide to `speed` over the `inputs` that come now.
    fn glide(&mut self, inputs: usize, speed: f64) {
        if !self.warping {
            self.warping = true;
            self.fraction = (self.phase << 32) / self.l;
        }
        let speed = if speed.is_finite() { speed.clamp(SPEEDS.0, SPEEDS.1) } else { 1.0 };
        self.speed = self.speed_wanted;
        self.speed_wanted = speed;
        self.speed_glide = (speed - self.speed) / inputs.max(1) as f64;
        self.from = self.next;
        self.warp.choose(speed.min(self.speed));
    }

    /// Fills `out` as far as the inputs allow; returns how far. Real-time safe.
    pub fn pull(&mut self, out: &mut [f32]) -> usize {
        let mut made = 0;
        while made < out.len() && self.end <= self.next {
            let out = &mut out[made..];
            made += if self.warping { self.pull_warped(out) } else { self.pull_plain(out) };
        }
        made
    }

    fn pull_plain(&mut self, out: &mut [f32]) -> usize {
        #[cfg(target_arch = "x86_64")]
        if self.avx2 {
            #[allow(unsafe_code)]
            // SAFETY: `avx2` is only set where the processor has AVX2.
            return unsafe { pull_plain_avx2(self, out) };
        }
        self.pull_plain_body(out)
    }

    #[inline(always)]
    fn pull_plain_body(&mut self, out: &mut [f32]) -> usize {
        // As many as the inputs allow: the last of them still finds the inputs it hears.
        let left = (self.next - self.end) as u64;
        let most = ((left + 1) * self.l - 1 - self.phase) / self.m + 1;
        let count = out.len().min(most as usize);
        let out = &mut out[..count];
        if self.coeffs.is_empty() {
            self.step_through(out, |this, end, _| this.history[end - 1 - this.taps / 2]);
        } else if self.part == 0 {
            self.step_whole(out);
        } else if self.l <= PHASES {
            self.step_through(out, |this, end, phase| {
                dot(&this.history[end - this.taps..end], this.row(phase as usize))
            });
        } else {
            self.step_through(out, Self::mixed);
        }
        count
    }

    /// Fills `out` where every output stands in the same phase, as at a ratio of whole numbers: its taps are found once.
    #[inline(always)]
    fn step_whole(&mut self, out: &mut [f32]) {
        let row = self.row(self.phase as usize);
        let heard = &self.history[self.end - self.taps..];
        let count = out.len();
        match <&[TapRow; USUAL_ROWS]>::try_from(row) {
            Ok(row) => step_along(heard, self.whole, out, |heard| dot_of(heard, row)),
            Err(_) => step_along(heard, self.whole, out, |heard| Some(dot(heard.get(..self.taps)?, row))),
        }
        self.end += count * self.whole;
    }

    /// Fills `out` with what `output` makes of each position.
    #[inline(always)]
    fn step_through(&mut self, out: &mut [f32], output: impl Fn(&Self, usize, u64) -> f32) {
        let (mut end, mut phase) = (self.end, self.phase);
        for out in out {
            *out = output(self, end, phase);
            end += self.whole;
            phase += self.part;
            if phase >= self.l {
                phase -= self.l;
                end += 1;
            }
        }
        (self.end, self.phase) = (end, phase);
    }

    /// Beside the plain way, which is taken every few samples and should not prepare for this one.
    #[inline(never)]
    fn pull_warped(&mut self, out: &mut [f32]) -> usize {
        #[cfg(target_arch = "x86_64")]
        if self.avx2 {
            #[allow(unsafe_code)]
            // SAFETY: `avx2` is only set where the processor has AVX2.
            return unsafe { pull_warped_avx2(self, out) };
        }
        self.pull_warped_body(out)
    }

    #[inline(always)]
    fn pull_warped_body(&mut self, out: &mut [f32]) -> usize {
        let mut made = 0;
        let step = self.m as f64 / self.l as f64 * ONE as f64;
        for out in out {
            if self.end > self.next {
                break;
            }
            let gliding = (self.end - 1).saturating_sub(self.from) as f64;
            let (low, high) = SPEEDS;
            let speed = (self.speed + self.speed_glide * gliding).clamp(low, high);
            *out = self.warp.output(&self.history, self.end, self.fraction, speed);
            made += 1;
            self.advance((step * speed).round() as u64);
            if speed == 1.0 && self.speed_wanted == 1.0 && self.land((step * DRIFT) as i64) {
                break;
            }
        }
        made
    }

    #[inline(always)]
    fn advance(&mut self, step: u64) {
        let position = self.fraction + step;
        self.end += (position >> 32) as usize;
        self.fraction = position & (ONE - 1);
    }

    /// Moves the next output towards the grid of the plain conversion, by `most` at most; true when it is there.
    fn land(&mut self, most: i64) -> bool {
        let phase = (self.fraction * self.l + ONE / 2) >> 32;
        let away = ((phase << 32) / self.l) as i64 - self.fraction as i64;
        if away.abs() > most {
            // The grid's points lie in 0..=ONE, and this stops short of the nearest.
            self.fraction = (self.fraction as i64 + most * away.signum()) as u64;
            return false;
        }
        (self.end, self.phase) = if phase < self.l { (self.end, phase) } else { (self.end + 1, 0) };
        (self.warping, self.speed, self.speed_glide) = (false, 1.0, 0.0);
        true
    }

    /// Silence, and the position of a new converter. Real-time safe.
    pub fn reset(&mut self) {
        self.history.fill(0.0);
        self.next = self.reach;
        (self.end, self.phase) = (self.next + self.whole, self.part);
        (self.warping, self.fraction, self.from) = (false, 0, self.next);
        (self.speed, self.speed_glide, self.speed_wanted) = (1.0, 0.0, 1.0);
        self.warp.choose(1.0);
    }

    /// Goes on as another converter between the same rates would. Real-time safe.
    pub fn follow(&mut self, other: &Self) {
        self.history.copy_from_slice(&other.history);
        (self.next, self.end, self.phase) = (other.next, other.end, other.phase);
        (self.warping, self.fraction, self.from) = (other.warping, other.fraction, other.from);
        (self.speed, self.speed_glide, self.speed_wanted) =
            (other.speed, other.speed_glide, other.speed_wanted);
        self.warp.follow(&other.warp);
    }

    /// Delay of the output behind the input at speed 1, output samples: a signal at input time 0 comes out around this
    /// index. At other speeds the same to a sample, as long as the input is worth no less than the lower of the rates;
    /// below that it grows as the speed falls.
    pub fn latency_out_samples(&self) -> f64 {
        (self.delay + 1.0) * self.l as f64 / self.m as f64 - 1.0
    }

    /// Most inputs that an output hears.
    pub fn reach(&self) -> usize {
        self.reach
    }

    /// Length of one output's dot product. Ratios above 512 phases and speeds other than 1 do two.
    pub fn taps(&self) -> usize {
        self.taps
    }

    /// The output that hears the inputs before `end`, between two of the phases kept.
    #[inline(never)]
    fn mixed(&self, end: usize, phase: u64) -> f32 {
        let heard = &self.history[end - self.taps..end];
        let position = phase * PHASES;
        let (row, mix) = ((position / self.l) as usize, (position % self.l) as f32 / self.l as f32);
        let (before, after) = (dot(heard, self.row(row)), dot(heard, self.row(row + 1)));
        before + mix * (after - before)
    }

    #[inline]
    fn row(&self, phase: usize) -> &[TapRow] {
        let chunks = self.taps / LANES;
        &self.coeffs[phase * chunks..][..chunks]
    }
}

/// Fills `out` with what `output` makes of the samples heard, which go on by `step` after each.
#[inline(always)]
fn step_along(mut heard: &[f32], step: usize, out: &mut [f32], output: impl Fn(&[f32]) -> Option<f32>) {
    for out in out {
        let Some(made) = output(heard) else { break };
        *out = made;
        // A step is far shorter than what is heard.
        let Some(next) = heard.get(step..) else { break };
        heard = next;
    }
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::dsp::low_pass::TRANSITION;

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

    /// Pulls blocks, pushing 16 inputs whenever they run out, until they end. Gives the outputs and the inputs pushed.
    fn convert(
        resampler: &mut Resampler,
        input: &[f32],
        blocks: impl Iterator<Item = usize>,
    ) -> (Vec<f32>, usize) {
        let (mut out, mut at) = (Vec::new(), 0);
        for block in blocks {
            let mut part = vec![0.0; block];
            let mut made = resampler.pull(&mut part);
            while made < block {
                if at + 16 > input.len() {
                    return (out, at);
                }
                resampler.push(&input[at..at + 16], 1.0);
                at += 16;
                made += resampler.pull(&mut part[made..]);
            }
            out.extend(part);
        }
        (out, at)
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
        let (out, _) =
            convert(&mut resampler, &sine(f_hz, in_hz, (in_hz * 0.3) as usize), std::iter::repeat(64));
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
        let (out, _) =
            convert(&mut resampler, &sine(f_hz, in_hz, (in_hz * 0.2) as usize), std::iter::repeat(64));
        let tail = &out[400..];
        10.0 * (2.0 * tail.iter().map(|&y| f64::from(y).powi(2)).sum::<f64>() / tail.len() as f64).log10()
    }

    /// Upper edge of the pass band and lower edge of the stop band, Hz. Both half the rate for equal rates.
    fn transition_hz(in_hz: f64, out_hz: f64) -> (f64, f64) {
        let half = if in_hz == out_hz { 0.0 } else { TRANSITION / 2.0 };
        let lower_hz = in_hz.min(out_hz);
        (lower_hz * (0.5 - half), lower_hz * (0.5 + half))
    }

    /// Everything the module's table claims, for every pair in it.
    #[test]
    fn pass_band_is_flat_and_nothing_folds_into_it() {
        for (in_hz, out_hz) in PAIRS {
            let (pass_hz, stop_hz) = transition_hz(in_hz, out_hz);
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
        let mut resampler = Resampler::new(96e3, 48e3);
        assert_eq!(resampler.taps(), 72);
        assert_eq!(convert(&mut resampler, &[0.0; 200], std::iter::once(64)).1, 128);
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
            let (whole, _) = convert(&mut resampler, &input, std::iter::once(8192));
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
                let (parts, _) = convert(&mut resampler, &input, cut.iter().copied());
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
            let (out, _) = convert(&mut resampler, &[0.5; 100_000], std::iter::once(100));
            assert!(out.len() == 100 && out.iter().all(|y| y.is_finite()));
        }
    }

    #[test]
    fn equal_rates_are_a_pure_delay() {
        let mut resampler = Resampler::new(96e3, 96e3);
        let input = sine(1e3, 96e3, 112);
        let (out, _) = convert(&mut resampler, &input, std::iter::repeat_n(7, 16));
        assert_eq!(resampler.latency_out_samples(), 20.0);
        assert_eq!(input[..92], out[20..]);
        assert!(out[..20].iter().all(|&y| y == 0.0));
    }

    /// A second of output takes a second of input, to the 16 pushed at once: nothing drifts, even where phases are mixed.
    #[test]
    fn a_second_is_a_second() {
        for (in_hz, out_hz) in PAIRS {
            let mut resampler = Resampler::new(in_hz, out_hz);
            let silence = vec![0.0; in_hz as usize + 100];
            let (out, pushed) = convert(&mut resampler, &silence, std::iter::once(out_hz as usize));
            assert_eq!((out.len(), pushed), (out_hz as usize, (in_hz as usize).next_multiple_of(16)));
        }
    }

    #[test]
    fn a_constant_stays_constant() {
        for (in_hz, out_hz) in PAIRS {
            let mut resampler = Resampler::new(in_hz, out_hz);
            let (out, _) = convert(&mut resampler, &[1.0; 20_000], std::iter::once(4000));
            assert!(out[1000..].iter().all(|y| (y - 1.0).abs() < 1e-6), "{in_hz} -> {out_hz}");
        }
    }
}
