//! One open port with what is known of the device behind it.

use crate::device::link::Hooks;
use crate::device::lock::{Holder, LockError, Ownership};
use crate::device::osc;
use crate::device::osc::StockMessage;
use crate::device::reader::KnobWriter;
use crate::device::runtime_dir::RuntimeDir;
use crate::device::session::{HostSession, SessionEvent, SessionOutput, SessionStatus, StateSample};
use crate::device::stats::{LinkStats, Meter};
use crate::device::stock::StockTracker;
use crate::device::transport::{Binding, Transport};
use crate::wire::Feel;
use std::io;
use std::thread;
use std::time::{Duration, Instant};

/// Longest wait for bytes in one round, so that a changed feel goes out at once.
const WAIT: Duration = Duration::from_millis(1);

/// A board that starts anew when its port is opened needs as long as this to answer, us.
const BOOT_US: i64 = 5_000_000;

/// A knob that has spoken and is silent for this long is lost, us. By judgement: twice what makes the breath stop, and
/// soon enough to be back within two seconds.
const LOST_US: i64 = 500_000;

/// The same over MIDI, us: little more than what makes STATE too old, to be back within two seconds here too.
const LOST_MIDI_US: i64 = 1_000_000;

/// How often the owner looks whether another instance wants the knob, us.
const WANTED_US: i64 = 100_000;

/// Least time between two SysEx, kept before the last one too.
const MIDI_SLOT: Duration = Duration::from_millis(20);

/// Why a connection ended.
#[derive(Debug)]
pub enum ConnectionEnd {
    /// The port is gone, or the knob fell silent: why.
    Gone(String),
    /// Nothing known has answered.
    NoAnswer,
    /// The knob is not the one that was chosen.
    AnotherKnob(u64),
    /// Unmodified firmware has told its name.
    Stock(String),
    /// Another instance has this knob.
    Held(u64, Holder),
    /// Another instance wanted the knob, or the port, of this number, and has been let.
    LetGo(u64, Holder),
}

enum Protocol {
    Session(Box<HostSession>),
    Stock(Box<StockTracker>, Box<Meter>),
}

/// See the module.
pub struct Connection {
    transport: Box<dyn Transport>,
    brain: Protocol,
    owned: Vec<Ownership>,
    is_claimed: bool,
    next_wanted_us: i64,
    ignored: u64,
    last: Option<StateSample>,
    button: bool,
}

/// Samples on their way to the audio thread and to whoever records.
pub struct Outlet<'a> {
    /// To the audio thread.
    pub writer: &'a mut KnobWriter,
    /// To whoever records.
    pub hooks: &'a mut Hooks,
    /// What host times count from.
    pub epoch: Instant,
}

impl Outlet<'_> {
    fn now_us(&self) -> i64 {
        self.epoch.elapsed().as_micros() as i64
    }

    fn state(&mut self, state: &StateSample) {
        self.writer.push(state.into());
        (self.hooks.on_state)(state);
    }
}

impl Connection {
    /// Begins with an open port; `owned` are the locks that were taken for it.
    pub fn new(transport: Box<dyn Transport>, owned: Vec<Ownership>, number: u32, now_us: i64) -> Self {
        let brain = match transport.binding() {
            Binding::Osc => Protocol::Stock(Box::default(), Box::new(Meter::new(now_us))),
            binding => Protocol::Session(Box::new(HostSession::new(binding, number, now_us))),
        };
        let (is_claimed, ignored) = (false, 0);
        Self {
            transport,
            brain,
            owned,
            is_claimed,
            next_wanted_us: now_us,
            ignored,
            last: None,
            button: false,
        }
    }

    /// The session, if the device speaks TTLink or might.
    pub fn session(&mut self) -> Option<&mut HostSession> {
        match &mut self.brain {
            Protocol::Session(session) => Some(session),
            Protocol::Stock(..) => None,
        }
    }

    /// Name of the port.
    pub fn port(&self) -> String {
        self.transport.describe()
    }

    /// The last measurement.
    pub fn last(&self) -> Option<&StateSample> {
        self.last.as_ref()
    }

    /// True while the knob's button is down.
    pub fn button(&self) -> bool {
        self.button
    }

    /// True while unmodified firmware is heard.
    pub fn is_stock_heard(&self, now_us: i64) -> bool {
        matches!(&self.brain, Protocol::Stock(tracker, _) if tracker.heard_us().is_some_and(|at| now_us - at < LOST_US))
    }

    /// What unmodified firmware did that a hand cannot.
    pub fn stock_notice(&self) -> Option<String> {
        let Protocol::Stock(tracker, _) = &self.brain else { return None };
        let (jumps, degrees) = tracker.jumps();
        (jumps > 0).then(|| {
            format!("the knob jumped by {degrees:.0} degrees, as if it had restarted; its new position is zero now")
        })
    }

    /// The present position becomes zero.
    pub fn zero(&mut self) {
        match &mut self.brain {
            Protocol::Session(session) => session.zero(),
            Protocol::Stock(tracker, _) => tracker.zero(),
        }
    }

    /// Counts and times. Sorts: not for every loop.
    pub fn stats(&self) -> LinkStats {
        let stats = match &self.brain {
            Protocol::Session(session) => session.stats(),
            Protocol::Stock(_, meter) => meter.picture(),
        };
        LinkStats { ignored: self.ignored, ..stats }
    }

