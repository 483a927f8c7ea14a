//! A place that keeps prepared instruments between sessions: a trait, so that this crate opens no file.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use sha2::{Digest, Sha256};

/// The hash of everything a prepared instrument depends on. Equal keys mean equal instruments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Key([u8; 32]);

impl Key {
    /// The SHA-256 of a description.
    pub fn of(description: &[u8]) -> Self {
        Self(Sha256::digest(description).into())
    }
}

impl std::fmt::Display for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// Keeps texts under keys. A store may forget any text at any time, but it returns a text whole or not at all.
pub trait Store {
    /// The text kept under `key`, if there is one.
    fn get(&self, key: &Key) -> Option<String>;

    /// Keeps `text` under `key`. A store that cannot keep it reports nothing: the text is made again when it is needed.
    fn put(&self, key: &Key, text: &str);
}

/// A store that lasts as long as the program.
#[derive(Debug, Default)]
pub struct MemoryStore {
    texts: Mutex<HashMap<Key, String>>,
}

impl Store for MemoryStore {
    fn get(&self, key: &Key) -> Option<String> {
        self.texts.lock().unwrap_or_else(PoisonError::into_inner).get(key).cloned()
    }

    fn put(&self, key: &Key, text: &str) {
        self.texts.lock().unwrap_or_else(PoisonError::into_inner).insert(*key, text.to_owned());
    }
}
