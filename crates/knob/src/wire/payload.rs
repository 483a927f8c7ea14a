//! Messages to payloads and back, at the offsets of `docs/protocol.md`.

use crate::wire::frame::{FrameError, MAX_PAYLOAD};
use crate::wire::limits::{self, FieldRange, OutOfRange};
use crate::wire::message::{
    Arm, Capabilities, Counters, DeviceEvent, DeviceState, EventKind, Feel, Flags, Info, Message, Stamp,
    TorqueLaw,
};

const MAGIC: [u8; 4] = *b"TTLK";

const HELLO: u8 = 0x01;
const FEEL: u8 = 0x02;
const ARM: u8 = 0x03;
const ALIVE: u8 = 0x04;
const FREE: u8 = 0x05;
const ZERO: u8 = 0x06;
const RATE: u8 = 0x07;
const BYE: u8 = 0x08;
const INFO: u8 = 0x81;
const STATE: u8 = 0x82;
const EVENT: u8 = 0x83;

/// Lengths from which on a payload has the fields that TTLink 1.1 appended.
const ARM_STAMPED: usize = 12;
const INFO_COUNTED: usize = 56;
const STATE_STAMPED: usize = 20;

/// Name of a type and the least length of its payload.
fn layout(kind: u8) -> Option<(&'static str, usize)> {
    Some(match kind {
        HELLO => ("HELLO", 12),
        FEEL => ("FEEL", 56),
        ARM => ("ARM", 8),
        ALIVE => ("ALIVE", 8),
        FREE => ("FREE", 0),
        ZERO => ("ZERO", 4),
        RATE => ("RATE", 2),
        BYE => ("BYE", 4),
        INFO => ("INFO", 52),
        STATE => ("STATE", 18),
        EVENT => ("EVENT", 12),
        _ => return None,
    })
}

impl Message {
    /// Its type byte.
    pub fn kind(&self) -> u8 {
        match self {
            Self::Hello { .. } => HELLO,
            Self::Feel(_) => FEEL,
            Self::Arm(_) => ARM,
            Self::Alive(_) => ALIVE,
            Self::Free => FREE,
            Self::Zero(_) => ZERO,
            Self::Rate(_) => RATE,
            Self::Bye { .. } => BYE,
            Self::Info(_) => INFO,
            Self::State(_) => STATE,
            Self::Event(_) => EVENT,
        }
    }

    /// Its name in `docs/protocol.md`.
    pub fn name(&self) -> &'static str {
        layout(self.kind()).map_or("", |(name, _)| name)
    }

    /// Whether every field lies in its range, as the receiving end will ask.
    pub fn check(&self) -> Result<(), OutOfRange> {
        match self {
            Self::Feel(feel) => feel.check(),
            Self::Arm(arm) | Self::Alive(arm) => limits::CEILING_MNM.check(arm.ceiling_mnm.into()),
            Self::Zero(angle) => limits::ZERO_ANGLE.check(*angle as f32),
            Self::Rate(hz) => limits::RATE_HZ.check((*hz).into()),
            Self::Info(info) => limits::SERIAL.check(info.serial as f32),
            Self::Event(event) => limits::VALUE.check(event.value),
            Self::Hello { .. } | Self::Free | Self::Bye { .. } | Self::State(_) => Ok(()),
        }
    }
}

/// A payload being written, field after field.
struct Writer<'a> {
    bytes: &'a mut [u8; MAX_PAYLOAD],
    length: usize,
}

impl Writer<'_> {
    // PANIC: the longest payload, FEEL, has 56 bytes of the 58; the golden vectors write every one.
    fn put<const N: usize>(&mut self, bytes: [u8; N]) -> &mut Self {
        self.bytes[self.length..self.length + N].copy_from_slice(&bytes);
        self.length += N;
        self
    }

    fn u8(&mut self, value: u8) -> &mut Self {
        self.put([value])
    }

    fn u16(&mut self, value: u16) -> &mut Self {
        self.put(value.to_le_bytes())
    }

    fn u32(&mut self, value: u32) -> &mut Self {
        self.put(value.to_le_bytes())
    }

    fn f32(&mut self, value: f32) -> &mut Self {
        self.put(value.to_le_bytes())
    }
}

