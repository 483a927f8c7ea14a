//! Glissando: a slur whose pitch slides.
//!
//! Within a register the fingers slide off their holes, or onto them, one after another: the bore's pitch moves with each
//! opening, without a step. `crossing` goes from register to register, up and down a `ladder` of holes on either side.

mod crossing;
mod ladder;

use super::voicing::Voiced;
use crate::bore::fingering_finder::bits;
use crate::instrument::model::Model;
use crate::maths;
use crossing::Crossing;

/// A slide from note to note.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slide {
    /// Fingering that is slid to.
    pub target: usize,
    /// The higher one of both.
    highest: usize,
    low: u64,
    high: u64,
    rises: bool,
    crossing: Option<Crossing>,
    octaves: f64,
    length_s: f64,
    passed_s: f64,
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

impl Slide {
    /// A slide of `length_s` seconds, above 0, between two fingerings.
    pub fn new(from: usize, to: usize, length_s: f64, model: &Model) -> Self {
        let octaves = maths::log2(model.notes_hz[to] / model.notes_hz[from]);
        let rises = octaves > 0.0;
        let (low, high) = if rises { (from, to) } else { (to, from) };
        let crossing = Crossing::new(low, high, rises, model);
        let (highest, low, high) = (high, holes(low, model), holes(high, model));
        Self {
            target: to,
            highest,
            low,
            high,
            rises,
            crossing,
            octaves: octaves.abs(),
            length_s,
            passed_s: 0.0,
        }
    }

    /// One tick of `tick_s` seconds, `period_s` on the clock of the bore, with this pressure in the mouthpiece; false when the slide
    /// has ended.
    pub fn tick(&mut self, pressure: f64, (tick_s, period_s): (f64, f64)) -> bool {
        self.passed_s += tick_s;
        let cents = 1_200.0 * self.octaves * self.place();
        if let Some(crossing) = &mut self.crossing {
            crossing.tick(cents, pressure, (tick_s, period_s));
        }
        self.passed_s < self.length_s
    }

    /// Where the slide is, from the lower note, 0, to the higher, 1.
    fn place(&self) -> f64 {
        let way = (self.passed_s / self.length_s).clamp(0.0, 1.0);
        if self.rises { way } else { 1.0 - way }
    }

    /// The fingering of the chart whose lip the player has. Within a register it is the higher note's all the way: a lower one's
    /// loses the register.
    pub fn lip(&self, model: &Model) -> usize {
        self.crossing.as_ref().map_or(self.highest, |crossing| crossing.lip(model))
    }

    /// What the vocal tract does for the slide; `None` where the fingers lead alone.
    pub fn tract(&self) -> Option<Voiced> {
        self.crossing.as_ref().and_then(Crossing::tract)
    }

    /// Where the fingers are.
    pub fn fingers(&self) -> Between {
        let Self { low, high, rises, .. } = *self;
        match &self.crossing {
            Some(crossing) => crossing.fingers(),
            None if rises => Between { from: low, to: high, way: self.place(), rises },
            None => Between { from: high, to: low, way: 1.0 - self.place(), rises },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// However it goes, a slide begins and ends at its fingerings.
    #[test]
    fn a_slide_leads_from_fingering_to_fingering() {
        let model = Model::built_in(48_000.0).unwrap();
        let open = |between: Between| match between.way {
            0.0 => between.from,
            1.0 => between.to,
            way => panic!("under way: {way}"),
        };
        for (from, to) in [(0, 15), (15, 0), (15, 32), (32, 15), (0, 29), (20, 32)] {
            let mut slide = Slide::new(from, to, 1.0, &model);
            assert_eq!(open(slide.fingers()), holes(from, &model), "{from} {to}");
            while slide.tick(0.0, (1e-3, 1e-3)) {}
            assert_eq!(open(slide.fingers()), holes(to, &model), "{from} {to}");
        }
    }
}
