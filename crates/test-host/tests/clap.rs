//! The bundled CLAP, as a host sees and hears it. `cargo xtask bundle` first; CHALUMEAU_CLAP names another file.

#[path = "support/kept_melody.rs"]
mod kept_melody;
#[path = "support/rules.rs"]
mod rules;

use chalumeau_core::analysis::pitch::fundamental_hz;
use chalumeau_core::analysis::to_f64;
use chalumeau_core::control::key_switches::{KeySwitches, ROW};
use chalumeau_core::event::{Event, Fingerings, Timed};
use chalumeau_core::instrument::{Clarinet, Reach, Settings};
use chalumeau_core::units::SoundingNote;
use chalumeau_test_host::clap::{At, NoteExpressionType, ParamInfoFlags, Plugin, Say, Stereo};
use rules::plugin;

const RATE: f64 = 48_000.0;
const SECOND: usize = 48_000;
const BLOCKS: [usize; 5] = [1, 17, 64, 512, 4096];

fn play(said: &[At], samples: usize) -> Vec<f32> {
    let [left, right] = plugin().play(RATE, 512, said, samples).unwrap();
    assert!(left == right, "both channels carry the same voice");
    left
}

/// What the instrument itself makes of the same events.
fn offline(settings: Settings, events: &[(usize, Event)], samples: usize) -> Vec<f32> {
    let mut clarinet = Clarinet::built_in(RATE).unwrap();
    clarinet.set_settings(&settings);
    let mut out = vec![0.0; samples];
    clarinet.render_events(events.iter().map(|&(at, event)| Timed { at, event }), &mut out);
    out
}

fn on(key: u8) -> Say {
    Say::Midi([0x90, key, 100])
}

fn off(key: u8) -> Say {
    Say::Midi([0x80, key, 0])
}

fn breath(value: u8) -> Say {
    Say::Midi([0xB0, 2, value])
}

fn note_on(key: u8) -> Event {
    Event::NoteOn { note: SoundingNote(key), velocity: 100.0 / 127.0 }
}

fn level_db(samples: &[f32]) -> f64 {
    let power: f64 = samples.iter().map(|&x| f64::from(x).powi(2)).sum();
    10.0 * (power / samples.len() as f64).max(1e-30).log10()
}

/// A phrase that uses everything at positions that fall anywhere in a block.
fn phrase(plugin: &mut Plugin) -> Vec<At> {
    let (gain, zeta) = (plugin.param("Gain").unwrap(), plugin.param("Embouchure").unwrap());
    let mut said = vec![At(0, breath(0)), At(311, on(58)), At(20_000, Say::Midi([0xE0, 0, 32]))];
    said.extend((0..100).map(|step| At(320 + 97 * step, breath(step as u8))));
    said.extend([
        At(9_999, on(62)),
        At(10_000, off(58)),
        At(15_001, Say::Set(gain.id, 0.9 * gain.default)),
        At(15_500, Say::Set(zeta.id, 0.5)),
        At(24_001, on(70)),
        At(24_002, off(62)),
        At(30_000, Say::Midi([0xE0, 0, 64])),
        At(33_333, breath(20)),
        At(40_000, off(70)),
        At(40_001, breath(0)),
    ]);
    said.sort_by_key(|At(at, _)| *at);
    said
}

#[test]
fn the_library_says_who_it_is() {
    let plugin = plugin();
    assert_eq!(plugin.identity().unwrap(), ("chalumeau.clarinet".to_owned(), "Chalumeau".to_owned()));
}

#[test]
fn an_event_acts_at_its_sample() {
    for at in [612, 613, 4095, 4096, 4097] {
        let heard = play(&[At(at, on(60))], SECOND / 4);
        assert!(heard[..at].iter().all(|&x| x.abs() < 1e-7), "silent before the note at {at}");
        assert!(heard == offline(Settings::default(), &[(at, note_on(60))], SECOND / 4), "note at {at}");
    }
    // The player acts on a grid of 16 internal samples (8 here): two grid steps later is later.
    assert!(play(&[At(612, on(60))], SECOND / 4) != play(&[At(628, on(60))], SECOND / 4));
}

#[test]
fn block_size_is_inaudible() {
    let said = phrase(&mut plugin());
    let whole: Stereo = plugin().play(RATE, SECOND, &said, SECOND).unwrap();
    assert!(level_db(&whole[0]) > -60.0, "the phrase sounds");
    for block in BLOCKS {
        let heard = plugin().play(RATE, block, &said, SECOND).unwrap();
        assert!(heard == whole, "blocks of {block}");
    }
}

