//! Takes of a plugin: where they go, what their rows belong to, and reading one back.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use super::desk::design;
use crate::plugin::params::ChalumeauParams;
use crate::take_file::TakeFile;
use chalumeau_core::instrument::Settings;
use chalumeau_knob::touch::study::{Side, plan};
use chalumeau_knob::touch::take::{Marks, Take};

/// Where takes go, for those who want them elsewhere.
const TAKES: &str = "CHALUMEAU_TAKES";

/// A take being written.
pub struct Recording {
    pub writer: TakeFile,
    pub path: PathBuf,
    pub rows: u64,
    pub trouble: Option<String>,
}

/// Reads a take, or says why not.
pub fn load(path: &str) -> Result<Arc<Take>, String> {
    let file = std::fs::File::open(path).map_err(|reason| format!("cannot read take {path}: {reason}"))?;
    Take::read(file).map(Arc::new).map_err(|reason| format!("take {path}: {reason}"))
}

/// What rows written now belong to.
pub fn marks(params: &ChalumeauParams, settings: &Settings) -> Marks {
    let law = settings.reed_law();
    let study = params
        .knob
        .study()
        .map(|(participant, trial, side)| (participant, trial.number, side, trial.condition(side)));
    Marks { reed: Some((law.h(), law.k())), study }
}

/// Opens a new take in the folder of takes.
pub fn begin(params: &ChalumeauParams) -> Result<Recording, String> {
    let folder = match std::env::var_os(TAKES) {
        Some(folder) => PathBuf::from(folder),
        None => dirs::document_dir()
            .or_else(dirs::data_dir)
            .ok_or_else(|| format!("no folder for takes; set {TAKES} to one"))?
            .join("Chalumeau")
            .join("takes"),
    };
    std::fs::create_dir_all(&folder).map_err(|reason| {
        format!("cannot make {}: {reason}; set {TAKES} to another folder", folder.display())
    })?;
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let path = (0..1_000)
        .map(|n| {
            folder.join(if n == 0 {
                format!("take-{seconds}.csv")
            } else {
                format!("take-{seconds}-{n}.csv")
            })
        })
        .find(|path| !path.exists())
        .ok_or_else(|| format!("{} is full of takes", folder.display()))?;
    let knob = &params.knob;
    let mut remarks = vec![
        format!(
            "Chalumeau {} take; t_us is the host's clock, angle from the knob's zero",
            env!("CARGO_PKG_VERSION")
        ),
        format!("feel {:?}", design(knob)),
    ];
    if let Some((participant, ..)) = params.knob.study() {
        let order: Vec<String> = plan(participant, knob.seed.value() as u32)
            .iter()
            .map(|trial| format!("{}:H={},A={}", trial.number, trial.h, trial.condition(Side::A).name()))
            .collect();
        remarks.push(format!(
            "study participant {participant} seed {} order {}",
            knob.seed.value(),
            order.join(" ")
        ));
    }
    let writer = TakeFile::create(&path, false, &remarks).map_err(|reason| reason.to_string())?;
    Ok(Recording { writer, path, rows: 0, trouble: None })
}
