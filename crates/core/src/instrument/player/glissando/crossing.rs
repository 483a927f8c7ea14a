//! How a glissando gets from the chalumeau into an upper register without a step.
//!
//! No finger leads from register to register, but the vocal tract does. In the chalumeau the fingers lead, up to all holes open. On the
//! last semitones the tract's resonance grows to the strength of the bore's and takes the note over: now it hardly matters what is
//! fingered. There the hands change, at once, to a fingering of the clarion whose own note is far above: under the same
//! tract it sounds the same pitch. The tract rises and lets the note rise, as players bend it (Chen, Smith & Wolfe 2009). From that
//! note's own pitch on, the fingers lead again. A falling glissando is the same way back.
//!
//! The player hears the pitch and corrects fingers and tract on the way. Places are cents above the lower note.

use super::ladder::{Ladder, highest_open};
use super::{Between, holes};
use crate::dsp::smooth::smooth;
use crate::instrument::model::Model;
use crate::instrument::player::pitch_ear::PitchEar;
use crate::instrument::player::voicing::{Voiced, bend_for_octaves, octaves_for_bend};
use crate::maths;
use crate::units::cents;

/// The hands change at this interval above the fingering with no finger down, cents.
const CHANGE_CENTS: f64 = 140.0;
/// The tract's resonance lies there meanwhile. All holes open and the fingering that the hands change to then sound within some 20
/// cents of each other; a whole tone higher or lower they do not (measured).
const RESONANCE_CENTS: f64 = 300.0;
/// A slide that begins less than this below goes at least so far before the hands change, cents, and the resonance lies this much
/// higher for each cent.
const LEAST_CENTS: f64 = 60.0;
/// See [`LEAST_CENTS`].
const RESONANCE_SLOPE: f64 = 1.6;
/// Interval below the change over which the tract takes over from the fingers, cents.
const TAKES_OVER_CENTS: f64 = 200.0;
/// Quality of the resonance while it takes over, and while it leads. The sharper, the less matters what is fingered: 16 leaves some 20
/// cents at the change, 12 leaves 45 and 8 leaves 100; with 20 both for a while two notes sound (measured).
const QUALITIES: (f64, f64) = (16.0, 12.0);
/// Pitch of all holes open above the fingering with no finger down, cents (measured).
const ALL_OPEN_CENTS: f64 = 420.0;
/// The hands change to a fingering of the clarion this far above the change: from there the sound leaves the tube not far from where it
/// left it, so its phase hardly jumps. A fingering with more holes closed turns it by half a period.
const HAND_CENTS: f64 = 1_090.0;
/// On so many cents above the change they close the other holes down to the fingering from which the fingers lead again.
const GIVES_BACK_CENTS: f64 = 80.0;
/// That fingering lies at most this far above the change, cents. Farther down a note that is bent has a subharmonic from its
/// fingering's first mode (measured).
const DEEPEST_CENTS: f64 = 565.0;
/// Time in which the hands change as the pitch rises, s: like behind the tongue. Slowly closing holes take the note down with them.
const CLOSES_S: f64 = 0.006;
/// The same as it falls: slowly opening ones do not, and a quick change is heard as a click.
const OPENS_S: f64 = 0.03;
/// Time constant with which the player corrects the pitch, s: slower than it is heard.
const CORRECTS_S: f64 = 0.06;
/// Farthest correction, cents.
const CORRECTION_MOST_CENTS: f64 = 200.0;
/// Near its ends a slide is the fingering's alone, cents.
const ENDS_CENTS: f64 = 200.0;

/// The way from register to register.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// From the lower note to all holes open.
    below: Ladder,
    /// From the fingering that the tract bends to the higher note.
    above: Ladder,
    /// Open holes before the hands change.
    all: u64,
    /// Open holes of the fingering that the hands change to.
    hand: u64,
    /// Open holes of the fingering that the tract bends.
    via: u64,
    /// Its pitch, Hz on the clock of the bore; that of the lower note.
    via_hz: f64,
    low_hz: f64,
    /// Cents above the lower note: where the tract begins, where the hands change, all holes open, that fingering, the
    /// higher note.
    begins: f64,
    change: f64,
    all_open: f64,
    reached: f64,
    height: f64,
    /// Interval of the resonance at the change from the fingering that the tract bends, octaves.
    octaves: f64,
    ear: PitchEar,
    rises: bool,
    /// What the player adds because of what was heard, cents.
    correction: f64,
    /// How far the hands have changed from all holes open to that fingering, 0..=1.
    hands: f64,
    /// The wanted pitch, cents above the lower note.
    place: f64,
}

