//! Ardour inside the fresh Debian, without a window: its Lua writes a session, its exporter plays it into a file.

use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};

use super::Fresh;
use crate::machine;

const NOTES: &str = include_str!("notes.lua");
const SESSION: &str = include_str!("session.lua");
/// Where Ardour keeps its own files, so that the user's home stays as it is.
const PLACE: &str = "/tmp/ardour";
/// Samples a second of the session, how many the notes last, and how many a note.
const RATE: usize = 48_000;
const NOTE: usize = RATE / 2;
const SAMPLES: usize = 4 * NOTE;
/// Ardour's unit of time: so many to the second.
const SUPERCLOCK_PER_SECOND: usize = 282_240_000;
/// Ardour 8.12's Lua sometimes ends with "exception not rethrown" before it has saved.
const ATTEMPTS: usize = 8;
/// How long an attempt may take, s: both take a few on a machine that is not busy. Ardour's export sometimes does not end.
const PATIENCE_S: &str = "180";
/// What a note's level must be at least, rms of full scale: -40 dB.
const AUDIBLE: f64 = 0.01;

/// Fails unless Ardour finds the plugin at this path and all four notes are heard.
pub fn plays(system: &Fresh, plugin: &str) -> Result<()> {
    let name = version(system)?;
    let place = system.inside(PLACE);
    if place.exists() {
        fs::remove_dir_all(&place)?;
    }
    let scripts = place.join("config").join(&name).join("scripts");
    fs::create_dir_all(&scripts)?;
    fs::write(scripts.join("notes.lua"), NOTES)?;
    fs::write(place.join("session.lua"), SESSION.replace("SESSION", &format!("{PLACE}/session")))?;
    machine::run(Command::new("chmod").args(["-R", "a+rwX"]).arg(&place))?;
    let library = format!("/usr/lib/{name}");
    let scan = [format!("LD_LIBRARY_PATH={library}"), format!("{library}/ardour-vst3-scanner")];
    // Ardour passes over a plugin that is newer than its scan, and it dates scans in whole seconds.
    std::thread::sleep(Duration::from_secs(2));
    machine::run(beside(system).args(scan).args(["-f", "-q", plugin]))?;
    let session = session(system, &name, plugin)?;
    let text = fs::read_to_string(&session)?;
    fs::write(&session, with_range(&text).context("Ardour's session has no list of places")?)?;
    let sound = export(system, &name)?;
    let levels: Vec<f64> = sound.chunks(NOTE).map(rms).collect();
    ensure!(
        levels.len() >= 4 && levels[..4].iter().all(|level| *level > AUDIBLE),
        "in {name} the notes have levels {levels:?}"
    );
    println!("{plugin} plays in {name}: rms of its four notes {:.3?}", &levels[..4]);
    Ok(fs::remove_dir_all(&place)?)
}

/// A command inside, as the user, who keeps nothing of it at home.
fn beside(system: &Fresh) -> Command {
    let mut command = system.user();
    // Before 8.5 Ardour writes behind the end of a buffer where it mixes with AVX-512, and may abort when an export ends. These
    // flags choose SSE2.
    command.arg("ARDOUR_FPU_FLAGS=15");
    // Ardour finds the plugins of the home itself, and follows no link to them.
    for (folder, of) in [
        ("XDG_CONFIG_HOME", "/config"),
        ("XDG_CACHE_HOME", "/cache"),
        ("XDG_DATA_HOME", "/data"),
        ("XDG_STATE_HOME", "/state"),
        ("XDG_RUNTIME_DIR", ""),
        ("CHALUMEAU_CACHE_DIR", "/cache"),
    ] {
        command.arg(format!("{folder}={PLACE}{of}"));
    }
    command
}

/// The same, ended when it takes too long: asked first, and killed when it does not listen.
fn with_patience(system: &Fresh) -> Command {
    let mut command = beside(system);
    command.args(["timeout", "--kill-after=5", PATIENCE_S]);
    command
}

