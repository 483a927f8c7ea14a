//! Finds the trims of a [`TuningTable`] by playing: it holds every note, measures its pitch, and moves its delay until the
//! pitch is right.
//!
//! The notes are independent: several are tried [side by side](crate::instrument::side_by_side), and the result does not depend on how many
//! processor cores share them. A note that hardly ever
//! sounds in its register gets the trims of its neighbours and is marked. What a player needs of a note is learnt
//! afterwards, in [`play_dynamics`](super::play_dynamics). Units: cents above the wanted pitch, rows of
//! round-trip delay, mouth pressure over the closing pressure (gamma).

use std::ops::ControlFlow;

use crate::instrument::model::Model;
use crate::instrument::prepare::trial_pitch::trial_pitch_hz;
use crate::instrument::side_by_side::{self, Stand};
use crate::instrument::trial_note::TrialNote;
use crate::instrument::tuning_table::{GAMMA_NODES, NATURAL_GAMMA, NoteTuning, TuningTable};
use crate::maths;
use crate::units::cents;

/// A note with a larger error than this after trimming is reported as out of tune, cents.
const OFF_CENTS: f64 = 0.5;
/// How far a note is moved up and down to measure its sensitivity to the delay, cents.
const PROBE_CENTS: f64 = 20.0;
/// A pitch further off than this is another note, cents: after trimming, and before. Before trimming a note must also be
/// nearer to its own mode than to a neighbouring one.
const OTHER_NOTE_CENTS: (f64, f64) = (150.0, 300.0);
/// Largest number of times a note is played for one trim.
const PLAYS: usize = 6;
/// A move by more than this measures the sensitivity, cents.
const MEASURING_CENTS: f64 = 10.0;
/// At fewer of the five pressures than this a note does not speak. One alone is chance: there written A#6 of the bundled
/// clarinets, with the maker's fingering, can be trimmed to its pitch at some rates and not at others, and it leaves its
/// register when played softer or louder.
const FEWEST_PRESSURES: usize = 2;
/// Lowest note of the B flat clarinet, Hz.
const LOWEST_HZ: f64 = 146.83;

/// How exactly notes are tuned.
#[derive(Clone, Copy, Debug)]
pub struct Accuracy {
    /// Largest error of a note that needs no further trim, cents.
    close_cents: f64,
    /// A last step of less than this is not played again, cents: the sensitivity is known to a few per cent by then.
    sure_cents: f64,
    /// Whether the sensitivity is measured around the trim, by two more plays, or taken from the way there.
    around: bool,
    /// Whether a note that is lost where it is soft is tried from every softer beginning before its range of level is narrowed; else
    /// only while that brings it further down. Concerns some of the highest notes.
    pub(super) every_beginning: bool,
}

impl Accuracy {
    /// Within 0.1 cents: for a user who waits.
    pub const QUICK: Self = Self { close_cents: 0.1, sure_cents: 2.0, around: false, every_beginning: false };
    /// Within 0.03 cents: for the instruments that come with the program. Takes half as long again.
    pub const FINE: Self = Self { close_cents: 0.02, sure_cents: 0.2, around: true, every_beginning: true };
}

/// How much longer than a B flat clarinet an instrument takes to settle: in proportion to the period of its lowest note.
pub(super) fn longer(model: &Model) -> f64 {
    let lowest_hz = model.notes_hz.first().copied().unwrap_or(LOWEST_HZ);
    (LOWEST_HZ / lowest_hz).clamp(1.0, 4.0)
}

/// From when to when the pitch of a held note is measured, s: near the threshold a note grows slowly.
fn listening_s(model: &Model, gamma: f64) -> (f64, f64) {
    let longer = longer(model);
    let (from_s, to_s) = if gamma < 0.5 { (1.0, 1.3) } else { (0.6, 0.9) };
    (longer * from_s, longer * to_s)
}

/// Pitch of a held note, Hz, or `None` if it is not periodic or more than 150 cents from `wanted_hz`. Plays the note for
/// about a second, longer on larger instruments. Allocates.
pub fn heard_hz(model: &Model, note: &TrialNote, wanted_hz: f64) -> Option<f64> {
    side_by_side::alone(async |stand| heard_within(stand, model, note, wanted_hz, OTHER_NOTE_CENTS.0).await)
}

async fn heard_within(
    stand: &Stand,
    model: &Model,
    note: &TrialNote,
    wanted_hz: f64,
    own_cents: f64,
) -> Option<f64> {
    let (from_s, to_s) = listening_s(model, note.gamma);
    let sound = note.radiated_beside(stand, model, from_s, to_s).await;
    trial_pitch_hz(&sound, model.coeffs.rate_hz, wanted_hz)
        .filter(|hz| cents(*hz, wanted_hz).abs() < own_cents)
}

/// One note at one mouth pressure.
struct Trial<'a> {
    stand: &'a Stand,
    model: &'a Model,
    fingering: usize,
    gamma: f64,
    accuracy: Accuracy,
}

