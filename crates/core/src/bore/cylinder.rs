//! A cylinder with holes that plays the notes asked for: the simplest instrument there is, for measurements and for a
//! first file to work on.
//!
//! The lowest note sounds with every hole closed; each further one opens the next hole from the bell. Length and positions
//! are moved until the transfer-matrix model, with the reed's volume at the tip, sounds (phase of the impedance through
//! zero) at every note. A vent can be added a third of the way down for the twelfths, which are as true as a cylinder's.

use crate::bore::instrument_file::{
    BoreSegment, Fingering, HoleKind, InstrumentFile, LONGEST_M, MAX_HOLES, ToneHole,
};
use crate::bore::transfer_matrix::TransferMatrix;
use crate::units::{A4_OF_THEORY_HZ, Air, WrittenNote, cents};

/// Rounds of moving everything; each brings the notes several times nearer.
const ROUNDS: usize = 40;
/// Near enough, cents: a position to a hundredth of a millimetre.
const ENOUGH_CENTS: f64 = 0.02;
/// From a chalumeau note to the clarion note of the same fingers, semitones.
const TWELFTH: u8 = 19;

/// What the cylinder is to be.
#[derive(Clone, Debug, PartialEq)]
pub struct Cylinder {
    /// What a player calls it.
    pub name: String,
    /// Notes it plays, at least one, rising.
    pub notes: Vec<WrittenNote>,
    /// Semitones it sounds below what is written.
    pub transposition: i8,
    /// Pitch of A4, 100..=1000 Hz.
    pub a4_hz: f64,
    /// Bore, m.
    pub radius_m: f64,
    /// Tone holes, m.
    pub hole_radius_m: f64,
    /// Chimneys, m.
    pub chimney_m: f64,
    /// Radius of a register hole, m, if there is to be one.
    pub vent_radius_m: Option<f64>,
    /// Volume of air that moves with the reed, m3.
    pub reed_volume_m3: f64,
}

/// Why there is no such cylinder.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CylinderError {
    /// None, or more than an instrument can have holes.
    #[error("{given} notes; there must be 1 to {most}")]
    Notes {
        /// Number of notes.
        given: usize,
        /// The most.
        most: usize,
    },
    /// A note that is not above the one before.
    #[error("{second} comes after {first}; notes must be given from the lowest to the highest, each once")]
    Order {
        /// One note.
        first: WrittenNote,
        /// The next.
        second: WrittenNote,
    },
    /// A note, or its twelfth, that MIDI does not have.
    #[error("{0} (or its twelfth) does not sound between C-1 and G9")]
    Range(WrittenNote),
    /// A pitch of A4, Hz, outside [`A4_OF_THEORY_HZ`].
    #[error("A4 must lie in {low}..{high} Hz, got {0}", low = A4_OF_THEORY_HZ.0, high = A4_OF_THEORY_HZ.1)]
    A4(f64),
    /// A size that no instrument file can have, in the words of [`InstrumentFile::check`].
    #[error("{0}")]
    Size(String),
    /// A note that needs a longer bore than an instrument file can have.
    #[error(
        "{lowest} needs a bore {length_mm:.0} mm long, and the longest of an instrument file is {most:.0} mm; begin with a higher note",
        most = 1e3 * LONGEST_M
    )]
    TooLong {
        /// The lowest note.
        lowest: WrittenNote,
        /// Its bore, mm.
        length_mm: f64,
    },
    /// Holes wider than the bore.
    #[error("holes of {hole_mm} mm are wider than a bore of {bore_mm} mm")]
    TooWide {
        /// Hole's diameter, mm.
        hole_mm: f64,
        /// Bore's, mm.
        bore_mm: f64,
    },
    /// Holes that would run into each other.
    #[error(
        "the holes of {first} and {second} would overlap, with centres {:.1} mm apart; make the chimneys shorter, or leave out one of the two notes",
        .apart_mm.max(0.0)
    )]
    Overlap {
        /// The lower note.
        first: WrittenNote,
        /// The upper.
        second: WrittenNote,
        /// Distance of the centres, mm.
        apart_mm: f64,
    },
    /// Nothing to tune.
    #[error("no resonance of such a bore lies within an octave of {0}; it is too low or too high for it")]
    NoResonance(WrittenNote),
    /// No cylinder plays it.
    #[error(
        "{written} cannot be reached with these holes (still {cents:+.1} cents off); make the holes wider or the chimneys shorter"
    )]
    OutOfReach {
        /// The note.
        written: WrittenNote,
        /// What is left, cents.
        cents: f64,
    },
}

