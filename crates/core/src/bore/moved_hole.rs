//! Tone holes drilled elsewhere, wider or narrower: what a maker tries on an instrument.

use serde::{Deserialize, Serialize};

use super::instrument_file::{HOLE_RADIUS_M, InstrumentFile, LEAST_HOLE_X_M};

/// Least distance between the centres of two holes, and between a hole and the end of the bore, m. Holes keep their order.
pub const LEAST_GAP_M: f64 = 0.1e-3;

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

    /// The same instrument with some holes elsewhere, in whatever order they are given; of two places of one hole the later counts.
    /// A hole that has no room where it should be comes as near as holes that stay, and moved ones nearer to the reed, leave it.
    /// Names that the instrument does not have and numbers that are none are left out.
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
        let mut wanted: Vec<Option<&MovedHole>> = vec![None; self.holes.len()];
        for hole in moved.iter().filter(|hole| hole.x_m.is_finite() && hole.radius_m.is_finite()) {
            if let Some(place) = self.hole(&hole.name).and_then(|index| wanted.get_mut(index)) {
                *place = Some(hole);
            }
        }
        // How far down each may go, from the bell: as far as all between it and the next hole that stays have room.
        let mut most_m = vec![0.0; self.holes.len()];
        for index in (0..self.holes.len()).rev() {
            most_m[index] = match (wanted[index], most_m.get(index + 1)) {
                (None, _) => self.holes[index].x_m,
                (Some(_), Some(below_m)) => below_m - self.gap_below(index),
                (Some(_), None) => (self.length_m() - LEAST_GAP_M).max(self.holes[index].x_m),
            };
        }
        for index in 0..self.holes.len() {
            let Some(MovedHole { x_m, radius_m, .. }) = wanted[index] else { continue };
            let least_m = match index.checked_sub(1) {
                Some(above) => file.holes[above].x_m + self.gap_below(above),
                None => LEAST_HOLE_X_M.min(self.holes[index].x_m),
            };
            let x_m = x_m.max(least_m).min(most_m[index]);
            let widest_m = file.radius_at(x_m).min(HOLE_RADIUS_M.1).max(HOLE_RADIUS_M.0);
            let hole = &mut file.holes[index];
            (hole.x_m, hole.radius_m) = (x_m, radius_m.clamp(HOLE_RADIUS_M.0, widest_m));
        }
        file
    }

    /// Least distance of a hole from the next one, m. Where the two were built closer together, they stay as close.
    fn gap_below(&self, hole: usize) -> f64 {
        let here_m = self.holes[hole].x_m;
        self.holes.get(hole + 1).map_or(LEAST_GAP_M, |next| LEAST_GAP_M.min(next.x_m - here_m))
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
    fn the_order_in_which_holes_are_moved_does_not_matter() {
        let file = InstrumentFile::built_in();
        let hole = |name: &str| file.holes.iter().find(|hole| hole.name == name).unwrap();
        let to = |name: &str, x_m: f64, radius_m: f64| MovedHole { name: name.to_owned(), x_m, radius_m };
        // The upper of two neighbours has moved up, and the lower to where the upper was built.
        let (key, pad) = (hole("EB_KEY"), hole("F_PAD"));
        assert!(key.x_m < pad.x_m);
        let key = to("EB_KEY", key.x_m - 8e-3, 0.9 * key.radius_m);
        let pad = to("F_PAD", hole("EB_KEY").x_m - 3e-3, pad.radius_m);
        let [down, up] = [[key.clone(), pad.clone()], [pad.clone(), key.clone()]]
            .map(|moved| file.with_holes_moved(&moved));
        assert_eq!(down, up);
        let now = |name: &str| down.holes[down.hole(name).unwrap()].x_m;
        assert_eq!((now("EB_KEY"), now("F_PAD")), (key.x_m, pad.x_m));
    }

    #[test]
    fn holes_that_are_moved_to_one_place_keep_their_order() {
        let file = InstrumentFile::built_in();
        for at_m in [-1.0, 0.0, 0.31, 9.0] {
            let all = file.holes.iter().rev();
            let all: Vec<_> =
                all.map(|hole| MovedHole { name: hole.name.clone(), x_m: at_m, radius_m: 1e-3 }).collect();
            for moved in [&all[..], &all[..5], &all[9..]] {
                let other = file.with_holes_moved(moved);
                assert!(other.holes.is_sorted_by(|a, b| a.x_m < b.x_m), "{at_m} m");
                InstrumentFile::parse(&other.to_toml()).unwrap_or_else(|fault| panic!("{at_m} m: {fault}"));
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
