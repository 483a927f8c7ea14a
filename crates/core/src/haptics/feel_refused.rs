//! Why a feel is refused: what was asked, what the limit is, and what would be accepted.

use crate::units::WrittenNote;

/// Why a feel is refused. Each message names the way out.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FeelRefused {
    /// A value of the [`FeelDesign`](crate::haptics::FeelDesign) lies outside its range.
    #[error("{name} must lie in {low}..{high}, got {given}")]
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
    /// The chosen reference note has no fingering or does not sound.
    #[error("the reference note {0} does not sound on this instrument with this reed; choose another")]
    Reference(WrittenNote),
    /// No note of the instrument sounds with this reed.
    #[error("no note sounds with this reed: zeta {zeta:.3} is too weak for the bore; raise zeta, A or H")]
    Silent {
        /// Embouchure parameter of this reed.
        zeta: f64,
    },
    /// H k exceeds the range of the protocol.
    #[error("the reed closes at {0:.3} times the reference pressure; a knob can follow H k up to 10")]
    Closing(f64),
    /// H and k are those of a known slip of the pen in the reference notebook.
    #[error(
        "H = sqrt(27/2) = 3.674 with k = 0.1361 closes at half the travel and is refused as a slip: \
         the reference is H = sqrt(27)/2 = 2.598; set k apart from H if this reed is meant"
    )]
    Slip,
    /// A note would close at an angle beyond the range of the protocol.
    #[error(
        "{note} would close at {wanted_deg:.0} degrees, the knob goes to {limit_deg:.0}; shorten the travel"
    )]
    Travel {
        /// The note that closes farthest from rest.
        note: WrittenNote,
        /// Its closure, degrees.
        wanted_deg: f64,
        /// Largest closure allowed, degrees.
        limit_deg: f64,
    },
    /// Place would put the felt threshold of a note too near its closure, or beyond it.
    #[error(
        "{note} would be felt to start at {a_on_deg:.0} degrees, too near closure at {a_close_deg:.0}; \
         lower Place, raise zeta, or use the flow law"
    )]
    Crossed {
        /// The note with the largest threshold.
        note: WrittenNote,
        /// Its felt threshold, degrees.
        a_on_deg: f64,
        /// Its closure, degrees.
        a_close_deg: f64,
    },
    /// A note needs more torque than the ceiling allows.
    #[error(
        "{note} would need {wanted_mnm:.0} mNm, the ceiling is {ceiling_mnm:.0}; \
         lower the strength to {strength_mnm:.0} mNm or less, lower Contrast, or allow more torque"
    )]
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
    #[error(
        "{note} would be as steep as {wanted:.3} N m/rad, the knob stays still up to {limit:.3}; \
         lower the strength, soften the wall, or lengthen the travel"
    )]
    Stiffness {
        /// The note with the steepest rise.
        note: WrittenNote,
        /// Its slope, N m/rad.
        wanted: f64,
        /// Steepest slope allowed, N m/rad.
        limit: f64,
    },
    /// The torque falls more steeply than a hand can hold.
    #[error(
        "{note} would push the hand along with {wanted:.3} N m/rad, the limit is {limit:.3}; \
         lower the mark or the strength, lengthen the travel, or use the pressure law"
    )]
    Push {
        /// The note with the steepest fall.
        note: WrittenNote,
        /// Its slope, N m/rad.
        wanted: f64,
        /// Steepest slope allowed, N m/rad.
        limit: f64,
    },
}