/// Names of the holes from the bell: those by which the [finder of fingerings](crate::bore::fingering_finder) knows the holes
/// under the fingers.
const HOLES: [&str; 7] = ["R3", "R2", "R1", "L3", "L2", "L1", "THUMB"];

/// Name of a hole, counted from the bell, from 1. Those beyond the fingers have a number.
fn name_of_hole(index: usize) -> String {
    index.checked_sub(1).and_then(|at| HOLES.get(at)).map_or_else(|| format!("H{index}"), ToString::to_string)
}

impl Cylinder {
    /// The instrument. Allocates; some tenths of a second.
    ///
    /// # Errors
    /// [`CylinderError`] says which size or note cannot be, and what to change.
    pub fn build(&self, air: Air) -> Result<InstrumentFile, CylinderError> {
        self.possible()?;
        let wanted: Vec<f64> = self
            .notes
            .iter()
            .filter_map(|note| note.sounding(self.transposition))
            .map(|sounding| sounding.frequency_hz(self.a4_hz))
            .collect();
        // Ends of the air column, note by note: the bell for the first, then the holes. A quarter wave to start with.
        let mut ends_m: Vec<f64> = wanted.iter().map(|hz| 0.25 * air.c / hz).collect();
        let mut worst = (self.notes[0], f64::MAX);
        for _ in 0..ROUNDS {
            let file = self.with_ends(&ends_m);
            let matrix = TransferMatrix::new(&file, air);
            worst = (self.notes[0], 0.0);
            for (index, (fingering, wanted_hz)) in file.fingerings.iter().zip(&wanted).enumerate() {
                let found = matrix.playing_frequency(&fingering.open, self.reed_volume_m3, *wanted_hz);
                let (hz, _) = found.ok_or(CylinderError::NoResonance(fingering.written))?;
                let off = cents(hz, *wanted_hz);
                if off.abs() > f64::abs(worst.1) {
                    worst = (fingering.written, off);
                }
                ends_m[index] += 0.25 * air.c * (1.0 / wanted_hz - 1.0 / hz);
            }
            if worst.1.abs() < ENOUGH_CENTS {
                break;
            }
            // A hole cannot be above the tip.
            if let Some(index) = ends_m.iter().position(|&end_m| end_m < 3.0 * self.radius_m) {
                return Err(CylinderError::OutOfReach { written: self.notes[index], cents: worst.1 });
            }
        }
        let (written, off) = worst;
        if off.abs() > 1.0 {
            return Err(CylinderError::OutOfReach { written, cents: off });
        }
        // A thousandth of a millimetre, and a file that can be read.
        ends_m.iter_mut().for_each(|end_m| *end_m = (*end_m * 1e6).round() / 1e6);
        for (pair, notes) in ends_m.windows(2).zip(self.notes.windows(2)).skip(1) {
            let apart_mm = 1e3 * (pair[0] - pair[1]);
            if apart_mm < 2e3 * self.hole_radius_m {
                return Err(CylinderError::Overlap { first: notes[0], second: notes[1], apart_mm });
            }
        }
        let mut file = self.with_ends(&ends_m);
        if self.vent_radius_m.is_some() {
            self.add_twelfths(&mut file);
        }
        if file.length_m() > LONGEST_M {
            return Err(CylinderError::TooLong { lowest: self.notes[0], length_mm: 1e3 * file.length_m() });
        }
        file.check().map_err(|error| CylinderError::Size(error.to_string()))?;
        Ok(file)
    }

