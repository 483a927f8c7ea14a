//! `chalumeau batch`: renders many variations of one command, and a table of what each file is: data sets.

pub(super) mod plan;

use crate::cli::csv_table::{CsvTable, quoted};
use crate::cli::files;
use crate::cli::render::{LIMITED, RenderCommand, Rendered};
use crate::cli::shared_args::counted;
use crate::cli::words::typed;
use crate::cli::{Failure, parse};
use chalumeau_core::instrument::side_by_side;
use clap::{Args, Parser};
use indicatif::{ProgressBar, ProgressStyle};
use plan::{Plan, Variation};
use std::collections::{BTreeSet, HashMap, HashSet};
use std::fs;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Name of the table in the folder.
const MANIFEST: &str = "manifest.csv";
/// The same while it grows, in the order in which files become ready.
const GROWING: &str = "manifest.part.csv";

const EXAMPLES: &str = "\
Examples:
  chalumeau batch plan.toml --into set
  chalumeau batch rows.csv --into set --dry-run

A plan is a TOML file. [same] is for every file; of [vary] every combination is rendered:
  [same]
  seconds = 1.5
  no-noise = true
  [vary]
  written = [\"E3\", \"C4\", \"G4\"]
  gamma = { from = 0.4, to = 0.6, steps = 5 }
  zeta = [0.2, 0.3]
Names are flags of `chalumeau render` without their dashes, or ids of `chalumeau parameters`; a MIDI file is midi = \"melody.mid\".
A CSV file has the names in its first line, and one file to render in each other line; an empty field leaves its name out.";

/// Render many variations into a folder, with a table of what each file is
///
/// Works on all cores, and on each renders up to eight files of one instrument side by side; a file is the same as if it were rendered by itself. If it is stopped, the same command goes on where it was: files that are listed with the same arguments stay
/// as they are. A folder with files of another plan is refused. The table, manifest.csv, has a line for each file: its arguments, length, peak and level.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct BatchCommand {
    /// Plan: a TOML file, or a CSV file with a line for each file to render
    #[arg(value_name = "PLAN")]
    plan: PathBuf,
    /// Folder for the WAV files and manifest.csv; it is made if it is not there
    #[arg(long, value_name = "FOLDER")]
    into: PathBuf,
    /// Render all files anew, in place of those that are there, also those of another plan
    #[arg(long)]
    force: bool,
    /// Only check the plan and print the commands
    #[arg(long)]
    dry_run: bool,
}

#[derive(Parser)]
struct RenderLine {
    #[command(flatten)]
    render: RenderCommand,
}

/// A variation and the command that renders it.
struct Job {
    /// Name of the file.
    file: String,
    /// Beginning of its line in the table: name and arguments.
    line: String,
    /// Where the plan has it, for a reader.
    place: String,
    words: Vec<String>,
    /// What it says of the bore.
    bore: Vec<String>,
    render: RenderCommand,
}

/// Files that are not what was asked for, by why.
#[derive(Default)]
struct Doubtful {
    limited: Vec<String>,
    clipped: Vec<String>,
    reset: Vec<String>,
}

impl Doubtful {
    fn look(&mut self, file: &str, &Rendered { level, resets, .. }: &Rendered) {
        let kinds = [
            (level.peak >= LIMITED, &mut self.limited),
            (level.clipped > 0, &mut self.clipped),
            (resets > 0, &mut self.reset),
        ];
        for (_, files) in kinds.into_iter().filter(|(is_so, _)| *is_so) {
            files.push(file.to_owned());
        }
    }

    fn warn(self) {
        for (files, what) in [
            (self.limited, "the limiter turned peaks down; lower gain-db for levels as played"),
            (self.clipped, "samples clipped; lower gain-db or use bits = \"32f\""),
            (self.reset, "the calculation broke down and the instrument was reset; please report this"),
        ] {
            if let Some(first) = files.iter().min() {
                let which = if files.len() == 1 { first.clone() } else { format!("{first} and others") };
                say!("warning: {} ({which}): {what}", counted(files.len(), "file"));
            }
        }
    }
}

/// Names that choose or change a bore.
const OF_THE_BORE: [&str; 6] = ["instrument", "preset", "rate", "quality", "a4", "untuned"];

