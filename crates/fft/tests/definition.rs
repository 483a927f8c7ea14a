//! Both transforms against the sum that defines them.

use chalumeau_fft::{forward, inverse};
use num_complex::Complex64;

/// As the definition has it.
fn slow(samples: &[f64], size: usize) -> Vec<Complex64> {
    let turn = |k: usize, n: usize| -std::f64::consts::TAU * (k * n % size) as f64 / size as f64;
    (0..=size / 2)
        .map(|k| samples.iter().enumerate().map(|(n, &x)| Complex64::from_polar(x, turn(k, n))).sum())
        .collect()
}

#[test]
fn both_ways_are_the_definition_for_even_and_odd_sizes() {
    for size in [1, 2, 3, 4, 7, 16, 60, 61, 1_024] {
        let samples: Vec<f64> = (0..size).map(|n| ((n * n + 3 * n) as f64).sin()).collect();
        let bins = forward(&samples, size);
        for (bin, expected) in bins.iter().zip(slow(&samples, size)) {
            assert!((bin - expected).norm() < 1e-10, "{size}: {bin} {expected}");
        }
        for (back, sample) in inverse(bins, size).iter().zip(&samples) {
            assert!((back / size as f64 - sample).abs() < 1e-12, "{size}: {back} {sample}");
        }
    }
}

#[test]
fn samples_are_cut_or_filled_with_zeros_and_missing_bins_are_0() {
    assert_eq!(forward(&[1.0, 2.0, 3.0, 4.0, 5.0], 4), forward(&[1.0, 2.0, 3.0, 4.0], 4));
    assert_eq!(forward(&[1.0], 4), [Complex64::from(1.0); 3]);
    assert_eq!(inverse(vec![Complex64::new(1.0, 1e-9)], 4), [1.0; 4]);
}
