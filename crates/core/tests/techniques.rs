//! Extended techniques, the vocal tract and the glissando, heard on the built-in clarinet with the default settings.

use chalumeau_core::analysis::pitch::{fundamental_hz, pitch_track};
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::context_fingerings::Alternate;
use chalumeau_core::bore::fingering_finder::bits;
use chalumeau_core::control::key_switches::KeySwitches;
use chalumeau_core::event::{Event, Fingerings, Technique, Timed};
use chalumeau_core::instrument::player::PlayerState;
use chalumeau_core::instrument::{
    Beyond, Clarinet, GrowlPitch, KeyPitches, Model, Preparation, Reach, Settings, Techniques, Tract, Wanted,
};
use chalumeau_core::units::{SoundingNote, WrittenNote, cents};
use std::sync::Arc;

const RATE_HZ: f64 = 48_000.0;
/// Samples of a step of 1 ms.
const STEP: usize = 48;

fn sounding(written: u8) -> SoundingNote {
    WrittenNote(written).sounding(2).unwrap()
}

fn playing(settings: &Settings, written: u8, breath: f32) -> Clarinet {
    let mut clarinet = Clarinet::built_in(RATE_HZ).unwrap();
    clarinet.set_settings(settings);
    clarinet.apply(Event::Breath(breath));
    clarinet.apply(Event::NoteOn { note: sounding(written), velocity: 0.7 });
    clarinet
}

/// `ms` of sound, with something done before each.
fn listen(clarinet: &mut Clarinet, ms: usize, mut each: impl FnMut(&mut Clarinet, usize)) -> Vec<f64> {
    let mut heard = Vec::with_capacity(ms * STEP);
    for n in 0..ms {
        each(clarinet, n);
        let mut block = [0.0; STEP];
        clarinet.render(&mut block);
        heard.extend(block.map(f64::from));
    }
    heard
}

/// Half a second of a held note after 0.9 s.
fn held(settings: &Settings, written: u8, breath: f32) -> Vec<f64> {
    let mut clarinet = playing(settings, written, breath);
    listen(&mut clarinet, 900, |_, _| {});
    listen(&mut clarinet, 500, |_, _| {})
}

/// Level of a sinusoid, dB, in a Hann window.
fn level_db(samples: &[f64], hz: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    let (mut re, mut im, mut sum) = (0.0, 0.0, 0.0);
    for (n, x) in samples.iter().enumerate() {
        let n = n as f64;
        let weight = 0.5 - 0.5 * (turn * n / samples.len() as f64).cos();
        let phase = turn * (hz * n / RATE_HZ).fract();
        re += weight * x * phase.cos();
        im += weight * x * phase.sin();
        sum += weight;
    }
    20.0 * (2.0 * re.hypot(im) / sum).max(1e-12).log10()
}

/// Largest change of the pitch between frames 10 ms apart, cents; a frame without pitch is endless. First and last pitch, and
/// lowest and highest level over the first, dB.
fn way(heard: &[f64]) -> (f64, f64, f64, [f64; 2]) {
    let track = pitch_track(heard, RATE_HZ, 0.01);
    let hz: Vec<f64> = track.iter().map(|point| point.hz.unwrap_or(f64::MIN_POSITIVE)).collect();
    // Where the level is low, a single frame may be taken for its third, fourth or fifth partial, whatever life and noise do: the middle of three
    // frames is not.
    let middle = |frames: &[f64]| {
        let mut frames = [frames[0], frames[1], frames[2]];
        frames.sort_by(f64::total_cmp);
        frames[1]
    };
    let hz: Vec<f64> = hz.windows(3).map(middle).collect();
    let step = hz.windows(2).map(|pair| cents(pair[1], pair[0]).abs()).fold(0.0, f64::max);
    let level = |n: usize| 20.0 * (track[n].rms / track[0].rms).log10();
    let (low, high) =
        (0..track.len()).map(level).fold((0.0, 0.0), |(a, b): (f64, f64), x| (a.min(x), b.max(x)));
    (step, hz[0], hz[hz.len() - 1], [low, high])
}

/// The table of docs/techniques.md.
#[test]
fn the_voice_of_a_growl_is_as_loud_as_the_documents_say() {
    let quiet = Settings { noise: 0.0, life: 0.0, ..Settings::default() };
    let fixed = Techniques { growl: 1.0, growl_pitch: GrowlPitch::Fixed, ..Techniques::default() };
    let below = Techniques { growl: 1.0, ..Techniques::default() };
    for (written, techniques, breath, documented) in [
        (60, below, 0.6, [-21.0, -35.0]),
        (79, below, 0.6, [-26.0, -33.0]),
        (64, fixed, 0.6, [-21.0, -28.0]),
        (52, fixed, 0.6, [-19.0, -36.0]),
        (79, below, 0.9, [-42.0, -40.0]),
    ] {
        let growled = held(&Settings { techniques, ..quiet }, written, breath);
        let hz = sounding(written).frequency_hz(440.0);
        let voice_hz = if techniques.growl_pitch == GrowlPitch::Fixed { 110.0 } else { 0.5 * hz };
        let sides = [hz + voice_hz, (hz - voice_hz).abs()];
        for (side_hz, wanted) in sides.into_iter().zip(documented) {
            let side = level_db(&growled, side_hz) - level_db(&growled, hz);
            assert!((side - wanted).abs() < 1.5, "{written} at {breath}: {side:.1} dB, {wanted} documented");
        }
    }
}

