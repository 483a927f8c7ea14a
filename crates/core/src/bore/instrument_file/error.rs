//! Why a text is not an instrument: where, what was given, what would be right.

/// Why a text is not an instrument. Numbers are given as in the file, in its own unit.
#[derive(Debug, thiserror::Error)]
pub enum InstrumentError {
    /// Not TOML, a missing or unknown key, or a value of the wrong kind; line and column are in the message.
    #[error("not an instrument file: {0}")]
    Syntax(#[from] toml::de::Error),
    /// A number out of range, a hole off the bore or wider than it.
    #[error("{place}: {field} is {given}; it must be {expected}")]
    Value {
        /// Segment, hole, fingering or `the file`, with its line.
        place: String,
        /// Key or column in the file.
        field: String,
        /// Value as it stands in the file.
        given: f64,
        /// The range, in the file's own unit, and the unit the number may have been meant in.
        expected: String,
    },
    /// A word that is not one of those allowed, or an empty or spaced name.
    #[error("{place}: {field} is {given:?}; it must be {expected}")]
    Word {
        /// Segment, hole, fingering or `the file`, with its line.
        place: String,
        /// Key or column in the file.
        field: String,
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
        "{place}: {field} is {given}, {} the cone before it; it must be {expected}",
        if given < expected { "overlapping" } else { "leaving a gap after" }
    )]
    NotContiguous {
        /// The cone.
        place: String,
        /// Key or column in the file.
        field: String,
        /// Its start, in the file's unit.
        given: f64,
        /// The end of the one before (0 for the first).
        expected: f64,
    },
    /// Two holes of one name, two fingerings of one note, or one hole twice in a fingering.
    #[error("{place}: {what} {name} appears twice; each must appear once")]
    Duplicate {
        /// The second of them.
        place: String,
        /// `hole`, or the key or column of the note.
        what: String,
        /// The repeated name.
        name: String,
    },
}
