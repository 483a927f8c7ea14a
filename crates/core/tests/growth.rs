//! What may not grow with the number of players: memory beyond a limit for each, and threads.
#![cfg(target_os = "linux")]

use std::sync::Arc;

use chalumeau_core::event::{Event, PartEvent, To};
use chalumeau_core::instrument::{Ensemble, MOST_PLAYERS, Model, Players, Settings, Split};
use chalumeau_core::units::SoundingNote;

const RATE_HZ: f64 = 48_000.0;
/// Most memory of a player with voice, filter and lane, kB.
const MOST_KB: usize = 1_024;

/// A number of this process, by the kernel's name for it.
fn status(name: &str) -> usize {
    let text = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':')).unwrap();
    line.split_whitespace().next().unwrap().parse().unwrap()
}

// The only test of its process: others would add memory and threads.
#[test]
fn a_player_takes_less_than_a_mebibyte_and_no_thread() {
    let model = Arc::new(Model::built_in(RATE_HZ).unwrap());
    // What all share is there before.
    let _shared = Ensemble::new(model.clone(), RATE_HZ);
    let (memory, threads) = (status("VmRSS"), status("Threads"));
    let mut ensemble = Ensemble::new(model, RATE_HZ);
    let players = Players { count: MOST_PLAYERS as i32, split: Split::Chords, ..Players::default() };
    ensemble.set_settings(&Settings { players, ..Settings::default() });
    for player in 0..MOST_PLAYERS as u8 {
        let event = Event::NoteOn { note: SoundingNote(52 + player), velocity: 0.8 };
        ensemble.apply(PartEvent { to: To::Player(player), event });
    }
    let mut out = [0.0; 4_800];
    ensemble.render(&mut out);
    assert_eq!(ensemble.awake(), MOST_PLAYERS);
    let each_kb = status("VmRSS").saturating_sub(memory) / MOST_PLAYERS;
    println!("{each_kb} kB for a player");
    assert!(each_kb < MOST_KB, "{each_kb} kB");
    assert_eq!(status("Threads"), threads);
}