#[test]
fn a_growl_puts_the_voice_beside_every_partial() {
    for (written, techniques, interval) in [
        (60, Techniques { growl: 1.0, ..Techniques::default() }, 0.5),
        (79, Techniques { growl: 1.0, ..Techniques::default() }, 0.5),
        (
            64,
            Techniques { growl: 1.0, growl_pitch: GrowlPitch::Fixed, ..Techniques::default() },
            110.0 / sounding(64).frequency_hz(440.0),
        ),
    ] {
        // A loud high note is saturated and hides a voice of 392 Hz: -43 dB at breath 0.9.
        let loudest = if written > 70 { 0.6 } else { 0.9 };
        for breath in [0.15, 0.5, loudest] {
            let quiet = Settings { noise: 0.0, ..Settings::default() };
            let (growled, clean) =
                (held(&Settings { techniques, ..quiet }, written, breath), held(&quiet, written, breath));
            let hz = sounding(written).frequency_hz(440.0);
            for place in [1.0 + interval, 1.0 - interval] {
                let side = level_db(&growled, place * hz) - level_db(&growled, hz);
                let before = level_db(&clean, place * hz) - level_db(&clean, hz);
                println!("{written} breath {breath}: at {place:.2} {side:.1} dB, without {before:.1}");
                assert!(side > -40.0 && before < -70.0, "{written} {breath} {place}: {side} {before}");
            }
        }
    }
}

#[test]
fn a_flutter_beats_at_its_rate_and_the_note_goes_on() {
    for written in [52, 67, 79] {
        for breath in [0.1, 0.6, 1.0] {
            let techniques = Techniques { flutter: 1.0, flutter_hz: 20.0, ..Techniques::default() };
            let quiet = Settings { noise: 0.0, ..Settings::default() };
            let heard = held(&Settings { techniques, ..quiet }, written, breath);
            let plain = held(&quiet, written, breath);
            let power = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64;
            let change = 10.0 * (power(&heard) / power(&plain)).log10();
            // The envelope, a level every 5 ms, at the rate and at what is not a multiple of it.
            let envelope: Vec<f64> = heard.chunks(240).map(|part| 10.0 * power(part).log10()).collect();
            let at = |hz: f64| {
                let turn = |n: usize| std::f64::consts::TAU * hz * n as f64 * 0.005;
                let sum = |f: fn(f64) -> f64| {
                    envelope.iter().enumerate().map(|(n, level)| level * f(turn(n))).sum::<f64>()
                };
                2.0 / envelope.len() as f64 * sum(f64::cos).hypot(sum(f64::sin))
            };
            let (rate, beside) = (at(20.0), at(30.0));
            println!(
                "{written} breath {breath}: {rate:.1} dB either way at 20 Hz, {beside:.1} at 30, level {change:.1}"
            );
            // Loud high notes are saturated.
            assert!(rate > 0.7 && rate > 2.0 * beside, "{written} {breath}: {rate} {beside}");
            assert!(change.abs() < 6.0, "{written} {breath}: {change}");
        }
    }
}

#[test]
fn a_subtone_is_dark_at_the_same_fundamental_and_in_tune() {
    let quiet = Settings { noise: 0.0, ..Settings::default() };
    let covered = Settings { techniques: Techniques { subtone: 1.0, ..Techniques::default() }, ..quiet };
    let mut darkest = 0.0_f64;
    for written in [52, 55, 60, 64, 67] {
        let measure = |settings: &Settings, breath: f32| {
            let heard = held(settings, written, breath);
            let hz = fundamental_hz(&heard, RATE_HZ).unwrap();
            let above: f64 = (4..=20).map(|n| 10f64.powf(0.1 * level_db(&heard, f64::from(n) * hz))).sum();
            (cents(hz, sounding(written).frequency_hz(440.0)), level_db(&heard, hz), 10.0 * above.log10())
        };
        let (off, first, above) = measure(&covered, 0.62);
        let (mut low, mut high) = (0.04_f32, 1.0);
        for _ in 0..7 {
            let middle = 0.5 * (low + high);
            if measure(&quiet, middle).1 < first { low = middle } else { high = middle }
        }
        let (_, same, plain) = measure(&quiet, 0.5 * (low + high));
        let darker = (above - first) - (plain - same);
        println!("{written}: {off:.1} cents, above h3 {darker:.1} dB at h1 {first:.1} and {same:.1} dBFS");
        assert!((first - same).abs() < 0.5 && off.abs() < 10.0, "{written}: {first} {same} {off}");
        // A throat note of that level is dark by itself, as recorded ones are.
        let most = if written == 67 { -5.0 } else { -9.5 };
        assert!(darker < most, "{written}: {darker}");
        darkest = darkest.min(darker);
    }
    assert!(darkest < -14.0);
}

