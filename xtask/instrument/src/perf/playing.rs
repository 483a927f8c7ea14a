//! Programs that play for a while, and what that costs: instructions by callgrind, and thread time.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use chalumeau_core::parallel;

use chalumeau_test_host::machine;

/// Lengths whose difference is counted, s: the note is steady by the first.
pub(super) const COUNTED_S: (f64, f64) = (0.2, 0.4);
/// Length that is timed, s, and how often; the least time counts, since all that interrupts only adds.
const TIMED_S: f64 = 1.0;
const TIMES: usize = 5;

/// What a sample of the host costs.
#[derive(Clone, Copy)]
pub(super) struct Cost {
    pub(super) instructions: f64,
    pub(super) ns: f64,
}

/// The number behind a word that a program printed.
pub(super) fn printed(text: &str, word: &str) -> Result<f64> {
    let mut words = text.split_whitespace();
    words.find(|found| *found == word).with_context(|| format!("no {word} in {text:?}"))?;
    Ok(words.next().context("no number")?.parse()?)
}

pub(super) fn output(command: &mut Command) -> Result<String> {
    let output = command.output().with_context(|| machine::described(command))?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{}: {said}", machine::described(command));
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// A program that plays for so many seconds: itself, and its other arguments.
pub(super) struct Player {
    pub(super) program: PathBuf,
    /// In place of `SECONDS` stands the length.
    pub(super) arguments: Vec<String>,
    pub(super) rate_hz: f64,
}

impl Player {
    fn command(&self, seconds: f64, tool: Option<&str>) -> Command {
        let mut command = Command::new(tool.map_or(self.program.as_path(), Path::new));
        if tool.is_some() {
            command.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]).arg(&self.program);
        }
        command.args(self.arguments.iter().map(|word| word.replace("SECONDS", &seconds.to_string())));
        command
    }

    /// Instructions of the whole run.
    pub(super) fn collected(&self, seconds: f64) -> Result<f64> {
        let mut command = self.command(seconds, Some("valgrind"));
        let output = command.output().context("valgrind: apt-get install valgrind")?;
        let said = String::from_utf8_lossy(&output.stderr);
        let line = said.lines().find(|line| line.contains("Collected :"));
        let line = line.with_context(|| format!("{}: {said}", machine::described(&command)))?;
        Ok(line.rsplit(' ').next().unwrap_or_default().parse()?)
    }

    /// Instructions of a sample.
    pub(super) fn instructions(&self, (short_s, long_s): (f64, f64)) -> Result<f64> {
        Ok((self.collected(long_s)? - self.collected(short_s)?) / ((long_s - short_s) * self.rate_hz))
    }

    /// Thread time of a sample, as the program says, ns.
    pub(super) fn ns(&self, word: &str) -> Result<f64> {
        let runs = (0..TIMES).map(|_| printed(&output(&mut self.command(TIMED_S, None))?, word));
        Ok(runs.collect::<Result<Vec<_>>>()?.into_iter().fold(f64::INFINITY, f64::min))
    }
}

/// The core's playing program with these words.
pub(super) fn ours(words: &[String]) -> Player {
    let rate = words.iter().find_map(|word| word.strip_prefix("rate=")?.parse().ok());
    let mut arguments = vec!["cost".to_owned(), "SECONDS".to_owned()];
    arguments.extend_from_slice(words);
    Player { program: program(), arguments, rate_hz: rate.unwrap_or(48_000.0) }
}

pub(super) fn program() -> PathBuf {
    machine::target().join("plugin").join(format!("growth{}", std::env::consts::EXE_SUFFIX))
}

pub(super) fn measure(words: &[String]) -> Result<Cost> {
    let player = ours(words);
    Ok(Cost { instructions: player.instructions(COUNTED_S)?, ns: player.ns("ns")? })
}

/// Counts on all cores: counts, unlike times, do not suffer.
pub(super) fn counted<T: Send>(count: usize, work: impl Fn(usize) -> Result<T> + Sync) -> Result<Vec<T>> {
    let found = parallel::each(count, work, &mut |_| ControlFlow::Continue(()));
    found.context("nothing stops this")?.into_iter().collect()
}
