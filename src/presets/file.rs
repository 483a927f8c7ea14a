//! The text of a preset: TOML, a head of words and one table of values.
//!
//! Values are the texts that a host shows, such as `"0.900 x"`; plain numbers and switches are read as such texts. What is
//! not known here is refused, with its line: a preset is never half applied.

use std::fmt::Write as _;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::{Preset, checked_name};
use crate::parameters::spelling::nearest;
use crate::parameters::{self, Parameter};

/// Layout of the text. A program reads its own and earlier ones.
pub const FORMAT: i64 = 1;
/// Most tags.
pub const TAGS_MOST: usize = 8;
/// Most characters of author and sentence, each, and of a tag.
pub const TEXT_MOST: usize = 200;

/// Why a text is no preset.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct PresetError {
    /// Where, from 1.
    pub line: usize,
    /// What is wrong, and what would be right.
    pub what: String,
}

/// Keys of the head.
const KEYS: [&str; 6] = ["format", "name", "author", "tags", "shows", "parameters"];

/// See [`Preset::parse`].
pub(super) fn parse(text: &str) -> Result<Preset, PresetError> {
    let at = |offset: usize| text.get(..offset).map_or(1, |before| 1 + before.matches('\n').count());
    let refuse = |offset: usize, what: String| PresetError { line: at(offset), what };
    let table = DeTable::parse(text).map_err(|error| {
        let start = error.span().map_or(0, |span| span.start);
        refuse(start, format!("{}; a preset is a TOML file", error.message()))
    })?;
    let table = table.get_ref();
    for key in table.keys() {
        let name = key.get_ref().as_ref();
        if !KEYS.contains(&name) {
            let meant =
                nearest(name, KEYS).map_or_else(String::new, |near| format!("; did you mean {near}?"));
            let known = KEYS.join(", ");
            return Err(refuse(
                key.span().start,
                format!("{name:?} is no part of a preset, whose parts are {known}{meant}"),
            ));
        }
    }
    let missing = |key: &str, right: &str| refuse(0, format!("{key} is missing; write {right}"));
    let format = table.get("format").ok_or_else(|| missing("format", &format!("format = {FORMAT}")))?;
    match whole(format.get_ref()) {
        Some(number) if (1..=FORMAT).contains(&number) => {}
        Some(number) if number > FORMAT => {
            let what = format!("format {number} is of a newer Chalumeau; this one reads up to {FORMAT}");
            return Err(refuse(format.span().start, what));
        }
        _ => {
            return Err(refuse(
                format.span().start,
                format!("format must be a whole number, {FORMAT} or less"),
            ));
        }
    }
    let words = |key: &str| match table.get(key) {
        None => Ok(String::new()),
        Some(value) => line_of_text(key, value.get_ref()).map_err(|what| refuse(value.span().start, what)),
    };
    let name = table.get("name").ok_or_else(|| missing("name", "name = \"...\""))?;
    let preset_name = line_of_text("name", name.get_ref()).and_then(|text| checked_name(&text));
    let preset_name = preset_name.map_err(|what| refuse(name.span().start, what))?;
    let mut preset =
        Preset { name: preset_name, author: words("author")?, shows: words("shows")?, ..Preset::default() };
    if let Some(tags) = table.get("tags") {
        preset.tags = read_tags(tags.get_ref()).map_err(|what| refuse(tags.span().start, what))?;
    }
    if let Some(values) = table.get("parameters") {
        let Some(values) = values.get_ref().as_table() else {
            return Err(refuse(values.span().start, "parameters must be a table, [parameters]".to_owned()));
        };
        for (key, value) in values {
            let (id, given) = (key.get_ref().as_ref(), value);
            let parameter = known(id).map_err(|what| refuse(key.span().start, what))?;
            let read = text_of(id, given).and_then(|text| parameter.read(&text));
            let value = read.map_err(|what| refuse(given.span().start, what))?;
            preset.values.push((parameter, value));
        }
    }
    let place = |id: &str| parameters::PARAMETERS.iter().position(|parameter| parameter.id == id);
    preset.values.sort_by_key(|(parameter, _)| place(parameter.id));
    Ok(preset)
}

