//! Looks through every fingering that fingers and keys can make, for a note, a trill or two notes at once.
//!
//! The [`mechanism`] says which holes the fingers can open together; the [survey](TransferMatrix::survey) finds all resonances
//! of all these fingerings by transfer matrices, within seconds. A note is ranked by what a player asks of it: in tune, easy to blow,
//! in no doubt about its register, and easy for the fingers. Botros, Smith & Wolfe (2006) did so for the 39744 fingerings of a
//! flute (The Virtual Flute: an advanced fingering guide generated via machine intelligence).
//!
//! Left out: the vocal tract, and the reed's own pull on the pitch.

pub mod mechanism;

use std::ops::ControlFlow;

use crate::bore::ZETA;
use crate::bore::instrument_file::{Fingering, HoleKind, InstrumentFile};
use crate::bore::transfer_matrix::{Peak, Resonance, TransferMatrix, threshold_gamma};
use crate::maths;
use crate::units::{Air, WrittenNote, cents};
use mechanism::{Grip, MAX_FINGERS, Mechanism};

/// How far off a fingering may be to be found at all, cents: what lips can pull (docs/bend.md).
pub const FARTHEST_CENTS: f64 = 40.0;
/// What a lip holds without effort, cents: a note is easily let down, hardly pushed up.
const HELD_CENTS: [f64; 2] = [-5.0, 12.0];
/// Height over the next lower resonance from which no doubt is left, dB.
pub const SURE_DB: f64 = 6.0;
/// One finger that changes the pitch by less than this, cents, makes no other fingering.
const SAME_CENTS: f64 = 3.0;
/// Fingerings of each note that a trill may use.
const TRILL_FINGERINGS: usize = 60;
/// Least distance of a multiphonic's upper note from the harmonics of its lower one, cents: a quarter tone and more.
const INHARMONIC_CENTS: f64 = 60.0;
/// Least ratio of its two resonances: nearer ones beat as one rough note.
const LEAST_RATIO: f64 = 1.2;
/// By how much the one may be higher than the other, dB.
const MOST_UNEVEN_DB: f64 = 6.0;
/// Multiphonics whose notes are nearer than this, cents, are taken as one.
const ALIKE_CENTS: f64 = 35.0;

/// Peaks of the impedance that an instrument file may name.
const MODES_MOST: usize = 12;

/// All fingerings of an instrument with their resonances.
#[derive(Debug)]
pub struct FingeringFinder {
    mechanism: Mechanism,
    transposition: i8,
    a4_hz: f64,
    /// Holes that fingers cover, from the top.
    finger_holes: Vec<usize>,
    grips: Vec<Grip>,
    resonances: Vec<Vec<Resonance>>,
    /// What the chart has for each note.
    chart: Vec<(WrittenNote, Grip)>,
    /// What the chart has for notes for which the fingers cannot open these holes: the open ones, and the resonances.
    out_of_reach: Vec<(WrittenNote, u64, Vec<Resonance>)>,
    /// Names of holes that no finger moves.
    unmoved: Vec<String>,
}

/// A fingering for a note.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Where the holes are open, and who opens them.
    pub grip: Grip,
    /// What the fingers press.
    pub fingers: String,
    /// Where it plays, Hz.
    pub f_hz: f64,
    /// How far that is from the note, cents.
    pub cents: f64,
    /// Mouth pressure at which it begins to sound, over the closing pressure of the reed.
    pub gamma_on: f64,
    /// Which of its resonances plays, from 1.
    pub mode: usize,
    /// Height of that resonance over the next lower one, dB, at most [`SURE_DB`]: below 0 the lower note may sound instead.
    pub evenness_db: f64,
    /// What the ranking goes by, from 0, the best.
    pub cost: f64,
}

impl Found {
    /// Which peak of the impedance it plays, as instrument files count them: small ones, too, which the search leaves out. `model` is of the same file.
    pub fn mode_of_file(&self, file: &InstrumentFile, model: &TransferMatrix) -> Option<usize> {
        let peaks = model.peaks(&self.grip.holes(file), file.reed_volume_m3, MODES_MOST);
        let off = |peak: &Peak| cents(peak.f_hz, self.f_hz).abs();
        let nearest = peaks.iter().enumerate().min_by(|a, b| off(a.1).total_cmp(&off(b.1)))?;
        Some(nearest.0 + 1)
    }
}

