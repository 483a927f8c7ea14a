//! Firmware, knob, hand and line put together, in simulated time: one call, one period of the 2 kHz loop.
//!
//! The order within a period is the real one: bytes that have arrived, the motor board's reading, the firmware's tick, its
//! answer on the bus (turning the motor in the next period), its bytes on the line. The same seed and the same bytes give
//! the same run to the bit.

use crate::simulator::fault::{Fault, FaultKind};
use crate::simulator::hand::SimulatedHand;
use crate::simulator::line::SimulatedLine;
use crate::simulator::plant::{LOOP_HZ, Plant, PlantDesign};
use crate::simulator::stock::{OscValue, StockFirmware};
use crate::simulator::tap::Tap;
use crate::wire::TorqueLaw;
use chalumeau_firmware::{Firmware, Reading, Setup};

/// Length of a period, us.
pub const PERIOD_US: u64 = 1_000_000 / LOOP_HZ as u64;

/// What an ESP32 says on the same line when it starts, in substance: text without a zero byte.
const BOOT_TEXT: &[u8] =
    b"\r\nrst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)\r\nentry 0x400806b4\r\n";

/// Most bytes the firmware sends in one period.
const TRANSMIT_MAX: usize = 1024;

/// Offset of the feel's number in STATE.
const STATE_FEEL_ID: usize = 14;

/// What runs on the controller.
enum Controller {
    Link(Box<Firmware>),
    Stock(Box<StockFirmware>),
    /// Starting anew.
    Absent,
}

