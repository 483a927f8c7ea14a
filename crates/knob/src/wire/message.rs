//! The messages of TTLink 1 as values. Offsets, units and ranges: `docs/protocol.md`.

use crate::wire::codes::{FaultCode, RefusedCode};
use crate::wire::plain_text::plain;
use chalumeau_core::haptics::TorqueLimits;
use chalumeau_core::haptics::feel_parameters::HARD_CEILING_MNM;
pub use chalumeau_core::haptics::{Feel, TorqueLaw};

/// What a permission answers: it dates ARM and ALIVE by the knob's own clock, so that the knob can refuse an old one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stamp {
    /// The knob's count of disarmings, as the host last heard it in STATE.
    pub epoch: u16,
    /// The knob's clock, microseconds, as the host last heard it in STATE.
    pub heard_us: u32,
}

/// Content of ARM and of ALIVE.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arm {
    /// Session of HELLO.
    pub session: u32,
    /// Most torque the user allows, mNm, 0..=450.
    pub ceiling_mnm: u16,
    /// Absent in TTLink 1.0.
    pub stamp: Option<Stamp>,
}

/// What a device can do, see INFO. `docs/protocol.md` lists all bits; those that the program uses have names here.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Capabilities(pub u16);

impl Capabilities {
    /// Knows the flow law.
    pub const FLOW: u16 = 1;
    /// Knows the pressure law.
    pub const PRESSURE: u16 = 1 << 1;
    /// Has a slap region.
    pub const SLAP: u16 = 1 << 2;
    /// Has marks at the threshold.
    pub const DETENT: u16 = 1 << 3;
    /// Has a button.
    pub const BUTTON: u16 = 1 << 4;
    /// Has a motor.
    pub const MOTOR: u16 = 1 << 5;
    /// Is a simulation.
    pub const SIMULATED: u16 = 1 << 6;
    /// Its damping, signs and torque per count were measured (since TTLink 1.1).
    pub const CALIBRATED: u16 = 1 << 7;

    /// Whether all of `bits` are set.
    pub fn has(self, bits: u16) -> bool {
        self.0 & bits == bits
    }
}

/// What a device has counted since its start; each stops at 65535.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Turns of its loop that came too late.
    pub overruns: u16,
    /// Exchanges with its motor board that failed.
    pub bus_errors: u16,
}

/// Message INFO: the device describes itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Info {
    /// Version of the protocol.
    pub major: u8,
    /// Version of the protocol.
    pub minor: u8,
    /// What it can do.
    pub capabilities: Capabilities,
    /// Version of the firmware: major, minor, patch.
    pub firmware: (u8, u8, u16),
    /// UTF-8, padded with zeros.
    pub name: [u8; 16],
    /// Identity of the device, never 0.
    pub serial: u64,
    /// Counts per turn of its encoder.
    pub counts_per_turn: u32,
    /// Rate of the haptic loop, Hz.
    pub loop_hz: u16,
    /// Silence after which torque begins to fade, ms.
    pub watchdog_ms: u16,
    /// Length of the fade, ms.
    pub fade_ms: u16,
    /// Most torque it will ever make, mNm.
    pub ceiling_mnm: u16,
    /// Session of the HELLO answered.
    pub session: u32,
    /// Steepest restoring slope it accepts, 0.001 N m/rad.
    pub stiffness_limit: u16,
    /// Steepest positive-feedback slope it accepts, 0.001 N m/rad.
    pub push_limit: u16,
    /// Absent in TTLink 1.0.
    pub counters: Option<Counters>,
}

/// Most torque that a device of TTLink 1.0 is asked for, mNm: it cannot tell an old permission from a new one, so that a
/// late or repeated ARM may arm it. A finger holds this much (judgement).
pub const UNDATED_CEILING_MNM: u16 = 50;
/// Most torque that a device is asked for whose motor nobody has measured, mNm: what it says of its torque is a guess. This project's firmware
/// then declares no more by itself; the host holds to it whatever is declared.
pub const UNCALIBRATED_CEILING_MNM: u16 = 50;

