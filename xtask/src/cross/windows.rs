//! The command line with devices and the simulated knob for Windows, built by MinGW and run by Wine: sound, and a knob at a
//! COM port.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result, ensure};

use crate::cross::build::{Built, Cargo};
use crate::cross::comparison::Runner;
use crate::cross::folder;
use crate::debian::{Packages, inside};
use crate::machine;

const CARGO: Cargo = Cargo {
    system: "windows",
    target: "x86_64-pc-windows-gnu",
    packages: Packages {
        purpose: "the compiler's library for Windows",
        processor: None,
        names: &[
            "rustc",
            "cargo",
            "rust-src",
            "gcc",
            "libc6-dev",
            "g++-mingw-w64-x86-64-posix",
            "wine",
            "wine64",
            "socat",
        ],
    },
    builds_library: true,
    variables: &[],
};
const OPTIONS: &[&str] =
    &["-p", "chalumeau", "--bin", "chalumeau", "--no-default-features", "--features", "simulator"];
/// Where Debian has it, in no folder of programs.
const WINESERVER: &str = "/usr/lib/x86_64-linux-gnu/wine/wineserver";
/// Two COM ports that are joined: the host's and the knob's.
const HOST: &str = "COM5";
const KNOB: &str = "COM6";

pub fn run() -> Result<()> {
    let built = CARGO.build("build", OPTIONS)?;
    let folder = folder(CARGO.system);
    built.keep(&folder, &[("chalumeau", "chalumeau.exe")])?;
    let wine = Wine::start(&built)?;
    wine.runner.files("chalumeau", &folder)?;
    wine.knob(&folder)
}

/// Windows' programs run here.
struct Wine<'a> {
    runner: Runner<'a>,
    prefix: PathBuf,
}

impl<'a> Wine<'a> {
    fn start(built: &'a Built) -> Result<Self> {
        let prefix = machine::target().join("cross/wine");
        fs::create_dir_all(&prefix)?;
        let variable = |name: &str, value: &str| (name.to_owned(), value.to_owned());
        let variables = vec![
            variable("WINEPREFIX", &inside(&prefix)?),
            // Neither Gecko nor Mono, which Wine would ask for.
            variable("WINEDLLOVERRIDES", "mscoree,mshtml="),
            variable("WINEDEBUG", "-all"),
        ];
        let wine = Self { runner: Runner { built, words: &["wine"], variables }, prefix };
        // One server for all programs, which would else start anew with each. One that was left behind ends first.
        let _ = wine.runner.helper(WINESERVER).arg("-k").stderr(Stdio::null()).status();
        machine::run(wine.runner.helper(WINESERVER).arg("-p"))?;
        machine::run(wine.runner.helper("wine").args(["wineboot", "--init"]))?;
        Ok(wine)
    }

    /// A simulated knob at one COM port, found, armed, turned and recorded through the other.
    fn knob(&self, folder: &Path) -> Result<()> {
        let program = self.runner.built.file("chalumeau")?;
        let _ports = self.ports()?;
        let mut simulator = self.runner.command(program)?;
        simulator.args(["knob-sim", "--quiet", "--crescendo", "0:200:4", "--wait-armed", "--path", KNOB]);
        // It ends by itself even where the signal does not reach it.
        let mut simulator = simulator.args(["--seconds", "120"]).stdout(Stdio::null()).spawn()?;
        let played = self.play(program, folder);
        let _ = simulator.kill();
        simulator.wait()?;
        played
    }

    /// Joins the two ports.
    fn ports(&self) -> Result<Joined> {
        let mut socat = self.runner.helper("socat");
        for port in [HOST, KNOB] {
            let device = self.prefix.join("dosdevices").join(port.to_lowercase());
            let _ = fs::remove_file(&device);
            socat.arg(format!("pty,raw,echo=0,link={}", inside(&device)?));
        }
        let ports = Joined(socat.spawn().context("cannot start socat")?);
        thread::sleep(Duration::from_secs(1));
        Ok(ports)
    }

    fn play(&self, program: &Path, folder: &Path) -> Result<()> {
        let said = self.runner.command(program)?.args(["doctor", "--path", HOST]).output()?;
        let said = String::from_utf8_lossy(&said.stdout).into_owned();
        println!("{said}");
        ensure!(said.contains("tier 2: position and feel"), "doctor does not reach the knob at {HOST}");
        let take = folder.join("take.csv");
        let mut knob = self.runner.command(program)?;
        knob.args(["knob", "--path", HOST, "--arm", "100", "--seconds", "10", "--force", "--record"]);
        machine::run(knob.arg(inside(&take)?).stdin(Stdio::null()))?;
        let reached = highest_angle(&fs::read_to_string(&take)?)?;
        println!("knob at {HOST}: armed, and turned to {reached:.1} degrees");
        // The hand turns to 200 degrees once the knob is armed; the torque pushes it back by up to 11.
        ensure!(reached > 180.0, "the knob at {HOST} was not played: {reached} degrees");
        Ok(())
    }
}

impl Drop for Wine<'_> {
    fn drop(&mut self) {
        let _ = self.runner.helper(WINESERVER).arg("-k").stderr(Stdio::null()).status();
    }
}

/// Two pseudo-terminals of Linux, joined until this is dropped.
struct Joined(Child);

impl Drop for Joined {
    fn drop(&mut self) {
        let _ = machine::terminate(&mut self.0);
    }
}

/// The largest number in the take's column `angle_deg`.
fn highest_angle(take: &str) -> Result<f64> {
    let mut lines = take.lines().filter(|line| !line.starts_with('#'));
    let header = lines.next().context("the take is empty")?;
    let column =
        header.split(',').position(|name| name == "angle_deg").context("the take has no angle_deg")?;
    let angles = lines.filter_map(|line| line.split(',').nth(column)?.parse().ok());
    Ok(angles.fold(0.0, f64::max))
}
