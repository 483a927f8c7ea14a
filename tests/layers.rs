//! The floors of the house: a module uses only modules on lower floors.
//!
//! Reads `src/` as text, so code behind any feature and under `#[cfg(test)]` counts. Understands `crate::x`, grouped
//! imports and `super::` paths that climb to the crate root; comments and strings do not count. What could hide a
//! use (`crate::*`, `crate as`, `extern crate`) is refused. Code that macros build from pieces is not seen.

use std::fs;
use std::path::{Path, PathBuf};

/// Modules and their floors. Two modules on one floor do not know each other.
const FLOORS: &[(&str, u8)] = &[
    ("identity", 0),
    ("units", 0),
    ("dsp", 0),
    ("output", 0),
    ("wire", 0),
    ("event", 1),
    ("reed", 2),
    ("bore", 2),
    ("control", 3),
    ("analysis", 3),
    ("haptics", 3),
    ("instrument", 4),
    ("device", 4),
    ("figure", 5),
    ("render", 5),
    ("touch", 5),
    ("simulator", 5),
    ("cli", 6),
    ("editor", 6),
    ("plugin", 7),
];

fn floor(module: &str) -> Option<u8> {
    FLOORS.iter().find(|(name, _)| *name == module).map(|(_, floor)| *floor)
}

/// Identifiers, `::` and single marks, without comments, strings, characters, lifetimes and numbers.
fn tokens(text: &str) -> Vec<String> {
    let chars: Vec<char> = text.chars().collect();
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut found = Vec::new();
    let mut i = 0;
    while i < chars.len() {
        let c = chars[i];
        if c == '/' && at(i + 1) == '/' {
            while i < chars.len() && chars[i] != '\n' {
                i += 1;
            }
        } else if c == '/' && at(i + 1) == '*' {
            let mut depth = 0;
            loop {
                match (at(i), at(i + 1)) {
                    ('/', '*') => (depth, i) = (depth + 1, i + 2),
                    ('*', '/') => (depth, i) = (depth - 1, i + 2),
                    _ => i += 1,
                }
                if depth == 0 || i >= chars.len() {
                    break;
                }
            }
        } else if c == '"' {
            i = after_string(&chars, i);
        } else if c == '\'' {
            // A character is closed by a quote two places on, or starts with a backslash; anything else is a lifetime.
            i += 1;
            if at(i) == '\\' {
                i += 2;
                while i < chars.len() && chars[i] != '\'' {
                    i += 1;
                }
                i += 1;
            } else if at(i + 1) == '\'' {
                i += 2;
            } else {
                while is_word(at(i)) {
                    i += 1;
                }
            }
        } else if is_word(c) {
            let start = i;
            while is_word(at(i)) {
                i += 1;
            }
            let word: String = chars[start..i].iter().collect();
            let hashes = chars[i..].iter().take_while(|c| **c == '#').count();
            let raw = matches!(word.as_str(), "r" | "br" | "cr");
            if raw && at(i + hashes) == '"' {
                i = after_raw_string(&chars, i + hashes + 1, hashes);
            } else if raw && hashes == 1 {
                i += 1; // a raw identifier: its name follows
            } else if !word.starts_with(|c: char| c.is_ascii_digit()) {
                found.push(word);
            }
        } else if c == ':' && at(i + 1) == ':' {
            found.push("::".into());
            i += 2;
        } else {
            if !c.is_whitespace() {
                found.push(c.into());
            }
            i += 1;
        }
    }
    found
}

/// Index after the string that opens at `i`.
fn after_string(chars: &[char], i: usize) -> usize {
    let mut i = i + 1;
    while i < chars.len() && chars[i] != '"' {
        i += if chars[i] == '\\' { 2 } else { 1 };
    }
    i + 1
}

/// Index after the raw string whose text starts at `i`.
fn after_raw_string(chars: &[char], mut i: usize, hashes: usize) -> usize {
    while i < chars.len() {
        if chars[i] == '"' && chars[i + 1..].iter().take(hashes).filter(|c| **c == '#').count() == hashes {
            return i + 1 + hashes;
        }
        i += 1;
    }
    i
}

/// Names used directly below the crate root, in order. `depth` is 1 for `src/foo.rs`, 2 for `src/foo/bar.rs`.
fn uses(text: &str, depth: usize) -> Vec<String> {
    let tokens = tokens(text);
    let at = |i: usize| tokens.get(i).map_or("", String::as_str);
    let mut braces: Vec<bool> = Vec::new(); // true where the brace opens an inline module
    let mut found = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        match at(i) {
            "{" => braces.push(i >= 2 && at(i - 2) == "mod"),
            "}" => _ = braces.pop(),
            "extern" if at(i + 1) == "crate" => {
                found.push("extern crate".into());
                i += 1;
            }
            "crate" if at(i + 1) == "as" => found.push("crate as".into()),
            "crate" if at(i + 1) == "::" => below_root(&tokens, i + 2, &mut found),
            "super" => {
                let mut climbed = 1;
                while at(i + 1) == "::" && at(i + 2) == "super" {
                    climbed += 1;
                    i += 2;
                }
                let inline_modules = braces.iter().filter(|is_module| **is_module).count();
                if climbed >= depth + inline_modules {
                    match at(i + 1) {
                        "::" => below_root(&tokens, i + 2, &mut found),
                        _ => found.push("super as".into()),
                    }
                }
            }
            _ => {}
        }
        i += 1;
    }
    found
}

