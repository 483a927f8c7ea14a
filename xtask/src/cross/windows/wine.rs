//! Windows' programs run here, by Wine, with a display that nobody sees.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::Result;
use chalumeau_test_host::display::Display;

use super::places;
use crate::cross::build::Built;
use crate::cross::comparison::Runner;
use crate::debian::inside;
use crate::machine::{self, XVFB};

/// Where Debian has it, in no folder of programs.
const WINESERVER: &str = "/usr/lib/x86_64-linux-gnu/wine/wineserver";

pub struct Wine<'a> {
    pub runner: Runner<'a>,
    pub prefix: PathBuf,
    pub display: Display,
}

impl<'a> Wine<'a> {
    pub fn start(built: &'a Built) -> Result<Self> {
        machine::provide(&[&XVFB])?;
        let display = Display::start()?;
        let prefix = machine::target().join("cross/wine");
        fs::create_dir_all(&prefix)?;
        let variable = |name: &str, value: &str| (name.to_owned(), value.to_owned());
        let mut variables = vec![
            variable("WINEPREFIX", &inside(&prefix)?),
            // Neither Gecko nor Mono, which Wine would ask for.
            variable("WINEDLLOVERRIDES", "mscoree,mshtml="),
            variable("WINEDEBUG", "-all"),
        ];
        variables.extend(places()?);
        // What the display asks of its clients.
        let mut client = Command::new("wine");
        for (name, value) in display.for_clients(&mut client).get_envs() {
            if let Some(value) = value {
                variables.push((name.to_string_lossy().into_owned(), value.to_string_lossy().into_owned()));
            }
        }
        let wine = Self { runner: Runner { built, words: &["wine"], variables }, prefix, display };
        // One server for all programs, which would else start anew with each. One that was left behind ends first.
        let _ = wine.runner.helper(WINESERVER).arg("-k").stderr(Stdio::null()).status();
        // At its end it would list what it still holds.
        machine::run(wine.runner.helper(WINESERVER).arg("-p").stderr(Stdio::null()))?;
        machine::run(wine.runner.helper("wine").args(["wineboot", "--init"]))?;
        Ok(wine)
    }
}

impl Drop for Wine<'_> {
    fn drop(&mut self) {
        let _ = self.runner.helper(WINESERVER).arg("-k").stderr(Stdio::null()).status();
    }
}

/// A path as Wine's programs see it: all of the folder's system is on drive Z.
pub fn path(path: &Path) -> Result<String> {
    Ok(format!("Z:{}", inside(path)?.replace('/', "\\")))
}
