//! What keyboards and projects send, in the bundled CLAP: pedal, volume, pan, and every controller at the start.

use chalumeau_core::event::{Event, Timed};
use chalumeau_core::instrument::Clarinet;
use chalumeau_core::instrument::stereo::Stereo;
use chalumeau_core::units::SoundingNote;
use chalumeau_test_host::clap::{At, NoteExpressionType, Plugin, Say, Stereo as Channels};

const RATE: f64 = 48_000.0;
const SECOND: usize = 48_000;
const BLOCKS: [usize; 4] = [1, 64, 512, 4096];

fn play(block: usize, said: &[At], samples: usize) -> Channels {
    let path = chalumeau_test_host::artefacts::clap().unwrap();
    Plugin::load(&path).unwrap().play(RATE, block, said, samples).unwrap()
}

/// What instrument and pan make of the same events.
fn rendered(events: &[(usize, Event)], samples: usize) -> Channels {
    let [mut left, mut right] = [vec![0.0; samples], vec![0.0; samples]];
    let events = events.iter().map(|&(at, event)| Timed { at, event });
    let mut stereo = Stereo::new(RATE);
    events.clone().for_each(|event| stereo.heed(&event));
    Clarinet::built_in(RATE).unwrap().render_events(events, &mut left);
    stereo.spread(&mut left, &mut right);
    [left, right]
}

fn cc(controller: u8, value: u8) -> Say {
    Say::Midi([0xB0, controller, value])
}

fn on(key: u8, velocity: u8) -> Say {
    Say::Midi([0x90, key, velocity])
}

fn off(key: u8) -> Say {
    Say::Midi([0x80, key, 0])
}

fn struck(key: u8, velocity: u8) -> Event {
    Event::NoteOn { note: SoundingNote(key), velocity: f32::from(velocity) / 127.0 }
}

fn released(key: u8) -> Event {
    Event::NoteOff { note: SoundingNote(key) }
}

fn level_db(samples: &[f32]) -> f64 {
    let power: f64 = samples.iter().map(|&x| f64::from(x).powi(2)).sum();
    10.0 * (power / samples.len() as f64).max(1e-30).log10()
}

/// All controllers of all channels, once each, pressure too, as some hosts begin a project.
fn every_controller(at: usize, value: impl Fn(u8) -> u8) -> Vec<At> {
    let of_channel = |channel: u8| {
        let value = &value;
        let controllers = (0..128).map(move |number| Say::Midi([0xB0 | channel, number, value(number)]));
        controllers.chain([Say::Midi([0xD0 | channel, value(2), 0])])
    };
    (0..16).flat_map(of_channel).map(|say| At(at, say)).collect()
}

#[test]
fn after_a_start_that_sends_every_controller_the_first_key_sounds_by_velocity() {
    let values: [fn(u8) -> u8; 4] = [|_| 0, |_| 64, |_| 127, |number| number];
    for value in values {
        for times in [1, 2] {
            for velocity in [30, 120] {
                let mut said = every_controller(0, value);
                // CC120 is among them, and it is meant.
                let mut events = vec![(0, Event::Panic)];
                if times == 2 {
                    said.extend(every_controller(256, |number| 127 - value(number)));
                    events.push((256, Event::Panic));
                }
                said.extend([At(1_000, on(58, velocity)), At(30_000, off(58))]);
                events.extend([(1_000, struck(58, velocity)), (30_000, released(58))]);
                assert!(play(512, &said, SECOND) == rendered(&events, SECOND), "{} {velocity}", value(2));
            }
        }
    }
}

#[test]
fn who_blows_after_such_a_start_is_heard() {
    let mut said = every_controller(0, |_| 64);
    said.extend((0..60).map(|step| At(2_000 + 100 * step, cc(2, step as u8))));
    said.push(At(1_990, on(58, 100)));
    said.sort_by_key(|At(at, _)| *at);
    let blown = (0..60).map(|step| (2_000 + 100 * step, Event::Breath(step as f32 / 127.0)));
    let events: Vec<_> = [(0, Event::Panic), (1_990, struck(58, 100))].into_iter().chain(blown).collect();
    assert!(play(512, &said, SECOND) == rendered(&events, SECOND));
}

