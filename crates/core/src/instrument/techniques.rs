//! What a player does beside blowing a note: growl, flutter tongue, subtone, the vocal tract. Plain numbers, all 0 at first.

use crate::units::clamped_or;

/// What the pitch of a growling voice goes by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum GrowlPitch {
    /// An interval from the fingered note.
    #[default]
    Interval,
    /// A frequency of its own.
    Fixed,
}

impl GrowlPitch {
    /// All, in the order of the parameter that chooses one.
    pub const ALL: [Self; 2] = [Self::Interval, Self::Fixed];
}

/// Extended techniques.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Techniques {
    /// How much the player sings into the instrument, 0 (not)..=1 (the voice alone closes and opens the breath). Default 0.
    pub growl: f32,
    /// What the voice's pitch goes by. Default [`GrowlPitch::Interval`].
    pub growl_pitch: GrowlPitch,
    /// Interval of the voice from the note, semitones, -24..=12. Default -12.
    pub growl_semitones: f32,
    /// Pitch of a fixed voice, Hz, 60..=400. Default 110.
    pub growl_hz: f32,
    /// How far the fluttering tongue closes the breath's way, 0 (not)..=1. Default 0.
    pub flutter: f32,
    /// Rate of the flutter, Hz, 15..=35. Default 25.
    pub flutter_hz: f32,
    /// Subtone: how much the lower lip covers and damps the reed, 0 (not)..=1. Default 0.
    pub subtone: f32,
}

impl Default for Techniques {
    fn default() -> Self {
        Self {
            growl: 0.0,
            growl_pitch: GrowlPitch::Interval,
            growl_semitones: -12.0,
            growl_hz: 110.0,
            flutter: 0.0,
            flutter_hz: 25.0,
            subtone: 0.0,
        }
    }
}

impl Techniques {
    /// Every number inside its range; a number that is not finite becomes its default. Real-time safe.
    pub(super) fn clamped(self) -> Self {
        let d = Self::default();
        Self {
            growl: clamped_or(self.growl, 0.0, 1.0, d.growl),
            growl_pitch: self.growl_pitch,
            growl_semitones: clamped_or(self.growl_semitones, -24.0, 12.0, d.growl_semitones),
            growl_hz: clamped_or(self.growl_hz, 60.0, 400.0, d.growl_hz),
            flutter: clamped_or(self.flutter, 0.0, 1.0, d.flutter),
            flutter_hz: clamped_or(self.flutter_hz, 15.0, 35.0, d.flutter_hz),
            subtone: clamped_or(self.subtone, 0.0, 1.0, d.subtone),
        }
    }
}

/// The resonance of the vocal tract that the player tunes; see [`vocal_tract`](super::vocal_tract).
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Tract {
    /// From an open throat without effect, 0, to one tuned with all strength, 1. Default 0.
    pub amount: f32,
    /// Where the resonance lies re the fingered note, semitones, -24..=24. Below the note it pulls the note down. Default 0.
    pub interval_semitones: f32,
}

impl Tract {
    /// Every number inside its range; a number that is not finite becomes its default. Real-time safe.
    pub(super) fn clamped(self) -> Self {
        Self {
            amount: clamped_or(self.amount, 0.0, 1.0, 0.0),
            interval_semitones: clamped_or(self.interval_semitones, -24.0, 24.0, 0.0),
        }
    }
}
