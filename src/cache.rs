//! Keeps prepared instruments between sessions, in a folder that may be deleted at any time.
//!
//! The name of an entry is a hash of everything its content depends on. So nothing ever has to be repaired: an entry that
//! is damaged, missing or from another version is made again. Entries appear whole or not at all, and two programs that
//! make the same one write the same bytes.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use chalumeau_core::instrument::store::{Key, Store};

use crate::output::{self, OutputError};

/// Environment variable that names a directory to use instead of the system's own; for tests and unusual systems.
pub const VARIABLE: &str = "CHALUMEAU_CACHE_DIR";
/// Number of entries kept; the least recently used are removed first. An entry is some 25 kB.
pub const ENTRIES_MOST: usize = 64;
/// File name extension of entries.
const SUFFIX: &str = "prepared";
/// A partly written file that a program has left behind is removed after this time.
const ABANDONED: Duration = Duration::from_secs(3_600);
/// Upper limit for the size of an entry, bytes; a larger file is not one.
const BYTES_MOST: u64 = 1 << 20;

/// The folder of prepared instruments: a [`Store`] on disk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cache {
    folder: PathBuf,
}

impl Cache {
    /// The folder `chalumeau` in the user's cache directory, or in the directory that [`VARIABLE`] names; `None` if there is
    /// neither.
    pub fn system() -> Option<Self> {
        let chosen = std::env::var_os(VARIABLE).filter(|chosen| !chosen.is_empty()).map(PathBuf::from);
        chosen.or_else(dirs::cache_dir).map(|root| Self::within(root.join("chalumeau")))
    }

    /// The cache as a store, if there is one.
    pub fn store(cache: Option<&Self>) -> Option<&dyn Store> {
        cache.map(|cache| cache as &dyn Store)
    }

    /// A cache in this folder, which is created when the first entry is kept.
    pub fn within(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// The folder of the entries.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Path of the entry of a key, whether it exists or not.
    pub fn path(&self, key: &Key) -> PathBuf {
        self.folder.join(format!("{key}.{SUFFIX}"))
    }

    /// Keeps a text under a key, and removes the least recently used entries.
    ///
    /// # Errors
    /// Those of the system, if the folder cannot be written.
    pub fn keep(&self, key: &Key, body: &str) -> Result<(), OutputError> {
        output::replace(&self.path(key), format!("{}\n{body}", heading(body)).as_bytes())?;
        self.prune();
        Ok(())
    }

    fn prune(&self) {
        let Ok(entries) = fs::read_dir(&self.folder) else { return };
        let dated = entries.filter_map(Result::ok).filter_map(|entry| {
            let path = entry.path();
            Some((entry.metadata().ok()?.modified().ok()?, path))
        });
        let ending = |path: &Path, ending: &str| path.extension().is_some_and(|is| is == ending);
        let (mut entries, others): (Vec<_>, Vec<_>) = dated.partition(|(_, path)| ending(path, SUFFIX));
        for (since, path) in others {
            if ending(&path, "part") && since.elapsed().is_ok_and(|age| age > ABANDONED) {
                let _ = fs::remove_file(path);
            }
        }
        let spare = entries.len().saturating_sub(ENTRIES_MOST);
        entries.sort();
        for (_, path) in entries.into_iter().take(spare) {
            // Another program may have removed it already.
            let _ = fs::remove_file(path);
        }
    }
}

impl Store for Cache {
    /// The text kept under a key, if it is whole.
    fn get(&self, key: &Key) -> Option<String> {
        let path = self.path(key);
        if fs::metadata(&path).ok()?.len() > BYTES_MOST {
            return None;
        }
        let text = fs::read_to_string(&path).ok()?;
        let (head, body) = text.split_once('\n')?;
        (head == heading(body)).then(|| {
            // Marks the entry as used. If the file cannot be written, the entry only counts as older than it is.
            let _ = fs::File::options()
                .write(true)
                .open(&path)
                .and_then(|file| file.set_modified(SystemTime::now()));
            body.to_owned()
        })
    }

