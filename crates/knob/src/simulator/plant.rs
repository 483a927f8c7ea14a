//! The moving parts of a TorqueTuner: knob on a motor shaft, friction, the motor board and its encoder.
//!
//! One inertia with viscous and dry friction, integrated at 32 kHz. Dry friction is an impulse that can stop the knob but
//! never turn it round; a knob at rest stays until the static torque is exceeded. The motor board holds the last torque
//! it was sent, which reaches it one period late (the bus is read and written once a period). Left out: cogging of the
//! motor (of a stepper some 10 mNm, periodic in 1.8 degrees), the current loop (kHz), play and flexing of the shaft.
//!
//! SI inside: rad, rad/s, N m, s. Nothing here was measured on hardware; each figure says where it was born.

use fastrand::Rng;
use std::f64::consts::TAU;

/// Rate of the haptic loop, Hz: one exchange with the motor board per period (TorqueTuner firmware).
pub use chalumeau_firmware::LOOP_HZ;

/// Steps of integration in a period: 32 kHz, three hundred times the fastest pole of knob and hand.
const SUBSTEPS: u32 = 16;

/// How the motor board treats silence on its bus (`firmware/motor_board/README.md`). Read from the public source of the
/// TorqueTuner's Moteus bridge and of the moteus firmware; not tried on hardware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotorBoard {
    /// As it comes: without a timeout it holds the last torque for ever.
    Stock,
    /// The stock bridge with the board's timeout switched on, and its usual mode 12. The bridge forwards a command only when
    /// it differs from the one before, so that a torque that stays the same, 0 included, times out; then the board brakes
    /// until it hears a stop command, which the bridge never sends.
    StockTimeout,
    /// The patched bridge: it forwards each command; after the timeout the motor is limp, and follows again when commands
    /// come again.
    Patched,
}

/// Silence after which a board with a timeout acts, s.
const BOARD_TIMEOUT_S: f64 = 0.1;

/// Damping of mode 12, N m s/rad: 1 N m per turn a second, as the board comes; its own limit of 5 N m is above any motor's.
const BRAKE_NMS: f64 = 0.159;

/// What a maker would measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantDesign {
    /// Knob and rotor, kg m2. Calculated: a disc of 80 g and 35 mm radius is 4.9e-5, the rotor of a NEMA 17 motor 0.5e-5
    /// to 0.8e-5 (data sheets).
    pub inertia_kgm2: f64,
    /// Viscous friction, N m s/rad; 2e-4..2e-3 is usual for such knobs.
    pub viscous_nms: f64,
    /// Dry friction of the moving knob, N m. Judgement: two small ball bearings and the hysteresis of the motor.
    pub coulomb_nm: f64,
    /// Dry friction of the resting knob, N m, at least `coulomb_nm`.
    pub static_nm: f64,
    /// Most torque of the motor, N m; 45 N cm is what the TorqueTuner's makers give.
    pub ceiling_nm: f64,
    /// Smallest step of torque the motor board knows, N m; the stock boards count 208 to the newton metre.
    pub torque_step_nm: f64,
    /// Counts of the encoder per turn as the board reports them.
    pub counts_per_turn: u32,
    /// Noise of the encoder before it is rounded, degrees rms; 0.015 is the data sheet's of a magnetic AS5047.
    pub encoder_noise_deg: f64,
    /// Corner of the board's velocity filter, Hz. Judgement: a first-order low-pass on the board's own position.
    pub velocity_filter_hz: f64,
    /// What the motor board does when the bus is silent. **The stock boards never let go**; see docs/simulator.md.
    pub board: MotorBoard,
}

impl Default for PlantDesign {
    fn default() -> Self {
        Self {
            inertia_kgm2: 6e-5,
            viscous_nms: 1e-3,
            coulomb_nm: 2e-3,
            static_nm: 3e-3,
            ceiling_nm: 0.45,
            torque_step_nm: 1.0 / 208.0,
            counts_per_turn: 3600,
            encoder_noise_deg: 0.015,
            velocity_filter_hz: 100.0,
            board: MotorBoard::Patched,
        }
    }
}

/// What a hand does to the knob during one period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HandPull {
    /// Where the fingers want the knob at the beginning, rad.
    pub from_rad: f64,
    /// Where they want it at the end, rad.
    pub to_rad: f64,
    /// Spring between fingers and knob, N m/rad.
    pub stiffness_nm_per_rad: f64,
    /// Damping between fingers and knob, N m s/rad.
    pub damping_nms: f64,
    /// Speed the damping is relative to, rad/s.
    pub speed_rads: f64,
    /// Torque on top, N m.
    pub torque_nm: f64,
    /// Most torque the fingers have, N m.
    pub most_nm: f64,
}

impl HandPull {
    fn torque_nm(&self, part: f64, angle_rad: f64, speed_rads: f64) -> f64 {
        let wanted = self.from_rad + part * (self.to_rad - self.from_rad);
        let spring = self.stiffness_nm_per_rad * (wanted - angle_rad);
        let damper = self.damping_nms * (self.speed_rads - speed_rads);
        (spring + damper + self.torque_nm).clamp(-self.most_nm, self.most_nm)
    }
}

