//! What hosts and validators ask of a CLAP, beside its sound: description, parameters, texts, states, small extensions.
//!
//! These tests make the checks of clap-validator 0.4.1 that are named here; `clap.rs` and `clap_sleep.rs` make the others
//! that a host of ours can make.
//!
//! | check of clap-validator | test |
//! |---|---|
//! | `query-nonexistent-factory`, `create-id-with-trailing-garbage` | `the_library_gives_only_what_it_has` |
//! | `descriptor-consistency`, `features-categories`, `features-duplicates` | `the_instance_describes_itself_as_the_factory_does` |
//! | the rules of all `param-*` checks for descriptions | `parameters_are_described_by_the_rules` |
//! | `param-default-values` | `a_new_instance_has_its_defaults` |
//! | `param-conversions` | `every_step_is_whole_by_event_value_and_text`, `numbers_are_the_same_after_their_text` |
//! | `param-set-events`, `param-set-no-cookies` | `a_flush_and_a_block_set_the_same` |
//! | `param-set-wrong-namespace` | `events_of_another_namespace_set_nothing` |
//! | `param-fuzz-basic`, `-bounds`, `-sample-accurate`, `-modulation`; `process-note-*` | `any_values_and_notes_sound_finite` |
//! | `state-invalid-empty`, `state-invalid-random` | `rubbish_is_no_state`; `clap.rs`: `a_broken_state_is_refused_and_changes_nothing` |
//! | `state-reproducibility-basic`, `-binary` | `any_values_survive_a_state` |
//! | `state-reproducibility-buffered` | `a_state_survives_streams_that_take_little_at_a_time` |
//! | `process-sleep-process-status`, `process-sleep-constant-mask` | `clap_sleep.rs` |
//! | `process-audio-basic-*`, `transport-null` | `clap.rs`: every test plays without a transport |
//! | `process-varying-block-sizes`, `process-random-block-sizes` | `clap.rs`: `block_size_is_inaudible` |
//! | `process-reset-reactivate` | `clap.rs`: `reset_is_a_new_beginning` |
//!
//! `clap_checks.rs` makes `scan-*`, `process-varying-sample-rates` and `transport-fuzz*`, and says what has nothing to check.

#[path = "support/rules.rs"]
mod rules;

use std::collections::{BTreeMap, BTreeSet};

use chalumeau_core::instrument::Model;
use chalumeau_core::units::SoundingNote;
use chalumeau_test_host::clap::{
    At, Hand, NoteDialects, ParamIndicationAutomation, ParamInfoFlags, ParamRescanFlags, Plugin, Say,
    StateContextType,
};
use rules::{MOMENTS, movable, plugin, random_value};

const RATE: f64 = 48_000.0;

#[test]
fn the_library_gives_only_what_it_has() {
    let plugin = plugin();
    assert!(!plugin.has_factory(c"chalumeau.no-such-factory"));
    assert!(plugin.has_factory(c"clap.plugin-factory"));
    for id in ["chalumeau.clarinetX", "chalumeau", ""] {
        assert!(!plugin.creates(id), "{id:?}");
    }
    assert!(plugin.creates("chalumeau.clarinet"));
}

#[test]
fn the_instance_describes_itself_as_the_factory_does() {
    let [factory, instance] = plugin().descriptions().unwrap();
    assert_eq!(factory, instance);
    let features: BTreeSet<_> = factory.features.iter().collect();
    assert_eq!(features.len(), factory.features.len(), "none stands twice");
    assert!(factory.features.contains(&"instrument".to_owned()));
}

