//! A knob at the browser's serial port: the native link's session, fed by the page with bytes, time and signs of life.
//!
//! The page reads and writes the port; everything that decides is here, on the audio thread, and is the native code: when torque is
//! allowed, whether the knob is believed, what it feels, and what breath its angle is. The audio thread sends ALIVE itself, so that
//! a knob loses its torque by its own watchdog when the sound stops, and the page's signs of life are asked for as those of a
//! plugin's window are. What the status says in words allocates, in the module's own memory, which no other thread waits for.

use std::fmt::Write as _;

use chalumeau_core::units::SoundingNote;
use chalumeau_knob::device::pose::Poses;
use chalumeau_knob::device::session::{HostSession, SessionEvent, SessionOutput, SessionStatus};
use chalumeau_knob::device::transport::Binding;
use chalumeau_knob::touch::feel::PlayedFeel;
use chalumeau_knob::wire::plain_text::plain;
use chalumeau_knob::wire::{Message, encode};

/// Why the page takes the torque away, by number. Each follows "disarmed: ".
const REASONS: [&str; 3] = ["stop was pressed", "the page was hidden", "the page was left"];
/// Who obeys the user, in "... has stood still".
const PAGE: &str = "the page";

/// One open port.
pub struct HeldKnob {
    session: HostSession,
    poses: Poses,
    played: PlayedFeel,
    out: Vec<u8>,
    baud: u32,
    slap: Option<f32>,
    /// When the page last gave a sign of life, us.
    beat_us: i64,
    clock: PageClock,
    now_us: i64,
    text: String,
}

/// The page's clock as the session counts. The only one that a page and its audio thread share is that of the system, which may
/// be set back while a knob is armed; then it goes on from the latest moment.
struct PageClock {
    latest_ms: f64,
    shift_ms: f64,
}

impl PageClock {
    /// Now, as the audio thread reads it: a step back is one of the system's clock.
    fn now_us(&mut self, now_ms: f64) -> i64 {
        self.shift_ms = self.shift_ms.max(self.latest_ms - now_ms);
        self.latest_ms = now_ms + self.shift_ms;
        (1e3 * self.latest_ms) as i64
    }

    /// A moment that the page has noted, which comes late, and may be from before the clock was set back.
    fn noted_us(&self, at_ms: f64) -> i64 {
        (1e3 * (at_ms + self.shift_ms).min(self.latest_ms)) as i64
    }
}

fn told(poses: &mut Poses, slap: &mut Option<f32>, event: SessionEvent) {
    match event {
        SessionEvent::State(state) => poses.take((&state).into()),
        SessionEvent::Slap(speed) => *slap = Some(speed),
        SessionEvent::Button(_) => {}
    }
}

impl HeldKnob {
    /// A port that has just been opened; `number` is random. Allocates.
    pub fn new(number: u32, now_ms: f64) -> Self {
        let mut clock = PageClock { latest_ms: now_ms, shift_ms: 0.0 };
        let now_us = clock.now_us(now_ms);
        Self {
            session: HostSession::new(Binding::Serial, number, now_us),
            poses: Poses::default(),
            played: PlayedFeel::default(),
            out: Vec::with_capacity(1_024),
            baud: 0,
            slap: None,
            beat_us: now_us,
            clock,
            now_us,
            text: String::new(),
        }
    }

    /// The page lives and obeys the user.
    pub fn beat(&mut self, now_ms: f64) {
        self.beat_us = self.clock.now_us(now_ms);
    }

    /// Bytes of the port, and when the page read them.
    pub fn receive(&mut self, now_ms: f64, bytes: &[u8]) {
        let Self { session, poses, slap, clock, .. } = self;
        session.receive(clock.noted_us(now_ms), bytes, &mut |event| told(poses, slap, event));
    }

    /// Lets time pass before a block of `frames` samples, with a note fingered.
    pub fn turn(&mut self, now_ms: f64, frames: usize, rate_hz: f64, note: Option<SoundingNote>) {
        self.now_us = self.clock.now_us(now_ms);
        let Self { session, poses, slap, out, baud, .. } = self;
        session.obeyed(self.beat_us, PAGE);
        if self.played.maps.is_ready() {
            session.want_feel(self.played.feel(note));
        }
        let mut send = |wish: SessionOutput| match wish {
            SessionOutput::Send(bytes) => out.extend_from_slice(bytes),
            SessionOutput::Baud(wanted) => *baud = wanted,
        };
        session.poll(self.now_us, &mut send, &mut |event| told(poses, slap, event));
        poses.begin_block_at(self.now_us, frames, rate_hz);
    }

    /// Feel and breath of the instrument that sounds, as [`PlayedFeel::to_bytes`] made them; others are ignored.
    pub fn set_feel(&mut self, bytes: &[u8]) {
        if let Some(played) = PlayedFeel::from_bytes(bytes) {
            self.played = played;
        }
    }

    /// The feel in force.
    pub fn played(&self) -> &PlayedFeel {
        &self.played
    }

