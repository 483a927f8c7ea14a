//! The session: the settings of the program, which its next start finds.
//!
//! It is a saved state, as a host keeps in a project: parameters, window, links, scale, altered holes, knob. It is written when the program
//! ends and, should it end otherwise, every [`INTERVAL`] while something has changed.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use nice_plug::plugin::{ParamValue, PluginState};

use crate::data_folder;
use crate::output;
use crate::plugin::ChalumeauParams;
use crate::plugin::launch_options::LaunchOptions;

/// How often a session that changes is written.
const INTERVAL: Duration = Duration::from_secs(2);
const FILE: &str = "session.json";
/// The first session that was set aside by `--new-session`, or could not be read; the next one is `session-before-2.json`.
const SET_ASIDE: &str = "session-before.json";

/// The session of this process. Clones are the same session.
#[derive(Clone)]
pub struct Session(Arc<Inside>);

struct Inside {
    params: Arc<ChalumeauParams>,
    path: PathBuf,
    written: Mutex<Written>,
}

struct Written {
    /// What the file contains.
    bytes: Vec<u8>,
    /// The user knows that the file cannot be written.
    is_told: bool,
}

/// Begins with the default settings: the session of before is kept beside, under another name.
pub fn set_aside() {
    if let Some(path) = path().filter(|path| path.exists()) {
        rename(&path);
    }
}

fn path() -> Option<PathBuf> {
    data_folder::folder().map(|folder| folder.join(FILE))
}

fn rename(path: &Path) {
    // None takes the place of an earlier one.
    let names = (2..).map(|n| SET_ASIDE.replace(".json", &format!("-{n}.json")));
    let mut free = std::iter::once(SET_ASIDE.to_owned()).chain(names).map(|name| path.with_file_name(name));
    let Some(beside) = free.find(|beside| !beside.exists()) else { return };
    match fs::rename(path, &beside) {
        Ok(()) => tell!("chalumeau-standalone: the last session is kept as {}", beside.display()),
        Err(reason) => tell!("chalumeau-standalone: cannot rename {}: {reason}", path.display()),
    }
}

impl Session {
    /// Puts the last session on the parameters, and what the user has asked for at the start over it. From then on the session is
    /// written. `None` on a system without a folder for it.
    pub fn begin(params: Arc<ChalumeauParams>) -> Option<Self> {
        let session = Self::at(path()?, params, LaunchOptions::get());
        let weak = Arc::downgrade(&session.0);
        // Without a thread it is written at the end.
        let _ = std::thread::Builder::new().name("Session".to_owned()).spawn(move || {
            loop {
                std::thread::sleep(INTERVAL);
                match weak.upgrade() {
                    Some(inside) => Self(inside).save(),
                    None => return,
                }
            }
        });
        Some(session)
    }

    /// The parameters that it keeps.
    pub fn params(&self) -> &ChalumeauParams {
        &self.0.params
    }

    fn at(path: PathBuf, params: Arc<ChalumeauParams>, options: Option<&LaunchOptions>) -> Self {
        let written = match read(&path) {
            Ok(None) => Vec::new(),
            Ok(Some((mut state, bytes))) => {
                ask_for(&mut state, options);
                params.restore(state);
                bytes
            }
            Err(reason) => {
                tell!(
                    "chalumeau-standalone: cannot read the last session, {}: {reason}; the settings are the default ones",
                    path.display()
                );
                rename(&path);
                Vec::new()
            }
        };
        Self(Arc::new(Inside {
            params,
            path,
            written: Mutex::new(Written { bytes: written, is_told: false }),
        }))
    }

    /// Writes the session if it has changed. Says so if it cannot, once.
    pub fn save(&self) {
        let Inside { params, path, written } = &*self.0;
        // One thread at a time.
        let mut written = written.lock().unwrap_or_else(PoisonError::into_inner);
        let Written { bytes: written, is_told } = &mut *written;
        let Ok(bytes) = serde_json::to_vec(&params.saved()) else { return };
        if *written == bytes {
            return;
        }
        match output::replace(path, &bytes) {
            Ok(()) => (*written, *is_told) = (bytes, false),
            // It may have room again the next time, so it is asked again; the user is told once.
            Err(reason) => {
                if !std::mem::replace(is_told, true) {
                    tell!("chalumeau-standalone: the next start will not find this session: {reason}");
                }
            }
        }
    }
}

