//! Why a text is not an instrument: where, what was given, what would be right.

/// What the reader of TOML says, and what a maker understands.
const PLAIN_WORDS: [(&str, &str); 11] = [
    ("expected struct RawSegment", "expected a cone, such as { x_start_mm = 0.0, x_end_mm = 40.0, ... }"),
    ("expected struct RawHole", "expected a hole with its own [[hole]]"),
    ("expected struct RawFingering", "expected a fingering with its own [[fingering]]"),
    ("expected i64", "expected a whole number"),
    ("expected i32", "expected a whole number"),
    ("expected u32", "expected a whole number, 0 or more"),
    ("expected f64", "expected a number without quotes"),
    ("expected a string", "expected one text in quotes"),
    ("invalid type: sequence", "this is a list"),
    ("invalid type: ", "this is a value of another kind: "),
    ("unknown variant", "unknown word"),
];

fn in_plain_words(error: &toml::de::Error) -> String {
    PLAIN_WORDS.iter().fold(error.to_string(), |text, (theirs, ours)| text.replace(theirs, ours))
}

/// Why a text is not an instrument. Numbers are given as in the file, in its own unit.
#[derive(Debug, thiserror::Error)]
pub enum InstrumentError {
    /// Not TOML, a missing or unknown key, or a value of the wrong kind; line and column are in the message.
    #[error("not an instrument file: {}", in_plain_words(.0))]
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
