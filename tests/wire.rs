//! The wire under abuse: round trips, damage, noise, and what is received after it.
//!
//! A CRC-32 lets one damaged frame in 2^32 pass. The floods below hold some 3e6 damaged or random runs whose COBS is
//! good, so 7e-4 false frames are to be expected in all; with the fixed seeds used here there is none, and none is
//! allowed.

use std::collections::HashSet;

use chalumeau_knob::wire::frame::FrameError;
use chalumeau_knob::wire::midi::{FromKnob, MidiReceiver, encode_sysex};
use chalumeau_knob::wire::{
    Arm, Capabilities, Counters, Decoder, DeviceEvent, DeviceState, EventKind, Feel, Flags, Info, Message,
    Stamp, TorqueLaw, encode, limits,
};
use proptest::prelude::*;

/// Bytes through the decoder in each of the two floods.
const FLOOD: usize = 100_000_000;

/// SplitMix64 (Steele, Lea & Flood 2014): good enough noise, the same at every run.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }
}

fn within(limit: limits::FieldRange) -> impl Strategy<Value = f32> {
    prop_oneof![8 => limit.low..=limit.high, 1 => Just(limit.low), 1 => Just(limit.high)]
}

prop_compose! {
    fn landmarks()(
        offset_deg in within(limits::OFFSET_DEG),
        a_on_deg in within(limits::A_ON_DEG),
        a_off_deg in within(limits::A_OFF_DEG),
        a_beat_deg in within(limits::A_BEAT_DEG),
        wall_deg in within(limits::WALL_DEG),
    ) -> Feel {
        Feel { offset_deg, a_on_deg, a_off_deg, a_beat_deg, wall_deg, ..Feel::default() }
    }
}

prop_compose! {
    fn feel()(
        landmarks in landmarks(),
        feel_id: u8,
        law in prop::sample::select(vec![TorqueLaw::Free, TorqueLaw::Flow, TorqueLaw::Pressure]),
        morph_ms in 20u16..=1_000,
        h in within(limits::H),
        k in within(limits::K),
        scale_mnm in within(limits::SCALE_MNM),
        stretch in within(limits::STRETCH),
        wall_mnm_per_deg in within(limits::WALL_MNM_PER_DEG),
        slap_mnm_per_deg in within(limits::SLAP_MNM_PER_DEG),
        (damping_mnms, friction, detent) in (within(limits::DAMPING_MNMS), 0u16..=1_000, 0u16..=1_000),
    ) -> Feel {
        let k = k.min(9.999 / h);
        Feel {
            feel_id, law, morph_ms, h, k, scale_mnm, stretch, wall_mnm_per_deg, slap_mnm_per_deg, damping_mnms,
            friction, detent, ..landmarks
        }
    }
}

fn counters() -> impl Strategy<Value = Option<Counters>> {
    any::<Option<(u16, u16)>>()
        .prop_map(|counted| counted.map(|(overruns, bus_errors)| Counters { overruns, bus_errors }))
}

prop_compose! {
    fn info()(
        (major, minor, capabilities) in (any::<u8>(), any::<u8>(), any::<u16>()),
        firmware: (u8, u8, u16),
        name: [u8; 16],
        serial in 1u64..,
        (counts_per_turn, session) in (any::<u32>(), any::<u32>()),
        loop_hz: u16,
        watchdog_ms: u16,
        fade_ms: u16,
        ceiling_mnm: u16,
        stiffness_limit: u16,
        push_limit: u16,
        counters in counters(),
    ) -> Info {
        Info {
            major, minor, capabilities: Capabilities(capabilities), firmware, name, serial, counts_per_turn, loop_hz,
            watchdog_ms, fade_ms, ceiling_mnm, session, stiffness_limit, push_limit, counters,
        }
    }
}

