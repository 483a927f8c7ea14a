//! What takes too long for the audio thread and for the page: asked in JSON by the page's workers, each with a module of its own.
//!
//! A question names an instrument: `{"rate": Hz, "instrument": its place among the bundled}` or `{"rate": Hz, "file": text,
//! "prepared": text}`, and `"moved"`: its moved holes. Then `"do"` is one of
//! - `"move"`: the instrument with its holes moved, at once, or with `"fit": true` fitted, which takes seconds. Gives `file`,
//!   `prepared` and `holes`.
//! - `"feel"`: what a knob should feel like with the page's `values`, under `ceiling`, `stiffness` and `push`. Gives bytes for
//!   [`PlayedFeel::from_bytes`](chalumeau_knob::touch::feel::PlayedFeel::from_bytes), or text with the reason why not.
//! - `"open"`: prepares the instrument of the file `text`; a minute or more, unless only its holes are not those of a bundled
//!   instrument. Gives `instrument` and `moved`, or `file`, `prepared` and `drawn`.
//!
//! Everything else gives `{"failed": why}`.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};

use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::instrument_file::{InstrumentError, InstrumentFile};
use chalumeau_core::bore::moved_hole::MovedHole;
use chalumeau_core::haptics::{FeelDesign, TorqueLimits};
use chalumeau_core::instrument::prepare::{PreparedInstrument, altered};
use chalumeau_core::instrument::{Model, Preparation, Settings, Wanted};
use chalumeau_knob::touch::feel::InstrumentFeel;
use serde_json::{Value, json};

use crate::{drawn, values};

/// The instrument asked for last, as its file has it, with its model; and what its bore requires.
#[derive(Default)]
struct Bench {
    of: String,
    base: Option<(InstrumentFile, Arc<Model>)>,
    felt: Option<(String, InstrumentFeel)>,
}

static BENCH: Mutex<Option<Bench>> = Mutex::new(None);

/// The answer to a question.
pub fn answer(question: &[u8]) -> Vec<u8> {
    let mut bench = BENCH.lock().unwrap_or_else(PoisonError::into_inner);
    let bench = bench.get_or_insert_default();
    let answer = serde_json::from_slice(question)
        .map_err(|error| format!("the question is not JSON: {error}"))
        .and_then(|question: Value| bench.answer(&question));
    answer.unwrap_or_else(|failed| json!({ "failed": failed }).to_string().into_bytes())
}

impl Bench {
    fn answer(&mut self, question: &Value) -> Result<Vec<u8>, String> {
        let rate_hz = question["rate"].as_f64().ok_or("the question has no rate")?;
        match question["do"].as_str() {
            Some("move") => {
                let (file, model) = self.moved(question, rate_hz, question["fit"] == true)?;
                let told = told(&file, &model)?;
                Ok(told.to_string().into_bytes())
            }
            Some("feel") => self.feel(question, rate_hz),
            Some("open") => {
                let text = question["text"].as_str().ok_or("the question has no text")?;
                open(text, rate_hz).map(|told| told.to_string().into_bytes())
            }
            other => Err(format!("nobody here can do {other:?}")),
        }
    }

    /// The instrument of a question before its holes are moved.
    fn base(&mut self, question: &Value, rate_hz: f64) -> Result<(InstrumentFile, Arc<Model>), String> {
        let of = format!("{rate_hz} {} {}", question["instrument"], question["file"]);
        if self.of == of
            && let Some(base) = &self.base
        {
            return Ok(base.clone());
        }
        let made = match question["file"].as_str() {
            Some(text) => {
                let file = InstrumentFile::parse(text).map_err(|error| error.to_string())?;
                let prepared = question["prepared"].as_str().and_then(PreparedInstrument::from_text);
                let model = prepared.and_then(|prepared| prepared.model(&file));
                (file, model.ok_or("the file and its preparation do not belong together")?)
            }
            None => {
                let place = question["instrument"].as_u64().unwrap_or(u64::MAX);
                let bundled = usize::try_from(place).ok().and_then(|place| Bundled::ALL.get(place));
                let file = bundled.ok_or("there is no such instrument")?.file();
                let wanted = Wanted::new(file.clone(), rate_hz);
                let model = Preparation::new(&wanted, None).ready().map_err(|error| error.to_string())?;
                (file, model.ok_or("the instrument is not prepared for this rate")?)
            }
        };
        let base = (made.0, Arc::new(made.1));
        (self.of, self.base) = (of, Some(base.clone()));
        Ok(base)
    }

