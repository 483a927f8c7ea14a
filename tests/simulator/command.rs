//! `chalumeau knob-sim` as a user and a host meet it. Limits of time are those of a very busy machine.

use chalumeau_firmware::Setup;
use chalumeau_knob::device::memory;
use chalumeau_knob::device::serial::{OpenError, SerialTransport};
use chalumeau_knob::device::transport::{Binding, Transport};
use chalumeau_knob::simulator::hand::{HandDesign, SimulatedHand};
use chalumeau_knob::simulator::knob::SimulatedKnob;
use chalumeau_knob::simulator::plant::PlantDesign;
use chalumeau_knob::simulator::script::{Aim, Script};
use chalumeau_knob::simulator::serve::{Control, Port, Server};
use chalumeau_knob::wire::midi::{FromKnob, MidiReceiver, encode_sysex};
use chalumeau_knob::wire::{Decoder, Info, Message, encode};
use serialport::{SerialPort, TTYPort};
use std::fs;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const PATIENCE: Duration = Duration::from_secs(60);

/// A running command; killed if its test fails.
struct Running {
    child: Child,
    lines: BufReader<ChildStdout>,
    directory: TempDir,
}

impl Running {
    fn start(arguments: &str) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_chalumeau"))
            .arg("knob-sim")
            .args(arguments.split_whitespace())
            .current_dir(directory.path())
            .env("CHALUMEAU_RUNTIME_DIR", directory.path())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap());
        Self { child, lines, directory }
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.lines.read_line(&mut line).unwrap();
        line.trim_end().to_owned()
    }

    fn port(&mut self) -> PathBuf {
        let line = self.line();
        PathBuf::from(line.strip_prefix("serial ").unwrap_or_else(|| panic!("{line:?}")))
    }

    fn card(&self) -> PathBuf {
        self.directory.path().join("chalumeau/knobs/000000000000c1a2.toml")
    }

    /// Code it ended with.
    fn end(&mut self) -> Option<i32> {
        let end = Instant::now() + PATIENCE;
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status.code();
            }
            assert!(Instant::now() < end, "it does not end");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The other end of a pair of ports.
struct OtherEnd(TTYPort);

impl Transport for OtherEnd {
    fn binding(&self) -> Binding {
        Binding::Serial
    }

    fn poll(&mut self, wait: Duration, sink: &mut dyn FnMut(&[u8])) -> io::Result<()> {
        self.0.set_timeout(wait)?;
        let mut buffer = [0; 1024];
        match self.0.read(&mut buffer) {
            Ok(read) => sink(&buffer[..read]),
            Err(e) if e.kind() == io::ErrorKind::TimedOut => {}
            Err(e) => return Err(e),
        }
        Ok(())
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)
    }

    fn describe(&self) -> String {
        self.0.name().unwrap_or_default()
    }
}

/// Says hello until INFO comes.
fn greet(transport: &mut dyn Transport, session: u32) -> Info {
    let end = Instant::now() + PATIENCE;
    let (mut decoder, mut receiver) = (Decoder::new(), MidiReceiver::new());
    let is_midi = transport.binding() == Binding::Midi;
    let mut info = None;
    while info.is_none() && Instant::now() < end {
        let hello = Message::Hello { major: 1, minor: 1, session };
        let sent = if is_midi {
            transport.send(&encode_sysex(&hello, 0))
        } else {
            transport.send(&encode(&hello, 0))
        };
        sent.unwrap();
        for _ in 0..25 {
            let mut take = |message| {
                if let Message::Info(heard) = message
                    && heard.session == session
                {
                    info = Some(heard);
                }
            };
            let poll = transport.poll(Duration::from_millis(10), &mut |bytes| {
                if is_midi {
                    receiver.feed(bytes, 0, |heard| {
                        if let FromKnob::Frame(Ok((_, message))) = heard {
                            take(message);
                        }
                    });
                } else {
                    decoder.feed(bytes).flatten().for_each(|(_, message)| take(message));
                }
            });
            poll.unwrap();
        }
    }
    info.expect("no INFO within a minute")
}

#[test]
fn it_takes_one_end_of_a_pair_of_ports() {
    let (host, end) = TTYPort::pair().unwrap();
    let path = end.name().unwrap();
    drop(end);
    let mut simulator = Running::start(&format!("--quiet --serial-number c1a2 --path {path}"));
    assert_eq!(simulator.line(), format!("serial {path}"));
    assert_eq!(greet(&mut OtherEnd(host), 7).serial, 0xc1a2);
    let mut missing = Running::start("--quiet --path /dev/not-there");
    assert_eq!(missing.end(), Some(2));
}

/// Opens a port that another host has just closed. A program that starts at that moment may hold a copy of it until it runs.
fn opened(path: &Path) -> SerialTransport {
    let end = Instant::now() + PATIENCE;
    loop {
        match SerialTransport::open(path) {
            Err(OpenError::Busy(_)) if Instant::now() < end => std::thread::sleep(Duration::from_millis(10)),
            other => return other.unwrap(),
        }
    }
}

#[test]
fn host_after_host_is_answered_until_interrupted() {
    let mut knob = Running::start("--quiet --serial-number c1a2");
    let path = knob.port();
    assert!(fs::read_to_string(knob.card()).unwrap().contains(path.to_str().unwrap()));
    for session in 1..=3 {
        let mut port = opened(&path);
        let info = greet(&mut port, session);
        assert_eq!((info.serial, info.watchdog_ms), (0xC1A2, 80));
    }
    let interrupted =
        Command::new("sh").args(["-c", &format!("kill -INT {}", knob.child.id())]).status().unwrap();
    assert!(interrupted.success());
    assert_eq!(knob.end(), Some(0));
    assert!(!knob.card().exists(), "the announcement is withdrawn");
}

