//! The same on another system: the bits of scores, the bytes of the program's files, and what tests say.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use sha2::{Digest, Sha256};

use crate::cross::build::Built;
use crate::cross::passed::{Passed, hex};
use crate::debian::inside;
use crate::machine;

/// Hashes that tests/program_files.rs keeps.
const FILES: &str = "tests/golden/program_files.tsv";

/// A test that can be run in parts.
pub struct Parts {
    /// The file of tests and the test in it.
    pub file: &'static str,
    pub name: &'static str,
    /// The hashes that it compares with.
    pub hashes: &'static str,
    pub parts: usize,
}

/// Twenty scores and the melody, each a part.
pub const SCORES: Parts = Parts {
    file: "scores",
    name: "the_module_plays_the_bits_of_the_clarinet",
    hashes: "web/tests/scores.json",
    parts: 21,
};

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
        self.command_with(&[], program)
    }

    /// The same with these variables besides.
    fn command_with(&self, variables: &[(&str, &str)], program: &Path) -> Result<Command> {
        let mut all = self.variables();
        all.extend(variables);
        let mut command = self.built.debian.command(&all, self.words[0]);
        command.args(&self.words[1..]).arg(inside(program)?);
        Ok(command)
    }

    /// A command beside the programs, with their variables.
    pub fn helper(&self, program: &str) -> Command {
        self.built.debian.command(&self.variables(), program)
    }

    fn variables(&self) -> Vec<(&str, &str)> {
        self.variables.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect()
    }

    /// Runs a test program, and fails where a test fails.
    pub fn test(&self, name: &str, arguments: &[&str]) -> Result<()> {
        let began = Instant::now();
        machine::run(self.command(self.built.file(name)?)?.args(arguments))?;
        println!("{name}: passed in {:.0} s", began.elapsed().as_secs_f64());
        Ok(())
    }

    /// Runs a test in parts, see tests/support/part.rs, one after the other, and says how far it is. What the same program
    /// has passed before is not run again; the folder keeps it.
    pub fn parts(&self, test: &Parts, folder: &Path) -> Result<()> {
        let &Parts { file, name, hashes, parts } = test;
        let program = self.built.file(file)?;
        let list = folder.join(format!("{file}.passed"));
        let mut passed = Passed::before(list, &[program, &machine::root().join(hashes)])?;
        for part in (1..=parts).map(|part| format!("{part}/{parts}")) {
            if passed.has(&part) {
                println!("{file}, part {part}: the same bits, before");
                continue;
            }
            let began = Instant::now();
            let mut command = self.command_with(&[("CHALUMEAU_PART", &part)], program)?;
            let done = command.args(["--exact", name]).output()?;
            let said = String::from_utf8_lossy(&done.stdout);
            ensure!(
                done.status.success() && said.contains(" 1 passed"),
                "{file}, part {part} failed: {said}{}",
                String::from_utf8_lossy(&done.stderr)
            );
            println!("{file}, part {part}: the same bits, {:.0} s", began.elapsed().as_secs_f64());
            passed.add(&part)?;
        }
        Ok(())
    }

    /// Plays the scores and compares their hashes with Linux's.
    pub fn scores(&self, folder: &Path) -> Result<()> {
        self.parts(&SCORES, folder)
    }

    /// Writes every file of the list with the system's program and compares the hashes with Linux's; goes on where it was stopped.
    pub fn files(&self, program: &str, folder: &Path) -> Result<()> {
        let list = machine::root().join(FILES);
        let program = self.built.file(program)?;
        let mut passed = Passed::before(folder.join("files.passed"), &[program, &list])?;
        let list = fs::read_to_string(&list).with_context(|| format!("cannot read {}", list.display()))?;
        let out = folder.join("out");
        let (mut equal, mut different) = (0, Vec::new());
        for (kept, line) in list.lines().filter_map(|line| line.split_once('\t')) {
            if passed.has(line) {
                equal += 1;
                println!("the same bytes, before: {line}");
                continue;
            }
            let _ = fs::remove_file(&out);
            let place = inside(&out)?;
            let words = line.split(' ').map(|word| if word == "OUT" { place.as_str() } else { word });
            let done = self.command(program)?.args(words).output()?;
            let made = fs::read(&out).map(|bytes| hash(&bytes)).unwrap_or_default();
            if done.status.success() && made.starts_with(kept) {
                equal += 1;
                println!("the same bytes: {line}");
                passed.add(line)?;
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
    hex(&Sha256::digest(bytes))
}
