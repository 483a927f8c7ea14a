//! The host's side of a TTLink session, without ports and clocks: time and bytes go in, bytes come out.
//!
//! Three rules always hold. The session sends ALIVE only while somebody obeys the user ([`HostSession::obeyed`]) and the
//! knob can be believed ([`trust`]). It sends ARM only after an act of the user. It never sends torque, only parameters and
//! a ceiling. Rates, codes and layouts: `docs/protocol.md`.

pub mod arming;
pub mod feeling;
pub mod greeting;
mod hearing;
mod slaps;
pub mod trust;
mod zeroing;

use crate::device::clock::DeviceClock;
use crate::device::heartbeat::OBEDIENCE_US;
use crate::device::session::arming::Arming;
use crate::device::session::feeling::Feeling;
use crate::device::session::greeting::Greeting;
use crate::device::session::slaps::Slaps;
use crate::device::session::trust::{Doubt, Trust};
use crate::device::session::zeroing::Zeroing;
use crate::device::stats::{LinkStats, Meter};
use crate::device::transport::Binding;
use crate::wire;
use crate::wire::midi::MidiReceiver;
use crate::wire::{Arm, DeviceState, Feel, Info, Message, Stamp, WireStats};

/// Time between two ALIVE on a serial line, us.
const ALIVE_US: i64 = 20_000;
/// Time between two ALIVE over MIDI, us.
const ALIVE_MIDI_US: i64 = 100_000;
/// Time between two HELLO to a device that counts, us: INFO tells the counts, and whether it is still the same device.
const HELLO_AGAIN_US: i64 = 2_000_000;
/// What the user wants and shows no effect (ARM, FREE, ZERO) is said again after this much, us.
const INSIST_US: i64 = 50_000;
/// How often ARM or ZERO is said for one act at most.
const TRIES: u32 = 4;
/// Least time between two frames over MIDI, us.
const MIDI_SLOT_US: i64 = 20_000;
/// STATE this old no longer says what the knob does, us: 125 periods, about twice the 130 ms in which serial devices let go.
const SILENCE_US: i64 = 250_000;
/// The same over MIDI, us: twice the 380 ms in which MIDI devices let go.
const SILENCE_MIDI_US: i64 = 800_000;
/// STATE a second at full speed.
const RATE_HZ: u16 = 500;
/// STATE a second at 115200 baud.
const SLOW_RATE_HZ: u16 = 200;
/// STATE further apart than this was lost in between, or the device began anew, us.
const LONGEST_PERIOD_US: u32 = 50_000;
/// Time between two angles of a plain MIDI device, us; only the reader's delay depends on it.
const PLAIN_PERIOD_US: u32 = 10_000;
/// A MIDI device that has not answered by then, us, is taken for a plain one: two HELLO and an answer. Its breath is heard
/// from the first.
const PLAIN_AFTER_US: i64 = 600_000;
/// Two angles further apart than this say nothing of speed, us.
const PLAIN_GAP_US: i64 = 200_000;
/// As far from a zero that nobody has set, degrees, people are told before the knob is armed. By judgement: what a hand turns
/// without noticing.
pub const STRAY_DEG: f64 = 5.0;
/// What a restart means, after what has happened.
pub const ZERO_IS_LOST: &str =
    "its zero is where it stood then: set it again (Rest here; on the command line --zero)";

/// One measurement of the knob, for recording and study.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StateSample {
    /// Host time of the measurement, us since the link's epoch.
    pub host_us: i64,
    /// Device clock, us, wraps; from devices without a clock the host's.
    pub t_us: u32,
    /// Degrees since zero, positive is blowing.
    pub angle_deg: f32,
    /// Degrees per second.
    pub velocity_deg_s: f32,
    /// The knob's own command after all limits, mNm; `None` where it is not told.
    pub torque_mnm: Option<f32>,
    /// Last FEEL accepted.
    pub feel_id: u8,
    /// `wire::Flags`.
    pub flags: u16,
    /// Time until the next one as a rule, us.
    pub period_us: u32,
}

