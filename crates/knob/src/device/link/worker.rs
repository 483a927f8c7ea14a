//! The link's thread: chooses ports, keeps one connection, and publishes the status.

use crate::device::discover;
use crate::device::discover::Candidate;
use crate::device::feel_osc::FeelSender;
use crate::device::heartbeat::Monitor;
use crate::device::link::bridged::BridgedFeel;
use crate::device::link::connection::{Connection, ConnectionEnd, Outlet};
use crate::device::link::status::{LinkStatus, Phase};
use crate::device::link::{Hooks, KnobChoice};
use crate::device::lock;
use crate::device::lock::{LockError, Ownership};
use crate::device::midi::{MidiError, MidiTransport};
use crate::device::osc::OscTransport;
use crate::device::reader::KnobWriter;
use crate::device::runtime_dir::{RuntimeDir, serial_text};
use crate::device::serial::{OpenError, SerialTransport};
use crate::device::session::{SessionStatus, ZERO_IS_LOST};
use crate::device::stats::LinkStats;
use crate::device::transport::Transport;
use std::hash::{BuildHasher, RandomState};
use std::io;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Shortest time between two attempts, us.
const RETRY_LEAST_US: i64 = 250_000;

/// Longest time between two attempts, us. While there is nothing to open the shortest holds: looking costs nothing.
const RETRY_MOST_US: i64 = 2_000_000;

/// Time between two attempts while another instance lets go, us.
const RETRY_TAKING_US: i64 = 25_000;

/// How long an instance that was asked has to let go, us.
const TAKING_US: i64 = 3_000_000;

/// How long an instance that has let go keeps its hands off, us.
const YIELD_US: i64 = 3_000_000;

/// Longest rest without a connection: commands wake it.
const REST: Duration = Duration::from_millis(10);

/// Time between two pictures for screens, us.
const STATUS_US: i64 = 40_000;

/// Time between two pictures of counts and times, us: they sort.
const STATS_US: i64 = 200_000;

/// What a link is told.
pub enum LinkCommand {
    Choose(KnobChoice),
    Attach(Box<dyn Transport>),
    Arm { ceiling_mnm: u16, further_act: bool },
    LowerCeiling(u16),
    Disarm,
    Zero,
    TakeOver,
    FeelOsc(Option<SocketAddr>),
}

/// The worker's ends of what it shares with the link and its users.
pub struct WorkerEnds {
    pub commands: Receiver<LinkCommand>,
    pub monitor: Monitor,
    pub status: Arc<Mutex<LinkStatus>>,
    pub writer: KnobWriter,
}

/// See the module.
pub struct Worker {
    places: RuntimeDir,
    label: String,
    hooks: Hooks,
    commands: Receiver<LinkCommand>,
    monitor: Monitor,
    status: Arc<Mutex<LinkStatus>>,
    writer: KnobWriter,
    epoch: Instant,
    random: RandomState,
    openings: u64,
    choice: KnobChoice,
    connection: Option<Connection>,
    bridged: BridgedFeel,
    /// What keeps the knob away; shown while there is no connection.
    trouble: Phase,
    /// Serial number of the knob another instance has.
    held: Option<u64>,
    last_serial: Option<u64>,
    last_port: String,
    lost_us: Option<i64>,
    /// A knob that was lost is back, and has been neither zeroed nor armed since.
    has_returned: bool,
    losses: u32,
    next_try_us: i64,
    retry_us: i64,
    cursor: usize,
    taking_until_us: i64,
    refusal: Option<String>,
    stats: LinkStats,
    next_status_us: i64,
    next_stats_us: i64,
}

/// A port that did not open, and whose it is if another instance has it.
struct Trouble {
    phase: Phase,
    held: Option<u64>,
}

impl From<Phase> for Trouble {
    fn from(phase: Phase) -> Self {
        Self { phase, held: None }
    }
}

impl Worker {
    pub fn new(
        places: RuntimeDir,
        label: &str,
        hooks: Hooks,
        WorkerEnds { commands, monitor, status, writer }: WorkerEnds,
        epoch: Instant,
    ) -> Self {
        Self {
            places,
            label: label.into(),
            hooks,
            commands,
            monitor,
            status,
            writer,
            epoch,
            random: RandomState::new(),
            openings: 0,
            choice: KnobChoice::Off,
            connection: None,
            bridged: BridgedFeel::default(),
            trouble: Phase::Off,
            held: None,
            last_serial: None,
            last_port: String::new(),
            lost_us: None,
            has_returned: false,
            losses: 0,
            next_try_us: 0,
            retry_us: RETRY_LEAST_US,
            cursor: 0,
            taking_until_us: i64::MIN,
            refusal: None,
            stats: LinkStats::default(),
            next_status_us: 0,
            next_stats_us: 0,
        }
    }

