//! The user's own presets: one file each, in the system's folder for the user's data, where an update leaves them.
//!
//! Files appear whole or not at all. A file that is no preset is reported with its name and line, and stays as it is. The
//! folder may be edited by hand and shared: what counts is the name inside a file, not the file's.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::factory;
use super::{Preset, checked_name};
use crate::data_folder;
use crate::output;
use crate::text_file;

/// Upper limit for the size of a preset's file, bytes; a larger file is something else.
const BYTES_MOST: u64 = 1 << 16;
/// Most files that are read: a folder with more is not one of presets.
const FILES_MOST: usize = 4_096;
/// Extension of presets.
const SUFFIX: &str = "toml";
/// The names that the user likes, one a line, beside the presets.
const FAVOURITES: &str = "favourites.txt";

/// The folder of the user's presets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UserFolder {
    folder: PathBuf,
}

/// What the folder holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UserPresets {
    /// The presets, by name.
    pub presets: Vec<Preset>,
    /// Names that the user likes, factory presets among them.
    pub favourites: BTreeSet<String>,
    /// Files that are no presets: which, and what to do.
    pub broken: Vec<String>,
    /// The same by the name that the file has, and by the one in it, in lower case.
    pub broken_names: BTreeMap<String, String>,
}

impl UserPresets {
    /// What is wrong with the file of a preset that cannot be read, if there is one of this name.
    pub fn broken_called(&self, name: &str) -> Option<&str> {
        let name = name.trim().to_lowercase();
        let found = self.broken_names.get(&name).or_else(|| self.broken_names.get(&stem(&name)));
        found.map(String::as_str)
    }
}

/// A file that should be a preset, and what is in it or why it is none.
type ReadFile = (PathBuf, Result<Preset, String>);

impl UserFolder {
    /// The folder `presets` in the [user's data](data_folder::folder); `None` if there is none.
    pub fn system() -> Option<Self> {
        data_folder::folder().map(|folder| Self::within(folder.join("presets")))
    }

    /// A folder of presets, which is created when the first one is saved.
    pub fn within(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.folder
    }

    /// Reads everything. A folder that does not exist is empty.
    pub fn read(&self) -> UserPresets {
        let mut found = UserPresets::default();
        let files = self.files().unwrap_or_else(|reason| {
            found.broken.push(reason);
            Vec::new()
        });
        for (path, read) in files {
            match read {
                Ok(preset) if found.presets.iter().any(|other| other.name == preset.name) => {
                    let shown = path.display();
                    found.broken.push(format!(
                        "{shown}: a second preset with the name {:?}; rename one of them",
                        preset.name
                    ));
                }
                Ok(preset) => found.presets.push(preset),
                Err(reason) => {
                    let said = format!("{}: {reason}", path.display());
                    for name in names_of_broken(&path) {
                        found.broken_names.insert(name, said.clone());
                    }
                    found.broken.push(said);
                }
            }
        }
        found.presets.sort_by_key(|preset| preset.name.to_lowercase());
        match self.favourites() {
            Ok(favourites) => found.favourites = favourites,
            Err(reason) => found.broken.push(reason),
        }
        found
    }

    /// What the user likes; nothing where there is no list.
    fn favourites(&self) -> Result<BTreeSet<String>, String> {
        let path = self.folder.join(FAVOURITES);
        check_file(&path).map_err(|reason| format!("{}: {reason}", path.display()))?;
        let text = match fs::read_to_string(&path) {
            Err(reason) if reason.kind() == ErrorKind::NotFound => return Ok(BTreeSet::new()),
            read => read.map_err(|reason| format!("{}: cannot be read: {reason}", path.display()))?,
        };
        Ok(text.lines().map(str::trim).filter(|line| !line.is_empty()).map(str::to_owned).collect())
    }

    /// Each file that should be a preset, in the order of their names; none where there is no folder.
    fn files(&self) -> Result<Vec<ReadFile>, String> {
        let entries = match fs::read_dir(&self.folder) {
            Err(reason) if reason.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
            read => read.map_err(|reason| format!("{}: cannot be read: {reason}", self.folder.display()))?,
        };
        let paths = entries.filter_map(Result::ok).map(|entry| entry.path());
        let mut paths: Vec<_> =
            paths.filter(|path| path.extension().is_some_and(|is| is == SUFFIX)).take(FILES_MOST).collect();
        paths.sort();
        Ok(paths.into_iter().map(|path| (path.clone(), read_file(&path))).collect())
    }