impl StateSample {
    /// Whether the knob may make torque; `None` where it does not say what torque it makes.
    pub fn armed(&self) -> Option<bool> {
        self.torque_mnm.map(|_| wire::Flags(self.flags).armed())
    }
}

/// What a session reports to its caller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SessionEvent {
    /// A measurement of the knob.
    State(StateSample),
    /// The player slapped the knob, with this peak speed, rad/s.
    Slap(f32),
    /// Its button went down (true) or up.
    Button(bool),
}

/// What a session asks its caller to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SessionOutput<'a> {
    /// Send these bytes, whole or not at all.
    Send(&'a [u8]),
    /// Change the speed of the line.
    Baud(u32),
}

/// The status of a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SessionStatus {
    /// No INFO yet.
    Greeting,
    /// INFO has come, and STATE keeps coming.
    Live,
    /// INFO has come; STATE has not come yet, or comes no longer.
    Silent,
    /// Another major version: its position is read, it is never armed.
    OtherVersion,
    /// Unmodified firmware has told its name.
    Stock(String),
    /// Control changes, but no answer to HELLO.
    PlainMidi,
}

/// What was told last of the knob, for people.
enum Notice {
    /// It has answered another program. An answer to this one settles it.
    AnswersAnother,
    /// What stays until the user acts, or something else is told.
    Told(String),
}

impl Notice {
    fn text(&self) -> &str {
        match self {
            Self::AnswersAnother => "the knob answers another program",
            Self::Told(text) => text,
        }
    }
}

enum Incoming {
    Stream(Box<wire::Decoder>),
    Midi(Box<MidiReceiver>),
}

/// The host's side of a session with one device; see the module.
pub struct HostSession {
    binding: Binding,
    number: u32,
    seq: u8,
    ears: Incoming,
    opened_us: i64,
    greeting: Greeting,
    arming: Arming,
    feeling: Feeling,
    slaps: Slaps,
    trust: Trust,
    /// When those who obey the user were last all alive, us, and who was heard longest ago.
    obeyed: Option<(i64, &'static str)>,
    info: Option<Info>,
    info_us: Option<i64>,
    hello_us: i64,
    zero_us: Option<i64>,
    next_alive_us: i64,
    next_slot_us: i64,
    zeroing: Zeroing,
    /// ZEROs that the knob has shown to have heard.
    zeros: u32,
    /// It is known where the knob's zero is: it has been set, or the knob was armed there, since this connection or a restart.
    is_zero_known: bool,
    /// A STATE has come since the first INFO: HELLO, which changes the knob's epoch, lies before it.
    is_dated: bool,
    rate_due: bool,
    clock: DeviceClock,
    state: Option<(DeviceState, i64)>,
    mean_step_us: f32,
    last_event: Option<u8>,
    plain: Option<StateSample>,
    has_plain_angle: bool,
    refusal: Option<String>,
    notice: Option<Notice>,
    meter: Meter,
}

impl HostSession {
    /// Opens a session at `now_us`; `number` is random, so that a knob can tell two openings apart.
    pub fn new(binding: Binding, number: u32, now_us: i64) -> Self {
        Self {
            binding,
            number,
            seq: 0,
            ears: match binding {
                Binding::Midi => Incoming::Midi(Box::default()),
                Binding::Serial | Binding::Osc => Incoming::Stream(Box::default()),
            },
            opened_us: now_us,
            greeting: Greeting::new(binding, now_us),
            arming: Arming::default(),
            feeling: Feeling::default(),
            slaps: Slaps::default(),
            trust: Trust::default(),
            obeyed: None,
            info: None,
            info_us: None,
            hello_us: now_us,
            zero_us: None,
            next_alive_us: now_us,
            has_plain_angle: false,
            next_slot_us: now_us,
            zeroing: Zeroing::default(),
            zeros: 0,
            is_zero_known: false,
            is_dated: false,
            rate_due: false,
            clock: DeviceClock::default(),
            state: None,
            mean_step_us: 1e6 / f32::from(RATE_HZ),
            last_event: None,
            plain: None,
            refusal: None,
            notice: None,
            meter: Meter::new(now_us),
        }
    }

