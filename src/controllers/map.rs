//! Controllers linked to parameters, as text: what *Learn* makes, what a project saves, what `--controllers` reads.
//!
//! ```toml
//! format = 1
//! name = "Two knobs and a pedal"
//!
//! [[link]]
//! controller = 21
//! parameter = "growl"
//!
//! [[link]]
//! controller = "pressure"
//! parameter = "vib"
//! from = "0 %"
//! to = "60 %"
//! curve = 2.0
//! ```

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use crate::parameters::spelling::nearest;
use crate::parameters::{self, Kind, PARAMETERS, Parameter, Sets, Value};
use chalumeau_core::control::midi::links::{Link, MOST, Source, Target};
use chalumeau_core::instrument::Settings;
use chalumeau_core::units::clamped_or;

/// Layout of the text.
const FORMAT: i64 = 1;
/// Range of a curve's exponent.
const CURVES: (f32, f32) = (0.2, 5.0);

/// A controller, tied to a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterLink {
    /// What moves.
    pub source: Source,
    /// What is moved.
    pub parameter: &'static Parameter,
    /// The parameter's value at the controller's 0, in its own unit.
    pub low: f32,
    /// The same at 127; it may lie below `low`.
    pub high: f32,
    /// Exponent of the way from low to high, 0.2..=5; 1 is straight.
    pub curve: f32,
}

/// Controllers that belong together, such as those of one device.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ControllerMap {
    /// What it is called.
    pub name: String,
    /// What it is for.
    pub shows: String,
    /// The links, in order.
    pub links: Vec<ParameterLink>,
    /// Parameters that the device needs at other values, such as its softest breath.
    pub values: Vec<(&'static Parameter, Value)>,
}

/// Why a text links no controllers.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct MapError {
    /// Where, from 1.
    pub line: usize,
    /// What is wrong, and what would be right.
    pub what: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MapText {
    format: Spanned<i64>,
    #[serde(default)]
    name: String,
    #[serde(default)]
    shows: String,
    #[serde(default)]
    link: Vec<Spanned<LinkText>>,
    #[serde(default)]
    parameters: BTreeMap<String, Spanned<toml::Value>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LinkText {
    controller: Spanned<toml::Value>,
    parameter: Spanned<String>,
    from: Option<Spanned<toml::Value>>,
    to: Option<Spanned<toml::Value>>,
    curve: Option<Spanned<f32>>,
}

/// Numbers that a controller may move: those that a host may automate and that shape the sound, and the breath.
pub fn linkable() -> impl Iterator<Item = &'static Parameter> {
    PARAMETERS.iter().filter(|parameter| target(parameter).is_some())
}

/// What a link to a parameter moves; `None` if no controller may move it.
fn target(parameter: &Parameter) -> Option<Target> {
    match parameter.sets {
        _ if parameter.id == "breath" => Some(Target::Breath),
        Some(Sets::Number(number)) if parameter.is_automatable => Some(Target::Number(number)),
        _ => None,
    }
}

impl ParameterLink {
    /// Over the whole range of a parameter; `None` if no controller may move it, or if the source steers MIDI itself.
    pub fn whole(source: Source, parameter: &'static Parameter) -> Option<Self> {
        let Kind::Number(number) = parameter.kind else { return None };
        let is_linkable = target(parameter).is_some() && source.is_free();
        is_linkable.then_some(Self { source, parameter, low: number.min, high: number.max, curve: 1.0 })
    }

    /// The same as the instrument takes it, with the parameter's own value in `settings`. Real-time safe.
    pub fn link(&self, settings: &Settings) -> Option<Link> {
        let target = target(self.parameter)?;
        let own = match target {
            Target::Breath => 0.0,
            Target::Number(number) => *settings.clone().number(number),
        };
        Some(Link { source: self.source, target, low: self.low, high: self.high, curve: self.curve, own })
    }

    /// The parameter's value at a controller's value, 0..=127.
    pub fn value(&self, raw: u8) -> f32 {
        let Self { source, low, high, curve, .. } = *self;
        Link { source, target: Target::Breath, low, high, curve, own: 0.0 }.value(raw)
    }

    /// Every number as it may be: inside the parameter's range, finite.
    pub fn mended(self) -> Self {
        let Kind::Number(number) = self.parameter.kind else { return self };
        let inside = |x: f32, default: f32| clamped_or(x, number.min, number.max, default);
        Self {
            low: inside(self.low, number.min),
            high: inside(self.high, number.max),
            curve: clamped_or(self.curve, CURVES.0, CURVES.1, 1.0),
            ..self
        }
    }
}

