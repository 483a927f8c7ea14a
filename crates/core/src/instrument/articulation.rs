//! How a note begins and ends beside breath and tongue, and what is heard of the player's breath and of the keys: plain numbers,
//! all off at first.

use crate::units::clamped_or;

/// Most that a breath in adds to the time until silence, s.
const BREATH_IN_S: f64 = 1.0;
/// Most that a fall adds beside its own time, s: the air column that it leaves rings on a slower clock.
const AFTER_FALL_S: f64 = 0.5;

/// Scoop, fall, breath in, the sounds of the keys, and the slap of the tongue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Articulation {
    /// How far below its pitch a tongued note begins, cents, 0 (not)..=300. Default 0.
    pub scoop_cents: f32,
    /// Time from when the note may speak until it has its pitch, s, 0.02..=1. Default 0.15.
    pub scoop_s: f32,
    /// How far the pitch falls when the last key comes up, cents, 0 (the note ends at once)..=1200. Default 0.
    pub fall_cents: f32,
    /// Time in which it falls and fades, s, 0.05..=2. Default 0.4.
    pub fall_s: f32,
    /// How much is heard of the player's breath in after a phrase, 0 (nothing)..=1 (40 dB below a mezzo-forte). It is an amplitude.
    /// Default 0.
    pub breath_in: f32,
    /// How much is heard of pads and fingers, 0 (nothing)..=1 (at most 35 dB below a mezzo-forte). Default 0.
    pub key_sounds: f32,
    /// How hard the tongue slaps the reed where a note is tongued, 0 (it does not)..=1, times the velocity. Default 0.
    pub slap: f32,
}

impl Default for Articulation {
    fn default() -> Self {
        Self {
            scoop_cents: 0.0,
            scoop_s: 0.15,
            fall_cents: 0.0,
            fall_s: 0.4,
            breath_in: 0.0,
            key_sounds: 0.0,
            slap: 0.0,
        }
    }
}

impl Articulation {
    /// Every number inside its range; a number that is not finite becomes its default. Real-time safe.
    pub(super) fn clamped(self) -> Self {
        let d = Self::default();
        Self {
            scoop_cents: clamped_or(self.scoop_cents, 0.0, 300.0, d.scoop_cents),
            scoop_s: clamped_or(self.scoop_s, 0.02, 1.0, d.scoop_s),
            fall_cents: clamped_or(self.fall_cents, 0.0, 1_200.0, d.fall_cents),
            fall_s: clamped_or(self.fall_s, 0.05, 2.0, d.fall_s),
            breath_in: clamped_or(self.breath_in, 0.0, 1.0, d.breath_in),
            key_sounds: clamped_or(self.key_sounds, 0.0, 1.0, d.key_sounds),
            slap: clamped_or(self.slap, 0.0, 1.0, d.slap),
        }
    }

    /// Time that these settings add at most to the tail of an instrument, s: what a host must still play after the last key beside
    /// [`Clarinet::TAIL_S`](super::Clarinet::TAIL_S). Real-time safe.
    pub fn tail_s(&self) -> f64 {
        let settings = self.clamped();
        let fall = if settings.fall_cents > 0.0 { f64::from(settings.fall_s) + AFTER_FALL_S } else { 0.0 };
        fall + if settings.breath_in > 0.0 { BREATH_IN_S } else { 0.0 }
    }
}
