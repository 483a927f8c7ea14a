//! Offline rendering: a score in, samples out, as fast as the machine can.
//!
//! The score is played once, block by block, through the same [`Clarinet`] that the plugin uses. The samples do not depend
//! on the size of the blocks. The latency of the instrument is not removed.

use crate::event::{Event, PartEvent, Timed};
use crate::instrument::side_by_side::{PlayedBeside, Stand};
use crate::instrument::{Channels, Clarinet, Ensemble, Probe};
use crate::score::timeline::Score;

/// Plays `score` in blocks of `block` samples (at least 1) and hands each block to `each`. Allocates one block.
///
/// `score` must have the sample rate of the host for which `clarinet` was made.
///
/// # Errors
///
/// The first error that `each` returns; it ends the playing.
pub fn play<E>(
    clarinet: &mut Clarinet,
    score: &Score,
    block: usize,
    each: impl FnMut(&[f32]) -> Result<(), E>,
) -> Result<(), E> {
    let render = |events: &[Timed<Event>], begun: usize, out: &mut [f32]| {
        clarinet.render_events(from(events, begun), out);
    };
    in_blocks(score, block, render, each)
}

/// As [`play`], and calls `probe` with the state inside the instrument at every sample of its internal rate.
///
/// # Errors
///
/// The first error that `each` returns; it ends the playing.
pub fn play_probed<E>(
    clarinet: &mut Clarinet,
    score: &Score,
    block: usize,
    probe: &mut dyn FnMut(Probe),
    each: impl FnMut(&[f32]) -> Result<(), E>,
) -> Result<(), E> {
    let render = |events: &[Timed<Event>], begun: usize, out: &mut [f32]| {
        render_probed(clarinet, events, begun, Channels::one(out), probe);
    };
    in_blocks(score, block, render, each)
}

/// As [`play_probed`] in stereo: `each` gets a block of the left channel and one of the right.
///
/// # Errors
///
/// The first error that `each` returns; it ends the playing.
pub fn play_stereo<E>(
    clarinet: &mut Clarinet,
    score: &Score,
    block: usize,
    probe: &mut dyn FnMut(Probe),
    mut each: impl FnMut(&[f32], &[f32]) -> Result<(), E>,
) -> Result<(), E> {
    let mut right = vec![0.0; block.max(1)];
    // The right channel leaves beside the left one, which the blocks are cut from.
    let heard = std::cell::RefCell::new(&mut right);
    let render = |events: &[Timed<Event>], begun: usize, left: &mut [f32]| {
        let mut right = heard.borrow_mut();
        let samples = left.len();
        render_probed(clarinet, events, begun, Channels::two(left, &mut right[..samples]), probe);
    };
    in_blocks(score, block, render, |left| each(left, &heard.borrow()[..left.len()]))
}

/// As [`play`] or, with `stereo`, as [`play_stereo`], beside others who play on other [`Stand`]s: the same bits, in less time. Without
/// `stereo`, `each` gets the one channel twice.
///
/// # Errors
///
/// The first error that `each` returns; it ends the playing.
pub async fn play_beside<E>(
    stand: &Stand,
    clarinet: &PlayedBeside,
    score: &Score,
    block: usize,
    stereo: bool,
    mut each: impl FnMut(&[f32], &[f32]) -> Result<(), E>,
) -> Result<(), E> {
    let [mut left, mut right] = [(); 2].map(|()| vec![0.0; block.max(1)]);
    let mut events = score.events.as_slice();
    let mut done = 0;
    while done < score.samples {
        let samples = left.len().min(score.samples - done);
        let now = take_before(&mut events, done + samples);
        let (left, right) = (&mut left[..samples], &mut right[..samples]);
        let out = if stereo { Channels::two(left, right) } else { Channels::one(left) };
        clarinet.render_events_channels(stand, from(now, done), out).await;
        each(left, if stereo { right } else { left })?;
        done += samples;
    }
    Ok(())
}

/// As [`play`], by several players.
///
/// # Errors
///
/// The first error that `each` returns; it ends the playing.
pub fn play_ensemble<E>(
    ensemble: &mut Ensemble,
    score: &Score<PartEvent>,
    block: usize,
    each: impl FnMut(&[f32]) -> Result<(), E>,
) -> Result<(), E> {
    let render = |events: &[Timed<PartEvent>], begun: usize, out: &mut [f32]| {
        ensemble.render_events_channels(from(events, begun), Channels::one(out));
    };
    in_blocks(score, block, render, each)
}

