//! What haptics needs to know about an instrument: the reed as it is played, and the pressures its notes need.

use crate::bore::instrument_file::InstrumentFile;
use crate::haptics::{PlayedReed, RequirementSolver};
use crate::instrument::lip::held;
use crate::instrument::model::Model;
use crate::instrument::settings::Settings;

/// The reed under these settings, with the law and the lip that the sound has, for every fingering of a file that plays at
/// `a4_hz`, Hz. Allocates.
pub fn played_reed(file: &InstrumentFile, a4_hz: f64, settings: &Settings) -> PlayedReed {
    let settings = settings.clamped();
    let sounding_hz = |written| file.sounding(written).frequency_hz(a4_hz);
    let lowest_hz = sounding_hz(file.lowest_unextended());
    let lips = file
        .fingerings
        .iter()
        .map(|fingering| held(sounding_hz(fingering.written), lowest_hz, settings.hold()))
        .collect();
    PlayedReed {
        law: settings.reed_law(),
        zeta: f64::from(settings.zeta),
        lay: f64::from(settings.lay),
        jet_loss: f64::from(settings.vent_loss),
        lips,
    }
}

/// The mouth pressures that the notes of a model need. The onsets are those of the lattice that sounds. Takes a second.
/// Allocates.
pub fn requirements(model: &Model) -> RequirementSolver {
    let rows = |fingering: usize| model.tuning.notes.get(fingering).map_or(0.0, |note| note.natural);
    RequirementSolver::of_checked(&model.file, model.air, model.a4_hz).with_lattice(
        &model.file,
        &model.coeffs,
        rows,
    )
}
