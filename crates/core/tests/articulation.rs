//! Scoop, fall and the breath in, heard on the built-in clarinet.

use chalumeau_core::analysis::pitch::{fundamental_hz, refine_hz};
use chalumeau_core::analysis::spectrum::moving_rms;
use chalumeau_core::event::{Event, SettingNumber, Timed};
use chalumeau_core::instrument::{Articulation, Clarinet, Model, Settings, Tuning};
use chalumeau_core::units::{SoundingNote, WrittenNote, cents};
use std::sync::{Arc, LazyLock};

const RATE_HZ: f64 = 48_000.0;
static MODEL: LazyLock<Arc<Model>> = LazyLock::new(|| Arc::new(Model::built_in(RATE_HZ).unwrap()));

fn sounding(written: u8) -> SoundingNote {
    WrittenNote(written).sounding(2).unwrap()
}

fn hz(written: u8) -> f64 {
    sounding(written).frequency_hz(440.0)
}

fn sample(s: f64) -> usize {
    (s * RATE_HZ).round() as usize
}

fn on(s: f64, written: u8) -> (f64, Event) {
    (s, Event::NoteOn { note: sounding(written), velocity: 0.6 })
}

fn off(s: f64, written: u8) -> (f64, Event) {
    (s, Event::NoteOff { note: sounding(written) })
}

fn still(articulation: Articulation) -> Settings {
    Settings { life: 0.0, articulation, ..Settings::default() }
}

fn machine(articulation: Articulation) -> Settings {
    Settings { articulation, ..Settings::physical() }
}

fn clarinet(settings: &Settings) -> Clarinet {
    let mut clarinet = Clarinet::new(Arc::clone(&MODEL), RATE_HZ);
    clarinet.set_settings(settings);
    clarinet.reset();
    clarinet
}

/// Plays events, at times in s, in blocks of so many samples.
fn played(clarinet: &mut Clarinet, events: &[(f64, Event)], seconds: f64, block: usize) -> Vec<f32> {
    let mut out = vec![0.0; sample(seconds)];
    for (n, part) in out.chunks_mut(block).enumerate() {
        let begin = n * block;
        let inside = begin..begin + part.len();
        let events = events.iter().filter(|(s, _)| inside.contains(&sample(*s)));
        clarinet.render_events(events.map(|&(s, event)| Timed { at: sample(s) - begin, event }), part);
    }
    out
}

fn heard(settings: &Settings, events: &[(f64, Event)], seconds: f64) -> Vec<f64> {
    played(&mut clarinet(settings), events, seconds, 512).into_iter().map(f64::from).collect()
}

fn part(sound: &[f64], from_s: f64, to_s: f64) -> &[f64] {
    &sound[sample(from_s)..sample(to_s)]
}

fn level_db(sound: &[f64]) -> f64 {
    10.0 * (sound.iter().map(|x| x * x).sum::<f64>() / sound.len() as f64).max(1e-20).log10()
}

/// Pitch of a stretch over a frequency, cents.
fn pitch_cents(sound: &[f64], hz: f64) -> f64 {
    cents(fundamental_hz(sound, RATE_HZ).unwrap(), hz)
}

