//! Finds what a note asks of the player ([`PlayedNote`]) by playing it at each dynamic, with the lip of that dynamic, until
//! level and pitch are right.
//!
//! From the loudest dynamic down, the mouth pressure is moved until the note is as much softer as the player's rule says.
//! The level follows the excess of the pressure over an onset nearly as a power, so that secants in logarithms need two or
//! three plays. The trim is corrected on the way. Results depend on the note alone.

use crate::analysis::pitch;
use crate::instrument::held_note::{HeldNote, Start};
use crate::instrument::model::Model;
use crate::instrument::played_note::PlayedNote;
use crate::instrument::player::dynamics::NODES;
use crate::instrument::player::ear::{self, Ear};
use crate::instrument::tuning_table::NoteTuning;
use crate::instrument::voice::TICK;
use crate::units::cents;

/// A level this near to the wanted one is right, dB.
const CLOSE_DB: f64 = 0.05;
/// A pitch this near to the wanted one is right, cents.
const CLOSE_CENTS: f64 = 0.3;
/// A pitch further off than this is another note, cents.
const OTHER_CENTS: f64 = 150.0;
/// Largest number of times a note is played at one dynamic.
const PLAYS: usize = 10;
/// Onset that the search begins with, mouth over closing pressure: below that of any note, 1/3 without losses.
const LOWEST_ONSET: f64 = 0.33;
/// How far the onset may lie below that of the louder dynamic before.
const ONSET_ROOM: f64 = 0.01;
/// Excess over the onset from one dynamic to the next lower one, where the search begins; from the loudest down.
const RATIOS: [f64; NODES - 1] = [0.6, 0.5, 0.4, 0.35, 0.3];
/// Exponent of the level over the excess, where the search begins: 1 near the threshold, less above.
const EXPONENT: f64 = 0.8;
/// Mouth pressures that are tried for the loudest dynamic, over that of the rule.
const LOUDEST: [f64; 4] = [1.0, 0.93, 0.86, 0.8];
/// Time until a note is steady, s, and time that it is heard: soft notes near their threshold change slowly.
const SETTLE_S: (f64, f64) = (1.8, 0.7);
const HEAR_S: f64 = 0.3;
/// Dynamics below this are soft.
const SOFT: f64 = 0.5;
/// Lowest note of the B flat clarinet, Hz. A larger instrument takes longer to settle, in proportion to its size.
const LOWEST_HZ: f64 = 146.83;

/// A note as it was heard.
#[derive(Clone, Copy)]
struct HeardPlay {
    gamma: f64,
    /// Mean square of the radiated pressure, Pa^2.
    power: f64,
    /// Rms of the pressure in the mouthpiece over the closing pressure.
    amplitude: f64,
    off_cents: f64,
}

/// One note while it is learnt.
struct Learner<'a> {
    model: &'a Model,
    fingering: usize,
    sensitivity: f64,
    /// A pressure at or a little below the onset, as far as is known.
    onset: f64,
    /// Trim to play with next, rows.
    rows: f64,
}

/// What a note asks of the player; `None` if it does not sound in its register at some dynamic. `tuned` has the note's natural
/// trim and sensitivity.
pub fn learn(model: &Model, fingering: usize, tuned: &NoteTuning) -> Option<PlayedNote> {
    let mut learner = Learner {
        model,
        fingering,
        sensitivity: tuned.sensitivity,
        onset: LOWEST_ONSET,
        rows: tuned.natural,
    };
    let (mut gammas, mut amplitudes, mut rows) = ([0.0; NODES], [0.0; NODES], [0.0; NODES]);
    let first = learner.loudest()?;
    let loudest = model.player.loudest_gamma(model.place(fingering)).min(first);
    let top = learner.settle(1.0, loudest)?;
    (gammas[NODES - 1], amplitudes[NODES - 1], rows[NODES - 1]) = (top.gamma, top.amplitude, learner.rows);
    for (node, ratio) in (0..NODES - 1).rev().zip(RATIOS) {
        let dynamic = node as f64 / (NODES - 1) as f64;
        let wanted = top.power * 10.0_f64.powf(0.1 * model.player.level_db(dynamic));
        let guess = learner.onset + ratio * (gammas[node + 1] - learner.onset);
        let found = learner.find(dynamic, wanted, guess, gammas[node + 1])?;
        (gammas[node], amplitudes[node], rows[node]) = (found.gamma, found.amplitude, learner.rows);
    }
    gammas.is_sorted_by(|a, b| a < b).then(|| PlayedNote::new(gammas, amplitudes, rows))
}

