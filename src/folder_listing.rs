//! What is in a folder, for a user who chooses a file.

use std::fs;
use std::path::{Path, PathBuf};

/// Most entries that are listed.
pub const ENTRIES_MOST: usize = 5_000;

/// Where a user looks for files.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Place {
    /// The user's own folder.
    #[default]
    Home,
    /// The folder in which the program saves instruments; where there is none yet, the user's own.
    Instruments,
    /// This one.
    Folder(PathBuf),
}

/// The content of a folder by name, without what is hidden.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FolderListing {
    /// Its path.
    pub folder: PathBuf,
    /// Folders in it.
    pub folders: Vec<String>,
    /// Files in it.
    pub files: Vec<String>,
    /// Why it cannot be read; a message for the user.
    pub refused: Option<String>,
    /// Whether it has more than are listed.
    pub is_cut: bool,
}

impl FolderListing {
    /// Reads a folder; of a file, the folder that it is in. Waits for the disk.
    pub fn read(path: &Path) -> Self {
        let is_file = path.is_file();
        let folder = if is_file { path.parent().unwrap_or(path) } else { path }.to_owned();
        let mut listing = Self { folder, ..Self::default() };
        let entries = match fs::read_dir(&listing.folder) {
            Ok(entries) => entries,
            Err(reason) => {
                listing.refused = Some(format!("cannot read {}: {reason}", listing.folder.display()));
                return listing;
            }
        };
        for (count, entry) in entries.filter_map(Result::ok).enumerate() {
            if count == ENTRIES_MOST {
                listing.is_cut = true;
                break;
            }
            let name = entry.file_name().to_string_lossy().into_owned();
            if name.starts_with('.') {
                continue;
            }
            // A link is what it leads to.
            match fs::metadata(entry.path()) {
                Ok(is) if is.is_dir() => listing.folders.push(name),
                Ok(_) => listing.files.push(name),
                Err(_) => {}
            }
        }
        for names in [&mut listing.folders, &mut listing.files] {
            names.sort_by_key(|name| name.to_lowercase());
        }
        listing
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_listed_by_name_and_a_missing_one_is_told() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["b.toml", "A.toml", ".hidden", "c.scl"] {
            fs::write(folder.path().join(name), "").unwrap();
        }
        fs::create_dir(folder.path().join("Within")).unwrap();
        let listing = FolderListing::read(folder.path());
        assert_eq!(listing.files, ["A.toml", "b.toml", "c.scl"]);
        assert_eq!((listing.folders.as_slice(), listing.refused.clone()), (&["Within".to_owned()][..], None));
        assert_eq!(FolderListing::read(&folder.path().join("b.toml")), listing);
        let none = FolderListing::read(&folder.path().join("none"));
        assert!(none.refused.unwrap().contains("none"));
    }
}
