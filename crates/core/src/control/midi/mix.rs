//! Volume and pan, after the instrument: CC7 and CC10, and those of the heard note.
//!
//! One instrument plays all channels, so the last value of any channel counts. Volume is the square of CC7 over 127, 0 dB at
//! 127, which is also the value until the first CC7 comes. Pan is the middle at 64 and a side at 0 and 127. The note's
//! volume multiplies, its pan adds. Fine parts (CC39, CC42) are left out: changes are smoothed.
//!
//! Source: General MIDI Level 1 Developer Guidelines (2nd revision, 1998), 40 log10(CC7 / 127) dB; RP-036 (default pan
//! formula): 0 and 1 are both the left side, so that 64 is the middle.

use crate::control::notes::HeldNote;
use crate::event::Event;

/// Controller values, 0..=127.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MixControllers {
    /// CC7.
    pub volume: u8,
    /// CC10.
    pub pan: u8,
}

impl Default for MixControllers {
    fn default() -> Self {
        Self { volume: 127, pan: 64 }
    }
}

/// The controllers, and what was said last.
#[derive(Clone, Copy, Debug)]
pub struct Mix {
    /// The controllers now.
    pub controllers: MixControllers,
    gain: f32,
    position: f32,
}

impl Default for Mix {
    fn default() -> Self {
        Self { controllers: MixControllers::default(), gain: 1.0, position: 0.0 }
    }
}

impl Mix {
    /// What has changed, for the note that is heard.
    pub fn changed(&mut self, heard: Option<&HeldNote>) -> [Option<Event>; 2] {
        let MixControllers { volume, pan } = self.controllers;
        let (note_gain, note_pan) = heard.map_or((1.0, 0.0), |note| (note.gain, note.pan));
        let gain = (f32::from(volume) / 127.0).powi(2) * note_gain;
        let position = f32::from(pan.max(1) - 1) / 63.0 - 1.0;
        let position = (position + note_pan).clamp(-1.0, 1.0);
        let has_gain = std::mem::replace(&mut self.gain, gain) != gain;
        let has_moved = std::mem::replace(&mut self.position, position) != position;
        [has_gain.then_some(Event::Volume { gain }), has_moved.then_some(Event::Pan { position })]
    }
}
