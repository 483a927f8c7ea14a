//! Saved states: what may stand in one, and how any state is made fit to load.

use std::collections::BTreeMap;

use nice_plug::params::InternalParamMut;
use nice_plug::plugin::ParamValue;
use nice_plug::prelude::*;
use serde::{Serialize, de::DeserializeOwned};

use super::ChalumeauParams;
use super::alterations::SavedAlterations;
use super::instrument;
use super::knob::SavedCalibration;
use super::microphone::RoomFloor;
use super::scale::SavedScale;
use crate::controllers;
use crate::controllers::source_curves::SourceCurves;
use crate::editor::WindowState;
use crate::parameters::{Kind, Number, PARAMETERS, Parameter};
use crate::plugin::launch_options::LaunchOptions;
use crate::presets::{NAME_MOST, Preset, factory};

/// Layout of the saved state. 1: ids and units as below. 2: the instrument and its file, the physical reed; a state of 1
/// is the B flat clarinet. 3: listening; a state of 1 or 2 is heard as from one point. 4: the breath response; in an earlier
/// state breath is physical and the tuning natural, unless it says otherwise. 5: life and vibrato; in an earlier state a held note
/// stands still and the mod wheel does nothing. 6: the onset spread; in an earlier state all players begin a note at once.
pub const SCHEMA: u32 = 6;
const SCHEMA_FIELD: &str = "schema";
/// Choices that meant something else before a layout, or were not there: id, what it was, and the first layout that has it.
const BEFORE: [(&str, &str, u32); 4] =
    [("resp", "phys", 4), ("tune", "nat", 4), ("heard", "point", 3), ("wheel", "none", 5)];
/// Numbers that were 0 before a layout, because they were not there: id, and the first layout that has it.
const NOT_YET: [(&str, u32); 2] = [("life", 5), ("late", 6)];

/// A number's default in this process: the table's, or what the program was started with.
pub(super) fn starting(id: &str, number: &Number) -> f32 {
    let first = LaunchOptions::get().filter(|_| id == "a4").and_then(|options| options.a4_hz);
    first.unwrap_or(number.default)
}

/// The preset that a new instance has: the one without changes, unless the program was started with some.
pub(super) fn first_preset() -> String {
    let has_changes = LaunchOptions::get().is_some_and(LaunchOptions::has_changes);
    let is_plain = |preset: &&Preset| preset.changes().is_empty() && !has_changes;
    factory::all().first().filter(is_plain).map_or_else(String::new, |preset| preset.name.clone())
}

/// Makes a state fit to load, whoever wrote it: numbers inside their ranges, values of the wrong kind and unknown ids
/// dropped, and what the state does not mention set to its default, so that a state means the same in every session.
pub fn mend(state: &mut PluginState) {
    let mut old = std::mem::take(&mut state.params);
    // A state without a layout, or with a broken one, was written by hand: it means what a new one does.
    let schema = state.fields.get(SCHEMA_FIELD).and_then(|text| text.parse::<u32>().ok());
    if schema.is_some() {
        keep_the_feel(&mut old);
    }
    for (id, was, since) in BEFORE {
        if schema.is_some_and(|schema| schema < since) {
            // What was saved then goes on sounding as it did.
            old.entry(id.to_owned()).or_insert_with(|| ParamValue::String(was.to_owned()));
        }
    }
    for (id, since) in NOT_YET {
        if schema.is_some_and(|schema| schema < since) {
            old.entry(id.to_owned()).or_insert(ParamValue::F32(0.0));
        }
    }
    for parameter in PARAMETERS {
        let value = mended(parameter, old.remove(parameter.id));
        state.params.insert(parameter.id.to_owned(), value);
    }
    mend_field(
        state,
        "serial",
        |text: String| {
            if u64::from_str_radix(&text, 16).is_ok() { text } else { String::new() }
        },
    );
    mend_field(state, "midiport", |text: String| text.chars().take(256).collect());
    mend_field(state, "take", |text: String| text);
    mend_field(state, "instrumentfile", |text: String| text.chars().take(instrument::PATH_MOST).collect());
    // A state from before presets has none.
    mend_field(state, "preset", |name: String| name.chars().take(NAME_MOST).collect());
    // A state from before links has none.
    mend_field(state, "links", controllers::mended);
    // A state from before own curves has none: all sources follow the common one.
    mend_field(state, "curves", SourceCurves::mended);
    // A state from before scales has none.
    mend_field(state, "scale", SavedScale::mended);
    // A state from before alterations has none: the bore is as it was built.
    mend_field(state, "holes", |saved: SavedAlterations| saved);
    mend_field(state, "calibration", SavedCalibration::mended);
    // A state from before microphones has 0, which no room is.
    mend_field(state, "roomlevel", |floor: f32| {
        if floor < 0.0 { RoomFloor::mended(floor) } else { RoomFloor::mended(f32::NAN) }
    });
    mend_field(state, "window", WindowState::mended);
    // An older schema lacks what it lacks; a newer one is read as far as its ids are known here.
    state.fields.insert(SCHEMA_FIELD.to_owned(), SCHEMA.to_string());
}