/// Written A4 to C6, tongued into the subtone, softly and loud: the note of the key, and hardly softer.
#[test]
fn above_the_break_a_subtone_neither_silences_a_note_nor_leaves_it_to_a_lower_mode() {
    let plain = Settings { noise: 0.0, life: 0.0, ..Settings::default() };
    let covered = Settings { techniques: Techniques { subtone: 1.0, ..Techniques::default() }, ..plain };
    for written in [71, 72, 74, 77, 81, 84] {
        for breath in [0.3, 0.62] {
            let [without, with] = [&plain, &covered].map(|settings| held(settings, written, breath));
            let off =
                fundamental_hz(&with, RATE_HZ).map(|hz| cents(hz, sounding(written).frequency_hz(440.0)));
            let hz = sounding(written).frequency_hz(440.0);
            let softer = level_db(&without, hz) - level_db(&with, hz);
            println!("{written} at {breath}: {off:?} cents, {softer:.1} dB softer");
            assert!(
                off.is_some_and(|off| off.abs() < 15.0) && softer < 4.0,
                "{written} at {breath}: {off:?} {softer}"
            );
        }
    }
}

#[test]
fn a_tract_bends_a_high_note_by_900_cents_without_a_break_and_keeps_its_level() {
    for (written, seconds) in [(84, 3.0), (79, 3.0), (84, 2.0), (79, 2.0)] {
        let at = |semitones: f32| Settings {
            tract: Tract { amount: 1.0, interval_semitones: semitones },
            ..Settings::default()
        };
        let mut clarinet = playing(&at(7.0), written, 0.6);
        listen(&mut clarinet, 1_000, |_, _| {});
        let steps = 1_000.0 * seconds;
        let heard = listen(&mut clarinet, steps as usize, |clarinet, n| {
            clarinet.set_settings(&at(7.0 - (15.5 / steps * n as f64) as f32));
        });
        let (step, first, last, level) = way(&heard);
        let bend = cents(last, first);
        println!("{written} in {seconds} s: {bend:.0} cents, largest step {step:.1}, level {level:.1?} dB");
        assert!(bend < -900.0 && step < 20.0, "{written}: {bend} {step}");
        assert!(level[0] > -4.0 && level[1] < 4.0, "{written}: {level:?}");
    }
}

#[test]
fn within_a_register_a_glissando_has_no_step() {
    for (from, to) in [(52, 67), (67, 52), (72, 84), (84, 72), (60, 64)] {
        let settings = Settings { glissando_s: 2.5, ..Settings::default() };
        let mut clarinet = playing(&settings, from, 0.6);
        listen(&mut clarinet, 800, |_, _| {});
        let heard = listen(&mut clarinet, 3_000, |clarinet, n| {
            if n == 150 {
                clarinet.apply(Event::NoteOn { note: sounding(to), velocity: 0.7 });
            }
        });
        let (step, first, last, level) = way(&heard);
        println!("{from} to {to}: largest step {step:.1} cents, level {level:.1?} dB");
        let off = [(first, from), (last, to)].map(|(hz, note)| cents(hz, sounding(note).frequency_hz(440.0)));
        assert!(off.iter().all(|off| off.abs() < 10.0), "{from} {to}: {off:?}");
        assert!(step < 22.0, "{from} {to}: {step}");
    }
}

/// A slide that is interrupted half-way: the high key is let go, so that it goes back, or another key is pressed, so that it goes on
/// from where it is.
#[test]
fn an_interrupted_glissando_has_no_step() {
    let up = |note| Event::NoteOn { note: sounding(note), velocity: 0.7 };
    let off = |note| Event::NoteOff { note: sounding(note) };
    for (from, to, then, last) in [
        (60, 67, off(67), 60),
        (52, 67, up(69), 69),
        (52, 65, up(55), 55),
        (67, 55, up(60), 60),
        (72, 84, off(84), 72),
        (84, 74, up(79), 79),
    ] {
        for after in [250, 1_000, 1_600] {
            let settings = Settings { glissando_s: 2.5, ..Settings::default() };
            let mut clarinet = playing(&settings, from, 0.6);
            listen(&mut clarinet, 800, |_, _| {});
            let heard = listen(&mut clarinet, 3_400 + after, |clarinet, n| match n {
                150 => clarinet.apply(up(to)),
                n if n == 150 + after => clarinet.apply(then),
                _ => {}
            });
            let (step, _, hz, level) = way(&heard);
            let off = cents(hz, sounding(last).frequency_hz(440.0));
            println!(
                "{from} to {to}, after {after} ms to {last}: step {step:.1} cents, off {off:.1}, level {level:.1?} dB"
            );
            assert!(off.abs() < 10.0, "{from} {to} {after} {last}: {off}");
            assert!(step < 22.0, "{from} {to} {after} {last}: {step}");
        }
    }
}

