//! Other reeds and lips than the reference, *Tempered*: the player keeps every note in tune.
//!
//! The test prints what it measured; `docs/tone.md` has the table.

#[path = "support/rendered.rs"]
mod rendered;
#[path = "support/some.rs"]
#[allow(dead_code, reason = "other tests use the rest")]
mod some;

use chalumeau_core::analysis::pitch::fundamental_hz;
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::event::Event;
use chalumeau_core::instrument::{Model, Preparation, Settings, Tuning, Wanted};
use chalumeau_core::parallel;
use chalumeau_core::units::{WrittenNote, cents};
use rendered::rendered;
use std::ops::ControlFlow;
use std::sync::Arc;

const RATE_HZ: f64 = 44_100.0;
/// Length of a note, and from where it counts as steady, s.
const NOTE_S: f64 = 1.2;
const STEADY_S: f64 = 0.8;
/// Softly, mezzo-forte and loud: values of the breath controller.
const BREATHS: [u8; 3] = [16, 70, 120];
/// Farther away it is another note: some reeds do not hold every one of the highest.
const OTHER_NOTE_CENTS: f64 = 150.0;

/// Strength, lip opening, zeta, damping and facing.
type Reed = [f32; 5];
/// What players choose: a soft reed and a hard one, a bite, an open lip, the ends of what presets ask for, and these together.
const REEDS: [Reed; 12] = [
    [2.0, 1.0, 0.3, 1.0, 0.4],
    [3.0, 1.0, 0.3, 1.0, 0.4],
    [3.5, 1.0, 0.3, 1.0, 0.4],
    [2.5, 0.85, 0.3, 1.0, 0.4],
    [2.5, 1.15, 0.3, 1.0, 0.4],
    [2.5, 1.0, 0.22, 1.0, 0.4],
    [2.5, 1.0, 0.4, 1.0, 0.4],
    [2.5, 1.0, 0.3, 0.75, 0.4],
    [2.5, 1.0, 0.3, 1.3, 0.4],
    [3.25, 1.18, 0.34, 1.0, 0.3],
    [2.0, 1.1, 0.38, 1.2, 0.4],
    [2.25, 1.0, 0.27, 1.3, 0.45],
];

fn settings([strength, lip, zeta, damping, lay]: Reed, tuning: Tuning) -> Settings {
    let still = Settings { gain_db: -12.0, life: 0.0, noise: 0.0, ..Settings::default() };
    Settings { strength, lip, zeta, damping, lay, tuning, ..still }
}

/// How much higher a note sounds than it is written, cents; `None` if another one sounds.
fn off_cents(model: &Arc<Model>, settings: &Settings, written: WrittenNote, breath: u8) -> Option<f64> {
    let note = written.sounding(model.file.transposition)?;
    let breath = Event::Breath(f32::from(breath) / 127.0);
    let events = [(0.0, breath), (0.0, Event::NoteOn { note, velocity: 0.8 })];
    let heard = rendered(model, RATE_HZ, settings, &events, NOTE_S);
    let hz = fundamental_hz(&heard[(STEADY_S * RATE_HZ) as usize..], RATE_HZ)?;
    Some(cents(hz, note.frequency_hz(440.0))).filter(|off| off.abs() < OTHER_NOTE_CENTS)
}

