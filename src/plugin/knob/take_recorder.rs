//! Records takes: their folder, their remarks, the marks of their rows. Also reads a take back.

use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use super::feel_design::feel_design;
use super::heard_sound::SoundListener;
use crate::output::{KeptLines, NewFile, free_path};
use crate::plugin::params::ChalumeauParams;
use crate::take_file::{TakeFile, knob_in_words};
use chalumeau_core::instrument::{BreathResponse, Settings};
use chalumeau_knob::touch::study::{StudySide, plan};
use chalumeau_knob::touch::take::{Take, TakeHead, TakeMarks, TakeRow};
use chalumeau_knob::wire::Info;

/// Environment variable that names another folder for takes.
const TAKES: &str = "CHALUMEAU_TAKES";

/// How long a row waits for what was heard at its time, us: the analysis is a quarter of a second behind, and a host may be
/// slow. After that it is written without.
const WAITS_US: u64 = 600_000;

/// Writes at most one take at a time.
pub struct TakeRecorder {
    recording: Option<Recording>,
    sound: SoundListener,
    /// Rows that wait for what was heard.
    waiting: VecDeque<(TakeRow, TakeMarks)>,
}

/// A take that is being written.
struct Recording {
    writer: TakeFile,
    rows: u64,
    /// Why no more rows can be written.
    error: Option<io::Error>,
    /// How often a saved state had been loaded when it began.
    loads: u32,
}

impl TakeRecorder {
    /// No take is open; `sound` brings what is heard.
    pub fn new(sound: SoundListener) -> Self {
        Self { recording: None, sound, waiting: VecDeque::new() }
    }

    /// Opens a new take of a knob that begins with this head, if none is open.
    pub fn begin(
        &mut self,
        params: &ChalumeauParams,
        head: &TakeHead,
        knob: Option<&Info>,
    ) -> Result<(), String> {
        if self.recording.is_none() {
            self.recording = Some(create(remarks(params, head, knob), params.loads())?);
        }
        Ok(())
    }

    /// Adds a row to the take, if one is open. It is written once it is known what was heard.
    pub fn take_in(&mut self, moment: &TakeRow, marks: &TakeMarks) {
        if self.recording.is_some() {
            self.waiting.push_back((*moment, *marks));
        }
    }

    /// Writes the rows of which it is known what was heard, and those that have waited in vain.
    pub fn write_known(&mut self) {
        self.sound.listen();
        let newest_us = self.waiting.back().map_or(0, |(newest, _)| newest.t_us);
        self.write_until(self.sound.known_until_us().max(newest_us.saturating_sub(WAITS_US)));
    }

    fn write_until(&mut self, until_us: u64) {
        let Some(recording) = &mut self.recording else { return };
        while let Some((moment, mut marks)) = self.waiting.pop_front_if(|(moment, _)| moment.t_us <= until_us)
        {
            marks.heard = self.sound.at(moment.t_us);
            match recording.writer.write(&moment, &marks) {
                Ok(()) => recording.rows += 1,
                Err(reason) => {
                    recording.error = Some(reason);
                    return;
                }
            }
        }
    }

    /// Nothing more can be written: the open take is to be ended.
    pub fn has_failed(&self) -> bool {
        self.recording.as_ref().is_some_and(|recording| recording.error.is_some())
    }

    /// Rows of the open take.
    pub fn rows(&self) -> Option<u64> {
        self.recording.as_ref().map(|recording| recording.rows)
    }

    /// Completes the open take, as far as it could be written, and makes it the take of the project. Returns a message for the
    /// user, if a take was open.
    pub fn end(&mut self, params: &ChalumeauParams) -> Option<String> {
        if !self.has_failed() {
            self.write_until(u64::MAX);
        }
        self.waiting.clear();
        let Recording { writer, rows, error, loads } = self.recording.take()?;
        if rows == 0 && error.is_none() {
            return Some("nothing recorded: the knob sent nothing".to_owned());
        }
        let KeptLines { path, cut } = match (writer.keep_rows(), &error) {
            (Ok(kept), _) => kept,
            (Err(_), Some(reason)) => return Some(format!("take lost: {reason}")),
            (Err(reason), None) => return Some(format!("take lost: {reason}")),
        };
        let path = path.display().to_string();
        let text = match error.or(cut) {
            Some(reason) => format!("take {path} ends early: {reason}"),
            None => format!("take {path} has {rows} rows"),
        };
        // A state that has been loaded meanwhile has a take of its own; the message says where this one is.
        if params.loads() == loads {
            if let Ok(mut take) = params.knob.take.write() {
                *take = path;
            }
            params.host.state_changed();
        }
        Some(text)
    }
}