/// A fingering on which two notes may sound at once.
#[derive(Clone, Debug, PartialEq)]
pub struct Multiphonic {
    /// Where the holes are open, and who opens them.
    pub grip: Grip,
    /// What the fingers press.
    pub fingers: String,
    /// The two highest resonances, the lower one first, Hz.
    pub f_hz: [f64; 2],
    /// How much higher the one is than the other, dB.
    pub uneven_db: f64,
    /// Threshold of the weaker one.
    pub gamma_on: f64,
    /// What the ranking goes by, from 0, the best.
    pub cost: f64,
}

/// What one of these is worth in cost: see [`FingeringFinder::best`].
mod worth {
    /// A cent beyond what a lip holds without effort; one within it.
    pub const CENT: f64 = 0.1;
    pub const CENT_WITHIN: f64 = 0.02;
    /// A threshold higher by a tenth of the closing pressure.
    pub const GAMMA: f64 = 10.0;
    /// 6 dB less over the next lower resonance, which can take over.
    pub const DOUBT_DB: f64 = 1.0 / 6.0;
    /// 3 dB between the two resonances of a multiphonic.
    pub const UNEVEN_DB: f64 = 1.0 / 3.0;
    /// A key besides the finger holes.
    pub const EFFORT: f64 = 0.5;
    /// A closed hole below an open one.
    pub const FORK: f64 = 0.5;
    /// A finger that moves on the way from the note beside, in the chart.
    pub const WAY: f64 = 0.5;
    /// A finger more that moves in a trill.
    pub const MOVE: f64 = 1.0;
}

/// One bit a hole, set if it is open, in the order of the file from the lowest bit.
pub fn bits(open: &[bool]) -> u64 {
    open.iter().rev().fold(0, |bits, &open| bits << 1 | u64::from(open))
}

/// Lowest and highest frequency looked at on a B flat clarinet, Hz, and how far they are from the lowest and the highest note of larger
/// and smaller ones.
const RANGE_HZ: (f64, f64) = (100.0, 2_600.0);
const AROUND: (f64, f64) = (0.7, 1.25);

/// What the resonances of an instrument are looked for in, Hz.
fn range_hz(file: &InstrumentFile) -> (f64, f64) {
    let notes = file.fingerings.iter().map(|fingering| file.sounding(fingering.written).frequency_hz(440.0));
    let (lowest_hz, highest_hz) =
        notes.fold((f64::INFINITY, 0.0), |(low, high), hz| (hz.min(low), hz.max(high)));
    (RANGE_HZ.0.min(AROUND.0 * lowest_hz), RANGE_HZ.1.max(AROUND.1 * highest_hz))
}

