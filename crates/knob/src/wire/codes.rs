//! Codes of EVENT and STATE, with a sentence for people. A later minor version may send other codes; they stay numbers.

use std::fmt;

/// Why a device has a fault or disarmed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum FaultCode {
    /// No valid ALIVE in time.
    Watchdog = 1,
    /// Faster than 60 rad/s.
    OverSpeed = 2,
    /// Three failures of the motor's I2C in a row.
    I2c = 3,
    /// Supply too low.
    BrownOut = 4,
    /// A number was not finite.
    NotFinite = 5,
    /// FREE was received.
    Free = 6,
    /// BYE was received.
    Bye = 7,
    /// HELLO came with another session.
    NewSession = 8,
    /// Another major version.
    Version = 9,
    /// The motor board's speed contradicts the counts.
    Speed = 10,
    /// The angle jumped, or stands still while the motor board tells of motion.
    Angle = 11,
    /// The local stop was pressed.
    Stop = 12,
    /// The haptic loop is slower than the limits of the slopes assume.
    Slow = 13,
    /// The probe found that the motor turns the knob the wrong way.
    Sign = 14,
}

impl FaultCode {
    /// All of them, by number.
    pub const ALL: [Self; 14] = [
        Self::Watchdog,
        Self::OverSpeed,
        Self::I2c,
        Self::BrownOut,
        Self::NotFinite,
        Self::Free,
        Self::Bye,
        Self::NewSession,
        Self::Version,
        Self::Speed,
        Self::Angle,
        Self::Stop,
        Self::Slow,
        Self::Sign,
    ];

    /// The code of a number; `None` for 0 (no fault) and for codes of a later version.
    pub fn from_u8(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|known| *known as u8 == code)
    }

    /// The cause as a sentence for people, without capital and full stop.
    pub fn text(self) -> &'static str {
        match self {
            Self::Watchdog => "the knob no longer heard from this computer",
            Self::OverSpeed => "the knob turned faster than 60 rad/s",
            Self::I2c => "the knob's motor board does not answer",
            Self::BrownOut => "the knob's supply voltage is too low",
            Self::NotFinite => "the knob got or computed a number that is not finite",
            Self::Free => "torque was switched off",
            Self::Bye => "the program that used the knob has closed the link",
            Self::NewSession => "another program opened the knob",
            Self::Version => "the knob speaks another version of the protocol",
            Self::Speed => {
                "the motor board's speed contradicts the angle: check the sign of the speed (firmware/README.md)"
            }
            Self::Angle => "the knob's angle jumped, or stands still while the knob turns",
            Self::Stop => "the stop button at the knob was pressed",
            Self::Slow => "the knob's loop is too slow to be safe",
            Self::Sign => {
                "the motor turns the knob the wrong way: set the sign of its torque (firmware/README.md)"
            }
        }
    }
}

impl fmt::Display for FaultCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}

/// Why a device refused what it was asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum RefusedCode {
    /// H k outside its range.
    HTimesK = 1,
    /// Restoring slope beyond INFO's `stiffness_limit`.
    TooStiff = 2,
    /// Positive feedback beyond INFO's `push_limit`.
    WouldPush = 3,
    /// Scale above the ceiling.
    AboveCeiling = 4,
    /// A number was not finite.
    NotFinite = 5,
    /// A field outside its range.
    OutOfRange = 6,
    /// A law the device does not know.
    LawUnknown = 7,
    /// Not armed: a fault stands.
    FaultStands = 8,
    /// Not armed: the knob is moving.
    Moving = 9,
    /// ZERO while armed.
    ZeroWhileArmed = 10,
    /// Another session than HELLO's.
    WrongSession = 11,
    /// Another major version.
    Version = 12,
    /// ARM whose sequence number is not newer than the last; only TTLink 1.0 sends this code.
    Repeated = 13,
    /// ARM or ALIVE older than 100 ms, or of before the last disarming.
    Stale = 14,
    /// Not armed: the knob did not move when its signs were probed.
    Unmoved = 15,
}

impl RefusedCode {
    /// All of them, by number.
    pub const ALL: [Self; 15] = [
        Self::HTimesK,
        Self::TooStiff,
        Self::WouldPush,
        Self::AboveCeiling,
        Self::NotFinite,
        Self::OutOfRange,
        Self::LawUnknown,
        Self::FaultStands,
        Self::Moving,
        Self::ZeroWhileArmed,
        Self::WrongSession,
        Self::Version,
        Self::Repeated,
        Self::Stale,
        Self::Unmoved,
    ];

    /// The code of a number; `None` for codes of a later version.
    pub fn from_u8(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|known| *known as u8 == code)
    }

    /// The cause as a sentence for people, without capital and full stop.
    pub fn text(self) -> &'static str {
        match self {
            Self::HTimesK => "H times k is outside the range in which the reed closes",
            Self::TooStiff => "this feel is stiffer than the knob can hold without shaking",
            Self::WouldPush => "this feel would push the hand along harder than the knob allows",
            Self::AboveCeiling => "this feel asks for more torque than the knob allows",
            Self::NotFinite => "the knob was sent a number that is not finite",
            Self::OutOfRange => "the knob was sent a number outside its range",
            Self::LawUnknown => "the knob does not know this law of torque",
            Self::FaultStands => "not armed: the fault is still present",
            Self::Moving => "not armed: the knob is moving; hold it still or let it go",
            Self::ZeroWhileArmed => {
                "the zero position cannot be changed while the knob is armed; disarm it first"
            }
            Self::WrongSession => "another program is using the knob",
            Self::Version => "the knob speaks another version of the protocol",
            Self::Repeated => "not armed: the request came twice or out of order; arm again",
            Self::Stale => "the line to the knob is late: what reached it was older than 100 ms",
            Self::Unmoved => {
                "not armed: the knob did not move in the test of its motor; let it go, or hold it lightly, and arm again"
            }
        }
    }
}

impl fmt::Display for RefusedCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_codes_belong_together() {
        for code in 0..=255 {
            assert_eq!(FaultCode::from_u8(code).is_some(), (1..=14).contains(&code), "fault {code}");
            assert_eq!(RefusedCode::from_u8(code).is_some(), (1..=15).contains(&code), "refused {code}");
            assert!(FaultCode::from_u8(code).is_none_or(|known| known as u8 == code));
            assert!(RefusedCode::from_u8(code).is_none_or(|known| known as u8 == code));
        }
    }
}
