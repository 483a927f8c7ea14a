//! What can be said of an instrument before it is played: whether its notes are where the chart says, and whether the
//! lattice can hold its holes.
//!
//! [`InstrumentFile::parse`] refuses what cannot be; this looks at what can be and is unlikely to be meant. Pitches are
//! those of the transfer-matrix model ([`TransferMatrix`]) with the reed's volume at the tip, at the peak of the
//! impedance the chart names; a played note lies up to some 40 cents below (the embouchure, the jets of the holes), and
//! the automatic tuning takes that and a little more. Beyond [`FAR_CENTS`] it is the file that is wrong.

use crate::bore::cells::{Cells, CellsError, MOVED_TICKS};
use crate::bore::instrument_file::{HoleKind, InstrumentFile, ToneHole};
use crate::bore::tone_hole;
use crate::bore::transfer_matrix::{Peak, TransferMatrix};
use crate::bore::wall_loss;
use crate::units::{Air, WrittenNote, cents};

/// Further from its note than this a peak is reported, cents: half a semitone is another note, and automatic tuning moves
/// a note by about as much.
pub const FAR_CENTS: f64 = 60.0;
/// A common distance larger than this is told, cents, where three in four notes lie as near to it: about what a player
/// evens out with the barrel.
const COMMON_CENTS: f64 = 20.0;
/// Further from what most notes are than this a peak is reported, too, cents, of notes up to the clarion: none of the bundled instruments is more than 11
/// away at 10 to 40 C. A finger hole of a B flat clarinet that is 10 mm away from its place moves a note by 20 to 54.
const APART_CENTS: f64 = 30.0;
/// The peak of the clarion; the charts of higher notes are by ear.
const CLARION_MODE: usize = 2;
/// What most notes are off is told with one that is off, from so many cents on.
const TOLD_CENTS: f64 = 10.0;
/// The lattice's own rate, Hz, where holes are tried on the grid; at 44.1 kHz and its multiples it is 88.2 kHz, which
/// differs by less than a tenth of a tick between holes.
const GRID_HZ: f64 = 96_000.0;
/// Moved by more than this no tuning brings it back, half samples (11 mm, a third of a tone on a clarinet).
const LOST_TICKS: f64 = 6.0;

/// One note of the chart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoteCheck {
    /// The note.
    pub written: WrittenNote,
    /// Which peak of the impedance is to sound, from 1.
    pub mode: usize,
    /// Equal-tempered frequency of the note, Hz.
    pub wanted_hz: f64,
    /// That peak, if the impedance has it below 6 kHz.
    pub peak: Option<Peak>,
    /// How far the peak is above the note, cents; `None` without a peak.
    pub cents: Option<f64>,
}

