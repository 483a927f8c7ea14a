//! Fits the player's rule and the presence to the committed half of the recorded notes, and says how well they do on notes left out.
//!
//! Every recorded note is played on a grid of opening, flow strength and mouth pressure, once (`spectra`). A rule then picks a point for
//! each note and dynamic: fortissimo by its pressure, the others by level below fortissimo, as a player does; and presence is heard on
//! top. Upper harmonics are lowered by what the pitch of a held note costs them that wanders as recorded ones do (`wander`). The loss asks
//! for what `docs/tone.md` asks: harmonics 2 to 10 near enough on the mean at pp, mf and ff, the third over the second harmonic of low
//! notes, and as many centroids in their range as can be; with a charge for loud dynamics that are not reached.
//!
//! What sounds is not what the grid says, by up to half a decibel of error: the player's ear, breath noise, life, and what lies between
//! the points. So each round learns and plays the recorded notes by the best rule so far, as `chalumeau realism` plays them, and the
//! search adds what they have beyond the grid (`Beyond`) to what the grid says. This is space mapping (Bandler, Biernacki, Chen,
//! Grobelny and Hemmers 1994) with the grid as the coarse model. A rule is better if it is better as played. The search is CMA-ES (Hansen and Ostermeier
//! 2001), with a seed, and begins at the committed rule. It is made again without each note in turn. Beside it stands what smooth
//! curves through the recordings themselves say of a note left out (`smooth`).

mod smooth;
mod spectra;
mod wander;

use anyhow::{Context, Result, bail, ensure};
use chalumeau_core::analysis::steady_note::SteadyNote;
use chalumeau_core::instrument::player::dynamics::PlayerModel;
use chalumeau_core::instrument::player::response::breath_of_dynamic;
use chalumeau_core::instrument::prepare::auto_tune::Accuracy;
use chalumeau_core::instrument::prepare::play_dynamics;
use chalumeau_core::instrument::presence::Presence;
use chalumeau_core::instrument::{Model, Settings};
use chalumeau_core::measure::realism::{
    self, CENTROID_RATIOS, Dynamic, FAIL_DB, HEADROOM_DB, NoteScore, ODD_UP_TO, RecordedNote, differences_db,
    mean, median,
};
use chalumeau_core::parallel;
use chalumeau_core::units::SoundingNote;
use cmaes::{CMAESOptions, DVector};
use std::ops::ControlFlow;
use std::sync::Arc;

use crate::generated::{read, write};
use spectra::{Gains, NoteSpectra, PlayedSpectrum};

/// Host rate of the recordings, Hz.
const RATE_HZ: f64 = 44_100.0;
/// Where the result is written.
const PATH: &str = "crates/core/src/instrument/player/fitted.rs";
/// Harmonics that are compared.
const COMPARED: usize = 10;
/// How often each recorded note is played: takes differ in breath noise and *Life*. Of four takes, the errors of the best and the
/// worst differ by 0.6 dB in the median and 4 dB at most, and their centroids by 1 and 14 %.
const TAKES: usize = 8;
/// Mean errors that are asked for at pp, mf and ff, a little less than what counts as right. What each dB of error costs, and what each
/// dB over these costs.
const ASKED_DB: [f64; 3] = [3.95, 6.85, 5.9];
const ERROR_COST: f64 = 0.2;
const OVER_COST: f64 = 10.0;
/// Most that the median of the third harmonic over the second may differ from the recorded one, dB: a little less than what counts as
/// right. And what each dB over it costs.
const THIRD_ASKED_DB: f64 = 3.4;
const THIRD_COST: f64 = 3.0;
/// What it costs if all centroids of a dynamic are wrong. The logarithm of the ratio has to be inside by `CENTROID_MARGIN`, and the cost
/// begins a little before, over a slope of `CENTROID_SLOPE`; beyond, it goes on with `CENTROID_FAR`.
const CENTROID_COST: f64 = 20.0;
const CENTROID_MARGIN: f64 = 0.02;
const CENTROID_SLOPE: f64 = 0.1;
const CENTROID_FAR: f64 = 0.15;
/// What each missing dB costs where a loud dynamic is not reached at the mouth pressure of fortissimo: a player who nears the closing
/// pressure opens the lip. And the dynamics at which this is asked.
const SHORT_COST: f64 = 2.0;
const LOUD: [f64; 3] = [0.7, 0.82, 0.92];
/// The bell around the throat is no narrower than this, three semitones on a B flat clarinet: it is to be a register, not a note.
const NARROWEST: f64 = 0.15;
/// Most that the throat may add to the logarithm of the closing pressure, either way: a lip that closes further has to open and close in every
/// slur from and to the throat, which is heard.
const THROAT: f64 = 0.8;
/// Most that shelf and bell lift or cut, dB, and the highest quality of the bell: a colour, not a tone of its own.
const SHELF_DB: f64 = 7.0;
const BELL_DB: f64 = 6.0;
const SHARPEST: f64 = 2.5;
/// Seed of the search, evaluations in a round, size of the first steps in it, in [`FIRST_STEPS`], and rounds; and what the square of a
/// first step away from what was played costs, because what notes have beyond the grid is known only there.
const SEED: u64 = 1;
const EVALUATIONS: usize = 20_000;
const SIZES: [f64; 6] = [0.1, 0.1, 0.05, 0.05, 0.03, 0.02];
const AWAY_COST: f64 = 0.01;
/// The same without a note.
const LEFT_OUT: (usize, f64) = (4_000, 0.1);
/// `--check`: the committed rule may be worse than what is found by this, less than what one wrong centroid costs.
const TOLERANCE: f64 = 0.7;

