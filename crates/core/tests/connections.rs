//! How notes are connected on clarinets of other sizes: slurs down over the break, and notes that are tongued while the one before rings.
//!
//! The tests print what they measured; `docs/tone.md` has the figures.

#[path = "support/rendered.rs"]
mod rendered;
#[path = "support/some.rs"]
mod some;

use chalumeau_core::analysis::pitch;
use chalumeau_core::analysis::spectrum::moving_rms;
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::event::Event;
use chalumeau_core::instrument::{Model, Preparation, Settings, Wanted};
use chalumeau_core::parallel;
use chalumeau_core::units::{SoundingNote, WrittenNote, cents};
use rendered::rendered;
use some::some;
use std::ops::ControlFlow;
use std::sync::Arc;

const RATE_HZ: f64 = 44_100.0;
/// Ends of the written compass that both tests play: E3 to C6.
const COMPASS: (u8, u8) = (52, 84);
/// Lowest written note of the clarion, B4.
const CLARION: u8 = 71;

/// An instrument that is played, by written notes.
struct Played<'a> {
    model: &'a Arc<Model>,
}

impl Played<'_> {
    fn sounding(&self, written: u8) -> SoundingNote {
        WrittenNote(written).sounding(self.model.file.transposition).unwrap()
    }

    fn hz(&self, written: u8) -> f64 {
        self.sounding(written).frequency_hz(440.0)
    }

    /// Without *Life*, and 20 dB softer, so that no peak meets the limiter.
    fn rendered(&self, events: &[(f64, Event)], seconds: f64) -> Vec<f64> {
        let settings = Settings { life: 0.0, gain_db: -20.0, ..Settings::default() };
        rendered(self.model, RATE_HZ, &settings, events, seconds)
    }
}

fn model(instrument: Bundled) -> Arc<Model> {
    let wanted = Wanted::new(instrument.file(), RATE_HZ);
    Arc::new(Preparation::new(&wanted, None).ready().unwrap().unwrap())
}

fn each<T: Send>(count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    parallel::each(count, work, &mut |_| ControlFlow::Continue(())).unwrap()
}

fn sample(s: f64) -> usize {
    (s * RATE_HZ) as usize
}

fn db(x: f64) -> f64 {
    20.0 * x.max(1e-10).log10()
}

fn level_db(samples: &[f64]) -> f64 {
    db((samples.iter().map(|x| x * x).sum::<f64>() / samples.len() as f64).sqrt())
}

/// Half, nine tenths and all of the values lie below these.
fn quantiles(values: impl IntoIterator<Item = f64>) -> [f64; 3] {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    [0.5, 0.9, 1.0].map(|share| values[((values.len() - 1) as f64 * share).round() as usize])
}

/// Hole and bump of a slur, dB, and how far off the new note is between 0.2 and 0.4 s after its key, cents.
fn slurred(played: &Played<'_>, from: u8, to: u8, value: u8) -> (f64, f64, f64) {
    let key = |s, written| (s, Event::NoteOn { note: played.sounding(written), velocity: 0.8 });
    let breath = (0.0, Event::Breath(f32::from(value) / 127.0));
    let out = played.rendered(&[breath, key(0.0, from), key(0.5, to)], 1.25);
    let after = &out[sample(0.95)..];
    let soon = &out[sample(0.7)..sample(0.9)];
    let off = pitch::fundamental_hz(soon, RATE_HZ).map_or(f64::INFINITY, |f| cents(f, played.hz(to)));
    let period_s = 1.0 / played.hz(from.min(to));
    let (before, after) = (level_db(&out[sample(0.38)..sample(0.48)]), level_db(after));
    let envelope = moving_rms(&out, RATE_HZ, period_s * (0.01 / period_s).ceil());
    let way = envelope[sample(0.5)..sample(0.9)].iter().map(|&x| db(x));
    let (least, most) =
        way.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), x| (least.min(x), most.max(x)));
    (before.min(after) - least, most - before.max(after), off)
}

