//! The bundled VST3, as a host sees and hears it. `cargo xtask bundle` first; CHALUMEAU_VST3 names another bundle.

#[path = "support/kept_melody.rs"]
mod kept_melody;
#[path = "support/vst3_host.rs"]
mod vst3_host_support;
#[path = "support/wind.rs"]
mod wind;

use chalumeau_core::event::{Event, Fingerings, Timed};
use chalumeau_core::instrument::{Clarinet, Settings};
use chalumeau_core::units::SoundingNote;
use chalumeau_test_host::clap::{At, Say};
use vst3_host::{AudioBuffers, MidiChannel, MidiEvent};
use vst3_host_support::*;
use wind::{RATE, SECOND, quiet, wind};

fn offline(events: &[(usize, Event)], samples: usize) -> Vec<f32> {
    let mut clarinet = Clarinet::built_in(RATE).unwrap();
    clarinet.set_settings(&Settings::default());
    let mut out = vec![0.0; samples];
    clarinet.render_events(events.iter().map(|&(at, event)| Timed { at, event }), &mut out);
    out
}

fn note_on(key: u8) -> Event {
    Event::NoteOn { note: SoundingNote(key), velocity: 100.0 / 127.0 }
}

#[test]
fn an_event_acts_at_its_sample() {
    for at in [612, 613, 1023, 1024, 1025] {
        let heard = play(512, &[(at, on(60))], SECOND / 4);
        assert!(heard == offline(&[(at, note_on(60))], SECOND / 4), "note at {at}");
    }
}

#[test]
fn controllers_pressure_and_wheel_reach_the_instrument() {
    let said = [
        (0, pressure(60)),
        (700, on(58)),
        (9_001, pressure(90)),
        (15_000, bend(4096)),
        (20_000, cc(11, 70)),
        (26_000, cc(2, 80)),
        (26_100, cc(11, 0)),
        (30_000, bend(8192)),
        (33_000, off(58)),
    ];
    let breath = |value: f32| Event::Breath(value / 127.0);
    let events = [
        (0, breath(60.0)),
        (700, note_on(58)),
        (9_001, breath(90.0)),
        (15_000, Event::Bend { cents: -100.0 }),
        (20_000, breath(70.0)),
        (26_000, breath(80.0)),
        (30_000, Event::Bend { cents: 0.0 }),
        (33_000, Event::NoteOff { note: SoundingNote(58) }),
    ];
    assert!(play(512, &said, SECOND) == offline(&events, SECOND));
}

#[test]
fn key_switches_choose_the_fingering_of_the_next_note() {
    // The second of three places.
    let said = [
        (0, Word::Set("Key switches", 0.5)),
        (1_024, on(63)),
        (6_000, on(25)),
        (7_000, off(25)),
        (9_600, on(61)),
        (9_601, off(63)),
    ];
    let events = [
        (1_024, note_on(63)),
        (6_000, Event::Fingerings(Fingerings::Alternate(1))),
        (9_600, note_on(61)),
        (9_601, Event::NoteOff { note: SoundingNote(63) }),
    ];
    let heard = play(512, &said, SECOND / 2);
    assert!(heard == offline(&events, SECOND / 2));
    assert!(heard != offline(&[events[0], events[2], events[3]], SECOND / 2));
}

#[test]
fn block_size_is_inaudible() {
    let mut said = vec![
        (0, cc(2, 0)),
        (311, on(58)),
        (15_001, Word::Set("Gain", 0.6)),
        (15_500, Word::Set("Embouchure", 0.5)),
    ];
    said.extend((0..100).map(|step| (320 + 97 * step, cc(2, step as u8))));
    said.extend([
        (9_999, on(62)),
        (10_000, off(58)),
        (20_000, bend(4000)),
        (24_001, on(70)),
        (40_000, off(70)),
    ]);
    said.sort_by_key(|(at, _)| *at);
    let whole = play(SECOND, &said, SECOND);
    assert!(whole.iter().any(|x| x.abs() > 1e-3), "the phrase sounds");
    for block in [1, 17, 64, 512, 4096] {
        assert!(play(block, &said, SECOND) == whole, "blocks of {block}");
    }
}

#[test]
fn starting_again_is_a_new_beginning() {
    let said = [(0, cc(2, 80)), (5, on(60)), (3_000, bend(0))];
    let mut loaded = load(256);
    loaded.plugin.start_processing().unwrap();
    let first = play_on(&mut loaded, 256, &said, 12_345);
    loaded.plugin.stop_processing().unwrap();
    loaded.plugin.start_processing().unwrap();
    assert!(play_on(&mut loaded, 256, &said, 12_345) == first);
}

