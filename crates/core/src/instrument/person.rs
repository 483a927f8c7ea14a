//! What makes one player of several a person: own breath noise, own wander, own place in a swing, own tuning.
//!
//! The first one is as every lone player is. The others follow from their number alone, so that every render repeats.

use crate::maths;
use std::f64::consts::PI;

/// Numbers that no simple ratio joins, so that multiples of them spread evenly over a turn: the golden ratio less 1, and the
/// inverse of the plastic number.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// See [`GOLDEN`].
const PLASTIC: f64 = 0.754_877_666_246_692_8;

/// One player of several.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Person {
    /// Turns the bits of seeds over.
    bits: u64,
    /// Where regular movements begin, turns, 0..1.
    phase: f64,
    /// Tuning, -1..=1 of the spread.
    detune: f64,
}

impl Person {
    /// A player by number; 0 is the lone one.
    pub fn new(number: u8) -> Self {
        if number == 0 {
            return Self::default();
        }
        let turn = |ratio: f64| (f64::from(number) * ratio).fract();
        Self { bits: mixed(u64::from(number)), phase: turn(PLASTIC), detune: 2.0 * turn(GOLDEN) - 1.0 }
    }

    /// This player's own seed in place of a lone player's.
    pub fn seed(&self, lone: u64) -> u64 {
        lone ^ self.bits
    }

    /// Where regular movements begin, turns, 0..1.
    pub fn phase(&self) -> f64 {
        self.phase
    }

    /// How far this player is out of tune among players who spread by `spread_cents` either way, cents.
    pub fn detune_cents(&self, spread_cents: f32) -> f64 {
        self.detune * f64::from(spread_cents)
    }

    /// Place between left (-1) and right (1) of `count` players, who sit at equal angles on a semicircle of `width`, 0..=1: the first
    /// in the middle, or left of it where their number is even, the others alternately to the right and left, the last ones at the ends. One player is in
    /// the middle.
    pub fn seat(number: usize, count: usize, width: f32) -> f32 {
        if count < 2 {
            return 0.0;
        }
        // Half steps between the middle and the seat, of count - 1 between the middle and an end.
        let half_steps = if count.is_multiple_of(2) { number / 2 * 2 + 1 } else { number.div_ceil(2) * 2 };
        let out = maths::sin(0.5 * PI * half_steps as f64 / (count - 1) as f64) as f32 * width;
        if number % 2 == 1 { out } else { -out }
    }
}

/// A number whose bits have no pattern.
///
/// Source: Steele, Lea & Flood, Fast Splittable Pseudorandom Number Generators (OOPSLA 2014), the finaliser of SplitMix64.
fn mixed(number: u64) -> u64 {
    let x = number.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dsp::white::White;

    #[test]
    fn the_first_is_the_lone_player_and_no_two_are_the_same() {
        let first = Person::new(0);
        assert_eq!((first.seed(7), first.phase(), first.detune_cents(25.0)), (7, 0.0, 0.0));
        let all: Vec<Person> = (0..16).map(Person::new).collect();
        for (a, one) in all.iter().enumerate() {
            assert!((0.0..1.0).contains(&one.phase) && one.detune.abs() <= 1.0);
            for other in &all[..a] {
                assert!((one.phase - other.phase).abs() > 0.01 && (one.detune - other.detune).abs() > 0.01);
                // Their noises have nothing in common: 0.01 is the deviation of 10 000 products.
                let [mut x, mut y] = [one, other].map(|person| White::new(person.seed(1)));
                let common = (0..10_000).map(|_| x.next() * y.next()).sum::<f64>() / 10_000.0;
                assert!(common.abs() < 0.05, "{common}");
            }
        }
        let mean = all.iter().map(|person| person.detune).sum::<f64>() / 16.0;
        assert!(mean.abs() < 0.1, "{mean}: together they are in tune");
    }

    #[test]
    fn seats_are_symmetric_and_reach_the_width() {
        assert_eq!(Person::seat(0, 1, 1.0), 0.0);
        assert_eq!([0, 1, 2].map(|number| Person::seat(number, 3, 0.5)), [0.0, 0.5, -0.5]);
        assert_eq!([0, 1].map(|number| Person::seat(number, 2, 0.5)), [-0.5, 0.5]);
        for count in 2..=16 {
            let seats: Vec<f32> = (0..count).map(|number| Person::seat(number, count, 1.0)).collect();
            assert!(seats.iter().sum::<f32>().abs() < 1e-6, "{seats:?}");
            assert!(seats.iter().all(|seat| seat.abs() <= 1.0) && seats.contains(&1.0));
            let out: Vec<f32> = seats.iter().map(|seat| seat.abs()).collect();
            assert!(out.is_sorted(), "from the middle outwards: {seats:?}");
        }
    }
}
