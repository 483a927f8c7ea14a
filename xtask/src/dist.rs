//! `cargo xtask dist`: what a musician without Rust downloads.
//!
//! An archive for this system, one for each other system whose built files lie in `target/cross/`, a Debian package, a parts
//! list and the checksums, all in `target/dist`. The same commit is to give the same bytes in every folder (`--check`), with the same compiler
//! and system packages: times are the commit's, entries are sorted, and no path of the machine is in a binary.

mod archive;
mod build;
mod contents;
#[cfg(target_os = "linux")]
mod deb;
mod parts;
#[cfg(target_os = "linux")]
mod trial;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};
use sha2::{Digest, Sha256};
use time::OffsetDateTime;

use crate::{licences, machine};

/// The list of checksums, as `sha256sum --check` reads it.
const SUMS: &str = "SHA256SUMS";

/// Which release this is.
pub struct Release {
    pub version: String,
    /// The commit's time, s since 1970: the time of every file.
    pub epoch: u64,
}

impl Release {
    /// The commit's time, in UTC.
    fn time(&self) -> Result<OffsetDateTime> {
        Ok(OffsetDateTime::from_unix_timestamp(self.epoch.try_into()?)?)
    }
}

/// A system that something is made for.
#[derive(Clone, Copy)]
pub struct System {
    /// As archives are named.
    pub name: &'static str,
    /// As Rust names it; the licences and the parts list are this target's.
    pub target: &'static str,
    /// A folder in `target/cross` where another command leaves the bundles and programs.
    pub cross: &'static str,
}

/// What is said about a system's binaries.
pub struct Papers {
    /// The licences of every crate inside.
    pub licences: String,
    /// The crates, for programs.
    pub parts: Vec<u8>,
}

impl Papers {
    fn new(system: System, release: &Release) -> Result<Self> {
        Ok(Self { licences: licences::list(system.target)?, parts: parts::list(system, release)? })
    }
}

/// The systems that archives are made for.
pub const SYSTEMS: [System; 4] = [
    System { name: "linux-x86_64", target: "x86_64-unknown-linux-gnu", cross: "linux" },
    System { name: "windows-x86_64", target: "x86_64-pc-windows-gnu", cross: "windows" },
    System { name: "macos-aarch64", target: "aarch64-apple-darwin", cross: "macos" },
    System { name: "windows-x86_64", target: "x86_64-pc-windows-msvc", cross: "windows-msvc" },
];

/// `cargo xtask dist [--check] [--try[=SUITE]]`.
pub fn run(args: &[String]) -> Result<()> {
    let (mut check, mut tried) = (false, None);
    for arg in args {
        match arg.as_str() {
            "--check" => check = true,
            "--try" => tried = Some("stable"),
            other => match other.strip_prefix("--try=") {
                Some(suite) if !suite.is_empty() => tried = Some(suite),
                _ => bail!(
                    "unknown argument {other:?}; usage: cargo xtask dist [--check] [--try[=SUITE OF DEBIAN]]"
                ),
            },
        }
    }
    if check {
        ensure!(
            output(Command::new("git").args(["status", "--porcelain"]))?.is_empty(),
            "--check compares with a clone of the last commit: commit or remove what `git status` names first"
        );
    }
    let folder = make()?;
    if check {
        same_in_a_clone(&folder)?;
    }
    match tried {
        #[cfg(target_os = "linux")]
        Some(suite) => trial::run(&folder, &release()?, suite),
        #[cfg(not(target_os = "linux"))]
        Some(_) => bail!("--try needs Debian"),
        None => Ok(()),
    }
}