prop_compose! {
    fn state()(
        t_us: u32, angle: i32, velocity: i16, torque: i16, flags: u16,
        feel_id: u8, slaps: u8, events: u8, fault: u8, epoch: Option<u16>,
    ) -> DeviceState {
        DeviceState { t_us, angle, velocity, torque, flags: Flags(flags), feel_id, slaps, events, fault, epoch }
    }
}

prop_compose! {
    fn event()(
        kind in prop::sample::select(vec![
            EventKind::Slap, EventKind::Button, EventKind::Limit,
            EventKind::Fault, EventKind::Refused, EventKind::Disarmed,
        ]),
        counter: u8, code: u8, feel_id: u8, t_us: u32,
        value in f32::MIN..=f32::MAX,
    ) -> DeviceEvent {
        DeviceEvent { kind, counter, code, feel_id, t_us, value }
    }
}

fn arm() -> impl Strategy<Value = Arm> {
    (any::<u32>(), 0u16..=450, any::<Option<(u16, u32)>>()).prop_map(|(session, ceiling_mnm, stamp)| {
        let stamp = stamp.map(|(epoch, heard_us)| Stamp { epoch, heard_us });
        Arm { session, ceiling_mnm, stamp }
    })
}

fn message() -> impl Strategy<Value = Message> {
    prop_oneof![
        any::<(u8, u8, u32)>().prop_map(|(major, minor, session)| Message::Hello { major, minor, session }),
        feel().prop_map(Message::Feel),
        arm().prop_map(Message::Arm),
        arm().prop_map(Message::Alive),
        Just(Message::Free),
        (-360_000i32..=360_000).prop_map(Message::Zero),
        (10u16..=1_000).prop_map(Message::Rate),
        any::<u32>().prop_map(|session| Message::Bye { session }),
        info().prop_map(Message::Info),
        state().prop_map(Message::State),
        event().prop_map(Message::Event),
    ]
}

fn decoded(bytes: &[u8]) -> Vec<Result<(u8, Message), FrameError>> {
    Decoder::new().feed(bytes).collect()
}

fn heard(bytes: &[u8]) -> Vec<FromKnob> {
    let mut found = Vec::new();
    MidiReceiver::new().feed(bytes, 0, |said| found.push(said));
    found
}

proptest! {
    #[test]
    fn every_message_comes_back(message in message(), seq: u8) {
        prop_assert_eq!(message.check(), Ok(()));
        let frame = encode(&message, seq);
        prop_assert_eq!((frame[0], frame[frame.len() - 1]), (0, 0));
        prop_assert!(frame[1..frame.len() - 1].iter().all(|&byte| byte != 0), "a zero inside {:?}", frame);
        prop_assert_eq!(decoded(&frame), [Ok((seq, message))]);
        let sysex = encode_sysex(&message, seq);
        prop_assert!(sysex[1..sysex.len() - 1].iter().all(|&byte| byte < 0x80), "no data byte in {:?}", sysex);
        prop_assert_eq!(heard(&sysex), [FromKnob::Frame(Ok((seq, message)))]);
    }

    #[test]
    fn each_damaged_byte_is_refused(message in message(), seq: u8, mask in 1u8..=255) {
        let frame = encode(&message, seq);
        for at in 1..frame.len() - 1 {
            let mut damaged = frame.to_vec();
            damaged[at] ^= mask;
            prop_assert!(decoded(&damaged).iter().all(Result::is_err), "byte {} of {:?}", at, frame);
        }
        let sysex = encode_sysex(&message, seq);
        let intact = [FromKnob::Frame(Ok((seq, message)))];
        for at in 1..sysex.len() - 1 {
            let mut damaged = sysex.to_vec();
            damaged[at] ^= mask;
            let same_bits = heard(&damaged) == intact;
            // Top bits of bytes that the last group does not have stand for nothing, and clock inside is allowed.
            prop_assert!(
                !heard(&damaged).iter().any(|said| matches!(said, FromKnob::Frame(Ok(_)))) || same_bits,
                "byte {} of {:?}", at, sysex
            );
        }
    }

    #[test]
    fn lost_doubled_and_added_bytes_are_refused(message in message(), seq: u8, byte in 1u8..=255) {
        let frame = encode(&message, seq);
        for at in 1..frame.len() - 1 {
            let mut lost = frame.to_vec();
            lost.remove(at);
            let mut doubled = frame.to_vec();
            doubled.insert(at, frame[at]);
            let mut added = frame.to_vec();
            added.insert(at, byte);
            let mut parted = frame.to_vec();
            parted.insert(at + 1, 0);
            for damaged in [lost, doubled, added, parted] {
                // A zero put in front of the last one parts nothing: the frame is intact.
                let found = decoded(&damaged);
                let is_intact = damaged.starts_with(&frame);
                prop_assert_eq!(found.iter().any(Result::is_ok), is_intact, "byte {} of {:?}", at, frame);
            }
        }
    }
}

