//! How hard each key was struck: a key that sounds again when a later one comes up is as loud as it was.

use crate::units::SoundingNote;

/// Velocities of all keys, 0..=1.
#[derive(Clone, Copy, Debug)]
pub struct Velocities([f32; 128]);

impl Default for Velocities {
    fn default() -> Self {
        Self([0.5; 128])
    }
}

impl Velocities {
    /// A key is struck.
    pub fn strike(&mut self, key: SoundingNote, velocity: f32) {
        if let Some(of_key) = self.0.get_mut(usize::from(key.0)) {
            *of_key = velocity;
        }
    }

    /// With which velocity a key was struck last.
    pub fn of(&self, key: SoundingNote) -> f32 {
        self.0.get(usize::from(key.0)).copied().unwrap_or(0.5)
    }
}
