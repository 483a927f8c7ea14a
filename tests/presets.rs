//! The factory presets as they sound: equally loud, without limiter, each note in its register, and changed without a click.

#[path = "../crates/core/tests/support/some.rs"]
mod some;

use std::collections::BTreeMap;
use std::sync::Arc;

use chalumeau::presets::{Preset, factory};
use chalumeau_core::analysis::pitch::{fundamental_hz, refine_hz};
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::event::{Event, Timed};
use chalumeau_core::instrument::prepare::Preparation;
use chalumeau_core::instrument::stereo::Stereo;
use chalumeau_core::instrument::{BreathResponse, Channels, Clarinet, Model, Settings, Tuning, Wanted};
use chalumeau_core::units::{Air, SoundingNote, WrittenNote, cents};
use ebur128::{EbuR128, Mode};
use some::some;

const RATE_HZ: u32 = 48_000;
/// Written notes of the phrase: low, across the break and up.
const PHRASE: [u8; 6] = [55, 60, 64, 69, 72, 76];
/// Length of each, and the part of it that sounds, s.
const NOTE_S: f64 = 0.45;
const HELD_S: f64 = 0.42;
/// Key velocity of a mezzo-forte.
const VELOCITY: f32 = 80.0 / 127.0;
/// Two presets differ by less than this in loudness, from the mean of all, LU.
const APART_LU: f64 = 2.0;
/// The presets are measured so far below their own level, dB: there the limiter does not hide a peak.
const BELOW_DB: f32 = 24.0;
/// Where the limiter begins (`core/dsp/limiter.rs`).
const CEILING: f32 = 0.98;

fn models() -> BTreeMap<&'static str, Arc<Model>> {
    let made = Bundled::ALL.map(|instrument| {
        let wanted = Wanted::new(instrument.file(), f64::from(RATE_HZ));
        let model = Preparation::new(&wanted, None).ready().unwrap().expect("it comes with the program");
        (instrument.id(), Arc::new(model))
    });
    made.into_iter().collect()
}

fn clarinet(preset: &Preset, models: &BTreeMap<&'static str, Arc<Model>>) -> Clarinet {
    let model = models[preset.bundled().expect("an instrument of the program").id()].clone();
    let mut clarinet = Clarinet::new(model, f64::from(RATE_HZ));
    let settings = preset.settings();
    clarinet.set_settings(&Settings { gain_db: settings.gain_db - BELOW_DB, ..settings });
    clarinet.reset();
    clarinet
}

fn sounding(clarinet: &Clarinet, written: u8) -> SoundingNote {
    WrittenNote(written).sounding(clarinet.model().file.transposition).unwrap()
}

/// The phrase at a velocity, left and right.
fn phrase(clarinet: &mut Clarinet, velocity: f32) -> [Vec<f32>; 2] {
    let samples = |seconds: f64| (seconds * f64::from(RATE_HZ)) as usize;
    let mut events = Vec::new();
    for (n, written) in PHRASE.into_iter().enumerate() {
        let (note, at) = (sounding(clarinet, written), samples(n as f64 * NOTE_S));
        events.push(Timed { at, event: Event::NoteOn { note, velocity } });
        events.push(Timed { at: at + samples(HELD_S), event: Event::NoteOff { note } });
    }
    let length = samples(PHRASE.len() as f64 * NOTE_S + 0.2);
    let [mut left, mut right] = [vec![0.0; length], vec![0.0; length]];
    clarinet.render_events_channels(events, Channels::two(&mut left, &mut right));
    [left, right]
}

/// The phrase in the preset's room.
fn in_room(preset: &Preset, clarinet: &mut Clarinet, velocity: f32) -> [Vec<f32>; 2] {
    let [mut left, mut right] = phrase(clarinet, velocity);
    let mut stereo = Stereo::new(f64::from(RATE_HZ));
    stereo.set_room(&preset.settings().room);
    stereo.pan(&mut left, &mut right);
    [left, right]
}

/// Integrated loudness, LUFS.
fn loudness([left, right]: &[Vec<f32>; 2]) -> f64 {
    let mut meter = EbuR128::new(2, RATE_HZ, Mode::I).unwrap();
    meter.add_frames_planar_f32(&[left, right]).unwrap();
    meter.loudness_global().unwrap() + f64::from(BELOW_DB)
}

/// Largest sample at the preset's own level, without the limiter.
fn peak(channels: &[Vec<f32>; 2]) -> f32 {
    let peak = channels.iter().flatten().fold(0.0_f32, |peak, sample| peak.max(sample.abs()));
    peak * 10_f32.powf(BELOW_DB / 20.0)
}

