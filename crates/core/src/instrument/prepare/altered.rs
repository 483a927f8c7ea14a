//! An instrument with other joints or other holes, made from one that is fitted and tuned.
//!
//! It keeps the trims and the dynamics of the instrument that it comes from. So the ear hears what the alteration does to
//! each note, as on a real instrument when its maker moves a hole; an instrument that is tuned anew would hide it.

#[cfg(feature = "fit")]
use super::{OnProgress, Progress};
use crate::bore::cells::Cells;
#[cfg(feature = "fit")]
use crate::bore::fit;
use crate::bore::instrument_file::InstrumentFile;
use crate::instrument::model::{BuildError, Model};

/// The altered instrument at once. The cells are cut anew, and the fit of `base` is carried over to them. Holes stand on the
/// lattice's grid of half samples, so their places are right to a quarter of a sample (0.9 mm at 96 kHz) and what the notes
/// do is right to some 10 cents. Takes milliseconds. Allocates.
///
/// `file` has the fingerings and the number of holes of `base`, in lengths before its scaling.
///
/// # Errors
/// [`BuildError::Cells`] if the grid has no room for the holes.
pub fn at_once(base: &Model, file: &InstrumentFile) -> Result<Model, BuildError> {
    let file = file.scaled(base.scale);
    let cells = carried_over(base, Cells::cut(&file, &base.air, base.cells.rate_hz)?)?;
    Ok(with_cells(base, file, cells))
}

/// The altered instrument, fitted to its own transfer matrices. Takes seconds. The fit moves the whole bore a little, so notes whose holes
/// stay as they were may move by up to 3 cents. Allocates.
///
/// # Errors
/// As [`at_once`], and [`BuildError::Cancelled`] if `on` ends it.
#[cfg(feature = "fit")]
pub fn fitted(base: &Model, file: &InstrumentFile, on: OnProgress<'_>) -> Result<Model, BuildError> {
    let file = file.scaled(base.scale);
    let cells = fit::fit(&file, &base.air, base.cells.rate_hz, &mut |share| on(Progress::Fitting(share)))?
        .ok_or(BuildError::Cancelled)?;
    Ok(with_cells(base, file, cells))
}

fn with_cells(base: &Model, file: InstrumentFile, cells: Cells) -> Model {
    let model = Model::assemble(file, cells, base.tuning.clone(), base.a4_hz, base.scale);
    Model { keys: base.keys.clone(), player: base.player, ..model }
}

/// `cells` with what the fit of `base` did to its own; without it where the bores are not cut alike.
fn carried_over(base: &Model, mut cells: Cells) -> Result<Cells, BuildError> {
    let (fit, cut) = (&base.cells, Cells::cut(&base.file, &base.air, base.cells.rate_hz)?);
    let alike = cells.hole_junctions == cut.hole_junctions
        && cut.hole_junctions == fit.hole_junctions
        && cells.cells.len() == cut.cells.len()
        && cut.cells.len() == fit.cells.len();
    if alike {
        for (cell, (fit, cut)) in cells.cells.iter_mut().zip(fit.cells.iter().zip(&cut.cells)) {
            cell.radius_m *= fit.radius_m / cut.radius_m;
        }
        cells.end_radius_m *= fit.end_radius_m / cut.end_radius_m;
    }
    (cells.loss_poles_hz, cells.loss_strengths) = (fit.loss_poles_hz, fit.loss_strengths);
    (cells.vent_resistance, cells.chimney_split) = (fit.vent_resistance, fit.chimney_split);
    Ok(cells)
}

