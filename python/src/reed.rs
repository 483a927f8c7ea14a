//! The reed's tables and its flow law.

use crate::mistakes::wrong;
use chalumeau_core::reed::{ReedLaw, ReedTables};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The tables that sound, touch and firmware share.
#[pyfunction]
pub fn reed_tables(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let tables = ReedTables::reference();
    let dict = PyDict::new(py);
    dict.set_item("p", PyArray1::from_slice(py, &tables.x[..]))?;
    dict.set_item("x_a", PyArray1::from_slice(py, &tables.x_a[..]))?;
    dict.set_item("x_b", PyArray1::from_slice(py, &tables.x_b[..]))?;
    dict.set_item("sgn", PyArray1::from_iter(py, tables.sgn.iter().map(|&sign| i64::from(sign))))?;
    Ok(dict)
}

/// Flow through the reed at each pressure difference. Without `k` it follows H.
#[pyfunction]
pub fn reed_flow<'py>(
    py: Python<'py>,
    p: PyReadonlyArray1<'py, f64>,
    h: Option<f64>,
    k: Option<f64>,
    a: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let h = h.unwrap_or(ReedLaw::default().h());
    let law = match k {
        Some(k) => ReedLaw::free(h, k, a),
        None => ReedLaw::coupled(h, a),
    }
    .map_err(wrong)?;
    let tables = ReedTables::reference();
    let mut flows = p.as_array().to_vec();
    py.detach(|| flows.iter_mut().filter(|p| !p.is_nan()).for_each(|p| *p = law.flow(tables, *p)));
    Ok(PyArray1::from_vec(py, flows))
}
