//! The one debug build of everything: all packages with all features, so that no step of `ci` builds anything again.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::OnceLock;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::machine;

/// What every step that tests begins with. Another choice of packages or features would build the dependencies again.
pub const TESTS: [&str; 3] = ["test", "--workspace", "--all-features"];

/// Debug builds, in which the framework aborts on any allocation while processing; their midir speaks to JACK.
pub struct Programs {
    /// The library, a CLAP.
    pub plugin: PathBuf,
    /// `chalumeau`, with the simulated knob.
    pub program: PathBuf,
    /// `chalumeau-standalone`.
    pub standalone: PathBuf,
    /// `xtask-instrument`; its test has cargo build it.
    pub instrument: PathBuf,
    /// All programs of tests, sorted by name.
    pub tests: Vec<TestProgram>,
}

/// The unit tests of a library or program, or a file of a folder `tests`.
pub struct TestProgram {
    /// Of the target; that of the core's unit tests is `chalumeau_core`.
    pub name: String,
    pub path: PathBuf,
    /// The package's.
    pub folder: PathBuf,
    /// In a folder `tests`.
    is_file: bool,
}

impl TestProgram {
    /// Whether it plays a plugin or a program that a step of its own must build and start.
    pub fn needs_host(&self) -> bool {
        self.is_file && self.folder.ends_with("crates/test-host")
    }

    /// As people call it.
    pub fn described(&self) -> String {
        if self.is_file { format!("tests/{}.rs", self.name) } else { format!("unit tests of {}", self.name) }
    }

    /// What cargo tells of a test that it has built; of anything else nothing.
    fn told(message: &Value) -> Option<Self> {
        let target = &message["target"];
        let kind = target["kind"][0].as_str()?;
        let is_test = message["profile"]["test"].as_bool()? && !matches!(kind, "bench" | "example");
        let path = PathBuf::from(message["executable"].as_str()?);
        let folder = Path::new(message["manifest_path"].as_str()?).parent()?.to_owned();
        let name = target["name"].as_str()?.to_owned();
        is_test.then_some(Self { name, path, folder, is_file: kind == "test" })
    }
}

static BUILT: OnceLock<Programs> = OnceLock::new();

/// Builds all tests and programs when first asked.
pub fn programs() -> Result<&'static Programs> {
    if let Some(built) = built() {
        return Ok(built);
    }
    let built = build()?;
    Ok(BUILT.get_or_init(|| built))
}

/// Those that [`programs`] has built.
pub fn built() -> Option<&'static Programs> {
    BUILT.get()
}

fn build() -> Result<Programs> {
    let mut command = machine::cargo();
    command.args(TESTS).args(["--no-run", "--message-format=json-render-diagnostics"]);
    let output = command.stderr(Stdio::inherit()).output().context("cannot start cargo")?;
    ensure!(output.status.success(), "`{}` failed: {}", machine::described(&command), output.status);
    let told = String::from_utf8_lossy(&output.stdout);
    let messages = told.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let mut tests: Vec<_> = messages.filter_map(|message| TestProgram::told(&message)).collect();
    tests.sort_by(|a, b| a.name.cmp(&b.name));
    let folder = machine::target().join("programs");
    fs::create_dir_all(&folder)?;
    // Copies: a user's next `cargo build` has other features and writes to the same place.
    let keep = |built: &str, name: String| -> Result<PathBuf> {
        let (from, to) = (machine::target().join(built).join(&name), folder.join(&name));
        // Another step may be running the one that is there.
        let new = folder.join(format!("{name}.{}", std::process::id()));
        fs::copy(&from, &new).with_context(|| format!("cannot copy {}", from.display()))?;
        fs::rename(&new, &to).with_context(|| format!("cannot replace {}", to.display()))?;
        Ok(to)
    };
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    Ok(Programs {
        // A build for tests leaves the library among its dependencies.
        plugin: keep("debug/deps", format!("{prefix}chalumeau{suffix}"))?,
        program: keep("debug", format!("chalumeau{}", std::env::consts::EXE_SUFFIX))?,
        standalone: keep("debug", format!("chalumeau-standalone{}", std::env::consts::EXE_SUFFIX))?,
        instrument: keep("debug", format!("xtask-instrument{}", std::env::consts::EXE_SUFFIX))?,
        tests,
    })
}
