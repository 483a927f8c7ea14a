//! The link to a knob: one thread finds the knob and keeps the connection. It ends when the [`KnobLink`] is dropped.
//!
//! Other threads talk to it in three ways: commands go through a queue, samples leave through the ring of the
//! [`KnobReader`], and screens copy a status behind a lock. The audio thread only has the reader.

mod bridged;
mod connection;
mod status;
mod worker;

use crate::device::heartbeat::{Heartbeat, Heartbeats, Monitor};
use crate::device::link::worker::{LinkCommand, Worker, WorkerEnds};
use crate::device::reader::{KnobReader, ring};
use crate::device::runtime_dir::RuntimeDir;
use crate::device::session::StateSample;
use crate::device::transport::Transport;
use crate::wire::Feel;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::thread::JoinHandle;
use std::time::Instant;

pub use crate::device::link::status::{LinkStatus, Phase};

/// Which knob to link to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum KnobChoice {
    /// None.
    #[default]
    Off,
    /// A knob at a serial port: the one with this serial number, else the first that answers behind a known board, or
    /// simulated.
    Serial {
        /// INFO's serial number.
        serial: Option<u64>,
    },
    /// The device at this serial port, whatever it is; only for an explicit choice of the user.
    Path(PathBuf),
    /// A knob at a MIDI port whose name contains `name`; without a name, the first port whose name is a known knob's.
    Midi {
        /// Part of the port's name.
        name: Option<String>,
    },
    /// Unmodified firmware that sends OSC to this port of UDP.
    Osc {
        /// Usually 8000.
        port: u16,
        /// Listens to the whole network instead of this machine alone.
        any_address: bool,
    },
}

/// Callbacks of the link to its owner, on the link's thread. Both must return at once.
pub struct Hooks {
    /// The feel wanted now; asked at most 1 ms apart while a knob is there. The link compares, and sends what changes.
    pub feel: Box<dyn FnMut() -> Option<Feel> + Send>,
    /// Every measurement, for recording and study.
    pub on_state: Box<dyn FnMut(&StateSample) + Send>,
}

impl Default for Hooks {
    fn default() -> Self {
        Self { feel: Box::new(|| None), on_state: Box::new(|_| {}) }
    }
}

/// A link to at most one knob. No method waits.
pub struct KnobLink {
    /// `None` once dropping: the thread ends when the queue does.
    commands: Option<Sender<LinkCommand>>,
    status: Arc<Mutex<LinkStatus>>,
    thread: Option<JoinHandle<()>>,
    heartbeats: Heartbeats,
    epoch: Instant,
}

impl KnobLink {
    /// Begins with [`KnobChoice::Off`]. `label` is what other instances show of this one.
    pub fn spawn(label: &str, hooks: Hooks) -> (Self, KnobReader) {
        Self::spawn_in(RuntimeDir::default(), label, hooks)
    }

    /// As [`KnobLink::spawn`], with a given directory for locks and announcements.
    pub fn spawn_in(places: RuntimeDir, label: &str, hooks: Hooks) -> (Self, KnobReader) {
        let epoch = Instant::now();
        let (writer, reader) = ring(epoch);
        let (commands, queue) = channel();
        let status = Arc::new(Mutex::new(LinkStatus::default()));
        let heartbeats = Heartbeats::default();
        let monitor = Monitor::new(heartbeats.clone());
        let ends = WorkerEnds { commands: queue, monitor, status: status.clone(), writer };
        let worker = Worker::new(places, label, hooks, ends, epoch);
        // A system without another thread to give plays without a knob.
        let thread = thread::Builder::new().name("chalumeau knob".into()).spawn(move || worker.run()).ok();
        (Self { commands: Some(commands), status, thread, heartbeats, epoch }, reader)
    }

    /// Links to another knob; the one before is left, disarmed.
    pub fn choose(&self, choice: KnobChoice) {
        self.tell(LinkCommand::Choose(choice));
    }

    /// Links to a port that is open already, until it fails; for tests and simulators within the program.
    pub fn attach(&self, transport: Box<dyn Transport>) {
        self.tell(LinkCommand::Attach(transport));
    }

    /// The sign of life of a thread that obeys the user; `name` completes "... has stood still". A knob is armed, and stays
    /// so, only while there is one and all of them beat, see [`heartbeat`](crate::device::heartbeat).
    pub fn heartbeat(&self, name: &'static str) -> Heartbeat {
        self.heartbeats.register(name)
    }

    /// Allows torque up to `ceiling_mnm`, at most 250: only ever call it for an act of the user.
    pub fn arm(&self, ceiling_mnm: u16) {
        self.tell(LinkCommand::Arm { ceiling_mnm, further_act: false });
    }

    /// Allows torque up to `ceiling_mnm`, at most 450: only ever call it after a second question to the user.
    pub fn arm_beyond_offer(&self, ceiling_mnm: u16) {
        self.tell(LinkCommand::Arm { ceiling_mnm, further_act: true });
    }

    /// Lowers the ceiling of an armed knob at once; never raises it.
    pub fn lower_ceiling(&self, ceiling_mnm: u16) {
        self.tell(LinkCommand::LowerCeiling(ceiling_mnm));
    }

    /// Torque off.
    pub fn disarm(&self) {
        self.tell(LinkCommand::Disarm);
    }

    /// The present position becomes zero. The knob refuses while it is armed.
    pub fn zero(&self) {
        self.tell(LinkCommand::Zero);
    }

    /// Asks the instance that has the knob to let go, and takes it.
    pub fn take_over(&self) {
        self.tell(LinkCommand::TakeOver);
    }

    /// Also sends the feel as OSC to this address while the knob is armed, see [`feel_osc`](crate::device::feel_osc). A knob
    /// that can only be read is armed for this alone.
    pub fn feel_osc(&self, to: Option<SocketAddr>) {
        self.tell(LinkCommand::FeelOsc(to));
    }

    /// The status for screens. Takes a lock: not for the audio thread.
    pub fn status(&self) -> LinkStatus {
        self.status.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The zero of all host times.
    pub fn epoch(&self) -> Instant {
        self.epoch
    }

    fn tell(&self, command: LinkCommand) {
        if let Some(commands) = &self.commands {
            let _ = commands.send(command);
        }
    }
}

impl Drop for KnobLink {
    fn drop(&mut self) {
        self.commands = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // a panicked thread has already been reported
        }
    }
}