impl Crossing {
    /// The way between a note of the first register and one above it; `None` if they are not. Real-time safe.
    pub fn new(low: usize, high: usize, rises: bool, model: &Model) -> Option<Self> {
        let above = |fingering: usize| cents(model.notes_hz[fingering], model.notes_hz[low]);
        let notes = 0..model.notes_hz.len();
        if model.registers[low] != 1 || model.registers[high] == 1 {
            return None;
        }
        let open = notes.clone().find(|&f| model.file.fingerings[f].fingers.is_empty())?;
        let height = above(high);
        let change = (above(open) + CHANGE_CENTS).max(LEAST_CENTS);
        let via = notes
            .filter(|&f| model.registers[f] == 2 && above(f) <= height.min(change + DEEPEST_CENTS))
            .max_by(|&a, &b| above(a).total_cmp(&above(b)))?;
        let hand = (0..model.notes_hz.len())
            .filter(|&f| model.registers[f] == 2 && above(f) <= change + HAND_CENTS)
            .max_by(|&a, &b| above(a).total_cmp(&above(b)))?;
        let resonance =
            above(open) + RESONANCE_CENTS + RESONANCE_SLOPE * (change - above(open) - CHANGE_CENTS);
        // Those below the highest hole that is open matter little.
        let all = holes(low, model) | !(u64::MAX << highest_open(low, model).min(63));
        let (low_hz, via_hz, reached) = (model.notes_hz[low], model.notes_hz[via], above(via));
        let all_open = above(open) + ALL_OPEN_CENTS;
        Some(Self {
            below: Ladder::new(holes(low, model), all, 1, (low_hz, all_open), model),
            above: Ladder::new(holes(via, model), holes(high, model), 2, (via_hz, height - reached), model),
            all,
            via: holes(via, model),
            hand: holes(hand, model),
            via_hz,
            low_hz,
            begins: (change - TAKES_OVER_CENTS).max(0.0),
            change,
            all_open,
            reached,
            height,
            octaves: (resonance - reached) / 1_200.0,
            ear: PitchEar::default(),
            rises,
            correction: 0.0,
            hands: if rises { 0.0 } else { 1.0 },
            place: if rises { 0.0 } else { height },
        })
    }

    /// The same, in the other direction from here.
    pub fn turned(&self) -> Self {
        Self { rises: !self.rises, ..*self }
    }

    /// One tick on the way to a place, cents above the lower note; hears the pressure in the mouthpiece, over the reference closing
    /// pressure. `period_s` is that of a tick on the clock of the bore. Real-time safe.
    pub fn tick(&mut self, place: f64, pressure: f64, (tick_s, period_s): (f64, f64)) {
        if (place < self.change) != (self.place < self.change) {
            // The tract goes on from where it is, and the fingers from all holes open.
            self.correction = if place < self.change {
                0.0
            } else {
                bend_for_octaves(self.octaves) - (self.change - self.reached)
            };
        }
        self.place = place;
        let goal = f64::from(u8::from(place >= self.change));
        let time_s = if self.rises { CLOSES_S } else { OPENS_S };
        self.hands += (goal - self.hands).clamp(-tick_s / time_s, tick_s / time_s);
        let wanted_hz = self.low_hz * maths::exp2(place / 1_200.0);
        let off = self.ear.hear(pressure, wanted_hz, period_s).unwrap_or(0.0);
        let corrected = self.correction - off * tick_s / CORRECTS_S;
        self.correction = corrected.clamp(-CORRECTION_MOST_CENTS, CORRECTION_MOST_CENTS);
    }

    /// How far the tract has taken over in the chalumeau, 0..=1.
    fn lead(&self) -> f64 {
        smooth((self.place - self.begins) / (self.change - self.begins))
    }

    /// What the fingers correct, cents: at the ends of the slide nothing.
    fn corrected(&self) -> f64 {
        self.correction * (self.place.min(self.height - self.place) / ENDS_CENTS).clamp(0.0, 1.0)
    }

    /// What the vocal tract does; `None` where its throat is open.
    pub fn tract(&self) -> Option<Voiced> {
        if self.place <= self.begins || self.place >= self.reached {
            return None;
        }
        let bend = self.place - self.reached + self.correction;
        let (octaves, amount, quality) = if self.place < self.change {
            (self.octaves, self.lead(), QUALITIES.0)
        } else {
            (octaves_for_bend(bend.min(0.0)), 1.0, QUALITIES.1)
        };
        Some(Voiced { note_hz: self.via_hz, octaves, amount, quality })
    }

    /// Where the fingers are.
    pub fn fingers(&self) -> Between {
        let place = self.place + self.corrected();
        if self.hands <= 0.0 {
            self.below.at(place + self.lead() * (self.all_open - self.change))
        } else if self.hands < 1.0 {
            if self.rises {
                Between { from: self.all, to: self.hand, way: self.hands, rises: true }
            } else {
                Between { from: self.hand, to: self.all, way: 1.0 - self.hands, rises: true }
            }
        } else if self.place < self.change + GIVES_BACK_CENTS {
            let way = ((self.place - self.change) / GIVES_BACK_CENTS).clamp(0.0, 1.0);
            Between { from: self.hand, to: self.via, way, rises: false }
        } else {
            self.above.at(if self.place < self.reached { 0.0 } else { place - self.reached })
        }
    }

    /// The fingering of the chart whose lip the player has now: that of the note which sounds. Where the tract leads it is that
    /// of the fingering which the tract bends.
    pub fn lip(&self, model: &Model) -> usize {
        let goal = self.place + self.lead() * (self.reached - self.place).max(0.0);
        let place = |fingering: usize| cents(model.notes_hz[fingering], self.low_hz);
        (0..model.notes_hz.len())
            .filter(|&fingering| place(fingering) < self.height + 1.0)
            .min_by(|&a, &b| (place(a) - goal).abs().total_cmp(&(place(b) - goal).abs()))
            .unwrap_or(0)
    }
}
