//! A longer lower joint: four semitones more, down to written C3, as bass clarinets have it.
//!
//! Behind the lowest hole the bore narrows to the width that it has before its flare and goes on as a tube; then it widens again,
//! and the end of the old flare and the bell follow. In this tube stand four pads, open at rest. The key of each low note closes its own pad
//! and all above it.
//!
//! A tube of the width that the bore has at that hole would be wider than the rest. It put the second and third mode of the lowest note 190
//! and 202 cents below its harmonics, now 54 and 44: for 0.15 s, the note began up to 1.8 semitones flat.

use crate::bore::instrument_file::{BoreSegment, Fingering, HoleKind, InstrumentFile, ToneHole};
use crate::units::WrittenNote;

/// The lowest hole of the ordinary clarinet. Behind it the tube begins.
const LOWEST_HOLE: &str = "E_PAD";
/// Length from there to the end of the old flare, m, on a clarinet of twice the B flat clarinet's size; so are all lengths here.
///
/// It and the places of the holes follow from the transfer-matrix model at 25 C: written E3 has its resonance 9 cents above equal
/// temperament, as before, and each note below it 10 cents, as `chalumeau instrument check` says. Not a measured instrument.
const TUBE_M: f64 = 0.296_96;
/// Radius of the tube, m: that of the bore before its flare.
const TUBE_RADIUS_M: f64 = 0.0146;
/// Where it narrows, from and to, m behind the middle of the lowest hole, and how far before its end it widens again, m (by judgement).
const NARROWS_M: (f64, f64) = (0.010, 0.030);
/// See [`NARROWS_M`].
const WIDENS_M: f64 = 0.060;
/// The holes: name, place in m from the tip of the reed, and what key closes it.
const HOLES: [(&str, f64, &str); 4] = [
    ("LOW_EB_PAD", 1.157_19, "low E flat key"),
    ("LOW_D_PAD", 1.221_37, "low D key"),
    ("LOW_CS_PAD", 1.289_35, "low C# key"),
    ("LOW_C_PAD", 1.365_07, "low C key"),
];
/// Radius and chimney of these holes, m: nearly as wide as the tube, and low. Through narrower holes, waves of the highest notes reach the
/// bell, and its echoes lie among the modes of A6, B6 and C7: with holes of 24.5 mm in a tube of 36 mm, these were lost at some breaths.
const RADIUS_M: f64 = 0.0135;
const CHIMNEY_M: f64 = 0.006;
/// The new notes from the lowest up, and the key that the right thumb or little finger presses. It stands for all keys above it.
const NOTES: [(WrittenNote, &str); 4] = [
    (WrittenNote(48), "low Ckey"),
    (WrittenNote(49), "low C#key"),
    (WrittenNote(50), "low Dkey"),
    (WrittenNote(51), "low Ebkey"),
];
/// Notes that sound at another peak of the longer bore.
const MODES: [(WrittenNote, usize); 4] =
    [(WrittenNote(93), 5), (WrittenNote(94), 5), (WrittenNote(95), 6), (WrittenNote(96), 6)];
/// Written A6, the hole that it opens in addition, and its fingers: without it, two peaks share the note.
const A6: (WrittenNote, &str, &str) = (WrittenNote(93), "R2", "R T L2 L3 side2 R3");
/// What the other fingers do in the lowest notes.
const OTHER_FINGERS: &str = "T L1 L2 L3 R1 R2 R3";