/// The numbers that are fitted: pressure at fortissimo (3), zeta (4), logarithm of the growth of the closing pressure, closing pressure
/// between (2), throat (3, the width by its logarithm); presence (5, frequencies and quality by their logarithms). The
/// others (range of levels, closing pressure at dynamic 0 and on the highest notes, flow strength in the altissimo, knee) are chosen, see `docs/tone.md`.
const COUNT: usize = 18;
/// Size of the first steps of the search.
const FIRST_STEPS: [f64; COUNT] =
    [0.08, 0.08, 0.08, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.2, 0.3, 1.0, 0.3, 1.0, 0.3];

/// What is fitted.
#[derive(Clone, Copy, Debug)]
struct Rule {
    player: PlayerModel,
    presence: Presence,
}

impl Rule {
    const COMMITTED: Self = Self { player: PlayerModel::FITTED, presence: Presence::FITTED };

    fn numbers(&self) -> [f64; COUNT] {
        let ([g0, g1, g2], [z0, z1, z2, z3]) = (self.player.loudest_gamma, self.player.zeta);
        let ([m1, m2], [throat, middle, width]) = (self.player.closing_between, self.player.throat);
        let heard = self.presence;
        let growth = self.player.closing[1].ln();
        let (shelf, bell, quality) = (heard.shelf_hz.ln(), heard.bell_hz.ln(), heard.bell_quality.ln());
        [
            g0,
            g1,
            g2,
            z0,
            z1,
            z2,
            z3,
            growth,
            m1,
            m2,
            throat,
            middle,
            width.ln(),
            shelf,
            heard.shelf_db,
            bell,
            heard.bell_db,
            quality,
        ]
    }

    fn of(numbers: &[f64]) -> Self {
        let mut player = PlayerModel::FITTED;
        player.loudest_gamma.copy_from_slice(&numbers[..3]);
        player.zeta.copy_from_slice(&numbers[3..7]);
        // Between a lip that stays and one that opens threefold.
        player.closing[1] = numbers[7].exp().clamp(1.0, 3.0);
        player.closing_between.copy_from_slice(&numbers[8..10]);
        player.throat =
            [numbers[10].clamp(-THROAT, THROAT), numbers[11], numbers[12].exp().clamp(NARROWEST, 1.0)];
        // Away from 550 Hz, where a filter would hide the second harmonic of the throat.
        let hz = |log_hz: f64| log_hz.exp().clamp(1_000.0, 8_000.0);
        let presence = Presence {
            shelf_hz: hz(numbers[13]),
            shelf_db: numbers[14].clamp(-SHELF_DB, SHELF_DB),
            bell_hz: hz(numbers[15]),
            bell_db: numbers[16].clamp(-BELL_DB, BELL_DB),
            bell_quality: numbers[17].exp().clamp(0.3, SHARPEST),
        };
        Self { player, presence }
    }
}