#[test]
fn the_first_key_sounds_by_its_velocity() {
    let [soft, loud] = [30, 120].map(|velocity| play(&[At(0, Say::Midi([0x90, 58, velocity]))], SECOND));
    let (soft, loud) = (level_db(&soft[SECOND / 2..]), level_db(&loud[SECOND / 2..]));
    assert!(loud > -40.0, "{loud} dB");
    assert!(loud > soft + 3.0, "{soft} dB, {loud} dB");
}

#[test]
fn breath_comes_from_controllers_and_pressure() {
    for source in [[0xB0, 2], [0xB0, 11], [0xD0, 0]] {
        let blow = |value: u8| match source {
            [0xD0, _] => Say::Midi([0xD0, value, 0]),
            [status, cc] => Say::Midi([status, cc, value]),
        };
        // A source at rest has not moved: it is the 1 that takes the breath away from the keys.
        let said =
            [At(0, blow(1)), At(5, blow(0)), At(10, on(58)), At(SECOND / 4, blow(90)), At(SECOND, blow(0))];
        let heard = play(&said, 2 * SECOND + SECOND / 4);
        // After the thump of keys and tongue.
        assert!(level_db(&heard[SECOND / 8..SECOND / 4]) < -90.0, "{source:x?}: no breath, no tone");
        assert!(level_db(&heard[SECOND / 2..SECOND]) > -40.0, "{source:x?}: breath sounds");
        let after = level_db(&heard[2 * SECOND..]);
        assert!(after < -120.0, "{source:x?}: {after} dBFS a second after the breath");
        let blown = |value: u8| Event::Breath(f32::from(value) / 127.0);
        let events =
            [(0, blown(1)), (5, blown(0)), (10, note_on(58)), (SECOND / 4, blown(90)), (SECOND, blown(0))];
        assert!(heard == offline(Settings::default(), &events, heard.len()), "{source:x?}");
    }
}

#[test]
fn the_breath_parameter_blows_when_it_moves() {
    let id = plugin().param("Breath").unwrap().id;
    let events = [(0, note_on(58)), (4800, Event::Breath(0.5)), (24_000, Event::Breath(0.0))];
    let said = [
        At(0, on(58)),
        At(4800, Say::Set(id, 0.5)),
        At(14_000, Say::Set(id, 0.5)),
        At(24_000, Say::Set(id, 0.0)),
    ];
    let heard = play(&said, SECOND);
    assert!(heard == offline(Settings::default(), &events, SECOND));
}

/// As in MIDI files (`tests/cli.rs`) and in the VST3 beside this test: the row's keys are no notes. Written E flat 4 is key 61.
#[test]
fn key_switches_choose_the_fingering_of_the_next_note() {
    let id = plugin().param("Key switches").unwrap().id;
    let said = |switch: u8| {
        [
            At(0, Say::Set(id, 1.0)),
            At(1_024, on(63)),
            At(6_000, on(switch)),
            At(7_000, off(switch)),
            At(9_600, on(61)),
            At(9_600, off(63)),
        ]
    };
    let wanted = |fingerings| {
        let reach = Reach { key_switches: KeySwitches::C1, ..Reach::default() };
        let events = [
            (1_024, note_on(63)),
            (6_000, Event::Fingerings(fingerings)),
            (9_600, note_on(61)),
            (9_600, Event::NoteOff { note: SoundingNote(63) }),
        ];
        offline(Settings { reach, ..Settings::default() }, &events, SECOND / 2)
    };
    let chart = wanted(Fingerings::Chart);
    for (switch, fingerings) in (24..).zip(ROW) {
        let heard = play(&said(switch), SECOND / 2);
        assert!(heard == wanted(fingerings), "{fingerings}");
        let is_other = !matches!(fingerings, Fingerings::Chart | Fingerings::Alternate(3));
        assert_eq!(heard != chart, is_other, "{fingerings}");
    }
}

