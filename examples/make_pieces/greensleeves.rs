//! "Greensleeves" (traditional, England, 16th century) for B flat clarinet.
//!
//! The first strain lies in the chalumeau, down to the lowest E; the second crosses the break into the clarion; a slurred
//! arpeggio through all of it ends the piece. The tempo falls towards the end.

use super::midi_file::{self, Heading};
use super::notation::pitch::*;
use super::notation::{DOTTED_EIGHTH, DOTTED_QUARTER, EIGHTH, Phrase, QUARTER, SIXTEENTH, slurred, tongued};
use super::playing::{Breath, Moments, Player, Timing};
use midly::Smf;

const PLAYER: Player = Player {
    transposition: 2,
    // 20 ms between breath values at the first tempo, 80 ms of lead.
    moments: Moments { step: 15, lead: 60, release: 150, overlap: 10, gap: 30, fall: 0 },
    timing: Timing::STRICT,
    breath: Breath::Coarse,
    beat: DOTTED_QUARTER,
    beat_weight: 0.04,
};

/// Silence before the first note.
const START: u32 = QUARTER;

fn phrases() -> Vec<Phrase> {
    vec![
        Phrase {
            rest: 0,
            notes: vec![
                tongued(A3, EIGHTH),
                slurred(C4, QUARTER),
                tongued(D4, EIGHTH),
                slurred(E4, DOTTED_EIGHTH),
                slurred(FS4, SIXTEENTH),
                tongued(E4, EIGHTH),
                slurred(D4, QUARTER),
                tongued(B3, EIGHTH),
                slurred(G3, DOTTED_EIGHTH),
                slurred(A3, SIXTEENTH),
                tongued(B3, EIGHTH),
                slurred(C4, QUARTER),
                tongued(A3, EIGHTH),
                slurred(A3, DOTTED_EIGHTH),
                slurred(GS3, SIXTEENTH),
                tongued(A3, EIGHTH),
                slurred(B3, QUARTER),
                slurred(GS3, EIGHTH),
                tongued(E3, QUARTER),
            ],
            upbeat: EIGHTH,
            swell: [0.44, 0.62, 0.46],
            height_at: 0.3,
        },
        Phrase {
            rest: 0,
            notes: vec![
                tongued(A3, EIGHTH),
                slurred(C4, QUARTER),
                tongued(D4, EIGHTH),
                slurred(E4, DOTTED_EIGHTH),
                slurred(FS4, SIXTEENTH),
                tongued(E4, EIGHTH),
                slurred(D4, QUARTER),
                tongued(B3, EIGHTH),
                slurred(G3, DOTTED_EIGHTH),
                slurred(A3, SIXTEENTH),
                tongued(B3, EIGHTH),
                slurred(C4, DOTTED_EIGHTH),
                slurred(B3, SIXTEENTH),
                slurred(A3, EIGHTH),
                slurred(GS3, DOTTED_EIGHTH),
                slurred(FS3, SIXTEENTH),
                slurred(GS3, EIGHTH),
                tongued(A3, DOTTED_QUARTER + QUARTER),
            ],
            upbeat: EIGHTH,
            swell: [0.48, 0.70, 0.42],
            height_at: 0.45,
        },
        Phrase {
            rest: 0,
            notes: vec![
                tongued(E4, EIGHTH),
                tongued(G5, DOTTED_QUARTER),
                slurred(G5, DOTTED_EIGHTH),
                slurred(FS5, SIXTEENTH),
                tongued(E5, EIGHTH),
                slurred(D5, QUARTER),
                tongued(B4, EIGHTH),
                slurred(G4, DOTTED_EIGHTH),
                slurred(A4, SIXTEENTH),
                tongued(B4, EIGHTH),
                slurred(C5, DOTTED_EIGHTH),
                slurred(B4, SIXTEENTH),
                slurred(A4, EIGHTH),
                slurred(GS4, DOTTED_EIGHTH),
                slurred(FS4, SIXTEENTH),
                slurred(GS4, EIGHTH),
                tongued(A4, DOTTED_QUARTER),
            ],
            upbeat: EIGHTH,
            swell: [0.60, 0.82, 0.46],
            height_at: 0.2,
        },
        Phrase {
            rest: 0,
            notes: vec![
                slurred(E3, EIGHTH),
                slurred(A3, EIGHTH),
                slurred(C4, EIGHTH),
                slurred(E4, EIGHTH),
                slurred(A4, EIGHTH),
                slurred(C5, EIGHTH),
                slurred(E5, EIGHTH),
                slurred(A5, EIGHTH),
                slurred(C6, EIGHTH),
                tongued(A5, DOTTED_QUARTER + DOTTED_QUARTER),
            ],
            upbeat: EIGHTH,
            swell: [0.46, 0.66, 0.4],
            height_at: 0.55,
        },
    ]
}

/// Quarter notes a minute from a tick on. The beat is the dotted quarter.
fn tempo_map(end: u32) -> Vec<(u32, f64)> {
    let mut map = vec![(0, 99.0)];
    let slowing = end - 13 * EIGHTH - DOTTED_QUARTER;
    map.extend((0..12).map(|i| (slowing + i * EIGHTH, 96.0 - 3.4 * f64::from(i))));
    map
}

/// The whole file.
pub fn file() -> Smf<'static> {
    let mut events = Vec::new();
    let end = PLAYER.play(&phrases(), START, &mut events);
    let heading = Heading {
        title: "Greensleeves (trad.)",
        time_signature: (6, 3),
        clocks_per_click: 36,
        tempo: tempo_map(end),
    };
    midi_file::file(&heading, vec![events])
}