/// One note at one dynamic against its recording.
#[derive(Clone, Copy)]
struct Compared {
    error_db: f64,
    /// Centroid over the recorded one; NaN if the note failed.
    ratio: f64,
    /// Of the lowest notes: level of the third harmonic over the second, played and recorded, dB.
    third_over_second_db: Option<(f64, f64)>,
}

impl Compared {
    /// Of a note that was played.
    fn of(score: &NoteScore) -> Self {
        let (third, recorded_third) = score.third_over_second_db();
        let low = score.recorded.midi <= ODD_UP_TO;
        Self {
            error_db: score.error_db,
            ratio: score.centroid_ratio().unwrap_or(f64::NAN),
            third_over_second_db: third.filter(|_| low).map(|third| (third, recorded_third)),
        }
    }

    /// How far the centroid is wrong, 0 to 1 and a little more.
    fn miss(&self) -> f64 {
        let ((low, high), log) = (CENTROID_RATIOS, self.ratio.ln());
        let far = (log - high.ln()).max(low.ln() - log) + CENTROID_MARGIN;
        if far.is_nan() {
            return 1.0;
        }
        (far / CENTROID_SLOPE + 0.1).clamp(0.0, 1.0) + CENTROID_FAR * far.clamp(0.0, 1.0)
    }
}

/// What a rule plays for a dynamic, with presence.
fn played(rule: &Rule, note: &NoteSpectra, dynamic: Dynamic) -> Option<PlayedSpectrum> {
    let (player, gains, d) = (&rule.player, Gains::of(&rule.presence, note.f0_hz), dynamic.played());
    let loudest = loudest(player, note)?.heard(&gains);
    if dynamic == Dynamic::Ff {
        return Some(loudest);
    }
    let wanted_db = wanted_db(player, &loudest, note.place, d);
    let (zeta, closing) = (player.zeta(note.place, d), player.closing(note.place, d));
    Some(note.at_level(zeta, closing, wanted_db, &gains)?.heard(&gains))
}

fn loudest(player: &PlayerModel, note: &NoteSpectra) -> Option<PlayedSpectrum> {
    let (zeta, closing) = (player.zeta(note.place, 1.0), player.closing(note.place, 1.0));
    note.at_gamma(zeta, closing, player.loudest_gamma(note.place))
}

/// Level of a dynamic as the grid has it, dB: there it does not go with the closing pressure.
fn wanted_db(player: &PlayerModel, loudest: &PlayedSpectrum, place: f64, d: f64) -> f64 {
    let opened = player.closing(place, d) / player.closing(place, 1.0);
    loudest.level_db() + player.level_db(d) - 20.0 * opened.log10()
}

/// By how much loud dynamics of a note are too soft at the mouth pressure of fortissimo, dB.
fn short_db(rule: &Rule, note: &NoteSpectra) -> f64 {
    let (player, gains) = (&rule.player, Gains::of(&rule.presence, note.f0_hz));
    let Some(loudest) = loudest(player, note) else { return 0.0 };
    let loudest = loudest.heard(&gains);
    let at = |d| {
        let gamma = player.loudest_gamma(note.place);
        let played = note.at_gamma(player.zeta(note.place, d), player.closing(note.place, d), gamma);
        let wanted_db = wanted_db(player, &loudest, note.place, d);
        played.map_or(0.0, |played| (wanted_db - played.heard(&gains).level_db()).max(0.0))
    };
    LOUD.map(at).iter().sum()
}

/// What a note, played whole, has beyond the grid: noise, wander beyond its mean cost, what lies between the points of the grid.
#[derive(Clone, Copy, Default)]
struct Beyond {
    harmonics_db: [f64; COMPARED],
    /// Logarithm of the ratio of the centroids.
    centroid: f64,
}

fn compare(
    rule: &Rule,
    note: &NoteSpectra,
    recorded: &RecordedNote,
    lost_db: &[f64],
    beyond: &Beyond,
) -> Compared {
    let Some(played) = played(rule, note, recorded.dynamic) else {
        return Compared { error_db: FAIL_DB, ratio: f64::NAN, third_over_second_db: None };
    };
    let steady = played.harmonics_db.iter().zip(lost_db).map(|(level, lost)| level - lost);
    let heard: Vec<f64> = steady.zip(beyond.harmonics_db).map(|(level, beyond)| level + beyond).collect();
    let differences = differences_db(&heard, &recorded.levels_db);
    let error_db = mean(differences[1..].iter().map(|difference| difference.abs()));
    let centroid_hz = played.centroid_hz(note.f0_hz) * beyond.centroid.exp();
    let over = |levels: &[f64]| levels[2] - levels[1];
    let third_over_second_db =
        (recorded.midi <= ODD_UP_TO).then(|| (over(&heard), over(&recorded.levels_db)));
    Compared { error_db, ratio: centroid_hz / recorded.centroid_hz, third_over_second_db }
}

