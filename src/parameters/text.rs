//! Values as text, and text as values.
//!
//! Texts are written in one way, and read back to the same step. What a user types is read generously: `spelling` has the
//! forms.

use crate::parameters::spelling::{bare_number, begins_with, canonical};
use crate::parameters::{Choice, Kind, Number, Parameter, Switch, Value, Whole};

/// Texts that choices had before, which presets of users still have: id, the text then, and now.
const FORMER: [(&str, &str, &str); 1] = [("rface", "Physical", "Measured")];

/// A text as the choice has it now.
fn of_now<'a>(id: &str, text: &'a str) -> &'a str {
    let is_former = |(of, then, _): &&(&str, &str, &str)| *of == id && text.trim().eq_ignore_ascii_case(then);
    FORMER.iter().find(is_former).map_or(text, |(.., now)| now)
}

impl Number {
    /// A value as text, without its unit.
    pub fn text(&self, value: f32) -> String {
        let (shown, digits) = (value * self.scale, self.digits);
        // A small negative number would be shown as -0.
        let step = 10_f32.powi(digits as i32);
        let shown = if (shown * step).round() == 0.0 { 0.0 } else { shown };
        format!("{shown:.digits$}")
    }

    /// Reads a number with or without its unit; a decimal comma is allowed. Does not check the range.
    pub fn parse(&self, text: &str) -> Option<f32> {
        let shown: f32 = bare_number(text, self.unit).parse().ok()?;
        shown.is_finite().then_some(shown / self.scale)
    }

    /// Whether the value lies in the range.
    pub fn contains(&self, value: f32) -> bool {
        (self.min..=self.max).contains(&value)
    }

    /// The range as short as it can be written, with its unit: `10..40 °C`.
    pub fn range(&self) -> String {
        // Through the text: 100 times a single-precision number shows its last bit.
        let end = |value: f32| {
            let text = self.text(value);
            if text.contains('.') {
                text.trim_end_matches('0').trim_end_matches('.').to_owned()
            } else {
                text
            }
        };
        format!("{}..{}{}", end(self.min), end(self.max), self.unit)
    }
}

impl Whole {
    /// A value as text, without its unit.
    pub fn text(&self, value: i32) -> String {
        value.to_string()
    }

    /// Whether a number lies inside the range.
    fn contains(&self, value: f64) -> bool {
        (f64::from(self.min)..=f64::from(self.max)).contains(&value)
    }

    /// Reads a whole number with or without its unit; `5.0` is one, `5.5` is none. What lies outside the range becomes its
    /// end.
    pub fn parse(&self, text: &str) -> Option<i32> {
        let value: f64 = bare_number(text, self.unit).parse().ok()?;
        (value.is_finite() && value.fract() == 0.0)
            .then(|| value.clamp(f64::from(self.min), f64::from(self.max)) as i32)
    }
}

impl Switch {
    /// A value as text.
    pub fn text(&self, on: bool) -> &'static str {
        if on { self.on } else { self.off }
    }

    /// Reads its own texts, on and off, yes and no, true and false, 1 and 0.
    pub fn parse(&self, text: &str) -> Option<bool> {
        let is = |words: [&str; 5]| words.iter().any(|word| text.trim().eq_ignore_ascii_case(word));
        if is([self.on, "on", "yes", "true", "1"]) {
            Some(true)
        } else if is([self.off, "off", "no", "false", "0"]) {
            Some(false)
        } else {
            None
        }
    }
}

impl Choice {
    /// Reads a text, an id, or the first words of one text alone: `Bass` is *Bass clarinet*.
    pub fn parse(&self, text: &str) -> Option<usize> {
        let typed = canonical(text);
        if typed.is_empty() {
            return None;
        }
        let exact =
            self.all.iter().position(|&(id, name)| typed == canonical(name) || typed == canonical(id));
        exact.or_else(|| {
            let mut begun = (0..self.all.len()).filter(|&at| begins_with(self.all[at].1, &typed));
            begun.next().filter(|_| begun.next().is_none())
        })
    }
}

impl Parameter {
    /// The unit without its leading space; empty if there is none.
    pub fn unit(&self) -> &'static str {
        match self.kind {
            Kind::Number(number) => number.unit.trim(),
            Kind::Whole(whole) => whole.unit.trim(),
            _ => "",
        }
    }

    /// The default as text, with its unit.
    pub fn default_text(&self) -> String {
        match self.kind {
            Kind::Status(first) => first.to_owned(),
            _ => self.text(self.default_value()),
        }
    }

    /// A value as text, with its unit; empty for one of another kind.
    pub fn text(&self, value: Value) -> String {
        match (self.kind, value) {
            (Kind::Number(number), Value::Number(value)) => format!("{}{}", number.text(value), number.unit),
            (Kind::Whole(whole), Value::Whole(value)) => format!("{}{}", whole.text(value), whole.unit),
            (Kind::Choice(choice), Value::Choice(at)) => {
                choice.all.get(at).map_or_else(String::new, |(_, text)| (*text).to_owned())
            }
            (Kind::Switch(switch), Value::Switch(on)) => switch.text(on).to_owned(),
            _ => String::new(),
        }
    }

    /// The range with its unit, or all choices; empty for a status.
    pub fn range(&self) -> String {
        match self.kind {
            Kind::Number(number) => number.range(),
            Kind::Whole(whole) => format!("{}..{}{}", whole.min, whole.max, whole.unit),
            Kind::Choice(choice) => choice.all.iter().map(|(_, text)| *text).collect::<Vec<_>>().join(", "),
            Kind::Switch(switch) => format!("{}, {}", switch.off, switch.on),
            Kind::Status(_) => String::new(),
        }
    }

    /// Reads a value, or says what would be right. Stricter than a host's text entry: a number outside the range is refused.
    pub fn read(&self, text: &str) -> Result<Value, String> {
        let Self { id, name, .. } = self;
        match self.kind {
            Kind::Number(number) => match number.parse(text) {
                Some(value) if number.contains(value) => Ok(Value::Number(value)),
                Some(_) => Err(format!("{id} ({name}) must lie in {}, got {text}", number.range())),
                None => Err(format!("{id} ({name}) must be a number in {}, got {text:?}", number.range())),
            },
            Kind::Choice(choice) => choice
                .parse(of_now(id, text))
                .map(Value::Choice)
                .ok_or_else(|| format!("{id} ({name}) must be one of {}, got {text:?}", self.range())),
            Kind::Switch(switch) => switch
                .parse(text)
                .map(Value::Switch)
                .ok_or_else(|| format!("{id} ({name}) must be one of {}, got {text:?}", self.range())),
            Kind::Whole(whole) => match bare_number(text, whole.unit).parse::<f64>() {
                Ok(value) if value.fract() == 0.0 && whole.contains(value) => Ok(Value::Whole(value as i32)),
                _ => Err(format!("{id} ({name}) must be a whole number in {}, got {text}", self.range())),
            },
            Kind::Status(_) => Err(format!("{id} ({name}) is not read from text")),
        }
    }
}
