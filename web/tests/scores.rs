//! The module plays the bits of `Clarinet`: twenty short scores and the example melody, as messages into [`Playing`] and as
//! events into the core.
//!
//! `web/tests/scores.json` holds the messages and the hash of each score. The browser's tests play the same messages through
//! the WebAssembly module and compare. A change of sound that is meant is written by
//! `UPDATE_GOLDEN=1 cargo test -p chalumeau-web --test scores`.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use assert_no_alloc::assert_no_alloc;
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::control::parts::Parts;
use chalumeau_core::event::{Event, PartEvent, SettingNumber, Timed};
use chalumeau_core::instrument::stereo::Stereo;
use chalumeau_core::instrument::{Channels, Clarinet, Ensemble, Preparation, Settings, Split, Wanted};
use chalumeau_core::score::midi_file;
use chalumeau_web::playing::{MOST_FRAMES, Playing};
use chalumeau_web::values::{self, NUMBERS};
use midly::{Smf, Timing, TrackEventKind};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

#[path = "../../tests/support/part.rs"]
mod part;

/// Optimised builds without debug assertions only compare the bits.
#[cfg(debug_assertions)]
#[global_allocator]
static ALLOCATOR: assert_no_alloc::AllocDisabler = assert_no_alloc::AllocDisabler;

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/scores.json");
const SCORES: u64 = 20;
/// Length of a random score, s.
const SECONDS: f64 = 0.8;
/// The score with several players.
const WITH_PLAYERS: u64 = 19;

/// What the page may send.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Message {
    Midi(u8, u8, u8),
    Breath(f32),
    Set(usize, f32),
}

struct Piece {
    name: String,
    instrument: usize,
    rate_hz: u32,
    samples: usize,
    messages: Vec<(usize, Message)>,
}

/// SplitMix64 (Steele, Lea, Flood, 2014): the same numbers on every machine.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, count: u64) -> u64 {
        self.next() % count
    }

    /// From `low` to `high`, in 64 steps.
    fn within(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.below(65) as f32 / 64.0
    }
}

/// Settings that scores move, with their ranges.
const MOVED: [(SettingNumber, f32, f32); 14] = [
    (SettingNumber::Lip, 0.8, 1.2),
    (SettingNumber::Strength, 2.0, 3.5),
    (SettingNumber::Zeta, 0.2, 0.4),
    (SettingNumber::Lay, 0.0, 0.5),
    (SettingNumber::Noise, 0.0, 1.0),
    (SettingNumber::VibratoDepth, 0.0, 1.0),
    (SettingNumber::Growl, 0.0, 1.0),
    (SettingNumber::Flutter, 0.0, 1.0),
    (SettingNumber::Subtone, 0.0, 1.0),
    (SettingNumber::TractAmount, 0.0, 1.0),
    (SettingNumber::GlissandoS, 0.0, 0.5),
    (SettingNumber::ScoopCents, 0.0, 200.0),
    (SettingNumber::RoomAmount, 0.0, 1.0),
    (SettingNumber::A4Hz, 430.0, 450.0),
];

fn place(number: SettingNumber) -> usize {
    NUMBERS.iter().position(|&other| other == number).unwrap()
}