/// From an alternate fingering, whose holes are not those of the chart, and between keys of another tuning.
#[test]
fn a_glissando_begins_at_the_fingering_and_the_pitch_that_sound() {
    let settings = Settings { glissando_s: 2.5, ..Settings::default() };
    let slide = |clarinet: &mut Clarinet, to: SoundingNote| {
        listen(clarinet, 800, |_, _| {});
        let heard = listen(clarinet, 3_200, |clarinet, n| {
            if n == 150 {
                clarinet.apply(Event::NoteOn { note: to, velocity: 0.7 });
            }
        });
        way(&heard)
    };
    let model = Model::built_in(RATE_HZ).unwrap();
    let has_alternate = |&written: &u8| {
        model
            .fingering_for(sounding(written))
            .is_some_and(|fingering| model.alternates.nth(fingering, 1).is_some())
    };
    let written: Vec<u8> = (52..=84).filter(has_alternate).collect();
    println!("{written:?} have alternates");
    assert!(written.len() >= 4);
    for from in written {
        // Within its register.
        let to = if matches!(from, 52..=59 | 71..=77) { from + 7 } else { from - 5 };
        let mut clarinet = Clarinet::built_in(RATE_HZ).unwrap();
        clarinet.set_settings(&settings);
        clarinet.apply(Event::Breath(0.6));
        clarinet.apply(Event::Fingerings(Fingerings::Alternate(1)));
        clarinet.apply(Event::NoteOn { note: sounding(from), velocity: 0.7 });
        let (step, _, last, level) = slide(&mut clarinet, sounding(to));
        let off = cents(last, sounding(to).frequency_hz(440.0));
        println!("alternate {from} to {to}: step {step:.1}, off {off:.1}, level {level:.1?} dB");
        assert!(step < 30.0 && off.abs() < 10.0, "{from} {to}: {step} {off}");
    }
    // Even keys are 45 cents flat. Odd keys play the note below, 45 cents sharp.
    let hz = |key: u8| {
        SoundingNote(key & !1).frequency_hz(440.0)
            * (if key & 1 == 0 { -45.0_f64 } else { 45.0 } / 1_200.0).exp2()
    };
    let mut model = Model::clone(&Model::built_in(RATE_HZ).unwrap());
    model.keys = KeyPitches::from_hz(|key| Some(hz(key)));
    let model = Arc::new(model);
    for (from, to) in [(60, 65), (61, 66), (60, 61), (61, 60)] {
        let mut clarinet = Clarinet::new(model.clone(), RATE_HZ);
        clarinet.set_settings(&settings);
        clarinet.apply(Event::Breath(0.6));
        clarinet.apply(Event::NoteOn { note: SoundingNote(from), velocity: 0.7 });
        let (step, first, last, _) = slide(&mut clarinet, SoundingNote(to));
        let off = [(first, from), (last, to)].map(|(heard, key)| cents(heard, hz(key)));
        println!("key {from} to {to}: step {step:.1}, off {off:.1?}");
        assert!(step < 22.0 && off.iter().all(|off| off.abs() < 10.0), "{from} {to}: {step} {off:?}");
    }
}

/// A glissando from note to note: largest step of the pitch; lowest, highest and last level over the first, dB; and how far off it arrives.
fn slides(from: u8, to: u8, seconds: f32, breath: f32) -> (f64, [f64; 2], f64, f64) {
    let settings = Settings { glissando_s: seconds, ..Settings::default() };
    let mut clarinet = playing(&settings, from, breath);
    listen(&mut clarinet, 800, |_, _| {});
    let heard = listen(&mut clarinet, 800 + (1_000.0 * seconds) as usize, |clarinet, n| {
        if n == 150 {
            clarinet.apply(Event::NoteOn { note: sounding(to), velocity: 0.7 });
        }
    });
    let (step, _, last, level) = way(&heard);
    let off = cents(last, sounding(to).frequency_hz(440.0));
    // The first and the last 100 ms: before the slide, and after it.
    let last_db = rms_db(&heard[heard.len() - 100 * STEP..]) - rms_db(&heard[..100 * STEP]);
    println!(
        "{from} to {to}, breath {breath}: largest step {step:.1} cents, level {level:.1?}, last {last_db:.1} dB, off {off:.1}"
    );
    (step, level, last_db, off)
}

/// The gesture at the beginning of the Rhapsody in Blue, two octaves and a half, up and down; and shorter ones.
#[test]
fn over_the_registers_a_glissando_has_no_step() {
    for (from, to, seconds, breath) in
        [(55, 84, 3.0, 0.6), (60, 84, 3.0, 0.3), (84, 60, 3.0, 0.6), (82, 64, 2.4, 0.9)]
    {
        let (step, _, _, off) = slides(from, to, seconds, breath);
        assert!(step < 22.0 && off.abs() < 10.0, "{from} {to} {breath}: {step} {off}");
    }
}

/// Where the hands change, or many holes follow each other quickly, some slides move faster than that for a moment. Loud ones are softer
/// where jets in half-open holes take from them. A note at the end may be softer than the one at the beginning, at the same breath.
#[test]
fn a_glissando_over_the_registers_is_nearly_even_and_keeps_its_level() {
    for (from, to, seconds, breath) in [
        (54, 84, 3.0, 0.9),
        (60, 84, 3.0, 0.6),
        (52, 81, 3.0, 0.6),
        (66, 77, 1.6, 0.3),
        (84, 60, 3.0, 0.3),
        (84, 54, 3.0, 0.9),
    ] {
        let (step, level, last_db, off) = slides(from, to, seconds, breath);
        // Down to C4, softly, 27.9 to 36.1 at life and noise of 0 to 1 and 0 to 0.3, as this wander falls.
        assert!(step < 37.0 && off.abs() < 10.0, "{from} {to} {breath}: {step} {off}");
        let softest_db = if breath < 0.8 { -4.0 } else { -12.0 };
        assert!(level[0] > softest_db + last_db.min(0.0), "{from} {to} {breath}: {level:?}");
    }
}