/// On a bass, slurs from the clarion to the low chalumeau stayed on the twelfth for a quarter of a second, and some were 12 dB louder on the way.
#[test]
fn slurs_down_over_the_break_arrive_on_every_clarinet() {
    // How deep nine tenths of the holes and all may be, and how loud all bumps, dB.
    let most_db = [
        (Bundled::A, [10.0, 22.0, 5.0]),
        (Bundled::EFlat, [11.5, 25.0, 5.5]),
        (Bundled::Bass, [12.5, 25.0, 7.5]),
    ];
    for (instrument, most_db) in most_db {
        let model = model(instrument);
        let played = Played { model: &model };
        let pairs = (CLARION..=COMPASS.1).flat_map(|from| (COMPASS.0..CLARION).map(move |to| (from, to)));
        let all: Vec<_> =
            pairs.flat_map(|(from, to)| [16, 45, 76, 108, 127].map(|value| (from, to, value))).collect();
        let all = some(all, 4);
        let found = each(all.len(), |n| slurred(&played, all[n].0, all[n].1, all[n].2));
        let lost: Vec<_> =
            all.iter().zip(&found).filter(|(_, (.., off))| off.abs() > 100.0).map(|(slur, _)| slur).collect();
        let holes = quantiles(found.iter().map(|slur| slur.0));
        let bumps = quantiles(found.iter().map(|slur| slur.1));
        println!(
            "{instrument:?}: {} slurs, lost {lost:?}, holes {holes:.1?} dB, bumps {bumps:.1?} dB",
            all.len()
        );
        assert!(lost.is_empty(), "{instrument:?}: {lost:?}");
        assert!(holes[1] <= most_db[0] && holes[2] <= most_db[1] && bumps[2] <= most_db[2], "{instrument:?}");
    }
}

/// A column that still rings is heard through the holes that open. Where all fingers moved at once and in 5 ms, that was up to 12 dB louder than
/// the notes on a bass.
#[test]
fn a_tongued_note_does_not_release_what_rings_with_a_pop() {
    for (instrument, most_db) in [(Bundled::BFlat, [2.5, 4.0]), (Bundled::Bass, [2.5, 7.5])] {
        let model = model(instrument);
        let played = Played { model: &model };
        let pairs = (COMPASS.0..=COMPASS.1)
            .flat_map(|from| [-7, -4, -2, -1, 1, 2, 4, 7].map(|by| (from, from.wrapping_add_signed(by))))
            .filter(|&(_, to)| (COMPASS.0..=COMPASS.1).contains(&to));
        let all: Vec<_> =
            pairs.flat_map(|(from, to)| [0.35, 0.7].map(|velocity| (from, to, velocity))).collect();
        let all = some(all, 2);
        let pops = each(all.len(), |n| {
            const AT: f64 = 0.3;
            let (from, to, velocity) = all[n];
            let on = |s, written| (s, Event::NoteOn { note: played.sounding(written), velocity });
            let off = (AT - 0.03, Event::NoteOff { note: played.sounding(from) });
            let out = played.rendered(&[on(0.0, from), off, on(AT, to)], AT + 0.3);
            let held = level_db(&out[sample(AT - 0.1)..sample(AT - 0.03)])
                .max(level_db(&out[sample(AT + 0.2)..sample(AT + 0.3)]));
            let begins = &moving_rms(&out, RATE_HZ, 0.008)[sample(AT)..sample(AT + 0.06)];
            db(begins.iter().copied().fold(0.0, f64::max)) - held
        });
        let found = quantiles(pops);
        println!("{instrument:?}: {} notes begin at most {found:.1?} dB louder", all.len());
        assert!(found[1] <= most_db[0] && found[2] <= most_db[1], "{instrument:?}: {found:.1?} dB");
    }
}
