//! The order of the core's modules that ARCHITECTURE.md promises.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The modules of each line of the list, the highest first.
fn lines(text: &str) -> Vec<Vec<String>> {
    let list = text.split("```text\n").find(|block| block.starts_with("measure ")).unwrap();
    let list = list.split("```").next().unwrap();
    // What they are stands behind a wide gap.
    let names = |line: &str| line.split("  ").next().unwrap().split(' ').map(str::to_owned).collect();
    list.lines().map(names).collect()
}

fn files(folder: &Path, all: &mut Vec<PathBuf>) {
    for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if path.is_dir() {
            files(&path, all);
        } else if path.extension().is_some_and(|end| end == "rs") && !path.ends_with("tests.rs") {
            all.push(path);
        }
    }
}

/// What each top module uses, outside tests and comments.
fn used() -> BTreeMap<String, BTreeSet<String>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/core/src");
    let mut all = Vec::new();
    files(&root, &mut all);
    let mut used: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for path in all {
        let place = path.strip_prefix(&root).unwrap();
        if place.iter().any(|part| part == "tests") {
            continue;
        }
        let top = place.iter().next().unwrap().to_string_lossy().replace(".rs", "");
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
        let code = code.lines().filter(|line| !line.trim_start().starts_with("//"));
        for line in code {
            for rest in line.split("crate::").skip(1) {
                let name: String = rest.chars().take_while(|c| c.is_ascii_lowercase() || *c == '_').collect();
                if !name.is_empty() && name != top {
                    used.entry(top.clone()).or_default().insert(name);
                }
            }
        }
    }
    used
}

#[test]
fn modules_of_the_core_use_those_on_lower_lines_only() {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md")).unwrap();
    let lines = lines(&text);
    let line = |name: &str| lines.iter().position(|line| line.iter().any(|other| other == name));
    let used = used();
    assert!(used.len() >= 8, "{used:?}");
    for (module, others) in used.iter().filter(|(module, _)| *module != "lib") {
        let own = line(module).unwrap_or_else(|| panic!("{module} is not in ARCHITECTURE.md"));
        for other in others {
            let theirs =
                line(other).unwrap_or_else(|| panic!("{other}, of {module}, is not in ARCHITECTURE.md"));
            assert!(theirs > own, "{module} uses {other}, which does not stand on a lower line");
        }
    }
}
