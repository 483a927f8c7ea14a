//! New settings of lip, reed and vent loss, reached in a little time, as a player's lip moves: at once they would click.
//!
//! A step of the reed's law is a step of the flow, and what is heard of a flow is its slope: the numbers gather speed. While nothing
//! sounds, new settings hold at once.

use super::step_towards;
use crate::instrument::settings::{BreathResponse, Settings};
use crate::reed::law::coupled_k;

/// Numbers that shape reed and flow: strength, lip, zeta, damping, lay, H, k, A, the loss of open holes, and how far the lip follows the
/// player's rule.
const NUMBERS: usize = 10;
/// Index of how far the lip follows the rule.
const FOLLOWS: usize = NUMBERS - 1;
/// A number counts as arrived when it is this near to its target, as a share of it: 0.001 dB of flow. Targets below
/// [`SMALL`], as a sharp lay's 0, count as that.
const ARRIVED: f32 = 1e-4;
const SMALL: f32 = 0.1;
/// Each of two time constants, s: 99 % of the way in 37 ms.
const MOVE_S: f64 = 0.0055;

/// The numbers on their way to those of the [`Settings`].
#[derive(Clone, Copy, Debug, Default)]
pub struct ReedGlide {
    /// `None` once they have arrived.
    under_way: Option<Way>,
}

/// Where the numbers are, and what they follow, which goes ahead.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Way {
    now: [f32; NUMBERS],
    ahead: [f32; NUMBERS],
}

/// The numbers of settings; k as it is played.
fn numbers(settings: &Settings) -> [f32; NUMBERS] {
    let k = if settings.coupled { coupled_k(f64::from(settings.reed_h)) as f32 } else { settings.reed_k };
    let Settings { strength, lip, zeta, damping, lay, reed_h, reed_a, vent_loss, .. } = *settings;
    let follows = f32::from(u8::from(settings.breath_response == BreathResponse::Played));
    [strength, lip, zeta, damping, lay, reed_h, k, reed_a, vent_loss, follows]
}

impl ReedGlide {
    /// The settings change from `old` to `new` while something sounds.
    pub fn begin(&mut self, old: &Settings, new: &Settings) {
        let mut way = self.under_way.unwrap_or_else(|| Way { now: numbers(old), ahead: numbers(old) });
        if old.breath_response == BreathResponse::Physical {
            // The lip has followed nothing, whatever it was to follow before.
            (way.now[FOLLOWS], way.ahead[FOLLOWS]) = (0.0, 0.0);
        }
        let arrived = Way { now: numbers(new), ahead: numbers(new) };
        self.under_way = (way != arrived).then_some(way);
    }

    /// Nothing sounds: all numbers are where they should be.
    pub fn settle(&mut self) {
        self.under_way = None;
    }

    /// Moves the numbers; whether they have changed.
    pub fn tick(&mut self, target: &Settings, tick_s: f64) -> bool {
        let Some(Way { now, ahead }) = &mut self.under_way else { return false };
        let share = step_towards(tick_s, MOVE_S) as f32;
        let mut has_arrived = true;
        for ((now, ahead), target) in now.iter_mut().zip(ahead).zip(numbers(target)) {
            *ahead += (target - *ahead) * share;
            *now += (*ahead - *now) * share;
            let far = ARRIVED * target.abs().max(SMALL);
            has_arrived &= (*now - target).abs() <= far && (*ahead - target).abs() <= far;
        }
        if has_arrived {
            self.under_way = None;
        }
        true
    }

    /// The settings with the reed as it is now.
    pub fn over(&self, settings: Settings) -> Settings {
        let Some(Way { now, .. }) = self.under_way else { return settings };
        let [strength, lip, zeta, damping, lay, reed_h, reed_k, reed_a, vent_loss, _] = now;
        let coupled = false;
        Settings { strength, lip, zeta, damping, lay, reed_h, reed_k, coupled, reed_a, vent_loss, ..settings }
    }

    /// How far a lip that is to follow the player's rule does so, 0..=1: it sets out where the breath was physical until now.
    pub fn follows(&self) -> f64 {
        self.under_way.map_or(1.0, |Way { now, .. }| f64::from(now[FOLLOWS]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reed_arrives_within_50_ms_and_never_jumps() {
        let old = Settings::default();
        let new = Settings { lip: 0.7, lay: 0.0, reed_h: 2.0, strength: 4.0, ..old };
        let mut glide = ReedGlide::default();
        glide.begin(&old, &new);
        let (before, begun) = (old.reed_law(), glide.over(new).reed_law());
        assert_eq!((begun.h(), begun.a()), (before.h(), before.a()), "where it was");
        // The glide keeps k in single precision.
        assert!((begun.k() / before.k() - 1.0).abs() < 1e-7, "{begun:?}");
        let tick_s = 16.0 / 96_000.0;
        let (mut last, mut ticks) = (old.closing_pa(), 0);
        while glide.tick(&new, tick_s) {
            let closing = glide.over(new).closing_pa();
            assert!((closing / last - 1.0).abs() < 0.05, "tick {ticks}: {last} to {closing}");
            (last, ticks) = (closing, ticks + 1);
            let arrived = (closing / new.closing_pa() - 1.0).abs();
            assert!(arrived < 0.02 || f64::from(ticks) * tick_s < 0.05, "{arrived} after {ticks} ticks");
        }
        assert_eq!(glide.over(new), new);
        assert!(f64::from(ticks) * tick_s < 0.15, "{ticks}");
    }

    #[test]
    fn a_lip_that_begins_to_follow_the_rule_sets_out_from_the_free_reed() {
        let played = Settings { breath_response: BreathResponse::Played, ..Settings::default() };
        let physical = Settings { breath_response: BreathResponse::Physical, ..played };
        let mut glide = ReedGlide::default();
        assert_eq!(glide.follows(), 1.0);
        for _ in 0..2 {
            glide.begin(&physical, &played);
            let mut last = glide.follows();
            assert_eq!(last, 0.0);
            for _ in 0..60 {
                glide.tick(&played, 1.0 / 6_000.0);
                assert!((0.0..0.02).contains(&(glide.follows() - last)));
                last = glide.follows();
            }
            assert!(last > 0.4, "{last}");
            // Turned back on the way, it begins anew.
            glide.begin(&played, &physical);
        }
    }

    #[test]
    fn a_new_target_on_the_way_goes_on_from_there() {
        let (old, new) = (Settings::default(), Settings { zeta: 0.9, ..Settings::default() });
        let mut glide = ReedGlide::default();
        glide.begin(&old, &new);
        (0..50).for_each(|_| assert!(glide.tick(&new, 1.0 / 6_000.0)));
        let half = glide.over(new).zeta;
        glide.begin(&new, &old);
        assert_eq!(glide.over(old).zeta, half);
        glide.settle();
        assert_eq!(glide.over(old), old);
    }
}
