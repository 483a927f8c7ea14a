//! `cargo xtask validate`: the plugin in the validators of others.
//!
//! Steinberg's tests come from crates.io and are built here. The other two are in no package registry; they run where they
//! are installed.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use chalumeau_test_host::artefacts;
#[cfg(target_os = "linux")]
use chalumeau_test_host::display::Display;

use crate::{bundle, machine};

/// The version that the project has met. Another may have other checks.
const CLAP_VALIDATOR_VERSION: &str = "0.4.1";
/// pluginval's strictest level.
const STRICTEST: &str = "10";

/// A validator that somebody has installed.
struct Installed {
    program: &'static str,
    /// Environment variable that names the program if it is not on the PATH.
    variable: &'static str,
    /// Where it comes from.
    source: &'static str,
}

const CLAP_VALIDATOR: Installed = Installed {
    program: "clap-validator",
    variable: "CHALUMEAU_CLAP_VALIDATOR",
    source: "https://github.com/free-audio/clap-validator/releases, version 0.4.1",
};
const PLUGINVAL: Installed = Installed {
    program: "pluginval",
    variable: "CHALUMEAU_PLUGINVAL",
    source: "https://github.com/Tracktion/pluginval/releases, version 1.0.4 or newer",
};

impl Installed {
    /// The program, if it is there.
    fn find(&self) -> Result<Option<PathBuf>> {
        if let Some(named) = std::env::var_os(self.variable) {
            let path = machine::root().join(named);
            if !path.is_file() {
                bail!("{} names {}, which is no file", self.variable, path.display());
            }
            return Ok(Some(path));
        }
        let path = std::env::var_os("PATH").unwrap_or_default();
        let name = format!("{}{}", self.program, std::env::consts::EXE_SUFFIX);
        Ok(std::env::split_paths(&path).map(|folder| folder.join(&name)).find(|path| path.is_file()))
    }
}

/// How a validator ended.
enum Outcome {
    Passed,
    Failed(String),
    Skipped(String),
}

/// `cargo xtask validate [--all]`: builds the bundles, and runs every validator that is there. With `--all`, a validator
/// that is not there is a failure.
pub fn run(words: &[String]) -> Result<()> {
    let needs_all = match words {
        [] => false,
        [word] if word == "--all" => true,
        other => bail!("unknown argument {:?}; usage: cargo xtask validate [--all]", other.join(" ")),
    };
    bundle::run(&[])?;
    validate(needs_all)
}

/// Runs every validator that is there on the bundles.
pub fn installed() -> Result<()> {
    validate(false)
}

fn validate(needs_all: bool) -> Result<()> {
    let outcomes = [
        ("Steinberg's tests", steinberg()),
        (CLAP_VALIDATOR.program, with_installed(&CLAP_VALIDATOR, clap_validator)),
        (PLUGINVAL.program, with_installed(&PLUGINVAL, pluginval)),
    ];
    println!();
    let mut failed = 0;
    for (name, outcome) in &outcomes {
        match outcome {
            Outcome::Passed => println!("{name}: passed"),
            Outcome::Failed(reason) => println!("{name}: FAILED: {reason}"),
            Outcome::Skipped(reason) => println!("{name}: skipped: {reason}"),
        }
        failed += match outcome {
            Outcome::Passed => 0,
            Outcome::Failed(_) => 1,
            Outcome::Skipped(_) => usize::from(needs_all),
        };
    }
    if failed > 0 { bail!("{failed} of {} validators did not pass", outcomes.len()) } else { Ok(()) }
}

impl From<Result<()>> for Outcome {
    fn from(result: Result<()>) -> Self {
        result.map_or_else(|error| Self::Failed(format!("{error:#}")), |()| Self::Passed)
    }
}

fn with_installed(validator: &Installed, check: fn(&Path) -> Result<()>) -> Outcome {
    match validator.find() {
        Err(error) => Outcome::Failed(format!("{error:#}")),
        Ok(Some(program)) => check(&program).into(),
        Ok(None) => Outcome::Skipped(format!(
            "not on the PATH, and {} names none; get it from {}",
            validator.variable, validator.source
        )),
    }
}

/// The tests of Steinberg's VST3 SDK, built from the sources that a crate carries.
fn steinberg() -> Outcome {
    if !cfg!(target_os = "linux") {
        return Outcome::Skipped(
            "built on Linux only; elsewhere run `validator` of the VST3 SDK, https://github.com/steinbergmedia/vst3sdk"
                .to_owned(),
        );
    }
    let run = || -> Result<()> {
        let folder = machine::root().join("xtask/steinberg-tests");
        let target = machine::target().join("steinberg-tests");
        machine::run(
            machine::cargo()
                .args(["build", "--locked", "--manifest-path"])
                .arg(folder.join("Cargo.toml"))
                .arg("--target-dir")
                .arg(&target),
        )?;
        machine::run(Command::new(target.join("debug/steinberg-tests")).arg(artefacts::vst3()?))
    };
    run().into()
}

/// clap-validator's whole list.
fn clap_validator(program: &Path) -> Result<()> {
    let version = Command::new(program).arg("--version").output().context("cannot start clap-validator")?;
    let version = String::from_utf8_lossy(&version.stdout).trim().to_owned();
    if !version.ends_with(CLAP_VALIDATOR_VERSION) {
        println!(
            "{version}: the project has met {CLAP_VALIDATOR_VERSION}; another version may check something else"
        );
    }
    let out = Command::new(program)
        .arg("validate")
        .arg(artefacts::clap()?)
        .stdin(Stdio::null())
        .output()
        .context("cannot start clap-validator")?;
    let said = String::from_utf8_lossy(&out.stdout);
    println!("{said}{}", String::from_utf8_lossy(&out.stderr));
    let failed = failed_tests(&said).context("clap-validator prints no summary")?;
    match (failed, out.status.success()) {
        (0, true) => Ok(()),
        (0, false) => bail!("clap-validator ended with {}", out.status),
        (failed, _) => bail!("{failed} of its tests failed"),
    }
}

/// The number of failed tests in clap-validator's summary: "44 tests run, 32 passed, 4 failed, 0 warnings, 8 skipped".
fn failed_tests(said: &str) -> Option<u32> {
    // It colours its numbers even where nobody sees colours.
    let said = anstream::adapter::strip_str(said).to_string();
    let summary = said.lines().rev().find(|line| line.contains(" tests run, "))?;
    summary.split(", ").find_map(|part| part.trim().strip_suffix(" failed"))?.trim().parse().ok()
}

/// pluginval at its strictest level, on a display that nobody sees.
fn pluginval(program: &Path) -> Result<()> {
    let mut command = Command::new(program);
    command
        .args(["--strictness-level", STRICTEST, "--validate-in-process", "--validate"])
        .arg(artefacts::vst3()?);
    #[cfg(target_os = "linux")]
    let display = Display::start()?;
    #[cfg(target_os = "linux")]
    display.for_clients(&mut command);
    machine::run(&mut command)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_is_read() {
        let said = "...\n44 tests run, 32 passed, 4 failed, 0 warnings, 8 skipped\n";
        assert_eq!(failed_tests(said), Some(4));
        assert_eq!(failed_tests("44 tests run, 36 passed, 0 failed, 0 warnings, 8 skipped"), Some(0));
        let coloured = "44 tests run, \x1b[1;32m36\x1b[0m passed, \x1b[1;31m2\x1b[0m failed, \x1b[1;33m0\x1b[0m warnings";
        assert_eq!(failed_tests(coloured), Some(2));
        assert_eq!(failed_tests("4 failed"), None);
    }
}
