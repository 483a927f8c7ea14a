//! New files that appear complete or not at all.
//!
//! The data goes to a temporary file beside the target, which gets its name only at the end. If it is dropped before,
//! nothing remains. An existing file stays, unless the caller asks to replace it.

use std::fs;
use std::io;
use std::io::{BufRead, BufReader, BufWriter, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::{NamedTempFile, PersistError};

/// Temporary files of this process.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Why a file cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The file exists, and the caller did not ask to replace it.
    #[error("{} exists already; choose another name or add --force to replace it", .0.display())]
    Exists(PathBuf),
    /// The path names a directory or a device.
    #[error("{} is not a regular file; give the name of a file to write", .0.display())]
    NotAFile(PathBuf),
    /// The file exists, and nobody may write to it.
    #[error("{} is write-protected; choose another name, or allow writing to it", .0.display())]
    Protected(PathBuf),
    /// The directory does not exist.
    #[error("directory {} does not exist; create it or choose another place", .0.display())]
    NoDirectory(PathBuf),
    /// The system reports an error.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The target.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
}

/// A file that is being written.
pub struct NewFile {
    path: PathBuf,
    force: bool,
    temp: BufWriter<NamedTempFile>,
    /// Dropped last: until then, the temporary file may be there.
    _listed: Listed,
}

/// Where a new file will be.
pub struct Target {
    path: PathBuf,
    directory: PathBuf,
    /// Those of the file that is replaced.
    permissions: Option<fs::Permissions>,
}

/// The directory of a file.
fn directory_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// The one path of a file that is there or may be made, whatever it was called; `None` where nothing can be made.
pub fn resolved(path: &Path) -> Option<PathBuf> {
    fs::canonicalize(path)
        .ok()
        .or_else(|| Some(fs::canonicalize(directory_of(path)).ok()?.join(path.file_name()?)))
}

/// One of the [`UNFINISHED`] files.
struct Listed(PathBuf);

impl Listed {
    fn new(path: &Path) -> Self {
        UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).push(path.to_owned());
        Self(path.to_owned())
    }
}

impl Drop for Listed {
    fn drop(&mut self) {
        UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).retain(|path| *path != self.0);
    }
}

/// Removes the temporary files of all [`NewFile`]s, then ends the process with this exit code. For a process that is told
/// to stop: nobody is left then who could drop them.
pub fn remove_unfinished_and_exit(code: i32) -> ! {
    // Nobody begins another file until the end.
    let unfinished = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
    for path in unfinished.iter() {
        // It may have its name already, or be gone.
        let _ = fs::remove_file(path);
    }
    std::process::exit(code)
}

impl NewFile {
    /// Opens a temporary file beside `path`. Checks at once what would fail at the end. `force` replaces an existing file, whose
    /// permissions stay.
    pub fn create(path: &Path, force: bool) -> Result<Self, OutputError> {
        let Target { path, directory, permissions } = Self::check(path, force)?;
        let mut prefix = path.file_name().unwrap_or_default().to_owned();
        prefix.push(".");
        let mut builder = tempfile::Builder::new();
        builder.prefix(&prefix).suffix(".part");
        // The permissions of any new file, which the user's mask limits, instead of the private ones of a temporary file.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        if let Some(permissions) = &permissions {
            builder.permissions(permissions.clone());
        }
        let opened = builder.tempfile_in(directory).and_then(|temp| match permissions {
            // Also what the mask took away.
            Some(permissions) => temp.as_file().set_permissions(permissions).map(|()| temp),
            None => Ok(temp),
        });
        match opened {
            Ok(temp) => {
                let listed = Listed::new(temp.path());
                Ok(Self { temp: BufWriter::new(temp), path, force, _listed: listed })
            }
            // The message of `tempfile` has the temporary name, which does not help the user.
            Err(error) => Err(OutputError::Write { source: plain(error), path }),
        }
    }

    /// Checks what [`create`](Self::create) checks, and opens nothing.
    pub fn check(path: &Path, force: bool) -> Result<Target, OutputError> {
        // A name that ends in a slash is one of a directory, also if there is none.
        if path.as_os_str().as_encoded_bytes().last().is_some_and(|&end| std::path::is_separator(end.into()))
        {
            return Err(OutputError::NotAFile(path.to_owned()));
        }
        // Follow a link, so that its target is replaced and not the link.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let permissions = match fs::metadata(&path) {
            Ok(there) if !there.is_file() => return Err(OutputError::NotAFile(path)),
            Ok(_) if !force => return Err(OutputError::Exists(path)),
            Ok(there) if there.permissions().readonly() => return Err(OutputError::Protected(path)),
            Ok(there) => Some(there.permissions()),
            // A link to nowhere.
            Err(_) if !force && path.is_symlink() => return Err(OutputError::Exists(path)),
            Err(_) => None,
        };
        if path.file_name().is_none() {
            return Err(OutputError::NotAFile(path));
        }
        let directory = directory_of(&path);
        if !directory.exists() {
            return Err(OutputError::NoDirectory(directory.to_owned()));
        }
        Ok(Target { directory: directory.to_owned(), path, permissions })
    }

    /// The path that the file will have.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the file its name.
    pub fn keep(self) -> Result<(), OutputError> {
        let Self { path, force, temp, _listed } = self;
        let written = temp.into_inner().map_err(io::IntoInnerError::into_error);
        let kept = written.and_then(|temp| {
            let persisted = if force { temp.persist(&path) } else { temp.persist_noclobber(&path) };
            persisted.map_err(|e| e.error)
        });
        match kept {
            Ok(_) => Ok(()),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Err(OutputError::Exists(path)),
            Err(source) => Err(OutputError::Write { path, source: plain(source) }),
        }
    }

    /// Gives a file of lines its name, even if not all of it could be written: it ends with its last whole line. If another file
    /// has the name by now, its name gets a number. A file with no more than `head` lines is not kept.
    pub fn keep_lines(self, head: usize) -> Result<KeptLines, OutputError> {
        let Self { path, mut temp, _listed, .. } = self;
        let cut = io::Write::flush(&mut temp).err().map(plain);
        // What is still in the buffer finds no room.
        let (mut temp, _) = temp.into_parts();
        let refused = |source| OutputError::Write { path: path.clone(), source: plain(source) };
        // A line may have begun before there was no room.
        end_with_a_line(temp.as_file_mut()).map_err(refused)?;
        if !has_more_lines(temp.as_file_mut(), head).map_err(refused)? {
            return Err(refused(cut.unwrap_or_else(|| io::ErrorKind::WriteZero.into())));
        }
        loop {
            let path = free_path(&path);
            match temp.persist_noclobber(&path) {
                Ok(_) => return Ok(KeptLines { path, cut }),
                Err(PersistError { error, file }) if error.kind() == io::ErrorKind::AlreadyExists => {
                    temp = file
                }
                Err(PersistError { error, .. }) => return Err(refused(error)),
            }
        }
    }
}

