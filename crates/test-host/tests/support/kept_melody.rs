//! The example melody as the repository keeps it: a hash of its samples at 48 kHz, the same on every system.

use chalumeau_test_host::machine;
use serde_json::Value;
use sha2::{Digest, Sha256};

/// Fails unless these channels begin with the melody's samples to the bit. `cargo test -p chalumeau-web --test scores` has made
/// the hash from what `Clarinet` plays.
pub fn assert_is_kept(left: &[f32], right: &[f32]) {
    let file = std::fs::read_to_string(machine::root().join("web/tests/scores.json")).unwrap();
    let scores: Vec<Value> = serde_json::from_str(&file).unwrap();
    let melody = scores.iter().find(|score| score["name"] == "melody").unwrap();
    let samples = melody["samples"].as_u64().unwrap() as usize;
    let mut hasher = Sha256::new();
    for (left, right) in left[..samples].iter().zip(&right[..samples]) {
        hasher.update(left.to_le_bytes());
        hasher.update(right.to_le_bytes());
    }
    let hash: String = hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(melody["hash"], hash, "the melody has other samples than on Linux, x86-64");
}
