//! The rows of a plan, as `chalumeau batch` reads it.

use crate::instrument::of_dict;
use crate::mistakes::wrong;
use chalumeau::cli::offline::{self, Rows};
use pyo3::prelude::*;
use std::path::PathBuf;

/// Column names and the values of each row: of a file, or of the text of a TOML plan, or of the same tables as JSON.
#[pyfunction]
#[pyo3(signature = (path=None, text=None, json=None))]
pub fn rows(
    path: Option<PathBuf>,
    text: Option<&str>,
    json: Option<&str>,
) -> PyResult<(Vec<String>, Vec<Vec<String>>)> {
    let rows = match (path, text, json) {
        (Some(path), ..) => Rows::read(&path),
        (None, Some(text), _) => Rows::parse(text),
        (None, None, Some(json)) => serde_json::from_str::<toml::Table>(json)
            .map_err(|error| format!("the dict is not like a plan: {error}"))
            .and_then(|table| toml::to_string(&table).map_err(|error| error.to_string()))
            .and_then(|text| Rows::parse(&text).map_err(|error| of_dict(&error))),
        (None, None, None) => Err("a plan is a path, a text or a dict".to_owned()),
    };
    let Rows { names, values } = rows.map_err(wrong)?;
    Ok((names, values))
}

/// Fails if these names and values are no arguments of a rendering.
#[pyfunction]
pub fn check(pairs: Vec<(String, String)>) -> PyResult<()> {
    offline::check(&pairs).map_err(wrong)
}

/// Fails if a rendering with these names and values cannot be played: also reads the files that they name. Prepares nothing.
#[pyfunction]
pub fn check_rendering(py: Python<'_>, pairs: Vec<(String, String)>) -> PyResult<()> {
    py.detach(|| offline::check_rendering(&pairs)).map_err(wrong)
}

/// The text of a preset, by its name; of the user's own first.
#[pyfunction]
pub fn preset_text(name: &str) -> PyResult<String> {
    offline::preset_text(name).map_err(wrong)
}
