//! Fits the player's rule to the committed half of the recorded notes, and says how well it does on notes left out.
//!
//! Every recorded note is played on a grid of opening, flow strength and mouth pressure, once (`spectra`). A rule then picks a point for
//! each note and dynamic: fortissimo by its pressure, the others by level below fortissimo, as a player does. The loss is
//! the mean distance of harmonics 2 to 10 at pp, mf and ff, plus a charge for each centroid outside the range that counts as
//! right, and for loud dynamics that are not reached. Upper harmonics are first lowered by what the pitch of a held note costs them that wanders as recorded ones do
//! (`wander`). A simplex search finds the rule (`simplex`), and again without each note in turn. `bound` says how near any smooth rule
//! could come.

mod bound;
mod simplex;
mod spectra;
mod wander;

use anyhow::{Result, bail, ensure};
use chalumeau_core::instrument::Model;
use chalumeau_core::instrument::player::dynamics::{MEZZO_FORTE, PlayerModel};
use chalumeau_core::measure::realism::{
    CENTROID_RATIOS, Dynamic, RecordedNote, differences_db, mean, median,
};
use chalumeau_core::parallel;
use std::ops::ControlFlow;

use crate::generated::{read, write};
use spectra::{NoteSpectra, PlayedSpectrum};

/// Host rate of the recordings, Hz.
const RATE_HZ: f64 = 44_100.0;
/// Where the result is written.
const PATH: &str = "crates/core/src/instrument/player/fitted.rs";
/// What a note counts that the rule cannot play, dB.
const FAIL_DB: f64 = 20.0;
/// What a centroid outside the range costs, dB, and the width of the slope up to that in the logarithm of its ratio.
const CENTROID_COST_DB: f64 = 6.0;
const CENTROID_SLOPE: f64 = 0.3;
/// What each missing dB costs where a loud dynamic is not reached at the mouth pressure of fortissimo: a player who nears the closing
/// pressure opens the lip. And the dynamics at which this is asked.
const SHORT_COST: f64 = 2.0;
const LOUD: [f64; 3] = [0.7, 0.82, 0.92];
/// Steps of the search: for the fit, twice, and for each note left out.
const STEPS: (usize, usize) = (500, 250);
/// The rule may differ by this from the committed one when it is fitted again: rounding of another processor.
const TOLERANCE: f64 = 2e-2;

/// The numbers that are fitted: pressure at fortissimo (3), zeta (4), logarithm of the growth of the closing pressure. The
/// others (range of levels, closing pressure at dynamic 0, flow strength in the altissimo, knee) are chosen, see `docs/tone.md`.
const COUNT: usize = 8;
/// Size of the first steps of the search.
const FIRST_STEPS: [f64; COUNT] = [0.08, 0.08, 0.08, 0.1, 0.1, 0.1, 0.1, 0.1];

fn numbers(rule: &PlayerModel) -> [f64; COUNT] {
    let ([g0, g1, g2], [z0, z1, z2, z3]) = (rule.loudest_gamma, rule.zeta);
    [g0, g1, g2, z0, z1, z2, z3, rule.closing[1].ln()]
}

fn rule_of(numbers: &[f64]) -> PlayerModel {
    let mut rule = PlayerModel::FITTED;
    rule.loudest_gamma.copy_from_slice(&numbers[..3]);
    rule.zeta.copy_from_slice(&numbers[3..7]);
    // Between a lip that stays and one that opens threefold.
    rule.closing[1] = numbers[7].exp().clamp(1.0, 3.0);
    rule
}

/// One note at one dynamic against its recording.
#[derive(Clone, Copy)]
struct Compared {
    error_db: f64,
    /// Centroid over the recorded one; NaN if the note failed.
    ratio: f64,
}

fn dynamic_number(dynamic: Dynamic) -> f64 {
    match dynamic {
        Dynamic::Pp => 0.0,
        Dynamic::Mf => MEZZO_FORTE,
        Dynamic::Ff => 1.0,
    }
}

/// What a rule plays for a dynamic.
fn played(rule: &PlayerModel, note: &NoteSpectra, dynamic: Dynamic) -> Option<PlayedSpectrum> {
    let d = dynamic_number(dynamic);
    let loudest = loudest(rule, note)?;
    if dynamic == Dynamic::Ff {
        return Some(loudest);
    }
    note.at_level(rule.zeta(note.place, d), rule.closing(d), wanted_db(rule, &loudest, d))
}