impl Info {
    /// A name as INFO carries it: cut at the last whole character that fits 16 bytes.
    pub fn name_bytes(name: &str) -> [u8; 16] {
        let mut bytes = [0; 16];
        let length = (0..=bytes.len()).rev().find(|&at| name.is_char_boundary(at)).unwrap_or(0);
        bytes[..length].copy_from_slice(&name.as_bytes()[..length]);
        bytes
    }

    /// The name up to its padding, without control characters; bytes that are no UTF-8 show as replacement characters.
    /// Allocates.
    pub fn name_text(&self) -> String {
        let length = self.name.iter().position(|&byte| byte == 0).unwrap_or(self.name.len());
        plain(&String::from_utf8_lossy(&self.name[..length]))
    }

    /// Whether the device checks the age of a permission.
    pub fn checks_age(&self) -> bool {
        self.minor >= 1
    }

    /// Most torque that this device may be asked for, mNm.
    pub fn most_mnm(&self) -> u16 {
        let dated_mnm = if self.checks_age() { HARD_CEILING_MNM } else { UNDATED_CEILING_MNM };
        let calibrated_mnm = if self.is_calibrated() { HARD_CEILING_MNM } else { UNCALIBRATED_CEILING_MNM };
        self.ceiling_mnm.min(dated_mnm).min(calibrated_mnm)
    }

    /// Whether somebody has measured the motor: its signs, its damping and its torque per count.
    pub fn is_calibrated(&self) -> bool {
        self.capabilities.has(Capabilities::CALIBRATED)
    }

    /// The limits a feel must keep on this device, under a ceiling of `allowed_mnm` that the user allows.
    pub fn torque_limits(&self, allowed_mnm: u16) -> TorqueLimits {
        TorqueLimits {
            ceiling_mnm: f64::from(self.most_mnm().min(allowed_mnm)),
            stiffness_nm_per_rad: 1e-3 * f64::from(self.stiffness_limit),
            push_nm_per_rad: 1e-3 * f64::from(self.push_limit),
        }
    }

    /// Whether this device may be armed by a host of this version.
    pub fn speaks_our_major(&self) -> bool {
        self.major == crate::wire::MAJOR
    }
}

/// Flags of STATE. `docs/protocol.md` lists all bits; those that the program uses have names here.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags(pub u16);

impl Flags {
    /// Torque is allowed.
    pub const ARMED: u16 = 1;
    /// A fault stands.
    pub const FAULT: u16 = 1 << 2;
    /// The knob is in the slap region.
    pub const SLAP: u16 = 1 << 3;
    /// The button is down.
    pub const BUTTON: u16 = 1 << 4;
    /// Torque fades.
    pub const FADING: u16 = 1 << 5;
    /// The knob probes its signs before it arms (since TTLink 1.1).
    pub const PROBING: u16 = 1 << 8;

    /// Whether all of `bits` are set.
    pub fn has(self, bits: u16) -> bool {
        self.0 & bits == bits
    }

    /// These flags with `bits` switched on or off.
    #[must_use]
    pub fn with(self, bits: u16, on: bool) -> Self {
        Self(if on { self.0 | bits } else { self.0 & !bits })
    }

    /// Whether torque is allowed.
    pub fn armed(self) -> bool {
        self.has(Self::ARMED)
    }

    /// Whether a fault stands.
    pub fn fault(self) -> bool {
        self.has(Self::FAULT)
    }

    /// Whether the button is down.
    pub fn button(self) -> bool {
        self.has(Self::BUTTON)
    }
}

/// Message STATE: position, speed, torque and flags of the knob.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeviceState {
    /// Device clock, microseconds; wraps.
    pub t_us: u32,
    /// Angle from zero, 0.01 degrees.
    pub angle: i32,
    /// Speed, 0.1 rpm.
    pub velocity: i16,
    /// Torque command after all limits, mNm.
    pub torque: i16,
    /// See [`Flags`].
    pub flags: Flags,
    /// Number of the last FEEL accepted.
    pub feel_id: u8,
    /// Counter of slaps.
    pub slaps: u8,
    /// Counter of the last EVENT.
    pub events: u8,
    /// Code of the present fault; 0 if there is none.
    pub fault: u8,
    /// Count of disarmings; absent in TTLink 1.0.
    pub epoch: Option<u16>,
}

