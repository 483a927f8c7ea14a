//! The events that a player causes. Hosts, MIDI files and devices are translated into these; the core takes nothing else.
//!
//! ```
//! use chalumeau_core::event::{Event, Timed};
//! use chalumeau_core::units::SoundingNote;
//!
//! let note_on = Event::NoteOn { note: SoundingNote(58), velocity: 0.8 };
//! let score = [Timed { at: 0, event: Event::Breath(0.5) }, Timed { at: 480, event: note_on }];
//! assert!(score.is_sorted_by_key(|timed| timed.at));
//! ```

mod setting_number;

pub use setting_number::SettingNumber;

use crate::units::SoundingNote;
use std::fmt;

/// Something the player does, in the units of the instrument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// A key or fingering goes down. `velocity` 0..=1.
    NoteOn {
        /// Sounding pitch.
        note: SoundingNote,
        /// How hard, 0..=1. Sets the mouth pressure until a breath source moves; afterwards it only shapes the attack.
        velocity: f32,
    },
    /// A key comes up.
    NoteOff {
        /// Sounding pitch.
        note: SoundingNote,
    },
    /// A note ends at once, in less than 5 ms, and its key comes up. A note that was held before it begins anew, tongued.
    Choke {
        /// Sounding pitch.
        note: SoundingNote,
    },
    /// Breath from any source, 0..=1. What it sets is `Settings::breath_response`: by default the dynamic, from where notes begin to fortissimo;
    /// with `BreathResponse::Physical` the mouth pressure as a share of `Settings::breath_full_kpa`. The first one makes breath *live*.
    Breath(f32),
    /// The velocity of keys sets the breath again, until the next [`Breath`](Self::Breath).
    BreathFromKeys,
    /// The keys are pressed on, 0..=1: from the loudness of their velocity to the greatest. Nothing once breath is live.
    KeyPressure(f32),
    /// Pitch bend, cents; two octaves at most. Near the note by the lip, beyond by the bore's size, see
    /// [`bend`](crate::instrument::bend).
    Bend {
        /// Cents above the note.
        cents: f32,
    },
    /// Controllers open and stiffen the reed: factors on [`Settings`](crate::instrument::Settings)' H and k. Where these are `coupled`, k is
    /// that of H without its factor.
    Reed {
        /// On H, 0.1..=10; 1 leaves it.
        h: f32,
        /// On k, 0.1..=10; 1 leaves it.
        k: f32,
    },
    /// Depth of the vibrato, 0..=1, added to that of the [`Settings`](crate::instrument::Settings).
    Vibrato(f32),
    /// The tongue pulls the reed off the mouthpiece and lets it slam: a percussive burst on the fingering in place, with
    /// or without breath and held keys.
    TongueSlap {
        /// How hard, 0..=1; 0 is nothing.
        strength: f32,
    },
    /// A controller's share of an extended technique; it adds to that of the settings.
    Technique {
        /// Which.
        which: Technique,
        /// How much, 0..=1; 0 leaves the settings'.
        amount: f32,
    },
    /// Loudness after the instrument, before the limiter.
    Volume {
        /// Factor on the amplitude, 0..=4; 1 leaves it.
        gain: f32,
    },
    /// Place between left and right, see [`Stereo`](crate::instrument::stereo::Stereo). The instrument itself is mono.
    Pan {
        /// -1 left, 0 middle, 1 right.
        position: f32,
    },
    /// A number of the [`Settings`](crate::instrument::Settings) gets a value in its own unit, clamped to its range.
    Set(SettingNumber, f32),
    /// Open holes whatever is fingered, one bit each in the order of the instrument's file from the lowest bit; `None` goes
    /// back to the fingering of the note.
    TryHoles(Option<u64>),
    /// Opens one hole as far as asked, whatever is fingered: half-holes, shadings, quarter tones. It gets there in the time
    /// of the fingers (`Settings::legato_ms`), and the tuning stays that of the note. [`TryHoles`](Self::TryHoles) takes
    /// its place, and its `None` gives back this hole too. A hole that the instrument does not have is ignored.
    Hole {
        /// Index in the order of the instrument's file, 0..=63.
        hole: u8,
        /// 0 closed..=1 open, about the share of the hole's diameter: air passes through the square of it. `None`, or a
        /// number that is not finite, goes back to the fingering of the note.
        opening: Option<f32>,
    },
    /// Which fingerings the notes take from the next one on, whatever `Settings::alternates` says.
    Fingerings(Fingerings),
    /// Releases all notes and silences reed and bore at once. What breath sources and controllers have set stays, and so do chosen
    /// [fingerings](Self::Fingerings) and holes on trial: who sent them does not send them again while they rest.
    Panic,
}

/// Which of a note's fingerings is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fingerings {
    /// That of the chart.
    Chart,
    /// Its first alternate, its second and so on, from 1; a note that has not so many takes that of the chart.
    Alternate(u8),
    /// In slurs by a semitone or a tone the one that moves the fewest fingers, else that of the chart.
    ByContext,
}

impl fmt::Display for Fingerings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Chart => f.write_str("chart fingerings"),
            Self::Alternate(1) => f.write_str("1st alternate"),
            Self::Alternate(2) => f.write_str("2nd alternate"),
            Self::Alternate(3) => f.write_str("3rd alternate"),
            Self::Alternate(nth) => write!(f, "{nth}th alternate"),
            Self::ByContext => f.write_str("by context"),
        }
    }
}

/// An extended technique that a controller may drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Technique {
    /// The player sings into the instrument.
    Growl,
    /// The tongue rolls an R.
    Flutter,
    /// The lip covers the reed.
    Subtone,
}

/// Which of several players plays an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum To {
    /// All of them.
    All,
    /// One, from 0.
    Player(u8),
}

/// An event, and who of several players plays it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartEvent {
    /// Who.
    pub to: To,
    /// What.
    pub event: Event,
}

impl From<Event> for PartEvent {
    /// For all players.
    fn from(event: Event) -> Self {
        Self { to: To::All, event }
    }
}

/// What is played: an event of one player, or one of several players.
pub trait Played: Copy + From<Event> {
    /// What happens.
    fn event(&self) -> Event;

    /// What the first player does of it.
    fn of_first(&self) -> Option<Event>;
}

impl Played for Event {
    fn event(&self) -> Event {
        *self
    }

    fn of_first(&self) -> Option<Event> {
        Some(*self)
    }
}

impl Played for PartEvent {
    fn event(&self) -> Event {
        self.event
    }

    fn of_first(&self) -> Option<Event> {
        matches!(self.to, To::All | To::Player(0)).then_some(self.event)
    }
}

/// An event and when it happens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timed<E> {
    /// Sample index from the start of the block (or of the file, where a whole score is meant).
    pub at: usize,
    /// What happens.
    pub event: E,
}
