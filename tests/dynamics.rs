//! A player's dynamics on the B flat clarinet: what a breath controller does to level, pitch, register and colour of every note.
//!
//! Each test prints what it measured. Levels are in dBFS as a project hears them; renders are 20 dB softer, so that no peak
//! meets the limiter.

use chalumeau_core::analysis::noise_bands::{BANDS_HZ, noise_db};
use chalumeau_core::analysis::pitch;
use chalumeau_core::analysis::spectrum::steady_segment;
use chalumeau_core::analysis::steady_note::SteadyNote;
use chalumeau_core::event::{Event, Timed};
use chalumeau_core::haptics::FeelDesign;
use chalumeau_core::instrument::player::response::breath_of_dynamic;
use chalumeau_core::instrument::{Clarinet, Model, Settings};
use chalumeau_core::measure::realism::{
    self, Dynamic, HEADROOM_DB, NoteScore, RecordedNote, Summary, louder_is_brighter, median,
};
use chalumeau_core::parallel;
use chalumeau_core::score::{Score, play};
use chalumeau_core::units::{SoundingNote, WrittenNote, cents};
use chalumeau_knob::touch::angle::KnobDesign;
use chalumeau_knob::touch::breath_from_angle::{Blower, BreathMapping};
use chalumeau_knob::touch::feel::{InstrumentFeel, NO_MOTOR};
use std::convert::Infallible;
use std::ops::ControlFlow;
use std::sync::{Arc, LazyLock};

const RATE: u32 = 44_100;
/// Written E3 to C6.
const NOTES: std::ops::RangeInclusive<u8> = 52..=84;
/// Controller values at which a held note is heard.
const VALUES: [u8; 18] = [8, 15, 22, 29, 36, 43, 50, 57, 64, 71, 78, 85, 92, 99, 106, 113, 120, 127];
/// Noise of the recorded notes at mezzo-forte re the tone in the bands of `noise_bands`, medians, dB.
const RECORDED_NOISE_DB: [f64; 5] = [-45.0, -46.0, -46.0, -52.0, -57.0];
/// Time at each, s.
const STEP_S: f64 = 0.5;

static MODEL: LazyLock<Arc<Model>> = LazyLock::new(|| Arc::new(Model::built_in(f64::from(RATE)).unwrap()));

fn sounding(written: u8) -> SoundingNote {
    WrittenNote(written).sounding(MODEL.file.transposition).unwrap()
}

fn each<T: Send>(count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    parallel::each(count, work, &mut |_| ControlFlow::Continue(())).unwrap()
}

/// A player who holds notes still: what is measured is the rule, not the wander around it.
fn still() -> Settings {
    Settings { life: 0.0, ..Settings::default() }
}

/// Plays events, at times in s, with these settings.
fn rendered(settings: &Settings, events: &[(f64, Event)], seconds: f64) -> Vec<f64> {
    let mut clarinet = Clarinet::new(MODEL.clone(), f64::from(RATE));
    clarinet.set_settings(&Settings { gain_db: -HEADROOM_DB as f32, ..*settings });
    clarinet.reset();
    let samples = |s: f64| (s * f64::from(RATE)) as usize;
    let events = events.iter().map(|&(s, event)| Timed { at: samples(s), event }).collect();
    let mut out = Vec::with_capacity(samples(seconds));
    let Ok(()) = play(&mut clarinet, &Score { events, samples: samples(seconds) }, 512, |block| {
        out.extend(block.iter().map(|&x| f64::from(x)));
        Ok::<_, Infallible>(())
    });
    out
}

fn controller(value: u8) -> Event {
    Event::Breath(f32::from(value) / 127.0)
}

fn key(written: u8) -> Event {
    Event::NoteOn { note: sounding(written), velocity: 0.8 }
}