impl DeviceState {
    /// Angle from zero, degrees.
    pub fn angle_deg(&self) -> f64 {
        0.01 * f64::from(self.angle)
    }

    /// The present fault; `None` without a fault, or if this version does not know its code.
    pub fn fault_code(&self) -> Option<FaultCode> {
        FaultCode::from_u8(self.fault)
    }
}

/// Kinds of EVENT.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum EventKind {
    /// The knob went through the slap region; value: peak speed, rad/s.
    Slap = 1,
    /// Value: 1 down, 0 up.
    Button = 2,
    /// Torque was limited; value: torque wanted, mNm.
    Limit = 3,
    /// A fault.
    Fault = 4,
    /// A request was refused; value: the number refused.
    Refused = 5,
    /// The knob disarmed.
    Disarmed = 6,
}

/// Message EVENT: something happened on the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceEvent {
    /// Kind of event.
    pub kind: EventKind,
    /// Counts events, modulo 256; a gap shows a lost event.
    pub counter: u8,
    /// Depends on the kind; see `docs/protocol.md`.
    pub code: u8,
    /// Number of the FEEL refused, otherwise of the FEEL in force.
    pub feel_id: u8,
    /// Device clock, microseconds.
    pub t_us: u32,
    /// See [`EventKind`].
    pub value: f32,
}

impl DeviceEvent {
    /// The code as a sentence for people; `None` where the kind has no codes.
    pub fn code_text(&self) -> Option<&'static str> {
        let unknown = "for a reason that this version does not know";
        match self.kind {
            EventKind::Fault | EventKind::Disarmed => {
                Some(FaultCode::from_u8(self.code).map_or(unknown, FaultCode::text))
            }
            EventKind::Refused => Some(RefusedCode::from_u8(self.code).map_or(unknown, RefusedCode::text)),
            EventKind::Slap | EventKind::Button | EventKind::Limit => None,
        }
    }
}

/// A message of either direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Message {
    /// HELLO: the host has opened the line.
    Hello {
        /// Version of the protocol.
        major: u8,
        /// Version of the protocol.
        minor: u8,
        /// Chosen at random for this opening.
        session: u32,
    },
    /// FEEL: all parameters of the torque.
    Feel(Feel),
    /// ARM: the user allows torque.
    Arm(Arm),
    /// ALIVE: the host is running.
    Alive(Arm),
    /// FREE: torque off.
    Free,
    /// ZERO: the new angle of the present position, 0.01 degrees.
    Zero(i32),
    /// RATE: how often the device sends STATE, Hz.
    Rate(u16),
    /// BYE: the host closes the line.
    Bye {
        /// Session of HELLO.
        session: u32,
    },
    /// INFO: the answer to HELLO.
    Info(Info),
    /// STATE: position of the knob.
    State(DeviceState),
    /// EVENT: something happened.
    Event(DeviceEvent),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_cut_between_characters() {
        let info = |name: &str| Info {
            major: 1,
            minor: 0,
            capabilities: Capabilities(Capabilities::FLOW),
            firmware: (0, 1, 0),
            name: Info::name_bytes(name),
            serial: 1,
            counts_per_turn: 3_600,
            loop_hz: 2_000,
            watchdog_ms: 80,
            fade_ms: 50,
            ceiling_mnm: 450,
            session: 0,
            stiffness_limit: 0,
            push_limit: 0,
            counters: None,
        };
        assert_eq!(info("TorqueTuner").name_text(), "TorqueTuner");
        assert_eq!(info("exactly 16 bytes").name_text(), "exactly 16 bytes");
        assert_eq!(info("fifteen bytes, \u{e9}").name_text(), "fifteen bytes, ");
        assert_eq!(info("").name_text(), "");
    }

    #[test]
    fn flags_are_switched_one_by_one() {
        let flags = Flags::default().with(Flags::ARMED, true).with(Flags::BUTTON, true);
        assert!(flags.armed() && flags.button() && !flags.fault());
        assert_eq!(flags.with(Flags::ARMED, false), Flags(Flags::BUTTON));
    }
}
