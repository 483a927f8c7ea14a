//! Finds what a note asks of the player ([`PlayedNote`]) by playing one long diminuendo.
//!
//! The note begins at the loudest dynamic and goes down to the softest, one dynamic after another, with the lip of each. A
//! controller moves the mouth pressure until the note is as much softer as the player's rule says; then pressure, amplitude
//! and pitch are read, and the trim is corrected. So the note never has to begin near its threshold, where that takes seconds, and
//! a soft note is found as a player finds it: on the way down. Results depend on the note alone, although several notes are played
//! [side by side](crate::instrument::side_by_side).

use std::ops::ControlFlow;

use crate::analysis::pitch::OTHER_CENTS;
use crate::instrument::model::Model;
use crate::instrument::played_note::PlayedNote;
use crate::instrument::player::dynamics::{LOWEST_ONSET, NODE_DYNAMICS, NODES};
use crate::instrument::prepare::auto_tune::{Accuracy, longer};
use crate::instrument::prepare::trial_pitch::trial_pitch_hz;
use crate::instrument::side_by_side::{self, BlownBeside, Stand};
use crate::instrument::trial_note::{TONGUE_HOLD_S, TrialNote};
use crate::instrument::tuning_table::{NoteTuning, TuningTable};
use crate::instrument::voice::{Drive, TICK};
use crate::maths;
use crate::reed::motion::TONGUE_FORCE;
use crate::units::cents;

/// A level this far from the wanted one was not reached, dB.
const FAR_DB: f64 = 0.5;
/// A pitch this near to the wanted one needs no other trim, cents.
const CLOSE_CENTS: f64 = 0.2;
/// A note that stays further off, because its trim ends, is played less loudly, cents.
const TRIM_ENDS_CENTS: f64 = 1.0;
/// Largest number of corrections of the trim at one dynamic.
const TRIMS: usize = 3;
/// Mouth pressures that are tried for the loudest dynamic, over that of the rule. Tongued harder, some notes begin in another
/// register: B3 of the bass clarinet above 0.68.
const LOUDEST: [f64; 6] = [1.0, 0.92, 0.84, 0.76, 0.68, 0.6];
/// Ranges of level that are tried, over that of the rule: a note of the altissimo that falls into another register where it
/// is soft is not played so softly.
const RANGES: [f64; 6] = [1.0, 0.8, 0.6, 0.45, 0.3, 0.2];
/// The loudest dynamics, from this one on, may be lost because the note is too loud; those below, because it is too soft.
const SOFT: usize = NODES - 2;
/// Excess of the pressure at dynamic 0 over that at 1, where the controller begins.
const SOFTER: f64 = 0.2;
/// The controller moves the logarithm of the excess of the mouth pressure over [`LOWEST_ONSET`]: mouth over closing pressure for
/// 1 neper of distance at once, and the rate at which the logarithm of the excess follows the distance, 1/s. Near its threshold
/// the amplitude grows by some 300 nepers a second and unit of pressure: the two then settle in a quarter of a second.
const PUSH: f64 = 0.06;
const RATE: f64 = 12.0;
/// Distances that count for the controller, nepers.
const FARTHEST: f64 = 0.7;
/// Highest mouth over closing pressure.
const HIGHEST: f64 = 1.1;
/// Time over which the controller listens, periods of the note.
const PERIODS: f64 = 4.0;
/// Times on the largest clarinet's scale, s: of a tongued beginning, of a change from one dynamic to the next, of settling there,
/// of settling after a new trim, and of listening.
const BEGIN_S: f64 = 0.6;
const CHANGE_S: f64 = 0.15;
const SETTLE_S: f64 = 0.6;
const TRIMMED_S: f64 = 0.25;
const LISTEN_S: f64 = 0.25;

/// A note as it was heard.
#[derive(Clone, Copy)]
struct Heard {
    /// Mouth over closing pressure.
    gamma: f64,
    /// Mean square of the radiated pressure, Pa^2.
    power: f64,
    /// Rms of the pressure in the mouthpiece over the closing pressure.
    amplitude: f64,
    off_cents: f64,
}

