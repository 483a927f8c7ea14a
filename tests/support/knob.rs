//! A knob for tests: the firmware itself, compiled for this machine, in simulated time or behind a pseudo-terminal.

use chalumeau_firmware::{Firmware, Reading, Setup};
use chalumeau_knob::device::{Announcement, KnobLink, RuntimeDir};
use chalumeau_knob::wire::{Decoder, Message};
use serialport::{SerialPort, TTYPort};
use std::io::{Read, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Fastest that a shaft turns to where it is put, counts a tick: 35 rad/s.
const COUNTS_A_TICK: i64 = 10;

/// The firmware with a shaft that turns to where it is put, whatever the motor does.
pub struct FirmwareKnob {
    pub firmware: Firmware,
    /// Where the shaft shall be, 0.1 degrees.
    pub counts: i64,
    at: i64,
    setup: Setup,
    ticks: u64,
}

impl FirmwareKnob {
    pub fn new(setup: Setup) -> Self {
        let setup = Setup { probes: false, ..setup };
        Self { firmware: Firmware::new(&setup), counts: 0, at: 0, setup, ticks: 0 }
    }

    /// Switched off and on.
    pub fn reboot(&mut self) {
        self.firmware = Firmware::new(&self.setup);
        self.ticks = 0;
    }

    /// Lives until it has been on for `t_us`.
    pub fn run_until(&mut self, t_us: u64) {
        while self.ticks * 500 <= t_us {
            self.at += (self.counts - self.at).clamp(-COUNTS_A_TICK, COUNTS_A_TICK);
            let reading = Reading { counts: self.at, tells_velocity: false, ..Reading::default() };
            self.firmware.tick(self.ticks * 500, &reading);
            self.ticks += 1;
        }
    }

    /// What it has to say.
    pub fn transmit(&mut self) -> Vec<u8> {
        let mut out = vec![0; 1024];
        let length = self.firmware.transmit(&mut out);
        out.truncate(length);
        out
    }
}

/// What a [`PtyKnob`] can be told to do wrong.
#[derive(Default)]
pub struct Faults {
    /// Neither reads nor writes.
    pub stalled: AtomicBool,
    /// Sends noise between its frames.
    pub noisy: AtomicBool,
    /// Starts anew.
    pub reboot: AtomicBool,
}

/// A knob behind a pseudo-terminal, alive on a thread of its own; dropped, it is unplugged.
pub struct PtyKnob {
    pub path: PathBuf,
    pub faults: Arc<Faults>,
    /// Angle of the shaft, 0.1 degrees.
    pub counts: Arc<AtomicI64>,
    armed: Arc<AtomicBool>,
    heard: Arc<Mutex<Vec<(Instant, Message)>>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    _advert: Option<Announcement>,
}

impl PtyKnob {
    /// Plugs it in; announced to `places` as simulated knobs are.
    pub fn plug(places: Option<&RuntimeDir>, setup: &Setup) -> Self {
        let (master, slave) = TTYPort::pair().unwrap();
        let path = PathBuf::from(slave.name().unwrap());
        let advert = places.map(|places| Announcement::publish(places, setup.serial, "test", &path).unwrap());
        let (stop, faults) = (Arc::new(AtomicBool::new(false)), Arc::new(Faults::default()));
        let (counts, armed) = (Arc::new(AtomicI64::new(0)), Arc::new(AtomicBool::new(false)));
        let heard = Arc::new(Mutex::new(Vec::new()));
        let life = Life {
            master,
            _slave: slave,
            device: FirmwareKnob::new(setup.clone()),
            stop: stop.clone(),
            faults: faults.clone(),
            counts: counts.clone(),
            armed: armed.clone(),
            heard: heard.clone(),
        };
        let thread = Some(thread::spawn(move || life.live()));
        Self { path, faults, counts, armed, heard, stop, thread, _advert: advert }
    }

    pub fn is_armed(&self) -> bool {
        self.armed.load(Ordering::Relaxed)
    }

    /// Everything the host has said so far.
    pub fn heard(&self) -> Vec<(Instant, Message)> {
        self.heard.lock().unwrap().clone()
    }
}

impl Drop for PtyKnob {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}

struct Life {
    master: TTYPort,
    /// Kept open, so that the master does not hang up before the host comes.
    _slave: TTYPort,
    device: FirmwareKnob,
    stop: Arc<AtomicBool>,
    faults: Arc<Faults>,
    counts: Arc<AtomicI64>,
    armed: Arc<AtomicBool>,
    heard: Arc<Mutex<Vec<(Instant, Message)>>>,
}

impl Life {
    fn live(mut self) {
        self.master.set_timeout(Duration::from_millis(1)).unwrap();
        let (mut born, mut decoder, mut noise) = (Instant::now(), Decoder::new(), 1u64);
        while !self.stop.load(Ordering::Relaxed) {
            if self.faults.stalled.load(Ordering::Relaxed) {
                thread::sleep(Duration::from_millis(1));
                continue;
            }
            if self.faults.reboot.swap(false, Ordering::Relaxed) {
                self.device.reboot();
                born = Instant::now();
            }
            let mut buffer = [0; 1024];
            if let Ok(length) = self.master.read(&mut buffer) {
                let now = Instant::now();
                let messages = decoder.feed(&buffer[..length]).flatten().map(|(_, message)| (now, message));
                self.heard.lock().unwrap().extend(messages);
                self.device.firmware.receive(&buffer[..length]);
            }
            self.device.counts = self.counts.load(Ordering::Relaxed);
            self.device.run_until(born.elapsed().as_micros() as u64);
            self.armed.store(self.device.firmware.is_armed(), Ordering::Relaxed);
            let mut said = self.device.transmit();
            if self.faults.noisy.load(Ordering::Relaxed) {
                noise = noise.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                said.extend(noise.to_le_bytes().map(|byte| byte.max(1)));
            }
            let _ = self.master.write_all(&said);
        }
    }
}

/// A program that obeys the user, until dropped.
pub struct Obeying {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Obeying {
    pub fn of(link: &KnobLink) -> Self {
        let (heart, stop) = (link.heartbeat("the test"), Arc::new(AtomicBool::new(false)));
        let stopped = stop.clone();
        let thread = thread::spawn(move || {
            while !stopped.load(Ordering::Relaxed) {
                heart.beat();
                thread::sleep(Duration::from_millis(20));
            }
        });
        Self { stop, thread: Some(thread) }
    }
}

impl Drop for Obeying {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}

/// Polls `holds` until it does, for 20 s at most: far beyond what it should take on a busy machine.
#[track_caller]
pub fn soon(what: &str, mut holds: impl FnMut() -> bool) -> Duration {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed() < Duration::from_secs(20), "{what}");
        thread::sleep(Duration::from_millis(2));
    }
    begun.elapsed()
}

/// What a link calls with each measurement.
pub type Record<T> = Box<dyn FnMut(&T) + Send>;

/// A channel for what a hook is told.
pub fn recorder<T: Copy + Send + 'static>() -> (Record<T>, Receiver<T>) {
    let (sender, receiver): (Sender<T>, Receiver<T>) = channel();
    let record = move |value: &T| {
        let _ = sender.send(*value);
    };
    (Box::new(record), receiver)
}
