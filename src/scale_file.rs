//! Scales from files in the formats of Scala (Manuel Op de Coul): `.scl` has the pitches, `.kbm` says which key plays which.

use std::borrow::Cow;
use std::fs;
use std::io;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use tune::key::PianoKey;
use tune::note::Note;
use tune::pitch::{Pitch, Pitched};
use tune::scala::{
    Kbm, KbmBuildError, KbmImportError, KbmParseErrorKind, KbmRoot, KbmStructuralError, Scl, SclBuildError,
    SclImportError, SclParseErrorKind, SclStructuralError,
};
use tune::tuning::KeyboardMapping;

use chalumeau_core::instrument::KeyPitches;
use chalumeau_core::units::SoundingNote;

/// Largest file that is read, bytes; a scale of 65,535 notes is smaller.
const BYTES_MOST: u64 = 4_000_000;
/// The key that plays the first pitch of a scale without a mapping: middle C, at its equal-tempered pitch.
const FIRST_KEY: i32 = 60;

/// Farthest pitch of a scale from its first, cents: twice the range of hearing.
const CENTS_MOST: f64 = 24_000.0;
/// Frequencies that a reference key may have, Hz: from below the lowest MIDI key to the end of hearing.
const REFERENCE_HZ: RangeInclusive<f64> = 1.0..=20_000.0;

/// Why a scale cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ScaleError {
    /// The system's reason.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The file is not what its format asks for.
    #[error("{}: {what}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong, with its line where there is one.
        what: String,
    },
}

/// Reads a scale, with a keyboard mapping if there is one. Without, middle C plays the first pitch of the scale, and the keys
/// go through the scale one after another.
pub fn read(scl: &Path, kbm: Option<&Path>) -> Result<KeyPitches, ScaleError> {
    let texts = (text(scl)?, kbm.map(text).transpose()?);
    key_pitches(&texts.0, texts.1.as_deref()).map_err(|fault| {
        let path = if fault.is_of_mapping { kbm.unwrap_or(scl) } else { scl };
        ScaleError::Format { path: path.to_owned(), what: fault.what }
    })
}

/// What is wrong with the text of a scale or of its keyboard mapping.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScaleFault {
    /// The mapping, not the scale.
    pub is_of_mapping: bool,
    /// What, with its line where there is one.
    pub what: String,
}

/// What every key plays, from the texts of a scale and, if there is one, of a keyboard mapping; see [`read`].
///
/// ```
/// use chalumeau::scale_file::key_pitches;
/// use chalumeau_core::units::SoundingNote;
///
/// let fifths = key_pitches("every key a fifth\n1\n3/2\n", None).unwrap();
/// // 61 is a pure fifth above middle C.
/// let fifth = fifths.of(SoundingNote(61)).unwrap();
/// assert_eq!(fifth.note, SoundingNote(67));
/// assert!((fifth.cents - 1.955).abs() < 0.001);
/// ```
pub fn key_pitches(scl: &str, kbm: Option<&str>) -> Result<KeyPitches, ScaleFault> {
    let (scl, kbm) = (&*described(without_mark(scl)), kbm.map(without_mark));
    let of_scale = |what| ScaleFault { is_of_mapping: false, what };
    let of_mapping = |what| ScaleFault { is_of_mapping: true, what };
    let scale = Scl::import(scl.as_bytes()).map_err(|error| of_scale(scl_error(&error, scl)))?;
    check_pitches(scl).map_err(of_scale)?;
    let mapping = match kbm {
        Some(text) => {
            let mapping =
                Kbm::import(text.as_bytes()).map_err(|error| of_mapping(kbm_error(&error, text)))?;
            check_mapping(text).map_err(of_mapping)?;
            rooted(mapping, text, &scale).map_err(of_mapping)?
        }
        None => Kbm::builder(Note::from_midi_number(FIRST_KEY))
            .build()
            .map_err(|_| of_scale("it has no keys".to_owned()))?,
    };
    let pitches = (&scale, &mapping);
    let keys = KeyPitches::from_hz(|key| {
        let pitch = pitches.maybe_pitch_of(PianoKey::from_midi_number(key))?;
        Some(pitch.pitch().as_hz())
    });
    if (0..128).all(|key| keys.of(SoundingNote(key)).is_none()) {
        let fault = if kbm.is_some() { of_mapping } else { of_scale };
        return Err(fault("no key has a pitch that can be heard".to_owned()));
    }
    Ok(keys)
}

