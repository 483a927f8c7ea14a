//! The blocks of a score on two channels, panned as the plugin pans them.

use crate::event::{Event, Timed};
use crate::instrument::stereo::Stereo;
use crate::score::play::take_before;
use crate::score::timeline::Score;

/// Makes two channels of the mono blocks that [`play`](super::play) hands out, in their order.
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

    /// Left and right of the next block.
    pub fn spread(&mut self, mono: &[f32]) -> [&[f32]; 2] {
        let end = self.begun + mono.len();
        for event in take_before(&mut self.events, end) {
            self.stereo.heed(&Timed { at: event.at - self.begun, event: event.event });
        }
        self.begun = end;
        let [left, right] = &mut self.channels;
        left.clear();
        left.extend_from_slice(mono);
        right.resize(mono.len(), 0.0);
        self.stereo.spread(left, right);
        [left, right]
    }
}
