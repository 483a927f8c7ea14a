//! Five simple feels for testing a knob before any music. Each shows one thing and says what the hand should notice.
//! Their torque is far below the default ceiling (100 mNm).

use chalumeau_knob::wire::message::{Feel, TorqueLaw};

/// A test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeelTest {
    /// No torque.
    Free,
    /// A plain spring.
    Spring,
    /// A mark where a note would speak.
    Bump,
    /// A stop.
    Wall,
    /// The spring behind rest, which a tongue slap pulls against.
    Slap,
}

impl FeelTest {
    /// In the order to try them.
    pub const ALL: [Self; 5] = [Self::Free, Self::Spring, Self::Bump, Self::Wall, Self::Slap];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Free => "Free",
            Self::Spring => "Spring",
            Self::Bump => "Threshold",
            Self::Wall => "Wall",
            Self::Slap => "Slap",
        }
    }

    /// What the hand should notice.
    pub fn notice(self) -> &'static str {
        match self {
            Self::Free => {
                "Turns freely, no torque anywhere. If it pulls, its zero or its motor is not calibrated."
            }
            Self::Spring => {
                "Pushes back more the further you turn, up to 40 mNm at one turn, and returns to rest."
            }
            Self::Bump => {
                "A mark at 120 degrees, like the point where a note speaks: the torque is small before it and drops a little after it."
            }
            Self::Wall => "Free up to 90 degrees, then a soft wall. It should not buzz when you lean on it.",
            Self::Slap => {
                "Turn back beyond -100 degrees: a spring pulls forwards. Let go, and the knob snaps forwards, like a tongue slap."
            }
        }
    }

    /// What goes to the knob.
    pub fn feel(self) -> Feel {
        let plain = Feel {
            law: TorqueLaw::Pressure,
            morph_ms: 200,
            damping_mnms: 1.0,
            friction: 10,
            ..Feel::default()
        };
        match self {
            Self::Free => Feel { morph_ms: 200, ..Feel::default() },
            Self::Spring => Feel { scale_mnm: 40.0, ..plain },
            Self::Bump => {
                Feel { law: TorqueLaw::Flow, scale_mnm: 12.0, detent: 150, wall_mnm_per_deg: 1.0, ..plain }
            }
            Self::Wall => Feel { scale_mnm: 0.0, wall_deg: 90.0, wall_mnm_per_deg: 2.0, ..plain },
            Self::Slap => Feel { scale_mnm: 40.0, slap_mnm_per_deg: 0.8, ..plain },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::haptics::torque_law::{extremes, torque_mnm};
    use chalumeau_core::reed::ReedTables;

    #[test]
    fn every_test_is_a_feel_a_knob_takes_and_stays_far_below_the_first_ceiling() {
        for test in FeelTest::ALL {
            let feel = test.feel();
            feel.check().unwrap();
            assert!(extremes(&feel).torque_mnm <= 60.0, "{test:?} {:?}", extremes(&feel));
        }
    }

    #[test]
    fn each_is_what_it_says() {
        let torque = |test: FeelTest, deg: f64| torque_mnm(&test.feel(), ReedTables::reference(), deg);
        assert!((-400..400).all(|deg| torque(FeelTest::Free, f64::from(deg)) == 0.0));
        assert!((torque(FeelTest::Spring, 180.0) - 20.0).abs() < 0.5);
        assert!(torque(FeelTest::Bump, 120.0) > torque(FeelTest::Bump, 100.0) + 10.0);
        assert!(torque(FeelTest::Bump, 120.0) > torque(FeelTest::Bump, 140.0) + 10.0);
        assert!(torque(FeelTest::Wall, 80.0).abs() < 0.1 && torque(FeelTest::Wall, 100.0) > 15.0);
        assert!(torque(FeelTest::Slap, -130.0) < -15.0);
    }
}