#[test]
fn note_expressions_blow_and_bend() {
    let said = [
        At(0, Say::NoteOn(58, 100.0 / 127.0)),
        At(0, Say::Express(58, NoteExpressionType::Pressure, 0.0)),
        At(9_000, Say::Express(58, NoteExpressionType::Pressure, 0.6)),
        At(18_000, Say::Express(58, NoteExpressionType::Tuning, -0.25)),
        At(30_000, Say::Express(58, NoteExpressionType::Expression, 0.5)),
        At(40_000, Say::NoteOff(58)),
    ];
    let events = [
        (0, note_on(58)),
        (9_000, Event::Breath(0.6)),
        (18_000, Event::Bend { cents: -25.0 }),
        (30_000, Event::Breath(0.5)),
        (40_000, Event::NoteOff { note: SoundingNote(58) }),
    ];
    assert!(play(&said, SECOND) == offline(Settings::default(), &events, SECOND));
}

#[test]
fn the_wheel_bends() {
    let bent = |low: u8, high: u8| {
        play(&[At(0, Say::Midi([0xE0, low, high])), At(0, breath(80)), At(0, on(60))], SECOND)
    };
    let plain = play(&[At(0, breath(80)), At(0, on(60))], SECOND);
    assert!(bent(0, 64) == plain, "the centre bends by nothing, not by a little");
    let hz = |samples: &[f32]| fundamental_hz(&to_f64(&samples[SECOND / 2..]), RATE).unwrap();
    let up = 1200.0 * (hz(&bent(0, 80)) / hz(&plain)).log2();
    let down = 1200.0 * (hz(&bent(0, 48)) / hz(&plain)).log2();
    // A quarter of two semitones; how far a bore follows is its own affair.
    assert!(up > 10.0 && down < -10.0, "{up} {down} cents");
}

#[test]
fn default_values_from_a_host_change_nothing() {
    let mut plugin = plugin();
    let mut said: Vec<_> =
        plugin.params().unwrap().iter().map(|param| At(0, Say::Set(param.id, param.default))).collect();
    said.extend([At(0, breath(70)), At(0, on(62))]);
    let heard = plugin.play(RATE, 512, &said, SECOND / 2).unwrap();
    let events = [(0, Event::Breath(70.0 / 127.0)), (0, note_on(62))];
    assert!(heard[0] == offline(Settings::default(), &events, SECOND / 2));
}

#[test]
fn every_controller_at_once_does_no_harm() {
    let said: Vec<_> = (0..16u8)
        .flat_map(|channel| (0..128u8).map(move |cc| At(100, Say::Midi([0xB0 | channel, cc, 64]))))
        .chain([At(200, breath(80)), At(200, on(60))])
        .collect();
    let heard = play(&said, SECOND);
    assert!(heard.iter().all(|x| x.is_finite()));
    assert!(level_db(&heard[SECOND / 2..]) > -40.0);
}

#[test]
fn panic_silences_once_and_then_lets_play() {
    let id = plugin().param("Panic").unwrap().id;
    let said = [
        At(0, breath(80)),
        At(0, on(60)),
        At(24_000, Say::Set(id, 1.0)),
        At(30_000, breath(80)),
        At(30_000, on(62)),
        At(60_000, Say::Set(id, 0.0)),
        At(70_000, Say::Set(id, 1.0)),
    ];
    let blown = Event::Breath(80.0 / 127.0);
    let events = [
        (0, blown),
        (0, note_on(60)),
        (24_000, Event::Panic),
        (30_000, blown),
        (30_000, note_on(62)),
        (70_000, Event::Panic),
    ];
    assert!(play(&said, 2 * SECOND) == offline(Settings::default(), &events, 2 * SECOND));
}

#[test]
fn reset_is_a_new_beginning() {
    let said = phrase(&mut plugin());
    let mut plugin = plugin();
    let (first, second) = plugin
        .session(RATE, 256, |session| {
            let first = session.play(&said[..60], 12_345).unwrap();
            session.reset();
            let _ = session.play(&[At(5, on(65)), At(5, Say::Midi([0xE0, 0, 100]))], 7_777).unwrap();
            session.reset();
            (first, session.play(&said[..60], 12_345).unwrap())
        })
        .unwrap();
    assert!(first == second);
}

#[test]
fn text_reads_both_ways() {
    let mut plugin = plugin();
    for param in plugin.params().unwrap() {
        for step in 0..=40 {
            let value = param.min + (param.max - param.min) * f64::from(step) / 40.0;
            let text = plugin.text(param.id, value).unwrap();
            let back = plugin
                .read_text(param.id, &text)
                .unwrap()
                .unwrap_or_else(|| panic!("{}: {text}", param.name));
            assert_eq!(plugin.text(param.id, back).unwrap(), text, "{}", param.name);
        }
        let default = plugin.text(param.id, param.default).unwrap();
        let back = plugin.read_text(param.id, &default).unwrap().unwrap();
        assert!((back - param.default).abs() < 1e-3, "{}: {default}", param.name);
        assert!(!param.module.is_empty(), "{} belongs to a group", param.name);
    }
}

