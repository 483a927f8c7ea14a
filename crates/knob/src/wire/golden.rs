//! Frames that every implementation of TTLink must read alike: good ones, and bad ones with what is wrong with them.
//!
//! `cargo xtask wire-vectors` writes them to `firmware/golden`, where the C++ tests read them.
//! Allocates; for tests and tools.

use crate::wire::frame::{Body, MAX_PAYLOAD, encode};
use crate::wire::limits::{self, FieldRange};
use crate::wire::message::{Arm, Capabilities, Event, EventKind, Feel, Flags, Info, Law, Message, State};
use crate::wire::midi::encode_sysex;

/// Header of the lists.
pub const COLUMNS: &str = "file\tverdict\ttype\tseq\tfields\twrites\thex";

/// One stretch of bytes and what a receiver makes of it.
#[derive(Clone, Debug)]
pub struct Vector {
    /// File it is kept in.
    pub file: String,
    /// What goes over the line.
    pub bytes: Vec<u8>,
    /// `ok`, or what is wrong: see [`FrameError::verdict`](crate::wire::FrameError::verdict).
    pub verdict: &'static str,
    /// Type and sequence number, where the checksum is good.
    pub head: Option<(u8, u8)>,
    /// What it says, where it is `ok`.
    pub message: Option<Message>,
    /// Name of the field refused, where the verdict is `range`.
    pub field: Option<&'static str>,
    /// Whether encoding the message gives the same bytes: not so where a later version appended fields.
    pub writes: bool,
}

impl Vector {
    /// Its line in the list; columns that do not apply hold `-`.
    pub fn line(&self) -> String {
        let dash = || "-".to_owned();
        let kind = self.head.map_or_else(dash, |(kind, _)| format!("0x{kind:02x}"));
        let seq = self.head.map_or_else(dash, |(_, seq)| seq.to_string());
        let said = self.message.as_ref().map(fields).filter(|text| !text.is_empty());
        let fields = said.or(self.field.map(str::to_owned)).unwrap_or_else(dash);
        let writes = if self.writes { "yes" } else { "no" };
        let hex: String = self.bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        [&self.file, self.verdict, &kind, &seq, &fields, writes, &hex].join("\t")
    }
}

/// A list as it is kept: the columns' names and a line for each.
pub fn list(vectors: &[Vector]) -> String {
    let lines = vectors.iter().map(Vector::line);
    std::iter::once(COLUMNS.to_owned()).chain(lines).map(|line| line + "\n").collect()
}

/// Fields as `name=value`, separated by spaces, in the order of `docs/protocol.md`; floats in as many digits as give
/// them back exactly, enumerations as numbers, INFO's name in hex.
fn fields(message: &Message) -> String {
    match message {
        Message::Hello { major, minor, session } => format!("major={major} minor={minor} session={session}"),
        Message::Feel(f) => format!(
            "feel_id={} law={} morph_ms={} h={} k={} scale_mnm={} stretch={} offset_deg={} a_on_deg={} a_off_deg={} \
             a_beat_deg={} wall_deg={} wall_mnm_per_deg={} slap_mnm_per_deg={} damping_mnms={} friction={} detent={}",
            f.feel_id,
            f.law as u8,
            f.morph_ms,
            f.h,
            f.k,
            f.scale_mnm,
            f.stretch,
            f.offset_deg,
            f.a_on_deg,
            f.a_off_deg,
            f.a_beat_deg,
            f.wall_deg,
            f.wall_mnm_per_deg,
            f.slap_mnm_per_deg,
            f.damping_mnms,
            f.friction,
            f.detent
        ),
        Message::Arm(arm) | Message::Alive(arm) => {
            format!("session={} ceiling_mnm={}", arm.session, arm.ceiling_mnm)
        }
        Message::Free => String::new(),
        Message::Zero(angle) => format!("angle={angle}"),
        Message::Rate(hz) => format!("hz={hz}"),
        Message::Bye { session } => format!("session={session}"),
        Message::Info(i) => format!(
            "major={} minor={} capabilities={} firmware_major={} firmware_minor={} firmware_patch={} name={} serial={} \
             counts_per_turn={} loop_hz={} watchdog_ms={} fade_ms={} ceiling_mnm={} session={} stiffness_limit={} \
             push_limit={}",
            i.major,
            i.minor,
            i.capabilities.0,
            i.firmware.0,
            i.firmware.1,
            i.firmware.2,
            i.name.iter().map(|byte| format!("{byte:02x}")).collect::<String>(),
            i.serial,
            i.counts_per_turn,
            i.loop_hz,
            i.watchdog_ms,
            i.fade_ms,
            i.ceiling_mnm,
            i.session,
            i.stiffness_limit,
            i.push_limit
        ),
        Message::State(s) => format!(
            "t_us={} angle={} velocity={} torque={} flags={} feel_id={} slaps={} events={} fault={}",
            s.t_us, s.angle, s.velocity, s.torque, s.flags.0, s.feel_id, s.slaps, s.events, s.fault
        ),
        Message::Event(e) => format!(
            "kind={} counter={} code={} feel_id={} t_us={} value={}",
            e.kind as u8, e.counter, e.code, e.feel_id, e.t_us, e.value
        ),
    }
}

