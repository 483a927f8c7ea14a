//! `chalumeau knob` and `chalumeau doctor` as programs, at the other end of a pseudo-terminal: how torque ends when the
//! program is stopped, its terminal held or the program interrupted; and what both make of knobs that misbehave.
#![cfg(unix)]

#[allow(dead_code, reason = "other tests use the rest")]
#[path = "support/knob.rs"]
mod knob;
#[allow(dead_code, reason = "other tests use the rest")]
#[path = "../crates/knob/tests/support/misbehaving_knobs.rs"]
mod misbehaving_knobs;

use chalumeau_firmware::Setup;
use chalumeau_knob::wire::Message;
use knob::{PtyKnob, soon};
use misbehaving_knobs::{FakeKnob, Misbehaving, all};
use serialport::{SerialPort, TTYPort};
use std::fs;
use std::fs::OpenOptions;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// These tests follow a clock: one at a time, or they disturb each other.
static ALONE: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Most memory of the program with a knob of any kind, KiB.
const MOST_KIB: u64 = 25 * 1024;

fn chalumeau(directory: &TempDir, path: &Path, command: &str, more: &[&str]) -> Command {
    let mut chalumeau = Command::new(env!("CARGO_BIN_EXE_chalumeau"));
    chalumeau.env("CHALUMEAU_RUNTIME_DIR", directory.path()).arg(command).arg("--path").arg(path).args(more);
    chalumeau
}

/// Ends with the test.
struct Running(Child);

