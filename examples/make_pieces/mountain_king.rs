//! "In the Hall of the Mountain King" (Edvard Grieg, Peer Gynt, 1875) for bass clarinet: the theme and its answer in turn.
//!
//! Here in E minor instead of B minor, so that the theme begins near the bottom of the instrument, all staccato. It begins softly
//! and gets faster and louder; three blows end it.

use super::midi_file::{self, Heading};
use super::notation::pitch::*;
use super::notation::{EIGHTH, HALF, Phrase, QUARTER, staccato, tongued};
use super::playing::{Breath, Events, Moments, Player, Timing};
use midly::Smf;

const PLAYER: Player = Player {
    // The bass clarinet sounds an octave below the B flat clarinet.
    transposition: 14,
    // 20 ms between breath values, 60 ms of lead, at the first tempo.
    moments: Moments { step: 20, lead: 60, release: 100, overlap: 10, gap: 40, fall: 0 },
    timing: Timing { looseness: 2, ..Timing::STRICT },
    breath: Breath::Fine,
    beat: QUARTER,
    beat_weight: 0.05,
};

/// Silence before the first note.
const START: u32 = QUARTER;
const BAR: u32 = 4 * QUARTER;
/// Quarter notes a minute at the beginning and at the end.
const TEMPO: [f64; 2] = [126.0, 232.0];

/// Eighths, and the longer note that they lead to.
type Motif = (&'static [u8], u8);

const THEME: [Motif; 4] = [
    (&[FS3, GS3, A3, B3, CS4, A3], CS4),
    (&[C4, GS3], C4),
    (&[B3, G3], B3),
    (&[FS3, GS3, A3, B3, CS4, A3, CS4, FS4, E4, CS4, A3, CS4], E4),
];

/// The theme's answer in the dominant.
const ANSWER: [Motif; 6] = [
    (&[CS4, DS4, F4, FS4, GS4, F4], GS4),
    (&[A4, F4], A4),
    (&[GS4, F4], GS4),
    (&[CS4, DS4, F4, FS4, GS4, F4], GS4),
    (&[A4, F4], A4),
    (&[], GS4),
];

/// Four bars under one breath. The last note is a half, the ends of the other motifs are quarters. `share` of each short
/// note sounds.
fn statement(motifs: &[Motif], share: f64, swell: [f64; 3]) -> Phrase {
    let mut notes = Vec::new();
    for (index, &(eighths, end)) in motifs.iter().enumerate() {
        notes.extend(eighths.iter().map(|&pitch| staccato(pitch, EIGHTH, share)));
        notes.push(if index + 1 < motifs.len() {
            staccato(end, QUARTER, 0.8 * share).weight(1.08)
        } else {
            tongued(end, HALF).weight(1.05)
        });
    }
    Phrase { rest: 0, notes, upbeat: 0, swell, height_at: 0.75 }
}

fn phrases() -> Vec<Phrase> {
    vec![
        statement(&THEME, 0.5, [0.44, 0.52, 0.44]),
        statement(&ANSWER, 0.5, [0.46, 0.55, 0.47]),
        statement(&THEME, 0.55, [0.5, 0.62, 0.54]),
        statement(&ANSWER, 0.6, [0.58, 0.72, 0.66]),
        statement(&THEME, 0.7, [0.7, 0.88, 0.86]),
        // Three blows.
        Phrase {
            rest: 0,
            notes: vec![staccato(FS4, HALF, 0.35), staccato(FS4, HALF, 0.35), tongued(FS3, HALF + QUARTER)],
            upbeat: 0,
            swell: [0.86, 0.86, 0.78],
            height_at: 0.5,
        },
    ]
}

/// Each beat is faster than the one before by the same factor; the last bar stays.
fn tempo_map(end: u32) -> Vec<(u32, f64)> {
    let beats = (end - START) / QUARTER;
    let [first, last] = TEMPO;
    let faster = |beat: u32| first * (last / first).powf(f64::from(beat) / f64::from(beats));
    (0..beats).map(|beat| (if beat == 0 { 0 } else { START + beat * QUARTER }, faster(beat))).collect()
}

/// The whole file.
pub fn file() -> Smf<'static> {
    let mut events = Events::new();
    let end = PLAYER.play(&phrases(), START, &mut events);
    let heading = Heading {
        title: "In the Hall of the Mountain King (Grieg)",
        time_signature: (4, 2),
        clocks_per_click: 24,
        tempo: tempo_map(end - BAR),
    };
    midi_file::file(&heading, vec![events])
}
