//! The Debian package, made by Debian's own tools: dpkg-shlibdeps finds which packages the binaries need, dpkg-deb
//! packs. It has no scripts: udev and the desktops notice new files by themselves.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};
use time::format_description::well_known::Rfc2822;

use super::build::{Built, walk};
use super::contents::name;
use super::{Papers, Release, archive, output};
use crate::licences;
use crate::machine::{self, Package};

/// Debian wants an address; the project has none.
const MAINTAINER: &str = "The Chalumeau authors <chalumeau@invalid.invalid>";
/// Debian's name of the architecture.
const ARCHITECTURE: &str = "amd64";
/// What the window loads while it runs, which dpkg-shlibdeps cannot see.
const LOADED: &str = "libegl1, libgl1, libx11-6, libx11-xcb1, libxcb1, libxkbcommon0, libxkbcommon-x11-0";
/// The standalone program plays through these where they are there. Without one, it plays to ALSA.
const RECOMMENDED: &str = "libjack-jackd2-0 | libjack-0.125 | pipewire-jack";
const DESCRIPTION: &str = "clarinet computed from physics, as a plugin and as programs
 A model of the reed drives a model of the bore with its tone holes. It uses
 no samples. A keyboard, a wind controller or a force-feedback knob plays it.
 .
 This package holds the plugin in the formats CLAP and VST3, the standalone
 program chalumeau-standalone, and the command line chalumeau, which renders
 scores and measures the instrument.";

const SHLIBDEPS: Package = Package {
    name: "dpkg-dev",
    present: || machine::works("dpkg-shlibdeps", &["--version"]),
    purpose: "the Debian package's dependencies",
};
/// Where the repository's files go.
const FILES: &[(&str, &str)] = &[
    ("packaging/70-chalumeau.rules", "usr/lib/udev/rules.d/70-chalumeau.rules"),
    ("packaging/chalumeau.desktop", "usr/share/applications/chalumeau.desktop"),
    ("web/page/icon.svg", "usr/share/icons/hicolor/scalable/apps/chalumeau.svg"),
    ("examples/instruments", "usr/share/doc/chalumeau/examples/instruments"),
    ("examples/melody.mid", "usr/share/doc/chalumeau/examples/melody.mid"),
    ("NOTICE", "usr/share/doc/chalumeau/NOTICE"),
];
/// Folders of the bundles and of the programs.
const CLAP: &str = "usr/lib/clap";
const VST3: &str = "usr/lib/vst3";
const PROGRAMS: &str = "usr/bin";

/// Whether a package can be made of these files, here.
pub fn possible(built: &Built) -> bool {
    built.system.name == "linux-x86_64" && machine::works("dpkg-deb", &["--version"])
}

/// The file's name.
pub fn file(release: &Release) -> String {
    format!("chalumeau_{}-1_{ARCHITECTURE}.deb", release.version)
}

/// Writes the package into a folder.
pub fn write(folder: &Path, built: &Built, papers: &Papers, release: &Release) -> Result<()> {
    machine::provide(&[&SHLIBDEPS])?;
    let stage = folder.join("deb");
    if stage.exists() {
        fs::remove_dir_all(&stage)?;
    }
    for path in &built.bundles {
        let home = if name(path).ends_with(".clap") { CLAP } else { VST3 };
        copy(path, &stage.join(home).join(name(path)))?;
    }
    for path in &built.programs {
        copy(path, &stage.join(PROGRAMS).join(name(path)))?;
    }
    for (from, to) in FILES {
        copy(&machine::root().join(from), &stage.join(to))?;
    }
    documents(&stage.join("usr/share/doc/chalumeau"), papers, release)?;
    modes(&stage)?;
    let needed = needed(folder, &stage)?;
    control(&stage, &needed, release)?;
    let mut pack = Command::new("dpkg-deb");
    // One thread: how many there are would be seen in the bytes.
    pack.args(["--root-owner-group", "-Zxz", "--threads-max=1", "--build"]);
    pack.arg(&stage).arg(folder.join(file(release))).env("SOURCE_DATE_EPOCH", release.epoch.to_string());
    machine::run(&mut pack)?;
    Ok(fs::remove_dir_all(&stage)?)
}

