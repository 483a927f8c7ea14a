//! Where several players sit, and how each of them is heard from the places of *Position*.
//!
//! They sit on an arc around a point two metres before the first one, and look at that point. So each has a direction and a distance of
//! its own to each place: from the front it sounds otherwise than from the side, and who is nearer is louder. That takes the place of the
//! pan, which only turns between the channels.
//!
//! Left out: the time that sound takes longer to the farther of the two places.

use crate::instrument::listening::{Listening, ListeningMode};
use crate::maths;

/// Radius of the arc, m: chairs of a quintet around its stands (by judgement).
const ARC_M: f64 = 2.0;
/// Nearest that a place can be to a player, m: as near as [`Listening`] lets one come.
const NEAREST_M: f64 = 0.2;

/// A player's chair. The first player's, by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Chair {
    /// Angle on the arc from the first player to its right, rad.
    along_rad: f64,
}

impl Chair {
    /// Of a place between left (-1) and right (1), see [`Person::seat`](super::person::Person::seat).
    pub fn new(seat: f32) -> Self {
        Self { along_rad: maths::asin(f64::from(seat.clamp(-1.0, 1.0))) }
    }

    /// Distance, m, and angle, rad, of the left (`side` -1), right (1) or middle (0) place from here, as [`Listening`] has them.
    fn place(&self, listening: &Listening, side: f64) -> (f64, f64) {
        let angle =
            (f64::from(listening.angle_deg) + 0.5 * side * f64::from(listening.width_deg)).to_radians();
        let distance_m = f64::from(listening.distance_m);
        let (sine, cosine) = maths::sin_cos(self.along_rad);
        let forward = distance_m * maths::cos(angle) - ARC_M * (1.0 - cosine);
        let across = distance_m * maths::sin(angle) - ARC_M * sine;
        (maths::hypot(forward, across).max(NEAREST_M), maths::atan2(across, forward) + self.along_rad)
    }

    /// The same way of listening as this player needs it. Real-time safe.
    pub fn listening(&self, listening: &Listening) -> Listening {
        if listening.mode != ListeningMode::Position || self.along_rad == 0.0 {
            return *listening;
        }
        let [(_, left), (_, right)] = [-1.0, 1.0].map(|side| self.place(listening, side));
        let width = wrapped(right - left);
        // Behind the places left is right: such a player is heard from between them.
        let (width, middle) = (width.max(0.0), wrapped(left + 0.5 * width));
        Listening {
            distance_m: self.place(listening, 0.0).0 as f32,
            angle_deg: middle.to_degrees() as f32,
            width_deg: width.to_degrees() as f32,
            ..*listening
        }
    }

    /// How loud this player is at the left and the right place, over the first player. Real-time safe.
    pub fn gains(&self, listening: &Listening) -> [f32; 2] {
        if self.along_rad == 0.0 {
            return [1.0; 2];
        }
        [-1.0, 1.0].map(|side| (f64::from(listening.distance_m) / self.place(listening, side).0) as f32)
    }
}

/// The same angle in -pi..=pi.
fn wrapped(angle_rad: f64) -> f64 {
    let (sine, cosine) = maths::sin_cos(angle_rad);
    maths::atan2(sine, cosine)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERE: Listening = Listening {
        mode: ListeningMode::Position,
        distance_m: 2.0,
        angle_deg: 0.0,
        height_m: 0.0,
        width_deg: 0.0,
    };

    #[test]
    fn from_the_middle_of_the_arc_all_are_as_far_and_look_at_you() {
        for seat in [-1.0, -0.7, -0.2, 0.0, 0.4, 1.0] {
            let chair = Chair::new(seat);
            let heard = chair.listening(&HERE);
            assert!((heard.distance_m - 2.0).abs() < 1e-5 && heard.angle_deg.abs() < 1e-3, "{heard:?}");
            assert!(chair.gains(&HERE).iter().all(|gain| (gain - 1.0).abs() < 1e-6));
        }
    }

    #[test]
    fn the_first_player_is_heard_as_a_lone_one_to_the_bit() {
        let here = Listening { angle_deg: 37.0, width_deg: 55.0, distance_m: 0.7, ..HERE };
        assert_eq!(Chair::new(0.0).listening(&here), here);
        assert_eq!(Chair::new(0.0).gains(&here), [1.0, 1.0]);
        let everywhere = Listening::default();
        assert_eq!(Chair::new(0.6).listening(&everywhere), everywhere);
    }

    #[test]
    fn who_sits_at_the_right_is_louder_there_and_the_arc_is_symmetric() {
        let here = Listening { distance_m: 1.0, width_deg: 60.0, ..HERE };
        for seat in [0.1, 0.5, 1.0] {
            let [right, left] = [seat, -seat].map(|seat| Chair::new(seat).gains(&here));
            assert!(right[1] > right[0], "{right:?}");
            assert!((right[0] - left[1]).abs() < 1e-6 && (right[1] - left[0]).abs() < 1e-6);
            let [right, left] = [seat, -seat].map(|seat| Chair::new(seat).listening(&here));
            assert!((right.angle_deg + left.angle_deg).abs() < 1e-4 && right.distance_m == left.distance_m);
        }
    }

    #[test]
    fn the_places_are_where_they_are_for_every_player() {
        // The distance of each player to a place, by hand: on the arc at 30 degrees, place 3 m before the first.
        let here = Listening { distance_m: 3.0, ..HERE };
        let heard = Chair::new(0.5).listening(&here);
        let (forward, across) = (3.0 - 2.0 * (1.0 - 30.0_f64.to_radians().cos()), 1.0_f64);
        assert!((f64::from(heard.distance_m) - forward.hypot(across)).abs() < 1e-6);
        // It looks at the middle of the arc, 2 m before the first, and the place lies farther: to its right.
        assert!((f64::from(heard.angle_deg) - (30.0 - (across / forward).atan().to_degrees())).abs() < 1e-4);
    }
}
