//! Instruments: measurements of bore, tone holes and fingerings.

use crate::mistakes::wrong;
use chalumeau::cli::offline;
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::instrument_file::{Fingering, InstrumentFile};
use chalumeau_core::units::WrittenNote;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use std::hash::{DefaultHasher, Hash, Hasher};

/// A checked instrument file.
#[pyclass(frozen, module = "chalumeau._native")]
pub struct Instrument {
    pub file: InstrumentFile,
    /// What it was made from: a text, or the id of one that comes with the program. The same again makes the same instrument to the last
    /// bit, which `to_toml`, rounded for readers, does not.
    origin: Origin,
}

/// See [`Instrument::origin`].
enum Origin {
    Bundled(&'static str),
    Text(String),
}

#[pymethods]
impl Instrument {
    /// One that comes with the program, by its id.
    #[staticmethod]
    fn bundled(id: &str) -> PyResult<Self> {
        let ids = || Bundled::ALL.map(Bundled::id).join(", ");
        let bundled = Bundled::named(id).ok_or_else(|| {
            wrong(format_args!("no instrument is called {id:?}; the bundled ones are {}", ids()))
        })?;
        Ok(Self { file: bundled.file(), origin: Origin::Bundled(bundled.id()) })
    }

    /// The ids of those that come with the program.
    #[staticmethod]
    fn ids() -> Vec<&'static str> {
        Bundled::ALL.map(Bundled::id).to_vec()
    }

    /// Of the text of an instrument file, TOML.
    #[staticmethod]
    fn parse(text: &str) -> PyResult<Self> {
        let file = InstrumentFile::parse(text).map_err(wrong)?;
        Ok(Self { file, origin: Origin::Text(text.to_owned()) })
    }

    /// Of the same tables and keys as a TOML file has, as JSON.
    #[staticmethod]
    fn of_json(text: &str) -> PyResult<Self> {
        let table: toml::Table = serde_json::from_str(text)
            .map_err(|error| wrong(format_args!("the dict is not like an instrument file: {error}")))?;
        let text = toml::to_string(&table).map_err(wrong)?;
        let file = InstrumentFile::parse(&text).map_err(|error| {
            wrong(format_args!("the dict is no instrument: {}", of_dict(&error.to_string())))
        })?;
        Ok(Self { file, origin: Origin::Text(text) })
    }

    /// What a player calls it.
    #[getter]
    fn name(&self) -> &str {
        &self.file.name
    }

    /// Where its measurements come from.
    #[getter]
    fn source(&self) -> &str {
        &self.file.source
    }

    /// Semitones that it sounds below what is written.
    #[getter]
    fn transposition(&self) -> i8 {
        self.file.transposition
    }

    /// Length of the bore from the reed tip to the end of the bell, m.
    #[getter]
    fn length_m(&self) -> f64 {
        self.file.length_m()
    }

    /// Radius that zeta and Zc refer to, m.
    #[getter]
    fn nominal_radius_m(&self) -> f64 {
        self.file.nominal_radius_m
    }

    /// The same measurements as the text of an instrument file.
    fn to_toml(&self) -> String {
        self.file.to_toml()
    }

    /// The names of the tone holes from the reed to the bell, with their places and radii in m.
    fn holes(&self) -> Vec<(String, f64, f64)> {
        self.file.holes.iter().map(|hole| (hole.name.clone(), hole.x_m, hole.radius_m)).collect()
    }

    /// The fingering chart, from the lowest note to the highest.
    fn fingerings<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.file.fingerings.iter().map(|fingering| self.described(py, fingering)).collect()
    }

    fn __repr__(&self) -> String {
        let (low, high) = (self.file.lowest(), self.file.highest());
        format!("<Instrument {:?}, written {low} to {high}>", self.file.name)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.file == other.file
    }

    fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        self.file.to_toml().hash(&mut hasher);
        hasher.finish()
    }

    /// It travels between processes as what it was made from.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        let (maker, of) = match &self.origin {
            Origin::Bundled(id) => ("bundled", *id),
            Origin::Text(text) => ("parse", text.as_str()),
        };
        Ok((PyType::new::<Self>(py).getattr(maker)?, (of.to_owned(),)))
    }
}

/// An error about the text that was made of a dict, without its lines, which the user does not see.
pub fn of_dict(error: &str) -> String {
    let no_line = |text: &str| text.strip_prefix("line ")?.split_once(": ").map(|(_, what)| what.to_owned());
    if !error.contains("TOML parse error at line") {
        return no_line(error).unwrap_or_else(|| error.to_owned());
    }
    let says = error.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or_default();
    // Of a key that is missing, the first line of its table is shown.
    let is_quoted =
        |line: &&str| line.split_once('|').is_some_and(|(number, _)| number.trim().parse::<u32>().is_ok());
    let quoted =
        error.lines().find(is_quoted).and_then(|line| line.split_once('|')).map(|(_, text)| text.trim());
    match quoted {
        Some(text) if text.starts_with('[') || !says.starts_with("missing field") => {
            format!("{text}: {says}")
        }
        _ => says.to_owned(),
    }
}

impl Instrument {
    fn described<'py>(&self, py: Python<'py>, of: &Fingering) -> PyResult<Bound<'py, PyDict>> {
        let open = self.file.holes.iter().zip(&of.open).filter(|(_, open)| **open);
        let dict = PyDict::new(py);
        dict.set_item("written_midi", of.written.0)?;
        dict.set_item("written", of.written.to_string())?;
        dict.set_item("sounding_midi", of.written.sounding(self.file.transposition).map(|note| note.0))?;
        dict.set_item("register", &of.register)?;
        dict.set_item("mode", of.mode)?;
        dict.set_item("fingers", &of.fingers)?;
        dict.set_item("open", open.map(|(hole, _)| hole.name.as_str()).collect::<Vec<_>>())?;
        Ok(dict)
    }

    /// The fingering of a written note, or what would be right.
    pub fn fingering(&self, written: u8) -> PyResult<&Fingering> {
        let (low, high) = (self.file.lowest(), self.file.highest());
        self.file.fingering(WrittenNote(written)).ok_or_else(|| {
            wrong(format_args!(
                "written {} has no fingering; this instrument has {low} to {high}",
                WrittenNote(written)
            ))
        })
    }

    /// Which holes are open: of a written note, or those that are named.
    pub fn open(&self, fingering: &OpenHoles) -> PyResult<Vec<bool>> {
        match fingering {
            OpenHoles::Written(written) => Ok(self.fingering(*written)?.open.clone()),
            OpenHoles::Named(names) => {
                let mut open = vec![false; self.file.holes.len()];
                for name in names {
                    let hole = self.file.hole(name).ok_or_else(|| {
                        let all: Vec<_> = self.file.holes.iter().map(|hole| hole.name.as_str()).collect();
                        wrong(format_args!("no hole is called {name:?}; the holes are {}", all.join(", ")))
                    })?;
                    open[hole] = true;
                }
                Ok(open)
            }
        }
    }
}

/// A fingering, from Python.
#[derive(FromPyObject)]
pub enum OpenHoles {
    /// The written note that the chart has it for.
    Written(u8),
    /// Names of the open holes.
    Named(Vec<String>),
}

/// The MIDI number of a note: of a name such as C4, or of a number as text.
#[pyfunction]
pub fn note(text: &str) -> PyResult<u8> {
    offline::note(text).map_err(|right| wrong(format_args!("{text:?}: a note {right}")))
}
