use super::*;
use sounds::{Noise, RATE_HZ, blow, music, room, sequence, sound, speech, tone};

mod sounds;

/// A meter that has measured the quiet room.
fn calibrated() -> WindMeter {
    let mut meter = WindMeter::new(WindCoeffs::new(RATE_HZ), WindDesign::default());
    meter.calibrate();
    for &sample in &room(CALIBRATION_S + 0.1, 1) {
        meter.tick(sample);
    }
    assert!(!meter.is_calibrating());
    meter
}

/// The breath at each decision.
fn heard(samples: &[f32]) -> Vec<f32> {
    let mut meter = calibrated();
    samples.iter().filter_map(|&sample| meter.tick(sample)).collect()
}

fn at(seconds: f64) -> usize {
    (seconds / STEP_S) as usize
}

fn mean(breath: &[f32]) -> f32 {
    breath.iter().sum::<f32>() / breath.len() as f32
}

fn blown(breath: &[f32]) -> f64 {
    breath.iter().filter(|&&unit| unit > 0.02).count() as f64 / breath.len() as f64
}

fn most(breath: &[f32]) -> f32 {
    breath.iter().fold(0.0, |most, &unit| unit.max(most))
}

#[test]
fn wind_blows_near_and_far_from_a_wide_or_a_narrow_mouth() {
    for corner_hz in [60.0, 150.0, 400.0] {
        for level in [0.04, 0.25] {
            let breath = heard(&sequence(&[&blow(1.5, corner_hz, level)]));
            let begins = STEP_S * breath.iter().position(|&unit| unit > 0.02).unwrap() as f64;
            assert!(begins < 0.25, "{corner_hz} Hz, {level}: begins after {begins} s");
            assert!(blown(&breath) > 0.8, "{corner_hz} Hz, {level}: {}", blown(&breath));
        }
    }
}

#[test]
fn harder_is_more_and_it_ends() {
    let swell = heard(&sequence(&[&blow(1.0, 150.0, 0.03), &blow(1.0, 150.0, 0.3)]));
    let (soft, hard) = (mean(&swell[at(0.5)..at(0.8)]), mean(&swell[at(1.5)..at(1.8)]));
    assert!(soft + 0.25 < hard, "{soft} and {hard}");
    let ends = heard(&sequence(&[&blow(0.5, 150.0, 0.25), &room(0.5, 3)]));
    assert_eq!(ends.last(), Some(&0.0));
}

/// The clarinet's odd partials.
fn own(hz: f64, level: f64) -> Vec<f32> {
    tone(1.5, hz, level, 9, 2)
}

/// Wind, and the clarinet that it has begun 0.2 s later.
fn beside(wind: &[f32], own: &[f32]) -> Vec<f32> {
    let begins = (0.2 * RATE_HZ) as usize;
    wind.iter().zip(own).enumerate().map(|(n, (x, own))| if n > begins { x + own } else { *x }).collect()
}

#[test]
fn the_clarinet_from_a_loudspeaker_does_not_end_a_blow_and_begins_none() {
    for hz in [147.0, 233.0, 466.0] {
        let both = heard(&sequence(&[&beside(&blow(1.5, 150.0, 0.25), &own(hz, 0.1))]));
        assert!(blown(&both) > 0.8, "{hz} Hz: {}", blown(&both));
        assert_eq!(most(&heard(&sequence(&[&own(hz, 0.1)]))), 0.0, "{hz} Hz alone");
    }
}

#[test]
fn the_clarinet_does_not_blow_itself_where_it_comes_back_as_loud_as_the_wind() {
    let soft = blow(1.5, 150.0, 0.1);
    let late = |samples: &[f32]| mean(&heard(&sequence(&[samples]))[at(0.5)..at(1.3)]);
    let (alone, beside) = (late(&soft), late(&beside(&soft, &own(233.0, 0.08))));
    assert!(beside < alone + 0.2 && beside > 0.05, "{alone} alone, {beside} beside its own sound");
}

#[test]
fn a_minute_of_speech_does_not_play() {
    for (voice_hz, seed) in [(100.0, 11), (125.0, 22), (180.0, 33), (230.0, 44)] {
        let breath = heard(&sequence(&[&speech(15.0, voice_hz, seed)]));
        assert!(breath.len() >= at(15.0));
        assert_eq!(most(&breath), 0.0, "a voice at {voice_hz} Hz");
    }
}

