//! All golden frames: the messages as they are, and frames that are longer, damaged, cut or out of range.

use chalumeau_knob::wire::frame::{FrameBody, MAX_PAYLOAD, encode};
use chalumeau_knob::wire::limits::{self, FieldRange};
use chalumeau_knob::wire::midi::encode_sysex;
use chalumeau_knob::wire::{Arm, DeviceEvent, DeviceState, EventKind, Feel, Message, Stamp};

use crate::wire_vectors::golden_frame::GoldenFrame;
use crate::wire_vectors::messages::{device_info, messages, reference_feel};

/// Type, sequence number and payload of a message as bytes, to be damaged.
fn parts(message: &Message, seq: u8) -> (u8, u8, Vec<u8>) {
    (message.kind(), seq, FrameBody::new(message, seq).payload().to_vec())
}

fn framed((kind, seq, payload): (u8, u8, Vec<u8>)) -> Vec<u8> {
    FrameBody::from_parts(kind, seq, &payload).framed().to_vec()
}

fn good(name: &str, seq: u8, message: Message, bytes: Vec<u8>, writes: bool) -> GoldenFrame {
    GoldenFrame {
        file: format!("{name}.bin"),
        bytes,
        verdict: "ok",
        head: Some((message.kind(), seq)),
        message: Some(message),
        field: None,
        writes,
    }
}

fn bad(name: &str, verdict: &'static str, head: Option<(u8, u8)>, bytes: Vec<u8>) -> GoldenFrame {
    let file = format!("{name}.bin");
    GoldenFrame { file, bytes, verdict, head, message: None, field: None, writes: false }
}

fn refused(name: &str, field: &'static str, parts: (u8, u8, Vec<u8>)) -> GoldenFrame {
    let head = Some((parts.0, parts.1));
    GoldenFrame { field: Some(field), ..bad(name, "range", head, framed(parts)) }
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
fn later_versions() -> Vec<GoldenFrame> {
    let longer = |name: &str, seq, message: Message, length: usize, filling: u8| {
        let (kind, seq, mut payload) = parts(&message, seq);
        payload.resize(length, filling);
        good(name, seq, message, framed((kind, seq, payload)), false)
    };
    let state = DeviceState { t_us: 5, angle: 6, epoch: Some(0), ..DeviceState::default() };
    vec![
        longer("later_free", 1, Message::Free, 3, 0xAA),
        longer("later_free_of_full_length", 2, Message::Free, MAX_PAYLOAD, 0xFF),
        longer("later_state", 3, Message::State(state), 24, 0x00),
        longer("later_feel_of_full_length", 4, Message::Feel(reference_feel()), MAX_PAYLOAD, 0x00),
        longer("later_info_of_full_length", 5, Message::Info(device_info()), MAX_PAYLOAD, 0xFF),
    ]
}

fn damaged() -> Vec<GoldenFrame> {
    let whole = encode(&Message::Feel(reference_feel()), 3).to_vec();
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

/// Payloads one byte shorter than the least, which is that of TTLink 1.0.
fn short_payloads() -> Vec<GoldenFrame> {
    let sample = |wanted: u8| messages().into_iter().find(|(_, _, message)| message.kind() == wanted);
    [
        (0x01, 12),
        (0x02, 56),
        (0x03, 8),
        (0x04, 8),
        (0x06, 4),
        (0x07, 2),
        (0x08, 4),
        (0x81, 52),
        (0x82, 18),
        (0x83, 12),
    ]
    .into_iter()
    .filter_map(|(kind, least)| Some((sample(kind)?, least)))
    .map(|((_, seq, message), least)| {
        let (kind, seq, mut payload) = parts(&message, seq);
        payload.truncate(least - 1);
        let name = format!("length_short_{}", message.name().to_lowercase());
        bad(&name, "length", Some((kind, seq)), framed((kind, seq, payload)))
    })
    .collect()
}

fn out_of_range() -> Vec<GoldenFrame> {
    let mut found = Vec::new();
    let feel = |change: &dyn Fn(&mut Feel)| {
        let mut feel = reference_feel();
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
    let event = Message::Event(DeviceEvent {
        kind: EventKind::Slap,
        counter: 1,
        code: 0,
        feel_id: 0,
        t_us: 1,
        value: 1.0,
    });
    let arm = Arm { session: 1, ceiling_mnm: 451, stamp: Some(Stamp::default()) };
    let hello = Message::Hello { major: 1, minor: 1, session: 1 };
    found.extend([
        refused("range_feel_law", "law", patched(Message::Feel(reference_feel()), 3, 1, &[3])),
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
pub fn frames() -> Vec<GoldenFrame> {
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
pub fn sysex() -> Vec<GoldenFrame> {
    let mut found: Vec<GoldenFrame> = messages()
        .into_iter()
        .map(|(name, seq, message)| {
            let bytes = encode_sysex(&message, seq).to_vec();
            GoldenFrame { file: format!("{name}.syx"), ..good(name, seq, message, bytes, true) }
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
        found.push(GoldenFrame { file: format!("{name}.syx"), ..bad(name, verdict, None, bytes) });
    }
    found
}