impl FingeringFinder {
    /// Works out all fingerings of an instrument whose A4 is `a4_hz`: some seconds. `on` hears the share done and may end it, then the answer is
    /// `None`. Allocates.
    pub fn new(
        file: &InstrumentFile,
        air: Air,
        a4_hz: f64,
        on: &mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Option<Self> {
        let mechanism = Mechanism::of(file);
        let grips = mechanism.grips(file);
        let open: Vec<u64> = grips.iter().map(|grip| grip.open).collect();
        let model = TransferMatrix::new(file, air);
        let range_hz = range_hz(file);
        let resonances = model.survey(&open, file.reed_volume_m3, range_hz, on)?;
        let fingers = file.holes.iter().enumerate().filter(|(_, hole)| hole.kind == HoleKind::Finger);
        let finger_holes = fingers.map(|(hole, _)| hole).collect();
        let of_chart = |fingering: &Fingering| {
            let at = grips.binary_search_by_key(&bits(&fingering.open), |grip| grip.open).ok()?;
            Some((fingering.written, grips[at]))
        };
        let chart = file.fingerings.iter().filter_map(of_chart).collect();
        let others: Vec<(WrittenNote, u64)> = file
            .fingerings
            .iter()
            .filter(|fingering| of_chart(fingering).is_none())
            .map(|fingering| (fingering.written, bits(&fingering.open)))
            .collect();
        let open: Vec<u64> = others.iter().map(|&(_, open)| open).collect();
        let go_on = &mut |_| ControlFlow::Continue(());
        let of_others = model.survey(&open, file.reed_volume_m3, range_hz, go_on)?;
        let out_of_reach = others.into_iter().zip(of_others).map(|((note, open), all)| (note, open, all));
        Some(Self {
            transposition: file.transposition,
            a4_hz,
            finger_holes,
            out_of_reach: out_of_reach.collect(),
            unmoved: mechanism.unmoved(file),
            mechanism,
            grips,
            resonances,
            chart,
        })
    }

    /// Names of the holes that neither finger nor key moves: keys and pads with other names than those of a Boehm clarinet. They
    /// stay as they are at rest in every fingering that is looked through.
    pub fn unmoved(&self) -> &[String] {
        &self.unmoved
    }

    /// The chart's own fingering of a note, at the resonance nearest to it however far that is; `None` for a note that is not
    /// in the chart. Where the fingers cannot open these holes, `fingers` is empty and nothing is added to the cost for them.
    pub fn played_by_chart(&self, written: WrittenNote) -> Option<Found> {
        let wanted_hz = written.sounding(self.transposition)?.frequency_hz(self.a4_hz);
        if let Some(grip) = self.of_chart(written) {
            let at = self.grips.binary_search_by_key(&grip.open, |grip| grip.open).ok()?;
            let mut found = self.found(*grip, &self.resonances[at], wanted_hz, f64::INFINITY)?;
            found.cost += self.cost_of_the_way(written, grip);
            return Some(Found { fingers: self.mechanism.words(grip), ..found });
        }
        let (_, open, resonances) = self.out_of_reach.iter().find(|(note, ..)| *note == written)?;
        let grip = Grip { open: *open, positions: [0; MAX_FINGERS], effort: 0 };
        self.found(grip, resonances, wanted_hz, f64::INFINITY)
    }

    /// What the chart of the instrument has for a note, if the fingers can do it.
    pub fn of_chart(&self, written: WrittenNote) -> Option<&Grip> {
        self.chart.iter().find(|(note, _)| *note == written).map(|(_, grip)| grip)
    }

    /// Number of different fingerings that were looked through.
    pub fn len(&self) -> usize {
        self.grips.len()
    }

    /// Whether the instrument has no fingering, which no instrument file allows.
    pub fn is_empty(&self) -> bool {
        self.grips.is_empty()
    }

    /// Fingerings that play a written note, best first. Those that one needless key makes of a better one are left out.
    ///
    /// A cost of 1 is 10 cents beyond what a lip holds; a threshold higher by a tenth of the closing pressure; 6 dB less over the
    /// next lower resonance; two keys besides the finger holes; two closed holes below open ones; or two fingers that move from the notes beside,
    /// as the chart has them.
    pub fn best(&self, written: WrittenNote, count: usize) -> Vec<Found> {
        let Some(sounding) = written.sounding(self.transposition) else { return Vec::new() };
        let wanted_hz = sounding.frequency_hz(self.a4_hz);
        let near =
            |(grip, resonances): (&Grip, &Vec<_>)| self.found(*grip, resonances, wanted_hz, FARTHEST_CENTS);
        let mut found: Vec<Found> = self.grips.iter().zip(&self.resonances).filter_map(near).collect();
        for found in &mut found {
            found.cost += self.cost_of_the_way(written, &found.grip);
        }
        found.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(a.grip.open.cmp(&b.grip.open)));
        let mut best: Vec<Found> = Vec::new();
        for one in found {
            let same = |better: &Found| {
                better.grip.moves(&one.grip) == 1 && (better.cents - one.cents).abs() < SAME_CENTS
            };
            if best.len() < count && !best.iter().any(same) {
                best.push(Found { fingers: self.mechanism.words(&one.grip), ..one });
            }
        }
        best
    }

    /// Pairs of fingerings for two notes, the cheapest first: what both cost, and each finger beyond the first that moves between them.
    pub fn trills(&self, written: WrittenNote, to: WrittenNote, count: usize) -> Vec<(Found, Found)> {
        let [from, to] = [written, to].map(|written| self.best(written, TRILL_FINGERINGS));
        let mut pairs: Vec<(&Found, &Found)> =
            from.iter().flat_map(|from| to.iter().map(move |to| (from, to))).collect();
        let cost = |(from, to): &(&Found, &Found)| {
            from.cost + to.cost + worth::MOVE * from.grip.moves(&to.grip).saturating_sub(1) as f64
        };
        pairs.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
        pairs.into_iter().take(count).map(|(from, to)| (from.clone(), to.clone())).collect()
    }