impl Beyond {
    fn of(played: &SteadyNote, on_grid: &PlayedSpectrum, f0_hz: f64, lost_db: &[f64]) -> Self {
        // Both as they are compared: relative to their strongest.
        let steady: Vec<f64> = on_grid
            .harmonics_db
            .iter()
            .zip(lost_db)
            .map(|(level, lost)| level - lost)
            .take(COMPARED)
            .collect();
        let differences = differences_db(&played.levels_db, &steady);
        Self {
            harmonics_db: std::array::from_fn(|h| differences.get(h).copied().unwrap_or(0.0)),
            centroid: (played.centroid_hz / on_grid.centroid_hz(f0_hz)).ln(),
        }
    }
}

impl Beyond {
    fn mean(takes: &[Self]) -> Self {
        if takes.is_empty() {
            return Self::default();
        }
        Self {
            harmonics_db: std::array::from_fn(|h| mean(takes.iter().map(|take| take.harmonics_db[h]))),
            centroid: mean(takes.iter().map(|take| take.centroid)),
        }
    }
}

/// A rule whose notes were played.
struct Played {
    numbers: [f64; COUNT],
    loss: f64,
    compared: Vec<(Dynamic, Compared)>,
    beyond: Vec<Vec<Beyond>>,
}

/// Everything that a fit needs.
struct Data {
    notes: Vec<NoteSpectra>,
    /// The recordings of each note.
    recorded: Vec<Vec<RecordedNote>>,
    /// What a wandering pitch costs the harmonics of each note, dB.
    lost_db: Vec<Vec<f64>>,
    /// What each note of `recorded` has beyond the grid.
    beyond: Vec<Vec<Beyond>>,
}

