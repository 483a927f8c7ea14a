//! Undo and redo of the changes made in this window.
//! A step is a gesture: the parameters it changed, each with its value before and after, or the holes and joints it moved.
//! Changes by the host or by another controller are not recorded. Undoing sets a parameter to the value that it had at the
//! start of the gesture. A and B have a history each: undoing on one side leaves the parameters of the other alone. Holes and
//! joints belong to their instrument on both sides; a step takes back only what it moved itself, and waits while another
//! instrument plays.

use std::sync::Arc;

use crate::editor::ab_comparison::ComparisonSide;
use crate::editor::hole_names::hole_title;
use chalumeau_core::bore::alterations::Alterations;
use chalumeau_core::bore::moved_hole::MovedHole;
use chalumeau_core::bore::pulled_joint::PulledJoint;

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

/// Holes and joints that a step moved.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Move {
    /// Number of the gesture: what one gesture asks for in turn is one step.
    pub gesture: u64,
    /// What names the instrument in a saved project.
    pub instrument_key: String,
    /// All alterations before the gesture.
    pub before: Arc<Alterations>,
    /// All alterations after it.
    pub after: Arc<Alterations>,
}

impl Move {
    /// What it moved, as musicians write it.
    pub fn titles(&self) -> Vec<String> {
        let is_hole = |name: &str| hole(&self.before, name).or(hole(&self.after, name)).is_some();
        let title = |name: &str| if is_hole(name) { hole_title(name) } else { name.to_owned() };
        self.names().into_iter().map(title).collect()
    }

    /// Names of the holes and parts that it moved.
    fn names(&self) -> Vec<&str> {
        let mut names = self.before.names();
        names.extend(self.after.names());
        let mut moved = Vec::new();
        for name in names {
            let is_same = hole(&self.before, name) == hole(&self.after, name)
                && joint(&self.before, name) == joint(&self.after, name);
            if !is_same && !moved.contains(&name) {
                moved.push(name);
            }
        }
        moved
    }

    /// `now` with what this move changed as it is in `to`, one of its two ends.
    fn brought(&self, now: &Alterations, to: &Alterations) -> Alterations {
        let mut all = now.clone();
        for name in self.names() {
            all.holes.retain(|hole| hole.name != name);
            all.holes.extend(hole(to, name).cloned());
            all.joints.retain(|joint| joint.part != name);
            all.joints.extend(joint(to, name).cloned());
        }
        all
    }
}

fn hole<'a>(of: &'a Alterations, name: &str) -> Option<&'a MovedHole> {
    of.holes.iter().find(|hole| hole.name == name)
}

fn joint<'a>(of: &'a Alterations, part: &str) -> Option<&'a PulledJoint> {
    of.joints.iter().find(|joint| joint.part == part)
}

/// The device that a step chose, and the links of controllers before and after it, as their text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeviceChoice {
    /// Of the device.
    pub name: String,
    /// Before the step.
    pub before: String,
    /// After it.
    pub after: String,
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
    /// Holes and joints that it moved, if it moved any.
    pub moved: Option<Move>,
    /// The device that it chose, if it chose one.
    pub device: Option<DeviceChoice>,
    /// The instrument file before and after it, if it opened one; empty for the usual place.
    pub file: Option<[String; 2]>,
}

impl Step {
    /// Whether it can be undone and redone while this instrument can be altered.
    fn is_of(&self, instrument_key: Option<&str>) -> bool {
        self.moved.as_ref().is_none_or(|moved| instrument_key == Some(&moved.instrument_key))
    }
}

