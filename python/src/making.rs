//! What a maker asks: which fingerings an instrument has for a note, and whether its measurements can be meant so.

use crate::bore::air;
use crate::instrument::Instrument;
use crate::mistakes::{watched, wrong};
use chalumeau_core::bore::check::Check;
use chalumeau_core::bore::fingering_finder::{FingeringFinder, Found};
use chalumeau_core::bore::transfer_matrix::TransferMatrix;
use chalumeau_core::instrument::concert_pitch::A4_RANGE_HZ;
use chalumeau_core::units::WrittenNote;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::ops::ControlFlow;

fn a4(a4_hz: f64) -> PyResult<f64> {
    let (low, high) = A4_RANGE_HZ;
    if (low..=high).contains(&a4_hz) {
        return Ok(a4_hz);
    }
    Err(wrong(format_args!("a4 must lie in {low}..{high} Hz, got {a4_hz}")))
}

/// Fingerings for a written note, best first.
#[pyfunction]
pub fn find_fingerings<'py>(
    py: Python<'py>,
    instrument: &Instrument,
    written: u8,
    count: usize,
    temperature_c: f64,
    a4_hz: f64,
) -> PyResult<Bound<'py, PyDict>> {
    if !(1..=1_000).contains(&count) {
        return Err(wrong(format_args!("count must lie in 1..1000, got {count}")));
    }
    let (file, air, a4_hz, note) = (&instrument.file, air(temperature_c)?, a4(a4_hz)?, WrittenNote(written));
    let (found, chart, modes, unmoved) = py.detach(|| {
        let finder = watched(|stop| {
            let mut go_on = |_| if stop() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
            FingeringFinder::new(file, air, a4_hz, &mut go_on).ok_or("the search was ended")
        })?;
        let (found, chart) = (finder.best(note, count), finder.of_chart(note).map(|grip| grip.open));
        let model = TransferMatrix::new(file, air);
        let modes: Vec<_> =
            found.iter().map(|found| found.mode_of_file(file, &model).unwrap_or(0) as i64).collect();
        PyResult::Ok((found, chart, modes, finder.unmoved().to_vec()))
    })?;
    let numbers = |of: fn(&Found) -> f64| PyArray1::from_iter(py, found.iter().map(of));
    let columns = PyDict::new(py);
    columns.set_item("fingers", found.iter().map(|found| found.fingers.as_str()).collect::<Vec<_>>())?;
    columns.set_item(
        "open",
        found.iter().map(|found| found.grip.open_names(file).collect::<Vec<_>>()).collect::<Vec<_>>(),
    )?;
    columns.set_item("f_hz", numbers(|found| found.f_hz))?;
    columns.set_item("cents", numbers(|found| found.cents))?;
    columns.set_item("gamma_on", numbers(|found| found.gamma_on))?;
    columns.set_item("mode", PyArray1::from_vec(py, modes))?;
    columns.set_item(
        "evenness_db",
        numbers(|found| if found.mode > 1 { found.evenness_db } else { f64::NAN }),
    )?;
    columns.set_item("cost", numbers(|found| found.cost))?;
    columns
        .set_item("of_chart", found.iter().map(|found| chart == Some(found.grip.open)).collect::<Vec<_>>())?;
    columns.set_item("unmoved", unmoved)?;
    Ok(columns)
}

/// Whether each note of the chart has its resonance, and what a maker should look at.
#[pyfunction]
pub fn check_instrument<'py>(
    py: Python<'py>,
    instrument: &Instrument,
    temperature_c: f64,
    a4_hz: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let (air, a4_hz) = (air(temperature_c)?, a4(a4_hz)?);
    let check = py.detach(|| Check::new(&instrument.file, air, a4_hz));
    let notes = || check.notes.iter();
    let columns = PyDict::new(py);
    columns
        .set_item("written_midi", PyArray1::from_iter(py, notes().map(|note| i64::from(note.written.0))))?;
    columns.set_item("mode", PyArray1::from_iter(py, notes().map(|note| note.mode as i64)))?;
    columns.set_item("wanted_hz", PyArray1::from_iter(py, notes().map(|note| note.wanted_hz)))?;
    let peak_hz = notes().map(|note| note.peak.map_or(f64::NAN, |peak| peak.f_hz));
    columns.set_item("f_hz", PyArray1::from_iter(py, peak_hz))?;
    columns.set_item("cents", PyArray1::from_iter(py, notes().map(|note| note.cents.unwrap_or(f64::NAN))))?;
    columns.set_item("common_cents", check.common_cents())?;
    columns.set_item("is_usable", check.is_usable())?;
    columns.set_item("concerns", check.concerns.iter().map(ToString::to_string).collect::<Vec<_>>())?;
    Ok(columns)
}