/// Pure noise, in turns with random frames whose COBS is good, so that it is the checksum that has to refuse them.
#[test]
fn random_bytes_give_no_message() {
    let mut decoder = Decoder::new();
    let mut noise = Noise(1);
    let (mut fed, mut others, mut refused) = (0, 0_u64, 0_u64);
    while fed < FLOOD {
        let mut body = [0; 64];
        body.as_chunks_mut().0.iter_mut().for_each(|chunk| *chunk = noise.next().to_le_bytes());
        let mut bytes = [0; 67];
        let length = if noise.below(2) == 0 {
            bytes[..64].copy_from_slice(&body);
            64
        } else {
            2 + cobs::encode(&body[..noise.below(65)], &mut bytes[1..66])
        };
        for &byte in &bytes[..length] {
            others += u64::from(byte != 0);
            match decoder.push(byte) {
                Some(Ok((seq, message))) => panic!("nobody sent {message:?} as {seq}"),
                Some(Err(_)) => refused += 1,
                None => {}
            }
        }
        fed += length;
    }
    let stats = decoder.stats();
    assert_eq!(refused, stats.crc_errors + stats.length_errors);
    assert!(stats.crc_errors > 500_000 && stats.length_errors > 300_000, "{stats:?}");
    assert!(others - stats.skipped_bytes < 4_096, "all but the last run is counted: {stats:?}");
}

/// The messages in `firmware/golden` that this version writes.
fn golden_messages() -> Vec<Message> {
    let list = include_str!("../firmware/golden/list.tsv");
    let lines = list.lines().skip(1).map(|line| line.split('\t').collect::<Vec<_>>());
    let written = lines.filter(|columns| columns[1] == "ok" && columns[5] == "yes");
    let messages = written.map(|columns| {
        let hex = columns[6].as_bytes().as_chunks::<2>().0;
        let bytes = hex.iter().map(|two| u8::from_str_radix(str::from_utf8(two).unwrap(), 16).unwrap());
        let (seq, message) = decoded(&bytes.collect::<Vec<u8>>())[0].unwrap();
        assert_eq!((columns[2], columns[3]), (&*format!("0x{:02x}", message.kind()), &*seq.to_string()));
        message
    });
    messages.collect()
}

/// One frame as sent: where its bytes are in the damaged stream, if all of them and both zeros are still there.
struct Sent {
    seq: u8,
    message: Message,
    /// Index, in the stream, of its last zero.
    intact_until: Option<usize>,
}