/// The seed's reed at TorqueTuner's own scale, with everything switched on.
fn seed_feel() -> Feel {
    Feel {
        feel_id: 17,
        law: Law::Flow,
        scale_mnm: 90.0,
        wall_mnm_per_deg: 4.0,
        slap_mnm_per_deg: 0.5,
        damping_mnms: 0.4,
        friction: 15,
        detent: 30,
        ..Feel::default()
    }
}

fn device_info() -> Info {
    Info {
        major: 1,
        minor: 0,
        capabilities: Capabilities(
            Capabilities::FLOW | Capabilities::PRESSURE | Capabilities::SLAP | Capabilities::DETENT,
        ),
        firmware: (0, 2, 345),
        name: Info::name_bytes("TorqueTuner"),
        serial: 0x0011_2233_4455_6677,
        counts_per_turn: 3_600,
        loop_hz: 2_000,
        watchdog_ms: 80,
        fade_ms: 50,
        ceiling_mnm: 450,
        session: 0xDEAD_BEEF,
        stiffness_limit: 2_000,
        push_limit: 60,
    }
}

/// The messages every implementation must write byte for byte, with names and sequence numbers.
pub fn messages() -> Vec<(&'static str, u8, Message)> {
    let least = Feel {
        feel_id: 0,
        law: Law::Free,
        morph_ms: 20,
        h: 0.5,
        k: 0.01,
        scale_mnm: 0.0,
        stretch: 0.1,
        offset_deg: -360.0,
        a_on_deg: 0.0,
        a_off_deg: 0.0,
        a_beat_deg: 0.0,
        wall_deg: 10.0,
        wall_mnm_per_deg: 0.0,
        slap_mnm_per_deg: 0.0,
        damping_mnms: 0.0,
        friction: 0,
        detent: 0,
    };
    let most = Feel {
        feel_id: 255,
        law: Law::Pressure,
        morph_ms: 1_000,
        h: 10.0,
        k: 1.0,
        scale_mnm: 450.0,
        stretch: 30.0,
        offset_deg: 360.0,
        a_on_deg: 3_600.0,
        a_off_deg: 36_000.0,
        a_beat_deg: 3_600.0,
        wall_deg: 36_000.0,
        wall_mnm_per_deg: 100.0,
        slap_mnm_per_deg: 20.0,
        damping_mnms: 20.0,
        friction: 1_000,
        detent: 1_000,
    };
    let info_most = Info {
        major: 255,
        minor: 255,
        capabilities: Capabilities(u16::MAX),
        firmware: (255, 255, u16::MAX),
        name: [0xFF; 16],
        serial: u64::MAX,
        counts_per_turn: u32::MAX,
        loop_hz: u16::MAX,
        watchdog_ms: u16::MAX,
        fade_ms: u16::MAX,
        ceiling_mnm: u16::MAX,
        session: u32::MAX,
        stiffness_limit: u16::MAX,
        push_limit: u16::MAX,
    };
    let info_least = Info {
        major: 0,
        minor: 0,
        capabilities: Capabilities(0),
        firmware: (0, 0, 0),
        name: [0; 16],
        serial: 1,
        counts_per_turn: 0,
        loop_hz: 0,
        watchdog_ms: 0,
        fade_ms: 0,
        ceiling_mnm: 0,
        session: 0,
        stiffness_limit: 0,
        push_limit: 0,
    };
    let state = State {
        t_us: 1_234_567,
        angle: -10_050,
        velocity: -123,
        torque: 45,
        flags: Flags(Flags::ARMED | Flags::SLAP),
        feel_id: 17,
        slaps: 3,
        events: 9,
        fault: 0,
    };
    let state_least =
        State { t_us: 0, angle: i32::MIN, velocity: i16::MIN, torque: i16::MIN, ..State::default() };
    let state_most = State {
        t_us: u32::MAX,
        angle: i32::MAX,
        velocity: i16::MAX,
        torque: i16::MAX,
        flags: Flags(u16::MAX),
        feel_id: 255,
        slaps: 255,
        events: 255,
        fault: 255,
    };
    let event = |kind, counter, code, value| {
        Message::Event(Event { kind, counter, code, feel_id: 17, t_us: 7_654_321, value })
    };
    let arm = |session, ceiling_mnm| Arm { session, ceiling_mnm };
    vec![
        ("hello", 0, Message::Hello { major: 1, minor: 0, session: 0xDEAD_BEEF }),
        ("hello_zeros", 1, Message::Hello { major: 0, minor: 0, session: 0 }),
        ("hello_most", 255, Message::Hello { major: 255, minor: 255, session: u32::MAX }),
        ("feel_rest", 2, Message::Feel(Feel::default())),
        ("feel_seed", 3, Message::Feel(seed_feel())),
        ("feel_least", 0, Message::Feel(least)),
        ("feel_most", 255, Message::Feel(most)),
        ("feel_stiff_thin", 4, Message::Feel(Feel { h: 0.5, k: 20.0, ..seed_feel() })),
        ("feel_minus_zero", 5, Message::Feel(Feel { offset_deg: -0.0, scale_mnm: -0.0, ..seed_feel() })),
        ("arm", 6, Message::Arm(arm(0xDEAD_BEEF, 100))),
        ("arm_zeros", 0, Message::Arm(arm(0, 0))),
        ("arm_most", 7, Message::Arm(arm(u32::MAX, 450))),
        ("alive", 8, Message::Alive(arm(0xDEAD_BEEF, 250))),
        ("alive_zeros", 0, Message::Alive(arm(0, 0))),
        ("free", 9, Message::Free),
        ("free_seq_0", 0, Message::Free),
        ("zero", 10, Message::Zero(0)),
        ("zero_least", 11, Message::Zero(-360_000)),
        ("zero_most", 12, Message::Zero(360_000)),
        ("rate_least", 13, Message::Rate(10)),
        ("rate", 14, Message::Rate(500)),
        ("rate_most", 15, Message::Rate(1_000)),
        ("bye", 16, Message::Bye { session: 0xDEAD_BEEF }),
        ("info", 0, Message::Info(device_info())),
        ("info_least", 1, Message::Info(info_least)),
        ("info_most", 2, Message::Info(info_most)),
        ("state", 3, Message::State(state)),
        ("state_zeros", 0, Message::State(State::default())),
        ("state_least", 4, Message::State(state_least)),
        ("state_most", 255, Message::State(state_most)),
        ("event_slap", 5, event(EventKind::Slap, 1, 0, 23.5)),
        ("event_button", 6, event(EventKind::Button, 2, 0, 1.0)),
        ("event_limit", 7, event(EventKind::Limit, 3, 0, 512.25)),
        ("event_fault", 8, event(EventKind::Fault, 4, 2, 61.5)),
        ("event_refused", 9, event(EventKind::Refused, 255, 6, f32::MIN)),
        ("event_disarmed", 10, event(EventKind::Disarmed, 0, 1, 0.0)),
        ("event_code_of_a_later_version", 11, event(EventKind::Refused, 1, 200, f32::MIN_POSITIVE)),
    ]
}

