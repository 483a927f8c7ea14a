//! Cuts a bore into cells of the lattice, and fits the cells to the bore's transfer matrices.

#[cfg(feature = "fit")]
use super::{OnProgress, Progress};
use crate::bore::cells::Cells;
#[cfg(feature = "fit")]
use crate::bore::fit;
use crate::bore::instrument_file::InstrumentFile;
use crate::instrument::model::{BuildError, Model};
use crate::instrument::tuning_table::TuningTable;
use crate::units::Air;

/// Cut, neither fitted nor tuned. Takes milliseconds. `scale` multiplies all lengths of the file.
pub fn cut(file: &InstrumentFile, scale: f64, rate_hz: f64, a4_hz: f64) -> Result<Model, BuildError> {
    let file = file.scaled(scale);
    let cells = Cells::cut(&file, &Air::default(), rate_hz)?;
    Ok(untuned(file, cells, a4_hz, scale))
}

/// Cut and fitted, not tuned. Takes seconds. `scale` multiplies all lengths of the file.
#[cfg(feature = "fit")]
pub fn fit(
    file: &InstrumentFile,
    scale: f64,
    rate_hz: f64,
    a4_hz: f64,
    on: OnProgress<'_>,
) -> Result<Model, BuildError> {
    let file = file.scaled(scale);
    let cells = fit::fit(&file, &Air::default(), rate_hz, &mut |share| on(Progress::Fitting(share)))?
        .ok_or(BuildError::Cancelled)?;
    Ok(untuned(file, cells, a4_hz, scale))
}

fn untuned(file: InstrumentFile, cells: Cells, a4_hz: f64, scale: f64) -> Model {
    let tuning = TuningTable::untuned(&file);
    Model::assemble(file, cells, tuning, a4_hz, scale)
}