/// The knob as it turns.
#[derive(Clone, Debug)]
pub struct Plant {
    design: PlantDesign,
    rng: Rng,
    angle_rad: f64,
    speed_rads: f64,
    /// Sent by the firmware in this period; turns the motor in the next.
    underway_nm: Option<f64>,
    motor_nm: f64,
    since_command_s: f64,
    /// The board has timed out and waits for a stop command.
    is_braking: bool,
    /// What the bridge forwarded last, N m.
    forwarded_nm: Option<f64>,
    /// Position the board saw last, in its own counts.
    board_counts: f64,
    filtered_rads: f64,
    hand_nm: f64,
}

impl Plant {
    /// A knob at rest at angle zero. The same seed gives the same noise.
    pub fn new(design: PlantDesign, seed: u64) -> Self {
        Self {
            design,
            rng: Rng::with_seed(seed),
            angle_rad: 0.0,
            speed_rads: 0.0,
            underway_nm: None,
            motor_nm: 0.0,
            since_command_s: 0.0,
            is_braking: false,
            forwarded_nm: None,
            board_counts: 0.0,
            filtered_rads: 0.0,
            hand_nm: 0.0,
        }
    }

    /// Position of the shaft, rad.
    pub fn angle_rad(&self) -> f64 {
        self.angle_rad
    }

    /// Speed of the shaft, rad/s.
    pub fn speed_rads(&self) -> f64 {
        self.speed_rads
    }

    /// Torque of the motor in the period just past, N m.
    pub fn motor_nm(&self) -> f64 {
        self.motor_nm
    }

    /// Torque of the hand at the end of the period just past, N m.
    pub fn hand_nm(&self) -> f64 {
        self.hand_nm
    }

    /// Turns the shaft to an angle and a speed, whatever it did before.
    pub fn set(&mut self, angle_rad: f64, speed_rads: f64) {
        self.angle_rad = angle_rad;
        self.speed_rads = speed_rads;
        self.board_counts = (angle_rad / TAU * BOARD_COUNTS).round();
        self.filtered_rads = speed_rads;
    }

    /// What the encoder says now, counts since the start.
    pub fn counts(&mut self) -> i64 {
        let noise_rad = self.normal() * self.design.encoder_noise_deg.to_radians();
        ((self.angle_rad + noise_rad) / TAU * f64::from(self.design.counts_per_turn)).round() as i64
    }

    /// What the board says of the speed, rpm.
    pub fn rpm(&self) -> f64 {
        self.filtered_rads * 60.0 / TAU
    }

    /// One period of the haptic loop. `command_nm` is what the firmware sent at its beginning, none if the bus failed.
    pub fn advance(&mut self, command_nm: Option<f64>, pull: &HandPull) {
        let d = self.design;
        let period_s = 1.0 / f64::from(LOOP_HZ);
        self.since_command_s += period_s;
        if let Some(arrived) = std::mem::replace(&mut self.underway_nm, command_nm) {
            let steps = if d.torque_step_nm > 0.0 {
                (arrived / d.torque_step_nm).round() * d.torque_step_nm
            } else {
                arrived
            };
            self.hear(steps.clamp(-d.ceiling_nm, d.ceiling_nm));
        }
        if self.since_command_s >= BOARD_TIMEOUT_S {
            match d.board {
                MotorBoard::Stock => {}
                MotorBoard::StockTimeout => self.is_braking = true,
                MotorBoard::Patched => self.motor_nm = 0.0,
            }
        }
        let dt = period_s / f64::from(SUBSTEPS);
        let smoothing = 1.0 - (-TAU * d.velocity_filter_hz * dt).exp();
        for step in 0..SUBSTEPS {
            let part = (f64::from(step) + 0.5) / f64::from(SUBSTEPS);
            self.hand_nm = pull.torque_nm(part, self.angle_rad, self.speed_rads);
            self.turn(dt);
            let board = (self.angle_rad / TAU * BOARD_COUNTS).round();
            let raw_rads = (board - self.board_counts) / BOARD_COUNTS * TAU / dt;
            self.board_counts = board;
            self.filtered_rads += smoothing * (raw_rads - self.filtered_rads);
        }
    }

    /// A command reaches the board's bridge.
    fn hear(&mut self, command_nm: f64) {
        let is_news = self.forwarded_nm.replace(command_nm) != Some(command_nm);
        if self.design.board == MotorBoard::Patched || is_news {
            self.since_command_s = 0.0;
            self.motor_nm = command_nm;
        }
    }

