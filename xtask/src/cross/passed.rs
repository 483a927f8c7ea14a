//! What has passed already, so that a comparison of hours goes on where it was stopped.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use sha2::{Digest, Sha256};

/// A list in a file: first the checksum of what was compared, then what has passed.
pub struct Passed {
    list: PathBuf,
    text: String,
}

impl Passed {
    /// What these files have passed before: a program and the hashes that are kept of it. Another program begins anew.
    pub fn before(list: PathBuf, files: &[&Path]) -> Result<Self> {
        let mut sum = Sha256::new();
        for file in files {
            sum.update(fs::read(file).with_context(|| format!("cannot read {}", file.display()))?);
        }
        let sum = hex(&sum.finalize());
        let kept = fs::read_to_string(&list).unwrap_or_default();
        let is_of_these = kept.lines().next() == Some(sum.as_str());
        Ok(Self { list, text: if is_of_these { kept } else { sum + "\n" } })
    }

    pub fn has(&self, what: &str) -> bool {
        self.text.lines().skip(1).any(|line| line == what)
    }

    pub fn add(&mut self, what: &str) -> Result<()> {
        self.text += &format!("{what}\n");
        fs::write(&self.list, &self.text).with_context(|| format!("cannot write {}", self.list.display()))
    }
}

pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_passed_is_known_until_the_program_changes() {
        let folder = std::env::temp_dir().join(format!("chalumeau-passed-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let program = folder.join("program");
        let before = || Passed::before(folder.join("list"), &[&program]).unwrap();
        fs::write(&program, "one").unwrap();
        before().add("part 1").unwrap();
        assert!(before().has("part 1") && !before().has("part 2"));
        fs::write(&program, "another").unwrap();
        assert!(!before().has("part 1"));
        fs::remove_dir_all(&folder).unwrap();
    }
}