    fn moved(
        &mut self,
        question: &Value,
        rate_hz: f64,
        fit: bool,
    ) -> Result<(InstrumentFile, Arc<Model>), String> {
        let (file, base) = self.base(question, rate_hz)?;
        let moved: Vec<MovedHole> = match &question["moved"] {
            Value::Null => Vec::new(),
            moved => serde_json::from_value(moved.clone()).map_err(|error| error.to_string())?,
        };
        if moved.is_empty() {
            return Ok((file, base));
        }
        let (name, source) = (&file.name, &file.source);
        let names: Vec<_> = moved.iter().map(|hole| hole.name.as_str()).collect();
        let file = InstrumentFile {
            name: format!("{name}, holes moved"),
            source: format!("{source} Moved by hand: {}.", names.join(", ")),
            ..file.with_holes_moved(&moved)
        };
        let model = if fit {
            altered::fitted(&base, &file, &mut |_| ControlFlow::Continue(()))
        } else {
            altered::at_once(&base, &file)
        };
        Ok((file, Arc::new(model.map_err(|error| error.to_string())?)))
    }

    fn feel(&mut self, question: &Value, rate_hz: f64) -> Result<Vec<u8>, String> {
        let (_, model) = self.moved(question, rate_hz, false)?;
        let of = format!("{} {}", self.of, question["moved"]);
        if self.felt.as_ref().is_none_or(|(before, _)| *before != of) {
            self.felt = Some((of, InstrumentFeel::new(&model)));
        }
        let (_, feels) = self.felt.as_ref().ok_or("no instrument")?;
        let mut settings = Settings::default();
        for (at, value) in question["values"].as_array().into_iter().flatten().enumerate() {
            values::set(&mut settings, at, value.as_f64().unwrap_or_default() as f32);
        }
        let number = |name: &str| question[name].as_f64().unwrap_or_default();
        let limits = TorqueLimits {
            ceiling_mnm: number("ceiling"),
            stiffness_nm_per_rad: number("stiffness"),
            push_nm_per_rad: number("push"),
        };
        // A knob that allows less than the usual feel gets the strongest that it allows.
        let weakened = feels.strongest(&settings, &FeelDesign::default(), &limits);
        let (table, _) = weakened.map_err(|refused| refused.to_string())?;
        Ok(feels.played(&table, &settings).to_bytes())
    }
}

fn told(file: &InstrumentFile, model: &Model) -> Result<Value, String> {
    let prepared = PreparedInstrument::of(model).to_text().ok_or("a number of the fit has no text")?;
    Ok(json!({ "file": file.to_toml(), "prepared": prepared, "holes": drawn::holes(file) }))
}

/// What a file's text rounds away, m.
const ROUNDED_M: f64 = 1e-9;

/// The bundled instrument of which only the holes stand elsewhere, and those holes.
fn bundled(file: &InstrumentFile) -> Option<(usize, Vec<MovedHole>)> {
    let same = |a: f64, b: f64| (a - b).abs() < ROUNDED_M;
    let is_it = |own: &InstrumentFile| {
        let bores = file.bore.iter().zip(&own.bore).all(|(a, b)| {
            same(a.x_start_m, b.x_start_m)
                && same(a.x_end_m, b.x_end_m)
                && same(a.r_start_m, b.r_start_m)
                && same(a.r_end_m, b.r_end_m)
        });
        let holes = file.holes.iter().zip(&own.holes).all(|(a, b)| {
            (&a.name, a.kind, a.register) == (&b.name, b.kind, b.register) && same(a.chimney_m, b.chimney_m)
        });
        let counts = |of: &InstrumentFile| (of.bore.len(), of.holes.len(), of.transposition);
        bores && holes && counts(file) == counts(own) && file.fingerings == own.fingerings
    };
    Bundled::ALL.iter().enumerate().find_map(|(at, bundled)| {
        let own = bundled.file();
        let moved = file
            .holes
            .iter()
            .zip(&own.holes)
            .filter(|(hole, own)| !same(hole.x_m, own.x_m) || !same(hole.radius_m, own.radius_m));
        let moved = moved.map(|(hole, _)| MovedHole {
            name: hole.name.clone(),
            x_m: hole.x_m,
            radius_m: hole.radius_m,
        });
        is_it(&own).then(|| (at, moved.collect()))
    })
}

fn open(text: &str, rate_hz: f64) -> Result<Value, String> {
    let file = InstrumentFile::parse(text).map_err(|error| match error {
        InstrumentError::Syntax(error) => format!("This is not a Chalumeau instrument file (.toml). {error}"),
        error => error.to_string(),
    })?;
    if let Some((at, moved)) = bundled(&file) {
        return Ok(json!({ "instrument": at, "moved": moved, "name": file.name }));
    }
    let wanted = Wanted::new(file.clone(), rate_hz);
    let model = Preparation::new(&wanted, None).tuned(&mut |_| ControlFlow::Continue(()));
    let model = model.map_err(|error| error.to_string())?;
    let mut told = told(&file, &model)?;
    told["drawn"] = drawn::drawn(&file, &model);
    Ok(told)
}