/// A text without the mark of its encoding, which editors put before it and which would make a line of the first comment.
fn without_mark(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}

/// A scale whose description, its first line that is no comment, is not empty. The format allows that, and the reader takes the next
/// line for it, which is the number of notes then. The number of lines stays.
fn described(scl: &str) -> Cow<'_, str> {
    let is_number = |item: &str| item.parse::<u32>().is_ok();
    if !entries(scl).next().is_some_and(|(_, item)| is_number(item)) {
        return Cow::Borrowed(scl);
    }
    let mut at = 0;
    for line in scl.split_inclusive('\n') {
        match line.trim() {
            "" => return Cow::Owned(format!("{}-{}", &scl[..at], &scl[at..])),
            comment if comment.starts_with('!') => at += line.len(),
            _ => break,
        }
    }
    Cow::Borrowed(scl)
}

/// The lines that are no comments, each with its number, and what counts of it. As the reader of the format sees them.
fn entries(text: &str) -> impl Iterator<Item = (usize, &str)> {
    (1..).zip(text.lines()).filter_map(|(number, line)| {
        let item = line.split_ascii_whitespace().next()?;
        (!line.trim().starts_with('!')).then_some((number, item))
    })
}

/// What stands in a line, for a message.
fn given(text: &str, number: usize) -> &str {
    text.lines().nth(number.saturating_sub(1)).unwrap_or_default().trim()
}

/// Refuses pitches that are none.
fn check_pitches(scl: &str) -> Result<(), String> {
    // After the description and the number of notes.
    for (number, item) in entries(scl).skip(2) {
        let value = |text: &str| text.parse::<f64>().unwrap_or(f64::NAN);
        let cents = match item.split_once('/') {
            _ if item.contains('.') => value(item),
            Some((upper, lower)) => 1_200.0 * (value(upper) / value(lower)).log2(),
            None => 1_200.0 * value(item).log2(),
        };
        // Also what is not a number.
        if !(-CENTS_MOST..=CENTS_MOST).contains(&cents) {
            let octaves = CENTS_MOST / 1_200.0;
            return Err(format!(
                "line {number} must be a ratio above 0 or cents, at most {octaves} octaves, got {:?}",
                given(scl, number)
            ));
        }
    }
    Ok(())
}

/// Refuses a mapping that leaves no key with a pitch.
fn check_mapping(kbm: &str) -> Result<(), String> {
    let all: Vec<_> = entries(kbm).collect();
    let [size, first, last, _, _, reference, _, degrees @ ..] = all.as_slice() else { return Ok(()) };
    let whole = |entry: &(usize, &str)| entry.1.parse::<i32>().unwrap_or_default();
    if whole(first) > whole(last) {
        return Err(format!(
            "line {} must be the last key, at or above the first, {}, got {:?}",
            last.0,
            first.1,
            given(kbm, last.0)
        ));
    }
    let hz = reference.1.parse().unwrap_or(f64::NAN);
    if !REFERENCE_HZ.contains(&hz) {
        return Err(format!(
            "line {} must be a frequency in {}..{} Hz, got {:?}",
            reference.0,
            REFERENCE_HZ.start(),
            REFERENCE_HZ.end(),
            given(kbm, reference.0)
        ));
    }
    if whole(size) > 0 && degrees.iter().all(|degree| degree.1.eq_ignore_ascii_case("x")) {
        return Err(match degrees.last() {
            Some((number, _)) => format!(
                "line {number} is {:?}, as are all entries of the map, so that no key has a pitch",
                given(kbm, *number)
            ),
            None => format!(
                "line {} gives the map a size of {}, and no entries follow, so that no key has a pitch; 0 is a map of all keys",
                size.0, size.1
            ),
        });
    }
    Ok(())
}