#[test]
fn parameters_have_names_units_and_text() {
    let loaded = load(512);
    let all = loaded.plugin.get_parameters().unwrap();
    // Behind them the framework hides one parameter for each MIDI controller of each channel.
    let ours: Vec<_> = all.iter().filter(|param| !param.name.starts_with("MIDI")).collect();
    assert_eq!(ours.len(), 109, "{:?}", ours.iter().map(|param| &param.name).collect::<Vec<_>>());
    for (name, text) in
        [("Full breath", "6.00"), ("A4", "440.0"), ("Reed coupled", "Coupled"), ("Tuning", "Tempered")]
    {
        let param = loaded.plugin.find_parameter(name).unwrap();
        let shown = loaded.plugin.format_parameter(param.id, param.value).unwrap();
        assert!(shown.starts_with(text), "{name}: {shown}");
    }
}

#[test]
fn state_makes_the_round_trip() {
    let mut loaded = load(64);
    loaded.plugin.start_processing().unwrap();
    play_on(&mut loaded, 64, &[(0, Word::Set("Embouchure", 0.625)), (0, Word::Set("Reed coupled", 0.0))], 64);
    let saved = loaded.plugin.save_state().unwrap();
    let mut other = load_beside(64);
    other.plugin.load_state(&saved).unwrap();
    let value = |loaded: &Loaded, name| loaded.plugin.find_parameter(name).unwrap().value;
    assert!((value(&other, "Embouchure") - 0.625).abs() < 1e-6);
    assert_eq!(value(&other, "Reed coupled"), 0.0);
    assert_eq!(other.plugin.save_state().unwrap(), saved);
}

#[test]
fn without_controllers_it_has_few_parameters_and_the_same_sound_and_state() {
    let _turn = turn();
    // "ChalumeauNotesOn".
    let mut notes = load_class(64, Some("4368616C756D6561754E6F7465734F6E"));
    let names = |loaded: &Loaded| loaded.plugin.get_parameters().unwrap().into_iter().map(|param| param.name);
    let mut full = load_beside(64);
    let ours: Vec<_> = names(&full).filter(|name| !name.starts_with("MIDI")).collect();
    assert_eq!(names(&notes).collect::<Vec<_>>(), ours);
    notes.plugin.start_processing().unwrap();
    let heard = play_on(&mut notes, 64, &[(100, on(60)), (9_000, off(60))], SECOND / 4);
    let events = [(100, note_on(60)), (9_000, Event::NoteOff { note: SoundingNote(60) })];
    assert!(heard == offline(&events, SECOND / 4));
    play_on(&mut notes, 64, &[(0, Word::Set("Embouchure", 0.625))], 64);
    let saved = notes.plugin.save_state().unwrap();
    full.plugin.load_state(&saved).unwrap();
    assert_eq!(full.plugin.save_state().unwrap(), saved);
    notes.plugin.load_state(&saved).unwrap();
    assert_eq!(notes.plugin.save_state().unwrap(), saved);
}

#[test]
fn the_class_of_a_microphone_is_blown_by_wind_and_plays_like_the_others_without_it() {
    let _turn = turn();
    // "ChalumeauMicroph".
    let mut blown = load_class(256, Some("4368616C756D6561754D6963726F7068"));
    blown.plugin.start_processing().unwrap();
    blown.input = [quiet(SECOND / 2), wind(SECOND)].concat();
    let heard = play_on(&mut blown, 256, &[(0, on(60)), (SECOND / 4, off(60))], SECOND / 2);
    let events = [(0, note_on(60)), (SECOND / 4, Event::NoteOff { note: SoundingNote(60) })];
    assert!(heard == offline(&events, SECOND / 2), "off, what comes in is not heard");
    let said = [(0, Word::Set("Microphone", 1.0)), (100, on(60))];
    let heard = play_on(&mut blown, 256, &said, 3 * SECOND / 2);
    let peak = |sound: &[f32]| sound.iter().fold(0.0_f32, |peak, x| peak.max(x.abs()));
    let (before, after) = (peak(&heard[SECOND / 4..SECOND / 2]), peak(&heard[SECOND..]));
    assert!(before < 1e-3 && after > 0.02, "{before} before the wind, {after} in it");
}

