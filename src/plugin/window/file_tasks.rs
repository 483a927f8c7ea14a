//! Files that the user looks for and opens in the window: read on the snapshot thread, because a disk may be slow.

use std::path::PathBuf;
use std::sync::Arc;

use crate::editor::Snapshot;
use crate::folder_listing::FolderListing;
use crate::plugin::params::ChalumeauParams;

/// What the window asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FileTask {
    /// List a folder; `None` is the user's own.
    ReadFolder(Option<PathBuf>),
    /// Take the scale or the keyboard mapping of a file.
    OpenScale(PathBuf),
}

/// What was read.
#[derive(Clone, Debug, Default)]
pub struct FilesRead {
    folder: Arc<FolderListing>,
    scale_refused: Option<String>,
}

impl FilesRead {
    /// Does what the window asks for. Waits for the disk.
    pub fn act(&mut self, task: FileTask, params: &ChalumeauParams) {
        match task {
            FileTask::ReadFolder(path) => {
                let usual = dirs::home_dir().unwrap_or_else(|| PathBuf::from("/"));
                self.folder = Arc::new(FolderListing::read(&path.unwrap_or(usual)));
            }
            FileTask::OpenScale(path) => match params.scale.saved().with_file(&path) {
                Ok(scale) => {
                    params.scale.put(scale);
                    self.scale_refused = None;
                    params.host.state_changed();
                }
                Err(refused) => self.scale_refused = Some(refused),
            },
        }
    }

    /// Fills in what was read.
    pub fn show(&self, snapshot: &mut Snapshot) {
        snapshot.folder = self.folder.clone();
        snapshot.scale_refused.clone_from(&self.scale_refused);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::instrument::KeyPitches;

    #[test]
    fn a_scale_is_taken_and_one_that_is_none_is_told_and_leaves_it() {
        let (params, mut read) = (ChalumeauParams::default(), FilesRead::default());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fifths.scl");
        std::fs::write(&path, "fifths\n1\n3/2\n").unwrap();
        read.act(FileTask::ReadFolder(Some(folder.path().to_owned())), &params);
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
