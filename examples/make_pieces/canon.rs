//! The beginning of the Canon in D (Johann Pachelbel, 1653-1706) for four B flat clarinets, in sounding F.
//!
//! The fourth player repeats the ground. The first enters after two bars, the second and third two bars apart with the same
//! notes. At the end the first leads on into an arpeggio up to a soft high G, while the others hold their chord.

use super::midi_file::{self, Heading};
use super::notation::pitch::*;
use super::notation::{DOTTED_EIGHTH, EIGHTH, HALF, Note, Phrase, QUARTER, SIXTEENTH, slurred, tongued};
use super::playing::{Breath, Events, Moments, Player, Timing, controller};
use midly::Smf;

/// Quarter notes a minute: a tick is 1.4 ms.
const TEMPO: f64 = 88.0;

/// Silence before the first note.
const START: u32 = QUARTER;
/// The ground, and the distance between entries.
const GROUND: u32 = 8 * QUARTER;

/// Pan of each player, from the seat that four players have: they sit half left, half right, left and right.
const PANS: [u8; 4] = [42, 55, 51, 64];

/// One of the four. Players who sit together are up to 10 ms apart.
fn player(seed: u32) -> Player {
    Player {
        transposition: 2,
        // 20 ms between breath values, 70 ms of lead.
        moments: Moments { step: 14, lead: 50, release: 120, overlap: 10, gap: 24, fall: 0 },
        timing: Timing { looseness: 7, seed, ..Timing::STRICT },
        breath: Breath::Fine,
        beat: HALF,
        beat_weight: 0.03,
    }
}

/// Notes of one length: the last of each group is followed by the tongue, the others by slurs.
fn groups(ticks: u32, groups: &[&[u8]]) -> Vec<Note> {
    let group = |written: &&[u8]| {
        let last = written.len().saturating_sub(1);
        let note = |(index, &pitch)| if index < last { slurred(pitch, ticks) } else { tongued(pitch, ticks) };
        written.iter().enumerate().map(note).collect::<Vec<_>>()
    };
    groups.iter().flat_map(group).collect()
}

fn phrase(notes: Vec<Note>, swell: [f64; 3]) -> Phrase {
    Phrase { rest: 0, notes, upbeat: 0, swell, height_at: 0.4 }
}

/// The four variations that the voices play one after another, each two bars.
fn variations() -> [Vec<Note>; 4] {
    let mut last =
        groups(EIGHTH, &[&[B4, G4], &[E4, FS5], &[G5, B5], &[D6], &[D5], &[B4, G4], &[C5, FS4], &[G4, G5]]);
    last.extend([slurred(G5, DOTTED_EIGHTH), slurred(FS5, SIXTEENTH)]);
    [
        groups(QUARTER, &[&[B5, A5, G5, FS5], &[E5, D5, E5, FS5]]),
        groups(QUARTER, &[&[G5, FS5, E5, D5], &[C5, B4, C5, A4]]),
        groups(EIGHTH, &[&[G4, B4, D5, C5], &[B4, G4, B4, A4], &[G4, E4, G4, D5], &[C5, E5, D5, C5]]),
        last,
    ]
}

/// The voice that enters `entries` grounds after the first, and ends on `end`.
fn voice(entries: u32, end: Vec<Note>) -> Vec<Phrase> {
    // Everybody grows with the piece, and the newest entry stands out.
    let swells = [[0.5, 0.62, 0.52], [0.48, 0.58, 0.5], [0.5, 0.64, 0.54], [0.54, 0.7, 0.6]];
    let mut phrases: Vec<Phrase> = variations()
        .into_iter()
        .zip(swells)
        .take(4 - entries as usize)
        .map(|(notes, swell)| phrase(notes, swell))
        .collect();
    phrases[0].rest = (1 + entries) * GROUND;
    phrases.push(Phrase { height_at: 0.3, ..phrase(end, [0.54, 0.56, 0.36]) });
    phrases
}

fn ground() -> Vec<Phrase> {
    let notes = || [G4, D4, E4, B3, C4, G3, C4, D4].map(|pitch| tongued(pitch, QUARTER)).to_vec();
    let mut phrases: Vec<Phrase> = (0..5)
        .map(|time| {
            let more = 0.03 * f64::from(time);
            phrase(notes(), [0.58 + more, 0.66 + more, 0.6 + more])
        })
        .collect();
    phrases.push(phrase(vec![tongued(G3, END)], [0.66, 0.66, 0.48]));
    phrases
}

/// Length of the last chord.
const END: u32 = 4 * QUARTER;

/// The piece slows down into the last chord.
fn tempo_map() -> Vec<(u32, f64)> {
    let chord = START + 5 * GROUND;
    let slower = [86.0, 83.0, 79.0, 74.0, 70.0, 68.0];
    let slowing = (chord - 2 * QUARTER..).step_by(EIGHTH as usize).zip(slower);
    [(0, TEMPO)].into_iter().chain(slowing).collect()
}

/// The whole file.
pub fn file() -> Smf<'static> {
    let arpeggio = [G5, B5, D6].map(|pitch| slurred(pitch, EIGHTH));
    let ends = [
        arpeggio.into_iter().chain([tongued(G6, END - 3 * EIGHTH)]).collect(),
        vec![tongued(B4, END)],
        vec![tongued(G4, END)],
    ];
    let mut parts: Vec<Vec<Phrase>> = (0..).zip(ends).map(|(entries, end)| voice(entries, end)).collect();
    parts.push(ground());
    let play = |((seed, pan), phrases): ((u32, u8), Vec<Phrase>)| {
        let mut events = Events::from([(0, controller(10, pan))]);
        player(seed).play(&phrases, START, &mut events);
        events
    };
    let heading = Heading {
        title: "Canon (Pachelbel)",
        time_signature: (4, 2),
        clocks_per_click: 24,
        tempo: tempo_map(),
    };
    midi_file::file(&heading, (1..).zip(PANS).zip(parts).map(play).collect())
}
