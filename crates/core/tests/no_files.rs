//! The crate keeps its promise: no files, processes, sockets, clock or environment, and threads only in `parallel.rs`.

use std::fs;
use std::path::{Path, PathBuf};

/// Modules of `std` that need an operating system.
const REFUSED: [&str; 6] = ["fs", "path", "process", "net", "time", "env"];

fn sources(folder: &Path, all: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, all);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            all.push(path);
        }
    }
}

/// The modules of `std` in a line of code that a file may not use. A list in braces after `std::` counts as all of them.
fn refused(line: &str, is_parallel: bool) -> Option<&'static str> {
    let code = line.split("//").next().unwrap_or_default();
    let uses = |module: &str| {
        code.match_indices("std::").any(|(at, found)| {
            let rest = &code[at + found.len()..];
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
            rest.starts_with('{') || &rest[..end] == module
        })
    };
    let thread = (!is_parallel && uses("thread")).then_some("thread");
    thread.or_else(|| REFUSED.into_iter().find(|module| uses(module)))
}

#[test]
fn sources_use_no_operating_system() {
    let mut all = Vec::new();
    sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut all);
    assert!(all.len() > 50, "the sources are somewhere else");
    let mut found = Vec::new();
    for path in all {
        let is_parallel = path.ends_with("src/parallel.rs");
        for (line, number) in fs::read_to_string(&path).unwrap().lines().zip(1..) {
            if let Some(module) = refused(line, is_parallel) {
                found.push(format!("{}:{number}: std::{module}", path.display()));
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn a_forbidden_module_is_found_however_it_is_written() {
    assert_eq!(refused("use std::fs;", false), Some("fs"));
    assert_eq!(refused("    let now = std::time::Instant::now();", true), Some("time"));
    assert_eq!(refused("use std::thread;", false), Some("thread"));
    assert_eq!(refused("use std::thread;", true), None);
    assert!(refused("use std::{fs, io};", true).is_some());
    assert_eq!(refused("use std::sync::Arc; // not std::fs", false), None);
}
