//! Gives each knob one owner among all instances of all programs on this machine.
//!
//! `locks/<serial>.lock` is locked by the owner, so that it is free again however the owner ends; it is never removed, or
//! two could lock two files of one name. `<serial>.owner` says who that is. Who wants the knob writes `<serial>.wanted`;
//! the owner looks for it and lets go.

use crate::device::runtime_dir::{RuntimeDir, serial_number, serial_text};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::fs;
use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Who has a knob.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Holder {
    /// File name of the program.
    pub program: String,
    /// Its process number.
    pub pid: u32,
    /// What the instance is called by its user.
    pub label: String,
    /// Port it is reached through.
    pub port: String,
    /// Seconds since 1970.
    pub since: u64,
}

impl Holder {
    fn me(label: &str, port: &str) -> Self {
        let program = std::env::current_exe()
            .ok()
            .and_then(|path| Some(path.file_name()?.to_string_lossy().into_owned()));
        Self {
            program: program.unwrap_or_else(|| "a program".into()),
            pid: std::process::id(),
            label: label.into(),
            port: port.into(),
            since: seconds(),
        }
    }

    /// Who has not said who it is, or is about to.
    fn unknown() -> Self {
        let (program, port) = (String::new(), String::new());
        Self { program, pid: 0, label: "another instance".into(), port, since: seconds() }
    }
}

impl fmt::Display for Holder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { label, program, pid, .. } = self;
        if program.is_empty() {
            return f.write_str(label);
        }
        let minutes = seconds().saturating_sub(self.since) / 60;
        write!(f, "{label} ({program}, process {pid}, for {minutes} min)")
    }
}

fn seconds() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())
}

/// Why a knob cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Somebody else has it.
    #[error("in use by {0}")]
    Held(Holder),
    /// The lock itself fails.
    #[error("cannot lock the knob: {0}")]
    Io(#[from] io::Error),
}

#[derive(Clone, Debug)]
struct Files {
    lock: PathBuf,
    owner: PathBuf,
    wanted: PathBuf,
}

impl Files {
    fn of(places: &RuntimeDir, serial: u64) -> io::Result<Self> {
        let base = places.locks()?.join(serial_text(serial));
        let [lock, owner, wanted] =
            ["lock", "owner", "wanted"].map(|extension| base.with_extension(extension));
        Ok(Self { lock, owner, wanted })
    }

    fn holder(&self) -> Holder {
        read(&self.owner).unwrap_or_else(Holder::unknown)
    }
}

fn read(path: &Path) -> Option<Holder> {
    toml::from_str(&fs::read_to_string(path).ok()?).ok()
}

/// Whole or not at all: others read it at any time.
fn write(path: &Path, holder: &Holder) -> io::Result<()> {
    let draft = path.with_extension(format!("{}.new", std::process::id()));
    fs::write(&draft, toml::to_string(holder).map_err(io::Error::other)?)?;
    fs::rename(&draft, path)
}

/// Locks `file`, past those who hold it for an instant to see whether they can.
pub(super) fn try_lock_patiently(file: &File) -> Result<(), TryLockError> {
    for _ in 0..3 {
        if file.try_lock().is_ok() {
            return Ok(());
        }
        thread::sleep(Duration::from_millis(2));
    }
    file.try_lock()
}

/// A knob that is ours until this is dropped.
#[derive(Debug)]
pub struct Ownership {
    serial: u64,
    files: Files,
    _lock: File,
}

impl Ownership {
    /// Takes the knob `serial`, or says who has it.
    pub fn take(places: &RuntimeDir, serial: u64, label: &str, port: &str) -> Result<Self, LockError> {
        let files = Files::of(places, serial)?;
        let lock = File::options().create(true).truncate(false).write(true).open(&files.lock)?;
        match try_lock_patiently(&lock) {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(LockError::Held(files.holder())),
            Err(TryLockError::Error(e)) => return Err(e.into()),
        }
        let _ = fs::remove_file(&files.wanted);
        write(&files.owner, &Holder::me(label, port))?;
        Ok(Self { serial, files, _lock: lock })
    }

