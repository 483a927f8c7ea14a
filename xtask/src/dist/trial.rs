//! `cargo xtask dist --try`: what was made is installed, played and removed in a fresh Debian, a folder of its own.
//!
//! The Debian package brings what it needs, renders the bits that are rendered here, opens its window, and its plugin plays
//! in Ardour. Then the archive is installed by its own script, in the home of a user. Each time everything is removed again,
//! and no file may be left that was not there before.

mod ardour;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use chalumeau_test_host::display::Display;
use chalumeau_test_host::screen::Screen;

use super::{Release, SYSTEMS, archive, deb, output, sha256};
use crate::chroot;
use crate::machine::{self, XVFB};

/// Where the downloads lie inside.
const DOWNLOADS: &str = "/srv";
/// Inside, the user who installs the archive.
const USER: &str = "musician";
const HOME: &str = "/home/musician";
/// What is rendered here and inside.
const NOTE: [&str; 7] = ["render", "--written", "C4", "--gamma", "0.5", "--seconds", "1.5"];
/// apt's, dpkg's and the linker's own books, and what a running system writes.
const BOOKS: [&str; 9] = [
    "/var/lib/apt/",
    "/var/lib/dpkg/",
    "/var/cache/",
    "/var/log/",
    "/srv/",
    "/proc/",
    "/dev/",
    "/tmp/",
    "/run/",
];

/// Folder inside for what a program keeps of its own; it lies among the [`BOOKS`].
const SCRATCH: &str = "/tmp/scratch";

/// Tries what lies in `folder` in this suite of Debian; the system is removed when all went well.
pub fn run(folder: &Path, release: &Release, suite: &str) -> Result<()> {
    machine::provide(&[&XVFB])?;
    let system = Fresh { root: machine::target().join("dist/trial") };
    println!("\nmaking a fresh Debian, {suite}, in {}", system.root.display());
    chroot::make(&system.root, suite)?;
    machine::run(chroot::apt(&system.root).arg("update"))?;
    let here = folder.join("build/plugin/chalumeau");
    let package = deb::file(release);
    let archive = archive::name(SYSTEMS[0], release);
    for name in [&package, &archive] {
        fs::copy(folder.join(name), system.inside(DOWNLOADS).join(name))
            .with_context(|| format!("cannot copy {name}"))?;
    }
    let rendered = rendered_here(&here, folder)?;
    system.bare(&package, &rendered)?;
    system.ardour(&package)?;
    system.home(&archive, &archive::folder(SYSTEMS[0], release), &rendered)?;
    fs::remove_dir_all(&system.root)?;
    println!("\ntried in Debian's {suite}: all as it should be");
    Ok(())
}

/// The checksum of a note, rendered by the program that was packed.
fn rendered_here(program: &Path, folder: &Path) -> Result<String> {
    let wav = folder.join("here.wav");
    machine::run(Command::new(program).args(NOTE).arg("--out").arg(&wav))?;
    let sum = sha256(&wav)?;
    fs::remove_file(wav)?;
    Ok(sum)
}

/// A Debian of our own.
struct Fresh {
    root: PathBuf,
}

impl Fresh {
    /// A path inside as this system sees it.
    fn inside(&self, path: &str) -> PathBuf {
        self.root.join(path.trim_start_matches('/'))
    }

    fn apt(&self, words: &[&str]) -> Result<()> {
        machine::run(chroot::apt(&self.root).args(words))
    }

    /// A command inside, as the user.
    fn user(&self) -> Command {
        let mut command = chroot::enter(&self.root, &[]);
        command.args(["setpriv", "--reuid", USER, "--regid", USER, "--init-groups", "--"]).args([
            "env",
            "-i",
            "-C",
            HOME,
            &format!("HOME={HOME}"),
            "PATH=/usr/bin:/bin",
            "LANG=C.UTF-8",
        ]);
        command
    }

    /// All files and folders, but for the books that are kept of what was done.
    fn files(&self) -> Result<BTreeSet<PathBuf>> {
        let list = output(Command::new("find").arg(&self.root).args(["-xdev", "-printf", "/%P\\n"]))?;
        let kept = list.lines().filter(|path| !BOOKS.iter().any(|book| path.starts_with(book)));
        Ok(kept.map(PathBuf::from).collect())
    }

    /// Fails where something has been left or lost since.
    fn as_before(&self, before: &BTreeSet<PathBuf>, what: &str) -> Result<()> {
        let after = self.files()?;
        let changed: Vec<_> =
            before.symmetric_difference(&after).map(|path| path.display().to_string()).collect();
        ensure!(changed.is_empty(), "{what}, these files differ: {}", changed.join(", "));
        println!("{what}, the {} files and folders are those from before", before.len());
        Ok(())
    }

