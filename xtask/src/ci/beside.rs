//! Steps that keep one core busy and follow no clock run beside each other, each in a process of its own. What a step says
//! goes to a file in `target/ci` and is printed in one piece when it ends.

use std::fs::{self, File};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use anyhow::{Context, Result, bail};

use super::{Done, EXACTLY, Step, cores, spoken};
use crate::machine;

/// Runs all `steps`, as many at once as there are cores, the first first.
pub fn run(steps: &[&'static Step]) -> Vec<Done> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..cores() {
            scope.spawn(|| {
                while let Some(step) = steps.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let began = Instant::now();
                    println!("=== {} begins", step.name);
                    let result = apart(step);
                    let took = began.elapsed();
                    if let Err(error) = &result {
                        println!("FAILED: {}: {error:#}", step.name);
                    }
                    println!("=== {}: {}", step.name, spoken(took));
                    let mut done = done.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
                    done.push(Done { step, passed: result.is_ok(), took });
                }
            });
        }
    });
    done.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// The step in a process of its own, which writes to a file.
fn apart(step: &Step) -> Result<()> {
    let this = std::env::current_exe().context("this program does not know its own path")?;
    let folder = machine::target().join("ci");
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let path = folder.join(format!("{}.log", step.name.replace(' ', "-")));
    let log = File::create(&path).with_context(|| format!("cannot write {}", path.display()))?;
    let mut command = Command::new(this);
    command.args(["ci", EXACTLY, step.name]).stdin(Stdio::null()).stdout(log.try_clone()?).stderr(log);
    let status = command.status()?;
    print!("{}", String::from_utf8_lossy(&fs::read(&path)?));
    if status.success() { Ok(()) } else { bail!("{status}") }
}