fn random_piece(seed: u64) -> Piece {
    let mut random = Random(seed);
    let instrument = seed as usize % Bundled::ALL.len();
    let rate_hz = if seed % 4 == 3 { 44_100 } else { 48_000 };
    let samples = (SECONDS * f64::from(rate_hz)) as usize;
    let lowest = (52 - i16::from(Bundled::ALL[instrument].file().transposition)) as u8;
    let mut last = lowest + 12;
    let mut messages = Vec::new();
    for _ in 0..random.below(4) {
        let (number, low, high) = MOVED[random.below(MOVED.len() as u64) as usize];
        messages.push((0, Message::Set(place(number), random.within(low, high))));
    }
    if seed == WITH_PLAYERS {
        let places = NUMBERS.len();
        messages.push((0, Message::Set(places + 8, 3.0)));
        messages.push((0, Message::Set(places + 9, 1.0)));
    }
    messages.push((0, Message::Midi(0x90, last, 100)));
    let mut later: Vec<_> = (0..14)
        .map(|_| {
            let at = random.below(samples as u64) as usize;
            let value = random.below(128) as u8;
            let message = match random.below(16) {
                0..=4 => {
                    last = lowest + random.below(40) as u8;
                    Message::Midi(0x90, last, value.max(20))
                }
                5 | 6 => Message::Midi(0x80, last, 0),
                7 | 8 => Message::Midi(0xb0, 2, value),
                9 => Message::Midi(0xb0, 11, value),
                10 => Message::Midi(0xb0, 1, value),
                11 => Message::Midi(0xd0, value, 0),
                12 => Message::Midi(0xe0, random.below(128) as u8, value),
                13 => Message::Breath(random.within(0.0, 1.0)),
                14 => Message::Midi(0xb0, 64, value),
                _ => {
                    let (number, low, high) = MOVED[random.below(MOVED.len() as u64) as usize];
                    Message::Set(place(number), random.within(low, high))
                }
            };
            (at, message)
        })
        .collect();
    later.sort_by_key(|(at, _)| *at);
    messages.extend(later);
    Piece { name: format!("score {seed}"), instrument, rate_hz, samples, messages }
}

/// The example melody as raw messages, at the samples at which the core's reader puts them.
fn melody(rate_hz: u32) -> Piece {
    let bytes = include_bytes!("../../examples/melody.mid");
    let smf = Smf::parse(bytes).unwrap();
    let Timing::Metrical(quarter) = smf.header.timing else { panic!("ticks per quarter") };
    let mut all: Vec<(u64, TrackEventKind)> = Vec::new();
    for track in &smf.tracks {
        let mut tick = 0;
        for event in track {
            tick += u64::from(event.delta.as_int());
            all.push((tick, event.kind));
        }
    }
    all.sort_by_key(|(tick, _)| *tick);
    // Microseconds times ticks per quarter, which is exact.
    let (mut time, mut tempo, mut before) = (0_u128, 500_000_u128, 0);
    let per_second = 1_000_000 * u128::from(quarter.as_int());
    let mut messages = Vec::new();
    for (tick, kind) in all {
        time += u128::from(tick - before) * tempo;
        before = tick;
        let at = ((2 * time * u128::from(rate_hz) + per_second) / (2 * per_second)) as usize;
        match kind {
            TrackEventKind::Meta(midly::MetaMessage::Tempo(us)) => tempo = u128::from(us.as_int()),
            TrackEventKind::Midi { channel, message } => {
                let mut raw = Vec::new();
                midly::live::LiveEvent::Midi { channel, message }.write_std(&mut raw).unwrap();
                messages.push((at, Message::Midi(raw[0], raw[1], raw.get(2).copied().unwrap_or(0))));
            }
            _ => {}
        }
    }
    let samples = midi_file::read(bytes, rate_hz).unwrap().samples;
    Piece { name: "melody".to_owned(), instrument: 0, rate_hz, samples, messages }
}

fn pieces() -> Vec<Piece> {
    (0..SCORES).map(random_piece).chain([melody(48_000)]).collect()
}

fn hash(left: &[f32], right: &[f32]) -> String {
    let mut hasher = Sha256::new();
    for (left, right) in left.iter().zip(right) {
        hasher.update(left.to_le_bytes());
        hasher.update(right.to_le_bytes());
    }
    hasher.finalize().iter().fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").unwrap();
        text
    })
}

