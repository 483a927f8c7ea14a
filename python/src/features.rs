//! Measurements of a note and of a recording, by the methods that the project's own tables use.

use crate::mistakes::wrong;
use chalumeau_core::analysis::onset::attack_s;
use chalumeau_core::analysis::spectrum::{centroid_hz, harmonic_levels_db, rms_dbfs, steady_segment};
use chalumeau_core::analysis::{pitch, recording};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Pitch, spectrum, level and attack of a note; `near_hz` is what it is to be, Hz.
#[pyfunction]
pub fn features<'py>(
    py: Python<'py>,
    samples: PyReadonlyArray1<'py, f32>,
    rate_hz: f64,
    near_hz: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    check_rate(rate_hz)?;
    if let Some(near_hz) = near_hz.filter(|near_hz| !(10.0..=5_000.0).contains(near_hz)) {
        return Err(wrong(format_args!("near must lie in 10..5000 Hz, got {near_hz}")));
    }
    let samples = to_f64(&samples);
    let (f0_hz, centroid, attack, level, harmonics) = py.detach(|| {
        let steady = steady_segment(&samples, rate_hz).map(|range| &samples[range]);
        let f0_hz = steady.and_then(|steady| match near_hz {
            Some(near_hz) => pitch::fundamental_near_hz(steady, rate_hz, near_hz),
            None => pitch::fundamental_hz(steady, rate_hz),
        });
        let harmonics = steady.zip(f0_hz).map(|(steady, f0_hz)| harmonic_levels_db(steady, rate_hz, f0_hz));
        let centroid = steady.and_then(|steady| centroid_hz(steady, rate_hz));
        (f0_hz, centroid, attack_s(&samples, rate_hz), steady.map(rms_dbfs), harmonics.unwrap_or_default())
    });
    let dict = PyDict::new(py);
    dict.set_item("f0_hz", f0_hz.unwrap_or(f64::NAN))?;
    dict.set_item("steady_dbfs", level.unwrap_or(f64::NEG_INFINITY))?;
    dict.set_item("centroid_hz", centroid.unwrap_or(f64::NAN))?;
    dict.set_item("attack_s", attack.unwrap_or(f64::NAN))?;
    dict.set_item("harmonics_db", harmonics)?;
    Ok(dict)
}

/// The notes of a recording of one voice.
#[pyfunction]
pub fn find_notes<'py>(
    py: Python<'py>,
    samples: PyReadonlyArray1<'py, f32>,
    rate_hz: f64,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    check_rate(rate_hz)?;
    let samples = to_f64(&samples);
    let (notes, _) = py.detach(|| recording::notes(&samples, rate_hz));
    let dict = |note: recording::Note| {
        let dict = PyDict::new(py);
        dict.set_item("start_s", note.start_s)?;
        dict.set_item("end_s", note.end_s)?;
        dict.set_item("f0_hz", note.f0_hz)?;
        dict.set_item("level_dbfs", note.level_dbfs)?;
        dict.set_item("t90_s", note.t90_s)?;
        dict.set_item("centroid_hz", note.centroid_hz)?;
        dict.set_item("harmonics_db", note.levels_db)?;
        Ok(dict)
    };
    notes.into_iter().map(dict).collect()
}

fn check_rate(rate_hz: f64) -> PyResult<()> {
    match (1_000.0..=1_536_000.0).contains(&rate_hz) {
        true => Ok(()),
        false => Err(wrong(format_args!("rate must lie in 1000..1536000 Hz, got {rate_hz}"))),
    }
}

fn to_f64(samples: &PyReadonlyArray1<'_, f32>) -> Vec<f64> {
    samples.as_array().iter().map(|&sample| f64::from(sample)).collect()
}
