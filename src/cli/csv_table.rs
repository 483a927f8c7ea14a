//! CSV tables, to standard output or a new file.

use crate::cli::Failure;
use crate::cli::files::{self, MaybeFile};
use crate::cli::plot_args::Plot;
use crate::output::NewFile;
use clap::Args;
use std::borrow::Cow;
use std::fmt;
use std::io;
use std::io::{BufWriter, StdoutLock, Write};
use std::path::{Path, PathBuf};

/// What files of other endings are.
const OTHERS: [(&str, &str); 11] = [
    ("png", "a picture"),
    ("jpg", "a picture"),
    ("pdf", "a document"),
    ("svg", "a picture"),
    ("gif", "a picture"),
    ("wav", "a sound"),
    ("mid", "a MIDI file"),
    ("midi", "a MIDI file"),
    ("toml", "an instrument or a plan"),
    ("json", "the data of a figure"),
    ("html", "a page"),
];

/// Where a table goes.
#[derive(Args)]
pub struct TableArgs {
    /// Where to write the table; - is standard output [default: -, unless a figure is drawn instead]
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Replace an existing file
    #[arg(long)]
    force: bool,
}

impl TableArgs {
    /// Whether the table goes to a file.
    pub fn to_file(&self) -> bool {
        self.csv.as_ref().is_some_and(|path| path != Path::new("-"))
    }

    /// Where it goes, for [`files`].
    pub fn path(&self) -> MaybeFile<'_> {
        self.csv.as_deref()
    }

    /// Refuses names of the table and of other results that cannot be meant, before anything is measured. `read` is what the
    /// command reads.
    pub fn check_files(&self, read: &[MaybeFile], others: &[MaybeFile]) -> Result<(), Failure> {
        files::check(files::READ, read, &[&[self.path()], others].concat(), self.force)?;
        self.check_name()
    }

    /// Refuses a name by which the table would be taken for something else.
    fn check_name(&self) -> Result<(), Failure> {
        let Some(path) = &self.csv else { return Ok(()) };
        let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
        match OTHERS.iter().find(|(other, _)| ending == *other) {
            Some((_, what)) => Err(Failure::Usage(format!(
                "--csv {}: a file of this name would be {what}; a table is called .csv or .txt",
                path.display()
            ))),
            None => Ok(()),
        }
    }

    /// Whether existing files may be replaced.
    pub fn force(&self) -> bool {
        self.force
    }

    pub fn open(&self, header: &str) -> Result<CsvTable, Failure> {
        self.check_name()?;
        CsvTable::open(self.csv.as_deref().unwrap_or(Path::new("-")), self.force, header)
    }

    /// The table beside a figure, which is all that is wanted where the figure alone has a file.
    pub fn open_beside(&self, plot: &Plot, header: &str) -> Result<CsvTable, Failure> {
        let only_figure = plot.wanted() && self.csv.is_none();
        if only_figure { Ok(CsvTable { sink: Sink::Nobody }) } else { self.open(header) }
    }
}

enum Sink {
    Stdout(BufWriter<StdoutLock<'static>>),
    File(NewFile),
    /// Nobody wants it, or its reader has seen enough. The other results of the command are still wanted.
    Nobody,
}

/// A table being written. A file appears with [`finish`](CsvTable::finish).
pub struct CsvTable {
    sink: Sink,
}

impl CsvTable {
    /// Opens `path` (`-`: standard output) and writes the column names.
    pub fn open(path: &Path, force: bool, header: &str) -> Result<Self, Failure> {
        let sink = if path == Path::new("-") {
            Sink::Stdout(BufWriter::new(io::stdout().lock()))
        } else {
            Sink::File(NewFile::create(path, force)?)
        };
        let mut table = Self { sink };
        table.line(format_args!("{header}"))?;
        Ok(table)
    }

    /// A comment line for a human reader; line breaks become spaces.
    pub fn comment(&mut self, text: fmt::Arguments) -> Result<(), Failure> {
        self.line(format_args!("# {}", text.to_string().replace(['\n', '\r'], " ")))
    }

    /// One line of data.
    pub fn line(&mut self, text: fmt::Arguments) -> Result<(), Failure> {
        match &mut self.sink {
            Sink::Stdout(out) => match writeln!(out, "{text}") {
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => self.sink = Sink::Nobody,
                written => written?,
            },
            Sink::File(file) => writeln!(file, "{text}")?,
            Sink::Nobody => {}
        }
        Ok(())
    }

    /// Writes the rest; a file gets its name.
    pub fn finish(self) -> Result<(), Failure> {
        match self.sink {
            Sink::Stdout(mut out) => match out.flush() {
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
                written => Ok(written?),
            },
            Sink::File(file) => Ok(file.keep()?),
            Sink::Nobody => Ok(()),
        }
    }
}

/// A field of a table, quoted where its text needs that: also where a reader that knows remarks would take # for the beginning of one.
pub fn quoted(text: &str) -> Cow<'_, str> {
    if text.contains([',', '"', '\n', '\r', '#']) {
        Cow::Owned(format!("\"{}\"", text.replace('"', "\"\"")))
    } else {
        Cow::Borrowed(text)
    }
}

/// A number with so many decimals, or nan.
pub fn number(x: f64, decimals: usize) -> String {
    if !x.is_finite() {
        return "nan".to_owned();
    }
    let text = format!("{x:.decimals$}");
    // What rounds to 0 has no sign.
    match text.strip_prefix('-') {
        Some(bare) if bare.bytes().all(|byte| matches!(byte, b'0' | b'.')) => bare.to_owned(),
        _ => text,
    }
}

/// The name of a note as a field of a table: C#4 is quoted.
pub fn named(note: impl fmt::Display) -> String {
    quoted(&note.to_string()).into_owned()
}
