//! Writes `examples/melody.mid`: "Greensleeves" (traditional, England, 16th century; own transcription) for B flat clarinet.
//!
//! `cargo run --no-default-features --features cli --example make_melody [FILE]`
//!
//! The first strain lies in the chalumeau, down to the lowest E; the second crosses the break into the clarion; a slurred
//! arpeggio through all of it ends the piece. Notes are written pitch here and sounding pitch in the file. A slur holds
//! each key until shortly after the next is down; a tongued note lets go early. Breath is CC2, one value every 20 ms:
//! a swell over each phrase, a breath between phrases, a little weight on the beats. The tempo falls towards the end.

use midly::num::{u4, u7, u15, u24, u28};
use midly::{Format, Header, MetaMessage, MidiMessage, Smf, Timing, TrackEvent, TrackEventKind};
use std::process::ExitCode;

const TICKS_PER_QUARTER: u16 = 480;
/// Eighth note.
const E: u32 = 240;
/// Sixteenth, dotted eighth, quarter, dotted quarter.
const S: u32 = E / 2;
const DE: u32 = E + S;
const Q: u32 = 2 * E;
const DQ: u32 = 3 * E;
/// Rest of a phrase in which the player breathes.
const BREATH: u32 = 150;
/// Time between breath values: 20 ms at the first tempo.
const STEP: u32 = 15;
/// How long before its first note a phrase begins to be blown: 80 ms.
const LEAD: u32 = 60;
/// Overlap of slurred notes, gap of tongued ones.
const OVERLAP: u32 = 10;
const GAP: u32 = 30;
/// Silence before the first note.
const START: u32 = Q;

/// Written semitones above written C4 of MIDI number 60; B flat clarinet sounds two lower.
const TRANSPOSITION: u8 = 2;

#[derive(Clone, Copy)]
struct Note {
    written: u8,
    ticks: u32,
    /// The next note follows without the tongue.
    slurred: bool,
}

/// Notes under one breath; `swell` is breath over full breath at the beginning, the height and the end, and where on
/// the way (0..1) the height lies.
struct Phrase {
    notes: Vec<Note>,
    swell: [f64; 3],
    height_at: f64,
}

/// A note with a slur to the next.
fn s(written: u8, ticks: u32) -> Note {
    Note { written, ticks, slurred: true }
}

/// A note whose successor is tongued.
fn t(written: u8, ticks: u32) -> Note {
    Note { written, ticks, slurred: false }
}

fn phrases() -> Vec<Phrase> {
    // Written pitches.
    let [e3, fs3, g3, gs3, a3, b3, c4, d4, e4, fs4] = [52, 54, 55, 56, 57, 59, 60, 62, 64, 66];
    let [g4, gs4, a4, b4, c5, d5, e5, fs5, g5, a5, c6] = [67, 68, 69, 71, 72, 74, 76, 78, 79, 81, 84];
    vec![
        Phrase {
            notes: vec![
                t(a3, E),
                s(c4, Q),
                t(d4, E),
                s(e4, DE),
                s(fs4, S),
                t(e4, E),
                s(d4, Q),
                t(b3, E),
                s(g3, DE),
                s(a3, S),
                t(b3, E),
                s(c4, Q),
                t(a3, E),
                s(a3, DE),
                s(gs3, S),
                t(a3, E),
                s(b3, Q),
                s(gs3, E),
                t(e3, Q),
            ],
            swell: [0.44, 0.62, 0.46],
            height_at: 0.3,
        },
        Phrase {
            notes: vec![
                t(a3, E),
                s(c4, Q),
                t(d4, E),
                s(e4, DE),
                s(fs4, S),
                t(e4, E),
                s(d4, Q),
                t(b3, E),
                s(g3, DE),
                s(a3, S),
                t(b3, E),
                s(c4, DE),
                s(b3, S),
                s(a3, E),
                s(gs3, DE),
                s(fs3, S),
                s(gs3, E),
                t(a3, DQ + Q),
            ],
            swell: [0.48, 0.70, 0.42],
            height_at: 0.45,
        },
        Phrase {
            notes: vec![
                t(e4, E),
                t(g5, DQ),
                s(g5, DE),
                s(fs5, S),
                t(e5, E),
                s(d5, Q),
                t(b4, E),
                s(g4, DE),
                s(a4, S),
                t(b4, E),
                s(c5, DE),
                s(b4, S),
                s(a4, E),
                s(gs4, DE),
                s(fs4, S),
                s(gs4, E),
                t(a4, DQ),
            ],
            swell: [0.60, 0.82, 0.46],
            height_at: 0.2,
        },
        Phrase {
            notes: vec![
                s(e3, E),
                s(a3, E),
                s(c4, E),
                s(e4, E),
                s(a4, E),
                s(c5, E),
                s(e5, E),
                s(a5, E),
                s(c6, E),
                t(a5, DQ + DQ),
            ],
            swell: [0.46, 0.66, 0.4],
            height_at: 0.55,
        },
    ]
}

