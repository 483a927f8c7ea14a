//! Loads instrument files from paths.

use std::path::{Path, PathBuf};

use chalumeau_core::bore::instrument_file::{InstrumentError, InstrumentFile};

/// Why an instrument cannot be loaded.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file could not be read.
    #[error("cannot read {}: {error}", path.display())]
    Read {
        /// The requested path.
        path: PathBuf,
        /// The system's error.
        error: std::io::Error,
    },
    /// The file is not an instrument.
    #[error(transparent)]
    Instrument(#[from] InstrumentError),
}

/// Reads and checks an instrument file, see [`InstrumentFile::parse`].
pub fn load(path: impl AsRef<Path>) -> Result<InstrumentFile, LoadError> {
    let path = path.as_ref();
    let text =
        crate::text_file::read(path).map_err(|error| LoadError::Read { path: path.to_path_buf(), error })?;
    Ok(InstrumentFile::parse(&text)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_file_is_named() {
        assert!(load("no/such/file").unwrap_err().to_string().contains("no/such/file"));
    }
}