#[test]
fn state_makes_the_round_trip() {
    let mut plugin = plugin();
    for (index, param) in rules::movable(&mut plugin).into_iter().enumerate() {
        let unit = 0.15 + 0.7 * (index as f64 * 0.618).fract();
        plugin.set(param.id, param.min + unit * (param.max - param.min)).unwrap();
    }
    let saved = plugin.save().unwrap();
    let mut other = self::plugin();
    other.restore(&saved).unwrap();
    assert_eq!(String::from_utf8_lossy(&other.save().unwrap()), String::from_utf8_lossy(&saved));
    for param in plugin.params().unwrap() {
        assert_eq!(plugin.value(param.id).unwrap(), other.value(param.id).unwrap(), "{}", param.name);
    }
    let said = [At(0, breath(90)), At(0, on(60))];
    assert!(plugin.play(RATE, 64, &said, 20_000).unwrap() == other.play(RATE, 64, &said, 20_000).unwrap());
}

/// The framework writes eight bytes of length, then JSON.
fn state_of(json: &str) -> Vec<u8> {
    let mut bytes = (json.len() as u64).to_le_bytes().to_vec();
    bytes.extend(json.bytes());
    bytes
}

#[test]
fn a_broken_state_is_refused_and_changes_nothing() {
    let mut plugin = plugin();
    let zeta = plugin.param("Embouchure").unwrap();
    plugin.set(zeta.id, 0.7).unwrap();
    let before = plugin.save().unwrap();
    let mut cut = before.clone();
    cut.truncate(before.len() / 2);
    let rubbish =
        [b"".to_vec(), b"rubbish!rubbish!".to_vec(), cut, state_of("{\"params\":7}"), state_of("nothing")];
    for bytes in rubbish {
        assert!(plugin.restore(&bytes).is_err(), "{}", String::from_utf8_lossy(&bytes));
        assert_eq!(plugin.save().unwrap(), before);
    }
}

/// Each of 10000 states with a bit turned, a byte lost, doubled or changed, or an end cut off.
#[test]
fn a_damaged_state_is_noticed_and_changes_nothing() {
    let mut plugin = plugin();
    let zeta = plugin.param("Embouchure").unwrap();
    plugin.set(zeta.id, 0.7).unwrap();
    let saved = plugin.save().unwrap();
    plugin.set(zeta.id, 0.4).unwrap();
    let before = plugin.save().unwrap();
    let mut random = fastrand::Rng::with_seed(15);
    let mut taken = Vec::new();
    for case in 0..10_000 {
        let mut bytes = saved.clone();
        let at = random.usize(0..bytes.len());
        match case % 5 {
            0 => bytes[at] ^= 1 << random.u8(0..8),
            1 => drop(bytes.remove(at)),
            2 => bytes.insert(at, bytes[at]),
            3 => bytes[at] = random.u8(b' '..b'~'),
            _ => bytes.truncate(at),
        }
        if plugin.restore(&bytes).is_err() {
            assert!((plugin.value(zeta.id).unwrap() - 0.4).abs() < 1e-6, "case {case}");
            continue;
        }
        // Not noticed: what stands there must be whole, or have lost no more than its checksum's name.
        taken.push(String::from_utf8_lossy(&bytes).into_owned());
        assert!(
            (plugin.value(zeta.id).unwrap() - 0.7).abs() < 1e-6,
            "case {case}: {}",
            taken[taken.len() - 1]
        );
        plugin.restore(&before).unwrap();
    }
    println!("{} of 10000 were read", taken.len());
    assert!(taken.len() < 200, "{}", taken.len());
    assert_eq!(plugin.save().unwrap(), before);
}