/// Quarter notes a minute from a tick on. The beat is the dotted quarter.
fn tempo_map(end: u32) -> Vec<(u32, f64)> {
    let mut map = vec![(0, 99.0)];
    let slowing = end - 13 * E - DQ;
    map.extend((0..12).map(|i| (slowing + i * E, 96.0 - 3.4 * f64::from(i))));
    map
}

/// Smooth from 0 to 1.
fn ease(x: f64) -> f64 {
    0.5 - 0.5 * (std::f64::consts::PI * x.clamp(0.0, 1.0)).cos()
}

/// One phrase from tick `from` on, appended to `events`; gives its end.
fn play(phrase: &Phrase, from: u32, events: &mut Vec<(u32, MidiMessage)>) -> u32 {
    let length: u32 = phrase.notes.iter().map(|n| n.ticks).sum();
    // The next phrase begins to be blown where this one ends.
    let (end, silent) = (from + length, from + length - LEAD);
    let [first, height, last] = phrase.swell;
    let mut last_value = u8::MAX;
    for tick in (from - LEAD..=silent).step_by(STEP as usize) {
        let along = (f64::from(tick) - f64::from(from)) / f64::from(silent - BREATH - from);
        let swell = if along < phrase.height_at {
            first + (height - first) * ease(along / phrase.height_at)
        } else {
            height + (last - height) * ease((along - phrase.height_at) / (1.0 - phrase.height_at))
        };
        // Weight on each dotted quarter, gone after an eighth.
        let beat = f64::from(tick.saturating_sub(from + E) % DQ) / f64::from(DQ);
        let weight = 1.0 + 0.04 * (1.0 - ease(2.0 * beat));
        let rise = ease((f64::from(tick) - f64::from(from - LEAD)) / f64::from(2 * LEAD));
        let fall = ease((f64::from(silent) - f64::from(tick)) / f64::from(BREATH));
        let value = (127.0 * swell * weight * rise * fall).round().clamp(0.0, 127.0) as u8;
        if value != last_value {
            events.push((tick, MidiMessage::Controller { controller: 2.into(), value: value.into() }));
            last_value = value;
        }
    }
    let mut at = from;
    for (index, note) in phrase.notes.iter().enumerate() {
        let key = u7::new(note.written - TRANSPOSITION);
        let after_slur = index > 0 && phrase.notes[index - 1].slurred;
        let vel = u7::new(if after_slur {
            60
        } else if note.ticks >= Q {
            96
        } else {
            80
        });
        events.push((at, MidiMessage::NoteOn { key, vel }));
        at += note.ticks;
        let last = index + 1 == phrase.notes.len();
        let up = if last {
            at - LEAD
        } else if note.slurred {
            at + OVERLAP
        } else {
            at - GAP
        };
        events.push((up, MidiMessage::NoteOff { key, vel: 64.into() }));
    }
    end
}

fn track(mut events: Vec<(u32, TrackEventKind<'static>)>) -> Vec<TrackEvent<'static>> {
    events.sort_by_key(|e| e.0);
    let mut before = 0;
    let mut track: Vec<_> = events
        .into_iter()
        .map(|(tick, kind)| TrackEvent { delta: u28::new(tick - std::mem::replace(&mut before, tick)), kind })
        .collect();
    track.push(TrackEvent { delta: 0.into(), kind: TrackEventKind::Meta(MetaMessage::EndOfTrack) });
    track
}

/// The whole file.
pub fn melody() -> Smf<'static> {
    let (mut events, mut end) = (Vec::new(), START);
    for phrase in phrases() {
        end = play(&phrase, end, &mut events);
    }
    let channel = u4::new(0);
    let notes =
        events.into_iter().map(|(at, message)| (at, TrackEventKind::Midi { channel, message })).collect();
    let mut conductor = vec![
        (0, TrackEventKind::Meta(MetaMessage::TrackName(b"Greensleeves (trad.)"))),
        (0, TrackEventKind::Meta(MetaMessage::TimeSignature(6, 3, 36, 8))),
    ];
    for (tick, quarters_a_minute) in tempo_map(end) {
        let us = u24::new((60e6 / quarters_a_minute).round() as u32);
        conductor.push((tick, TrackEventKind::Meta(MetaMessage::Tempo(us))));
    }
    let mut smf = Smf::new(Header::new(Format::Parallel, Timing::Metrical(u15::new(TICKS_PER_QUARTER))));
    smf.tracks = vec![track(conductor), track(notes)];
    smf
}

#[allow(dead_code)] // The tests use this file as a module, to compare what it writes with what is committed.
fn main() -> ExitCode {
    let path = std::env::args().nth(1).unwrap_or_else(|| "examples/melody.mid".to_owned());
    match melody().save(&path) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: cannot write {path}: {error}");
            ExitCode::from(2)
        }
    }
}