/// A mapping whose degrees count from its middle key, where its first entry is, and whose reference key has its frequency. The reader of
/// the format counts them from the reference key.
fn rooted(mut mapping: Kbm, kbm: &str, scale: &Scl) -> Result<Kbm, String> {
    let all: Vec<_> = entries(kbm).collect();
    let [size, _, _, middle, reference, hz, octave, degrees @ ..] = all.as_slice() else {
        return Ok(mapping);
    };
    let whole = |entry: &(usize, &str)| entry.1.parse::<i32>().unwrap_or_default();
    let steps = whole(reference) - whole(middle);
    let degree = match whole(size) {
        ..=0 => Some(steps),
        size => {
            let entry = degrees.get(steps.rem_euclid(size) as usize);
            let degree = entry.and_then(|(_, degree)| degree.parse::<i32>().ok());
            degree.map(|degree| degree + steps.div_euclid(size) * whole(octave))
        }
    };
    let Some(degree) = degree else {
        return Err(format!(
            "line {} is the reference key, {}, and the map gives that key no pitch",
            reference.0, reference.1
        ));
    };
    let reference_hz = hz.1.parse().unwrap_or(f64::NAN);
    mapping.root = KbmRoot {
        ref_key: PianoKey::from_midi_number(whole(middle)),
        ref_pitch: Pitch::from_hz(reference_hz / scale.relative_pitch_of(degree).as_float()),
        root_offset: 0,
    };
    Ok(mapping)
}

/// The text of a file of a scale. Scala's archive is in Latin-1; only comments and names have letters beyond ASCII.
pub fn text(path: &Path) -> Result<String, ScaleError> {
    let refused = |source| ScaleError::Read { path: path.to_owned(), source };
    let size = fs::metadata(path).map_err(refused)?.len();
    if size > BYTES_MOST {
        let what = format!("{size} bytes are too many for a scale");
        return Err(ScaleError::Format { path: path.to_owned(), what });
    }
    Ok(String::from_utf8_lossy(&fs::read(path).map_err(refused)?).into_owned())
}

fn scl_error(error: &SclImportError, text: &str) -> String {
    match error {
        SclImportError::IoError(error) => error.to_string(),
        SclImportError::ParseError { line_number, kind } => {
            let what = match kind {
                SclParseErrorKind::IntValue => "must be a whole number from 0 to 65535",
                SclParseErrorKind::CentsValue => "must be cents with a point, such as 701.955",
                SclParseErrorKind::Numer | SclParseErrorKind::Denom => "must be a ratio, such as 3/2",
            };
            format!("line {line_number} {what}, got {:?}", given(text, *line_number))
        }
        SclImportError::StructuralError(SclStructuralError::ExpectingDescription) => {
            "it is empty; the first line of a scale is its description".to_owned()
        }
        SclImportError::StructuralError(SclStructuralError::ExpectingNumberOfNotes) => {
            "the second line must have the number of notes".to_owned()
        }
        SclImportError::StructuralError(SclStructuralError::InconsistentNumberOfNotes) => {
            "it has not as many pitches as the second line says".to_owned()
        }
        SclImportError::BuildError(SclBuildError::ScaleTooLarge) => "it has too many notes".to_owned(),
    }
}

fn kbm_error(error: &KbmImportError, text: &str) -> String {
    match error {
        KbmImportError::IoError(error) => error.to_string(),
        KbmImportError::ParseError { line_number, kind } => {
            let what = match kind {
                KbmParseErrorKind::IntValue => {
                    "must be a whole number: the size of the map from 0 to 65535, a key or a degree"
                }
                KbmParseErrorKind::FloatValue => "must be a frequency in Hz, such as 440.0",
                KbmParseErrorKind::KeyboardMapping => {
                    "must be a degree of the scale, or x for a key without a pitch"
                }
            };
            format!("line {line_number} {what}, got {:?}", given(text, *line_number))
        }
        KbmImportError::StructuralError(part) => {
            let what = match part {
                KbmStructuralError::ExpectingMapSize => "the size of the map",
                KbmStructuralError::ExpectingFirstMidiNote => "the first key",
                KbmStructuralError::ExpectingLastMidiNote => "the last key",
                KbmStructuralError::ExpectingOrigin => "the middle key",
                KbmStructuralError::ExpectingReferenceNote => "the reference key",
                KbmStructuralError::ExpectingReferencePitch => "the reference frequency",
                KbmStructuralError::ExpectingFormalOctave => "the degree of the formal octave",
                KbmStructuralError::InconsistentNumberOfItems => {
                    return "it has more entries than its first line says".to_owned();
                }
            };
            format!("it ends before {what}")
        }
        KbmImportError::BuildError(KbmBuildError::FormalOctaveMissing) => {
            "it does not say which degree is the formal octave".to_owned()
        }
        KbmImportError::BuildError(KbmBuildError::MappingTooLarge) => "its map is too large".to_owned(),
    }
}