/// As the page plays it, in blocks of a worklet that messages cut.
fn through_module(piece: &Piece) -> [Vec<f32>; 2] {
    let mut playing = Playing::new(f64::from(piece.rate_hz), Bundled::ALL[piece.instrument]).unwrap();
    let mut out = [Vec::with_capacity(piece.samples), Vec::with_capacity(piece.samples)];
    let (mut done, mut messages) = (0, piece.messages.iter().peekable());
    // Nothing of this may allocate: the buffers of the samples are as long as the piece.
    assert_no_alloc(|| {
        while done < piece.samples {
            while let Some((_, message)) = messages.next_if(|(at, _)| *at <= done) {
                match *message {
                    Message::Midi(status, first, second) => playing.midi(status, first, second),
                    Message::Breath(unit) => playing.breath(Some(unit)),
                    Message::Set(at, value) => {
                        playing.set(at, value);
                        playing.settle();
                    }
                }
            }
            let next = messages.peek().map_or(piece.samples, |(at, _)| (*at).min(piece.samples));
            let frames = playing.process(128.min(next - done));
            for (channel, out) in out.iter_mut().enumerate() {
                out.extend_from_slice(&playing.channel(channel)[..frames]);
            }
            playing.picture();
            done += frames;
        }
    });
    out
}

/// The same as events of the core, rendered in one block by one `Clarinet`.
fn through_clarinet(piece: &Piece) -> [Vec<f32>; 2] {
    let rate_hz = f64::from(piece.rate_hz);
    let wanted = Wanted::new(Bundled::ALL[piece.instrument].file(), rate_hz);
    let model = Arc::new(Preparation::new(&wanted, None).ready().unwrap().unwrap());
    let mut parts = Parts::new(1);
    let (mut settings, mut events) = (Settings::default(), Vec::<Timed<PartEvent>>::new());
    for &(at, message) in &piece.messages {
        let timed = |event: &PartEvent| Timed { at, event: *event };
        match message {
            Message::Midi(status, first, second) => {
                let said = match status & 0xf0 {
                    0x80 => parts.note_off(0, first),
                    0x90 => parts.note_on(0, first, second),
                    0xb0 => parts.controller(0, first, second),
                    0xd0 => parts.pressure(0, first),
                    _ => parts.bend(0, u16::from(second) << 7 | u16::from(first)),
                };
                events.extend(said.iter().map(timed));
            }
            Message::Breath(unit) => events.push(timed(&Event::Breath(unit).into())),
            Message::Set(place, value) => match NUMBERS.get(place) {
                Some(&number) => events.push(timed(&Event::Set(number, value).into())),
                None => {
                    values::set(&mut settings, place, value);
                    parts.set_count(settings.players.count as usize);
                }
            },
        }
    }
    let mut out = [vec![0.0; piece.samples], vec![0.0; piece.samples]];
    let [left, right] = &mut out;
    let mut stereo = Stereo::new(rate_hz);
    if settings.players.count == 1 {
        let mut clarinet = Clarinet::new(model, rate_hz);
        clarinet.set_settings(&settings);
        let events: Vec<_> = events.iter().map(|e| Timed { at: e.at, event: e.event.event }).collect();
        events.iter().for_each(|event| stereo.heed(event));
        clarinet.render_events_channels(events.iter().copied(), Channels::two(left, right));
    } else {
        assert_eq!(settings.players.split, Split::Unison);
        let mut ensemble = Ensemble::new(model, rate_hz);
        ensemble.set_settings(&settings);
        ensemble.render_events_channels(events.iter().copied(), Channels::two(left, right));
    }
    stereo.pan(left, right);
    out
}

#[test]
fn the_module_plays_the_bits_of_the_clarinet() {
    let all = pieces();
    let chosen = part::of(all.len());
    let mut made = Vec::new();
    for piece in &all[chosen.clone()] {
        let [left, right] = through_module(piece);
        let heard = left.iter().chain(&right).fold(0.0_f32, |most, sample| most.max(sample.abs()));
        assert!(heard > 0.01 && heard <= 1.0, "{}: {heard}", piece.name);
        let own = hash(&left, &right);
        let [left, right] = through_clarinet(piece);
        assert_eq!(own, hash(&left, &right), "{}", piece.name);
        made.push(as_json(piece, &own).to_string());
    }
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(FILE, format!("[\n{}\n]\n", made.join(",\n"))).unwrap();
    }
    let kept = std::fs::read_to_string(Path::new(FILE)).unwrap();
    let kept: Vec<_> = kept.lines().filter(|line| line.starts_with('{')).collect();
    assert_eq!(kept.len(), all.len(), "{FILE} has other scores");
    for (number, made) in chosen.zip(&made) {
        let kept = kept[number].trim_end_matches(',');
        assert!(kept == made, "{}: {FILE} is out of date; is the change of sound meant?", all[number].name);
    }
}

