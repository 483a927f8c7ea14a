//! `chalumeau-standalone` when the JACK server dies, comes back or hangs. The tests start and kill servers of the name in
//! JACK_DEFAULT_SERVER, one after another; CHALUMEAU_JACK_DEATHS says how often (`cargo xtask ci JACK` does all that).
#![cfg(target_os = "linux")]

#[path = "support/wind.rs"]
mod wind;

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use chalumeau_test_host::artefacts;
use chalumeau_test_host::jack::JackServer;
use jack::{
    AsyncClient, AudioIn, AudioOut, Client, ClientOptions, Control, MidiOut, Port, ProcessScope, RawMidi,
};

const PATIENCE: Duration = Duration::from_secs(20);
/// How soon the program must say that the server has gone.
const MESSAGE_WITHIN: Duration = Duration::from_secs(1);
/// How soon a new server must be played to, counted from the start of its process.
const SOUND_WITHIN: Duration = Duration::from_secs(3);
/// How soon the program must end when asked.
const END_WITHIN: Duration = Duration::from_secs(2);
/// Quieter than any note, louder than any silence; full scale is 1.
const AUDIBLE: f32 = 1e-3;
/// Louder than the tongue without breath, which has 0.008; quieter than a blown note.
const BLOWN: f32 = 0.02;

/// One server at a time.
static TURN: Mutex<()> = Mutex::new(());

fn turn() -> MutexGuard<'static, ()> {
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

fn server(rate_hz: u32) -> JackServer {
    JackServer::named(&server_name(), rate_hz).unwrap()
}

fn server_name() -> String {
    std::env::var("JACK_DEFAULT_SERVER").expect("JACK_DEFAULT_SERVER names the server")
}

/// The running program; ends with the test.
struct Program {
    child: Child,
    lines: Receiver<String>,
    said: Vec<String>,
    _home: tempfile::TempDir,
}

impl Program {
    fn start(server: &JackServer, args: &[&str]) -> Self {
        let mut command = Command::new(artefacts::standalone().unwrap());
        command.args(["--backend", "jack", "--no-window"]).args(args);
        // None has a session of another one.
        let home = tempfile::tempdir().unwrap();
        command.env("CHALUMEAU_DATA_DIR", home.path());
        let mut child = server
            .for_clients(&mut command)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let stderr = BufReader::new(child.stderr.take().unwrap());
        let (send, lines) = channel();
        std::thread::spawn(move || stderr.lines().map_while(Result::ok).try_for_each(|line| send.send(line)));
        let mut program = Self { child, lines, said: Vec::new(), _home: home };
        program.says("playing", PATIENCE);
        program
    }

    /// Waits for a line with this in it.
    #[track_caller]
    fn says(&mut self, part: &str, within: Duration) {
        let until = Instant::now() + within;
        loop {
            match self.lines.recv_timeout(until.saturating_duration_since(Instant::now())) {
                Ok(line) => {
                    let is_it = line.contains(part);
                    self.said.push(line);
                    if is_it {
                        return;
                    }
                }
                Err(RecvTimeoutError::Timeout) => panic!("no {part:?} in {within:?}: {:#?}", self.said),
                Err(RecvTimeoutError::Disconnected) => panic!("ended without {part:?}: {:#?}", self.said),
            }
        }
    }