/// Copyright and changelogs, as Debian wants them.
fn documents(folder: &Path, papers: &Papers, release: &Release) -> Result<()> {
    let read = |name: &str| {
        fs::read_to_string(machine::root().join(name)).with_context(|| format!("cannot read {name}"))
    };
    let copyright = format!(
        "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\nUpstream-Name: chalumeau\n\n\
         Files: *\nCopyright: The Chalumeau authors\nLicense: Expat or Apache-2.0\n\
         Comment: The binaries contain the packages that THIRD-PARTY-LICENSES.txt.gz lists\n with their licences. \
         NOTICE says where data come from.\n\n\
         License: Expat\n{}\nLicense: Apache-2.0\n On Debian systems the text is in /usr/share/common-licenses/Apache-2.0.\n",
        paragraph(&read("LICENSE-MIT")?)
    );
    put(&folder.join("copyright"), copyright.as_bytes())?;
    let time = release.time()?.format(&Rfc2822)?;
    let changes = format!(
        "chalumeau ({}-1) unstable; urgency=medium\n\n  * See changelog.gz.\n\n -- {MAINTAINER}  {time}\n",
        release.version
    );
    put(&folder.join("changelog.Debian.gz"), &archive::gzip(changes.as_bytes())?)?;
    put(&folder.join("changelog.gz"), &archive::gzip(read("CHANGELOG.md")?.as_bytes())?)?;
    put(&folder.join(format!("{}.gz", licences::FILE)), &archive::gzip(papers.licences.as_bytes())?)
}

/// A text as a field's value: each line after a space, a dot for an empty line.
fn paragraph(text: &str) -> String {
    text.trim()
        .lines()
        .map(|line| if line.is_empty() { " .\n".to_owned() } else { format!(" {line}\n") })
        .collect()
}

/// The packages that the binaries need, as a field's value.
fn needed(folder: &Path, stage: &Path) -> Result<String> {
    // The tool wants to stand in a source package.
    let source = folder.join("deb-source");
    put(&source.join("debian/control"), b"Source: chalumeau\n\nPackage: chalumeau\nArchitecture: any\n")?;
    let mut binaries: Vec<PathBuf> = Vec::new();
    for home in [CLAP, VST3, PROGRAMS] {
        walk(&stage.join(home), &mut binaries)?;
    }
    let mut shlibdeps = Command::new("dpkg-shlibdeps");
    let said = output(shlibdeps.arg("-O").args(&binaries).current_dir(&source))?;
    fs::remove_dir_all(&source)?;
    let found = said.lines().find_map(|line| line.strip_prefix("shlibs:Depends="));
    Ok(format!("{}, {LOADED}", found.context("dpkg-shlibdeps names no package")?))
}

/// The package's own description, and the checksums of its files.
fn control(stage: &Path, needed: &str, release: &Release) -> Result<()> {
    let mut files = Vec::new();
    walk(stage, &mut files)?;
    let (mut size, mut paths) = (0, Vec::new());
    for file in &files {
        size += file.metadata()?.len().div_ceil(1024);
        paths.push(file.strip_prefix(stage)?.to_owned());
    }
    let sums = output(Command::new("md5sum").args(&paths).current_dir(stage))?;
    put(&stage.join("DEBIAN/md5sums"), sums.as_bytes())?;
    let text = format!(
        "Package: chalumeau\nVersion: {}-1\nArchitecture: {ARCHITECTURE}\nMaintainer: {MAINTAINER}\n\
         Installed-Size: {size}\nDepends: {needed}\nRecommends: {RECOMMENDED}\nSection: sound\nPriority: optional\n\
         Description: {DESCRIPTION}\n",
        release.version
    );
    put(&stage.join("DEBIAN/control"), text.as_bytes())?;
    modes(&stage.join("DEBIAN"))
}

/// Copies a file, or a folder with all that is in it.
fn copy(from: &Path, to: &Path) -> Result<()> {
    let mut files = Vec::new();
    walk(from, &mut files)?;
    for file in files {
        let bytes = fs::read(&file).with_context(|| format!("cannot read {}", file.display()))?;
        // A folder's path with nothing after it would end in a slash.
        let below = file.strip_prefix(from)?;
        put(&if below.as_os_str().is_empty() { to.to_owned() } else { to.join(below) }, &bytes)?;
    }
    Ok(())
}

/// Programs run, files are read, whatever this machine's user prefers.
fn modes(folder: &Path) -> Result<()> {
    fs::set_permissions(folder, fs::Permissions::from_mode(0o755))?;
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            modes(&path)?;
        } else {
            let runs = path.parent().is_some_and(|parent| parent.ends_with(PROGRAMS));
            fs::set_permissions(&path, fs::Permissions::from_mode(if runs { 0o755 } else { 0o644 }))?;
        }
    }
    Ok(())
}

fn put(path: &Path, bytes: &[u8]) -> Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_paragraph_has_no_empty_line() {
        assert_eq!(paragraph("one\n\ntwo\n"), " one\n .\n two\n");
    }
}
