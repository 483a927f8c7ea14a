//! One act arms once: what the knob, its own button, a lost line, a restart and a zero that comes late make of it. The real firmware
//! and a host session in simulated time.
#![cfg(feature = "simulator")]

use chalumeau_firmware::{Firmware, Reading, Setup};
use chalumeau_knob::device::session::{HostSession, SessionOutput};
use chalumeau_knob::device::transport::Binding;
use chalumeau_knob::wire::{Decoder, Feel, Message};

/// Session and firmware on a line without delay; the motor turns nothing.
struct Course {
    session: HostSession,
    firmware: Firmware,
    setup: Setup,
    born_ms: i64,
    ms: i64,
    /// Where the shaft is, and where it turns to, 0.1 degrees.
    counts: i64,
    aim: i64,
    stop: bool,
    /// What the knob says does not arrive.
    is_deaf: bool,
    decoder: Decoder,
    heard: Vec<Message>,
}

impl Course {
    fn new(probes: bool) -> Self {
        let setup = Setup { probes, epoch: 77, ..Setup::default() };
        let mut course = Self {
            session: HostSession::new(Binding::Serial, 5, 0),
            firmware: Firmware::new(&setup),
            setup,
            born_ms: 0,
            ms: 0,
            counts: 0,
            aim: 0,
            stop: false,
            is_deaf: false,
            decoder: Decoder::new(),
            heard: Vec::new(),
        };
        course.run(800);
        course
    }

    fn now_us(&self) -> i64 {
        1_000 * self.ms
    }

    fn arm(&mut self) {
        self.session.arm(100, false, self.now_us());
    }

    fn run(&mut self, ms: i64) {
        for _ in 0..ms {
            self.ms += 1;
            let now_us = self.now_us();
            let mut said = Vec::new();
            self.session.obeyed(now_us, "the test");
            self.session.want_feel(Feel { scale_mnm: 40.0, ..Feel::default() });
            let mut send = |wish: SessionOutput| {
                if let SessionOutput::Send(bytes) = wish {
                    said.extend_from_slice(bytes);
                }
            };
            self.session.poll(now_us, &mut send, &mut |_| {});
            self.heard.extend(self.decoder.feed(&said).flatten().map(|(_, message)| message));
            self.firmware.receive(&said);
            self.counts += (self.aim - self.counts).clamp(-10, 10);
            for half in 0..2 {
                let reading = Reading {
                    counts: self.counts,
                    stop: self.stop,
                    tells_velocity: false,
                    ..Reading::default()
                };
                self.firmware.tick((now_us - 1_000 * self.born_ms + 500 * half) as u64, &reading);
            }
            let mut bytes = [0; 1024];
            let length = self.firmware.transmit(&mut bytes);
            if !self.is_deaf {
                self.session.receive(now_us, &bytes[..length], &mut |_| {});
            }
        }
    }

    fn said(&self, what: impl Fn(&Message) -> bool) -> usize {
        self.heard.iter().filter(|message| what(message)).count()
    }
}

fn is_arm(message: &Message) -> bool {
    matches!(message, Message::Arm(_))
}

fn is_zero(message: &Message) -> bool {
    matches!(message, Message::Zero(_))
}

#[test]
fn a_knob_stopped_by_its_own_button_is_not_armed_by_the_same_act() {
    let mut course = Course::new(false);
    course.arm();
    course.is_deaf = true;
    course.run(10);
    assert!(course.firmware.is_armed());
    course.stop = true;
    course.run(10);
    assert!(!course.firmware.is_armed());
    // The host has heard neither; the next try would be due now.
    course.stop = false;
    course.run(20);
    course.is_deaf = false;
    for _ in 0..1_000 {
        course.run(1);
        assert!(!course.firmware.is_armed(), "armed against the user's last word at {} ms", course.ms);
    }
    assert_eq!(course.said(is_arm), 1);
    assert!(!course.session.is_arming() && !course.session.is_armed());
    assert!(course.session.notice().is_some(), "and it is told");
    assert_eq!(course.session.alarm(), None, "the knob has done nothing wrong");
    course.arm();
    course.run(300);
    assert!(course.session.is_armed(), "{:?}", course.session.refusal());
}

