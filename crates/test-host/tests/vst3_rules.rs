//! What VST3 hosts rely on beside events and sound: offline mode, expressions of notes, what the plugin tells its host. `cargo xtask
//! bundle` first.

#[path = "support/vst3_host.rs"]
mod vst3_host_support;
#[path = "support/wind.rs"]
mod wind;

use vst3_host::{AudioBuffers, BusDirection, HostNotification, MediaType, NoteExpressionType, ProcessMode};
use vst3_host_support::*;
use wind::{RATE, SECOND, quiet};

/// "ChalumeauMicroph".
const MICROPHONE: &str = "4368616C756D6561754D6963726F7068";

fn peak(sound: &[f32]) -> f32 {
    sound.iter().fold(0.0, |peak, x| peak.max(x.abs()))
}

#[test]
fn the_offline_mode_begins_with_the_render_and_ends_with_it() {
    const LENGTH: usize = SECOND / 4;
    let mut loaded = load(512);
    let quality = loaded.plugin.find_parameter("Offline quality").unwrap().id;
    let mut sound = |mode| {
        loaded.plugin.set_process_mode(mode).unwrap();
        loaded.plugin.start_processing().unwrap();
        loaded.plugin.set_parameter_at(quality, 1.0, 0).unwrap();
        let heard = play_on(&mut loaded, 512, &[(600, on(60))], LENGTH);
        loaded.plugin.stop_processing().unwrap();
        heard
    };
    let live = sound(ProcessMode::Realtime);
    let high = sound(ProcessMode::Offline);
    assert!(peak(&live) > 1e-3 && peak(&high) > 1e-3);
    assert!(high != live, "the bounce is of high quality");
    assert!(sound(ProcessMode::Offline) == high, "so is the next one");
    assert!(sound(ProcessMode::Realtime) == live, "what is played after it is not");
}

#[test]
fn a_volume_is_of_its_note_and_a_quarter_is_as_it_was() {
    let sound = |volume: Option<f64>| {
        let mut loaded = load(512);
        loaded.plugin.start_processing().unwrap();
        let id = loaded.plugin.note_on(CHANNEL, 62, 100).unwrap();
        if let Some(volume) = volume {
            loaded.plugin.send_note_expression(id, NoteExpressionType::Volume, volume).unwrap();
        }
        play_on(&mut loaded, 512, &[], SECOND / 2)
    };
    let plain = sound(None);
    assert!(plain == sound(Some(0.25)), "a quarter is a gain of 1");
    assert!(peak(&sound(Some(0.0))[SECOND / 4..]) < 1e-3 * peak(&plain));
    let loaded = load(512);
    let all = loaded.plugin.note_expressions().unwrap();
    let default = |kind| all.iter().find(|known| known.kind == kind).unwrap().default_value;
    assert_eq!(default(NoteExpressionType::Volume), 0.25, "what a host shows before anybody sets it");
    assert_eq!(default(NoteExpressionType::Pan), 0.5);
}

#[test]
fn what_falls_back_is_told_to_the_host() {
    let mut loaded = load(256);
    loaded.plugin.start_processing().unwrap();
    let panic = loaded.plugin.find_parameter("Panic").unwrap().id;
    let told = |loaded: &mut Loaded| -> Vec<f64> {
        let changes = loaded.plugin.get_parameter_changes();
        changes.into_iter().filter(|(id, _)| *id == panic).map(|(_, value)| value).collect()
    };
    play_on(&mut loaded, 256, &[(0, on(60))], SECOND / 8);
    assert!(told(&mut loaded).is_empty());
    for round in 0..2 {
        play_on(&mut loaded, 256, &[(100, Word::Set("Panic", 1.0))], 256);
        assert_eq!(told(&mut loaded), [0.0], "round {round}");
        play_on(&mut loaded, 256, &[], 512);
        assert!(told(&mut loaded).is_empty(), "once");
    }
}

#[test]
fn what_is_saved_and_no_parameter_marks_the_project_as_changed() {
    let _turn = turn();
    let mut loaded = load_class(256, Some(MICROPHONE));
    loaded.plugin.start_processing().unwrap();
    let dirty = |loaded: &mut Loaded| {
        let all = loaded.plugin.take_host_notifications();
        all.iter().filter(|told| matches!(told, HostNotification::DirtyChanged(true))).count()
    };
    loaded.input = quiet(4 * SECOND).iter().map(|x| 20.0 * x).collect();
    play_on(&mut loaded, 256, &[(0, Word::Set("Microphone", 1.0))], SECOND / 2);
    assert_eq!(dirty(&mut loaded), 0);
    play_on(&mut loaded, 256, &[(0, Word::Set("Calibrate microphone", 1.0))], 3 * SECOND);
    // Without a window the host's next call on its main thread brings it.
    loaded.plugin.stop_processing().unwrap();
    assert_eq!(dirty(&mut loaded), 1, "it has measured another room");
}

#[test]
fn a_microphone_whose_input_the_host_has_switched_off_plays_like_one_without_sound() {
    let _turn = turn();
    let sound = |is_active| {
        let mut loaded = load_class(256, Some(MICROPHONE));
        loaded.plugin.set_bus_active(MediaType::Audio, BusDirection::Input, 0, is_active).unwrap();
        loaded.plugin.start_processing().unwrap();
        play_on(&mut loaded, 256, &[(0, Word::Set("Microphone", 1.0)), (10, on(60))], SECOND / 4)
    };
    let active = sound(true);
    assert!(peak(&active) > 0.01);
    // The host gives null pointers for its channels.
    assert!(sound(false) == active);
}

#[test]
fn a_flush_of_events_does_not_wait_for_samples() {
    let mut loaded = load(256);
    loaded.plugin.start_processing().unwrap();
    play_on(&mut loaded, 256, &[(0, on(60))], SECOND / 2);
    let Word::Midi(event) = off(60) else { unreachable!() };
    loaded.plugin.send_midi_event_at(event, 0).unwrap();
    loaded.plugin.process_audio(&mut AudioBuffers::new(0, 2, 0, RATE)).unwrap();
    play_on(&mut loaded, 256, &[], SECOND);
    let rest = peak(&play_on(&mut loaded, 256, &[], SECOND / 4));
    assert!(rest < 1e-6, "{rest} sounds on");
}
