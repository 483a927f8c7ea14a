//! Where a block of samples goes: one channel, or a left and a right one.

use std::ops::Range;

use crate::event::Timed;

/// One channel, or two of the same length. In two, the instrument sounds as at its two
/// [listening](super::listening) places, where it has two.
#[derive(Debug)]
pub struct Channels<'a> {
    /// The only channel, or the left one.
    pub(super) left: &'a mut [f32],
    /// The right channel, if there is one.
    pub(super) right: Option<&'a mut [f32]>,
}

impl<'a> Channels<'a> {
    /// Only one.
    pub fn one(out: &'a mut [f32]) -> Self {
        Self { left: out, right: None }
    }

    /// Two; the longer one is cut to the length of the other.
    pub fn two(left: &'a mut [f32], right: &'a mut [f32]) -> Self {
        let samples = left.len().min(right.len());
        Self { left: &mut left[..samples], right: Some(&mut right[..samples]) }
    }

    /// The only channel, or the left one.
    pub fn left(&mut self) -> &mut [f32] {
        self.left
    }

    /// The right channel, if there is one.
    pub fn right(&mut self) -> Option<&mut [f32]> {
        self.right.as_deref_mut()
    }

    /// Whether there is a right channel.
    pub fn is_stereo(&self) -> bool {
        self.right.is_some()
    }

    /// Samples in each channel.
    pub fn len(&self) -> usize {
        self.left.len()
    }

    /// Whether there is nothing to fill.
    pub fn is_empty(&self) -> bool {
        self.left.is_empty()
    }

    /// Some of the samples, all within the length.
    pub fn part(&mut self, range: Range<usize>) -> Channels<'_> {
        Channels {
            left: &mut self.left[range.clone()],
            right: self.right.as_deref_mut().map(|right| &mut right[range]),
        }
    }

    /// Each channel there is.
    pub fn each(&mut self, mut of: impl FnMut(&mut [f32])) {
        of(self.left);
        if let Some(right) = &mut self.right {
            of(right);
        }
    }

    /// Cuts the block at its events, which must be in order of time: `player` renders up to each event and applies it. An event at or
    /// after the end of the block is applied at its end.
    pub(super) fn cut_at<P, E>(
        mut self,
        events: impl IntoIterator<Item = Timed<E>>,
        player: &mut P,
        render: impl Fn(&mut P, Channels),
        apply: impl Fn(&mut P, E),
    ) {
        let (mut done, end) = (0, self.len());
        for Timed { at, event } in events {
            let at = at.clamp(done, end);
            render(player, self.part(done..at));
            apply(player, event);
            done = at;
        }
        render(player, self.part(done..end));
    }

    /// Multiplies each sample of all channels by the next gain.
    pub(super) fn each_moment(&mut self, mut gain: impl FnMut() -> f32) {
        match &mut self.right {
            None => self.left.iter_mut().for_each(|sample| *sample *= gain()),
            Some(right) => {
                for (left, right) in self.left.iter_mut().zip(right.iter_mut()) {
                    let gain = gain();
                    *left *= gain;
                    *right *= gain;
                }
            }
        }
    }
}