/// Type, sequence number and payload of a message as bytes, to be damaged.
fn parts(message: &Message, seq: u8) -> (u8, u8, Vec<u8>) {
    let body = Body::new(message, seq);
    (body[0], body[1], body[2..body.len() - 4].to_vec())
}

fn framed((kind, seq, payload): (u8, u8, Vec<u8>)) -> Vec<u8> {
    Body::of(kind, seq, &payload).framed().to_vec()
}

fn good(name: &str, seq: u8, message: Message, bytes: Vec<u8>, writes: bool) -> Vector {
    Vector {
        file: format!("{name}.bin"),
        bytes,
        verdict: "ok",
        head: Some((message.kind(), seq)),
        message: Some(message),
        field: None,
        writes,
    }
}

fn bad(name: &str, verdict: &'static str, head: Option<(u8, u8)>, bytes: Vec<u8>) -> Vector {
    let file = format!("{name}.bin");
    Vector { file, bytes, verdict, head, message: None, field: None, writes: false }
}

fn refused(name: &str, field: &'static str, parts: (u8, u8, Vec<u8>)) -> Vector {
    let head = Some((parts.0, parts.1));
    Vector { field: Some(field), ..bad(name, "range", head, framed(parts)) }
}

/// Sets a float of [`Feel`].
type SetFeel = fn(&mut Feel, f32);