/// Writes the payload of `message` and gives its length. Total: fields outside their range are written as they are.
pub(super) fn write(message: &Message, bytes: &mut [u8; MAX_PAYLOAD]) -> usize {
    let mut out = Writer { bytes, length: 0 };
    match *message {
        Message::Hello { major, minor, session } => {
            out.put(MAGIC).u8(major).u8(minor).u16(0).u32(session);
        }
        Message::Feel(feel) => {
            out.u8(feel.feel_id).u8(feel.law as u8).u16(feel.morph_ms);
            out.f32(feel.h).f32(feel.k).f32(feel.scale_mnm).f32(feel.stretch).f32(feel.offset_deg);
            out.f32(feel.a_on_deg).f32(feel.a_off_deg).f32(feel.a_beat_deg);
            out.f32(feel.wall_deg).f32(feel.wall_mnm_per_deg).f32(feel.slap_mnm_per_deg);
            out.f32(feel.damping_mnms).u16(feel.friction).u16(feel.detent);
        }
        Message::Arm(arm) | Message::Alive(arm) => {
            out.u32(arm.session).u16(arm.ceiling_mnm).u16(arm.stamp.map_or(0, |stamp| stamp.epoch));
            if let Some(stamp) = arm.stamp {
                out.u32(stamp.heard_us);
            }
        }
        Message::Free => {}
        Message::Zero(angle) => {
            out.put(angle.to_le_bytes());
        }
        Message::Rate(hz) => {
            out.u16(hz);
        }
        Message::Bye { session } => {
            out.u32(session);
        }
        Message::Info(info) => {
            let (major, minor, patch) = info.firmware;
            out.u8(info.major).u8(info.minor).u16(info.capabilities.0);
            out.u8(major).u8(minor).u16(patch).put(info.name).put(info.serial.to_le_bytes());
            out.u32(info.counts_per_turn).u16(info.loop_hz).u16(info.watchdog_ms).u16(info.fade_ms);
            out.u16(info.ceiling_mnm).u32(info.session).u16(info.stiffness_limit).u16(info.push_limit);
            if let Some(counters) = info.counters {
                out.u16(counters.overruns).u16(counters.bus_errors);
            }
        }
        Message::State(state) => {
            out.u32(state.t_us).put(state.angle.to_le_bytes()).put(state.velocity.to_le_bytes());
            out.put(state.torque.to_le_bytes()).u16(state.flags.0);
            out.u8(state.feel_id).u8(state.slaps).u8(state.events).u8(state.fault);
            if let Some(epoch) = state.epoch {
                out.u16(epoch);
            }
        }
        Message::Event(event) => {
            out.u8(event.kind as u8).u8(event.counter).u8(event.code).u8(event.feel_id);
            out.u32(event.t_us).f32(event.value);
        }
    }
    out.length
}

