//! The example melody blown by a simulated hand on a simulated knob: firmware, pty, link, plugin and sound at work
//! together, at the pace of a sound card.

use std::fmt::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, bail};
use chalumeau_core::control::keys::Keys;
use chalumeau_core::event::Event;
use chalumeau_core::haptics::{FeelDesign, FeelTable, TorqueLimits};
use chalumeau_core::instrument::Settings;
use chalumeau_core::score::Score;
use chalumeau_knob::touch::feel::Feels;

use crate::host::{At, Plugin, Say, Session};
use crate::simulator::{Simulator, serial_number};

/// Frames of a block: what a musician at a computer plays with.
const BLOCK: usize = 128;
/// The hand begins so long before the notes, s: time for the firmware's torque to come up.
const LEAD_S: f64 = 1.0;
/// The hand is ahead of the fingers by what it needs to get there and what the link needs to tell, s.
const AHEAD_S: f64 = 0.06;
/// Step of the hand's script, s.
const STEP_S: f64 = 0.01;
/// The hand turns no faster than this, degrees a step: 10 rad/s, far from the knob's over-speed of 60.
const HASTE_DEG: f64 = 6.0;
/// How long to wait for the knob, s.
const PATIENCE_S: u64 = 20;

/// What came of it; all times in seconds from the first note.
pub struct Performance {
    /// The sound, from the first note.
    pub left: Vec<f32>,
    /// Time, angle in degrees, torque in mNm.
    pub knob: Vec<[f64; 3]>,
    /// Time and mouth pressure over closing pressure, as the plugin sent it to the host.
    pub gamma: Vec<[f64; 2]>,
    /// Time, and threshold: angle in degrees, gamma.
    pub threshold: Vec<[f64; 3]>,
}

/// Plays the notes of a score through the plugin, its breath through the knob.
pub fn play(clap: &Path, folder: &Path, score: &Score, said: &[At], rate: u32) -> Result<Performance> {
    let feels = Feels::built_in().map_err(|reason| anyhow!("{reason}"))?;
    let table = feels.table(&Settings::default(), &FeelDesign::default(), &TorqueLimits::default())?;
    let hand = folder.join("hand.csv");
    std::fs::write(&hand, script(score, &feels, &table, rate))?;
    let log = folder.join("knob.csv");
    let number = serial_number();
    let text = |path: &Path| path.to_string_lossy().into_owned();
    let seconds = format!("{:.0}", score.seconds(rate) + 60.0);
    let simulator = Simulator::start(&[
        "--serial-number",
        &format!("{number:016x}"),
        "--script",
        &text(&hand),
        "--wait-armed",
        "--log",
        &text(&log),
        "--seconds",
        &seconds,
    ])?;
    println!("a simulated knob on {}", simulator.greeting);

    let rate_hz = f64::from(rate);
    let mut plugin = Plugin::load(clap)?;
    connect(&mut plugin, number)?;
    let arm = plugin.param("Arm knob")?.id;
    let status = plugin.param("Knob status")?.id;
    let played = plugin.session(rate_hz, BLOCK, |session| -> Result<_> {
        wait_until_live(session, rate_hz)?;
        let armed_at = session.played();
        let lead = (LEAD_S * rate_hz) as usize;
        let mut all = vec![At(0, Say::Set(arm, 1.0))];
        // The notes alone: breath is the knob's.
        let notes =
            said.iter().filter(|At(_, say)| !matches!(say, Say::Midi([status, ..]) if status & 0xF0 == 0xB0));
        all.extend(notes.map(|At(at, say)| At(at + lead, *say)));
        let [left, _] = session.play_live(&all, lead + score.samples, rate_hz)?;
        let first = armed_at + lead;
        let breath = breath_sent(session, first, rate_hz);
        Ok((left[lead..].to_vec(), breath))
    })?;
    let (left, breath) = played?;
    let said = plugin.text(status, 0.0)?;
    println!("the plugin says of its knob: {said}");
    drop(plugin);
    drop(simulator);

    let settings = Settings::default();
    let full = 1e3 * f64::from(settings.breath_full_kpa) / settings.closing_pa();
    Ok(Performance {
        left,
        knob: read_log(&log)?,
        gamma: breath.into_iter().map(|[t, unit]| [t, unit * full]).collect(),
        threshold: threshold(score, &feels, &table, rate),
    })
}

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

