//! A simulated knob at one COM port, found, armed, turned and recorded through the other.

use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result, ensure};

use super::Wine;
use crate::debian::inside;
use crate::machine;

/// Two COM ports that are joined: the host's and the knob's.
const HOST: &str = "COM5";
const KNOB: &str = "COM6";

/// Plays it; the take goes to `folder`.
pub fn play(wine: &Wine, folder: &Path) -> Result<()> {
    let program = wine.runner.built.file("chalumeau")?;
    let _ports = join(wine)?;
    let mut simulator = wine.runner.command(program)?;
    simulator.args(["knob-sim", "--quiet", "--crescendo", "0:200:4", "--wait-armed", "--path", KNOB]);
    // It ends by itself even where the signal does not reach it.
    let mut simulator = simulator.args(["--seconds", "120"]).stdout(Stdio::null()).spawn()?;
    let played = record(wine, program, folder);
    let _ = simulator.kill();
    simulator.wait()?;
    played
}

/// Joins the two ports.
fn join(wine: &Wine) -> Result<Joined> {
    let mut socat = wine.runner.helper("socat");
    for port in [HOST, KNOB] {
        let device = wine.prefix.join("dosdevices").join(port.to_lowercase());
        let _ = fs::remove_file(&device);
        socat.arg(format!("pty,raw,echo=0,link={}", inside(&device)?));
    }
    let ports = Joined(socat.spawn().context("cannot start socat")?);
    thread::sleep(Duration::from_secs(1));
    Ok(ports)
}

fn record(wine: &Wine, program: &Path, folder: &Path) -> Result<()> {
    let said = wine.runner.command(program)?.args(["doctor", "--path", HOST]).output()?;
    let said = String::from_utf8_lossy(&said.stdout).into_owned();
    println!("{said}");
    ensure!(said.contains("tier 2: position and feel"), "doctor does not reach the knob at {HOST}");
    let take = folder.join("take.csv");
    let mut knob = wine.runner.command(program)?;
    knob.args(["knob", "--path", HOST, "--arm", "100", "--seconds", "10", "--force", "--record"]);
    machine::run(knob.arg(inside(&take)?).stdin(Stdio::null()))?;
    let reached = highest_angle(&fs::read_to_string(&take)?)?;
    println!("knob at {HOST}: armed, and turned to {reached:.1} degrees");
    // The hand turns to 200 degrees once the knob is armed; the torque pushes it back by up to 11.
    ensure!(reached > 180.0, "the knob at {HOST} was not played: {reached} degrees");
    Ok(())
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
