//! TTLink over MIDI: frames as SysEx both ways; breath, angle and button as control changes from the knob.
//!
//! Breath and angle come as a coarse and a fine control change. Which of the two comes first is found out by waiting
//! 2 ms: coarse parts are passed on at once until the knob has shown that fine ones follow. Other MIDI is ignored.

use std::ops::Deref;

use crate::wire::frame::{FrameBody, FrameError, MAX_DECODED, Receiver, WireStats};
use crate::wire::message::Message;

/// Start of system exclusive, the identity for private use, `TT` and the major version.
const HEADER: [u8; 5] = [0xF0, 0x7D, 0x54, 0x54, 0x01];
const END: u8 = 0xF7;
/// Longest frame in groups of seven bytes and their top bits.
const MAX_PACKED: usize = MAX_DECODED + MAX_DECODED.div_ceil(7);
/// Longest SysEx, bytes.
pub const MAX_SYSEX: usize = HEADER.len() + MAX_PACKED + 1;
/// How long one half of a pair waits for the other, microseconds.
pub const PATIENCE_US: u64 = 2_000;

const CONTROL_CHANGE: u8 = 0xB0;
const BREATH: u8 = 2;
const ANGLE: u8 = 17;
const FINE: u8 = 32;
const BUTTON: u8 = 80;
/// Greatest value of a coarse and a fine part together.
pub const BREATH_MAX: u16 = 16_383;
/// The angle's zero.
const ANGLE_ZERO: i32 = 8_192;

/// A message as SysEx.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SysEx {
    bytes: [u8; MAX_SYSEX],
    length: usize,
}

impl Deref for SysEx {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
}

/// Encodes any message as SysEx, as [`encode`](crate::wire::encode) does for the serial line. Real-time safe.
pub fn encode_sysex(message: &Message, seq: u8) -> SysEx {
    let body = FrameBody::new(message, seq);
    let mut out = SysEx { bytes: [0; MAX_SYSEX], length: 0 };
    // PANIC: `MAX_SYSEX` counts header, end and the groups of the longest body.
    let mut put = |byte: u8| {
        out.bytes[out.length] = byte;
        out.length += 1;
    };
    HEADER.into_iter().for_each(&mut put);
    for group in body.chunks(7) {
        put(group.iter().enumerate().fold(0, |tops, (bit, byte)| tops | (byte >> 7) << bit));
        group.iter().for_each(|byte| put(byte & 0x7F));
    }
    put(END);
    out
}

/// Undoes the packing; `None` if the last group has top bits but no bytes.
fn unpack(packed: &[u8], out: &mut [u8; MAX_DECODED]) -> Option<usize> {
    let mut length = 0;
    for group in packed.chunks(8) {
        let (tops, lows) = group.split_first()?;
        if lows.is_empty() {
            return None;
        }
        for (bit, low) in lows.iter().enumerate() {
            *out.get_mut(length)? = low | (tops >> bit & 1) << 7;
            length += 1;
        }
    }
    Some(length)
}

/// What a knob says over MIDI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FromKnob {
    /// A message with its sequence number, or why the SysEx is none.
    Frame(Result<(u8, Message), FrameError>),
    /// Breath, 0..=16383 of the travel up to the wall.
    Breath(u16),
    /// Angle, 0.1 degrees.
    Angle(i32),
    /// Button, true while down.
    Button(bool),
}

#[derive(Clone, Copy, Debug)]
enum Half {
    Neither,
    /// Came at this time; `shown` if it was passed on without its fine part.
    Coarse {
        since_us: u64,
        shown: bool,
    },
    Fine {
        since_us: u64,
        fine: u8,
    },
}

/// A value on two controllers.
#[derive(Clone, Copy, Debug)]
struct Pair {
    coarse: Option<u8>,
    /// Both parts have come within the patience at least once.
    is_fine: bool,
    waiting: Half,
}

/// What a pair gives: a coarse part alone, or both parts as 14 bits.
#[derive(Clone, Copy, Debug)]
enum Reading {
    Coarse(u8),
    Both(u16),
}

impl Pair {
    const NEW: Self = Self { coarse: None, is_fine: false, waiting: Half::Neither };

    fn both(coarse: u8, fine: u8) -> Reading {
        Reading::Both(u16::from(coarse) << 7 | u16::from(fine))
    }

    /// Coarse part without a fine one: on a device that has fine parts the fine part is zero (MIDI 1.0).
    fn alone(&self, coarse: u8) -> Reading {
        if self.is_fine { Self::both(coarse, 0) } else { Reading::Coarse(coarse) }
    }

