//! Letters of the computer's keyboard as a piano, for a window that has no host: the row of A has the white keys, the row above it
//! the black ones. Page Up and Page Down move them by an octave, C and V make them softer and louder, as in many DAWs.
//!
//! The window system tells letters, not places, so the sixth black key has two of them: Y, and Z where that is in its place.

use egui::{Event, Key, Ui};

use super::PLAIN;
use crate::editor::Action;
use chalumeau_core::units::SoundingNote;

/// Letters, and how many semitones they lie above the lowest.
const LETTERS: [(Key, u8); 17] = [
    (Key::A, 0),
    (Key::W, 1),
    (Key::S, 2),
    (Key::E, 3),
    (Key::D, 4),
    (Key::F, 5),
    (Key::T, 6),
    (Key::G, 7),
    (Key::Y, 8),
    (Key::Z, 8),
    (Key::H, 9),
    (Key::U, 10),
    (Key::J, 11),
    (Key::K, 12),
    (Key::O, 13),
    (Key::L, 14),
    (Key::P, 15),
];
/// Where the lowest letter begins: C4.
const FIRST: u8 = 60;

/// How far the velocity of letters goes, and by how much C and V change it.
const VELOCITIES: (f32, f32) = (0.125, 1.0);
const VELOCITY_STEP: f32 = 0.125;

/// The letters that are down, and where and how they play.
#[derive(Clone, Debug)]
pub struct TypedLetters {
    lowest: u8,
    velocity: f32,
    held: Vec<(Key, SoundingNote)>,
    /// Came up in the last frame. Some window systems repeat a held letter as up and down: such a one does not come up.
    leaving: Vec<Key>,
}

impl Default for TypedLetters {
    fn default() -> Self {
        Self { lowest: FIRST, velocity: PLAIN, held: Vec::new(), leaving: Vec::new() }
    }
}

impl TypedLetters {
    /// The letter that plays a key.
    pub fn letter(&self, note: u8) -> Option<&'static str> {
        let above = note.checked_sub(self.lowest)?;
        LETTERS.iter().find(|(_, semitones)| *semitones == above).map(|(key, _)| key.name())
    }

    /// Whether a letter holds this key down.
    pub fn holds(&self, note: u8) -> bool {
        self.held.iter().any(|(_, held)| held.0 == note)
    }

    /// Plays what has been typed since the last frame. `range`: the instrument's lowest and highest key; `is_text`: letters are text now;
    /// `plays`: whether a key sounds.
    pub fn play(
        &mut self,
        ui: &Ui,
        range: (u8, u8),
        is_text: bool,
        plays: impl Fn(SoundingNote) -> bool,
        actions: &mut Vec<Action>,
    ) {
        let octave = |note: u8| note - note % 12;
        self.lowest = self.lowest.clamp(octave(range.0), octave(range.1));
        let (events, modifiers) = ui.input(|input| (input.events.clone(), input.modifiers));
        let is_left = events.iter().any(|event| matches!(event, Event::WindowFocused(false)));
        // Under a modifier the window system tells other letters: it would not tell that these come up.
        if is_text || is_left || modifiers.any() {
            self.release(actions);
            return;
        }
        let typed: Vec<(Key, bool)> = events
            .iter()
            .filter_map(|event| match event {
                Event::Key { key, pressed, repeat: false, .. } => Some((*key, *pressed)),
                _ => None,
            })
            .collect();
        let is_struck = |key: Key| typed.contains(&(key, true));
        for key in std::mem::take(&mut self.leaving) {
            if !is_struck(key) {
                self.lift(key, actions);
            }
        }
        for &(key, is_down) in &typed {
            match key {
                Key::PageUp if is_down => self.lowest = (self.lowest + 12).min(octave(range.1)),
                Key::PageDown if is_down => {
                    self.lowest = self.lowest.saturating_sub(12).max(octave(range.0));
                }
                Key::C | Key::V if is_down => {
                    let step = if key == Key::V { VELOCITY_STEP } else { -VELOCITY_STEP };
                    self.velocity = (self.velocity + step).clamp(VELOCITIES.0, VELOCITIES.1);
                }
                _ if is_down => {
                    self.leaving.retain(|leaving| *leaving != key);
                    self.press(key, &plays, actions);
                }
                _ => self.leaving.push(key),
            }
        }
        if !self.leaving.is_empty() {
            ui.ctx().request_repaint();
        }
    }

    /// Lets go of every letter.
    pub fn release(&mut self, actions: &mut Vec<Action>) {
        self.leaving.clear();
        while let Some(&(key, _)) = self.held.last() {
            self.lift(key, actions);
        }
    }

    fn press(&mut self, key: Key, plays: impl Fn(SoundingNote) -> bool, actions: &mut Vec<Action>) {
        let Some((_, semitones)) = LETTERS.iter().find(|(letter, _)| *letter == key) else { return };
        let note = SoundingNote(self.lowest + semitones);
        if self.held.iter().any(|(held, _)| *held == key) || !plays(note) {
            return;
        }
        self.held.push((key, note));
        actions.push(Action::NoteOn { note, velocity: self.velocity });
    }

    fn lift(&mut self, key: Key, actions: &mut Vec<Action>) {
        let Some(at) = self.held.iter().position(|(held, _)| *held == key) else { return };
        let (_, note) = self.held.remove(at);
        if !self.held.iter().any(|(_, other)| *other == note) {
            actions.push(Action::NoteOff { note });
        }
    }
}
