//! Joints pulled out or parts cut shorter: how a player tunes an instrument, and what a maker tries.

use serde::{Deserialize, Serialize};

use super::instrument_file::{BoreSegment, InstrumentFile};

/// Furthest that a joint is pulled out, m. A tenon is some 15 to 20 mm long.
const MOST_PULLED_M: f64 = 15e-3;
/// Most that a part is cut shorter, m. Barrels are sold in lengths from 60 to 68 mm.
const MOST_CUT_M: f64 = 15e-3;
/// What must remain of a part between its last hole, or its upper end, and its lower end, m.
const LEAST_LEFT_M: f64 = 2e-3;

/// A part with another length. All that lies below moves with it. Lengths are those of the instrument's file.
///
/// Pulled out, the gap has the bore's width at the end of the part, as with a tuning ring in it. Cut shorter, the part loses its
/// lower end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PulledJoint {
    /// Name of the part above the joint, e.g. `barrel`.
    pub part: String,
    /// How much longer the part is, m; below 0 it is shorter.
    pub by_m: f64,
}

impl InstrumentFile {
    /// Names of the parts that end in a joint, from the reed on; the last part does not.
    pub fn jointed_parts(&self) -> Vec<&str> {
        let pairs = self.bore.windows(2).filter(|pair| pair[0].part != pair[1].part);
        pairs.map(|pair| pair[0].part.as_str()).collect()
    }

    /// Distance of the joint below a part from the tip of the reed, m; `None` if the part has none.
    pub fn joint_x_m(&self, part: &str) -> Option<f64> {
        self.bore.get(self.segment_above_joint(part)?).map(|segment| segment.x_end_m)
    }

    /// How much shorter (below 0) and longer a part can be, m; `None` if it does not end in a joint.
    pub fn room_of_joint(&self, part: &str) -> Option<(f64, f64)> {
        let joint_m = self.joint_x_m(part)?;
        let start_m = self.bore.iter().find(|segment| segment.part == part)?.x_start_m;
        let holes = self.holes.iter().filter(|hole| hole.x_m < joint_m).map(|hole| hole.x_m + hole.radius_m);
        let kept_m = holes.fold(start_m, f64::max) + LEAST_LEFT_M;
        Some(((kept_m - joint_m).clamp(-MOST_CUT_M, 0.0), MOST_PULLED_M))
    }