    /// The angle at a sample of the block, degrees, if the knob plays: it is there, and what its angles mean is known.
    pub fn angle_deg(&self, at: usize) -> Option<f64> {
        let pose = self.poses.pose(at).filter(|_| self.played.maps.is_ready())?;
        Some(f64::from(pose.angle_deg))
    }

    /// Peak speed of a slap that has not been taken yet, rad/s.
    pub fn take_slap(&mut self) -> Option<f32> {
        self.slap.take()
    }

    /// The user allows torque up to so many mNm, 250 at most: only ever call it for an act of the user.
    pub fn arm(&mut self, ceiling_mnm: u16) {
        self.session.arm(ceiling_mnm, false, self.now_us);
    }

    /// Lowers the ceiling at once; never raises it.
    pub fn lower_ceiling(&mut self, ceiling_mnm: u16) {
        self.session.lower_ceiling(ceiling_mnm);
    }

    /// Torque off, by the number of the reason in the page.
    pub fn let_go(&mut self, reason: usize) {
        self.session.let_go(REASONS.get(reason).copied().unwrap_or(REASONS[0]), self.now_us);
    }

    /// The present position becomes zero; the knob refuses while it is armed.
    pub fn zero(&mut self) {
        self.session.zero();
    }

    /// What is to be written to the port now.
    pub fn take_out(&mut self, taken: &mut Vec<u8>) {
        taken.clear();
        taken.append(&mut self.out);
    }

    /// The speed that the port shall have before anything else is written, baud; 0 for the one that it has.
    pub fn take_baud(&mut self) -> u32 {
        std::mem::take(&mut self.baud)
    }

    /// Two frames that the page may write at any time, whoever stands still: FREE, then BYE.
    pub fn farewell(number: u32, taken: &mut Vec<u8>) {
        taken.clear();
        for message in [Message::Free, Message::Bye { session: number }] {
            taken.extend_from_slice(&encode(&message, 0));
        }
    }

    /// The status as lines for the page: whether it plays, whether it is armed, ceiling, angle, torque and feel, its limits, STATE a
    /// second, its name or why there is none, then alarm, restriction, refusal and notice, each empty if there is none; whether it has
    /// been told to arm and is not armed yet; and how far it stands from a zero that nobody has set, degrees, or nothing. Allocates.
    pub fn status(&mut self) -> &str {
        let session = &self.session;
        let info = session.info();
        let who = match session.status(self.now_us) {
            SessionStatus::Greeting => "waiting for an answer".to_owned(),
            SessionStatus::Live => info.map_or_else(String::new, |info| {
                let (major, minor, patch) = info.firmware;
                format!("{} {:016x} (firmware {major}.{minor}.{patch})", info.name_text(), info.serial)
            }),
            SessionStatus::Silent | SessionStatus::PlainMidi => "the knob sends nothing".to_owned(),
            SessionStatus::OtherVersion => {
                "the knob speaks another version of the protocol: its position is read, it is never armed"
                    .to_owned()
            }
            SessionStatus::Stock(name) => format!(
                "{name} has its stock firmware, which sends no position over USB: flash the firmware in firmware/"
            ),
        };
        let limits = info.map(|info| info.torque_limits(self.session.ceiling_mnm()));
        let most_mnm = info.map_or(0, |info| info.most_mnm());
        let (stiffness, push) = limits.map_or((0.0, 0.0), |of| (of.stiffness_nm_per_rad, of.push_nm_per_rad));
        let state = session.state().copied().unwrap_or_default();
        let live = session.status(self.now_us) == SessionStatus::Live;
        self.text.clear();
        let _ = write!(
            self.text,
            "{}\n{}\n{}\n{:.2}\n{}\n{}\n{most_mnm}\n{stiffness}\n{push}\n{}",
            u8::from(live),
            u8::from(session.is_armed()),
            session.ceiling_mnm(),
            state.angle_deg(),
            state.torque,
            state.feel_id,
            plain(&who),
        );
        let alarm = session.alarm();
        let restriction = session.restriction();
        for text in [alarm.as_deref(), restriction.as_deref(), session.refusal(), session.notice()] {
            let _ = write!(self.text, "\n{}", plain(text.unwrap_or_default()));
        }
        let _ = write!(self.text, "\n{}\n", u8::from(session.is_arming()));
        if let Some(stray_deg) = session.stray_deg() {
            let _ = write!(self.text, "{stray_deg:.1}");
        }
        &self.text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_is_set_back_goes_on() {
        let mut clock = PageClock { latest_ms: 5_000.0, shift_ms: 0.0 };
        assert_eq!(clock.now_us(90_000.0), 90_000_000);
        assert_eq!(clock.noted_us(89_995.0), 89_995_000, "a late message");
        assert_eq!(clock.now_us(30_000.0), 90_000_000, "set back by a minute");
        assert_eq!(clock.noted_us(89_999.0), 90_000_000, "noted before that");
        assert_eq!(clock.now_us(30_010.0), 90_010_000);
        assert_eq!(clock.noted_us(30_007.0), 90_007_000);
        assert_eq!(clock.now_us(29_900.0), 90_010_000, "and by a little more");
    }
}
