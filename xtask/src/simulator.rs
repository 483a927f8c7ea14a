//! Builds `chalumeau` with the simulated knob.

use anyhow::{Context, Result};
use chalumeau_test_host::artefacts;

use crate::machine;

/// Builds it and puts it where no other build takes its place.
pub fn build() -> Result<()> {
    let features = ["--no-default-features", "--features", "simulator"];
    machine::run(machine::cargo().args(["build", "--bin", "chalumeau"]).args(features))?;
    let path = artefacts::program_path();
    std::fs::create_dir_all(path.parent().context("no folder for the simulator")?)?;
    let built = machine::target().join("debug").join(path.file_name().context("no name for the simulator")?);
    std::fs::copy(&built, &path).with_context(|| format!("cannot copy {}", built.display()))?;
    Ok(())
}