    /// SIGTERM. How it ended, and after what time.
    fn terminate(&mut self) -> (ExitStatus, Duration) {
        let asked = Command::new("sh").args(["-c", &format!("kill {}", self.child.id())]).status();
        assert!(asked.unwrap().success());
        let began = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return (status, began.elapsed());
            }
            assert!(began.elapsed() < PATIENCE, "does not end: {:#?}", self.said);
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    #[track_caller]
    fn ends_soon(&mut self) {
        let (status, after) = self.terminate();
        println!("ended after {after:.2?}: {status}");
        assert!(after <= END_WITHIN, "ended after {after:?}: {:#?}", self.said);
        assert!(status.success(), "{status}: {:#?}", self.said);
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A client that holds a key, listens, and blows when it is told to.
struct Listener {
    client: AsyncClient<(), Ear>,
    heard: Arc<Heard>,
}

/// What the listener heard in the last tenth of a second.
#[derive(Default)]
struct Heard {
    /// Largest sample, the bits of an f32.
    peak: AtomicU32,
    /// Zero crossings per second.
    crossings_hz: AtomicU32,
    /// The listener is to blow.
    blows: AtomicBool,
    /// It lets its key go no more.
    holds: AtomicBool,
}

impl Heard {
    fn peak(&self) -> f32 {
        f32::from_bits(self.peak.load(Ordering::Relaxed))
    }
}

struct Ear {
    input: Port<AudioIn>,
    keys: Port<MidiOut>,
    mouth: Port<AudioOut>,
    /// What the mouth does at rest, and when it blows: a second each.
    breaths: [Vec<f32>; 2],
    blown: usize,
    cycles: u32,
    window: Vec<f32>,
    rate_hz: u32,
    heard: Arc<Heard>,
}

impl jack::ProcessHandler for Ear {
    fn process(&mut self, _: &Client, scope: &ProcessScope) -> Control {
        let mut keys = self.keys.writer(scope);
        // Again and again, because nobody may be connected yet.
        let pressed = self.cycles % 100;
        let holds = self.heard.holds.load(Ordering::Relaxed);
        if let Some(bytes) = [(0, [0x90, 60, 100]), (90, [0x80, 60, 0])].iter().find(|(at, _)| *at == pressed)
            && (!holds || bytes.0 == 0)
        {
            let _ = keys.write(&RawMidi { time: 0, bytes: &bytes.1 });
        }
        self.cycles += 1;
        let breath = &self.breaths[usize::from(self.heard.blows.load(Ordering::Relaxed))];
        for sample in self.mouth.as_mut_slice(scope) {
            *sample = breath[self.blown % breath.len()];
            self.blown += 1;
        }
        self.window.extend_from_slice(self.input.as_slice(scope));
        if self.window.len() >= self.rate_hz as usize / 10 {
            let peak = self.window.iter().fold(0.0_f32, |peak, x| peak.max(x.abs()));
            let up = self.window.windows(2).filter(|pair| pair[0] <= 0.0 && pair[1] > 0.0).count();
            let crossings_hz = up as f32 * self.rate_hz as f32 / self.window.len() as f32;
            self.heard.peak.store(peak.to_bits(), Ordering::Relaxed);
            self.heard.crossings_hz.store(crossings_hz.to_bits(), Ordering::Relaxed);
            self.window.clear();
        }
        Control::Continue
    }
}

impl Listener {
    /// A client of the server as soon as that answers.
    fn join() -> Self {
        let began = Instant::now();
        let client = loop {
            match Client::new("listener", ClientOptions::NO_START_SERVER) {
                Ok((client, _)) => break client,
                Err(reason) => assert!(began.elapsed() < PATIENCE, "{reason}"),
            }
            std::thread::sleep(Duration::from_millis(50));
        };
        let heard = Arc::new(Heard::default());
        let ear = Ear {
            input: client.register_port("in", AudioIn::default()).unwrap(),
            keys: client.register_port("keys", MidiOut::default()).unwrap(),
            mouth: client.register_port("mouth", AudioOut::default()).unwrap(),
            breaths: [wind::quiet(wind::SECOND), wind::wind(2 * wind::SECOND).split_off(wind::SECOND)],
            blown: 0,
            cycles: 0,
            window: Vec::with_capacity(1 << 16),
            rate_hz: client.sample_rate(),
            heard: heard.clone(),
        };
        Self { client: client.activate_async((), ear).unwrap(), heard }
    }

    /// Connects itself to the program.
    fn connect(&self) {
        let client = self.client.as_client();
        client.connect_ports_by_name("chalumeau:output_1", "listener:in").unwrap();
        client.connect_ports_by_name("listener:keys", "chalumeau:midi_input").unwrap();
    }

    /// Waits until it hears the note, and returns its zero crossings per second.
    #[track_caller]
    fn hears(&self, until: Instant) -> f32 {
        while self.heard.peak() < AUDIBLE {
            assert!(Instant::now() < until, "nothing sounds");
            std::thread::sleep(Duration::from_millis(5));
        }
        f32::from_bits(self.heard.crossings_hz.load(Ordering::Relaxed))
    }
}

#[test]
#[ignore = "kills JACK servers"]
fn it_plays_again_after_each_death_of_the_server() {
    let _turn = turn();
    let deaths: u32 = std::env::var("CHALUMEAU_JACK_DEATHS").map_or(3, |count| count.parse().unwrap());
    let mut running = server(48_000);
    let mut program = Program::start(&running, &[]);
    let listener = Listener::join();
    listener.connect();
    listener.hears(Instant::now() + PATIENCE);
    drop(listener);
    // The program notes its connections each second, and keeps the older note.
    let mut listener = Listener::join();
    listener.connect();
    std::thread::sleep(Duration::from_millis(2_200));
    for death in 1..=deaths {
        running.kill().unwrap();
        let killed = Instant::now();
        program.says("the JACK server has ended", MESSAGE_WITHIN);
        let said_after = killed.elapsed();
        drop(listener);
        let began = Instant::now();
        running = JackServer::beginning(&server_name(), 48_000).unwrap();
        // Nobody connects them again but the program.
        listener = Listener::join();
        listener.hears(began + SOUND_WITHIN);
        let sounded_after = began.elapsed();
        program.says("the JACK server is back", MESSAGE_WITHIN);
        println!("death {death}: said after {said_after:.2?}, sounded after {sounded_after:.2?}");
    }
    program.ends_soon();
    drop(listener);
}

#[test]
#[ignore = "kills JACK servers"]
fn the_keys_of_a_device_that_goes_come_up() {
    let _turn = turn();
    let running = server(48_000);
    let mut program = Program::start(&running, &[]);
    let listener = Listener::join();
    listener.heard.holds.store(true, Ordering::Relaxed);
    listener.connect();
    listener.hears(Instant::now() + PATIENCE);
    // The program notes its connections each second. The key is struck again meanwhile, without coming up.
    std::thread::sleep(Duration::from_millis(3_200));
    listener.hears(Instant::now());
    let client = listener.client.as_client();
    client.disconnect_ports_by_name("listener:keys", "chalumeau:midi_input").unwrap();
    let until = Instant::now() + PATIENCE;
    while listener.heard.peak() >= AUDIBLE {
        assert!(Instant::now() < until, "it sounds on: {:#?}", program.said);
        std::thread::sleep(Duration::from_millis(25));
    }
    program.ends_soon();
    drop((listener, running));
}

#[test]
#[ignore = "kills JACK servers"]
fn a_server_at_another_rate_hears_the_same_pitch() {
    let _turn = turn();
    let running = server(48_000);
    let mut program = Program::start(&running, &[]);
    let listener = Listener::join();
    listener.connect();
    listener.hears(Instant::now() + PATIENCE);
    std::thread::sleep(Duration::from_millis(300));
    let before = listener.hears(Instant::now() + PATIENCE);
    running.kill().unwrap();
    program.says("the JACK server has ended", MESSAGE_WITHIN);
    drop(listener);
    let running = server(44_100);
    program.says("the JACK server is back", PATIENCE);
    let listener = Listener::join();
    listener.connect();
    listener.hears(Instant::now() + PATIENCE);
    std::thread::sleep(Duration::from_millis(300));
    let after = listener.hears(Instant::now() + PATIENCE);
    // A program that plays on at the old rate is 8 % flat.
    assert!((after / before - 1.0).abs() < 0.04, "{before} crossings a second, then {after}");
    program.ends_soon();
    drop((listener, running));
}

#[test]
#[ignore = "kills JACK servers"]
fn wind_at_the_microphone_that_was_named_blows_held_keys() {
    let _turn = turn();
    let running = server(48_000);
    let mut program = Program::start(&running, &["--connect-jack-input", "listener:mouth"]);
    let listener = Listener::join();
    listener.connect();
    // Until the program has connected the microphone, which is quiet, velocity blows.
    let until = Instant::now() + PATIENCE;
    let mut silent_for = 0;
    while silent_for < 40 {
        assert!(Instant::now() < until, "keys sound without wind: {:#?}", program.said);
        silent_for = if listener.heard.peak() < BLOWN { silent_for + 1 } else { 0 };
        std::thread::sleep(Duration::from_millis(25));
    }
    listener.heard.blows.store(true, Ordering::Relaxed);
    let until = Instant::now() + PATIENCE;
    while listener.heard.peak() < BLOWN {
        assert!(Instant::now() < until, "wind does not blow: {:#?}", program.said);
        std::thread::sleep(Duration::from_millis(25));
    }
    program.ends_soon();
    drop((listener, running));
}

#[test]
#[ignore = "kills JACK servers"]
fn it_ends_when_asked_though_the_server_has_gone() {
    let _turn = turn();
    let running = server(48_000);
    let mut program = Program::start(&running, &[]);
    running.kill().unwrap();
    program.says("the JACK server has ended", MESSAGE_WITHIN);
    program.ends_soon();
}

#[test]
#[ignore = "kills JACK servers"]
fn it_says_that_the_server_hangs_and_ends_when_asked() {
    let _turn = turn();
    let running = server(48_000);
    let mut program = Program::start(&running, &[]);
    running.freeze(true).unwrap();
    program.says("the JACK server does not call", Duration::from_secs(4));
    running.freeze(false).unwrap();
    program.says("the JACK server is back", MESSAGE_WITHIN);
    running.freeze(true).unwrap();
    program.says("the JACK server does not call", Duration::from_secs(4));
    program.ends_soon();
}
