//! The framework's parameters, made from the table: name, range, unit, default and texts are looked up by id.

use std::sync::{Arc, RwLock};

use nice_plug::prelude::*;

use crate::parameters::{self, Kind, Number, Parameter, Switch, Whole};

// PANIC: an id that is not in the table, or is of another kind there, is a mistake in the program. The ids are literals in
// this folder, and every one of them is looked up whenever parameters are made, first of all by the tests.
fn of(id: &str) -> &'static Parameter {
    parameters::find(id).unwrap_or_else(|| panic!("no parameter {id} in the table"))
}

fn wrong(id: &str) -> ! {
    panic!("parameter {id} is of another kind in the table")
}

/// A number of the table; `start` may replace its default.
pub(super) fn number_from(id: &str, start: impl FnOnce(&Number) -> f32) -> FloatParam {
    let parameter = of(id);
    let Kind::Number(number) = parameter.kind else { wrong(id) };
    let range = FloatRange::Linear { min: number.min, max: number.max };
    let param = FloatParam::new(parameter.name, start(&number), range)
        .with_unit(number.unit)
        .with_value_to_string(Arc::new(move |value| number.text(value)))
        .with_string_to_value(Arc::new(move |text| number.parse(text)));
    if parameter.is_automatable { param } else { param.non_automatable() }
}

/// A number of the table.
pub(super) fn number(id: &str) -> FloatParam {
    number_from(id, |number| number.default)
}

/// A whole number of the table.
pub(super) fn whole(id: &str) -> IntParam {
    let parameter = of(id);
    let Kind::Whole(whole) = parameter.kind else { wrong(id) };
    let Whole { min, max, default, unit } = whole;
    let param = IntParam::new(parameter.name, default, IntRange::Linear { min, max })
        .with_unit(unit)
        .with_value_to_string(Arc::new(move |value| whole.text(value)))
        .with_string_to_value(Arc::new(move |text| whole.parse(text)));
    if parameter.is_automatable { param } else { param.non_automatable() }
}

/// A switch of the table; `start` may replace its default.
pub(super) fn switch_from(id: &str, start: impl FnOnce(bool) -> bool) -> BoolParam {
    let parameter = of(id);
    let Kind::Switch(switch) = parameter.kind else { wrong(id) };
    let Switch { default, .. } = switch;
    let param = BoolParam::new(parameter.name, start(default))
        .with_value_to_string(Arc::new(move |on| switch.text(on).to_owned()))
        .with_string_to_value(Arc::new(move |text| switch.parse(text)));
    if parameter.is_automatable { param } else { param.non_automatable() }
}

/// A switch of the table.
pub(super) fn switch(id: &str) -> BoolParam {
    switch_from(id, |default| default)
}

/// A choice of the table; `start` may replace its default. The framework takes texts and ids from the enum; a test holds
/// them to the table.
pub(super) fn choice_from<T: Enum + PartialEq + 'static>(
    id: &str,
    start: impl FnOnce(T) -> T,
) -> EnumParam<T> {
    let parameter = of(id);
    let Kind::Choice(choice) = parameter.kind else { wrong(id) };
    let param = EnumParam::new(parameter.name, start(T::from_index(choice.default)));
    if parameter.is_automatable { param } else { param.non_automatable() }
}

/// A choice of the table.
pub(super) fn choice<T: Enum + PartialEq + 'static>(id: &str) -> EnumParam<T> {
    choice_from(id, |default| default)
}

/// A read-only status: `text` is what it says.
pub(super) fn status(id: &str, text: Arc<RwLock<String>>) -> BoolParam {
    let parameter = of(id);
    let Kind::Status(_) = parameter.kind else { wrong(id) };
    BoolParam::new(parameter.name, false)
        .with_value_to_string(Arc::new(move |_| {
            text.read().map_or_else(|_| String::new(), |text| text.clone())
        }))
        .with_string_to_value(Arc::new(|_| Some(false)))
        .non_automatable()
}

/// Where a status is written; says first what the table says.
pub(super) fn status_text(id: &str) -> Arc<RwLock<String>> {
    let Kind::Status(first) = of(id).kind else { wrong(id) };
    Arc::new(RwLock::new(first.to_owned()))
}