#[test]
fn a_scoop_begins_as_far_below_as_asked_and_arrives_in_time() {
    for (scoop_cents, scoop_s) in [(30.0, 0.6), (100.0, 0.8), (300.0, 1.0)] {
        let articulation = Articulation { scoop_cents, scoop_s, ..Articulation::default() };
        for written in [55, 67, 79] {
            for [with, without] in [
                [still(articulation), still(Articulation::default())],
                [machine(articulation), machine(Articulation::default())],
            ] {
                let [scooped, plain] =
                    [with, without].map(|settings| heard(&settings, &[on(0.0, written)], 1.6));
                let off = |from_s: f64, to_s: f64| {
                    let reference = fundamental_hz(part(&plain, 1.2, 1.6), RATE_HZ).unwrap();
                    pitch_cents(part(&scooped, from_s, to_s), reference)
                };
                let first = off(0.06, 0.12);
                let arrived = off(f64::from(scoop_s) + 0.03, f64::from(scoop_s) + 0.13);
                let late = off(1.3, 1.6);
                println!("{written}, {scoop_cents} cents: {first:.1}, then {arrived:.2} and {late:.2}");
                let asked = -f64::from(scoop_cents);
                assert!((first / asked - 1.0).abs() < 0.15, "{written}: {first} of {asked} cents");
                assert!(arrived.abs() < 3.0 && late.abs() < 1.0, "{written}: {arrived}, {late} cents");
            }
        }
    }
}

#[test]
fn a_scoop_rises_without_a_step() {
    let articulation = Articulation { scoop_cents: 200.0, scoop_s: 0.5, ..Articulation::default() };
    let sound = heard(&still(articulation), &[on(0.0, 67)], 0.9);
    let mut before = -200.0;
    for n in 0..35 {
        let from_s = 0.06 + 0.02 * f64::from(n);
        let now = pitch_cents(part(&sound, from_s, from_s + 0.06), hz(67));
        // 0.6 cents a millisecond at the steepest.
        assert!(now - before > -3.0 && now - before < 16.0 || n == 0, "{from_s}: {before} to {now}");
        before = now;
    }
}

#[test]
fn a_slurred_note_has_no_scoop() {
    let articulation = Articulation { scoop_cents: 200.0, scoop_s: 0.3, ..Articulation::default() };
    let events = [on(0.0, 67), on(1.0, 69)];
    let [with, without] =
        [articulation, Articulation::default()].map(|articulation| heard(&still(articulation), &events, 1.5));
    let at = |sound: &[f64]| pitch_cents(part(sound, 1.03, 1.1), hz(69));
    assert!((at(&with) - at(&without)).abs() < 2.0, "{} {}", at(&with), at(&without));
    // Tongued, it has one.
    let tongued = heard(&still(articulation), &[on(0.0, 67), off(0.95, 67), on(1.0, 69)], 1.5);
    assert!(pitch_cents(part(&tongued, 1.06, 1.11), hz(69)) < -150.0);
}

/// A scoop waits for the breath: a wind controller's key may come first.
#[test]
fn a_scoop_begins_with_the_breath() {
    let articulation = Articulation { scoop_cents: 150.0, scoop_s: 0.4, ..Articulation::default() };
    let events = [(0.0, Event::Breath(0.0)), on(0.0, 67), (0.6, Event::Breath(0.6))];
    let sound = heard(&still(articulation), &events, 1.5);
    let [first, late] =
        [(0.64, 0.7), (1.2, 1.5)].map(|(from, to)| pitch_cents(part(&sound, from, to), hz(67)));
    assert!((first / -150.0 - 1.0).abs() < 0.15 && late.abs() < 3.0, "{first} {late}");
}

