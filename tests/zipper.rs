//! A parameter that a controller sweeps makes no steps: between the harmonics of a held note a sweep by the 128 values of a
//! controller leaves no more than one in steps too fine to matter. Figures are printed (`--nocapture`).

#[path = "support/parallel.rs"]
mod parallel;

use std::sync::Arc;

use chalumeau::controllers::linkable;
use chalumeau::parameters::{Kind, Sets};
use chalumeau_core::analysis::{pitch, spectrum, to_f64};
use chalumeau_core::event::{Event, Technique, Timed};
use chalumeau_core::instrument::stereo::Stereo;
use chalumeau_core::instrument::{
    BreathResponse, Channels, Clarinet, Listening, ListeningMode, Model, Settings,
};
use chalumeau_core::units::SoundingNote;
use parallel::each;

const RATE_HZ: f64 = 48_000.0;
/// Length of a sweep, s.
const SWEEP_S: f64 = 0.2;
/// Before the sweep, s: the note is steady.
const BEFORE_S: f64 = 1.0;
/// What a sweep may leave between the harmonics, dB under all.
const LEAST_DB: f64 = -75.0;
/// What the steps of a controller may add to a sweep that is itself above that, dB.
const MORE_DB: f64 = 4.0;

/// Something continuous, and the event of a share 0..=1 of its way.
struct Swept {
    name: String,
    event: Box<dyn Fn(f32) -> Event + Sync + Send>,
}

fn swept() -> Vec<Swept> {
    let of = |name: &str, event: fn(f32) -> Event| Swept { name: name.to_owned(), event: Box::new(event) };
    let mut all = vec![
        of("breath", |x| Event::Breath(0.4 + 0.2 * x)),
        of("bend", |x| Event::Bend { cents: 200.0 * x }),
        of("vibrato", Event::Vibrato),
        of("growl", |amount| Event::Technique { which: Technique::Growl, amount }),
        of("flutter", |amount| Event::Technique { which: Technique::Flutter, amount }),
        of("subtone", |amount| Event::Technique { which: Technique::Subtone, amount }),
        of("volume", |x| Event::Volume { gain: 0.25 + 0.75 * x }),
        of("pan", |x| Event::Pan { position: 2.0 * x - 1.0 }),
    ];
    all.extend(linkable().filter_map(|parameter| {
        let (Kind::Number(number), Some(Sets::Number(which))) = (parameter.kind, parameter.sets) else {
            return None;
        };
        // The middle half of its range: at an end the note may stop. Full breath at 11 kPa would close the reed.
        let quarter = 0.25 * (number.max - number.min);
        let (low, high) = match parameter.id {
            "full" => (4.5, 9.0),
            _ => (number.min + quarter, number.max - quarter),
        };
        let event = move |x: f32| Event::Set(which, low + x * (high - low));
        Some(Swept { name: parameter.name.to_owned(), event: Box::new(event) })
    }));
    all
}

/// A held mezzo-forte, with that switched on which a parameter shapes.
fn around(name: &str) -> Settings {
    let mut settings = Settings { noise: 0.0, life: 0.0, gain_db: -18.0, ..Settings::default() };
    if name.starts_with("Listening") {
        settings.listening = Listening { mode: ListeningMode::Position, ..Listening::default() };
    } else if name.starts_with("Room ") {
        settings.room.amount = 0.3;
    } else if name.starts_with("Vibrato ") {
        settings.vibrato.depth = 0.1;
        settings.vibrato.onset_s = 0.0;
    } else if name.starts_with("Growl ") {
        settings.techniques.growl = 0.1;
    } else if name.starts_with("Flutter ") {
        settings.techniques.flutter = 0.1;
    } else if name.starts_with("Tract ") {
        settings.tract.amount = 0.1;
    } else if name == "Full breath" {
        settings.breath_response = BreathResponse::Physical;
    }
    settings
}

/// The sound around a sweep in steps of so many samples, both channels added.
fn sound(model: &Arc<Model>, swept: &Swept, step: usize) -> Vec<f64> {
    let mut clarinet = Clarinet::new(model.clone(), RATE_HZ);
    let settings = around(&swept.name);
    clarinet.set_settings(&settings);
    let mut stereo = Stereo::new(RATE_HZ);
    stereo.set_room(&settings.room);
    let begin = (BEFORE_S * RATE_HZ) as usize;
    let steps = (SWEEP_S * RATE_HZ) as usize / step;
    let mut events = vec![
        Timed { at: 0, event: Event::Breath(0.5) },
        Timed { at: 0, event: Event::NoteOn { note: SoundingNote(58), velocity: 0.7 } },
        Timed { at: 0, event: (swept.event)(0.0) },
    ];
    events.extend((0..=steps).map(|n| {
        let event = (swept.event)(n as f32 / steps as f32);
        Timed { at: begin + n * step, event }
    }));
    let samples = ((BEFORE_S + 2.0 * SWEEP_S) * RATE_HZ) as usize;
    let (mut left, mut right) = (vec![0.0; samples], vec![0.0; samples]);
    events.iter().for_each(|event| stereo.heed(event));
    clarinet.render_events_channels(events, Channels::two(&mut left, &mut right));
    stereo.pan(&mut left, &mut right);
    let both: Vec<f32> = left.iter().zip(&right).map(|(left, right)| left + 0.7 * right).collect();
    to_f64(&both[begin - samples / 20..begin + (1.2 * SWEEP_S * RATE_HZ) as usize])
}

#[test]
fn sweeps_make_no_steps() {
    let model = Arc::new(Model::built_in(RATE_HZ).unwrap());
    let all = swept();
    let levels = each(&all, |swept| {
        [75, 5].map(|step| {
            let sound = sound(&model, swept, step);
            let f0_hz = pitch::fundamental_hz(&sound, RATE_HZ).unwrap_or(233.1);
            spectrum::non_harmonic_db(&sound, RATE_HZ, f0_hz, 20.0, 8_000.0, 60.0)
        })
    });
    let mut wrong = Vec::new();
    for (swept, [by_controller, fine]) in all.iter().zip(levels) {
        println!("{}: {by_controller:.1} dB, in fine steps {fine:.1} dB", swept.name);
        if by_controller > LEAST_DB.max(fine + MORE_DB) {
            wrong.push(format!("{}: {by_controller:.1} dB, in fine steps {fine:.1} dB", swept.name));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
