//! A host in simulated time, as plain as the protocol allows: says hello, sends ALIVE, arms when told.

use chalumeau_knob::simulator::knob::SimulatedKnob;
use chalumeau_knob::wire::midi::{FromKnob, MidiReceiver, encode_sysex};
use chalumeau_knob::wire::{Arm, Decoder, DeviceEvent, DeviceState, Info, Message, Stamp, encode};

/// Knob and host on one line.
pub struct TestHost {
    pub knob: SimulatedKnob,
    pub session: u32,
    pub is_alive: bool,
    pub events: Vec<DeviceEvent>,
    pub heard_bytes: Vec<u8>,
    is_midi: bool,
    ceiling_mnm: u16,
    seq: u8,
    tick: u64,
    serial: Decoder,
    midi: MidiReceiver,
    info: Option<Info>,
    last: DeviceState,
}

impl TestHost {
    pub fn new(knob: SimulatedKnob, is_midi: bool, ceiling_mnm: u16) -> Self {
        Self {
            knob,
            session: 0x1234_5678,
            is_alive: true,
            events: Vec::new(),
            heard_bytes: Vec::new(),
            is_midi,
            ceiling_mnm,
            seq: 0,
            tick: 0,
            serial: Decoder::new(),
            midi: MidiReceiver::new(),
            info: None,
            last: DeviceState::default(),
        }
    }

    /// Last STATE heard.
    pub fn state(&self) -> DeviceState {
        self.last
    }

    pub fn send(&mut self, message: &Message) {
        self.seq = self.seq.wrapping_add(1);
        if self.is_midi {
            self.knob.send(&encode_sysex(message, self.seq));
        } else {
            self.knob.send(&encode(message, self.seq));
        }
    }

    /// Says hello and waits for the answer.
    pub fn greet(&mut self) {
        self.send(&Message::Hello { major: 1, minor: 1, session: self.session });
        self.run(0.05, |_| {});
        assert_eq!(self.info.expect("INFO").session, self.session);
    }

    /// Puts the shaft of a knob that nobody has armed at an angle, and calls it so: a shaft that leaps is a fault of its
    /// encoder to the firmware, and changes no position.
    pub fn put(&mut self, angle_deg: f64) {
        self.knob.plant().set(angle_deg.to_radians(), 0.0);
        self.run(0.01, |_| {});
        self.send(&Message::Zero((100.0 * angle_deg).round() as i32));
        self.run(0.01, |_| {});
    }

    /// What the user's act does: ARM, and time for the probe of the signs.
    pub fn arm(&mut self) {
        self.send(&Message::Arm(self.arming()));
        self.run(0.03, |_| {});
        for _ in 0..50 {
            if self.knob.is_armed() {
                break;
            }
            self.run(0.01, |_| {});
        }
    }

    fn arming(&self) -> Arm {
        let stamp = Stamp { epoch: self.last.epoch.unwrap_or(0), heard_us: self.last.t_us };
        Arm { session: self.session, ceiling_mnm: self.ceiling_mnm, stamp: Some(stamp) }
    }

    /// Lets time pass; `each` sees the knob after every period.
    pub fn run(&mut self, seconds: f64, mut each: impl FnMut(&SimulatedKnob)) {
        let alive_every = if self.is_midi { 200 } else { 40 };
        for _ in 0..(seconds * 2000.0).round() as u64 {
            if self.is_alive && self.tick.is_multiple_of(alive_every) {
                self.send(&Message::Alive(self.arming()));
            }
            self.tick += 1;
            self.knob.step();
            self.listen();
            each(&self.knob);
        }
    }

    fn listen(&mut self) {
        let mut bytes = Vec::new();
        self.knob.receive(&mut bytes);
        let mut messages = Vec::new();
        if self.is_midi {
            self.midi.feed(&bytes, self.knob.t_us(), |heard| {
                if let FromKnob::Frame(Ok((_, message))) = heard {
                    messages.push(message);
                }
            });
        } else {
            messages.extend(self.serial.feed(&bytes).flatten().map(|(_, message)| message));
        }
        for message in messages {
            match message {
                Message::Info(info) => self.info = Some(info),
                Message::State(state) => self.last = state,
                Message::Event(event) => self.events.push(event),
                _ => {}
            }
        }
        self.heard_bytes.extend(bytes);
    }
}
