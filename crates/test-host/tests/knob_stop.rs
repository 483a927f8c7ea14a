//! How torque ends at a knob that the bundled CLAP has armed: the simulated knob's own log tells for how long there was any.
//! `cargo xtask bundle` first.

#[allow(dead_code, reason = "other tests use the rest")]
#[path = "support/live.rs"]
mod live;

use std::thread;
use std::time::{Duration, Instant};

use chalumeau_test_host::clap::{At, Plugin, Say, Session};
use chalumeau_test_host::knob_setup::{connect, wait_until_live};
use chalumeau_test_host::simulator::{Simulator, serial_number};
use live::{BLOCK, E3, RATE, SECOND, on, plugin};

/// In which ways the user's side ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stop {
    PanicParameter,
    AllSoundOff,
    Deactivate,
    Reset,
    Transport,
    NoProcess,
    MainThreadHangs,
}

const STOPS: [Stop; 7] = [
    Stop::PanicParameter,
    Stop::AllSoundOff,
    Stop::Deactivate,
    Stop::Reset,
    Stop::Transport,
    Stop::NoProcess,
    Stop::MainThreadHangs,
];

/// *Arm knob* is off for so long before it is switched on, s: it works after a second.
const OFF_S: f64 = 1.4;
/// Rounds through all of them.
const ROUNDS: usize = 3;

impl Stop {
    /// Longest torque after it, s: after an explicit stop, or after somebody stands still.
    fn limit_s(self) -> f64 {
        if matches!(self, Self::NoProcess | Self::MainThreadHangs) { 0.650 } else { 0.150 }
    }
}

/// Plays for a time with a main thread that attends to the plugin, as a host's does.
fn attended(plugin: &mut Plugin, session: &mut Session, said: &[At], seconds: f64) {
    let mut said = said;
    for _ in 0..(10.0 * seconds).round() as usize {
        session.play_live(said, SECOND / 10, RATE).unwrap();
        plugin.attend();
        said = &[];
    }
}

/// Arms, plays, stops, and waits; seconds from the act of arming to the stop.
fn course(plugin: &mut Plugin, mut session: Session, stop: Stop) -> (Session, f64) {
    let [arm, panic] = ["Arm knob", "Panic"].map(|name| plugin.param(name).unwrap().id);
    session.set_playing(true);
    attended(
        plugin,
        &mut session,
        &[At(0, on(E3)), At(0, Say::Set(arm, 0.0)), At(0, Say::Set(panic, 0.0))],
        OFF_S,
    );
    let armed = Instant::now();
    attended(plugin, &mut session, &[At(0, Say::Set(arm, 1.0))], 1.5);
    let held_s = armed.elapsed().as_secs_f64();
    match stop {
        Stop::PanicParameter => attended(plugin, &mut session, &[At(0, Say::Set(panic, 1.0))], 1.0),
        Stop::AllSoundOff => attended(plugin, &mut session, &[At(0, Say::Midi([0xB0, 120, 0]))], 1.0),
        Stop::Reset => {
            session.reset();
            attended(plugin, &mut session, &[], 1.0);
        }
        Stop::Transport => {
            session.set_playing(false);
            attended(plugin, &mut session, &[], 1.0);
        }
        Stop::Deactivate => {
            plugin.deactivate(session);
            thread::sleep(Duration::from_secs(1));
            session = plugin.activate(RATE, BLOCK).unwrap();
        }
        Stop::NoProcess => {
            for _ in 0..10 {
                thread::sleep(Duration::from_millis(100));
                plugin.attend();
            }
        }
        // The audio goes on; nobody looks at the window.
        Stop::MainThreadHangs => drop(session.play_live(&[], SECOND, RATE).unwrap()),
    }
    (session, held_s)
}

/// Stretches of torque in the log, s, with the strongest of each, mNm: whatever lies less than 0.3 s apart is one.
fn stretches(log: &str) -> Vec<(f64, f64)> {
    let mut found: Vec<(f64, f64, f64)> = Vec::new();
    let rows = log.lines().filter(|line| !line.starts_with('#')).skip(1);
    for cells in rows.map(|line| line.split(',').filter_map(|cell| cell.parse().ok()).collect::<Vec<f64>>()) {
        let (t_s, mnm) = (1e-6 * cells[0], cells[3].abs());
        match found.last_mut() {
            _ if mnm == 0.0 => {}
            Some((_, to_s, most)) if t_s - *to_s < 0.3 => (*to_s, *most) = (t_s, most.max(mnm)),
            _ => found.push((t_s, t_s, mnm)),
        }
    }
    found.iter().map(|(from_s, to_s, most)| (to_s - from_s, *most)).collect()
}

/// What is too late, if anything.
fn late(round: usize) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("knob.csv");
    let number = serial_number();
    let hand = ["--hold", "110", "--log", &path.to_string_lossy()].map(str::to_owned);
    let hand: Vec<&str> = hand.iter().map(String::as_str).collect();
    let serial = format!("{number:016x}");
    let knob = Simulator::start(&[&["--serial-number", serial.as_str()], &hand[..]].concat()).unwrap();
    let mut plugin = plugin();
    connect(&mut plugin, number).unwrap();
    let mut session = plugin.activate(RATE, BLOCK).unwrap();
    wait_until_live(&mut session, RATE).unwrap();
    let arm = plugin.param("Arm knob").unwrap().id;
    // The hand holds it away from a zero that nobody has set, which the first press tells.
    attended(&mut plugin, &mut session, &[At(0, Say::Set(arm, 1.0))], 0.5);
    attended(&mut plugin, &mut session, &[At(0, Say::Set(arm, 0.0))], OFF_S);
    let mut held_s = Vec::new();
    for stop in STOPS {
        let (next, held) = course(&mut plugin, session, stop);
        session = next;
        held_s.push(held);
    }
    plugin.deactivate(session);
    drop(plugin);
    drop(knob);
    let found = stretches(&std::fs::read_to_string(&path).unwrap());
    let mut late = Vec::new();
    if found.len() != STOPS.len() {
        late.push(format!("{} stretches of torque for {} acts", found.len(), STOPS.len()));
    }
    for ((stop, held_s), (torque_s, most)) in STOPS.iter().zip(held_s).zip(found) {
        // Torque begins a moment after the act of arming: what is measured is a little too short.
        let after_s = torque_s - held_s;
        println!(
            "{round} {stop:?}: torque for {:.0} ms after it, {most:.0} mNm at most",
            1e3 * after_s.max(0.0)
        );
        if most < 15.0 || torque_s < held_s - 0.3 {
            late.push(format!("{stop:?}: armed for {torque_s:.2} s of {held_s:.2} with {most:.0} mNm"));
        } else if after_s > stop.limit_s() {
            late.push(format!("{stop:?}: torque for {after_s:.3} s after it"));
        }
    }
    late
}

#[test]
fn torque_ends_with_the_users_word() {
    for round in 0..ROUNDS {
        // A machine that stalls for 80 ms disarms the knob, as it must; the round may have another try.
        let failed = (0..4).map(|_| late(round)).take_while(|late| !late.is_empty()).collect::<Vec<_>>();
        assert!(failed.len() < 4, "{failed:?}");
    }
}