fn as_json(piece: &Piece, hash: &str) -> Value {
    let messages = piece.messages.iter().map(|&(at, message)| match message {
        Message::Midi(status, first, second) => json!([at, status, first, second]),
        Message::Breath(unit) => json!([at, "breath", unit]),
        Message::Set(place, value) => json!([at, "set", place, value]),
    });
    json!({
        "name": piece.name,
        "instrument": piece.instrument,
        "rate": piece.rate_hz,
        "samples": piece.samples,
        "hash": hash,
        "messages": messages.collect::<Vec<_>>(),
    })
}

#[test]
fn the_melodys_messages_come_when_the_reader_says() {
    let score = midi_file::read(include_bytes!("../../examples/melody.mid"), 48_000).unwrap();
    let (mut parts, mut events) = (Parts::new(1), Vec::new());
    for (at, message) in melody(48_000).messages {
        let Message::Midi(status, first, second) = message else { panic!("{message:?}") };
        let said = match status & 0xf0 {
            0x80 => parts.note_off(0, first),
            0x90 => parts.note_on(0, first, second),
            _ => parts.controller(0, first, second),
        };
        events.extend(said.iter().map(|said| Timed { at, event: said.event }));
    }
    assert_eq!(events, score.events);
}

#[test]
fn another_instrument_takes_over_the_note() {
    let mut before = Playing::new(48_000.0, Bundled::BFlat).unwrap();
    before.set(place(SettingNumber::Growl), 0.3);
    before.settle();
    // At the right: the pan goes on, too.
    before.midi(0xb0, 10, 127);
    before.midi(0x90, 60, 100);
    for _ in 0..8 {
        before.process(MOST_FRAMES);
    }
    let mut after = Playing::new(48_000.0, Bundled::Bass).unwrap();
    after.carry_on(before);
    let [left, right] = (0..24).fold([0.0_f32; 2], |most, _| {
        let frames = after.process(MOST_FRAMES);
        [0, 1].map(|side| {
            after.channel(side)[..frames].iter().fold(most[side], |most, sample| most.max(sample.abs()))
        })
    });
    let picture = after.picture();
    assert!(right > 0.01 && left < 1e-3 && picture[0] == 60.0, "{left} {right} {picture:?}");
}

#[test]
fn another_instrument_takes_over_without_a_pop_or_a_step() {
    for velocity in [20, 100] {
        let mut before = Playing::new(48_000.0, Bundled::BFlat).unwrap();
        before.midi(0x90, 60, velocity);
        let mut samples = Vec::new();
        for _ in 0..200 {
            let frames = before.process(MOST_FRAMES);
            samples.extend_from_slice(&before.channel(0)[..frames]);
        }
        let held = &samples[samples.len() - 4_800..];
        let peak = held.iter().fold(0.0_f32, |most, sample| most.max(sample.abs()));
        let step = held.windows(2).fold(0.0_f32, |most, pair| most.max((pair[1] - pair[0]).abs()));
        let mut all = vec![samples[samples.len() - 1]];
        let mut after = Playing::new(48_000.0, Bundled::A).unwrap();
        after.carry_on(before);
        // The same note on another clarinet: it begins anew, and no louder.
        for _ in 0..200 {
            let frames = after.process(MOST_FRAMES);
            all.extend_from_slice(&after.channel(0)[..frames]);
        }
        let found = all.iter().fold(0.0_f32, |most, sample| most.max(sample.abs()));
        let steps = all.windows(2).fold(0.0_f32, |most, pair| most.max((pair[1] - pair[0]).abs()));
        println!("velocity {velocity}: peak {peak:.3}, then {found:.3}; step {step:.4}, then {steps:.4}");
        assert!(found < 1.3 * peak && steps < 2.0 * step, "{velocity}: {found} of {peak}, {steps} of {step}");
    }
}
