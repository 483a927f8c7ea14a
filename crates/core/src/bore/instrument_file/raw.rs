//! The text as it is written, before anything is checked.

use serde::Deserialize;
use toml::Spanned;

use super::HoleKind;

/// A line of the file, from 1, if it is of a file, and what stands there.
#[derive(Clone, Debug)]
pub(super) struct Lined<T> {
    pub(super) line: Option<u64>,
    pub(super) value: T,
}

/// An instrument as written, millimetres and diameters.
#[derive(Clone, Debug)]
pub(super) struct RawFile {
    pub(super) name: String,
    pub(super) source: String,
    pub(super) transposition_semitones: i64,
    pub(super) reed_volume_mm3: f64,
    pub(super) nominal_diameter_mm: Option<f64>,
    pub(super) extension_semitones: i64,
    pub(super) bore: Vec<Lined<RawSegment>>,
    pub(super) hole: Vec<Lined<RawHole>>,
    pub(super) fingering: Vec<Lined<RawFingering>>,
}

impl RawFile {
    /// Reads TOML. Mistakes of syntax, missing and unknown keys come with their line.
    pub(super) fn from_toml(text: &str) -> Result<Self, toml::de::Error> {
        let file: TomlFile = toml::from_str(text)?;
        Ok(Self {
            name: file.name,
            source: file.source,
            transposition_semitones: file.transposition_semitones,
            reed_volume_mm3: file.reed_volume_mm3,
            nominal_diameter_mm: file.nominal_diameter_mm,
            extension_semitones: file.extension_semitones,
            bore: lined(file.bore, text),
            hole: lined(file.hole, text),
            fingering: lined(file.fingering, text),
        })
    }
}

fn lined<T>(entries: Vec<Spanned<T>>, text: &str) -> Vec<Lined<T>> {
    let (mut line, mut at) = (1, 0);
    let mut lines = Vec::with_capacity(entries.len());
    for entry in entries {
        let start = entry.span().start.min(text.len());
        // Entries come in the order of the text; one that does not is counted from the top.
        if start < at {
            (line, at) = (1, 0);
        }
        line += text.as_bytes()[at..start].iter().filter(|&&byte| byte == b'\n').count() as u64;
        at = start;
        lines.push(Lined { line: Some(line), value: entry.into_inner() });
    }
    lines
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TomlFile {
    name: String,
    #[serde(default)]
    source: String,
    transposition_semitones: i64,
    reed_volume_mm3: f64,
    #[serde(default)]
    nominal_diameter_mm: Option<f64>,
    #[serde(default)]
    extension_semitones: i64,
    bore: Vec<Spanned<RawSegment>>,
    #[serde(default)]
    hole: Vec<Spanned<RawHole>>,
    #[serde(default)]
    fingering: Vec<Spanned<RawFingering>>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSegment {
    #[serde(default)]
    pub(super) part: String,
    pub(super) x_start_mm: f64,
    pub(super) x_end_mm: f64,
    pub(super) diameter_start_mm: f64,
    pub(super) diameter_end_mm: f64,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawHole {
    pub(super) name: String,
    pub(super) kind: HoleKind,
    pub(super) x_mm: f64,
    pub(super) diameter_mm: f64,
    pub(super) chimney_mm: f64,
    #[serde(default)]
    pub(super) register: bool,
    #[serde(default)]
    pub(super) description: String,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawFingering {
    pub(super) written: String,
    pub(super) register: String,
    pub(super) mode: u32,
    pub(super) open: String,
    #[serde(default)]
    pub(super) maker_open: Option<String>,
    #[serde(default)]
    pub(super) fingers: String,
}
