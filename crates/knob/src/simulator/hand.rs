//! A hand that turns the knob: fingers as a spring and a damper between where they want the knob and where it is.
//!
//! The form is that of Hasser and Cutkosky (2002), who found a second-order model to describe a pinch grip on a knob, with
//! stiffness and damping rising with the grip; of their paper only the abstract was read, so the values are our own
//! judgement: a fingertip gives some 200 to 300 N/m sideways, two of them on a radius of 35 mm make 0.5 N m/rad, and
//! 0.01 N m s/rad damps knob and fingers a little below critically, as hands do. Left out: the inertia of the fingers
//! (below that of the knob), and letting go when the torque hurts.
//!
//! A player also *listens*: with `correction_per_s` the aim is moved, after a reaction time, until the knob is where it
//! was wanted. Without it the hand sags under torque by torque over stiffness.

use crate::simulator::plant::{HandPull, LOOP_HZ};
use crate::simulator::script::{Aim, Script};
use fastrand::Rng;
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// Sines that make up the tremor.
const TREMOR_SINES: usize = 6;

/// Band of the physiological tremor of hand and fingers, Hz.
const TREMOR_HZ: (f64, f64) = (8.0, 12.0);

/// How far the ear moves the aim at most, degrees. Judgement: further and a player would grip again.
const CORRECTION_MAX_DEG: f64 = 120.0;

/// How fast an aim given by [`SimulatedHand::aim`] is approached, degrees per second. Judgement: a hand, not a step.
const REACH_DEG_PER_S: f64 = 360.0;

/// What a hand is like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandDesign {
    /// Spring between fingers and knob, N m/rad.
    pub stiffness_nm_per_rad: f64,
    /// Damping between fingers and knob, N m s/rad.
    pub damping_nms: f64,
    /// Tremor of the aim, degrees rms.
    pub tremor_deg: f64,
    /// How fast the ear corrects the aim, 1/s; 0 is a deaf hand. Must stay well below 1 / `reaction_s`.
    pub correction_per_s: f64,
    /// Delay before a correction, s.
    pub reaction_s: f64,
    /// Most torque of the fingers, N m.
    pub most_nm: f64,
}

impl Default for HandDesign {
    fn default() -> Self {
        Self {
            stiffness_nm_per_rad: 0.5,
            damping_nms: 0.01,
            tremor_deg: 0.1,
            correction_per_s: 0.0,
            reaction_s: 0.15,
            most_nm: 1.0,
        }
    }
}

impl HandDesign {
    /// A hand that listens: corrects within about half a second, reaction time of a practised player.
    pub fn listening() -> Self {
        Self { correction_per_s: 2.0, ..Self::default() }
    }
}

/// What leads the hand.
#[derive(Clone, Debug)]
enum Lead {
    /// Nobody holds the knob.
    Nobody,
    /// A script; its clock starts at `start_s`, or waits for the device being armed.
    Script { script: Box<Script>, start_s: Option<f64>, waits_for_arm: bool },
    /// An aim from outside; an angle is approached at a hand's speed.
    Aim { aim: Aim, at_deg: f64 },
}

/// A hand at work.
#[derive(Clone, Debug)]
pub struct SimulatedHand {
    design: HandDesign,
    lead: Lead,
    /// Frequency, Hz, and phase of each sine of the tremor.
    tremor: [(f64, f64); TREMOR_SINES],
    /// Wanted and actual angle of the last `reaction_s`, degrees.
    seen: VecDeque<(f64, f64)>,
    correction_deg: f64,
    /// Where the fingers were at the end of the last period, degrees; none while they are off the knob.
    fingers_deg: Option<f64>,
    button: bool,
}

impl SimulatedHand {
    /// No hand; [`SimulatedHand::follow`] or [`SimulatedHand::aim`] takes hold. The same seed trembles alike.
    pub fn new(design: HandDesign, seed: u64) -> Self {
        let mut rng = Rng::with_seed(seed ^ 0x7472_656d_6f72);
        let (low, high) = TREMOR_HZ;
        let tremor = std::array::from_fn(|_| (low + (high - low) * rng.f64(), TAU * rng.f64()));
        Self {
            design,
            lead: Lead::Nobody,
            tremor,
            seen: VecDeque::new(),
            correction_deg: 0.0,
            fingers_deg: None,
            button: false,
        }
    }