    /// The device's INFO; `None` before it has answered HELLO.
    pub fn info(&self) -> Option<&Info> {
        self.info.as_ref()
    }

    /// The last STATE.
    pub fn state(&self) -> Option<&DeviceState> {
        self.state.as_ref().map(|(state, _)| state)
    }

    /// When it was opened, us.
    pub fn opened_us(&self) -> i64 {
        self.opened_us
    }

    /// When the knob was last heard, us.
    pub fn heard_us(&self) -> Option<i64> {
        self.state.map(|(_, at)| at).max(self.plain.map(|sample| sample.host_us)).max(self.info_us)
    }

    /// True while the knob says that it is armed and shall be.
    pub fn is_armed(&self) -> bool {
        self.arming.is_armed()
    }

    /// True from the user's act until the knob says that it is armed, or the act is over.
    pub fn is_arming(&self) -> bool {
        self.arming.is_arming()
    }

    /// How often the knob has shown that it has heard ZERO.
    pub fn zeros(&self) -> u32 {
        self.zeros
    }

    /// How far the knob stands from a zero that nobody has set or armed at since it was connected or has restarted, degrees;
    /// `None` if that is no more than [`STRAY_DEG`]. Armed there, it may turn back by itself.
    pub fn stray_deg(&self) -> Option<f64> {
        let angle_deg = self.state()?.angle_deg();
        (!self.is_zero_known && angle_deg.abs() > STRAY_DEG).then_some(angle_deg)
    }

    /// What ARM and ALIVE carry, mNm.
    pub fn ceiling_mnm(&self) -> u16 {
        self.arming.ceiling_mnm()
    }

    /// True when the slower speed is in use.
    pub fn is_slow(&self) -> bool {
        self.greeting.is_slow()
    }

    /// Why the knob, or this side, did not do what was wanted; the latest.
    pub fn refusal(&self) -> Option<&str> {
        self.refusal.as_deref()
    }

    /// What the knob reported last of faults and of disarming by itself.
    pub fn notice(&self) -> Option<&str> {
        self.notice.as_ref().map(Notice::text)
    }

    /// Why the knob is not trusted with torque, and what to do.
    pub fn alarm(&self) -> Option<String> {
        let doubt = self.trust.doubt()?;
        let next = if self.trust.is_lost() {
            "this program keeps it disarmed until it is connected again"
        } else {
            "it was told to let go; arm it again if you trust it"
        };
        Some(format!("WARNING: {doubt}; {next}"))
    }

    /// What limits the torque of a knob whose firmware is of TTLink 1.0, or which is not calibrated.
    pub fn restriction(&self) -> Option<String> {
        let info = self.info.as_ref().filter(|info| info.speaks_our_major())?;
        if info.checks_age() {
            return (!info.is_calibrated()).then(|| {
                format!(
                    "this knob is not calibrated, so that nobody knows what torque it makes: at most {} mNm; \
                     firmware/README.md, Calibrate it",
                    info.most_mnm()
                )
            });
        }
        Some(format!(
            "this knob's firmware speaks TTLink {}.{} and cannot tell a late command from a new one: at most {} mNm; flash \
             the firmware in firmware/ for more",
            info.major,
            info.minor,
            info.most_mnm()
        ))
    }

    /// Counts and times. Sorts about 1,000 values: call it a few times a second at most.
    pub fn stats(&self) -> LinkStats {
        LinkStats { wire: self.wire_stats(), skew_ppm: self.clock.skew_ppm() as f32, ..self.meter.picture() }
    }