/// A file of lines that has its name.
#[derive(Debug)]
pub struct KeptLines {
    /// The name.
    pub path: PathBuf,
    /// Why the last lines are missing, if they are.
    pub cut: Option<io::Error>,
}

/// A path that no file has: this one or, if it is taken, the same with a number before its extension.
pub fn free_path(path: &Path) -> PathBuf {
    let (mut free, mut number) = (path.to_owned(), 0);
    while free.exists() {
        number += 1;
        let mut name = path.file_stem().unwrap_or_default().to_owned();
        name.push(format!("-{number}"));
        if let Some(extension) = path.extension() {
            name.push(".");
            name.push(extension);
        }
        free.set_file_name(name);
    }
    free
}

/// Removes what follows the last line's end.
fn end_with_a_line(file: &mut fs::File) -> io::Result<()> {
    const STEP: u64 = 4_096;
    let mut end = file.seek(SeekFrom::End(0))?;
    while end > 0 {
        let begin = end.saturating_sub(STEP);
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(begin))?;
        Read::take(&mut *file, end - begin).read_to_end(&mut bytes)?;
        if let Some(last) = bytes.iter().rposition(|&byte| byte == b'\n') {
            return file.set_len(begin + last as u64 + 1);
        }
        end = begin;
    }
    file.set_len(0)
}

/// Whether a file has more than so many lines.
fn has_more_lines(file: &mut fs::File, lines: usize) -> io::Result<bool> {
    file.seek(SeekFrom::Start(0))?;
    let more = BufReader::new(file).split(b'\n').nth(lines).transpose()?;
    Ok(more.is_some())
}

/// Writes a small file of the program's own, in place of what was there. Its folder is made.
pub fn replace(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    let refused = |path: &Path| {
        let path = path.to_owned();
        move |source| OutputError::Write { path, source }
    };
    let folder = directory_of(path);
    fs::create_dir_all(folder).map_err(refused(folder))?;
    let mut file = NewFile::create(path, true)?;
    io::Write::write_all(&mut file, bytes).map_err(refused(path))?;
    file.keep()
}

/// The system's error, without the text that a library has added.
fn plain(error: io::Error) -> io::Error {
    match error.raw_os_error() {
        Some(code) => io::Error::from_raw_os_error(code),
        None => io::Error::from(error.kind()),
    }
}

impl io::Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.temp.write(bytes).map_err(plain)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.temp.flush().map_err(plain)
    }
}