#[test]
fn parameters_are_described_by_the_rules() {
    let mut plugin = plugin();
    let params = plugin.params().unwrap();
    let ids: BTreeSet<_> = params.iter().map(|param| param.id).collect();
    assert_eq!(ids.len(), params.len());
    assert!(!plugin.has_param_info(params.len() as u32), "one after the last");
    let flagged = |flags: ParamInfoFlags| {
        let all = params.iter().filter(move |param| param.flags.contains(flags));
        all.map(|param| param.name.as_str()).collect::<Vec<_>>()
    };
    for param in &params {
        let (name, flags) = (&param.name, param.flags);
        assert!(!param.module.starts_with('/') && !param.module.ends_with('/'), "{name}");
        assert!(param.min <= param.default && param.default <= param.max, "{name}");
        if flags.contains(ParamInfoFlags::IS_STEPPED) {
            assert!([param.min, param.max, param.default].iter().all(|x| x.fract() == 0.0), "{name}");
        }
        if flags.contains(ParamInfoFlags::IS_ENUM) {
            assert!(flags.contains(ParamInfoFlags::IS_STEPPED), "{name}");
        }
        if flags.intersects(ParamInfoFlags::IS_READONLY | ParamInfoFlags::IS_HIDDEN) {
            let moved = ParamInfoFlags::IS_AUTOMATABLE | ParamInfoFlags::IS_MODULATABLE;
            assert!(!flags.intersects(moved), "{name}");
        }
    }
    assert_eq!(flagged(ParamInfoFlags::IS_READONLY), ["Knob status", "Instrument status"]);
    let choices = [
        "Breath response",
        "Breath from",
        "Reed coupled",
        "Tuning",
        "Beyond the range",
        "Knob",
        "Feel",
        "Feel order",
        "Study side",
        "H from",
        "k from",
        "Instrument",
        "Offline quality",
        "Reed description",
        "Heard from",
        "Attack",
        "Mod wheel",
        "Alternate fingerings",
        "Key switches",
        "Growl pitch",
        "Split",
    ];
    assert_eq!(flagged(ParamInfoFlags::IS_ENUM), choices);
    assert_eq!(flagged(ParamInfoFlags::REQUIRES_PROCESS), ["Breath", "Panic"]);
}

#[test]
fn what_has_no_effect_is_hidden_until_it_has() {
    let mut plugin = plugin();
    let hidden = |plugin: &mut Plugin| {
        let all = plugin.params().unwrap().into_iter();
        let hidden = all.filter(|param| param.flags.contains(ParamInfoFlags::IS_HIDDEN));
        hidden.map(|param| param.name).collect::<BTreeSet<_>>()
    };
    let all = [
        "Arm knob",
        "Torque ceiling",
        "Take over knob",
        "Rest here",
        "Blow hard here",
        "Knob curve",
        "OSC port",
        "OSC from network",
        "Feel OSC port",
        "Record take",
        "Participant",
        "Study seed",
        "Trial",
    ];
    let all: BTreeSet<String> = all.map(str::to_owned).into();
    assert_eq!(hidden(&mut plugin), all);
    let (knob, study) = (plugin.param("Knob").unwrap().id, plugin.param("Study").unwrap().id);
    let _ = plugin.heard();
    for (values, left) in [
        (vec![(knob, 1.0)], vec!["OSC port", "OSC from network", "Participant", "Study seed", "Trial"]),
        (vec![(knob, 3.0)], vec!["Participant", "Study seed", "Trial"]),
        (vec![(knob, 3.0), (study, 1.0)], vec![]),
    ] {
        plugin.set_all(&values).unwrap();
        plugin.attend();
        assert!(plugin.heard().rescans.contains(ParamRescanFlags::INFO), "{left:?}");
        assert_eq!(hidden(&mut plugin), left.into_iter().map(str::to_owned).collect());
        plugin.attend();
        assert!(plugin.heard().rescans.is_empty(), "told once");
    }
    let other = self::plugin().save().unwrap();
    plugin.restore(&other).unwrap();
    assert!(plugin.heard().rescans.contains(ParamRescanFlags::INFO | ParamRescanFlags::VALUES));
    assert_eq!(hidden(&mut plugin), all);
}

#[test]
fn a_new_instance_has_its_defaults() {
    let mut plugin = plugin();
    for param in plugin.params().unwrap() {
        assert_eq!(plugin.value(param.id).unwrap(), param.default, "{}", param.name);
    }
}

#[test]
fn every_step_is_whole_by_event_value_and_text() {
    let mut plugin = plugin();
    let (mut steps, mut texts) = (0, 0);
    for param in movable(&mut plugin) {
        if !param.flags.contains(ParamInfoFlags::IS_STEPPED) {
            continue;
        }
        let (id, name) = (param.id, &param.name);
        for step in param.min as u32..=param.max as u32 {
            let step = f64::from(step);
            plugin.set(id, step).unwrap();
            let kept = if MOMENTS.contains(&name.as_str()) { 0.0 } else { step };
            assert_eq!(plugin.value(id).unwrap(), kept, "{name}");
            steps += 1;
            let text = plugin.text(id, step).unwrap();
            assert_eq!(plugin.read_text(id, &text).unwrap(), Some(step), "{name}: {text}");
            texts += 1;
        }
    }
    println!("{steps} steps, {texts} texts");
    assert!(steps > 150_000 && texts > 150_000);
}