    fn possible(&self) -> Result<(), CylinderError> {
        let most = if self.vent_radius_m.is_some() { MAX_HOLES } else { MAX_HOLES + 1 };
        if self.notes.is_empty() || self.notes.len() > most {
            return Err(CylinderError::Notes { given: self.notes.len(), most });
        }
        if let Some(pair) = self.notes.windows(2).find(|pair| pair[0] >= pair[1]) {
            return Err(CylinderError::Order { first: pair[0], second: pair[1] });
        }
        if !(A4_OF_THEORY_HZ.0..=A4_OF_THEORY_HZ.1).contains(&self.a4_hz) {
            return Err(CylinderError::A4(self.a4_hz));
        }
        let highest = |note: &WrittenNote| match self.vent_radius_m {
            Some(_) => WrittenNote(note.0.saturating_add(TWELFTH).min(128)),
            None => *note,
        };
        let silent = |note: WrittenNote| note.0 > 127 || note.sounding(self.transposition).is_none();
        if let Some(note) = self.notes.iter().find(|note| silent(**note) || silent(highest(note))) {
            return Err(CylinderError::Range(*note));
        }
        if self.hole_radius_m > self.radius_m || self.vent_radius_m.is_some_and(|vent| vent > self.radius_m) {
            let hole_m = self.vent_radius_m.unwrap_or(0.0).max(self.hole_radius_m);
            return Err(CylinderError::TooWide { hole_mm: 2e3 * hole_m, bore_mm: 2e3 * self.radius_m });
        }
        // Two notes with all sizes: places and names are worked out later.
        let notes = vec![WrittenNote(60), WrittenNote(72)];
        let two = Self { name: "cylinder".to_owned(), notes, transposition: 0, ..self.clone() };
        let sizes = two.with_ends(&[0.4, 0.2]);
        sizes.check().map_err(|error| CylinderError::Size(error.to_string()))
    }

    /// The instrument with its air column ending here for each note; holes from the reed to the bell.
    fn with_ends(&self, ends_m: &[f64]) -> InstrumentFile {
        let count = ends_m.len();
        let hole = |name: String, x_m: f64, radius_m: f64, register: bool, description: String| ToneHole {
            name,
            kind: if register { HoleKind::KeyClosed } else { HoleKind::Finger },
            x_m,
            radius_m,
            chimney_m: self.chimney_m,
            register,
            description,
        };
        // Each with the number of the note from which on it is open; the register hole has none.
        let mut holes: Vec<(ToneHole, Option<usize>)> = Vec::with_capacity(count);
        if let (Some(radius_m), Some(highest_m)) = (self.vent_radius_m, ends_m.last()) {
            // Where a third of the column lies, taken between the longest and the shortest.
            let third_m = (ends_m[0] + highest_m) / 6.0;
            let register = hole("REG".to_owned(), third_m, radius_m, true, "register hole".to_owned());
            holes.push((register, None));
        }
        for (index, x_m) in ends_m.iter().enumerate().skip(1).rev() {
            let description = format!("open for {} and above", self.notes[index]);
            let tone_hole = hole(name_of_hole(index), *x_m, self.hole_radius_m, false, description);
            holes.push((tone_hole, Some(index)));
        }
        // Over more than two octaves the topmost holes lie above the register hole.
        holes.sort_by(|(a, _), (b, _)| a.x_m.total_cmp(&b.x_m));
        let fingerings = self
            .notes
            .iter()
            .enumerate()
            .map(|(index, &written)| Fingering {
                written,
                register: "chalumeau".to_owned(),
                mode: 1,
                open: holes.iter().map(|(_, from)| from.is_some_and(|from| from <= index)).collect(),
                maker_open: None,
                fingers: String::new(),
            })
            .collect();
        InstrumentFile {
            name: self.name.clone(),
            source: format!(
                "Made by `chalumeau instrument new`: a cylinder of {} mm whose length and holes were placed by the \
                 transfer-matrix model for A4 = {} Hz at 25 C.",
                2e3 * self.radius_m,
                self.a4_hz
            ),
            transposition: self.transposition,
            reed_volume_m3: self.reed_volume_m3,
            nominal_radius_m: self.radius_m,
            extension_semitones: 0,
            bore: vec![BoreSegment {
                part: "cylinder".to_owned(),
                x_start_m: 0.0,
                x_end_m: ends_m[0],
                r_start_m: self.radius_m,
                r_end_m: self.radius_m,
            }],
            holes: holes.into_iter().map(|(hole, _)| hole).collect(),
            fingerings,
        }
    }

