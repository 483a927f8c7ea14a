//! Discrete Fourier transforms of real samples in double precision.
//!
//! `realfft` is generic, so each crate and each test program that names it compiles all kernels of `rustfft` again: a
//! third of what the compiler did for the core. Here they are compiled once.

use std::cell::RefCell;

use num_complex::Complex64;
use realfft::RealFftPlanner;

thread_local! {
    /// Plans of sizes that are powers of two, of which there are few; making one takes longer than using it.
    static PLANNER: RefCell<RealFftPlanner<f64>> = RefCell::new(RealFftPlanner::new());
}

/// Bins 0..=`size`/2 of the samples, which are cut or filled with zeros to `size`: `X[k] = sum x[n] exp(-2 pi i k n / size)`,
/// not scaled. `size` is at least 1. Allocates.
///
/// ```
/// // One turn of a cosine: half of its four samples in bin 1.
/// let bins = chalumeau_fft::forward(&[1.0, 0.0, -1.0, 0.0], 4);
/// assert_eq!(bins.iter().map(|bin| bin.re).collect::<Vec<_>>(), [0.0, 2.0, 0.0]);
/// ```
pub fn forward(samples: &[f64], size: usize) -> Vec<Complex64> {
    let plan = with_planner(size, |planner| planner.plan_fft_forward(size));
    let mut input = plan.make_input_vec();
    for (to, from) in input.iter_mut().zip(samples) {
        *to = *from;
    }
    let mut bins = plan.make_output_vec();
    // PANIC: both buffers were made by this plan, and length is all it checks.
    plan.process(&mut input, &mut bins).unwrap();
    bins
}

/// `size` samples, times `size`, of their bins 0..=`size`/2; bins that are missing are 0, and what is imaginary at
/// 0 Hz and at half the rate is rounding and left out. `size` is at least 1. Allocates.
///
/// ```
/// let samples = [0.5, -1.0, 0.25, 2.0, 0.0, 0.0, -0.5, 1.0];
/// let back = chalumeau_fft::inverse(chalumeau_fft::forward(&samples, 8), 8);
/// for (there, back) in samples.iter().zip(back) {
///     assert!((there - back / 8.0).abs() < 1e-15);
/// }
/// ```
pub fn inverse(mut bins: Vec<Complex64>, size: usize) -> Vec<f64> {
    let plan = with_planner(size, |planner| planner.plan_fft_inverse(size));
    bins.resize(size / 2 + 1, Complex64::default());
    bins[0].im = 0.0;
    if size.is_multiple_of(2) {
        bins[size / 2].im = 0.0;
    }
    let mut samples = plan.make_output_vec();
    // PANIC: the lengths are the plan's own, and the ends are real.
    plan.process(&mut bins, &mut samples).unwrap();
    samples
}

/// Plans of other sizes are not kept: there may be as many as there are sounds.
fn with_planner<T>(size: usize, plan: impl FnOnce(&mut RealFftPlanner<f64>) -> T) -> T {
    if size.is_power_of_two() { PLANNER.with_borrow_mut(plan) } else { plan(&mut RealFftPlanner::new()) }
}
