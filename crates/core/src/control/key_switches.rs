//! Key switches: five keys in a row that make no sound and choose the fingerings of the notes that follow.
//!
//! As in libraries of samples, a key of the row is struck once and need not be held: its choice stays until another key of the row
//! is struck. A note that is sounding keeps its fingering. The row is off unless the player chooses one of its two places: C1 to
//! E1 lies below every bundled instrument, C2 to E2 below the sopranos, where a keyboard of five octaves has it. A key of the row is
//! silent even where the instrument has a note for it. Left out: multiphonics, which are more than a row holds.

use crate::control::notes::{Note, NoteAddress};
use crate::event::Fingerings;

/// What the keys of the row choose, from its lowest key up.
pub const ROW: [Fingerings; 5] = [
    Fingerings::Chart,
    Fingerings::Alternate(1),
    Fingerings::Alternate(2),
    Fingerings::Alternate(3),
    Fingerings::ByContext,
];

/// Where the row is. Keys are as they are struck, before any transposition.
///
/// ```
/// use chalumeau_core::control::key_switches::KeySwitches;
/// use chalumeau_core::event::Fingerings;
///
/// assert_eq!(KeySwitches::C2.chosen(37), Some(Fingerings::Alternate(1)));
/// assert_eq!(KeySwitches::C2.chosen(41), None, "above the row");
/// assert_eq!(KeySwitches::Off.chosen(37), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum KeySwitches {
    /// Nowhere: every key plays.
    #[default]
    Off,
    /// From C1 to E1, MIDI keys 24 to 28.
    C1,
    /// From C2 to E2, MIDI keys 36 to 40.
    C2,
}

impl KeySwitches {
    /// All, in the order of the parameter that chooses one.
    pub const ALL: [Self; 3] = [Self::Off, Self::C1, Self::C2];

    /// The lowest key of the row.
    pub fn lowest(self) -> Option<u8> {
        match self {
            Self::Off => None,
            Self::C1 => Some(24),
            Self::C2 => Some(36),
        }
    }

    /// What a key chooses, if it is one of the row. Real-time safe.
    pub fn chosen(self, key: u8) -> Option<Fingerings> {
        ROW.get(usize::from(key.checked_sub(self.lowest()?)?)).copied()
    }
}

/// The row, and where one of its keys is down.
#[derive(Clone, Copy, Debug, Default)]
pub struct SwitchKeys {
    row: KeySwitches,
    /// The one that went down last on each channel, until it comes up.
    down: [Option<Note>; 16],
}

impl SwitchKeys {
    /// Where the row is.
    pub fn row(&self) -> KeySwitches {
        self.row
    }

    /// Moves the row. What was down in it is no key of the new one, so nothing would tell when it comes up.
    pub fn set_row(&mut self, row: KeySwitches) {
        if self.row != row {
            *self = Self { row, ..Self::default() };
        }
    }

    /// What a key chooses that goes down, if it is one of the row. The channel is 0..=15.
    pub fn press(&mut self, note: Note) -> Option<Fingerings> {
        let chosen = self.row.chosen(note.key)?;
        self.down[usize::from(note.channel % 16)] = Some(note);
        Some(chosen)
    }

    /// Keys come up.
    pub fn release(&mut self, address: NoteAddress) {
        for down in &mut self.down {
            down.take_if(|note| address.fits(*note));
        }
    }

    /// All keys come up.
    pub fn release_all(&mut self) {
        self.down = [None; 16];
    }

    /// Whether one is down on this channel, 0..=15.
    pub fn is_down_on(&self, channel: u8) -> bool {
        self.down[usize::from(channel % 16)].is_some()
    }
}
