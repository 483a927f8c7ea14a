//! How near to the recordings a smooth rule can come: at each dynamic by itself, mouth pressure and flow strength are free
//! functions of the place of a note, bound to no level; without filters, and with three that are the same for all notes of that
//! dynamic. The search is local: it shows what can be reached, and not that more cannot.

use std::ops::ControlFlow;

use chalumeau_core::instrument::player::dynamics::PlayerModel;
use chalumeau_core::measure::realism::{Dynamic, RecordedNote};
use chalumeau_core::parallel;

use super::spectra::PlayedSpectrum;
use super::{Compared, Data, FAIL_DB, compare_played, cost, dynamic_number, say, simplex};

/// Terms of each function: a line, a parabola, a cubic.
const TERMS: [usize; 3] = [2, 3, 4];
/// Where the searches begin: mouth pressures and flow strengths in the middle of the compass.
const STARTS: [(f64, f64); 4] = [(0.5, 0.25), (0.5, 0.4), (0.8, 0.25), (0.8, 0.4)];
/// Size of the first steps of the search in each term, and steps.
const FIRST_STEP: f64 = 0.15;
const STEPS: (usize, usize) = (400, 250);
/// What a wrong centroid costs here, dB: more than in the fit, so that as many as can be are right.
const CENTROID_COST_DB: f64 = 20.0;
/// Filters that are the same for all notes: a shelf of first order and two bells. Where a search for them begins: logarithm of the frequency
/// over 1 kHz, gain, dB, and for the bells the logarithm of the quality; and its first steps.
const FILTERS: ([f64; 8], [f64; 8]) =
    ([1.0, 0.0, 0.0, 0.0, 0.0, 0.7, 0.0, 0.0], [0.5, 3.0, 0.3, 2.0, 0.3, 0.3, 2.0, 0.3]);
/// Their bounds: logarithm of the frequency, gain, logarithm of the quality. The lowest frequency is above 550 Hz, where one would hide
/// the second harmonic.
const FILTER_BOUNDS: [(f64, f64); 3] = [(-0.3, 2.3), (-9.0, 9.0), (-1.0, 0.7)];
/// Grid on which a note is asked for by itself: mouth pressures and flow strengths.
const GAMMAS: (f64, f64, usize) = (0.38, 1.04, 67);
const ZETAS: (f64, f64, usize) = (0.14, 0.66, 53);

fn polynomial(terms: &[f64], place: f64) -> f64 {
    terms.iter().rev().fold(0.0, |sum, term| sum * place + term)
}

fn grid((from, to, count): (f64, f64, usize)) -> impl Iterator<Item = f64> {
    (0..count).map(move |n| from + (to - from) * n as f64 / (count - 1) as f64)
}

/// Gain of the filters with these numbers, dB; of none, 0.
fn filters_db(numbers: &[f64], f_hz: f64) -> f64 {
    let held = |number: f64, (low, high): (f64, f64)| number.clamp(low, high);
    let [of_hz, of_gain, of_quality] = FILTER_BOUNDS;
    let over = |log_hz: f64| f_hz / (1e3 * held(log_hz, of_hz).exp());
    let power_db = |above: f64, below: f64| 10.0 * (above / below).log10();
    let shelf_db = |log_hz: f64, gain_db: f64| {
        let (u, root) = (over(log_hz), 10.0_f64.powf(held(gain_db, of_gain) / 40.0));
        power_db(1.0 + (u * root).powi(2), 1.0 + (u / root).powi(2))
    };
    let bell_db = |log_hz: f64, gain_db: f64, quality: f64| {
        let (u, root) = (over(log_hz), 10.0_f64.powf(held(gain_db, of_gain) / 40.0));
        let (off, width) = ((1.0 - u * u).powi(2), u / held(quality, of_quality).exp());
        power_db(off + (width * root).powi(2), off + (width / root).powi(2))
    };
    let &[shelf_hz, shelf_gain, hz, gain, quality, other_hz, other_gain, other_quality] = numbers else {
        return 0.0;
    };
    shelf_db(shelf_hz, shelf_gain) + bell_db(hz, gain, quality) + bell_db(other_hz, other_gain, other_quality)
}

/// What is searched: how many terms each function has, and whether there are filters.
#[derive(Clone, Copy)]
struct Free {
    terms: usize,
    filters: bool,
}