    /// What still waits, without its other half.
    fn flush(&mut self) -> Option<Reading> {
        match (std::mem::replace(&mut self.waiting, Half::Neither), self.coarse) {
            (Half::Coarse { shown: false, .. }, Some(coarse)) => Some(self.alone(coarse)),
            (Half::Fine { fine, .. }, Some(coarse)) => Some(Self::both(coarse, fine)),
            _ => None,
        }
    }

    fn poll(&mut self, t_us: u64) -> Option<Reading> {
        let since_us = match self.waiting {
            Half::Coarse { since_us, .. } | Half::Fine { since_us, .. } => since_us,
            Half::Neither => return None,
        };
        if t_us.saturating_sub(since_us) > PATIENCE_US { self.flush() } else { None }
    }

    fn coarse(&mut self, coarse: u8, t_us: u64) -> [Option<Reading>; 2] {
        let late = self.poll(t_us);
        if let Half::Fine { fine, .. } = self.waiting {
            *self = Self { coarse: Some(coarse), is_fine: true, waiting: Half::Neither };
            return [late, Some(Self::both(coarse, fine))];
        }
        // A second coarse part: nothing will refine the first.
        let late = late.or(self.flush());
        self.coarse = Some(coarse);
        self.waiting = Half::Coarse { since_us: t_us, shown: !self.is_fine };
        [late, if self.is_fine { None } else { Some(self.alone(coarse)) }]
    }

    fn fine(&mut self, fine: u8, t_us: u64) -> [Option<Reading>; 2] {
        let late = self.poll(t_us);
        if let (Half::Coarse { .. }, Some(coarse)) = (self.waiting, self.coarse) {
            self.is_fine = true;
            self.waiting = Half::Neither;
            return [late, Some(Self::both(coarse, fine))];
        }
        let late = late.or(self.flush());
        self.waiting = Half::Fine { since_us: t_us, fine };
        [late, None]
    }
}

fn breath_of(reading: Reading) -> FromKnob {
    FromKnob::Breath(match reading {
        // Full scale is full breath, with seven bits too.
        Reading::Coarse(coarse) => (u32::from(coarse) * u32::from(BREATH_MAX) / 127) as u16,
        Reading::Both(value) => value,
    })
}

fn angle_of(reading: Reading) -> FromKnob {
    FromKnob::Angle(match reading {
        // Not stretched: 64 has to be the zero.
        Reading::Coarse(coarse) => (i32::from(coarse) << 7) - ANGLE_ZERO,
        Reading::Both(value) => i32::from(value) - ANGLE_ZERO,
    })
}

/// Finds what a knob says in a stream of MIDI bytes, any channel, with running status. Real-time safe.
#[derive(Clone, Debug)]
pub struct MidiReceiver {
    /// Running status; 0 while there is none.
    status: u8,
    first_data: Option<u8>,
    in_sysex: bool,
    /// Bytes of the SysEx after F0; may exceed what `sysex` holds.
    length: usize,
    sysex: [u8; MAX_SYSEX],
    breath: Pair,
    angle: Pair,
    receiver: Receiver,
}

impl Default for MidiReceiver {
    fn default() -> Self {
        Self::new()
    }
}

impl MidiReceiver {
    /// A receiver that has heard nothing.
    pub fn new() -> Self {
        Self {
            status: 0,
            first_data: None,
            in_sysex: false,
            length: 0,
            sysex: [0; MAX_SYSEX],
            breath: Pair::NEW,
            angle: Pair::NEW,
            receiver: Receiver::default(),
        }
    }

    /// Takes bytes that came at `t_us`, whole messages or pieces, and hands what they complete to `sink`.
    pub fn feed(&mut self, bytes: &[u8], t_us: u64, mut sink: impl FnMut(FromKnob)) {
        for &byte in bytes {
            self.push(byte, t_us, &mut sink);
        }
    }

    /// Hands out halves that have waited long enough; to be called every millisecond or so.
    pub fn poll(&mut self, t_us: u64, mut sink: impl FnMut(FromKnob)) {
        self.breath.poll(t_us).map(breath_of).into_iter().for_each(&mut sink);
        self.angle.poll(t_us).map(angle_of).into_iter().for_each(&mut sink);
    }

    /// What was counted of SysEx frames so far.
    pub fn stats(&self) -> WireStats {
        self.receiver.stats
    }

    /// Counts from zero; what is being read and the sequence go on.
    pub fn forget_counts(&mut self) {
        self.receiver.stats = WireStats::default();
    }

