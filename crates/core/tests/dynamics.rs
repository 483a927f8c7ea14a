//! The player's dynamics: what a breath controller does to level, pitch and register, note by note.

use chalumeau_core::analysis::pitch;
use chalumeau_core::event::{Event, Timed};
use chalumeau_core::instrument::{Clarinet, Model, Settings, Tuning};
use chalumeau_core::parallel;
use chalumeau_core::score::{Score, play};
use chalumeau_core::units::{SoundingNote, WrittenNote, cents};
use std::convert::Infallible;
use std::ops::ControlFlow;
use std::sync::{Arc, LazyLock};

const RATE: u32 = 48_000;
/// Written E3 to C6.
const NOTES: std::ops::RangeInclusive<u8> = 52..=84;
/// Controller values at which a note is heard.
const VALUES: [u8; 18] = [8, 15, 22, 29, 36, 43, 50, 57, 64, 71, 78, 85, 92, 99, 106, 113, 120, 127];
/// Time at each, s.
const STEP_S: f64 = 0.5;

static MODEL: LazyLock<Arc<Model>> = LazyLock::new(|| Arc::new(Model::built_in(f64::from(RATE)).unwrap()));

fn sounding(written: u8) -> SoundingNote {
    WrittenNote(written).sounding(MODEL.file.transposition).unwrap()
}

fn rendered(settings: &Settings, events: Vec<Timed<Event>>, seconds: f64) -> Vec<f64> {
    let mut clarinet = Clarinet::new(MODEL.clone(), f64::from(RATE));
    clarinet.set_settings(settings);
    clarinet.reset();
    let samples = (seconds * f64::from(RATE)) as usize;
    let mut out = Vec::with_capacity(samples);
    let Ok(()) = play(&mut clarinet, &Score { events, samples }, 512, |block| {
        out.extend(block.iter().map(|&x| f64::from(x)));
        Ok::<_, Infallible>(())
    });
    out
}

fn at(seconds: f64, event: Event) -> Timed<Event> {
    Timed { at: (seconds * f64::from(RATE)) as usize, event }
}

fn cc(value: u8) -> Event {
    Event::Breath(f32::from(value) / 127.0)
}

/// A stretch of a render.
#[derive(Clone, Copy, Debug)]
struct Heard {
    level_db: f64,
    /// Cents off the note; `None` for no pitch.
    off_cents: Option<f64>,
    centroid_hz: f64,
}

fn heard(out: &[f64], from_s: f64, to_s: f64, written: u8) -> Heard {
    let range = |s: f64| ((s * f64::from(RATE)) as usize).min(out.len());
    let part = &out[range(from_s)..range(to_s)];
    let power = part.iter().map(|x| x * x).sum::<f64>() / part.len() as f64;
    let wanted = sounding(written).frequency_hz(440.0);
    let hz = pitch::fundamental_hz(part, f64::from(RATE));
    // Mean frequency by the slope of the wave: enough to tell which is brighter.
    let slope = part.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>() / part.len() as f64;
    Heard {
        level_db: 10.0 * power.max(1e-20).log10(),
        off_cents: hz.map(|hz| cents(hz, wanted)),
        centroid_hz: (slope / power.max(1e-20)).sqrt() * f64::from(RATE) / std::f64::consts::TAU,
    }
}

/// A staircase of controller values on one note, from soft to loud, and what is heard at each.
fn staircase(settings: &Settings, written: u8) -> Vec<Heard> {
    let mut events =
        vec![at(0.0, cc(VALUES[0])), at(0.0, Event::NoteOn { note: sounding(written), velocity: 0.8 })];
    events.extend(VALUES.iter().enumerate().map(|(n, &value)| at(n as f64 * STEP_S, cc(value))));
    events.sort_by_key(|event| event.at);
    let out = rendered(settings, events, VALUES.len() as f64 * STEP_S);
    (0..VALUES.len())
        .map(|n| heard(&out, (n as f64 + 0.5) * STEP_S, (n as f64 + 1.0) * STEP_S, written))
        .collect()
}