    fn add_twelfths(&self, file: &mut InstrumentFile) {
        let taken: Vec<WrittenNote> = file.fingerings.iter().map(|fingering| fingering.written).collect();
        let above: Vec<Fingering> = file
            .fingerings
            .iter()
            .map(|low| {
                let mut open = low.open.clone();
                open[0] = true;
                let written = WrittenNote(low.written.0 + TWELFTH);
                let register = "clarion".to_owned();
                Fingering { written, register, mode: 2, open, maker_open: None, fingers: String::new() }
            })
            .filter(|high| !taken.contains(&high.written))
            .collect();
        file.fingerings.extend(above);
        file.fingerings.sort_by_key(|fingering| fingering.written);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bore::check::{Check, Concern};
    use crate::bore::fingering_finder::mechanism::Mechanism;

    fn cylinder(notes: &[u8]) -> Cylinder {
        Cylinder {
            name: "cylinder".to_owned(),
            notes: notes.iter().map(|&midi| WrittenNote(midi)).collect(),
            transposition: 0,
            a4_hz: 440.0,
            radius_m: 7.45e-3,
            hole_radius_m: 4e-3,
            chimney_m: 8e-3,
            vent_radius_m: None,
            reed_volume_m3: 1.2e-6,
        }
    }

    #[test]
    fn its_notes_are_in_tune_and_its_file_is_good() {
        let file = cylinder(&[50, 52, 53, 55, 57, 59, 60]).build(Air::default()).unwrap();
        assert_eq!((file.holes.len(), file.fingerings.len()), (6, 7));
        assert!(Mechanism::boehm().unmoved(&file).is_empty(), "fingers reach all holes");
        let check = Check::new(&file, Air::default(), 440.0);
        assert_eq!(check.concerns, []);
        for note in check.notes {
            // Peak and zero of the phase differ a little.
            assert!(note.cents.unwrap().abs() < 3.0, "{note:?}");
        }
        let read = InstrumentFile::parse(&file.to_toml()).unwrap();
        assert_eq!(read.fingerings, file.fingerings);
        assert!((read.length_m() - file.length_m()).abs() < 1e-9);
    }

    #[test]
    fn a_vent_adds_the_twelfths() {
        let file = Cylinder { vent_radius_m: Some(1.2e-3), ..cylinder(&[50, 52, 54]) }
            .build(Air::default())
            .unwrap();
        let notes: Vec<u8> = file.fingerings.iter().map(|fingering| fingering.written.0).collect();
        assert_eq!(notes, [50, 52, 54, 69, 71, 73]);
        assert!(file.fingerings[3].open[0] && !file.fingerings[0].open[0] && file.holes[0].register);
        let check = Check::new(&file, Air::default(), 440.0);
        let heard: Vec<_> =
            check.concerns.iter().filter(|concern| !matches!(concern, Concern::Grid(_))).collect();
        assert!(heard.is_empty(), "{heard:?}: {:?}", check.notes);
    }

    #[test]
    fn what_cannot_be_is_refused_with_a_reason() {
        let air = Air::default();
        let message = |cylinder: Cylinder| cylinder.build(air).unwrap_err().to_string();
        assert!(message(cylinder(&[])).contains("1 to 41"));
        assert!(message(cylinder(&[52, 50])).contains("D3 comes after E3"));
        assert!(message(Cylinder { transposition: 36, ..cylinder(&[30]) }).contains("F#1"));
        assert!(message(cylinder(&[0])).contains("an octave of C-1"));
        assert!(
            message(Cylinder { hole_radius_m: 8e-3, ..cylinder(&[50, 52]) })
                .contains("wider than a bore of 14.9")
        );
        for a4_hz in [0.0, -440.0, 99.0, 1e9, f64::NAN] {
            assert!(message(Cylinder { a4_hz, ..cylinder(&[50, 52]) }).contains("A4 must lie in 100..1000"));
        }
        for size in [0.0, -1e-3, f64::NAN, f64::INFINITY] {
            for wrong in [
                Cylinder { radius_m: size, hole_radius_m: size, ..cylinder(&[50, 52]) },
                Cylinder { hole_radius_m: if size > 0.0 { 1e-9 } else { size }, ..cylinder(&[50, 52]) },
                Cylinder { chimney_m: size, ..cylinder(&[50, 52]) },
                Cylinder { vent_radius_m: Some(if size > 0.0 { 1e-9 } else { size }), ..cylinder(&[50, 52]) },
            ] {
                let said = message(wrong);
                assert!(said.contains("it must be"), "{size}: {said}");
            }
        }
        let crowd = Cylinder { hole_radius_m: 7e-3, ..cylinder(&[70, 71, 72, 73, 74, 75, 76, 77]) };
        assert!(message(crowd).contains("overlap"));
        assert!(message(Cylinder { hole_radius_m: 0.3e-3, ..cylinder(&[50, 69]) }).contains("wider"));
    }
}
