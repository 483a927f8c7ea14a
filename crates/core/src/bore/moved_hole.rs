//! Tone holes drilled elsewhere, wider or narrower: what a maker tries on an instrument.

use serde::{Deserialize, Serialize};

use super::instrument_file::{HOLE_RADIUS_M, InstrumentFile, LEAST_HOLE_X_M};

/// Least distance between the centres of two holes, and between a hole and the end of the bore, m. Holes keep their order.
const LEAST_GAP_M: f64 = 0.1e-3;

/// A tone hole with another place or width. Lengths are those of the instrument's file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MovedHole {
    /// Name of the hole.
    pub name: String,
    /// Distance of its centre from the tip of the reed, m.
    pub x_m: f64,
    /// Its radius, m.
    pub radius_m: f64,
}

/// Where a hole can be drilled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HoleRoom {
    /// Least and greatest distance from the tip of the reed, m: between the neighbours, or between hole and end.
    pub x_m: (f64, f64),
    /// Least radius, m. The greatest is the radius of the bore at its place.
    pub least_radius_m: f64,
}

impl InstrumentFile {
    /// Where a hole can be drilled while all others stay; `None` if there is no such hole.
    pub fn room_of_hole(&self, hole: usize) -> Option<HoleRoom> {
        let here = self.holes.get(hole)?;
        let above_m = hole
            .checked_sub(1)
            .and_then(|above| self.holes.get(above))
            .map_or(0.0, |hole| hole.x_m + LEAST_GAP_M);
        let below_m = self.holes.get(hole + 1).map_or(self.length_m(), |hole| hole.x_m);
        // Where neighbours are closer than that already, the hole stays between them.
        let least_m = above_m.max(LEAST_HOLE_X_M).min(here.x_m);
        let most_m = (below_m - LEAST_GAP_M).max(here.x_m);
        Some(HoleRoom { x_m: (least_m, most_m), least_radius_m: HOLE_RADIUS_M.0 })
    }

    /// The same instrument with some holes elsewhere, one after the other. What would lie outside a hole's room is
    /// brought back into it; names that the instrument does not have and numbers that are none are left out.
    ///
    /// ```
    /// use chalumeau_core::bore::instrument_file::InstrumentFile;
    /// use chalumeau_core::bore::moved_hole::MovedHole;
    ///
    /// let clarinet = InstrumentFile::built_in();
    /// let hole = clarinet.holes.last().expect("it has holes");
    /// // Nearer to the reed: the notes that sound from it rise.
    /// let moved = MovedHole { name: hole.name.clone(), x_m: hole.x_m - 2e-3, radius_m: hole.radius_m };
    /// let sharp = clarinet.with_holes_moved(&[moved]);
    /// assert!(sharp.holes.last().expect("as many").x_m < hole.x_m);
    /// ```
    #[must_use]
    pub fn with_holes_moved(&self, moved: &[MovedHole]) -> Self {
        let mut file = self.clone();
        for MovedHole { name, x_m, radius_m } in moved {
            let room = file.hole(name).and_then(|index| Some((index, file.room_of_hole(index)?)));
            let Some((index, room)) = room.filter(|_| x_m.is_finite() && radius_m.is_finite()) else {
                continue;
            };
            let x_m = x_m.clamp(room.x_m.0, room.x_m.1);
            let most_m = file.radius_at(x_m).min(HOLE_RADIUS_M.1).max(room.least_radius_m);
            if let Some(hole) = file.holes.get_mut(index) {
                (hole.x_m, hole.radius_m) = (x_m, radius_m.clamp(room.least_radius_m, most_m));
            }
        }
        file
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(file: &InstrumentFile, hole: usize, by_m: f64, radius_m: f64) -> InstrumentFile {
        let hole = &file.holes[hole];
        file.with_holes_moved(&[MovedHole { name: hole.name.clone(), x_m: hole.x_m + by_m, radius_m }])
    }

    #[test]
    fn holes_keep_their_order_and_their_bore() {
        let file = InstrumentFile::built_in();
        for hole in 0..file.holes.len() {
            for (by_m, radius_m) in [(-1.0, 1.0), (1.0, 1e-9), (2e-4, 3e-3)] {
                let other = moved(&file, hole, by_m, radius_m);
                assert!(other.holes.is_sorted_by(|a, b| a.x_m <= b.x_m), "hole {hole} by {by_m}");
                let it = &other.holes[hole];
                assert!(it.radius_m <= other.radius_at(it.x_m) + 1e-9 && it.radius_m >= HOLE_RADIUS_M.0);
                // What a window makes can be saved and read.
                let again = InstrumentFile::parse(&other.to_toml()).unwrap_or_else(|fault| panic!("{fault}"));
                assert_eq!(again.fingerings, file.fingerings);
            }
        }
    }

    #[test]
    fn nothing_moved_is_the_same_and_nonsense_is_left_out() {
        let file = InstrumentFile::built_in();
        assert_eq!(file.with_holes_moved(&[]), file);
        let name = file.holes[3].name.clone();
        let nonsense = [
            MovedHole { name: "none".to_owned(), x_m: 0.1, radius_m: 3e-3 },
            MovedHole { name: name.clone(), x_m: f64::NAN, radius_m: 3e-3 },
            MovedHole { name, x_m: 0.1, radius_m: f64::INFINITY },
        ];
        assert_eq!(file.with_holes_moved(&nonsense), file);
        assert_eq!(file.room_of_hole(99), None);
    }
}
