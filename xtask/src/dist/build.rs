//! The bundles and programs of a release. Their bytes do not depend on the folder in which they are built.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use super::{Release, SYSTEMS, System, output};
use crate::machine;

/// The programs, without what only tests need.
const PROGRAMS: [&str; 2] = ["chalumeau", "chalumeau-standalone"];
const FEATURES: &str = "standalone,devices,cli,simulator";
/// The bundles' profile, so that programs and bundles share what they depend on.
const PROFILE: &str = "plugin";
/// What stands in the binaries for the workspace and for the packages.
const WORKSPACE: &str = "/chalumeau";
const PACKAGES: &str = "/crates";

/// What was built for a system.
pub struct Built {
    pub system: System,
    /// `Chalumeau.clap` and `Chalumeau.vst3`.
    pub bundles: Vec<PathBuf>,
    pub programs: Vec<PathBuf>,
}

/// Builds for this system.
pub fn here(release: &Release) -> Result<Built> {
    let host = compiler("host")?;
    let system = SYSTEMS.into_iter().find(|system| system.target == host);
    let system = system.with_context(|| {
        let known: Vec<_> = SYSTEMS.iter().map(|system| system.target).collect();
        format!("nothing is handed on for {host}; the systems are {}", known.join(", "))
    })?;
    let target = machine::target().join("dist/build");
    let flags = flags()?;
    let run = |command: &mut Command| {
        command
            .env("CARGO_ENCODED_RUSTFLAGS", &flags)
            .env("CARGO_TARGET_DIR", &target)
            .env("CARGO_INCREMENTAL", "0")
            .env("SOURCE_DATE_EPOCH", release.epoch.to_string());
        machine::run(command)
    };
    run(Command::new(std::env::current_exe()?).args(["bundle", "--locked"]))?;
    let mut cargo = machine::cargo();
    cargo.args(["build", "--locked", "--profile", PROFILE, "--no-default-features", "--features", FEATURES]);
    run(cargo.args(PROGRAMS.iter().flat_map(|name| ["--bin", name])))?;
    let built = built(system, &target.join("bundled"), &target.join(PROFILE))?;
    for path in built.binaries()? {
        no_path_of_this_machine(&path)?;
    }
    Ok(built)
}

/// What other commands have built for other systems: `target/cross/SYSTEM/` with bundles and programs.
pub fn elsewhere() -> Result<Vec<Built>> {
    let folders = SYSTEMS.iter().map(|system| (*system, machine::target().join("cross").join(system.cross)));
    folders
        .filter(|(_, folder)| folder.is_dir())
        .map(|(system, folder)| built(system, &folder, &folder))
        .collect()
}

fn built(system: System, bundles: &Path, programs: &Path) -> Result<Built> {
    let suffix = if system.name.starts_with("windows") { ".exe" } else { "" };
    let bundles = ["Chalumeau.clap", "Chalumeau.vst3"].map(|name| bundles.join(name));
    let programs = PROGRAMS.map(|name| programs.join(format!("{name}{suffix}")));
    for path in bundles.iter().chain(&programs) {
        ensure!(path.exists(), "{} is not there", path.display());
    }
    Ok(Built { system, bundles: bundles.into(), programs: programs.into() })
}

impl Built {
    /// All files that hold code, and the bundles' other files.
    pub fn binaries(&self) -> Result<Vec<PathBuf>> {
        let mut found = Vec::new();
        for path in self.bundles.iter().chain(&self.programs) {
            walk(path, &mut found)?;
        }
        Ok(found)
    }
}

/// The files at or below a path, sorted in each folder.
pub fn walk(path: &Path, found: &mut Vec<PathBuf>) -> Result<()> {
    if !path.is_dir() {
        found.push(path.to_owned());
        return Ok(());
    }
    let entries = fs::read_dir(path).with_context(|| format!("cannot list {}", path.display()))?;
    let mut entries = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    entries.sort();
    entries.iter().try_for_each(|entry| walk(entry, found))
}

/// The compiler's flags, as cargo reads them: each folder of this machine gets a name that is the same on every machine.
fn flags() -> Result<String> {
    let sources = cargo_home()?.join("registry/src");
    let mut packages: Vec<_> = match fs::read_dir(&sources) {
        Ok(entries) => entries.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?,
        Err(_) => Vec::new(),
    };
    packages.sort();
    let sysroot = output(Command::new("rustc").args(["--print", "sysroot"]))?;
    let library = Path::new(sysroot.trim()).join("lib/rustlib/src/rust");
    // As the compiler's makers name it.
    let rust = format!("/rustc/{}", compiler("commit-hash")?);
    let folders = [(machine::root().to_owned(), WORKSPACE)]
        .into_iter()
        .chain(packages.into_iter().map(|folder| (folder, PACKAGES)))
        .chain([(library, rust.as_str())]);
    let flags: Vec<_> =
        folders.map(|(folder, name)| format!("--remap-path-prefix={}={name}", folder.display())).collect();
    Ok(flags.join("\x1f"))
}

/// What the compiler says of itself.
fn compiler(what: &str) -> Result<String> {
    let said = output(Command::new("rustc").arg("-vV"))?;
    let found = said.lines().find_map(|line| line.strip_prefix(what)?.strip_prefix(": "));
    found.map(str::to_owned).with_context(|| format!("rustc -vV names no {what}"))
}

fn cargo_home() -> Result<PathBuf> {
    let named = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = named.or_else(|| Some(std::env::home_dir()?.join(".cargo")));
    home.context("cargo's home is not known; set CARGO_HOME")
}

/// Fails where a file holds the path of the workspace or of cargo's home.
fn no_path_of_this_machine(file: &Path) -> Result<()> {
    let bytes = fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
    for folder in [machine::root().to_owned(), cargo_home()?] {
        let word = folder.to_string_lossy();
        ensure!(
            !bytes.windows(word.len()).any(|window| window == word.as_bytes()),
            "{} holds the path {word} of this machine",
            file.display()
        );
    }
    Ok(())
}