#[test]
fn a_fall_fades_to_its_depth_and_then_there_is_silence() {
    for (fall_cents, fall_s) in [(40.0, 1.0), (300.0, 0.5), (1_200.0, 1.5)] {
        let articulation = Articulation { fall_cents, fall_s, ..Articulation::default() };
        for written in [55, 67, 79] {
            for settings in [still(articulation), machine(articulation)] {
                let mut clarinet = clarinet(&settings);
                let end_s = 1.0 + f64::from(fall_s);
                let sound = played(&mut clarinet, &[on(0.0, written), off(1.0, written)], end_s - 0.05, 512);
                let more = played(&mut clarinet, &[], 0.05, 512);
                assert!(!clarinet.is_resting());
                let rest = played(&mut clarinet, &[], 0.25, 512);
                assert!(clarinet.is_resting(), "{written}: the player rests after the fall");
                let tail = played(&mut clarinet, &[], Clarinet::TAIL_S + articulation.tail_s(), 512);
                assert!(clarinet.is_silent());
                let sound: Vec<f64> = [sound, more, rest, tail].concat().into_iter().map(f64::from).collect();
                let note_hz = fundamental_hz(part(&sound, 0.5, 1.0), RATE_HZ).unwrap();
                // Near its end the way is flat: over these 60 ms it changes by less than 4 %.
                let deepest = pitch_cents(part(&sound, end_s - 0.06, end_s), note_hz);
                let level = |at_s: f64| level_db(part(&sound, at_s, at_s + 0.05));
                let [note, half, last, after] =
                    [0.9, 1.0 + 0.5 * f64::from(fall_s), end_s - 0.06, end_s + 0.6].map(level);
                println!(
                    "{written}, {fall_cents} cents: {deepest:.1}, {:.1} dB half way, {:.1} at the end, then {:.1}",
                    half - note,
                    last - note,
                    after - note
                );
                let asked = -f64::from(fall_cents);
                // A machine's note rises as it fades, because nobody holds its pitch.
                let free = if settings.tuning == Tuning::Natural { 15.0 } else { 3.0 };
                let off = (deepest - asked).abs();
                assert!(off < free + 0.05 * f64::from(fall_cents), "{written}: {deepest} cents");
                assert!(last > note - 45.0 && last < note - 1.0, "{written}: {note} to {last} dB");
                assert!(half < note && half > last, "{written}: {note}, {half}, {last} dB");
                assert!(after < note - 60.0, "{written}: {after} dB");
            }
        }
    }
}

#[test]
fn after_a_fall_the_next_note_is_in_tune_and_a_choke_cuts_it() {
    let articulation = Articulation { fall_cents: 600.0, fall_s: 1.0, ..Articulation::default() };
    let events = [on(0.0, 67), off(0.5, 67), on(1.0, 72), off(1.6, 72)];
    let mut clarinet = clarinet(&still(articulation));
    let sound: Vec<f64> = played(&mut clarinet, &events, 1.8, 512).into_iter().map(f64::from).collect();
    let pitch = pitch_cents(part(&sound, 1.1, 1.5), hz(72));
    assert!(pitch.abs() < 3.0, "{pitch}");
    clarinet.apply(Event::Choke { note: sounding(72) });
    played(&mut clarinet, &[], 0.3, 512);
    assert!(clarinet.is_resting() && clarinet.is_silent());
}

const MEZZO_FORTE: f32 = 0.5;

/// A phrase until 1 s, and then a rest.
fn phrase() -> [(f64, Event); 5] {
    [(0.0, Event::Breath(MEZZO_FORTE)), on(0.1, 67), on(0.5, 69), off(0.9, 67), off(1.0, 69)]
}

#[test]
fn the_breath_in_is_heard_after_a_phrase_alone_and_ends() {
    let with = |breath_in: f32| Articulation { breath_in, ..Articulation::default() };
    let sound = |breath_in: f32| heard(&still(with(breath_in)), &phrase(), 3.0);
    let (none, full, half) = (sound(0.0), sound(1.0), sound(0.5));
    let note = level_db(part(&none, 0.6, 0.9));
    let air =
        |sound: &[f64]| -> Vec<f64> { sound.iter().zip(&none).map(|(with, none)| with - none).collect() };
    let (air, soft) = (air(&full), air(&half));
    assert!(part(&air, 0.0, 1.2).iter().all(|x| x.abs() < 1e-6), "the phrase stays as it is");
    let loudest = |air: &[f64]| air.chunks(sample(0.05)).map(level_db).fold(f64::NEG_INFINITY, f64::max);
    let below = loudest(part(&air, 1.2, 2.0)) - note;
    println!("the breath in is {below:.1} dB re mezzo-forte");
    assert!((-45.0..-37.0).contains(&below), "{below} dB");
    assert!((loudest(part(&air, 1.2, 2.0)) - loudest(part(&soft, 1.2, 2.0)) - 6.02).abs() < 0.1);
    let heard = moving_rms(&air, RATE_HZ, 0.02);
    let loud = 0.05 * heard.iter().copied().fold(0.0, f64::max);
    let first = heard.iter().position(|&x| x > loud).unwrap() as f64 / RATE_HZ;
    let last = heard.iter().rposition(|&x| x > loud).unwrap() as f64 / RATE_HZ;
    assert!((1.24..1.45).contains(&first) && (0.3..0.5).contains(&(last - first)), "{first} to {last} s");
    assert!(part(&air, 2.0, 3.0).iter().all(|x| x.abs() < 1e-6), "once");
}

