//! The map from the angle of the knob to mouth pressure, which puts the start of the sound at the felt threshold.
//!
//! Straight lines join rest, onset, closure and extinction; the last line continues beyond extinction. The map is monotone
//! and has an exact inverse. A dead zone around rest is left to the code that reads the knob.

/// Least way from the onset to full breath, over that to closure; by judgement: so that a hand can play between them.
const LEAST_WAY: f64 = 0.25;
/// Number of points: rest, onset, closure, extinction.
const KNOTS: usize = 4;

/// The map from angle to mouth pressure for one note. Eight numbers; cheap to copy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleMap {
    angle_deg: [f64; KNOTS],
    pressure_pa: [f64; KNOTS],
}

impl AngleMap {
    /// A map through rest and three landmarks `(angle, pressure)`. A landmark that does not lie above the one before it is
    /// moved just above it, so that the map keeps an inverse.
    pub fn new(landmarks: [(f64, f64); KNOTS - 1]) -> Self {
        let (mut angle_deg, mut pressure_pa) = ([0.0; KNOTS], [0.0; KNOTS]);
        for (at, (angle, pressure)) in landmarks.into_iter().enumerate() {
            angle_deg[at + 1] = angle.max(angle_deg[at] + 1e-3);
            pressure_pa[at + 1] = pressure.max(pressure_pa[at] + 1e-3);
        }
        Self { angle_deg, pressure_pa }
    }

    /// Its three landmarks, (angle in degrees, pressure in Pa): onset, closure, extinction.
    pub fn landmarks(&self) -> [(f64, f64); KNOTS - 1] {
        std::array::from_fn(|at| (self.angle_deg[at + 1], self.pressure_pa[at + 1]))
    }

    /// Mouth pressure at an angle from rest, Pa; 0 at and below rest, and for NaN. Real-time safe.
    pub fn pressure_pa(&self, angle_deg: f64) -> f64 {
        along(&self.angle_deg, &self.pressure_pa, angle_deg)
    }

    /// The same angles for breath that is no pressure: the onset is at `onset_pa` and `full_pa` stays, with straight lines between.
    /// Where full breath would be no or little more than the pressure of the onset, as with a hard reed, it is reached a quarter of the
    /// way from there to closure. Real-time safe.
    pub fn with_onset(&self, onset_pa: f64, full_pa: f64) -> Self {
        let [_, own, closure, _] = self.pressure_pa;
        let full_at = full_pa.max(own + LEAST_WAY * (closure - own));
        let above = (full_pa - onset_pa) / (full_at - own);
        let moved = |pa: f64| if pa <= own { pa * onset_pa / own } else { onset_pa + (pa - own) * above };
        Self { angle_deg: self.angle_deg, pressure_pa: self.pressure_pa.map(moved) }
    }

    /// Angle from rest, degrees, at which the mouth pressure is `pressure_pa`; 0 at and below 0 Pa, and for NaN. Real-time
    /// safe.
    pub fn angle_deg(&self, pressure_pa: f64) -> f64 {
        along(&self.pressure_pa, &self.angle_deg, pressure_pa)
    }
}

/// The straight lines from one set of points to the other.
fn along(from: &[f64; KNOTS], to: &[f64; KNOTS], x: f64) -> f64 {
    if x.is_nan() || x <= 0.0 {
        return 0.0;
    }
    let right = from[1..KNOTS - 1].iter().filter(|&&knot| knot < x).count() + 1;
    let share = (x - from[right - 1]) / (from[right] - from[right - 1]);
    to[right - 1] + share * (to[right] - to[right - 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn map_rises_through_its_landmarks_and_has_an_inverse() {
        let map = AngleMap::new([(120.0, 2_350.0), (360.0, 6_000.0), (700.0, 11_700.0)]);
        for (angle, pressure) in [(0.0, 0.0), (120.0, 2_350.0), (360.0, 6_000.0), (700.0, 11_700.0)] {
            assert!((map.pressure_pa(angle) - pressure).abs() < 1e-9);
        }
        let mut before = -1.0;
        for step in 0..20_000 {
            let angle = 0.05 * f64::from(step);
            let pressure = map.pressure_pa(angle);
            assert!(pressure > before, "{angle}");
            before = pressure;
            assert!((map.angle_deg(pressure) - angle).abs() < 1e-9, "{angle}");
        }
        assert_eq!((map.pressure_pa(-50.0), map.pressure_pa(f64::NAN)), (0.0, 0.0));
    }

    #[test]
    fn a_moved_onset_keeps_its_angle_and_full_breath() {
        let map = AngleMap::new([(120.0, 2_350.0), (360.0, 6_000.0), (700.0, 11_700.0)]);
        let moved = map.with_onset(189.0, 6_000.0);
        assert!((moved.pressure_pa(120.0) - 189.0).abs() < 1e-9 && moved.pressure_pa(60.0) < 100.0);
        assert!((moved.pressure_pa(360.0) - 6_000.0).abs() < 1e-9);
        assert!((moved.angle_deg(moved.pressure_pa(200.0)) - 200.0).abs() < 1e-9);
    }

    #[test]
    fn between_onset_and_full_breath_there_is_always_a_way_for_the_hand() {
        // Of a reed of strength 5: the note begins at more than full breath.
        let map = AngleMap::new([(130.0, 6_300.0), (360.0, 16_400.0), (700.0, 30_000.0)]);
        let moved = map.with_onset(189.0, 6_000.0);
        assert!((moved.pressure_pa(130.0) - 189.0).abs() < 1e-9);
        let full_deg = moved.angle_deg(6_000.0);
        assert!((full_deg - (130.0 + 0.25 * 230.0)).abs() < 1e-6, "{full_deg}");
        assert!(moved.pressure_pa(150.0) < 0.5 * 6_000.0);
    }

    #[test]
    fn landmarks_in_the_wrong_order_leave_it_invertible() {
        let map = AngleMap::new([(120.0, 7_000.0), (360.0, 6_000.0), (360.0, 6_000.0)]);
        for angle in [1.0, 119.0, 200.0, 359.0] {
            assert!((map.angle_deg(map.pressure_pa(angle)) - angle).abs() < 1e-3, "{angle}");
        }
        assert!(map.pressure_pa(1e4).is_finite());
    }
}