/// A trim that was played.
#[derive(Clone, Copy)]
struct PlayedTrim {
    rows: f64,
    off_cents: f64,
}

impl Trial<'_> {
    /// Plays the note with a trim of `rows`; `None` if another note or none sounds.
    async fn play(&self, rows: f64) -> Option<PlayedTrim> {
        let wanted = self.model.notes_hz[self.fingering];
        // The modes are as the odd numbers; the limit is half-way to the next higher one.
        let mode = self.model.file.fingerings[self.fingering].mode as f64;
        let half_way = 600.0 * maths::log2((2.0 * mode + 1.0) / (2.0 * mode - 1.0));
        let note = TrialNote { rows, ..TrialNote::new(self.model, self.fingering, self.gamma) };
        let own_cents = half_way.min(OTHER_NOTE_CENTS.1);
        let hz = heard_within(self.stand, self.model, &note, wanted, own_cents).await?;
        Some(PlayedTrim { rows, off_cents: cents(hz, wanted) })
    }

    /// Secant steps from a trim that was played. `known` is the sensitivity if it was measured already; it comes back with
    /// the trim, measured if possible.
    async fn trim(&self, from: PlayedTrim, known: Option<f64>) -> (PlayedTrim, Option<f64>) {
        let (low, high) = self.model.coeffs.tuning_range();
        let estimate = |off_cents: f64| self.model.rows_for_cents(self.fingering, off_cents);
        let mut sensitivity = known.unwrap_or(1.0);
        let mut heard = known;
        let (mut best, mut before) = (from, from);
        let mut rows = from.rows;
        for _ in 1..PLAYS {
            if best.off_cents.abs() < self.accuracy.close_cents {
                break;
            }
            let wanted = (before.rows - sensitivity * estimate(before.off_cents)).clamp(low, high);
            if wanted == rows {
                break;
            }
            if heard.is_some()
                && before.off_cents.abs() < self.accuracy.sure_cents
                && wanted > low
                && wanted < high
            {
                best = PlayedTrim { rows: wanted, off_cents: 0.0 };
                break;
            }
            rows = wanted;
            let Some(here) = self.play(rows).await else {
                // The step went too far and the note left its register: take half of it.
                sensitivity *= 0.5;
                before = best;
                continue;
            };
            let moved = estimate(here.off_cents) - estimate(before.off_cents);
            if moved.abs() > 0.02 {
                sensitivity = ((here.rows - before.rows) / moved).clamp(0.5, 3.0);
                if (here.off_cents - before.off_cents).abs() > MEASURING_CENTS {
                    heard = Some(sensitivity);
                }
            }
            if here.off_cents.abs() < best.off_cents.abs() {
                best = here;
            }
            before = here;
        }
        (best, heard)
    }

    /// Rows per cent near a trim, over [`Model::rows_for_cents`]; measured by moving the note both ways, or the one way for
    /// which the delay has room.
    async fn sensitivity(&self, at: PlayedTrim) -> Option<f64> {
        let (low, high) = self.model.coeffs.tuning_range();
        let moved = async |cents: f64| {
            let rows = at.rows + self.model.rows_for_cents(self.fingering, cents);
            if (low..=high).contains(&rows) { self.play(rows).await } else { None }
        };
        let (down, up) = (moved(-PROBE_CENTS).await, moved(PROBE_CENTS).await);
        let (from, to) = (down.or(up.map(|_| at))?, up.unwrap_or(at));
        let estimate = |trim: PlayedTrim| self.model.rows_for_cents(self.fingering, trim.off_cents);
        Some(((to.rows - from.rows) / (estimate(to) - estimate(from))).clamp(0.5, 3.0))
    }
}

/// The trims of one note. `untrimmed_cents` is its error without a trim at [`NATURAL_GAMMA`], `None` if it is silent
/// there.
async fn tune_note(
    stand: &Stand,
    model: &Model,
    fingering: usize,
    untrimmed_cents: Option<f64>,
    accuracy: Accuracy,
) -> NoteTuning {
    let at = |gamma: f64| Trial { stand, model, fingering, gamma, accuracy };
    let mut note = model.tuning.notes[fingering];
    let (natural, heard) = match untrimmed_cents {
        Some(off_cents) => {
            let (found, heard) = at(NATURAL_GAMMA).trim(PlayedTrim { rows: 0.0, off_cents }, None).await;
            let heard = match heard {
                Some(heard) if !accuracy.around => Some(heard),
                _ => at(NATURAL_GAMMA).sensitivity(found).await.or(heard),
            };
            (Some(found), heard)
        }
        None => (None, None),
    };
    let mut guess = natural.map_or(0.0, |found| found.rows);
    let mut nodes = [None; GAMMA_NODES.len()];
    for (node, gamma) in nodes.iter_mut().zip(GAMMA_NODES) {
        let Some(found) = at(gamma).play(guess).await else { continue };
        let (found, _) = at(gamma).trim(found, heard).await;
        guess = found.rows;
        *node = Some(found);
    }
    // A note that does not speak at the natural pressure is tuned at the first pressure where it does.
    let speaks = natural.iter().chain(nodes.iter().flatten()).count() >= FEWEST_PRESSURES;
    let first = natural.or_else(|| nodes.into_iter().flatten().next()).filter(|_| speaks);
    note.silent = !speaks;
    note.sensitivity = heard.unwrap_or(1.0);
    note.natural = first.map_or(0.0, |found| found.rows);
    note.off_cents = first.map_or(0.0, |found| found.off_cents);
    if note.off_cents.abs() < OFF_CENTS {
        note.off_cents = 0.0;
    }
    let mut rows = note.natural;
    for (trim, found) in note.tempered.iter_mut().zip(nodes) {
        rows = found.map_or(rows, |found| found.rows);
        *trim = rows;
    }
    note
}