#[test]
fn numbers_are_the_same_after_their_text() {
    let mut plugin = plugin();
    let mut count = 0;
    for param in movable(&mut plugin) {
        let (id, name) = (param.id, &param.name);
        for step in 0..=1_000 {
            let value = param.min + (param.max - param.min) * f64::from(step) / 1_000.0;
            let text = plugin.text(id, value).unwrap();
            let read = plugin.read_text(id, &text).unwrap().unwrap_or_else(|| panic!("{name}: {text}"));
            let again = plugin.text(id, read).unwrap();
            assert_eq!(again, text, "{name}: {value} read as {read}");
            assert_eq!(plugin.read_text(id, &again).unwrap(), Some(read), "{name}");
            count += 1;
        }
    }
    println!("{count} texts");
    assert!(count > 50_000);
}

#[test]
fn what_users_type_is_read() {
    let mut plugin = plugin();
    for (name, typed, shown) in [
        ("Temperature", "20 C", "20.0 °C"),
        ("Temperature", "20 °C", "20.0 °C"),
        ("Temperature", "20,5", "20.5 °C"),
        ("Bend range", "12 semitones", "12 st"),
        ("Instrument", "Bass", "Bass clarinet"),
        ("Instrument", "bass clarinet", "Bass clarinet"),
        ("Gain", "\u{2212}3 dB", "-3.0 dB"),
        ("A4", "442HZ", "442.0 Hz"),
        ("Breath noise", "12 percent", "12.0 %"),
        ("Reed area", "90 mm2", "90.00 mm²"),
    ] {
        let id = plugin.param(name).unwrap().id;
        let read = plugin.read_text(id, typed).unwrap().unwrap_or_else(|| panic!("{name}: {typed}"));
        assert_eq!(plugin.text(id, read).unwrap(), shown, "{name}: {typed}");
    }
}

fn values(plugin: &mut Plugin) -> BTreeMap<String, f64> {
    let params = plugin.params().unwrap();
    params.into_iter().map(|param| (param.name, plugin.value(param.id).unwrap())).collect()
}

#[test]
fn a_flush_and_a_block_set_the_same() {
    let mut random = fastrand::Rng::with_seed(1);
    let (mut flushed, mut played) = (plugin(), plugin());
    // What may stay on beside a knob is said by another thread, in its time.
    let params: Vec<_> = movable(&mut flushed).into_iter().filter(|param| param.name != "Knob").collect();
    let is_moment = |id| params.iter().any(|param| param.id == id && MOMENTS.contains(&param.name.as_str()));
    for _ in 0..20 {
        let set: Vec<_> = params.iter().map(|param| (param.id, random_value(&mut random, param))).collect();
        let answers = flushed.set_all(&set).unwrap();
        let said: Vec<_> = set.iter().map(|&(id, value)| At(0, Say::Set(id, value))).collect();
        let hands = played
            .session(RATE, 512, |session| {
                session.play(&said, 512).unwrap();
                session.hands().to_vec()
            })
            .unwrap();
        assert_eq!(values(&mut flushed), values(&mut played));
        // The host is told that what it switched on is Off again.
        let pressed = set.iter().filter(|&&(id, value)| value == 1.0 && is_moment(id));
        let off: BTreeSet<_> = pressed.map(|&(id, _)| id).collect();
        for told in [answers, hands] {
            assert!(
                told.iter().all(|hand| matches!(hand, Hand::Move(_, value) if *value == 0.0)),
                "{told:?}"
            );
            let told: BTreeSet<_> = told
                .iter()
                .filter_map(|hand| match hand {
                    Hand::Move(id, _) => Some(*id),
                    _ => None,
                })
                .collect();
            assert_eq!(told, off);
        }
    }
}

