//! What a block of samples amounts to, in eight lanes beside each other: an eighth of the steps.

use std::hint::black_box;

/// Values added up beside each other.
pub const LANES: usize = 8;

/// Whether the processor has vectors of eight numbers of single precision: AVX2.
#[cfg(target_arch = "x86_64")]
pub fn has_avx2() -> bool {
    std::arch::is_x86_feature_detected!("avx2")
}

/// Whether the processor has vectors of eight numbers of single precision: AVX2.
#[cfg(not(target_arch = "x86_64"))]
pub fn has_avx2() -> bool {
    false
}

/// The same numbers, which have been in memory: where single numbers follow, as in a recursion or a sum in order, the compiler
/// otherwise makes all that comes before of single numbers, too. By value, since what is lent to memory stays there before, too.
#[inline(always)]
pub fn through_memory<T>(numbers: T) -> T {
    black_box(numbers)
}

/// Sum of all samples, in an order that does not depend on the machine. Not finite if any of them is not. Real-time safe.
#[inline]
pub fn sum(samples: &[f32]) -> f32 {
    let (chunks, rest) = samples.as_chunks::<LANES>();
    let mut lanes = [0.0f32; LANES];
    for chunk in chunks {
        for k in 0..LANES {
            lanes[k] += chunk[k];
        }
    }
    lanes.iter().chain(rest).sum()
}

/// Whether the magnitude of any sample is above a limit. Looks at all of them, which is less work than to ask each time
/// whether to go on. Real-time safe.
#[inline]
pub fn any_above(samples: &[f32], limit: f32) -> bool {
    samples.iter().fold(false, |any, sample| any | (sample.abs() > limit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_counts_at_every_length() {
        for length in 0..40 {
            let ramp: Vec<f32> = (1..=length).map(|n| n as f32).collect();
            assert_eq!(sum(&ramp), (length * (length + 1) / 2) as f32);
            for at in 0..length as usize {
                let mut samples = vec![0.5; length as usize];
                for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                    samples[at] = odd;
                    assert!(!sum(&samples).is_finite());
                }
                for loud in [0.7, -0.7] {
                    samples[at] = loud;
                    assert!(any_above(&samples, 0.6) && !any_above(&samples, 0.7));
                }
            }
        }
    }
}