    /// Fingerings whose two strongest resonances belong to no one note, the cheapest first, by how uneven they are and by the
    /// fingers' effort: what may sound as a multiphonic. Only playing tells, see [`measure::multiphonics`](crate::measure::multiphonics). No two that are nearly the
    /// same in both pitches.
    pub fn multiphonics(&self, count: usize) -> Vec<Multiphonic> {
        let mut all: Vec<Multiphonic> =
            (0..self.grips.len()).filter_map(|grip| self.multiphonic(grip)).collect();
        all.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(a.grip.open.cmp(&b.grip.open)));
        let mut found: Vec<Multiphonic> = Vec::new();
        for one in all {
            let near = |other: &Multiphonic| {
                one.f_hz.iter().zip(&other.f_hz).all(|(a, b)| cents(*a, *b).abs() < ALIKE_CENTS)
            };
            if found.len() < count && !found.iter().any(near) {
                found.push(Multiphonic { fingers: self.mechanism.words(&one.grip), ..one });
            }
        }
        found
    }

    /// What the fingers that move from the notes beside, as the chart has them, add to the cost of a grip.
    fn cost_of_the_way(&self, written: WrittenNote, grip: &Grip) -> f64 {
        let beside = [written.0.checked_sub(1), written.0.checked_add(1)];
        let beside: Vec<&Grip> =
            beside.into_iter().filter_map(|note| self.of_chart(WrittenNote(note?))).collect();
        let moves: usize = beside.iter().map(|of_chart| of_chart.moves(grip)).sum();
        worth::WAY * moves as f64 / beside.len().max(1) as f64
    }

    /// A grip with these resonances, for a note that is at most so many cents away.
    fn found(
        &self,
        grip: Grip,
        resonances: &[Resonance],
        wanted_hz: f64,
        farthest_cents: f64,
    ) -> Option<Found> {
        let off = |resonance: &Resonance| cents(f64::from(resonance.f_hz), wanted_hz);
        let (index, played) =
            resonances.iter().enumerate().min_by(|a, b| off(a.1).abs().total_cmp(&off(b.1).abs()))?;
        let off = off(played);
        if off.abs() > farthest_cents {
            return None;
        }
        let lower = index.checked_sub(1).map(|below| resonances[below].height);
        let evenness_db =
            lower.map_or(SURE_DB, |lower| 20.0 * maths::log10(f64::from(played.height / lower))).min(SURE_DB);
        let gamma_on = threshold_gamma(f64::from(played.height), ZETA);
        let beyond = (off - HELD_CENTS[1]).max(HELD_CENTS[0] - off).max(0.0);
        let cost = worth::CENT * beyond
            + worth::CENT_WITHIN * off.abs()
            + worth::GAMMA * (gamma_on - 1.0 / 3.0)
            + worth::DOUBT_DB * (SURE_DB - evenness_db)
            + worth::EFFORT * f64::from(grip.effort)
            + worth::FORK * self.forks(grip.open) as f64;
        let f_hz = f64::from(played.f_hz);
        Some(Found {
            grip,
            fingers: String::new(),
            f_hz,
            cents: off,
            gamma_on,
            mode: index + 1,
            evenness_db,
            cost,
        })
    }

    /// Closed finger holes just below open ones.
    fn forks(&self, open: u64) -> usize {
        let is_open = |hole: usize| open >> hole & 1 == 1;
        self.finger_holes.windows(2).filter(|pair| is_open(pair[0]) && !is_open(pair[1])).count()
    }

    fn multiphonic(&self, at: usize) -> Option<Multiphonic> {
        let grip = self.grips[at];
        let mut strong = self.resonances[at].clone();
        strong.sort_by(|a, b| b.height.total_cmp(&a.height));
        let [first, second, ..] = strong[..] else { return None };
        let [low, high] = if first.f_hz < second.f_hz { [first, second] } else { [second, first] };
        let ratio = f64::from(high.f_hz / low.f_hz);
        // Cents to the nearest harmonic of the lower one, which would only colour its note.
        let inharmonic = cents(ratio, ratio.round()).abs();
        let uneven_db = 20.0 * maths::log10(f64::from(first.height / second.height));
        if inharmonic < INHARMONIC_CENTS || ratio < LEAST_RATIO || uneven_db > MOST_UNEVEN_DB {
            return None;
        }
        let gamma_on = threshold_gamma(f64::from(second.height), ZETA);
        let cost = worth::UNEVEN_DB * uneven_db + worth::EFFORT * f64::from(grip.effort);
        let f_hz = [low, high].map(|resonance| f64::from(resonance.f_hz));
        Some(Multiphonic { grip, fingers: String::new(), f_hz, uneven_db, gamma_on, cost })
    }
}

#[cfg(test)]
mod tests;
