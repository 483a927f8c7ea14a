//! Alternate fingerings by context: those that players take on the way from a note to a near one because fewer fingers move.
//!
//! A player who slurs F5 to F#5 adds a finger to those that are down instead of exchanging two: so in chromatic runs and in trills.
//! Each [alternate](super::alternate_fingerings) of the instrument is compared with the chart's fingering of its
//! note by the transfer matrices. One that is much off or much harder to blow is taken only when the player asks for it; its error
//! is for the player to correct.

use crate::bore::ZETA;
use crate::bore::alternate_fingerings::fingering_choices;
use crate::bore::fingering_finder::bits;
use crate::bore::fingering_finder::mechanism::{Grip, Mechanism};
use crate::bore::instrument_file::InstrumentFile;
use crate::bore::transfer_matrix::{TransferMatrix, threshold_gamma};
use crate::maths;
use crate::units::{Air, cents};

/// Widest step over which an alternate is taken, semitones: those of chromatic runs and of trills.
const WIDEST_SEMITONES: u8 = 2;
/// How far an alternate may be from the chart's fingering, cents: what a lip corrects unnoticed.
const UNNOTICED_CENTS: f64 = 15.0;
/// How much higher its threshold may be.
const HARDEST: f64 = 1.15;
/// Where a resonance is looked for, cents from its note, and in which steps. Without a reed's pull the chart plays up to 70 cents
/// sharp.
const SEARCH_CENTS: (f64, f64) = (-80.0, 120.0);
const STEP_CENTS: f64 = 20.0;
/// Secant steps from there; the third is nearer than 0.01 cents.
const SECANTS: usize = 4;

/// An alternate, and what it is like beside the chart's fingering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alternate {
    /// Index of the chart's fingering of its note.
    pub fingering: usize,
    /// One bit a hole, set if it is open, in the order of the file from the lowest bit.
    pub open: u64,
    /// How much higher it sounds than the chart's fingering, cents.
    pub cents: f64,
    /// Mouth pressure at which it begins to sound, over that of the chart's fingering.
    pub harder: f64,
    /// The first, second ... alternate of its note, from 1.
    pub nth: usize,
}

impl Alternate {
    /// Whether a player takes it without being asked: a lip corrects it unnoticed, and it speaks about as easily.
    fn is_good(&self) -> bool {
        self.cents.abs() <= UNNOTICED_CENTS && self.harder <= HARDEST
    }
}

/// The alternates of an instrument, and when they are taken.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContextFingerings {
    alternates: Vec<Alternate>,
    /// Fingerings of the chart.
    notes: usize,
    /// What is taken, `[form * notes + to]`. Forms are the chart's fingerings, then the alternates.
    taken: Vec<Option<u8>>,
}

/// Frequency near a note where the phase of the impedance falls through zero, Hz, and Re Z over Zc there. The transfer matrices'
/// [`playing_frequency`](TransferMatrix::playing_frequency) over a range that is known: in a tenth of the time.
fn resonance(bore: &TransferMatrix, open: &[bool], reed_volume_m3: f64, note_hz: f64) -> Option<(f64, f64)> {
    let at = |off: f64| bore.impedance(note_hz * maths::exp2(off / 1_200.0), open, reed_volume_m3);
    let steps = ((SEARCH_CENTS.1 - SEARCH_CENTS.0) / STEP_CENTS) as usize;
    let (mut low, mut high) = (0..steps)
        .map(|step| SEARCH_CENTS.0 + STEP_CENTS * step as f64)
        .map(|low| (low, low + STEP_CENTS))
        .find(|&(low, high)| at(low).im > 0.0 && at(high).im <= 0.0)?;
    let (mut low_im, mut high_im) = (at(low).im, at(high).im);
    for _ in 0..SECANTS {
        let middle = low + (high - low) * low_im / (low_im - high_im);
        let im = at(middle).im;
        if im > 0.0 {
            (low, low_im) = (middle, im);
        } else {
            (high, high_im) = (middle, im);
        }
    }
    let found = low + (high - low) * low_im / (low_im - high_im);
    Some((note_hz * maths::exp2(found / 1_200.0), at(found).re))
}

impl ContextFingerings {
    /// Compares the alternates of an instrument, whose A4 is `a4_hz`, with its chart: milliseconds. Allocates.
    pub fn new(file: &InstrumentFile, air: &Air, a4_hz: f64) -> Self {
        let mechanism = Mechanism::of(file);
        let notes = file.fingerings.len();
        let bore = TransferMatrix::new(file, *air);
        let alternates: Vec<Alternate> = fingering_choices(file)
            .iter()
            .filter(|choice| choice.nth > 0)
            .filter_map(|choice| {
                let fingering = file.fingerings.iter().position(|chart| chart.written == choice.written)?;
                let wanted_hz = choice.written.sounding(file.transposition)?.frequency_hz(a4_hz);
                let played = |open: &[bool]| resonance(&bore, open, file.reed_volume_m3, wanted_hz);
                let (chart_hz, chart_height) = played(&file.fingerings[fingering].open)?;
                let (hz, height) = played(&choice.open)?;
                Some(Alternate {
                    fingering,
                    open: bits(&choice.open),
                    cents: cents(hz, chart_hz),
                    harder: threshold_gamma(height, ZETA) / threshold_gamma(chart_height, ZETA),
                    nth: choice.nth,
                })
            })
            .take(usize::from(u8::MAX))
            .collect();
        let chart = file.fingerings.iter().enumerate().map(|(at, one)| (at, bits(&one.open)));
        let forms = chart.chain(alternates.iter().map(|one| (one.fingering, one.open)));
        let forms: Vec<(usize, Option<Grip>)> =
            forms.map(|(note, open)| (note, mechanism.grip(file, open))).collect();
        let near = |from: usize, to: usize| {
            let [from, to] = [from, to].map(|note| file.fingerings[note].written.0);
            from != to && from.abs_diff(to) <= WIDEST_SEMITONES
        };
        let take = |from: &(usize, Option<Grip>), to: usize| {
            let grip = from.1.filter(|_| near(from.0, to))?;
            let moves = |form: usize| Some(grip.moves(&forms[form].1?));
            let own = (0..alternates.len())
                .filter(|&at| alternates[at].fingering == to && alternates[at].is_good());
            let fewest = own.filter_map(|at| Some((moves(notes + at)?, at))).min()?;
            (fewest.0 < moves(to)?).then_some(fewest.1 as u8)
        };
        let taken = forms.iter().flat_map(|from| (0..notes).map(move |to| take(from, to))).collect();
        Self { alternates, notes, taken }
    }

