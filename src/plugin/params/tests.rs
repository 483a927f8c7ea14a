//! The framework's parameters are those of the table.

use std::collections::BTreeMap;
use std::fmt::Debug;

use chalumeau_core::control::key_switches::KeySwitches;
use chalumeau_core::instrument::{Attack, GrowlPitch, ListeningMode, Split};

use super::instrument::{InstrumentChoice, QualityChoice};
use super::knob::{KnobKind, LawChoice, OrderChoice};
use super::listening::ListeningChoice;
use super::players::SplitChoice;
use super::reed::ReedDescription;
use super::techniques::{AttackChoice, GrowlPitchChoice, KeySwitchesChoice, WheelChoice};
use super::*;
use crate::parameters::{Choice, Kind, PARAMETERS, Sets, Value, find};

/// Id, group, name, default as text, and whether a host can automate it.
#[test]
#[allow(unsafe_code)] // the framework's pointers to parameters
fn hosts_see_the_table() {
    let params = ChalumeauParams::default();
    let found = params.param_map();
    let found: Vec<_> = found
        .iter()
        .map(|(id, param, group)| {
            // SAFETY: `params` keeps what the pointer points to.
            let (name, default, flags) =
                unsafe { (param.name(), param.default_normalized_value(), param.flags()) };
            // SAFETY: as above.
            let text = unsafe { param.normalized_value_to_string(default, true) };
            let is_automatable = !flags.contains(ParamFlags::NON_AUTOMATABLE);
            (id.as_str(), group.as_str(), name, text, is_automatable)
        })
        .collect();
    let table: Vec<_> =
        PARAMETERS.iter().map(|p| (p.id, p.group, p.name, p.default_text(), p.is_automatable)).collect();
    assert_eq!(found, table);
}

#[test]
fn choices_have_the_ids_and_texts_of_the_table() {
    fn same<T: Enum>(id: &'static str) -> &'static str {
        let Some(Kind::Choice(Choice { all, .. })) = find(id).map(|p| p.kind) else {
            panic!("{id} is no choice")
        };
        assert_eq!(T::variants(), all.iter().map(|(_, text)| *text).collect::<Vec<_>>(), "{id}");
        assert_eq!(T::ids().unwrap(), all.iter().map(|(id, _)| *id).collect::<Vec<_>>(), "{id}");
        id
    }
    // In the order of the table, and none is missing.
    let held = [
        same::<ResponseChoice>("resp"),
        same::<BreathFromChoice>("bfrom"),
        same::<TuningChoice>("tune"),
        same::<BeyondChoice>("beyond"),
        same::<KnobKind>("knob"),
        same::<LawChoice>("law"),
        same::<OrderChoice>("order"),
        same::<ReedSource>("hsrc"),
        same::<ReedSource>("ksrc"),
        same::<InstrumentChoice>("instr"),
        same::<QualityChoice>("qual"),
        same::<ReedDescription>("rface"),
        same::<ListeningChoice>("heard"),
        same::<AttackChoice>("attack"),
        same::<WheelChoice>("wheel"),
        same::<KeySwitchesChoice>("keysw"),
        same::<GrowlPitchChoice>("growlp"),
        same::<SplitChoice>("split"),
    ];
    let choices = PARAMETERS.iter().filter(|p| matches!(p.kind, Kind::Choice(_)));
    assert_eq!(held.to_vec(), choices.map(|p| p.id).collect::<Vec<_>>());
}

/// The instrument's own choices stand in the same order.
#[test]
fn each_choice_is_the_one_of_its_name() {
    fn same<T: Enum + Debug + Into<U>, U: Debug>() {
        for index in 0..T::variants().len() {
            let name = format!("{:?}", T::from_index(index));
            assert_eq!(format!("{:?}", T::from_index(index).into()), name);
        }
    }
    same::<TuningChoice, Tuning>();
    same::<BeyondChoice, Beyond>();
    same::<ResponseChoice, BreathResponse>();
    same::<ListeningChoice, ListeningMode>();
    same::<SplitChoice, Split>();
    same::<AttackChoice, Attack>();
    same::<GrowlPitchChoice, GrowlPitch>();
    same::<KeySwitchesChoice, KeySwitches>();
}

#[test]
fn default_parameters_are_the_reference_clarinet_bit_for_bit() {
    assert_eq!(ChalumeauParams::default().settings(), Settings::default());
}

#[test]
fn each_parameter_sets_the_field_that_the_table_says() {
    // Every number somewhere else in its range, so that two fields that are exchanged are noticed.
    let place = |id: &str, number: &Number| {
        let at = PARAMETERS.iter().position(|p| p.id == id).unwrap() as f32;
        number.min + (number.max - number.min) * (at + 1.0) / 80.0
    };
    let played = ChalumeauParams::new(&place).settings();
    let mut filled = Settings::default();
    for parameter in PARAMETERS {
        if let (Kind::Number(number), Some(Sets::Number(_))) = (parameter.kind, parameter.sets) {
            parameter.set(&mut filled, Value::Number(place(parameter.id, &number)));
        }
    }
    assert_eq!(played, filled);
    assert_ne!(played, Settings::default());
}

#[test]
#[allow(unsafe_code)] // the framework's pointers to parameters
fn texts_and_ends_survive_a_host_that_thinks_in_0_to_1() {
    let params = ChalumeauParams::default();
    let found: BTreeMap<_, _> = params.param_map().into_iter().map(|(id, param, _)| (id, param)).collect();
    for parameter in PARAMETERS {
        let (id, param) = (parameter.id, found[parameter.id]);
        // SAFETY: `params` keeps what the pointer points to.
        let text = |value: f32| unsafe { param.normalized_value_to_string(value, true) };
        // SAFETY: as above.
        let read = |text: &str| unsafe { param.string_to_normalized_value(text) };
        match parameter.kind {
            Kind::Number(number) => {
                // SAFETY: as above.
                let ends = unsafe { [param.preview_plain(0.0), param.preview_plain(1.0)] };
                assert_eq!(ends, [number.min, number.max], "{id}");
                // SAFETY: as above.
                let back = unsafe { param.preview_plain(param.default_normalized_value()) };
                assert!((back - number.default).abs() <= 1e-6 * (number.max - number.min), "{id}: {back}");
                for step in 0..=200 {
                    let shown = text(step as f32 / 200.0);
                    let back = read(&shown).unwrap_or_else(|| panic!("{id}: {shown}"));
                    assert!((back - step as f32 / 200.0).abs() < 0.006, "{id}: {shown} read as {back}");
                    assert_eq!(text(back), shown, "{id}");
                }
                assert_eq!(read("loud"), None, "{id}");
            }
            Kind::Choice(_) | Kind::Switch(_) => {
                let steps = parameter.steps().unwrap();
                for step in 0..=steps {
                    let value = step as f32 / steps as f32;
                    assert_eq!(read(&text(value)), Some(value), "{id}: {}", text(value));
                }
                assert_eq!(read("perhaps"), None, "{id}");
            }
            Kind::Whole(_) | Kind::Status(_) => {}
        }
    }
}
