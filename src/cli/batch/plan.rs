//! What a batch renders: names, and their values for each file.

use crate::cli::render::RenderCommand;
use crate::cli::words::Names;
use crate::text_file;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Most files of one batch.
const FILES_MOST: usize = 1_000_000;
/// Flags of `render` that the batch sets itself, or that name further files.
const OWN: [&str; 6] = ["out", "force", "probe", "plot", "plot-at", "help"];

/// The values of one file, in the order of the plan's names; an empty one leaves its name out.
pub struct Variation {
    pub values: Vec<String>,
    /// Its line in the plan, from 1, if it has one of its own.
    pub line: Option<u64>,
}

/// What is set for each file.
pub struct Plan {
    /// Names: what is the same for all files, then what varies.
    pub names: Vec<String>,
    /// The files to render.
    pub variations: Vec<Variation>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlanFile {
    #[serde(default)]
    same: BTreeMap<String, toml::Value>,
    vary: toml::Table,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Scalar {
    Switch(bool),
    Whole(i64),
    Number(f64),
    Text(String),
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Values {
    List(Vec<Scalar>),
    Steps(Steps),
}

/// Line, from 1, of the record that the reader found beginning at `byte`: past the empty lines before it.
fn line_of_record(text: &str, byte: usize) -> u64 {
    let (before, rest) = text.split_at_checked(byte).unwrap_or((text, ""));
    let empty = rest.len() - rest.trim_start_matches(['\n', '\r']).len();
    1 + (before.matches('\n').count() + rest[..empty].matches('\n').count()) as u64
}

/// Equal steps from one number to another.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Steps {
    from: f64,
    to: f64,
    steps: usize,
}

impl Scalar {
    fn text(self) -> String {
        match self {
            Self::Switch(on) => on.to_string(),
            Self::Whole(number) => number.to_string(),
            Self::Number(number) => number.to_string(),
            Self::Text(text) => text,
        }
    }
}

impl Values {
    fn texts(self, name: &str) -> Result<Vec<String>, String> {
        let texts: Vec<_> = match self {
            Self::List(list) => list.into_iter().map(Scalar::text).collect(),
            Self::Steps(Steps { steps: 1, from, to }) if from == to => vec![from.to_string()],
            Self::Steps(Steps { steps: 1, from, to }) => {
                return Err(format!("{name}: from {from} to {to} are 2 steps or more, got 1"));
            }
            Self::Steps(Steps { from, to, steps }) if (2..=FILES_MOST).contains(&steps) => (0..steps)
                // Nine digits: the sum of steps is not to show its last bits.
                .map(|step| from + (to - from) * step as f64 / (steps - 1) as f64)
                .map(|value| ((value * 1e9).round() / 1e9).to_string())
                .collect(),
            Self::Steps(Steps { steps, .. }) => {
                return Err(format!("{name}: steps must lie in 1..{FILES_MOST}, got {steps}"));
            }
        };
        if texts.is_empty() { Err(format!("{name} has no values")) } else { Ok(texts) }
    }
}

/// Fails if a name is none, or stands twice.
fn check_names(all: &[String]) -> Result<(), String> {
    let names = Names::of::<RenderCommand>();
    for (at, name) in all.iter().enumerate() {
        if all[..at].contains(name) {
            return Err(format!("{name} stands twice; give each name once"));
        }
        if OWN.contains(&name.as_str()) {
            return Err(format!("{name} cannot be in a plan: the batch names the files itself"));
        }
        names.check(name)?;
    }
    Ok(())
}

impl Plan {
    /// Reads a plan. What is wrong is said without the name of the file.
    pub fn read(path: &Path) -> Result<Self, String> {
        let text = text_file::read(path).map_err(|error| format!("cannot be read: {error}"))?;
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv")) {
            Self::from_csv(&text)
        } else {
            Self::from_toml(&text)
        }
    }

    pub fn from_toml(text: &str) -> Result<Self, String> {
        let PlanFile { same, vary } =
            toml::from_str(text).map_err(|error| error.to_string().trim().to_owned())?;
        if vary.is_empty() {
            return Err("nothing varies: [vary] is empty".to_owned());
        }
        // A wrong name is said before its values are read.
        check_names(&same.keys().chain(vary.keys()).cloned().collect::<Vec<_>>())?;
        let (mut names, mut one) = (Vec::new(), Vec::new());
        for (name, value) in same {
            let scalar: Scalar = value.try_into().map_err(|_| {
                format!("{name} in [same] must be a number, a text in quotes, true or false; a list goes into [vary]")
            })?;
            names.push(name);
            one.push(scalar.text());
        }
        let mut variations = vec![one];
        for (name, values) in vary {
            let values: Values = values
                .try_into()
                .map_err(|_| {
                    format!("{name} must be a list of numbers, of texts in quotes, or of true and false, or {{ from = 0.4, to = 0.6, steps = 5 }}")
                })?;
            let texts = values.texts(&name)?;
            if variations.len() * texts.len() > FILES_MOST {
                return Err(format!("these are more than {FILES_MOST} files"));
            }
            variations = variations
                .iter()
                .flat_map(|begun: &Vec<String>| {
                    texts.iter().map(|text| begun.iter().chain([text]).cloned().collect::<Vec<_>>())
                })
                .collect();
            names.push(name);
        }
        let variations = variations.into_iter().map(|values| Variation { values, line: None });
        Self { names, variations: variations.collect() }.checked()
    }

    pub fn from_csv(text: &str) -> Result<Self, String> {
        let mut reader =
            csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
        let names: Vec<_> =
            reader.headers().map_err(|error| error.to_string())?.iter().map(str::to_owned).collect();
        if names.iter().all(String::is_empty) {
            return Err("the first line must have the names, for example written,gamma".to_owned());
        }
        let variations = reader
            .into_records()
            .map(|record| {
                let record = record.map_err(|error| {
                    let line = error.position().map_or(0, csv::Position::line);
                    match error.kind() {
                        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                            format!("line {line} has {len} fields, the line of names has {expected_len}")
                        }
                        _ => format!("line {line}: {error}"),
                    }
                })?;
                let line = record.position().map(|at| line_of_record(text, at.byte() as usize));
                Ok(Variation { values: record.iter().map(str::to_owned).collect(), line })
            })
            .collect::<Result<Vec<_>, String>>()?;
        if variations.is_empty() {
            return Err("there is no line below the names".to_owned());
        }
        Self { names, variations }.checked()
    }

    /// Fails if a name is none.
    fn checked(self) -> Result<Self, String> {
        check_names(&self.names)?;
        Ok(self)
    }

    /// The words of the command that renders a variation.
    pub fn words(&self, variation: &Variation) -> Result<Vec<String>, String> {
        let names = Names::of::<RenderCommand>();
        names.words(self.names.iter().map(String::as_str).zip(variation.values.iter().map(String::as_str)))
    }
}