#[cfg(all(test, feature = "fit"))]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::bore::lattice::sensitivity::{AtFrequency, Sweep};
    use crate::bore::moved_hole::MovedHole;
    use crate::bore::pulled_joint::PulledJoint;
    use crate::bore::transfer_matrix::TransferMatrix;
    use crate::units::{WrittenNote, cents};

    /// First impedance peak of the lattice near `near_hz`, Hz: where the admittance is least.
    fn peak_hz(model: &Model, open: &[bool], near_hz: f64) -> f64 {
        let magnitude =
            |hz: f64| AtFrequency::new(&model.coeffs, hz).admittance(open, &mut Sweep::default()).norm();
        let grid = (-600..=600).map(|n| near_hz * (f64::from(n) / 10.0 / 1_200.0).exp2());
        grid.min_by(|a, b| magnitude(*a).total_cmp(&magnitude(*b))).unwrap()
    }

    #[test]
    fn nothing_altered_is_the_same() {
        let base = Model::built_in(48_000.0).unwrap();
        let same = at_once(&base, &base.file).unwrap();
        for (a, b) in same.cells.cells.iter().zip(&base.cells.cells) {
            assert!((a.radius_m / b.radius_m - 1.0).abs() < 1e-14 && a.ticks == b.ticks);
        }
        assert_eq!(same.tuning, base.tuning);
    }

    /// The barrel pulled out by 2 mm, as a player does who is sharp, or cut by 3: written E4 falls or rises as the transfer matrices
    /// say.
    #[test]
    fn a_pulled_joint_moves_its_notes_as_the_transfer_matrices_say() {
        let base = Model::built_in(48_000.0).unwrap();
        let note = base.file.fingering(WrittenNote(64)).unwrap().clone();
        let peak =
            |file: &InstrumentFile| TransferMatrix::new(file, base.air).peaks(&note.open, 0.0, 1)[0].f_hz;
        let before = peak(&base.file);
        for by_m in [2e-3, -3e-3] {
            let pulled = PulledJoint { part: "barrel".to_owned(), by_m };
            let file = base.file.with_joints_pulled(&[pulled]);
            let after = peak(&file);
            let by = cents(after, before);
            assert!(by * by_m < 0.0 && by.abs() > 8.0, "{by} cents by {by_m} m");
            let played_by =
                |model: &Model| cents(peak_hz(model, &note.open, after), peak_hz(&base, &note.open, before));
            let at_once = played_by(&super::at_once(&base, &file).unwrap());
            let fitted = played_by(&super::fitted(&base, &file, &mut |_| ControlFlow::Continue(())).unwrap());
            assert!(
                (at_once - by).abs() < 8.0 && (fitted - by).abs() < 1.6,
                "{by}, at once {at_once}, fitted {fitted}"
            );
        }
    }

    /// The first hole that a note opens, moved up the bore by 4 mm: the lattice's peak moves as the transfer matrices' does,
    /// within the step of the grid at once, and within 1.6 cents when fitted, which is what the fit holds everywhere.
    #[test]
    fn a_moved_hole_moves_its_note_as_the_transfer_matrices_say() {
        let base = Model::built_in(48_000.0).unwrap();
        let note = base.file.fingering(WrittenNote(55)).unwrap().clone();
        let hole = note.open.iter().position(|open| *open).unwrap();
        let was = &base.file.holes[hole];
        let moved = MovedHole { name: was.name.clone(), x_m: was.x_m - 4e-3, radius_m: was.radius_m };
        let file = base.file.with_holes_moved(&[moved]);
        let peak =
            |file: &InstrumentFile| TransferMatrix::new(file, base.air).peaks(&note.open, 0.0, 1)[0].f_hz;
        let (before, after) = (peak(&base.file), peak(&file));
        let by = cents(after, before);
        assert!(by > 10.0, "{by} cents");
        let played_by =
            |model: &Model| cents(peak_hz(model, &note.open, after), peak_hz(&base, &note.open, before));
        let at_once = played_by(&super::at_once(&base, &file).unwrap());
        let fitted = played_by(&super::fitted(&base, &file, &mut |_| ControlFlow::Continue(())).unwrap());
        assert!(
            (at_once - by).abs() < 7.0 && (fitted - by).abs() < 1.6,
            "{by}, at once {at_once}, fitted {fitted}"
        );
    }
}
