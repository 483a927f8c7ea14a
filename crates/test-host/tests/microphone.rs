//! The bundled CLAP with a microphone at its side-chain.

#[path = "support/rules.rs"]
mod rules;
#[path = "support/wind.rs"]
mod wind;

use chalumeau_test_host::clap::{At, Plugin, ProcessStatus, Say, Stereo};
use rules::plugin;
use wind::{RATE, SECOND, quiet, wind};

const ON: At = At(2_000, Say::Midi([0x90, 60, 100]));

fn peak(sound: &[f32]) -> f32 {
    sound.iter().fold(0.0, |peak, x| peak.max(x.abs()))
}

/// A plugin whose microphone is on, or not.
fn hearing(is_on: bool) -> Plugin {
    let mut plugin = plugin();
    let id = plugin.param("Microphone").unwrap().id;
    plugin.set(id, f64::from(u8::from(is_on))).unwrap();
    plugin
}

/// What it plays of these events beside what its side-chain gives.
fn play(
    plugin: &mut Plugin,
    block: usize,
    said: &[At],
    side_chain: Option<Vec<f32>>,
    samples: usize,
) -> Stereo {
    let body = |session: &mut chalumeau_test_host::clap::Session| {
        if let Some(samples) = side_chain {
            session.connect(samples);
        }
        session.play(said, samples).unwrap()
    };
    plugin.session(RATE, block, body).unwrap()
}

#[test]
fn wind_blows_a_held_key_and_its_end_is_silence() {
    let blown = [quiet(SECOND / 2), wind(SECOND), quiet(2 * SECOND)].concat();
    let [left, _] = play(&mut hearing(true), 256, &[ON], Some(blown), 3 * SECOND);
    // Before the wind the key has no breath, whatever its velocity; only the tongue is heard.
    let before = peak(&left[SECOND / 4..SECOND / 2]);
    assert!(before < 1e-3, "{before}");
    let sounding = peak(&left[SECOND..3 * SECOND / 2]);
    assert!(sounding > 0.02, "{sounding}");
    let after = peak(&left[5 * SECOND / 2..]);
    assert!(after < 1e-3, "{after}");
}

#[test]
fn blocks_of_any_size_give_the_same_bits() {
    let calibrate = plugin().param("Calibrate microphone").unwrap().id;
    let said = [
        ON,
        At(9_000, Say::Midi([0xB0, 2, 90])),
        // While it blows, and so that the next wind begins after it.
        At(40_001, Say::Set(calibrate, 1.0)),
        At(140_000, Say::Midi([0x90, 64, 100])),
    ];
    let blown = [quiet(10_000), wind(30_000), quiet(100_000), wind(SECOND)].concat();
    let whole = play(&mut hearing(true), 4 * SECOND, &said, Some(blown.clone()), 4 * SECOND);
    assert!(peak(&whole[0][24_000..40_000]) > 0.02 && peak(&whole[0][160_000..]) > 0.02);
    for block in [1, 17, 240, 4_096] {
        let cut = play(&mut hearing(true), block, &said, Some(blown.clone()), 4 * SECOND);
        assert!(cut == whole, "blocks of {block}");
    }
}

#[test]
fn off_or_with_nothing_connected_it_plays_as_without_a_microphone() {
    let said = [ON, At(20_000, Say::Midi([0xB0, 2, 90]))];
    let plain = play(&mut plugin(), 512, &said, None, SECOND);
    assert!(peak(&plain[0]) > 0.02);
    for (is_on, side_chain) in [(false, Some(wind(SECOND))), (true, None), (true, Some(vec![0.0; SECOND]))] {
        let what = format!("on: {is_on}, connected: {}", side_chain.is_some());
        assert!(play(&mut hearing(is_on), 512, &said, side_chain, SECOND) == plain, "{what}");
    }
}

#[test]
fn switched_off_it_gives_the_breath_back_to_the_keys() {
    let mut plugin = hearing(true);
    let id = plugin.param("Microphone").unwrap().id;
    let said = [At(0, Say::Set(id, 0.0)), ON];
    plugin
        .session(RATE, 256, |session| {
            session.connect([quiet(SECOND / 4), wind(SECOND)].concat());
            session.play(&[], SECOND).unwrap();
            let [left, _] = session.play(&said, SECOND).unwrap();
            assert!(peak(&left[SECOND / 2..]) > 0.02, "by its velocity");
        })
        .unwrap();
}

#[test]
fn a_room_that_was_measured_is_saved_and_the_next_session_needs_a_stronger_wind() {
    let mut plugin = hearing(true);
    let calibrate = plugin.param("Calibrate microphone").unwrap().id;
    let noisy: Vec<f32> = quiet(3 * SECOND).iter().map(|x| 100.0 * x).collect();
    let soft: Vec<f32> = wind(SECOND).iter().map(|x| 0.3 * x).collect();
    let heard = |plugin: &mut Plugin| {
        let [left, _] = play(plugin, 256, &[ON], Some(soft.clone()), SECOND);
        peak(&left[SECOND / 4..])
    };
    assert!(heard(&mut plugin) > 0.02);
    plugin
        .session(RATE, 256, |session| {
            session.connect(noisy);
            session
                .play(&[At(0, Say::Set(calibrate, 1.0)), At(300, Say::Midi([0x90, 60, 100]))], 3 * SECOND)
                .unwrap();
        })
        .unwrap();
    assert_eq!(plugin.value(calibrate).unwrap(), 0.0);
    let saved = plugin.save().unwrap();
    let mut later = hearing(false);
    later.restore(&saved).unwrap();
    for one in [&mut plugin, &mut later] {
        let silent = heard(one);
        assert!(silent < 1e-3, "{silent}");
    }
}

#[test]
fn it_listens_on_in_silence() {
    hearing(true)
        .session(RATE, 512, |session| {
            session.connect(quiet(2 * SECOND));
            session.play(&[], 2 * SECOND).unwrap();
            assert_eq!(session.status(), ProcessStatus::Continue);
        })
        .unwrap();
}
