//! How notes are named, in the bundled CLAP: by id, channel, key and wildcards. Each case of one table says what a host
//! does, which events of the instrument that is, what is heard in the end, and which notes the host is told to be over.

use chalumeau_core::analysis::pitch::fundamental_hz;
use chalumeau_core::analysis::to_f64;
use chalumeau_core::event::{Event, Timed};
use chalumeau_core::instrument::Clarinet;
use chalumeau_core::units::SoundingNote;
use chalumeau_test_host::clap::{At, NoteExpressionType, NoteName, Plugin, Say, VoiceInfoFlags};

const RATE: f64 = 48_000.0;
/// Samples from one step of a case to the next. The lowest note of a case speaks within 50 ms.
const STEP: usize = 4_800;
/// Samples of listening after the last step: the end of a note rings for less than a second, and the plugin takes 4096 samples
/// of silence for the end.
const LISTEN: usize = 72_000;
/// Velocity of every note, as MIDI and in the instrument.
const VELOCITY: u8 = 100;

/// Every note.
const ANY: NoteName = NoteName { id: None, channel: None, key: None };

const fn id(id: u32) -> NoteName {
    NoteName { id: Some(id), ..ANY }
}

const fn key(key: u16) -> NoteName {
    NoteName { key: Some(key), ..ANY }
}

const fn channel(channel: u16) -> NoteName {
    NoteName { channel: Some(channel), ..ANY }
}

const fn name(id: u32, channel: u16, key: u16) -> NoteName {
    NoteName { id: Some(id), channel: Some(channel), key: Some(key) }
}

/// A MIDI note, which has no id.
const fn midi_name(channel: u16, key: u16) -> NoteName {
    NoteName { id: None, channel: Some(channel), key: Some(key) }
}

const fn strike(id: u32, key: u16) -> Say {
    strike_on(id, 0, key)
}

const fn strike_on(id: u32, channel: u16, key: u16) -> Say {
    Say::Strike(name(id, channel, key), VELOCITY as f64 / 127.0)
}

const fn tune(name: NoteName, semitones: f64) -> Say {
    Say::ExpressNotes(name, NoteExpressionType::Tuning, semitones)
}

const fn press(name: NoteName, pressure: f64) -> Say {
    Say::ExpressNotes(name, NoteExpressionType::Pressure, pressure)
}

const fn pedal(value: u8) -> Say {
    Say::Midi([0xB0, 64, value])
}

const fn on(key: u8) -> Event {
    Event::NoteOn { note: SoundingNote(key), velocity: VELOCITY as f32 / 127.0 }
}

const fn off(key: u8) -> Event {
    Event::NoteOff { note: SoundingNote(key) }
}

const fn choked(key: u8) -> Event {
    Event::Choke { note: SoundingNote(key) }
}

const fn bend(cents: f32) -> Event {
    Event::Bend { cents }
}

struct Case {
    name: &'static str,
    /// What the host does, a step each.
    does: &'static [Say],
    /// The same as events of the instrument, and the step of each.
    means: &'static [(usize, Event)],
    /// What is heard in the end: a key, with hundredths for cents; `None` for silence.
    heard: Option<f64>,
    /// The notes that the host is told to be over, in order.
    over: &'static [NoteName],
}

const fn case(
    name: &'static str,
    does: &'static [Say],
    means: &'static [(usize, Event)],
    heard: Option<f64>,
    over: &'static [NoteName],
) -> Case {
    Case { name, does, means, heard, over }
}

const ONE: NoteName = name(1, 0, 60);
const TWO: NoteName = name(2, 0, 64);
/// The second note of the first key.
const TWIN: NoteName = name(2, 0, 60);