#[test]
fn the_player_does_not_rest_until_the_breath_has_come_in() {
    let articulation = Articulation { breath_in: 1.0, ..Articulation::default() };
    let mut clarinet = clarinet(&still(articulation));
    played(&mut clarinet, &[], 0.5, 512);
    assert!(clarinet.is_silent(), "no phrase, no breath");
    played(&mut clarinet, &phrase(), 1.2, 64);
    let (mut rested_s, mut seconds) = (None, 0.2);
    while !clarinet.is_silent() {
        assert!(seconds < Clarinet::TAIL_S + articulation.tail_s());
        played(&mut clarinet, &[], 0.01, 64);
        seconds += 0.01;
        if clarinet.is_resting() {
            rested_s = rested_s.or(Some(seconds));
        }
    }
    assert!((0.65..1.0).contains(&rested_s.unwrap()), "{rested_s:?} s after the last key");
}

/// Everything at once.
fn all() -> Articulation {
    Articulation {
        scoop_cents: 120.0,
        scoop_s: 0.1,
        fall_cents: 500.0,
        fall_s: 0.2,
        breath_in: 1.0,
        key_sounds: 1.0,
        slap: 0.6,
    }
}

#[test]
fn the_sound_does_not_depend_on_the_blocks() {
    let settings = Settings { articulation: all(), ..Settings::default() };
    let events =
        [on(0.01, 60), on(0.2, 67), off(0.3, 60), off(0.35, 67), on(1.4, 72), off(1.45, 72), on(1.5, 64)];
    let [large, small, one] = [512, 17, 1].map(|block| played(&mut clarinet(&settings), &events, 1.8, block));
    assert!(large == small && large == one);
    assert!(large.iter().all(|x| x.abs() <= 1.0));
}

#[test]
fn without_amounts_times_change_nothing() {
    let events = [on(0.01, 60), on(0.2, 67), off(0.3, 60), off(0.35, 67), on(0.5, 72)];
    let times = Articulation { scoop_s: 1.0, fall_s: 2.0, ..Articulation::default() };
    let sounds = [Settings::default(), Settings { articulation: times, ..Settings::default() }]
        .map(|settings| played(&mut clarinet(&settings), &events, 0.8, 512));
    assert_eq!(sounds[0], sounds[1]);
    assert_eq!(times.tail_s(), 0.0);
}

#[test]
fn another_instrument_goes_on_with_the_scoop_and_the_breath() {
    let settings = still(Articulation { fall_cents: 0.0, scoop_s: 0.6, ..all() });
    let mut from = clarinet(&settings);
    played(&mut from, &[on(0.0, 67)], 0.05, 512);
    let mut other = clarinet(&settings);
    other.carry_on(&from);
    let sound: Vec<f64> = played(&mut other, &[], 1.0, 512).into_iter().map(f64::from).collect();
    assert!(pitch_cents(part(&sound, 0.05, 0.11), hz(67)) < -90.0);
    assert!(
        refine_hz(part(&sound, 0.7, 1.0), RATE_HZ, hz(67))
            .is_some_and(|pitch| cents(pitch, hz(67)).abs() < 3.0)
    );
    other.apply(Event::NoteOff { note: sounding(67) });
    played(&mut other, &[], 0.4, 512);
    assert!(!other.is_resting());
    let mut third = clarinet(&settings);
    third.carry_on(&other);
    assert!(!third.is_resting());
    played(&mut third, &[], 1.0, 512);
    assert!(third.is_resting());
}

