//! Writes takes as files, which appear in their folder when they end.

use std::io;
use std::path::Path;
use std::time::SystemTime;

use chalumeau_knob::device::serial_text;
use chalumeau_knob::touch::take::{TakeMarks, TakeRow};
use chalumeau_knob::touch::take_csv::TakeWriter;
use chalumeau_knob::wire::Info;
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

use crate::output::{KeptLines, NewFile, OutputError};

/// A take that is being written. [`keep`](Self::keep) makes the complete file appear.
pub struct TakeFile {
    writer: TakeWriter<NewFile>,
    /// Lines above the rows: remarks, and the names of the columns.
    head: usize,
}

impl TakeFile {
    /// Begins `file` with remarks, one per line, the time of day, and the names of the columns.
    pub fn begin(file: NewFile, mut remarks: Vec<String>) -> Result<Self, OutputError> {
        let path = file.path().to_owned();
        remarks.extend(time_of_day(SystemTime::now()).map(|now| format!("begun {now}")));
        match TakeWriter::new(file, &remarks) {
            Ok(writer) => Ok(Self { writer, head: remarks.len() + 1 }),
            Err(source) => Err(OutputError::Write { path, source }),
        }
    }

    /// Adds a row.
    pub fn write(&mut self, moment: &TakeRow, marks: &TakeMarks) -> io::Result<()> {
        self.writer.write(moment, marks)
    }

    /// The path that the file will have.
    pub fn path(&self) -> &Path {
        self.writer.get_ref().path()
    }

    /// Gives the file its name.
    pub fn keep(self) -> Result<(), OutputError> {
        self.writer.into_inner().keep()
    }

    /// Gives the file a name, even if not all rows could be written, but only if there are any.
    pub fn keep_rows(self) -> Result<KeptLines, OutputError> {
        self.writer.into_inner().keep_lines(self.head)
    }
}

/// What a knob says of itself, for the remarks of a take.
pub fn knob_in_words(info: &Info) -> String {
    let (major, minor, patch) = info.firmware;
    let (name, serial) = (info.name_text(), serial_text(info.serial));
    format!("{name}, serial number {serial}, firmware {major}.{minor}.{patch}")
}

/// Universal time to the millisecond, so that a take can be laid beside a video; `None` for a clock beyond all years.
fn time_of_day(now: SystemTime) -> Option<String> {
    let now = OffsetDateTime::from(now);
    now.replace_millisecond(now.millisecond()).ok()?.format(&Rfc3339).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_take_appears_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("take.csv");
        let file = NewFile::create(&path, false).unwrap();
        let mut take = TakeFile::begin(file, vec!["participant 7".to_owned()]).unwrap();
        assert_eq!(take.path().file_name(), path.file_name());
        take.write(&TakeRow::default(), &TakeMarks::default()).unwrap();
        assert!(!path.exists(), "no half-written file");
        take.keep().unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text.lines().count(), 4);
        assert!(text.lines().nth(1).unwrap().starts_with("# begun 2"), "{text}");
    }

    #[test]
    fn a_take_begins_at_a_time_of_day() {
        let at = SystemTime::UNIX_EPOCH + std::time::Duration::from_micros(1_796_061_012_345_678);
        assert_eq!(time_of_day(at).as_deref(), Some("2026-11-30T17:50:12.345Z"));
    }
}
