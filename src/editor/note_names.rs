//! Names of notes: as they are written for this instrument, or as they sound.

use serde::{Deserialize, Serialize};

use chalumeau_core::units::{SoundingNote, WrittenNote};

/// Which pitch the names of notes say, in every view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoteNames {
    /// The written one, as a clarinettist reads it.
    #[default]
    Written,
    /// The sounding one, *concert* in the states of projects.
    #[serde(rename = "concert")]
    Sounding,
}

impl NoteNames {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Written, Self::Sounding];

    /// The text on its button.
    pub fn title(self) -> &'static str {
        match self {
            Self::Written => "Written",
            Self::Sounding => "Sounding",
        }
    }

    /// The other one.
    pub fn other(self) -> Self {
        match self {
            Self::Written => Self::Sounding,
            Self::Sounding => Self::Written,
        }
    }

    /// The note that is named, as a MIDI number, for a sounding note of an instrument with this transposition.
    pub fn of_sounding(self, note: SoundingNote, transposition: i8) -> Option<u8> {
        match self {
            Self::Written => note.written(transposition).map(|note| note.0),
            Self::Sounding => Some(note.0),
        }
    }

    /// The same for a written note.
    pub fn of_written(self, note: WrittenNote, transposition: i8) -> Option<u8> {
        match self {
            Self::Written => Some(note.0),
            Self::Sounding => note.sounding(transposition).map(|note| note.0),
        }
    }
}

/// The name of a pitch as musicians write it, with the flats they use.
pub fn note_name(midi: u8) -> String {
    const NAMES: [&str; 12] = ["C", "C#", "D", "Eb", "E", "F", "F#", "G", "Ab", "A", "Bb", "B"];
    format!("{}{}", NAMES[usize::from(midi % 12)], i16::from(midi / 12) - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_kinds_of_names_name_the_same_note() {
        let (written, sounding) = (WrittenNote(60), SoundingNote(58));
        for (names, wanted) in [(NoteNames::Written, 60), (NoteNames::Sounding, 58)] {
            assert_eq!(names.of_written(written, 2), Some(wanted));
            assert_eq!(names.of_sounding(sounding, 2), Some(wanted));
            assert_eq!(names.other().other(), names);
        }
        assert_eq!(note_name(58), "Bb3");
    }
}
