//! From the instrument to two channels: the [room](super::room) and the pan, after the instrument and its limiter.
//!
//! The law has constant power, with 0 dB on both sides in the middle: `sqrt(2) cos` on the left, `sqrt(2) sin` on the right, of
//! an angle from 0 to 90 degrees. So a sound in the middle is the instrument's to the bit, on both channels; at a side it is
//! 3 dB louder there and silent on the other. What would leave full scale is turned down on both channels alike. A change
//! takes 10 ms.
//!
//! Source: RP-036, the default pan formula of General MIDI 2 devices, which has -3 dB in the middle.

use std::f32::consts::{FRAC_PI_4, SQRT_2};

use crate::dsp::glide::Glide;
use crate::dsp::limiter::Limiter;
use crate::event::{Event, Timed};
use crate::instrument::Settings;
use crate::instrument::room::{Room, RoomSound};
use crate::maths;

/// Time that a change of the pan takes, s.
const PAN_S: f64 = 0.010;
/// Changes that one block can hold: as many as the plugin takes events. Later ones replace the last one.
const CHANGES: usize = 4_096;

/// Spreads mono over two channels, block by block. Real-time safe, but for `new`.
///
/// ```
/// use chalumeau_core::event::{Event, Timed};
/// use chalumeau_core::instrument::stereo::Stereo;
///
/// let mut stereo = Stereo::new(48_000.0);
/// let (mut left, mut right) = ([0.25; 1_000], [0.0; 1_000]);
/// stereo.heed(&Timed { at: 10, event: Event::Pan { position: 1.0 } });
/// stereo.spread(&mut left, &mut right);
/// assert_eq!((left[9], right[9]), (0.25, 0.25));
/// assert!(left[999].abs() < 1e-7 && right[999] > 0.35);
/// ```
#[derive(Clone, Debug)]
pub struct Stereo {
    sides: [Glide; 2],
    /// Changes in the block that begins now, in order of time.
    changes: Vec<(usize, Change)>,
    room: RoomSound,
    /// The room after these changes.
    wanted: Room,
    limiter: Limiter,
}

/// What an event changes.
#[derive(Clone, Copy, Debug)]
enum Change {
    /// Place between left and right, -1..=1.
    Pan(f32),
    /// The room around the instrument.
    Room(Room),
}

impl Stereo {
    /// In the middle, without a room, at a sample rate. Allocates.
    pub fn new(rate_hz: f64) -> Self {
        Self {
            sides: [Glide::new(1.0, PAN_S, rate_hz); 2],
            changes: Vec::with_capacity(CHANGES),
            room: RoomSound::new(rate_hz),
            wanted: Room::default(),
            limiter: Limiter::new(rate_hz),
        }
    }

    /// Another room from the next block on.
    pub fn set_room(&mut self, room: &Room) {
        self.wanted = *room;
        self.room.set(room);
    }

    /// The room of these settings from the next block on, and whether several players sit apart in it.
    pub fn set_space(&mut self, settings: &Settings) {
        self.set_room(&settings.room);
        self.room.set_apart(settings.players.sit_apart());
    }

    /// One player has become several, who are panned one by one, or the other way round. `position` is the pan of the first, -1
    /// left..=1 right. Real-time safe.
    pub fn hand_over_pan(&mut self, was_lone: bool, position: f32) {
        let position = if was_lone { 0.0 } else { position };
        self.heed(&Timed { at: 0, event: Event::Pan { position } });
    }

    /// The room: whether it still sounds, and how long it can.
    pub fn room(&self) -> &RoomSound {
        &self.room
    }

    /// Back to the middle at once, in a silent room.
    pub fn reset(&mut self) {
        self.sides.iter_mut().for_each(|side| side.set(1.0));
        self.changes.clear();
        self.room.reset();
        self.limiter.reset();
    }

    /// Notes an event of the block that begins now; all do nothing but [`Event::Pan`] and an [`Event::Set`] of the room.
    pub fn heed(&mut self, event: &Timed<Event>) {
        let change = match event.event {
            Event::Pan { position } if position.is_finite() => Change::Pan(position.clamp(-1.0, 1.0)),
            Event::Pan { .. } => Change::Pan(0.0),
            Event::Set(number, value) => {
                let mut settings = Settings { room: self.wanted, ..Settings::default() };
                *settings.number(number) = value;
                if settings.room == self.wanted {
                    return;
                }
                self.wanted = settings.room.clamped();
                Change::Room(self.wanted)
            }
            _ => return,
        };
        if self.changes.len() == CHANGES {
            self.changes.pop();
        }
        self.changes.push((event.at, change));
    }

    /// Ends the block: `left` holds the mono sound; afterwards it is the left channel.
    pub fn spread(&mut self, left: &mut [f32], right: &mut [f32]) {
        right[..left.len()].copy_from_slice(left);
        self.pan(left, right);
    }

