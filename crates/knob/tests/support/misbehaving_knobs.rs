//! Knobs that lie, contradict themselves or do not obey, each with the words by which a host must tell it apart.
//!
//! All of them are one honest knob, small and written against `docs/protocol.md` alone, with one thing twisted.

use chalumeau_knob::wire::{
    Arm, Capabilities, Counters, Decoder, DeviceEvent, DeviceState, EventKind, Flags, Info, Message, encode,
};

/// What a twist can see.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moment {
    /// Since its start.
    pub ms: u32,
    /// Since it was armed first.
    pub armed_ms: Option<u32>,
    /// INFOs sent so far.
    pub infos: u32,
}

/// A knob that misbehaves in one way.
#[derive(Clone, Copy)]
pub struct Misbehaving {
    /// What it does.
    pub name: &'static str,
    /// What the host says of it, in alarm, refusal, notice, restriction or status.
    pub says: &'static str,
    /// What `doctor` says of it, which arms nothing and so cannot see everything.
    pub doctor: &'static str,
    /// It is odd, but nothing forbids to arm it.
    pub may_arm: bool,
    info: fn(&mut Info, Moment),
    state: fn(&mut DeviceState, Moment),
    obeys: fn(&Message, Moment) -> bool,
    /// Messages of its own accord.
    adds: fn(Moment) -> Option<Message>,
}

const HONEST: Misbehaving = Misbehaving {
    name: "",
    says: "",
    doctor: "tier 2: position and feel",
    may_arm: false,
    info: |_, _| {},
    state: |_, _| {},
    obeys: |_, _| true,
    adds: |_| None,
};

fn is_arm(message: &Message) -> bool {
    matches!(message, Message::Arm(_))
}

fn refusal(code: u8) -> Message {
    Message::Event(DeviceEvent {
        kind: EventKind::Refused,
        counter: code,
        code,
        feel_id: 1,
        t_us: 0,
        value: 5.0,
    })
}

