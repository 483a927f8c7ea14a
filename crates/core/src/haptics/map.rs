//! From the angle of the knob to mouth pressure, bent so that what is felt is what sounds.
//!
//! Straight lines through rest, onset, closure and extinction; beyond extinction the last line goes on. Monotone, and
//! exactly invertible. A dead zone around rest is the knob reader's matter.

/// Rest, onset, closure, extinction.
const KNOTS: usize = 4;

/// Angle to mouth pressure for one note. A few numbers, to be copied anywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleMap {
    angle_deg: [f64; KNOTS],
    pressure_pa: [f64; KNOTS],
}

impl AngleMap {
    /// Through rest and three landmarks `(angle, pressure)`, both rising. A landmark that does not rise over the one
    /// before it is put just above it, so that the map stays invertible.
    pub(super) fn new(landmarks: [(f64, f64); KNOTS - 1]) -> Self {
        let (mut angle_deg, mut pressure_pa) = ([0.0; KNOTS], [0.0; KNOTS]);
        for (at, (angle, pressure)) in landmarks.into_iter().enumerate() {
            angle_deg[at + 1] = angle.max(angle_deg[at] + 1e-3);
            pressure_pa[at + 1] = pressure.max(pressure_pa[at] + 1e-3);
        }
        Self { angle_deg, pressure_pa }
    }

    /// Mouth pressure at an angle from rest, Pa; 0 on the other side of rest. Real-time safe. [audio thread]
    pub fn pressure_pa(&self, angle_deg: f64) -> f64 {
        along(&self.angle_deg, &self.pressure_pa, angle_deg)
    }

    /// Angle at which the mouth pressure is so many Pa; 0 at and below 0. Real-time safe.
    pub fn angle_deg(&self, pressure_pa: f64) -> f64 {
        along(&self.pressure_pa, &self.angle_deg, pressure_pa)
    }
}

fn along(from: &[f64; KNOTS], to: &[f64; KNOTS], x: f64) -> f64 {
    if x.is_nan() || x <= 0.0 {
        return 0.0;
    }
    let right = from[1..KNOTS - 1].iter().filter(|&&knot| knot < x).count() + 1;
    let way = (x - from[right - 1]) / (from[right] - from[right - 1]);
    to[right - 1] + way * (to[right] - to[right - 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn map_rises_passes_its_landmarks_and_is_undone() {
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
    fn landmarks_in_the_wrong_order_leave_it_invertible() {
        let map = AngleMap::new([(120.0, 7_000.0), (360.0, 6_000.0), (360.0, 6_000.0)]);
        for angle in [1.0, 119.0, 200.0, 359.0] {
            assert!((map.angle_deg(map.pressure_pa(angle)) - angle).abs() < 1e-3, "{angle}");
        }
        assert!(map.pressure_pa(1e4).is_finite());
    }
}