#[test]
fn look() {
    let settings = Settings { gain_db: -20.0, ..Settings::default() };
    let notes: Vec<u8> = match std::env::var("LOOK") {
        Ok(list) => list.split(',').map(|at| at.parse().unwrap()).collect(),
        Err(_) => NOTES.collect(),
    };
    let stairs =
        parallel::each(notes.len(), |n| staircase(&settings, notes[n]), &mut |_| ControlFlow::Continue(()))
            .unwrap();
    for (written, heard) in notes.iter().zip(&stairs) {
        let levels: Vec<String> = heard.iter().map(|h| format!("{:.1}", h.level_db + 20.0)).collect();
        let steps: Vec<f64> = heard.windows(2).map(|w| w[1].level_db - w[0].level_db).collect();
        let mean = steps.iter().sum::<f64>() / steps.len() as f64;
        let (min, max) =
            steps.iter().fold((f64::MAX, f64::MIN), |(a, b), &s| (a.min(s / mean), b.max(s / mean)));
        let cents: Vec<String> =
            heard.iter().map(|h| h.off_cents.map_or("-".to_owned(), |c| format!("{c:.1}"))).collect();
        let dull = heard.windows(2).filter(|w| w[1].centroid_hz < w[0].centroid_hz).count();
        println!(
            "{written} range {:.1} steps {min:.2}..{max:.2} duller {dull}\n   {}\n   {}",
            mean * 17.0,
            levels.join(" "),
            cents.join(" ")
        );
    }
    let _ = Tuning::Natural;
}

/// When a tongued note first sounds as itself at each controller value.
#[test]
fn look_attacks() {
    let settings = Settings { gain_db: -20.0, ..Settings::default() };
    let notes: Vec<u8> = match std::env::var("LOOK") {
        Ok(list) => list.split(',').map(|at| at.parse().unwrap()).collect(),
        Err(_) => NOTES.collect(),
    };
    let values = [4, 7, 10, 16, 32, 48, 64, 80, 96, 112, 127];
    let all = parallel::each(
        notes.len(),
        |n| {
            values.map(|value| {
                let note = Event::NoteOn { note: sounding(notes[n]), velocity: 0.8 };
                let out = rendered(&settings, vec![at(0.0, cc(value)), at(0.0, note)], 0.7);
                let end = heard(&out, 0.5, 0.7, notes[n]);
                let level = |w: usize| heard(&out, 0.01 * w as f64, 0.01 * (w + 1) as f64, notes[n]).level_db;
                let t = (0..70).find(|&w| level(w) > end.level_db - 3.0).unwrap_or(99);
                let over = (0..70).map(level).fold(f64::MIN, f64::max) - end.level_db;
                (t * 10, over, end)
            })
        },
        &mut |_| ControlFlow::Continue(()),
    )
    .unwrap();
    for (written, row) in notes.iter().zip(&all) {
        let text: Vec<String> = row
            .iter()
            .map(|(t, over, end)| {
                format!("{t}ms/{over:+.0}/{}", end.off_cents.map_or("-".to_owned(), |c| format!("{c:.0}")))
            })
            .collect();
        println!("{written} {}", text.join(" "));
    }
}

#[test]
fn envelope() {
    let settings = Settings { gain_db: -20.0, ..Settings::default() };
    for written in [52, 64, 72, 80] {
        for value in [7, 16, 48] {
            let note = Event::NoteOn { note: sounding(written), velocity: 0.8 };
            let out = rendered(&settings, vec![at(0.0, cc(value)), at(0.0, note)], 0.7);
            let levels: Vec<String> = (0..60)
                .filter(|w| *w < 16 || w % 4 == 0)
                .map(|w| {
                    format!(
                        "{:.0}",
                        heard(&out, 0.01 * w as f64, 0.01 * (w + 1) as f64, written).level_db + 20.0
                    )
                })
                .collect();
            println!("{written} {value}: {}", levels.join(" "));
        }
    }
}