impl Free {
    fn start(self, (gamma, zeta): (f64, f64)) -> Vec<f64> {
        let mut numbers = vec![0.0; 2 * self.terms];
        (numbers[0], numbers[self.terms]) = (gamma, zeta.ln());
        numbers.extend(if self.filters { &FILTERS.0[..] } else { &[] });
        numbers
    }

    fn first_steps(self) -> Vec<f64> {
        let mut steps = vec![FIRST_STEP; 2 * self.terms];
        steps.extend(if self.filters { &FILTERS.1[..] } else { &[] });
        steps
    }
}

impl PlayedSpectrum {
    fn behind(mut self, filters: &[f64], f0_hz: f64) -> Self {
        for (level, harmonic) in self.harmonics_db.iter_mut().zip(1..) {
            *level += filters_db(filters, f64::from(harmonic) * f0_hz);
        }
        self
    }
}

impl Data {
    fn at_point(
        &self,
        at: usize,
        recorded: &RecordedNote,
        (gamma, zeta): (f64, f64),
        filters: &[f64],
    ) -> Compared {
        let note = &self.notes[at];
        let opening = PlayerModel::FITTED.closing(dynamic_number(recorded.dynamic));
        let played = note.at_gamma(zeta, opening, gamma).map(|played| played.behind(filters, note.f0_hz));
        compare_played(played, note, recorded, &self.lost_db[at])
    }

    fn of(&self, at: usize, dynamic: Dynamic) -> Option<&RecordedNote> {
        self.recorded[at].iter().find(|recorded| recorded.dynamic == dynamic)
    }

    /// A note at a dynamic under free functions: `numbers` are those of the mouth pressure, of the flow strength, and of the filters.
    fn under(&self, free: Free, numbers: &[f64], at: usize, dynamic: Dynamic) -> Option<Compared> {
        let (gamma, others) = numbers.split_at(free.terms);
        let (zeta, filters) = others.split_at(free.terms);
        let place = self.notes[at].place;
        let recorded = self.of(at, dynamic)?;
        let point = (polynomial(gamma, place), polynomial(zeta, place).exp());
        Some(self.at_point(at, recorded, point, filters))
    }

    fn free_loss(&self, free: Free, numbers: &[f64], dynamic: Dynamic, without: Option<usize>) -> f64 {
        let notes = (0..self.notes.len()).filter(|&at| Some(at) != without);
        let compared = notes.filter_map(|at| self.under(free, numbers, at, dynamic));
        compared.map(|compared| cost(&compared, CENTROID_COST_DB)).sum()
    }

    fn free_fit(
        &self,
        free: Free,
        dynamic: Dynamic,
        starts: &[Vec<f64>],
        steps: usize,
        without: Option<usize>,
    ) -> Vec<f64> {
        let loss = |numbers: &[f64]| self.free_loss(free, numbers, dynamic, without);
        let fits = starts.iter().map(|start| simplex::minimise(&loss, start, &free.first_steps(), steps));
        fits.min_by(|a, b| loss(a).total_cmp(&loss(b))).unwrap_or_default()
    }

    /// The best point of the grid for a note by itself.
    fn alone(&self, at: usize, dynamic: Dynamic) -> Option<Compared> {
        let recorded = self.of(at, dynamic)?;
        let points = grid(GAMMAS).flat_map(|gamma| grid(ZETAS).map(move |zeta| (gamma, zeta)));
        let compared = points.map(|point| self.at_point(at, recorded, point, &[]));
        let cost = |compared: &Compared| cost(compared, CENTROID_COST_DB);
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
        for (filters, terms) in
            [false, true].into_iter().flat_map(|filters| TERMS.map(|terms| (filters, terms)))
        {
            let free = Free { terms, filters };
            let what = format!("{terms} terms each{}", if filters { " and three filters" } else { "" });
            let starts = STARTS.map(|start| free.start(start));
            let once = data.free_fit(free, dynamic, &starts, STEPS.0, None);
            let fitted = data.free_fit(free, dynamic, &[once], STEPS.0, None);
            let compared = (0..notes).filter_map(|at| data.under(free, &fitted, at, dynamic));
            say(&format!("{what}, fitted"), compared.map(|note| (dynamic, note)));
            let left_out = |at: usize| {
                let others = data.free_fit(free, dynamic, std::slice::from_ref(&fitted), STEPS.1, Some(at));
                data.under(free, &others, at, dynamic)
            };
            let left_out = parallel::each(notes, left_out, &mut |_| ControlFlow::Continue(()));
            say(
                &format!("{what}, left out"),
                left_out.into_iter().flatten().flatten().map(|note| (dynamic, note)),
            );
        }
    }
}