    /// All, by their numbers.
    pub fn all(&self) -> &[Alternate] {
        &self.alternates
    }

    /// The number of the first, second ... alternate of a fingering, from 1, if it has so many. Real-time safe.
    pub fn nth(&self, fingering: usize, nth: u8) -> Option<u8> {
        let is_it = |one: &Alternate| one.fingering == fingering && one.nth == usize::from(nth);
        // There are no more than a byte counts.
        self.alternates.iter().position(is_it).map(|at| at as u8)
    }

    /// One by its number. Real-time safe.
    pub fn get(&self, alternate: u8) -> Option<&Alternate> {
        self.alternates.get(usize::from(alternate))
    }

    /// The number of the alternate that is taken on the way from a fingering, or from an alternate of it, to another fingering; `None` for that of
    /// the chart. Real-time safe.
    pub fn taken(&self, from: usize, alternate: Option<u8>, to: usize) -> Option<u8> {
        let form = alternate.map_or(from, |at| self.notes + usize::from(at));
        if to < self.notes { self.taken.get(form * self.notes + to).copied().flatten() } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Common knowledge of players: side keys, sliver keys and forks where a chromatic step or a trill would change hands.
    #[test]
    fn what_is_taken_moves_fewer_fingers_on_small_steps_and_is_in_tune() {
        let file = InstrumentFile::built_in();
        let context = ContextFingerings::new(&file, &Air::default(), 440.0);
        for one in context.all() {
            println!("{} {one:?}", file.fingerings[one.fingering].written);
        }
        let grip = |open: u64| Mechanism::boehm().grip(&file, open).unwrap();
        let chart: Vec<Grip> = file.fingerings.iter().map(|one| grip(bits(&one.open))).collect();
        let mut taken = Vec::new();
        for (from, to) in (0..chart.len()).flat_map(|from| (0..chart.len()).map(move |to| (from, to))) {
            let Some(at) = context.taken(from, None, to) else { continue };
            let one = context.get(at).unwrap();
            assert_eq!(one.fingering, to);
            assert!(one.cents.abs() <= 15.0 && one.harder <= 1.15);
            assert!(chart[from].moves(&grip(one.open)) < chart[from].moves(&chart[to]), "{from} {to}");
            let [low, high] = [from, to].map(|note| file.fingerings[note].written);
            assert!((1..=2).contains(&low.0.abs_diff(high.0)), "{low} {high}");
            // On the way back, too, no more fingers move than by the chart.
            let back = context
                .taken(to, Some(at), from)
                .map_or(chart[from], |at| grip(context.get(at).unwrap().open));
            assert!(grip(one.open).moves(&back) <= chart[to].moves(&chart[from]));
            taken.push(format!("{low}-{high}"));
        }
        println!("{taken:?}");
        for known in ["A#3-B3", "E4-D#4", "F5-F#5", "B5-A#5"] {
            assert!(taken.iter().any(|pair| pair == known), "{known}: {taken:?}");
        }
    }

    #[test]
    fn another_pitch_of_a4_has_the_same_alternates() {
        let file = InstrumentFile::built_in();
        let of = |a4_hz: f64| {
            let context = ContextFingerings::new(&file.scaled(440.0 / a4_hz), &Air::default(), a4_hz);
            context.all().iter().map(|one| (one.fingering, one.nth)).collect::<Vec<_>>()
        };
        assert!(!of(440.0).is_empty());
        for a4_hz in [415.0, 466.0] {
            assert_eq!(of(a4_hz), of(440.0), "{a4_hz}");
        }
    }

    #[test]
    fn resonances_are_those_of_the_whole_search() {
        let file = InstrumentFile::built_in();
        let bore = TransferMatrix::new(&file, Air::default());
        for choice in fingering_choices(&file).iter().filter(|choice| choice.nth > 0) {
            let hz = choice.written.sounding(file.transposition).unwrap().frequency_hz(440.0);
            let (near, height) = resonance(&bore, &choice.open, file.reed_volume_m3, hz).unwrap();
            let (far, other) = bore.playing_frequency(&choice.open, file.reed_volume_m3, hz).unwrap();
            assert!(cents(near, far).abs() < 0.01 && (height / other - 1.0).abs() < 1e-4, "{choice:?}");
        }
    }

    #[test]
    fn another_mechanism_has_no_alternates() {
        let mut file = InstrumentFile::built_in();
        file.holes.iter_mut().for_each(|hole| hole.name.insert(0, 'x'));
        let context = ContextFingerings::new(&file, &Air::default(), 440.0);
        assert!(context.all().is_empty() && context.taken(0, None, 1).is_none());
    }
}
