//! The one debug build of everything: all packages with all features, so that no step of `ci` builds anything again.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use anyhow::{Context, Result};

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
}

/// Builds all tests and programs when first asked.
pub fn programs() -> Result<&'static Programs> {
    static BUILT: OnceLock<Programs> = OnceLock::new();
    if let Some(built) = BUILT.get() {
        return Ok(built);
    }
    let built = build()?;
    Ok(BUILT.get_or_init(|| built))
}

/// The programs are copied: a user's next `cargo build` has other features and writes to the same place.
fn build() -> Result<Programs> {
    machine::run(machine::cargo().args(TESTS).arg("--no-run"))?;
    let folder = machine::target().join("programs");
    fs::create_dir_all(&folder)?;
    let keep = |built: &str, name: String| -> Result<PathBuf> {
        let (from, to) = (machine::target().join(built).join(&name), folder.join(name));
        fs::copy(&from, &to).with_context(|| format!("cannot copy {}", from.display()))?;
        Ok(to)
    };
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    Ok(Programs {
        // A build for tests leaves the library among its dependencies.
        plugin: keep("debug/deps", format!("{prefix}chalumeau{suffix}"))?,
        program: keep("debug", format!("chalumeau{}", std::env::consts::EXE_SUFFIX))?,
        standalone: keep("debug", format!("chalumeau-standalone{}", std::env::consts::EXE_SUFFIX))?,
    })
}

/// Names of the test files that need neither a bundle nor a host, sorted.
pub fn test_files() -> Result<Vec<String>> {
    let mut names = Vec::new();
    for folder in [
        "tests",
        "crates/core/tests",
        "crates/knob/tests",
        "crates/figure/tests",
        "firmware/tests",
        "web/tests",
    ] {
        let folder = machine::root().join(folder);
        if folder.exists() {
            for entry in fs::read_dir(&folder).with_context(|| format!("cannot list {}", folder.display()))? {
                names.extend(stem(&entry?.path()));
            }
        }
    }
    names.sort();
    Ok(names)
}

fn stem(path: &Path) -> Option<String> {
    let is_rust = path.extension() == Some(OsStr::new("rs"));
    is_rust.then(|| path.file_stem().map(|stem| stem.to_string_lossy().into_owned()))?
}