#[test]
fn expression_at_full_is_no_breath_and_one_value_of_cc2_is() {
    let file = [(0, 7, 127), (0, 10, 64), (0, 11, 127), (0, 91, 40)];
    let mut said: Vec<_> = file.map(|(at, number, value)| At(at, cc(number, value))).into();
    said.push(At(100, on(58, 40)));
    assert!(play(512, &said, SECOND / 2) == rendered(&[(100, struck(58, 40))], SECOND / 2));
    let said = [At(0, cc(2, 64)), At(100, on(58, 40))];
    let events = [(0, Event::Breath(64.0 / 127.0)), (100, struck(58, 40))];
    assert!(play(512, &said, SECOND / 2) == rendered(&events, SECOND / 2));
}

#[test]
fn volume_is_the_square_of_cc7_and_does_not_jump() {
    let held = [At(0, on(58, 100))];
    let [plain, _] = play(512, &held, SECOND);
    for value in [127, 100, 64, 20] {
        let [quiet, _] = play(512, &[At(0, cc(7, value)), held[0]], SECOND);
        let change_db = level_db(&quiet[SECOND / 2..]) - level_db(&plain[SECOND / 2..]);
        let wanted_db = 40.0 * (f64::from(value) / 127.0).log10();
        assert!((change_db - wanted_db).abs() < 0.01, "{value}: {change_db} dB, not {wanted_db}");
    }
    let [silent, _] = play(512, &[held[0], At(24_000, cc(7, 0))], SECOND);
    assert!(silent[24_000 + 480..].iter().all(|&sample| sample == 0.0), "10 ms later");
    let step = |sound: &[f32]| sound.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max);
    assert!(step(&silent[24_000..24_480]) <= 1.05 * step(&silent[12_000..24_000]), "no click");
}

#[test]
fn pan_has_constant_power_and_leaves_the_middle_alone() {
    let held = At(0, on(58, 100));
    let [plain, same] = play(512, &[held], SECOND);
    assert!(plain == same);
    assert!(play(512, &[At(0, cc(10, 64)), held], SECOND) == [plain.clone(), same]);
    let power = |samples: &[f32]| samples.iter().map(|&x| f64::from(x).powi(2)).sum::<f64>();
    let whole = 2.0 * power(&plain[SECOND / 2..]);
    for value in [0, 32, 64, 100, 127] {
        let [left, right] = play(512, &[At(0, cc(10, value)), held], SECOND);
        let sides = [power(&left[SECOND / 2..]), power(&right[SECOND / 2..])];
        assert!((10.0 * ((sides[0] + sides[1]) / whole).log10()).abs() < 0.01, "{value}: {sides:?}");
        let angle = (value.max(1) - 1) as f64 / 126.0;
        assert!(
            (sides[1] / (sides[0] + sides[1]) - (angle * 90_f64.to_radians()).sin().powi(2)).abs() < 1e-3
        );
    }
}

#[test]
fn mix_and_pedal_are_sample_accurate_in_every_block_size() {
    let express = |kind, value| Say::Express(58, kind, value);
    let said = [
        At(0, on(58, 100)),
        At(5_003, cc(7, 90)),
        At(7_001, cc(10, 20)),
        At(9_999, cc(64, 127)),
        At(12_345, off(58)),
        At(15_000, express(NoteExpressionType::Volume, 0.5)),
        At(16_001, express(NoteExpressionType::Pan, 1.0)),
        At(20_000, on(62, 100)),
        At(24_000, off(62)),
        At(30_001, cc(64, 0)),
    ];
    let gain = (90.0_f32 / 127.0).powi(2);
    let position = 19.0 / 63.0 - 1.0;
    let events = [
        (0, struck(58, 100)),
        (5_003, Event::Volume { gain }),
        (7_001, Event::Pan { position }),
        (15_000, Event::Volume { gain: 0.5 * gain }),
        (16_001, Event::Pan { position: position + 1.0 }),
        (20_000, Event::Volume { gain }),
        (20_000, Event::Pan { position }),
        (20_000, struck(62, 100)),
        (20_000, released(58)),
        (30_001, released(62)),
    ];
    let wanted = rendered(&events, SECOND);
    assert!(level_db(&wanted[0][25_000..30_000]) > -40.0, "the pedal holds");
    assert!(level_db(&wanted[0][SECOND - 4_096..]) < -60.0, "and lets go");
    for block in BLOCKS {
        assert!(play(block, &said, SECOND) == wanted, "blocks of {block}");
    }
}
