//! Why a text is not an instrument: where, what was given, what would be right.

use std::path::PathBuf;

/// Why a text is not an instrument. Lengths are given as in the file, in millimetres.
#[derive(Debug, thiserror::Error)]
pub enum InstrumentError {
    /// The file could not be read.
    #[error("cannot read {}: {error}", path.display())]
    Read {
        /// The path asked for.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// Not TOML, a missing or unknown key, or a value of the wrong kind; line and column are in the message.
    #[error("not an instrument file: {0}")]
    Syntax(#[from] toml::de::Error),
    /// A number out of range.
    #[error("{place}: {field} is {given}; it must be {expected}")]
    Value {
        /// Segment, hole, fingering or `the file`.
        place: String,
        /// Key in the file.
        field: &'static str,
        /// Value as it stands in the file.
        given: f64,
        /// The range, in words, and a guess at a mistaken unit.
        expected: &'static str,
    },
    /// A word that is not one of those allowed, or an empty or spaced name.
    #[error("{place}: {field} is {given:?}; it must be {expected}")]
    Word {
        /// Segment, hole, fingering or `the file`.
        place: String,
        /// Key in the file.
        field: &'static str,
        /// Text as it stands in the file.
        given: String,
        /// What would be right.
        expected: String,
    },
    /// Too many or too few entries of a list.
    #[error("there are {given} {what} entries; there must be {least} to {most}")]
    Count {
        /// Key in the file.
        what: &'static str,
        /// Number found.
        given: usize,
        /// Fewest allowed.
        least: usize,
        /// Most allowed.
        most: usize,
    },
    /// A cone does not start where the one before ends.
    #[error(
        "{place}: x_start_mm is {given_mm}, {} the cone before it; it must be {expected_mm}",
        if given_mm < expected_mm { "overlapping" } else { "leaving a gap after" }
    )]
    NotContiguous {
        /// The cone.
        place: String,
        /// Its start, mm.
        given_mm: f64,
        /// The end of the one before (0 for the first), mm.
        expected_mm: f64,
    },
    /// A hole outside the bore.
    #[error("{place}: x_mm is {given_mm}; the bore runs from 0 to {length_mm} and a hole must be inside it")]
    HoleOffBore {
        /// The hole.
        place: String,
        /// Its position, mm.
        given_mm: f64,
        /// Length of the bore, mm.
        length_mm: f64,
    },
    /// A hole wider than the bore it opens.
    #[error(
        "{place}: diameter_mm is {given_mm}; the bore there is {bore_mm} wide and a hole must not be wider"
    )]
    HoleTooWide {
        /// The hole.
        place: String,
        /// Its diameter, mm.
        given_mm: f64,
        /// Diameter of the bore there, mm.
        bore_mm: f64,
    },
    /// Two holes of one name, two fingerings of one note, or one hole twice in a fingering.
    #[error("{place}: {what} {name} appears twice; each must appear once")]
    Duplicate {
        /// The second of them.
        place: String,
        /// `hole` or `written`.
        what: &'static str,
        /// The repeated name.
        name: String,
    },
}