/// The list.
pub fn all() -> Vec<Misbehaving> {
    let info = |name, says, info| Misbehaving { name, says, doctor: says, info, ..HONEST };
    let state = |name, says, state| Misbehaving { name, says, state, ..HONEST };
    let deaf = |name, says, obeys| Misbehaving { name, says, obeys, ..HONEST };
    vec![
        // ---- lies in INFO
        info("lets go after a minute", "60050 ms after", |info, _| info.watchdog_ms = 60_000),
        info("fades for a minute", "65615 ms after", |info, _| info.fade_ms = 65_535),
        info("watchdog and fade that overflow", "131070 ms after", |info, _| {
            (info.watchdog_ms, info.fade_ms) = (65_535, 65_535);
        }),
        info("no watchdog", "watchdog of 0 ms", |info, _| info.watchdog_ms = 0),
        info("a ceiling of nothing", "ceiling of 0 mNm", |info, _| info.ceiling_mnm = 0),
        info("a ceiling of 65 N m", "ceiling of 65535 mNm", |info, _| info.ceiling_mnm = 65_535),
        info("no motor", "has no motor", |info, _| info.capabilities.0 &= !Capabilities::MOTOR),
        Misbehaving {
            may_arm: true,
            doctor: "not calibrated",
            ..info("not calibrated", "not calibrated", |info, _| {
                info.capabilities.0 &= !Capabilities::CALIBRATED
            })
        },
        info("a loop of 100 Hz", "at 100 Hz", |info, _| info.loop_hz = 100),
        info("no loop", "at 0 Hz", |info, _| info.loop_hz = 0),
        info("no encoder", "0 counts a turn", |info, _| info.counts_per_turn = 0),
        info("stable at any stiffness", "65.5 N m/rad", |info, _| info.stiffness_limit = 65_535),
        info("another serial number with each INFO", "serial number changed", |info, moment| {
            info.serial += u64::from(moment.infos);
        }),
        Misbehaving {
            name: "another serial number once it is armed",
            says: "serial number changed",
            info: |info, moment| info.serial += u64::from(moment.armed_ms.is_some()),
            adds: |moment| (moment.armed_ms == Some(300)).then(|| Message::Info(honest_info(moment))),
            ..HONEST
        },
        Misbehaving {
            name: "another major version",
            says: "another version",
            doctor: "position only, never armed",
            info: |info, _| info.major = 2,
            ..HONEST
        },
        Misbehaving {
            name: "TTLink 1.0",
            says: "at most 50 mNm",
            doctor: "at most 50 mNm",
            may_arm: true,
            info: |info, _| (info.minor, info.counters) = (0, None),
            state: |state, _| state.epoch = None,
            ..HONEST
        },
        Misbehaving {
            name: "says 1.1 and sends 1.0",
            says: "counts no disarmings",
            doctor: "counts no disarmings",
            state: |state, _| state.epoch = None,
            ..HONEST
        },
        Misbehaving {
            name: "escape sequences in its name",
            says: "Kn[2J]0;ob",
            doctor: "Kn[2J]0;ob",
            may_arm: true,
            info: |info, _| info.name = Info::name_bytes("Kn\u{1b}[2J\u{1b}]0;ob\u{7}"),
            ..HONEST
        },
        Misbehaving {
            name: "a name that is no text",
            says: "\u{fffd}",
            doctor: "\u{fffd}",
            may_arm: true,
            info: |info, _| info.name = [0xFE; 16],
            ..HONEST
        },
        Misbehaving {
            name: "answers another host",
            says: "the knob answers another program",
            doctor: "the knob answers another program",
            info: |info, _| info.session ^= 1,
            ..HONEST
        },
        // ---- lies in STATE
        state("four times the torque allowed", "makes -400 mNm, more than the 100", |state, moment| {
            if moment.armed_ms.is_some() {
                state.torque = -400;
            }
        }),
        Misbehaving {
            doctor: "without being armed",
            ..state("torque without being armed", "makes 30 mNm without being armed", |state, _| {
                state.torque = 30;
            })
        },
        Misbehaving {
            doctor: "told to let go",
            ..state("armed from the start", "told to let go", |state, _| state.flags.0 |= Flags::ARMED)
        },
        state("fades for ever", "without being armed", |state, moment| {
            if moment.armed_ms.is_some_and(|ms| ms > 300) {
                (state.flags, state.torque) = (Flags(Flags::FADING), 20);
                state.epoch = Some(7);
            }
        }),
        state("probes for ever", "does not arm", |state, moment| {
            if moment.armed_ms.is_some() {
                state.flags = Flags(Flags::PROBING);
            }
        }),
        Misbehaving {
            doctor: "clock stands still",
            ..state("a clock that stands", "clock stands still", |state, _| state.t_us = 77)
        },
        state("a clock that jumps back", "has restarted", |state, moment| {
            state.t_us = moment.ms % 1_000 * 1_000;
        }),
        Misbehaving {
            doctor: "its speed says",
            ..state("a frozen angle", "its speed says", |state, _| state.velocity = 3_000)
        },
        Misbehaving {
            doctor: "its speed says",
            ..state("a speed of the wrong sign", "its speed says", |state, moment| {
                // Forth for a second, back for a second, 1 rad/s.
                let (ms, turn) = (i64::from(moment.ms % 2_000), i64::from(moment.ms % 2_000 >= 1_000));
                state.angle = (if turn == 1 { 2_000 - ms } else { ms } * 573 / 100) as i32;
                state.velocity = if turn == 1 { 95 } else { -95 };
            })
        },
        Misbehaving {
            doctor: "has jumped",
            ..state("leaps of 21 million degrees", "jumped by", |state, moment| {
                state.angle = if moment.ms % 1_000 < 500 { i32::MAX } else { i32::MIN };
            })
        },
        Misbehaving {
            doctor: "has jumped",
            ..state("an angle of noise", "jumped by", |state, moment| {
                state.angle = (moment.ms.wrapping_mul(2_654_435_761) >> 8) as i32;
            })
        },
        state("armed with a fault", "in spite of a fault", |state, _| {
            if state.flags.armed() {
                (state.flags.0, state.fault) = (state.flags.0 | Flags::FAULT, 3);
            }
        }),
        Misbehaving {
            name: "does not count its disarmings",
            says: "did not count it",
            state: |state, moment| {
                state.epoch = Some(9);
                if moment.armed_ms.is_some_and(|ms| ms % 400 > 300) {
                    state.flags.0 &= !Flags::ARMED;
                }
            },
            ..HONEST
        },
        state("disarms for a reason of its own", "the knob has disarmed itself", |state, moment| {
            if moment.armed_ms.is_some_and(|ms| ms > 500) {
                (state.flags.0, state.fault) = (state.flags.0 & !Flags::ARMED, 200);
                state.epoch = state.epoch.map(|epoch| epoch.wrapping_add(1));
            }
        }),
        // ---- deaf
        deaf("does not hear ARM", "does not arm and gives no reason", |message, _| !is_arm(message)),
        deaf("does not hear FREE", "told to let go", |message, _| !matches!(message, Message::Free)),
        Misbehaving {
            doctor: "does not take over the feel",
            ..deaf("does not hear FEEL", "does not take over the feel", |message, _| {
                !matches!(message, Message::Feel(_))
            })
        },
        deaf("does not hear ALIVE", "no longer heard from this computer", |message, _| {
            !matches!(message, Message::Alive(_))
        }),
        Misbehaving {
            doctor: "does not take over the feel",
            ..state("echoes a feel that was not sent", "does not take over the feel", |state, _| {
                state.feel_id = 200;
            })
        },
        state("forgets its feel", "does not take over the feel", |state, moment| {
            if moment.armed_ms.is_some_and(|ms| ms > 200) {
                state.feel_id = 0;
            }
        }),
        // ---- refuses
        Misbehaving {
            name: "refuses ARM for a fault",
            says: "the fault is still present",
            obeys: |message, _| !is_arm(message),
            adds: |moment| (moment.ms % 20 == 0).then(|| refusal(8)),
            ..HONEST
        },
        Misbehaving {
            name: "refuses ARM for a reason of a later version",
            says: "for a reason that this version does not know",
            doctor: "tier 2",
            obeys: |message, _| !is_arm(message),
            adds: |moment| (moment.ms % 20 == 0).then(|| refusal(200)),
            ..HONEST
        },
        Misbehaving {
            name: "refuses every feel",
            says: "stiffer than the knob can hold",
            may_arm: true,
            obeys: |message, _| !matches!(message, Message::Feel(_)),
            adds: |moment| (moment.ms % 20 == 0).then(|| refusal(2)),
            ..HONEST
        },
        // ---- falls silent
        state("falls silent once armed", "the knob sends nothing", |_, _| {}),
        state("three positions a second", "the knob sends nothing", |_, _| {}),
    ]
}