/// A source as a user reads it.
pub fn source_name(source: Source) -> String {
    match source {
        Source::Pressure => "Channel pressure".to_owned(),
        Source::Controller(cc) => format!("CC{cc}"),
    }
}

/// Links as the instrument takes them; those beyond the most that fit are left out. Real-time safe.
pub fn as_links(links: &[ParameterLink], settings: &Settings) -> [Option<Link>; MOST] {
    std::array::from_fn(|at| links.get(at).and_then(|link| link.link(settings)))
}

impl ControllerMap {
    /// What it sets a parameter to; `None` where the device needs nothing.
    pub fn value(&self, parameter: &Parameter) -> Option<Value> {
        self.values.iter().find(|(other, _)| *other == parameter).map(|(_, value)| *value)
    }

    /// Reads the text of a map. What is not known is refused with its line: a map is never half applied.
    pub fn parse(text: &str) -> Result<Self, MapError> {
        let refuse = |offset: usize, what: String| {
            let line = text.get(..offset).map_or(1, |before| 1 + before.matches('\n').count());
            MapError { line, what }
        };
        let read: MapText = toml::from_str(text)
            .map_err(|error| refuse(error.span().map_or(0, |span| span.start), error.message().to_owned()))?;
        if *read.format.get_ref() != FORMAT {
            let what = format!("format is {}; this Chalumeau reads {FORMAT}", read.format.get_ref());
            return Err(refuse(read.format.span().start, what));
        }
        let mut map = Self { name: read.name, shows: read.shows, ..Self::default() };
        if let Some(extra) = read.link.get(MOST) {
            return Err(refuse(
                extra.span().start,
                format!("there are {} links; there may be {MOST}", read.link.len()),
            ));
        }
        for link in &read.link {
            let link = link.get_ref();
            let source = read_source(link.controller.get_ref())
                .map_err(|what| refuse(link.controller.span().start, what))?;
            let at = link.parameter.span().start;
            let parameter = find(link.parameter.get_ref()).map_err(|what| refuse(at, what))?;
            let whole = ParameterLink::whole(source, parameter).ok_or_else(|| {
                refuse(at, format!("no controller can move {} ({})", parameter.name, parameter.id))
            })?;
            let end = |text: &Option<Spanned<toml::Value>>, usual: f32| match text {
                None => Ok(usual),
                Some(text) => {
                    number(parameter, text.get_ref()).map_err(|what| refuse(text.span().start, what))
                }
            };
            let curve = match &link.curve {
                None => 1.0,
                Some(curve) if (CURVES.0..=CURVES.1).contains(curve.get_ref()) => *curve.get_ref(),
                Some(curve) => {
                    let what =
                        format!("curve is {}; it may be {} to {}", curve.get_ref(), CURVES.0, CURVES.1);
                    return Err(refuse(curve.span().start, what));
                }
            };
            let (low, high) = (end(&link.from, whole.low)?, end(&link.to, whole.high)?);
            map.links.push(ParameterLink { low, high, curve, ..whole });
        }
        for (id, value) in &read.parameters {
            let parameter = parameters::find(id).filter(|parameter| parameter.is_in_presets());
            let at = value.span().start;
            let parameter = parameter.ok_or_else(|| {
                refuse(
                    at,
                    format!("{id:?} is no parameter that can be set here; `chalumeau parameters` lists all"),
                )
            })?;
            let value = parameter.read(&bare(value.get_ref())).map_err(|what| refuse(at, what))?;
            map.values.push((parameter, value));
        }
        Ok(map)
    }

    /// Reads a file.
    pub fn load(path: &Path) -> Result<Self, String> {
        let shown = path.display();
        let text = crate::text_file::read(path).map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => {
                format!(
                    "there is no file {shown}; `chalumeau controllers list` lists the devices that need none"
                )
            }
            _ => format!("{shown}: {error}"),
        })?;
        Self::parse(&text).map_err(|error| format!("{shown}: {error}"))
    }

    /// The text that [`parse`](Self::parse) reads.
    pub fn to_text(&self) -> String {
        let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
        let mut text =
            format!("format = {FORMAT}\nname = {}\nshows = {}\n", quoted(&self.name), quoted(&self.shows));
        // Writing into a String does not fail.
        for ParameterLink { source, parameter, low, high, curve } in &self.links {
            let controller = match source {
                Source::Controller(cc) => cc.to_string(),
                Source::Pressure => quoted("pressure"),
            };
            let end = |value: f32| quoted(&parameter.text(Value::Number(value)));
            let _ =
                writeln!(text, "\n[[link]]\ncontroller = {controller}\nparameter = {}", quoted(parameter.id));
            let _ = writeln!(text, "from = {}\nto = {}\ncurve = {curve:?}", end(*low), end(*high));
        }
        if !self.values.is_empty() {
            text.push_str("\n[parameters]\n");
        }
        for (parameter, value) in &self.values {
            let _ = writeln!(text, "{} = {}", parameter.id, quoted(&parameter.text(*value)));
        }
        text
    }
}