    fn turn(&mut self, dt: f64) {
        let d = &self.design;
        if self.is_braking {
            self.motor_nm = (-BRAKE_NMS * self.speed_rads).clamp(-d.ceiling_nm, d.ceiling_nm);
        }
        let driving = self.motor_nm + self.hand_nm - d.viscous_nms * self.speed_rads;
        if self.speed_rads == 0.0 && driving.abs() <= d.static_nm {
            return;
        }
        let free = self.speed_rads + driving / d.inertia_kgm2 * dt;
        let brake = d.coulomb_nm / d.inertia_kgm2 * dt;
        self.speed_rads = if free.abs() <= brake { 0.0 } else { free - brake.copysign(free) };
        self.angle_rad += self.speed_rads * dt;
    }

    /// Normal deviate, near enough: twelve uniform ones less their mean.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.rng.f64()).sum::<f64>() - 6.0
    }
}

/// Counts per turn of the board's own encoder, 14 bit; what it reports is coarser.
const BOARD_COUNTS: f64 = 16384.0;

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 1.0 / LOOP_HZ as f64;

    fn ideal() -> PlantDesign {
        PlantDesign {
            viscous_nms: 0.0,
            coulomb_nm: 0.0,
            static_nm: 0.0,
            torque_step_nm: 0.0,
            encoder_noise_deg: 0.0,
            ..PlantDesign::default()
        }
    }

    #[test]
    fn free_knob_follows_newton() {
        let mut plant = Plant::new(ideal(), 1);
        for _ in 0..201 {
            plant.advance(Some(0.01), &HandPull::default());
        }
        // The first period passes before the command arrives.
        let t = 200.0 * PERIOD_S;
        let acceleration = 0.01 / ideal().inertia_kgm2;
        assert!((plant.speed_rads() - acceleration * t).abs() < 1e-9 * acceleration);
        let angle = 0.5 * acceleration * t * t;
        assert!((plant.angle_rad() / angle - 1.0).abs() < 1e-3, "{} {angle}", plant.angle_rad());
        assert!((plant.rpm() * TAU / 60.0 / plant.speed_rads() - 1.0).abs() < 0.05, "{}", plant.rpm());
    }

    #[test]
    fn dry_friction_takes_its_work_and_stops() {
        let design = PlantDesign { coulomb_nm: 2e-3, static_nm: 3e-3, ..ideal() };
        let mut plant = Plant::new(design, 1);
        plant.set(0.0, 10.0);
        for _ in 0..2000 {
            plant.advance(Some(0.0), &HandPull::default());
        }
        let way = 0.5 * design.inertia_kgm2 * 100.0 / design.coulomb_nm;
        assert_eq!(plant.speed_rads(), 0.0);
        assert!((plant.angle_rad() / way - 1.0).abs() < 2e-3, "{} {way}", plant.angle_rad());
        let rest = plant.angle_rad();
        for _ in 0..100 {
            plant.advance(Some(2.9e-3), &HandPull::default());
        }
        assert_eq!(plant.angle_rad(), rest, "less than the static torque moves nothing");
        for _ in 0..100 {
            plant.advance(Some(3.1e-3), &HandPull::default());
        }
        assert!(plant.angle_rad() > rest);
    }

    #[test]
    fn spring_of_the_hand_swings_at_its_frequency() {
        let mut plant = Plant::new(ideal(), 1);
        plant.set(0.2, 0.0);
        let pull = HandPull { stiffness_nm_per_rad: 0.5, most_nm: 1.0, ..HandPull::default() };
        let mut crossings = Vec::new();
        for tick in 0..2000 {
            let before = plant.angle_rad();
            plant.advance(Some(0.0), &pull);
            let after = plant.angle_rad();
            if before > 0.0 && after <= 0.0 {
                crossings.push((f64::from(tick) + before / (before - after)) * PERIOD_S);
            }
        }
        let swings = crossings.len() - 1;
        let measured = swings as f64 / (crossings[swings] - crossings[0]);
        let expected = (0.5 / ideal().inertia_kgm2).sqrt() / TAU;
        assert!((measured / expected - 1.0).abs() < 1e-3, "{measured} {expected}");
    }

    #[test]
    fn motor_saturates_and_lets_go_when_the_bus_is_silent() {
        let mut plant = Plant::new(PlantDesign::default(), 1);
        let held =
            HandPull { stiffness_nm_per_rad: 10.0, damping_nms: 0.01, most_nm: 1.0, ..HandPull::default() };
        for _ in 0..10 {
            plant.advance(Some(2.0), &held);
        }
        assert_eq!(plant.motor_nm(), 0.45);
        for _ in 0..195 {
            plant.advance(None, &held);
        }
        assert_eq!(plant.motor_nm(), 0.45, "a silent bus holds the last torque");
        for _ in 0..10 {
            plant.advance(None, &held);
        }
        assert_eq!(plant.motor_nm(), 0.0, "until the board's own watchdog ends");
    }

    #[test]
    fn same_seed_gives_the_same_counts() {
        let run = |seed| {
            let mut plant =
                Plant::new(PlantDesign { encoder_noise_deg: 0.1, ..PlantDesign::default() }, seed);
            (0..100).map(|_| plant.counts()).collect::<Vec<_>>()
        };
        assert_eq!(run(7), run(7));
        assert_ne!(run(7), run(8));
    }
}
