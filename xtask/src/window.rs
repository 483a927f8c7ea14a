//! The plugin's window: its tests in hosts, on a display that nobody sees.

use std::path::Path;
use std::process::Command;

use anyhow::Result;

use chalumeau_test_host::display::Display;
use chalumeau_test_host::{ardour, artefacts};

use crate::bundle;
use crate::machine::{self, EGL, MESA, X11_XCB, XKB, XVFB};
use crate::programs::{Programs, TESTS, programs};

/// The tests that draw every picture worth keeping.
const PICTURES: [(&str, &str); 2] = [("window", "every_view"), ("standalone", "its_window")];

/// Starts a display and plays the bundled plugin and the debug build of the standalone on it.
pub fn test() -> Result<()> {
    let programs = programs()?;
    let display = Display::start()?;
    for file in ["window", "journeys", "vst3_raw"] {
        machine::run(&mut tests(programs, &display, file, ""))?;
    }
    machine::run(&mut tests(programs, &display, "standalone", "its_window"))
}

/// Builds plugin and standalone and keeps pictures of them.
pub fn screenshots(_: &[String]) -> Result<()> {
    machine::provide(&[&XVFB, &MESA, &EGL, &XKB, &X11_XCB])?;
    bundle::run(&[])?;
    let (programs, display) = (programs()?, Display::start()?);
    for (file, name) in PICTURES {
        // In every size and theme.
        machine::run(tests(programs, &display, file, name).env("CHALUMEAU_ALL_CASES", "1"))?;
    }
    ardour::test()?;
    println!("pictures: {}", machine::target().join(Path::new("screenshots")).display());
    Ok(())
}

/// The tests of a file that need a display, those whose name begins with `name`.
fn tests(programs: &Programs, display: &Display, file: &str, name: &str) -> Command {
    let mut command = machine::cargo();
    command
        .args(TESTS)
        .args(["--test", file, "--no-fail-fast", "--"])
        // One after another: they look at one display and move one pointer.
        .args(["--ignored", "--nocapture", "--test-threads=1", name])
        .env(artefacts::STANDALONE, &programs.standalone)
        .env(artefacts::PROGRAM, &programs.program)
        .env(artefacts::CACHE, machine::target().join("cache"));
    display.for_clients(&mut command);
    command
}