const CASES: &[Case] = &[
    // One note.
    case(
        "its whole name releases a note",
        &[strike(1, 60), Say::Release(ONE)],
        &[(0, on(60)), (1, off(60))],
        None,
        &[ONE],
    ),
    case(
        "its id alone does, though the id looks like a key",
        &[strike(64, 60), Say::Release(id(64))],
        &[(0, on(60)), (1, off(60))],
        None,
        &[name(64, 0, 60)],
    ),
    case(
        "its key alone does",
        &[strike(1, 60), Say::Release(key(60))],
        &[(0, on(60)), (1, off(60))],
        None,
        &[ONE],
    ),
    case(
        "its channel and key do",
        &[strike(1, 60), Say::Release(midi_name(0, 60))],
        &[(0, on(60)), (1, off(60))],
        None,
        &[ONE],
    ),
    case(
        "its channel alone does",
        &[strike(1, 60), Say::Release(channel(0))],
        &[(0, on(60)), (1, off(60))],
        None,
        &[ONE],
    ),
    case(
        "wildcards alone do",
        &[strike(1, 60), Say::Release(ANY)],
        &[(0, on(60)), (1, off(60))],
        None,
        &[ONE],
    ),
    case(
        "another id does not",
        &[strike(1, 60), Say::Release(name(7, 0, 60))],
        &[(0, on(60))],
        Some(60.0),
        &[],
    ),
    case(
        "another key does not",
        &[strike(1, 60), Say::Release(name(1, 0, 61))],
        &[(0, on(60))],
        Some(60.0),
        &[],
    ),
    case(
        "another channel does not",
        &[strike(1, 60), Say::Release(name(1, 3, 60))],
        &[(0, on(60))],
        Some(60.0),
        &[],
    ),
    case(
        "an id that has gone does not",
        &[strike(1, 60), Say::Release(ONE), strike(2, 64), Say::Release(id(1))],
        &[(0, on(60)), (1, off(60)), (2, on(64))],
        Some(64.0),
        &[ONE],
    ),
    // Notes of several keys.
    case(
        "the last note struck is heard",
        &[strike(1, 60), strike(2, 64)],
        &[(0, on(60)), (1, on(64))],
        Some(64.0),
        &[],
    ),
    case(
        "its release gives the note before it",
        &[strike(1, 60), strike(2, 64), Say::Release(id(2))],
        &[(0, on(60)), (1, on(64)), (2, off(64))],
        Some(60.0),
        &[TWO],
    ),
    case(
        "an unheard note is released unheard",
        &[strike(1, 60), strike(2, 64), Say::Release(id(1))],
        &[(0, on(60)), (1, on(64)), (2, off(60))],
        Some(64.0),
        &[ONE],
    ),
    case(
        "a foreign id leaves both",
        &[strike(1, 60), strike(2, 64), Say::Release(name(3, 0, 64)), Say::Release(id(3))],
        &[(0, on(60)), (1, on(64))],
        Some(64.0),
        &[],
    ),
    case(
        "wildcards release all, and the sound ends as any note does",
        &[strike(1, 60), strike(2, 64), Say::Release(ANY)],
        &[(0, on(60)), (1, on(64)), (2, off(60)), (2, off(64))],
        None,
        &[ONE, TWO],
    ),
    case(
        "from the middle, then from the top",
        &[strike(1, 60), strike(2, 62), strike(3, 64), Say::Release(id(2)), Say::Release(id(3))],
        &[(0, on(60)), (1, on(62)), (2, on(64)), (3, off(62)), (4, off(64))],
        Some(60.0),
        &[name(2, 0, 62), name(3, 0, 64)],
    ),
    case(
        "from the bottom",
        &[strike(1, 60), strike(2, 62), strike(3, 64), Say::Release(id(1)), Say::Release(id(2))],
        &[(0, on(60)), (1, on(62)), (2, on(64)), (3, off(60)), (4, off(62))],
        Some(64.0),
        &[ONE, name(2, 0, 62)],
    ),
    case(
        "a channel's notes only",
        &[strike(1, 60), strike_on(2, 3, 64), strike_on(3, 3, 65), Say::Release(channel(3))],
        &[(0, on(60)), (1, on(64)), (2, on(65)), (3, off(64)), (3, off(65))],
        Some(60.0),
        &[name(2, 3, 64), name(3, 3, 65)],
    ),
    case(
        "a key on all channels",
        &[strike(1, 60), strike_on(2, 3, 60), Say::Release(key(60))],
        &[(0, on(60)), (1, off(60)), (1, on(60)), (2, off(60))],
        None,
        &[ONE, name(2, 3, 60)],
    ),
    // Two notes of one key.
    case(
        "the first of two notes of a key: the other goes on",
        &[strike(1, 60), strike(2, 60), Say::Release(id(1))],
        &[(0, on(60)), (1, off(60)), (1, on(60))],
        Some(60.0),
        &[ONE],
    ),
    case(
        "the second of two notes of a key: the other goes on",
        &[strike(1, 60), strike(2, 60), Say::Release(id(2))],
        &[(0, on(60)), (1, off(60)), (1, on(60))],
        Some(60.0),
        &[TWIN],
    ),
    case(
        "both, one after the other",
        &[strike(1, 60), strike(2, 60), Say::Release(id(1)), Say::Release(id(2))],
        &[(0, on(60)), (1, off(60)), (1, on(60)), (3, off(60))],
        None,
        &[ONE, TWIN],
    ),
    case(
        "both by their key",
        &[strike(1, 60), strike(2, 60), Say::Release(key(60))],
        &[(0, on(60)), (1, off(60)), (1, on(60)), (2, off(60))],
        None,
        &[ONE, TWIN],
    ),
    case(
        "neither by a foreign id with their key",
        &[strike(1, 60), strike(2, 60), Say::Release(name(3, 0, 60))],
        &[(0, on(60)), (1, off(60)), (1, on(60))],
        Some(60.0),
        &[],
    ),
    case(
        "two notes of a key around another: the upper one gives way to the one between",
        &[strike(1, 60), strike(2, 64), strike(3, 60), Say::Release(id(3))],
        &[(0, on(60)), (1, on(64)), (2, on(60)), (3, on(64))],
        Some(64.0),
        &[name(3, 0, 60)],
    ),
    case(
        "and that one to the lower one",
        &[strike(1, 60), strike(2, 64), strike(3, 60), Say::Release(id(3)), Say::Release(id(2))],
        &[(0, on(60)), (1, on(64)), (2, on(60)), (3, on(64)), (4, off(64))],
        Some(60.0),
        &[name(3, 0, 60), TWO],
    ),
    case(
        "the same note again is one note",
        &[strike(1, 60), strike(1, 60), Say::Release(id(1))],
        &[(0, on(60)), (1, off(60)), (1, on(60)), (2, off(60))],
        None,
        &[ONE],
    ),
    case(
        "one id with two keys is two notes",
        &[strike(1, 60), strike(1, 64), Say::Release(name(1, 0, 64))],
        &[(0, on(60)), (1, on(64)), (2, off(64))],
        Some(60.0),
        &[name(1, 0, 64)],
    ),
    // Notes of MIDI, which have no ids.
    case(
        "MIDI's note-off releases a note with an id",
        &[strike(1, 60), Say::Midi([0x80, 60, 0])],
        &[(0, on(60)), (1, off(60))],
        None,
        &[ONE],
    ),
    case(
        "a note of MIDI has no id to be named by",
        &[Say::Midi([0x90, 60, VELOCITY]), Say::Release(name(5, 0, 60))],
        &[(0, on(60))],
        Some(60.0),
        &[],
    ),
    case(
        "a note of MIDI is released by its key",
        &[Say::Midi([0x92, 60, VELOCITY]), Say::Release(key(60))],
        &[(0, on(60)), (1, off(60))],
        None,
        &[midi_name(2, 60)],
    ),
    case(
        "MIDI and CLAP hold one key together",
        &[Say::Midi([0x90, 60, VELOCITY]), strike(1, 60), Say::Release(id(1))],
        &[(0, on(60)), (1, off(60)), (1, on(60))],
        Some(60.0),
        &[ONE],
    ),
    case(
        "CC120 ends all at once",
        &[strike(1, 60), strike(2, 64), Say::Midi([0xB0, 120, 0])],
        &[(0, on(60)), (1, on(64)), (2, Event::Panic)],
        None,
        &[ONE, TWO],
    ),
    case(
        "CC123 lifts all keys",
        &[strike(1, 60), strike(2, 64), Say::Midi([0xB0, 123, 0])],
        &[(0, on(60)), (1, on(64)), (2, off(60)), (2, off(64))],
        None,
        &[ONE, TWO],
    ),
    // Choke.
    case(
        "a choke ends a note",
        &[strike(1, 60), Say::Choke(id(1))],
        &[(0, on(60)), (1, choked(60))],
        None,
        &[ONE],
    ),
    case(
        "a choke of an unheard note is not heard",
        &[strike(1, 60), strike(2, 64), Say::Choke(id(1))],
        &[(0, on(60)), (1, on(64)), (2, off(60))],
        Some(64.0),
        &[ONE],
    ),
    case(
        "a note under a choked one begins anew",
        &[strike(1, 60), strike(2, 64), Say::Choke(id(2))],
        &[(0, on(60)), (1, on(64)), (2, choked(64))],
        Some(60.0),
        &[TWO],
    ),
    case(
        "a foreign choke does nothing",
        &[strike(1, 60), Say::Choke(name(9, 0, 60))],
        &[(0, on(60))],
        Some(60.0),
        &[],
    ),
    case(
        "a choke of everything",
        &[strike(1, 60), strike(2, 64), Say::Choke(ANY)],
        &[(0, on(60)), (1, on(64)), (2, off(60)), (2, choked(64))],
        None,
        &[ONE, TWO],
    ),
    case(
        "a choke of one of two notes of a key: the other begins anew",
        &[strike(1, 60), strike(2, 60), Say::Choke(id(2))],
        &[(0, on(60)), (1, off(60)), (1, on(60)), (2, choked(60)), (2, on(60))],
        Some(60.0),
        &[TWIN],
    ),
    // What belongs to a note.
    case(
        "tuning bends the note of its id",
        &[strike(1, 60), tune(id(1), 0.5)],
        &[(0, on(60)), (1, bend(50.0))],
        Some(60.5),
        &[],
    ),
    case(
        "tuning for an unheard id bends nothing",
        &[strike(1, 60), strike(2, 64), tune(id(1), 2.92)],
        &[(0, on(60)), (1, on(64))],
        Some(64.0),
        &[],
    ),
    case(
        "until its note is heard",
        &[strike(1, 60), strike(2, 64), tune(id(1), 2.92), Say::Release(id(2))],
        &[(0, on(60)), (1, on(64)), (3, bend(292.0)), (3, off(64))],
        Some(62.92),
        &[TWO],
    ),
    case(
        "two notes of a key have a tuning each",
        &[strike(1, 60), strike(2, 60), tune(id(2), 1.0), Say::Release(id(2))],
        &[(0, on(60)), (1, off(60)), (1, on(60)), (2, bend(100.0)), (3, bend(0.0))],
        Some(60.0),
        &[TWIN],
    ),
    case(
        "tuning for a foreign id bends nothing",
        &[strike(1, 60), tune(name(7, 0, 60), 3.0)],
        &[(0, on(60))],
        Some(60.0),
        &[],
    ),
    case(
        "tuning for all bends the one that is heard",
        &[strike(1, 60), strike(2, 64), tune(ANY, -1.0)],
        &[(0, on(60)), (1, on(64)), (2, bend(-100.0))],
        Some(63.0),
        &[],
    ),
    case(
        "pressure of an unheard note is no breath",
        &[strike(1, 60), strike(2, 64), press(id(2), 0.6), press(id(1), 0.0)],
        &[(0, on(60)), (1, on(64)), (2, Event::Breath(0.6))],
        Some(64.0),
        &[],
    ),
    // The pedal.
    case(
        "the pedal holds the last note",
        &[pedal(127), strike(1, 60), Say::Release(id(1))],
        &[(1, on(60))],
        Some(60.0),
        &[],
    ),
    case(
        "another note slurs, and the pedal's end is the end",
        &[pedal(127), strike(1, 60), Say::Release(ONE), strike(2, 64), Say::Release(TWO), pedal(0)],
        &[(1, on(60)), (3, on(64)), (3, off(60)), (5, off(64))],
        None,
        &[ONE, TWO],
    ),
    case(
        "a choke does not heed the pedal",
        &[pedal(127), strike(1, 60), Say::Release(ONE), Say::Choke(ONE)],
        &[(1, on(60)), (3, choked(60))],
        None,
        &[ONE],
    ),
];