/// Live rates in single precision and high quality in double: nothing runs away with every technique moving at once.
#[test]
fn any_movement_of_all_techniques_stays_bounded() {
    let mut seed = 1_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f32 / (1_u64 << 24) as f32
    };
    for rate_hz in [44_100.0, 48_000.0, 96_000.0] {
        let mut clarinet = Clarinet::built_in(rate_hz).unwrap();
        for n in 0..150 {
            clarinet.set_settings(&Settings {
                tract: Tract { amount: random(), interval_semitones: 48.0 * random() - 24.0 },
                glissando_s: 0.3 * random(),
                ..Settings::default()
            });
            for which in [Technique::Growl, Technique::Flutter, Technique::Subtone] {
                clarinet.apply(Event::Technique { which, amount: random() });
            }
            clarinet.apply(Event::Breath(random()));
            let note = sounding(52 + (random() * 40.0) as u8);
            clarinet.apply(if n % 3 == 2 {
                Event::NoteOff { note }
            } else {
                Event::NoteOn { note, velocity: random() }
            });
            let mut block = vec![0.0; 2_000];
            clarinet.render(&mut block);
            assert!(block.iter().all(|x| x.abs() <= 1.0), "{rate_hz} {n}");
        }
        assert_eq!(clarinet.resets(), 0, "{rate_hz}");
    }
}

/// Written C4, whose fingering with the left ring finger's hole open is that of D4.
const HALF_HOLED: u8 = 60;

/// Index of that hole, and the open holes of D4.
fn ring_finger(clarinet: &Clarinet) -> (u8, u64) {
    let file = &clarinet.model().file;
    let hole = file.hole("L3").unwrap();
    let [low, high] = [60, 62].map(|written| bits(&file.fingering(WrittenNote(written)).unwrap().open));
    assert_eq!(high, low | 1 << hole);
    (hole as u8, high)
}

fn still() -> Settings {
    Settings { noise: 0.0, life: 0.0, ..Settings::default() }
}

fn opening(clarinet: &mut Clarinet, hole: u8) -> f64 {
    clarinet.voice_mut().lattice().opening(usize::from(hole))
}

/// Loudest 3 ms above about 4 kHz (a first difference, three times, whose gain there is set to 1), dB.
fn highest_db(heard: &[f64]) -> f64 {
    let gain = 2.0 * (std::f64::consts::PI * 4_000.0 / RATE_HZ).sin();
    let third: Vec<f64> = heard.windows(4).map(|x| x[3] - 3.0 * (x[2] - x[1]) - x[0]).collect();
    let power = |part: &[f64]| part.iter().map(|x| x * x).sum::<f64>() / part.len() as f64;
    10.0 * (third.chunks(3 * STEP).map(power).fold(1e-20, f64::max) / gain.powi(6)).log10()
}

/// Level, dB.
fn rms_db(heard: &[f64]) -> f64 {
    10.0 * (heard.iter().map(|x| x * x).sum::<f64>() / heard.len() as f64).log10()
}

#[test]
fn the_pitch_follows_a_hole_as_it_half_opens() {
    for breath in [0.2, 0.5, 0.9] {
        let mut clarinet = playing(&still(), HALF_HOLED, breath);
        let (hole, open) = ring_finger(&clarinet);
        listen(&mut clarinet, 600, |_, _| {});
        let mut pitches = Vec::new();
        for tenths in 0..=10 {
            clarinet.apply(Event::Hole { hole, opening: Some(tenths as f32 / 10.0) });
            listen(&mut clarinet, 300, |_, _| {});
            pitches.push(fundamental_hz(&listen(&mut clarinet, 300, |_, _| {}), RATE_HZ).unwrap());
        }
        let steps: Vec<f64> = pitches.windows(2).map(|pair| cents(pair[1], pair[0])).collect();
        let whole = cents(pitches[10], pitches[0]);
        println!("breath {breath}: {whole:.1} cents by {steps:.1?}");
        assert!(steps.iter().all(|&step| step > 0.0 && step < 0.35 * whole), "{breath}: {steps:?}");
        assert!((whole - 200.0).abs() < 40.0, "{breath}: a whole tone, in the tuning of C4: {whole}");
        // The same holes at once.
        let mut other = playing(&still(), HALF_HOLED, breath);
        other.apply(Event::TryHoles(Some(open)));
        listen(&mut other, 900, |_, _| {});
        let at_once = fundamental_hz(&listen(&mut other, 300, |_, _| {}), RATE_HZ).unwrap();
        assert!(cents(at_once, pitches[10]).abs() < 0.1, "{at_once} {}", pitches[10]);
    }
}

