//! Parameters, as the editor may see them, and the hands that move them.
//!
//! [`Controls`] is all the editor knows of a host: look, write, and say when a hand begins and ends. Values are
//! normalised, 0..=1; text is the parameter's own both ways. Every widget goes through [`Hands`], which remembers what
//! was done.

use crate::controllers::source_curves::SourceCurves;
use crate::controllers::{ControllerLinks, ControllerMap};
use std::path::Path;

use crate::editor::ab_comparison::Values;
use crate::editor::snapshot::Snapshot;
use crate::editor::terms;
use crate::editor::undo::{Change, DeviceChoice, Step, UndoHistory};

/// Two normalised values that are nearer than this are one: what a host's single precision loses.
pub const SAME: f32 = 1e-6;

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

/// Something that the host has tied to a parameter: a controller, automation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mark {
    /// Red, green, blue; `None` if the host leaves it to the window.
    pub colour: Option<[u8; 3]>,
    /// What it is, for a tool tip.
    pub text: String,
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
    /// What the host has tied to it; nothing where hosts do not tell.
    fn marks(&self, _id: &str) -> Vec<Mark> {
        Vec::new()
    }
    /// Controllers that the user links to parameters; `None` where that is not done.
    fn links(&self) -> Option<&ControllerLinks> {
        None
    }
    /// The own curves of sources of breath; `None` where there are none.
    fn curves(&self) -> Option<&SourceCurves> {
        None
    }
    /// Whether the host opens menus of its own.
    fn has_menu(&self) -> bool {
        false
    }
    /// Opens the host's own menu for it, at a place of the window in pixels. Nothing happens where the host has none.
    fn menu(&self, _id: &str, _at: (i32, i32)) {}
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

/// Least time that a pressed button holds its parameter, s: the plugin looks once a block, and 4,096 samples at 44.1 kHz are
/// 93 ms.
pub const LEAST_PRESS_S: f64 = 0.1;

/// A button that holds its parameter at 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Press {
    /// Which.
    pub id: &'static str,
    /// When it went down, s.
    pub since_s: f64,
    /// Mouse button or key are still down, as its widget saw in this frame.
    pub is_down: bool,
}

