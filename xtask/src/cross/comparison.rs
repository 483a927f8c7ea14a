//! The same on another system: the bits of scores, the bytes of the program's files, and what tests say.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use sha2::{Digest, Sha256};

use crate::cross::build::Built;
use crate::debian::inside;
use crate::machine;

/// Hashes that tests/program_files.rs keeps.
const FILES: &str = "tests/golden/program_files.tsv";

/// The test of web/tests/scores.rs that compares twenty scores and the melody with the hashes in web/tests/scores.json.
pub const SCORES: &str = "the_module_plays_the_bits_of_the_clarinet";

/// Runs programs of another system here.
pub struct Runner<'a> {
    pub built: &'a Built,
    /// The program that runs them, and its arguments.
    pub words: &'a [&'a str],
    pub variables: Vec<(String, String)>,
}

impl Runner<'_> {
    /// A command that runs a program of the system; its arguments follow.
    pub fn command(&self, program: &Path) -> Result<Command> {
        let mut command = self.helper(self.words[0]);
        command.args(&self.words[1..]).arg(inside(program)?);
        Ok(command)
    }

    /// A command beside the programs, with their variables.
    pub fn helper(&self, program: &str) -> Command {
        let variables: Vec<_> =
            self.variables.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
        self.built.debian.command(&variables, program)
    }

    /// Runs a test program, and fails where a test fails.
    pub fn test(&self, name: &str, arguments: &[&str]) -> Result<()> {
        let began = Instant::now();
        machine::run(self.command(self.built.file(name)?)?.args(arguments))?;
        println!("{name}: passed in {:.0} s", began.elapsed().as_secs_f64());
        Ok(())
    }

    /// Plays the scores and compares the hashes with Linux's.
    pub fn scores(&self) -> Result<()> {
        self.test("scores", &[SCORES])
    }

    /// Writes every file of the list with the system's program and compares the hashes with Linux's.
    pub fn files(&self, program: &str, folder: &Path) -> Result<()> {
        let list = machine::root().join(FILES);
        let list = fs::read_to_string(&list).with_context(|| format!("cannot read {}", list.display()))?;
        let out = folder.join("out");
        let (mut equal, mut different) = (0, Vec::new());
        for (kept, line) in list.lines().filter_map(|line| line.split_once('\t')) {
            let _ = fs::remove_file(&out);
            let place = inside(&out)?;
            let words = line.split(' ').map(|word| if word == "OUT" { place.as_str() } else { word });
            let done = self.command(self.built.file(program)?)?.args(words).output()?;
            let made = fs::read(&out).map(|bytes| hash(&bytes)).unwrap_or_default();
            if done.status.success() && made.starts_with(kept) {
                equal += 1;
            } else {
                println!("differs: {line}: {made}\n{}", String::from_utf8_lossy(&done.stderr));
                different.push(line);
            }
        }
        let _ = fs::remove_file(&out);
        println!("{FILES}: {equal} files have Linux's bytes, {} have not", different.len());
        ensure!(different.is_empty() && equal > 0, "these files differ from Linux's: {different:#?}");
        Ok(())
    }
}

fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
