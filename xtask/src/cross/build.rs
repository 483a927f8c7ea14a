//! Cargo for another system, in the folder of Debian's packages, and what it has made.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::debian::{self, Debian, Packages};
use crate::machine;

/// The compiler, and the sources of its library.
pub const COMPILER: Packages = Packages {
    purpose: "the compiler's library for other systems",
    processor: None,
    names: &["rustc", "cargo", "rust-src", "gcc", "libc6-dev"],
};
/// The release profile without link-time optimisation, which pip builds with too.
const PROFILE: &str = "wheel";

/// What builds for one system.
pub struct Cargo {
    /// Its folder below `target/cross`.
    pub system: &'static str,
    /// Rust's name of it.
    pub target: &'static str,
    pub packages: Packages,
    /// Debian has no library of the compiler for it, so that it is compiled too.
    pub builds_library: bool,
    pub variables: &'static [(&'static str, &'static str)],
}

/// What cargo has made.
pub struct Built {
    pub debian: Debian,
    /// Programs and test programs by the name of their target in Cargo.toml, libraries that others load by their own name.
    pub files: BTreeMap<String, PathBuf>,
}

impl Built {
    /// A file by its name in `files`.
    pub fn file(&self, name: &str) -> Result<&Path> {
        self.files.get(name).map(PathBuf::as_path).with_context(|| format!("cargo has not built {name}"))
    }

    /// Copies files to a folder for users, which is made.
    pub fn keep(&self, folder: &Path, files: &[(&str, &str)]) -> Result<()> {
        for (name, to) in files {
            let to = folder.join(to);
            fs::create_dir_all(to.parent().unwrap_or(folder))?;
            fs::copy(self.file(name)?, &to).with_context(|| format!("cannot write {}", to.display()))?;
            println!("{}: {} kB", to.display(), fs::metadata(&to)?.len() / 1_000);
        }
        Ok(())
    }
}

impl Cargo {
    /// Builds programs, libraries and tests.
    pub fn build(&self, options: &[&str]) -> Result<Built> {
        let debian = Debian::with(&self.packages)?;
        let mut cargo = self.cargo(&debian, "build")?;
        cargo.args(["--profile", PROFILE, "--message-format", "json-render-diagnostics"]).args(options);
        let name = machine::described(&cargo);
        let output = cargo.stderr(Stdio::inherit()).output().context("cannot start unshare")?;
        ensure!(output.status.success(), "`{name}` failed: {}", output.status);
        Ok(Built { debian, files: files(&String::from_utf8_lossy(&output.stdout))? })
    }

    /// Type-checks; a warning is an error.
    pub fn check(&self, options: &[&str]) -> Result<()> {
        let debian = Debian::with(&self.packages)?;
        let mut cargo = self.cargo(&debian, "check")?;
        cargo.args(["--config", "build.warnings=\"deny\""]);
        machine::run(cargo.args(options))
    }

    fn cargo(&self, debian: &Debian, command: &str) -> Result<std::process::Command> {
        let folder = machine::target().join("cross/build").join(self.system);
        let mut cargo = debian.cargo(&folder, &[&[("RUSTC_BOOTSTRAP", "1")], self.variables].concat())?;
        cargo.args([command, "--locked", "--target", self.target]);
        if self.builds_library {
            cargo.arg("-Zbuild-std=std,panic_unwind,test");
        }
        Ok(cargo)
    }
}

/// Where cargo's messages say that programs and libraries are.
fn files(messages: &str) -> Result<BTreeMap<String, PathBuf>> {
    let here = |path: &str| {
        machine::root().join(Path::new(path).strip_prefix(debian::SOURCE).unwrap_or(Path::new(path)))
    };
    let mut files = BTreeMap::new();
    for line in messages.lines().filter(|line| line.starts_with('{')) {
        let message: Value = serde_json::from_str(line)?;
        let name = message["target"]["name"].as_str();
        if let (Some(name), Some(program)) = (name, message["executable"].as_str()) {
            files.insert(name.to_owned(), here(program));
        }
        let made = message["filenames"].as_array().into_iter().flatten().filter_map(Value::as_str);
        for library in made.filter(|path| path.ends_with(".dll")) {
            let path = here(library);
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            files.insert(name, path);
        }
    }
    Ok(files)
}
