//! Glissando: a slur whose pitch slides.
//!
//! Within a register the fingers slide off their holes, or onto them, one after another: the bore's pitch moves with each
//! opening, without a step. From one register to another no finger can lead. There the way goes over all holes open, whose first mode
//! is the highest that the bore has, to a fingering of the upper register, which the vocal tract bends down to there and lets
//! rise (Chen, Smith & Wolfe 2009); from its own pitch on the fingers lead again.

use crate::bore::fingering_finder::bits;
use crate::instrument::model::Model;
use crate::units::cents;

/// Interval from the fingering with no finger down to the first mode of all holes open, cents (measured).
const ALL_OPEN_CENTS: f64 = 450.0;
/// Bend with which the tract takes over from the fingers, cents: deep enough to save fingers, and still steady (measured).
const TAKES_OVER_CENTS: f64 = 750.0;
/// Time in which the fingers change between the registers, s.
const CHANGE_S: f64 = 0.03;

/// A slide from note to note. Places on its way are told from the lower note, 0, to the higher, 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slide {
    /// Fingering that is slid to.
    pub target: usize,
    low: u64,
    high: u64,
    rises: bool,
    crossing: Option<Crossing>,
    octaves: f64,
    length_s: f64,
    passed_s: f64,
}

/// How a slide gets from register to register.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Crossing {
    /// Open holes of the upper register's fingering that the tract bends.
    via: u64,
    /// Its pitch, Hz on the clock of the bore.
    via_hz: f64,
    /// Where the fingers change to it.
    change: f64,
    /// Where its own pitch is reached.
    reached: f64,
}

/// How the fingers stand: on the way from some open holes to others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Between {
    /// The holes that were open, one bit each.
    pub from: u64,
    /// The holes that will be open.
    pub to: u64,
    /// How far the way has gone, 0..=1.
    pub way: f64,
    /// The holes open from the bell up, or close from the mouth down.
    pub rises: bool,
}

/// Open holes of a fingering, one bit each.
fn holes(fingering: usize, model: &Model) -> u64 {
    bits(&model.file.fingerings[fingering].open)
}

impl Crossing {
    fn new(low: usize, high: usize, model: &Model) -> Option<Self> {
        let above = |fingering: usize| cents(model.notes_hz[fingering], model.notes_hz[low]);
        let notes = 0..model.notes_hz.len();
        if model.registers[low] != 1 || model.registers[high] == 1 {
            return None;
        }
        let open = notes.clone().find(|&f| model.file.fingerings[f].fingers.is_empty()).unwrap_or(low);
        let meets = above(open).max(0.0) + ALL_OPEN_CENTS;
        let via = notes
            .filter(|&f| model.registers[f] == 2 && above(f) <= above(high).min(meets + TAKES_OVER_CENTS))
            .max_by(|&a, &b| above(a).total_cmp(&above(b)))?;
        let share = |cents: f64| (cents / above(high)).clamp(0.0, 1.0);
        let (change, reached) = (share(meets.min(above(via))), share(above(via)));
        Some(Self { via: holes(via, model), via_hz: model.notes_hz[via], change, reached })
    }
}

impl Slide {
    /// A slide of `length_s` seconds, above 0, between two fingerings.
    pub fn new(from: usize, to: usize, length_s: f64, model: &Model) -> Self {
        let octaves = (model.notes_hz[to] / model.notes_hz[from]).log2();
        let rises = octaves > 0.0;
        let (low, high) = if rises { (from, to) } else { (to, from) };
        let crossing = Crossing::new(low, high, model);
        let (low, high) = (holes(low, model), holes(high, model));
        Self { target: to, low, high, rises, crossing, octaves: octaves.abs(), length_s, passed_s: 0.0 }
    }

    /// Whether the pitch rises.
    pub fn rises(&self) -> bool {
        self.rises
    }

    /// One tick; false when the slide has ended.
    pub fn tick(&mut self, tick_s: f64) -> bool {
        self.passed_s += tick_s;
        self.passed_s < self.length_s
    }

    /// Where the slide is, 0..=1.
    fn place(&self) -> f64 {
        let way = (self.passed_s / self.length_s).clamp(0.0, 1.0);
        if self.rises { way } else { 1.0 - way }
    }

    /// The pitch of a fingering, Hz on the clock of the bore, and how far the tract must bend it, cents; `None` where the
    /// fingers lead.
    pub fn bend(&self) -> Option<(f64, f64)> {
        let (crossing, place) = (self.crossing?, self.place());
        let below = 1_200.0 * self.octaves * (place - crossing.reached);
        (crossing.change..crossing.reached).contains(&place).then_some((crossing.via_hz, below))
    }

    /// Where the fingers are, on the bore of `model`.
    pub fn fingers(&self, model: &Model) -> Between {
        let Self { low, high, rises, .. } = *self;
        let place = self.place();
        // Told as it rises; a falling slide is the same way back.
        let told = |from: u64, to: u64, way: f64| {
            let way = way.clamp(0.0, 1.0);
            if rises {
                Between { from, to, way, rises }
            } else {
                Between { from: to, to: from, way: 1.0 - way, rises }
            }
        };
        let part = |from: f64, to: f64| (place - from) / (to - from).max(1e-9);
        let Some(Crossing { via, change, reached, .. }) = self.crossing else {
            return told(low, high, place);
        };
        let all = u64::MAX >> (64 - model.coeffs.holes().clamp(1, 64));
        let quick = CHANGE_S / self.length_s;
        let (begin, end) = if rises { (change, change + quick) } else { (change - quick, change) };
        if place < begin {
            told(low, all, part(0.0, begin))
        } else if place < end {
            // Many holes close at once: the fingers of both hands.
            Between { rises: !rises, ..told(all, via, part(begin, end)) }
        } else if place < reached {
            told(via, high, 0.0)
        } else {
            told(via, high, part(reached, 1.0))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// However it goes, a slide begins and ends at its fingerings and passes through no hole's step.
    #[test]
    fn a_slide_leads_from_fingering_to_fingering() {
        let model = Model::built_in(48_000.0).unwrap();
        for (from, to) in [(0, 15), (15, 0), (15, 32), (32, 15), (0, 29), (20, 32)] {
            let mut slide = Slide::new(from, to, 1.0, &model);
            let first = slide.fingers(&model);
            assert_eq!((first.from, first.way), (holes(from, &model), 0.0), "{from} {to}");
            while slide.tick(1e-3) {
                assert!(slide.bend().is_none_or(|(_, bend)| (-TAKES_OVER_CENTS - 1.0..=0.0).contains(&bend)));
            }
            let last = slide.fingers(&model);
            assert_eq!((last.to, last.way), (holes(to, &model), 1.0), "{from} {to}");
        }
    }
}
