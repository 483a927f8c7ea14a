//! Where the built plugin and programs are, and the environment variables that name others.

use std::path::PathBuf;

use anyhow::{Result, bail};

use crate::machine;

/// Names another CLAP than the bundled one.
pub const CLAP: &str = "CHALUMEAU_CLAP";
/// Names another VST3 than the bundled one.
pub const VST3: &str = "CHALUMEAU_VST3";
/// Names another `chalumeau` with the simulated knob.
pub const PROGRAM: &str = "CHALUMEAU_PROGRAM";
/// Names another `chalumeau-standalone`.
pub const STANDALONE: &str = "CHALUMEAU_STANDALONE";
/// The folder of the instruments that a program under test makes.
pub const CACHE: &str = "CHALUMEAU_CACHE_DIR";

/// The bundled CLAP as a host loads it: the file, or on macOS the binary inside the bundle.
pub fn clap() -> Result<PathBuf> {
    let path = machine::target().join("bundled/Chalumeau.clap");
    let inside = path.join("Contents/MacOS/Chalumeau");
    named(CLAP, if inside.exists() { inside } else { path }, "cargo xtask bundle")
}

/// The bundled VST3, a folder.
pub fn vst3() -> Result<PathBuf> {
    named(VST3, machine::target().join("bundled/Chalumeau.vst3"), "cargo xtask bundle")
}

/// `chalumeau` with the simulated knob.
pub fn program() -> Result<PathBuf> {
    named(PROGRAM, program_path(), "cargo xtask simulator")
}

/// Where `cargo xtask simulator` puts `chalumeau`.
pub fn program_path() -> PathBuf {
    machine::target().join("simulator").join(format!("chalumeau{}", std::env::consts::EXE_SUFFIX))
}

/// `chalumeau-standalone`, a debug build with every feature.
pub fn standalone() -> Result<PathBuf> {
    let name = format!("programs/chalumeau-standalone{}", std::env::consts::EXE_SUFFIX);
    named(STANDALONE, machine::target().join(name), "cargo xtask ci programs")
}

/// What the variable names, or `path`; whichever it is must be there.
fn named(variable: &str, path: PathBuf, made_by: &str) -> Result<PathBuf> {
    let path = std::env::var_os(variable).map_or(path, |named| machine::root().join(named));
    if path.exists() { Ok(path) } else { bail!("{} is not there; run `{made_by}`", path.display()) }
}
