//! A host session against knobs that misbehave, in simulated time: each gets its message, none keeps its torque.
#![cfg(feature = "devices")]

#[allow(dead_code, reason = "other tests use the rest")]
#[path = "support/misbehaving_knobs.rs"]
mod misbehaving_knobs;

use chalumeau_knob::device::session::{HostSession, SessionEvent, SessionOutput};
use chalumeau_knob::device::transport::Binding;
use chalumeau_knob::wire::{Feel, Message, TorqueLaw, UNCALIBRATED_CEILING_MNM, UNDATED_CEILING_MNM};
use misbehaving_knobs::{FakeKnob, Misbehaving, all};

/// Session and knob on a line without delay; the user arms after a second and asks for 100 mNm.
struct Course {
    session: HostSession,
    knob: FakeKnob,
    said: Vec<String>,
    angles: Vec<f32>,
}

impl Course {
    fn new(kind: Misbehaving) -> Self {
        let session = HostSession::new(Binding::Serial, 0xABCD, 0);
        Self { session, knob: FakeKnob::new(kind), said: Vec::new(), angles: Vec::new() }
    }

    fn run(&mut self, ms: u32) {
        for _ in 0..ms {
            let now_us = 1_000 * i64::from(self.knob.ms());
            let mut out = Vec::new();
            let mut send = |wish: SessionOutput| {
                if let SessionOutput::Send(bytes) = wish {
                    out.extend_from_slice(bytes);
                }
            };
            self.session.obeyed(now_us, "the test");
            self.session.want_feel(Feel { law: TorqueLaw::Flow, scale_mnm: 40.0, ..Feel::default() });
            self.session.poll(now_us, &mut send, &mut |_| {});
            let answer = self.knob.tick(&out);
            let angles = &mut self.angles;
            self.session.receive(now_us, &answer, &mut |event| {
                if let SessionEvent::State(state) = event {
                    angles.push(state.angle_deg);
                }
            });
            let name = self.session.info().map(|info| info.name_text());
            let words = [self.session.alarm(), self.session.restriction(), name];
            let borrowed = [self.session.refusal(), self.session.notice()];
            for text in words.into_iter().chain(borrowed.map(|text| text.map(str::to_owned))).flatten() {
                if !self.said.contains(&text) {
                    self.said.push(text);
                }
            }
        }
    }

    fn heard(&self, what: impl Fn(&Message) -> bool) -> usize {
        self.knob.heard.iter().filter(|(_, message)| what(message)).count()
    }
}

#[test]
fn each_of_40_misbehaving_knobs_gets_its_message_and_keeps_no_torque() {
    let knobs = all();
    assert!(knobs.len() >= 40, "{}", knobs.len());
    for kind in knobs {
        let mut course = Course::new(kind);
        course.run(1_000);
        course.session.arm(100, false, 1_000 * i64::from(course.knob.ms()));
        course.run(3_500);
        if kind.may_arm {
            assert!(course.session.is_armed() && course.knob.is_armed(), "{}: {:?}", kind.name, course.said);
        } else if kind.name == "does not hear FREE" {
            // It does what it is told until the user disarms.
            course.session.disarm(1_000 * i64::from(course.knob.ms()));
            course.run(1_500);
        }
        // To arm a knob that has fallen silent is refused with the reason.
        if !course.session.is_armed() {
            course.session.arm(100, false, 1_000 * i64::from(course.knob.ms()));
            course.run(1_500);
        }
        println!("{}: {:?}", kind.name, course.said);
        let is_said = course.said.iter().any(|text| text.contains(kind.says));
        assert!(is_said, "{}: {:?} is not in {:?}", kind.name, kind.says, course.said);
        assert!(
            course.said.iter().all(|text| !text.chars().any(char::is_control)),
            "{}: {:?}",
            kind.name,
            course.said
        );
        if !kind.may_arm {
            assert!(!course.session.is_armed() && !course.knob.is_armed(), "{}: armed at the end", kind.name);
        }
        let jumps = course.angles.windows(2).filter(|pair| (pair[1] - pair[0]).abs() > 1e3).count();
        assert!(jumps <= 10, "{}: {jumps} leaps were played", kind.name);
    }
}

#[test]
fn a_doubt_lets_the_knob_go_within_a_message_and_for_good() {
    let knobs = all();
    let torque = knobs.iter().find(|kind| kind.name.starts_with("four times")).unwrap();
    let mut course = Course::new(*torque);
    course.run(1_000);
    course.session.arm(100, false, 1_000_000);
    course.run(20);
    assert!(!course.knob.is_armed(), "{:?}", course.said);
    assert_eq!(course.heard(|message| matches!(message, Message::Free)), 1);
    let alive = course.heard(|message| matches!(message, Message::Alive(_)));
    for _ in 0..3 {
        course.session.arm(100, false, 1_000 * i64::from(course.knob.ms()));
        course.run(500);
    }
    assert!(!course.knob.is_armed(), "an act of the user does not make it honest");
    assert_eq!(course.heard(|message| matches!(message, Message::Arm(_))), 1);
    assert_eq!(course.heard(|message| matches!(message, Message::Alive(_))), alive, "nor is it kept alive");
    assert!(course.session.refusal().is_some_and(|why| why.contains("not trusted")));
}

#[test]
fn a_knob_that_jumps_again_and_again_is_disarmed_for_good_and_says_why() {
    let leaps = *all().iter().find(|kind| kind.name.starts_with("leaps")).unwrap();
    let mut course = Course::new(leaps);
    course.run(4_000);
    let alarm = course.session.alarm().unwrap();
    assert!(alarm.contains("has jumped 4 times") && alarm.contains("connected again"), "{alarm}");
    course.session.arm(100, false, 4_000_000);
    course.run(500);
    assert!(!course.knob.is_armed());
}

#[test]
fn a_knob_of_version_1_0_is_asked_for_50_mnm_at_most() {
    is_asked_for("TTLink 1.0", UNDATED_CEILING_MNM);
}

#[test]
fn a_knob_that_is_not_calibrated_is_asked_for_50_mnm_at_most_whatever_it_declares() {
    is_asked_for("not calibrated", UNCALIBRATED_CEILING_MNM);
}

/// A knob that declares 450 mNm is armed with at most so much where the user allows 250.
fn is_asked_for(name: &str, most_mnm: u16) {
    let kind = *all().iter().find(|kind| kind.name == name).unwrap();
    let mut course = Course::new(kind);
    course.run(1_000);
    course.session.arm(250, true, 1_000_000);
    course.run(1_000);
    assert!(course.session.is_armed());
    let ceilings = course.knob.heard.iter().filter_map(|(_, message)| match message {
        Message::Arm(arm) => Some(arm.ceiling_mnm),
        _ => None,
    });
    assert_eq!(ceilings.collect::<Vec<_>>(), [most_mnm]);
    assert_eq!(course.session.info().unwrap().torque_limits(250).ceiling_mnm, f64::from(most_mnm));
}
