//! The files of one command: what it reads is never replaced, and no two results go to one file.

use crate::cli::Failure;
use crate::output::{NewFile, resolved};
use std::path::{Path, PathBuf};

/// A file that a command may have.
pub type MaybeFile<'a> = Option<&'a Path>;

/// What a command that measures does with the files it is given, for the message.
pub const READ: &str = "is read by this command";

/// Refuses to write a file that is being read, and two results in one file: `--force` replaces results, not what they are made
/// of. `-` is standard output. `is_read` says what is done with a file that is read.
pub fn keep_apart(is_read: &str, read: &[MaybeFile], written: &[MaybeFile]) -> Result<(), Failure> {
    let inputs: Vec<PathBuf> = read.iter().flatten().filter_map(|path| resolved(path)).collect();
    let mut outputs = Vec::new();
    for path in results(written) {
        let Some(to) = resolved(path) else { continue };
        let path = path.display();
        if inputs.contains(&to) {
            return Err(Failure::Usage(format!("{path} {is_read}; give another name for what is written")));
        }
        if outputs.contains(&to) {
            return Err(Failure::Usage(format!(
                "two results of this command would go to {path}; give them different names"
            )));
        }
        outputs.push(to);
    }
    Ok(())
}

/// The same, and refuses at once what could not be written at the end.
pub fn check(is_read: &str, read: &[MaybeFile], written: &[MaybeFile], force: bool) -> Result<(), Failure> {
    keep_apart(is_read, read, written)?;
    Ok(results(written).try_for_each(|path| NewFile::check(path, force).map(drop))?)
}

/// Those that are files.
fn results<'a>(written: &[MaybeFile<'a>]) -> impl Iterator<Item = &'a Path> {
    written.iter().copied().flatten().filter(|path| *path != Path::new("-"))
}