    /// The file of a preset.
    fn find(&self, name: &str) -> Result<Option<PathBuf>, String> {
        let mut files = self.files()?.into_iter();
        let found = files.find(|(_, read)| read.as_ref().is_ok_and(|preset| preset.name == name));
        Ok(found.map(|(path, _)| path))
    }

    /// Saves a preset. One of the same name is replaced if it is `shown`, as the user saw it who wants to replace it; any other one
    /// was saved meanwhile, in another window.
    ///
    /// # Errors
    /// A message for the user.
    pub fn save(&self, preset: &Preset, shown: Option<&Preset>) -> Result<(), String> {
        let name = checked_name(&preset.name)?;
        if factory::find(&name).is_some() {
            return Err(format!("{name:?} is a factory preset; choose another name"));
        }
        let path = match self.find(&name)? {
            Some(path) if read_file(&path).ok().as_ref() != shown => {
                return Err(format!(
                    "there is a preset {name:?} already, saved since this list was read; save again to replace it, or choose \
                     another name"
                ));
            }
            Some(path) => path,
            None => self.free_path(&name),
        };
        let text = Preset { name, ..preset.clone() }.to_text();
        // What cannot be read again is not written.
        Preset::parse(&text).map_err(|reason| reason.what)?;
        self.write(&path, &text)
    }

    /// Gives a preset another name. It stays a favourite if it was one.
    pub fn rename(&self, old: &str, new: &str) -> Result<(), String> {
        let new = checked_name(new)?;
        if new == old {
            return Ok(());
        }
        let path = self.find(old)?.ok_or_else(|| self.is_missing(old))?;
        if factory::find(&new).is_some() || self.find(&new)?.is_some() {
            return Err(format!("there is a preset {new:?} already; choose another name"));
        }
        let preset = Preset { name: new.clone(), ..read_file(&path)? };
        // The new file first: at every moment one of the two is there.
        self.write(&self.free_path(&new), &preset.to_text())?;
        fs::remove_file(&path).map_err(|reason| format!("cannot remove {}: {reason}", path.display()))?;
        if self.read().favourites.contains(old) {
            self.set_favourite(old, false)?;
            self.set_favourite(&new, true)?;
        }
        Ok(())
    }

    /// Deletes a preset.
    pub fn delete(&self, name: &str) -> Result<(), String> {
        let path = self.find(name)?.ok_or_else(|| self.is_missing(name))?;
        fs::remove_file(&path).map_err(|reason| format!("cannot remove {}: {reason}", path.display()))?;
        // Another preset of this name is not liked from the start.
        self.set_favourite(name, false)
    }

    /// Remembers whether the user likes a preset.
    pub fn set_favourite(&self, name: &str, is_liked: bool) -> Result<(), String> {
        // A list that cannot be read is not replaced.
        let mut favourites = self.favourites()?;
        let has_changed = if is_liked { favourites.insert(name.to_owned()) } else { favourites.remove(name) };
        if !has_changed {
            return Ok(());
        }
        let lines: String = favourites.iter().map(|name| format!("{name}\n")).collect();
        self.write(&self.folder.join(FAVOURITES), &lines)
    }

    fn is_missing(&self, name: &str) -> String {
        format!("there is no preset {name:?} in {}", self.folder.display())
    }

    /// A path that no file has: the name in plain letters, with a number if that is taken.
    fn free_path(&self, name: &str) -> PathBuf {
        let stem = stem(name);
        let numbered = |n: usize| match n {
            1 => format!("{stem}.{SUFFIX}"),
            n => format!("{stem}_{n}.{SUFFIX}"),
        };
        let mut paths = (1..).map(|n| self.folder.join(numbered(n)));
        // Among more paths than files one is free; the first is never reached.
        paths.find(|path| !path.exists()).unwrap_or_else(|| self.folder.join(numbered(1)))
    }

    fn write(&self, path: &Path, text: &str) -> Result<(), String> {
        output::replace(path, text.as_bytes()).map_err(|reason| reason.to_string())
    }
}