#[test]
fn a_controller_that_steps_a_hole_neither_clicks_nor_leaves_a_gap() {
    // How much what is high rises over the held notes, or over 45 dB below the tone; and the frames of the pitch.
    let move_it = |length_ms: usize, each: &mut dyn FnMut(&mut Clarinet, usize)| {
        let mut clarinet = playing(&still(), HALF_HOLED, 0.5);
        listen(&mut clarinet, 600, |_, _| {});
        let before = listen(&mut clarinet, 300, |_, _| {});
        let way = listen(&mut clarinet, length_ms + 200, |clarinet, ms| each(clarinet, ms));
        let after = listen(&mut clarinet, 300, |_, _| {});
        let held = highest_db(&before).max(highest_db(&after)).max(rms_db(&before) - 45.0);
        let track = pitch_track(&[before, way.clone(), after].concat(), RATE_HZ, 0.01);
        let hz: Vec<f64> = track.iter().map(|point| point.hz.unwrap_or(f64::MIN_POSITIVE)).collect();
        let steps: Vec<f64> = hz[10..hz.len() - 10].windows(2).map(|pair| cents(pair[1], pair[0])).collect();
        (highest_db(&way) - held, steps)
    };
    let (hole, _) = ring_finger(&playing(&still(), HALF_HOLED, 0.5));
    let open = |share: f32| Event::Hole { hole, opening: Some(share) };
    let (slur, _) = move_it(0, &mut |clarinet, ms| {
        if ms == 0 {
            clarinet.apply(Event::NoteOn { note: sounding(HALF_HOLED + 2), velocity: 0.8 });
        }
    });
    let (at_once, _) = move_it(0, &mut |clarinet, ms| {
        if ms == 0 {
            clarinet.apply(open(1.0));
        }
    });
    println!("at once {at_once:.2} dB, the slur {slur:.2} dB");
    assert!(at_once < slur + 1.0, "as a slur by this finger, {slur} dB: {at_once} dB");
    // All steps of a MIDI controller, one every 8 ms.
    let (stepped, steps) = move_it(1_016, &mut |clarinet, ms| {
        if ms % 8 == 0 && ms < 1_016 {
            clarinet.apply(open((ms / 8 + 1) as f32 / 127.0));
        }
    });
    let largest = steps.iter().copied().fold(0.0, f64::max);
    let back = -steps.iter().copied().fold(0.0, f64::min);
    println!("stepped {stepped:.2} dB, pitch up by {largest:.1} cents in 10 ms at most, back by {back:.2}");
    assert!(stepped < 1.0, "{stepped} dB");
    assert!(largest < 12.0 && back < 0.5, "{largest} {back}");
}

#[test]
fn a_held_hole_stays_under_every_fingering_until_it_is_given_back() {
    for glissando_s in [0.0, 0.2] {
        let mut clarinet = playing(&Settings { glissando_s, ..still() }, HALF_HOLED, 0.5);
        let (hole, open) = ring_finger(&clarinet);
        // It comes before the fingers are in place, and twice.
        clarinet.apply(Event::Hole { hole, opening: Some(3.0) });
        clarinet.apply(Event::Hole { hole, opening: Some(0.25) });
        clarinet.apply(Event::Hole { hole: 63, opening: Some(0.5) });
        listen(&mut clarinet, 100, |_, _| {});
        assert_eq!(opening(&mut clarinet, hole), 0.25);
        // Of all these slurs, and of the slides, the hole takes no part.
        for written in [64, 57, 72, 60] {
            clarinet.apply(Event::NoteOn { note: sounding(written), velocity: 0.7 });
            for _ in 0..300 {
                listen(&mut clarinet, 1, |_, _| {});
                assert_eq!(opening(&mut clarinet, hole), 0.25, "{written} {glissando_s}");
            }
        }
        clarinet.apply(Event::Hole { hole, opening: None });
        listen(&mut clarinet, 100, |_, _| {});
        assert_eq!(opening(&mut clarinet, hole), 0.0);
        for back in [
            Event::TryHoles(None),
            Event::TryHoles(Some(open & !(1 << hole))),
            Event::Hole { hole, opening: Some(f32::NAN) },
        ] {
            clarinet.apply(Event::Hole { hole, opening: Some(0.7) });
            listen(&mut clarinet, 50, |_, _| {});
            assert!((opening(&mut clarinet, hole) - 0.7).abs() < 1e-6);
            clarinet.apply(back);
            listen(&mut clarinet, 50, |_, _| {});
            assert_eq!(opening(&mut clarinet, hole), 0.0, "{back:?}");
        }
    }
}

#[test]
fn half_holes_do_not_depend_on_the_block() {
    let note = Event::NoteOn { note: sounding(HALF_HOLED), velocity: 0.7 };
    let mut events = vec![Timed { at: 0, event: Event::Breath(0.5) }, Timed { at: 0, event: note }];
    events.extend((0..40).map(|n| Timed {
        at: 9_000 + 301 * n,
        event: Event::Hole { hole: (n % 24) as u8, opening: Some((n % 7) as f32 / 6.0) },
    }));
    let render = |block: usize| {
        let mut clarinet = Clarinet::built_in(RATE_HZ).unwrap();
        let mut out = vec![0.0_f32; 24_000];
        for (n, part) in out.chunks_mut(block).enumerate() {
            let begin = n * block;
            let length = part.len();
            let own = events.iter().filter(|event| (begin..begin + length).contains(&event.at));
            clarinet.render_events(own.map(|event| Timed { at: event.at - begin, ..*event }), part);
        }
        out
    };
    let whole = render(24_000);
    assert!([1, 37, 512].into_iter().all(|block| render(block) == whole));
}