/// Collects the first name, or each first name of a group, that stands at `i`.
fn below_root(tokens: &[String], i: usize, found: &mut Vec<String>) {
    if tokens.get(i).is_none_or(|token| token != "{") {
        found.push(tokens.get(i).cloned().unwrap_or_default());
        return;
    }
    let (mut depth, mut is_first) = (0, true);
    for token in &tokens[i..] {
        match token.as_str() {
            "{" => depth += 1,
            "}" => depth -= 1,
            "," if depth == 1 => is_first = true,
            name if depth == 1 && is_first => {
                found.push(name.into());
                is_first = false;
            }
            _ => {}
        }
        if depth == 0 {
            break;
        }
    }
}

/// What is wrong with one file of `module`, a sentence each.
fn faults(module: &str, depth: usize, text: &str) -> Vec<String> {
    let Some(own) = floor(module) else {
        return vec![format!("`{module}` has no floor: add it to FLOORS in tests/layers.rs")];
    };
    let judge = |used: String| match floor(&used) {
        _ if used == module => None,
        None => Some(format!("`{module}` uses `{used}`, which is no module with a floor")),
        Some(other) if other >= own => {
            Some(format!("`{module}` (floor {own}) must not use `{used}` (floor {other})"))
        }
        Some(_) => None,
    };
    uses(text, depth).into_iter().filter_map(judge).collect()
}

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn modules_use_only_lower_floors() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    rust_files(&src, &mut files);
    files.sort();
    let mut wrong = Vec::new();
    let mut checked = 0;
    for path in files {
        let inside = path.strip_prefix(&src).unwrap().with_extension("");
        let parts: Vec<&str> = inside.iter().map(|part| part.to_str().unwrap()).collect();
        if parts.last() == Some(&"mod") {
            wrong.push(format!("{}: write foo.rs beside foo/, not foo/mod.rs", path.display()));
        }
        if matches!(parts[..], ["lib"] | ["main"] | ["bin", ..]) {
            continue; // the roots: they list the modules or start the program
        }
        let text = fs::read_to_string(&path).unwrap();
        let here = faults(parts[0], parts.len(), &text);
        wrong.extend(here.into_iter().map(|fault| format!("{}: {fault}", path.display())));
        checked += 1;
    }
    assert!(checked > 0, "no module found under {}", src.display());
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn checker_bites() {
    for (module, depth, text, names) in [
        ("reed", 1, "use crate::plugin::Plugin;", "plugin"),
        ("reed", 2, "use crate::bore::Bore;", "bore"),
        ("bore", 2, "fn f() { crate :: reed::law(); }", "reed"),
        ("event", 1, "use crate::{units, cli};", "cli"),
        ("event", 1, "use crate::{units::{Air, cents}, render::{self, go}, wire};", "render"),
        ("dsp", 1, "use crate::{\n    // why\n    wire,\n};", "wire"),
        ("analysis", 1, "#[cfg(test)] mod tests { use crate::instrument::Clarinet; }", "instrument"),
        ("reed", 1, "use super::bore::Bore;", "bore"),
        ("reed", 2, "use super::super::bore::Bore;", "bore"),
        ("reed", 1, "mod tests { use super::{super::bore, x}; use super::super::bore::Bore; }", "bore"),
        ("reed", 1, "fn f() {} mod tests { fn g() { super::super::instrument::h() } }", "instrument"),
        ("plugin", 1, "use crate::*;", "*"),
        ("plugin", 1, "use crate as c;", "crate as"),
        ("plugin", 1, "use crate::{self as c};", "self"),
        ("plugin", 1, "extern crate self as c;", "extern crate"),
        ("plugin", 1, "use super as c;", "super as"),
        ("plugin", 1, "use crate::attic::Box;", "attic"),
        ("plugin", 1, "const A: char = '\"'; const B: &str = \"\\\"\"; use crate::attic;", "attic"),
        ("attic", 1, "", "attic"),
    ] {
        let found = faults(module, depth, text);
        assert!(
            found.iter().any(|fault| fault.contains(&format!("`{names}`"))),
            "{module}: {text}\n{found:?}"
        );
    }
}

#[test]
fn checker_lets_honest_code_pass() {
    for (module, depth, text) in [
        ("plugin", 1, "use crate::instrument::Clarinet; use crate::{editor, units::Air};"),
        ("reed", 2, "use crate::reed::table::Table; use super::law::Law; pub(crate) fn f() {}"),
        ("reed", 2, "mod tests { use super::super::law; use super::*; }"),
        ("reed", 1, "mod tests { use super::*; fn f() { if true {} super::g() } }"),
        (
            "reed",
            1,
            "//! [`crate::plugin`]\n/* crate::bore /* crate::bore */ crate::cli */ use crate::units;",
        ),
        ("reed", 1, "const A: &str = \"crate::bore\"; const B: &str = r#\"\"crate::bore\"#; use crate::dsp;"),
        ("reed", 1, "fn f<'a>(x: &'a str) -> char { '\\u{7b}' } mod m { use super::f; }"),
    ] {
        assert_eq!(faults(module, depth, text), Vec::<String>::new(), "{text}");
    }
}