/// A payload whose length has been checked, read by offset.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    // PANIC: `read` has compared the length with `layout`, whose lengths end behind the last field read; appended fields
    // are read only behind a comparison of their own.
    fn take<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut bytes = [0; N];
        bytes.copy_from_slice(&self.0[at..at + N]);
        bytes
    }

    fn u8(&self, at: usize) -> u8 {
        self.0[at]
    }

    fn u16(&self, at: usize) -> u16 {
        u16::from_le_bytes(self.take(at))
    }

    fn u32(&self, at: usize) -> u32 {
        u32::from_le_bytes(self.take(at))
    }

    fn f32(&self, at: usize) -> f32 {
        f32::from_le_bytes(self.take(at))
    }

    fn has(&self, length: usize) -> bool {
        self.0.len() >= length
    }

    fn arm(&self) -> Arm {
        let stamp = self.has(ARM_STAMPED).then(|| Stamp { epoch: self.u16(6), heard_us: self.u32(8) });
        Arm { session: self.u32(0), ceiling_mnm: self.u16(4), stamp }
    }

    fn feel(&self) -> Result<Feel, OutOfRange> {
        let law = match self.u8(1) {
            0 => TorqueLaw::Free,
            1 => TorqueLaw::Flow,
            2 => TorqueLaw::Pressure,
            other => return Err(outside(limits::LAW, other)),
        };
        Ok(Feel {
            feel_id: self.u8(0),
            law,
            morph_ms: self.u16(2),
            h: self.f32(4),
            k: self.f32(8),
            scale_mnm: self.f32(12),
            stretch: self.f32(16),
            offset_deg: self.f32(20),
            a_on_deg: self.f32(24),
            a_off_deg: self.f32(28),
            a_beat_deg: self.f32(32),
            wall_deg: self.f32(36),
            wall_mnm_per_deg: self.f32(40),
            slap_mnm_per_deg: self.f32(44),
            damping_mnms: self.f32(48),
            friction: self.u16(52),
            detent: self.u16(54),
        })
    }

    fn info(&self) -> Info {
        Info {
            major: self.u8(0),
            minor: self.u8(1),
            capabilities: Capabilities(self.u16(2)),
            firmware: (self.u8(4), self.u8(5), self.u16(6)),
            name: self.take(8),
            serial: u64::from_le_bytes(self.take(24)),
            counts_per_turn: self.u32(32),
            loop_hz: self.u16(36),
            watchdog_ms: self.u16(38),
            fade_ms: self.u16(40),
            ceiling_mnm: self.u16(42),
            session: self.u32(44),
            stiffness_limit: self.u16(48),
            push_limit: self.u16(50),
            counters: self
                .has(INFO_COUNTED)
                .then(|| Counters { overruns: self.u16(52), bus_errors: self.u16(54) }),
        }
    }

    fn state(&self) -> DeviceState {
        DeviceState {
            t_us: self.u32(0),
            angle: i32::from_le_bytes(self.take(4)),
            velocity: i16::from_le_bytes(self.take(8)),
            torque: i16::from_le_bytes(self.take(10)),
            flags: Flags(self.u16(12)),
            feel_id: self.u8(14),
            slaps: self.u8(15),
            events: self.u8(16),
            fault: self.u8(17),
            epoch: self.has(STATE_STAMPED).then(|| self.u16(18)),
        }
    }

    fn event(&self) -> Result<DeviceEvent, OutOfRange> {
        let kind = match self.u8(0) {
            1 => EventKind::Slap,
            2 => EventKind::Button,
            3 => EventKind::Limit,
            4 => EventKind::Fault,
            5 => EventKind::Refused,
            6 => EventKind::Disarmed,
            other => return Err(outside(limits::KIND, other)),
        };
        Ok(DeviceEvent {
            kind,
            counter: self.u8(1),
            code: self.u8(2),
            feel_id: self.u8(3),
            t_us: self.u32(4),
            value: self.f32(8),
        })
    }
}

fn outside(limit: FieldRange, value: u8) -> OutOfRange {
    let FieldRange { field, low, high } = limit;
    OutOfRange { field, value: value.into(), low, high }
}

/// Reads the payload of a message of type `kind`; bytes behind those known are ignored.
pub(super) fn read(kind: u8, seq: u8, payload: &[u8]) -> Result<Message, FrameError> {
    let (message, least) = layout(kind).ok_or(FrameError::UnknownType { kind, seq })?;
    if payload.len() < least {
        return Err(FrameError::ShortPayload { message, seq, given: payload.len(), least });
    }
    let reader = Reader(payload);
    let refused = |reason| FrameError::Range { kind, message, seq, reason };
    let read = match kind {
        HELLO if reader.take(0) != MAGIC => {
            return Err(FrameError::Magic { seq, given: reader.take(0) });
        }
        HELLO => Message::Hello { major: reader.u8(4), minor: reader.u8(5), session: reader.u32(8) },
        FEEL => Message::Feel(reader.feel().map_err(refused)?),
        ARM => Message::Arm(reader.arm()),
        ALIVE => Message::Alive(reader.arm()),
        FREE => Message::Free,
        ZERO => Message::Zero(i32::from_le_bytes(reader.take(0))),
        RATE => Message::Rate(reader.u16(0)),
        BYE => Message::Bye { session: reader.u32(0) },
        INFO => Message::Info(reader.info()),
        STATE => Message::State(reader.state()),
        // The last of those `layout` knows.
        _ => Message::Event(reader.event().map_err(refused)?),
    };
    read.check().map_err(refused)?;
    Ok(read)
}
