//! All tests that need no host: as many test programs at once as there are cores, each with one thread. Then no core waits
//! for another's last test, and what takes minutes to prepare is prepared once for all tests of a program.

use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};

use super::{at_once, cores, spoken};
use crate::programs::{TestProgram, programs};

/// Programs that follow a clock (ports, links, the simulated knob in real time) run while nothing else does.
const BY_THE_CLOCK: &[&str] = &["simulator", "misbehaving", "obedience", "chalumeau_knob"];
/// These follow one, too, and mostly wait. They are steps of their own.
const APART: &[&str] = &["device", "knob_command"];
/// Programs that take longest begin first; the others follow in the order of their names.
const LONG: &[&str] = &[
    "instruments_tuned",
    "editor",
    "closed_loop",
    "chalumeau_core",
    "player",
    "instruments",
    "other_reeds",
    "render_hashes",
];

/// The step of `ci`.
pub fn run() -> Result<()> {
    let mut all: Vec<_> = programs()?.tests.iter().filter(|test| !test.needs_host()).collect();
    for &name in BY_THE_CLOCK.iter().chain(APART).chain(LONG) {
        ensure!(all.iter().any(|test| test.name == name), "no test program is called {name}");
    }
    all.retain(|test| !APART.contains(&test.name.as_str()));
    let (clock, mut others): (Vec<_>, Vec<_>) =
        all.into_iter().partition(|test| BY_THE_CLOCK.contains(&test.name.as_str()));
    others.sort_by_key(|test| LONG.iter().position(|name| *name == test.name).unwrap_or(LONG.len()));
    let mut results: Vec<_> = clock.into_iter().map(|test| played(test, &mut command(test))).collect();
    results.extend(at_once(&others, cores(), |test| played(test, command(test).arg("--test-threads=1")))?);
    let failed: Vec<_> = results.into_iter().filter_map(|result| Some(result.err()?.to_string())).collect();
    ensure!(failed.is_empty(), "{} failed: {}", failed.len(), failed.join(", "));
    Ok(())
}

/// A step with one of these programs.
pub fn run_alone(name: &str) -> Result<()> {
    let test = programs()?.tests.iter().find(|test| test.name == name);
    let test = test.with_context(|| format!("no test program is called {name}"))?;
    played(test, &mut command(test))
}

fn command(test: &TestProgram) -> Command {
    let mut command = Command::new(&test.path);
    // As cargo starts it.
    command.current_dir(&test.folder).env("CARGO_MANIFEST_DIR", &test.folder);
    command
}

/// Runs a program and prints what it said in one piece.
fn played(test: &TestProgram, command: &mut Command) -> Result<()> {
    let began = Instant::now();
    let output = command.output()?;
    let took = spoken(began.elapsed());
    let verdict = if output.status.success() { "passed" } else { "FAILED" };
    let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).trim().to_owned());
    println!("--- {}: {verdict}, {took}\n{}", test.described(), said.join("\n").trim());
    if output.status.success() { Ok(()) } else { bail!("{} ({})", test.described(), output.status) }
}
