//! Comparison of two settings, A and B, also blind.
//!
//! A slot holds the values of all parameters that belong to a setting. Changing sides saves the values of the
//! side that is left. In a blind comparison the sides are called X and Y in random order, only *Reveal* tells which is
//! which, and the window shows no value that would tell.

use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};

/// Values of a setting, normalised.
pub type Values = Vec<(&'static str, f32)>;

/// Which side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ComparisonSide {
    /// The first.
    #[default]
    A,
    /// The second.
    B,
}

impl ComparisonSide {
    /// The other one.
    pub fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

/// Both sides.
#[derive(Clone, Debug, Default)]
pub struct AbComparison {
    /// The side in force.
    pub side: ComparisonSide,
    /// The values of the side that is not in force; `None` until it is first used.
    resting: Option<Values>,
    blind: Option<Blind>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Blind {
    /// X is B.
    is_crossed: bool,
    is_revealed: bool,
}

impl AbComparison {
    /// Goes to `side`: saves `now` for the old side and returns the values to set. Returns nothing for the side in force. A
    /// side that was never used begins as a copy.
    pub fn go(&mut self, side: ComparisonSide, now: Values) -> Values {
        if side == self.side {
            return Vec::new();
        }
        self.side = side;
        let values = self.resting.take().unwrap_or_else(|| now.clone());
        self.resting = Some(now);
        values
    }

    /// Makes the other side a copy of `now`.
    pub fn copy(&mut self, now: Values) {
        self.resting = Some(now);
    }

    /// Whether there is anything to compare.
    pub fn differs(&self, now: &Values) -> bool {
        self.resting.as_ref().is_some_and(|resting| resting != now)
    }

    /// Starts a blind comparison; X and Y get their sides at random.
    pub fn hide(&mut self) {
        self.hide_as(RandomState::new().build_hasher().finish() & 1 == 1);
    }

    /// Starts a blind comparison in which X is B if `is_crossed`.
    pub fn hide_as(&mut self, is_crossed: bool) {
        self.blind = Some(Blind { is_crossed, is_revealed: false });
    }

    /// A blind comparison is on.
    pub fn is_blind(&self) -> bool {
        self.blind.is_some()
    }

    /// Tells which is which.
    pub fn reveal(&mut self) {
        if let Some(blind) = &mut self.blind {
            blind.is_revealed = true;
        }
    }

    /// Whether it has been told.
    pub fn is_revealed(&self) -> bool {
        self.blind.is_some_and(|blind| blind.is_revealed)
    }

    /// Ends a blind comparison.
    pub fn end_blind(&mut self) {
        self.blind = None;
    }

    /// The side behind X (`first`) or Y.
    pub fn behind(&self, first: bool) -> ComparisonSide {
        let is_crossed = self.blind.is_some_and(|blind| blind.is_crossed);
        if first == is_crossed { ComparisonSide::B } else { ComparisonSide::A }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_side_keeps_what_was_set_on_it() {
        let mut compare = AbComparison::default();
        assert_eq!(compare.go(ComparisonSide::A, vec![("lip", 0.1)]), []);
        assert_eq!(compare.go(ComparisonSide::B, vec![("lip", 0.1)]), [("lip", 0.1)], "B begins as A");
        assert_eq!(compare.go(ComparisonSide::A, vec![("lip", 0.9)]), [("lip", 0.1)]);
        assert_eq!(compare.go(ComparisonSide::B, vec![("lip", 0.2)]), [("lip", 0.9)]);
        compare.copy(vec![("lip", 0.5)]);
        assert_eq!(compare.go(ComparisonSide::A, vec![("lip", 0.5)]), [("lip", 0.5)]);
    }

    #[test]
    fn blind_names_cover_both_sides_and_the_lot_falls_both_ways() {
        let mut compare = AbComparison::default();
        for is_crossed in [false, true] {
            compare.hide_as(is_crossed);
            assert_ne!(compare.behind(true), compare.behind(false));
            assert_eq!(compare.behind(true) == ComparisonSide::B, is_crossed);
            assert!(!compare.is_revealed());
        }
        let mut seen = [false; 2];
        for _ in 0..200 {
            compare.hide();
            seen[usize::from(compare.behind(true) == ComparisonSide::B)] = true;
        }
        assert_eq!(seen, [true, true]);
    }
}
