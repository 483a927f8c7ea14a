//! The directory in which programs on this machine tell each other about knobs.

use std::fs;
use std::io;
use std::path::PathBuf;

/// Environment variable that names another directory; for tests and unusual systems.
pub const VARIABLE: &str = "CHALUMEAU_RUNTIME_DIR";

/// The directory shared by all instances: `chalumeau` in the user's runtime directory, else in that for temporary files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RuntimeDir {
    root: PathBuf,
}

impl Default for RuntimeDir {
    fn default() -> Self {
        let chosen = std::env::var_os(VARIABLE).filter(|chosen| !chosen.is_empty()).map(PathBuf::from);
        let root = chosen.or_else(dirs::runtime_dir).unwrap_or_else(std::env::temp_dir);
        Self::within(root)
    }
}

impl RuntimeDir {
    /// `chalumeau` in `directory`.
    pub fn within(directory: impl Into<PathBuf>) -> Self {
        Self { root: directory.into().join("chalumeau") }
    }

    /// The directory in which simulated knobs are announced; created if missing.
    pub fn knobs(&self) -> io::Result<PathBuf> {
        self.made("knobs")
    }

    /// The directory of locks and owners; created if missing.
    pub fn locks(&self) -> io::Result<PathBuf> {
        self.made("locks")
    }

    fn made(&self, name: &str) -> io::Result<PathBuf> {
        let path = self.root.join(name);
        fs::create_dir_all(&path)?;
        Ok(path)
    }
}

/// A device's serial number as text, 16 hexadecimal digits, as in file names and on screens.
pub fn serial_text(serial: u64) -> String {
    format!("{serial:016x}")
}

/// The number in [`serial_text`], or in a USB serial number that is written in hexadecimal, as an ESP32's address is.
pub fn serial_number(text: &str) -> Option<u64> {
    let digits: String = text.chars().filter(|c| !matches!(c, ':' | '-')).collect();
    u64::from_str_radix(&digits, 16).ok().filter(|serial| *serial != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn serial_numbers_are_written_and_read_alike() {
        assert_eq!(serial_text(0xC1A2), "000000000000c1a2");
        assert_eq!(serial_number(&serial_text(u64::MAX)), Some(u64::MAX));
        assert_eq!(serial_number("7C:DF:A1:00:12:34"), Some(0x7CDF_A100_1234));
        for none in ["", "0001-xyz", "0"] {
            assert_eq!(serial_number(none), None, "{none:?}");
        }
    }
}
