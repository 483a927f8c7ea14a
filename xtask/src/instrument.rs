//! Starts the program of the chores that need the clarinet itself. Compiling it takes minutes, so it is built when a chore
//! asks for it and not for each.

use std::path::PathBuf;
use std::process::Command;

use anyhow::Result;

use crate::{machine, programs};

const PACKAGE: &str = "xtask-instrument";

/// Runs a chore of that program.
pub fn run(name: &str, args: &[String]) -> Result<()> {
    machine::run(Command::new(program()?).arg(name).args(args))
}

/// That of the one debug build, where a step of `ci` has asked for one.
fn program() -> Result<PathBuf> {
    if let Some(programs) = programs::built() {
        return Ok(programs.instrument.clone());
    }
    machine::run(machine::cargo().args(["build", "--package", PACKAGE]))?;
    Ok(machine::target().join("debug").join(format!("{PACKAGE}{}", std::env::consts::EXE_SUFFIX)))
}
