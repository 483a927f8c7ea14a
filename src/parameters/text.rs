//! Values as text, and text as values.

use crate::parameters::{Choice, Kind, Number, Parameter, Switch, Value, Whole};

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
        let text = text.trim();
        let unit = self.unit.trim();
        let bare = text
            .len()
            .checked_sub(unit.len())
            .and_then(|at| text.split_at_checked(at))
            .filter(|(_, tail)| tail.eq_ignore_ascii_case(unit))
            .map_or(text, |(head, _)| head);
        let shown: Option<f32> = bare.trim().replace(',', ".").parse().ok();
        shown.filter(|value| value.is_finite()).map(|shown| shown / self.scale)
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
}

impl Switch {
    /// A value as text.
    pub fn text(&self, on: bool) -> &'static str {
        if on { self.on } else { self.off }
    }

    /// Reads its own texts, on and off, true and false, 1 and 0.
    pub fn parse(&self, text: &str) -> Option<bool> {
        let is = |words: [&str; 4]| words.iter().any(|word| text.trim().eq_ignore_ascii_case(word));
        if is([self.on, "on", "true", "1"]) {
            Some(true)
        } else if is([self.off, "off", "false", "0"]) {
            Some(false)
        } else {
            None
        }
    }
}

impl Choice {
    /// Reads a text or an id.
    pub fn parse(&self, text: &str) -> Option<usize> {
        let is = |word: &str| text.trim().eq_ignore_ascii_case(word);
        self.all.iter().position(|&(id, name)| is(name) || is(id))
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
            Kind::Number(number) => format!("{}{}", number.text(number.default), number.unit),
            Kind::Whole(whole) => format!("{}{}", whole.text(whole.default), whole.unit),
            Kind::Choice(choice) => choice.all[0].1.to_owned(),
            Kind::Switch(switch) => switch.text(switch.default).to_owned(),
            Kind::Status(first) => first.to_owned(),
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

    /// Reads a value inside the range, as a host's text entry does, or says what would be right.
    pub fn read(&self, text: &str) -> Result<Value, String> {
        let Self { id, name, .. } = self;
        match self.kind {
            Kind::Number(number) => match number.parse(text) {
                Some(value) if number.contains(value) => Ok(Value::Number(value)),
                Some(_) => Err(format!("{id} ({name}) must lie in {}, got {text}", number.range())),
                None => Err(format!("{id} ({name}) must be a number in {}, got {text:?}", number.range())),
            },
            Kind::Choice(choice) => choice
                .parse(text)
                .map(Value::Choice)
                .ok_or_else(|| format!("{id} ({name}) must be one of {}, got {text:?}", self.range())),
            Kind::Switch(switch) => switch
                .parse(text)
                .map(Value::Switch)
                .ok_or_else(|| format!("{id} ({name}) must be one of {}, got {text:?}", self.range())),
            Kind::Whole(_) | Kind::Status(_) => Err(format!("{id} ({name}) is not read from text")),
        }
    }
}