impl BatchCommand {
    pub fn run(&self) -> Result<(), Failure> {
        self.refuse_names()?;
        let plan = Plan::read(&self.plan).map_err(|what| self.failure(&what))?;
        let jobs = self.jobs(&plan)?;
        for job in &jobs {
            let checked = job.render.check();
            checked.map_err(|failure| {
                self.failure(&format!("{}: {failure} (chalumeau {})", job.place, typed(&job.words)))
            })?;
        }
        if self.dry_run {
            let mut out = BufWriter::new(io::stdout().lock());
            for job in &jobs {
                writeln!(out, "chalumeau {}", typed(&job.words))?;
            }
            return Ok(out.flush()?);
        }
        fs::create_dir_all(&self.into)
            .map_err(|error| self.failure(&format!("cannot make {}: {error}", self.into.display())))?;
        let header = format!("file,{},length_s,rate_hz,peak_dbfs,rms_dbfs", plan.names.join(","));
        let earlier = Earlier::read(&self.into)?;
        if !self.force {
            earlier.check(&self.into, &header, &jobs)?;
        }
        let there = if self.force { HashMap::new() } else { earlier.lines_by_arguments() };
        let growing = self.into.join(GROWING);
        let mut journal =
            new_journal(&growing).map_err(|source| Failure::Batch { path: growing.clone(), source })?;
        // In one piece: a run that is stopped leaves whole lines.
        let mut say = |line: &str| {
            let line = format!("{line}\n");
            journal
                .write_all(line.as_bytes())
                .map_err(|source| Failure::Batch { path: growing.clone(), source })
        };
        say(&header)?;
        if self.force {
            // It lists files that are about to be replaced. Without it, the same command can go on after a stop, without --force.
            let _ = fs::remove_file(self.into.join(MANIFEST));
        }
        let mut lines = Vec::with_capacity(jobs.len());
        for job in &jobs {
            let kept = there.get(&job.line).filter(|_| self.into.join(&job.file).is_file());
            if let Some(line) = kept {
                say(line)?;
            }
            lines.push(kept.cloned());
        }
        let mut left: Vec<_> = (0..jobs.len()).filter(|&at| lines[at].is_none()).collect();
        if left.len() < jobs.len() {
            let are = if jobs.len() == 1 { "is" } else { "are" };
            say!("{} of {} {are} there already", jobs.len() - left.len(), counted(jobs.len(), "file"));
        }
        // Those of one bore one after another: only they play side by side.
        left.sort_by(|&one, &other| jobs[one].bore.cmp(&jobs[other].bore));
        let bar = progress(left.len());
        let (journal, failed) = (Mutex::new(&mut say), Mutex::new(None));
        let doubtful = Mutex::new(Doubtful::default());
        let made = side_by_side::each(
            left.len(),
            async |stand, at| {
                let job = &jobs[left[at]];
                let made = job.render.render_beside(stand, |_| ProgressBar::hidden()).await;
                let line = made.and_then(|made| {
                    let line = finished(&job.line, &made);
                    if let Ok(mut doubtful) = doubtful.lock() {
                        doubtful.look(&job.file, &made);
                    }
                    if let Ok(mut say) = journal.lock() {
                        (*say)(&line)?;
                    }
                    Ok(line)
                });
                line.map_err(|failure| {
                    if let Ok(mut failed) = failed.lock() {
                        failed.get_or_insert((typed(&job.words), failure));
                    }
                })
                .ok()
            },
            &mut |_| {
                bar.inc(1);
                let has_failed = failed.lock().is_ok_and(|failed| failed.is_some());
                if has_failed { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            },
        );
        bar.finish_and_clear();
        if let Some((words, failure)) = failed.into_inner().ok().flatten() {
            return Err(Failure::Usage(format!("chalumeau {words}: {failure}")));
        }
        for (at, line) in left.into_iter().zip(made.unwrap_or_default()) {
            lines[at] = line;
        }
        let mut table = CsvTable::open(&self.into.join(MANIFEST), true, &header)?;
        for line in lines.iter().flatten() {
            table.line(format_args!("{line}"))?;
        }
        table.finish()?;
        let _ = fs::remove_file(&growing);
        say!("{}: {} and {MANIFEST}", self.into.display(), counted(jobs.len(), "file"));
        doubtful.into_inner().unwrap_or_default().warn();
        if let Some(left_over) = earlier.left_over(&self.into, &jobs) {
            say!("{left_over}");
        }
        Ok(())
    }

    fn failure(&self, what: &str) -> Failure {
        Failure::Usage(format!("{}: {what}", self.plan.display()))
    }

    /// Refuses a folder that cannot be meant, and a plan that the tables in the folder would replace.
    fn refuse_names(&self) -> Result<(), Failure> {
        if self.into.to_str().is_none() {
            return Err(Failure::Usage(format!(
                "--into {}: the name of the folder is not in UTF-8, in which the commands of a batch are; give another name",
                self.into.display()
            )));
        }
        let tables = [MANIFEST, GROWING].map(|name| self.into.join(name));
        files::keep_apart(
            "is the plan, and is replaced by a table of the files that are made",
            &[Some(&self.plan)],
            &tables.each_ref().map(|table| Some(table.as_path())),
        )
    }

    /// Checks every command before the first is run.
    fn jobs(&self, plan: &Plan) -> Result<Vec<Job>, Failure> {
        let digits = plan.variations.len().to_string().len().max(4);
        let job = |(at, variation): (usize, &Variation)| {
            let file = format!("{:0digits$}.wav", at + 1);
            let mut words = vec!["render".to_owned()];
            let place = match variation.line {
                Some(line) => format!("line {line}"),
                None => format!("file {}", at + 1),
            };
            let values = plan.words(variation);
            words.extend(values.map_err(|what| self.failure(&format!("{place}: {what}")))?);
            words.extend([
                "--out".to_owned(),
                self.into.join(&file).to_string_lossy().into_owned(),
                "--force".to_owned(),
            ]);
            let parsed = parse::<RenderLine>(&words).map_err(|error| {
                self.failure(&format!("{place}: {} (chalumeau {})", in_one_line(&error), typed(&words)))
            })?;
            let fields: Vec<_> = variation.values.iter().map(|value| quoted(value)).collect();
            let line = format!("{file},{}", fields.join(","));
            let values = plan.names.iter().zip(&variation.values);
            let bore = values.filter(|(name, _)| OF_THE_BORE.contains(&name.as_str()));
            let bore = bore.map(|(_, value)| value.clone()).collect();
            Ok(Job { file, line, place, words, bore, render: parsed.render })
        };
        plan.variations.iter().enumerate().map(job).collect()
    }
}

/// The tables that earlier runs left in the folder, without lines that were cut off.
struct Earlier {
    finished: String,
    growing: String,
}

impl Earlier {
    fn read(folder: &Path) -> Result<Self, Failure> {
        let table = |name: &str| match fs::read(folder.join(name)) {
            Ok(bytes) => {
                let whole = bytes.iter().rposition(|&byte| byte == b'\n').map_or(0, |end| end + 1);
                Ok(String::from_utf8_lossy(&bytes[..whole]).into_owned())
            }
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(String::new()),
            Err(source) => Err(Failure::Read { path: folder.join(name), source }),
        };
        Ok(Self { finished: table(MANIFEST)?, growing: table(GROWING)? })
    }

