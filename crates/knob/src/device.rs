//! Links to knobs: ports, sessions, clock alignment, and positions for the audio thread.
//!
//! [`KnobLink`] runs one thread per instance; the audio thread holds a [`KnobReader`]. Torque never crosses the
//! link: the knob computes it from [`Feel`](crate::wire::Feel). Not yet tested on hardware; see `docs/touch.md`.

pub mod clock;
pub mod discover;
pub mod feel_osc;
pub mod heartbeat;
pub mod link;
pub mod lock;
pub mod memory;
pub mod midi;
pub mod osc;
pub mod reader;
pub mod runtime_dir;
pub mod serial;
pub mod session;
pub mod stats;
pub mod stock;
pub mod transport;

pub use discover::{Announcement, Candidate, candidates};
pub use heartbeat::{Heartbeat, Heartbeats, Release};
pub use link::{Hooks, KnobChoice, KnobLink, LinkStatus, Phase};
pub use reader::{KnobReader, Pose};
pub use runtime_dir::{RuntimeDir, serial_number, serial_text};
pub use session::StateSample;
pub use session::arming::{FIRST_CEILING_MNM, HARD_CEILING_MNM, OFFERED_CEILING_MNM};
pub use stats::LinkStats;
