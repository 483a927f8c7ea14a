//! Breath noise at the beginning and the end of a note, beside that of the held note, on the B flat clarinet.
//!
//! Above 6 kHz soft notes have hardly any tone, so that what is there is noise. `docs/tone.md` has what is printed.

#[path = "support/rendered.rs"]
mod support;

use chalumeau_core::analysis::spectrum::moving_rms;
use chalumeau_core::event::Event;
use chalumeau_core::instrument::{Model, Settings};
use chalumeau_core::units::{SoundingNote, WrittenNote};
use std::sync::{Arc, LazyLock};

const RATE_HZ: f64 = 44_100.0;
/// When the key goes down and up, and when all is over, s.
const BEGIN_S: f64 = 0.05;
const END_S: f64 = 1.25;
const OVER_S: f64 = 1.5;
/// Written E3 to E6.
const NOTES: [u8; 7] = [52, 60, 66, 70, 76, 82, 88];
/// Soft, up to mezzo-piano.
const SOFT: [u8; 4] = [4, 12, 24, 45];

static MODEL: LazyLock<Arc<Model>> = LazyLock::new(|| Arc::new(Model::built_in(RATE_HZ).unwrap()));

fn sample(s: f64) -> usize {
    (s * RATE_HZ) as usize
}

/// A note that is tongued and let go, without life.
fn rendered(note: SoundingNote, value: u8, noise: f32) -> Vec<f64> {
    let settings = Settings { noise, life: 0.0, gain_db: -20.0, ..Settings::default() };
    let events = [
        (0.0, Event::Breath(f32::from(value) / 127.0)),
        (BEGIN_S, Event::NoteOn { note, velocity: 0.8 }),
        (END_S, Event::NoteOff { note }),
    ];
    support::rendered(&MODEL, RATE_HZ, &settings, &events, OVER_S)
}

/// What is above 6 kHz, by three high-passes of second order.
fn high(samples: &[f64]) -> Vec<f64> {
    let (sine, cosine) = (std::f64::consts::TAU * 6_000.0 / RATE_HZ).sin_cos();
    let width = sine / 2.0_f64.sqrt();
    let gain = (1.0 + cosine) / 2.0 / (1.0 + width);
    let (a1, a2) = (-2.0 * cosine / (1.0 + width), (1.0 - width) / (1.0 + width));
    let mut out = samples.to_vec();
    for _ in 0..3 {
        let ([mut x1, mut x2], [mut y1, mut y2]) = ([0.0; 2], [0.0; 2]);
        for x in &mut out {
            let y = gain * (*x - 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
            (x2, x1, y2, y1) = (x1, *x, y1, y);
            *x = y;
        }
    }
    out
}

/// Loudest of the windows of a length within a time, dB.
fn loudest_db(high: &[f64], length_s: f64, (from_s, to_s): (f64, f64)) -> f64 {
    let windows = moving_rms(high, RATE_HZ, length_s);
    20.0 * windows[sample(from_s)..sample(to_s)].iter().copied().fold(1e-10, f64::max).log10()
}

fn steady_db(high: &[f64]) -> f64 {
    let part = &high[sample(0.6)..sample(1.2)];
    10.0 * (part.iter().map(|x| x * x).sum::<f64>() / part.len() as f64).log10()
}

#[test]
fn soft_notes_begin_and_end_without_a_puff() {
    let mut most = [f64::NEG_INFINITY; 4];
    for (written, value) in NOTES.into_iter().flat_map(|note| SOFT.map(|value| (note, value))) {
        let note = WrittenNote(written).sounding(MODEL.file.transposition).unwrap();
        let [noisy, clean] = [0.3, 0.0].map(|noise| high(&rendered(note, value, noise)));
        let steady_db = steady_db(&noisy);
        let (begin, end) = ((BEGIN_S, BEGIN_S + 0.2), (END_S, END_S + 0.2));
        // 40 ms and 10 ms around the beginning, and the same around the end.
        let over = [(0.04, begin), (0.01, begin), (0.04, end), (0.01, end)]
            .map(|(length_s, time)| loudest_db(&noisy, length_s, time) - steady_db);
        let tone = [begin, end].map(|time| loudest_db(&clean, 0.04, time) - steady_db);
        println!(
            "{written} at {value}: steady {steady_db:.1} dB, over it {over:.1?} dB, without noise {tone:.1?}"
        );
        assert!(tone.into_iter().all(|db| db < -3.0), "{written} at {value}: the band has a tone");
        most = [0, 1, 2, 3].map(|n| most[n].max(over[n]));
    }
    println!("most {most:.1?} dB");
    // The jet through a reed that the tongue lets go meets the first waves in the bore: some of a beginning is pulsed. It was 24 and 27 dB
    // at the beginning and 27 and 30 dB at the end while only the slow mean counted as steady. Ten milliseconds of steady noise
    // scatter by 2 dB.
    let [begin_db, begin_peak_db, end_db, end_peak_db] = most;
    assert!(begin_db < 6.0 && begin_peak_db < 9.0, "{begin_db} {begin_peak_db}");
    assert!(end_db < 2.0 && end_peak_db < 4.0, "{end_db} {end_peak_db}");
}

#[test]
fn noise_grows_with_the_note() {
    let note = WrittenNote(64).sounding(MODEL.file.transposition).unwrap();
    let levels = [4, 45, 78, 110].map(|value| steady_db(&high(&rendered(note, value, 0.3))));
    println!("{levels:.1?} dB");
    assert!(levels.is_sorted_by(|soft, loud| soft + 4.0 < *loud));
}