/// What each preset gives, on all cores.
fn each<T: Send>(measure: impl Fn(&Preset) -> T + Sync) -> Vec<(&'static str, T)> {
    let presets = factory::all();
    let next = std::sync::atomic::AtomicUsize::new(0);
    let found = std::sync::Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some(at) = Some(next.fetch_add(1, std::sync::atomic::Ordering::Relaxed))
                    .filter(|&at| at < presets.len())
                {
                    let measured = measure(&presets[at]);
                    found.lock().unwrap().push((at, measured));
                }
            });
        }
    });
    let mut found = found.into_inner().unwrap();
    found.sort_by_key(|(at, _)| *at);
    found.into_iter().map(|(at, measured)| (presets[at].name.as_str(), measured)).collect()
}

#[test]
fn all_presets_are_equally_loud_and_none_reaches_the_limiter() {
    let models = models();
    let found = each(|preset| {
        let usual = loudness(&in_room(preset, &mut clarinet(preset, &models), VELOCITY));
        let mut loudest = clarinet(preset, &models);
        let peak = peak(&in_room(preset, &mut loudest, 1.0));
        assert_eq!(loudest.resets(), 0, "{}", preset.name);
        (usual, peak)
    });
    let mean = found.iter().map(|(_, (lufs, _))| lufs).sum::<f64>() / found.len() as f64;
    for (name, (lufs, peak)) in &found {
        println!("{name}\t{lufs:.2} LUFS\tpeak {peak:.3}");
    }
    println!("mean {mean:.2} LUFS");
    let wrong: Vec<_> =
        found.iter().filter(|(_, (lufs, peak))| (lufs - mean).abs() > APART_LU || *peak >= CEILING).collect();
    assert!(wrong.is_empty(), "mean {mean:.2} LUFS, limiter from {CEILING}: {wrong:?}");
}

#[test]
fn every_preset_but_effects_speaks_in_tune() {
    /// A note of 0.4 s wanders by itself, cents; *Tempered* keeps it in tune whatever the reed.
    const TEMPERED_CENTS: f64 = 10.0;
    /// *Natural*, and a blowing machine, let the pitch go with breath and reed; there the test asks for the note, not for the tuning.
    const NATURAL_CENTS: f64 = 30.0;
    let models = models();
    let found = each(|preset| {
        let mut clarinet = clarinet(preset, &models);
        let settings = preset.settings();
        let [left, _] = phrase(&mut clarinet, VELOCITY);
        let warm = Air::at(f64::from(settings.temperature_c)).c / Air::at(25.0).c;
        let is_tempered =
            settings.tuning == Tuning::Tempered && settings.breath_response == BreathResponse::Played;
        let most_cents = if is_tempered { TEMPERED_CENTS } else { NATURAL_CENTS };
        let heard = |(n, written): (usize, &u8)| {
            let wanted_hz = warm * sounding(&clarinet, *written).frequency_hz(f64::from(settings.a4_hz));
            let at = |seconds: f64| ((n as f64 * NOTE_S + seconds) * f64::from(RATE_HZ)) as usize;
            let steady: Vec<f64> =
                left[at(0.2)..at(HELD_S)].iter().map(|&sample| f64::from(sample)).collect();
            let heard_hz = refine_hz(&steady, f64::from(RATE_HZ), wanted_hz);
            heard_hz.map_or(f64::NAN, |heard_hz| cents(heard_hz, wanted_hz))
        };
        let heard: Vec<f64> = PHRASE.iter().enumerate().map(heard).collect();
        // What has no pitch is wrong, too.
        let is_right = heard.iter().all(|cents| cents.abs() < most_cents);
        (preset.has_tag("effects"), is_tempered, is_right, heard)
    });
    for (name, (is_effect, is_tempered, is_right, heard)) in &found {
        println!("{name}, effect {is_effect}, tempered {is_tempered}, right {is_right}: {heard:.1?} cents");
    }
    assert!(found.iter().all(|(_, (is_effect, _, is_right, _))| *is_effect || *is_right));
}

