//! The plugin and the programs with every feature, built once and kept where no other build takes their place: cargo gives
//! a library that can be loaded one name, whatever its features, and so builds it anew whenever they change.

use std::fs;
use std::path::PathBuf;
use std::sync::OnceLock;

use anyhow::{Context, Result};

use crate::machine::{self, PROGRAM};

/// Debug builds, in which the framework aborts on any allocation while processing; their midir speaks to JACK.
pub struct Programs {
    /// The library, a CLAP.
    pub plugin: PathBuf,
    /// `chalumeau`, with the simulated knob.
    pub program: PathBuf,
    /// `chalumeau-standalone`.
    pub standalone: PathBuf,
}

/// Which program the tests of the standalone start.
pub const STANDALONE: &str = "CHALUMEAU_STANDALONE";

/// Builds them when first asked.
pub fn programs() -> Result<&'static Programs> {
    static BUILT: OnceLock<Programs> = OnceLock::new();
    if let Some(built) = BUILT.get() {
        return Ok(built);
    }
    let built = build()?;
    Ok(BUILT.get_or_init(|| built))
}

fn build() -> Result<Programs> {
    // With an example, which like a test may use what only tests need, cargo takes the libraries that the program's tests
    // were just built with; without one some have fewer features, and all that stands on them is built again.
    let what = ["--lib", "--bin", "chalumeau", "--bin", "chalumeau-standalone", "--example", "instructions"];
    machine::run(machine::cargo().arg("build").args(PROGRAM.split(' ')).args(what))?;
    let folder = machine::target().join("programs");
    fs::create_dir_all(&folder)?;
    let keep = |name: String| -> Result<PathBuf> {
        let (from, to) = (machine::target().join("debug").join(&name), folder.join(name));
        fs::copy(&from, &to).with_context(|| format!("cannot copy {}", from.display()))?;
        Ok(to)
    };
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    Ok(Programs {
        plugin: keep(format!("{prefix}chalumeau{suffix}"))?,
        program: keep(format!("chalumeau{}", std::env::consts::EXE_SUFFIX))?,
        standalone: keep(format!("chalumeau-standalone{}", std::env::consts::EXE_SUFFIX))?,
    })
}