const FEEL_FLOATS: [(FieldRange, SetFeel); 12] = [
    (limits::H, |feel, value| feel.h = value),
    (limits::K, |feel, value| feel.k = value),
    (limits::SCALE_MNM, |feel, value| feel.scale_mnm = value),
    (limits::STRETCH, |feel, value| feel.stretch = value),
    (limits::OFFSET_DEG, |feel, value| feel.offset_deg = value),
    (limits::A_ON_DEG, |feel, value| feel.a_on_deg = value),
    (limits::A_OFF_DEG, |feel, value| feel.a_off_deg = value),
    (limits::A_BEAT_DEG, |feel, value| feel.a_beat_deg = value),
    (limits::WALL_DEG, |feel, value| feel.wall_deg = value),
    (limits::WALL_MNM_PER_DEG, |feel, value| feel.wall_mnm_per_deg = value),
    (limits::SLAP_MNM_PER_DEG, |feel, value| feel.slap_mnm_per_deg = value),
    (limits::DAMPING_MNMS, |feel, value| feel.damping_mnms = value),
];

/// Payloads that a later minor version has lengthened.
fn later_versions() -> Vec<Vector> {
    let longer = |name: &str, seq, message: Message, length: usize, filling: u8| {
        let (kind, seq, mut payload) = parts(&message, seq);
        payload.resize(length, filling);
        good(name, seq, message, framed((kind, seq, payload)), false)
    };
    let state = State { t_us: 5, angle: 6, ..State::default() };
    vec![
        longer("later_free", 1, Message::Free, 3, 0xAA),
        longer("later_free_of_full_length", 2, Message::Free, MAX_PAYLOAD, 0xFF),
        longer("later_state", 3, Message::State(state), 24, 0x00),
        longer("later_feel_of_full_length", 4, Message::Feel(seed_feel()), MAX_PAYLOAD, 0x00),
        longer("later_info_of_full_length", 5, Message::Info(device_info()), MAX_PAYLOAD, 0xFF),
    ]
}

fn damaged() -> Vec<Vector> {
    let whole = encode(&Message::Feel(seed_feel()), 3).to_vec();
    let last = whole.len() - 1;
    // Bytes that are no zero and, being data rather than counts of COBS, shift nothing when one bit of them changes.
    let flipped = |frame: &[u8], at: usize, bit: u8| {
        let mut bytes = frame.to_vec();
        bytes[at] ^= bit;
        bytes
    };
    let free = encode(&Message::Free, 7).to_vec();
    let boot = b"\r\nrst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)\r\nconfigsip: 0\r\n\0".to_vec();
    let mut cut = whole[..last - 9].to_vec();
    cut.push(0);
    let mut too_long = vec![0, 67];
    too_long.extend((0..66).map(|i| i + 1));
    too_long.push(0);
    vec![
        bad("crc_bit_in_type", "crc", None, flipped(&free, 2, 0x10)),
        bad("crc_bit_in_seq", "crc", None, flipped(&free, 3, 0x80)),
        bad("crc_bit_in_checksum", "crc", None, flipped(&free, 7, 0x01)),
        bad("crc_bytes_swapped", "crc", None, vec![0, 7, 7, 5, 0x19, 0x73, 0xca, 0xa2, 0]),
        bad("length_cut", "length", None, cut),
        bad("length_cobs_count_too_large", "length", None, flipped(&free, 1, 0x20)),
        bad("length_too_long", "length", None, too_long),
        bad("length_boot_message", "length", None, boot),
        bad("length_five_bytes", "length", None, vec![0, 6, 5, 7, 0x19, 0x73, 0xca, 0]),
        bad("length_one_byte", "length", None, vec![0, 1, 0]),
    ]
}

fn short_payloads() -> Vec<Vector> {
    let sample = |wanted: u8| messages().into_iter().find(|(_, _, message)| message.kind() == wanted);
    [0x01, 0x02, 0x03, 0x04, 0x06, 0x07, 0x08, 0x81, 0x82, 0x83]
        .into_iter()
        .filter_map(sample)
        .map(|(_, seq, message)| {
            let (kind, seq, mut payload) = parts(&message, seq);
            payload.pop();
            let name = format!("length_short_{}", message.name().to_lowercase());
            bad(&name, "length", Some((kind, seq)), framed((kind, seq, payload)))
        })
        .collect()
}

