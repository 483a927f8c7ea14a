//! The fingers: which fingering is in place, and how its holes get there.

use crate::bore::lattice::{Lattice, Real};
use crate::instrument::model::Model;
use crate::instrument::voice::TICK;

/// State of the fingers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fingers {
    /// Index of the fingering in place; none before the first note.
    fingering: Option<usize>,
    /// Open holes that replace those of the fingering, one bit each.
    tried: Option<u64>,
}

impl Fingers {
    /// Index of the fingering in place, if there was any note.
    pub fn fingering(&self) -> Option<usize> {
        self.fingering
    }

    /// Replaces the open holes of every fingering, one bit each from the lowest; `None` goes back to the fingering.
    /// [`move_to`](Self::move_to) then moves the holes.
    pub fn try_holes(&mut self, tried: Option<u64>) {
        self.tried = tried;
    }

    /// Moves the fingers to a fingering within `ticks` control ticks; the first fingering of all is in place at once.
    pub fn move_to<F: Real>(
        &mut self,
        fingering: usize,
        ticks: u32,
        model: &Model,
        lattice: &mut Lattice<F>,
    ) {
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

    /// Opening of a hole under a fingering: 1 open, 0 closed.
    fn opening(&self, fingering: usize, hole: usize, model: &Model) -> f64 {
        let open = match self.tried {
            Some(tried) => tried >> hole & 1 == 1,
            None => model.file.fingerings[fingering].open[hole],
        };
        f64::from(u8::from(open))
    }
}
