//! The tuning that another program gives to all instruments of a host: the client's side of MTS-ESP.
//!
//! A tuning program (the master) writes the frequency of each key into a table of a shared library, which every instrument
//! (the client) loads. The names and types of its functions are those of ODDSound's interface, version 1.3.

#![allow(unsafe_code)] // functions of a library that is loaded at run time; each use says why it is sound

use std::ffi::{CStr, c_char};
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use libloading::Library;
use nice_plug::prelude::nice_log;

use chalumeau_core::instrument::KeyPitches;
use chalumeau_core::instrument::concert_pitch::A4_HZ;

/// Environment variable with the path of the library, in place of the usual one.
pub const VARIABLE: &str = "CHALUMEAU_MTS_ESP";
/// Keys of the table.
const KEYS: usize = 128;
/// Longest name of a scale that is shown, bytes.
const NAME_MOST: usize = 256;

/// What the library offers. It stays loaded for the life of the process, as other clients in the process may have its table.
struct Functions {
    register: unsafe extern "C" fn(),
    deregister: unsafe extern "C" fn(),
    has_master: unsafe extern "C" fn() -> bool,
    table: unsafe extern "C" fn() -> *const f64,
    name: unsafe extern "C" fn() -> *const c_char,
}

impl Functions {
    /// The library of this system; `None` if no tuning program has installed one.
    fn installed() -> Option<&'static Self> {
        static LOADED: OnceLock<Option<Functions>> = OnceLock::new();
        LOADED.get_or_init(|| usual_paths().into_iter().find_map(Self::load)).as_ref()
    }

    fn load(path: PathBuf) -> Option<Self> {
        if !path.is_file() {
            return None;
        }
        let all = || -> Result<Self, libloading::Error> {
            // SAFETY: the path is that of the interface, or the user has named it; loading runs the library's initialisers.
            let library = Box::leak(Box::new(unsafe { Library::new(&path) }?));
            // SAFETY: the types are those of the interface, and the library is never closed.
            unsafe {
                Ok(Self {
                    register: *library.get(b"MTS_RegisterClient\0")?,
                    deregister: *library.get(b"MTS_DeregisterClient\0")?,
                    has_master: *library.get(b"MTS_HasMaster\0")?,
                    table: *library.get(b"MTS_GetTuningTable\0")?,
                    name: *library.get(b"MTS_GetScaleName\0")?,
                })
            }
        };
        match all() {
            Ok(functions) => Some(functions),
            Err(reason) => {
                nice_log!("MTS-ESP: cannot use {}: {reason}", path.display());
                None
            }
        }
    }
}

/// Where tuning programs install the library.
fn usual_paths() -> Vec<PathBuf> {
    if let Some(named) = std::env::var_os(VARIABLE).filter(|path| !path.is_empty()) {
        return vec![PathBuf::from(named)];
    }
    if cfg!(windows) {
        let common = std::env::var_os("CommonProgramFiles").map(PathBuf::from);
        return common.map(|folder| folder.join("MTS-ESP").join("LIBMTS.dll")).into_iter().collect();
    }
    ["/Library/Application Support/MTS-ESP/libMTS.dylib", "/usr/local/lib/libMTS.so"]
        .map(PathBuf::from)
        .to_vec()
}

/// What a tuning program says.
#[derive(Clone, Debug, PartialEq)]
pub struct ReceivedTuning {
    /// Name of its scale.
    pub name: String,
    /// What every key plays.
    pub keys: Arc<KeyPitches>,
}

/// One client of the tuning program; it is counted there while it lives.
pub struct MtsClient(&'static Functions);

impl MtsClient {
    /// `None` where no tuning program is installed. Loads a library. Allocates.
    pub fn register() -> Option<Self> {
        let functions = Functions::installed()?;
        // SAFETY: a function of the interface, which takes nothing.
        unsafe { (functions.register)() };
        Some(Self(functions))
    }

    /// The tuning where A4 of this instrument is `a4_hz`; `None` while no tuning program runs. The frequencies of the tuning program
    /// are absolute: its A4 wins. Allocates.
    pub fn tuning(&self, a4_hz: f64) -> Option<ReceivedTuning> {
        // SAFETY: functions of the interface, which take nothing. The table has a frequency for each key, and the name ends
        // with a zero, as long as the library is loaded.
        let (hz, name) = unsafe {
            if !(self.0.has_master)() {
                return None;
            }
            let table = (self.0.table)();
            if table.is_null() {
                return None;
            }
            // The master may write meanwhile: each number is read once, and an odd one is read again at the next look.
            let hz: [f64; KEYS] = std::array::from_fn(|key| table.add(key).read_volatile());
            let name = (self.0.name)();
            (hz, (!name.is_null()).then(|| CStr::from_ptr(name).to_string_lossy().into_owned()))
        };
        let keys = KeyPitches::from_hz(|key| hz.get(usize::from(key)).map(|hz| hz * A4_HZ / a4_hz));
        let name = name.filter(|name| !name.is_empty() && name.len() <= NAME_MOST);
        Some(ReceivedTuning { name: name.unwrap_or_else(|| "unnamed".to_owned()), keys: Arc::new(keys) })
    }
}

impl Drop for MtsClient {
    fn drop(&mut self) {
        // SAFETY: as in `register`.
        unsafe { (self.0.deregister)() };
    }
}
