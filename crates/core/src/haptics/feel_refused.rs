//! Why a feel is refused: what was asked, what the limit is, and what would be accepted.

use std::fmt;

use crate::haptics::feel_parameters::OutOfRange;
use crate::units::WrittenNote;

/// Why a feel is refused. Its text is the [`reason`](Self::reason) and, behind a semicolon, the [`advice`](Self::advice).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FeelRefused {
    /// A value of the [`FeelDesign`](crate::haptics::FeelDesign) lies outside its range.
    Range {
        /// Name and unit of the value.
        name: &'static str,
        /// The value given.
        given: f64,
        /// Least value allowed.
        low: f64,
        /// Greatest value allowed.
        high: f64,
    },
    /// What a note would be sent exceeds the range of the protocol.
    Field {
        /// The note.
        note: WrittenNote,
        /// The field of the protocol, and its range.
        out_of_range: OutOfRange,
    },
    /// The chosen reference note has no fingering or does not sound.
    Reference(WrittenNote),
    /// No note of the instrument sounds with this reed.
    Silent {
        /// Embouchure parameter of this reed.
        zeta: f64,
    },
    /// H k exceeds the range of the protocol.
    Closing(f64),
    /// H and k are those of a known slip of the pen in the reference notebook.
    Slip,
    /// A note would close at an angle beyond the range of the protocol.
    Travel {
        /// The note that closes farthest from rest.
        note: WrittenNote,
        /// Its closure, degrees.
        wanted_deg: f64,
        /// Largest closure allowed, degrees.
        limit_deg: f64,
    },
    /// Place would put the felt threshold of a note too near its closure, or beyond it.
    Crossed {
        /// The note with the largest threshold.
        note: WrittenNote,
        /// Its felt threshold, degrees.
        a_on_deg: f64,
        /// Its closure, degrees.
        a_close_deg: f64,
    },
    /// A note needs more torque than the ceiling allows.
    Ceiling {
        /// The note with the largest torque.
        note: WrittenNote,
        /// Its largest torque with friction, mNm.
        wanted_mnm: f64,
        /// Largest torque allowed, mNm.
        ceiling_mnm: f64,
        /// Largest strength that would be allowed, mNm, rounded down.
        strength_mnm: f64,
    },
    /// The torque rises more steeply than a sampled knob can render without oscillating.
    Stiffness {
        /// The note with the steepest rise.
        note: WrittenNote,
        /// Its slope, N m/rad.
        wanted: f64,
        /// Steepest slope allowed, N m/rad.
        limit: f64,
    },
    /// The torque falls more steeply than a hand can hold.
    Push {
        /// The note with the steepest fall.
        note: WrittenNote,
        /// Its slope, N m/rad.
        wanted: f64,
        /// Steepest slope allowed, N m/rad.
        limit: f64,
    },
}

impl FeelRefused {
    /// What was asked, and what the limit is.
    pub fn reason(&self) -> String {
        match *self {
            Self::Range { name, given, low, high } => {
                format!("{name} must lie in {low}..{high}, got {given}")
            }
            Self::Field { note, out_of_range: OutOfRange { field, value, low, high } } => {
                format!("{note} would need a {field} of {value:.1}, the protocol takes {low}..{high}")
            }
            Self::Reference(note) => {
                format!("the reference note {note} does not sound on this instrument with this reed")
            }
            Self::Silent { zeta } => {
                format!("no note sounds with this reed: zeta {zeta:.3} is too weak for the bore")
            }
            Self::Closing(closing) => format!("the reed closes at {closing:.3} times the reference pressure"),
            Self::Slip => {
                "H = sqrt(27/2) = 3.674 with k = 0.1361 closes at half the travel and is refused as a slip: \
                           the reference is H = sqrt(27)/2 = 2.598"
                    .to_owned()
            }
            Self::Travel { note, wanted_deg, limit_deg } => {
                format!("{note} would close at {wanted_deg:.0} degrees, the knob goes to {limit_deg:.0}")
            }
            Self::Crossed { note, a_on_deg, a_close_deg } => format!(
                "{note} would be felt to start at {a_on_deg:.0} degrees, too near closure at {a_close_deg:.0}"
            ),
            Self::Ceiling { note, wanted_mnm, ceiling_mnm, .. } => {
                format!(
                    "{note} would need {:.0} mNm with mark and friction, the ceiling is {ceiling_mnm:.0}",
                    wanted_mnm.ceil()
                )
            }
            Self::Stiffness { note, wanted, limit } => {
                format!(
                    "{note} would be as steep as {:.3} N m/rad; above {limit:.3} a knob oscillates",
                    (1e3 * wanted).ceil() / 1e3
                )
            }
            Self::Push { note, wanted, limit } => {
                format!("{note} would push the hand along with {wanted:.3} N m/rad, the limit is {limit:.3}")
            }
        }
    }

    /// What to change so that the feel is accepted; `None` where the reason says it.
    pub fn advice(&self) -> Option<String> {
        let advice = match *self {
            Self::Range { .. } => return None,
            Self::Field { .. } => "lengthen the travel, or lower Feel torque or Feel place",
            Self::Reference(_) => "choose another",
            Self::Silent { .. } => "raise zeta, A or H",
            Self::Closing(_) => "a knob can follow H k up to 10",
            Self::Slip => "set k apart from H if this reed is meant",
            Self::Travel { .. } => "shorten the travel",
            Self::Crossed { .. } => "lower Feel place, raise zeta, or use the flow law",
            Self::Ceiling { strength_mnm: 0.0, .. } => "lower the mark or the friction, or allow more torque",
            Self::Ceiling { strength_mnm, .. } => {
                return Some(format!(
                    "lower Feel torque to {strength_mnm:.0} mNm or less, lower Feel contrast, or allow more torque"
                ));
            }
            Self::Stiffness { .. } => {
                "lower Feel torque or the mark, soften the wall, or lengthen the travel"
            }
            Self::Push { .. } => {
                "lower the mark or Feel torque, lengthen the travel, or use the pressure law"
            }
        };
        Some(advice.to_owned())
    }
}

impl fmt::Display for FeelRefused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.reason())?;
        self.advice().map_or(Ok(()), |advice| write!(f, "; {advice}"))
    }
}

impl std::error::Error for FeelRefused {}
