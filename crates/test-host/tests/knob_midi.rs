//! The simulated knob as a MIDI device: a virtual port of its own, midir's JACK backend on both sides, a JACK server with a
//! dummy driver between them, and the plugin as a CLAP or the command line as its host.
//!
//! `cargo xtask ci MIDI` builds what is needed, starts the server and runs these; without it there is nothing to run them
//! with, so they are marked as ignored.

#[path = "support/live.rs"]
mod live;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use chalumeau_core::analysis::pitch::fundamental_hz;
use chalumeau_core::analysis::to_f64;
use chalumeau_core::units::cents;
use chalumeau_test_host::artefacts;
use chalumeau_test_host::clap::{At, Plugin, Say};
use chalumeau_test_host::knob_setup::{connect_midi, hear_of_zero, wait_until_live};
use chalumeau_test_host::simulator::{Simulator, serial_number};
use live::{BLOCK, E3, RATE, SECOND, breath, level_db, on, play_until, plugin};
use tempfile::TempDir;

/// In the middle of the travel, degrees: sounds, and is felt.
const HAND_DEG: f64 = 200.0;

/// Longer than anything here takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(30);

/// A simulated knob with a MIDI port, and its log.
struct MidiKnob {
    simulator: Simulator,
    log: PathBuf,
    name: String,
    number: u64,
    _folder: TempDir,
}

/// What a line of the log says.
#[derive(Clone, Copy, Debug)]
struct Row {
    t_us: f64,
    angle_deg: f64,
    torque_mnm: f64,
    armed: bool,
    feel_id: u8,
}

impl Row {
    /// The hand has come where it stays; a knob that is being turned is not armed.
    fn is_held(&self) -> bool {
        (self.angle_deg - HAND_DEG).abs() < 1.0
    }
}

impl MidiKnob {
    fn plug() -> Self {
        let number = serial_number();
        Self::plug_as(&format!("TorqueTuner {number:x}"), number)
    }

    /// Nobody holds it until it is armed.
    fn plug_free() -> Self {
        let number = serial_number();
        Self::plug_with(&format!("TorqueTuner {number:x}"), number, &["--wait-armed"])
    }

    fn plug_as(name: &str, number: u64) -> Self {
        Self::plug_with(name, number, &[])
    }

    fn plug_with(name: &str, number: u64, more: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("knob.csv");
        let serial = format!("{number:016x}");
        let hand = HAND_DEG.to_string();
        let log_text = log.to_str().unwrap();
        let args = ["--midi", name, "--serial-number", &serial, "--hold", &hand, "--log", log_text];
        let simulator = Simulator::start(&[&args[..], more].concat()).unwrap();
        assert_eq!(simulator.greeting, format!("midi {name}"));
        Self { simulator, log, name: name.to_owned(), number, _folder: folder }
    }

    fn played_by(&self, plugin: &mut Plugin) {
        connect_midi(plugin, &self.name).unwrap();
    }

    fn rows(&self) -> Vec<Row> {
        rows(&self.log)
    }

    /// Whether the last line of the log says so.
    fn last(&self, says: impl Fn(&Row) -> bool) -> bool {
        self.rows().last().is_some_and(says)
    }