    /// The lines of both tables without their headers.
    fn lines(&self) -> impl Iterator<Item = &str> {
        [&self.finished, &self.growing].into_iter().flat_map(|text| text.lines().skip(1))
    }

    /// The lines by their beginnings: file and arguments.
    fn lines_by_arguments(&self) -> HashMap<String, String> {
        self.lines().map(|line| (beginning(line).to_owned(), line.to_owned())).collect()
    }

    /// Refuses a folder with files that this plan has not made and would replace.
    fn check(&self, folder: &Path, header: &str, jobs: &[Job]) -> Result<(), Failure> {
        let refuse = |name: &str, is: &str| {
            Failure::Usage(format!(
                "{} {is}; choose another folder, or add --force to render all anew",
                folder.join(name).display()
            ))
        };
        // A run whose first file failed has left a table without files.
        if self.lines().next().is_none() && !has_numbered_files(folder) {
            return Ok(());
        }
        for (name, text) in [(MANIFEST, &self.finished), (GROWING, &self.growing)] {
            if text.lines().next().is_some_and(|first| first != header) {
                return Err(refuse(name, "is of another plan"));
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
    fn left_over(&self, folder: &Path, jobs: &[Job]) -> Option<String> {
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

/// An empty journal in place of an earlier one. What an earlier one links to is not touched.
fn new_journal(path: &Path) -> io::Result<fs::File> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    fs::File::create_new(path)
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

/// Clap's own text without its "error: " and usage: with a list of what is missing, which stands on further lines.
fn in_one_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let lines: Vec<_> = text.lines().map(str::trim).take_while(|line| !line.is_empty()).collect();
    lines.join(" ").trim_start_matches("error: ").to_owned()
}

/// File and arguments: a line without what is known after the rendering.
fn beginning(line: &str) -> &str {
    line.rsplitn(MEASURED_COLUMNS + 1, ',').last().unwrap_or_default()
}

/// The first field of a line.
fn file_name(line: &str) -> &str {
    line.split(',').next().unwrap_or_default()
}

/// Columns of a line that are known after the rendering.
const MEASURED_COLUMNS: usize = 4;

/// The whole line of a file.
fn finished(begin: &str, made: &Rendered) -> String {
    let db = |x: f32| if x > 0.0 { format!("{:.2}", 20.0 * x.log10()) } else { "-inf".to_owned() };
    format!("{begin},{:.4},{},{},{}", made.seconds, made.rate, db(made.level.peak), db(made.level.rms))
}

/// A progress bar over files; it shows on a terminal only.
fn progress(files: usize) -> ProgressBar {
    let bar = ProgressBar::new(files as u64);
    match ProgressStyle::with_template("{bar:40} {pos} of {len}  {elapsed} (left: {eta})") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The last columns of a table.
    const REST: &str = "length_s,rate_hz,peak_dbfs,rms_dbfs";

    fn batch(directory: &Path, plan: &str, text: &str, force: bool) -> (BatchCommand, PathBuf) {
        let path = directory.join(plan);
        fs::write(&path, text).unwrap();
        let into = directory.join("set");
        (BatchCommand { plan: path, into: into.clone(), force, dry_run: false }, into)
    }

    #[test]
    fn a_plan_is_rendered_once_and_goes_on_where_it_was() {
        let directory = tempfile::tempdir().unwrap();
        let plan = "[same]\nseconds = 0.05\nno-noise = true\n[vary]\nwritten = [\"E3\", \"C4\"]\ngamma = { from = 0.4, to = 0.5, steps = 2 }\n";
        let (command, into) = batch(directory.path(), "plan.toml", plan, false);
        command.run().unwrap();
        let manifest = fs::read_to_string(into.join(MANIFEST)).unwrap();
        let lines: Vec<_> = manifest.lines().collect();
        assert_eq!(lines[0], "file,no-noise,seconds,gamma,written,length_s,rate_hz,peak_dbfs,rms_dbfs");
        assert_eq!(lines.len(), 5);
        assert!(lines[2].starts_with("0002.wav,true,0.05,0.4,C4,0.0500,48000,"), "{}", lines[2]);
        assert!(!into.join(GROWING).exists());
        // One file is lost: only this one is rendered again.
        let file = |name: &str| into.join(name);
        fs::remove_file(file("0003.wav")).unwrap();
        fs::write(file("0001.wav"), "mine").unwrap();
        command.run().unwrap();
        assert_eq!(fs::read(file("0001.wav")).unwrap(), b"mine");
        assert!(fs::metadata(file("0003.wav")).unwrap().len() > 1_000);
        assert_eq!(fs::read_to_string(file(MANIFEST)).unwrap(), manifest);
    }

    #[test]
    fn what_this_plan_has_not_made_is_kept_unless_forced() {
        let directory = tempfile::tempdir().unwrap();
        let plan = "[same]\nseconds = 0.05\n[vary]\nwritten = [\"E3\", \"C4\", \"G4\"]\n";
        let (command, into) = batch(directory.path(), "plan.toml", plan, false);
        let file = |name: &str| into.join(name);
        let first = "0001.wav,0.05,E3,0.0500,48000,-1.00,-2.00";
        let with_header = |line: &str| format!("file,seconds,written,{REST}\n{line}\n");
        // A file without a table, one that a finished table does not list, one with other arguments, and other columns.
        for (manifest, growing, says) in [
            (None, None, "0001.wav is there and is not of this plan; choose another folder, or add --force"),
            (Some(with_header(&first.replace("0001", "0009"))), None, "0001.wav is there and is not"),
            (Some(with_header(&first.replace("E3", "F3"))), None, "0001.wav is of another plan"),
            (None, Some(with_header(&first.replace("E3", "F3"))), "0001.wav is of another plan"),
            (Some(format!("file,written,{REST}\n")), None, "manifest.csv is of another plan"),
            (None, Some(format!("file,written,{REST}\n")), "manifest.part.csv is of another plan"),
        ] {
            let _ = fs::remove_dir_all(&into);
            fs::create_dir(&into).unwrap();
            fs::write(file("0001.wav"), "mine").unwrap();
            for (name, text) in [(MANIFEST, &manifest), (GROWING, &growing)] {
                if let Some(text) = text {
                    fs::write(file(name), text).unwrap();
                }
            }
            let said = command.run().unwrap_err().to_string();
            assert!(said.contains(says), "{said}");
            assert_eq!(fs::read(file("0001.wav")).unwrap(), b"mine");
            assert!(!file("0002.wav").exists());
            assert_eq!(fs::read_to_string(file(GROWING)).ok(), growing);
        }
        // A stopped run goes on: its last line is cut off, and a file is not listed yet.
        fs::write(file(GROWING), with_header(&format!("{first}\n0002.wav,0.0")).trim_end()).unwrap();
        fs::write(file("0002.wav"), "not listed").unwrap();
        command.run().unwrap();
        assert_eq!(fs::read(file("0001.wav")).unwrap(), b"mine");
        assert!(["0002.wav", "0003.wav"].iter().all(|name| fs::metadata(file(name)).unwrap().len() > 1_000));
        // By force, a shorter plan replaces its own files and names the others.
        let shorter = plan.replace("\"E3\", ", "");
        let (forced, _) = batch(directory.path(), "plan.toml", &shorter, true);
        let jobs = forced.jobs(&Plan::read(&forced.plan).unwrap()).unwrap();
        let left_over = Earlier::read(&into).unwrap().left_over(&into, &jobs).unwrap();
        assert!(left_over.contains("holds 1 file of an earlier plan"), "{left_over}");
        assert!(left_over.ends_with("manifest.csv does not list: 0003.wav"), "{left_over}");
        forced.run().unwrap();
        assert!(fs::metadata(file("0001.wav")).unwrap().len() > 1_000);
        assert_eq!(fs::read_to_string(file(MANIFEST)).unwrap().lines().count(), 3);
        assert!(file("0003.wav").exists());
    }

    #[test]
    fn a_plan_that_is_corrected_before_any_file_was_made_is_the_same_plan() {
        let directory = tempfile::tempdir().unwrap();
        let plan = "[vary]\nwritten = [\"E3\"]\n[same]\nseconds = 0.02\n";
        let (command, into) = batch(directory.path(), "plan.toml", plan, false);
        fs::create_dir(&into).unwrap();
        fs::write(into.join(GROWING), "file,written,growl,length_s,rate_hz,peak_dbfs,rms_dbfs\n").unwrap();
        command.run().unwrap();
        assert!(into.join("0001.wav").exists() && !into.join(GROWING).exists());
        // With a file that may be of that plan it is refused.
        fs::rename(into.join(MANIFEST), into.join(GROWING)).unwrap();
        fs::write(into.join(GROWING), "file,written,growl,length_s,rate_hz,peak_dbfs,rms_dbfs\n").unwrap();
        let said = command.run().unwrap_err().to_string();
        assert!(said.contains("is of another plan"), "{said}");
    }

    #[test]
    fn mistakes_are_told_before_anything_is_rendered() {
        let directory = tempfile::tempdir().unwrap();
        for (name, text, says) in [
            ("p.toml", "[vary]\nwritten = [\"H9\"]\n", "file 1"),
            ("p.toml", "[vary]\nwritten = [\"C4\", \"C9\"]\n", "file 2: written 120 (C9) has no fingering"),
            (
                "p.toml",
                "[vary]\nbreath = [\"none.csv\"]\n[same]\nwritten = \"C4\"\n",
                "file 1: cannot read none.csv",
            ),
            ("p.toml", "[vary]\nwriten = [\"C4\"]\n", "written"),
            ("p.toml", "[vary]\nout = [\"x.wav\"]\n", "out"),
            ("p.toml", "[vary]\n", "nothing varies"),
            ("p.toml", "[vary]\ngamma = [-1]\n", "0..3"),
            ("p.toml", "vary = 3", "invalid type"),
            ("r.csv", "written,gamma\nC4\n", "line 2"),
            ("r.csv", "written,gamma\nC4,0.5\n\nC9,0.5\n", "line 4: written 120 (C9) has no fingering"),
            (
                "r.csv",
                "gamma\n0.5\n0.6\n",
                "line 2: the following required arguments were not provided: <MIDI|",
            ),
            ("r.csv", "", "names"),
        ] {
            let (command, into) = batch(directory.path(), name, text, false);
            let said = command.run().unwrap_err().to_string();
            assert!(said.contains(says), "{text}: {said}");
            assert!(!into.exists());
        }
    }
}