/// Makes everything, and returns its folder.
fn make() -> Result<PathBuf> {
    let release = release()?;
    let folder = machine::target().join("dist");
    fs::create_dir_all(&folder)?;
    for old in files(&folder)? {
        fs::remove_file(old)?;
    }
    let built = build::here(&release)?;
    let mut all = vec![built];
    all.extend(build::elsewhere()?);
    for built in &all {
        let papers = Papers::new(built.system, &release)?;
        let entries = contents::archive(built, &papers, &release)?;
        archive::write(&folder.join(archive::name(built.system, &release)), &entries, &release)?;
        let parts = format!("chalumeau-{}-{}.cdx.json", release.version, built.system.name);
        fs::write(folder.join(parts), &papers.parts)?;
        #[cfg(target_os = "linux")]
        if deb::possible(built) {
            deb::write(&folder, built, &papers, &release)?;
        }
    }
    let mut sums = String::new();
    for path in files(&folder)? {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        sums += &format!("{}  {name}\n", sha256(&path)?);
    }
    fs::write(folder.join(SUMS), &sums)?;
    println!("\n{}:\n{sums}", folder.display());
    Ok(folder)
}

/// The release that the last commit would be.
fn release() -> Result<Release> {
    let manifest: toml::Table = fs::read_to_string(machine::root().join("Cargo.toml"))?.parse()?;
    let version =
        manifest["workspace"]["package"]["version"].as_str().context("Cargo.toml names no version")?;
    let epoch = match std::env::var("SOURCE_DATE_EPOCH") {
        Ok(epoch) => epoch,
        Err(_) => output(Command::new("git").args(["log", "-1", "--format=%ct"]))
            .context("the time of the release is its commit's; outside of a clone, set SOURCE_DATE_EPOCH")?,
    };
    let epoch =
        epoch.trim().parse().with_context(|| format!("{epoch:?} is no time in seconds since 1970"))?;
    Ok(Release { version: version.to_owned(), epoch })
}

/// Makes everything again in a clone elsewhere, and compares the checksums.
fn same_in_a_clone(folder: &Path) -> Result<()> {
    let clone = folder.join("again/in a clone");
    println!("\nmaking everything again in {}", clone.display());
    let git = |words: &[&str]| machine::run(Command::new("git").arg("-C").arg(&clone).args(words));
    if clone.exists() {
        // One that failed: what it had built serves again.
        git(&["fetch", "--quiet", "origin", "HEAD"])?;
        git(&["reset", "--quiet", "--hard", "FETCH_HEAD"])?;
    } else {
        let clone_here = ["clone", "--quiet", "--no-local"];
        machine::run(Command::new("git").args(clone_here).arg(machine::root()).arg(&clone))?;
    }
    // Others build these; here only their packing is compared.
    let to = clone.join("target/cross");
    let _ = fs::remove_dir_all(&to);
    fs::create_dir_all(&to)?;
    for system in build::elsewhere()? {
        let from = machine::target().join("cross").join(system.system.cross);
        machine::run(Command::new("cp").arg("-r").arg(from).arg(&to))?;
    }
    let mut again = machine::cargo();
    again.args(["run", "--locked", "--package", "xtask", "--", "dist"]).current_dir(&clone);
    machine::run(again.env_remove("CARGO_TARGET_DIR"))?;
    let read =
        |path: PathBuf| fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()));
    let (here, there) = (read(folder.join(SUMS))?, read(clone.join("target/dist").join(SUMS))?);
    let differing: Vec<_> = here.lines().filter(|line| !there.lines().any(|other| other == *line)).collect();
    ensure!(
        here == there,
        "built again in {}, these have other checksums: {}",
        clone.display(),
        differing.join(", ")
    );
    println!("built again in another folder: the same {} checksums", here.lines().count());
    Ok(fs::remove_dir_all(folder.join("again"))?)
}

/// The files in a folder, sorted; folders are not among them.
fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder).with_context(|| format!("cannot list {}", folder.display()))?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    paths.retain(|path| path.is_file());
    paths.sort();
    Ok(paths)
}

fn sha256(path: &Path) -> Result<String> {
    let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    Ok(Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect())
}

/// What a command prints; anything but success is an error that names it.
fn output(command: &mut Command) -> Result<String> {
    let name = machine::described(command);
    let output = command.output().with_context(|| format!("cannot start `{name}`"))?;
    ensure!(
        output.status.success(),
        "`{name}` failed: {}",
        String::from_utf8_lossy(&output.stderr).trim_end()
    );
    Ok(String::from_utf8(output.stdout)?)
}