/// A stretch of frames, one after the other, damaged in some places; and what became of each.
fn damaged_stream(samples: &[Message], noise: &mut Noise, stream: &mut Vec<u8>) -> Vec<Sent> {
    stream.clear();
    let mut sent = Vec::new();
    for seq in 0..200_u8 {
        let message = samples[noise.below(samples.len())];
        let frame = encode(&message, seq);
        // Frames may share a zero: half of them leave out their own first one where the frame before left one.
        let shares = stream.last() == Some(&0) && noise.below(2) == 0;
        let mut bytes = frame[usize::from(shares)..].to_vec();
        let damage = noise.below(16);
        let at = noise.below(bytes.len());
        match damage {
            0 | 1 => bytes[at] ^= 1 << noise.below(8),
            2 => _ = bytes.remove(at),
            3 => bytes.insert(at, bytes[at]),
            4 => bytes.insert(at, 0),
            5 => bytes.truncate(at),
            6 => bytes[at] = noise.next() as u8,
            7 => (0..noise.below(100)).for_each(|_| bytes.insert(at, noise.next() as u8)),
            _ => {}
        }
        let is_whole = if shares { bytes == frame[1..] } else { bytes == frame[..] };
        // Without damage of its own and with a zero in front, its own or the one shared, it has to be received.
        let has_zero = !shares || stream.last() == Some(&0);
        stream.extend_from_slice(&bytes);
        sent.push(Sent { seq, message, intact_until: (is_whole && has_zero).then(|| stream.len() - 1) });
    }
    sent
}

/// The promise of the protocol, and that nothing is received that was not sent.
#[test]
fn every_intact_frame_is_received_and_nothing_else() {
    let samples = golden_messages();
    // Damage may leave a frame's meaning whole (a byte doubled at a zero, say): what counts as false is a message with a
    // sequence number under which it was never sent.
    let known: HashSet<Vec<u8>> =
        samples.iter().flat_map(|m| (0..200).map(|seq| encode(m, seq).to_vec())).collect();
    let mut noise = Noise(2);
    let mut decoder = Decoder::new();
    let mut stream = Vec::new();
    let (mut fed, mut intact, mut damaged, mut received, mut late) = (0, 0_u64, 0_u64, 0_u64, 0_u64);
    while fed < FLOOD {
        let sent = damaged_stream(&samples, &mut noise, &mut stream);
        let mut waiting = sent.iter().filter(|sent| sent.intact_until.is_some()).peekable();
        damaged += sent.iter().filter(|sent| sent.intact_until.is_none()).count() as u64;
        for (index, &byte) in stream.iter().enumerate() {
            let found = decoder.push(byte);
            if let Some(Ok((seq, message))) = found {
                received += 1;
                let frame = encode(&message, seq);
                assert!(known.contains(&frame[..]), "nobody sent {message:?} as {seq}");
                late += u64::from(sent[usize::from(seq)].intact_until != Some(index));
            }
            if let Some(due) = waiting.next_if(|sent| sent.intact_until == Some(index)) {
                intact += 1;
                assert_eq!(found, Some(Ok((due.seq, due.message))), "intact, and not received");
            }
        }
        fed += stream.len();
    }
    assert!(intact > 500_000 && damaged > 300_000, "{intact} intact, {damaged} damaged");
    // The rest are frames whose damage did them no harm, such as one zero more.
    assert_eq!(received, intact + late);
    assert!(late < damaged / 4, "{late} of {damaged} damaged frames were still received");
    assert_eq!(decoder.stats().frames, received);
}

#[test]
fn random_midi_gives_no_frame() {
    let mut receiver = MidiReceiver::new();
    let mut noise = Noise(3);
    let header = [0xF0, 0x7D, 0x54, 0x54, 0x01];
    let mut frames = 0_u64;
    for t_us in 0..2_000_000 {
        let bytes = noise.next().to_le_bytes();
        if bytes[0] < 32 {
            receiver.feed(&header, t_us, |_| {});
        }
        receiver.feed(&bytes.map(|byte| if bytes[7] < 250 { byte & 0x7F } else { byte }), t_us, |said| {
            frames += u64::from(matches!(said, FromKnob::Frame(Ok(_))));
            if let FromKnob::Breath(breath) = said {
                assert!(breath <= 16_383);
            }
        });
    }
    assert_eq!(frames, 0, "messages nobody sent");
    assert!(receiver.stats().crc_errors + receiver.stats().length_errors > 100_000, "{:?}", receiver.stats());
}
