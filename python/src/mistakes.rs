//! Errors as Python's exceptions: the texts say what was given and what would be right.

use pyo3::PyErr;
use pyo3::exceptions::PyValueError;
use std::fmt::Display;

/// A `ValueError` with this text.
pub fn wrong(what: impl Display) -> PyErr {
    PyValueError::new_err(what.to_string())
}
