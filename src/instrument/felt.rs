//! The instrument's reed as the knob's side of the house wants to know it.

use crate::haptics::{Lip, PlayedReed};
use crate::instrument::embouchure::embouchure;
use crate::instrument::model::Model;
use crate::instrument::settings::Settings;

/// The reed under these settings, lip and law as the sound has them, for every fingering of a model. Allocates.
pub fn played_reed(model: &Model, settings: &Settings) -> PlayedReed {
    let settings = settings.clamped();
    let lips = model
        .notes_hz
        .iter()
        .map(|&note_hz| {
            let lip = embouchure(note_hz, model.lowest_hz);
            Lip { resonance_hz: lip.resonance_hz, damping: lip.damping * f64::from(settings.damping) }
        })
        .collect();
    PlayedReed {
        law: settings.reed_law(),
        zeta: f64::from(settings.zeta),
        lay: f64::from(settings.lay),
        lips,
    }
}
