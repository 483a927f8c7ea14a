//! Comparison of two settings, A and B, also blind.
//!
//! A slot holds the values of all parameters that belong to a setting, the name of its preset, and what can be undone on its
//! side. Changing sides saves those of the side that is left. In a blind comparison the sides are called X and Y in random order,
//! it begins on X, only *Reveal* tells which is which, and the window shows no value that would tell.

use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};

use crate::editor::Action;
use crate::editor::controls::{Hands, SAME};
use crate::editor::undo::{Change, Step, UndoHistory};

/// Id of the parameter that says which instrument plays.
const INSTRUMENT: &str = "instr";

/// Values of a setting, normalised.
pub type Values = Vec<(&'static str, f32)>;

/// Which side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ComparisonSide {
    /// The first.
    #[default]
    A,
    /// The second.
    B,
}

impl ComparisonSide {
    /// The other one.
    pub fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }

    /// Its letter.
    pub fn name(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::B => "B",
        }
    }
}

/// What one side holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SideSetting {
    /// All that belongs to a setting.
    pub values: Values,
    /// Name of the preset that was chosen last on this side; empty if there is none.
    pub preset: String,
}

impl SideSetting {
    /// Of the side in force; `preset`: the name of its preset.
    fn now(hands: &Hands, preset: &str) -> Self {
        Self { values: hands.setting(), preset: preset.to_owned() }
    }

    /// What changes from here to `other`.
    fn changes_to(&self, other: &Self) -> Vec<Change> {
        let after = |id: &str| other.values.iter().find(|(known, _)| *known == id).map(|&(_, value)| value);
        let change =
            |&(id, before): &(&'static str, f32)| after(id).map(|after| Change { id, before, after });
        self.values
            .iter()
            .filter_map(change)
            .filter(|change| (change.before - change.after).abs() > SAME)
            .collect()
    }
}

/// Both sides.
#[derive(Clone, Debug, Default)]
pub struct AbComparison {
    /// The side in force.
    pub side: ComparisonSide,
    /// The side that is not in force; `None` until it is first used.
    resting: Option<SideSetting>,
    /// What can be undone on the side that is not in force.
    resting_history: UndoHistory,
    blind: Option<Blind>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Blind {
    /// X is B.
    is_crossed: bool,
    is_revealed: bool,
}

impl AbComparison {
    /// Goes to `side`: saves `now` for the old side, exchanges what can be undone, and returns what to set. Returns nothing for
    /// the side in force. A side that was never used begins as a copy.
    pub fn go(
        &mut self,
        side: ComparisonSide,
        now: SideSetting,
        history: &mut UndoHistory,
    ) -> Option<SideSetting> {
        if side == self.side {
            return None;
        }
        self.side = side;
        std::mem::swap(history, &mut self.resting_history);
        let wanted = self.resting.take().unwrap_or_else(|| now.clone());
        self.resting = Some(now);
        Some(wanted)
    }

    /// Goes to `side` and puts its setting on the controls. `preset`: the name of the preset in force.
    pub fn switch(
        &mut self,
        side: ComparisonSide,
        hands: &mut Hands,
        preset: &str,
        actions: &mut Vec<Action>,
    ) {
        // A gesture ends on the side that it began on.
        hands.let_go();
        let now = SideSetting::now(hands, preset);
        let Some(wanted) = self.go(side, now.clone(), hands.history) else { return };
        let moved = now.changes_to(&wanted).into_iter().map(|change| (change.id, change.after));
        hands.restore(&moved.collect::<Vec<_>>());
        if wanted.preset != preset {
            actions.push(Action::ChosePreset(wanted.preset));
        }
    }

    /// Makes the other side a copy of the side in force, as a step that can be undone there. `preset`: the name of the preset in
    /// force.
    pub fn copy(&mut self, hands: &Hands, preset: &str) {
        let now = SideSetting::now(hands, preset);
        if let Some(resting) = &self.resting {
            self.resting_history.record(Step {
                changes: resting.changes_to(&now),
                preset: Some([resting.preset.clone(), now.preset.clone()]),
                copied_from: Some(self.side),
                ..Step::default()
            });
        }
        self.resting = Some(now);
    }

    /// Whether there is anything to compare.
    pub fn differs(&self, now: &Values) -> bool {
        self.resting.as_ref().is_some_and(|resting| {
            let now = SideSetting { values: now.clone(), preset: String::new() };
            !resting.changes_to(&now).is_empty()
        })
    }

    /// Whether the sides are different instruments. The keys and the names of notes tell which one plays.
    pub fn differs_in_instrument(&self, now: &Values) -> bool {
        let instrument = |values: &Values| values.iter().find(|(id, _)| *id == INSTRUMENT).copied();
        self.resting.as_ref().is_some_and(|resting| instrument(&resting.values) != instrument(now))
    }