#[test]
fn unplugged_knob_comes_back_at_a_port_of_its_own() {
    let mut knob = Running::start("--quiet --serial-number c1a2 --fault unplug@0.5:0.5");
    let first = knob.port();
    let mut port = SerialTransport::open(&first).unwrap();
    let end = Instant::now() + PATIENCE;
    while port.poll(Duration::from_millis(10), &mut |_| ()).is_ok() {
        assert!(Instant::now() < end, "the host does not notice");
    }
    let second = knob.port();
    drop(port);
    assert_eq!(greet(&mut SerialTransport::open(&second).unwrap(), 7).serial, 0xC1A2);
    let card = fs::read_to_string(knob.card()).unwrap();
    assert!(card.contains(second.to_str().unwrap()), "{card}");
}

#[test]
fn log_tells_what_the_hand_did() {
    let mut knob = Running::start("--hold 45 --seconds 2 --log knob.csv --stiffness 1");
    assert_eq!(knob.end(), Some(0));
    let log = fs::read_to_string(knob.directory.path().join("knob.csv")).unwrap();
    let mut lines = log.lines();
    assert_eq!(lines.next(), Some("t_us,angle_deg,velocity_rpm,torque_mnm,hand_mnm,armed,feel_id"));
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|field| field.parse().unwrap()).collect()).collect();
    assert!(rows.windows(2).all(|w| w[1][0] - w[0][0] == 2000.0), "500 lines a second of the knob's time");
    let last = rows.last().unwrap();
    assert!((last[1] - 45.0).abs() < 1.5 && last[5] == 0.0, "{last:?}");
}

#[test]
fn stock_firmware_reports_by_osc() {
    let ear = UdpSocket::bind("127.0.0.1:0").unwrap();
    ear.set_read_timeout(Some(PATIENCE)).unwrap();
    let to = ear.local_addr().unwrap();
    let mut knob = Running::start(&format!("--osc {to} --hold 30 --quiet"));
    assert_eq!(knob.line(), format!("osc {to}"));
    let mut buffer = [0; 1500];
    let mut names = Vec::new();
    for _ in 0..16 {
        let length = ear.recv(&mut buffer).unwrap();
        let text = String::from_utf8_lossy(&buffer[..length]).into_owned();
        names.push(text.split('\0').next().unwrap().to_owned());
    }
    for name in ["angle_out", "velocity", "trigger", "angle_discrete", "flow", "pluck", "st", "button"] {
        let address = format!("/TorqueTuner_001/instrument/{name}");
        assert_eq!(names.iter().filter(|n| **n == address).count(), 2, "{names:?}");
    }
}

#[test]
fn mistakes_are_explained() {
    for (arguments, says) in [
        ("--script none.csv", "cannot read none.csv"),
        ("--crescendo 1:2", "FROM:TO:SECONDS"),
        ("--hold 1 --press 2", "cannot be used with"),
        ("--loop", "required"),
        ("--fault fire@1", "there are drop, corrupt"),
        ("--osc nowhere", "no HOST:PORT"),
        ("--misspelt", "--osc"),
        ("--serial-number 0", "hexadecimal"),
        ("--log no/such/folder/x.csv", "directory no/such/folder does not exist"),
        ("--log kept.csv", "exists already"),
    ] {
        let directory = tempfile::tempdir().unwrap();
        let kept = directory.path().join("kept.csv");
        std::fs::write(&kept, "mine").unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_chalumeau"))
            .args(["knob-sim", "--seconds", "0"])
            .args(arguments.split_whitespace())
            .current_dir(directory.path())
            .env("CHALUMEAU_RUNTIME_DIR", directory.path())
            .output()
            .unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments}: {said}");
        assert!(said.contains(says) && !said.contains("panicked"), "{arguments}: {said}");
        assert_eq!(std::fs::read_to_string(&kept).unwrap(), "mine", "{arguments}");
    }
}

#[test]
fn knob_within_the_program_speaks_midi_and_obeys() {
    let setup = Setup { midi: true, serial: 0xC1A3, ..Setup::default() };
    let knob =
        SimulatedKnob::new(setup, PlantDesign::default(), SimulatedHand::new(HandDesign::default(), 1), 1);
    let (device, mut host) = memory::pair(Binding::Midi, "a wire");
    let running = Server::new(knob, Port::Wire(Box::new(device))).spawn().unwrap();
    assert_eq!(greet(&mut host, 9).watchdog_ms, 330);
    running.tell(Control::Aim(Aim::Angle(20.0)));
    let (mut receiver, end) = (MidiReceiver::new(), Instant::now() + PATIENCE);
    let mut tenths_deg = 0;
    while (tenths_deg - 200i32).abs() > 20 {
        assert!(Instant::now() < end, "{tenths_deg}");
        let poll = host.poll(Duration::from_millis(10), &mut |bytes| {
            receiver.feed(bytes, 0, |heard| {
                if let FromKnob::Angle(angle) = heard {
                    tenths_deg = angle;
                }
            });
        });
        poll.unwrap();
    }
    assert!(running.finish().is_ok());
}

#[test]
fn example_hands_can_be_read_and_stay_below_over_speed() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/hands");
    let mut count = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let script = Script::read_csv(fs::File::open(&path).unwrap());
        let script = script.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let deg = |ms: u32| match script.at(f64::from(ms) / 1000.0).aim {
            Aim::Angle(deg) => deg,
            Aim::Force(_) => 0.0,
        };
        let fastest = (1..10_000).map(|ms| (deg(ms) - deg(ms - 1)).abs() * 1000.0).fold(0.0, f64::max);
        assert!(fastest.to_radians() < 45.0, "{}: {fastest} degrees a second", path.display());
        count += 1;
    }
    assert!(count >= 4);
}