/// A whole TorqueTuner.
pub struct SimulatedKnob {
    setup: Option<Setup>,
    is_midi: bool,
    brain: Controller,
    plant: Plant,
    hand: SimulatedHand,
    faults: Vec<Fault>,
    to_device: SimulatedLine,
    to_host: SimulatedLine,
    tap: Tap,
    tick: u64,
    booted_at_tick: u64,
    command_nm: f64,
    report: Option<[(&'static str, OscValue); 8]>,
    extra_button: bool,
}

impl SimulatedKnob {
    /// A knob with our firmware. The seed is that of noise and faults; the hand has its own.
    pub fn new(setup: Setup, plant: PlantDesign, hand: SimulatedHand, seed: u64) -> Self {
        // The firmware counts in the steps of the board that is built in.
        let mnm_per_count = (1000.0 * plant.torque_step_nm) as f32;
        let board_clips_mnm = (1000.0 * plant.ceiling_nm) as f32;
        let setup = Setup { mnm_per_count, board_clips_mnm, ..setup };
        let brain = Controller::Link(Box::new(Firmware::new(&setup)));
        Self::with_brain(brain, Some(setup), plant, hand, seed)
    }

    /// A knob with the reed firmware it is sold with; it speaks OSC only, see [`SimulatedKnob::take_report`].
    pub fn stock(plant: PlantDesign, hand: SimulatedHand, seed: u64) -> Self {
        Self::with_brain(Controller::Stock(Box::default()), None, plant, hand, seed)
    }

    fn with_brain(
        brain: Controller,
        setup: Option<Setup>,
        plant: PlantDesign,
        hand: SimulatedHand,
        seed: u64,
    ) -> Self {
        let is_midi = setup.as_ref().is_some_and(|setup| setup.midi);
        Self {
            setup,
            is_midi,
            brain,
            plant: Plant::new(plant, seed),
            hand,
            faults: Vec::new(),
            to_device: SimulatedLine::new(seed.wrapping_add(1)),
            to_host: SimulatedLine::new(seed.wrapping_add(2)),
            tap: Tap::new(is_midi),
            tick: 0,
            booted_at_tick: 0,
            command_nm: 0.0,
            report: None,
            extra_button: false,
        }
    }

    /// Adds a fault; its time counts from the start of the simulation.
    pub fn inject(&mut self, fault: Fault) {
        self.faults.push(fault);
    }

    /// Bytes from the host, at the present time.
    pub fn send(&mut self, bytes: &[u8]) {
        if !bytes.is_empty() {
            self.to_device.push(self.t_s(), &self.faults, bytes);
        }
    }

    /// Appends the bytes that have reached the host.
    pub fn receive(&mut self, into: &mut Vec<u8>) {
        self.to_host.take(self.t_s(), &self.faults, into);
    }

    /// One period: 0.5 ms.
    pub fn step(&mut self) {
        let t_s = self.t_s();
        self.start_faults(t_s);
        let bus_ok = !self.is_faulty(FaultKind::I2c);
        let pressed = self.hand.button() || self.extra_button;
        let reading = Reading {
            counts: self.plant.counts(),
            velocity_rpm: self.plant.rpm() as f32,
            bus_ok,
            supply_ok: !self.is_faulty(FaultKind::BrownOut),
            button: pressed,
            // The local stop too, as on the TorqueTuner.
            stop: pressed,
            tells_velocity: true,
        };
        let mut arrived = Vec::new();
        self.to_device.take(t_s, &self.faults, &mut arrived);
        let mut command_nm = None;
        match &mut self.brain {
            Controller::Link(firmware) => {
                self.tap.hear(&arrived);
                if self.is_midi {
                    firmware.receive_midi(&arrived);
                } else {
                    firmware.receive(&arrived);
                }
                let t_us = (self.tick - self.booted_at_tick) * PERIOD_US;
                let torque_mnm = firmware.tick(t_us, &reading);
                self.command_nm = f64::from(torque_mnm) / 1000.0;
                // In whole counts of the board.
                command_nm = Some(f64::from(firmware.command(torque_mnm)) / 1000.0);
                let mut bytes = [0; TRANSMIT_MAX];
                let length = firmware.transmit(&mut bytes);
                self.to_host.push(t_s, &self.faults, &bytes[..length]);
            }
            Controller::Stock(firmware) => {
                command_nm = Some(firmware.tick(reading.counts, self.plant.rpm(), reading.button));
                self.command_nm = command_nm.unwrap_or(0.0);
                self.report = firmware.report().or(self.report.take());
            }
            Controller::Absent => self.command_nm = 0.0,
        }
        let mut pull = self.hand.pull(t_s, self.plant.angle_rad(), self.is_armed());
        if self.is_faulty(FaultKind::OverSpeed) {
            pull = Default::default();
        }
        self.plant.advance(command_nm.filter(|_| bus_ok), &pull);
        self.tick += 1;
    }

    fn start_faults(&mut self, t_s: f64) {
        let before_s = t_s - PERIOD_US as f64 * 1e-6;
        for at in 0..self.faults.len() {
            let fault = self.faults[at];
            let (is_active, was_active) = (fault.is_active(t_s), fault.is_active(before_s));
            match fault.kind {
                FaultKind::OverSpeed if is_active && !was_active => {
                    self.plant.set(self.plant.angle_rad(), fault.strength);
                }
                FaultKind::Reboot if is_active && !was_active => {
                    self.brain = Controller::Absent;
                    self.to_device.clear();
                    if self.setup.is_some() && !self.is_midi {
                        self.to_host.push(t_s, &self.faults, BOOT_TEXT);
                    }
                }
                FaultKind::Reboot if was_active && !is_active => self.boot(),
                _ => {}
            }
        }
    }

    fn boot(&mut self) {
        self.booted_at_tick = self.tick;
        self.brain = match &self.setup {
            Some(setup) => {
                // As a real one draws it at each start.
                let epoch = setup.epoch.wrapping_add(self.booted_at_tick as u16).wrapping_add(1);
                Controller::Link(Box::new(Firmware::new(&Setup { epoch, ..setup.clone() })))
            }
            None => Controller::Stock(Box::default()),
        };
        // What arrived while nobody was there is lost.
        self.to_device.clear();
        self.tap = Tap::new(self.is_midi);
    }

    fn is_faulty(&self, kind: FaultKind) -> bool {
        let t_s = self.t_s();
        self.faults.iter().any(|fault| fault.kind == kind && fault.is_active(t_s))
    }

    /// Whether the cable is out.
    pub fn is_unplugged(&self) -> bool {
        self.is_faulty(FaultKind::Unplug)
    }

    /// Time since the start, us.
    pub fn t_us(&self) -> u64 {
        self.tick * PERIOD_US
    }

    /// Time since the start, s.
    pub fn t_s(&self) -> f64 {
        self.t_us() as f64 * 1e-6
    }

    /// Where the shaft really is, degrees.
    pub fn angle_deg(&self) -> f64 {
        self.plant.angle_rad().to_degrees()
    }

    /// How fast it really turns, rpm.
    pub fn velocity_rpm(&self) -> f64 {
        self.plant.speed_rads() * 60.0 / std::f64::consts::TAU
    }

    /// What the motor really does, mNm: a period later than the firmware said, in the board's steps, held while the bus is
    /// silent.
    pub fn motor_mnm(&self) -> f64 {
        self.plant.motor_nm() * 1000.0
    }

    /// What the firmware wanted in the last period, before the board's counts, mNm.
    pub fn command_mnm(&self) -> f64 {
        self.command_nm * 1000.0
    }

    /// What the hand does, mNm.
    pub fn hand_mnm(&self) -> f64 {
        self.plant.hand_nm() * 1000.0
    }

    /// Whether the firmware allows torque. The stock firmware always does.
    pub fn is_armed(&self) -> bool {
        match &self.brain {
            Controller::Link(firmware) => firmware.is_armed(),
            Controller::Stock(_) => true,
            Controller::Absent => false,
        }
    }

    /// Number and law of the feel in force; no law before the first FEEL.
    pub fn feel(&self) -> (u8, Option<TorqueLaw>) {
        let Controller::Link(firmware) = &self.brain else { return (0, None) };
        let feel_id = firmware.state()[STATE_FEEL_ID];
        (feel_id, self.tap.law(feel_id))
    }

    /// The fault that stands, else the one that disarmed last, as STATE says it; 0 none.
    pub fn fault(&self) -> u8 {
        match &self.brain {
            Controller::Link(firmware) => firmware.fault(),
            _ => 0,
        }
    }

    /// The report of the stock firmware that is due, once.
    pub fn take_report(&mut self) -> Option<[(&'static str, OscValue); 8]> {
        self.report.take()
    }

    /// The hand, to be told what to do.
    pub fn hand(&mut self) -> &mut SimulatedHand {
        &mut self.hand
    }

    /// The knob itself, to be put somewhere.
    pub fn plant(&mut self) -> &mut Plant {
        &mut self.plant
    }

    /// Holds the button down, or not, beside what the script says.
    pub fn press_button(&mut self, is_down: bool) {
        self.extra_button = is_down;
    }
}