fn out_of_range() -> Vec<Vector> {
    let mut found = Vec::new();
    let feel = |change: &dyn Fn(&mut Feel)| {
        let mut feel = seed_feel();
        change(&mut feel);
        parts(&Message::Feel(feel), 3)
    };
    for (limit, set) in FEEL_FLOATS {
        let just_below = limit.low.next_down();
        let just_above = limit.high.next_up();
        for (what, value) in
            [("below", just_below), ("above", just_above), ("nan", f32::NAN), ("inf", f32::INFINITY)]
        {
            let name = format!("range_feel_{}_{what}", limit.field);
            found.push(refused(&name, limit.field, feel(&|feel| set(feel, value))));
        }
    }
    let patched = |message: Message, seq, at: usize, bytes: &[u8]| {
        let (kind, seq, mut payload) = parts(&message, seq);
        payload[at..at + bytes.len()].copy_from_slice(bytes);
        (kind, seq, payload)
    };
    let event =
        Message::Event(Event { kind: EventKind::Slap, counter: 1, code: 0, feel_id: 0, t_us: 1, value: 1.0 });
    let arm = Arm { session: 1, ceiling_mnm: 451 };
    let hello = Message::Hello { major: 1, minor: 0, session: 1 };
    found.extend([
        refused("range_feel_law", "law", patched(Message::Feel(seed_feel()), 3, 1, &[3])),
        refused("range_feel_morph_ms_below", "morph_ms", feel(&|feel| feel.morph_ms = 19)),
        refused("range_feel_morph_ms_above", "morph_ms", feel(&|feel| feel.morph_ms = 1_001)),
        refused("range_feel_friction", "friction", feel(&|feel| feel.friction = 1_001)),
        refused("range_feel_detent", "detent", feel(&|feel| feel.detent = 1_001)),
        refused("range_feel_h_times_k", "h*k", feel(&|feel| (feel.h, feel.k) = (10.0, 1.000_000_1))),
        refused("range_hello_magic", "magic", patched(hello, 1, 0, b"TTLL")),
        refused("range_arm_ceiling", "ceiling_mnm", parts(&Message::Arm(arm), 1)),
        refused("range_alive_ceiling", "ceiling_mnm", parts(&Message::Alive(arm), 1)),
        refused("range_zero_below", "angle", parts(&Message::Zero(-360_001), 1)),
        refused("range_zero_above", "angle", parts(&Message::Zero(360_001), 1)),
        refused("range_zero_most_negative", "angle", parts(&Message::Zero(i32::MIN), 1)),
        refused("range_rate_below", "hz", parts(&Message::Rate(9), 1)),
        refused("range_rate_above", "hz", parts(&Message::Rate(1_001), 1)),
        refused("range_info_serial", "serial", patched(Message::Info(device_info()), 1, 24, &[0; 8])),
        refused("range_event_kind_0", "kind", patched(event, 1, 0, &[0])),
        refused("range_event_kind_7", "kind", patched(event, 1, 0, &[7])),
        refused("range_event_value_nan", "value", patched(event, 1, 8, &f32::NAN.to_le_bytes())),
        refused("range_event_value_inf", "value", patched(event, 1, 8, &f32::NEG_INFINITY.to_le_bytes())),
    ]);
    found
}

/// Frames with their zeros, as the serial line carries them. Every file decodes by itself and gives one verdict.
pub fn frames() -> Vec<Vector> {
    let unknown = |name: &str, kind, payload: &[u8]| {
        bad(name, "unknown", Some((kind, 1)), framed((kind, 1, payload.to_vec())))
    };
    let written = messages()
        .into_iter()
        .map(|(name, seq, message)| good(name, seq, message, encode(&message, seq).to_vec(), true));
    written
        .chain(later_versions())
        .chain(damaged())
        .chain([
            unknown("unknown_0x00", 0x00, &[]),
            unknown("unknown_0x09", 0x09, &[1, 2, 3]),
            unknown("unknown_0x80", 0x80, &[0; MAX_PAYLOAD]),
            unknown("unknown_0xff", 0xFF, &[0xFF; MAX_PAYLOAD]),
        ])
        .chain(short_payloads())
        .chain(out_of_range())
        .collect()
}