    /// Serial number of the knob.
    pub fn serial(&self) -> u64 {
        self.serial
    }

    /// Who wants the knob, if anybody does. Reads a file: not for every loop.
    pub fn wanted_by(&self) -> Option<Holder> {
        read(&self.files.wanted)
    }
}

impl Drop for Ownership {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.files.owner);
    }
}

/// Asks the owner of the knob `serial` to let go.
pub fn ask_for(places: &RuntimeDir, serial: u64, label: &str) -> io::Result<()> {
    write(&Files::of(places, serial)?.wanted, &Holder::me(label, ""))
}

/// Who has the knob `serial`, if anybody does.
pub fn holder(places: &RuntimeDir, serial: u64) -> Option<Holder> {
    let files = Files::of(places, serial).ok()?;
    match File::open(&files.lock).ok()?.try_lock_shared() {
        Err(TryLockError::WouldBlock) => Some(files.holder()),
        _ => None,
    }
}

/// Who has a knob through the port `port`, and which.
pub fn holder_of_port(places: &RuntimeDir, port: &str) -> Option<(u64, Holder)> {
    let entries = fs::read_dir(places.locks().ok()?).ok()?;
    entries.flatten().find_map(|entry| {
        let path = entry.path();
        let serial = serial_number(path.file_stem()?.to_str()?)
            .filter(|_| path.extension().is_some_and(|e| e == "owner"))?;
        holder(places, serial).filter(|holder| holder.port == port).map(|holder| (serial, holder))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_owner_at_a_time_and_the_other_knows_who() {
        let directory = tempfile::tempdir().unwrap();
        let places = RuntimeDir::within(directory.path());
        let mine = Ownership::take(&places, 7, "Track 1", "/dev/pts/3").unwrap();
        let Err(LockError::Held(holder)) = Ownership::take(&places, 7, "Track 2", "/dev/pts/3") else {
            panic!("taken twice")
        };
        assert_eq!((holder.label.as_str(), holder.pid), ("Track 1", std::process::id()));
        assert!(holder.to_string().starts_with("Track 1 ("), "{holder}");
        assert_eq!(holder_of_port(&places, "/dev/pts/3").unwrap().0, 7);
        assert_eq!(holder_of_port(&places, "/dev/pts/4"), None);
        Ownership::take(&places, 8, "Track 2", "/dev/pts/4").expect("another knob is free");
        drop(mine);
        assert_eq!(super::holder(&places, 7), None);
        Ownership::take(&places, 7, "Track 2", "/dev/pts/3").expect("let go");
    }

    #[test]
    fn owner_hears_who_wants_the_knob_once() {
        let directory = tempfile::tempdir().unwrap();
        let places = RuntimeDir::within(directory.path());
        let mine = Ownership::take(&places, 7, "Track 1", "").unwrap();
        assert_eq!(mine.wanted_by(), None);
        ask_for(&places, 7, "Track 2").unwrap();
        assert_eq!(mine.wanted_by().unwrap().label, "Track 2");
        drop(mine);
        let theirs = Ownership::take(&places, 7, "Track 2", "").unwrap();
        assert_eq!(theirs.wanted_by(), None, "the wish is fulfilled");
    }

    #[test]
    fn what_a_dead_owner_left_stops_nobody() {
        let directory = tempfile::tempdir().unwrap();
        let places = RuntimeDir::within(directory.path());
        drop(Ownership::take(&places, 9, "dead", "").unwrap());
        let files = Files::of(&places, 9).unwrap();
        write(&files.owner, &Holder::me("dead", "")).unwrap();
        assert_eq!(super::holder(&places, 9), None);
        Ownership::take(&places, 9, "alive", "").unwrap();
    }
}