fn honest_info(moment: Moment) -> Info {
    Info {
        major: 1,
        minor: 1,
        capabilities: Capabilities(
            Capabilities::FLOW | Capabilities::PRESSURE | Capabilities::MOTOR | Capabilities::CALIBRATED,
        ),
        firmware: (9, 9, 9),
        name: Info::name_bytes("Honest"),
        serial: 0xBAD0 + u64::from(moment.armed_ms.is_some()),
        counts_per_turn: 3_600,
        loop_hz: 2_000,
        watchdog_ms: 80,
        fade_ms: 50,
        ceiling_mnm: 450,
        session: 0,
        stiffness_limit: 2_000,
        push_limit: 200,
        counters: Some(Counters::default()),
    }
}

/// One of them at work, a millisecond at a time.
pub struct FakeKnob {
    kind: Misbehaving,
    decoder: Decoder,
    moment: Moment,
    session: u32,
    armed: bool,
    alive_ms: u32,
    epoch: u16,
    feel_id: u8,
    fault: u8,
    seq: u8,
    /// All that it was told.
    pub heard: Vec<(u32, Message)>,
}

impl FakeKnob {
    pub fn new(kind: Misbehaving) -> Self {
        Self {
            kind,
            decoder: Decoder::new(),
            moment: Moment::default(),
            session: 0,
            armed: false,
            alive_ms: 0,
            epoch: 100,
            feel_id: 0,
            fault: 0,
            seq: 0,
            heard: Vec::new(),
        }
    }

    /// Whether a knob that obeys as far as this one does would make torque now.
    pub fn is_armed(&self) -> bool {
        self.armed
    }

    pub fn ms(&self) -> u32 {
        self.moment.ms
    }

    /// A millisecond: bytes of the host in, its own out.
    pub fn tick(&mut self, from_host: &[u8]) -> Vec<u8> {
        self.moment.ms += 1;
        if let Some(armed_ms) = &mut self.moment.armed_ms {
            *armed_ms += 1;
        }
        let messages: Vec<Message> =
            self.decoder.feed(from_host).flatten().map(|(_, message)| message).collect();
        let mut said = Vec::new();
        for message in messages {
            self.heard.push((self.moment.ms, message));
            if (self.kind.obeys)(&message, self.moment) {
                self.hear(&message, &mut said);
            }
        }
        if self.armed && self.moment.ms - self.alive_ms > 80 {
            self.disarm(1);
        }
        if let Some(mut message) = (self.kind.adds)(self.moment) {
            if let Message::Info(info) = &mut message {
                info.session = self.session;
            }
            self.say(&message, &mut said);
        }
        let silent = self.kind.name.starts_with("falls silent") && self.moment.armed_ms > Some(300);
        let rare = self.kind.name.starts_with("three positions") && !self.moment.ms.is_multiple_of(333);
        if self.moment.ms.is_multiple_of(2) && !silent && !rare {
            let mut state = DeviceState {
                t_us: self.moment.ms * 1_000,
                flags: Flags(u16::from(self.armed)),
                feel_id: self.feel_id,
                epoch: Some(self.epoch),
                fault: self.fault,
                ..DeviceState::default()
            };
            (self.kind.state)(&mut state, self.moment);
            self.say(&Message::State(state), &mut said);
        }
        said
    }

    fn hear(&mut self, message: &Message, said: &mut Vec<u8>) {
        match message {
            Message::Hello { session, .. } => {
                self.session = *session;
                let mut info = Info { session: *session, serial: 0xBAD0, ..honest_info(self.moment) };
                (self.kind.info)(&mut info, self.moment);
                self.moment.infos += 1;
                self.say(&Message::Info(info), said);
            }
            Message::Arm(Arm { session, .. }) if *session == self.session => {
                self.armed = true;
                self.fault = 0;
                self.alive_ms = self.moment.ms;
                self.moment.armed_ms.get_or_insert(0);
            }
            Message::Alive(Arm { session, .. }) if *session == self.session => self.alive_ms = self.moment.ms,
            Message::Free => self.disarm(6),
            Message::Bye { .. } => self.disarm(7),
            Message::Feel(feel) => self.feel_id = feel.feel_id,
            _ => {}
        }
    }

    fn disarm(&mut self, cause: u8) {
        self.armed = false;
        self.fault = cause;
        self.epoch = self.epoch.wrapping_add(1);
    }

    fn say(&mut self, message: &Message, said: &mut Vec<u8>) {
        said.extend_from_slice(&encode(message, self.seq));
        self.seq = self.seq.wrapping_add(1);
    }
}