impl Running {
    fn signal(&self, name: &str) {
        // The shell's own `kill`: small systems have no program of this name.
        let sent = Command::new("sh").args(["-c", &format!("kill {name} {}", self.0.id())]).status().unwrap();
        assert!(sent.success());
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The soft start is through: torque is what the feel wants.
fn armed(knob: &PtyKnob) {
    soon("armed", || knob.is_armed());
    thread::sleep(Duration::from_millis(300));
    assert!(knob.is_armed());
}

fn limp(knob: &PtyKnob) -> Duration {
    soon("limp", || !knob.is_armed())
}

fn stays_limp(knob: &PtyKnob) {
    let end = Instant::now() + Duration::from_millis(700);
    while Instant::now() < end {
        assert!(!knob.is_armed(), "armed without an act of the user");
        thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_stopped_program_lets_go_and_arms_nothing_when_it_goes_on() {
    let (_alone, directory) = (alone(), tempfile::tempdir().unwrap());
    let knob = PtyKnob::plug(None, &Setup::default());
    let mut command = chalumeau(&directory, &knob.path, "knob", &["--arm", "60"]);
    let running = Running(command.stderr(Stdio::null()).spawn().unwrap());
    armed(&knob);
    running.signal("-STOP");
    let took = limp(&knob);
    println!("stopped: limp after {took:?}");
    // 130 ms and what the machine needs to notice it.
    assert!(took < Duration::from_millis(650), "{took:?}");
    running.signal("-CONT");
    stays_limp(&knob);
}

#[test]
fn a_program_whose_terminal_is_held_lets_go() {
    let (_alone, directory) = (alone(), tempfile::tempdir().unwrap());
    let knob = PtyKnob::plug(None, &Setup::default());
    let (mut terminal, slave) = TTYPort::pair().unwrap();
    let name = slave.name().unwrap();
    // The slave as a terminal that people use: Ctrl-S holds its output.
    let cooked = Command::new("stty").args(["-F", &name, "sane", "ixon"]).status().unwrap();
    assert!(cooked.success());
    let screen = OpenOptions::new().read(true).write(true).open(&name).unwrap();
    let mut command = chalumeau(&directory, &knob.path, "knob", &["--arm", "60"]);
    let running = Running(command.stderr(Stdio::from(screen)).spawn().unwrap());
    terminal.set_timeout(Duration::from_millis(10)).unwrap();
    let stop = Arc::new(AtomicBool::new(false));
    let mut reader = terminal.try_clone_native().unwrap();
    let stopped = stop.clone();
    let shown = thread::spawn(move || {
        let mut all = Vec::new();
        while !stopped.load(Ordering::Relaxed) {
            let mut bytes = [0; 1024];
            if let Ok(length) = reader.read(&mut bytes) {
                all.extend_from_slice(&bytes[..length]);
            }
        }
        String::from_utf8_lossy(&all).into_owned()
    });
    armed(&knob);
    terminal.write_all(&[0x13]).unwrap(); // Ctrl-S
    let took = limp(&knob);
    println!("held: limp after {took:?}");
    assert!(took < Duration::from_millis(1_000), "{took:?}");
    // What it sends goes on: the link's thread runs.
    let alive = |message: &&(Instant, Message)| matches!(message.1, Message::Alive(_));
    let heard = knob.heard();
    let last = heard.iter().rfind(alive).unwrap().0;
    assert!(heard.iter().any(|(at, message)| matches!(message, Message::Free) && *at > last));
    terminal.write_all(&[0x11]).unwrap(); // Ctrl-Q
    stays_limp(&knob);
    running.signal("-INT");
    stop.store(true, Ordering::Relaxed);
    let shown = shown.join().unwrap();
    assert!(shown.contains("gamma"), "{shown}");
    drop(slave);
}

#[test]
fn an_interrupted_program_lets_go_at_once_and_ends() {
    let (_alone, directory) = (alone(), tempfile::tempdir().unwrap());
    let knob = PtyKnob::plug(None, &Setup::default());
    let mut command = chalumeau(&directory, &knob.path, "knob", &["--arm", "60"]);
    let mut running = Running(command.stderr(Stdio::null()).spawn().unwrap());
    armed(&knob);
    running.signal("-INT");
    let took = limp(&knob);
    println!("interrupted: limp after {took:?}");
    assert!(took < Duration::from_millis(150), "{took:?}");
    soon("ended", || running.0.try_wait().unwrap().is_some());
    assert!(knob.heard().iter().any(|(_, message)| matches!(message, Message::Bye { .. })));
}

fn arms(knob: &PtyKnob) -> usize {
    knob.heard().iter().filter(|(_, message)| matches!(message, Message::Arm(_))).count()
}

#[test]
fn a_knob_that_another_program_has_is_not_armed_later() {
    let (_alone, directory) = (alone(), tempfile::tempdir().unwrap());
    let knob = PtyKnob::plug(None, &Setup::default());
    let mut first = chalumeau(&directory, &knob.path, "knob", &[]);
    let first = Running(first.stderr(Stdio::null()).spawn().unwrap());
    let is_alive = |message: &(Instant, Message)| matches!(message.1, Message::Alive(_));
    soon("the first program has it", || knob.heard().iter().any(is_alive));
    let mut second = chalumeau(&directory, &knob.path, "knob", &["--arm", "60"]);
    let mut second = Running(second.stdin(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap());
    soon("the second program ends", || second.0.try_wait().unwrap().is_some());
    let mut said = String::new();
    second.0.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert!(!second.0.wait().unwrap().success());
    assert!(said.contains("not armed") && said.contains("in use by"), "{said}");
    drop(first);
    stays_limp(&knob);
    assert_eq!(arms(&knob), 0);
}

/// A knob that answers only two seconds after the program has begun to look for it, and the program, which wants to arm it.
struct Late {
    knob: PtyKnob,
    running: Running,
    shown: Arc<Mutex<Vec<u8>>>,
    reading: JoinHandle<()>,
}

impl Late {
    fn new(directory: &TempDir, stdin: Stdio) -> Self {
        let knob = PtyKnob::plug(None, &Setup::default());
        knob.faults.stalled.store(true, Ordering::Relaxed);
        let mut command = chalumeau(directory, &knob.path, "knob", &["--arm", "60"]);
        let mut running = Running(command.stdin(stdin).stderr(Stdio::piped()).spawn().unwrap());
        let mut out = running.0.stderr.take().unwrap();
        let shown = Arc::new(Mutex::new(Vec::new()));
        let kept = shown.clone();
        let reading = thread::spawn(move || {
            let mut bytes = [0; 256];
            while let Ok(length @ 1..) = out.read(&mut bytes) {
                kept.lock().unwrap().extend_from_slice(&bytes[..length]);
            }
        });
        let late = Self { knob, running, shown, reading };
        soon("the program looks for it", || late.said().contains("waiting for an answer"));
        thread::sleep(Duration::from_secs(2));
        late.knob.faults.stalled.store(false, Ordering::Relaxed);
        late
    }

    fn said(&self) -> String {
        String::from_utf8_lossy(&self.shown.lock().unwrap()).into_owned()
    }
}

#[test]
fn a_knob_that_answers_late_is_armed_after_enter_alone() {
    let (_alone, directory) = (alone(), tempfile::tempdir().unwrap());
    let mut late = Late::new(&directory, Stdio::null());
    soon("ended", || late.running.0.try_wait().unwrap().is_some());
    soon("told", || late.said().contains("nobody is at a terminal"));
    assert!(!late.running.0.wait().unwrap().success());
    assert_eq!(arms(&late.knob), 0);

    let (mut terminal, slave) = TTYPort::pair().unwrap();
    let name = slave.name().unwrap();
    assert!(Command::new("stty").args(["-F", &name, "sane"]).status().unwrap().success());
    let keys = OpenOptions::new().read(true).write(true).open(&name).unwrap();
    let late = Late::new(&directory, Stdio::from(keys));
    soon("asked", || late.said().contains("press Enter"));
    stays_limp(&late.knob);
    assert_eq!(arms(&late.knob), 0);
    terminal.write_all(b"\n").unwrap();
    armed(&late.knob);
    late.running.signal("-INT");
    limp(&late.knob);
    drop(late.running);
    late.reading.join().unwrap();
    drop(slave);
}

#[test]
fn arming_with_the_usual_feel_works_and_more_than_250_mnm_needs_an_answer() {
    let (_alone, directory) = (alone(), tempfile::tempdir().unwrap());
    let run = |mnm: &str, answer: &str| {
        let knob = PtyKnob::plug(None, &Setup::default());
        let mut command = chalumeau(&directory, &knob.path, "knob", &["--arm", mnm, "--seconds", "1"]);
        let mut child =
            command.stdin(Stdio::piped()).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
        child.stdin.take().unwrap().write_all(answer.as_bytes()).unwrap();
        let output = child.wait_with_output().unwrap();
        let ceilings: Vec<u16> = knob
            .heard()
            .iter()
            .filter_map(|(_, message)| match message {
                Message::Arm(arm) => Some(arm.ceiling_mnm),
                _ => None,
            })
            .collect();
        (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned(), ceilings)
    };
    let (ok, said, ceilings) = run("60", "");
    assert!(ok && ceilings == [60], "{ceilings:?}: {said}");
    assert!(said.contains("weakened from 55 to"), "{said}");
    let (ok, said, ceilings) = run("300", "yes\n");
    assert!(!ok && ceilings.is_empty(), "{ceilings:?}");
    assert!(said.contains("Type 300 and Enter") && said.contains("300 was not typed"), "{said}");
    let (ok, said, ceilings) = run("300", "300\n");
    assert!(ok && ceilings == [300], "{ceilings:?}: {said}");
}

/// A script sees it in the exit code, as a person does in the line.
#[test]
fn a_knob_that_lets_go_by_itself_is_a_failure() {
    let (_alone, directory) = (alone(), tempfile::tempdir().unwrap());
    let knob = PtyKnob::plug(None, &Setup::default());
    let mut command = chalumeau(&directory, &knob.path, "knob", &["--arm", "60", "--seconds", "6"]);
    let child = command.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    armed(&knob);
    knob.faults.reboot.store(true, Ordering::Relaxed);
    limp(&knob);
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
}

/// A knob that misbehaves behind a pseudo-terminal, until dropped.
struct FakePty {
    path: PathBuf,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<FakeKnob>>,
}

impl FakePty {
    fn plug(kind: Misbehaving) -> Self {
        let (mut master, slave) = TTYPort::pair().unwrap();
        let path = PathBuf::from(slave.name().unwrap());
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = stop.clone();
        let thread = thread::spawn(move || {
            master.set_timeout(Duration::from_millis(1)).unwrap();
            let (mut knob, born) = (FakeKnob::new(kind), Instant::now());
            while !stopped.load(Ordering::Relaxed) {
                let mut buffer = [0; 1024];
                let length = master.read(&mut buffer).unwrap_or(0);
                let mut heard = &buffer[..length];
                while u128::from(knob.ms()) < born.elapsed().as_millis() {
                    let _ = master.write_all(&knob.tick(std::mem::take(&mut heard)));
                }
                if !heard.is_empty() {
                    let _ = master.write_all(&knob.tick(heard));
                }
            }
            drop(slave);
            knob
        });
        Self { path, stop, thread: Some(thread) }
    }

    fn unplug(mut self) -> FakeKnob {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap()
    }
}

/// What a program printed, and the most memory that it had, KiB.
fn watched(mut child: Child) -> (bool, String, u64) {
    let mut out = child.stdout.take().unwrap();
    let reader = thread::spawn(move || {
        let mut text = Vec::new();
        out.read_to_end(&mut text).unwrap();
        String::from_utf8_lossy(&text).into_owned()
    });
    let mut most_kib = 0;
    let status = loop {
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kib = peak.and_then(|text| text.trim().trim_end_matches(" kB").parse().ok());
        most_kib = most_kib.max(kib.unwrap_or(0));
        match child.try_wait().unwrap() {
            Some(status) => break status,
            None => thread::sleep(Duration::from_millis(20)),
        }
    };
    // With or without a knob that answers, it came to its end.
    (matches!(status.code(), Some(0 | 1)), reader.join().unwrap(), most_kib)
}

#[test]
fn doctor_tells_each_misbehaving_knob_apart_in_25_mb() {
    let (_alone, kinds) = (alone(), all());
    assert!(kinds.len() >= 40);
    let mut most = 0;
    // Eight at a time: each waits seconds for answers.
    for some in kinds.chunks(8) {
        let running: Vec<_> = some
            .iter()
            .map(|kind| {
                let (directory, knob) = (tempfile::tempdir().unwrap(), FakePty::plug(*kind));
                let mut command = chalumeau(&directory, &knob.path, "doctor", &["--seconds", "4"]);
                let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
                let watching = thread::spawn(move || watched(child));
                (kind, directory, knob, watching)
            })
            .collect();
        for (kind, _directory, knob, watching) in running {
            let (ok, said, kib) = watching.join().unwrap();
            let fake = knob.unplug();
            most = most.max(kib);
            assert!(ok, "{}: {said}", kind.name);
            assert!(said.contains(kind.doctor), "{}: {:?} is not in {said}", kind.name, kind.doctor);
            let is_plain = said.chars().all(|c| c == '\n' || !c.is_control());
            assert!(is_plain, "{}: {said:?}", kind.name);
            let arms = fake.heard.iter().filter(|(_, message)| matches!(message, Message::Arm(_))).count();
            assert_eq!(arms, 0, "{}: the doctor arms", kind.name);
        }
    }
    println!("doctor on {} knobs: at most {most} KiB", kinds.len());
    assert!(most > 0 && most <= MOST_KIB, "{most} KiB");
}