    /// Waits until the log has told something that is new since now.
    #[track_caller]
    fn wait_for(&self, what: &str, holds: impl Fn(&Row) -> bool) {
        let (began, seen) = (Instant::now(), self.rows().len());
        while !self.rows().iter().skip(seen).any(&holds) {
            assert!(began.elapsed() < PATIENCE, "{what} did not come about");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// The log as far as it is written; the last line may be there in part.
fn rows(log: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(log).unwrap();
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    let row = |line: &str| {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        Row {
            t_us: cells[0],
            angle_deg: cells[1],
            torque_mnm: cells[3],
            armed: cells[5] != 0.0,
            feel_id: cells[6] as u8,
        }
    };
    whole.lines().skip(1).map(row).collect()
}

/// The command line as a host of the knob: `chalumeau knob --arm`. Killed when dropped.
struct Host(Child);

impl Host {
    fn arm(knob: &MidiKnob) -> Self {
        let mut host = Command::new(artefacts::program().unwrap());
        host.args(["knob", "--midi", &knob.name, "--written", "E3", "--arm", "150", "--seconds", "600"]);
        Self(host.stdin(Stdio::null()).stdout(Stdio::null()).spawn().unwrap())
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
#[ignore = "needs a JACK server and a build for it: cargo xtask ci MIDI"]
fn a_hand_on_a_midi_knob_plays_the_plugin() {
    let knob = MidiKnob::plug();
    let mut plugin = plugin();
    knob.played_by(&mut plugin);
    let (heard, sent) = plugin
        .session(RATE, BLOCK, |session| {
            wait_until_live(session, RATE).unwrap();
            let [left, _] = session.play_live(&[At(0, on(E3))], 2 * SECOND, RATE).unwrap();
            let fine = session.answers().iter().filter(|(_, said)| said[1] == 34).count();
            assert!(fine > 20, "{fine} times CC34");
            (left, breath(session))
        })
        .unwrap();
    let hz = fundamental_hz(&to_f64(&heard[SECOND..]), RATE).expect("a pitch");
    let off = cents(hz, 146.832);
    println!("breath {sent:.3}, {hz:.2} Hz, {off:+.1} cents, {:.1} dBFS", level_db(&heard[SECOND..]));
    assert!(off.abs() < 20.0, "{hz} Hz");
    assert!((0.35..0.95).contains(&sent), "breath {sent}");
}

#[test]
#[ignore = "needs a JACK server and a build for it: cargo xtask ci MIDI"]
fn feel_reaches_a_midi_knob_and_torque_waits_for_the_user() {
    let knob = MidiKnob::plug();
    let mut plugin = plugin();
    knob.played_by(&mut plugin);
    let arm = plugin.param("Arm knob").unwrap().id;
    plugin
        .session(RATE, BLOCK, |session| {
            wait_until_live(session, RATE).unwrap();
            session.play_live(&[At(0, on(E3))], SECOND, RATE).unwrap();
            play_until(session, "the hand", |_| knob.last(Row::is_held));
            play_until(session, "a feel", |_| knob.last(|row| row.feel_id != 0));
            let idle = knob.rows();
            assert!(idle.iter().all(|row| !row.armed && row.torque_mnm == 0.0), "torque nobody asked for");
            let lowest = idle.last().unwrap().feel_id;

            hear_of_zero(session, arm, RATE).unwrap();
            session.play_live(&[At(0, Say::Set(arm, 1.0))], SECOND / 10, RATE).unwrap();
            let took = play_until(session, "torque", |_| knob.last(|row| row.armed && row.torque_mnm < -5.0));
            println!("felt {:.2} s after Arm as the log has it", took.as_secs_f64());
            session.play_live(&[At(0, on(72))], SECOND / 10, RATE).unwrap();
            play_until(session, "another note's feel", |_| knob.last(|row| row.feel_id != lowest));

            session.play_live(&[At(0, Say::Set(arm, 0.0))], SECOND / 10, RATE).unwrap();
            play_until(session, "no torque", |_| knob.last(|row| !row.armed && row.torque_mnm == 0.0));
        })
        .unwrap();
    let strongest = knob.rows().iter().map(|row| -row.torque_mnm).fold(0.0, f64::max);
    println!("at most {strongest:.1} mNm");
    assert!(strongest <= 100.0, "{strongest} mNm above the ceiling");
}

/// Time from a kill to the end of torque, ms, in the knob's own time.
///
/// The knob's clock at the kill is told by its log: when a line is read, the clock stands there or a little later. Taking it
/// for exact makes the result rather too long.
fn torque_after_the_kill_ms() -> f64 {
    // The command arms without a question where the knob stands at its zero.
    let knob = MidiKnob::plug_free();
    let host = Host::arm(&knob);
    knob.wait_for("torque", |row| row.armed && row.torque_mnm < -10.0);
    let seen = knob.rows().len();
    let killed = Instant::now();
    drop(host);

    let (mut length, mut ahead_us) = (0, f64::INFINITY);
    loop {
        assert!(killed.elapsed() < PATIENCE, "armed {:?} after the kill", killed.elapsed());
        std::thread::sleep(Duration::from_millis(2));
        let rows = knob.rows();
        if rows.len() == length {
            continue;
        }
        length = rows.len();
        let now_us = killed.elapsed().as_secs_f64() * 1e6;
        ahead_us = ahead_us.min(now_us - rows[length - 1].t_us);
        let after = &rows[seen..];
        let Some(end) = after.iter().rposition(|row| row.armed || row.torque_mnm != 0.0) else { continue };
        // Half a second of nothing: that was the end.
        if after.len() - end > 250 {
            return (after[end].t_us + ahead_us) * 1e-3;
        }
    }
}

#[test]
#[ignore = "needs a JACK server and a build for it: cargo xtask ci MIDI"]
fn a_midi_knob_goes_limp_within_400_ms_when_its_host_is_killed() {
    // The knob promises 380 ms from the last ALIVE, and 400 times in simulated time that is held to it. Here the last
    // ALIVE may still be on its way at the kill, and on a busy machine for long: so three kills must be within the time, of
    // nine at most, and none far beyond it.
    let mut took = Vec::new();
    while took.iter().filter(|&&took| took <= 400.0).count() < 3 && took.len() < 9 {
        took.push(torque_after_the_kill_ms());
    }
    println!("torque ends {took:.0?} ms after the kill");
    assert!(took.iter().filter(|&&took| took <= 400.0).count() == 3, "{took:?} ms");
    assert!(
        took.iter().all(|took| (200.0..2_000.0).contains(took)),
        "{took:?} ms: too long, or not the watchdog"
    );
}

#[test]
#[ignore = "needs a JACK server and a build for it: cargo xtask ci MIDI"]
fn an_unplugged_midi_knob_is_found_again_disarmed() {
    let mut knob = MidiKnob::plug();
    let mut plugin = plugin();
    knob.played_by(&mut plugin);
    let arm = plugin.param("Arm knob").unwrap().id;
    let mut session = plugin.activate(RATE, BLOCK).unwrap();
    wait_until_live(&mut session, RATE).unwrap();
    play_until(&mut session, "the hand", |_| knob.last(Row::is_held));
    hear_of_zero(&mut session, arm, RATE).unwrap();
    session.play_live(&[At(0, on(E3)), At(0, Say::Set(arm, 1.0))], SECOND, RATE).unwrap();
    play_until(&mut session, "torque", |_| knob.last(|row| row.armed));

    // So soon that no list of ports has shown the gap, and late enough for all to have noticed.
    for unplugged in [Duration::ZERO, Duration::from_secs(2)] {
        let (name, number, sent) = (knob.name.clone(), knob.number, session.answers().len());
        knob.simulator.unplug().unwrap();
        // Meanwhile the music goes on.
        let plugged = std::thread::spawn(move || {
            std::thread::sleep(unplugged);
            (MidiKnob::plug_as(&name, number), Instant::now())
        });
        let took = play_until(&mut session, "silence", |session| {
            session.answers()[sent..].iter().any(|(_, said)| said[1..] == [2, 0])
        });
        println!("breath ends within {:.1} s of the pull", took.as_secs_f64());
        play_until(&mut session, "the plug", |_| plugged.is_finished());
        let back;
        (knob, back) = plugged.join().unwrap();
        play_until(&mut session, "the knob's return", |session| breath(session) > 0.1);
        let took = back.elapsed();
        println!("plugged in again after {unplugged:?}: back after {:.2} s", took.as_secs_f64());
        assert!(took < Duration::from_secs(5), "{took:?}");
        let [left, _] = session.play_live(&[], SECOND, RATE).unwrap();
        assert!(level_db(&left[SECOND / 2..]) > -60.0, "it does not sound again");
        let rows = knob.rows();
        assert!(
            rows.len() > 100 && rows.iter().all(|row| !row.armed && row.torque_mnm == 0.0),
            "armed again"
        );
    }
    plugin.deactivate(session);
}

#[test]
#[ignore = "needs a JACK server and a build for it: cargo xtask ci MIDI"]
fn the_doctor_hears_a_midi_knob_and_misses_it_when_it_is_gone() {
    let mut knob = MidiKnob::plug();
    let ask = || {
        let mut doctor = Command::new(artefacts::program().unwrap());
        let output = doctor.args(["doctor", "--seconds", "3"]).output().unwrap();
        String::from_utf8(output.stdout).unwrap()
    };
    let found = ask();
    println!("{found}");
    let serial = format!("{:016x}", knob.number);
    for say in [&serial, "tier 2", "no torque 380 ms after silence", "FEEL to its echo"] {
        assert!(found.contains(say), "{say:?} in {found}");
    }
    assert!(!found.contains("not seen"), "{found}");
    knob.simulator.unplug().unwrap();
    std::thread::sleep(Duration::from_secs(1));
    let gone = ask();
    assert!(!gone.contains(&serial), "{gone}");
}
