//! Errors as Python's exceptions: the texts say what was given and what would be right.

use chalumeau::parameters::PARAMETERS;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;
use std::cell::Cell;
use std::fmt::Display;

/// What the command line advises, and the same for Python.
const ADVICE: [(&str, &str); 6] = [
    ("`chalumeau presets list` lists", "chalumeau.presets() lists"),
    (
        "`chalumeau render --help` and `chalumeau parameters` list",
        "help(chalumeau.render) and chalumeau.parameters() list",
    ),
    ("`chalumeau parameters` lists", "chalumeau.parameters() lists"),
    ("--set beyond=octave plays", "beyond=\"octave\" plays"),
    ("--players 2 or more play", "players=2 or more play"),
    ("--untuned plays", "untuned=True plays"),
];

/// Where neither a score nor a note is given.
const NOTHING_TO_PLAY: &str = "nothing to play: give written=\"C4\" or sounding=58 for a note, scale=\"E3:C6\", a MIDI file or a list of notes";

/// A `ValueError` with this text.
pub fn wrong(what: impl Display) -> PyErr {
    let text = advised(&what.to_string());
    PyValueError::new_err(in_another_case(&text).unwrap_or(text))
}

/// A text of the command line as Python has it.
pub fn advised(text: &str) -> String {
    if text.contains("required arguments were not provided") && text.contains("--scale") {
        return NOTHING_TO_PLAY.to_owned();
    }
    ADVICE.iter().fold(text.to_owned(), |text, (of_shell, ours)| text.replace(of_shell, ours))
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
        // Where nobody knows who called, Python's usual place.
        let stacklevel = [("stacklevel", 1 + frames_within(py).unwrap_or(0))].into_py_dict(py)?;
        py.import("warnings")?.call_method("warn", (advised(said),), Some(&stacklevel)).map(drop)
    });
    if let Err(raised) = warned {
        RAISED.set(Some(raised));
    }
}

/// How many calls of the package stand between the user's line and this code.
fn frames_within(py: Python<'_>) -> PyResult<usize> {
    let mut frame = py.import("sys")?.call_method1("_getframe", (0,))?;
    let mut count = 0;
    while !frame.is_none() {
        // Code of `exec` may have no name; then it is the user's.
        let name = frame.getattr("f_globals")?.call_method1("get", ("__name__", ""))?;
        let module = name.extract::<String>().unwrap_or_default();
        if module != "chalumeau" && !module.starts_with("chalumeau.") {
            break;
        }
        count += 1;
        frame = frame.getattr("f_back")?;
    }
    Ok(count)
}

/// Where a name that is unknown differs from a flag by its case alone (h, H), that flag is meant.
fn in_another_case(text: &str) -> Option<String> {
    let (what, rest) = text.split_once(" is called \"")?;
    let name = rest.split('"').next()?;
    let mut flags = PARAMETERS.iter().filter_map(|parameter| parameter.flag.strip_prefix("--"));
    let flag = flags.find(|flag| *flag != name && flag.eq_ignore_ascii_case(name))?;
    Some(format!("{what} is called {name:?}; do you mean {flag}?"))
}
