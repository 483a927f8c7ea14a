//! Tests of the module in Node and of the page in Chromium.

use std::path::Path;
use std::process::Command;

use anyhow::{Result, ensure};

use super::build;
use crate::machine::{self, Package};
use crate::programs::programs;

/// Drives the browser. Pinned: a new one may expect another Chromium.
const PLAYWRIGHT: &str = "playwright-core@1.65.1";

const NODE: Package = Package {
    name: "nodejs",
    present: || machine::works("node", &["--version"]),
    purpose: "testing the module",
};
const NPM: Package = Package {
    name: "npm",
    present: || machine::works("npm", &["--version"]),
    purpose: "fetching playwright-core",
};
const CHROMIUM: Package = Package {
    name: "chromium",
    present: || machine::works("chromium", &["--version"]),
    purpose: "testing the page",
};
const ESPEAK: Package = Package {
    name: "espeak-ng",
    present: || machine::works("espeak-ng", &["--version"]),
    purpose: "speech that must not play",
};

/// The page's tests, in order: the module, the microphone, the page. Each is a program of Node, which gets the page's folder and
/// one of its own.
const TESTS: [&str; 4] = ["module.mjs", "wind.mjs", "use.mjs", "browser.mjs"];

/// Builds the page and runs its tests; installs what they need.
pub fn test() -> Result<()> {
    machine::provide(&[&NODE, &NPM, &CHROMIUM, &ESPEAK])?;
    // Before the page, whose data a program of this build writes.
    let program = &programs()?.program;
    let page = build()?;
    let folder = machine::target().join("web-tests");
    std::fs::create_dir_all(&folder)?;
    if !has_playwright(&folder) {
        let npm = ["install", "--no-save", "--no-audit", "--no-fund", "--ignore-scripts", "--prefix"];
        machine::run(Command::new("npm").args(npm).arg(&folder).arg(PLAYWRIGHT))?;
    }
    for name in TESTS {
        let script = machine::root().join("web/tests").join(name);
        ensure!(script.exists(), "{} is missing", script.display());
        let mut node = Command::new("node");
        node.arg(script).arg(&page).arg(&folder).env("CHALUMEAU", program);
        machine::run(&mut node)?;
    }
    Ok(())
}

/// Builds the page and has Node play the scores through its module: they have the hashes of the Rust code.
pub fn test_module() -> Result<()> {
    machine::provide(&[&NODE])?;
    let page = build()?;
    machine::run(Command::new("node").arg(machine::root().join("web/tests").join(TESTS[0])).arg(page))
}

fn has_playwright(folder: &Path) -> bool {
    let version = PLAYWRIGHT.rsplit('@').next().unwrap_or_default();
    let package = folder.join("node_modules/playwright-core/package.json");
    std::fs::read_to_string(package).is_ok_and(|text| text.contains(&format!("\"version\": \"{version}\"")))
}
