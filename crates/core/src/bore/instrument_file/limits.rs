//! What a checker can see: ranges of the file format, and the unit a wrong size suggests.
//!
//! Bounds are in the words of the format (millimetres, diameters); messages speak those of the file that was read, which
//! may be a table in metres and radii.

use super::InstrumentError;
use super::words::{Place, Word};

/// Most tone holes a file may have; a full Boehm clarinet has 24.
pub const MAX_HOLES: usize = 40;
/// Most cones a bore may be made of.
pub const MAX_SEGMENTS: usize = 256;

/// A range of the file format.
pub(super) struct Range {
    least: f64,
    most: f64,
    /// Whether 0 is right as well.
    or_zero: bool,
    /// What a sensible value is like: a wrong one that lies here in another unit was meant in that unit.
    likely: (f64, f64),
    /// What follows the bounds, e.g. ` semitones (B flat clarinet: 2)`.
    after: &'static str,
}

const fn range(least: f64, most: f64, likely: (f64, f64), after: &'static str) -> Range {
    Range { least, most, or_zero: false, likely, after }
}

const NEVER: (f64, f64) = (1.0, 0.0);

pub(super) const TRANSPOSITION: Range = range(-12.0, 36.0, NEVER, " semitones (B flat clarinet: 2)");
pub(super) const REED_VOLUME: Range =
    Range { or_zero: true, ..range(20.0, 20_000.0, (100.0, 10_000.0), " (clarinet: 1200 mm3)") };
pub(super) const NOMINAL_DIAMETER: Range = range(1.0, 200.0, (4.0, 150.0), " (B flat clarinet: 14.9 mm)");
pub(super) const EXTENSION: Range = range(0.0, 12.0, NEVER, " semitones (bass clarinet to low C: 4)");
// 3 m is a little more than a contrabass clarinet.
pub(super) const POSITION: Range = range(0.0, 3_000.0, (5.0, 3_000.0), "");
// Nearer to the tip than 1 mm there is no bore to drill.
pub(super) const HOLE_POSITION: Range = range(1.0, 3_000.0, (20.0, 3_000.0), "");
pub(super) const BORE_LENGTH: Range = range(20.0, 3_000.0, (100.0, 3_000.0), " for the last cone");
pub(super) const BORE_DIAMETER: Range = range(1.0, 200.0, (4.0, 150.0), "");
pub(super) const HOLE_DIAMETER: Range = range(0.2, 60.0, (1.0, 40.0), "");
/// Longest bore of the format, m.
pub const LONGEST_M: f64 = POSITION.most / 1e3;
/// Least distance of a tone hole from the tip of the reed, m.
pub const LEAST_HOLE_X_M: f64 = HOLE_POSITION.least / 1e3;
/// Least and greatest radius of a tone hole, m.
pub const HOLE_RADIUS_M: (f64, f64) = (HOLE_DIAMETER.least / 2e3, HOLE_DIAMETER.most / 2e3);
pub(super) const CHIMNEY: Range = range(0.2, 100.0, (1.0, 50.0), "");
pub(super) const MODE: Range = range(1.0, 12.0, NEVER, ", the number of the impedance peak that sounds");

/// Refuses a number (in the unit of the format) outside its range.
pub(super) fn within(place: &Place, word: &Word, value: f64, range: &Range) -> Result<(), InstrumentError> {
    if (range.least..=range.most).contains(&value) || range.or_zero && value == 0.0 {
        return Ok(());
    }
    let unit = word.unit();
    let zero = if range.or_zero { "0, or " } else { "" };
    let expected = format!(
        "{zero}{} to {}{}{unit}{}{}",
        word.given(range.least),
        word.given(range.most),
        if unit.is_empty() { "" } else { " " },
        range.after,
        word.guess(value, |value| (range.likely.0..=range.likely.1).contains(&value)),
    );
    Err(InstrumentError::Value {
        place: place.to_string(),
        field: word.name.clone(),
        given: word.given(value),
        expected,
    })
}

pub(super) fn count(
    what: &'static str,
    given: usize,
    least: usize,
    most: usize,
) -> Result<(), InstrumentError> {
    if (least..=most).contains(&given) {
        Ok(())
    } else {
        Err(InstrumentError::Count { what, given, least, most })
    }
}

pub(super) fn word(place: &Place, field: &Word, given: &str, expected: impl Into<String>) -> InstrumentError {
    InstrumentError::Word {
        place: place.to_string(),
        field: field.name.clone(),
        given: given.to_owned(),
        expected: expected.into(),
    }
}