/// Reads a take. The error is a message for the user.
pub fn load_take(path: &str) -> Result<Arc<Take>, String> {
    let file = std::fs::File::open(path).map_err(|reason| format!("cannot read take {path}: {reason}"))?;
    Take::read(file).map(Arc::new).map_err(|reason| format!("take {path}: {reason}"))
}

/// Reed and study trial of the rows that are written now.
pub fn marks(params: &ChalumeauParams, settings: &Settings) -> TakeMarks {
    let law = settings.reed_law();
    let study = params
        .knob
        .study()
        .map(|(participant, trial, side)| (participant, trial.number, side, trial.condition(side)));
    TakeMarks { reed: Some((law.h(), law.k())), study, ..TakeMarks::default() }
}

/// Creates a new take in the folder of takes.
fn create(remarks: Vec<String>, loads: u32) -> Result<Recording, String> {
    let folder = match std::env::var_os(TAKES).filter(|folder| !folder.is_empty()) {
        // A project holds the path, and is opened from other folders.
        Some(folder) => std::path::absolute(&folder)
            .map_err(|reason| format!("{TAKES} is {}: {reason}", folder.display()))?,
        None => dirs::document_dir()
            .or_else(dirs::data_dir)
            .ok_or_else(|| format!("no folder for takes; set {TAKES} to one"))?
            .join("Chalumeau")
            .join("takes"),
    };
    std::fs::create_dir_all(&folder).map_err(|reason| {
        format!("cannot create {}: {reason}; set {TAKES} to another folder", folder.display())
    })?;
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let path = free_path(&folder.join(format!("take-{seconds}.csv")));
    let writer = NewFile::create(&path, false)
        .and_then(|file| TakeFile::begin(file, remarks))
        .map_err(|reason| reason.to_string())?;
    Ok(Recording { writer, rows: 0, error: None, loads })
}

/// The lines above a take's columns: program, knob, what is played and felt at the beginning, and the order of the study's trials.
fn remarks(params: &ChalumeauParams, head: &TakeHead, device: Option<&Info>) -> Vec<String> {
    let knob = &params.knob;
    let feel = feel_design(knob);
    let mut remarks = vec![
        format!(
            "Chalumeau {} take; t_us and heard_us are the host's clock, angle from the knob's zero",
            env!("CARGO_PKG_VERSION")
        ),
        format!(
            "damping {} mNm s/rad, friction {} mNm, wall {} mNm per degree from {} of the angle of closure, \
             slap {} mNm per degree, a change takes {} ms",
            feel.damping_mnms as f32,
            feel.friction_mnm as f32,
            feel.wall_mnm_per_deg as f32,
            feel.wall_share as f32,
            feel.slap_mnm_per_deg as f32,
            feel.morph_ms
        ),
    ];
    remarks.extend(device.map(knob_in_words));
    let response = match params.settings().breath_response {
        BreathResponse::Played => "played",
        BreathResponse::Physical => "physical",
    };
    remarks.push(format!("breath response {response}"));
    remarks.extend(head.remarks());
    if let Some((participant, ..)) = knob.study() {
        let seed = knob.seed.value();
        let order: Vec<String> = plan(participant, seed as u32)
            .iter()
            .map(|trial| format!("{}:H={},A={}", trial.number, trial.h, trial.condition(StudySide::A).name()))
            .collect();
        remarks.push(format!("study participant {participant} seed {seed} order {}", order.join(" ")));
    }
    remarks
}
