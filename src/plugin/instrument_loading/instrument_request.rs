//! Which instrument the parameters ask for, and its file.

use std::io;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use super::Readiness;
use crate::plugin::params::ChalumeauParams;
use crate::plugin::params::instrument::InstrumentChoice;
use chalumeau_core::bore::alterations::Alterations;
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::instrument::concert_pitch::A4_BY_DELAY_HZ;
use chalumeau_core::instrument::concert_pitch::A4_HZ;
use chalumeau_core::instrument::prepare::{OnProgress, Preparation, Progress, Quality, Wanted, altered};
use chalumeau_core::instrument::store::Store;
use chalumeau_core::instrument::{BuildError, KeyPitches, Model};

/// Environment variable with the path of the user's instrument file.
pub const VARIABLE: &str = "CHALUMEAU_INSTRUMENT";
/// People edit instrument files by hand; a larger file is something else.
const BYTES_MOST: u64 = 1 << 20;

/// Where an instrument comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum InstrumentSource {
    /// The program.
    Bundled(Bundled),
    /// A file, which may change.
    User {
        /// Its path; `None` if this system has no folder for it.
        path: Option<PathBuf>,
        /// Time of the last change, if the file exists.
        changed: Option<SystemTime>,
    },
}

/// What the parameters and the host ask for.
#[derive(Clone, Debug, PartialEq)]
pub struct InstrumentRequest {
    /// The parameter *Instrument* as a number, which the audio thread compares.
    pub choice: u32,
    /// Where it comes from.
    pub source: InstrumentSource,
    /// Pitch of A4 to tune for, Hz.
    pub a4_hz: f64,
    /// The host's sample rate, Hz.
    pub host_rate_hz: f64,
    /// Rendering quality.
    pub quality: Quality,
    /// What every key plays.
    pub keys: Arc<KeyPitches>,
    /// What the user has altered.
    pub alterations: Arc<Alterations>,
    /// What names the instrument in a saved project, see `InstrumentParams::key`.
    pub key: String,
}

impl InstrumentRequest {
    /// The request of the parameters at a host rate in Hz.
    pub fn from_params(params: &ChalumeauParams, host_rate_hz: f64, offline: bool) -> Self {
        let choice = params.instrument.choice.value();
        let source = match choice.bundled() {
            Some(bundled) => InstrumentSource::Bundled(bundled),
            None => {
                let path =
                    user_file(&params.instrument.file.read().map_or(String::new(), |path| path.clone()));
                let changed = path.as_ref().and_then(|path| path.metadata().ok()?.modified().ok());
                InstrumentSource::User { path, changed }
            }
        };
        let a4_hz = f64::from(params.settings().a4_hz);
        let is_bridged = (A4_BY_DELAY_HZ.0..=A4_BY_DELAY_HZ.1).contains(&a4_hz);
        // The parameter shows a tenth of a hertz; a finer step does not justify a fit of its own.
        let a4_hz = if is_bridged { A4_HZ } else { (10.0 * a4_hz).round() / 10.0 };
        let quality = if offline { params.instrument.quality.value().into() } else { Quality::Live };
        let keys = params.scale.key_pitches();
        let key = params.instrument.key();
        let alterations = params.alterations.of(&key);
        Self { choice: choice as u32, source, a4_hz, host_rate_hz, quality, keys, alterations, key }
    }

    /// The request that the built-in clarinet answers.
    pub fn built_in(host_rate_hz: f64) -> Self {
        Self {
            choice: InstrumentChoice::BFlat as u32,
            source: InstrumentSource::Bundled(Bundled::BFlat),
            a4_hz: A4_HZ,
            host_rate_hz,
            quality: Quality::Live,
            keys: Arc::default(),
            alterations: Arc::default(),
            key: InstrumentChoice::BFlat.id().to_owned(),
        }
    }

    /// Whether another request differs in what its keys play at most.
    pub fn differs_in_keys_at_most(&self, other: &Self) -> bool {
        *self == Self { keys: self.keys.clone(), ..other.clone() }
    }

    /// A model with the keys of this request. Allocates if they are others.
    pub fn with_keys(&self, mut model: Arc<Model>) -> Arc<Model> {
        if model.keys != *self.keys {
            Arc::make_mut(&mut model).keys = KeyPitches::clone(&self.keys);
        }
        model
    }

    /// The file with what the user has altered; `None` if all is as built.
    fn altered(&self, file: &InstrumentFile) -> Option<InstrumentFile> {
        let altered = file.altered(&self.alterations);
        (altered != *file).then(|| InstrumentFile { name: format!("{}, altered", file.name), ..altered })
    }

    /// The instrument's measurements as they were built. The error is a message for the user.
    pub fn file(&self) -> Result<InstrumentFile, String> {
        let path = match &self.source {
            InstrumentSource::Bundled(bundled) => return Ok(bundled.file()),
            InstrumentSource::User { path: Some(path), .. } => path,
            InstrumentSource::User { path: None, .. } => {
                return Err(format!(
                    "this system has no folder for an instrument file; set {VARIABLE} to a path"
                ));
            }
        };
        let shown = path.display();
        match path.metadata() {
            Ok(is) if is.len() > BYTES_MOST => {
                return Err(format!(
                    "{shown} has {} bytes; an instrument file has at most {BYTES_MOST}",
                    is.len()
                ));
            }
            Ok(is) if !is.is_file() => return Err(format!("{shown} is not a file")),
            _ => {}
        }
        let text = crate::text_file::read(path).map_err(|reason| unread(path, &reason))?;
        InstrumentFile::parse(&text).map_err(|reason| format!("{shown}: {reason}"))
    }