/// Extends a bass clarinet, a Boehm clarinet of twice the B flat clarinet's size.
pub(super) fn extended(mut file: InstrumentFile) -> InstrumentFile {
    let Some(lowest) = file.hole(LOWEST_HOLE) else { return file };
    let from_m = file.holes[lowest].x_m;
    // A cone ends at this hole.
    let behind = file.bore.partition_point(|segment| segment.x_start_m < from_m);
    let Some(flare) = file.bore.get(behind).cloned() else { return file };
    // To a nanometre and by way of millimetres, as the file has it: without the digits that an addition adds.
    let rounded = |x_m: f64| (x_m * 1e9).round() / 1e6 / 1e3;
    let ends = [
        (NARROWS_M.0, flare.r_start_m),
        (NARROWS_M.1, TUBE_RADIUS_M),
        (TUBE_M - WIDENS_M, TUBE_RADIUS_M),
        (TUBE_M, flare.r_start_m),
    ];
    for segment in &mut file.bore[behind..] {
        (segment.x_start_m, segment.x_end_m) =
            (rounded(segment.x_start_m + TUBE_M), rounded(segment.x_end_m + TUBE_M));
    }
    let mut begins = (flare.x_start_m, flare.r_start_m);
    let tube = ends.map(|(behind_m, r_m)| {
        let (x_start_m, r_start_m) =
            std::mem::replace(&mut begins, (rounded(flare.x_start_m + behind_m), r_m));
        BoreSegment { x_start_m, r_start_m, x_end_m: begins.0, r_end_m: begins.1, ..flare.clone() }
    });
    file.bore.splice(behind..behind, tube);
    file.holes.extend(HOLES.map(|(name, x_m, key)| ToneHole {
        name: name.to_owned(),
        kind: HoleKind::PadOpen,
        x_m,
        radius_m: RADIUS_M,
        chimney_m: CHIMNEY_M,
        register: false,
        description: format!("pad standing open, closed by the {key} and those of lower notes"),
    }));
    // Above the lowest notes these pads are open.
    for fingering in &mut file.fingerings {
        let every = std::iter::once(&mut fingering.open).chain(&mut fingering.maker_open);
        every.for_each(|open| open.extend([true; HOLES.len()]));
    }
    let holes = file.holes.len();
    for (written, mode) in MODES {
        let note = file.fingerings.iter_mut().filter(|fingering| fingering.written == written);
        note.for_each(|fingering| fingering.mode = mode);
    }
    let (a6, opened, fingers) = A6;
    if let Some(hole) = file.hole(opened) {
        let note = file.fingerings.iter_mut().filter(|fingering| fingering.written == a6);
        note.for_each(|fingering| (fingering.open[hole], fingering.fingers) = (true, fingers.to_owned()));
    }
    let low = NOTES.iter().enumerate().map(|(open, (written, key))| Fingering {
        written: *written,
        register: "chalumeau".to_owned(),
        mode: 1,
        open: (0..holes).map(|hole| hole + open >= holes).collect(),
        maker_open: None,
        fingers: format!("{OTHER_FINGERS} {key}"),
    });
    file.fingerings = low.chain(file.fingerings).collect();
    file.extension_semitones = NOTES.len() as u8;
    file
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bore::bundled::Bundled;
    use crate::bore::transfer_matrix::TransferMatrix;
    use crate::units::{Air, cents};

    /// How far the resonance of a note lies above equal temperament, cents.
    fn off_cents(file: &InstrumentFile, written: u8) -> f64 {
        let matrix = TransferMatrix::new(file, Air::default());
        let fingering = file.fingering(WrittenNote(written)).unwrap();
        let wanted_hz = file.sounding(fingering.written).frequency_hz(440.0);
        let found = matrix.playing_frequency(&fingering.open, file.reed_volume_m3, wanted_hz);
        cents(found.unwrap().0, wanted_hz)
    }

    #[test]
    fn the_lowest_notes_are_where_the_constants_say() {
        let file = Bundled::Bass.file();
        for (written, wanted_cents) in [(48, 10.0), (49, 10.0), (50, 10.0), (51, 10.0), (52, 9.0)] {
            let off = off_cents(&file, written);
            assert!((off - wanted_cents).abs() < 1.0, "{written}: {off}");
        }
        assert_eq!((file.lowest(), file.lowest_unextended()), (WrittenNote(48), WrittenNote(52)));
    }

    /// Cents between the second and third mode of a note and the third and fifth harmonic of the first.
    fn inharmonicity(file: &InstrumentFile, written: u8) -> [f64; 2] {
        let matrix = TransferMatrix::new(file, Air::default());
        let open = &file.fingering(WrittenNote(written)).unwrap().open;
        let first_hz = file.sounding(WrittenNote(written)).frequency_hz(440.0);
        let near = |times: f64| {
            let found = matrix.playing_frequency(open, file.reed_volume_m3, times * first_hz);
            found.unwrap().0
        };
        let first_hz = near(1.0);
        [3.0, 5.0].map(|times| cents(near(times), times * first_hz))
    }

    #[test]
    fn the_modes_of_the_lowest_notes_lie_near_their_harmonics() {
        let file = Bundled::Bass.file();
        for written in 48..=52 {
            let off = inharmonicity(&file, written);
            assert!(off.iter().all(|off| (-80.0..20.0).contains(off)), "{written}: {off:.0?}");
        }
    }

    #[test]
    fn the_other_notes_stay_where_they_were_and_have_a_peak() {
        let (file, before) = (Bundled::Bass.file(), Bundled::BFlat.file().scaled(2.0));
        let is_all = option_env!("CHALUMEAU_ALL_CASES").is_some();
        for written in (52..=97).filter(|written| is_all || written % 3 == 0 || *written == A6.0.0) {
            let fingering = before.fingering(WrittenNote(written)).unwrap();
            let tube = InstrumentFile { transposition: 14, ..before.clone() };
            let (now, then) = (off_cents(&file, written), off_cents(&tube, written));
            let most = if written == A6.0.0 { 20.0 } else { 9.0 };
            assert!((now - then).abs() < most, "{}: {now}, before {then}", fingering.written);
        }
    }
}