#[test]
fn a_slap_begins_a_tongued_note_and_the_note_goes_on() {
    let events = [on(0.0, 55), on(0.6, 57), off(0.65, 55), off(1.2, 57)];
    let [with, without] = [1.0, 0.0].map(|slap| {
        let articulation = Articulation { slap, ..Articulation::default() };
        heard(&still(articulation), &events, 1.5)
    });
    let highest = |sound: &[f64]| sound.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let louder_db = |from_s, to_s| {
        20.0 * (highest(part(&with, from_s, to_s)) / highest(part(&without, from_s, to_s))).log10()
    };
    let (first, held, slurred) = (louder_db(0.0, 0.03), louder_db(0.4, 0.6), louder_db(0.6, 0.63));
    println!("the first 30 ms {first:+.1} dB, the held note {held:+.1}, a slurred beginning {slurred:+.1}");
    assert!(first > 12.0, "{first} dB");
    assert!(held.abs() < 0.5 && slurred.abs() < 0.5, "{held} and {slurred} dB");
    assert!(pitch_cents(part(&with, 0.4, 0.6), hz(55)).abs() < 5.0);
    // Struck softly it is softer.
    let of = |velocity| {
        let mut clarinet = clarinet(&still(Articulation { slap: 1.0, ..Articulation::default() }));
        let note = Event::NoteOn { note: sounding(55), velocity };
        let sound = played(&mut clarinet, &[(0.0, Event::Breath(0.0)), (0.0, note)], 0.1, 512);
        sound.iter().fold(0.0_f32, |most, x| most.max(x.abs()))
    };
    assert!(of(1.0) > 2.0 * of(0.25) && of(0.25) > 1e-4, "{} {}", of(1.0), of(0.25));
}

#[test]
fn numbers_out_of_range_are_clamped_where_they_come_in() {
    let mut clarinet = clarinet(&Settings::default());
    let numbers = [
        (SettingNumber::ScoopCents, [0.0, 300.0]),
        (SettingNumber::ScoopS, [0.02, 1.0]),
        (SettingNumber::FallCents, [0.0, 1_200.0]),
        (SettingNumber::FallS, [0.05, 2.0]),
        (SettingNumber::BreathIn, [0.0, 1.0]),
        (SettingNumber::KeySounds, [0.0, 1.0]),
        (SettingNumber::Slap, [0.0, 1.0]),
    ];
    for (number, ends) in numbers {
        for (asked, end) in [-1e9, 1e9].into_iter().zip(ends) {
            clarinet.apply(Event::Set(number, asked));
            clarinet.apply(Event::Set(number, asked));
            let mut wild = Settings::default();
            *wild.number(number) = asked;
            assert_eq!(*wild.clamped().number(number), end, "{number:?}");
            *wild.number(number) = f32::NAN;
            assert_eq!(wild.clamped(), Settings::default());
        }
    }
    let sound = played(&mut clarinet, &[on(0.0, 60), off(0.5, 60)], 4.0, 512);
    assert!(sound.iter().all(|x| x.abs() <= 1.0));
    assert_eq!(clarinet.resets(), 0);
}