/// Level in dBFS and cents off a note, infinite for no pitch, between two times in s.
fn heard(out: &[f64], from_s: f64, to_s: f64, written: u8) -> (f64, f64) {
    let sample = |s: f64| ((s * f64::from(RATE)) as usize).min(out.len());
    let part = &out[sample(from_s)..sample(to_s)];
    let power = part.iter().map(|x| x * x).sum::<f64>() / part.len() as f64;
    let off = pitch::fundamental_hz(part, f64::from(RATE))
        .map_or(f64::INFINITY, |hz| cents(hz, sounding(written).frequency_hz(440.0)));
    (10.0 * power.max(1e-20).log10() + HEADROOM_DB, off)
}

/// A staircase of controller values on one note, from soft to loud: level and cents at each.
fn staircase(written: u8) -> Vec<(f64, f64)> {
    let mut events = vec![(0.0, controller(VALUES[0])), (0.0, key(written))];
    events
        .extend(VALUES.iter().enumerate().skip(1).map(|(n, &value)| (n as f64 * STEP_S, controller(value))));
    let out = rendered(&still(), &events, VALUES.len() as f64 * STEP_S);
    let step = |n: usize| heard(&out, (n as f64 + 0.5) * STEP_S, (n as f64 + 1.0) * STEP_S, written);
    (0..VALUES.len()).map(step).collect()
}

#[test]
fn equal_steps_of_breath_are_equal_steps_of_level_in_tune() {
    let notes: Vec<u8> = NOTES.collect();
    let stairs = each(notes.len(), |n| staircase(notes[n]));
    let (mut ranges, mut steps, mut off) = ((f64::INFINITY, 0.0_f64), (f64::INFINITY, 0.0_f64), 0.0_f64);
    for (written, stair) in notes.iter().zip(&stairs) {
        let range = stair[stair.len() - 1].0 - stair[0].0;
        let mean = range / (stair.len() - 1) as f64;
        let own = stair.windows(2).map(|pair| (pair[1].0 - pair[0].0) / mean);
        let own = own.fold((f64::INFINITY, 0.0_f64), |(low, high), step| (low.min(step), high.max(step)));
        let own_off = stair.iter().map(|(_, cents)| cents.abs()).fold(0.0, f64::max);
        println!("written {written}: {range:.1} dB, steps {:.2}..{:.2}, {own_off:.1} cents", own.0, own.1);
        ranges = (ranges.0.min(range), ranges.1.max(range));
        steps = (steps.0.min(own.0), steps.1.max(own.1));
        off = off.max(own_off);
    }
    println!(
        "range {:.1} to {:.1} dB, steps {:.2}..{:.2} of the mean, {off:.1} cents",
        ranges.0, ranges.1, steps.0, steps.1
    );
    // 27 dB from 4 on (docs/guide/midi.md), of which one lies below 8.
    assert!(ranges.0 > 25.5 && ranges.1 < 27.0, "{ranges:?} dB");
    assert!(steps.0 > 0.5 && steps.1 < 2.0);
    assert!(off < 3.0);
}

#[test]
fn every_note_speaks_in_its_register_from_ten_up_and_none_below_four() {
    const TONGUED: [u8; 10] = [4, 8, 10, 16, 32, 48, 64, 80, 104, 127];
    let notes: Vec<u8> = NOTES.collect();
    let played = each(notes.len(), |n| {
        let tongued = |value: u8| rendered(&still(), &[(0.0, controller(value)), (0.0, key(notes[n]))], 0.8);
        let silent = heard(&tongued(3), 0.5, 0.8, notes[n]).0;
        (silent, TONGUED.map(|value| heard(&tongued(value), 0.5, 0.8, notes[n])))
    });
    let mut loudest_silence = f64::NEG_INFINITY;
    for (written, (silent, tongued)) in notes.iter().zip(&played) {
        println!("written {written}: {silent:.0} dBFS at 3, then {tongued:.1?}");
        loudest_silence = loudest_silence.max(*silent);
        for ((level_db, off), value) in tongued.iter().zip(TONGUED) {
            assert!(
                off.abs() < 5.0 && *level_db > -45.0,
                "written {written} at {value}: {level_db} dBFS, {off} cents"
            );
        }
    }
    println!("at most {loudest_silence:.1} dBFS at 3");
    assert!(loudest_silence < -75.0);
}