    /// The same instrument with some parts longer or shorter, one after the other. What would lie outside a part's room
    /// is brought back into it; parts that do not end in a joint and numbers that are none are left out.
    ///
    /// ```
    /// use chalumeau_core::bore::instrument_file::InstrumentFile;
    /// use chalumeau_core::bore::pulled_joint::PulledJoint;
    ///
    /// let clarinet = InstrumentFile::built_in();
    /// // As a player does who is too sharp.
    /// let flat = clarinet.with_joints_pulled(&[PulledJoint { part: "barrel".to_owned(), by_m: 2e-3 }]);
    /// assert!((flat.length_m() - clarinet.length_m() - 2e-3).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn with_joints_pulled(&self, pulled: &[PulledJoint]) -> Self {
        let mut file = self.clone();
        for PulledJoint { part, by_m } in pulled {
            if let Some((least_m, most_m)) = file.room_of_joint(part).filter(|_| by_m.is_finite()) {
                file.lengthen(part, by_m.clamp(least_m, most_m));
            }
        }
        file
    }

    /// How far what lies at `x_m` moves when joints are pulled, m: the sum of those above it. Places at a joint are below it.
    pub fn moved_by_joints(&self, x_m: f64, pulled: &[PulledJoint]) -> f64 {
        let is_above =
            |joint: &&PulledJoint| self.joint_x_m(&joint.part).is_some_and(|joint_m| joint_m <= x_m);
        pulled.iter().filter(is_above).map(|joint| joint.by_m).sum()
    }

    fn segment_above_joint(&self, part: &str) -> Option<usize> {
        self.bore.windows(2).position(|pair| pair[0].part == part && pair[1].part != part)
    }

    fn lengthen(&mut self, part: &str, by_m: f64) {
        let Some(last) = self.segment_above_joint(part) else { return };
        let Some(above) = self.bore.get(last).cloned() else { return };
        let (joint_m, end_m) = (above.x_end_m, above.x_end_m + by_m);
        for segment in self.bore.iter_mut().skip(last + 1) {
            segment.x_start_m += by_m;
            segment.x_end_m += by_m;
        }
        for hole in self.holes.iter_mut().filter(|hole| hole.x_m >= joint_m) {
            hole.x_m += by_m;
        }
        if by_m > 0.0 {
            let gap = BoreSegment { x_start_m: joint_m, x_end_m: end_m, r_start_m: above.r_end_m, ..above };
            self.bore.insert(last + 1, gap);
        } else if by_m < 0.0 {
            let r_m = self.radius_at(end_m);
            // Another part farther down may have the same name.
            let (mut index, mut left) = (0, 0);
            self.bore.retain(|segment| {
                let is_above = index <= last;
                let is_cut_off = segment.part == part && is_above && segment.x_start_m >= end_m;
                index += 1;
                left += usize::from(is_above && !is_cut_off);
                !is_cut_off
            });
            let cut = self.bore[..left].iter_mut().rfind(|segment| segment.part == part);
            if let Some(cut) = cut {
                (cut.x_end_m, cut.r_end_m) = (end_m, r_m);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pulled(part: &str, by_m: f64) -> PulledJoint {
        PulledJoint { part: part.to_owned(), by_m }
    }

    #[test]
    fn a_part_whose_name_comes_twice_is_pulled_where_it_comes_first() {
        let mut file = InstrumentFile::built_in();
        let parts: Vec<String> = file.jointed_parts().into_iter().map(str::to_owned).collect();
        let (first, again) = (parts[1].clone(), parts[2].clone());
        file.bore
            .iter_mut()
            .filter(|segment| segment.part == again)
            .for_each(|segment| segment.part = format!("{first} 2"));
        let plain = file.with_joints_pulled(&[pulled(&first, -1e-3)]);
        // The last segment of the other part has the name too.
        let last = file.bore.iter().rposition(|segment| segment.part == format!("{first} 2")).unwrap();
        file.bore[last].part.clone_from(&first);
        let twice = file.with_joints_pulled(&[pulled(&first, -1e-3)]);
        let ends = |file: &InstrumentFile| {
            file.bore.iter().map(|segment| (segment.x_start_m, segment.x_end_m)).collect::<Vec<_>>()
        };
        assert_eq!(ends(&twice), ends(&plain));
        assert!(ends(&twice).iter().all(|(start, end)| start < end));
    }

    #[test]
    fn every_joint_of_every_instrument_moves_all_below_it_and_nothing_above() {
        for bundled in crate::bore::bundled::Bundled::ALL {
            let file = bundled.file();
            assert!(file.jointed_parts().len() >= 3, "{}: {:?}", file.name, file.jointed_parts());
            for part in file.jointed_parts() {
                let (joint_m, room) = (file.joint_x_m(part).unwrap(), file.room_of_joint(part).unwrap());
                for by_m in [room.0, 0.4 * room.0, 1e-4, 3e-3, room.1] {
                    let other = file.with_joints_pulled(&[pulled(part, by_m)]);
                    assert!((other.length_m() - file.length_m() - by_m).abs() < 1e-12, "{part} by {by_m}");
                    assert!((other.joint_x_m(part).unwrap() - joint_m - by_m).abs() < 1e-12);
                    for (before, after) in file.holes.iter().zip(&other.holes) {
                        let way_m = if before.x_m < joint_m { 0.0 } else { by_m };
                        assert!((after.x_m - before.x_m - way_m).abs() < 1e-12, "{part} by {by_m}");
                    }
                    assert!(other.bore.windows(2).all(|pair| pair[0].x_end_m == pair[1].x_start_m));
                    assert!(other.bore.iter().all(|segment| segment.x_end_m > segment.x_start_m));
                    // Above the joint the bore is as it was.
                    for share in [0.1, 0.5, 0.95] {
                        let x_m = share * (joint_m + by_m.min(0.0));
                        assert!((other.radius_at(x_m) - file.radius_at(x_m)).abs() < 1e-12);
                    }
                    // What a window makes can be saved and read.
                    let again =
                        InstrumentFile::parse(&other.to_toml()).unwrap_or_else(|fault| panic!("{fault}"));
                    assert_eq!(again.fingerings, file.fingerings);
                }
            }
        }
    }

    #[test]
    fn nothing_pulled_is_the_same_and_nonsense_is_left_out() {
        let file = InstrumentFile::built_in();
        let nonsense =
            [pulled("none", 1e-3), pulled("bell", 1e-3), pulled("barrel", f64::NAN), pulled("barrel", 0.0)];
        assert_eq!(file.with_joints_pulled(&nonsense), file);
        let far = file.with_joints_pulled(&[pulled("barrel", 1.0)]);
        assert!((far.length_m() - file.length_m() - MOST_PULLED_M).abs() < 1e-12);
        let short = file.with_joints_pulled(&[pulled("upper joint", -1.0)]);
        let joint_m = short.joint_x_m("upper joint").unwrap();
        let above = short.holes.iter().zip(&file.holes).filter(|(new, old)| new.x_m == old.x_m);
        assert!(
            above.clone().count() >= 15
                && above.into_iter().all(|(hole, _)| hole.x_m + hole.radius_m < joint_m)
        );
        assert_eq!(file.moved_by_joints(0.05, &[pulled("barrel", 2e-3)]), 0.0);
        let both = [pulled("barrel", 2e-3), pulled("mouthpiece", 1e-3)];
        assert!((file.moved_by_joints(0.2, &both) - 3e-3).abs() < 1e-15);
    }
}
