//! The fingers: which fingering is in place, and how its holes get there.

use super::glissando::Between;
use super::slur;
use crate::bore::lattice::{Lattice, Real};
use crate::instrument::model::Model;
use crate::instrument::voice::TICK;

/// How many fingers are on their way at a time in a slide: a finger begins where the one before is half open.
pub const TOGETHER: f64 = 2.0;
/// Holes that fingers can move: those that a set of holes has bits for.
const HOLES: usize = 64;

/// State of the fingers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fingers {
    /// Index of the fingering in place; none before the first note.
    fingering: Option<usize>,
    /// The alternate that is in place instead of the chart's fingering, by its number in the model.
    alternate: Option<u8>,
    /// Holes that are open as far as asked, whatever is fingered.
    held: HeldHoles,
    /// A slur that is under way.
    walk: Walk,
    /// What is left of where the holes were when a slide began.
    settling: Settling,
}

/// Openings that replace those of the fingering.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HeldHoles {
    /// The holes that have one, one bit each.
    which: u64,
    /// 0 closed..=1 open.
    openings: [f32; HOLES],
}

impl Default for HeldHoles {
    fn default() -> Self {
        Self { which: 0, openings: [0.0; HOLES] }
    }
}

impl HeldHoles {
    fn opening(&self, hole: usize) -> Option<f32> {
        (hole < HOLES && self.which >> hole & 1 == 1).then(|| self.openings[hole])
    }

    fn set(&mut self, hole: usize, opening: Option<f32>) {
        match opening {
            Some(opening) => {
                self.which |= 1 << hole;
                self.openings[hole] = opening;
            }
            None => self.which &= !(1 << hole),
        }
    }
}

/// Fingers that move one after another.
#[derive(Clone, Copy, Debug)]
struct Walk {
    /// Ticks until each hole begins to move; 0 for those that have begun.
    waits: [u16; HOLES],
    /// Ticks that each takes.
    ticks: usize,
    /// Ticks until the last begins.
    left: u16,
}

impl Default for Walk {
    fn default() -> Self {
        Self { waits: [0; HOLES], ticks: 1, left: 0 }
    }
}

/// Holes that a slide found elsewhere than where it begins: they go there, while it goes on.
#[derive(Clone, Copy, Debug)]
struct Settling {
    /// These holes, one bit each.
    which: u64,
    /// How much farther open each was, -1..=1.
    off: [f32; HOLES],
    /// Ticks that are left, and all of them, at least 1.
    left: u32,
    ticks: u32,
}

impl Default for Settling {
    fn default() -> Self {
        Self { which: 0, off: [0.0; HOLES], left: 0, ticks: 1 }
    }
}

impl Fingers {
    /// Without a fingering; holes that are held stay so.
    pub fn lifted(&self) -> Self {
        Self { held: self.held, ..Self::default() }
    }

    /// Those of a player without keys hold the holes that another one holds.
    pub fn follow(&mut self, from: &Self) {
        if self.held != from.held {
            *self = from.lifted();
        }
    }

    /// Index of the fingering in place, if there was any note.
    pub fn fingering(&self) -> Option<usize> {
        self.fingering
    }

    /// The alternate in place of it, if one is.
    pub fn alternate(&self) -> Option<u8> {
        self.alternate
    }

    /// Chooses an alternate for the fingering that they are moved to next; `None` for that of the chart.
    pub fn choose(&mut self, alternate: Option<u8>) {
        self.alternate = alternate;
    }

    /// Replaces the open holes of every fingering, one bit each from the lowest; `None` goes back to the fingering.
    /// [`move_to`](Self::move_to) then moves the holes.
    pub fn try_holes(&mut self, tried: Option<u64>) {
        let open = |tried: u64, hole: usize| if tried >> hole & 1 == 1 { 1.0 } else { 0.0 };
        (0..HOLES).for_each(|hole| self.held.set(hole, tried.map(|tried| open(tried, hole))));
    }