/// "ardour8".
fn version(system: &Fresh) -> Result<String> {
    let folders = fs::read_dir(system.inside("/usr/lib"))?.filter_map(|entry| Some(entry.ok()?.path()));
    let newest = folders.filter(|folder| folder.join("ardour-vst3-scanner").exists()).max();
    let newest = newest.context("no ardour-vst3-scanner in /usr/lib/ardour*")?;
    Ok(newest.file_name().unwrap_or_default().to_string_lossy().into_owned())
}

/// Has the session written; its file. Ardour may fail while it ends: what it has saved counts.
fn session(system: &Fresh, name: &str, plugin: &str) -> Result<PathBuf> {
    let folder = system.inside(PLACE).join("session");
    let file = folder.join("s.ardour");
    let mut said = String::new();
    for _ in 0..ATTEMPTS {
        if folder.exists() {
            fs::remove_dir_all(&folder)?;
        }
        let output =
            with_patience(system).args([&format!("{name}-lua"), &format!("{PLACE}/session.lua")]).output()?;
        said =
            String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
        if said.contains("saved") && file.exists() {
            let path = said.lines().find_map(|line| line.strip_prefix("found ")).unwrap_or_default();
            ensure!(path.starts_with(plugin), "{name} found another plugin, {path}, where {plugin} is");
            return Ok(file);
        }
    }
    bail!("{name}-lua wrote no session in {ATTEMPTS} attempts: {said}")
}

/// The session with a range from its beginning to the end of the notes, which is what Ardour exports.
fn with_range(session: &str) -> Option<String> {
    let end = SUPERCLOCK_PER_SECOND / RATE * SAMPLES;
    let range = format!(
        "  <Locations>\n    <Location id=\"900001\" name=\"session\" start=\"a0\" end=\"a{end}\" flags=\"IsSessionRange\" \
         locked=\"0\"/>\n"
    );
    if session.contains("  <Locations/>\n") {
        return Some(session.replacen("  <Locations/>\n", &format!("{range}  </Locations>\n"), 1));
    }
    session.contains("  <Locations>\n").then(|| session.replacen("  <Locations>\n", &range, 1))
}

/// Plays the session into a file, and returns its left channel.
fn export(system: &Fresh, name: &str) -> Result<Vec<f32>> {
    let wav = system.inside(PLACE).join("sound.wav");
    let mut said = String::new();
    for _ in 0..ATTEMPTS {
        let _ = fs::remove_file(&wav);
        let export = [&format!("{name}-export"), "-b", "float", "-o", &format!("{PLACE}/sound.wav")];
        let output = with_patience(system).args(export).args([&format!("{PLACE}/session"), "s"]).output()?;
        said =
            String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
        let left = hound::WavReader::open(&wav).ok().map(|reader| {
            let channels = usize::from(reader.spec().channels);
            reader.into_samples::<f32>().step_by(channels).collect::<Result<Vec<_>, _>>()
        });
        // Ardour may fail after it has written everything.
        if let Some(Ok(left)) = left.filter(|left| left.as_ref().is_ok_and(|left| left.len() >= SAMPLES)) {
            return Ok(left);
        }
    }
    bail!("{name}-export wrote no sound in {ATTEMPTS} attempts: {said}")
}

fn rms(samples: &[f32]) -> f64 {
    let power: f64 = samples.iter().map(|sample| f64::from(*sample).powi(2)).sum();
    (power / samples.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_gets_the_range_that_is_exported() {
        for session in [
            "<Session>\n  <Locations/>\n</Session>\n",
            "<Session>\n  <Locations>\n  </Locations>\n</Session>\n",
        ] {
            let ranged = with_range(session).unwrap();
            assert!(ranged.contains("end=\"a564480000\" flags=\"IsSessionRange\""), "{ranged}");
            assert_eq!(ranged.matches("Locations>").count(), 2);
        }
        assert_eq!(with_range("<Session>\n</Session>\n"), None);
    }
}
