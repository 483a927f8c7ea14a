//! Errors as Python's exceptions: the texts say what was given and what would be right.

use chalumeau::parameters::PARAMETERS;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;
use std::cell::Cell;
use std::fmt::Display;

/// What the command line advises, and the same for Python.
const ADVICE: [(&str, &str); 3] = [
    ("`chalumeau presets list` lists", "chalumeau.presets() lists"),
    (
        "`chalumeau render --help` and `chalumeau parameters` list",
        "help(chalumeau.render) and chalumeau.parameters() list",
    ),
    ("`chalumeau parameters` lists", "chalumeau.parameters() lists"),
];

/// A `ValueError` with this text.
pub fn wrong(what: impl Display) -> PyErr {
    let text = ADVICE.iter().fold(what.to_string(), |text, (of_shell, ours)| text.replace(of_shell, ours));
    PyValueError::new_err(in_another_case(&text).unwrap_or(text))
}

thread_local! {
    /// What a signal raised while Rust code worked.
    static RAISED: Cell<Option<PyErr>> = const { Cell::new(None) };
}

/// Fails if the user wants to stop (Ctrl-C).
pub fn signals() -> PyResult<()> {
    Python::attach(|py| py.check_signals())
}

/// The result of work that asks now and then whether it is to stop; what the signal raised (Ctrl-C) if there was one.
pub fn watched<T, E: Display>(work: impl FnOnce(fn() -> bool) -> Result<T, E>) -> PyResult<T> {
    let done = work(|| signals().map_err(|raised| RAISED.set(Some(raised))).is_err());
    // Also where the work was done before it could stop.
    RAISED.take().map_or_else(|| done.map_err(wrong), Err)
}

/// What the code of the commands says beside its results, as Python's warnings. Where a warning is to be an error, that is raised at the
/// end of the work.
pub fn warn(said: &str) {
    let said = ["note: ", "warning: "].iter().find_map(|mark| said.strip_prefix(mark)).unwrap_or(said);
    let warned = Python::attach(|py| {
        // Of the line that called the package.
        let stacklevel = [("stacklevel", 2)].into_py_dict(py)?;
        py.import("warnings")?.call_method("warn", (said,), Some(&stacklevel)).map(drop)
    });
    if let Err(raised) = warned {
        RAISED.set(Some(raised));
    }
}

/// Where a name that is unknown differs from a flag by its case alone (h, H), that flag is meant.
fn in_another_case(text: &str) -> Option<String> {
    let (what, rest) = text.split_once(" is called \"")?;
    let name = rest.split('"').next()?;
    let mut flags = PARAMETERS.iter().filter_map(|parameter| parameter.flag.strip_prefix("--"));
    let flag = flags.find(|flag| *flag != name && flag.eq_ignore_ascii_case(name))?;
    Some(format!("{what} is called {name:?}; do you mean {flag}?"))
}
