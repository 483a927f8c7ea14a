//! Writes takes as files. A take appears in its folder complete or not at all.

use std::io;
use std::path::Path;

use chalumeau_knob::touch::take::{TakeMarks, TakeRow};
use chalumeau_knob::touch::take_csv::TakeWriter;

use crate::output::{NewFile, OutputError};

/// A take that is being written. [`keep`](Self::keep) makes the complete file appear.
pub struct TakeFile {
    writer: TakeWriter<NewFile>,
}

impl TakeFile {
    /// Begins `file` with remarks, one per line, and the names of the columns.
    pub fn begin(file: NewFile, remarks: &[String]) -> Result<Self, OutputError> {
        let path = file.path().to_owned();
        match TakeWriter::new(file, remarks) {
            Ok(writer) => Ok(Self { writer }),
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_take_appears_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("take.csv");
        let file = NewFile::create(&path, false).unwrap();
        let mut take = TakeFile::begin(file, &["participant 7".to_owned()]).unwrap();
        assert_eq!(take.path().file_name(), path.file_name());
        take.write(&TakeRow::default(), &TakeMarks::default()).unwrap();
        assert!(!path.exists(), "no half-written file");
        take.keep().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap().lines().count(), 3);
    }
}
