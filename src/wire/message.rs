//! The messages of TTLink 1 as values. Offsets, units and ranges: `docs/protocol.md`.

use std::borrow::Cow;

use crate::wire::codes::{FaultCode, RefusedCode};
use crate::wire::limits::{self, OutOfRange};

/// Which torque law the knob follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Law {
    /// No torque but friction and damping.
    #[default]
    Free = 0,
    /// The seed's flow: rises to the threshold, falls to nothing at closure.
    Flow = 1,
    /// A spring with a step at the threshold: easy to hold.
    Pressure = 2,
}

/// The whole state of the feel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feel {
    /// Echoed by STATE once accepted.
    pub feel_id: u8,
    /// Torque law.
    pub law: Law,
    /// Time in which the old torque gives way to the new, ms, 20..=1000.
    pub morph_ms: u16,
    /// The seed's H, rest opening, 0.5..=10.
    pub h: f32,
    /// The seed's k, stiffness, 0.01..=20.
    pub k: f32,
    /// Torque per unit of flow (flow law) or at closure (pressure law), mNm, 0..=450.
    pub scale_mnm: f32,
    /// Closure of H k = 1 lies at 360 / stretch degrees; 0.1..=30.
    pub stretch: f32,
    /// Where the law's origin lies, degrees, -360..=360.
    pub offset_deg: f32,
    /// Felt threshold, degrees, 0..=3600.
    pub a_on_deg: f32,
    /// Felt extinction, degrees, 0..=36000.
    pub a_off_deg: f32,
    /// Where the reed begins to beat, degrees, 0..=3600.
    pub a_beat_deg: f32,
    /// End wall, degrees, 10..=36000.
    pub wall_deg: f32,
    /// Stiffness of the end wall, mNm per degree, 0..=100.
    pub wall_mnm_per_deg: f32,
    /// Spring of the slap region below -100 degrees, mNm per degree, 0..=20.
    pub slap_mnm_per_deg: f32,
    /// Damping on top of the knob's own, mNm s/rad, 0..=20.
    pub damping_mnms: f32,
    /// Smooth Coulomb friction, 0.1 mNm, 0..=1000.
    pub friction: u16,
    /// Height of the mark at `a_on` (flow) or of the step there (pressure), 0.1 mNm, 0..=1000.
    pub detent: u16,
}

/// No torque: law free, no friction, walls without stiffness. H and k are the seed's (H k = 1), landmarks those of its
/// lossless reed on one turn: threshold at a third of the closing angle, beating from its half.
impl Default for Feel {
    fn default() -> Self {
        Self {
            feel_id: 0,
            law: Law::Free,
            morph_ms: 50,
            h: 2.598_076,
            k: 0.384_900_18,
            scale_mnm: 0.0,
            stretch: 1.0,
            offset_deg: 0.0,
            a_on_deg: 120.0,
            a_off_deg: 360.0,
            a_beat_deg: 180.0,
            wall_deg: 400.0,
            wall_mnm_per_deg: 0.0,
            slap_mnm_per_deg: 0.0,
            damping_mnms: 0.0,
            friction: 0,
            detent: 0,
        }
    }
}

impl Feel {
    /// Whether every field lies in its range, H k among them. A device refuses more: slopes and its own ceiling.
    pub fn check(&self) -> Result<(), OutOfRange> {
        limits::MORPH_MS.check(self.morph_ms.into())?;
        limits::H.check(self.h)?;
        limits::K.check(self.k)?;
        limits::H_K.check(self.h * self.k)?;
        limits::SCALE_MNM.check(self.scale_mnm)?;
        limits::STRETCH.check(self.stretch)?;
        limits::OFFSET_DEG.check(self.offset_deg)?;
        limits::A_ON_DEG.check(self.a_on_deg)?;
        limits::A_OFF_DEG.check(self.a_off_deg)?;
        limits::A_BEAT_DEG.check(self.a_beat_deg)?;
        limits::WALL_DEG.check(self.wall_deg)?;
        limits::WALL_MNM_PER_DEG.check(self.wall_mnm_per_deg)?;
        limits::SLAP_MNM_PER_DEG.check(self.slap_mnm_per_deg)?;
        limits::DAMPING_MNMS.check(self.damping_mnms)?;
        limits::FRICTION.check(self.friction.into())?;
        limits::DETENT.check(self.detent.into())
    }
}

/// ARM and ALIVE.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arm {
    /// Session of HELLO.
    pub session: u32,
    /// Most torque the user allows, mNm, 0..=450.
    pub ceiling_mnm: u16,
}

/// What a device can do, see INFO.
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

    /// Whether all of `bits` are set.
    pub fn has(self, bits: u16) -> bool {
        self.0 & bits == bits
    }
}

