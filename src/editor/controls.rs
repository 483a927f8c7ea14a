//! Parameters, as the editor may see them, and the hands that move them.
//!
//! [`Controls`] is all the editor knows of a host: look, write, and say when a hand begins and ends. Values are
//! normalised, 0..=1; text is the parameter's own both ways. Every widget goes through [`Hands`], which remembers what
//! was done.

use crate::editor::compare::Values;
use crate::editor::history::History;
use crate::editor::terms;

pub use crate::editor::slider::slider;
pub use crate::editor::widgets::{choice, handle, heading, momentary, segments, switch, teach};

/// What a parameter looks like now.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Its name, as hosts list it.
    pub name: String,
    /// Its value, normalised.
    pub value: f32,
    /// Its default, normalised.
    pub default: f32,
    /// Distance from one end to the other in steps: 1 for a switch; `None` for a continuous one.
    pub steps: Option<usize>,
}

/// The host, as the editor sees it.
pub trait Controls {
    /// All parameters, in the order hosts list them.
    fn ids(&self) -> &[&'static str];
    /// A parameter; `None` for an unknown id.
    fn look(&self, id: &str) -> Option<Look>;
    /// A normalised value as text, with its unit.
    fn text(&self, id: &str, value: f32) -> String;
    /// Text as a normalised value, with or without its unit; `None` if it is no such.
    fn parse(&self, id: &str, text: &str) -> Option<f32>;
    /// A hand is on the parameter.
    fn begin(&self, id: &str);
    /// Sets it. Only between [`begin`](Self::begin) and [`end`](Self::end).
    fn set(&self, id: &str, value: f32);
    /// The hand is off.
    fn end(&self, id: &str);
}

/// Text being typed for one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Which.
    pub id: &'static str,
    /// As it stands.
    pub text: String,
    /// It was no value: what it would take is shown.
    pub is_wrong: bool,
    /// The field has had the focus.
    pub is_shown: bool,
}

/// The controls, and what is remembered of touching them.
pub struct Hands<'a> {
    /// The host.
    pub controls: &'a dyn Controls,
    /// What was done.
    pub history: &'a mut History,
    /// The open text field.
    pub entry: &'a mut Option<Entry>,
    /// Parameters that a hand is on.
    pub held: &'a mut Vec<&'static str>,
}

impl Hands<'_> {
    /// A hand is on it.
    pub fn begin(&mut self, id: &'static str) {
        if let Some(look) = self.controls.look(id).filter(|_| !self.held.contains(&id)) {
            self.controls.begin(id);
            self.held.push(id);
            if terms::is_setting(id) {
                self.history.begin(id, look.value);
            }
        }
    }

    /// Moves it; only while a hand is on it.
    pub fn set(&mut self, id: &'static str, value: f32) {
        if self.held.contains(&id) {
            self.controls.set(id, value.clamp(0.0, 1.0));
        }
    }

    /// The hand is off.
    pub fn end(&mut self, id: &'static str) {
        if let Some(at) = self.held.iter().position(|held| *held == id) {
            self.held.remove(at);
            self.controls.end(id);
            let after = self.controls.look(id).map_or(0.0, |look| look.value);
            self.history.end(id, after);
        }
    }

    /// All hands off: what held them is gone, or the pointer is up.
    pub fn let_go(&mut self) {
        for id in self.held.clone() {
            self.end(id);
        }
    }

    /// One touch: on, there, off.
    pub fn put(&mut self, id: &'static str, value: f32) {
        self.begin(id);
        self.set(id, value);
        self.end(id);
    }

    /// Several at once, as one step.
    pub fn put_all(&mut self, values: &[(&'static str, f32)]) {
        values.iter().for_each(|&(id, _)| self.begin(id));
        values.iter().for_each(|&(id, value)| self.set(id, value));
        values.iter().for_each(|&(id, _)| self.end(id));
    }

    /// Sets values that are no new step: undo, redo, A/B.
    pub fn restore(&mut self, values: &[(&'static str, f32)]) {
        for &(id, value) in values {
            self.controls.begin(id);
            self.controls.set(id, value);
            self.controls.end(id);
        }
    }

    /// Everything that belongs to a setting.
    pub fn setting(&self) -> Values {
        let ids = self.controls.ids().iter().filter(|id| terms::is_setting(id));
        ids.filter_map(|&id| Some((id, self.controls.look(id)?.value))).collect()
    }

    /// Sets a parameter to a number in its own unit; nothing happens where that is no value of it.
    pub fn set_number(&mut self, id: &'static str, number: f64) {
        if let Some(value) = self.controls.parse(id, &format!("{number}")) {
            self.set(id, value);
        }
    }

    /// A switch or choice is on its `index`-th step.
    pub fn step(&self, id: &str) -> usize {
        self.controls
            .look(id)
            .map_or(0, |look| (look.value * look.steps.unwrap_or(1) as f32).round() as usize)
    }

    /// The name of a parameter.
    pub fn name(&self, id: &str) -> String {
        self.controls.look(id).map_or_else(|| id.to_owned(), |look| look.name)
    }
}