/// What undo or redo brings back.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Restored {
    /// Values to set.
    pub values: Vec<(&'static str, f32)>,
    /// Name of the preset, if the step chose one.
    pub preset: Option<String>,
    /// All alterations of the instrument, if the step moved a hole or a joint.
    pub alterations: Option<Alterations>,
    /// Links of controllers, if the step chose a device: those that the step left, and those to bring back in their place. Where others
    /// are there, the user has changed them since.
    pub links: Option<[String; 2]>,
    /// The instrument file, if the step opened one.
    pub file: Option<String>,
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
    /// The parameter that the wheel has moved in the last step.
    nudged: Option<&'static str>,
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

    /// The wheel moved a parameter by a notch: with the notches right before it, it is one step.
    pub fn nudge(&mut self, id: &'static str, before: f32, after: f32) {
        let last = self.done.last_mut().and_then(|step| step.changes.first_mut());
        match last.filter(|_| self.nudged == Some(id)) {
            Some(last) => last.after = after,
            None => self.record(Step { changes: vec![Change { id, before, after }], ..Step::default() }),
        }
        self.nudged = Some(id);
    }

    /// A whole step at once.
    pub fn record(&mut self, mut step: Step) {
        step.changes.retain(|change| change.before != change.after);
        let has_linked = step.device.as_ref().is_some_and(|device| device.before != device.after);
        let has_opened = step.file.as_ref().is_some_and(|[before, after]| before != after);
        if step.changes.is_empty() && !has_linked && !has_opened {
            return;
        }
        self.undone.clear();
        self.push(step);
    }

    /// Holes or joints moved. What the same gesture moved before belongs to the same step.
    pub fn record_move(&mut self, moved: Move) {
        let last = self.done.last_mut().and_then(|step| step.moved.as_mut());
        match last.filter(|last| last.gesture == moved.gesture) {
            Some(last) => last.after = moved.after,
            None => {
                self.undone.clear();
                self.push(Step { moved: Some(moved), ..Step::default() });
            }
        }
        // Back where it was, it is no step.
        let is_nothing = |step: &Step| step.moved.as_ref().is_some_and(|moved| moved.names().is_empty());
        if self.done.last().is_some_and(is_nothing) {
            self.done.pop();
        }
    }

    fn push(&mut self, step: Step) {
        self.nudged = None;
        self.done.push(step);
        if self.done.len() > KEPT {
            self.done.remove(0);
        }
    }

    /// What undoing would touch while this instrument can be altered.
    pub fn undoable(&self, instrument_key: Option<&str>) -> Option<&Step> {
        self.done.iter().rev().find(|step| step.is_of(instrument_key))
    }

    /// What redoing would touch while this instrument can be altered.
    pub fn redoable(&self, instrument_key: Option<&str>) -> Option<&Step> {
        self.undone.iter().rev().find(|step| step.is_of(instrument_key))
    }

    /// Takes the last step back. `now`: the alterations of the instrument that plays.
    pub fn undo(&mut self, instrument_key: Option<&str>, now: &Alterations) -> Restored {
        let Some(at) = self.done.iter().rposition(|step| step.is_of(instrument_key)) else {
            return Restored::default();
        };
        let step = self.done.remove(at);
        self.nudged = None;
        let values = step.changes.iter().rev().map(|change| (change.id, change.before)).collect();
        let preset = step.preset.as_ref().map(|[before, _]| before.clone());
        let alterations = step.moved.as_ref().map(|moved| moved.brought(now, &moved.before));
        let links = step.device.as_ref().map(|device| [device.after.clone(), device.before.clone()]);
        let file = step.file.as_ref().map(|[before, _]| before.clone());
        self.undone.push(step);
        Restored { values, preset, alterations, links, file }
    }

    /// Does the last undone step again. `now`: see [`undo`](Self::undo).
    pub fn redo(&mut self, instrument_key: Option<&str>, now: &Alterations) -> Restored {
        let Some(at) = self.undone.iter().rposition(|step| step.is_of(instrument_key)) else {
            return Restored::default();
        };
        let step = self.undone.remove(at);
        let values = step.changes.iter().map(|change| (change.id, change.after)).collect();
        let preset = step.preset.as_ref().map(|[_, after]| after.clone());
        let alterations = step.moved.as_ref().map(|moved| moved.brought(now, &moved.after));
        let links = step.device.as_ref().map(|device| [device.before.clone(), device.after.clone()]);
        let file = step.file.as_ref().map(|[_, after]| after.clone());
        self.done.push(step);
        Restored { values, preset, alterations, links, file }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Undo and redo where no hole is moved.
    impl UndoHistory {
        fn back(&mut self) -> Restored {
            self.undo(None, &Alterations::default())
        }

        fn again(&mut self) -> Restored {
            self.redo(None, &Alterations::default())
        }
    }

    #[test]
    fn a_gesture_is_one_step_however_far_it_went() {
        let mut history = UndoHistory::default();
        history.begin("zeta", 0.1);
        history.begin("zeta", 0.2);
        history.end("zeta", 0.7);
        assert_eq!(history.back().values, [("zeta", 0.1)]);
        assert_eq!(history.back().values, []);
        assert_eq!(history.again().values, [("zeta", 0.7)]);
    }

    #[test]
    fn notches_of_the_wheel_are_one_step_until_something_else_is() {
        let mut history = UndoHistory::default();
        history.nudge("zeta", 0.1, 0.2);
        history.nudge("zeta", 0.2, 0.3);
        history.begin("zeta", 0.3);
        history.end("zeta", 0.5);
        history.nudge("zeta", 0.5, 0.6);
        history.nudge("lay", 0.0, 0.1);
        history.nudge("zeta", 0.6, 0.7);
        assert_eq!(history.back().values, [("zeta", 0.6)]);
        history.nudge("lay", 0.1, 0.2);
        let back: Vec<_> =
            std::iter::repeat_with(|| history.back().values).take_while(|v| !v.is_empty()).collect();
        assert_eq!(back, [[("lay", 0.1)], [("lay", 0.0)], [("zeta", 0.5)], [("zeta", 0.3)], [("zeta", 0.1)]]);
    }

    #[test]
    fn parameters_moved_together_come_back_together() {
        let mut history = UndoHistory::default();
        history.begin("reedh", 0.1);
        history.begin("reedk", 0.2);
        history.end("reedh", 0.3);
        assert!(history.undoable(None).is_none());
        history.end("reedk", 0.4);
        assert_eq!(history.back().values, [("reedk", 0.2), ("reedh", 0.1)]);
    }

    #[test]
    fn a_preset_that_is_taken_back_takes_its_name_along() {
        let mut history = UndoHistory::default();
        let changes = vec![Change { id: "lip", before: 0.1, after: 0.2 }];
        let preset = Some(["Old".to_owned(), "New".to_owned()]);
        history.record(Step { changes, preset, ..Step::default() });
        assert_eq!(history.back().preset.as_deref(), Some("Old"));
        assert_eq!(history.again().preset.as_deref(), Some("New"));
    }

    #[test]
    fn a_new_step_forgets_what_was_undone_and_nothing_is_no_step() {
        let mut history = UndoHistory::default();
        for after in [0.2, 0.3] {
            history.begin("lip", 0.1);
            history.end("lip", after);
        }
        history.back();
        history.begin("lip", 0.5);
        history.end("lip", 0.5);
        assert!(history.redoable(None).is_some(), "a click that moved nothing");
        history.begin("lip", 0.5);
        history.end("lip", 0.6);
        assert!(history.redoable(None).is_none());
    }

    #[test]
    fn long_work_does_not_grow_without_end() {
        let mut history = UndoHistory::default();
        for n in 0..1000 {
            history.begin("lip", n as f32);
            history.end("lip", n as f32 + 1.0);
        }
        assert_eq!(history.done.len(), KEPT);
        assert_eq!(history.back().values, [("lip", 999.0)]);
    }

    fn moved(gesture: u64, holes: [&[(&str, f64)]; 2]) -> Move {
        let all = |holes: &[(&str, f64)]| {
            let hole = |&(name, x_m): &(&str, f64)| MovedHole { name: name.to_owned(), x_m, radius_m: 4e-3 };
            Arc::new(Alterations { holes: holes.iter().map(hole).collect(), joints: Vec::new() })
        };
        let [before, after] = holes.map(all);
        Move { gesture, instrument_key: "b-flat".to_owned(), before, after }
    }

    #[test]
    fn a_hole_that_is_dragged_is_one_step_among_the_others() {
        let mut history = UndoHistory::default();
        history.begin("lip", 0.1);
        history.end("lip", 0.2);
        history.record_move(moved(1, [&[], &[("R2", 0.31)]]));
        history.record_move(moved(1, [&[], &[("R2", 0.32)]]));
        let now = moved(0, [&[], &[("R2", 0.32)]]).after;
        assert_eq!(
            history.undoable(Some("b-flat")).and_then(|step| step.moved.as_ref()).unwrap().names(),
            ["R2"]
        );
        assert_eq!(history.undo(Some("b-flat"), &now).alterations, Some(Alterations::default()));
        assert_eq!(history.redo(Some("b-flat"), &Alterations::default()).alterations.as_ref(), Some(&*now));
        history.undo(Some("b-flat"), &now);
        let restored = history.undo(Some("b-flat"), &Alterations::default());
        assert_eq!((restored.values, restored.alterations), (vec![("lip", 0.1)], None));
    }

    #[test]
    fn a_hole_that_is_dragged_back_is_no_step() {
        let mut history = UndoHistory::default();
        history.record_move(moved(1, [&[], &[("R2", 0.31)]]));
        history.record_move(moved(1, [&[], &[]]));
        assert!(history.undoable(Some("b-flat")).is_none());
        // Among others it comes back to another place in the list.
        let others = [("L1", 0.2), ("R2", 0.31)];
        history.record_move(moved(2, [&others, &[("R2", 0.31), ("L1", 0.21)]]));
        history.record_move(moved(2, [&others, &[("R2", 0.31), ("L1", 0.2)]]));
        assert!(history.undoable(Some("b-flat")).is_none());
    }

    /// On the other side of a comparison R3 was moved meanwhile; it stays.
    #[test]
    fn a_move_takes_back_itself_alone_and_on_its_instrument_alone() {
        let mut history = UndoHistory::default();
        history.begin("lip", 0.1);
        history.end("lip", 0.2);
        history.record_move(moved(1, [&[("L1", 0.2)], &[("L1", 0.2), ("R2", 0.31)]]));
        let now = moved(0, [&[], &[("L1", 0.2), ("R2", 0.31), ("R3", 0.36)]]).after;
        assert!(history.undoable(Some("bass")).is_some_and(|step| step.moved.is_none()));
        let wanted = moved(0, [&[], &[("L1", 0.2), ("R3", 0.36)]]).after;
        assert_eq!(history.undo(Some("b-flat"), &now).alterations.as_ref(), Some(&*wanted));
    }
}
