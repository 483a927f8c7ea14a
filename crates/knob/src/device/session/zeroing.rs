//! ZERO until the knob's angle shows that it has been heard.
//!
//! ZERO has no answer of its own, and a line may lose it. A knob that has heard it says an angle near zero from then on; one
//! that has not is told again, for 200 ms: that is still the same act. ARM waits for it. A knob that is armed at a zero
//! which the user believes gone turns back to it by itself.

use super::{INSIST_US, TRIES};

/// ZERO that could not be said for this long is forgotten, us: FREE, for which it may wait, has had its effect ten times over.
const PATIENCE_US: i64 = 500_000;
/// As far from zero as this, degrees, and what the knob turns meanwhile, it has been heard: a hand on the knob is not still, and a
/// zero that is wrong by so little turns nothing.
const NEAR_DEG: f64 = 5.0;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Goal {
    /// The user wants none.
    #[default]
    None,
    /// To be said, as soon as it may; since when, once time has passed, us.
    Due { since_us: Option<i64> },
    /// Said so often, the last time then, us.
    Said { tries: u32, at_us: i64 },
}

/// See the module.
#[derive(Clone, Copy, Debug, Default)]
pub struct Zeroing {
    goal: Goal,
    /// Not seen to be heard in all its tries.
    is_ignored: bool,
}

impl Zeroing {
    /// The user wants the present position to be zero.
    pub fn want(&mut self) {
        self.goal = Goal::Due { since_us: None };
    }

    /// It comes too late.
    pub fn forget(&mut self) {
        self.goal = Goal::None;
    }

    /// Whether it is wanted and not seen to be heard.
    pub fn is_pending(&self) -> bool {
        self.goal != Goal::None
    }

    /// True once after an act that the knob has not heard.
    pub fn take_ignored(&mut self) -> bool {
        std::mem::take(&mut self.is_ignored)
    }

    /// Takes in where the knob says that it is, and how fast it turns. True when that shows that ZERO has been heard.
    pub fn hear(&mut self, angle_deg: f64, velocity_deg_s: f64, now_us: i64) -> bool {
        let Goal::Said { at_us, .. } = self.goal else { return false };
        let turned_deg = velocity_deg_s.abs() * 1e-6 * (now_us - at_us) as f64;
        let is_heard = angle_deg.abs() <= NEAR_DEG + turned_deg;
        if is_heard {
            self.goal = Goal::None;
        }
        is_heard
    }

    /// Whether ZERO is to be said now, if it may be said.
    pub fn poll(&mut self, may_be_said: bool, now_us: i64) -> bool {
        if !may_be_said {
            if let Goal::Due { since_us } = &mut self.goal
                && now_us - *since_us.get_or_insert(now_us) > PATIENCE_US
            {
                (self.goal, self.is_ignored) = (Goal::None, true);
            }
            return false;
        }
        let tries = match self.goal {
            Goal::Due { .. } => 0,
            Goal::Said { tries, at_us } if now_us - at_us >= INSIST_US => tries,
            Goal::None | Goal::Said { .. } => return false,
        };
        let is_left = tries < TRIES;
        self.goal = if is_left { Goal::Said { tries: tries + 1, at_us: now_us } } else { Goal::None };
        self.is_ignored |= !is_left;
        is_left
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(zeroing: &mut Zeroing, from_ms: i64, to_ms: i64) -> usize {
        (from_ms..to_ms).filter(|ms| zeroing.poll(true, 1_000 * ms)).count()
    }

    #[test]
    fn it_is_said_once_to_a_knob_that_hears() {
        let mut zeroing = Zeroing::default();
        assert_eq!(said(&mut zeroing, 0, 100), 0);
        zeroing.want();
        assert_eq!(said(&mut zeroing, 100, 110), 1);
        assert!(!zeroing.hear(200.0, 0.0, 110_000), "this was on its way already");
        assert!(zeroing.is_pending());
        assert!(zeroing.hear(0.4, 0.0, 120_000));
        assert!(!zeroing.is_pending() && !zeroing.hear(0.4, 0.0, 121_000));
        assert_eq!((said(&mut zeroing, 120, 1_000), zeroing.take_ignored()), (0, false));
    }

    #[test]
    fn it_is_said_again_to_one_that_does_not_and_then_given_up() {
        let mut zeroing = Zeroing::default();
        zeroing.want();
        for ms in 0..1_000 {
            zeroing.hear(200.0, 30.0, 1_000 * ms);
            assert_eq!(zeroing.poll(true, 1_000 * ms), [0, 50, 100, 150].contains(&ms), "{ms}");
            assert_eq!(zeroing.take_ignored(), ms == 200);
        }
        assert!(!zeroing.is_pending());
    }

    #[test]
    fn a_knob_that_turns_on_meanwhile_has_heard_it() {
        let mut zeroing = Zeroing::default();
        zeroing.want();
        assert!(zeroing.poll(true, 0));
        zeroing.hear(300.0, 200.0, 20_000);
        assert!(zeroing.is_pending());
        zeroing.hear(8.0, 200.0, 20_000);
        assert!(!zeroing.is_pending());
    }

    #[test]
    fn what_cannot_be_said_soon_is_never_said() {
        let mut zeroing = Zeroing::default();
        zeroing.want();
        for ms in 0..=500 {
            assert!(!zeroing.poll(false, 1_000 * ms) && zeroing.is_pending(), "{ms}");
        }
        assert!(!zeroing.poll(false, 501_000) && zeroing.take_ignored());
        assert_eq!(said(&mut zeroing, 502, 2_000), 0);
    }
}
