//! Measurements of a rendered note, by the methods that the project's own tables use.

use crate::mistakes::wrong;
use chalumeau_core::analysis::onset::attack_s;
use chalumeau_core::analysis::pitch;
use chalumeau_core::analysis::spectrum::{centroid_hz, harmonic_levels_db, rms_dbfs, steady_segment};
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
    if !(1_000.0..=1_536_000.0).contains(&rate_hz) {
        return Err(wrong(format_args!("rate must lie in 1000..1536000 Hz, got {rate_hz}")));
    }
    if let Some(near_hz) = near_hz.filter(|near_hz| !(10.0..=5_000.0).contains(near_hz)) {
        return Err(wrong(format_args!("near must lie in 10..5000 Hz, got {near_hz}")));
    }
    let samples: Vec<f64> = samples.as_array().iter().map(|&sample| f64::from(sample)).collect();
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
