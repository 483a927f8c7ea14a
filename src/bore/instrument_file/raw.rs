//! The text as it is written, before anything is checked.

use serde::Deserialize;

use super::HoleKind;

/// The file as it is written, millimetres and diameters.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawFile {
    pub(super) name: String,
    #[serde(default)]
    pub(super) source: String,
    pub(super) transposition_semitones: i64,
    pub(super) reed_volume_mm3: f64,
    #[serde(default)]
    pub(super) nominal_diameter_mm: Option<f64>,
    pub(super) bore: Vec<RawSegment>,
    #[serde(default)]
    pub(super) hole: Vec<RawHole>,
    #[serde(default)]
    pub(super) fingering: Vec<RawFingering>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSegment {
    #[serde(default)]
    pub(super) part: String,
    pub(super) x_start_mm: f64,
    pub(super) x_end_mm: f64,
    pub(super) diameter_start_mm: f64,
    pub(super) diameter_end_mm: f64,
}

#[derive(Deserialize)]
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

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawFingering {
    pub(super) written: String,
    pub(super) register: String,
    pub(super) mode: u32,
    pub(super) open: String,
    #[serde(default)]
    pub(super) fingers: String,
}
