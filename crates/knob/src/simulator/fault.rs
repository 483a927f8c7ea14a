//! What can go wrong between host and knob and inside the knob, on purpose and at a given time.
//!
//! Written `KIND@AT[:SECONDS[=STRENGTH]]`, for example `corrupt@3:2` or `delay@1:5=30`. Faults of the line change the
//! bytes of both directions; the others change what the firmware sees or whether it runs at all.

use std::str::FromStr;

/// Why a fault was refused.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum FaultError {
    /// Not the form of a fault.
    #[error("a fault is KIND@AT[:SECONDS[=STRENGTH]] in seconds, for example corrupt@3:2; got {0:?}")]
    Form(String),
    /// No such fault.
    #[error("no fault is called {given:?}; there are {}", names())]
    Kind {
        /// The name as it stands.
        given: String,
    },
    /// A time that is none.
    #[error("{what} of a fault must lie in 0..86400 s, got {given:?}")]
    Time {
        /// Beginning or length.
        what: &'static str,
        /// The field as it stands.
        given: String,
    },
    /// A strength that fits not.
    #[error("strength of {kind} must be {range}, got {given:?}")]
    Strength {
        /// Name of the fault.
        kind: &'static str,
        /// What would be right.
        range: &'static str,
        /// The field as it stands.
        given: String,
    },
}

/// Kinds of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// Bytes vanish; strength: their share.
    Drop,
    /// Bytes get one bit turned; strength: their share.
    Corrupt,
    /// Pieces arrive twice; strength: their share.
    Duplicate,
    /// Bytes arrive late; strength: ms.
    Delay,
    /// The processor starts anew and says so on the line.
    Reboot,
    /// The line stands still, then everything arrives at once.
    Stall,
    /// The cable is out.
    Unplug,
    /// The bus to the motor fails.
    I2c,
    /// The supply is too low.
    BrownOut,
    /// Something spins the knob out of the hand; strength: rad/s.
    OverSpeed,
}

struct KindFacts {
    kind: FaultKind,
    name: &'static str,
    seconds: f64,
    strength: f64,
    range: (f64, f64, &'static str),
}

const SHARE: (f64, f64, &str) = (0.0, 1.0, "a share in 0..1");
const NONE: (f64, f64, &str) = (0.0, 0.0, "left out");

const fn facts(
    kind: FaultKind,
    name: &'static str,
    seconds: f64,
    strength: f64,
    range: (f64, f64, &'static str),
) -> KindFacts {
    KindFacts { kind, name, seconds, strength, range }
}

/// Names, default lengths and strengths. All by judgement: short enough to recover from, strong enough to hurt.
const KINDS: [KindFacts; 10] = [
    facts(FaultKind::Drop, "drop", 1.0, 0.05, SHARE),
    facts(FaultKind::Corrupt, "corrupt", 1.0, 0.05, SHARE),
    facts(FaultKind::Duplicate, "duplicate", 1.0, 0.5, SHARE),
    facts(FaultKind::Delay, "delay", 1.0, 50.0, (0.0, 10_000.0, "0..10000 ms")),
    facts(FaultKind::Reboot, "reboot", 0.4, 0.0, NONE),
    facts(FaultKind::Stall, "stall", 0.5, 0.0, NONE),
    facts(FaultKind::Unplug, "unplug", 1.0, 0.0, NONE),
    facts(FaultKind::I2c, "i2c", 0.5, 0.0, NONE),
    facts(FaultKind::BrownOut, "brownout", 0.1, 0.0, NONE),
    facts(FaultKind::OverSpeed, "overspeed", 0.3, 90.0, (-500.0, 500.0, "-500..500 rad/s")),
];

fn names() -> String {
    KINDS.map(|facts| facts.name).join(", ")
}

/// One fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// What goes wrong.
    pub kind: FaultKind,
    /// When, s since the start.
    pub at_s: f64,
    /// For how long, s.
    pub seconds: f64,
    /// See [`FaultKind`].
    pub strength: f64,
}

impl Fault {
    /// A fault of default length and strength.
    pub fn new(kind: FaultKind, at_s: f64) -> Self {
        // PANIC: every kind has its line in KINDS (tested).
        let facts = KINDS.iter().find(|facts| facts.kind == kind).unwrap();
        Self { kind, at_s, seconds: facts.seconds, strength: facts.strength }
    }

    /// The same for another length, s.
    pub fn lasting(self, seconds: f64) -> Self {
        Self { seconds, ..self }
    }

    /// The same with another strength.
    pub fn strong(self, strength: f64) -> Self {
        Self { strength, ..self }
    }

    /// Whether it lasts at a time, s.
    pub fn is_active(&self, t_s: f64) -> bool {
        (self.at_s..self.at_s + self.seconds).contains(&t_s)
    }
}

impl FromStr for Fault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Self, FaultError> {
        let form = || FaultError::Form(text.to_owned());
        let (name, rest) = text.split_once('@').ok_or_else(form)?;
        let facts = KINDS.iter().find(|facts| facts.name == name.trim());
        let facts = facts.ok_or_else(|| FaultError::Kind { given: name.trim().to_owned() })?;
        let (times, strength) = rest.split_once('=').map_or((rest, None), |(times, s)| (times, Some(s)));
        let (at, seconds) = times.split_once(':').map_or((times, None), |(at, s)| (at, Some(s)));
        let time = |what, given: &str| {
            let seconds = given.trim().trim_end_matches('s').parse::<f64>().ok();
            let seconds = seconds.filter(|s| (0.0..=86_400.0).contains(s));
            seconds.ok_or_else(|| FaultError::Time { what, given: given.to_owned() })
        };
        let mut fault = Self::new(facts.kind, time("the beginning", at)?);
        if let Some(seconds) = seconds {
            fault.seconds = time("the length", seconds)?;
        }
        if let Some(given) = strength {
            let (low, high, range) = facts.range;
            let strength =
                given.trim().parse::<f64>().ok().filter(|x| low < high && (low..=high).contains(x));
            let wrong = || FaultError::Strength { kind: facts.name, range, given: given.to_owned() };
            fault.strength = strength.ok_or_else(wrong)?;
        }
        Ok(fault)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_read_with_their_defaults() {
        let read = |text: &str| text.parse::<Fault>().unwrap();
        assert_eq!(read("corrupt@3:2"), Fault::new(FaultKind::Corrupt, 3.0).lasting(2.0));
        assert_eq!(read("delay@1:5=30"), Fault::new(FaultKind::Delay, 1.0).lasting(5.0).strong(30.0));
        assert_eq!(read("unplug@0.5"), Fault::new(FaultKind::Unplug, 0.5));
        assert_eq!(read("overspeed@2s=-80"), Fault::new(FaultKind::OverSpeed, 2.0).strong(-80.0));
        for facts in KINDS {
            assert_eq!(read(&format!("{}@1", facts.name)).kind, facts.kind);
        }
    }

    #[test]
    fn errors_say_what_would_be_right() {
        for (text, says) in [
            ("corrupt", "KIND@AT[:SECONDS[=STRENGTH]]"),
            ("fire@3", "there are drop, corrupt, duplicate"),
            ("drop@soon", "the beginning of a fault must lie in 0..86400 s, got \"soon\""),
            ("drop@1:-2", "the length"),
            ("drop@nan", "the beginning"),
            ("drop@1:2=1.5", "strength of drop must be a share in 0..1, got \"1.5\""),
            ("stall@1=2", "strength of stall must be left out"),
        ] {
            let said = text.parse::<Fault>().unwrap_err().to_string();
            assert!(said.contains(says), "{text}: {said}");
        }
    }
}
