//! Scores: what to play, and playing it offline.
//!
//! A [`Score`] is a list of events at sample positions. It comes from a note, a scale, a MIDI file ([`midi_file`], feature
//! `midi`) or your own events. A [`BreathCurve`](breath::BreathCurve) gives its mouth pressure. [`play`] renders it block by
//! block through a [`Clarinet`](crate::instrument::Clarinet); [`play_probed`] also shows the inside of the instrument. [`StereoBlocks`] pans them. A
//! [`NoteSpan`] says which note is heard when.
//!
//! Positions are in samples. Notes in events are sounding pitches; [`Score::scale`] takes written ones. `gamma` is mouth
//! pressure over closing pressure.
//!
//! ```
//! use chalumeau_core::instrument::{Clarinet, Settings};
//! use chalumeau_core::score::breath::BreathCurve;
//! use chalumeau_core::score::{Score, play};
//! use chalumeau_core::units::WrittenNote;
//!
//! const RATE: u32 = 48_000;
//! let mut clarinet = Clarinet::built_in(f64::from(RATE))?;
//! // The curve is one of pressure.
//! clarinet.set_settings(&Settings::physical());
//! // Written E3 to G3 on a B flat clarinet, slurred, 0.2 s each, with a crescendo.
//! let score = Score::scale(WrittenNote(52), WrittenNote(55), 2, 0.2, true, RATE)?;
//! let score = score.blown(&BreathCurve::parse_crescendo("0.45:0.8")?, &Settings::physical(), RATE);
//!
//! let mut samples = Vec::new();
//! play(&mut clarinet, &score, 512, |block| {
//!     samples.extend_from_slice(block);
//!     Ok::<_, std::convert::Infallible>(())
//! })?;
//! assert_eq!(samples.len(), score.samples);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod breath;
#[cfg(feature = "midi")]
pub mod midi_file;
mod note_spans;
mod play;
mod samples;
mod stereo_blocks;
mod timeline;

pub use breath::{breath_of_gamma, closing_kpa};
pub use note_spans::NoteSpan;
pub use play::{play, play_beside, play_ensemble, play_ensemble_stereo, play_probed, play_stereo};
pub use samples::samples_in;
pub use stereo_blocks::StereoBlocks;
pub use timeline::{Score, ScoreError};