/// Which alternate of the model is in place at rest, if all its holes are as it has them and the chart's are not.
fn in_place(clarinet: &mut Clarinet) -> Option<usize> {
    let holes = clarinet.model().file.holes.len();
    let open = (0..holes as u8).fold(0, |bits, hole| {
        let opening = opening(clarinet, hole);
        assert!(opening == 0.0 || opening == 1.0, "under way");
        bits | u64::from(opening == 1.0) << hole
    });
    let state = clarinet.player_state();
    let model = clarinet.model();
    let chart = bits(&model.file.fingerings[state.fingering].open);
    let own = |one: &Alternate| one.fingering == state.fingering && one.open == open;
    let found = model.alternates.all().iter().position(own);
    assert!(found.is_some() || open == chart, "neither the chart's fingering nor an alternate");
    found
}

fn press(clarinet: &mut Clarinet, written: u8) {
    let note = WrittenNote(written).sounding(clarinet.model().file.transposition).unwrap();
    clarinet.apply(Event::NoteOn { note, velocity: 0.7 });
}

fn by_context() -> Settings {
    Settings { alternates: true, ..still() }
}

#[test]
fn chromatic_slurs_take_alternates_and_leaps_do_not() {
    // From, to, whether an alternate is taken: F5 F#5, E4 D#4; a leap to the same notes; a step that the chart does best.
    for (from, to, takes) in
        [(77, 78, true), (64, 63, true), (70, 78, false), (55, 63, false), (65, 67, false)]
    {
        for (settings, takes) in [(by_context(), takes), (still(), false)] {
            let mut clarinet = playing(&settings, from, 0.5);
            listen(&mut clarinet, 300, |_, _| {});
            assert_eq!(in_place(&mut clarinet), None, "a tongued note");
            press(&mut clarinet, to);
            listen(&mut clarinet, 100, |_, _| {});
            assert_eq!(in_place(&mut clarinet).is_some(), takes, "{from} {to}");
        }
    }
}

#[test]
fn a_trill_goes_to_the_alternate_and_back() {
    let (from, to) = (77, 78);
    let mut clarinet = playing(&by_context(), from, 0.6);
    listen(&mut clarinet, 300, |_, _| {});
    for _ in 0..6 {
        press(&mut clarinet, to);
        listen(&mut clarinet, 80, |_, _| {});
        assert!(in_place(&mut clarinet).is_some());
        clarinet.apply(Event::NoteOff { note: sounding(to) });
        listen(&mut clarinet, 80, |_, _| {});
        assert!(in_place(&mut clarinet).is_none());
    }
    listen(&mut clarinet, 200, |_, _| {});
    let hz = fundamental_hz(&listen(&mut clarinet, 300, |_, _| {}), RATE_HZ).unwrap();
    assert!(cents(hz, sounding(from).frequency_hz(440.0)).abs() < 3.0);
}

/// All pairs of fingerings between which an alternate is taken, on every bundled instrument.
#[test]
fn each_alternate_that_is_taken_plays_its_note() {
    for instrument in Bundled::ALL {
        let model =
            Preparation::new(&Wanted::new(instrument.file(), RATE_HZ), None).ready().unwrap().unwrap();
        let model = Arc::new(model);
        let fingerings = &model.file.fingerings;
        let notes = 0..fingerings.len();
        let mut worst = 0.0_f64;
        let mut count = 0;
        for (from, to) in notes.clone().flat_map(|from| notes.clone().map(move |to| (from, to))) {
            let Some(at) = model.alternates.taken(from, None, to) else { continue };
            for breath in [0.2, 0.5, 0.9] {
                let mut clarinet = Clarinet::new(model.clone(), RATE_HZ);
                clarinet.set_settings(&by_context());
                clarinet.apply(Event::Breath(breath));
                press(&mut clarinet, fingerings[from].written.0);
                listen(&mut clarinet, 500, |_, _| {});
                press(&mut clarinet, fingerings[to].written.0);
                listen(&mut clarinet, 500, |_, _| {});
                assert_eq!(in_place(&mut clarinet), Some(usize::from(at)));
                let hz = fundamental_hz(&listen(&mut clarinet, 300, |_, _| {}), RATE_HZ);
                let off = hz.map_or(f64::INFINITY, |hz| cents(hz, model.notes_hz[to]));
                let alternate = model.alternates.get(at).unwrap();
                println!(
                    "{} {} {} breath {breath}: {off:+.1} cents, corrected by {:+.1}, threshold x {:.3}",
                    instrument.id(),
                    fingerings[from].written,
                    fingerings[to].written,
                    -alternate.cents,
                    alternate.harder
                );
                worst = worst.max(off.abs());
                count += 1;
            }
        }
        assert!(count >= 12, "{}: {count}", instrument.id());
        assert!(worst < 20.0, "{}: {worst}", instrument.id());
    }
}

#[test]
fn where_no_alternate_is_taken_not_a_bit_changes() {
    let play = |settings: &Settings| {
        let mut clarinet = playing(settings, 65, 0.5);
        listen(&mut clarinet, 900, |clarinet, ms| match ms {
            300 => press(clarinet, 72),
            600 => press(clarinet, 79),
            _ => {}
        })
    };
    assert!(play(&by_context()) == play(&still()));
}

