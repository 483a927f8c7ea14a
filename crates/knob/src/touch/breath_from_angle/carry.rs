//! What a new note takes over from the note before it.
//!
//! Each note makes its own pressure of an angle. If the map changed under the hand when the note changes, the pressure would
//! leap: by 0.1 of the closing pressure over the break at Place 3. No glide over time helps a hand that stays where it is; it
//! would only leap more slowly. So the new note keeps the pressure, as lungs do: it is blown as if the hand stood at the angle
//! where its own map gives that pressure. The difference between the two angles vanishes as the hand turns.
//!
//! - Turning towards that angle changes nothing until it is reached; from there on the note's own map holds.
//! - Turning away from it makes up as much of the difference as the hand turns.
//! - At rest nothing is left.
//!
//! The pressure follows the hand without a jump, and never against it.

/// The difference between where the hand is and where the note's own map has the pressure.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Carry {
    /// Where the hand was when the note changed, degrees from rest.
    from_deg: f64,
    /// From there to where the note's own map has the pressure, degrees.
    shift_deg: f64,
    /// Part of it that is left; it only falls.
    left: f64,
}

impl Carry {
    /// The hand is at `from_deg`, and the new note has the present pressure at `own_deg`, both degrees from rest.
    pub fn new(from_deg: f64, own_deg: f64) -> Self {
        let shift_deg = own_deg - from_deg;
        // At rest there is no breath to take over.
        let left = if from_deg > 0.0 && shift_deg.is_finite() && shift_deg != 0.0 { 1.0 } else { 0.0 };
        Self { from_deg, shift_deg, left }
    }

    /// Angle whose pressure is blown while the hand is at `angle_deg`, degrees from rest. Real-time safe.
    pub fn effective_deg(&mut self, angle_deg: f64) -> f64 {
        if self.left == 0.0 {
            return angle_deg;
        }
        let turned_deg = (angle_deg - self.from_deg).abs();
        let way_deg = self.shift_deg.abs();
        let way_deg = if angle_deg < self.from_deg { way_deg.min(self.from_deg) } else { way_deg };
        let left = 1.0 - turned_deg / way_deg;
        // Not a number leaves nothing.
        self.left = if left > 0.0 { self.left.min(left) } else { 0.0 };
        angle_deg + self.left * self.shift_deg
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_towards_the_own_angle_is_level_and_the_other_way_twice_as_steep() {
        for (from, own) in [(150.0, 190.0), (150.0, 110.0)] {
            let towards = if own > from { 1.0 } else { -1.0 };
            let mut carry = Carry::new(from, own);
            for turned in [0.0, 10.0, 25.0, 40.0] {
                assert!((carry.effective_deg(from + towards * turned) - own).abs() < 1e-9, "{turned}");
            }
            assert_eq!(carry.effective_deg(from), from, "what has been made up stays made up");
            let mut carry = Carry::new(from, own);
            let back = carry.effective_deg(from - towards * 10.0);
            assert!((back - (own - towards * 20.0)).abs() < 1e-9, "{back}");
        }
    }

    #[test]
    fn rest_is_rest_and_nonsense_is_nothing() {
        for (from, own) in [(20.0, 90.0), (20.0, 5.0), (1.5, 400.0)] {
            let mut carry = Carry::new(from, own);
            let mut before = f64::INFINITY;
            for step in (0..=200).rev() {
                let now = carry.effective_deg(from * f64::from(step) / 200.0);
                assert!(now <= before + 1e-9 && now >= 0.0, "{from} {own}: {now} after {before}");
                before = now;
            }
            assert_eq!(before, 0.0);
        }
        for (from, own) in
            [(0.0, 30.0), (50.0, f64::NAN), (50.0, f64::INFINITY), (f64::NAN, 30.0), (50.0, 50.0)]
        {
            assert_eq!(Carry::new(from, own).effective_deg(70.0), 70.0, "{from} {own}");
        }
        let mut carry = Carry::new(100.0, 130.0);
        assert!(carry.effective_deg(f64::NAN).is_nan());
        assert_eq!(carry.effective_deg(100.0), 100.0);
    }
}
