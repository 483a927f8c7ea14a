//! Undo and redo of the changes made in this window.
//! A step is a gesture: the parameters it changed, each with its value before and after. Changes by the host or by another
//! controller are not recorded. Undoing sets a parameter to the value that it had at the start of the gesture. A and B have a
//! history each: undoing on one side leaves the other alone.

use crate::editor::ab_comparison::ComparisonSide;

/// Steps kept; some hours of work.
const KEPT: usize = 200;

/// One parameter in a step, normalised.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Of the parameter.
    pub id: &'static str,
    /// Before the gesture.
    pub before: f32,
    /// After it.
    pub after: f32,
}

/// A step: what it changed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Step {
    /// The parameters.
    pub changes: Vec<Change>,
    /// Name of the preset before and after it, if it chose one.
    pub preset: Option<[String; 2]>,
    /// The side whose setting it has copied, if it has.
    pub copied_from: Option<ComparisonSide>,
}

/// What undo or redo brings back.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Restored {
    /// Values to set.
    pub values: Vec<(&'static str, f32)>,
    /// Name of the preset, if the step chose one.
    pub preset: Option<String>,
}

/// The steps that can be undone, and those that can be redone.
#[derive(Clone, Debug, Default)]
pub struct UndoHistory {
    done: Vec<Step>,
    undone: Vec<Step>,
    /// Gestures that have begun, with the value they found.
    open: Vec<(&'static str, f32)>,
    /// Finished parts of a gesture of several parameters.
    parts: Vec<Change>,
}

impl UndoHistory {
    /// A gesture on `id` begins.
    pub fn begin(&mut self, id: &'static str, value: f32) {
        if !self.open.iter().any(|(open, _)| *open == id) {
            self.open.push((id, value));
        }
    }

    /// Whether a gesture on `id` has begun.
    pub fn is_open(&self, id: &str) -> bool {
        self.open.iter().any(|(open, _)| *open == id)
    }

    /// The gesture on `id` ends. What ends while others are open belongs to the same step.
    pub fn end(&mut self, id: &'static str, after: f32) {
        let Some(at) = self.open.iter().position(|(open, _)| *open == id) else { return };
        let (_, before) = self.open.remove(at);
        self.parts.push(Change { id, before, after });
        if self.open.is_empty() {
            let changes = std::mem::take(&mut self.parts);
            self.record(Step { changes, ..Step::default() });
        }
    }

    /// A whole step at once.
    pub fn record(&mut self, mut step: Step) {
        step.changes.retain(|change| change.before != change.after);
        if step.changes.is_empty() {
            return;
        }
        self.undone.clear();
        self.done.push(step);
        if self.done.len() > KEPT {
            self.done.remove(0);
        }
    }

    /// What undoing would touch.
    pub fn undoable(&self) -> Option<&Step> {
        self.done.last()
    }

    /// What redoing would touch.
    pub fn redoable(&self) -> Option<&Step> {
        self.undone.last()
    }

    /// Takes the last step back.
    pub fn undo(&mut self) -> Restored {
        let Some(step) = self.done.pop() else { return Restored::default() };
        let values = step.changes.iter().rev().map(|change| (change.id, change.before)).collect();
        let preset = step.preset.as_ref().map(|[before, _]| before.clone());
        self.undone.push(step);
        Restored { values, preset }
    }

    /// Does the last undone step again.
    pub fn redo(&mut self) -> Restored {
        let Some(step) = self.undone.pop() else { return Restored::default() };
        let values = step.changes.iter().map(|change| (change.id, change.after)).collect();
        let preset = step.preset.as_ref().map(|[_, after]| after.clone());
        self.done.push(step);
        Restored { values, preset }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gesture_is_one_step_however_far_it_went() {
        let mut history = UndoHistory::default();
        history.begin("zeta", 0.1);
        history.begin("zeta", 0.2);
        history.end("zeta", 0.7);
        assert_eq!(history.undo().values, [("zeta", 0.1)]);
        assert_eq!(history.undo().values, []);
        assert_eq!(history.redo().values, [("zeta", 0.7)]);
    }

    #[test]
    fn parameters_moved_together_come_back_together() {
        let mut history = UndoHistory::default();
        history.begin("reedh", 0.1);
        history.begin("reedk", 0.2);
        history.end("reedh", 0.3);
        assert!(history.undoable().is_none());
        history.end("reedk", 0.4);
        assert_eq!(history.undo().values, [("reedk", 0.2), ("reedh", 0.1)]);
    }

    #[test]
    fn a_preset_that_is_taken_back_takes_its_name_along() {
        let mut history = UndoHistory::default();
        let changes = vec![Change { id: "lip", before: 0.1, after: 0.2 }];
        let preset = Some(["Old".to_owned(), "New".to_owned()]);
        history.record(Step { changes, preset, copied_from: None });
        assert_eq!(history.undo().preset.as_deref(), Some("Old"));
        assert_eq!(history.redo().preset.as_deref(), Some("New"));
    }

    #[test]
    fn a_new_step_forgets_what_was_undone_and_nothing_is_no_step() {
        let mut history = UndoHistory::default();
        for after in [0.2, 0.3] {
            history.begin("lip", 0.1);
            history.end("lip", after);
        }
        history.undo();
        history.begin("lip", 0.5);
        history.end("lip", 0.5);
        assert!(history.redoable().is_some(), "a click that moved nothing");
        history.begin("lip", 0.5);
        history.end("lip", 0.6);
        assert!(history.redoable().is_none());
    }

    #[test]
    fn long_work_does_not_grow_without_end() {
        let mut history = UndoHistory::default();
        for n in 0..1000 {
            history.begin("lip", n as f32);
            history.end("lip", n as f32 + 1.0);
        }
        assert_eq!(history.done.len(), KEPT);
        assert_eq!(history.undo().values, [("lip", 999.0)]);
    }
}