impl Learner<'_> {
    /// Plays at a dynamic; `None` if another note or none sounds.
    fn play(&self, dynamic: f64, gamma: f64) -> Option<HeardPlay> {
        let model = self.model;
        let longer = (LOWEST_HZ / model.lowest_hz).clamp(1.0, 4.0);
        let from_s = longer * if dynamic < SOFT { SETTLE_S.0 } else { SETTLE_S.1 };
        let held = HeldNote::played(model, self.fingering, dynamic, gamma);
        let held = HeldNote { rows: self.rows, start: Start::Tongued(2.0), ..held };
        let rate_hz = model.coeffs.rate_hz;
        let closing = held.reed(model).closing_pressure();
        let ear_share = ear::share(TICK as f64 / rate_hz, model.lowest_hz);
        let (mut sound, mut ear, mut heard) = (Vec::new(), Ear::default(), 0);
        held.play(model, from_s + longer * HEAR_S, |out, voice| {
            ear.hear(voice.p_mouthpiece() / closing, ear_share);
            heard += TICK;
            if heard as f64 > from_s * rate_hz {
                sound.extend(out.iter().map(|&sample| f64::from(sample)));
            }
        });
        let hz = pitch::fundamental_hz(&sound, rate_hz)?;
        let off_cents = cents(hz, model.notes_hz[self.fingering]);
        let is_own = off_cents.abs() < OTHER_CENTS && pitch::periodicity(&sound, rate_hz, hz) > 0.9;
        let power = sound.iter().map(|sample| sample * sample).sum::<f64>() / sound.len().max(1) as f64;
        is_own.then_some(HeardPlay { gamma, power, amplitude: ear.amplitude(), off_cents })
    }

    /// Moves the trim against an error of the pitch.
    fn retrim(&mut self, off_cents: f64) {
        let (low, high) = self.model.coeffs.tuning_range();
        let estimate = self.model.rows_for_cents(self.fingering, off_cents);
        self.rows = (self.rows - self.sensitivity * estimate).clamp(low, high);
    }

    /// Largest mouth pressure, of a few, at which the note sounds at dynamic 1.
    fn loudest(&mut self) -> Option<f64> {
        let wanted = self.model.player.loudest_gamma(self.model.place(self.fingering));
        LOUDEST.into_iter().map(|share| share * wanted).find(|&gamma| self.play(1.0, gamma).is_some())
    }

    /// The note at one pressure, in tune.
    fn settle(&mut self, dynamic: f64, gamma: f64) -> Option<HeardPlay> {
        let mut heard = self.play(dynamic, gamma)?;
        for _ in 0..3 {
            if heard.off_cents.abs() < CLOSE_CENTS {
                break;
            }
            self.retrim(heard.off_cents);
            heard = self.play(dynamic, gamma)?;
        }
        Some(heard)
    }

    /// The pressure at which the note has the wanted power, between the onset and `highest`.
    fn find(&mut self, dynamic: f64, wanted: f64, guess: f64, highest: f64) -> Option<HeardPlay> {
        let mut gamma = guess;
        // The lip of a softer dynamic may let the note begin earlier.
        self.onset = (self.onset - ONSET_ROOM).max(LOWEST_ONSET);
        let mut before: Option<HeardPlay> = None;
        let mut best: Option<HeardPlay> = None;
        for _ in 0..PLAYS {
            let Some(heard) = self.play(dynamic, gamma) else {
                // Too soft to be heard, or in another register: between here and what sounded.
                let above = best.map_or(highest, |best| best.gamma.max(gamma));
                self.onset = self.onset.max(gamma);
                if above - gamma < 1e-5 {
                    return None;
                }
                gamma = 0.5 * (gamma + above);
                continue;
            };
            let off_db = 10.0 * (heard.power / wanted).log10();
            let nearer = |best: HeardPlay| off_db.abs() < (10.0 * (best.power / wanted).log10()).abs();
            if best.is_none_or(nearer) {
                best = Some(heard);
            }
            let in_tune = heard.off_cents.abs() < CLOSE_CENTS;
            if !in_tune {
                self.retrim(heard.off_cents);
            }
            if off_db.abs() < CLOSE_DB && in_tune {
                break;
            }
            let exponent = match before {
                Some(before) if (before.gamma - heard.gamma).abs() > 1e-6 => self.exponent(before, heard),
                _ => EXPONENT,
            };
            before = Some(heard);
            let step = ((wanted / heard.power).ln() / exponent).clamp(-1.5, 1.5);
            let next = self.onset + (heard.gamma - self.onset).max(1e-6) * step.exp();
            gamma = next.min(highest - 1e-4);
        }
        best
    }

    /// Exponent of the power over the excess between two plays. The line through them, power over pressure, meets zero at or
    /// below the onset, because the power rises ever more slowly: so it also tells the onset.
    fn exponent(&mut self, a: HeardPlay, b: HeardPlay) -> f64 {
        let lowest = a.gamma.min(b.gamma);
        let zero = a.gamma - a.power * (b.gamma - a.gamma) / (b.power - a.power);
        if zero.is_finite() && zero < lowest {
            self.onset = self.onset.max(zero - 0.01 * (lowest - zero)).max(LOWEST_ONSET);
        }
        let excess = |gamma: f64| (gamma - self.onset).max(1e-6).ln();
        let exponent = (b.power / a.power).ln() / (excess(b.gamma) - excess(a.gamma));
        if (0.2..4.0).contains(&exponent) { exponent } else { EXPONENT }
    }
}
