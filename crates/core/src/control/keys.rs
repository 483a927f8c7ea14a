//! Which of the held keys sounds: the last one pressed; when it is released, the one pressed before it. Real-time safe.

use crate::units::SoundingNote;

/// Keys that can be held at once; more push the oldest out.
pub const MOST: usize = 16;

/// The held keys, oldest first.
#[derive(Clone, Copy, Debug)]
pub struct Keys {
    held: [SoundingNote; MOST],
    count: usize,
}

impl Default for Keys {
    fn default() -> Self {
        Self { held: [SoundingNote(0); MOST], count: 0 }
    }
}

impl Keys {
    /// The key that sounds; `None` while no key is held.
    pub fn last(&self) -> Option<SoundingNote> {
        self.count.checked_sub(1).map(|last| self.held[last])
    }

    /// The held keys, oldest first.
    pub fn held(&self) -> &[SoundingNote] {
        &self.held[..self.count]
    }

    /// Whether no key is held.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// A key goes down; again, if it was held. Returns the key that it pushes out, if one is.
    pub fn press(&mut self, note: SoundingNote) -> Option<SoundingNote> {
        self.release(note);
        let pushed_out = (self.count == MOST).then_some(self.held[0]);
        if pushed_out.is_some() {
            self.held.copy_within(1.., 0);
            self.count -= 1;
        }
        self.held[self.count] = note;
        self.count += 1;
        pushed_out
    }

    /// A key comes up.
    pub fn release(&mut self, note: SoundingNote) {
        if let Some(at) = self.held[..self.count].iter().position(|&held| held == note) {
            self.held.copy_within(at + 1..self.count, at);
            self.count -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn last_key_is_heard_and_gives_way_to_the_one_before() {
        let mut keys = Keys::default();
        assert!(keys.is_empty() && keys.last().is_none());
        for key in 60..63 {
            keys.press(SoundingNote(key));
        }
        keys.press(SoundingNote(60));
        assert_eq!(keys.last(), Some(SoundingNote(60)));
        keys.release(SoundingNote(61));
        keys.release(SoundingNote(60));
        assert_eq!(keys.last(), Some(SoundingNote(62)));
        keys.release(SoundingNote(99));
        keys.release(SoundingNote(62));
        assert!(keys.is_empty());
    }

    #[test]
    fn more_keys_than_fingers_push_the_oldest_out() {
        let mut keys = Keys::default();
        for key in 0..40 {
            assert_eq!(keys.press(SoundingNote(key)), key.checked_sub(MOST as u8).map(SoundingNote));
        }
        assert_eq!(keys.last(), Some(SoundingNote(39)));
        for key in (25..40).rev() {
            keys.release(SoundingNote(key));
        }
        assert_eq!(keys.last(), Some(SoundingNote(24)));
        keys.release(SoundingNote(24));
        assert!(keys.is_empty());
    }
}