    /// The status at `now_us`.
    pub fn status(&self, now_us: i64) -> SessionStatus {
        match &self.info {
            Some(info) if !info.speaks_our_major() => SessionStatus::OtherVersion,
            Some(_) if self.is_heard(now_us) => SessionStatus::Live,
            Some(_) if self.state.is_none() && self.is_plain(now_us) => SessionStatus::PlainMidi,
            Some(_) => SessionStatus::Silent,
            None if self.is_plain(now_us) => SessionStatus::PlainMidi,
            None => self
                .greeting
                .stock_name()
                .map_or(SessionStatus::Greeting, |name| SessionStatus::Stock(name.into())),
        }
    }

    /// The feel that is wanted now; sent when it differs from the one before.
    pub fn want_feel(&mut self, feel: Feel) {
        if let Err(reason) = self.feeling.want(feel) {
            self.refusal = Some(reason);
        }
    }

    /// The user allows torque up to `ceiling_mnm`: only ever call it for an act of the user. More than
    /// [`arming::OFFERED_CEILING_MNM`] needs `further_act`, a second question answered.
    pub fn arm(&mut self, ceiling_mnm: u16, further_act: bool, now_us: i64) {
        let why_not = match &self.info {
            None => "not armed: no knob with Chalumeau's firmware has answered",
            Some(info) if !info.speaks_our_major() => {
                "not armed: the knob speaks another version of the protocol"
            }
            Some(_) if !self.is_heard(now_us) => "not armed: the knob sends nothing",
            Some(_) if self.trust.is_lost() => "not armed: the knob is not trusted",
            Some(_) if self.disobedient(now_us).is_some() => "not armed: nobody is there to obey you",
            Some(info) => {
                self.trust.forgive();
                self.arming.arm(ceiling_mnm, further_act, info, now_us);
                // A zero that waits for the knob to let go comes too late. ARM waits for one that does not.
                if !self.is_free() {
                    self.zeroing.forget();
                }
                (self.refusal, self.notice) = (None, None);
                return;
            }
        };
        self.refusal = Some(why_not.into());
    }

    /// Those who obey the user were all alive at `at_us`; `who` was heard longest ago. Without this, called again and
    /// again, the knob is let go after [`OBEDIENCE_US`].
    pub fn obeyed(&mut self, at_us: i64, who: &'static str) {
        self.obeyed = Some((at_us, who));
    }

    /// Nobody obeys the user any more.
    pub fn unobeyed(&mut self) {
        self.obeyed = None;
    }

    /// Somebody who obeys the user wants no torque, now.
    pub fn let_go(&mut self, why: &str, now_us: i64) {
        if self.arming.is_wanted() {
            self.notice = Some(Notice::Told(format!("disarmed: {why}")));
        }
        self.take_away(now_us);
    }

    /// Torque off. A zero that waits for that would come at whatever angle the knob has then.
    fn take_away(&mut self, now_us: i64) {
        self.arming.disarm(now_us);
        self.zeroing.forget();
    }

    /// Who should obey the user and does not.
    fn disobedient(&self, now_us: i64) -> Option<&'static str> {
        match self.obeyed {
            Some((at_us, _)) if now_us - at_us <= OBEDIENCE_US => None,
            Some((_, who)) => Some(who),
            None => Some("the program that used the knob"),
        }
    }

    /// The knob cannot be believed: torque off, and people are told why.
    fn distrust(&mut self, doubt: Doubt, now_us: i64) {
        if self.trust.doubts(doubt) {
            self.take_away(now_us);
        }
    }

    /// Lowers the ceiling at once; never raises it.
    pub fn lower_ceiling(&mut self, ceiling_mnm: u16) {
        self.arming.lower(ceiling_mnm);
    }

    /// Torque off.
    pub fn disarm(&mut self, now_us: i64) {
        self.notice = None;
        self.take_away(now_us);
    }