#[test]
fn events_of_another_namespace_set_nothing() {
    let mut plugin = plugin();
    let mut random = fastrand::Rng::with_seed(2);
    let before = values(&mut plugin);
    let params = movable(&mut plugin);
    let said: Vec<_> =
        params.iter().map(|param| At(0, Say::Foreign(param.id, random_value(&mut random, param)))).collect();
    plugin.play(RATE, 512, &said, 512).unwrap();
    assert_eq!(values(&mut plugin), before);
}

#[test]
fn any_values_and_notes_sound_finite() {
    let mut random = fastrand::Rng::with_seed(3);
    let mut plugin = plugin();
    // A reed of another size is built on another thread, and a knob is looked for on this machine.
    let params = movable(&mut plugin);
    let params: Vec<_> = params
        .into_iter()
        .filter(|param| !["Knob", "Instrument", "A4"].contains(&param.name.as_str()))
        .collect();
    for round in 0..30 {
        let mut said = Vec::new();
        for at in (0..4_096).step_by([10, 100, 1_000][round % 3]) {
            for _ in 0..8 {
                let param = &params[random.usize(0..params.len())];
                let value = match random.u8(0..3) {
                    0 => random_value(&mut random, param),
                    1 => [param.min, param.max][random.usize(0..2)],
                    _ => {
                        said.push(At(at, Say::Modulate(param.id, random.f64() - 0.5)));
                        continue;
                    }
                };
                said.push(At(at, Say::Set(param.id, value)));
            }
            let key = random.u16(0..128);
            said.push(At(
                at,
                match random.u8(0..4) {
                    0 | 1 => Say::NoteOn(key, random.f64()),
                    2 => Say::NoteOff(key),
                    _ => Say::Midi([0x80 | random.u8(0..0x70), random.u8(0..128), random.u8(0..128)]),
                },
            ));
        }
        let heard = plugin.play(RATE, 256, &said, 4_096).unwrap();
        let is_fine = |x: &f32| x.is_finite() && !x.is_subnormal();
        assert!(heard.iter().flatten().all(is_fine), "round {round}");
        for param in &params {
            plugin.set(param.id, param.default).unwrap();
        }
    }
}

#[test]
fn any_values_survive_a_state() {
    let mut random = fastrand::Rng::with_seed(4);
    let (mut saved, mut loaded) = (plugin(), plugin());
    let params = movable(&mut saved);
    for _ in 0..200 {
        let set: Vec<_> = params.iter().map(|param| (param.id, random_value(&mut random, param))).collect();
        saved.set_all(&set).unwrap();
        let (expected, state) = (values(&mut saved), saved.save().unwrap());
        loaded.restore(&state).unwrap();
        assert!(loaded.heard().rescans.contains(ParamRescanFlags::VALUES));
        assert_eq!(values(&mut loaded), expected);
        assert_eq!(loaded.save().unwrap(), state);
        assert!(MOMENTS.iter().all(|name| expected[*name] == 0.0), "never On after a state");
    }
}

#[test]
fn a_state_survives_streams_that_take_little_at_a_time() {
    let (mut saved, mut loaded) = (plugin(), plugin());
    let zeta = saved.param("Embouchure").unwrap();
    saved.set(zeta.id, 0.7).unwrap();
    let state = saved.save_slowly(23).unwrap();
    assert_eq!(state, saved.save().unwrap());
    loaded.restore_slowly(&state, 17).unwrap();
    assert_eq!(loaded.save().unwrap(), state);
}

#[test]
fn rubbish_is_no_state() {
    let mut random = fastrand::Rng::with_seed(5);
    let mut plugin = plugin();
    let before = plugin.save().unwrap();
    assert!(plugin.restore(&[]).is_err());
    for _ in 0..3 {
        let bytes: Vec<u8> = std::iter::repeat_with(|| random.u8(..)).take(1 << 20).collect();
        assert!(plugin.restore(&bytes).is_err());
    }
    assert_eq!(plugin.save().unwrap(), before);
}

