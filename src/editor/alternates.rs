//! Fingerings beside those of the file: the usual alternates of Boehm clarinets, for instruments whose holes have these
//! names.
//!
//! A file has one fingering a note, the one that is tuned and played. An alternate is that of a neighbour with a key or a
//! finger more; it can be tried, heard and seen here, and is not tuned. The list is every clarinettist's (side and sliver
//! keys, the fork, trills); left out are those that open and close the same holes by another finger.

use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::units::WrittenNote;

/// A fingering of the picker.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The note it plays.
    pub written: WrittenNote,
    /// Where it stands in the picker.
    pub register: String,
    /// What the fingers do.
    pub fingers: String,
    /// Whether each hole is open, in the order of the file.
    pub open: Vec<bool>,
    /// How many of this note come before it: 0 for the one that is played.
    pub nth: usize,
}

/// Note, the neighbour whose fingering it begins from, what it opens, what it closes, and in a player's words.
type Row = (u8, u8, &'static [&'static str], &'static [&'static str], &'static str);

/// Written notes by MIDI number. In the forks the ring of the right first finger closes, by the bridge between the joints,
/// also the vent above the left second.
const BOEHM: &[Row] = &[
    (59, 58, &["SLIVER_B"], &[], "T L1 L2 L3 R1 sliverB"),
    (63, 62, &["SIDE1_Eb"], &[], "T L1 L2 side1"),
    (63, 64, &[], &["R1", "R_VENT", "L2_VENT"], "T L1 R1 (fork)"),
    (66, 65, &["SIDE1_Eb", "SIDE2_Fs"], &[], "T side1 side2"),
    (70, 69, &["TRILL3_Bb"], &[], "A side3"),
    (78, 77, &["SLIVER_B"], &[], "R T L1 L2 L3 R1 sliverB"),
    (82, 81, &["SLIVER_Eb"], &[], "R T L1 L2 sliverEb"),
    (82, 83, &[], &["R1", "R_VENT", "L2_VENT"], "R T L1 R1 (fork)"),
];

/// All fingerings of the picker: those of the file, each followed by its alternates.
pub fn choices(file: &InstrumentFile) -> Vec<Choice> {
    let mut all: Vec<Choice> = Vec::with_capacity(file.fingerings.len() + BOEHM.len());
    for fingering in &file.fingerings {
        let nth = all.iter().filter(|other| other.written == fingering.written).count();
        all.push(Choice {
            written: fingering.written,
            register: fingering.register.clone(),
            fingers: fingering.fingers.clone(),
            open: fingering.open.clone(),
            nth,
        });
    }
    for &(note, neighbour, opens, closes, fingers) in BOEHM {
        let written = WrittenNote(note);
        let Some(at) = all.iter().rposition(|choice| choice.written == written) else { continue };
        let Some(open) = changed(file, WrittenNote(neighbour), opens, closes) else { continue };
        let known = &all[at];
        if all.iter().any(|other| other.written == written && other.open == open) {
            continue;
        }
        let choice = Choice {
            written,
            register: known.register.clone(),
            fingers: fingers.into(),
            open,
            nth: known.nth + 1,
        };
        all.insert(at + 1, choice);
    }
    all
}

/// The neighbour's fingering with some holes opened and closed; `None` where one is missing or stands as wanted already.
fn changed(
    file: &InstrumentFile,
    neighbour: WrittenNote,
    opens: &[&str],
    closes: &[&str],
) -> Option<Vec<bool>> {
    let mut open = file.fingering(neighbour)?.open.clone();
    for (names, wanted) in [(opens, true), (closes, false)] {
        for name in names {
            let hole = open.get_mut(file.hole(name)?)?;
            if *hole == wanted {
                return None;
            }
            *hole = wanted;
        }
    }
    Some(open)
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::bore::transfer_matrix::TransferMatrix;
    use chalumeau_core::units::{Air, cents};

    /// By the linear model, without a player's lip, which corrects as much.
    #[test]
    fn alternates_of_the_reference_play_their_note_within_half_a_semitone() {
        let file = InstrumentFile::built_in();
        let all = choices(&file);
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
        assert!(choices(&file).iter().all(|choice| choice.nth == 0));
    }
}
