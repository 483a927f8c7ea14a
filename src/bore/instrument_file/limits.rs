//! What a checker can see: ranges of the file format, with the unit a wrong size suggests.

use super::InstrumentError;

/// A range of the file format: the bounds, the bound in words, and units a wrong size suggests.
pub(super) struct Range {
    least: f64,
    most: f64,
    expected: &'static str,
    /// Below this and above 0 the message is `small` instead: a mistaken unit.
    small_below: f64,
    small: &'static str,
}

const fn range(
    least: f64,
    most: f64,
    expected: &'static str,
    small_below: f64,
    small: &'static str,
) -> Range {
    Range { least, most, expected, small_below, small }
}

pub(super) const TRANSPOSITION: Range =
    range(-12.0, 36.0, "-12 to 36 semitones (B flat clarinet: 2)", -13.0, "");
pub(super) const REED_VOLUME: Range = range(
    0.0,
    20_000.0,
    "0 to 20000 mm3 (clarinet: 1200)",
    20.0,
    "in mm3, 0 to 20000 (clarinet: 1200); this looks like cm3 (1 cm3 = 1000 mm3) or m3",
);
pub(super) const NOMINAL_DIAMETER: Range = range(
    1.0,
    199.999,
    "1 mm to below 200 mm (B flat clarinet: 14.9)",
    0.1,
    "in mm, 1 to below 200 (B flat clarinet: 14.9); this looks like metres (0.015 m = 15 mm)",
);
// 3 m is a little more than a contrabass clarinet.
pub(super) const POSITION: Range = range(0.0, 3_000.0, "0 to 3000 mm", 0.0, "");
pub(super) const BORE_LENGTH: Range = range(
    20.0,
    3_000.0,
    "20 to 3000 mm for the last cone",
    20.0,
    "in mm, 20 to 3000 for the last cone; this looks like metres (1 m = 1000 mm) or centimetres",
);
pub(super) const BORE_DIAMETER: Range = range(
    1.0,
    199.999,
    "1 mm to below 200 mm",
    0.1,
    "in mm, 1 to below 200; this looks like metres (0.015 m = 15 mm)",
);
pub(super) const HOLE_DIAMETER: Range =
    range(0.2, 60.0, "0.2 to 60 mm", 0.1, "in mm, 0.2 to 60; this looks like metres (0.008 m = 8 mm)");
pub(super) const CHIMNEY: Range =
    range(0.2, 100.0, "0.2 to 100 mm", 0.1, "in mm, 0.2 to 100; this looks like metres (0.007 m = 7 mm)");
pub(super) const MODE: Range =
    range(1.0, 12.0, "1 to 12, the number of the impedance peak that sounds", 0.0, "");

pub(super) fn within(
    place: &str,
    field: &'static str,
    given: f64,
    range: &Range,
) -> Result<(), InstrumentError> {
    let looks_small = given > 0.0 && given < range.small_below;
    if (range.least..=range.most).contains(&given) && !looks_small {
        return Ok(());
    }
    let expected = if looks_small { range.small } else { range.expected };
    Err(InstrumentError::Value { place: place.to_owned(), field, given, expected })
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

pub(super) fn word(place: &str, field: &'static str, given: &str, expected: &str) -> InstrumentError {
    InstrumentError::Word {
        place: place.to_owned(),
        field,
        given: given.to_owned(),
        expected: expected.to_owned(),
    }
}

/// Metres as a message shows them: millimetres to the nearest 0.1 micrometre.
pub(super) fn in_mm(metres: f64) -> f64 {
    (metres * 1e7).round() / 1e4
}