#[test]
fn a_probe_that_the_button_ends_is_told_and_raises_no_doubt() {
    let mut course = Course::new(true);
    course.arm();
    course.run(30);
    assert!(course.session.is_arming());
    course.stop = true;
    course.run(20);
    course.stop = false;
    course.run(1_000);
    assert!(!course.session.is_arming() && !course.session.is_armed());
    assert_eq!(course.session.alarm(), None);
    let notice = course.session.notice().unwrap_or_default();
    assert!(notice.contains("button") || notice.contains("stop"), "{notice}");
}

#[test]
fn a_zero_is_refused_while_the_signs_are_probed_and_none_comes_later() {
    let mut course = Course::new(true);
    course.arm();
    course.run(30);
    assert!(course.session.is_arming());
    course.session.zero();
    assert!(course.session.refusal().is_some_and(|why| why.contains("zero position cannot be changed")));
    course.run(500);
    course.session.disarm(course.now_us());
    course.aim = 900;
    course.run(500);
    assert_eq!(course.said(is_zero), 0);
    assert_eq!(course.session.zeros(), 0);
    course.session.zero();
    course.run(100);
    assert_eq!((course.said(is_zero), course.session.zeros()), (1, 1));
}

#[test]
fn positions_that_piled_up_before_the_session_are_no_restart_and_no_rate() {
    let mut course = Course::new(false);
    // Nobody listens for half a minute; the line keeps what came first, as that of a pseudo-terminal does.
    let mut pile = Vec::new();
    for _ in 0..30_000 {
        course.ms += 1;
        for half in 0..2 {
            course.firmware.tick((course.now_us() + 500 * half) as u64, &Reading::default());
        }
        let mut bytes = [0; 1024];
        let length = course.firmware.transmit(&mut bytes);
        if pile.len() < 16_384 {
            pile.extend_from_slice(&bytes[..length]);
        }
    }
    let now_us = course.now_us();
    course.session = HostSession::new(Binding::Serial, 6, now_us);
    course.session.receive(now_us, &pile, &mut |_| {});
    course.run(1_600);
    assert_eq!(course.session.notice(), None);
    let stats = course.session.stats();
    assert!((450.0..550.0).contains(&stats.rate_hz), "{stats:?}");
    assert!(stats.states < 900, "{stats:?}");
}

#[test]
fn a_zero_that_waits_ends_with_every_disarming() {
    let mut course = Course::new(false);
    course.aim = 900;
    course.run(500);
    course.session.zero();
    course.session.let_go("Panic", course.now_us());
    course.run(1_000);
    assert_eq!(course.said(is_zero), 0);
}

#[test]
fn a_restart_says_what_it_means_and_a_knob_away_from_its_zero_is_told_of() {
    let mut course = Course::new(false);
    assert_eq!(course.session.stray_deg(), None);
    course.aim = 900;
    course.run(500);
    assert_eq!(course.session.stray_deg(), Some(90.0));
    course.session.zero();
    course.run(100);
    assert_eq!(course.session.stray_deg(), None);
    course.aim = 1_800;
    course.run(500);
    assert_eq!(course.session.stray_deg(), None, "the user has said where zero is");
    (course.firmware, course.born_ms) = (Firmware::new(&course.setup), course.ms);
    course.run(1_000);
    let notice = course.session.notice().unwrap_or_default();
    assert!(notice.contains("restarted") && notice.contains("Rest here"), "{notice}");
    course.aim = 2_700;
    course.run(500);
    assert_eq!(course.session.stray_deg(), Some(90.0));
    course.arm();
    course.run(300);
    assert!(course.session.is_armed());
    assert_eq!(course.session.stray_deg(), None);
}
