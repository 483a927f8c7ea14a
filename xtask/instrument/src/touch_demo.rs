//! The example melody blown by a simulated hand on a simulated knob: firmware, pty, link, plugin and sound at work
//! together, at the pace of a sound card.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail};
use chalumeau_core::control::keys::Keys;
use chalumeau_core::event::Event;
use chalumeau_core::haptics::{FeelDesign, FeelTable, TorqueLimits};
use chalumeau_core::instrument::Settings;
use chalumeau_core::score::Score;
use chalumeau_knob::touch::feel::InstrumentFeel;

use chalumeau_test_host::clap::{At, Plugin, Say, Session};
use chalumeau_test_host::knob_setup::{connect, wait_until_live};
use chalumeau_test_host::simulator::{Simulator, serial_number};

/// Frames of a block: what a musician at a computer plays with.
const BLOCK: usize = 128;
/// *Breath response*: physical.
const PHYSICAL: f64 = 1.0;
/// The hand begins so long before the notes, s: time for the firmware's torque to come up.
const LEAD_S: f64 = 1.0;
/// How long the hand may take to move, s: the knob has to be armed first.
const PATIENCE_S: f64 = 10.0;
/// The hand's sign that the knob is armed: it turns so far, and back, each in this time. It makes no sound.
const SIGN_DEG: f64 = 20.0;
const SIGN_S: f64 = 0.1;
/// The hand is ahead of the fingers by what it needs to get there and what the link needs to tell, s.
const AHEAD_S: f64 = 0.06;
/// Step of the hand's script, s.
const STEP_S: f64 = 0.01;
/// The hand turns no faster than this, degrees a step: 10 rad/s, far from the knob's over-speed of 60.
const HASTE_DEG: f64 = 6.0;

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
    let feels = InstrumentFeel::built_in().map_err(|reason| anyhow!("{reason}"))?;
    let table = feels.table(&Settings::physical(), &FeelDesign::default(), &TorqueLimits::default())?;
    let hand = folder.join("hand.csv");
    let angles = angles(score, &feels, &table, rate);
    std::fs::write(&hand, script(&angles))?;
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
        // Of the demonstration before.
        "--force",
        "--seconds",
        &seconds,
    ])?;
    println!("a simulated knob on {}", simulator.greeting);

    let rate_hz = f64::from(rate);
    let mut plugin = Plugin::load(clap)?;
    connect(&mut plugin, number)?;
    // The hand below turns pressures into angles.
    let response = plugin.param("Breath response")?.id;
    plugin.set(response, PHYSICAL)?;
    let arm = plugin.param("Arm knob")?.id;
    let status = plugin.param("Knob status")?.id;
    let played = plugin.session(rate_hz, BLOCK, |session| -> Result<_> {
        wait_until_live(session, rate_hz)?;
        // The fingers follow the hand: arming takes the knob its own time.
        let sign = wait_for_sign(session, Say::Set(arm, 1.0), rate_hz)?;
        let lead = (sign + (LEAD_S * rate_hz) as usize).saturating_sub(session.played());
        // The notes alone: breath is the knob's.
        let notes =
            said.iter().filter(|At(_, say)| !matches!(say, Say::Midi([status, ..]) if status & 0xF0 == 0xB0));
        let notes: Vec<At> = notes.map(|At(at, say)| At(at + lead, *say)).collect();
        let first = session.played() + lead;
        let [left, _] = session.play_live(&notes, lead + score.samples, rate_hz)?;
        let breath = breath_sent(session, first, rate_hz);
        Ok((left[lead..].to_vec(), breath))
    })?;
    let (left, breath) = played?;
    let said = plugin.text(status, 0.0)?;
    println!("the plugin says of its knob: {said}");
    drop(plugin);
    drop(simulator);

    let settings = Settings::physical();
    let full = 1e3 * f64::from(settings.breath_full_kpa) / settings.closing_pa();
    Ok(Performance {
        left,
        knob: read_log(&log)?,
        gamma: breath.into_iter().map(|[t, unit]| [t, unit * full]).collect(),
        threshold: threshold(score, &feels, &table, rate),
    })
}

/// Arms the knob and waits for the sign of its hand: the sample at which it begins.
fn wait_for_sign(session: &mut Session, arm: Say, rate_hz: f64) -> Result<usize> {
    let armed_at = session.played();
    let mut said = vec![At(0, arm)];
    while (session.played() - armed_at) as f64 <= PATIENCE_S * rate_hz {
        session.play_live(&said, (STEP_S * rate_hz) as usize, rate_hz)?;
        said.clear();
        let breath = breath_sent(session, armed_at, rate_hz);
        if let Some([t_s, _]) = breath.into_iter().find(|[t_s, unit]| *t_s > 0.0 && *unit > 0.0) {
            return Ok(armed_at + (t_s * rate_hz) as usize);
        }
    }
    bail!("the simulated knob was not armed within {PATIENCE_S:.0} s: its hand does not move")
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

/// What the hand does: for each step from the score's start the angle that blows what the score asks of the note in the
/// fingers, degrees.
fn angles(score: &Score, feels: &InstrumentFeel, table: &FeelTable, rate: u32) -> Vec<f64> {
    let full_pa = 1e3 * f64::from(Settings::physical().breath_full_kpa);
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
                Event::NoteOn { note, .. } => _ = keys.press(note),
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
    angles
}

/// The hand's angles as a script for the simulator, which plays it once the knob is armed.
fn script(angles: &[f64]) -> String {
    let mut text = format!("t_s,angle_deg\n0,0\n{SIGN_S},{SIGN_DEG}\n{},0\n", 2.0 * SIGN_S);
    for (at, angle) in angles.iter().enumerate() {
        let _ = writeln!(text, "{:.3},{angle:.2}", at as f64 * STEP_S + LEAD_S - AHEAD_S);
    }
    text
}

/// Where each note's threshold lies, in degrees and as gamma.
fn threshold(score: &Score, feels: &InstrumentFeel, table: &FeelTable, rate: u32) -> Vec<[f64; 3]> {
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