#[test]
fn who_speaks_at_the_end_of_a_blow_does_not_go_on_blowing() {
    for (voice_hz, seed) in [(110.0, 5), (160.0, 6), (220.0, 7)] {
        let breath = heard(&sequence(&[&blow(0.8, 150.0, 0.25), &speech(3.0, voice_hz, seed)]));
        assert_eq!(most(&breath[at(1.3)..]), 0.0, "{voice_hz} Hz");
    }
}

#[test]
fn a_minute_of_music_does_not_play() {
    for seed in [1, 2, 3, 4] {
        assert_eq!(most(&heard(&sequence(&[&music(15.0, seed)]))), 0.0, "{seed}");
    }
}

#[test]
fn singing_a_whistle_a_louder_room_and_clicks_do_not_play() {
    let mut noise = Noise::new(9);
    let clicks = sound(2.0, |n| if n % 6_000 < 200 { 0.3 * noise.next() } else { 0.0 });
    let louder: Vec<f32> = room(2.0, 5).iter().map(|x| 2.0 * x).collect();
    let others = [
        ("voice", tone(1.0, 130.0, 0.2, 20, 1)),
        ("whistle", tone(1.0, 1_200.0, 0.2, 1, 1)),
        ("room", louder),
        ("clicks", clicks),
    ];
    for (name, samples) in others {
        assert_eq!(most(&heard(&sequence(&[&samples]))), 0.0, "{name}");
    }
}

#[test]
fn wind_is_heard_at_every_rate_of_a_host() {
    // The same samples, at a lower rate: the wind of a wider mouth, and of a narrower one.
    for rate_hz in [22_050.0, 44_100.0, 96_000.0, 192_000.0] {
        let mut meter = WindMeter::new(WindCoeffs::new(rate_hz), WindDesign::default());
        let samples = blow(2.0 * rate_hz / RATE_HZ, 150.0 * RATE_HZ / rate_hz, 0.25);
        let breath: Vec<f32> = samples.iter().filter_map(|&sample| meter.tick(sample)).collect();
        assert!(blown(&breath) > 0.8, "{rate_hz} Hz: {}", blown(&breath));
    }
}

#[test]
fn a_loud_room_is_measured_and_needs_a_stronger_wind() {
    let fan: Vec<f32> = room(4.0, 8).iter().map(|x| 30.0 * x).collect();
    let mut meter = WindMeter::new(WindCoeffs::new(RATE_HZ), WindDesign::default());
    meter.calibrate();
    for sample in fan {
        meter.tick(sample);
    }
    // Uniform noise of this amplitude has its amplitude over the square root of 3.
    let expected = 20.0 * (30.0 * 6e-4 / 3.0_f64.sqrt()).log10();
    let floor = f64::from(meter.design().floor_dbfs);
    assert!((floor - expected).abs() < 1.5, "{floor}, not {expected}");
    assert_eq!(WindDesign { floor_dbfs: f32::NAN }.clamped(), WindDesign::default());
    assert_eq!(WindDesign { floor_dbfs: 7.0 }.clamped().floor_dbfs, MOST_FLOOR_DBFS);
}

#[test]
fn what_is_no_sound_is_no_wind_and_leaves_no_trace() {
    let mut meter = calibrated();
    for bad in [f32::NAN, f32::INFINITY, -1e30, f32::MIN_POSITIVE / 2.0] {
        meter.tick(bad);
    }
    let breath: Vec<f32> =
        sequence(&[&room(1.0, 2), &blow(1.5, 150.0, 0.25)]).iter().filter_map(|&x| meter.tick(x)).collect();
    assert!(breath.iter().all(|unit| unit.is_finite()) && blown(&breath[at(1.0)..]) > 0.8);
}

#[test]
fn a_microphone_that_gives_nothing_but_zeros_is_not_there() {
    let mut meter = WindMeter::new(WindCoeffs::new(RATE_HZ), WindDesign::default());
    for _ in 0..10_000 {
        meter.tick(0.0);
    }
    assert!(!meter.is_there());
    meter.tick(1e-4);
    assert!(meter.is_there());
    meter.reset();
    assert!(!meter.is_there());
}