    /// Follows a script from now on.
    pub fn follow(&mut self, script: Script) {
        self.lead = Lead::Script { script: Box::new(script), start_s: None, waits_for_arm: false };
    }

    /// Stays at the first row of the script until the device is armed, then follows it.
    pub fn follow_once_armed(&mut self, script: Script) {
        self.lead = Lead::Script { script: Box::new(script), start_s: None, waits_for_arm: true };
    }

    /// Takes hold and wants this from now on. An angle is approached at 360 degrees a second.
    pub fn aim(&mut self, aim: Aim) {
        match (&mut self.lead, aim) {
            (Lead::Aim { aim: old @ Aim::Angle(_), .. }, Aim::Angle(_)) => *old = aim,
            _ => self.lead = Lead::Aim { aim, at_deg: f64::NAN },
        }
    }

    /// Lets go.
    pub fn release(&mut self) {
        self.lead = Lead::Nobody;
    }

    /// Whether the button is held down.
    pub fn button(&self) -> bool {
        self.button
    }

    /// What the hand does in the period that begins at `t_s`.
    pub fn pull(&mut self, t_s: f64, angle_rad: f64, is_armed: bool) -> HandPull {
        let angle_deg = angle_rad.to_degrees();
        let period_s = 1.0 / f64::from(LOOP_HZ);
        let (aim, grip_unit) = match &mut self.lead {
            Lead::Nobody => (Aim::Force(0.0), 0.0),
            Lead::Script { script, start_s, waits_for_arm } => {
                if start_s.is_none() && (is_armed || !*waits_for_arm) {
                    *start_s = Some(t_s);
                }
                let moment = script.at(start_s.map_or(0.0, |start_s| t_s + period_s - start_s));
                self.button = moment.button;
                (moment.aim, moment.grip_unit)
            }
            Lead::Aim { aim: Aim::Angle(wanted), at_deg } => {
                let from = if at_deg.is_nan() { angle_deg } else { *at_deg };
                let reach = REACH_DEG_PER_S * period_s;
                *at_deg = from + (*wanted - from).clamp(-reach, reach);
                (Aim::Angle(*at_deg), 1.0)
            }
            Lead::Aim { aim, .. } => (*aim, 1.0),
        };
        if grip_unit <= 0.0 {
            self.fingers_deg = None;
            self.forget();
            return HandPull::default();
        }
        let damping_nms = grip_unit * self.design.damping_nms;
        match aim {
            Aim::Force(mnm) => {
                self.fingers_deg = None;
                self.forget();
                let torque_nm = grip_unit * mnm / 1000.0;
                HandPull { damping_nms, torque_nm, most_nm: self.design.most_nm, ..HandPull::default() }
            }
            Aim::Angle(wanted_deg) => {
                self.listen(wanted_deg, angle_deg, period_s);
                let to_deg = wanted_deg + self.correction_deg + self.tremor_deg(t_s + period_s);
                let from_deg = self.fingers_deg.unwrap_or(to_deg);
                self.fingers_deg = Some(to_deg);
                let (from_rad, to_rad) = (from_deg.to_radians(), to_deg.to_radians());
                HandPull {
                    from_rad,
                    to_rad,
                    stiffness_nm_per_rad: grip_unit * self.design.stiffness_nm_per_rad,
                    damping_nms,
                    speed_rads: (to_rad - from_rad) / period_s,
                    torque_nm: 0.0,
                    most_nm: self.design.most_nm,
                }
            }
        }
    }

    fn forget(&mut self) {
        self.seen.clear();
        self.correction_deg = 0.0;
    }

    fn listen(&mut self, wanted_deg: f64, angle_deg: f64, period_s: f64) {
        if self.design.correction_per_s <= 0.0 {
            return;
        }
        self.seen.push_back((wanted_deg, angle_deg));
        let delay = (self.design.reaction_s / period_s) as usize;
        while self.seen.len() > delay {
            // PANIC: the loop's condition leaves at least one.
            let (wanted, actual) = self.seen.pop_front().unwrap();
            self.correction_deg += self.design.correction_per_s * period_s * (wanted - actual);
        }
        self.correction_deg = self.correction_deg.clamp(-CORRECTION_MAX_DEG, CORRECTION_MAX_DEG);
    }