/// What a device says of itself.
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
}

impl Info {
    /// A name as INFO carries it: cut at the last whole character that fits 16 bytes.
    pub fn name_bytes(name: &str) -> [u8; 16] {
        let mut bytes = [0; 16];
        let length = (0..=bytes.len()).rev().find(|&at| name.is_char_boundary(at)).unwrap_or(0);
        bytes[..length].copy_from_slice(&name.as_bytes()[..length]);
        bytes
    }

    /// The name up to its padding; bytes that are no UTF-8 show as replacement characters.
    pub fn name_text(&self) -> Cow<'_, str> {
        let length = self.name.iter().position(|&byte| byte == 0).unwrap_or(self.name.len());
        String::from_utf8_lossy(&self.name[..length])
    }

    /// Whether this device may be armed by a host of this version.
    pub fn speaks_our_major(&self) -> bool {
        self.major == crate::wire::MAJOR
    }
}

/// Flags of STATE.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags(pub u16);

impl Flags {
    /// Torque is allowed.
    pub const ARMED: u16 = 1;
    /// The last torque was limited.
    pub const LIMITED: u16 = 1 << 1;
    /// A fault stands.
    pub const FAULT: u16 = 1 << 2;
    /// The knob is in the slap region.
    pub const SLAP: u16 = 1 << 3;
    /// The button is down.
    pub const BUTTON: u16 = 1 << 4;
    /// Torque is fading out.
    pub const FADING: u16 = 1 << 5;
    /// The old feel gives way to the new.
    pub const MORPHING: u16 = 1 << 6;
    /// The continuous rating limits torque.
    pub const THERMAL: u16 = 1 << 7;

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

/// Where the knob is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    /// Device clock, microseconds; wraps.
    pub t_us: u32,
    /// 0.01 degrees since zero.
    pub angle: i32,
    /// 0.1 rpm.
    pub velocity: i16,
    /// Command after all limits, mNm.
    pub torque: i16,
    /// See [`Flags`].
    pub flags: Flags,
    /// Last FEEL accepted.
    pub feel_id: u8,
    /// Counter of slaps.
    pub slaps: u8,
    /// Counter of the last EVENT.
    pub events: u8,
    /// Standing fault, 0 none.
    pub fault: u8,
}

impl State {
    /// Angle since zero, degrees.
    pub fn angle_deg(&self) -> f64 {
        0.01 * f64::from(self.angle)
    }

    /// Velocity, rad/s.
    pub fn velocity_rad_s(&self) -> f64 {
        f64::from(self.velocity) * (0.1 * std::f64::consts::TAU / 60.0)
    }

    /// The fault that stands, if this version knows its code.
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

/// Something that happened on the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// What.
    pub kind: EventKind,
    /// Counts events, so that a lost one shows.
    pub counter: u8,
    /// See the protocol.
    pub code: u8,
    /// Of the FEEL refused, else the one in force.
    pub feel_id: u8,
    /// Device clock, microseconds.
    pub t_us: u32,
    /// See [`EventKind`].
    pub value: f32,
}

impl Event {
    /// What the code says to people; `None` where the kind has no codes.
    pub fn code_text(&self) -> Option<&'static str> {
        let unknown = "for a reason this version does not know";
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
    /// The host has opened the line.
    Hello {
        /// Version of the protocol.
        major: u8,
        /// Version of the protocol.
        minor: u8,
        /// Chosen at random for this opening.
        session: u32,
    },
    /// The whole state of the feel.
    Feel(Feel),
    /// The user allows torque.
    Arm(Arm),
    /// The host is there.
    Alive(Arm),
    /// Torque off.
    Free,
    /// What the present position shall be called, 0.01 degrees.
    Zero(i32),
    /// How often STATE comes, Hz.
    Rate(u16),
    /// The host leaves.
    Bye {
        /// Session of HELLO.
        session: u32,
    },
    /// Answer to HELLO.
    Info(Info),
    /// Where the knob is.
    State(State),
    /// Something happened.
    Event(Event),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn feel_at_rest_is_allowed_and_makes_no_torque() {
        let feel = Feel::default();
        assert_eq!(feel.check(), Ok(()));
        assert_eq!((feel.law, feel.scale_mnm, feel.wall_mnm_per_deg), (Law::Free, 0.0, 0.0));
        assert!((feel.h * feel.k - 1.0).abs() < 1e-6);
    }

    #[test]
    fn product_of_h_and_k_is_limited_though_each_is_allowed() {
        let feel = Feel { h: 10.0, k: 2.0, ..Feel::default() };
        let error = feel.check().unwrap_err();
        assert_eq!((error.field, error.value, error.high), ("h*k", 20.0, 10.0));
    }

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
