//! Steps that may run beside each other, each in a process of its own. What a step says
//! goes to a file in `target/ci` and is printed in one piece when it ends.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, bail};

use super::{Done, EXACTLY, Step, spoken};
use crate::machine;

/// Runs a step while others run.
pub fn run(step: &'static Step) -> Done {
    println!("=== {} begins", step.name);
    let began = Instant::now();
    let log = machine::target().join("ci").join(format!("{}.log", step.name.replace(' ', "-")));
    let result = apart(step, &log);
    let took = began.elapsed();
    if let Err(error) = &result {
        println!("FAILED: {}: {error:#}", step.name);
    }
    println!("=== {}: {}", step.name, spoken(took));
    Done { step, passed: result.is_ok(), took, log: Some(log) }
}

/// The step in a process of its own, which writes to a file.
fn apart(step: &Step, path: &Path) -> Result<()> {
    let this = std::env::current_exe().context("this program does not know its own path")?;
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    let log = File::create(path).with_context(|| format!("cannot write {}", path.display()))?;
    let mut command = Command::new(this);
    command.args(["ci", EXACTLY, step.name]).stdin(Stdio::null()).stdout(log.try_clone()?).stderr(log);
    let status = command.status()?;
    print!("{}", String::from_utf8_lossy(&fs::read(path)?));
    if status.success() { Ok(()) } else { bail!("{status}") }
}

/// How many lines of a failed step are said again.
const LAST_LINES: usize = 40;

/// The last lines of a file.
pub fn end_of(log: &Path) -> String {
    let log = fs::read(log).unwrap_or_default();
    let log = String::from_utf8_lossy(&log);
    let lines: Vec<_> = log.lines().collect();
    lines[lines.len().saturating_sub(LAST_LINES)..].join("\n")
}
