//! How near to the recordings any smooth rule can come: at each dynamic by itself, mouth pressure and flow strength are free
//! functions of the place of a note, bound to no level. What these cannot reach, no rule of a player can that
//! is smooth in pitch and moves pressure and flow.

use std::ops::ControlFlow;

use chalumeau_core::instrument::player::dynamics::PlayerModel;
use chalumeau_core::measure::realism::{Dynamic, RecordedNote};
use chalumeau_core::parallel;

use super::{Compared, Data, FAIL_DB, compare_played, cost, dynamic_number, say, simplex};

/// Terms of each function: a line, a parabola, a cubic.
const TERMS: [usize; 3] = [2, 3, 4];
/// Where the searches begin: mouth pressures and flow strengths in the middle of the compass.
const STARTS: [(f64, f64); 4] = [(0.5, 0.25), (0.5, 0.4), (0.8, 0.25), (0.8, 0.4)];
/// Size of the first steps of the search in each term, and steps.
const FIRST_STEP: f64 = 0.15;
const STEPS: (usize, usize) = (400, 250);
/// Grid on which a note is asked for by itself: mouth pressures and flow strengths.
const GAMMAS: (f64, f64, usize) = (0.38, 1.04, 67);
const ZETAS: (f64, f64, usize) = (0.14, 0.66, 53);

fn polynomial(terms: &[f64], place: f64) -> f64 {
    terms.iter().rev().fold(0.0, |sum, term| sum * place + term)
}

fn grid((from, to, count): (f64, f64, usize)) -> impl Iterator<Item = f64> {
    (0..count).map(move |n| from + (to - from) * n as f64 / (count - 1) as f64)
}

impl Data {
    fn at_point(&self, at: usize, recorded: &RecordedNote, gamma: f64, zeta: f64) -> Compared {
        let note = &self.notes[at];
        let opening = PlayerModel::FITTED.closing(dynamic_number(recorded.dynamic));
        compare_played(note.at_gamma(zeta, opening, gamma), note, recorded, &self.lost_db[at])
    }

    fn of(&self, at: usize, dynamic: Dynamic) -> Option<&RecordedNote> {
        self.recorded[at].iter().find(|recorded| recorded.dynamic == dynamic)
    }

    /// A note at a dynamic under free functions; the first half of `numbers` is that of the mouth pressure.
    fn under(&self, numbers: &[f64], at: usize, dynamic: Dynamic) -> Option<Compared> {
        let (gamma, zeta) = numbers.split_at(numbers.len() / 2);
        let place = self.notes[at].place;
        let recorded = self.of(at, dynamic)?;
        Some(self.at_point(at, recorded, polynomial(gamma, place), polynomial(zeta, place).exp()))
    }

    fn free_loss(&self, numbers: &[f64], dynamic: Dynamic, without: Option<usize>) -> f64 {
        let notes = (0..self.notes.len()).filter(|&at| Some(at) != without);
        notes.filter_map(|at| self.under(numbers, at, dynamic)).map(|compared| cost(&compared)).sum()
    }

    fn free_fit(
        &self,
        dynamic: Dynamic,
        starts: &[Vec<f64>],
        steps: usize,
        without: Option<usize>,
    ) -> Vec<f64> {
        let loss = |numbers: &[f64]| self.free_loss(numbers, dynamic, without);
        let fits =
            starts.iter().map(|start| simplex::minimise(&loss, start, &vec![FIRST_STEP; start.len()], steps));
        fits.min_by(|a, b| loss(a).total_cmp(&loss(b))).unwrap_or_default()
    }

    /// The best point of the grid for a note by itself.
    fn alone(&self, at: usize, dynamic: Dynamic) -> Option<Compared> {
        let recorded = self.of(at, dynamic)?;
        let points = grid(GAMMAS).flat_map(|gamma| grid(ZETAS).map(move |zeta| (gamma, zeta)));
        let compared = points.map(|(gamma, zeta)| self.at_point(at, recorded, gamma, zeta));
        compared.filter(|compared| compared.error_db < FAIL_DB).min_by(|a, b| cost(a).total_cmp(&cost(b)))
    }
}

/// Prints what can be reached: by functions of each length, fitted and with each note left out, and by each note alone.
pub(super) fn run(data: &Data) {
    let notes = data.notes.len();
    for dynamic in [Dynamic::Mf, Dynamic::Ff] {
        let alone = |at: usize| data.alone(at, dynamic);
        let alone = parallel::each(notes, alone, &mut |_| ControlFlow::Continue(()));
        say("each note by itself", alone.into_iter().flatten().flatten().map(|note| (dynamic, note)));
        for terms in TERMS {
            let start = |(gamma, zeta): (f64, f64)| {
                let mut numbers = vec![0.0; 2 * terms];
                (numbers[0], numbers[terms]) = (gamma, zeta.ln());
                numbers
            };
            let starts: Vec<_> = STARTS.into_iter().map(start).collect();
            let once = data.free_fit(dynamic, &starts, STEPS.0, None);
            let fitted = data.free_fit(dynamic, &[once], STEPS.0, None);
            let compared = (0..notes).filter_map(|at| data.under(&fitted, at, dynamic));
            say(&format!("{terms} terms each, fitted"), compared.map(|note| (dynamic, note)));
            let left_out = |at: usize| {
                let others = data.free_fit(dynamic, std::slice::from_ref(&fitted), STEPS.1, Some(at));
                data.under(&others, at, dynamic)
            };
            let left_out = parallel::each(notes, left_out, &mut |_| ControlFlow::Continue(()));
            say(
                &format!("{terms} terms each, left out"),
                left_out.into_iter().flatten().flatten().map(|note| (dynamic, note)),
            );
        }
    }
}