fn loudest(rule: &PlayerModel, note: &NoteSpectra) -> Option<PlayedSpectrum> {
    note.at_gamma(rule.zeta(note.place, 1.0), rule.closing(1.0), rule.loudest_gamma(note.place))
}

/// Level of a dynamic as the grid has it, dB: there it does not go with the closing pressure.
fn wanted_db(rule: &PlayerModel, loudest: &PlayedSpectrum, d: f64) -> f64 {
    loudest.level_db + rule.level_db(d) - 20.0 * (rule.closing(d) / rule.closing(1.0)).log10()
}

/// By how much loud dynamics of a note are too soft at the mouth pressure of fortissimo, dB.
fn short_db(rule: &PlayerModel, note: &NoteSpectra) -> f64 {
    let Some(loudest) = loudest(rule, note) else { return 0.0 };
    let at = |d| {
        let gamma = rule.loudest_gamma(note.place);
        let played = note.at_gamma(rule.zeta(note.place, d), rule.closing(d), gamma);
        played.map_or(0.0, |played| (wanted_db(rule, &loudest, d) - played.level_db).max(0.0))
    };
    LOUD.map(at).iter().sum()
}

fn compare(rule: &PlayerModel, note: &NoteSpectra, recorded: &RecordedNote, lost_db: &[f64]) -> Compared {
    compare_played(played(rule, note, recorded.dynamic), note, recorded, lost_db)
}

fn compare_played(
    played: Option<PlayedSpectrum>,
    note: &NoteSpectra,
    recorded: &RecordedNote,
    lost_db: &[f64],
) -> Compared {
    let Some(played) = played else {
        return Compared { error_db: FAIL_DB, ratio: f64::NAN };
    };
    let heard: Vec<f64> = played.harmonics_db.iter().zip(lost_db).map(|(level, lost)| level - lost).collect();
    let differences = differences_db(&heard, &recorded.levels_db);
    let error_db = mean(differences[1..].iter().map(|difference| difference.abs()));
    Compared { error_db, ratio: played.centroid_hz(note.f0_hz) / recorded.centroid_hz }
}

/// Error and, as far as the centroid is wrong, what a wrong one costs, dB.
fn cost(compared: &Compared, centroid_cost_db: f64) -> f64 {
    let (low, high) = CENTROID_RATIOS;
    let far = (compared.ratio.ln() / (if compared.ratio > 1.0 { high } else { low }).ln() - 1.0) * high.ln();
    let outside =
        if far.is_nan() { 1.0 } else { ((far + 0.5 * CENTROID_SLOPE) / CENTROID_SLOPE).clamp(0.0, 1.0) };
    compared.error_db + centroid_cost_db * outside
}

/// Everything that a fit needs.
struct Data {
    notes: Vec<NoteSpectra>,
    /// The recordings of each note.
    recorded: Vec<Vec<RecordedNote>>,
    /// What a wandering pitch costs the harmonics of each note, dB.
    lost_db: Vec<Vec<f64>>,
}

impl Data {
    fn compare(&self, rule: &PlayerModel, at: usize) -> impl Iterator<Item = (Dynamic, Compared)> + '_ {
        let rule = *rule;
        self.recorded[at].iter().map(move |recorded| {
            (recorded.dynamic, compare(&rule, &self.notes[at], recorded, &self.lost_db[at]))
        })
    }

    fn loss(&self, numbers: &[f64], without: Option<usize>) -> f64 {
        let rule = rule_of(numbers);
        let notes = (0..self.notes.len()).filter(|&at| Some(at) != without);
        let short = SHORT_COST * mean(notes.clone().map(|at| short_db(&rule, &self.notes[at])));
        short
            + mean(
                notes
                    .flat_map(|at| self.compare(&rule, at))
                    .map(|(_, compared)| cost(&compared, CENTROID_COST_DB)),
            )
    }

    fn fit(&self, from: &[f64; COUNT], without: Option<usize>, steps: usize) -> Vec<f64> {
        simplex::minimise(&|numbers| self.loss(numbers, without), from, &FIRST_STEPS, steps)
    }
}

