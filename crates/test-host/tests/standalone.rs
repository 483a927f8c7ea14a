//! `chalumeau-standalone` as a user starts it; CHALUMEAU_STANDALONE names the program.
#![cfg(unix)]

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, ExitStatus, Output, Stdio};
use std::sync::LazyLock;
use std::time::{Duration, Instant};

/// Where the program keeps its session; empty when the tests begin, so that an earlier run does not count.
static HOME: LazyLock<PathBuf> = LazyLock::new(|| {
    let home = Path::new(env!("CARGO_TARGET_TMPDIR")).join("standalone");
    let _ = std::fs::remove_dir_all(&home);
    home
});

const PATIENCE: Duration = Duration::from_secs(20);

/// The program without a display, and without a JACK server or a sound card that this machine may have.
fn program() -> Command {
    let path = chalumeau_test_host::artefacts::standalone().unwrap();
    let mut command = Command::new(path);
    command
        .env("CHALUMEAU_DATA_DIR", &*HOME)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env("ALSA_CONFIG_PATH", "/dev/null")
        .env("JACK_NO_START_SERVER", "1");
    command
}

fn alone(args: &[&str]) -> Output {
    program().args(args).env("JACK_DEFAULT_SERVER", "chalumeau-no-such-server").output().unwrap()
}

/// A running program; ends with the test.
struct Running {
    child: Child,
    said: BufReader<ChildStderr>,
}

impl Running {
    fn start(args: &[&str]) -> Self {
        Self::spawn(program().args(args))
    }

    fn spawn(command: &mut Command) -> Self {
        let mut child =
            command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let said = BufReader::new(child.stderr.take().unwrap());
        Self { child, said }
    }

    /// Reads until it says that it plays.
    fn wait(&mut self) {
        let mut all = String::new();
        loop {
            let from = all.len();
            let read = self.said.read_line(&mut all).unwrap();
            assert!(read > 0, "ended without playing: {all}");
            if all[from..].starts_with("playing") {
                return;
            }
        }
    }

    /// Ctrl-C.
    fn interrupt(&mut self) -> ExitStatus {
        let asked = Command::new("sh").args(["-c", &format!("kill -INT {}", self.child.id())]).status();
        assert!(asked.unwrap().success());
        self.ended()
    }