    /// The present position becomes zero; not while the knob is armed, or told to arm: it turns when its signs are probed.
    pub fn zero(&mut self) {
        if self.arming.is_wanted() {
            self.refusal = Some(wire::RefusedCode::ZeroWhileArmed.text().into());
        } else {
            self.zeroing.want();
        }
    }

    /// The frame to send before closing: torque off, the host leaves.
    pub fn bye(&mut self, send: &mut dyn FnMut(SessionOutput)) {
        self.arming.forget();
        self.say(&Message::Bye { session: self.number }, send);
    }

    /// Lets time pass and hands over what is to be sent, and slaps of which only the count arrived.
    pub fn poll(
        &mut self,
        now_us: i64,
        send: &mut dyn FnMut(SessionOutput),
        tell: &mut dyn FnMut(SessionEvent),
    ) {
        self.meter.tick(now_us);
        while let Some(speed) = self.slaps.poll(now_us) {
            tell(SessionEvent::Slap(speed));
        }
        if let Incoming::Midi(_) = &self.ears {
            self.hear_midi(&[], now_us, tell);
        }
        if let Some(who) = self.disobedient(now_us)
            && self.arming.is_wanted()
        {
            self.let_go(&format!("{who} has stood still"), now_us);
        }
        if self.arming.take_ignored() {
            self.distrust(Doubt::DeafToArm, now_us);
        }
        if self.info.is_some() && !self.is_heard(now_us) {
            // It may have started anew; whatever it was, it is not armed by us any more.
            // A knob that is only mute hears FREE, and its watchdog what no longer comes.
            if self.arming.is_wanted() {
                self.let_go("the knob sends nothing any more", now_us);
            }
            self.arming.forget();
            self.zeroing.forget();
        }
        // Most urgent first: over MIDI only one frame goes out at a time.
        while self.has_slot(now_us) {
            match self.next_message(now_us, send) {
                Some(message) => {
                    self.next_slot_us = now_us + MIDI_SLOT_US;
                    self.say(&message, send);
                }
                None => break,
            }
        }
    }

    /// Takes in a chunk as it came.
    pub fn receive(&mut self, now_us: i64, chunk: &[u8], tell: &mut dyn FnMut(SessionEvent)) {
        if self.info.is_none() {
            self.greeting.hear(chunk);
        }
        match &mut self.ears {
            Incoming::Midi(_) => self.hear_midi(chunk, now_us, tell),
            Incoming::Stream(_) => {
                for &byte in chunk {
                    let Incoming::Stream(decoder) = &mut self.ears else { return };
                    if let Some(Ok((_, message))) = decoder.push(byte) {
                        self.hear(&message, now_us, tell);
                    }
                }
            }
        }
    }

    /// Control changes, and time enough for more.
    fn is_plain(&self, now_us: i64) -> bool {
        self.plain.is_some() && now_us - self.opened_us > PLAIN_AFTER_US
    }

    fn is_heard(&self, now_us: i64) -> bool {
        let silence_us = if self.binding == Binding::Midi { SILENCE_MIDI_US } else { SILENCE_US };
        self.state.is_some_and(|(_, at)| now_us - at <= silence_us)
    }

    fn wire_stats(&self) -> WireStats {
        match &self.ears {
            Incoming::Stream(decoder) => decoder.stats(),
            Incoming::Midi(receiver) => receiver.stats(),
        }
    }

    /// The knob does not say that it is armed. One that has just been told FREE may still say so, and would refuse ZERO.
    fn is_free(&self) -> bool {
        self.state().is_none_or(|state| !state.flags.armed())
    }

    fn take_zero(&mut self, now_us: i64) -> Option<Message> {
        let due = self.zeroing.poll(self.info.is_some() && self.is_free(), now_us);
        if self.zeroing.take_ignored() {
            let is_wanted = self.arming.is_wanted();
            let so = if is_wanted { "not armed: " } else { "" };
            self.refusal = Some(format!("{so}the knob has not taken its new zero; try again"));
            if is_wanted {
                self.take_away(now_us);
            }
        }
        due.then(|| {
            self.zero_us = Some(now_us);
            Message::Zero(0)
        })
    }

