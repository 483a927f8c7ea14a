//! Errors as Python's exceptions: the texts say what was given and what would be right.

use chalumeau::parameters::PARAMETERS;
use pyo3::PyErr;
use pyo3::exceptions::PyValueError;
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

/// Where a name that is unknown differs from a flag by its case alone (h, H), that flag is meant.
fn in_another_case(text: &str) -> Option<String> {
    let (what, rest) = text.split_once(" is called \"")?;
    let name = rest.split('"').next()?;
    let mut flags = PARAMETERS.iter().filter_map(|parameter| parameter.flag.strip_prefix("--"));
    let flag = flags.find(|flag| *flag != name && flag.eq_ignore_ascii_case(name))?;
    Some(format!("{what} is called {name:?}; do you mean {flag}?"))
}