/// Each note by itself, tongued, softly and as loud as a key can: no other mode of the bore may take its place.
#[test]
fn every_note_of_every_preset_speaks_in_its_register() {
    /// It says that it does not.
    const UNTAMED: &str = "Untamed reed";
    /// Written notes: the ends of both registers, G#5 to C6, which too little damping and too much lose first, and E6 and F6, which a strong reed loses
    /// when loud.
    const NOTES: [u8; 12] = [52, 60, 69, 71, 77, 80, 81, 82, 83, 84, 88, 89];
    const VELOCITIES: [u8; 2] = [30, 127];
    /// The note is heard from the one to the other, s.
    const HEARD_S: [f64; 2] = [0.3, 0.7];
    /// The nearest other mode is eight times as far away, cents.
    const OFF_CENTS: f64 = 150.0;
    let models = models();
    let found = each(|preset| {
        if preset.name == UNTAMED {
            return Vec::new();
        }
        let mut clarinet = clarinet(preset, &models);
        let settings = *clarinet.settings();
        let (mut players, mut techniques) = (settings.players, settings.techniques);
        // One alone, who does not sing: two pitches have a period in common that is neither's.
        players.count = 1;
        techniques.growl = 0.0;
        clarinet.set_settings(&Settings { players, techniques, ..settings });
        let warm = Air::at(f64::from(settings.temperature_c)).c / Air::at(25.0).c;
        let mut wrong = Vec::new();
        let cases = NOTES.into_iter().flat_map(|written| VELOCITIES.map(|velocity| (written, velocity)));
        for (written, velocity) in some(cases.collect(), 2) {
            let note = sounding(&clarinet, written);
            let wanted_hz = warm * note.frequency_hz(f64::from(settings.a4_hz));
            clarinet.reset();
            clarinet.apply(Event::NoteOn { note, velocity: f32::from(velocity) / 127.0 });
            let [from, to] = HEARD_S.map(|seconds| (seconds * f64::from(RATE_HZ)) as usize);
            let mut samples = vec![0.0; to];
            clarinet.render(&mut samples);
            let steady: Vec<f64> = samples[from..].iter().map(|&sample| f64::from(sample)).collect();
            let off = fundamental_hz(&steady, f64::from(RATE_HZ)).map(|hz| cents(hz, wanted_hz).round());
            if off.is_none_or(|cents| cents.abs() > OFF_CENTS) {
                wrong.push((WrittenNote(written).to_string(), velocity, off));
            }
        }
        wrong
    });
    let wrong: Vec<_> = found.iter().filter(|(_, wrong)| !wrong.is_empty()).collect();
    for (name, wrong) in &wrong {
        println!("{name}: {wrong:?}");
    }
    assert!(wrong.is_empty(), "{} presets have wrong notes", wrong.len());
}

/// Loudest sample, and largest step: a click has far more of it than a tone.
fn edges(samples: &[f32]) -> (f32, f32) {
    let most = |most: f32, value: f32| most.max(value.abs());
    let steps = samples.windows(2).map(|pair| pair[1] - pair[0]);
    (samples.iter().copied().fold(0.0, most), steps.fold(0.0, most))
}

fn rms(samples: &[f32]) -> f32 {
    (samples.iter().map(|sample| sample * sample).sum::<f32>() / samples.len() as f32).sqrt()
}

/// Under a held note, from each preset to the next of the same instrument.
#[test]
fn a_change_of_preset_is_done_in_50_ms_and_does_not_click() {
    const CLICK: f32 = 1.584_893; // 4 dB
    let models = models();
    let presets = factory::all();
    let mut wrong = Vec::new();
    for (at, from) in presets.iter().enumerate() {
        let later = presets[at + 1..].iter().chain(&presets[..at]);
        let Some(to) = later.clone().find(|to| to.bundled() == from.bundled()) else { continue };
        let mut clarinet = clarinet(from, &models);
        // A player who holds still: what is measured is the change, not the wander around it.
        let still = |preset: &Preset| Settings { life: 0.0, ..preset.settings() };
        clarinet.set_settings(&Settings { gain_db: still(from).gain_db - BELOW_DB, ..still(from) });
        let note = sounding(&clarinet, 64);
        clarinet.apply(Event::NoteOn { note, velocity: VELOCITY });
        let samples = |ms: usize| ms * RATE_HZ as usize / 1_000;
        let mut before = vec![0.0; samples(600)];
        clarinet.render(&mut before);
        clarinet.set_settings(&Settings { gain_db: still(to).gain_db - BELOW_DB, ..still(to) });
        let mut after = vec![0.0; samples(900)];
        clarinet.render(&mut after);
        let steady = [&before[samples(400)..], &after[samples(700)..]].map(edges);
        let change = edges(&after[..samples(100)]);
        let most = |get: fn(&(f32, f32)) -> f32| CLICK * steady.iter().map(get).fold(0.0, f32::max);
        let (level, edge) = (change.0 / most(|edges| edges.0), change.1 / most(|edges| edges.1));
        let arrived = 20.0 * (rms(&after[samples(50)..samples(100)]) / rms(&after[samples(700)..])).log10();
        println!(
            "{} to {}: {level:.2} {edge:.2} of a click, {arrived:.1} dB after 50 ms",
            from.name, to.name
        );
        if level > 1.0 || edge > 1.0 || arrived.abs() > 3.0 {
            wrong.push(format!("{} to {}: {level:.2} {edge:.2} {arrived:.1} dB", from.name, to.name));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