impl Data {
    fn compare(&self, rule: Rule, at: usize) -> impl Iterator<Item = (Dynamic, Compared)> + '_ {
        self.recorded[at].iter().zip(&self.beyond[at]).map(move |(recorded, beyond)| {
            (recorded.dynamic, compare(&rule, &self.notes[at], recorded, &self.lost_db[at], beyond))
        })
    }

    /// Learns and plays the recorded notes by a rule, under the presence that the program has; keeps what they have beyond the grid. A
    /// note that fails has nothing beyond it.
    fn play(&mut self, numbers: &[f64; COUNT]) -> Result<Played> {
        let rule = Rule { presence: Presence::FITTED, ..Rule::of(numbers) };
        let mut model = Model { player: rule.player, ..Model::built_in(RATE_HZ)? };
        let fingerings: Vec<usize> =
            self.notes.iter().filter_map(|note| model.fingering_for(SoundingNote(note.midi))).collect();
        let go_on = &mut |_| ControlFlow::Continue(());
        model.tuning = play_dynamics::learn_again(&model, &fingerings, Accuracy::FINE, go_on)
            .context("not cancelled")?;
        let model = Arc::new(model);
        let settings = Settings::default();
        let settings = Settings { gain_db: settings.gain_db - HEADROOM_DB as f32, ..settings };
        let all: Vec<(usize, usize)> = (0..self.notes.len())
            .flat_map(|at| (0..self.recorded[at].len()).map(move |take| (at, take)))
            .collect();
        let score = |n: usize| {
            let recorded = &self.recorded[all[n / TAKES].0][all[n / TAKES].1];
            let breath = breath_of_dynamic(recorded.dynamic.played(), &settings) as f32;
            let samples = realism::render(&model, &settings, SoundingNote(recorded.midi), breath, n % TAKES);
            NoteScore::new(recorded.clone(), SteadyNote::measure(&samples))
        };
        let scores = parallel::each(TAKES * all.len(), score, &mut |_| ControlFlow::Continue(()));
        let scores = scores.context("not cancelled")?;
        for (&(at, dynamic), takes) in all.iter().zip(scores.chunks(TAKES)) {
            let note = &self.notes[at];
            let on_grid = played(&rule, note, takes[0].recorded.dynamic);
            let beyond: Vec<Beyond> = takes
                .iter()
                .filter_map(|score| score.played.as_ref().zip(on_grid.as_ref()))
                .map(|(played, grid)| Beyond::of(played, grid, note.f0_hz, &self.lost_db[at]))
                .collect();
            self.beyond[at][dynamic] = Beyond::mean(&beyond);
        }
        let compared: Vec<_> =
            scores.iter().map(|score| (score.recorded.dynamic, Compared::of(score))).collect();
        Ok(Played {
            loss: missed(&compared) + self.charges(numbers, None),
            numbers: *numbers,
            beyond: self.beyond.clone(),
            compared,
        })
    }

    /// What a rule costs beside how its notes compare.
    fn charges(&self, numbers: &[f64], without: Option<usize>) -> f64 {
        let rule = Rule::of(numbers);
        let notes = self.notes.iter().enumerate().filter(|(at, _)| Some(*at) != without);
        SHORT_COST * mean(notes.map(|(_, note)| short_db(&rule, note))) + modesty(&rule)
    }

    fn loss(&self, numbers: &[f64], without: Option<usize>) -> f64 {
        let rule = Rule::of(numbers);
        let notes = (0..self.notes.len()).filter(|&at| Some(at) != without);
        let compared: Vec<_> = notes.flat_map(|at| self.compare(rule, at)).collect();
        missed(&compared) + self.charges(numbers, without)
    }

    /// The best rule near this one, in first steps of this size.
    fn fit(
        &self,
        from: &[f64; COUNT],
        without: Option<usize>,
        most: usize,
        size: f64,
        seed: u64,
    ) -> Result<[f64; COUNT]> {
        let at = |steps: &DVector<f64>| -> [f64; COUNT] {
            std::array::from_fn(|n| from[n] + FIRST_STEPS[n] * steps[n])
        };
        let mut search = CMAESOptions::new(vec![0.0; COUNT], size)
            .seed(seed)
            .max_function_evals(most)
            .build(|steps: &DVector<f64>| self.loss(&at(steps), without) + AWAY_COST * steps.norm_squared())
            .map_err(|error| anyhow::anyhow!("{error:?}"))?;
        let best = search.run().overall_best.context("no step was better")?;
        Ok(at(&best.point))
    }
}

/// What compared notes cost.
fn missed(compared: &[(Dynamic, Compared)]) -> f64 {
    let of_dynamic = |(dynamic, asked_db): (Dynamic, f64)| {
        let own = || compared.iter().filter(|(of, _)| *of == dynamic).map(|(_, compared)| compared);
        let error_db = mean(own().map(|compared| compared.error_db));
        let missed = mean(own().map(Compared::miss));
        let thirds = || own().filter_map(|compared| compared.third_over_second_db);
        let third_off_db =
            median(thirds().map(|(played, _)| played)) - median(thirds().map(|(_, recorded)| recorded));
        let third_off_db = if third_off_db.is_nan() { 0.0 } else { third_off_db.abs() };
        ERROR_COST * error_db
            + OVER_COST * (error_db - asked_db).max(0.0)
            + THIRD_COST * (third_off_db - THIRD_ASKED_DB).max(0.0)
            + CENTROID_COST * missed
    };
    Dynamic::ALL.into_iter().zip(ASKED_DB).map(of_dynamic).sum()
}

/// A small cost of what is large for no need.
fn modesty(rule: &Rule) -> f64 {
    let ([slope, curvature], heard) = (rule.player.closing_between, rule.presence);
    0.05 * (slope * slope + curvature * curvature)
        + 0.02 * ((heard.shelf_db / 6.0).powi(2) + (heard.bell_db / 5.0).powi(2))
}

