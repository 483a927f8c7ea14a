//! The program's files are the same bytes on every system: 25 renderings and five tables. Two renderings are of a user's
//! instrument files, which the program fits and tunes first.
//!
//! `tests/golden/program_files.tsv` holds a SHA-256 prefix for each command line, in which `OUT` stands for the file. The
//! test runs them on this system, and `cargo xtask cross` runs the same on others. Lines are made by hand; their hashes are
//! written by `UPDATE_GOLDEN=1 cargo core --test program_files`.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use sha2::{Digest, Sha256};

#[path = "support/parallel.rs"]
mod parallel;

/// Hex digits kept of a hash: 64 bits.
const DIGITS: usize = 16;

fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().take(DIGITS / 2).fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").unwrap();
        text
    })
}

/// Runs one line and hashes its file.
fn file_of(line: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let words = line.split(' ').map(|word| if word == "OUT" { out.as_os_str() } else { word.as_ref() });
    let output = Command::new(env!("CARGO_BIN_EXE_chalumeau"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env("CHALUMEAU_CACHE_DIR", folder.path())
        .args(words)
        .output()
        .unwrap();
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    hash(&std::fs::read(&out).unwrap())
}

#[test]
fn every_file_has_the_same_bytes() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/program_files.tsv");
    let kept = std::fs::read_to_string(&path).unwrap();
    let lines: Vec<(&str, &str)> = kept.lines().filter_map(|line| line.split_once('\t')).collect();
    assert!(lines.len() > 20, "{} lines", lines.len());
    let made = parallel::each(&lines, |(_, line)| file_of(line));
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        let text: String =
            made.iter().zip(&lines).map(|(hash, (_, line))| format!("{hash}\t{line}\n")).collect();
        return std::fs::write(&path, text).unwrap();
    }
    let differing: Vec<&str> = made
        .iter()
        .zip(&lines)
        .filter(|(made, (kept, _))| made != kept)
        .map(|(_, (_, line))| *line)
        .collect();
    assert!(differing.is_empty(), "{} of {} files differ: {differing:#?}", differing.len(), lines.len());
}
