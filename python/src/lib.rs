//! The compiled part of the Python package `chalumeau`, imported there as `chalumeau._native`.
//!
//! It translates and computes nothing itself: what a command of `chalumeau` does, it does by the same code. The package's
//! Python modules hold the documented functions. What takes longer than a millisecond runs without Python's
//! lock, and an array that leaves here is the memory that was computed into.

mod bore;
mod features;
mod instrument;
mod making;
mod mistakes;
mod reed;
mod render;
mod rows;
mod voice;

use chalumeau::parameters::{Kind, PARAMETERS};
use chalumeau::presets::{factory, user};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The parameters of the sound, in the order of hosts: for each its id, name, unit, range, default and meaning.
#[pyfunction]
fn parameters(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let of_sound = PARAMETERS
        .iter()
        .filter(|parameter| parameter.sets.is_some() && !matches!(parameter.kind, Kind::Status(_)));
    of_sound
        .map(|parameter| {
            let dict = PyDict::new(py);
            dict.set_item("id", parameter.id)?;
            dict.set_item("name", parameter.name)?;
            dict.set_item("group", parameter.group)?;
            dict.set_item("flag", parameter.flag.trim_start_matches('-').replace('-', "_"))?;
            dict.set_item("unit", parameter.unit())?;
            dict.set_item("range", parameter.range())?;
            dict.set_item("default", parameter.default_text())?;
            dict.set_item("meaning", parameter.meaning)?;
            dict.set_item("sound", parameter.sound)?;
            Ok(dict)
        })
        .collect()
}

/// The presets that come with the program and the user's own: for each its name, tags, author, and what it shows.
#[pyfunction]
fn presets(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let user = user();
    let all = factory::all().iter().chain(&user.presets);
    all.map(|preset| {
        let dict = PyDict::new(py);
        dict.set_item("name", &preset.name)?;
        dict.set_item("tags", &preset.tags)?;
        dict.set_item("author", &preset.author)?;
        dict.set_item("shows", &preset.shows)?;
        Ok(dict)
    })
    .collect()
}

/// The compiled part of the package `chalumeau`.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    chalumeau::cli::say_to(mistakes::warn);
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<instrument::Instrument>()?;
    module.add_class::<voice::Voice>()?;
    module.add_function(wrap_pyfunction!(parameters, module)?)?;
    module.add_function(wrap_pyfunction!(presets, module)?)?;
    module.add_function(wrap_pyfunction!(instrument::note, module)?)?;
    module.add_function(wrap_pyfunction!(render::render, module)?)?;
    module.add_function(wrap_pyfunction!(bore::impedance, module)?)?;
    module.add_function(wrap_pyfunction!(bore::impedance_peaks, module)?)?;
    module.add_function(wrap_pyfunction!(bore::thresholds, module)?)?;
    module.add_function(wrap_pyfunction!(bore::bifurcation, module)?)?;
    module.add_function(wrap_pyfunction!(bore::feel, module)?)?;
    module.add_function(wrap_pyfunction!(bore::torque, module)?)?;
    module.add_function(wrap_pyfunction!(making::find_fingerings, module)?)?;
    module.add_function(wrap_pyfunction!(making::check_instrument, module)?)?;
    module.add_function(wrap_pyfunction!(reed::reed_tables, module)?)?;
    module.add_function(wrap_pyfunction!(reed::reed_flow, module)?)?;
    module.add_function(wrap_pyfunction!(features::features, module)?)?;
    module.add_function(wrap_pyfunction!(features::find_notes, module)?)?;
    module.add_function(wrap_pyfunction!(rows::rows, module)?)?;
    module.add_function(wrap_pyfunction!(rows::check, module)?)?;
    module.add_function(wrap_pyfunction!(rows::check_rendering, module)?)?;
    module.add_function(wrap_pyfunction!(rows::preset_text, module)?)?;
    Ok(())
}