/// SysEx as the MIDI binding carries it, with F0 and F7.
pub fn sysex() -> Vec<Vector> {
    let mut found: Vec<Vector> = messages()
        .into_iter()
        .map(|(name, seq, message)| {
            let bytes = encode_sysex(&message, seq).to_vec();
            Vector { file: format!("{name}.syx"), ..good(name, seq, message, bytes, true) }
        })
        .collect();
    let whole = encode_sysex(&Message::Free, 7).to_vec();
    let mut wrong_bit = whole.clone();
    wrong_bit[6] ^= 0x01;
    let mut open_group = whole.clone();
    open_group.truncate(6);
    open_group.push(0xF7);
    let mut too_long = whole[..5].to_vec();
    too_long.extend([0x55; 75]);
    too_long.push(0xF7);
    for (name, verdict, bytes) in [
        ("crc_bit", "crc", wrong_bit),
        ("length_group_without_bytes", "length", open_group),
        ("length_too_long", "length", too_long),
    ] {
        found.push(Vector { file: format!("{name}.syx"), ..bad(name, verdict, None, bytes) });
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::frame::{Decoder, FrameError};
    use crate::wire::midi::{FromKnob, MidiReceiver};

    /// Holds a vector against what a decoder said.
    fn judge(vector: &Vector, found: &[Result<(u8, Message), FrameError>]) {
        let file = &vector.file;
        assert_eq!(found.len(), 1, "{file}: {found:?}");
        match (&found[0], vector.head) {
            (Ok((seq, message)), Some(head)) => {
                assert_eq!((vector.verdict, head), ("ok", (message.kind(), *seq)), "{file}");
                assert_eq!(vector.message, Some(*message), "{file}");
            }
            (Ok(_), None) => panic!("{file} was read"),
            (Err(error), _) => {
                assert_eq!(error.verdict(), vector.verdict, "{file}: {error}");
                let (head, field) = match *error {
                    FrameError::Range { kind, seq, reason, .. } => (Some((kind, seq)), Some(reason.field)),
                    FrameError::Magic { seq, .. } => (Some((0x01, seq)), Some("magic")),
                    FrameError::UnknownType { kind, seq } => (Some((kind, seq)), None),
                    FrameError::ShortPayload { seq, .. } => (vector.head.map(|(kind, _)| (kind, seq)), None),
                    _ => (None, None),
                };
                assert_eq!((vector.head, vector.field), (head, field), "{file}: {error}");
            }
        }
    }

    #[test]
    fn every_frame_gets_its_verdict() {
        for vector in frames() {
            judge(&vector, &Decoder::new().feed(&vector.bytes).collect::<Vec<_>>());
        }
    }

    #[test]
    fn every_exclusive_message_gets_its_verdict() {
        for vector in sysex() {
            let mut found = Vec::new();
            MidiReceiver::new().feed(&vector.bytes, 0, |said| match said {
                FromKnob::Frame(frame) => found.push(frame),
                other => panic!("{}: {other:?}", vector.file),
            });
            judge(&vector, &found);
        }
    }

    #[test]
    fn what_is_to_be_written_is_written() {
        for vector in frames().iter().filter(|vector| vector.writes) {
            let (Some((_, seq)), Some(message)) = (vector.head, vector.message) else {
                panic!("{}", vector.file)
            };
            assert_eq!(encode(&message, seq)[..], vector.bytes[..], "{}", vector.file);
            assert_eq!(message.check(), Ok(()), "{}", vector.file);
        }
    }

    #[test]
    fn names_are_unique_and_lines_have_all_columns() {
        for vectors in [frames(), sysex()] {
            let mut names: Vec<_> = vectors.iter().map(|vector| vector.file.clone()).collect();
            names.sort();
            names.dedup();
            assert_eq!(names.len(), vectors.len());
            for line in list(&vectors).lines() {
                assert_eq!(line.split('\t').count(), COLUMNS.split('\t').count(), "{line}");
            }
        }
    }

    #[test]
    fn every_type_and_the_longest_frame_are_among_them() {
        let vectors = frames();
        for kind in [1, 2, 3, 4, 5, 6, 7, 8, 0x81, 0x82, 0x83] {
            assert!(vectors.iter().any(|v| v.verdict == "ok" && v.head.is_some_and(|head| head.0 == kind)));
        }
        let longest = vectors.iter().filter(|v| v.verdict == "ok").map(|v| v.bytes.len()).max();
        assert_eq!(longest, Some(crate::wire::frame::MAX_ENCODED));
    }
}