/// Breath as the host could have recorded it: seconds from sample `first`, 0..=1 of full breath.
fn breath_sent(session: &Session, first: usize, rate_hz: f64) -> Vec<[f64; 2]> {
    let mut coarse = 0;
    session
        .answers()
        .iter()
        .filter_map(|&(at, [_, cc, value])| match cc {
            2 => {
                coarse = u16::from(value) << 7;
                None
            }
            34 => {
                let t = (at as f64 - first as f64) / rate_hz;
                Some([t, f64::from(coarse | u16::from(value)) / 16_383.0])
            }
            _ => None,
        })
        .collect()
}

/// What the hand does: for each moment the angle that blows what the score asks of the note in the fingers.
fn script(score: &Score, feels: &Feels, table: &FeelTable, rate: u32) -> String {
    let full_pa = 1e3 * f64::from(Settings::default().breath_full_kpa);
    let maps = feels.maps(table);
    let mut angles = Vec::new();
    let (mut keys, mut breath, mut note, mut next) = (Keys::default(), 0.0, None, 0);
    let mut steps = 0;
    loop {
        let t_s = f64::from(steps) * STEP_S;
        let at = (t_s * f64::from(rate)) as usize;
        if at >= score.samples {
            break;
        }
        while let Some(event) = score.events.get(next).filter(|event| event.at <= at) {
            match event.event {
                Event::NoteOn { note, .. } => keys.press(note),
                Event::NoteOff { note } => keys.release(note),
                Event::Breath(unit) => breath = f64::from(unit),
                _ => {}
            }
            note = keys.last().or(note);
            next += 1;
        }
        let index = note.and_then(|note| feels.fingering(note)).and_then(|index| table.note(index));
        let angle = index.map_or(0.0, |feel| feel.map.angle_deg(breath * full_pa));
        debug_assert!((maps.pressure_pa(note, angle) - breath * full_pa).abs() < 1.0 || note.is_none());
        angles.push(angle);
        steps += 1;
    }
    // A hand that has far to go sets out early.
    for at in (1..angles.len()).rev() {
        angles[at - 1] = f64::clamp(angles[at - 1], angles[at] - HASTE_DEG, angles[at] + HASTE_DEG);
    }
    let mut text = "t_s,angle_deg\n0,0\n".to_owned();
    for (at, angle) in angles.iter().enumerate() {
        let _ = writeln!(text, "{:.3},{angle:.2}", at as f64 * STEP_S + LEAD_S - AHEAD_S);
    }
    text
}

/// Where each note's threshold lies, in degrees and as gamma.
fn threshold(score: &Score, feels: &Feels, table: &FeelTable, rate: u32) -> Vec<[f64; 3]> {
    let note_ons = score.events.iter().filter_map(|event| match event.event {
        Event::NoteOn { note, .. } => Some((event.at, note)),
        _ => None,
    });
    note_ons
        .filter_map(|(at, note)| {
            let feel = table.note(feels.fingering(note)?)?;
            let gamma = feel.requirement?.gamma_sounding;
            Some([at as f64 / f64::from(rate), feel.landmarks.a_on_deg, gamma])
        })
        .collect()
}

/// The simulator's log, from the moment it was armed, in seconds from the first note.
fn read_log(path: &Path) -> Result<Vec<[f64; 3]>> {
    let text = std::fs::read_to_string(path).with_context(|| format!("no log at {}", path.display()))?;
    let rows = text.lines().filter(|line| !line.starts_with('#')).skip(1).map(|line| {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.trim().parse().unwrap_or(f64::NAN)).collect();
        cells.get(..6).map(|cells| [cells[0], cells[1], cells[3], cells[5]])
    });
    let rows: Vec<[f64; 4]> = rows.flatten().collect();
    let armed = rows.iter().find(|row| row[3] > 0.5).context("the knob was never armed")?[0];
    Ok(rows
        .iter()
        .map(|[t_us, angle, torque, _]| [1e-6 * (t_us - armed) - LEAD_S, *angle, *torque])
        .collect())
}