/// Eb4 has two alternates, F#5 one, F4 none.
#[test]
fn key_switches_choose_the_fingering_of_the_next_note() {
    let settings = Settings { reach: Reach { key_switches: KeySwitches::C1, ..Reach::default() }, ..still() };
    let mut clarinet = playing(&settings, 65, 0.5);
    // Struck without a decoder: as the window and Python strike keys.
    let switch = |clarinet: &mut Clarinet, key| {
        let note = SoundingNote(key);
        clarinet.apply(Event::NoteOn { note, velocity: 0.7 });
        clarinet.apply(Event::NoteOff { note });
    };
    let nth = |clarinet: &mut Clarinet, written: u8, is_slurred: bool| {
        let before = clarinet.player_state().key;
        if let (Some(note), false) = (before, is_slurred) {
            clarinet.apply(Event::NoteOff { note });
            listen(clarinet, 50, |_, _| {});
        }
        press(clarinet, written);
        listen(clarinet, 100, |_, _| {});
        let found = in_place(clarinet);
        if let (Some(note), true) = (before, is_slurred) {
            clarinet.apply(Event::NoteOff { note });
        }
        found.map_or(0, |at| clarinet.model().alternates.all()[at].nth)
    };
    for is_slurred in [true, false] {
        for (key, of_d_sharp, of_f_sharp) in [(25, 1, 1), (26, 2, 0), (27, 0, 0), (24, 0, 0)] {
            assert_eq!(nth(&mut clarinet, 65, is_slurred), 0);
            let before = clarinet.player_state();
            switch(&mut clarinet, key);
            let PlayerState { key: held, fingering, .. } = clarinet.player_state();
            assert_eq!((held, fingering), (before.key, before.fingering), "the note goes on");
            listen(&mut clarinet, 50, |_, _| {});
            assert_eq!(in_place(&mut clarinet), None, "with its fingering");
            assert_eq!(nth(&mut clarinet, 63, is_slurred), of_d_sharp, "{key} {is_slurred}");
            assert_eq!(nth(&mut clarinet, 65, is_slurred), 0);
            assert_eq!(nth(&mut clarinet, 78, is_slurred), of_f_sharp, "{key} {is_slurred}");
        }
        switch(&mut clarinet, 28);
        nth(&mut clarinet, 77, is_slurred);
        assert_eq!(nth(&mut clarinet, 78, true), 1, "by context");
        switch(&mut clarinet, 24);
    }
    // What was chosen last counts, key or setting; a panic leaves it, a reset does not.
    switch(&mut clarinet, 25);
    clarinet.apply(Event::Panic);
    assert_eq!(clarinet.player_state().chosen, Some(Fingerings::Alternate(1)));
    clarinet.set_settings(&Settings { noise: 0.1, ..settings });
    assert!(clarinet.player_state().chosen.is_some(), "another setting");
    clarinet.set_settings(&Settings { alternates: true, ..settings });
    assert_eq!(clarinet.player_state().chosen, None);
    switch(&mut clarinet, 25);
    clarinet.reset();
    assert_eq!(clarinet.player_state().chosen, None);
}

#[test]
fn key_switches_alone_are_silent_and_off_they_do_nothing() {
    let reach = |key_switches| Reach { key_switches, beyond: Beyond::Octave, ..Reach::default() };
    let play = |key_switches, keys: &[u8]| {
        let mut clarinet = Clarinet::built_in(RATE_HZ).unwrap();
        clarinet.set_settings(&Settings { reach: reach(key_switches), ..still() });
        clarinet.apply(Event::Breath(0.6));
        listen(&mut clarinet, 400, |clarinet, ms| {
            if let Some(&key) = keys.get(ms / 50).filter(|_| ms % 50 == 0) {
                clarinet.apply(Event::NoteOn { note: SoundingNote(key), velocity: 0.9 });
            }
        })
    };
    let row = [36, 37, 38, 39, 40];
    let nothing = play(KeySwitches::C2, &[]);
    assert!(play(KeySwitches::C2, &row) == nothing);
    assert!(play(KeySwitches::Off, &row) != nothing, "off, they play an octave higher");
}

/// Every alternate that a key can choose on the bundled B flat clarinet.
#[test]
fn each_alternate_that_a_key_chooses_plays_its_note() {
    let settings = Settings { reach: Reach { key_switches: KeySwitches::C1, ..Reach::default() }, ..still() };
    let model = Clarinet::built_in(RATE_HZ).unwrap().model().clone();
    let mut worst = 0.0_f64;
    for alternate in model.alternates.all() {
        for breath in [0.2, 0.5, 0.9] {
            let mut clarinet = Clarinet::new(model.clone(), RATE_HZ);
            clarinet.set_settings(&settings);
            clarinet.apply(Event::Breath(breath));
            clarinet.apply(Event::Fingerings(Fingerings::Alternate(alternate.nth as u8)));
            press(&mut clarinet, model.file.fingerings[alternate.fingering].written.0);
            listen(&mut clarinet, 600, |_, _| {});
            let hz = fundamental_hz(&listen(&mut clarinet, 300, |_, _| {}), RATE_HZ);
            let off = hz.map_or(f64::INFINITY, |hz| cents(hz, model.notes_hz[alternate.fingering]));
            println!(
                "{} alternate {} breath {breath}: {off:+.1} cents, corrected by {:+.1}, threshold x {:.3}",
                model.file.fingerings[alternate.fingering].written,
                alternate.nth,
                -alternate.cents,
                alternate.harder
            );
            worst = worst.max(off.abs());
        }
    }
    // F#4 with two side keys at the loudest of the three.
    assert!(worst < 17.0, "{worst}");
}