    /// Ends the block: room and pan of two channels of the same length.
    pub fn pan(&mut self, left: &mut [f32], right: &mut [f32]) {
        let right = &mut right[..left.len()];
        let mut done = 0;
        for change in 0..=self.changes.len() {
            let next = self.changes.get(change).copied();
            let to = next.map_or(left.len(), |(at, _)| at.clamp(done, left.len()));
            let in_room = self.room.add(&mut left[done..to], &mut right[done..to]);
            self.turn(&mut left[done..to], &mut right[done..to], in_room);
            match next {
                Some((_, Change::Pan(position))) => {
                    for (side, gain) in self.sides.iter_mut().zip(gains(position)) {
                        side.go_to(gain);
                    }
                }
                Some((_, Change::Room(room))) => self.room.set(&room),
                None => {}
            }
            done = to;
        }
        self.changes.clear();
    }

    /// Applies the pan. In the middle nothing is touched, which is decided sample by sample: the host's blocks must not show.
    /// The first `in_room` samples are of a room, which can be too loud.
    fn turn(&mut self, left: &mut [f32], right: &mut [f32], in_room: usize) {
        for (n, (left, right)) in left.iter_mut().zip(right).enumerate() {
            if n >= in_room && self.sides.iter().all(|side| side.rests_at(1.0)) && self.limiter.is_idle() {
                // Nothing changes before the next event.
                return;
            }
            *left *= self.sides[0].next();
            *right *= self.sides[1].next();
            self.limiter.process_pair(left, right);
            // What a room or a pan has made too small to hear costs a host much time.
            for sample in [left, right] {
                if sample.is_subnormal() {
                    *sample = 0.0;
                }
            }
        }
    }
}

/// The gains of left and right.
pub(super) fn gains(position: f32) -> [f32; 2] {
    if position == 0.0 {
        // Exactly, so that the middle leaves every bit as it is.
        return [1.0; 2];
    }
    let (right, left) = maths::single::sin_cos(FRAC_PI_4 * (1.0 + position));
    [SQRT_2 * left, SQRT_2 * right]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::SettingNumber;

    const RATE_HZ: f64 = 48_000.0;

    fn at(at: usize, position: f32) -> Timed<Event> {
        Timed { at, event: Event::Pan { position } }
    }

    /// A sine of full scale, panned, in blocks of so many samples.
    fn spread(events: &[Timed<Event>], block: usize) -> [Vec<f32>; 2] {
        let mut stereo = Stereo::new(RATE_HZ);
        let mut left: Vec<f32> = (0..9_600).map(|n| (n as f32 * 0.05).sin()).collect();
        let mut right = vec![0.0; left.len()];
        for begun in (0..left.len()).step_by(block) {
            let end = left.len().min(begun + block);
            for event in events.iter().filter(|event| (begun..end).contains(&event.at)) {
                stereo.heed(&Timed { at: event.at - begun, event: event.event });
            }
            stereo.spread(&mut left[begun..end], &mut right[begun..end]);
        }
        [left, right]
    }

    #[test]
    fn power_is_constant_and_the_middle_is_exact() {
        for step in -20..=20 {
            let [left, right] = gains(step as f32 / 20.0);
            assert!((left * left + right * right - 2.0).abs() < 1e-5, "{step}");
            assert!((0.0..=1.415).contains(&left.max(0.0)) && right > -1e-6);
        }
        assert_eq!(gains(0.0), [1.0, 1.0]);
        assert!(gains(-1.0)[1].abs() < 1e-6 && gains(1.0)[0].abs() < 1e-6);
        let [left, right] = spread(&[], 512);
        assert!(left == right && left[100] == (100.0_f32 * 0.05).sin());
    }

    #[test]
    fn blocks_make_no_difference_and_nothing_leaves_full_scale_or_clicks() {
        let events = [at(777, 1.0), at(900, -1.0), at(901, 0.3), at(5_000, 0.0)];
        let whole = spread(&events, 9_600);
        for block in [1, 17, 64, 4_096] {
            assert!(spread(&events, block) == whole, "blocks of {block}");
        }
        for channel in &whole {
            assert!(channel.iter().all(|x| x.abs() <= 1.0));
            let step = channel.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max);
            assert!(step < 0.09, "{step}");
        }
        // Back in the middle, both are the instrument's again.
        assert!(whole[0][6_000..] == whole[1][6_000..]);
    }

    #[test]
    fn a_room_that_a_controller_opens_does_not_depend_on_blocks() {
        let amount = SettingNumber::RoomAmount;
        let events = [0.2, 0.9, 0.0]
            .into_iter()
            .zip([333, 4_001, 7_777])
            .map(|(value, at)| Timed { at, event: Event::Set(amount, value) })
            .collect::<Vec<_>>();
        let whole = spread(&events, 9_600);
        assert!(whole[0] != spread(&[], 9_600)[0]);
        for block in [1, 17, 480] {
            assert!(spread(&events, block) == whole, "blocks of {block}");
        }
    }
}
