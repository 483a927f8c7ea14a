//! Alternate fingerings: usual fingerings of Boehm clarinets that are not in an instrument's chart.
//!
//! An instrument file has one fingering per note, which is tuned and played. The alternates are in
//! `data/boehm_alternate_fingerings.toml`. Each one changes the chart fingering of another note. A user can try, hear and
//! see an alternate; it is not tuned. Instruments whose holes have other names get no alternates.

use crate::bore::instrument_file::InstrumentFile;
use crate::units::{WrittenNote, midi_of_name};
use serde::Deserialize;
use std::sync::LazyLock;

/// A fingering that a user can choose: from the chart, or an alternate.
#[derive(Clone, Debug, PartialEq)]
pub struct FingeringChoice {
    /// The note it plays.
    pub written: WrittenNote,
    /// Register of the note, as in the chart.
    pub register: String,
    /// What the fingers do, for a reader.
    pub fingers: String,
    /// Whether each hole is open, `[hole]` in the order of [`InstrumentFile::holes`].
    pub open: Vec<bool>,
    /// 0 for the chart fingering of the note; 1, 2 ... for its alternates.
    pub nth: usize,
}

/// One entry of the data file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Alternate {
    /// The note it plays.
    written: String,
    /// The note whose chart fingering it starts from.
    from: String,
    /// Holes to open, separated by spaces.
    #[serde(default)]
    open: String,
    /// Holes to close, separated by spaces.
    #[serde(default)]
    close: String,
    /// What the fingers do.
    fingers: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AlternatesFile {
    alternate: Vec<Alternate>,
}

static BOEHM: LazyLock<Vec<Alternate>> = LazyLock::new(|| {
    let text = include_str!("../../data/boehm_alternate_fingerings.toml");
    // PANIC: the text is a constant of this program and a test below parses it.
    toml::from_str::<AlternatesFile>(text).expect("the alternate fingerings are valid").alternate
});

/// All fingerings of an instrument: those of its chart, each followed by its alternates. Allocates.
pub fn fingering_choices(file: &InstrumentFile) -> Vec<FingeringChoice> {
    let mut all: Vec<FingeringChoice> = Vec::with_capacity(file.fingerings.len() + BOEHM.len());
    for fingering in &file.fingerings {
        let nth = all.iter().filter(|other| other.written == fingering.written).count();
        all.push(FingeringChoice {
            written: fingering.written,
            register: fingering.register.clone(),
            fingers: fingering.fingers.clone(),
            open: fingering.open.clone(),
            nth,
        });
    }
    for alternate in BOEHM.iter() {
        let Some(written) = midi_of_name(&alternate.written).map(WrittenNote) else { continue };
        let Some(at) = all.iter().rposition(|choice| choice.written == written) else { continue };
        let Some(open) = alternate.applied_to(file) else { continue };
        let known = &all[at];
        if all.iter().any(|other| other.written == written && other.open == open) {
            continue;
        }
        let choice = FingeringChoice {
            written,
            register: known.register.clone(),
            fingers: alternate.fingers.clone(),
            open,
            nth: known.nth + 1,
        };
        all.insert(at + 1, choice);
    }
    all
}

impl Alternate {
    /// Whether each hole of `file` is open. `None` if the note or a hole is missing, or if a hole already is as this entry
    /// wants it.
    fn applied_to(&self, file: &InstrumentFile) -> Option<Vec<bool>> {
        let from = midi_of_name(&self.from).map(WrittenNote)?;
        let mut open = file.fingering(from)?.open.clone();
        for (names, wanted) in [(&self.open, true), (&self.close, false)] {
            for name in names.split_whitespace() {
                let hole = open.get_mut(file.hole(name)?)?;
                if *hole == wanted {
                    return None;
                }
                *hole = wanted;
            }
        }
        Some(open)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bore::transfer_matrix::TransferMatrix;
    use crate::units::{Air, cents};

    /// Measured by the linear model. A player's lip, which the model leaves out, corrects as much.
    #[test]
    fn alternates_of_the_reference_play_their_note_within_half_a_semitone() {
        let file = InstrumentFile::built_in();
        let all = fingering_choices(&file);
        assert_eq!(all.len(), file.fingerings.len() + BOEHM.len());
        let bore = TransferMatrix::new(&file, Air::default());
        for choice in all.iter().filter(|choice| choice.nth > 0) {
            let wanted_hz = choice.written.sounding(file.transposition).unwrap().frequency_hz(440.0);
            let (f_hz, _) =
                bore.playing_frequency(&choice.open, file.reed_volume_m3, wanted_hz).expect("a resonance");
            let off = cents(f_hz, wanted_hz);
            println!("{:?} {}: {off:+.0} cents", choice.written, choice.fingers);
            assert!(off.abs() < 50.0, "{:?} {}: {off:+.0} cents", choice.written, choice.fingers);
        }
    }

    #[test]
    fn an_instrument_with_other_holes_has_the_fingerings_of_its_file() {
        let mut file = InstrumentFile::built_in();
        file.holes.iter_mut().for_each(|hole| hole.name.insert(0, 'x'));
        assert!(fingering_choices(&file).iter().all(|choice| choice.nth == 0));
    }
}