    /// This request for the core, with the instrument's file.
    pub fn wanted(&self, file: InstrumentFile) -> Wanted {
        let Self { a4_hz, host_rate_hz, quality, .. } = *self;
        Wanted { file, a4_hz, host_rate_hz, quality }
    }

    /// The best instrument that needs no fitting and no tuning. Takes up to 50 ms; longer only for a file that was never
    /// fitted, and for an altered one.
    pub fn available_now(&self, cache: Option<&dyn Store>) -> Result<(Model, Readiness), String> {
        let wanted = self.wanted(self.file()?);
        let at_440 = Wanted { a4_hz: A4_HZ, ..wanted.clone() };
        let built = || -> Result<(Model, Readiness), BuildError> {
            if let Some(model) = Preparation::new(&wanted, cache).ready()? {
                return Ok((model, Readiness::Tuned));
            }
            match Preparation::new(&at_440, cache).ready()? {
                Some(model) => Ok((model, Readiness::OtherA4)),
                None => Ok((Preparation::new(&wanted, None).rough()?, Readiness::Rough)),
            }
        };
        let altered = || match (built()?, self.altered(&wanted.file)) {
            (ready, None) => Ok(ready),
            ((base, _), Some(file)) => Ok((altered::at_once(&base, &file)?, Readiness::Rough)),
        };
        altered().map_err(|reason: BuildError| reason.to_string())
    }

    /// The whole instrument: tuned, or, where the user has altered it, fitted with the trims it had before. Takes up to a
    /// minute.
    pub fn made(
        &self,
        file: InstrumentFile,
        cache: Option<&dyn Store>,
        on: OnProgress<'_>,
    ) -> Result<Model, BuildError> {
        let altered = self.altered(&file);
        let wanted = self.wanted(file);
        let preparation = Preparation::new(&wanted, cache);
        let Some(file) = altered else { return preparation.tuned(on) };
        // Nobody asked to hear it as built.
        let base = preparation.tuned(&mut |progress| match progress {
            Progress::Fitted(_) => ControlFlow::Continue(()),
            shares => on(shares),
        })?;
        altered::fitted(&base, &file, on)
    }
}

/// Why the user's file was not read. Who has named none and has none is told how to come by one.
fn unread(path: &Path, reason: &io::Error) -> String {
    if reason.kind() == io::ErrorKind::NotFound && own_file().is_some_and(|own| own == path) {
        return "No file of yours yet: open one, or move a hole and save".to_owned();
    }
    format!("cannot read {}: {reason}; put an instrument file there", path.display())
}

/// Where a user who names no file keeps one.
fn own_file() -> Option<PathBuf> {
    crate::data_folder::folder().map(|folder| folder.join("instruments/user.toml"))
}

/// The path of the user's instrument file: `named` if it is not empty, else the path in [`VARIABLE`], else
/// `chalumeau/instruments/user.toml` in the user's data folder.
pub fn user_file(named: &str) -> Option<PathBuf> {
    if !named.is_empty() {
        return Some(PathBuf::from(named));
    }
    let chosen = std::env::var_os(VARIABLE).filter(|path| !path.is_empty()).map(PathBuf::from);
    chosen.or_else(own_file)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn user(path: &std::path::Path) -> InstrumentRequest {
        let source = InstrumentSource::User { path: Some(path.to_owned()), changed: None };
        InstrumentRequest { choice: 5, source, ..InstrumentRequest::built_in(48_000.0) }
    }

    #[test]
    fn default_parameters_ask_for_the_built_in_clarinet_and_have_it_available_now() {
        let request = InstrumentRequest::from_params(&ChalumeauParams::default(), 48_000.0, true);
        assert_eq!(request.source, InstrumentSource::Bundled(Bundled::BFlat));
        assert_eq!((request.a4_hz, request.quality), (440.0, Quality::Live));
        assert_eq!(request, InstrumentRequest::built_in(48_000.0));
        let (model, readiness) = request.available_now(None).unwrap();
        assert_eq!((readiness, model.a4_hz), (Readiness::Tuned, 440.0));
    }

    #[test]
    fn another_pitch_begins_with_the_instrument_for_440() {
        let request = InstrumentRequest {
            a4_hz: 417.3,
            ..InstrumentRequest::from_params(&ChalumeauParams::default(), 48_000.0, false)
        };
        let (model, readiness) = request.available_now(None).unwrap();
        assert_eq!((readiness, model.a4_hz), (Readiness::OtherA4, 440.0));
    }

    #[test]
    fn who_has_no_file_is_told_how_to_come_by_one() {
        let missing = io::Error::from(io::ErrorKind::NotFound);
        let own = own_file().unwrap();
        assert_eq!(unread(&own, &missing), "No file of yours yet: open one, or move a hole and save");
        let forbidden = io::Error::from(io::ErrorKind::PermissionDenied);
        assert!(unread(&own, &forbidden).contains("cannot read"), "other reasons are told as they are");
        assert!(unread(Path::new("/mine.toml"), &missing).contains("cannot read /mine.toml"));
    }

    #[test]
    fn a_file_that_is_none_is_named_with_its_fault() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.toml");
        let refused = |request: &InstrumentRequest| request.file().unwrap_err();
        assert!(refused(&user(&path)).contains("mine.toml: No such file"), "{}", refused(&user(&path)));
        assert!(refused(&user(folder.path())).contains("is not a file"));
        std::fs::write(&path, "name = 3").unwrap();
        assert!(refused(&user(&path)).contains("mine.toml"), "{}", refused(&user(&path)));
        std::fs::write(&path, Bundled::A.text()).unwrap();
        assert_eq!(user(&path).file().unwrap(), Bundled::A.file());
        std::fs::write(&path, "x".repeat(2 << 20)).unwrap();
        assert!(refused(&user(&path)).contains("at most"), "{}", refused(&user(&path)));
    }
}