/// The knob's angle makes breath by its map, as in the plugin; the hand feels each note's threshold at `a_on_deg`.
#[test]
fn with_a_knob_sound_begins_where_the_hand_feels_the_threshold() {
    const PLACES: [f64; 2] = [1.0, 3.0];
    const BELOW: f64 = 0.99;
    const ABOVE: f64 = 1.01;
    let (settings, feels) = (still(), InstrumentFeel::new(&MODEL));
    let full_pa = 1e3 * f64::from(settings.breath_full_kpa);
    for place in PLACES {
        let table =
            feels.table(&settings, &FeelDesign { place, ..FeelDesign::default() }, &NO_MOTOR).unwrap();
        let maps = feels.maps_for(&table, &settings);
        let hand = BreathMapping { maps, design: KnobDesign::default(), feels: true };
        let notes: Vec<u8> = NOTES.collect();
        let heard = each(notes.len(), |n| {
            let felt = table.notes().iter().find(|note| note.written == WrittenNote(notes[n])).unwrap();
            [BELOW, ABOVE].map(|share| {
                let pressed = Timed { at: 0, event: key(notes[n]) };
                let mut blower = Blower::default();
                blower.heed(&pressed);
                let angle_deg = hand.design.zero_deg + share * felt.landmarks.a_on_deg;
                let breath = blower.blow(&hand, angle_deg, full_pa).unwrap().unit();
                let events = [(0.0, Event::Breath(breath)), (0.0, pressed.event)];
                heard(&rendered(&settings, &events, 0.8), 0.5, 0.8, notes[n])
            })
        });
        for (written, [below, above]) in notes.iter().zip(&heard) {
            println!("written {written} at place {place}: {below:.1?}, {above:.1?}");
        }
        let loudest = heard.iter().map(|[below, _]| below.0).fold(f64::NEG_INFINITY, f64::max);
        let softest = heard.iter().map(|[_, above]| above.0).fold(f64::INFINITY, f64::min);
        let off = heard.iter().map(|[_, above]| above.1.abs()).fold(0.0, f64::max);
        println!(
            "place {place}: at most {loudest:.1} dBFS at {BELOW} of the felt threshold, at least {softest:.1} dBFS at {ABOVE}, \
             within {off:.1} cents"
        );
        assert!(loudest < -75.0 && softest > -45.0 && off < 5.0);
    }
}

#[test]
fn slurs_arrive_at_every_dynamic() {
    let mut slurs = Vec::new();
    for from in NOTES.step_by(2) {
        for interval in [1_i16, -1, 2, -4, 7, -7, 12, -12, -13, -16, 19, -19, -24] {
            if let Some(to) = u8::try_from(i16::from(from) + interval).ok().filter(|to| NOTES.contains(to)) {
                slurs.extend([16, 64, 112].map(|value| (from, to, value)));
            }
        }
    }
    let arrived = each(slurs.len(), |n| {
        let (from, to, value) = slurs[n];
        let events = [(0.0, controller(value)), (0.0, key(from)), (0.4, key(to))];
        heard(&rendered(&Settings::default(), &events, 1.1), 0.9, 1.1, to).1.abs() < 10.0
    });
    let lost: Vec<_> =
        slurs.iter().zip(&arrived).filter(|(_, arrived)| !**arrived).map(|(slur, _)| slur).collect();
    println!("{} of {} slurs do not arrive: {lost:?}", lost.len(), slurs.len());
    assert!(lost.is_empty());
}