impl io::Seek for NewFile {
    fn seek(&mut self, to: io::SeekFrom) -> io::Result<u64> {
        self.temp.seek(to).map_err(plain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn names(directory: &Path) -> Vec<String> {
        fs::read_dir(directory).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_dropped_file_leaves_nothing() {
        let directory = tempfile::tempdir().unwrap();
        let mut file = NewFile::create(&directory.path().join("x"), false).unwrap();
        file.write_all(b"half").unwrap();
        drop(file);
        assert!(names(directory.path()).is_empty());
    }

    #[test]
    fn an_existing_file_stays_unless_replaced() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("x");
        let early = NewFile::create(&path, false).unwrap();
        fs::write(&path, "old").unwrap();
        assert!(matches!(NewFile::create(&path, false), Err(OutputError::Exists(_))));
        assert!(matches!(early.keep(), Err(OutputError::Exists(_))), "not even when it came later");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        let mut file = NewFile::create(&path, true).unwrap();
        file.write_all(b"new").unwrap();
        file.keep().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(directory.path()), ["x"]);
    }

    #[test]
    fn lines_are_kept_as_far_as_they_go_beside_other_files() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("x.csv");
        // All of them begin before the first one is kept.
        let files = [(); 3].map(|()| NewFile::create(&free_path(&path), false).unwrap());
        for (mut file, name) in files.into_iter().zip(["x.csv", "x-1.csv", "x-2.csv"]) {
            writeln!(file, "one line").unwrap();
            let kept = file.keep_lines(0).unwrap();
            assert!(kept.cut.is_none());
            assert_eq!(kept.path.file_name().unwrap(), name);
            assert_eq!(fs::read(&kept.path).unwrap(), b"one line\n");
        }
        for (written, kept) in [("a\nbc", "a\n"), ("a\n", "a\n"), ("abc", ""), ("", "")] {
            fs::write(&path, written).unwrap();
            let mut file = fs::File::options().read(true).write(true).open(&path).unwrap();
            end_with_a_line(&mut file).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), kept);
        }
        let long = "x".repeat(9_000);
        fs::write(&path, format!("a\n{long}")).unwrap();
        end_with_a_line(&mut fs::File::options().read(true).write(true).open(&path).unwrap()).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "a\n");
    }

    /// A disk without room, as the system has it.
    #[cfg(target_os = "linux")]
    #[test]
    fn what_a_full_disk_has_taken_stays() {
        let directory = tempfile::tempdir().unwrap();
        let mut file = NewFile::create(&directory.path().join("x.csv"), false).unwrap();
        writeln!(file, "written").unwrap();
        file.flush().unwrap();
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let temp = file.temp.get_mut();
        let written = std::mem::replace(temp.as_file_mut(), full);
        write!(file, "late\nhal").unwrap();
        assert!(file.flush().is_err());
        *file.temp.get_mut().as_file_mut() = written;
        let KeptLines { path, cut } = file.keep_lines(1).unwrap();
        assert!(cut.is_none(), "there is room again");
        assert_eq!(fs::read_to_string(path).unwrap(), "written\nlate\n");
    }

    #[test]
    fn lines_end_whole_and_a_file_without_rows_is_not_kept() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("x.csv");
        for (head, kept) in [(1, vec!["x.csv"]), (2, vec![])] {
            let mut file = NewFile::create(&path, false).unwrap();
            write!(file, "head\nrow\nhal").unwrap();
            assert_eq!(file.keep_lines(head).is_ok(), !kept.is_empty());
            assert_eq!(names(directory.path()), kept);
            if head == 1 {
                assert_eq!(fs::read_to_string(&path).unwrap(), "head\nrow\n");
                fs::remove_file(&path).unwrap();
            }
        }
    }

    #[test]
    fn no_device_or_directory_is_replaced() {
        let directory = tempfile::tempdir().unwrap();
        assert!(matches!(NewFile::create(directory.path(), true), Err(OutputError::NotAFile(_))));
        let missing = directory.path().join("no/x");
        assert!(matches!(NewFile::create(&missing, true), Err(OutputError::NoDirectory(_))));
        let unmade = directory.path().join("unmade/");
        assert!(matches!(NewFile::create(&unmade, true), Err(OutputError::NotAFile(_))));
    }

    #[cfg(unix)]
    #[test]
    fn a_replaced_file_keeps_its_permissions_and_a_protected_one_stays() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("x");
        fs::write(&path, "old").unwrap();
        for mode in [0o600, 0o664] {
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
            NewFile::create(&path, true).unwrap().keep().unwrap();
            assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, mode);
        }
        fs::set_permissions(&path, fs::Permissions::from_mode(0o444)).unwrap();
        assert!(matches!(NewFile::create(&path, true), Err(OutputError::Protected(_))));
        let link = directory.path().join("link");
        std::os::unix::fs::symlink(directory.path().join("nowhere"), &link).unwrap();
        assert!(matches!(NewFile::create(&link, false), Err(OutputError::Exists(_))));
    }
}
