//! `chalumeau batch`: renders many variations of one command, and a table of what each file is: data sets.

mod earlier;
mod inputs;
pub(super) mod plan;

use crate::cli::csv_table::{CsvTable, quoted};
use crate::cli::doubt::Doubt;
use crate::cli::files;
use crate::cli::idle_settings::{self, Idle};
use crate::cli::progress_bar::bar;
use crate::cli::render::{RenderCommand, Rendered};
use crate::cli::shared_args::counted;
use crate::cli::words::typed;
use crate::cli::{Failure, parse};
use chalumeau_core::instrument::side_by_side;
use clap::{Args, Parser};
use earlier::Earlier;
use indicatif::ProgressBar;
use inputs::{INPUTS, Inputs};
use plan::{Plan, Variation};
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Name of the table in the folder.
const MANIFEST: &str = "manifest.csv";
/// The same while it grows, in the order in which files become ready.
const GROWING: &str = "manifest.part.csv";
/// What stands between the warnings of a line.
const BETWEEN_DOUBTS: &str = ";";

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
Names are flags of `chalumeau render` without their dashes, or ids of `chalumeau parameters`; a MIDI file is midi = \
\"melody.mid\". A CSV file has the names in its first line, and one file to render in each other line; an empty field \
leaves its name out.";

/// Render many variations into a folder, with a table of what each file is
///
/// Works on all cores, and on each renders up to eight files of one instrument side by side; a file is the same as if it were rendered by itself. If it is stopped, the same command goes on where it was: files that are listed with the same arguments stay
/// as they are, unless a file or a preset that they are made of has changed. A folder with files of another plan is refused. The table, manifest.csv, has a line for each file: its arguments, length, peak and level, and what the command warns of: clipped, limited, reset or no_tone.
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

/// Files that may not be what was asked for, by why.
#[derive(Default)]
struct Doubtful(BTreeMap<Doubt, Vec<String>>);

impl Doubtful {
    /// Those of a finished table.
    fn read(jobs: &[Job], lines: &[Option<String>]) -> Self {
        let mut found = Self::default();
        for (job, line) in jobs.iter().zip(lines) {
            let told = line.as_deref().and_then(|line| line.rsplit(',').next()).unwrap_or_default();
            for doubt in Doubt::EACH {
                if told.split(BETWEEN_DOUBTS).any(|id| id == doubt.id()) {
                    found.0.entry(doubt).or_default().push(job.file.clone());
                }
            }
        }
        found
    }

    fn warn(&self) {
        for (doubt, files) in &self.0 {
            if let Some(first) = files.first() {
                let which = if files.len() == 1 { first.clone() } else { format!("{first} and others") };
                say!("warning: {} ({which}): {}", counted(files.len(), "file"), doubt.text());
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
        let mut idle_in_all: Option<Vec<Idle>> = None;
        for job in &jobs {
            let idle = job.render.check().map_err(|failure| {
                self.failure(&format!("{}: {failure} (chalumeau {})", job.place, typed(&job.words)))
            })?;
            match &mut idle_in_all {
                Some(all) => all.retain(|one| idle.contains(one)),
                None => idle_in_all = Some(idle),
            }
        }
        if let Some(idle) = idle_settings::in_words(&idle_in_all.unwrap_or_default()) {
            say!("warning: in every file, {idle}");
        }
        if self.dry_run {
            return dry_run(&jobs);
        }
        if self.into.is_file() {
            return Err(Failure::Usage(format!(
                "--into {} is a file; give the name of a folder",
                self.into.display()
            )));
        }
        fs::create_dir_all(&self.into).map_err(|error| {
            Failure::Usage(format!("cannot make the folder {}: {error}", self.into.display()))
        })?;
        let header = format!("file,{},length_s,rate_hz,peak_dbfs,rms_dbfs,warnings", plan.names.join(","));
        let earlier = Earlier::read(&self.into)?;
        if !self.force {
            earlier.check(&self.into, &header, &jobs)?;
        }
        let inputs = Inputs::read(&self.into, &jobs)?;
        let (mut lines, changed) =
            if self.force { (vec![None; jobs.len()], 0) } else { earlier.kept(&self.into, &jobs, &inputs) };
        say_what_stays(lines.iter().flatten().count(), changed, jobs.len());
        let journal = self.open_journal(&header, &jobs, &lines, &inputs)?;
        render_left(&jobs, &mut lines, journal)?;
        self.write_manifest(&header, &lines)?;
        say!("{}: {} and {MANIFEST}", self.into.display(), counted(jobs.len(), "file"));
        // Of the files that were there already, too.
        Doubtful::read(&jobs, &lines).warn();
        if let Some(left_over) = earlier.left_over(&self.into, &jobs) {
            say!("{left_over}");
        }
        Ok(())
    }

    /// The table that grows while files become ready, with those that stay.
    fn open_journal<'a>(
        &self,
        header: &str,
        jobs: &[Job],
        lines: &[Option<String>],
        inputs: &'a Inputs,
    ) -> Result<Journal<'a>, Failure> {
        let path = self.into.join(GROWING);
        let table = new_table(&path).map_err(|source| Failure::Write { path: path.clone(), source })?;
        let stays = jobs.iter().zip(lines).filter(|(_, line)| line.is_some());
        let made_of = inputs.open(&stays.map(|(job, _)| job.file.clone()).collect::<Vec<_>>())?;
        let mut journal = Journal { path, table, inputs, made_of };
        journal.say(header)?;
        if self.force {
            // It lists files that are about to be replaced. Without it, the same command can go on after a stop, without --force.
            let _ = fs::remove_file(self.into.join(MANIFEST));
        }
        lines.iter().flatten().try_for_each(|line| journal.say(line))?;
        Ok(journal)
    }

