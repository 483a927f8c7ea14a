//! An instrument that the page prepares has the numbers that the native code gives it, to the last bit: one from a user's file,
//! and the B flat clarinet with a hole moved and fitted.
//!
//! `web/tests/own_instrument.json` holds the questions and the hashes of the answers; `module.mjs` asks the WebAssembly module. A
//! change that is meant is written by `UPDATE_GOLDEN=1 cargo test -p chalumeau-web --features workshop --test own_instrument`.
#![cfg(feature = "workshop")]

use chalumeau_web::workshop::answer;
use serde_json::Value;
use sha2::{Digest, Sha256};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/own_instrument.json");
const INSTRUMENTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/instruments/");

/// Hash of the prepared instrument. A question that names a file of the examples gets its text.
fn prepared(mut question: Value) -> String {
    if let Some(name) = question["open"].as_str() {
        question["text"] = std::fs::read_to_string(format!("{INSTRUMENTS}{name}")).unwrap().into();
    }
    let told: Value = serde_json::from_slice(&answer(question.to_string().as_bytes())).unwrap();
    assert_eq!(told["failed"], Value::Null);
    let prepared = told["prepared"].as_str().unwrap();
    Sha256::digest(prepared).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
fn a_prepared_instrument_has_the_same_bits_everywhere() {
    let mut cases: Vec<Value> = serde_json::from_str(&std::fs::read_to_string(FILE).unwrap()).unwrap();
    assert!(cases.len() > 1);
    let hashes: Vec<_> = cases.iter().map(|case| prepared(case["question"].clone())).collect();
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        for (case, hash) in cases.iter_mut().zip(hashes) {
            case["hash"] = hash.into();
        }
        return std::fs::write(FILE, format!("{:#}\n", Value::from(cases))).unwrap();
    }
    for (case, hash) in cases.iter().zip(hashes) {
        assert_eq!(case["hash"], hash, "{}", case["question"]);
    }
}