    fn has_slot(&self, now_us: i64) -> bool {
        self.binding != Binding::Midi || now_us >= self.next_slot_us
    }

    fn next_message(&mut self, now_us: i64, send: &mut dyn FnMut(SessionOutput)) -> Option<Message> {
        if self.info.as_ref().is_some_and(|info| !info.speaks_our_major()) {
            return None; // nobody knows what it would make of it
        }
        // Before ARM, after which the knob would refuse it; but nothing comes before FREE.
        if self.arming.is_wanted()
            && let Some(zero) = self.take_zero(now_us)
        {
            return Some(zero);
        }
        // Without a STATE there is nothing that a permission could answer.
        let stamp = self.state().map(|state| Stamp { epoch: state.epoch.unwrap_or(0), heard_us: state.t_us });
        let arm = Arm { session: self.number, ceiling_mnm: self.arming.ceiling_mnm(), stamp };
        // While nobody wants torque, ALIVE has a ceiling of 0, in case FREE is lost.
        let ceiling_mnm = if self.arming.is_wanted() { arm.ceiling_mnm } else { 0 };
        let alive = Arm { ceiling_mnm, ..arm };
        let waits = self.arming.is_wanted() && (self.zeroing.is_pending() || !self.is_dated);
        let epoch = self.state().and_then(|state| state.epoch);
        match if waits { None } else { self.arming.poll(now_us, epoch) } {
            Some(arming::ArmingMessage::Free) => return Some(Message::Free),
            Some(arming::ArmingMessage::Arm) => return Some(Message::Arm(arm)),
            None => {}
        }
        let may_live = self.disobedient(now_us).is_none() && !self.trust.is_lost() && self.is_heard(now_us);
        if self.info.is_some() && stamp.is_some() && may_live && now_us >= self.next_alive_us {
            let period_us = if self.binding == Binding::Midi { ALIVE_MIDI_US } else { ALIVE_US };
            // Counted from when it was due, so that the rate holds; after a stall from now.
            self.next_alive_us = (self.next_alive_us + period_us).max(now_us);
            return Some(Message::Alive(alive));
        }
        if self.info.is_none() || !self.is_heard(now_us) {
            let is_framed = self.wire_stats().frames > 0;
            while let Some(due) = self.greeting.poll(now_us, is_framed) {
                match due {
                    greeting::GreetingStep::Baud(baud) => send(SessionOutput::Baud(baud)),
                    greeting::GreetingStep::Question => send(SessionOutput::Send(greeting::QUESTION)),
                    greeting::GreetingStep::Hello => {
                        return Some(self.hello(now_us));
                    }
                }
            }
        }
        let info = self.info.as_ref()?;
        if info.checks_age() && now_us - self.hello_us >= HELLO_AGAIN_US {
            return Some(self.hello(now_us));
        }
        if let Some(zero) = self.take_zero(now_us) {
            return Some(zero);
        }
        if std::mem::take(&mut self.rate_due) {
            return Some(Message::Rate(if self.is_slow() { SLOW_RATE_HZ } else { RATE_HZ }));
        }
        self.feeling.poll(now_us, self.is_heard(now_us)).map(Message::Feel)
    }

    fn hello(&mut self, now_us: i64) -> Message {
        self.hello_us = now_us;
        Message::Hello { major: wire::MAJOR, minor: wire::MINOR, session: self.number }
    }

    fn say(&mut self, message: &Message, send: &mut dyn FnMut(SessionOutput)) {
        match self.binding {
            Binding::Midi => send(SessionOutput::Send(&wire::midi::encode_sysex(message, self.seq))),
            Binding::Serial | Binding::Osc => send(SessionOutput::Send(&wire::encode(message, self.seq))),
        }
        self.seq = self.seq.wrapping_add(1);
    }
}
