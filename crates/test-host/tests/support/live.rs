//! What tests that play the plugin at the pace of a sound card share.

use std::time::{Duration, Instant};

use chalumeau_test_host::clap::{Plugin, Say, Session};

pub const RATE: f64 = 48_000.0;
pub const SECOND: usize = 48_000;
pub const BLOCK: usize = 128;
/// Sounding D3, written E3, the lowest note.
pub const E3: u8 = 50;

/// The bundled CLAP, or another build of it that the environment names.
pub fn plugin() -> Plugin {
    let path = chalumeau_test_host::artefacts::clap().unwrap();
    Plugin::load(&path).unwrap()
}

pub fn on(key: u8) -> Say {
    Say::Midi([0x90, key, 100])
}

pub fn level_db(samples: &[f32]) -> f64 {
    let power: f64 = samples.iter().map(|&x| f64::from(x).powi(2)).sum();
    10.0 * (power / samples.len().max(1) as f64).max(1e-30).log10()
}

/// Last breath the plugin has sent, 0..=1.
pub fn breath(session: &Session) -> f64 {
    let last = |cc: u8| {
        session.answers().iter().rev().find(|(_, said)| said[1] == cc).map_or(0, |(_, said)| said[2])
    };
    f64::from(u16::from(last(2)) << 7 | u16::from(last(34))) / 16_383.0
}

/// Plays on in steps of a tenth of a second until something holds; how long that took.
#[track_caller]
pub fn play_until(
    session: &mut Session,
    what: &str,
    mut holds: impl FnMut(&mut Session) -> bool,
) -> Duration {
    let began = Instant::now();
    while !holds(session) {
        assert!(began.elapsed() < Duration::from_secs(30), "{what} did not come about in 30 s");
        session.play_live(&[], SECOND / 10, RATE).unwrap();
    }
    began.elapsed()
}