/// The controls, and what is remembered of touching them.
pub struct Hands<'a> {
    /// The host.
    pub controls: &'a dyn Controls,
    /// What was done.
    pub history: &'a mut UndoHistory,
    /// The open text field.
    pub entry: &'a mut Option<Entry>,
    /// Parameters that a hand is on.
    pub held: &'a mut Vec<&'static str>,
    /// Buttons that are down.
    pub presses: &'a mut Vec<Press>,
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

    /// All hands off: what held them is gone, or the pointer is up. Pressed buttons end by themselves.
    pub fn let_go(&mut self) {
        for id in self.held.clone() {
            if !self.presses.iter().any(|press| press.id == id) {
                self.end(id);
            }
        }
    }

    /// A button was pressed by `now_s`, and `is_down` still: its parameter is 1 until
    /// [`end_presses`](Self::end_presses).
    pub fn press(&mut self, id: &'static str, now_s: f64, is_down: bool) {
        if let Some(press) = self.presses.iter_mut().find(|press| press.id == id) {
            press.is_down = is_down;
        } else if !self.held.contains(&id) {
            self.begin(id);
            self.set(id, 1.0);
            self.presses.push(Press { id, since_s: now_s, is_down });
        }
    }

    /// Ends the presses that no hand holds and that were long enough, after all widgets of a frame; all of them if
    /// `now_s` is `None`. How long until the next may end, s.
    pub fn end_presses(&mut self, now_s: Option<f64>) -> Option<f64> {
        let mut soonest: Option<f64> = None;
        for press in std::mem::take(self.presses) {
            let left_s = now_s.map_or(0.0, |now_s| press.since_s + LEAST_PRESS_S - now_s);
            if now_s.is_none() || (!press.is_down && left_s <= 0.0) {
                self.set(press.id, 0.0);
                self.end(press.id);
                continue;
            }
            if !press.is_down {
                soonest = Some(soonest.map_or(left_s, |soonest| soonest.min(left_s)));
            }
            // Its widget says so again in the next frame, unless it has vanished.
            self.presses.push(Press { is_down: false, ..press });
        }
        soonest
    }

    /// One touch: on, there, off.
    pub fn put(&mut self, id: &'static str, value: f32) {
        self.begin(id);
        self.set(id, value);
        self.end(id);
    }

    /// A notch of the wheel: one touch, and one step with the notches before it.
    pub fn nudge(&mut self, id: &'static str, value: f32) {
        let Some(look) = self.controls.look(id).filter(|_| !self.held.contains(&id)) else { return };
        self.controls.begin(id);
        self.controls.set(id, value.clamp(0.0, 1.0));
        self.controls.end(id);
        if terms::is_setting(id) {
            self.history.nudge(id, look.value, self.controls.look(id).map_or(0.0, |look| look.value));
        }
    }

    /// Several at once, as one step.
    pub fn put_all(&mut self, values: &[(&'static str, f32)]) {
        values.iter().for_each(|&(id, _)| self.begin(id));
        values.iter().for_each(|&(id, value)| self.set(id, value));
        values.iter().for_each(|&(id, _)| self.end(id));
    }

    /// Several at once as one step, whatever undo carries otherwise: a preset brings its instrument.
    /// `preset`: its name, and that of the one before.
    pub fn put_step(&mut self, values: &[(&'static str, f32)], preset: [String; 2]) {
        let changes = self.put_free(values);
        self.history.record(Step { changes, preset: Some(preset), ..Step::default() });
    }

    /// Chooses a device, as one step: its links replace all links, and `values` are set.
    pub fn put_device(&mut self, map: &ControllerMap, values: &[(&'static str, f32)]) {
        let Some(links) = self.controls.links() else { return };
        let before = links.to_text();
        links.learn(None);
        links.choose(map);
        let device = DeviceChoice { name: map.name.clone(), before, after: links.to_text() };
        let changes = self.put_free(values);
        self.history.record(Step { changes, device: Some(device), ..Step::default() });
    }

    /// Sets values where no hand holds the parameter, and tells what changed.
    fn put_free(&self, values: &[(&'static str, f32)]) -> Vec<Change> {
        let free = values.iter().filter(|(id, _)| !self.held.contains(id));
        let values: Vec<(&'static str, f32)> = free.copied().collect();
        let looks = values
            .iter()
            .map(|&(id, after)| self.controls.look(id).map(|look| Change { id, before: look.value, after }));
        let changes = looks.flatten().collect();
        self.restore(&values);
        changes
    }

    /// Records as a step that one of `count` choices was made, which the window asks for elsewhere.
    pub fn record_choice(&mut self, id: &'static str, index: usize, count: usize) {
        if let Some(look) = self.controls.look(id) {
            let after = index as f32 / count.saturating_sub(1).max(1) as f32;
            let changes = vec![Change { id, before: look.value, after }];
            self.history.record(Step { changes, ..Step::default() });
        }
    }

    /// Records as a step that an instrument file is opened, which the window asks for elsewhere.
    pub fn record_instrument_file(&mut self, path: &Path, snapshot: &Snapshot) {
        let Some(look) = self.controls.look("instr") else { return };
        // The last of the list is the user's file.
        let changes = vec![Change { id: "instr", before: look.value, after: 1.0 }];
        let file = Some([snapshot.instrument_file.clone(), path.display().to_string()]);
        self.history.record(Step { changes, file, ..Step::default() });
    }

    /// Sets values that are no new step: undo, redo, A/B.
    pub fn restore(&self, values: &[(&'static str, f32)]) {
        for &(id, value) in values {
            self.controls.begin(id);
            self.controls.set(id, value);
            self.controls.end(id);
        }
    }

    /// Everything that A and B carry.
    pub fn setting(&self) -> Values {
        let ids = self.controls.ids().iter().filter(|id| terms::is_compared(id));
        ids.filter_map(|&id| Some((id, self.controls.look(id)?.value))).collect()
    }

    /// Sets a parameter to a number in its own unit; nothing happens where that is no value of it.
    pub fn set_number(&mut self, id: &'static str, number: f64) {
        if let Some(value) = self.controls.parse(id, &format!("{number}")) {
            self.set(id, value);
        }
    }

    /// A parameter in its own unit, as exact as its text; 0 where it is no number.
    pub fn number(&self, id: &str) -> f64 {
        let text = self.controls.look(id).map_or_else(String::new, |look| self.controls.text(id, look.value));
        let end = text.find(|c: char| !(c.is_ascii_digit() || "-.".contains(c))).unwrap_or(text.len());
        text[..end].parse().unwrap_or(0.0)
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