fn plugin() -> Plugin {
    Plugin::load(&chalumeau_test_host::artefacts::clap().unwrap()).unwrap()
}

/// What the instrument itself makes of events.
fn rendered(events: &[(usize, Event)], samples: usize) -> Vec<f32> {
    let mut out = vec![0.0; samples];
    let events = events.iter().map(|&(step, event)| Timed { at: step * STEP, event });
    Clarinet::built_in(RATE).unwrap().render_events(events, &mut out);
    out
}

fn peak(samples: &[f32]) -> f32 {
    samples.iter().fold(0.0, |peak, sample| sample.abs().max(peak))
}

#[test]
fn every_case_of_the_table_holds() {
    assert!(CASES.len() >= 40, "{}", CASES.len());
    let mut wrong = Vec::new();
    for Case { name, does, means, heard, over } in CASES {
        let said: Vec<At> = does.iter().enumerate().map(|(step, &say)| At(step * STEP, say)).collect();
        let samples = (does.len() - 1) * STEP + LISTEN;
        let wanted = rendered(means, samples);
        for block in [100, 512] {
            let (sound, told) = plugin()
                .session(RATE, block, |session| {
                    let [left, _] = session.play(&said, samples).unwrap();
                    (left, session.ends().to_vec())
                })
                .unwrap();
            if sound != wanted {
                let at = sound.iter().zip(&wanted).position(|(one, other)| one != other);
                wrong.push(format!(
                    "{name}: not the instrument's sound, from sample {at:?}, in blocks of {block}"
                ));
            }
            let told: Vec<NoteName> = told.into_iter().map(|(_, name)| name).collect();
            if told != *over {
                wrong.push(format!("{name}: the host was told {told:?}, not {over:?}, in blocks of {block}"));
            }
        }
        let last = &wanted[samples - 12_000..];
        match heard {
            None if peak(last) > 1e-6 => wrong.push(format!("{name}: {} is not silent", peak(last))),
            None => {}
            Some(key) => {
                let hz = fundamental_hz(&to_f64(last), RATE).unwrap_or(1.0);
                let found = 69.0 + 12.0 * (hz / 440.0).log2();
                // The natural tuning of the instrument is within 25 cents; another note is 50 away.
                if (found - key).abs() > 0.25 {
                    wrong.push(format!("{name}: heard {found:.2}, not {key:.2}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {} cases:\n{}", wrong.len(), CASES.len(), wrong.join("\n"));
}

#[test]
fn a_choke_is_silence_within_5_ms() {
    for at in [24_000, 24_001, 24_511] {
        let said = [At(0, strike(1, 60)), At(at, Say::Choke(id(1)))];
        let [sound, _] = plugin().play(RATE, 512, &said, 48_000).unwrap();
        assert!(peak(&sound[at - 480..at]) > 0.05, "it sounded");
        let silent = at + (0.005 * RATE) as usize;
        assert!(peak(&sound[silent..]) < 1e-5, "{} after 5 ms", peak(&sound[silent..]));
        let step = |from: usize, to: usize| {
            sound[from..to].windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max)
        };
        assert!(step(at, silent) <= 1.2 * step(at - 2_400, at), "a click");
    }
}

#[test]
fn the_host_is_told_of_a_faded_note_when_nothing_sounds_any_more() {
    let said = [At(0, strike(1, 60)), At(24_000, Say::Release(id(1)))];
    let (sound, told) = plugin()
        .session(RATE, 256, |session| {
            let [left, _] = session.play(&said, 120_000).unwrap();
            (left, session.ends().to_vec())
        })
        .unwrap();
    let [(at, name)] = told[..] else { panic!("{told:?}") };
    assert_eq!(name, ONE);
    assert!(peak(&sound[at..]) < 1e-6 && peak(&sound[24_000..at]) > 1e-2, "at {at}");
}

#[test]
fn voice_info_is_one_voice_of_as_many_as_there_are_players_with_overlapping_notes() {
    let mut plugin = plugin();
    let players = plugin.param("Players").unwrap();
    for count in [1, 4] {
        // Hosts count the steps from the least.
        plugin.set(players.id, players.min + f64::from(count - 1)).unwrap();
        let session = plugin.activate(RATE, 256).unwrap();
        let info = plugin.voice_info().unwrap();
        assert_eq!((info.voice_count, info.voice_capacity), (count, 16));
        assert!(info.flags.contains(VoiceInfoFlags::SUPPORTS_OVERLAPPING_NOTES));
        plugin.deactivate(session);
    }
}

/// Anything that a host may say of notes and controllers, on sixteen channels, by MIDI and by notes with ids.
fn any_event(random: &mut fastrand::Rng) -> Say {
    let (channel, key) = (random.u8(0..16), random.u8(0..128));
    let named = |random: &mut fastrand::Rng| NoteName {
        id: random.bool().then(|| random.u32(0..64)),
        channel: random.bool().then_some(u16::from(channel)),
        key: random.bool().then_some(u16::from(key)),
    };
    match random.u8(0..12) {
        0 => Say::Midi([0x90 | channel, key, random.u8(0..128)]),
        1 => Say::Midi([0x80 | channel, key, 0]),
        2 | 3 => Say::Midi([0xb0 | channel, random.u8(0..128), random.u8(0..128)]),
        4 => Say::Midi([0xe0 | channel, random.u8(0..128), random.u8(0..128)]),
        5 => Say::Midi([0xd0 | channel, random.u8(0..128), 0]),
        6 => Say::Midi([0xa0 | channel, key, random.u8(0..128)]),
        7 | 8 => Say::Strike(name(random.u32(0..64), u16::from(channel), u16::from(key)), random.f64()),
        9 => Say::Release(named(random)),
        10 => Say::Choke(named(random)),
        _ => {
            let which = [
                NoteExpressionType::Tuning,
                NoteExpressionType::Pressure,
                NoteExpressionType::Volume,
                NoteExpressionType::Pan,
                NoteExpressionType::Brightness,
                NoteExpressionType::Expression,
                NoteExpressionType::Vibrato,
            ];
            Say::ExpressNotes(named(random), which[random.usize(0..which.len())], 4.0 * random.f64() - 1.0)
        }
    }
}

#[test]
fn a_million_events_leave_no_stuck_note() {
    const EVENTS: usize = 1_000_000;
    /// Samples from one event to the next.
    const APART: usize = 4;
    const PART: usize = 50_000;
    let path = chalumeau_test_host::artefacts::clap().unwrap();
    let mut plugin = Plugin::load(&path).unwrap();
    let mut session = plugin.activate(RATE, 256).unwrap();
    let mut random = fastrand::Rng::with_seed(11);
    let is_fine = |heard: &[Vec<f32>; 2]| heard.iter().flatten().all(|x| x.abs() <= 1.0);
    for part in 0..EVENTS / PART {
        let said: Vec<At> = (0..PART).map(|n| At(n * APART, any_event(&mut random))).collect();
        assert!(is_fine(&session.play(&said, PART * APART).unwrap()), "part {part}");
    }
    let mut said: Vec<At> = (0..16).map(|channel| At(0, Say::Midi([0xb0 | channel, 123, 0]))).collect();
    said.push(At(0, Say::Release(ANY)));
    let fading = session.play(&said, LISTEN * 2).unwrap();
    assert!(is_fine(&fading));
    let rest = session.play(&[], 4_800).unwrap();
    let loudest = rest.iter().flatten().fold(0.0_f32, |most, x| most.max(x.abs()));
    assert!(loudest < 1e-6, "{loudest} is left");
    plugin.deactivate(session);
}