/// States as earlier versions saved them, with nothing at its default.
#[test]
fn states_of_earlier_versions_mean_what_they_did() {
    let states = [
        include_str!("states/layout-1.json"),
        include_str!("states/layout-2.json"),
        include_str!("states/layout-3.json"),
        include_str!("states/layout-4.json"),
    ];
    // What was not there yet: breath was pressure, heard from one point, in a still note without vibrato.
    let was = [("resp", "phys", 4), ("heard", "point", 3), ("wheel", "none", 5)];
    let moments = ["arm", "rec", "panic", "takeov", "rest", "blow", "study", "replay"];
    for (at, text) in states.into_iter().enumerate() {
        let layout = at + 1;
        let frozen: serde_json::Value = serde_json::from_str(text).unwrap();
        let mut plugin = plugin();
        plugin.restore(&state_of(text)).unwrap();
        let bytes = plugin.save().unwrap();
        let saved: serde_json::Value = serde_json::from_slice(&bytes[8..]).unwrap();
        for (id, value) in frozen["params"].as_object().unwrap() {
            if moments.contains(&id.as_str()) {
                continue;
            }
            let now = &saved["params"][id];
            let is_same = match (value["f32"].as_f64(), now["f32"].as_f64()) {
                (Some(was), Some(is)) => (was - is).abs() <= 1e-5 * was.abs().max(1.0),
                _ => now == value,
            };
            assert!(is_same, "layout {layout}: {id} was {value}, is {now}");
        }
        for (id, choice, since) in was {
            if layout < since && frozen["params"].get(id).is_none() {
                assert_eq!(saved["params"][id]["string"], choice, "layout {layout}: {id}");
            }
        }
        assert_eq!(saved["params"]["life"]["f32"], 0.0, "layout {layout}");
        for (field, was) in
            frozen["fields"].as_object().unwrap().iter().filter(|(field, _)| *field != "schema")
        {
            // A window may have learnt something since.
            let (was, is) = (was.as_str().unwrap(), saved["fields"][field].as_str().unwrap());
            assert!(is.starts_with(was.trim_end_matches('}')), "layout {layout}: {field} was {was}, is {is}");
        }
        let mut again = self::plugin();
        again.restore(&bytes).unwrap();
        assert_eq!(again.save().unwrap(), bytes, "layout {layout}");
    }
}