/// The preset in a file; the error says what is wrong with it, without its name.
pub fn read_file(path: &Path) -> Result<Preset, String> {
    check_file(path)?;
    let text = text_file::read(path).map_err(|reason| format!("cannot be read: {reason}"))?;
    Preset::parse(&text).map_err(|reason| reason.to_string())
}

/// What is too large for a preset, or no file at all (a pipe would never end), is not read.
fn check_file(path: &Path) -> Result<(), String> {
    let Ok(file) = fs::metadata(path) else { return Ok(()) };
    if !file.is_file() {
        return Err("is not a file; move it elsewhere".to_owned());
    }
    if file.len() > BYTES_MOST {
        return Err(format!(
            "has more than {BYTES_MOST} bytes, so it is not of Chalumeau; move it elsewhere"
        ));
    }
    Ok(())
}

/// A name as files have it.
fn stem(name: &str) -> String {
    let plain = |c: char| if c.is_alphanumeric() { c.to_lowercase().next().unwrap_or(c) } else { '_' };
    let mut stem: String = name.chars().map(plain).collect();
    // Windows keeps these names for devices, whatever follows the dot.
    let is_port = |kind| {
        stem.strip_prefix(kind)
            .is_some_and(|number| number.len() == 1 && number.as_bytes()[0].is_ascii_digit())
    };
    if ["con", "prn", "aux", "nul"].contains(&stem.as_str()) || is_port("com") || is_port("lpt") {
        stem.push('_');
    }
    stem
}

