//! A trial: holes that the user has opened and closed replace those of the played note, in every view, until the trial ends.

use crate::editor::Action;
use crate::editor::snapshot::Snapshot;

/// The trial of now, if there is one.
#[derive(Clone, Debug, Default)]
pub struct Trial {
    open: Option<Vec<bool>>,
}

impl Trial {
    /// The holes of the trial, in the order of the instrument's file: whether each is open.
    pub fn open(&self) -> Option<&[bool]> {
        self.open.as_deref()
    }

    /// Whether there is one.
    pub fn is_on(&self) -> bool {
        self.open.is_some()
    }

    /// Tries these holes.
    pub fn set(&mut self, open: Vec<bool>, actions: &mut Vec<Action>) {
        actions.push(Action::TryFingering(open.clone()));
        self.open = Some(open);
    }

    /// Opens a hole or closes it; a trial begins with the holes of the played note.
    pub fn toggle(&mut self, hole: usize, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        let holes = snapshot.instrument.holes.len();
        let is_open = |hole: usize| snapshot.openings.get(hole).is_some_and(|&opening| opening >= 0.5);
        let mut open = self.open.take().unwrap_or_else(|| (0..holes).map(is_open).collect());
        if let Some(is_open) = open.get_mut(hole) {
            *is_open = !*is_open;
        }
        self.set(open, actions);
    }

    /// Ends the trial: the played note sets the holes again.
    pub fn end(&mut self, actions: &mut Vec<Action>) {
        if self.open.take().is_some() {
            actions.push(Action::EndTry);
        }
    }

    /// Ends the trial if the instrument has other holes.
    pub fn keep_to(&mut self, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        if self.open.as_ref().is_some_and(|open| open.len() != snapshot.instrument.holes.len()) {
            self.end(actions);
        }
    }
}