/// A note that is held while lip and breath change.
struct Diminuendo<'a> {
    model: &'a Model,
    fingering: usize,
    stand: &'a Stand,
    voice: BlownBeside,
    held: TrialNote,
    /// Dynamic of the lip.
    dynamic: f64,
    /// Force of the tongue, 0..=1.
    tongue: f64,
    /// Mean square that is wanted; `None` for a constant pressure.
    wanted: Option<f64>,
    /// Mean square of the last periods.
    power: f64,
    /// Times are this much longer than on the B flat clarinet.
    longer: f64,
}

/// What every note of a model asks of the player, on all cores, given the trims of its table; takes some seconds on
/// two cores. `on` receives the share done, 0..=1; if it breaks, the result is `None`.
pub fn learn(
    model: &Model,
    accuracy: Accuracy,
    on: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Option<TuningTable> {
    let all: Vec<usize> = (0..model.tuning.notes.len()).collect();
    learn_again(model, &all, accuracy, on)
}

/// What some fingerings of a model ask of the player, as [`learn`]; the others stay as they are. An index that the model lacks does
/// nothing.
pub fn learn_again(
    model: &Model,
    fingerings: &[usize],
    accuracy: Accuracy,
    on: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Option<TuningTable> {
    let mut notes = model.tuning.notes.clone();
    let fingerings: Vec<usize> = fingerings.iter().copied().filter(|&at| at < notes.len()).collect();
    let learnt = async |stand: &Stand, at: usize| {
        let (fingering, note) = (fingerings[at], model.tuning.notes[fingerings[at]]);
        let learnt = if note.silent { None } else { learn_beside(stand, model, fingering, accuracy).await };
        // What cannot be played gets the pressures of other notes.
        let unheard = || PlayedNote { rows: [note.natural; NODES], ..PlayedNote::default() };
        NoteTuning { played: learnt.unwrap_or_else(unheard), ..note }
    };
    let learnt = side_by_side::each_from_last(fingerings.len(), learnt, on)?;
    for (&fingering, note) in fingerings.iter().zip(learnt) {
        notes[fingering] = note;
    }
    Some(TuningTable { notes })
}

/// What one note asks of the player; `None` if it leaves its register whatever is tried.
///
/// A note that is out of tune where it is loudest is played less loudly, down to 0.6 of the rule's pressure; then the best is taken.
pub fn learn_note(model: &Model, fingering: usize, accuracy: Accuracy) -> Option<PlayedNote> {
    side_by_side::alone(async |stand| learn_beside(stand, model, fingering, accuracy).await)
}

async fn learn_beside(
    stand: &Stand,
    model: &Model,
    fingering: usize,
    accuracy: Accuracy,
) -> Option<PlayedNote> {
    let tuned = model.tuning.notes.get(fingering)?;
    let gamma = model.player.loudest_gamma(model.place(fingering));
    // What is lost at the loudest dynamic is lost whatever the range.
    let mut speaks = [true; LOUDEST.len()];
    for range in RANGES {
        let mut best: Option<(f64, PlayedNote)> = None;
        let mut softest = NODES;
        for (share, speaks) in LOUDEST.into_iter().zip(&mut speaks).filter(|(_, speaks)| **speaks) {
            let most_cents = best.map_or(f64::INFINITY, |(least, _)| least);
            match descend(stand, model, fingering, tuned, share * gamma, range, most_cents).await {
                Ok((off_cents, note)) if off_cents < TRIM_ENDS_CENTS => return Some(note),
                Ok(found) => best = Some(found),
                Err(Lost::AtLoudest) => *speaks = false,
                Err(Lost::At(node)) if node < softest.min(SOFT) => softest = node,
                // Where a note is lost because it is soft, it is mostly lost if it begins more softly, too.
                Err(Lost::At(node)) if node < SOFT && !accuracy.every_beginning => break,
                Err(Lost::At(_) | Lost::OutOfTune) => {}
            }
        }
        if let Some((_, note)) = best {
            return Some(note);
        }
    }
    None
}

/// Where a diminuendo is given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Lost {
    AtLoudest,
    /// At a softer one, by its number.
    At(usize),
    /// Not better in tune than what is known.
    OutOfTune,
}

/// Plays the diminuendo from a mouth pressure `gamma`, over a part of the rule's range of level. Gives the note and its largest error
/// of pitch, cents; gives up where the note leaves its register, or gets as far out of tune as `most_cents`.
async fn descend(
    stand: &Stand,
    model: &Model,
    fingering: usize,
    tuned: &NoteTuning,
    gamma: f64,
    range: f64,
    most_cents: f64,
) -> Result<(f64, PlayedNote), Lost> {
    let mut note = Diminuendo::begin(stand, model, fingering, tuned, gamma).await.ok_or(Lost::AtLoudest)?;
    let (mut gammas, mut amplitudes, mut rows) = ([0.0; NODES], [0.0; NODES], [0.0; NODES]);
    let (mut loudest, mut off_cents) = (None, 0.0_f64);
    for node in (0..NODES).rev() {
        let dynamic = NODE_DYNAMICS[node];
        if let Some(power) = loudest {
            note.wanted = Some(power * maths::pow(10.0, 0.1 * range * model.player.level_db(dynamic)));
            let softer = range * (note.dynamic - dynamic);
            let excess = maths::pow(SOFTER, softer) * (note.held.gamma - LOWEST_ONSET).max(1e-3);
            note.go_to(dynamic, LOWEST_ONSET + excess).await;
        }
        let lost = if loudest.is_none() { Lost::AtLoudest } else { Lost::At(node) };
        let heard = note.settle(tuned.sensitivity).await.ok_or(lost)?;
        loudest = loudest.or(Some(heard.power));
        off_cents = off_cents.max(heard.off_cents.abs());
        if off_cents >= most_cents {
            return Err(Lost::OutOfTune);
        }
        (gammas[node], amplitudes[node], rows[node]) = (heard.gamma, heard.amplitude, note.held.rows);
    }
    Ok((off_cents, PlayedNote::new(gammas, amplitudes, rows)))
}

impl<'a> Diminuendo<'a> {
    /// Tongues the note at dynamic 1; `None` if it does not speak.
    async fn begin(
        stand: &'a Stand,
        model: &'a Model,
        fingering: usize,
        tuned: &NoteTuning,
        gamma: f64,
    ) -> Option<Self> {
        let held = TrialNote { rows: tuned.natural, ..TrialNote::played(model, fingering, 1.0, gamma) };
        let longer = longer(model);
        let mut note = Self {
            model,
            fingering,
            stand,
            voice: BlownBeside::new(
                model,
                held.voice(model),
                Drive { p_mouth: 0.0, tongue: 0.0, noise: 0.0, reed: held.reed(model) },
            ),
            held,
            dynamic: 1.0,
            tongue: 1.0,
            wanted: None,
            power: 0.0,
            longer,
        };
        note.play(TONGUE_HOLD_S, |_, _, _| {}).await;
        note.tongue = 0.0;
        note.play(longer * BEGIN_S, |_, _, _| {}).await;
        note.listen().await.map(|_| note)
    }

    /// Goes on for so long; calls `heard` after each tick with the radiated pressure, the pressure in the mouthpiece over the
    /// closing pressure, and the mouth over closing pressure.
    async fn play(&mut self, seconds: f64, mut heard: impl FnMut(&[f32; TICK], f64, f64)) {
        let rate_hz = self.model.coeffs.rate_hz;
        let tick_s = TICK as f64 / rate_hz;
        let share = 1.0 - maths::exp(-tick_s * self.model.notes_hz[self.fingering] / PERIODS);
        let reed = self.held.reed(self.model);
        let closing = reed.closing_pressure();
        for _ in 0..(seconds / tick_s).round() as usize {
            let mut push = 0.0;
            if let Some(wanted) = self.wanted {
                let distance = (0.5 * maths::ln(wanted / self.power.max(1e-12))).clamp(-FARTHEST, FARTHEST);
                let excess = (self.held.gamma - LOWEST_ONSET).max(1e-4);
                let gamma = LOWEST_ONSET + excess * maths::exp(RATE / self.longer * tick_s * distance);
                self.held.gamma = gamma.min(HIGHEST);
                push = PUSH / self.longer * distance;
            }
            let gamma = self.held.gamma + push;
            let (p_mouth, tongue) = (gamma * closing, TONGUE_FORCE * self.tongue * closing);
            self.voice.tick(self.stand, Drive { p_mouth, tongue, noise: 0.0, reed }).await;
            let (out, pressure) = self.voice.with(|voice| (*voice.heard().0, voice.p_mouthpiece() / closing));
            let power = out.iter().map(|&x| f64::from(x) * f64::from(x)).sum::<f64>() / TICK as f64;
            self.power += (power - self.power) * share;
            heard(&out, pressure, gamma);
        }
    }

    /// Moves to the lip of another dynamic, and to a mouth pressure from which the controller goes on.
    async fn go_to(&mut self, dynamic: f64, gamma: f64) {
        let (from, from_gamma, steps) = (self.dynamic, self.held.gamma, 30);
        let wanted = self.wanted.take();
        for step in 1..=steps {
            let way = f64::from(step) / f64::from(steps);
            let (dynamic, gamma) = (from + way * (dynamic - from), from_gamma + way * (gamma - from_gamma));
            let lip = TrialNote::played(self.model, self.fingering, dynamic, gamma);
            self.held = TrialNote { rows: self.held.rows, ..lip };
            self.play(self.longer * CHANGE_S / f64::from(steps), |_, _, _| {}).await;
        }
        (self.dynamic, self.wanted) = (dynamic, wanted);
        self.play(self.longer * SETTLE_S, |_, _, _| {}).await;
    }

    /// Listens until the note is in tune; `None` if it is another note or not as loud as it should be.
    async fn settle(&mut self, sensitivity: f64) -> Option<Heard> {
        let mut heard = self.listen().await?;
        for _ in 0..TRIMS {
            if heard.off_cents.abs() < CLOSE_CENTS {
                break;
            }
            let (low, high) = self.model.coeffs.tuning_range();
            let rows = sensitivity * self.model.rows_for_cents(self.fingering, heard.off_cents);
            self.held.rows = (self.held.rows - rows).clamp(low, high);
            let ticks = (0.05 * self.model.coeffs.rate_hz) as usize;
            self.voice.with(|voice| voice.lattice_mut().glide_delay(self.held.rows, ticks));
            self.play(self.longer * TRIMMED_S, |_, _, _| {}).await;
            heard = self.listen().await?;
        }
        let off_db = self.wanted.map_or(0.0, |wanted| 10.0 * maths::log10(heard.power / wanted));
        (off_db.abs() < FAR_DB).then_some(heard)
    }

    /// Hears the note as it is; `None` if it is another one.
    async fn listen(&mut self) -> Option<Heard> {
        let (mut sound, mut square, mut sum, mut ticks) = (Vec::new(), 0.0, 0.0, 0.0);
        self.play(self.longer * LISTEN_S, |out, pressure, gamma| {
            sound.extend(out.iter().map(|&x| f64::from(x)));
            square += pressure * pressure;
            sum += gamma;
            ticks += 1.0;
        })
        .await;
        let rate_hz = self.model.coeffs.rate_hz;
        let note_hz = self.model.notes_hz[self.fingering];
        let off_cents = cents(trial_pitch_hz(&sound, rate_hz, note_hz)?, note_hz);
        (off_cents.abs() < OTHER_CENTS).then_some(Heard {
            gamma: sum / ticks,
            power: sound.iter().map(|x| x * x).sum::<f64>() / sound.len() as f64,
            amplitude: (square / ticks).sqrt(),
            off_cents,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_note_is_learnt_anew_as_it_came_with_the_program() {
        let model = Model::built_in(48_000.0).unwrap();
        for fingering in [0, 24] {
            let (kept, again) = (
                model.tuning.notes[fingering].played,
                learn_note(&model, fingering, Accuracy::QUICK).unwrap(),
            );
            for node in 0..NODES {
                assert!((kept.gammas[node] - again.gammas[node]).abs() < 1e-3, "{fingering}: {again:?}");
                assert!((kept.amplitudes[node] / again.amplitudes[node] - 1.0).abs() < 0.01);
                assert!((kept.rows[node] - again.rows[node]).abs() < 0.02);
            }
        }
    }

    #[test]
    fn a_note_that_leaves_its_register_is_not_learnt() {
        let model = Model::built_in(48_000.0).unwrap();
        // Far above its closing pressure a reed stays shut.
        let tuned = &model.tuning.notes[0];
        let most_cents = f64::INFINITY;
        let descent = side_by_side::alone(async |stand| {
            descend(stand, &model, 0, tuned, 3.0, 1.0, most_cents).await.map(|(off_cents, _)| off_cents)
        });
        assert_eq!(descent, Err(Lost::AtLoudest));
    }
}
