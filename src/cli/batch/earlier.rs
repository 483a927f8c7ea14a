//! What earlier runs of a batch have left in its folder, and what of it stays.

use crate::cli::Failure;
use crate::cli::batch::inputs::Inputs;
use crate::cli::batch::{GROWING, Job, MANIFEST};
use crate::cli::shared_args::counted;
use crate::wav;
use std::collections::{BTreeSet, HashMap, HashSet};
use std::fs;
use std::io::ErrorKind;
use std::path::Path;

/// The tables that earlier runs left in the folder; the one that grows without a line that was cut off.
pub(super) struct Earlier {
    finished: String,
    growing: String,
}

impl Earlier {
    pub(super) fn read(folder: &Path) -> Result<Self, Failure> {
        let table = |name: &str| match fs::read(folder.join(name)) {
            Ok(bytes) => Ok(String::from_utf8_lossy(&bytes).into_owned()),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(String::new()),
            Err(source) => Err(Failure::Read { path: folder.join(name), source }),
        };
        let mut growing = table(GROWING)?;
        growing.truncate(growing.rfind('\n').map_or(0, |end| end + 1));
        Ok(Self { finished: table(MANIFEST)?, growing })
    }

    /// The lines of both tables without their headers.
    fn lines(&self) -> impl Iterator<Item = &str> {
        [&self.finished, &self.growing].into_iter().flat_map(|text| text.lines().skip(1))
    }

    /// For each job the line of its file, if it stays: listed with the same arguments, there in its whole length, and of the same
    /// inputs. Then how many files are there and are of other inputs, or of inputs that nobody knows.
    pub(super) fn kept(&self, folder: &Path, jobs: &[Job], inputs: &Inputs) -> (Vec<Option<String>>, usize) {
        let listed: HashMap<_, _> = self.lines().map(|line| (beginning(line), line)).collect();
        let mut changed = 0;
        let kept = |job: &Job| {
            let line = *listed.get(job.line.as_str())?;
            if !is_whole(&folder.join(&job.file), line) {
                return None;
            }
            let is_same = inputs.are_those_of(job);
            changed += usize::from(!is_same);
            is_same.then(|| line.to_owned())
        };
        let lines = jobs.iter().map(kept).collect();
        (lines, changed)
    }

    /// Refuses a folder with files that this plan has not made and would replace.
    pub(super) fn check(&self, folder: &Path, header: &str, jobs: &[Job]) -> Result<(), Failure> {
        let refuse = |name: &str, is: &str| {
            Failure::Usage(format!(
                "{} {is}; choose another folder, or add --force to render all anew",
                folder.join(name).display()
            ))
        };
        // A run whose first file failed has left a table without files. What is called so and is none is not replaced.
        let is_table = |text: &String| text.is_empty() || text.starts_with("file,");
        let are_tables = [&self.finished, &self.growing].into_iter().all(is_table);
        if are_tables && self.lines().next().is_none() && !has_numbered_files(folder) {
            return Ok(());
        }
        for (name, text) in [(MANIFEST, &self.finished), (GROWING, &self.growing)] {
            if text.lines().next().is_some_and(|first| first != header) {
                let is = if is_table(text) { "is of another plan" } else { "is not the table of a batch" };
                return Err(refuse(name, is));
            }
        }
        let listed: HashMap<_, _> = self.lines().map(|line| (file_name(line), beginning(line))).collect();
        for job in jobs {
            match listed.get(job.file.as_str()) {
                Some(&line) if line == job.line => {}
                Some(_) => return Err(refuse(&job.file, "is of another plan")),
                // A stopped run has finished files that it had no time to list.
                None if !self.growing.is_empty() => {}
                None if folder.join(&job.file).exists() => {
                    return Err(refuse(&job.file, "is there and is not of this plan"));
                }
                None => {}
            }
        }
        Ok(())
    }

    /// Says which listed files are still there and are not of this plan.
    pub(super) fn left_over(&self, folder: &Path, jobs: &[Job]) -> Option<String> {
        let ours: HashSet<_> = jobs.iter().map(|job| job.file.as_str()).collect();
        let others: BTreeSet<_> = self
            .lines()
            .map(file_name)
            .filter(|&name| is_numbered(name) && !ours.contains(name) && folder.join(name).is_file())
            .collect();
        let (first, last) = (others.first()?, others.last()?);
        let which = if first == last { (*first).to_owned() } else { format!("{first} to {last}") };
        Some(format!(
            "{} holds {} of an earlier plan, which {MANIFEST} does not list: {which}",
            folder.display(),
            counted(others.len(), "file")
        ))
    }
}

/// Whether a file is called as the batch calls its own.
fn is_numbered(name: &str) -> bool {
    let number = name.strip_suffix(".wav").unwrap_or_default();
    !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit())
}

fn has_numbered_files(folder: &Path) -> bool {
    let files = fs::read_dir(folder).into_iter().flatten().flatten();
    files.into_iter().any(|file| file.file_name().to_str().is_some_and(is_numbered))
}

/// File and arguments: a line without what is known after the rendering.
fn beginning(line: &str) -> &str {
    line.rsplitn(MEASURED_COLUMNS + 1, ',').last().unwrap_or_default()
}

/// Whether a sound is there as long as its line says, to its last sample.
fn is_whole(path: &Path, line: &str) -> bool {
    let mut last = line.rsplit(',').skip(MEASURED_COLUMNS - 2);
    let (rate, seconds) = (last.next(), last.next());
    let (rate, seconds) =
        (rate.and_then(|rate| rate.parse().ok()), seconds.and_then(|seconds| seconds.parse().ok()));
    rate.zip(seconds).is_some_and(|(rate, seconds)| wav::is_whole(path, seconds, rate))
}

/// The first field of a line.
fn file_name(line: &str) -> &str {
    line.split(',').next().unwrap_or_default()
}

/// Columns of a line that are known after the rendering.
const MEASURED_COLUMNS: usize = 5;