/// Fits the rule and writes it; with `--check` asks whether the committed one is as good.
pub fn run(args: &[String]) -> Result<()> {
    let check = match args {
        [] => false,
        [arg] if arg == "--check" => true,
        _ => bail!("takes --check or nothing, got {}", args.join(" ")),
    };
    let mut data = data()?;
    let committed = data.play(&Rule::COMMITTED.numbers())?;
    say("committed, as played", &committed.compared);
    println!("loss {:.2}", committed.loss);
    let kept = committed.loss;
    let mut best = committed;
    for (size, seed) in SIZES.into_iter().zip(SEED..) {
        data.beyond.clone_from(&best.beyond);
        let fitted = data.fit(&best.numbers, None, EVALUATIONS, size, seed)?;
        let played = data.play(&fitted)?;
        say("played", &played.compared);
        println!("steps of {size}: loss {:.2}, as played {:.2}", data.loss(&fitted, None), played.loss);
        if played.loss < best.loss {
            best = played;
        }
    }
    data.beyond.clone_from(&best.beyond);
    println!("{:#?}", Rule::of(&best.numbers));
    say("best, as played", &best.compared);
    let left_out = |at: usize| -> Result<Vec<(Dynamic, Compared)>> {
        let (most, size) = LEFT_OUT;
        let others = data.fit(&best.numbers, Some(at), most, size, SEED)?;
        Ok(data.compare(Rule::of(&others), at).collect())
    };
    let validated = parallel::each(data.notes.len(), left_out, &mut |_| ControlFlow::Continue(()));
    let validated: Vec<_> = validated.into_iter().flatten().collect::<Result<_>>()?;
    say("left out", &validated.concat());
    for dynamic in Dynamic::ALL {
        let own: Vec<&RecordedNote> =
            data.recorded.iter().flatten().filter(|note| note.dynamic == dynamic).collect();
        println!(
            "best smooth curve through the recordings themselves, left out, {}: centroid right on {:.0} %",
            dynamic.name(),
            100.0 * smooth::best_share(&own)
        );
    }
    if check {
        println!("the loss of the committed rule is {kept:.2}, of the one found {:.2}", best.loss);
        ensure!(
            kept < best.loss + TOLERANCE,
            "{PATH} is not this fit; run `cargo xtask fit-player`, then `cargo xtask play-dynamics`"
        );
        return Ok(());
    }
    write(PATH, &text(&read(PATH)?, &Rule::of(&best.numbers)))
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
    let beyond = |recorded: &Vec<RecordedNote>| vec![Beyond::default(); recorded.len()];
    let of = |note: &NoteSpectra| all.iter().filter(|other| other.midi == note.midi).cloned().collect();
    let loss = wander::Loss::recorded();
    let lost = |note: &NoteSpectra| {
        (1..=spectra::HARMONICS).map(|harmonic| loss.lost_db(harmonic as f64 * note.f0_hz)).collect()
    };
    let recorded: Vec<Vec<RecordedNote>> = notes.iter().map(of).collect();
    Ok(Data {
        beyond: recorded.iter().map(beyond).collect(),
        lost_db: notes.iter().map(lost).collect(),
        recorded,
        notes,
    })
}

/// Prints error and centroids of each dynamic that was compared.
fn say(what: &str, compared: &[(Dynamic, Compared)]) {
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

/// The generated file: its head as it is, then the rule and the presence.
fn text(kept: &str, rule: &Rule) -> String {
    let head = kept.split("pub const FITTED").next().unwrap_or_default();
    let PlayerModel {
        range_db,
        loudest_gamma,
        zeta,
        closing,
        closing_between,
        throat,
        high,
        top,
        altissimo_zeta,
        knee,
    } = rule.player;
    let Presence { shelf_hz, shelf_db, bell_hz, bell_db, bell_quality } = rule.presence;
    let round = |numbers: &[f64]| numbers.iter().map(|x| format!("{x:.4}")).collect::<Vec<_>>().join(", ");
    format!(
        "{head}pub const FITTED: PlayerModel = PlayerModel {{\n    range_db: {range_db:?},\n    loudest_gamma: [{}],\n    \
         zeta: [{}],\n    closing: [{}],\n    closing_between: [{}],\n    throat: [{}],\n    high: {high:?},\n    top: {top:?},\n    \
         altissimo_zeta: {altissimo_zeta:?},\n    knee: {knee:?},\n}};\n\n\
         /// Fitted with it.\npub const PRESENCE: Presence = Presence {{\n    shelf_hz: {shelf_hz:.1},\n    \
         shelf_db: {shelf_db:.3},\n    bell_hz: {bell_hz:.1},\n    bell_db: {bell_db:.3},\n    \
         bell_quality: {bell_quality:.3},\n}};\n",
        round(&loudest_gamma),
        round(&zeta),
        round(&closing),
        round(&closing_between),
        round(&throat)
    )
}
