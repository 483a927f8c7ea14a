//! Links to knobs: ports, sessions, clock alignment, and positions for the audio thread.
//!
//! `KnobLink` (feature `devices`) runs one thread per instance; the audio thread holds a `KnobReader`. Torque never crosses
//! the link: the knob computes it from [`Feel`](crate::wire::Feel). Not yet tested on hardware; see `docs/touch.md`.
//!
//! Without the feature there is what needs no port, thread or clock: the [`session`], and the [`pose`] at each sample. A browser
//! page plays a knob with these.

pub mod clock;
#[cfg(feature = "devices")]
pub mod discover;
#[cfg(feature = "devices")]
pub mod feel_osc;
pub mod heartbeat;
#[cfg(feature = "devices")]
pub mod link;
#[cfg(feature = "devices")]
pub mod lock;
#[cfg(feature = "devices")]
pub mod memory;
#[cfg(feature = "devices")]
pub mod midi;
#[cfg(feature = "devices")]
pub mod osc;
pub mod pose;
#[cfg(feature = "devices")]
pub mod reader;
#[cfg(feature = "devices")]
pub mod runtime_dir;
#[cfg(feature = "devices")]
pub mod serial;
pub mod session;
pub mod stats;
#[cfg(feature = "devices")]
pub mod stock;
pub mod transport;

#[cfg(feature = "devices")]
pub use discover::{Announcement, Candidate, candidates};
pub use heartbeat::{Heartbeat, Heartbeats, Release};
#[cfg(feature = "devices")]
pub use link::{Hooks, KnobChoice, KnobLink, LinkStatus, Phase};
#[cfg(feature = "devices")]
pub use reader::{KnobReader, Pose};
#[cfg(feature = "devices")]
pub use runtime_dir::{RuntimeDir, serial_number, serial_text};
pub use session::StateSample;
pub use session::arming::{FIRST_CEILING_MNM, HARD_CEILING_MNM, OFFERED_CEILING_MNM};
pub use stats::LinkStats;

/// Names under which the MIDI port of a knob is taken without being chosen.
const MIDI_NAMES: [&str; 2] = ["torquetuner", "chalumeau"];

/// Whether a MIDI port of this name is taken for a knob without being chosen.
///
/// ```
/// assert!(chalumeau_knob::device::is_midi_name_of_knob("TorqueTuner_001 MIDI 1"));
/// ```
#[must_use]
pub fn is_midi_name_of_knob(name: &str) -> bool {
    let name = name.to_lowercase();
    MIDI_NAMES.iter().any(|known| name.contains(known))
}
