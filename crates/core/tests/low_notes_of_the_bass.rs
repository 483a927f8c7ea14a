//! The lowest notes of the bass clarinet, in its longer lower joint: how they begin, and how even they are in repetitions.
//!
//! The test prints what it measured; `docs/findings.md` has the figures.

#[path = "support/rendered.rs"]
mod rendered;

use chalumeau_core::analysis::pitch;
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::event::Event;
use chalumeau_core::instrument::{Model, Preparation, Settings, Wanted};
use chalumeau_core::parallel;
use chalumeau_core::units::{WrittenNote, cents};
use rendered::rendered;
use std::ops::{ControlFlow, RangeInclusive};
use std::sync::{Arc, LazyLock};

const RATE_HZ: f64 = 48_000.0;
/// Written C3 to E flat 3: the notes of the longer joint.
const LONGER_JOINT: RangeInclusive<u8> = 48..=51;
/// Written C3 to G4.
const LOW: RangeInclusive<u8> = 48..=67;
static MODEL: LazyLock<Arc<Model>> = LazyLock::new(|| {
    let wanted = Wanted::new(Bundled::Bass.file(), RATE_HZ);
    Arc::new(Preparation::new(&wanted, None).ready().unwrap().unwrap())
});

fn samples(s: f64) -> usize {
    (s * RATE_HZ) as usize
}

/// A note on a default player, struck and released at these times, s.
fn played(written: u8, velocity: f32, keys: &[(f64, f64)], length_s: f64) -> (Vec<f64>, f64) {
    let note = WrittenNote(written).sounding(MODEL.file.transposition).unwrap();
    // Below the limiter.
    let settings = Settings { gain_db: -20.0, ..Settings::default() };
    let events: Vec<_> = keys
        .iter()
        .flat_map(|&(on_s, off_s)| {
            [(on_s, Event::NoteOn { note, velocity }), (off_s, Event::NoteOff { note })]
        })
        .collect();
    (rendered(&MODEL, RATE_HZ, &settings, &events, length_s), note.frequency_hz(440.0))
}

/// Where the second and third mode lay far below the harmonics, the first 0.15 s were up to 1.8 semitones flat.
#[test]
fn the_notes_of_the_longer_joint_begin_in_tune() {
    let cases: Vec<(u8, f32)> =
        LONGER_JOINT.flat_map(|written| [0.3, 0.6, 0.9].map(|velocity| (written, velocity))).collect();
    let off = |at: usize| {
        let (written, velocity) = cases[at];
        let (out, wanted_hz) = played(written, velocity, &[(0.1, 1.0)], 1.0);
        // Four periods of the lowest note and more.
        [0.14, 0.17, 0.2, 0.3].map(|from_s| {
            let window = &out[samples(from_s)..samples(from_s + 0.08)];
            cents(pitch::fundamental_hz(window, RATE_HZ).unwrap(), wanted_hz)
        })
    };
    let found = parallel::each(cases.len(), off, &mut |_| ControlFlow::Continue(())).unwrap();
    for ((written, velocity), off) in cases.iter().zip(&found) {
        println!("{} at {velocity}: {off:.0?} cents from 0.04, 0.07, 0.1, 0.2 s on", WrittenNote(*written));
    }
    assert!(found.iter().flatten().all(|off| off.abs() < 30.0));
}

/// Of ten notes so many a second, held for half of the time, how much the last nine differ, dB.
fn unevenness_db(written: u8, velocity: f32, rate: f64) -> f64 {
    let begin = |n: usize| 0.1 + n as f64 / rate;
    let keys: Vec<_> = (0..10).map(|n| (begin(n), begin(n) + 0.5 / rate)).collect();
    let (out, _) = played(written, velocity, &keys, begin(10) + 0.1);
    let power = |part: &[f64]| part.iter().map(|x| x * x).sum::<f64>() / part.len() as f64;
    let peak = |n: usize| {
        let windows = out[samples(begin(n))..samples(begin(n + 1))].chunks_exact(samples(0.01));
        10.0 * windows.map(power).fold(0.0, f64::max).log10()
    };
    let peaks: Vec<f64> = (1..10).map(peak).collect();
    peaks.iter().copied().fold(f64::MIN, f64::max) - peaks.iter().copied().fold(f64::MAX, f64::min)
}

#[test]
fn repeated_low_notes_are_mostly_even() {
    let mut cases = Vec::new();
    for written in LOW {
        for velocity in [0.25, 0.5, 0.7, 0.95] {
            cases.extend([6.0, 8.0].map(|rate| (written, velocity, rate)));
        }
    }
    let row = |at: usize| unevenness_db(cases[at].0, cases[at].1, cases[at].2);
    let found = parallel::each(cases.len(), row, &mut |_| ControlFlow::Continue(())).unwrap();
    let uneven = found.iter().filter(|&&db| db > 4.0).count();
    println!("{uneven} of {} rows differ by more than 4 dB", found.len());
    assert!(uneven <= 20, "{uneven}");
}