    /// Starts a blind comparison; X and Y get their sides at random. The caller goes to X, [`behind`](Self::behind) which
    /// either side may be: the side in force would be known by its name of before.
    pub fn hide(&mut self) {
        self.hide_as(RandomState::new().build_hasher().finish() & 1 == 1);
    }

    /// Starts a blind comparison in which X is B if `is_crossed`.
    fn hide_as(&mut self, is_crossed: bool) {
        self.blind = Some(Blind { is_crossed, is_revealed: false });
    }

    /// A blind comparison is on.
    pub fn is_blind(&self) -> bool {
        self.blind.is_some()
    }

    /// Tells which is which.
    pub fn reveal(&mut self) {
        if let Some(blind) = &mut self.blind {
            blind.is_revealed = true;
        }
    }

    /// Whether it has been told.
    pub fn is_revealed(&self) -> bool {
        self.blind.is_some_and(|blind| blind.is_revealed)
    }

    /// Ends a blind comparison.
    pub fn end_blind(&mut self) {
        self.blind = None;
    }

    /// The side behind X (`first`) or Y.
    pub fn behind(&self, first: bool) -> ComparisonSide {
        let is_crossed = self.blind.is_some_and(|blind| blind.is_crossed);
        if first == is_crossed { ComparisonSide::B } else { ComparisonSide::A }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::bore::alterations::Alterations;

    fn with_lip(value: f32, preset: &str) -> SideSetting {
        SideSetting { values: vec![("lip", value)], preset: preset.to_owned() }
    }

    #[test]
    fn each_side_keeps_what_was_set_on_it_and_its_presets_name() {
        let (mut compare, mut history) = (AbComparison::default(), UndoHistory::default());
        let mut go = |side, now| compare.go(side, now, &mut history);
        assert_eq!(go(ComparisonSide::A, with_lip(0.1, "Doina")), None);
        let begun = go(ComparisonSide::B, with_lip(0.1, "Doina"));
        assert_eq!(begun, Some(with_lip(0.1, "Doina")), "B begins as A");
        assert_eq!(go(ComparisonSide::A, with_lip(0.9, "Mine")), Some(with_lip(0.1, "Doina")));
        assert_eq!(go(ComparisonSide::B, with_lip(0.2, "Doina")), Some(with_lip(0.9, "Mine")));
    }

    #[test]
    fn each_side_undoes_its_own_steps() {
        let (mut compare, mut history) = (AbComparison::default(), UndoHistory::default());
        let step = |history: &mut UndoHistory, before, after| {
            history.begin("lip", before);
            history.end("lip", after);
        };
        step(&mut history, 0.1, 0.2);
        compare.go(ComparisonSide::B, with_lip(0.2, ""), &mut history);
        assert!(history.undoable(None).is_none(), "B has no step yet");
        step(&mut history, 0.2, 0.9);
        compare.go(ComparisonSide::A, with_lip(0.9, ""), &mut history);
        assert_eq!(history.undo(None, &Alterations::default()).values, [("lip", 0.1)]);
        compare.go(ComparisonSide::B, with_lip(0.1, ""), &mut history);
        assert_eq!(history.undo(None, &Alterations::default()).values, [("lip", 0.2)]);
    }

    #[test]
    fn values_that_a_host_has_rounded_are_no_difference_but_another_instrument_is() {
        let (mut compare, mut history) = (AbComparison::default(), UndoHistory::default());
        let of = |lip, instrument| vec![("lip", lip), (INSTRUMENT, instrument)];
        let before = SideSetting { values: of(0.3, 0.0), preset: String::new() };
        compare.go(ComparisonSide::B, before, &mut history);
        assert!(!compare.differs(&of(0.3 + 0.5 * SAME, 0.0)));
        assert!(compare.differs(&of(0.31, 0.0)) && !compare.differs_in_instrument(&of(0.31, 0.0)));
        assert!(compare.differs(&of(0.3, 0.2)) && compare.differs_in_instrument(&of(0.3, 0.2)));
    }

    #[test]
    fn blind_names_cover_both_sides_and_the_lot_falls_both_ways() {
        let mut compare = AbComparison::default();
        for is_crossed in [false, true] {
            compare.hide_as(is_crossed);
            assert_ne!(compare.behind(true), compare.behind(false));
            assert_eq!(compare.behind(true) == ComparisonSide::B, is_crossed);
            assert!(!compare.is_revealed());
        }
        let mut seen = [false; 2];
        for _ in 0..200 {
            compare.hide();
            seen[usize::from(compare.behind(true) == ComparisonSide::B)] = true;
        }
        assert_eq!(seen, [true, true]);
    }
}