    fn tremor_deg(&self, t_s: f64) -> f64 {
        let peak = self.design.tremor_deg * (2.0 / TREMOR_SINES as f64).sqrt();
        self.tremor.iter().map(|(hz, phase)| peak * (TAU * hz * t_s + phase).sin()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::plant::{Plant, PlantDesign};

    /// Angles, degrees, one per period, of a knob whose motor pulls with a constant torque.
    fn held(hand: &mut SimulatedHand, motor_nm: f64, seconds: f64) -> Vec<f64> {
        let mut plant = Plant::new(PlantDesign::default(), 1);
        (0..(seconds * f64::from(LOOP_HZ)) as u32)
            .map(|tick| {
                let pull = hand.pull(f64::from(tick) / f64::from(LOOP_HZ), plant.angle_rad(), false);
                plant.advance(Some(motor_nm), &pull);
                plant.angle_rad().to_degrees()
            })
            .collect()
    }

    fn mean(x: &[f64]) -> f64 {
        x.iter().sum::<f64>() / x.len() as f64
    }

    #[test]
    fn deaf_hand_sags_by_torque_over_stiffness_and_a_listening_one_does_not() {
        let still = HandDesign { tremor_deg: 0.0, ..HandDesign::default() };
        let motor_nm = -20.0 / 208.0; // a whole number of the board's steps
        let sag_deg = (motor_nm / still.stiffness_nm_per_rad).to_degrees();
        let friction_deg = (PlantDesign::default().static_nm / still.stiffness_nm_per_rad).to_degrees();
        for (correction_per_s, expected) in [(0.0, 90.0 + sag_deg), (2.0, 90.0)] {
            let mut hand = SimulatedHand::new(HandDesign { correction_per_s, ..still }, 1);
            hand.aim(Aim::Angle(90.0));
            let angles = held(&mut hand, motor_nm, 8.0);
            let end = mean(&angles[angles.len() - 1000..]);
            assert!((end - expected).abs() <= friction_deg, "{end} for {expected} +- {friction_deg}");
        }
    }

    #[test]
    fn tremor_lies_in_its_band_with_its_strength() {
        let hand = SimulatedHand::new(HandDesign { tremor_deg: 0.3, ..HandDesign::default() }, 5);
        let seconds = 40.0;
        let x: Vec<f64> = (0..40_000).map(|ms| hand.tremor_deg(f64::from(ms) / 1000.0)).collect();
        let rms = mean(&x.iter().map(|x| x * x).collect::<Vec<_>>()).sqrt();
        assert!((rms / 0.3 - 1.0).abs() < 0.1, "{rms}");
        let upwards = x.windows(2).filter(|w| w[0] < 0.0 && w[1] >= 0.0).count() as f64 / seconds;
        assert!((8.0..=12.0).contains(&upwards), "{upwards} Hz");
    }

    #[test]
    fn script_waits_for_the_device_being_armed() {
        let mut hand = SimulatedHand::new(HandDesign { tremor_deg: 0.0, ..HandDesign::default() }, 1);
        hand.follow_once_armed(Script::parse_crescendo("0:100:1").unwrap());
        let target = |hand: &mut SimulatedHand, t_s, armed| hand.pull(t_s, 0.0, armed).to_rad.to_degrees();
        assert_eq!(target(&mut hand, 5.0, false), 0.0);
        assert!(target(&mut hand, 6.0, true).abs() < 0.1);
        let later = target(&mut hand, 6.6, true);
        assert!((later - 50.0).abs() < 0.2, "{later}");
    }

    #[test]
    fn open_hand_does_nothing() {
        let mut hand = SimulatedHand::new(HandDesign::default(), 1);
        assert_eq!(hand.pull(0.0, 1.0, true), HandPull::default());
        hand.aim(Aim::Angle(10.0));
        assert_ne!(hand.pull(0.0, 1.0, true), HandPull::default());
        hand.release();
        assert_eq!(hand.pull(0.0, 1.0, true), HandPull::default());
    }
}
