//! Controllers that open and stiffen the reed: their factors, smoothed so that their steps are not heard.

use super::breath::BREATH_FOLLOW_S;
use super::step_towards;
use crate::units::clamped_or;

/// A factor counts as arrived when it is this near to its target.
const ARRIVED: f32 = 1e-4;

/// Factors on the H and k of the [`Settings`](crate::instrument::Settings).
#[derive(Clone, Copy, Debug)]
pub struct ReedSmoothing {
    factors: [f32; 2],
    targets: [f32; 2],
}

impl Default for ReedSmoothing {
    fn default() -> Self {
        Self { factors: [1.0; 2], targets: [1.0; 2] }
    }
}

impl ReedSmoothing {
    /// New factors on H and k, 0.1..=10; not a number counts as 1.
    pub fn set(&mut self, h: f32, k: f32) {
        self.targets = [h, k].map(|factor| clamped_or(factor, 0.1, 10.0, 1.0));
    }

    /// The factors on H and k now.
    pub fn factors(&self) -> [f32; 2] {
        self.factors
    }

    /// Moves the factors, as fast as the breath follows its source; whether they have changed.
    pub fn tick(&mut self, tick_s: f64) -> bool {
        if self.factors == self.targets {
            return false;
        }
        let share = step_towards(tick_s, BREATH_FOLLOW_S) as f32;
        for (now, target) in self.factors.iter_mut().zip(self.targets) {
            *now += (target - *now) * share;
            if (*now - target).abs() < ARRIVED {
                *now = target;
            }
        }
        true
    }
}