/// Fits the rule and writes it; with `--check` compares it with the committed one, with `--bound` says how near any smooth rule can come.
pub fn run(args: &[String]) -> Result<()> {
    let check = match args {
        [] => false,
        [arg] if arg == "--check" => true,
        [arg] if arg == "--bound" => {
            bound::run(&data()?);
            return Ok(());
        }
        _ => bail!("takes --check, --bound or nothing, got {}", args.join(" ")),
    };
    let data = data()?;
    let start = numbers(&PlayerModel::FITTED);
    let first = data.fit(&start, None, STEPS.0);
    let again: [f64; COUNT] = first.as_slice().try_into()?;
    let fitted: [f64; COUNT] = data.fit(&again, None, STEPS.0).as_slice().try_into()?;
    let rule = rule_of(&fitted);
    println!("{rule:#?}");
    say("fitted", (0..data.notes.len()).flat_map(|at| data.compare(&rule, at)));
    let left_out = |at: usize| -> Vec<(Dynamic, Compared)> {
        data.compare(&rule_of(&data.fit(&fitted, Some(at), STEPS.1)), at).collect()
    };
    let validated = parallel::each(data.notes.len(), left_out, &mut |_| ControlFlow::Continue(()));
    say("left out", validated.into_iter().flatten().flatten());
    if check {
        let now = numbers(&PlayerModel::FITTED);
        let off = now.iter().zip(&fitted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("the committed rule differs by {off:.1e}");
        ensure!(
            off < TOLERANCE,
            "{PATH} is not this fit; run `cargo xtask fit-player`, then `cargo xtask tune`"
        );
        return Ok(());
    }
    write(PATH, &text(&read(PATH)?, &rule))
}

/// Plays every note on the grid.
fn data() -> Result<Data> {
    let model = Model::built_in(RATE_HZ)?;
    let all = RecordedNote::all();
    let mut midis: Vec<u8> = all.iter().map(|note| note.midi).collect();
    midis.dedup();
    // The lowest note has no recording: it is asked to reach its loud dynamics.
    let lowest = model.file.fingerings.iter().map(|fingering| fingering.written).min();
    let lowest = lowest.and_then(|written| written.sounding(model.file.transposition));
    midis.extend(lowest.map(|note| note.0).filter(|lowest| !midis.contains(lowest)));
    let play = |at: usize| NoteSpectra::play(&model, midis[at]);
    let mut on = |share: f64| {
        eprint!("\rplaying {:3.0} %", 100.0 * share);
        ControlFlow::Continue(())
    };
    let notes =
        parallel::each(midis.len(), play, &mut on).into_iter().flatten().flatten().collect::<Vec<_>>();
    eprintln!();
    ensure!(notes.len() == midis.len(), "a recorded note has no fingering");
    let of = |note: &NoteSpectra| all.iter().filter(|other| other.midi == note.midi).cloned().collect();
    let loss = wander::Loss::recorded();
    let lost = |note: &NoteSpectra| {
        (1..=spectra::HARMONICS).map(|harmonic| loss.lost_db(harmonic as f64 * note.f0_hz)).collect()
    };
    Ok(Data { recorded: notes.iter().map(of).collect(), lost_db: notes.iter().map(lost).collect(), notes })
}

/// Prints error and centroids of each dynamic that was compared.
fn say(what: &str, compared: impl Iterator<Item = (Dynamic, Compared)>) {
    let compared: Vec<_> = compared.collect();
    for dynamic in Dynamic::ALL {
        let own = || compared.iter().filter(|(of, _)| *of == dynamic).map(|(_, compared)| compared);
        if own().next().is_none() {
            continue;
        }
        let right =
            |ratio: f64| f64::from(u8::from((CENTROID_RATIOS.0..=CENTROID_RATIOS.1).contains(&ratio)));
        println!(
            "{what}, {}: error {:.2} dB, centroid right on {:.0} %, median ratio {:.2}",
            dynamic.name(),
            mean(own().map(|compared| compared.error_db)),
            100.0 * mean(own().map(|compared| right(compared.ratio))),
            median(own().map(|compared| compared.ratio).filter(|ratio| !ratio.is_nan()))
        );
    }
}

/// The generated file: its head as it is, then the rule.
fn text(kept: &str, rule: &PlayerModel) -> String {
    let head = kept.split("pub const FITTED").next().unwrap_or_default();
    let PlayerModel { range_db, loudest_gamma, zeta, closing, altissimo_zeta, knee } = rule;
    let round = |numbers: &[f64]| numbers.iter().map(|x| format!("{x:.4}")).collect::<Vec<_>>().join(", ");
    format!(
        "{head}pub const FITTED: PlayerModel = PlayerModel {{\n    range_db: {range_db:?},\n    loudest_gamma: [{}],\n    \
         zeta: [{}],\n    closing: [{}],\n    altissimo_zeta: {altissimo_zeta:?},\n    knee: {knee:?},\n}};\n",
        round(loudest_gamma),
        round(zeta),
        round(closing)
    )
}
