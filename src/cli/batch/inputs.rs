//! What the files of a batch were made of beside their arguments: other files and presets, as hashes.
//!
//! A MIDI file, an instrument or a preset of the user's may change while its name stays. So the folder keeps a hash of them for
//! each sound that has some, in a text file: a line for each, the later one counts.

use crate::cli::Failure;
use crate::cli::batch::Job;
use chalumeau_core::instrument::store::Key;
use std::collections::HashMap;
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Name of the file in the folder.
pub const INPUTS: &str = "manifest.inputs";
/// Its first line.
const HEADER: &str = "# Chalumeau batch: SHA-256 of the files and presets of which each sound was made";

/// What the files in the folder were made of, and what the jobs are made of now.
pub struct Inputs {
    path: PathBuf,
    /// By the name of the sound.
    made_of: HashMap<String, String>,
    /// Of each job that has some, by the name of its sound.
    now: HashMap<String, String>,
}

impl Inputs {
    /// Reads what is known of the folder, and hashes what the jobs read.
    pub fn read(folder: &Path, jobs: &[Job]) -> Result<Self, Failure> {
        let path = folder.join(INPUTS);
        let text = match fs::read(&path) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(error) if error.kind() == ErrorKind::NotFound => String::new(),
            Err(source) => return Err(Failure::Read { path, source }),
        };
        if !text.is_empty() && !text.starts_with(HEADER) {
            return Err(Failure::Usage(format!(
                "{} is not of a batch, which keeps a file of this name; choose another folder",
                path.display()
            )));
        }
        let lines = text.lines().skip(1).filter_map(|line| line.split_once(' '));
        let made_of = lines.map(|(name, hash)| (name.to_owned(), hash.to_owned())).collect();
        let (mut now, mut hashed) = (HashMap::new(), HashMap::new());
        for job in jobs {
            let mut all = String::new();
            for file in job.render.inputs() {
                let hash = match hashed.get(file) {
                    Some(hash) => *hash,
                    None => {
                        let read = fs::read(file);
                        let bytes = read.map_err(|source| Failure::Read { path: file.to_owned(), source })?;
                        let hash = Key::of(&bytes);
                        hashed.insert(file.to_owned(), hash);
                        hash
                    }
                };
                all += &format!("{hash}\n");
            }
            all += &job.render.preset_text().unwrap_or_default();
            if !all.is_empty() {
                now.insert(job.file.clone(), Key::of(all.as_bytes()).to_string());
            }
        }
        Ok(Self { path, made_of, now })
    }

    /// Whether the sound of a job, if it is there, was made of what the job is made of now.
    pub fn are_those_of(&self, job: &Job) -> bool {
        let now = self.now.get(&job.file);
        now.is_none() || now == self.made_of.get(&job.file)
    }

    /// A list of what the sounds that stay were made of, to which others are added. `None` if no job has any.
    pub fn open(&self, kept: &[String]) -> Result<Option<File>, Failure> {
        if self.now.is_empty() {
            return Ok(None);
        }
        let lines = kept.iter().filter_map(|name| self.line(name));
        let text = format!("{HEADER}\n{}", lines.collect::<String>());
        fs::write(&self.path, text).map_err(|source| self.failure(source))?;
        let file = File::options().append(true).open(&self.path);
        file.map(Some).map_err(|source| self.failure(source))
    }

    /// Adds what a sound was made of.
    pub fn add(&self, file: &mut File, job: &Job) -> Result<(), Failure> {
        let line = self.line(&job.file).unwrap_or_default();
        file.write_all(line.as_bytes()).map_err(|source| self.failure(source))
    }

    fn line(&self, name: &str) -> Option<String> {
        self.now.get(name).map(|hash| format!("{name} {hash}\n"))
    }

    fn failure(&self, source: std::io::Error) -> Failure {
        Failure::Write { path: self.path.clone(), source }
    }
}