/// The session and its bytes; `Ok(None)` if there is none yet.
fn read(path: &Path) -> Result<Option<(PluginState, Vec<u8>)>, String> {
    match fs::read(path) {
        Err(reason) if reason.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(reason) => Err(reason.to_string()),
        Ok(bytes) => {
            let state = serde_json::from_slice(&bytes).map_err(|reason| reason.to_string())?;
            Ok(Some((state, bytes)))
        }
    }
}

/// What the user has asked for at the start counts, whatever was played before.
fn ask_for(state: &mut PluginState, options: Option<&LaunchOptions>) {
    let Some(LaunchOptions { instrument, a4_hz, microphone, .. }) = options else { return };
    if let Some((choice, file)) = instrument {
        state.params.insert("instr".to_owned(), ParamValue::String(choice.id().to_owned()));
        if let Ok(file) = serde_json::to_string(file) {
            state.fields.insert("instrumentfile".to_owned(), file);
        }
    }
    if let Some(a4_hz) = *a4_hz {
        state.params.insert("a4".to_owned(), ParamValue::F32(a4_hz));
    }
    // None is open unless the user has named one.
    state.params.insert("mic".to_owned(), ParamValue::Bool(microphone.load(Ordering::Relaxed)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plugin::InstrumentChoice;

    fn start(path: &Path, options: Option<&LaunchOptions>) -> (Session, Arc<ChalumeauParams>) {
        let params = Arc::<ChalumeauParams>::default();
        (Session::at(path.to_owned(), params.clone(), options), params)
    }

    fn with_strength(strength: f32) -> PluginState {
        let mut state = ChalumeauParams::default().saved();
        state.params.insert("stren".to_owned(), ParamValue::F32(strength));
        state
    }

    #[test]
    fn the_next_start_finds_what_was_set_and_the_users_wish_goes_first() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new").join(FILE);
        let (session, params) = start(&path, None);
        params.restore(with_strength(3.5));
        params.set_preset_name("Mine");
        session.save();
        let (_, params) = start(&path, None);
        assert_eq!((params.embouchure.strength.value(), params.preset_name().as_str()), (3.5, "Mine"));
        let options = LaunchOptions {
            instrument: Some((InstrumentChoice::User, "/a/\"b\".toml".to_owned())),
            a4_hz: Some(442.0),
            microphone: true.into(),
            has_window: true,
            quit: Default::default(),
            restart: Default::default(),
            window_failed: Default::default(),
            connections: Default::default(),
            device_tasks: Default::default(),
        };
        let (_, params) = start(&path, Some(&options));
        assert_eq!(params.embouchure.strength.value(), 3.5);
        assert_eq!(params.instrument.key(), "user:/a/\"b\".toml");
        assert!(params.tuning.a4.value() == 442.0 && params.microphone.on.value());
    }

    #[test]
    fn only_changes_are_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(FILE);
        let (session, params) = start(&path, None);
        session.save();
        fs::remove_file(&path).unwrap();
        session.save();
        assert!(!path.exists(), "nothing has changed");
        params.restore(with_strength(3.5));
        session.save();
        assert!(path.exists());
    }

    #[test]
    fn a_session_that_cannot_be_read_is_kept_beside() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(FILE);
        fs::write(&path, "{ half").unwrap();
        let (session, params) = start(&path, None);
        assert!(!path.exists());
        assert_eq!(
            params.embouchure.strength.value(),
            ChalumeauParams::default().embouchure.strength.value()
        );
        session.save();
        assert_eq!(fs::read_to_string(folder.path().join(SET_ASIDE)).unwrap(), "{ half");
        assert!(read(&path).unwrap().is_some());
        rename(&path);
        assert_eq!(fs::read_to_string(folder.path().join(SET_ASIDE)).unwrap(), "{ half");
        assert!(read(&folder.path().join("session-before-2.json")).unwrap().is_some());
    }
}
