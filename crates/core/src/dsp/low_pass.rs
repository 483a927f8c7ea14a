//! The low-pass of all sample-rate conversion here: a sinc under a Kaiser window, as a function of time.
//!
//! Formulas for the window and its length: J. F. Kaiser, Nonrecursive digital filter design using the I0-sinh window
//! function, ISCAS 1974. Time counts in input samples, in f64; rows of taps are f32.

use std::f64::consts::PI;

use crate::dsp::lanes::{LANES, through_memory};
use crate::maths;

/// Width of the transition over the lower rate: 2:1 then costs 72 taps and passes 20 kHz to a host at 48 kHz.
pub const TRANSITION: f64 = 1.0 / 6.0;
/// Attenuation asked of the design, dB. Rounding the taps up gives more, never less.
const ATTENUATION_DB: f64 = 94.0;
/// What the length formula promises and the stop band does not quite keep at its edge, dB: the window is shaped for
/// this much less, which moves the edge where it should be.
const EDGE_DB: f64 = 2.0;

/// A windowed sinc.
#[derive(Clone, Copy, Debug)]
pub struct Kernel {
    /// Taps an output hears, a multiple of [`LANES`].
    pub taps: usize,
    /// Half the length of the window, input samples: the delay.
    pub half: f64,
    /// Cut-off over half the input rate, 0..=1.
    cutoff: f64,
    beta: f64,
}

impl Kernel {
    /// The low-pass for `lower_hz`, the lower of two rates, at an input rate of `in_hz`; its window is shorter than its
    /// taps by `less` input samples.
    pub fn new(in_hz: f64, lower_hz: f64, less: f64) -> Self {
        let width = TRANSITION * lower_hz / in_hz;
        let taps = ((ATTENUATION_DB - 7.95) / (14.36 * width)).ceil() as usize;
        let taps = taps.next_multiple_of(LANES);
        let beta = 0.1102 * (14.36 * width * taps as f64 + 7.95 - EDGE_DB - 8.7);
        Self { taps, half: (taps as f64 - less) / 2.0, cutoff: lower_hz / in_hz, beta }
    }

    /// Height at `t` input samples from the middle, within the window.
    pub fn at(&self, t: f64) -> f64 {
        sinc(self.cutoff * t) * kaiser(t / self.half, self.beta)
    }
}

/// Taps whose sum is one, so that a constant passes unchanged and breath pressure makes no whistle at the phase rate.
pub fn normalised(row: &[f64]) -> impl Iterator<Item = f32> + '_ {
    let sum: f64 = row.iter().sum();
    row.iter().map(move |tap| (tap / sum) as f32)
}

/// One tap for each lane, aligned so that a processor multiplies with it in memory.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct TapRow([f32; LANES]);

/// Rows of taps, whose number is a multiple of [`LANES`].
pub fn tap_rows(taps: &[f32]) -> impl Iterator<Item = TapRow> + '_ {
    taps.as_chunks().0.iter().map(|&row| TapRow(row))
}

/// Sum of products in eight lanes, then of the lanes one by one: the same order on every machine.
#[inline(always)]
pub fn dot(a: &[f32], b: &[TapRow]) -> f32 {
    // Three rows a turn, in their order: the counting of turns is a fifth of the work otherwise.
    let (a, a_rest) = a.as_chunks::<LANES>().0.as_chunks::<3>();
    let (b, b_rest) = b.as_chunks::<3>();
    let mut lanes = [0.0f32; LANES];
    for (a, b) in a.iter().zip(b) {
        for row in 0..3 {
            add(&mut lanes, &a[row], &b[row]);
        }
    }
    for (a, b) in a_rest.iter().zip(b_rest) {
        add(&mut lanes, a, b);
    }
    total(lanes)
}

/// [`dot`] with a number of rows that is known beforehand: the compiler counts no turns and keeps the taps in registers from one
/// sum to the next. `None` where there are too few samples.
#[inline(always)]
pub fn dot_of<const ROWS: usize>(a: &[f32], b: &[TapRow; ROWS]) -> Option<f32> {
    let a = a.as_chunks::<LANES>().0.first_chunk::<ROWS>()?;
    let mut lanes = [0.0f32; LANES];
    for row in 0..ROWS {
        add(&mut lanes, &a[row], &b[row]);
    }
    Some(total(lanes))
}

/// The lanes one by one.
#[inline(always)]
fn total(lanes: [f32; LANES]) -> f32 {
    through_memory(lanes).iter().sum()
}

#[inline(always)]
fn add(lanes: &mut [f32; LANES], a: &[f32; LANES], b: &TapRow) {
    // Copied whole: so the compiler remembers how it is aligned.
    let TapRow(b) = *b;
    for k in 0..LANES {
        lanes[k] += a[k] * b[k];
    }
}

fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { maths::sin(PI * x) / (PI * x) }
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
