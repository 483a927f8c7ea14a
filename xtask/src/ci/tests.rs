//! All tests that need no host: as many test programs at once as there are cores, each with one thread. Then no core waits
//! for another's last test, and what takes minutes to prepare is prepared once for all tests of a program.

use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use anyhow::{Result, bail};

use super::{cores, spoken};
use crate::programs::{TestProgram, programs};

/// Programs that follow a clock (ports, links, the simulated knob in real time) run while nothing else does.
const BY_THE_CLOCK: &[&str] =
    &["device", "knob_command", "simulator", "misbehaving", "obedience", "chalumeau_knob"];
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
    let all = programs()?.tests.iter().filter(|test| !test.needs_host());
    let (clock, mut others): (Vec<_>, Vec<_>) =
        all.partition(|test| BY_THE_CLOCK.contains(&test.name.as_str()));
    others.sort_by_key(|test| LONG.iter().position(|name| *name == test.name).unwrap_or(LONG.len()));
    let mut failed = Vec::new();
    for test in clock {
        failed.extend(played(test, &mut command(test)).err());
    }
    failed.extend(at_once(&others));
    if failed.is_empty() {
        return Ok(());
    }
    bail!(
        "{} failed: {}",
        failed.len(),
        failed.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
    )
}

fn command(test: &TestProgram) -> Command {
    let mut command = Command::new(&test.path);
    // As cargo starts it.
    command.current_dir(&test.folder).env("CARGO_MANIFEST_DIR", &test.folder);
    command
}

/// As many programs as there are cores, the first of `tests` first.
fn at_once(tests: &[&TestProgram]) -> Vec<anyhow::Error> {
    let (next, failed) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..cores() {
            scope.spawn(|| {
                while let Some(test) = tests.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if let Err(error) = played(test, command(test).arg("--test-threads=1")) {
                        failed.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push(error);
                    }
                }
            });
        }
    });
    failed.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner())
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