/// Something a maker should look at.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Concern {
    /// The lattice cannot hold the bore.
    #[error("{0}")]
    Grid(CellsError),
    /// Two holes nearer than the lattice can set them.
    #[error(
        "holes {first} and {second} are {apart_mm:.2} mm apart; the lattice sets no two closer than {least_mm:.2} mm, half a \
         sample at 96 kHz"
    )]
    HolesClose {
        /// The one nearer to the reed.
        first: String,
        /// The other.
        second: String,
        /// Their distance, mm.
        apart_mm: f64,
        /// A half sample, mm.
        least_mm: f64,
    },
    /// Two holes under the fingers that run into each other.
    #[error(
        "holes {first} and {second} overlap: their centres are {apart_mm:.2} mm apart, and their radii together are {radii_mm:.2} mm"
    )]
    HolesOverlap {
        /// The one nearer to the reed.
        first: String,
        /// The other.
        second: String,
        /// Distance of the centres, mm.
        apart_mm: f64,
        /// Sum of the radii, mm.
        radii_mm: f64,
    },
    /// A hole the lattice sets elsewhere, because there is no room for all.
    #[error(
        "hole {hole} is set {by_mm:+.1} mm from its place among the others: too many holes or steps stand close together"
    )]
    HoleMoved {
        /// The hole.
        hole: String,
        /// Towards the bell, mm.
        by_mm: f64,
        /// Whether that is too far for any tuning.
        lost: bool,
    },
    /// The impedance has not as many peaks.
    #[error("{written} is to sound at peak {mode} of the impedance, which has none below 6 kHz")]
    NoPeak {
        /// The note.
        written: WrittenNote,
        /// The peak asked for.
        mode: usize,
    },
    /// No note has its peak.
    #[error("no note of the chart has a peak of the impedance to sound at")]
    Silent,
    /// Every note is off by about the same.
    #[error("all notes are about {cents:+.0} cents from the chart{hint}", hint = transposition_hint(*.right))]
    AllOff {
        /// The median over the notes, cents.
        cents: f64,
        /// The transposition that would put most of it right.
        right: Option<i8>,
    },
    /// A note is off.
    #[error(
        "{written} (peak {mode}) is {cents:+.0} cents from its note{most}{hint}",
        most = most_hint(*.most), hint = mode_hint(*.better, .hole.as_deref())
    )]
    OutOfTune {
        /// The note.
        written: WrittenNote,
        /// The peak asked for.
        mode: usize,
        /// How far that is above the note, cents.
        cents: f64,
        /// The median over the notes, cents.
        most: f64,
        /// Another peak that is right.
        better: Option<usize>,
        /// The first hole that is open, but for register holes, where other notes are elsewhere: its place and size count most.
        hole: Option<String>,
    },
    /// A clarion note that nothing keeps from falling to the fundamental.
    #[error(
        "{written} is a clarion note and opens no register hole; mark the vent with register = true, or it may fall a twelfth"
    )]
    NoRegisterHole {
        /// The note.
        written: WrittenNote,
    },
    /// Two notes that are one.
    #[error("{first} and {second} have the same open holes and the same peak; only one of them can be right")]
    SameFingering {
        /// The lower.
        first: WrittenNote,
        /// The higher.
        second: WrittenNote,
    },
}

fn transposition_hint(right: Option<i8>) -> String {
    right.map_or_else(String::new, |right| format!("; transposition_semitones = {right} would be nearer"))
}

fn most_hint(most: f64) -> String {
    if most.abs() < TOLD_CENTS { String::new() } else { format!(", where most are {most:+.0}") }
}

fn mode_hint(better: Option<usize>, hole: Option<&str>) -> String {
    match (better, hole) {
        (Some(mode), _) => format!("; peak {mode} is right"),
        (None, Some(hole)) => format!("; the first hole that it opens is {hole}"),
        (None, None) => String::new(),
    }
}

impl Concern {
    /// Whether the instrument cannot be played as it is.
    pub fn is_fatal(&self) -> bool {
        matches!(self, Self::Grid(_) | Self::Silent | Self::HoleMoved { lost: true, .. })
    }
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// Every note of the chart, low to high.
    pub notes: Vec<NoteCheck>,
    /// What to look at, fatal ones first.
    pub concerns: Vec<Concern>,
}

impl Check {
    /// Looks at an instrument in one air, for one pitch of A4. Allocates; some tenths of a second.
    pub fn new(file: &InstrumentFile, air: Air, a4_hz: f64) -> Self {
        let matrix = TransferMatrix::new(file, air);
        let mut concerns = grid(file, &air);
        let mut notes = Vec::with_capacity(file.fingerings.len());
        let mut others = Vec::with_capacity(file.fingerings.len());
        for fingering in &file.fingerings {
            let Some(sounding) = fingering.written.sounding(file.transposition) else { continue };
            let wanted_hz = sounding.frequency_hz(a4_hz);
            // One more than asked for: perhaps the next one was meant.
            let peaks = matrix.peaks(&fingering.open, file.reed_volume_m3, fingering.mode + 1);
            let peak = peaks.get(fingering.mode - 1).copied();
            notes.push(NoteCheck {
                written: fingering.written,
                mode: fingering.mode,
                wanted_hz,
                peak,
                cents: peak.map(|peak| cents(peak.f_hz, wanted_hz)),
            });
            others.push(peaks.iter().position(|peak| cents(peak.f_hz, wanted_hz).abs() < FAR_CENTS / 2.0));
        }
        concerns.extend(overlaps(file));
        concerns.extend(tuning(file, &notes, &others));
        for (index, fingering) in file.fingerings.iter().enumerate() {
            let vented = file.holes.iter().zip(&fingering.open).any(|(hole, open)| hole.register && *open);
            if fingering.register == "clarion" && fingering.mode > 1 && !vented {
                concerns.push(Concern::NoRegisterHole { written: fingering.written });
            }
            let same = file.fingerings[..index]
                .iter()
                .find(|other| other.open == fingering.open && other.mode == fingering.mode);
            if let Some(other) = same {
                concerns.push(Concern::SameFingering { first: other.written, second: fingering.written });
            }
        }
        concerns.sort_by_key(|concern| !concern.is_fatal());
        Self { notes, concerns }
    }

