//! The blocks of a score on two channels, panned as the plugin pans them.

use crate::event::{Event, Timed};
use crate::instrument::Settings;
use crate::instrument::stereo::Stereo;
use crate::score::play::take_before;
use crate::score::timeline::Score;

/// Makes two channels of the blocks that [`play`](super::play) or [`play_stereo`](super::play_stereo) hands out, in their
/// order.
///
/// ```
/// use chalumeau_core::score::{Score, StereoBlocks};
/// use chalumeau_core::units::SoundingNote;
///
/// let score = Score::note(SoundingNote(60), 1.0, 48_000);
/// let mut blocks = StereoBlocks::new(&score, 48_000);
/// let [left, right] = blocks.spread(&[0.1, 0.2]);
/// assert_eq!((left, right), (&[0.1, 0.2][..], &[0.1, 0.2][..]));
/// ```
pub struct StereoBlocks<'a> {
    stereo: Stereo,
    /// Events that have not happened yet.
    events: &'a [Timed<Event>],
    begun: usize,
    channels: [Vec<f32>; 2],
}

impl<'a> StereoBlocks<'a> {
    /// From the beginning of a score at `rate` Hz. Allocates.
    pub fn new(score: &'a Score, rate: u32) -> Self {
        Self {
            stereo: Stereo::new(f64::from(rate)),
            events: &score.events,
            begun: 0,
            channels: Default::default(),
        }
    }

    /// In the room of these settings.
    pub fn in_room(mut self, settings: &Settings) -> Self {
        self.stereo.set_space(settings);
        self
    }

    /// Left and right of the next block, of a mono sound.
    pub fn spread(&mut self, mono: &[f32]) -> [&[f32]; 2] {
        self.pan(mono, mono)
    }

    /// Left and right of the next block, of a sound with two channels of the same length.
    pub fn pan(&mut self, left_in: &[f32], right_in: &[f32]) -> [&[f32]; 2] {
        let end = self.begun + left_in.len();
        for event in take_before(&mut self.events, end) {
            self.stereo.heed(&Timed { at: event.at - self.begun, event: event.event });
        }
        self.begun = end;
        let [left, right] = &mut self.channels;
        for (channel, sound) in [(&mut *left, left_in), (&mut *right, right_in)] {
            channel.clear();
            channel.extend_from_slice(sound);
        }
        self.stereo.pan(left, right);
        [left, right]
    }
}