/// As [`play_stereo`], by several players.
///
/// # Errors
///
/// The first error that `each` returns; it ends the playing.
pub fn play_ensemble_stereo<E>(
    ensemble: &mut Ensemble,
    score: &Score<PartEvent>,
    block: usize,
    mut each: impl FnMut(&[f32], &[f32]) -> Result<(), E>,
) -> Result<(), E> {
    let mut right = vec![0.0; block.max(1)];
    let heard = std::cell::RefCell::new(&mut right);
    let render = |events: &[Timed<PartEvent>], begun: usize, left: &mut [f32]| {
        let mut right = heard.borrow_mut();
        let samples = left.len();
        ensemble.render_events_channels(from(events, begun), Channels::two(left, &mut right[..samples]));
    };
    in_blocks(score, block, render, |left| each(left, &heard.borrow()[..left.len()]))
}

/// The same events, counted from sample `begun`.
fn from<E: Copy>(events: &[Timed<E>], begun: usize) -> impl Iterator<Item = Timed<E>> + '_ {
    events.iter().map(move |e| Timed { at: e.at - begun, event: e.event })
}

/// Fills `out`, which begins at sample `begun` of the score, and applies each event at its sample.
fn render_probed(
    clarinet: &mut Clarinet,
    events: &[Timed<Event>],
    begun: usize,
    mut out: Channels,
    probe: &mut dyn FnMut(Probe),
) {
    let mut done = 0;
    for event in events {
        let at = event.at - begun;
        clarinet.render_probed_channels(out.part(done..at), probe);
        clarinet.apply(event.event);
        done = at;
    }
    let end = out.len();
    clarinet.render_probed_channels(out.part(done..end), probe);
}

/// Cuts a score into blocks. `render` gets the events of a block, the sample at which it begins, and where to write.
fn in_blocks<V, E>(
    score: &Score<V>,
    block: usize,
    mut render: impl FnMut(&[Timed<V>], usize, &mut [f32]),
    mut each: impl FnMut(&[f32]) -> Result<(), E>,
) -> Result<(), E> {
    let mut out = vec![0.0; block.max(1)];
    let mut events = score.events.as_slice();
    let mut done = 0;
    while done < score.samples {
        let out = &mut out[..block.max(1).min(score.samples - done)];
        render(take_before(&mut events, done + out.len()), done, out);
        each(out)?;
        done += out.len();
    }
    Ok(())
}

/// Splits off the events that happen before sample `end`.
pub(super) fn take_before<'a, E>(events: &mut &'a [Timed<E>], end: usize) -> &'a [Timed<E>] {
    let (now, later) = events.split_at(events.partition_point(|e| e.at < end));
    *events = later;
    now
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::Event;
    use crate::instrument::{Listening, ListeningMode, Settings};
    use crate::units::SoundingNote;
    use std::convert::Infallible;

    fn score() -> Score {
        let mut events = vec![Timed { at: 0, event: Event::Breath(0.5) }];
        for i in 0..20u8 {
            let note = SoundingNote(60 + i);
            let at = 37 + 211 * usize::from(i);
            events.push(Timed { at, event: Event::NoteOn { note, velocity: 0.8 } });
            events.push(Timed { at: at + 200, event: Event::NoteOff { note } });
        }
        Score { events, samples: 5000 }
    }

    fn samples(block: usize) -> Vec<f32> {
        let mut clarinet = Clarinet::built_in(48_000.0).unwrap();
        let mut all = Vec::new();
        play(&mut clarinet, &score(), block, |out| {
            all.extend_from_slice(out);
            Ok::<_, Infallible>(())
        })
        .unwrap();
        all
    }

    #[test]
    fn block_size_does_not_change_the_samples() {
        let whole = samples(5000);
        assert_eq!(whole.len(), 5000);
        for block in [1, 17, 64, 512, 4096] {
            assert!(samples(block) == whole, "block of {block}");
        }
    }

    #[test]
    fn everywhere_is_the_same_in_both_channels_and_two_places_are_not() {
        let two = |settings: &Settings| {
            let mut clarinet = Clarinet::built_in(48_000.0).unwrap();
            clarinet.set_settings(settings);
            let (mut left, mut right) = (Vec::new(), Vec::new());
            play_stereo(&mut clarinet, &score(), 300, &mut |_| (), |a, b| {
                left.extend_from_slice(a);
                right.extend_from_slice(b);
                Ok::<_, Infallible>(())
            })
            .unwrap();
            (left, right)
        };
        let (left, right) = two(&Settings::default());
        assert!(left == right && left == samples(512));
        let place = Listening { mode: ListeningMode::Position, ..Listening::default() };
        let (left, right) = two(&Settings { listening: place, ..Settings::default() });
        assert!(left != right && right.len() == left.len());
    }

    #[test]
    fn probing_does_not_change_the_samples() {
        let mut clarinet = Clarinet::built_in(48_000.0).unwrap();
        let (mut all, mut probed) = (Vec::new(), 0usize);
        play_probed(&mut clarinet, &score(), 300, &mut |_| probed += 1, |out| {
            all.extend_from_slice(out);
            Ok::<_, Infallible>(())
        })
        .unwrap();
        assert!(all == samples(512));
        assert!(probed >= 5000);
    }
}