    /// How far nearly all notes are from the chart, cents, if that is worth a word and about the same for all: the median.
    pub fn common_cents(&self) -> Option<f64> {
        let known: Vec<f64> = self.notes.iter().filter_map(|note| note.cents).collect();
        let median = upper_median(&known)?;
        let near = known.iter().filter(|cents| (**cents - median).abs() < COMMON_CENTS).count();
        (known.len() > 2 && median.abs() > COMMON_CENTS && near * 4 > known.len() * 3).then_some(median)
    }

    /// Whether the instrument can be played.
    pub fn is_usable(&self) -> bool {
        !self.concerns.iter().any(Concern::is_fatal)
    }
}

/// The value in the middle, of an even number the higher of the two; `None` for nothing.
fn upper_median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}

/// Holes under the fingers stand in a row, except that under the thumb; a key's hole may stand beside another.
fn overlaps(file: &InstrumentFile) -> Vec<Concern> {
    let under_fingers: Vec<_> = file
        .holes
        .iter()
        .filter(|hole| hole.kind == HoleKind::Finger && !hole.name.eq_ignore_ascii_case("thumb"))
        .collect();
    let pairs = under_fingers.windows(2).map(|pair| (pair[0], pair[1]));
    let overlap = pairs.filter(|(first, second)| second.x_m - first.x_m < first.radius_m + second.radius_m);
    let concern = |(first, second): (&ToneHole, &ToneHole)| Concern::HolesOverlap {
        first: first.name.clone(),
        second: second.name.clone(),
        apart_mm: 1e3 * (second.x_m - first.x_m),
        radii_mm: 1e3 * (first.radius_m + second.radius_m),
    };
    overlap.map(concern).collect()
}

fn tuning(file: &InstrumentFile, notes: &[NoteCheck], others: &[Option<usize>]) -> Vec<Concern> {
    let mut concerns = Vec::new();
    let known: Vec<f64> = notes.iter().filter_map(|note| note.cents).collect();
    let Some(median) = upper_median(&known) else { return vec![Concern::Silent] };
    // One note alone is not all of them.
    let near = known.iter().filter(|cents| (**cents - median).abs() < FAR_CENTS).count();
    let all_off = known.len() > 2 && median.abs() > FAR_CENTS && near * 4 > known.len() * 3;
    if all_off {
        let right = f64::from(file.transposition) - (median / 100.0).round();
        let right = (-12.0..=36.0).contains(&right).then_some(right as i8);
        let right = right.filter(|right| *right != file.transposition);
        concerns.push(Concern::AllOff { cents: median, right });
    }
    let base = if all_off { median } else { 0.0 };
    for (note, other) in notes.iter().zip(others) {
        let (written, mode) = (note.written, note.mode);
        let is_apart = |cents: f64| mode <= CLARION_MODE && (cents - median).abs() > APART_CENTS;
        match note.cents {
            None => concerns.push(Concern::NoPeak { written, mode }),
            Some(cents) if (cents - base).abs() > FAR_CENTS || is_apart(cents) => {
                let better = other.map(|index| index + 1).filter(|better| *better != mode);
                concerns.push(Concern::OutOfTune {
                    written,
                    mode,
                    cents,
                    most: median,
                    better,
                    // Where all are off, it is not this hole.
                    hole: is_apart(cents).then(|| first_open(file, written)).flatten(),
                });
            }
            Some(_) => {}
        }
    }
    concerns
}

