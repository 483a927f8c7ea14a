//! What is in an archive, and under which name.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::build::{Built, walk};
use super::{Papers, Release, archive};
use crate::{licences, machine};

/// A file of an archive.
pub struct Entry {
    /// With `/` between the folders, on every system.
    pub path: String,
    pub bytes: Vec<u8>,
    pub runs: bool,
}

impl Entry {
    /// The file's mode on systems that have one.
    pub fn mode(&self) -> u32 {
        if self.runs { 0o755 } else { 0o644 }
    }
}

/// Files of the repository that every archive has, and their names there. The factory presets are inside the binaries.
const EVERYWHERE: &[(&str, &str)] = &[
    ("LICENSE-MIT", "LICENSE-MIT"),
    ("LICENSE-APACHE", "LICENSE-APACHE"),
    ("NOTICE", "NOTICE"),
    ("CHANGELOG.md", "CHANGELOG.md"),
    ("examples/instruments", "examples/instruments"),
    ("examples/melody.mid", "examples/melody.mid"),
];
/// What one kind of system has besides, by the beginning of the system's name; the last word says whether it runs.
const SOMEWHERE: &[(&str, &str, &str, bool)] = &[
    ("linux", "packaging/download/README-linux.txt", "README.txt", false),
    ("linux", "packaging/download/install.sh", "install.sh", true),
    ("linux", "packaging/chalumeau.desktop", "chalumeau.desktop", false),
    ("linux", "web/page/icon.svg", "chalumeau.svg", false),
    ("linux", "packaging/70-chalumeau.rules", "70-chalumeau.rules", false),
    ("macos", "packaging/download/README-macos.txt", "README.txt", false),
    ("macos", "packaging/download/install.sh", "install.sh", true),
    ("windows", "packaging/download/README-windows.txt", "README.txt", false),
    ("windows", "packaging/download/install.ps1", "install.ps1", false),
];

/// The entries of a system's archive, sorted, all in one folder.
pub fn archive(built: &Built, papers: &Papers, release: &Release) -> Result<Vec<Entry>> {
    let mut entries = Vec::new();
    for path in built.bundles.iter().chain(&built.programs) {
        add(path, &name(path), true, &mut entries)?;
    }
    for (from, to) in EVERYWHERE {
        add(&machine::root().join(from), to, false, &mut entries)?;
    }
    let somewhere = SOMEWHERE.iter().filter(|(system, ..)| built.system.name.starts_with(system));
    for (_, from, to, runs) in somewhere {
        add(&machine::root().join(from), to, *runs, &mut entries)?;
    }
    for (path, bytes) in [(licences::FILE, papers.licences.as_bytes()), ("parts.cdx.json", &papers.parts)] {
        entries.push(Entry { path: path.to_owned(), bytes: bytes.to_owned(), runs: false });
    }
    let folder = archive::folder(built.system, release);
    for entry in &mut entries {
        entry.path = format!("{folder}/{}", entry.path);
    }
    entries.sort_by(|one, other| one.path.cmp(&other.path));
    Ok(entries)
}

/// Adds a file, or all files below a folder.
fn add(from: &Path, to: &str, runs: bool, entries: &mut Vec<Entry>) -> Result<()> {
    let mut files: Vec<PathBuf> = Vec::new();
    walk(from, &mut files)?;
    for file in files {
        let below = file.strip_prefix(from).unwrap_or(Path::new(""));
        let words = below.components().map(|word| word.as_os_str().to_string_lossy().into_owned());
        let path = [to.to_owned()].into_iter().chain(words).collect::<Vec<_>>().join("/");
        let bytes = fs::read(&file).with_context(|| format!("cannot read {}", file.display()))?;
        entries.push(Entry { path, bytes, runs });
    }
    Ok(())
}

/// The last word of a path.
pub fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