/// The parameter of an id, if a preset may set it.
fn known(id: &str) -> Result<&'static Parameter, String> {
    match parameters::find(id) {
        Some(parameter) if parameter.is_in_presets() => Ok(parameter),
        Some(parameter) => Err(format!("{id} ({}) is not set by presets; take the line out", parameter.name)),
        None => {
            let near = nearest(id, Preset::parameters().map(|parameter| parameter.id));
            let meant = near.map_or_else(String::new, |near| format!("did you mean {near}? "));
            Err(format!("there is no parameter {id:?}; {meant}`chalumeau parameters` lists them all"))
        }
    }
}

fn whole(value: &DeValue) -> Option<i64> {
    let number = value.as_integer()?;
    i64::from_str_radix(number.as_str(), number.radix()).ok()
}

/// A value as the text that a user would type for it.
fn text_of(id: &str, value: &Spanned<DeValue>) -> Result<String, String> {
    match value.get_ref() {
        DeValue::String(text) => Ok(text.to_string()),
        integer @ DeValue::Integer(_) => whole(integer)
            .map(|number| number.to_string())
            .ok_or_else(|| format!("{id} is too large a number")),
        DeValue::Float(number) => Ok(number.as_str().to_owned()),
        DeValue::Boolean(on) => Ok(on.to_string()),
        other => Err(format!("{id} is a {}; it must be a text such as {id} = \"...\"", other.type_str())),
    }
}

fn line_of_text(key: &str, value: &DeValue) -> Result<String, String> {
    let Some(text) = value.as_str().map(str::trim) else {
        return Err(format!("{key} is a {}; it must be a text in quotes", value.type_str()));
    };
    let long = text.chars().count();
    if long > TEXT_MOST {
        return Err(format!("{key} has {long} characters; it may have {TEXT_MOST}"));
    }
    if text.chars().any(char::is_control) {
        return Err(format!("{key} must be one line of plain text"));
    }
    Ok(text.to_owned())
}

fn read_tags(value: &DeValue) -> Result<Vec<String>, String> {
    let list = value.as_array().ok_or("tags must be a list of texts, such as [\"jazz\", \"soft\"]")?;
    if list.len() > TAGS_MOST {
        return Err(format!("there are {} tags; there may be {TAGS_MOST}", list.len()));
    }
    list.iter().map(|tag| line_of_text("tags", tag.get_ref())).collect()
}