#[test]
fn a_state_is_one_for_every_context() {
    let mut plugin = plugin();
    let zeta = plugin.param("Embouchure").unwrap();
    plugin.set(zeta.id, 0.25).unwrap();
    let state = plugin.save().unwrap();
    let contexts =
        [StateContextType::ForPreset, StateContextType::ForDuplicate, StateContextType::ForProject];
    for context in contexts {
        assert_eq!(plugin.save_for(context).unwrap(), state, "{context:?}");
        let mut other = self::plugin();
        other.restore_for(&state, context).unwrap();
        assert_eq!(other.save().unwrap(), state, "{context:?}");
    }
}

#[test]
fn a_window_is_offered_only_to_a_host_that_opens_windows() {
    assert!(plugin().has_window());
    let path = chalumeau_test_host::artefacts::clap().unwrap();
    assert!(!Plugin::load_blind(&path).unwrap().has_window());
}

#[test]
fn each_key_that_sounds_has_its_written_note_for_a_name() {
    let mut plugin = plugin();
    let named =
        |plugin: &mut Plugin| plugin.note_names().unwrap().into_iter().collect::<BTreeMap<u16, String>>();
    let play_on = |plugin: &mut Plugin| {
        plugin.session(RATE, 512, |session| session.play(&[], 512).unwrap()).unwrap();
        plugin.attend();
    };
    assert_eq!(named(&mut plugin).len(), 46, "all fingerings, before anything is known of them");
    play_on(&mut plugin);
    let names = named(&mut plugin);
    let model = Model::built_in(RATE).unwrap();
    let sounding = (0..128).filter(|&key| model.fingering_for(SoundingNote(key)).is_some());
    assert!(names.keys().copied().eq(sounding.map(u16::from)));
    assert_eq!([names[&50].as_str(), names[&71].as_str()], ["E3 written", "C#5 written"]);
    let instrument = plugin.param("Instrument").unwrap();
    let a = plugin.read_text(instrument.id, "A").unwrap().unwrap();
    let _ = plugin.heard();
    plugin.set(instrument.id, a).unwrap();
    play_on(&mut plugin);
    assert_eq!(plugin.heard().names, 1, "the host is told once");
    let names = named(&mut plugin);
    assert_eq!([names[&49].as_str(), names[&71].as_str()], ["E3 written", "D5 written"]);
}

#[test]
fn pages_for_control_surfaces_hold_what_a_player_turns() {
    let mut plugin = plugin();
    let names: BTreeMap<_, _> =
        plugin.params().unwrap().into_iter().map(|param| (param.id, param.name)).collect();
    let pages = plugin.remote_pages().unwrap();
    let shown: Vec<Vec<&str>> =
        pages.iter().map(|page| page.params.iter().map(|id| names[id].as_str()).collect()).collect();
    assert_eq!(shown[0][..5], ["Breath", "Lip opening", "Reed strength", "Breath noise", "Gain"]);
    let titles: Vec<_> = pages.iter().map(|page| (page.section.as_str(), page.name.as_str())).collect();
    let expected = [
        ("Player", "Breath and lip"),
        ("Player", "Expression"),
        ("Player", "Techniques"),
        ("Player", "Room"),
        ("Player", "Players"),
        ("Player", "Tuning"),
        ("Player", "Listening"),
        ("Reed", "Reed"),
        ("Reed", "Reed, physical"),
        ("Knob", "Feel"),
    ];
    assert_eq!(titles, expected);
    assert!(shown.iter().flatten().all(|name| !MOMENTS.contains(name) && *name != "Torque ceiling"));
}

#[test]
fn notes_come_in_every_dialect_that_the_plugin_understands() {
    let [(input, preferred), (output, sent)] = plugin().note_dialects().unwrap();
    assert_eq!(input, NoteDialects::CLAP | NoteDialects::MIDI | NoteDialects::MIDI_MPE);
    assert_eq!((preferred, output, sent), (NoteDialects::CLAP, NoteDialects::MIDI, NoteDialects::MIDI));
}

#[test]
fn indications_come_and_go() {
    let mut plugin = plugin();
    let before = plugin.save().unwrap();
    for param in plugin.params().unwrap() {
        plugin.indicate_mapping(param.id, Some("Knob 3")).unwrap();
        for automation in [ParamIndicationAutomation::Playing, ParamIndicationAutomation::None] {
            plugin.indicate_automation(param.id, automation).unwrap();
        }
        plugin.indicate_mapping(param.id, None).unwrap();
    }
    assert_eq!(plugin.save().unwrap(), before);
}