    /// Until the queue of commands ends.
    pub fn run(mut self) {
        loop {
            let rest = if self.connection.is_some() { Duration::ZERO } else { self.rest() };
            match self.commands.recv_timeout(rest) {
                Ok(command) => {
                    self.obey(command);
                    continue;
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            self.watch_heartbeats();
            let feel = (self.hooks.feel)();
            let now_us = self.now_us();
            let session = self.connection.as_mut().and_then(Connection::session);
            let armed_mnm = session.filter(|session| session.is_armed()).map(|session| session.ceiling_mnm());
            self.bridged.poll(feel.as_ref(), armed_mnm, now_us);
            if self.connection.is_none() && now_us >= self.next_try_us && self.choice != KnobChoice::Off {
                self.try_open(now_us);
            }
            let mut outlet = Outlet { writer: &mut self.writer, hooks: &mut self.hooks, epoch: self.epoch };
            let ended = match &mut self.connection {
                Some(connection) => connection.round(feel, &mut outlet).and_then(|()| {
                    let wanted = match self.choice {
                        KnobChoice::Serial { serial } => serial,
                        _ => None,
                    };
                    let now_us = self.epoch.elapsed().as_micros() as i64;
                    connection.check(&self.places, &self.label, wanted, now_us)
                }),
                None => Ok(()),
            };
            match ended {
                Ok(()) => self.note_live(),
                Err(end) => self.ended(end),
            }
            self.publish(false);
        }
        self.close();
    }

    fn now_us(&self) -> i64 {
        self.epoch.elapsed().as_micros() as i64
    }

    /// Tells the session, or what goes to a bridge, who still obeys the user.
    fn watch_heartbeats(&mut self) {
        let now_us = self.now_us();
        let pulse = self.monitor.look(now_us);
        let is_heard = self.is_stock_heard(now_us);
        self.bridged.watch(&pulse, is_heard, now_us);
        let Some(session) = self.connection.as_mut().and_then(Connection::session) else { return };
        match pulse.oldest {
            Some((at_us, who)) => session.obeyed(at_us, who),
            None => session.unobeyed(),
        }
        if let Some(release) = pulse.released {
            session.let_go(release.text(), now_us);
        }
    }

    fn is_stock_heard(&self, now_us: i64) -> bool {
        self.connection.as_ref().is_some_and(|connection| connection.is_stock_heard(now_us))
    }

    /// Arms a knob that has no session, by way of a bridge.
    fn arm_bridged(&mut self, ceiling_mnm: u16, further_act: bool, now_us: i64) -> Result<(), String> {
        if self.connection.is_none() {
            return Err("not armed: no knob is connected".into());
        }
        let (pulse, is_heard) = (self.monitor.look(now_us), self.is_stock_heard(now_us));
        self.bridged.arm(ceiling_mnm, further_act, &pulse, is_heard, now_us)
    }

    fn rest(&self) -> Duration {
        match self.choice {
            KnobChoice::Off => 5 * REST,
            _ => Duration::from_micros((self.next_try_us - self.now_us()).clamp(0, 10_000) as u64).min(REST),
        }
    }

    fn obey(&mut self, command: LinkCommand) {
        let now_us = self.now_us();
        let session = self.connection.as_mut().and_then(Connection::session);
        match (command, session) {
            (LinkCommand::Choose(choice), _) => self.choose(choice),
            (LinkCommand::Attach(transport), _) => {
                self.close();
                self.lost_us = None;
                self.open(transport, Vec::new(), now_us);
            }
            (LinkCommand::Arm { ceiling_mnm, further_act }, Some(session)) => {
                self.refusal = None;
                // Whoever has just registered counts from now on.
                let pulse = self.monitor.look(now_us);
                match pulse.oldest {
                    Some((at_us, who)) => session.obeyed(at_us, who),
                    None => session.unobeyed(),
                }
                match pulse.released {
                    // Which of the two came first is not known.
                    Some(release) => session.let_go(release.text(), now_us),
                    None => session.arm(ceiling_mnm, further_act, now_us),
                }
            }
            (LinkCommand::Arm { ceiling_mnm, further_act }, None) => {
                self.refusal = self.arm_bridged(ceiling_mnm, further_act, now_us).err();
            }
            (LinkCommand::LowerCeiling(ceiling_mnm), Some(session)) => session.lower_ceiling(ceiling_mnm),
            (LinkCommand::LowerCeiling(ceiling_mnm), None) => self.bridged.lower(ceiling_mnm),
            (LinkCommand::Disarm, Some(session)) => session.disarm(now_us),
            (LinkCommand::Disarm, None) => self.bridged.disarm(),
            (LinkCommand::Zero, _) => {
                if let Some(connection) = &mut self.connection {
                    connection.zero();
                }
            }
            (LinkCommand::TakeOver, _) => self.take_over(now_us),
            (LinkCommand::FeelOsc(to), _) => {
                let sender = to.and_then(|to| match FeelSender::new(to) {
                    Ok(sender) => Some(sender),
                    Err(e) => {
                        self.refusal = Some(format!("the feel cannot be sent to {to}: {e}"));
                        None
                    }
                });
                self.bridged.send_to(sender);
            }
        }
        self.publish(true);
    }

    fn choose(&mut self, choice: KnobChoice) {
        if choice == self.choice {
            return;
        }
        self.close();
        self.trouble = if choice == KnobChoice::Off { Phase::Off } else { Phase::Searching };
        (self.held, self.last_serial, self.lost_us, self.refusal) = (None, None, None, None);
        self.has_returned = false;
        (self.next_try_us, self.retry_us, self.cursor, self.taking_until_us) =
            (0, RETRY_LEAST_US, 0, i64::MIN);
        self.last_port.clear();
        self.choice = choice;
    }

    fn take_over(&mut self, now_us: i64) {
        let Some(serial) = self.held else { return };
        match lock::ask_for(&self.places, serial, &self.label) {
            Ok(()) => (self.taking_until_us, self.next_try_us) = (now_us + TAKING_US, now_us),
            Err(e) => self.refusal = Some(format!("cannot ask for the knob: {e}")),
        }
    }

    fn close(&mut self) {
        self.bridged.disarm();
        if let Some(connection) = self.connection.take() {
            connection.close();
        }
    }

    /// A knob that is there ends every trouble before it.
    fn note_live(&mut self) {
        let now_us = self.now_us();
        let Some(connection) = &mut self.connection else { return };
        let is_stock = connection.is_stock_heard(now_us);
        let session = connection.session();
        let is_live = session.as_ref().is_some_and(|session| {
            matches!(
                session.status(now_us),
                SessionStatus::Live | SessionStatus::OtherVersion | SessionStatus::PlainMidi
            )
        });
        if is_live || is_stock {
            let is_settled =
                session.as_ref().is_some_and(|session| session.zeros() > 0 || session.is_armed());
            self.has_returned = (self.has_returned || self.lost_us.is_some()) && !is_settled;
            self.last_serial =
                session.and_then(|session| session.info().map(|info| info.serial)).or(self.last_serial);
            (self.lost_us, self.held, self.retry_us) = (None, None, RETRY_LEAST_US);
            self.trouble = Phase::Searching;
        }
    }

    fn ended(&mut self, end: ConnectionEnd) {
        let now_us = self.now_us();
        let Some(mut connection) = self.connection.take() else { return };
        self.bridged.disarm();
        let port = connection.port();
        let was_there = connection.session().is_none_or(|session| session.heard_us().is_some());
        self.next_try_us = now_us + RETRY_LEAST_US;
        match end {
            ConnectionEnd::Gone(why) => {
                if was_there {
                    self.losses += 1;
                    self.lost_us = Some(now_us);
                } else {
                    self.trouble = Phase::Failed(why);
                }
            }
            ConnectionEnd::LetGo(serial, holder) => {
                (self.trouble, self.held) = (Phase::HeldBy(holder.to_string()), Some(serial));
                self.next_try_us = now_us + YIELD_US;
            }
            ConnectionEnd::Held(serial, holder) => {
                (self.trouble, self.held) = (Phase::HeldBy(holder.to_string()), Some(serial));
                self.back_off(now_us);
            }
            ConnectionEnd::Stock(name) => {
                self.trouble = Phase::StockSerial(name);
                self.back_off(now_us);
            }
            ConnectionEnd::NoAnswer => {
                self.trouble = Phase::NoAnswer(format!(
                    "no known device answers at {port}: does it run the firmware in firmware/?"
                ));
                self.back_off(now_us);
            }
            ConnectionEnd::AnotherKnob(serial) => {
                let text = format!(
                    "the knob at {port} has serial number {}; another one was chosen",
                    serial_text(serial)
                );
                self.trouble = Phase::NoAnswer(text);
                self.back_off(now_us);
            }
        }
        connection.close();
        self.cursor += 1;
        self.publish(true);
    }

    fn back_off(&mut self, now_us: i64) {
        if now_us < self.taking_until_us {
            self.next_try_us = now_us + RETRY_TAKING_US;
            return;
        }
        self.next_try_us = now_us + self.retry_us;
        self.retry_us = (2 * self.retry_us).min(RETRY_MOST_US);
    }

    fn try_open(&mut self, now_us: i64) {
        let opened = match self.choice.clone() {
            KnobChoice::Off => return,
            KnobChoice::Serial { serial } => self.open_serial(serial),
            KnobChoice::Path(path) => self.open_path(&path),
            KnobChoice::Midi { name } => self.open_midi(name.as_deref()),
            KnobChoice::Osc { port, any_address } => self.open_osc(port, any_address),
        };
        match opened {
            Ok((transport, owned)) => self.open(transport, owned, now_us),
            Err(Trouble { phase: Phase::Searching, .. }) => {
                // Nothing to open: what was wrong with it before no longer matters.
                (self.trouble, self.held) = (Phase::Searching, None);
                self.retry_us = RETRY_LEAST_US;
                self.next_try_us = now_us + RETRY_LEAST_US;
            }
            Err(Trouble { phase, held }) => {
                (self.trouble, self.held) = (phase, held);
                self.back_off(now_us);
            }
        }
    }

    fn open(&mut self, transport: Box<dyn Transport>, owned: Vec<Ownership>, now_us: i64) {
        self.openings += 1;
        let number = self.random.hash_one(self.openings) as u32;
        self.last_port = transport.describe();
        self.connection = Some(Connection::new(transport, owned, number, now_us));
        self.publish(true);
    }

    fn open_serial(&mut self, wanted: Option<u64>) -> Opened {
        let mut list = discover::candidates(&self.places);
        // A hint that cannot be wrong decides; any other only says which port to try first.
        list.retain(|c| !c.is_certain() || wanted.is_none() || c.serial_hint() == wanted);
        let favourite = wanted.or(self.last_serial);
        let is_favourite = |c: &Candidate| favourite.is_some() && c.serial_hint() == favourite;
        list.sort_by_key(|c| !is_favourite(c));
        if list.first().is_some_and(is_favourite) {
            self.cursor = 0;
        }
        let mut worst = Trouble::from(Phase::Searching);
        for n in 0..list.len() {
            let candidate = &list[(self.cursor + n) % list.len()];
            let owned = match candidate.serial_hint().filter(|_| candidate.is_certain()) {
                Some(serial) => self.own(serial, &candidate.path.to_string_lossy()),
                None => Ok(Vec::new()),
            };
            let opened = owned.and_then(|owned| Ok((self.open_port(&candidate.path)?, owned)));
            match opened {
                Ok(opened) => {
                    self.cursor += n;
                    return Ok(opened);
                }
                Err(trouble) if trouble.phase.rank() >= worst.phase.rank() => worst = trouble,
                Err(_) => {}
            }
        }
        Err(worst)
    }

    fn open_path(&mut self, path: &Path) -> Opened {
        Ok((self.open_port(path)?, Vec::new()))
    }

    fn open_port(&self, path: &Path) -> Result<Box<dyn Transport>, Trouble> {
        match SerialTransport::open(path) {
            Ok(port) => Ok(Box::new(port)),
            Err(OpenError::Missing(text)) => {
                let is_chosen = matches!(self.choice, KnobChoice::Path(_)) && self.lost_us.is_none();
                Err(if is_chosen { Phase::Failed(text) } else { Phase::Searching }.into())
            }
            Err(OpenError::Permission(text)) => Err(Phase::NoPermission(text).into()),
            Err(OpenError::Busy(text)) => {
                Err(match lock::holder_of_port(&self.places, &path.to_string_lossy()) {
                    Some((serial, holder)) => {
                        Trouble { phase: Phase::HeldBy(holder.to_string()), held: Some(serial) }
                    }
                    None => Phase::Busy(text).into(),
                })
            }
            Err(OpenError::Other(text)) => Err(Phase::Failed(text).into()),
        }
    }

    fn open_midi(&mut self, name: Option<&str>) -> Opened {
        let transport = MidiTransport::open(name).map_err(|e| match e {
            MidiError::Missing(_) => Phase::Searching,
            MidiError::Unavailable(_) | MidiError::Refused { .. } => Phase::Failed(e.to_string()),
        })?;
        let owned = self.own(port_serial(&transport.describe()), &transport.describe())?;
        Ok((Box::new(transport), owned))
    }

    fn open_osc(&mut self, port: u16, any_address: bool) -> Opened {
        let name = format!("UDP port {port}");
        let owned = self.own(port_serial(&name), &name)?;
        let transport = OscTransport::open(port, any_address).map_err(|e| match e.kind() {
            io::ErrorKind::AddrInUse => Phase::Busy(format!(
                "{name} is in use by another program: close that program, or set another port on both sides"
            )),
            _ => Phase::Failed(format!("{name} does not open: {e}")),
        })?;
        Ok((Box::new(transport), owned))
    }

    /// Takes the lock of a knob, or of a port that has no knob's number.
    fn own(&self, serial: u64, port: &str) -> Result<Vec<Ownership>, Trouble> {
        match Ownership::take(&self.places, serial, &self.label, port) {
            Ok(ownership) => Ok(vec![ownership]),
            Err(LockError::Held(holder)) => {
                Err(Trouble { phase: Phase::HeldBy(holder.to_string()), held: Some(serial) })
            }
            // Without a place for locks the port itself is still ours alone.
            Err(LockError::Io(_)) => Ok(Vec::new()),
        }
    }

    fn publish(&mut self, at_once: bool) {
        let now_us = self.now_us();
        if !at_once && now_us < self.next_status_us {
            return;
        }
        self.next_status_us = now_us + STATUS_US;
        if now_us >= self.next_stats_us {
            self.next_stats_us = now_us + STATS_US;
            self.stats = self.connection.as_ref().map_or_else(LinkStats::default, Connection::stats);
            self.stats.losses = self.losses;
        }
        let picture = self.picture(now_us);
        *self.status.lock().unwrap_or_else(PoisonError::into_inner) = picture;
    }

    fn picture(&mut self, now_us: i64) -> LinkStatus {
        let lost = self.lost_us.map(|at| Phase::Lost { seconds: (now_us - at) as f32 * 1e-6 });
        let mut status =
            LinkStatus { port: self.last_port.clone(), stats: self.stats, ..LinkStatus::default() };
        status.last_refusal = self.refusal.clone();
        status.serial = self.held;
        status.phase = match &mut self.connection {
            // What needs somebody to act is told before what only needs patience.
            None if self.trouble.rank() > 0 => self.trouble.clone(),
            None => lost.unwrap_or_else(|| self.trouble.clone()),
            Some(connection) => {
                status.angle_deg = connection.last().map(|state| state.angle_deg);
                status.torque_mnm = connection.last().and_then(|state| state.torque_mnm);
                status.button = connection.button();
                status.notice =
                    connection.stock_notice().or_else(|| self.bridged.notice().map(str::to_owned));
                status.armed = self.bridged.ceiling_mnm().is_some();
                status.ceiling_mnm = self.bridged.ceiling_mnm().unwrap_or_default();
                status.restriction = self.bridged.warning().map(str::to_owned);
                let is_stock_heard = connection.is_stock_heard(now_us);
                match connection.session() {
                    None if is_stock_heard => Phase::ReadOnly,
                    None => Phase::Waiting,
                    Some(session) => {
                        status.info = session.info().copied();
                        status.serial = status.info.map(|info| info.serial);
                        (status.armed, status.arming) = (session.is_armed(), session.is_arming());
                        (status.zeros, status.stray_deg) =
                            (session.zeros(), session.stray_deg().map(|deg| deg as f32));
                        status.ceiling_mnm = session.ceiling_mnm();
                        status.is_slow = session.is_slow();
                        let returned = self
                            .has_returned
                            .then(|| format!("the knob is back; if it has restarted, {ZERO_IS_LOST}"));
                        status.notice = session.notice().map(str::to_owned).or(returned);
                        (status.alarm, status.restriction) = (session.alarm(), session.restriction());
                        if let Some(refusal) = session.refusal() {
                            status.last_refusal = Some(refusal.into());
                        }
                        match session.status(now_us) {
                            SessionStatus::Live => Phase::Live,
                            SessionStatus::OtherVersion => Phase::VersionMismatch,
                            SessionStatus::PlainMidi => Phase::ReadOnly,
                            SessionStatus::Stock(name) => Phase::StockSerial(name),
                            SessionStatus::Greeting | SessionStatus::Silent => lost.unwrap_or(Phase::Waiting),
                        }
                    }
                }
            }
        };
        status.tier = if status.info.is_some() { 2 } else { 0 };
        status.text = status.phase.text(&status.port, status.info.as_ref());
        status
    }
}

type Opened = Result<(Box<dyn Transport>, Vec<Ownership>), Trouble>;

/// A number for the lock of a port behind which no serial number is known: FNV-1a of its name.
fn port_serial(name: &str) -> u64 {
    name.bytes()
        .fold(0xCBF2_9CE4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3))
}