/// Puts what no loaded state brings back to its default, before a state is saved.
pub fn without_moments(state: &mut PluginState) {
    for parameter in PARAMETERS.iter().filter(|parameter| !parameter.is_restored) {
        state.params.insert(parameter.id.to_owned(), mended(parameter, None));
    }
}

/// A state that was saved before *Feel place* and *Feel mark* were there feels as it did: its *Feel contrast* moved the angles too,
/// and the flow law had no mark.
fn keep_the_feel(old: &mut BTreeMap<String, ParamValue>) {
    let Some(ParamValue::F32(contrast)) = old.get("contr") else { return };
    let contrast = *contrast;
    if !old.contains_key("place") {
        old.insert("place".to_owned(), ParamValue::F32(contrast));
        old.entry("mark".to_owned()).or_insert(ParamValue::F32(0.0));
    }
}

// The framework's parameter pointers are raw; they point into the parameters.
#[allow(unsafe_code)]
impl ChalumeauParams {
    /// All that a project saves, without the controls of the moment. Not for the audio thread: allocates and locks.
    pub fn saved(&self) -> PluginState {
        let value = |pointer: ParamPtr| {
            // SAFETY: the pointer leads into `self`, and the getters read atomics.
            unsafe {
                match pointer {
                    ParamPtr::FloatParam(param) => ParamValue::F32((*param).unmodulated_plain_value()),
                    ParamPtr::IntParam(param) => ParamValue::I32((*param).unmodulated_plain_value()),
                    ParamPtr::BoolParam(param) => ParamValue::Bool((*param).unmodulated_plain_value()),
                    ParamPtr::EnumParam(param) => {
                        ParamValue::String((*param).unmodulated_plain_id().unwrap_or_default().to_owned())
                    }
                }
            }
        };
        let params = self.param_map().into_iter().map(|(id, pointer, _)| (id, value(pointer))).collect();
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let mut state = PluginState { version, params, fields: self.serialize_fields() };
        without_moments(&mut state);
        state
    }

    /// Puts a saved state on the parameters, made fit by `mend`. For a start without a host, before anything plays: nobody is told.
    /// Not for the audio thread: allocates and locks.
    pub fn restore(&self, mut state: PluginState) {
        mend(&mut state);
        for (id, pointer, _) in self.param_map() {
            // SAFETY: the pointer leads into `self`, and the setters store atomics.
            unsafe {
                match (pointer, state.params.get(&id)) {
                    (ParamPtr::FloatParam(param), Some(&ParamValue::F32(value))) => {
                        (*param)._internal_set_plain_value(value);
                    }
                    (ParamPtr::IntParam(param), Some(&ParamValue::I32(value))) => {
                        (*param)._internal_set_plain_value(value);
                    }
                    (ParamPtr::BoolParam(param), Some(&ParamValue::Bool(value))) => {
                        (*param)._internal_set_plain_value(value);
                    }
                    (ParamPtr::EnumParam(param), Some(ParamValue::String(id))) => {
                        (*param).set_from_id(id);
                    }
                    // `mend` leaves none of another kind.
                    _ => {}
                }
            }
        }
        self.deserialize_fields(&state.fields);
    }
}

/// A parameter's value as it may be, or its default.
fn mended(parameter: &Parameter, saved: Option<ParamValue>) -> ParamValue {
    let saved = saved.filter(|_| parameter.is_restored);
    match parameter.kind {
        Kind::Number(number) => ParamValue::F32(match saved {
            Some(ParamValue::F32(value)) if value.is_finite() => value.clamp(number.min, number.max),
            _ => starting(parameter.id, &number),
        }),
        Kind::Whole(whole) => ParamValue::I32(match saved {
            Some(ParamValue::I32(value)) => value.clamp(whole.min, whole.max),
            _ => whole.default,
        }),
        Kind::Switch(switch) => ParamValue::Bool(match saved {
            Some(ParamValue::Bool(value)) => value,
            _ => switch.default,
        }),
        Kind::Choice(choice) => ParamValue::String(match saved {
            Some(ParamValue::String(value)) if choice.all.iter().any(|(id, _)| *id == value) => value,
            _ => choice.all[choice.default].0.to_owned(),
        }),
        Kind::Status(_) => ParamValue::Bool(false),
    }
}