    /// The note rendered inside has the checksum of the one rendered here.
    fn renders(&self, program: &str, rendered: &str) -> Result<()> {
        let wav = "/tmp/there.wav";
        machine::run(
            self.user()
                .args([&format!("CHALUMEAU_CACHE_DIR={SCRATCH}"), program])
                .args(NOTE)
                .args(["--out", wav]),
        )?;
        let there = sha256(&self.inside(wav))?;
        ensure!(there == rendered, "{program} renders other bits there: {there}, and {rendered} here");
        println!("{program} renders the same bits there: {there}");
        fs::remove_file(self.inside(wav))?;
        Ok(())
    }

    /// The package on a system that has nothing: what it needs comes with it.
    fn bare(&self, package: &str, rendered: &str) -> Result<()> {
        machine::run(chroot::enter(&self.root, &[]).args(["useradd", "--create-home", USER]))?;
        let before = self.files()?;
        self.apt(&["install", &format!("{DOWNLOADS}/{package}")])?;
        self.renders("/usr/bin/chalumeau", rendered)?;
        self.shows_its_window()?;
        self.apt(&["purge", "--autoremove", "chalumeau"])?;
        self.as_before(&before, "package removed from a bare system")
    }

    /// The standalone program draws its window, on a display of this machine: the libraries that it loads are there.
    fn shows_its_window(&self) -> Result<()> {
        let display = Display::start()?;
        let screen = Screen::open(Some(display.name()))?;
        let mut command = self.user();
        command.args([&format!("DISPLAY={}", display.name()), "LIBGL_ALWAYS_SOFTWARE=1", "LP_NUM_THREADS=1"]);
        // Mesa keeps compiled shaders in the user's home, for every program that draws: they are no trace of the package.
        command.arg("MESA_SHADER_CACHE_DISABLE=true");
        // The session is the user's, who keeps it.
        command.arg(format!("CHALUMEAU_DATA_DIR={SCRATCH}"));
        let mut running = command.args(["chalumeau-standalone", "--backend", "dummy"]).spawn()?;
        let drawn = screen.titled("Chalumeau").and_then(|window| {
            let picture = screen.settled(window, Duration::from_millis(600))?;
            screen.ask_to_close(window)?;
            Ok(picture.colours())
        });
        if drawn.is_err() {
            machine::terminate(&mut running)?;
        }
        let colours = drawn.context("chalumeau-standalone shows no window there")?;
        let status = running.wait()?;
        ensure!(status.success(), "chalumeau-standalone ended with {status}");
        ensure!(colours > 20, "its window has only {colours} colours: nothing is drawn");
        println!("chalumeau-standalone draws its window there, in {colours} colours");
        Ok(())
    }

    /// The package beside a host: Ardour finds the plugin where packages put it, and it sounds.
    fn ardour(&self, package: &str) -> Result<()> {
        self.apt(&["install", "--no-install-recommends", "ardour", "lintian"])?;
        let lintian = ["lintian", "--fail-on", "error", "--allow-root", "--tag-display-limit", "0"];
        machine::run(chroot::enter(&self.root, &[]).args(lintian).arg(format!("{DOWNLOADS}/{package}")))?;
        let before = self.files()?;
        self.apt(&["install", &format!("{DOWNLOADS}/{package}")])?;
        ardour::plays(self, "/usr/lib/vst3/Chalumeau.vst3")?;
        self.apt(&["purge", "--autoremove", "chalumeau"])?;
        self.as_before(&before, "package removed beside Ardour")
    }

    /// The archive, installed by its script in the user's home, and again over itself.
    fn home(&self, archive: &str, folder: &str, rendered: &str) -> Result<()> {
        let before = self.files()?;
        let install = format!("{DOWNLOADS}/{folder}/install.sh");
        machine::run(chroot::enter(&self.root, &[]).args([
            "tar",
            "-C",
            DOWNLOADS,
            "-xf",
            &format!("{DOWNLOADS}/{archive}"),
        ]))?;
        for _ in 0..2 {
            machine::run(self.user().arg(&install))?;
        }
        self.renders(&format!("{HOME}/.local/bin/chalumeau"), rendered)?;
        ardour::plays(self, &format!("{HOME}/.vst3/Chalumeau.vst3"))?;
        machine::run(self.user().args([&install, "--uninstall"]))?;
        self.as_before(&before, "archive removed from a home")
    }
}