    fn push(&mut self, byte: u8, t_us: u64, sink: &mut impl FnMut(FromKnob)) {
        match byte {
            // Clock and sensing may stand anywhere, inside a SysEx too.
            0xF8.. => {}
            0x00..=0x7F if self.in_sysex => {
                if let Some(free) = self.sysex.get_mut(self.length) {
                    *free = byte;
                }
                self.length = self.length.saturating_add(1);
            }
            0x00..=0x7F => match (self.status & 0xF0, self.first_data.take()) {
                (CONTROL_CHANGE, None) => self.first_data = Some(byte),
                (CONTROL_CHANGE, Some(controller)) => self.control(controller, byte, t_us, sink),
                _ => {}
            },
            0x80.. => {
                if self.in_sysex {
                    self.in_sysex = false;
                    self.end_sysex(byte == END, sink);
                }
                self.status = if byte < 0xF0 { byte } else { 0 };
                self.first_data = None;
                self.in_sysex = byte == HEADER[0];
                self.length = 0;
            }
        }
    }

    fn control(&mut self, controller: u8, value: u8, t_us: u64, sink: &mut impl FnMut(FromKnob)) {
        const BREATH_FINE: u8 = BREATH + FINE;
        const ANGLE_FINE: u8 = ANGLE + FINE;
        let (made, made_of): (_, fn(Reading) -> FromKnob) = match controller {
            BREATH => (self.breath.coarse(value, t_us), breath_of),
            BREATH_FINE => (self.breath.fine(value, t_us), breath_of),
            ANGLE => (self.angle.coarse(value, t_us), angle_of),
            ANGLE_FINE => (self.angle.fine(value, t_us), angle_of),
            BUTTON => return sink(FromKnob::Button(value >= 64)),
            _ => return,
        };
        made.into_iter().flatten().map(made_of).for_each(sink);
    }