#[test]
fn a_broken_state_changes_nothing() {
    let mut loaded = load(64);
    let before = loaded.plugin.save_state().unwrap();
    // Whether the host reports it differs; that nothing changes must not.
    let _ = loaded.plugin.load_state(b"rubbish! rubbish! rubbish!");
    let mut cut = before.clone();
    cut.truncate(before.len() / 2);
    let _ = loaded.plugin.load_state(&cut);
    assert_eq!(loaded.plugin.save_state().unwrap(), before);
}

#[test]
fn latency_is_the_instruments() {
    let mut loaded = load(512);
    // VST3 hosts ask once the plugin is active; before that it knows no sample rate.
    loaded.plugin.start_processing().unwrap();
    assert_eq!(loaded.plugin.latency_samples(), Clarinet::built_in(RATE).unwrap().latency_samples());
}

#[test]
fn the_melody_is_the_renderers() {
    let file = std::fs::read(chalumeau_test_host::machine::root().join("examples/melody.mid")).unwrap();
    let score = chalumeau_core::score::midi_file::read(&file, 48_000).unwrap().with_tail(0.5, 48_000);
    let mut clarinet = Clarinet::built_in(RATE).unwrap();
    let mut rendered = Vec::new();
    chalumeau_core::score::play(&mut clarinet, &score, 512, |block| {
        rendered.extend_from_slice(block);
        Ok::<_, std::convert::Infallible>(())
    })
    .unwrap();
    let said: Vec<_> = chalumeau_test_host::midi::messages(&file, 48_000)
        .unwrap()
        .into_iter()
        .filter_map(|At(at, say)| match say {
            Say::Midi([status, a, b]) => Some((at, Word::Midi(event(status, a, b)?))),
            _ => None,
        })
        .collect();
    assert!(play(512, &said, score.samples) == rendered);
    kept_melody::assert_is_kept(&rendered, &rendered);
}

fn event(status: u8, a: u8, b: u8) -> Option<MidiEvent> {
    let channel = MidiChannel::from_index(status & 15)?;
    Some(match status & 0xF0 {
        0x80 => MidiEvent::NoteOff { channel, note: a, velocity: b },
        0x90 => MidiEvent::NoteOn { channel, note: a, velocity: b },
        0xB0 => MidiEvent::ControlChange { channel, controller: a, value: b },
        0xD0 => MidiEvent::ChannelAftertouch { channel, pressure: a },
        0xE0 => MidiEvent::PitchBend { channel, value: u16::from(b) << 7 | u16::from(a) },
        _ => return None,
    })
}

#[test]
fn a_million_events_on_sixteen_channels_leave_no_stuck_note() {
    const EVENTS: usize = 1_000_000;
    const BLOCK: usize = 256;
    /// Events of a block.
    const AT_ONCE: usize = 64;
    let mut loaded = load(BLOCK);
    loaded.plugin.start_processing().unwrap();
    let mut random = fastrand::Rng::with_seed(12);
    for block in 0..EVENTS / AT_ONCE {
        for n in 0..AT_ONCE {
            let channel = MidiChannel::from_index(random.u8(0..16)).unwrap();
            let (note, value) = (random.u8(0..128), random.u8(0..128));
            let event = match random.u8(0..6) {
                0 | 1 => MidiEvent::NoteOn { channel, note, velocity: value },
                2 => MidiEvent::NoteOff { channel, note, velocity: 0 },
                3 => MidiEvent::ControlChange { channel, controller: note, value },
                4 => MidiEvent::PitchBend { channel, value: random.u16(0..16_384) },
                _ => MidiEvent::ChannelAftertouch { channel, pressure: value },
            };
            loaded.plugin.send_midi_event_at(event, (n * BLOCK / AT_ONCE) as i32).unwrap();
        }
        let mut buffers = AudioBuffers::new(0, 2, BLOCK, RATE);
        loaded.plugin.process_audio(&mut buffers).unwrap();
        assert!(buffers.outputs.iter().flatten().all(|x| x.abs() <= 1.0), "block {block}");
    }
    for index in 0..16 {
        let channel = MidiChannel::from_index(index).unwrap();
        let off = MidiEvent::ControlChange { channel, controller: 123, value: 0 };
        loaded.plugin.send_midi_event_at(off, 0).unwrap();
    }
    let mut rest = 0.0_f32;
    for block in 0..4 * SECOND / BLOCK {
        let mut buffers = AudioBuffers::new(0, 2, BLOCK, RATE);
        loaded.plugin.process_audio(&mut buffers).unwrap();
        if block > 3 * SECOND / BLOCK {
            rest = buffers.outputs.iter().flatten().fold(rest, |most, x| most.max(x.abs()));
        }
    }
    assert!(rest < 1e-6, "{rest} is left");
}