/// See [`Preset::to_text`].
pub(super) fn to_text(preset: &Preset) -> String {
    let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
    let tags: Vec<_> = preset.tags.iter().map(|tag| quoted(tag)).collect();
    let mut text = format!("format = {FORMAT}\nname = {}\n", quoted(&preset.name));
    // Writing into a String does not fail.
    let _ = writeln!(text, "author = {}", quoted(&preset.author));
    let _ = writeln!(text, "tags = [{}]", tags.join(", "));
    let _ = writeln!(text, "shows = {}\n\n[parameters]", quoted(&preset.shows));
    for (parameter, value) in &preset.values {
        let _ = writeln!(text, "{} = {}", parameter.id, quoted(&parameter.text(*value)));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Kind, Value};

    const WHOLE: &str = "format = 1\nname = \"Mine\"\ntags = [\"jazz\"]\n\n[parameters]\n";

    #[test]
    fn every_value_of_every_parameter_survives_the_text() {
        for share in [0.0_f32, 0.37, 1.0] {
            let preset = Preset::of("All", None, |parameter| {
                let text = match parameter.kind {
                    Kind::Number(number) => number.text(number.min + share * (number.max - number.min)),
                    Kind::Whole(whole) => whole.text(if share < 0.5 { whole.min } else { whole.max }),
                    Kind::Choice(choice) => {
                        choice.all[(share * (choice.all.len() - 1) as f32) as usize].1.to_owned()
                    }
                    Kind::Switch(switch) => switch.text(share < 0.5).to_owned(),
                    Kind::Status(_) => return None,
                };
                Some(parameter.read(&text).unwrap())
            });
            assert!(preset.changes().len() > 20);
            assert_eq!(Preset::parse(&preset.to_text()), Ok(preset));
        }
    }

    #[test]
    fn numbers_and_switches_may_stand_without_quotes() {
        let text = format!("{WHOLE}stren = 3\nlip = 0.9\nnoise = 40\nreedc = false\nbendr = 12\n");
        let preset = Preset::parse(&text).unwrap();
        let values: Vec<_> =
            preset.changes().iter().map(|(parameter, value)| (parameter.id, *value)).collect();
        let number = Value::Number;
        assert_eq!(
            values,
            [
                ("stren", number(3.0)),
                ("lip", number(0.9)),
                ("reedc", Value::Switch(false)),
                ("noise", number(0.4)),
                ("bendr", Value::Whole(12))
            ]
        );
    }

    #[test]
    fn a_broken_preset_names_its_line_and_what_to_do() {
        for (text, line, says) in [
            ("format = 1\nname = \"a\"\n[parameters]\nlipp = 1\n", 4, "did you mean lip?"),
            ("format = 1\nname = \"a\"\n[parameters]\nlip = 9\n", 4, "must lie in 0.6..1.4 x, got 9"),
            ("format = 1\nname = \"a\"\n[parameters]\nlip = [1]\n", 4, "it must be a text"),
            ("format = 1\nname = \"a\"\n[parameters]\nbendr = 99\n", 4, "a whole number in 0..48 st"),
            (
                "format = 1\nname = \"a\"\n[parameters]\narm = true\n",
                4,
                "arm (Arm knob) is not set by presets",
            ),
            ("format = 1\nname = \"a\"\nparameters = 3\n", 3, "must be a table"),
            ("format = 1\nnam = \"a\"\n", 2, "did you mean name?"),
            ("format = 2\nname = \"a\"\n", 1, "newer Chalumeau"),
            ("format = \"x\"\nname = \"a\"\n", 1, "must be a whole number"),
            ("name = \"a\"\n", 1, "format is missing; write format = 1"),
            ("format = 1\n", 1, "name is missing"),
            ("format = 1\nname = 7\n", 2, "name is a integer"),
            ("format = 1\nname = \"\"\n", 2, "needs a name"),
            ("format = 1\nname = \"a\"\ntags = \"jazz\"\n", 3, "must be a list"),
            ("format = 1\nname = \"a\"\nshows = \"a\\nb\"\n", 3, "one line"),
            ("format = 1\nname = \"a\n", 2, "a preset is a TOML file"),
            ("format = 1\nname = \"a\"\nname = \"b\"\n", 3, "duplicate key"),
        ] {
            let error = Preset::parse(text).unwrap_err();
            assert!(error.line == line && error.what.contains(says), "{text:?}: {error}");
        }
    }

    #[test]
    fn no_cut_and_no_damage_of_a_preset_is_half_applied() {
        let whole = format!("{WHOLE}stren = 3\nlip = 0.9\ngain = \"-3.0 dB\"\n");
        let known = Preset::parse(&whole).unwrap();
        for cut in 0..whole.len() {
            if let Ok(preset) = Preset::parse(&whole[..cut]) {
                // Only at the end of a line, or of a number, is a shorter text a preset.
                assert!(preset.changes().len() <= known.changes().len());
            }
        }
        let mut random = fastrand::Rng::with_seed(7);
        for _ in 0..2_000 {
            let mut bytes = whole.clone().into_bytes();
            let at = random.usize(..bytes.len());
            bytes[at] = random.u8(..);
            let Ok(text) = String::from_utf8(bytes) else { continue };
            // A text is refused whole, or every value of it lies in its range.
            if let Ok(preset) = Preset::parse(&text) {
                for (parameter, value) in preset.changes() {
                    assert!((0.0..=1.0).contains(&parameter.normalized(*value)), "{text}");
                }
            }
        }
    }
}