fn read_source(value: &toml::Value) -> Result<Source, String> {
    let number_of = |text: &str| text.trim_start_matches(['C', 'c']).parse::<u8>().ok();
    let source = match value {
        toml::Value::String(text) if number_of(text).is_some_and(|cc| cc < 128) => {
            number_of(text).map(Source::Controller)
        }
        toml::Value::Integer(cc) => u8::try_from(*cc).ok().filter(|cc| *cc < 128).map(Source::Controller),
        toml::Value::String(text) if text == "pressure" => Some(Source::Pressure),
        _ => None,
    };
    match source {
        Some(source) if source.is_free() => Ok(source),
        Some(source) => Err(format!(
            "{} cannot be linked, as MIDI needs it for something else; choose another controller",
            source_name(source)
        )),
        None => Err(format!(
            "controller is {value}; it must be the number of a controller, such as 21 for CC21, or \"pressure\""
        )),
    }
}

fn find(id: &str) -> Result<&'static Parameter, String> {
    parameters::find(id).ok_or_else(|| {
        // The window shows names.
        let named = linkable().find(|parameter| parameter.name.eq_ignore_ascii_case(id));
        let near =
            named.map(|parameter| parameter.id).or_else(|| nearest(id, linkable().map(|other| other.id)));
        let meant = near.map_or_else(String::new, |near| format!("did you mean {near:?}? "));
        format!("there is no parameter {id:?}; {meant}`chalumeau parameters` lists them all")
    })
}

/// A value without its quotes.
fn bare(value: &toml::Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

fn number(parameter: &Parameter, value: &toml::Value) -> Result<f32, String> {
    match parameter.read(&bare(value))? {
        Value::Number(number) => Ok(number),
        _ => Err(format!("{value} is no number for {}", parameter.name)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "format = 1\nname = \"Mine\"\n\n[[link]]\n";

    #[test]
    fn every_parameter_that_a_controller_may_move_survives_the_text() {
        let mut links: Vec<ParameterLink> = linkable()
            .filter_map(|parameter| ParameterLink::whole(Source::Controller(21), parameter))
            .collect();
        assert!(links.len() > 30 && links.iter().any(|link| link.parameter.id == "breath"));
        assert!(
            !links.iter().any(|link| ["arm", "ceil", "torque"].contains(&link.parameter.id)),
            "no torque"
        );
        links[0].source = Source::Pressure;
        links[1].curve = 2.5;
        for links in links.chunks(MOST) {
            let map = ControllerMap { name: "All".into(), links: links.to_vec(), ..ControllerMap::default() };
            assert_eq!(ControllerMap::parse(&map.to_text()), Ok(map));
        }
    }

    #[test]
    fn mistakes_name_their_line_and_what_is_right() {
        for (text, line, word) in [
            ("controller = 21\nparameter = \"growll\"\n", 6, "growll"),
            ("controller = 200\nparameter = \"growl\"\n", 5, "number of a controller"),
            ("controller = 64\nparameter = \"growl\"\n", 5, "cannot be linked"),
            ("controller = 21\nparameter = \"Growl\"\n", 6, "did you mean \"growl\"?"),
            ("controller = 21\nparameter = \"tune\"\n", 6, "no controller can move Tuning"),
            ("controller = 21\nparameter = \"arm\"\n", 6, "no controller can move"),
            ("controller = 21\nparameter = \"growl\"\nto = \"loud\"\n", 7, "loud"),
            ("controller = 21\nparameter = \"growl\"\ncurve = 0\n", 7, "0.2 to 5"),
            ("controller = 21\nparameter = \"growl\"\nrange = 3\n", 7, "range"),
        ] {
            let error = ControllerMap::parse(&format!("{HEAD}{text}")).unwrap_err();
            assert_eq!(error.line, line, "{text}: {error}");
            assert!(error.what.contains(word), "{text}: {error}");
        }
        assert!(ControllerMap::parse("format = 2\n").unwrap_err().what.contains("reads 1"));
        assert!(ControllerMap::parse(&"[[link]]\n".repeat(30)).is_err());
    }
}
