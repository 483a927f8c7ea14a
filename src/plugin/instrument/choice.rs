//! Which instrument the parameters ask for, and its file.

use std::path::PathBuf;
use std::time::SystemTime;

use super::Stage;
use crate::plugin::params::ChalumeauParams;
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::instrument::Model;
use chalumeau_core::instrument::model::A4_HZ;
use chalumeau_core::instrument::prepare::{A4_BY_DELAY_HZ, Quality, Wanted, ready, rough};
use chalumeau_core::instrument::store::Store;

/// Names the user's instrument file, for those who want it elsewhere.
pub const VARIABLE: &str = "CHALUMEAU_INSTRUMENT";
/// A file is edited by hand: larger than this it is something else.
const BYTES_MOST: u64 = 1 << 20;

/// Where an instrument comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// The program.
    Bundled(Bundled),
    /// A file, which may change.
    User {
        /// Where; none if this system has no place for it.
        path: Option<PathBuf>,
        /// When it was changed last, if it is there.
        changed: Option<SystemTime>,
    },
}

/// An instrument as it shall be.
#[derive(Clone, Debug, PartialEq)]
pub struct Order {
    /// The parameter *Instrument* as a number, to be compared on the audio thread.
    pub choice: u32,
    /// Which.
    pub source: Source,
    /// Pitch of A4 that it shall be tuned for, Hz.
    pub a4_hz: f64,
    /// The host's sample rate, Hz.
    pub host_rate_hz: f64,
    /// How finely.
    pub quality: Quality,
}

impl Order {
    /// What the parameters ask for.
    pub fn of(params: &ChalumeauParams, host_rate_hz: f64, offline: bool) -> Self {
        let choice = params.instrument.choice.value();
        let source = match choice.bundled() {
            Some(bundled) => Source::Bundled(bundled),
            None => {
                let path =
                    user_file(&params.instrument.file.read().map_or(String::new(), |path| path.clone()));
                let changed = path.as_ref().and_then(|path| path.metadata().ok()?.modified().ok());
                Source::User { path, changed }
            }
        };
        let a4_hz = f64::from(params.settings().a4_hz);
        let near = (A4_BY_DELAY_HZ.0..=A4_BY_DELAY_HZ.1).contains(&a4_hz);
        // To a tenth of a hertz, as it is shown: finer steps are not worth a fit of their own.
        let a4_hz = if near { A4_HZ } else { (10.0 * a4_hz).round() / 10.0 };
        let quality = if offline { params.instrument.quality.value().into() } else { Quality::Live };
        Self { choice: choice as u32, source, a4_hz, host_rate_hz, quality }
    }

    /// Its measurements, or why there are none, in words for the user.
    pub fn file(&self) -> Result<InstrumentFile, String> {
        let path = match &self.source {
            Source::Bundled(bundled) => return Ok(bundled.file()),
            Source::User { path: Some(path), .. } => path,
            Source::User { path: None, .. } => {
                return Err(format!("no place for an instrument file; name one with {VARIABLE}"));
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
            Ok(is) if !is.is_file() => return Err(format!("{shown} is no file")),
            _ => {}
        }
        let text = std::fs::read_to_string(path)
            .map_err(|reason| format!("cannot read {shown}: {reason}; put an instrument file there"))?;
        InstrumentFile::parse(&text).map_err(|reason| format!("{shown}: {reason}"))
    }

    /// The same as the core wants it.
    pub fn wanted(&self, file: InstrumentFile) -> Wanted {
        let Self { a4_hz, host_rate_hz, quality, .. } = *self;
        Wanted { file, a4_hz, host_rate_hz, quality }
    }

    /// What can be had at once, the best first. Takes up to 50 ms; longer only for a file nobody has fitted yet.
    pub fn at_once(&self, cache: Option<&dyn Store>) -> Result<(Model, Stage), String> {
        let wanted = self.wanted(self.file()?);
        let near = Wanted { a4_hz: A4_HZ, ..wanted.clone() };
        let built = || {
            if let Some(model) = ready(&wanted, cache)? {
                return Ok((model, Stage::Tuned));
            }
            match ready(&near, cache)? {
                Some(model) => Ok((model, Stage::Near)),
                None => Ok((rough(&wanted)?, Stage::Rough)),
            }
        };
        built().map_err(|reason: chalumeau_core::instrument::BuildError| reason.to_string())
    }
}

/// The file a state names, or the usual place: what [`VARIABLE`] says, else `chalumeau/instruments/user.toml` in the
/// user's folder for data.
pub fn user_file(named: &str) -> Option<PathBuf> {
    if !named.is_empty() {
        return Some(PathBuf::from(named));
    }
    let chosen = std::env::var_os(VARIABLE).filter(|path| !path.is_empty()).map(PathBuf::from);
    chosen.or_else(|| dirs::data_dir().map(|folder| folder.join("chalumeau/instruments/user.toml")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn user(path: &std::path::Path) -> Order {
        let source = Source::User { path: Some(path.to_owned()), changed: None };
        Order { choice: 5, source, a4_hz: 440.0, host_rate_hz: 48_000.0, quality: Quality::Live }
    }

    #[test]
    fn default_parameters_ask_for_the_built_in_clarinet_and_have_it_at_once() {
        let order = Order::of(&ChalumeauParams::default(), 48_000.0, true);
        assert_eq!(order.source, Source::Bundled(Bundled::BFlat));
        assert_eq!((order.a4_hz, order.quality), (440.0, Quality::Live));
        let (model, stage) = order.at_once(None).unwrap();
        assert_eq!((stage, model.a4_hz), (Stage::Tuned, 440.0));
    }

    #[test]
    fn another_pitch_begins_with_the_instrument_for_440() {
        let order = Order { a4_hz: 417.3, ..Order::of(&ChalumeauParams::default(), 48_000.0, false) };
        let (model, stage) = order.at_once(None).unwrap();
        assert_eq!((stage, model.a4_hz), (Stage::Near, 440.0));
    }

    #[test]
    fn a_file_that_is_none_is_named_with_its_fault() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.toml");
        let refused = |order: &Order| order.file().unwrap_err();
        assert!(refused(&user(&path)).contains("mine.toml: No such file"), "{}", refused(&user(&path)));
        assert!(refused(&user(folder.path())).contains("is no file"));
        std::fs::write(&path, "name = 3").unwrap();
        assert!(refused(&user(&path)).contains("mine.toml"), "{}", refused(&user(&path)));
        std::fs::write(&path, Bundled::A.text()).unwrap();
        assert_eq!(user(&path).file().unwrap(), Bundled::A.file());
        std::fs::write(&path, "x".repeat(2 << 20)).unwrap();
        assert!(refused(&user(&path)).contains("at most"), "{}", refused(&user(&path)));
    }
}