/// Error of each note without a trim at [`NATURAL_GAMMA`], cents above its pitch; `None` for a note that does not sound in
/// its register. `on` receives the share done, 0..=1; if it breaks, the result is `None`.
pub fn offsets(model: &Model, on: &mut dyn FnMut(f64) -> ControlFlow<()>) -> Option<Vec<Option<f64>>> {
    let untrimmed = async |stand: &Stand, fingering: usize| untrimmed_cents(stand, model, fingering).await;
    side_by_side::each_from_last(model.file.fingerings.len(), untrimmed, on)
}

/// Error of one note without a trim.
async fn untrimmed_cents(stand: &Stand, model: &Model, fingering: usize) -> Option<f64> {
    let trial = Trial { stand, model, fingering, gamma: NATURAL_GAMMA, accuracy: Accuracy::QUICK };
    trial.play(0.0).await.map(|found| found.off_cents)
}

/// Tunes every fingering of a model by playing it, on all cores. `offsets` is the result of [`offsets`](fn@offsets). Takes
/// up to a minute on two cores. `on` receives the share done, 0..=1; if it breaks, the result is `None`.
pub fn tune(
    model: &Model,
    offsets: &[Option<f64>],
    accuracy: Accuracy,
    on: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Option<TuningTable> {
    let count = model.file.fingerings.len();
    let note = async |stand: &Stand, fingering: usize| {
        let untrimmed_cents = offsets.get(fingering).copied().flatten();
        tune_note(stand, model, fingering, untrimmed_cents, accuracy).await
    };
    let mut table = TuningTable { notes: side_by_side::each_from_last(count, note, on)? };
    fill_silent(model, &mut table);
    Some(table)
}

/// Tunes some fingerings of a tuned model again, as [`tune`](fn@tune) would; the others keep their trims to the bit, except those of silent
/// notes between. Where `fingerings` has an index that the model lacks, nothing happens.
pub fn tune_again(
    model: &Model,
    fingerings: &[usize],
    accuracy: Accuracy,
    on: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Option<TuningTable> {
    let mut table = model.tuning.clone();
    let fingerings: Vec<usize> =
        fingerings.iter().copied().filter(|&fingering| fingering < table.notes.len()).collect();
    let tuned = async |stand: &Stand, at: usize| {
        let fingering = fingerings[at];
        let untrimmed_cents = untrimmed_cents(stand, model, fingering).await;
        tune_note(stand, model, fingering, untrimmed_cents, accuracy).await
    };
    let notes = side_by_side::each_from_last(fingerings.len(), tuned, on)?;
    for (fingering, note) in fingerings.into_iter().zip(notes) {
        table.notes[fingering] = note;
    }
    fill_silent(model, &mut table);
    Some(table)
}

/// Gives each silent note trims between those of its nearest neighbours that sound, in cents, so that they fit the note's
/// own length.
fn fill_silent(model: &Model, table: &mut TuningTable) {
    let per_cent = |fingering: usize| model.rows_for_cents(fingering, -1.0);
    let heard: Vec<usize> = (0..table.notes.len()).filter(|&note| !table.notes[note].silent).collect();
    for silent in 0..table.notes.len() {
        if !table.notes[silent].silent {
            continue;
        }
        let after = heard.partition_point(|&note| note < silent);
        let (below, above) = (after.checked_sub(1).map(|at| heard[at]), heard.get(after).copied());
        let (Some(low), Some(high)) = (below.or(above), above.or(below)) else { return };
        let way = if low == high { 0.0 } else { (silent - low) as f64 / (high - low) as f64 };
        let (low, high) = ((low, table.notes[low]), (high, table.notes[high]));
        let between = |rows: fn(&NoteTuning) -> f64| {
            let [a, b] = [low, high].map(|(note, tuning)| rows(&tuning) / per_cent(note));
            (a + way * (b - a)) * per_cent(silent)
        };
        let note = &mut table.notes[silent];
        note.natural = between(|note| note.natural);
        note.tempered = [
            between(|note| note.tempered[0]),
            between(|note| note.tempered[1]),
            between(|note| note.tempered[2]),
            between(|note| note.tempered[3]),
        ];
    }
}
