//! Glissando: a slur whose pitch slides.
//!
//! Within a register the fingers slide off their holes, or onto them, one after another: the bore's pitch moves with each
//! opening, without a step. `crossing` goes from register to register, up and down a `ladder` of holes on either side.
//!
//! A slide that is interrupted goes back the way it came, or on to another note from where it is: from the holes as they then are
//! and the pitch that they have reached.

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
    /// Fingering that is slid from.
    origin: usize,
    /// Fingering that is slid to.
    pub target: usize,
    /// The open holes at the lower and at the higher end, one bit each.
    low: u64,
    high: u64,
    rises: bool,
    crossing: Option<Crossing>,
    octaves: f64,
    length_s: f64,
    passed_s: f64,
    /// How far the pitch lay from that of the target beside the interval of the fingerings, cents, when this much of the slide was left, s.
    beside: (f64, f64),
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
    /// A slide of `length_s` seconds, above 0, between two fingerings. `open` holes are open now, one bit each: they need not be those
    /// of the chart.
    pub fn new(from: usize, open: u64, to: usize, length_s: f64, model: &Model) -> Self {
        let octaves = maths::log2(model.notes_hz[to] / model.notes_hz[from]);
        let rises = octaves > 0.0;
        let (low, high) = if rises { (from, to) } else { (to, from) };
        let crossing = Crossing::new(low, high, rises, model);
        let there = holes(to, model);
        let (low, high) = if rises { (open, there) } else { (there, open) };
        Self {
            origin: from,
            target: to,
            low,
            high,
            rises,
            crossing,
            octaves: octaves.abs(),
            length_s,
            passed_s: 0.0,
            beside: (0.0, length_s),
        }
    }

    /// The slide to a fingering that takes the place of this one, which is under way: on to the same note, back to where it came from, or
    /// to another note from where it is, with these holes open.
    #[must_use]
    pub fn turned_to(&self, to: usize, open: u64, length_s: f64, model: &Model) -> Self {
        if to == self.target {
            return *self;
        }
        if to == self.origin {
            let crossing = self.crossing.as_ref().map(Crossing::turned);
            return Self {
                origin: self.target,
                target: to,
                rises: !self.rises,
                crossing,
                passed_s: self.length_s - self.passed_s,
                ..*self
            };
        }
        Self::new(self.nearest(model), open, to, length_s, model)
    }

    /// The same slide, whose pitch lies so many cents beside that of its fingerings now, and no longer at its end.
    #[must_use]
    pub fn beginning_beside(self, cents: f64) -> Self {
        Self { beside: (cents, self.length_s - self.passed_s), ..self }
    }

    /// How far the pitch is from that of the target beside the interval of the fingerings, cents.
    pub fn beside_cents(&self) -> f64 {
        let (cents, left_s) = self.beside;
        cents * ((self.length_s - self.passed_s) / left_s.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    }

    /// Time in which a finger is followed by the next, s, if all that are left move one after another.
    pub fn finger_s(&self) -> f64 {
        let changing = f64::from((self.low ^ self.high).count_ones());
        (self.length_s - self.passed_s) / (changing + 1.0)
    }

    /// The fingering of the chart whose pitch is nearest to that reached.
    fn nearest(&self, model: &Model) -> usize {
        let ends = (self.origin, self.target);
        let (low, high) = if self.rises { ends } else { (ends.1, ends.0) };
        let (low_hz, high_hz) = (model.notes_hz[low], model.notes_hz[high]);
        let reached_hz = low_hz * maths::exp2(self.octaves * self.place());
        let far = |&fingering: &usize| (model.notes_hz[fingering] / reached_hz - 1.0).abs();
        let between = |fingering: &usize| (low_hz..=high_hz).contains(&model.notes_hz[*fingering]);
        let all = (0..model.notes_hz.len()).filter(between);
        all.min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(self.target)
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
        let highest = if self.rises { self.target } else { self.origin };
        self.crossing.as_ref().map_or(highest, |crossing| crossing.lip(model))
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
            let mut slide = Slide::new(from, holes(from, &model), to, 1.0, &model);
            assert_eq!(open(slide.fingers()), holes(from, &model), "{from} {to}");
            while slide.tick(0.0, (1e-3, 1e-3)) {}
            assert_eq!(open(slide.fingers()), holes(to, &model), "{from} {to}");
        }
    }

    #[test]
    fn a_slide_that_turns_goes_back_the_same_way() {
        let model = Model::built_in(48_000.0).unwrap();
        for (from, to) in [(0, 15), (15, 0), (15, 32)] {
            let mut slide = Slide::new(from, holes(from, &model), to, 1.0, &model).beginning_beside(-30.0);
            (0..300).for_each(|_| assert!(slide.tick(0.0, (1e-3, 1e-3))));
            assert!((slide.beside_cents() + 21.0).abs() < 1e-9);
            let (there, mut back) = (slide.fingers(), slide.turned_to(from, 0, 1.0, &model));
            assert_eq!((back.target, back.turned_to(from, 0, 1.0, &model)), (from, back));
            let here = back.fingers();
            let mirrored = (there.from, there.to) == (here.to, here.from);
            assert!(there == here || mirrored && (there.way + here.way - 1.0).abs() < 1e-12, "{from} {to}");
            let mut ticks = 1;
            while back.tick(0.0, (1e-3, 1e-3)) {
                ticks += 1;
            }
            assert!((299..=301).contains(&ticks), "{ticks}");
        }
    }
}
