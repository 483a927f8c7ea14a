//! The multiphonics that were found on the built-in clarinet, as choices of the picker.

use crate::editor::hole_names::fingers_title;
use crate::editor::note_names::{NoteNames, note_name};
use chalumeau_core::bore::alternate_fingerings::FingeringChoice;
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::measure::multiphonics::{self, PlayedMultiphonic};
use chalumeau_core::units::SoundingNote;

/// The line of the picker that they stand on, as a register.
pub const REGISTER: &str = "multiphonic";

/// Those of an instrument: none but of the B flat clarinet, on which they were played.
pub fn choices(file: &InstrumentFile) -> Vec<FingeringChoice> {
    if file.name != Bundled::BFlat.file().name {
        return Vec::new();
    }
    let choice = |(nth, one): (usize, &PlayedMultiphonic)| {
        let names: Vec<&str> = one.open.split_whitespace().collect();
        Some(FingeringChoice {
            written: SoundingNote(one.held).written(file.transposition)?,
            register: REGISTER.to_owned(),
            fingers: one.fingers.clone(),
            open: file.holes.iter().map(|hole| names.contains(&hole.name.as_str())).collect(),
            nth,
        })
    };
    multiphonics::built_in().iter().enumerate().filter_map(choice).collect()
}

/// What a reader should know of one of them.
pub fn about(choice: &FingeringChoice, names: NoteNames, transposition: i8) -> String {
    let Some(one) = multiphonics::built_in().get(choice.nth) else { return String::new() };
    let tones: Vec<String> = one.partials_hz.iter().map(|hz| format!("{hz:.0}")).collect();
    let key = names.of_written(choice.written, transposition).map_or_else(String::new, note_name);
    format!(
        "M{}: hold {key}, breath {:.0} %, breath response Physical. Tones at {} Hz. {}",
        choice.nth + 1,
        100.0 * one.breath,
        tones.join(", "),
        fingers_title(&one.fingers),
    )
}