    /// Keeps a text under a key, see [`keep`](Cache::keep). Reports nothing if the cache cannot be written: the program works
    /// without it.
    fn put(&self, key: &Key, body: &str) {
        let _ = self.keep(key, body);
    }
}

/// First line of an entry: tells a reader what the file is, and the program whether the rest is whole.
fn heading(body: &str) -> String {
    format!("# Chalumeau: a prepared instrument; may be deleted. sha256 {}", Key::of(body.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cache() -> (tempfile::TempDir, Cache) {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::within(folder.path().join("not/there/yet"));
        (folder, cache)
    }

    #[test]
    fn what_was_kept_comes_back() {
        let (_folder, cache) = cache();
        let (key, other) = (Key::of(b"one"), Key::of(b"two"));
        assert_eq!(cache.get(&key), None);
        cache.put(&key, "text\nand more\n");
        assert_eq!(cache.get(&key).as_deref(), Some("text\nand more\n"));
        assert_eq!(cache.get(&other), None);
        cache.put(&key, "new");
        assert_eq!(cache.get(&key).as_deref(), Some("new"));
    }

    #[test]
    fn damaged_entries_are_none_and_can_be_written_again() {
        let (_folder, cache) = cache();
        let key = Key::of(b"one");
        cache.put(&key, "a text of some length");
        let whole = fs::read(cache.path(&key)).unwrap();
        let mut flipped = whole.clone();
        *flipped.last_mut().unwrap() ^= 1;
        let huge = vec![b'x'; 2 << 20];
        for damaged in [&whole[..whole.len() - 1], &flipped, b"", b"\n", &[0xff, 0xfe, b'\n'], &huge] {
            fs::write(cache.path(&key), damaged).unwrap();
            assert_eq!(cache.get(&key), None);
        }
        cache.put(&key, "again");
        assert_eq!(cache.get(&key).as_deref(), Some("again"));
    }

    #[test]
    fn a_cache_that_cannot_be_written_is_none() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "in the way").unwrap();
        let cache = Cache::within(&file);
        cache.put(&Key::of(b"one"), "text");
        assert!(cache.keep(&Key::of(b"one"), "text").unwrap_err().to_string().contains("file"));
        assert_eq!(cache.get(&Key::of(b"one")), None);
        assert_eq!(fs::read(&file).unwrap(), b"in the way");
    }

    #[test]
    fn the_least_used_entries_go() {
        let (_folder, cache) = cache();
        let keys: Vec<Key> = (0..ENTRIES_MOST as u32 + 3).map(|n| Key::of(&n.to_le_bytes())).collect();
        let begun = SystemTime::now() - Duration::from_secs(10_000);
        for (age, key) in keys.iter().enumerate().take(ENTRIES_MOST) {
            cache.put(key, "text");
            let file = fs::File::options().write(true).open(cache.path(key)).unwrap();
            file.set_modified(begun + Duration::from_secs(age as u64)).unwrap();
        }
        // The oldest is used: now the next three are the oldest.
        assert!(cache.get(&keys[0]).is_some());
        fs::write(cache.folder().join("mine.txt"), "not an entry").unwrap();
        for (name, age) in [("old.part", 7_200), ("new.part", 0)] {
            fs::write(cache.folder().join(name), "half").unwrap();
            let file = fs::File::options().write(true).open(cache.folder().join(name)).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(age)).unwrap();
        }
        keys[ENTRIES_MOST..].iter().for_each(|key| cache.put(key, "text"));
        let there: Vec<bool> = keys.iter().map(|key| cache.path(key).exists()).collect();
        assert_eq!(there.iter().filter(|&&there| there).count(), ENTRIES_MOST);
        assert_eq!(there[..5], [true, false, false, false, true]);
        let left = ["mine.txt", "new.part", "old.part"].map(|name| cache.folder().join(name).exists());
        assert_eq!(left, [true, true, false]);
    }

    #[test]
    fn writers_at_once_leave_one_whole_entry() {
        let (_folder, cache) = cache();
        let (key, body) = (Key::of(b"one"), "text\n".repeat(10_000));
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..20 {
                        cache.put(&key, &body);
                        assert_eq!(cache.get(&key).as_deref(), Some(&*body));
                    }
                });
            }
        });
        assert_eq!(fs::read_dir(cache.folder()).unwrap().count(), 1);
    }
}