/// Name of the first hole that a note opens, but for register holes.
fn first_open(file: &InstrumentFile, written: WrittenNote) -> Option<String> {
    let open = &file.fingering(written)?.open;
    let first = file.holes.iter().zip(open).find(|(hole, open)| **open && !hole.register)?.0;
    Some(first.name.clone())
}

/// How long a wave takes from the tip to `x_m`, half samples, slowed by the walls as the lattice reckons.
fn ticks_to(file: &InstrumentFile, x_m: f64, air: &Air) -> f64 {
    let path: f64 = file
        .bore
        .iter()
        .map(|segment| {
            let end_m = segment.x_end_m.min(x_m);
            let length_m = end_m - segment.x_start_m;
            if length_m <= 0.0 {
                return 0.0;
            }
            let middle_m = file.radius_at(0.5 * (segment.x_start_m + end_m));
            length_m * (1.0 + wall_loss::slowing(air, middle_m))
        })
        .sum();
    path / air.c * 2.0 * GRID_HZ
}

fn grid(file: &InstrumentFile, air: &Air) -> Vec<Concern> {
    let cells = match Cells::cut(file, air, GRID_HZ) {
        Ok(cells) => cells,
        Err(error) => return vec![Concern::Grid(error)],
    };
    let tick_mm = 1e3 * air.c / (2.0 * GRID_HZ);
    // The negative mass of each hole shortens the bore about it, half of it as length.
    let mut shorter_m = 0.0;
    let exact: Vec<f64> = (file.holes.iter())
        .map(|hole| {
            let at = ticks_to(file, hole.x_m, air) + 1e3 * shorter_m / tick_mm;
            shorter_m += 0.5 * tone_hole::series_correction_m(hole.radius_m, file.radius_at(hole.x_m));
            at
        })
        .collect();
    let mut concerns = Vec::new();
    for pair in file.holes.windows(2) {
        if ticks_to(file, pair[1].x_m, air) - ticks_to(file, pair[0].x_m, air) < 1.0 {
            concerns.push(Concern::HolesClose {
                first: pair[0].name.clone(),
                second: pair[1].name.clone(),
                apart_mm: 1e3 * (pair[1].x_m - pair[0].x_m),
                least_mm: tick_mm,
            });
        }
    }
    let moved: Vec<f64> = (cells.hole_junctions.iter().zip(&exact))
        .map(|(&junction, exact)| {
            let placed: u32 = cells.cells[..=junction].iter().map(|cell| cell.ticks).sum();
            f64::from(placed) - exact
        })
        .collect();
    // What all have in common the fit makes up for in the mouthpiece.
    let common = upper_median(&moved).unwrap_or(0.0);
    for (hole, moved) in file.holes.iter().zip(moved) {
        let by = moved - common;
        // Rounding alone stays below one.
        if by.abs() > MOVED_TICKS {
            let (hole, by_mm, lost) = (hole.name.clone(), by * tick_mm, by.abs() > LOST_TICKS);
            concerns.push(Concern::HoleMoved { hole, by_mm, lost });
        }
    }
    concerns
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bore::bundled::Bundled;

    fn changed(from: &str, to: &str) -> Check {
        let text = InstrumentFile::built_in_text().replacen(from, to, 1);
        assert_ne!(text, InstrumentFile::built_in_text(), "{from}");
        Check::new(&InstrumentFile::parse(&text).unwrap(), Air::default(), 440.0)
    }

    #[test]
    fn the_built_in_clarinet_is_sound() {
        let check = Check::new(&InstrumentFile::built_in(), Air::default(), 440.0);
        assert!(check.is_usable());
        assert_eq!(check.notes.len(), 46);
        let far: Vec<_> =
            check.notes.iter().filter(|note| note.cents.is_none_or(|c| c.abs() > 35.0)).collect();
        assert!(far.is_empty(), "{far:?}");
        assert_eq!(check.concerns, []);
    }

    #[test]
    fn each_concern_is_seen() {
        let check = changed("transposition_semitones = 2", "transposition_semitones = 3");
        assert!(
            matches!(check.concerns[..], [Concern::AllOff { cents, right: Some(2) }] if (80.0..125.0).contains(&cents)),
            "{:?}",
            check.concerns
        );
        assert!(check.is_usable());

        let check = changed("register = true", "register = false");
        assert_eq!(check.concerns.len(), 14, "B4 to C6: {:?}", check.concerns);
        assert!(matches!(check.concerns[0], Concern::NoRegisterHole { written: WrittenNote(71) }));

        let check = changed(
            "written = \"E3\"\nregister = \"chalumeau\"\nmode = 1",
            "written = \"E3\"\nregister = \"chalumeau\"\nmode = 2",
        );
        assert!(
            matches!(
                check.concerns[..],
                [Concern::OutOfTune { written: WrittenNote(52), mode: 2, better: Some(1), .. }]
            ),
            "{:?}",
            check.concerns
        );

        let check = changed("open = \"E_PAD\"", "open = \"\"");
        assert!(
            check
                .concerns
                .contains(&Concern::SameFingering { first: WrittenNote(52), second: WrittenNote(53) }),
            "{:?}",
            check.concerns
        );

        // The second trill hole on top of the first.
        let check = changed("x_mm = 193.187", "x_mm = 166.7");
        assert!(
            check
                .concerns
                .iter()
                .any(|concern| matches!(concern, Concern::HolesClose { apart_mm, .. } if *apart_mm < 0.02)),
            "{:?}",
            check.concerns
        );
    }

    #[test]
    fn bundled_instruments_have_no_holes_that_overlap() {
        for bundled in Bundled::ALL {
            assert_eq!(overlaps(&bundled.file()), [], "{}", bundled.id());
        }
        let mut file = InstrumentFile::built_in();
        let fingers: Vec<_> =
            (0..file.holes.len()).filter(|&hole| file.holes[hole].kind == HoleKind::Finger).collect();
        file.holes[fingers[2]].x_m = file.holes[fingers[1]].x_m + 1e-3;
        assert!(matches!(overlaps(&file)[..], [Concern::HolesOverlap { .. }]), "{:?}", overlaps(&file));
    }

    #[test]
    fn a_hole_in_a_wrong_place_is_named() {
        let mut file = InstrumentFile::built_in().scaled(1.02);
        assert_eq!(
            Check::new(&file, Air::default(), 440.0).concerns,
            [],
            "all are flat by a third of a semitone"
        );
        let at = file.holes.iter().position(|hole| hole.name == "R2").unwrap();
        // In cold air, at another pitch, it is no hole.
        let cold = Check::new(&InstrumentFile::built_in(), Air::at(10.0), 415.0);
        let names = |concern: &Concern| matches!(concern, Concern::OutOfTune { hole: Some(_), .. });
        assert!(!cold.concerns.is_empty() && !cold.concerns.iter().any(names), "{:?}", cold.concerns);
        file.holes[at].x_m -= 10e-3;
        let concerns = Check::new(&file, Air::default(), 440.0).concerns;
        let named = |concern: &Concern| concern.to_string().ends_with("the first hole that it opens is R2");
        assert!(!concerns.is_empty() && concerns.iter().all(named), "{concerns:?}");
    }

    #[test]
    fn what_all_notes_have_in_common_is_told() {
        let mut file = InstrumentFile::built_in();
        assert_eq!(Check::new(&file, Air::default(), 440.0).common_cents(), None);
        file = file.scaled(0.98);
        let common = Check::new(&file, Air::default(), 440.0).common_cents().unwrap();
        assert!((25.0..50.0).contains(&common), "{common}");
    }

    #[test]
    fn twenty_holes_in_one_place_are_refused() {
        let mut file = InstrumentFile::built_in();
        let x_m = file.holes[4].x_m;
        for (n, hole) in file.holes.iter_mut().enumerate().skip(4) {
            hole.x_m = x_m + 1e-4 * n as f64;
        }
        let check = Check::new(&file, Air::default(), 440.0);
        assert!(!check.is_usable());
        assert!(check.concerns[0].is_fatal(), "fatal ones come first");
    }
}
