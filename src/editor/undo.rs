//! Undo and redo of the changes made in this window.
//! A step is a gesture: the parameters it changed, each with its value before and after. Changes by the host or by another
//! controller are not recorded. Undoing sets a parameter to the value that it had at the start of the gesture.

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

/// The steps that can be undone, and those that can be redone.
#[derive(Clone, Debug, Default)]
pub struct UndoHistory {
    done: Vec<Vec<Change>>,
    undone: Vec<Vec<Change>>,
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
            let parts = std::mem::take(&mut self.parts);
            self.record(parts);
        }
    }

    /// A whole step at once.
    pub fn record(&mut self, mut step: Vec<Change>) {
        step.retain(|change| change.before != change.after);
        if step.is_empty() {
            return;
        }
        self.undone.clear();
        self.done.push(step);
        if self.done.len() > KEPT {
            self.done.remove(0);
        }
    }

    /// What undoing would touch.
    pub fn undoable(&self) -> Option<&[Change]> {
        self.done.last().map(Vec::as_slice)
    }

    /// What redoing would touch.
    pub fn redoable(&self) -> Option<&[Change]> {
        self.undone.last().map(Vec::as_slice)
    }

    /// Takes the last step back: values to set.
    pub fn undo(&mut self) -> Vec<(&'static str, f32)> {
        let Some(step) = self.done.pop() else { return Vec::new() };
        let values = step.iter().rev().map(|change| (change.id, change.before)).collect();
        self.undone.push(step);
        values
    }

    /// Does the last undone step again: values to set.
    pub fn redo(&mut self) -> Vec<(&'static str, f32)> {
        let Some(step) = self.undone.pop() else { return Vec::new() };
        let values = step.iter().map(|change| (change.id, change.after)).collect();
        self.done.push(step);
        values
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
        assert_eq!(history.undo(), [("zeta", 0.1)]);
        assert_eq!(history.undo(), []);
        assert_eq!(history.redo(), [("zeta", 0.7)]);
    }

    #[test]
    fn parameters_moved_together_come_back_together() {
        let mut history = UndoHistory::default();
        history.begin("reedh", 0.1);
        history.begin("reedk", 0.2);
        history.end("reedh", 0.3);
        assert!(history.undoable().is_none());
        history.end("reedk", 0.4);
        assert_eq!(history.undo(), [("reedk", 0.2), ("reedh", 0.1)]);
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
        assert_eq!(history.undo(), [("lip", 999.0)]);
    }
}