/// Sizes of the errors of every `step`th note with all reeds, in order, cents, at each of [`BREATHS`]; and how many notes were others.
fn errors(instrument: Bundled, step: usize, tuning: Tuning) -> ([Vec<f64>; 3], usize) {
    let wanted = Wanted::new(instrument.file(), RATE_HZ);
    let model = Arc::new(Preparation::new(&wanted, None).ready().expect("it comes prepared").unwrap());
    // Below, in the longer lower joint of the bass, written C3 is up to 34 cents off at full breath.
    let lowest = model.file.lowest_unextended();
    let notes = model.file.fingerings.iter().map(|fingering| fingering.written);
    let notes: Vec<WrittenNote> = notes.filter(|note| *note >= lowest).step_by(step).collect();
    let cases = REEDS.len() * notes.len();
    let each = parallel::each(
        cases * BREATHS.len(),
        |at| {
            let (breath, case) = (BREATHS[at / cases], at % cases);
            off_cents(&model, &settings(REEDS[case / notes.len()], tuning), notes[case % notes.len()], breath)
        },
        &mut |_| ControlFlow::Continue(()),
    )
    .unwrap();
    let others = each.iter().filter(|off| off.is_none()).count();
    let sorted = [0, 1, 2].map(|breath| {
        let mut sizes: Vec<f64> =
            each[breath * cases..(breath + 1) * cases].iter().flatten().map(|off| off.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        sizes
    });
    (sorted, others)
}

fn quantile(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

#[test]
fn every_note_stays_in_tune_with_another_reed_and_another_lip() {
    let (step, step_of_others) = if some::all_cases() { (1, 4) } else { (5, 11) };
    for (instrument, step) in
        [(Bundled::BFlat, step), (Bundled::EFlat, step_of_others), (Bundled::Bass, step_of_others)]
    {
        let (sizes, others) = errors(instrument, step, Tuning::Tempered);
        for ((sizes, breath), (median, most)) in
            sizes.iter().zip(BREATHS).zip([(0.8, 5.0), (0.8, 7.0), (1.8, 12.0)])
        {
            let [middle, tenth, worst] = [0.5, 0.9, 1.0].map(|share| quantile(sizes, share));
            println!(
                "{} at {breath}: {} notes, half within {middle:.2}, nine of ten within {tenth:.2}, all within {worst:.2} cents",
                instrument.id(),
                sizes.len()
            );
            assert!(middle < median && worst < most, "{} at {breath}: {middle} {worst}", instrument.id());
        }
        println!("{others} others");
    }
}

/// Without the player's correction the same reeds are far away: what the test above asserts is not in the reeds.
#[test]
fn natural_the_same_reeds_put_notes_elsewhere() {
    let ([_, mezzo_forte, _], _) = errors(Bundled::BFlat, 4, Tuning::Natural);
    println!(
        "half within {:.1} cents, all within {:.1}",
        quantile(&mezzo_forte, 0.5),
        quantile(&mezzo_forte, 1.0)
    );
    assert!(quantile(&mezzo_forte, 0.5) > 4.0 && quantile(&mezzo_forte, 1.0) > 25.0);
}

/// Full travel of a controller that opens the reed, either way.
const TRAVEL: f32 = 1.6;

#[test]
fn a_reed_that_a_controller_opens_keeps_every_note_in_tune() {
    let wanted = Wanted::new(Bundled::BFlat.file(), RATE_HZ);
    let model = Arc::new(Preparation::new(&wanted, None).ready().expect("it comes prepared").unwrap());
    let notes: Vec<WrittenNote> = model.file.fingerings.iter().map(|fingering| fingering.written).collect();
    let notes: Vec<WrittenNote> = notes.into_iter().step_by(if some::all_cases() { 1 } else { 4 }).collect();
    let settings = settings([2.5, 1.0, 0.3, 1.0, 0.4], Tuning::Tempered);
    let cases = 2 * notes.len();
    let each = parallel::each(
        cases,
        |at| {
            let (h, written) = ([1.0 / TRAVEL, TRAVEL][at % 2], notes[at / 2]);
            let note = written.sounding(model.file.transposition)?;
            let events = [
                Event::Breath(70.0 / 127.0),
                Event::Reed { h, k: 1.0 },
                Event::NoteOn { note, velocity: 0.8 },
            ];
            let heard = rendered(&model, RATE_HZ, &settings, &events.map(|event| (0.0, event)), NOTE_S);
            let hz = fundamental_hz(&heard[(STEADY_S * RATE_HZ) as usize..], RATE_HZ)?;
            Some((written, h, cents(hz, note.frequency_hz(440.0))))
        },
        &mut |_| ControlFlow::Continue(()),
    )
    .unwrap();
    let heard: Vec<_> = each.into_iter().flatten().collect();
    assert!(heard.len() + 2 >= cases, "{} of {cases} are heard", heard.len());
    let worst = heard.iter().map(|(_, _, off)| off.abs()).fold(0.0, f64::max);
    println!("{} notes, all within {worst:.1} cents", heard.len());
    assert!(worst < 10.0, "{heard:?}");
}
