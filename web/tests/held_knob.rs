//! The module and the simulated knob, which runs the real firmware, in simulated time: the angle plays, and torque is there only
//! after the user's act, and ends with the user's word, the page's signs of life, and the sound.
#![cfg(feature = "workshop")]

use chalumeau_core::bore::bundled::Bundled;
use chalumeau_firmware::Setup;
use chalumeau_knob::simulator::hand::{HandDesign, SimulatedHand};
use chalumeau_knob::simulator::knob::SimulatedKnob;
use chalumeau_knob::simulator::plant::PlantDesign;
use chalumeau_knob::simulator::script::Aim;
use chalumeau_web::held_knob::HeldKnob;
use chalumeau_web::playing::Playing;
use chalumeau_web::workshop::answer;
use serde_json::json;

const RATE_HZ: f64 = 48_000.0;
/// A block of the worklet, samples.
const BLOCK: usize = 128;
const NOTE: u8 = 64;

/// Page, module and knob on one clock.
struct Session {
    playing: Playing,
    knob: SimulatedKnob,
    ms: f64,
    /// The page gives signs of life.
    beats: bool,
    /// The audio thread runs.
    runs: bool,
    heard: f32,
}

impl Session {
    fn new(angle_deg: f64) -> Self {
        let plant = PlantDesign::default();
        let setup = Setup {
            serial: 7,
            knob_damping_nms: plant.viscous_nms as f32,
            counts_per_turn: plant.counts_per_turn,
            ..Setup::default()
        };
        let mut knob = SimulatedKnob::new(setup, plant, SimulatedHand::new(HandDesign::default(), 1), 1);
        knob.hand().aim(Aim::Angle(angle_deg));
        let mut playing = Playing::new(RATE_HZ, Bundled::BFlat).unwrap();
        // Any page's clock is far from zero.
        let ms = 1.7e12;
        playing.set_knob(Some(Box::new(HeldKnob::new(7, ms))));
        let mut session = Self { playing, knob, ms, beats: true, runs: true, heard: 0.0 };
        session.run(1_500);
        let question = json!({
            "do": "feel", "rate": RATE_HZ, "instrument": 0, "moved": [], "values": [],
            "ceiling": 100, "stiffness": 8.0, "push": 0.2,
        });
        session.playing.set_feel(&answer(question.to_string().as_bytes()));
        session.playing.midi(0x90, NOTE, 100);
        session.run(1_000);
        session
    }

    fn run(&mut self, ms: u32) {
        let (end_ms, mut bytes, mut out) = (self.ms + f64::from(ms), Vec::new(), Vec::new());
        let mut samples_ms = self.ms;
        self.heard = 0.0;
        while self.ms < end_ms {
            for _ in 0..2 {
                self.knob.step();
            }
            self.ms += 1.0;
            bytes.clear();
            self.knob.receive(&mut bytes);
            if !self.runs {
                continue;
            }
            let held = self.playing.knob().unwrap();
            held.receive(self.ms, &bytes);
            if self.beats {
                held.beat(self.ms);
            }
            while samples_ms < self.ms {
                samples_ms += 1e3 * BLOCK as f64 / RATE_HZ;
                self.playing.turn_knob(self.ms, BLOCK);
                self.playing.knob().unwrap().take_out(&mut out);
                self.knob.send(&out);
                let frames = self.playing.process(BLOCK);
                self.heard =
                    self.playing.channel(0)[..frames].iter().fold(self.heard, |most, x| most.max(x.abs()));
            }
        }
    }

    fn torque_mnm(&self) -> f64 {
        self.knob.command_mnm().abs()
    }

    fn arm(&mut self) {
        self.playing.knob().unwrap().arm(100);
        self.run(1_500);
        assert!(self.knob.is_armed() && self.torque_mnm() > 10.0, "{}", self.status());
        assert!(self.torque_mnm() <= 100.0);
    }

    /// Time until there is no torque, ms.
    fn free_ms(&mut self) -> u32 {
        let free = (0..1_000).find(|_| {
            self.run(1);
            self.torque_mnm() == 0.0 && !self.knob.is_armed()
        });
        let took = free.unwrap_or_else(|| panic!("not free: {}", self.status()));
        for _ in 0..500 {
            self.run(1);
            assert!(self.torque_mnm() == 0.0 && !self.knob.is_armed(), "it stays free");
        }
        took
    }

    fn status(&mut self) -> String {
        self.playing.knob().unwrap().status().to_owned()
    }
}

#[test]
fn the_angle_plays_and_torque_waits_for_the_user() {
    let mut session = Session::new(150.0);
    assert!(session.heard > 0.01, "150 degrees sound: {}", session.status());
    assert_eq!(session.playing.picture()[8], 5.0, "the knob blows");
    let (feel_id, law) = session.knob.feel();
    assert!(feel_id > 0 && law.is_some(), "FEEL has arrived");
    assert!(session.torque_mnm() == 0.0 && !session.knob.is_armed(), "nobody has armed it");
    // Other breath does nothing while the knob blows.
    session.playing.breath(Some(1.0));
    session.knob.hand().aim(Aim::Angle(0.0));
    session.run(1_500);
    session.run(100);
    assert!(session.heard < 1e-3, "at rest it is silent: {}", session.heard);
}

#[test]
fn torque_ends_with_the_users_word_and_with_every_sign_of_life() {
    let mut session = Session::new(150.0);
    for reason in 0..3 {
        session.arm();
        session.playing.knob().unwrap().let_go(reason);
        let took = session.free_ms();
        assert!(took <= 5, "reason {reason}: {took} ms");
        let told = session.status();
        assert!(
            told.contains(["stop was pressed", "the page was hidden", "the page was left"][reason]),
            "{told}"
        );
    }
    session.arm();
    session.beats = false;
    let took = session.free_ms();
    assert!((480..=510).contains(&took), "no heartbeat: {took} ms");
    assert!(session.status().contains("the page has stood still"));
    session.playing.knob().unwrap().arm(100);
    session.run(500);
    assert!(!session.knob.is_armed(), "nobody is there to obey the user");
    session.beats = true;
    session.run(300);
    session.arm();
    session.runs = false;
    let took = session.free_ms();
    assert!(took <= 135, "the audio thread has stopped: {took} ms");
    session.runs = true;
    session.run(1_000);
    assert!(!session.knob.is_armed(), "it is not armed by itself");
    // What the page keeps ready ends torque without the session.
    session.arm();
    let mut farewell = Vec::new();
    HeldKnob::farewell(7, &mut farewell);
    session.knob.send(&farewell);
    session.runs = false;
    let took = session.free_ms();
    assert!(took <= 2, "farewell: {took} ms");
}
