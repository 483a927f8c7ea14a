//! A room around the instrument: early reflections of a shoebox, then a reverberant tail, on two channels.
//!
//! - [`Room`]: what a player can set, a part of [`Settings`](super::Settings)
//! - `shoebox` (Design): where player and listener are, the images behind the walls, and how loud the room is
//! - `room_coeffs` (Coeffs): delays, gains and filters at one sample rate
//! - `room_sound` (State): what is in the air, in `delay_line`s; `seats` is what comes from several players
//!
//! The dry sound stays as it is, and stands for the direct sound. Images of order 1 and 2 are exact in time and level
//! (Allen & Berkley 1979, Image method for efficiently simulating small-room acoustics). Everything later comes from a
//! feedback delay network, whose lines lose what the room loses in the time that they last (Jot & Chaigne 1991, Digital
//! delay networks for designing artificial reverberators). Both together are as loud as Sabine's theory says for a
//! listener at that distance (`docs/room.md`).
//!
//! Left out: the head between the ears, the directions in which the instrument sounds, and the air's own absorption,
//! which is a part of *tone*.

mod delay_line;
mod room_coeffs;
mod room_sound;
mod seats;
mod shoebox;
#[cfg(test)]
mod tests;

use crate::units::clamped_or;
pub use room_sound::RoomSound;

/// The room in which the instrument is heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Room {
    /// How much of the room is heard, 0..=1, a factor of its sound. At 0, the default, there is no room. At 1 it is as loud
    /// as in a room of this size and decay, from a quarter of its length away.
    pub amount: f32,
    /// Length of the room, m, 3..=40. Width and height follow from it. Default 12.
    pub size_m: f32,
    /// Time in which the sound of low and middle frequencies decays by 60 dB, s, 0.2..=4. Default 1.2.
    pub decay_s: f32,
    /// From dark, 0, to bright, 1: at 5 kHz the sound decays in a quarter of the time at 0, in half of it at 0.5, the default,
    /// and in the same time at 1.
    pub tone: f32,
}

impl Default for Room {
    fn default() -> Self {
        Self { amount: 0.0, size_m: 12.0, decay_s: 1.2, tone: 0.5 }
    }
}

impl Room {
    /// With every number inside its range; one that is not finite becomes its default. Real-time safe.
    pub fn clamped(self) -> Self {
        let d = Self::default();
        Self {
            amount: clamped_or(self.amount, 0.0, 1.0, d.amount),
            size_m: clamped_or(self.size_m, 3.0, 40.0, d.size_m),
            decay_s: clamped_or(self.decay_s, 0.2, 4.0, d.decay_s),
            tone: clamped_or(self.tone, 0.0, 1.0, d.tone),
        }
    }
}
