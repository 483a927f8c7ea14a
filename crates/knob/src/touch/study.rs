//! An open question of the reference as an experiment: does a player prefer, or play better with, a reed whose stiffness
//! follows its opening (*coupled*, the peak of the flow stays 1) or one whose opening alone changes (*free*)?
//!
//! Each trial compares the two at one opening H, as sides A and B. The player switches between them without knowing which
//! is which. Sound and feel change together. There are sixteen trials: four openings, each with either condition as A,
//! twice. Participant and seed fix the order, so that the analysis can find it again.

use chalumeau_core::reed::law::{K_INIT, coupled_k};

/// Openings tried: two below and two above the reference's sqrt(27)/2, inside what the knob can do (by judgement).
const OPENINGS: [f64; 4] = [2.0, 2.3, 2.9, 3.3];
/// How often each opening comes with the same condition as A.
const REPEATS: usize = 2;
/// Trials of a session.
pub const TRIALS: usize = OPENINGS.len() * 2 * REPEATS;

/// How k goes with H.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Condition {
    /// `k = 27 / (4 H^3)`.
    Coupled,
    /// k keeps the reference value.
    Free,
}

impl Condition {
    /// The name in the study log.
    pub fn name(self) -> &'static str {
        match self {
            Self::Coupled => "coupled",
            Self::Free => "free",
        }
    }

    /// k at an opening.
    pub fn k(self, h: f64) -> f64 {
        match self {
            Self::Coupled => coupled_k(h),
            Self::Free => K_INIT,
        }
    }
}

/// Position of the player's switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StudySide {
    /// Not switched.
    A,
    /// Switched.
    B,
}

impl StudySide {
    /// The side that is not this one.
    pub fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

/// One comparison of two sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial {
    /// Number of the trial, from 1.
    pub number: u32,
    /// Opening H of both sides.
    pub h: f64,
    /// Condition of side A; B has the other.
    pub a: Condition,
}

impl Trial {
    /// Condition of a side.
    pub fn condition(&self, side: StudySide) -> Condition {
        match (side, self.a) {
            (StudySide::A, a) => a,
            (StudySide::B, Condition::Coupled) => Condition::Free,
            (StudySide::B, Condition::Free) => Condition::Coupled,
        }
    }
}

/// The sixteen trials of a participant, in order. Real-time safe.
pub fn plan(participant: u32, seed: u32) -> [Trial; TRIALS] {
    let mut random = SplitMix(u64::from(participant) << 32 | u64::from(seed));
    let mut order: [usize; TRIALS] = std::array::from_fn(|index| index);
    // Fisher and Yates.
    for last in (1..TRIALS).rev() {
        order.swap(last, (random.next() % (last as u64 + 1)) as usize);
    }
    std::array::from_fn(|at| Trial {
        number: at as u32 + 1,
        h: OPENINGS[order[at] % OPENINGS.len()],
        a: if (order[at] / OPENINGS.len()).is_multiple_of(2) { Condition::Coupled } else { Condition::Free },
    })
}

/// Steele, Lea & Flood (2014), "Fast splittable pseudorandom number generators": the same on every machine for ever.
struct SplitMix(u64);

impl SplitMix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::reed::law::H_INIT;

    #[test]
    fn every_opening_meets_either_order_equally_often() {
        for (participant, seed) in [(1, 1), (2, 1), (7, 99), (u32::MAX, u32::MAX)] {
            let plan = plan(participant, seed);
            for h in OPENINGS {
                for a in [Condition::Coupled, Condition::Free] {
                    assert_eq!(plan.iter().filter(|trial| trial.h == h && trial.a == a).count(), REPEATS);
                }
            }
            assert!(plan.iter().enumerate().all(|(at, trial)| trial.number as usize == at + 1));
        }
    }

    #[test]
    fn order_is_the_participants_own_and_repeats() {
        assert_eq!(plan(7, 1), plan(7, 1));
        assert_ne!(plan(7, 1), plan(8, 1));
        assert_ne!(plan(7, 1), plan(7, 2));
        // Over many participants no position favours a condition.
        let coupled_first = (0..1_000).filter(|&who| plan(who, 3)[0].a == Condition::Coupled).count();
        assert!((440..560).contains(&coupled_first), "{coupled_first}");
    }

    #[test]
    fn sides_differ_and_meet_at_the_reference_opening() {
        let trial = plan(1, 1)[0];
        assert_ne!(trial.condition(StudySide::A), trial.condition(StudySide::B));
        assert!((Condition::Coupled.k(H_INIT) - Condition::Free.k(H_INIT)).abs() < 1e-12);
        for h in OPENINGS {
            assert!((Condition::Coupled.k(h) / Condition::Free.k(h) - 1.0).abs() > 0.2, "{h}");
        }
    }

    #[test]
    fn generator_is_the_published_one() {
        let mut random = SplitMix(0);
        assert_eq!(random.next(), 0xE220_A839_7B1D_CDAF);
    }
}