    /// Waits for its end.
    fn ended(&mut self) -> ExitStatus {
        let began = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status;
            }
            assert!(began.elapsed() < PATIENCE, "still running");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn it_plays_to_nobody_and_stops_when_asked() {
    let mut running = Running::start(&["--backend", "dummy"]);
    running.wait();
    std::thread::sleep(Duration::from_millis(300));
    assert!(running.interrupt().success());
    let mut rest = String::new();
    running.said.read_to_string(&mut rest).unwrap();
    assert!(!rest.contains("panicked"), "{rest}");
}

#[test]
fn the_next_start_finds_the_settings_of_the_last() {
    let home = tempfile::tempdir().unwrap();
    let plays = |args: &[&str]| {
        let mut command = program();
        command.args(["--backend", "dummy"]).args(args).env("CHALUMEAU_DATA_DIR", home.path());
        let mut running = Running::spawn(&mut command);
        running.wait();
        std::thread::sleep(Duration::from_millis(300));
        assert!(running.interrupt().success());
        let mut said = String::new();
        running.said.read_to_string(&mut said).unwrap();
        let kept = std::fs::read_to_string(home.path().join("chalumeau/session.json")).unwrap();
        let state: serde_json::Value = serde_json::from_str(&kept).unwrap();
        ["instr", "a4"].map(|id| state["params"][id].to_string())
    };
    let first = [r#"{"string":"bflat"}"#, r#"{"f32":440.0}"#];
    let asked = [r#"{"string":"bass"}"#, r#"{"f32":442.0}"#];
    assert_eq!(plays(&[]), first);
    assert_eq!(plays(&["--instrument", "bass", "--a4", "442"]), asked);
    assert_eq!(plays(&[]), asked);
    for kept in ["session-before.json", "session-before-2.json"] {
        assert_eq!(plays(&["--new-session"]), first);
        assert!(home.path().join("chalumeau").join(kept).exists(), "no {kept}");
    }
}

#[test]
fn without_a_device_it_says_what_was_tried_and_what_to_do() {
    let Output { status, stderr, .. } = alone(&[]);
    let said = String::from_utf8(stderr).unwrap();
    assert_eq!(status.code(), Some(1), "{said}");
    for word in
        ["tried jack: no JACK server is running", "tried alsa: ", "--output-device", "--backend dummy"]
    {
        assert!(said.contains(word), "no {word:?} in {said}");
    }
    let Output { status, stderr, .. } = alone(&["--backend", "jack"]);
    let said = String::from_utf8(stderr).unwrap();
    assert_eq!(status.code(), Some(1), "{said}");
    assert!(said.contains("tried jack") && !said.contains("tried alsa"), "{said}");
}

#[test]
fn help_helps_and_mistakes_are_named() {
    let Output { status, stdout, .. } = alone(&["--help"]);
    let said = String::from_utf8(stdout).unwrap();
    assert_eq!(status.code(), Some(0));
    for word in ["--backend", "--midi-input", "--output-device", "Ctrl-C", "Without a display"] {
        assert!(said.contains(word), "no {word:?} in {said}");
    }
    for (args, word) in [
        (["--sample-rate", "800"], "1000..1536000"),
        (["--backend", "oss"], "jack"),
        (["--output-device", "Nonesuch"], "Nonesuch"),
        (["--input-device", "Nonesuch"], "Nonesuch"),
    ] {
        let Output { status, stderr, .. } = alone(&args);
        let said = String::from_utf8(stderr).unwrap();
        assert_eq!(status.code(), Some(2), "{said}");
        assert!(said.contains(word), "no {word:?} in {said}");
    }
}

/// Run by the step that starts a JACK server; the environment names it.
#[test]
#[ignore = "needs a JACK server"]
fn it_plays_to_jack() {
    let mut running = Running::start(&["--backend", "jack"]);
    running.wait();
    let began = Instant::now();
    loop {
        let ports = Command::new("jack_lsp").output().unwrap();
        let ports = String::from_utf8_lossy(&ports.stdout).into_owned();
        if ["chalumeau:output_1", "chalumeau:output_2", "chalumeau:microphone", "chalumeau:midi_input"]
            .iter()
            .all(|port| ports.contains(port))
        {
            break;
        }
        assert!(began.elapsed() < PATIENCE, "{ports}");
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(running.interrupt().success());
}

/// A MIDI device, as a server shows it.
#[cfg(target_os = "linux")]
struct Device;

// SAFETY: the type of the port is one that servers know, whose buffers have a size of their own.
#[cfg(target_os = "linux")]
unsafe impl jack::PortSpec for Device {
    fn jack_port_type(&self) -> &str {
        jack::jack_sys::RAW_MIDI_TYPE
    }

    fn jack_flags(&self) -> jack::PortFlags {
        jack::PortFlags::IS_OUTPUT | jack::PortFlags::IS_PHYSICAL
    }

    fn jack_buffer_size(&self) -> std::ffi::c_ulong {
        0
    }
}

/// Run by the step that starts a JACK server.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "needs a JACK server"]
fn midi_devices_at_jack_play_without_being_named() {
    let (client, _) = jack::Client::new("devices", jack::ClientOptions::NO_START_SERVER).unwrap();
    let plug = |name: &str| client.register_port(name, Device).unwrap();
    let first = plug("keyboard");
    let others = [plug("TorqueTuner"), plug("Midi Through"), plug("virtual keyboard")];
    // A program's port is that program's to connect.
    let program = client.register_port("player", jack::MidiOut::default()).unwrap();
    let client = client.activate_async((), ()).unwrap();
    let mut running = Running::start(&["--backend", "jack"]);
    running.wait();
    const INPUT: &str = "chalumeau:midi_input";
    let plays = |port: &jack::Port<Device>| {
        let began = Instant::now();
        while !port.is_connected_to(INPUT).unwrap() {
            assert!(began.elapsed() < PATIENCE, "{} is not connected", port.name().unwrap());
            std::thread::sleep(Duration::from_millis(20));
        }
    };
    plays(&first);
    plays(&others[2]);
    let later = client.as_client().register_port("wind controller", Device).unwrap();
    plays(&later);
    // What the user takes apart stays apart; the program looks once a second.
    client.as_client().disconnect_ports_by_name("devices:keyboard", INPUT).unwrap();
    std::thread::sleep(Duration::from_millis(2_500));
    for port in [&first, &others[0], &others[1]] {
        assert!(!port.is_connected_to(INPUT).unwrap(), "{}", port.name().unwrap());
    }
    assert!(!program.is_connected_to(INPUT).unwrap());
    assert!(running.interrupt().success());
}

/// Run by the step that starts a display.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "needs a display"]
fn its_window_plays_and_closing_it_is_the_end() {
    let display = std::env::var("DISPLAY").unwrap();
    let screen = chalumeau_test_host::screen::Screen::open(Some(&display)).unwrap();
    let mut command = program();
    command.env("DISPLAY", &display);
    let mut running = Running::spawn(command.args(["--backend", "dummy"]));
    let window = screen.titled("Chalumeau").unwrap();
    let still = screen.settled(window, Duration::from_millis(600)).unwrap();
    let keep = |name: &str| {
        let picture = screen.picture(window).unwrap();
        picture.write(&chalumeau_test_host::machine::target().join("screenshots").join(name)).unwrap();
        picture
    };
    keep("standalone.png");
    // A key of the keyboard along the lower edge, held.
    let (width, height) = screen.size(window).unwrap();
    let at = |share: u32, of: u32| i16::try_from(of * share / 100).unwrap();
    screen.point(window, (at(50, width), i16::try_from(height - 16).unwrap())).unwrap();
    screen.press(true).unwrap();
    std::thread::sleep(Duration::from_millis(1_500));
    let sounding = keep("standalone-playing.png");
    screen.press(false).unwrap();
    assert!(sounding.differing(&still) > 1_000, "nothing sounds");
    screen.ask_to_close(window).unwrap();
    let status = running.ended();
    assert!(status.success(), "{status}");
}

/// A size that was chosen on a larger screen, at which 1100 by 720 points would be 3300 by 2160 pixels.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "needs a display"]
fn its_window_is_no_larger_than_the_screen() {
    let home = tempfile::tempdir().unwrap();
    let start = |display: Option<&str>| {
        let mut command = program();
        command.args(["--backend", "dummy"]).env("CHALUMEAU_DATA_DIR", home.path());
        Running::spawn(command.envs(display.map(|display| ("DISPLAY", display))))
    };
    let mut first = start(None);
    first.wait();
    assert!(first.interrupt().success());
    let path = home.path().join("chalumeau/session.json");
    let kept = std::fs::read_to_string(&path).unwrap();
    let large = kept.replace(r#"\"zoom\":1.0"#, r#"\"zoom\":3.0"#);
    assert_ne!(large, kept, "{kept}");
    std::fs::write(&path, large).unwrap();

    let display = std::env::var("DISPLAY").unwrap();
    let screen = chalumeau_test_host::screen::Screen::open(Some(&display)).unwrap();
    let mut running = start(Some(&display));
    let window = screen.titled("Chalumeau").unwrap();
    screen.settled(window, Duration::from_millis(600)).unwrap();
    let (width, height) = screen.size(window).unwrap();
    let (room_width, room_height) = screen.whole().unwrap();
    assert!(width <= room_width && height <= room_height, "{width} by {height}");
    assert!(2 * width > room_width && 2 * height > room_height, "{width} by {height}: as large as it may be");
    let picture = screen.picture(window).unwrap();
    picture.write(&chalumeau_test_host::machine::target().join("screenshots/standalone-large.png")).unwrap();
    // The size that the user had chosen is not lost.
    screen.ask_to_close(window).unwrap();
    assert!(running.ended().success());
    let after = std::fs::read_to_string(&path).unwrap();
    assert!(after.contains(r#"\"size\":[1100.0,720.0]"#), "{after}");
}