/// By which names a user may look for a file that is no preset, in lower case: its own, and that in its line `name`.
fn names_of_broken(path: &Path) -> Vec<String> {
    let own = path.file_stem().map(|stem| stem.to_string_lossy().to_lowercase());
    let text = check_file(path).ok().and_then(|()| text_file::read(path).ok()).unwrap_or_default();
    let inside = text.lines().find_map(|line| {
        let value = line.trim().strip_prefix("name")?.trim_start().strip_prefix('=')?;
        Some(value.split('#').next()?.trim().trim_matches(['"', '\'']).to_lowercase())
    });
    own.into_iter().chain(inside).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn favourites_that_cannot_be_read_are_told_and_not_replaced() {
        let (_root, folder) = folder();
        fs::create_dir_all(folder.path()).unwrap();
        let list = folder.path().join(FAVOURITES);
        let in_latin_1 = b"Caf\xe9\nMellow\n";
        fs::write(&list, in_latin_1).unwrap();
        assert!(folder.set_favourite("Jazz", true).unwrap_err().contains(FAVOURITES));
        assert_eq!(fs::read(&list).unwrap(), in_latin_1);
        assert!(folder.read().broken.iter().any(|told| told.contains("cannot be read")));
        fs::remove_file(&list).unwrap();
        folder.set_favourite("Jazz", true).unwrap();
        // What is no file is not read: a pipe would never end.
        fs::create_dir(folder.path().join("folder.toml")).unwrap();
        let found = folder.read();
        assert!(
            found.favourites.contains("Jazz")
                && found.broken.iter().any(|told| told.contains("is not a file"))
        );
    }

    #[test]
    fn no_file_has_the_name_of_a_device() {
        for (name, file) in [("Aux", "aux_"), ("COM1", "com1_"), ("Con brio", "con_brio"), ("Com10", "com10")]
        {
            assert_eq!(stem(name), file);
        }
    }

    #[test]
    fn a_broken_preset_is_told_by_its_name() {
        let (_root, folder) = folder();
        fs::create_dir_all(folder.path()).unwrap();
        fs::write(folder.path().join("a_b.toml"), "format = 1\nname = \"My ballad\"\nlip = 2\n").unwrap();
        let user = folder.read();
        for name in ["My ballad", "my Ballad ", "a_b", "A b"] {
            let said = crate::presets::find(name, &user).unwrap_err();
            assert!(said.contains("a_b.toml: line 3"), "{said}");
        }
        assert!(crate::presets::find("Other", &user).unwrap_err().contains("there is no preset"));
    }

    fn folder() -> (tempfile::TempDir, UserFolder) {
        let root = tempfile::tempdir().unwrap();
        let folder = UserFolder::within(root.path().join("not/there/yet"));
        (root, folder)
    }

    fn preset(name: &str) -> Preset {
        let mut preset = Preset::of(name, None, |parameter| {
            (parameter.id == "lip").then(|| parameter.read("0.9").unwrap())
        });
        preset.tags = vec!["jazz".to_owned()];
        preset
    }

    fn names(folder: &UserFolder) -> Vec<String> {
        folder.read().presets.into_iter().map(|preset| preset.name).collect()
    }

    #[test]
    fn what_is_saved_is_found_again_renamed_and_deleted() {
        let (_root, folder) = folder();
        assert_eq!(folder.read(), UserPresets::default());
        for name in ["My jazz", "another", "My/jazz"] {
            folder.save(&preset(name), None).unwrap();
        }
        assert_eq!(names(&folder), ["another", "My jazz", "My/jazz"]);
        assert_eq!(folder.read().presets[1], preset("My jazz"));
        let shown = folder.read().presets.into_iter().find(|preset| preset.name == "My jazz");
        folder.save(&Preset { shows: "New.".to_owned(), ..preset("My jazz") }, shown.as_ref()).unwrap();
        assert_eq!(names(&folder).len(), 3, "replaced");
        assert_eq!(folder.read().presets[1].shows, "New.");
        folder.set_favourite("My jazz", true).unwrap();
        folder.rename("My jazz", "Best").unwrap();
        assert_eq!(names(&folder), ["another", "Best", "My/jazz"]);
        assert_eq!(folder.read().favourites, BTreeSet::from(["Best".to_owned()]));
        folder.delete("Best").unwrap();
        assert_eq!(names(&folder), ["another", "My/jazz"]);
        for said in [folder.delete("Best"), folder.rename("Best", "x")] {
            assert!(said.unwrap_err().contains("no preset \"Best\" in"));
        }
    }

    #[test]
    fn names_that_are_taken_are_refused() {
        let (_root, folder) = folder();
        let taken = factory::all()[0].name.clone();
        assert!(folder.save(&preset(&taken), None).unwrap_err().contains("is a factory preset"));
        folder.save(&preset("a"), None).unwrap();
        folder.save(&preset("b"), None).unwrap();
        for name in ["b", &taken] {
            assert!(folder.rename("a", name).unwrap_err().contains("already"));
        }
        assert_eq!(names(&folder), ["a", "b"]);
    }

    #[test]
    fn a_broken_file_is_named_with_its_line_and_left_alone() {
        let (_root, folder) = folder();
        folder.save(&preset("good"), None).unwrap();
        let broken = "format = 1\nname = \"bad\"\n[parameters]\nlip = 9\n";
        for (name, text) in [("bad.toml", broken), ("twin.toml", preset("good").to_text().as_str())] {
            fs::write(folder.path().join(name), text).unwrap();
        }
        fs::write(folder.path().join("notes.txt"), "no preset").unwrap();
        fs::write(folder.path().join("huge.toml"), "x".repeat(1 << 17)).unwrap();
        fs::write(folder.path().join("binary.toml"), [0xff, 0xfe]).unwrap();
        let found = folder.read();
        assert_eq!(found.presets, [preset("good")]);
        let says = [
            "bad.toml: line 4: lip (Lip opening) must lie in",
            "binary.toml: cannot be read",
            "huge.toml: has more",
            "twin.toml: a second preset",
        ];
        assert_eq!(found.broken.len(), says.len(), "{:?}", found.broken);
        for (said, wanted) in found.broken.iter().zip(says) {
            assert!(said.contains(wanted), "{said}");
        }
        assert_eq!(fs::read_to_string(folder.path().join("bad.toml")).unwrap(), broken);
    }

    #[test]
    fn a_folder_that_cannot_be_written_says_so() {
        let root = tempfile::tempdir().unwrap();
        let file = root.path().join("file");
        fs::write(&file, "in the way").unwrap();
        let said = UserFolder::within(&file).save(&preset("a"), None).unwrap_err();
        assert!(said.contains("cannot be read"), "{said}");
        // It is not empty to the user either.
        assert!(UserFolder::within(&file).read().broken[0].contains("cannot be read"));
    }
}