    /// One round: sends what is due, takes in what comes, waits 1 ms at most.
    pub fn round(&mut self, feel: Option<Feel>, outlet: &mut Outlet) -> Result<(), ConnectionEnd> {
        // A knob that may be another's is not played.
        let is_played = self.is_claimed || self.transport.binding() == Binding::Midi;
        let mut last = self.last;
        let mut button = self.button;
        let mut failed = None;
        let received = match &mut self.brain {
            Protocol::Session(session) => {
                if let Some(feel) = feel {
                    session.want_feel(feel);
                }
                let transport = &mut self.transport;
                let mut send = |wish: SessionOutput| {
                    let done = match wish {
                        SessionOutput::Send(bytes) => transport.send(bytes),
                        SessionOutput::Baud(baud) => transport.set_baud(baud),
                    };
                    // What does not fit now is said again in time.
                    if let Err(e) = done
                        && e.kind() != io::ErrorKind::WouldBlock
                    {
                        failed = Some(e);
                    }
                };
                let mut tell = |outlet: &mut Outlet, what: SessionEvent| match what {
                    _ if !is_played => {}
                    SessionEvent::State(state) => {
                        last = Some(state);
                        outlet.state(&state);
                    }
                    SessionEvent::Slap(speed) => outlet.writer.slap(speed),
                    SessionEvent::Button(down) => button = down,
                };
                session.poll(outlet.now_us(), &mut send, &mut |what| tell(outlet, what));
                self.transport.poll(WAIT, &mut |chunk| {
                    session.receive(outlet.now_us(), chunk, &mut |what| tell(outlet, what));
                })
            }
            Protocol::Stock(tracker, meter) => {
                let ignored = &mut self.ignored;
                let received = self.transport.poll(WAIT, &mut |datagram| {
                    let now_us = outlet.now_us();
                    *ignored += osc::read(datagram, |word| {
                        if let StockMessage::Angle(_) = word {
                            meter.state(0);
                        }
                        if let Some(speed) = tracker.hear(word, now_us) {
                            outlet.writer.slap(speed);
                        }
                    });
                });
                let now_us = outlet.now_us();
                meter.tick(now_us);
                tracker.poll(now_us, &mut |state| {
                    last = Some(state);
                    outlet.state(&state);
                });
                received
            }
        };
        (self.last, self.button) = (last, button);
        match received.err().or(failed) {
            Some(e) => Err(ConnectionEnd::Gone(format!("{}: {e}", self.transport.describe()))),
            None => Ok(()),
        }
    }

    /// Whether the connection shall go on: the right knob, owned, alive, not wanted by others.
    pub fn check(
        &mut self,
        places: &RuntimeDir,
        label: &str,
        wanted_serial: Option<u64>,
        now_us: i64,
    ) -> Result<(), ConnectionEnd> {
        if now_us >= self.next_wanted_us {
            self.next_wanted_us = now_us + WANTED_US;
            for ownership in &self.owned {
                if let Some(holder) = ownership.wanted_by() {
                    return Err(ConnectionEnd::LetGo(ownership.serial(), holder));
                }
            }
        }
        let Protocol::Session(session) = &self.brain else { return Ok(()) };
        let silent_us = now_us - session.heard_us().unwrap_or(session.opened_us());
        let lost_us = if self.transport.binding() == Binding::Midi { LOST_MIDI_US } else { LOST_US };
        match session.status(now_us) {
            SessionStatus::Stock(name) => return Err(ConnectionEnd::Stock(name)),
            // MIDI devices that only send control changes rest for as long as they like.
            SessionStatus::Greeting | SessionStatus::PlainMidi
                if self.transport.binding() == Binding::Midi => {}
            _ if session.heard_us().is_none() && silent_us > BOOT_US => return Err(ConnectionEnd::NoAnswer),
            _ if session.heard_us().is_some() && silent_us > lost_us => {
                return Err(ConnectionEnd::Gone("the knob sends nothing".into()));
            }
            _ => {}
        }
        if let Some(info) = session.info().filter(|_| !self.is_claimed) {
            let serial = info.serial;
            if wanted_serial.is_some_and(|wanted| wanted != serial) {
                return Err(ConnectionEnd::AnotherKnob(serial));
            }
            self.is_claimed = true;
            let is_ours = self.owned.iter().any(|ownership| ownership.serial() == serial);
            if !is_ours {
                match Ownership::take(places, serial, label, &self.transport.describe()) {
                    Ok(ownership) => self.owned.push(ownership),
                    Err(LockError::Held(holder)) => return Err(ConnectionEnd::Held(serial, holder)),
                    // Without a place for locks the port itself is still ours alone.
                    Err(LockError::Io(_)) => {}
                }
            }
        }
        Ok(())
    }

    /// Leaves: torque off, and everything free for others.
    pub fn close(mut self) {
        if let Protocol::Session(session) = &mut self.brain {
            if self.transport.binding() == Binding::Midi {
                thread::sleep(MIDI_SLOT);
            }
            let transport = &mut self.transport;
            session.bye(&mut |wish| {
                if let SessionOutput::Send(bytes) = wish {
                    let _ = transport.send(bytes);
                }
            });
        }
    }
}