    /// Holds one hole at an opening, 0..=1, under every fingering; `None`, or a number that is not finite, gives it back to
    /// the fingering. It moves there within `ticks` control ticks; before the first note it waits for the note.
    pub fn hold_hole<F: Real>(
        &mut self,
        hole: usize,
        opening: Option<f32>,
        ticks: u32,
        model: &Model,
        lattice: &mut Lattice<F>,
    ) {
        if hole >= model.coeffs.holes().min(HOLES) {
            return;
        }
        self.held.set(hole, opening.filter(|x| x.is_finite()).map(|x| x.clamp(0.0, 1.0)));
        self.walk.waits[hole] = 0;
        if let Some(fingering) = self.fingering {
            lattice.glide_opening(hole, self.opening(fingering, hole, model), ticks.max(1) as usize * TICK);
        }
    }

    /// Makes a fingering the one in place while [`slide`](Self::slide) moves the holes.
    pub fn aim(&mut self, fingering: usize) {
        self.fingering = Some(fingering);
        self.alternate = None;
        self.walk = Walk::default();
    }

    /// Moves the fingers to a fingering within `ticks` control ticks; the first fingering of all is in place at once.
    pub fn move_to<F: Real>(
        &mut self,
        fingering: usize,
        ticks: u32,
        model: &Model,
        lattice: &mut Lattice<F>,
    ) {
        self.walk = Walk::default();
        let is_first = self.fingering.is_none();
        self.fingering = Some(fingering);
        for hole in 0..model.coeffs.holes() {
            let opening = self.opening(fingering, hole, model);
            if is_first {
                lattice.set_opening(hole, opening);
            } else {
                lattice.glide_opening(hole, opening, ticks.max(1) as usize * TICK);
            }
        }
    }

    /// The holes that are open now, those that are held left out: one bit each, half open or more counts.
    pub fn open_holes<F: Real>(&self, model: &Model, lattice: &Lattice<F>) -> u64 {
        let Some(fingering) = self.fingering else { return 0 };
        let open = |hole: usize| {
            let opening = match self.held.opening(hole) {
                Some(_) => f64::from(u8::from(model.file.fingerings[fingering].open[hole])),
                None => lattice.opening(hole),
            };
            u64::from(opening >= 0.5) << hole
        };
        (0..model.coeffs.holes().min(HOLES)).map(open).sum()
    }

    /// A slide begins here. Holes that are elsewhere go there within `ticks` control ticks while it goes on.
    pub fn begin_slide<F: Real>(
        &mut self,
        between: Between,
        ticks: u32,
        model: &Model,
        lattice: &Lattice<F>,
    ) {
        let mut settling = Settling { left: ticks.max(1), ticks: ticks.max(1), ..Settling::default() };
        each_opening(between, self.held.which, model, |hole, opening| {
            let off = (lattice.opening(hole) - opening) as f32;
            settling.which |= u64::from(off != 0.0) << hole;
            settling.off[hole] = off;
        });
        self.settling = settling;
    }

    /// Puts the fingers where a slide has them, within one tick: the holes that change do so one after another.
    pub fn slide<F: Real>(&mut self, between: Between, model: &Model, lattice: &mut Lattice<F>) {
        let settling = &mut self.settling;
        settling.left = settling.left.saturating_sub(1);
        let share = f64::from(settling.left) / f64::from(settling.ticks);
        let moving = between.from ^ between.to | settling.which;
        each_opening(between, self.held.which, model, |hole, opening| {
            if moving >> hole & 1 == 1 {
                let off = share * f64::from(settling.off[hole]);
                lattice.glide_opening(hole, (opening + off).clamp(0.0, 1.0), TICK);
            }
        });
        if settling.left == 0 {
            settling.which = 0;
        }
    }

