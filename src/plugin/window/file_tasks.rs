//! Files that the user looks for, opens and saves in the window: on the snapshot thread, because a disk may be slow.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::editor::Snapshot;
use crate::folder_listing::{FolderListing, Place};
use crate::output::{NewFile, OutputError};
use crate::plugin::params::ChalumeauParams;
use chalumeau_core::bore::instrument_file::InstrumentFile;

/// What the window asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum FileTask {
    /// List a folder.
    ReadFolder(Place),
    /// Take the scale or the keyboard mapping of a file.
    OpenScale(PathBuf),
    /// Save an instrument beside the user's others.
    SaveInstrument(Arc<InstrumentFile>),
}

/// What was read.
#[derive(Clone, Debug, Default)]
pub struct FilesRead {
    folder: Arc<FolderListing>,
    scale_refused: Option<String>,
    /// What names the instrument that was saved as it was altered, and where it is, or why it is not.
    saved: Option<(String, Result<PathBuf, String>)>,
}

impl FilesRead {
    /// Does what the window asks for. Waits for the disk.
    pub fn act(&mut self, task: FileTask, params: &ChalumeauParams) {
        match task {
            FileTask::ReadFolder(place) => {
                let home = || dirs::home_dir().unwrap_or_else(|| PathBuf::from("/"));
                let folder = match place {
                    Place::Home => home(),
                    Place::Instruments => instruments().filter(|folder| folder.is_dir()).unwrap_or_else(home),
                    Place::Folder(folder) => folder,
                };
                self.folder = Arc::new(FolderListing::read(&folder));
            }
            FileTask::OpenScale(path) => match params.scale.saved().with_file(&path) {
                Ok(scale) => {
                    params.scale.put(scale);
                    self.scale_refused = None;
                    params.host.state_changed();
                }
                Err(refused) => self.scale_refused = Some(refused),
            },
            FileTask::SaveInstrument(file) => {
                let saved = match instruments() {
                    Some(folder) => save(&file, &folder),
                    None => Err("this system has no folder for instrument files".to_owned()),
                };
                self.saved = Some((params.instrument.key(), saved));
            }
        }
    }

    /// Fills in what was read.
    pub fn show(&self, snapshot: &mut Snapshot) {
        snapshot.folder = self.folder.clone();
        snapshot.scale_refused.clone_from(&self.scale_refused);
        let of_this = self.saved.as_ref().filter(|(key, _)| *key == snapshot.instrument_key);
        snapshot.saved = of_this.map(|(_, saved)| saved.clone());
    }
}

/// The folder in which instruments are saved.
fn instruments() -> Option<PathBuf> {
    crate::data_folder::folder().map(|folder| folder.join("instruments"))
}

/// Most files with one name and a number.
const NUMBERS_MOST: usize = 1_000;

/// Writes an instrument into a folder under a name that no file has there yet: whole or not at all. The error is a message for
/// the user.
fn save(file: &InstrumentFile, folder: &Path) -> Result<PathBuf, String> {
    let refused = |reason: std::io::Error| format!("cannot save in {}: {reason}", folder.display());
    fs::create_dir_all(folder).map_err(refused)?;
    let words = file.name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let name = words.map(str::to_ascii_lowercase).collect::<Vec<_>>().join("_");
    let name = if name.is_empty() { "instrument" } else { &name };
    for number in 1..=NUMBERS_MOST {
        let path = folder.join(format!("{name}_{number}.toml"));
        let mut written = match NewFile::create(&path, false) {
            Ok(written) => written,
            Err(OutputError::Exists(_)) => continue,
            Err(failed) => return Err(failed.to_string()),
        };
        written.write_all(file.to_toml().as_bytes()).map_err(refused)?;
        return match written.keep() {
            Ok(()) => Ok(path),
            Err(failed) => Err(failed.to_string()),
        };
    }
    Err(format!("{} has {NUMBERS_MOST} instruments called {name}; delete some", folder.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::instrument::KeyPitches;

    #[test]
    fn an_instrument_is_saved_beside_the_others_and_can_be_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let file = InstrumentFile { name: "B flat, altered".to_owned(), ..InstrumentFile::built_in() };
        let folder = folder.path().join("chalumeau/instruments");
        let (first, second) = (save(&file, &folder).unwrap(), save(&file, &folder).unwrap());
        assert!(first.ends_with("b_flat_altered_1.toml") && second.ends_with("b_flat_altered_2.toml"));
        for path in [first, second] {
            assert_eq!(InstrumentFile::parse(&fs::read_to_string(path).unwrap()).unwrap(), file);
        }
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 2, "nothing else is left there");
        let foreign = InstrumentFile { name: "\u{43a}".to_owned(), ..file.clone() };
        assert!(save(&foreign, &folder).unwrap().ends_with("instrument_1.toml"));
        let none = folder.join("b_flat_altered_1.toml/within");
        assert!(save(&file, &none).unwrap_err().contains("cannot save in"));
    }

    #[test]
    fn a_scale_is_taken_and_one_that_is_none_is_told_and_leaves_it() {
        let (params, mut read) = (ChalumeauParams::default(), FilesRead::default());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fifths.scl");
        std::fs::write(&path, "fifths\n1\n3/2\n").unwrap();
        read.act(FileTask::ReadFolder(Place::Folder(folder.path().to_owned())), &params);
        read.act(FileTask::OpenScale(path), &params);
        let mut snapshot = Snapshot::default();
        read.show(&mut snapshot);
        assert_eq!(
            (snapshot.folder.files.as_slice(), &snapshot.scale_refused),
            (&["fifths.scl".to_owned()][..], &None)
        );
        assert_ne!(*params.scale.key_pitches(), KeyPitches::default());
        let before = params.scale.saved();
        read.act(FileTask::OpenScale(folder.path().join("none.scl")), &params);
        read.show(&mut snapshot);
        assert!(snapshot.scale_refused.unwrap().contains("none.scl"));
        assert_eq!(params.scale.saved(), before);
    }
}