/// The tongue that prepares a note has not let go of the reed when such a key comes up: landing on it then would be a click, six
/// times as loud as the note.
#[test]
fn a_key_that_hardly_goes_down_plays_a_short_note_and_no_click() {
    let breath = (0.0, Event::Breath(0.6));
    for settings in [still(Articulation::default()), machine(Articulation::default())] {
        let peak = |seconds: f64| {
            let events = [breath, on(0.3, 60), off(0.3 + seconds, 60)];
            heard(&settings, &events, 0.6).into_iter().map(f64::abs).fold(0.0, f64::max)
        };
        let long = peak(0.1);
        for ms in [0.0, 1.0, 2.0, 4.0, 7.0, 8.0, 9.0, 10.0, 12.0, 15.0, 20.0] {
            let short = peak(1e-3 * ms);
            assert!(short < 1.1 * long && short > 0.02 * long, "{ms} ms: {short}, a note of 0.1 s: {long}");
        }
    }
}

/// Above the break a note takes longer to speak than such a key is down.
#[test]
fn a_short_key_is_about_as_loud_as_a_long_one() {
    let mut shorts = Vec::new();
    for note in (50..=90).map(SoundingNote) {
        for velocity in [0.25, 0.6, 0.9] {
            let loudest = |seconds: f64| {
                let key = [(0.1, Event::NoteOn { note, velocity }), (0.1 + seconds, Event::NoteOff { note })];
                let sound = heard(&still(Articulation::default()), &key, 0.5);
                let power = |part: &[f64]| part.iter().map(|x| x * x).sum::<f64>() / part.len() as f64;
                10.0 * sound.windows(384).step_by(48).map(power).fold(1e-30, f64::max).log10()
            };
            let long = loudest(0.3);
            for ms in [1.0, 10.0, 30.0, 50.0] {
                let short = loudest(1e-3 * ms) - long;
                shorts.push(short.abs());
                assert!(short.abs() < 9.0, "{note:?}, velocity {velocity}, {ms} ms: {short:.1} dB");
            }
        }
    }
    shorts.sort_by(f64::total_cmp);
    let [half, tenth] = [shorts[shorts.len() / 2], shorts[shorts.len() * 9 / 10]];
    assert!(half < 1.5 && tenth < 3.0, "half within {half:.1} dB, nine tenths within {tenth:.1}");
}

/// The tongue lets go of a reed on which no pressure rests so slowly that the air column does not pop.
#[test]
fn keys_without_breath_are_silent() {
    let gesture = |breath: f32, every_s: f64| {
        let mut events = vec![(0.0, Event::Breath(0.5)), (0.05, Event::Breath(breath))];
        for (nth, key) in [52, 60, 69, 79, 84].into_iter().enumerate() {
            let begun = 0.3 + every_s * nth as f64;
            events.extend([on(begun, key), off(begun + 0.2, key)]);
        }
        let sound = heard(&still(Articulation::default()), &events, 1.9);
        20.0 * sound[12_000..].iter().fold(0.0_f64, |most, x| most.max(x.abs())).log10()
    };
    // So close, too, that the tongue has hardly come back.
    for every_s in [0.3, 0.22, 0.202] {
        let (blown, not_blown) = (gesture(0.5, every_s), gesture(0.0, every_s));
        assert!(not_blown < blown - 40.0, "every {every_s} s: {not_blown:.1} and {blown:.1} dB");
    }
}

/// A key that has come up without breath plays nothing, whenever breath comes.
#[test]
fn breath_after_a_key_has_come_up_plays_nothing() {
    for tongue_ms in [1.0, 2.0, 20.0] {
        for blown_s in [0.02, 0.05, 0.1, 0.2, 1.0] {
            let settings = Settings { tongue_ms, ..still(Articulation::default()) };
            let events = [
                (0.0, Event::Breath(0.5)),
                (0.02, Event::Breath(0.0)),
                on(0.3, 60),
                off(0.31, 60),
                (0.31 + blown_s, Event::Breath(0.7)),
            ];
            let sound = heard(&settings, &events, 0.31 + blown_s + 0.5);
            let most = sound[sample(0.31)..].iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            assert!(most < 3e-3, "tongue {tongue_ms} ms, breath after {blown_s} s: {most}");
        }
    }
}
