//! "When the Saints Go Marching In" (traditional, United States) for B flat clarinet: one chorus, swung.
//!
//! The first half is the melody, low in the chalumeau. An arpeggio of the dominant leads up over the break, and the second
//! half goes around the melody in the clarion and climbs to a high G, which falls. Scoops, growl, vibrato and one slide are
//! controllers; `saints.toml` links those that have none by themselves.

use super::midi_file::{self, Heading};
use super::notation::pitch::*;
use super::notation::{DOTTED_QUARTER, EIGHTH, HALF, Phrase, QUARTER, slurred, tongued};
use super::playing::{Breath, Moments, Player, Timing};
use midly::Smf;

/// Quarter notes a minute: a tick is 0.8 ms.
const TEMPO: f64 = 160.0;

const PLAYER: Player = Player {
    transposition: 2,
    // 20 ms between breath values, 60 ms of lead.
    moments: Moments { step: 26, lead: 80, release: 120, overlap: 14, gap: 40, fall: 400 },
    // Swing evens out as it gets faster; at this tempo players give the first eighth about 0.62.
    timing: Timing { swing: 0.62, looseness: 8, seed: 1 },
    breath: Breath::Fine,
    beat: HALF,
    beat_weight: 0.03,
};

fn phrases() -> Vec<Phrase> {
    vec![
        // Oh, when the saints
        Phrase {
            rest: 0,
            notes: vec![
                tongued(G3, QUARTER).scoop(50),
                tongued(B3, QUARTER),
                slurred(C4, EIGHTH),
                tongued(D4, EIGHTH + HALF + QUARTER).weight(1.06).vibrato(75),
            ],
            upbeat: 3 * QUARTER,
            swell: [0.66, 0.76, 0.58],
            height_at: 0.5,
        },
        // go marching in
        Phrase {
            rest: HALF,
            notes: vec![
                tongued(G3, QUARTER),
                tongued(B3, QUARTER),
                slurred(C4, EIGHTH),
                slurred(D4, EIGHTH + HALF).weight(1.06).vibrato(75),
                slurred(E4, EIGHTH),
                slurred(D4, EIGHTH),
                slurred(B3, EIGHTH),
                tongued(G3, EIGHTH),
            ],
            upbeat: 3 * QUARTER,
            swell: [0.68, 0.8, 0.6],
            height_at: 0.5,
        },
        // Oh, when the saints go marching in
        Phrase {
            rest: QUARTER,
            notes: vec![
                tongued(G3, QUARTER).scoop(50),
                tongued(B3, QUARTER),
                slurred(C4, EIGHTH),
                tongued(D4, EIGHTH + HALF).weight(1.08).growl(100),
                slurred(B3, DOTTED_QUARTER),
                tongued(G3, HALF).weight(1.06),
                slurred(B3, DOTTED_QUARTER),
                slurred(AS3, QUARTER),
                tongued(A3, HALF).vibrato(85),
            ],
            upbeat: 3 * QUARTER,
            swell: [0.72, 0.86, 0.7],
            height_at: 0.4,
        },
        // Lord, I want to be in that number
        Phrase {
            rest: QUARTER,
            notes: vec![
                slurred(D4, EIGHTH),
                slurred(FS4, EIGHTH),
                slurred(A4, EIGHTH),
                slurred(D5, EIGHTH),
                tongued(B5, HALF).glissando(30).growl(60),
                tongued(A5, QUARTER),
                slurred(G5, DOTTED_QUARTER).weight(1.05).scoop(70).growl(110),
                slurred(D5, EIGHTH),
                slurred(E5, EIGHTH),
                slurred(G5, EIGHTH),
                slurred(A5, EIGHTH),
                slurred(AS5, EIGHTH),
                slurred(B5, DOTTED_QUARTER).vibrato(75),
                tongued(D6, EIGHTH + QUARTER).weight(1.04),
                slurred(F6, EIGHTH),
                tongued(D6, EIGHTH),
                tongued(C6, HALF).weight(1.04).growl(110).vibrato(90),
            ],
            upbeat: QUARTER,
            swell: [0.62, 0.78, 0.68],
            height_at: 0.6,
        },
        // when the saints go marching in
        Phrase {
            rest: QUARTER,
            notes: vec![
                slurred(C5, EIGHTH),
                slurred(E5, EIGHTH),
                slurred(G5, EIGHTH),
                tongued(C6, EIGHTH),
                tongued(DS6, QUARTER).weight(1.04).growl(110),
                tongued(B5, QUARTER).scoop(70),
                slurred(C6, EIGHTH),
                slurred(D6, EIGHTH + QUARTER).weight(1.04).vibrato(85),
                slurred(E6, EIGHTH),
                tongued(D6, EIGHTH),
                slurred(B5, DOTTED_QUARTER),
                tongued(G5, EIGHTH + QUARTER).growl(110),
                slurred(A5, EIGHTH),
                slurred(C6, EIGHTH),
                slurred(D6, EIGHTH),
                slurred(E6, EIGHTH),
                slurred(F6, EIGHTH),
                slurred(FS6, EIGHTH),
                tongued(G6, 2 * HALF).vibrato(100).fall(90),
            ],
            upbeat: QUARTER,
            swell: [0.62, 0.84, 0.78],
            height_at: 0.7,
        },
    ]
}

/// The whole file.
pub fn file() -> Smf<'static> {
    let mut events = Vec::new();
    // A quarter of silence; the first bar begins with a rest.
    PLAYER.play(&phrases(), QUARTER, &mut events);
    let heading = Heading {
        title: "When the Saints Go Marching In (trad.)",
        time_signature: (4, 2),
        clocks_per_click: 24,
        tempo: vec![(0, TEMPO)],
    };
    midi_file::file(&heading, vec![events])
}
