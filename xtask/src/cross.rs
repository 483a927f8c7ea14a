//! Builds for systems other than this one, and compares what their programs play with what Linux plays, to the bit.
//!
//! - `build`: cargo in the folder of Debian's packages, and what it has made
//! - `comparison`: the same scores, files and tests on another system
//! - `passed`: what need not be compared again
//! - `windows`: plugin, standalone and command line for Windows, under Wine
//! - `arm`: the command line for Linux on ARM, under qemu
//!
//! All of them, this system and WebAssembly in Node among them, play the same twenty scores and the melody, whose hashes
//! web/tests/scores.json keeps.
//!
//! For macOS there is neither a linker nor a way to run a program here: it is type-checked. Wine is not Windows, and qemu is no
//! ARM processor; .github/workflows/ci.yml has the jobs for real systems.

mod arm;
mod build;
mod comparison;
mod passed;
mod windows;

use std::path::PathBuf;

use anyhow::{Result, bail};

use crate::machine;
use crate::web;
use build::Cargo;

type System = (&'static str, fn() -> Result<()>);

/// What `cargo xtask cross` knows to build for.
const SYSTEMS: [System; 5] = [
    ("here", here),
    ("web", web::test_module),
    ("windows", windows::run),
    ("macos", macos),
    ("arm", arm::run),
];

/// `cargo xtask cross [system..]`: all of them unless some are named. Goes on after a failure.
pub fn run(names: &[String]) -> Result<()> {
    if let Some(unknown) = names.iter().find(|name| SYSTEMS.iter().all(|(known, _)| known != name)) {
        bail!(
            "no system is called {unknown:?}; the systems are: {}",
            SYSTEMS.map(|(name, _)| name).join(", ")
        );
    }
    let (mut passed, mut failed) = (Vec::new(), Vec::new());
    for (name, system) in SYSTEMS {
        if names.is_empty() || names.iter().any(|named| named == name) {
            println!("\n=== {name}");
            match system() {
                Ok(()) => passed.push(name),
                Err(error) => {
                    println!("FAILED: {error:#}");
                    failed.push(name);
                }
            }
        }
    }
    println!("\npassed: {}", passed.join(", "));
    if failed.is_empty() { Ok(()) } else { bail!("failed: {}", failed.join(", ")) }
}

/// Where the results for a system are.
fn folder(system: &str) -> PathBuf {
    machine::target().join("cross").join(system)
}

/// The scores on this system.
fn here() -> Result<()> {
    machine::run(machine::cargo().args([
        "test",
        "-p",
        "chalumeau-web",
        "--test",
        "scores",
        comparison::SCORES.name,
    ]))
}

/// Plugin, standalone, command line and devices, type-checked without a warning.
fn macos() -> Result<()> {
    let cargo = Cargo {
        system: "macos",
        target: "aarch64-apple-darwin",
        packages: build::COMPILER,
        builds_library: true,
        variables: &[],
    };
    cargo.check(&[
        "-p",
        "chalumeau",
        "--no-default-features",
        "--features",
        "cli,plugin,devices,standalone",
    ])?;
    println!("command line, plugin, devices and standalone have the right types; nothing was linked or run");
    Ok(())
}
