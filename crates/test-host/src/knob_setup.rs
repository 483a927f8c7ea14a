//! Points a plugin at a knob and waits for it, as a saved project and its user do.

use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clack_host::utils::ClapId;

use crate::clap::{At, Plugin, Say, Session};

/// How long to wait for the knob, s.
const PATIENCE_S: u64 = 20;

/// Points a plugin at the knob with this serial number, as a saved project does.
pub fn connect(plugin: &mut Plugin, serial: u64) -> Result<()> {
    edit(plugin, |state| {
        state["fields"]["serial"] = format!("\"{serial:016x}\"").into();
        state["params"]["knob"] = serde_json::json!({ "string": "serial" });
    })
}

/// Points a plugin at the knob whose MIDI port has this name.
pub fn connect_midi(plugin: &mut Plugin, name: &str) -> Result<()> {
    edit(plugin, |state| {
        state["fields"]["midiport"] = serde_json::json!(name).to_string().into();
        state["params"]["knob"] = serde_json::json!({ "string": "midi" });
    })
}

/// Has a plugin listen to stock firmware on a UDP port.
pub fn listen(plugin: &mut Plugin, port: u16) -> Result<()> {
    edit(plugin, |state| {
        state["params"]["knob"] = serde_json::json!({ "string": "osc" });
        state["params"]["oscprt"] = serde_json::json!({ "i32": port });
    })
}

/// Changes a plugin's state as a project file would.
pub fn edit(plugin: &mut Plugin, change: impl FnOnce(&mut serde_json::Value)) -> Result<()> {
    let state = plugin.save()?;
    // The wrapper's own frame: eight bytes of length, then JSON.
    let json = state.get(8..).context("the plugin's state is too short")?;
    let mut json: serde_json::Value =
        serde_json::from_slice(json).context("the plugin's state is no JSON")?;
    change(&mut json);
    // A state that was written by hand has no checksum.
    if let Some(fields) = json["fields"].as_object_mut() {
        fields.remove("crc32");
    }
    let json = serde_json::to_vec(&json)?;
    plugin.restore(&[&(json.len() as u64).to_le_bytes(), json.as_slice()].concat())
}

/// Plays silence until the knob's breath arrives, then half a second more, so that the switch is seen off.
pub fn wait_until_live(session: &mut Session, rate_hz: f64) -> Result<()> {
    let began = Instant::now();
    while session.answers().is_empty() {
        if began.elapsed() > Duration::from_secs(PATIENCE_S) {
            bail!("the plugin has not found the simulated knob within {PATIENCE_S} s");
        }
        session.play_live(&[], (0.1 * rate_hz) as usize, rate_hz)?;
    }
    session.play_live(&[], rate_hz as usize, rate_hz)?;
    Ok(())
}

/// Presses *Arm knob*, by its id, where the knob stands away from a zero that nobody has set: the first press is answered with a
/// warning. Afterwards the switch is off, and the next press arms.
pub fn hear_of_zero(session: &mut Session, arm: ClapId, rate_hz: f64) -> Result<()> {
    for (value, seconds) in [(1.0, 0.5), (0.0, 1.0)] {
        session.play_live(&[At(0, Say::Set(arm, value))], (seconds * rate_hz) as usize, rate_hz)?;
    }
    Ok(())
}
