//! Couples reed and bore into a playable instrument, moved by a player and heard at the host's sample rate.
//!
//! [`Clarinet`] is the whole instrument: events in, samples out. It plays a [`Model`], which a [`Preparation`] makes from
//! an instrument file. Inside, a [`player`] turns events and [`Settings`] into breath, tongue, fingers and tuning, and a
//! [`Voice`] turns those into sound.
//!
//! ```
//! use chalumeau_core::event::Event;
//! use chalumeau_core::instrument::Clarinet;
//! use chalumeau_core::units::SoundingNote;
//!
//! let mut clarinet = Clarinet::built_in(48_000.0)?;
//! clarinet.apply(Event::NoteOn { note: SoundingNote(60), velocity: 0.8 });
//! let mut samples = vec![0.0; 4_800];
//! clarinet.render(&mut samples);
//! assert!(samples.iter().any(|sample| sample.abs() > 0.01));
//! # Ok::<(), chalumeau_core::instrument::BuildError>(())
//! ```

mod articulation;
pub mod bend;
mod breath_noise;
mod channels;
mod choke;
mod clarinet;
pub mod concert_pitch;
mod control_tick;
mod ensemble;
pub mod feel_inputs;
pub mod internal_rate;
pub mod key_pitches;
pub mod lip;
pub mod listening;
pub mod model;
mod output_level;
mod outside;
mod pads;
mod person;
pub mod played_note;
pub mod player;
mod players;
pub mod prepare;
pub mod presence;
mod reach;
pub mod room;
pub mod scope;
mod settings;
pub mod side_by_side;
mod slap;
mod stage;
pub mod stereo;
pub mod store;
pub mod techniques;
pub mod trial_note;
pub mod tuning_table;
pub mod vocal_tract;
pub mod voice;

pub use articulation::Articulation;
pub use channels::Channels;
pub use clarinet::Clarinet;
pub use ensemble::Ensemble;
pub use key_pitches::{KeyPitch, KeyPitches};
pub use listening::{Listening, ListeningMode};
pub use model::{BuildError, Model};
pub use player::{Attack, vibrato::Vibrato};
pub use players::{MOST_PLAYERS, Players, Split};
pub use prepare::{Preparation, Quality, Wanted};
pub use reach::{Beyond, KeyNotes, Reach};
pub use room::Room;
pub use settings::{BreathResponse, Settings, Tuning};
pub use techniques::{GrowlPitch, Techniques, Tract};
pub use voice::{Probe, Voice};