    /// Moves the fingers to a fingering one after another, as a slur has it, whose time is `ticks` control ticks. The hole nearest to the bell goes
    /// first: what it does is hardly heard, and the hole that makes the new note is the last.
    pub fn walk_to<F: Real>(
        &mut self,
        fingering: usize,
        ticks: u32,
        walk: slur::Walk,
        model: &Model,
        lattice: &mut Lattice<F>,
    ) {
        let ticks = (f64::from(ticks) * walk.time) as u32;
        if self.fingering.is_none() {
            return self.move_to(fingering, ticks, model, lattice);
        }
        self.fingering = Some(fingering);
        self.walk = Walk::default();
        let holes = model.coeffs.holes().min(HOLES);
        let mut moving = 0_u64;
        for hole in 0..holes {
            let moves =
                lattice.is_gliding(hole) || lattice.opening(hole) != self.opening(fingering, hole, model);
            moving |= u64::from(moves) << hole;
        }
        let count = moving.count_ones();
        let share = if count > 1 { walk.finger_share } else { 1.0 };
        self.walk.ticks = ((f64::from(ticks) * share) as usize).max(1);
        let spread = (f64::from(ticks) - self.walk.ticks as f64).max(0.0) / f64::from(count.max(2) - 1);
        // Holes are in order from the mouth.
        for (n, hole) in (0..holes).rev().filter(|hole| moving >> hole & 1 == 1).enumerate() {
            self.walk.waits[hole] = 1 + (spread * n as f64) as u16;
        }
        self.walk.left = (ticks + 1).min(u32::from(u16::MAX)) as u16;
        self.step(model, lattice);
    }

    /// One control tick of fingers that move one after another.
    pub fn tick<F: Real>(&mut self, model: &Model, lattice: &mut Lattice<F>) {
        if self.walk.left > 0 {
            self.step(model, lattice);
        }
    }

    fn step<F: Real>(&mut self, model: &Model, lattice: &mut Lattice<F>) {
        self.walk.left = self.walk.left.saturating_sub(1);
        let Some(fingering) = self.fingering else { return };
        for hole in 0..model.coeffs.holes().min(HOLES) {
            match self.walk.waits[hole] {
                0 => {}
                1 => {
                    self.walk.waits[hole] = 0;
                    lattice.glide_opening(hole, self.opening(fingering, hole, model), self.walk.ticks * TICK);
                }
                wait => self.walk.waits[hole] = wait - 1,
            }
        }
    }

    /// Opening of a hole under a fingering: 1 open, 0 closed.
    fn opening(&self, fingering: usize, hole: usize, model: &Model) -> f64 {
        if let Some(opening) = self.held.opening(hole) {
            return f64::from(opening);
        }
        let alternate = self.alternate.and_then(|at| model.alternates.get(at));
        let open = match alternate {
            Some(alternate) => alternate.open >> hole & 1 == 1,
            None => model.file.fingerings[fingering].open[hole],
        };
        f64::from(u8::from(open))
    }
}

/// Where a slide has the fingers: calls `with` for every hole that is not `held` and its opening, 0..=1.
fn each_opening(between: Between, held: u64, model: &Model, mut with: impl FnMut(usize, f64)) {
    let Between { from, to, way, rises } = between;
    let changes = (from ^ to) & !held;
    let count = changes.count_ones();
    let mut n = 0;
    // Holes are in order from the mouth.
    for hole in (0..model.coeffs.holes().min(HOLES)).filter(|hole| held >> hole & 1 == 0) {
        let opens = to >> hole & 1 == 1;
        if changes >> hole & 1 == 0 {
            with(hole, f64::from(u8::from(opens)));
            continue;
        }
        let turn = if rises { count - 1 - n } else { n };
        n += 1;
        let own = (way * (f64::from(count) - 1.0 + TOGETHER) - f64::from(turn)) / TOGETHER;
        let own = own.clamp(0.0, 1.0);
        with(hole, if opens { own } else { 1.0 - own });
    }
}