/// A field as it may be, or as it is by default.
fn mend_field<T: Default + Serialize + DeserializeOwned>(
    state: &mut PluginState,
    id: &str,
    mended: impl Fn(T) -> T,
) {
    let value = state.fields.get(id).and_then(|text| serde_json::from_str(text).ok());
    if let Ok(text) = serde_json::to_string(&mended(value.unwrap_or_default())) {
        state.fields.insert(id.to_owned(), text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_saved_is_restored() {
        let (old, new) = (ChalumeauParams::default(), ChalumeauParams::default());
        let defaults = serde_json::to_string(&old.saved()).unwrap();
        let mut state = old.saved();
        for (id, value) in [
            ("stren", ParamValue::F32(3.25)),
            ("transp", ParamValue::I32(-2)),
            ("reedc", ParamValue::Bool(false)),
            ("instr", ParamValue::String("bass".to_owned())),
            ("arm", ParamValue::Bool(true)),
        ] {
            state.params.insert(id.to_owned(), value);
        }
        old.restore(state);
        old.set_preset_name("Mine");
        new.restore(old.saved());
        assert!(new.embouchure.strength.value() == 3.25 && new.tuning.transpose.value() == -2);
        assert!(!new.reed.coupled.value() && new.instrument.key() == "bass" && new.preset_name() == "Mine");
        assert!(!new.knob.arm.value(), "an armed knob is not restored");
        let texts = [&old, &new].map(|params| serde_json::to_string(&params.saved()).unwrap());
        assert!(texts[0] == texts[1] && texts[0] != defaults);
    }

    #[test]
    fn what_a_state_does_not_mention_is_as_in_a_new_project() {
        let params = ChalumeauParams::default();
        let mut state =
            PluginState { version: String::new(), params: BTreeMap::new(), fields: BTreeMap::new() };
        mend(&mut state);
        let kept = params.serialize_fields();
        assert!(kept.contains_key("holes"));
        for id in kept.keys() {
            assert!(state.fields.contains_key(id), "{id} stays as it was in the project before");
        }
    }

    #[test]
    fn an_old_project_is_played_as_it_was() {
        let choices = |schema: Option<u32>, tune: Option<&str>| {
            let params = tune.map(|id| ("tune".to_owned(), ParamValue::String(id.to_owned())));
            let fields = schema.map(|schema| (SCHEMA_FIELD.to_owned(), schema.to_string()));
            let mut state = PluginState {
                version: String::new(),
                params: params.into_iter().collect(),
                fields: fields.into_iter().collect(),
            };
            mend(&mut state);
            ["resp", "tune"].map(|id| match &state.params[id] {
                ParamValue::String(choice) => choice.clone(),
                _ => String::new(),
            })
        };
        for schema in [1, 2, 3] {
            assert_eq!(choices(Some(schema), None), ["phys", "nat"]);
            assert_eq!(choices(Some(schema), Some("temp")), ["phys", "temp"]);
        }
        assert_eq!(choices(Some(SCHEMA), None), ["play", "temp"]);
        assert_eq!(choices(None, Some("nat")), ["play", "nat"]);
    }

    #[test]
    fn any_state_is_mended() {
        let mut state = PluginState {
            version: String::new(),
            params: BTreeMap::from([
                ("full".to_owned(), ParamValue::F32(99.0)),
                ("zeta".to_owned(), ParamValue::F32(f32::NAN)),
                ("lip".to_owned(), ParamValue::Bool(true)),
                ("tune".to_owned(), ParamValue::String("just".to_owned())),
                ("reedc".to_owned(), ParamValue::Bool(false)),
                ("gone".to_owned(), ParamValue::I32(3)),
                ("arm".to_owned(), ParamValue::Bool(true)),
                ("rec".to_owned(), ParamValue::Bool(true)),
                ("knob".to_owned(), ParamValue::String("osc".to_owned())),
                ("law".to_owned(), ParamValue::String("strong".to_owned())),
                ("trial".to_owned(), ParamValue::I32(99)),
                ("ceil".to_owned(), ParamValue::F32(9e9)),
            ]),
            fields: BTreeMap::from([
                ("schema".to_owned(), "rubbish".to_owned()),
                ("serial".to_owned(), "\"/dev/ttyUSB0\"".to_owned()),
                (
                    "calibration".to_owned(),
                    "{\"rest_deg\":1e99,\"travel_deg\":1.0,\"dead_deg\":[1,5]}".to_owned(),
                ),
            ]),
        };
        mend(&mut state);
        assert_eq!(state.params.len(), PARAMETERS.len());
        assert!(matches!(state.params["full"], ParamValue::F32(20.0)));
        assert!(matches!(state.params["zeta"], ParamValue::F32(0.3)));
        assert!(matches!(state.params["lip"], ParamValue::F32(1.0)));
        assert!(matches!(state.params["reedc"], ParamValue::Bool(false)));
        assert!(matches!(&state.params["tune"], ParamValue::String(id) if id == "temp"));
        assert_eq!(state.fields["schema"], SCHEMA.to_string());
        for id in ["arm", "rec"] {
            assert!(
                matches!(state.params[id], ParamValue::Bool(false)),
                "{id} is never on in a loaded state"
            );
        }
        assert!(matches!(&state.params["knob"], ParamValue::String(id) if id == "osc"));
        assert!(matches!(&state.params["law"], ParamValue::String(id) if id == "flow"));
        assert!(matches!(state.params["trial"], ParamValue::I32(16)));
        assert!(matches!(state.params["ceil"], ParamValue::F32(250.0)));
        assert_eq!(state.fields["serial"], "\"\"", "a path is no serial number");
        assert!(state.fields["calibration"].contains("120.0"), "{}", state.fields["calibration"]);
    }

    #[test]
    fn a_saved_state_has_nothing_of_the_moment() {
        let on = || ParamValue::Bool(true);
        let params = ["arm", "rec", "panic", "replay"].map(|id| (id.to_owned(), on()));
        let mut state =
            PluginState { version: String::new(), params: BTreeMap::from(params), fields: BTreeMap::new() };
        without_moments(&mut state);
        for (id, stays) in [("arm", false), ("rec", false), ("panic", false), ("replay", true)] {
            assert!(matches!(state.params[id], ParamValue::Bool(on) if on == stays), "{id}");
        }
    }

    #[test]
    fn a_state_from_before_place_and_mark_feels_as_it_did() {
        let old = [("contr", 5.0)];
        let new = [("contr", 5.0), ("place", 2.0), ("mark", 8.0)];
        for (schema, saved, wanted) in [
            (Some("4"), &old[..], [5.0, 5.0, 0.0]),
            (Some("5"), &new[..], [5.0, 2.0, 8.0]),
            // By hand.
            (None, &old[..], [5.0, 1.0, 9.0]),
            (None, &[], [3.0, 1.0, 9.0]),
        ] {
            let params = saved.iter().map(|&(id, value)| (id.to_owned(), ParamValue::F32(value))).collect();
            let fields =
                schema.map(|schema| (SCHEMA_FIELD.to_owned(), schema.to_owned())).into_iter().collect();
            let mut state = PluginState { version: String::new(), params, fields };
            mend(&mut state);
            for (id, wanted) in ["contr", "place", "mark"].into_iter().zip(wanted) {
                assert!(
                    matches!(state.params[id], ParamValue::F32(value) if value == wanted),
                    "{saved:?} {id}"
                );
            }
        }
    }

    #[test]
    fn what_was_saved_before_listening_is_heard_as_it_was() {
        for (schema, heard) in [("1", "point"), ("2", "point"), ("3", "all")] {
            let mut state = PluginState {
                version: String::new(),
                params: BTreeMap::new(),
                fields: BTreeMap::from([("schema".to_owned(), schema.to_owned())]),
            };
            mend(&mut state);
            assert!(matches!(&state.params["heard"], ParamValue::String(id) if id == heard), "{schema}");
        }
    }

    #[test]
    fn what_was_saved_before_life_or_the_onset_spread_has_none() {
        for (schema, life, late) in [("4", 0.0, 0.0), ("5", 1.0, 0.0), ("6", 1.0, 25.0)] {
            let fields = BTreeMap::from([(SCHEMA_FIELD.to_owned(), schema.to_owned())]);
            let mut state = PluginState { version: String::new(), params: BTreeMap::new(), fields };
            mend(&mut state);
            for (id, wanted) in [("life", life), ("late", late)] {
                assert!(
                    matches!(state.params[id], ParamValue::F32(value) if value == wanted),
                    "{schema} {id}"
                );
            }
        }
    }
}
