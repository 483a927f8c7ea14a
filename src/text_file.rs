//! Reads text files that people write.

use std::fs;
use std::io::{self, Error, ErrorKind};
use std::path::Path;

/// The text of a file.
///
/// # Errors
/// Those of the system. A file that is not UTF-8 says what to do about it.
pub fn read(path: impl AsRef<Path>) -> io::Result<String> {
    fs::read_to_string(path).map_err(|error| match error.kind() {
        ErrorKind::InvalidData => {
            Error::new(ErrorKind::InvalidData, "it is not in UTF-8; save it as UTF-8 text in your editor")
        }
        _ => error,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_encodings_are_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("latin1.toml");
        fs::write(&path, b"name = \"Fl\xf6te\"").unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("save it as UTF-8"));
        fs::write(&path, "name = \"Fl\u{f6}te\"").unwrap();
        assert_eq!(read(&path).unwrap(), "name = \"Fl\u{f6}te\"");
        assert_eq!(read(folder.path().join("none")).unwrap_err().kind(), ErrorKind::NotFound);
    }
}