#[test]
fn a_strange_state_is_mended() {
    let mut plugin = plugin();
    let zeta = plugin.param("Embouchure").unwrap();
    let a4 = plugin.param("A4").unwrap();
    plugin.set(zeta.id, 0.9).unwrap();
    let json = r#"{"version":"9","params":{"a4":{"f32":9999.0},"zeta":{"bool":true},"later":{"i32":3}},"fields":{"schema":"77"}}"#;
    plugin.restore(&state_of(json)).unwrap();
    assert_eq!(plugin.value(a4.id).unwrap(), a4.max, "clamped");
    let value = plugin.value(zeta.id).unwrap();
    assert_eq!(plugin.text(zeta.id, value).unwrap(), "0.300", "default");
    let mut fresh = self::plugin();
    // Without the checksum, which is another.
    let text = |plugin: &mut Plugin| {
        let mut state: serde_json::Value = serde_json::from_slice(&plugin.save().unwrap()[8..]).unwrap();
        assert!(state["fields"].as_object_mut().unwrap().remove("crc32").is_some());
        state.to_string()
    };
    // The reference clarinet by name; a state without a name has no preset.
    let named = r#""preset":"\"B flat clarinet\"""#;
    let reference = text(&mut fresh);
    assert!(reference.contains(named), "{reference}");
    fresh.restore(&state_of(r#"{"version":"","params":{},"fields":{}}"#)).unwrap();
    let reference = reference.replace(named, r#""preset":"\"\"""#);
    assert_eq!(text(&mut fresh), reference, "an empty state is the reference clarinet");
}

#[test]
fn latency_is_the_instruments() {
    let mut plugin = plugin();
    for rate in [44_100.0, 48_000.0, 88_200.0, 96_000.0, 192_000.0] {
        plugin.session(rate, 512, |_| ()).unwrap();
        assert_eq!(
            plugin.latency().unwrap(),
            Clarinet::built_in(rate).unwrap().latency_samples(),
            "{rate} Hz"
        );
    }
}

#[test]
fn a_new_latency_is_told_within_the_activation_and_asks_for_no_restart() {
    let mut plugin = plugin();
    let quality = plugin.param("Offline quality").unwrap().id;
    plugin.set(quality, 1.0).unwrap();
    let mut latency = plugin.latency().unwrap();
    for (rate, offline) in [(48_000.0, false), (48_000.0, true), (44_100.0, true), (192_000.0, false)] {
        plugin.set_offline(offline).unwrap();
        plugin.heard();
        plugin.session(rate, 512, |session| session.play(&[At(0, on(60))], 2_048).unwrap()).unwrap();
        plugin.attend();
        let (heard, before) = (plugin.heard(), latency);
        latency = plugin.latency().unwrap();
        assert_eq!(heard.restarts, 0, "{rate} Hz, offline: {offline}");
        assert_eq!(heard.latencies, u32::from(latency != before), "{rate} Hz, offline: {offline}");
    }
}

#[test]
fn a_program_change_begins_at_its_sample_in_a_bounce_of_any_block_size() {
    const LENGTH: usize = 12_000;
    let program = |at, number| At(at, Say::Midi([0xC0, number, 0]));
    let bank = |at| At(at, Say::Midi([0xB0, 0, 0]));
    let bounce = |said: &[At], block| {
        let mut plugin = plugin();
        plugin.set_offline(true).unwrap();
        plugin.play(RATE, block, said, LENGTH).unwrap()
    };
    let said = [bank(0), program(0, 12), At(0, on(60)), bank(5_000), program(5_000, 29), program(9_001, 3)];
    let whole = bounce(&said, LENGTH);
    for block in [64, 333, 4_096] {
        assert!(bounce(&said, block) == whole, "blocks of {block}");
    }
    let unchanged = bounce(&[said[2]], LENGTH);
    let first = |other: &[f32]| whole[0].iter().zip(other).position(|(a, b)| a != b);
    assert!(first(&unchanged[0]).unwrap() < 2_000, "from the beginning on");
    let later = bounce(&said[..3], LENGTH);
    assert!((5_000..6_000).contains(&first(&later[0]).unwrap()), "from its sample on");
}

#[test]
fn a_new_value_under_modulation_that_holds_the_parameter_counts_when_that_ends() {
    let mut plugin = plugin();
    let modulated = ParamInfoFlags::IS_MODULATABLE;
    let params = plugin.params().unwrap().into_iter();
    let params: Vec<_> = params.filter(|param| param.flags.contains(modulated)).collect();
    assert!(!params.is_empty());
    for param in params {
        let (id, range) = (param.id, param.max - param.min);
        let [low, high] = [0.25, 0.75].map(|share| param.min + share * range);
        let [low, high] = if param.flags.contains(ParamInfoFlags::IS_STEPPED) {
            [param.min, param.max]
        } else {
            [low, high]
        };
        let mut session = plugin.activate(RATE, 512).unwrap();
        session.play(&[At(0, Say::Set(id, low)), At(1, Say::Modulate(id, range))], 512).unwrap();
        session.play(&[At(0, Say::Set(id, high))], 512).unwrap();
        let held = plugin.value(id).unwrap();
        session.play(&[At(0, Say::Modulate(id, 0.0))], 512).unwrap();
        let after = plugin.value(id).unwrap();
        plugin.deactivate(session);
        for value in [held, after] {
            assert!((value - high).abs() < 1e-4 * range, "{}: {value} for {high}", param.name);
        }
    }
}

#[test]
fn a_rate_out_of_reach_is_refused() {
    let mut plugin = plugin();
    for rate in [999.0, 1_536_001.0] {
        assert!(plugin.session(rate, 512, |_| ()).is_err(), "{rate} Hz");
    }
    plugin.play(RATE, 512, &[At(0, on(60))], 100).unwrap();
}

#[test]
fn the_melody_is_the_renderers_bit_for_bit() {
    let file = std::fs::read(chalumeau_test_host::machine::root().join("examples/melody.mid")).unwrap();
    let score = chalumeau_core::score::midi_file::read(&file, 48_000).unwrap().with_tail(0.5, 48_000);
    let mut clarinet = Clarinet::built_in(RATE).unwrap();
    let mut rendered = Vec::new();
    chalumeau_core::score::play(&mut clarinet, &score, 512, |block| {
        rendered.extend_from_slice(block);
        Ok::<_, std::convert::Infallible>(())
    })
    .unwrap();
    let said = chalumeau_test_host::midi::messages(&file, 48_000).unwrap();
    for block in BLOCKS {
        let [left, right] = plugin().play(RATE, block, &said, score.samples).unwrap();
        assert!(left == rendered && right == rendered, "blocks of {block}");
    }
    kept_melody::assert_is_kept(&rendered, &rendered);
}
