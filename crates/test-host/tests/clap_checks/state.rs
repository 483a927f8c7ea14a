//! Checks of the saved state.

use std::io::{Read, Write};

use fastrand::Rng;

use super::bench::{BLOCK, Bench, RATE_HZ, random_values};

#[test]
fn state_invalid_empty() {
    assert!(!Bench::new().load(&[][..]));
}

#[test]
fn state_invalid_random() {
    let mut rng = Rng::with_seed(23);
    let mut bench = Bench::new();
    let before = bench.values();
    for _ in 0..3 {
        let noise: Vec<u8> = std::iter::repeat_with(|| rng.u8(..)).take(1_000_000).collect();
        assert!(!bench.load(&noise[..]));
    }
    assert_eq!(bench.values(), before);
}

/// A plugin with random values, its state, and a new plugin with that state.
fn saved_and_loaded(load: impl Fn(&mut Bench, &[u8])) -> ([Vec<f64>; 2], [Vec<u8>; 2]) {
    let mut bench = Bench::new();
    let said = random_values(&mut Rng::with_seed(29), &bench.params(), 0);
    bench.session(RATE_HZ, BLOCK, |session| drop(session.block(BLOCK, &said, None)));
    let (mut saved, mut again) = (Vec::new(), Vec::new());
    bench.save(&mut saved);
    let mut other = Bench::new();
    load(&mut other, &saved);
    other.save(&mut again);
    ([bench.values(), other.values()], [saved, again])
}

fn assert_same_values(bench: &mut Bench, [before, after]: [Vec<f64>; 2]) {
    for ((param, before), after) in bench.params().into_iter().zip(before).zip(after) {
        assert_eq!(before, after, "{}", param.name);
    }
}

#[test]
fn state_reproducibility_basic() {
    let (values, _) = saved_and_loaded(|bench, state| assert!(bench.load(state)));
    assert_same_values(&mut Bench::new(), values);
}

#[test]
fn state_reproducibility_binary() {
    let (_, [saved, again]) = saved_and_loaded(|bench, state| assert!(bench.load(state)));
    assert_eq!(String::from_utf8_lossy(&saved), String::from_utf8_lossy(&again));
}

/// Takes and gives few bytes at a time.
struct Trickle<T>(T);

impl<T: Read> Read for Trickle<T> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let most = buffer.len().min(17);
        self.0.read(&mut buffer[..most])
    }
}

impl<T: Write> Write for Trickle<T> {
    fn write(&mut self, buffer: &[u8]) -> std::io::Result<usize> {
        self.0.write(&buffer[..buffer.len().min(23)])
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

#[test]
fn state_reproducibility_buffered() {
    let (values, [saved, _]) = saved_and_loaded(|bench, state| assert!(bench.load(Trickle(state))));
    assert_same_values(&mut Bench::new(), values);
    let mut bench = Bench::new();
    assert!(bench.load(&saved[..]));
    let (mut whole, mut trickled) = (Vec::new(), Vec::new());
    bench.save(&mut whole);
    bench.save(Trickle(&mut trickled));
    assert_eq!(whole, trickled);
}