    fn end_sysex(&mut self, is_whole: bool, sink: &mut impl FnMut(FromKnob)) {
        let given = self.length;
        let kept = &self.sysex[..given.min(MAX_SYSEX)];
        // Somebody else's exclusive message, or of another major version, is none of ours.
        let Some(packed) = kept.strip_prefix(&HEADER[1..]) else { return };
        let mut frame = [0; MAX_DECODED];
        let refused = if packed.len() > MAX_PACKED {
            Err(FrameError::TooLong { given })
        } else if !is_whole {
            Err(FrameError::CutShort { given })
        } else {
            unpack(packed, &mut frame).ok_or(FrameError::CutShort { given })
        };
        sink(FromKnob::Frame(match refused {
            Ok(length) => self.receiver.receive(&frame[..length], given),
            Err(error) => {
                self.receiver.count(&error, given);
                Err(error)
            }
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two control changes on the first channel: breath 0..=16383 of the travel up to the wall.
    fn encode_breath(breath: u16) -> [u8; 6] {
        pair(BREATH, breath.min(BREATH_MAX))
    }

    /// Two control changes on the first channel: the angle in 0.1 degrees, saturating.
    fn encode_angle(tenths_deg: i32) -> [u8; 6] {
        let value = tenths_deg.clamp(-ANGLE_ZERO, ANGLE_ZERO - 1) + ANGLE_ZERO;
        pair(ANGLE, value as u16)
    }

    fn pair(controller: u8, value: u16) -> [u8; 6] {
        let [coarse, fine] = [value >> 7, value & 0x7F].map(|part| part as u8);
        [CONTROL_CHANGE, controller, coarse, CONTROL_CHANGE, controller + FINE, fine]
    }

    /// Everything a fresh receiver says to timed pieces of MIDI and a last poll at the end.
    fn heard(pieces: &[(u64, &[u8])]) -> Vec<FromKnob> {
        let mut receiver = MidiReceiver::new();
        let mut found = Vec::new();
        for (t_us, bytes) in pieces {
            receiver.poll(*t_us, |said| found.push(said));
            receiver.feed(bytes, *t_us, |said| found.push(said));
        }
        receiver.poll(u64::MAX, |said| found.push(said));
        found
    }

    #[test]
    fn packing_is_the_one_worked_out_by_hand() {
        // FREE with seq 7 is 05 07 19 73 CA A2: top bits of bytes 4 and 5 make 30.
        let sysex = encode_sysex(&Message::Free, 7);
        let expected = [0xF0, 0x7D, 0x54, 0x54, 0x01, 0x30, 0x05, 0x07, 0x19, 0x73, 0x4A, 0x22, 0xF7];
        assert_eq!(sysex[..], expected);
        assert_eq!(heard(&[(0, &expected)]), [FromKnob::Frame(Ok((7, Message::Free)))]);
    }

    #[test]
    fn coarse_alone_is_full_breath_at_127() {
        let found = heard(&[(0, &[0xB3, 2, 0]), (1, &[0xB3, 2, 64]), (2, &[0xB3, 2, 127])]);
        assert_eq!(found, [0, 8_256, 16_383].map(FromKnob::Breath));
    }

    #[test]
    fn pairs_give_one_value_each_once_known_as_pairs() {
        let pieces: Vec<(u64, [u8; 6])> =
            (0..4).map(|i| (i * 10_000, encode_breath(5_000 + i as u16))).collect();
        let pieces: Vec<(u64, &[u8])> = pieces.iter().map(|(t, bytes)| (*t, &bytes[..])).collect();
        // The very first coarse part cannot know that a fine one follows.
        let first = 5_031; // 39/127 of full scale
        assert_eq!(heard(&pieces), [first, 5_000, 5_001, 5_002, 5_003].map(FromKnob::Breath));
    }

    #[test]
    fn fine_part_may_come_first() {
        let found = heard(&[
            (0, &[0xB0, 34, 5]),
            (1_500, &[0xB0, 2, 10]),
            (10_000, &[0xB0, 34, 6]),
            (10_000, &[0xB0, 2, 11]),
        ]);
        assert_eq!(found, [10 * 128 + 5, 11 * 128 + 6].map(FromKnob::Breath));
    }

    #[test]
    fn fine_part_alone_refines_after_the_patience() {
        let found = heard(&[(0, &encode_angle(10)), (10_000, &[0xB0, 49, 11]), (12_001, &[])]);
        assert_eq!(found, [0, 10, 11].map(FromKnob::Angle));
    }

    #[test]
    fn coarse_part_is_held_no_longer_than_the_patience() {
        let found = heard(&[(0, &encode_breath(300)), (10_000, &[0xB0, 2, 3]), (12_000, &[]), (12_001, &[])]);
        assert_eq!(found, [258, 300, 3 * 128].map(FromKnob::Breath));
    }

    #[test]
    fn fine_parts_without_end_starve_nothing() {
        let mut pieces: Vec<(u64, [u8; 3])> = vec![(0, [0xB0, 2, 1])];
        pieces.extend((0..100).map(|i| (10_000 + i * 500, [0xB0, 34, i as u8])));
        let pieces: Vec<(u64, &[u8])> = pieces.iter().map(|(t, bytes)| (*t, &bytes[..])).collect();
        assert_eq!(heard(&pieces).len(), 101);
    }

    #[test]
    fn angle_saturates_and_64_is_its_zero() {
        for (given, read) in [(-9_000, -8_192), (-1, -1), (0, 0), (8_191, 8_191), (9_000, 8_191)] {
            let found = heard(&[(0, &encode_angle(given))]);
            assert_eq!(found.last(), Some(&FromKnob::Angle(read)), "{given}");
        }
        assert_eq!(heard(&[(0, &[0xB0, 17, 64])]), [FromKnob::Angle(0)]);
    }

    #[test]
    fn running_status_and_clock_inside_a_message_are_understood() {
        let found = heard(&[(0, &[0xB0, 80, 0xF8, 127, 80, 0xFE, 0])]);
        assert_eq!(found, [true, false].map(FromKnob::Button));
        let mut sysex = encode_sysex(&Message::Free, 7).to_vec();
        sysex.insert(8, 0xF8);
        assert_eq!(heard(&[(0, &sysex)]), [FromKnob::Frame(Ok((7, Message::Free)))]);
    }

    #[test]
    fn other_exclusive_messages_are_ignored_and_damaged_ones_counted() {
        assert_eq!(heard(&[(0, &[0xF0, 0x43, 1, 2, 0xF7, 0xF0, 0x7D, 0x54, 0x54, 0x02, 0, 0xF7])]), []);
        let sysex = encode_sysex(&Message::Free, 7);
        let mut receiver = MidiReceiver::new();
        let mut found = Vec::new();
        receiver.feed(&sysex[..10], 0, |said| found.push(said));
        receiver.feed(&sysex, 0, |said| found.push(said));
        assert!(matches!(
            found[..],
            [FromKnob::Frame(Err(FrameError::CutShort { .. })), FromKnob::Frame(Ok(_))]
        ));
        assert_eq!((receiver.stats().length_errors, receiver.stats().frames), (1, 1));
    }

    #[test]
    fn longest_exclusive_message_fits() {
        let body = FrameBody::from_parts(0x05, 1, &[0xFF; 58]);
        assert_eq!(body.len(), MAX_DECODED);
        let mut frame = [0; MAX_DECODED];
        let packed: Vec<u8> = body
            .chunks(7)
            .flat_map(|group| {
                let tops = group.iter().enumerate().fold(0, |tops, (bit, byte)| tops | (byte >> 7) << bit);
                std::iter::once(tops).chain(group.iter().map(|byte| byte & 0x7F))
            })
            .collect();
        assert_eq!(packed.len(), MAX_PACKED);
        assert_eq!(unpack(&packed, &mut frame), Some(MAX_DECODED));
        assert_eq!(frame[..], body[..]);
        assert_eq!(unpack(&packed[..MAX_PACKED - 1], &mut frame), None, "the last group has one byte");
    }
}