    /// The table of all files, in their order, in place of the one that grew.
    fn write_manifest(&self, header: &str, lines: &[Option<String>]) -> Result<(), Failure> {
        let mut table = CsvTable::open(&self.into.join(MANIFEST), true, header)?;
        for line in lines.iter().flatten() {
            table.line(format_args!("{line}"))?;
        }
        table.finish()?;
        let _ = fs::remove_file(self.into.join(GROWING));
        Ok(())
    }

    fn failure(&self, what: &str) -> Failure {
        Failure::Usage(format!("{}: {what}", self.plan.display()))
    }

    /// Refuses a folder that cannot be meant, and a plan that the tables in the folder would replace.
    fn refuse_names(&self) -> Result<(), Failure> {
        if self.into == Path::new("-") {
            let usage = "a batch cannot go to standard output; give --into the name of a folder";
            return Err(Failure::Usage(usage.to_owned()));
        }
        if self.into.to_str().is_none() {
            return Err(Failure::Usage(format!(
                "--into {}: the name of the folder is not in UTF-8, in which the commands of a batch are; give another name",
                self.into.display()
            )));
        }
        let tables = [MANIFEST, GROWING, INPUTS].map(|name| self.into.join(name));
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

/// Prints the commands.
fn dry_run(jobs: &[Job]) -> Result<(), Failure> {
    let mut out = BufWriter::new(io::stdout().lock());
    for job in jobs {
        writeln!(out, "chalumeau {}", typed(&job.words))?;
    }
    Ok(out.flush()?)
}

/// Says how many files stay, and how many are there and are made of something else by now.
fn say_what_stays(stay: usize, changed: usize, all: usize) {
    if stay > 0 {
        let are = if all == 1 { "is" } else { "are" };
        say!("{stay} of {} {are} there already", counted(all, "file"));
    }
    if changed > 0 {
        let are = if changed == 1 { "is" } else { "are" };
        say!(
            "{} {are} rendered again: what they are made of has changed, or is not known",
            counted(changed, "file")
        );
    }
}

/// The table of the files that are ready, in the order in which they became so, and what they were made of.
struct Journal<'a> {
    path: PathBuf,
    table: fs::File,
    inputs: &'a Inputs,
    made_of: Option<fs::File>,
}

impl Journal<'_> {
    /// In one piece: a run that is stopped leaves whole lines.
    fn say(&mut self, line: &str) -> Result<(), Failure> {
        let written = self.table.write_all(format!("{line}\n").as_bytes());
        written.map_err(|source| Failure::Write { path: self.path.clone(), source })
    }

    /// A file has become ready.
    fn made(&mut self, job: &Job, line: &str) -> Result<(), Failure> {
        if let Some(made_of) = &mut self.made_of {
            self.inputs.add(made_of, job)?;
        }
        self.say(line)
    }
}

/// Renders the files of jobs that have no line, and gives them theirs.
fn render_left(jobs: &[Job], lines: &mut [Option<String>], journal: Journal<'_>) -> Result<(), Failure> {
    let mut left: Vec<_> = (0..jobs.len()).filter(|&at| lines[at].is_none()).collect();
    // Those of one bore one after another: only they play side by side.
    left.sort_by(|&one, &other| jobs[one].bore.cmp(&jobs[other].bore));
    let bar = bar(left.len(), "{bar:40} {pos} of {len}  {elapsed} (left: {eta})");
    let (journal, failed) = (Mutex::new(journal), Mutex::new(None));
    let made = side_by_side::each(
        left.len(),
        async |stand, at| {
            let job = &jobs[left[at]];
            let made = job.render.render_beside(stand, |_| ProgressBar::hidden()).await;
            let line = made.and_then(|made| {
                let line = finished(&job.line, &made);
                if let Ok(mut journal) = journal.lock() {
                    journal.made(job, &line)?;
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
    Ok(())
}

/// An empty table in place of an earlier one. What an earlier one links to is not touched.
fn new_table(path: &Path) -> io::Result<fs::File> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    fs::File::create_new(path)
}

/// Clap's own text without its "error: " and usage: with a list of what is missing, which stands on further lines.
fn in_one_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let lines: Vec<_> = text.lines().map(str::trim).take_while(|line| !line.is_empty()).collect();
    lines.join(" ").trim_start_matches("error: ").to_owned()
}

/// The whole line of a file.
fn finished(begin: &str, made: &Rendered) -> String {
    let db = |x: f32| if x > 0.0 { format!("{:.2}", 20.0 * x.log10()) } else { "-inf".to_owned() };
    let warnings: Vec<_> = made.doubts().map(Doubt::id).collect();
    let (peak, rms) = (db(made.level.peak), db(made.level.rms));
    format!("{begin},{:.4},{},{peak},{rms},{}", made.seconds, made.rate, warnings.join(BETWEEN_DOUBTS))
}

#[cfg(test)]
mod tests;