/// From the clarion and the throat to written E flat 6..F#6; softer, F#6 falls into a lower mode.
#[test]
fn slurs_into_the_altissimo_arrive() {
    let mut slurs = Vec::new();
    for from in (69..=84).step_by(3) {
        for to in 87..=90 {
            slurs.extend([44, 78, 112].map(|value| (from, to, value)));
        }
    }
    let off: Vec<f64> = each(slurs.len(), |n| {
        let (from, to, value) = slurs[n];
        let events = [(0.0, controller(value)), (0.0, key(from)), (0.4, key(to))];
        heard(&rendered(&still(), &events, 1.1), 0.8, 1.1, to).1
    });
    let lost: Vec<_> = slurs.iter().zip(&off).filter(|(_, off)| off.abs() > 20.0).collect();
    println!("{} of {} slurs do not arrive: {lost:?}", lost.len(), slurs.len());
    assert!(lost.is_empty());
}

#[test]
fn colour_level_and_noise_are_near_those_of_recorded_notes() {
    let recorded = RecordedNote::all();
    let played = each(recorded.len(), |n| {
        let dynamic = recorded[n].dynamic.played();
        let settings = Settings { gain_db: -HEADROOM_DB as f32, ..Settings::default() };
        let (note, breath) = (SoundingNote(recorded[n].midi), breath_of_dynamic(dynamic, &settings) as f32);
        let out = realism::render(&MODEL, &settings, note, breath, n);
        let score = NoteScore::new(recorded[n].clone(), SteadyNote::measure(&out));
        let segment = steady_segment(&out, f64::from(RATE)).map_or(&[][..], |range| &out[range]);
        let f0_hz = score.played.as_ref().map(|played| played.f0_hz);
        let hz = f0_hz.and_then(|hz| pitch::refine_hz(segment, f64::from(RATE), hz));
        (score, hz.map(|hz| noise_db(segment, f64::from(RATE), hz, &BANDS_HZ)))
    });
    let of = |dynamic: Dynamic| played.iter().filter(move |(score, _)| score.recorded.dynamic == dynamic);
    let [pp, mf, ff] = Dynamic::ALL.map(|dynamic| Summary::of(of(dynamic).map(|(score, _)| score)));
    for (summary, dynamic) in [(&pp, "pp"), (&mf, "mf"), (&ff, "ff")] {
        println!(
            "{dynamic}: {:.2} dB, {} failed, centroid right on {:.2}, median {:.2}",
            summary.error_db, summary.failed, summary.centroid_share, summary.centroid_ratio
        );
    }
    let step = |from: &Summary, to: &Summary| {
        let (played, recorded) = (to.level_db.0 - from.level_db.0, to.level_db.1 - from.level_db.1);
        println!("step {played:.1} dB, recorded {recorded:.1}");
        played - recorded
    };
    let (to_mf, to_ff) = (step(&pp, &mf), step(&mf, &ff));
    let failed: Vec<_> = played
        .iter()
        .filter(|(score, _)| score.played.is_none())
        .map(|(score, _)| (score.recorded.midi, score.recorded.dynamic))
        .collect();
    println!("failed: {failed:?}");
    let scores: Vec<NoteScore> = played.iter().map(|(score, _)| score.clone()).collect();
    let brighter = louder_is_brighter(&scores);
    let noise: Vec<f64> = (0..BANDS_HZ.len())
        .map(|band| median(of(Dynamic::Mf).filter_map(|(_, noise)| noise.as_ref().map(|noise| noise[band]))))
        .collect();
    println!("brighter on {brighter:.2}; noise at mf {noise:.1?} dB");
    assert!(failed.is_empty(), "{failed:?}");
    // Wanted are 4, 7 and 6 dB. One take tells them to 0.1 dB, and the shares to 5 %.
    assert!(pp.error_db < 4.1 && mf.error_db < 6.7 && ff.error_db < 6.1);
    assert!(pp.centroid_share > 0.9 && mf.centroid_share > 0.7 && ff.centroid_share > 0.75);
    assert!(to_mf.abs() < 3.0 && to_ff.abs() < 3.0);
    assert!(brighter >= 0.95);
    for (noise, (recorded, band)) in noise.iter().zip(RECORDED_NOISE_DB.into_iter().zip(BANDS_HZ)) {
        assert!((noise - recorded).abs() < 4.5, "{band:?}: {noise} dB");
    }
}
