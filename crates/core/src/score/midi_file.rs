//! Reads standard MIDI files, formats 0 and 1, as a score.
//!
//! Tracks are merged by tick. At one tick the earlier track and the earlier message come first, so that a file always plays
//! the same way. Tempo changes of every track count. Time is an exact fraction, and is rounded once, to the nearest sample.
//! Notes are sounding pitches. Format 2 (independent patterns) is refused; messages other than channel messages, tempo and
//! the end of a track are ignored.
//!
//! A key that is struck again before it has come up is let go first, so that both notes begin and end as written: recorded
//! and quantised parts often overlap so. At the end of the last track, pedal and keys that are still down come up.
//!
//! A damaged file is refused with the byte at which reading stopped; it is not played up to there.
//! Source: Standard MIDI Files 1.0 (RP-001, 1988).

mod tracks;

use crate::control::midi::MidiDecoder;
use crate::control::notes::{NoteAddress, NoteExpression};
use crate::control::parts::Parts;
use crate::event::{Event, PartEvent, Timed};
use crate::score::samples::SECONDS_MAX;
use crate::score::timeline::Score;
use midly::{EventIter, MetaMessage, MidiMessage, TrackEventKind};
use std::collections::{HashMap, VecDeque};
pub use tracks::{Tracks, read_tracks};

/// Microseconds in a quarter note until the file sets a tempo (Standard MIDI Files 1.0).
const DEFAULT_TEMPO_US: u32 = 500_000;

/// Why a MIDI file was refused. Positions are bytes from the start of the file.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum MidiFileError {
    /// The file is of another kind, or empty; holds its first bytes.
    #[error("not a standard MIDI file: it should begin with MThd{}", begins(.0))]
    NotMidi(Vec<u8>),
    /// The header is cut short.
    #[error("MIDI header is cut short: {length} bytes of 14")]
    Header {
        /// Length of the file, bytes.
        length: usize,
    },
    /// The format is not 0, 1 or 2.
    #[error("MIDI format must be 0 or 1, got {0}")]
    Format(u16),
    /// The time code counts an unknown number of frames per second.
    #[error("MIDI time code must count 24, 25, 29 or 30 frames a second, got {0}")]
    Frames(u8),
    /// The file has format 2.
    #[error("MIDI format 2 (unrelated patterns) cannot be played as one piece; save it as format 0 or 1")]
    Format2,
    /// The header gives no ticks.
    #[error("MIDI header gives 0 ticks per beat or frame; expected 1 or more, usually 480 or 960")]
    NoTicks,
    /// A tempo says that a beat takes no time.
    #[error("MIDI track {track} has a tempo of 0 us for a beat at tick {tick}, in which no time would pass")]
    Tempo {
        /// Track, counted from 1.
        track: usize,
        /// Since the beginning.
        tick: u64,
    },
    /// The file ends before a chunk does.
    #[error(
        "MIDI file ends at byte {end}, but the chunk at byte {start} should go on to byte {wanted}; is it a whole file?"
    )]
    Truncated {
        /// First byte of the chunk.
        start: usize,
        /// Where the chunk should end.
        wanted: usize,
        /// Where the file ends.
        end: usize,
    },
    /// The file holds fewer tracks than its header says.
    #[error("MIDI header announces {announced} tracks, the file holds {found}; is it a whole file?")]
    Tracks {
        /// Tracks in the header.
        announced: u16,
        /// Tracks in the file.
        found: u16,
    },
    /// A track holds bytes that are no valid message.
    #[error("MIDI track {track} is damaged: no valid message at byte {at}")]
    Message {
        /// Track, counted from 1.
        track: usize,
        /// First byte of the message.
        at: usize,
    },
    /// The file holds no notes.
    #[error("MIDI file holds no notes; expected at least one note-on")]
    NoNotes,
    /// The file has more lines than there can be players.
    #[error(
        "MIDI file has {found} tracks or channels with notes; at most {most} can have a player each: play all of them together, or leave some out"
    )]
    Lines {
        /// Tracks or channels with notes.
        found: usize,
        /// Most players.
        most: usize,
    },
    /// The file lasts longer than 6 hours.
    #[error("MIDI file lasts {hours:.1} hours; at most {} can be rendered", SECONDS_MAX / 3600)]
    TooLong {
        /// Length of the file, hours.
        hours: f64,
    },
}

fn begins(bytes: &[u8]) -> String {
    if bytes.is_empty() {
        ", but it is empty".to_owned()
    } else {
        format!(", but begins with {:?}", String::from_utf8_lossy(bytes))
    }
}

/// A message of any track, with its position in ticks.
#[derive(Clone, Copy)]
struct Message<'a> {
    tick: u64,
    /// Track, counted from 1.
    track: usize,
    kind: TrackEventKind<'a>,
}

/// Seconds as a fraction with a fixed denominator: `numerator / per_second`.
struct Clock {
    /// Whether ticks are parts of a quarter note; otherwise they are parts of a film frame.
    metrical: bool,
    per_second: u128,
    per_tick: u128,
    numerator: u128,
}

/// The header's division of time: ticks per quarter note, or minus frames per second and ticks per frame.
fn clock(high: u8, low: u8) -> Result<Clock, MidiFileError> {
    let metrical = high < 128;
    let (per_second, per_tick) = if metrical {
        (u128::from(u16::from_be_bytes([high, low])) * 1_000_000, u128::from(DEFAULT_TEMPO_US))
    } else {
        // 29 stands for 30000/1001 frames per second.
        let (frames, seconds) = match high.wrapping_neg() {
            29 => (30_000, 1001),
            frames @ (24 | 25 | 30) => (u128::from(frames), 1),
            frames => return Err(MidiFileError::Frames(frames)),
        };
        (frames * u128::from(low), seconds)
    };
    if per_second == 0 {
        return Err(MidiFileError::NoTicks);
    }
    Ok(Clock { metrical, per_second, per_tick, numerator: 0 })
}

impl Clock {
    fn advance(&mut self, ticks: u64) {
        self.numerator += u128::from(ticks) * self.per_tick;
    }

    /// A tempo at this message. It does not count where ticks are parts of a film frame.
    fn set_tempo(&mut self, us_per_beat: u32, at: &Message) -> Result<(), MidiFileError> {
        if self.metrical && us_per_beat == 0 {
            return Err(MidiFileError::Tempo { track: at.track, tick: at.tick });
        }
        if self.metrical {
            self.per_tick = u128::from(us_per_beat);
        }
        Ok(())
    }

    fn sample(&self, rate: u32) -> Result<usize, MidiFileError> {
        if self.numerator > u128::from(SECONDS_MAX) * self.per_second {
            return Err(MidiFileError::TooLong {
                hours: self.numerator as f64 / self.per_second as f64 / 3600.0,
            });
        }
        let rounded = (2 * self.numerator * u128::from(rate) + self.per_second) / (2 * self.per_second);
        Ok(rounded as usize)
    }
}

/// Reads the bytes of a file as a score at the sample rate `rate`, Hz. The score ends with its longest track.
///
/// # Errors
///
/// [`MidiFileError`] says what is wrong with the file, and at which byte.
pub fn read(bytes: &[u8], rate: u32) -> Result<Score, MidiFileError> {
    Ok((&read_parts(&mut Parts::of(MidiDecoder::new(), 1), bytes, rate)?).into())
}

/// As [`read`], for several players, whose decoders have been set up for the file.
///
/// # Errors
///
/// As [`read`].
pub fn read_parts(parts: &mut Parts, bytes: &[u8], rate: u32) -> Result<Score<PartEvent>, MidiFileError> {
    let (mut clock, messages) = merged(bytes, Hands::OfAll)?;
    let (mut events, mut tick, mut notes) = (Vec::new(), 0, 0usize);
    for message in messages {
        clock.advance(message.tick - tick);
        tick = message.tick;
        let decoded = match message.kind {
            TrackEventKind::Midi { channel, message } => decode(parts, channel.as_int(), message),
            TrackEventKind::Meta(MetaMessage::Tempo(us)) => {
                clock.set_tempo(us.as_int(), &message)?;
                &[]
            }
            _ => &[],
        };
        for &event in decoded {
            notes += usize::from(matches!(event.event, Event::NoteOn { .. }));
            events.push(Timed { at: clock.sample(rate)?, event });
        }
    }
    if notes == 0 && parts.unplayed().iter().all(|&count| count == 0) {
        return Err(MidiFileError::NoNotes);
    }
    let samples = end(&clock, &events, rate);
    events.extend(parts.let_go().iter().map(|&event| Timed { at: samples, event }));
    Ok(Score { events, samples })
}

/// Where a file ends: with its longest track, or with its last event if the track would last for more hours than can be rendered.
fn end(clock: &Clock, events: &[Timed<PartEvent>], rate: u32) -> usize {
    clock.sample(rate).unwrap_or_else(|_| events.last().map_or(0, |last| last.at))
}

fn decode(parts: &mut Parts, channel: u8, message: MidiMessage) -> &[PartEvent] {
    match message {
        MidiMessage::NoteOn { key, vel } => parts.note_on(channel, key.as_int(), vel.as_int()),
        MidiMessage::NoteOff { key, .. } => parts.note_off(channel, key.as_int()),
        MidiMessage::Controller { controller, value } => {
            parts.controller(channel, controller.as_int(), value.as_int())
        }
        MidiMessage::ChannelAftertouch { vel } => parts.pressure(channel, vel.as_int()),
        MidiMessage::PitchBend { bend } => parts.bend(channel, bend.0.as_int()),
        MidiMessage::Aftertouch { key, vel } => {
            let breath = NoteExpression::Breath(f32::from(vel.as_int()) / 127.0);
            parts.express(NoteAddress::of_key(channel, key.as_int()), breath)
        }
        MidiMessage::ProgramChange { .. } => &[],
    }
}

/// Whose keys a channel's are.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Hands {
    /// The channel's, in whatever tracks it is.
    OfAll,
    /// Each track has its own, though they share a channel.
    OfTrack,
}

/// The messages of all tracks, in order of time.
fn merged(bytes: &[u8], hands: Hands) -> Result<(Clock, Vec<Message<'_>>), MidiFileError> {
    // A RIFF wrapper (.rmi) holds an ordinary file further in.
    let start = if bytes.starts_with(b"RIFF") { find(bytes, b"MThd").unwrap_or(0) } else { 0 };
    let file = &bytes[start..];
    if !file.starts_with(b"MThd") {
        return Err(MidiFileError::NotMidi(bytes[..bytes.len().min(4)].to_vec()));
    }
    let &[_, _, _, _, _, _, _, _, f0, f1, t0, t1, d0, d1, ..] = file else {
        return Err(MidiFileError::Header { length: file.len() });
    };
    let (announced, clock) = (u16::from_be_bytes([t0, t1]), clock(d0, d1)?);
    match u16::from_be_bytes([f0, f1]) {
        0 | 1 => {}
        2 => return Err(MidiFileError::Format2),
        other => return Err(MidiFileError::Format(other)),
    }
    let mut messages = Vec::new();
    let (mut at, mut track) = (0, 0u16);
    // Padding or a wrapper's other chunks may follow the last track.
    while at < file.len() && (at == 0 || track < announced) {
        let Some(length) = file.get(at + 4..at + 8) else { break };
        // PANIC: the slice above has four bytes.
        let length = u32::from_be_bytes([length[0], length[1], length[2], length[3]]) as usize;
        let (first, end) = (at + 8, (at + 8).saturating_add(length));
        let Some(body) = file.get(first..end) else {
            return Err(MidiFileError::Truncated {
                start: start + at,
                wanted: start.saturating_add(end),
                end: bytes.len(),
            });
        };
        if file[at..].starts_with(b"MTrk") {
            track += 1;
            read_track(body, usize::from(track), start + first, &mut messages)?;
        }
        at = end;
    }
    if track < announced {
        return Err(MidiFileError::Tracks { announced, found: track });
    }
    messages.sort_by_key(|m: &Message| m.tick);
    let mut held = HashMap::new();
    for together in messages.chunk_by_mut(|a, b| a.tick == b.tick) {
        end_before_beginning(together, hands, &mut held);
    }
    Ok((clock, apart(messages, hands)))
}

/// A key: its track, where each has its own; its channel, and its number.
type KeyOf = (usize, u8, u8);

/// The key of a message, and whether the message strikes it or lets it go.
fn key_of(message: &Message, hands: Hands) -> Option<(KeyOf, bool)> {
    let (channel, key, is_down) = match message.kind {
        TrackEventKind::Midi { channel, message: MidiMessage::NoteOn { key, vel } } => {
            (channel, key, vel > 0)
        }
        TrackEventKind::Midi { channel, message: MidiMessage::NoteOff { key, .. } } => (channel, key, false),
        _ => return None,
    };
    let track = if hands == Hands::OfTrack { message.track } else { 0 };
    Some(((track, channel.as_int(), key.as_int()), is_down))
}

/// Notes of one key that overlap, apart: the earlier one ends where the later one begins, and its own end is left out. Of keys that do not
/// come up as often as they are struck no end is left out: it cannot be told whose they are.
fn apart(messages: Vec<Message<'_>>, hands: Hands) -> Vec<Message<'_>> {
    let mut balance: HashMap<KeyOf, i32> = HashMap::new();
    for (key, is_down) in messages.iter().filter_map(|message| key_of(message, hands)) {
        *balance.entry(key).or_default() += if is_down { 1 } else { -1 };
    }
    let mut held: HashMap<KeyOf, u32> = HashMap::new();
    let mut all = Vec::with_capacity(messages.len());
    for message in messages {
        match key_of(&message, hands) {
            Some((key, true)) => {
                let held = held.entry(key).or_default();
                if *held > 0
                    && let TrackEventKind::Midi { channel, message: MidiMessage::NoteOn { key, vel } } =
                        message.kind
                {
                    let up = TrackEventKind::Midi { channel, message: MidiMessage::NoteOff { key, vel } };
                    all.push(Message { kind: up, ..message });
                }
                *held += 1;
            }
            Some((key, false)) => {
                let is_balanced = balance.get(&key) == Some(&0);
                let held = held.entry(key).or_default();
                *held = if is_balanced { held.saturating_sub(1) } else { 0 };
                if *held > 0 {
                    continue;
                }
            }
            None => {}
        }
        all.push(message);
    }
    all
}

/// Messages of one tick. A key that is held, and struck again where it ends, ends first: otherwise its end would end the new note.
/// Files with several tracks have these two in any order. `held` says which keys are, of all channels.
fn end_before_beginning(together: &mut [Message], hands: Hands, held: &mut HashMap<KeyOf, bool>) {
    let mut ends: HashMap<KeyOf, VecDeque<usize>> = HashMap::new();
    for (at, message) in together.iter().enumerate() {
        if let Some((key, false)) = key_of(message, hands) {
            ends.entry(key).or_default().push_back(at);
        }
    }
    let mut order = Vec::with_capacity(together.len());
    let mut is_moved = vec![false; together.len()];
    for (at, message) in together.iter().enumerate() {
        if is_moved[at] {
            continue;
        }
        if let Some((key, is_down)) = key_of(message, hands) {
            let of_key = ends.entry(key).or_default();
            while of_key.front().is_some_and(|&end| end <= at) {
                of_key.pop_front();
            }
            if is_down
                && held.get(&key) == Some(&true)
                && let Some(end) = of_key.pop_front()
            {
                is_moved[end] = true;
                order.push(end);
            }
            held.insert(key, is_down);
        }
        order.push(at);
    }
    let ordered: Vec<Message> = order.into_iter().map(|at| together[at]).collect();
    together.copy_from_slice(&ordered);
}

fn read_track<'a>(
    body: &'a [u8],
    track: usize,
    offset: usize,
    messages: &mut Vec<Message<'a>>,
) -> Result<(), MidiFileError> {
    let mut track_events = EventIter::new(body);
    let mut tick = 0u64;
    loop {
        let before = track_events.unread().len();
        match track_events.next() {
            Some(Ok(event)) => {
                tick += u64::from(event.delta.as_int());
                messages.push(Message { tick, track, kind: event.kind });
                if event.kind == TrackEventKind::Meta(MetaMessage::EndOfTrack) {
                    return Ok(());
                }
            }
            // The iterator also ends at a message that it cannot read. Only without unread bytes is it the end.
            None if before == 0 => return Ok(()),
            None | Some(Err(_)) => {
                return Err(MidiFileError::Message { track, at: offset + body.len() - before });
            }
        }
    }
}

fn find(bytes: &[u8], word: &[u8]) -> Option<usize> {
    bytes.windows(word.len()).position(|w| w == word)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dsp::white::White;
    use crate::instrument::KeyNotes;
    use crate::units::SoundingNote;

    /// A file from a division and the bodies of its tracks.
    pub(super) fn file(format: u8, division: [u8; 2], tracks: &[&[u8]]) -> Vec<u8> {
        let mut bytes = b"MThd\0\0\0\x06\0".to_vec();
        bytes.extend([format, 0, tracks.len() as u8, division[0], division[1]]);
        for track in tracks {
            bytes.extend(b"MTrk");
            bytes.extend((track.len() as u32).to_be_bytes());
            bytes.extend(*track);
        }
        bytes
    }

    const NOTE: &[u8] = &[0, 0x90, 60, 64, 96, 0x80, 60, 0, 0, 0xFF, 0x2F, 0];

    fn positions(bytes: &[u8], rate: u32) -> Vec<usize> {
        read(bytes, rate).unwrap().events.iter().map(|e| e.at).collect()
    }

    #[test]
    fn tempo_of_another_track_counts_and_time_is_rounded_once() {
        let tempo: &[u8] =
            &[0, 0xFF, 0x51, 3, 0x07, 0xA1, 0x21, 48, 0xFF, 0x51, 3, 0x0F, 0x42, 0x40, 0, 0xFF, 0x2F, 0];
        let bytes = file(1, [0, 96], &[tempo, NOTE]);
        // 48 ticks at 500.001 ms a beat, then 48 at 1 s.
        assert_eq!(positions(&bytes, 48_000), [0, (0.75 * 48_000.0_f64).round() as usize]);
        assert_eq!(positions(&bytes, 44_100), [0, 33_075]);
        assert_eq!(positions(&file(0, [0, 96], &[NOTE]), 44_100), [0, 22_050]);
    }

    /// The slow reference: each end is looked for, and moved before its beginning.
    fn ends_moved(together: &mut [Message], hands: Hands, held: &mut HashMap<KeyOf, bool>) {
        let mut at = 0;
        while at < together.len() {
            if let Some((key, true)) = key_of(&together[at], hands)
                && held.get(&key) == Some(&true)
                && let Some(end) =
                    together[at..].iter().position(|message| key_of(message, hands) == Some((key, false)))
            {
                together[at..=at + end].rotate_right(1);
            }
            if let Some((key, is_down)) = key_of(&together[at], hands) {
                held.insert(key, is_down);
            }
            at += 1;
        }
    }

    #[test]
    fn ends_of_one_tick_come_before_beginnings_as_the_slow_reference_has_them() {
        let mut white = White::new(7);
        let mut below = |most: f64| ((white.next() / 3.0_f64.sqrt() * 0.5 + 0.5) * most) as u8;
        for _ in 0..3_000 {
            let message = |track: u8, key: u8, vel: u8| Message {
                tick: 0,
                track: usize::from(track) + 1,
                kind: TrackEventKind::Midi {
                    channel: 0.into(),
                    message: MidiMessage::NoteOn { key: (60 + key).into(), vel: vel.into() },
                },
            };
            let mut fast: Vec<_> =
                (0..below(12.0)).map(|_| message(below(2.0), below(3.0), below(2.0))).collect();
            let mut slow = fast.clone();
            let hands = if below(2.0) == 0 { Hands::OfAll } else { Hands::OfTrack };
            let mut held: [HashMap<KeyOf, bool>; 2] = Default::default();
            if let Some((key, _)) = fast.first().and_then(|first| key_of(first, hands)) {
                held.iter_mut().for_each(|held| held.extend([(key, true)]));
            }
            end_before_beginning(&mut fast, hands, &mut held[0]);
            ends_moved(&mut slow, hands, &mut held[1]);
            let mut pairs = fast.iter().zip(&slow);
            assert!(pairs.all(|(a, b)| (a.track, a.kind) == (b.track, b.kind)));
            assert_eq!(held[0], held[1]);
        }
    }

    #[test]
    fn smpte_time_is_frames() {
        // 25 frames of 40 ticks: a millisecond a tick. 29 is 30000/1001.
        assert_eq!(positions(&file(0, [0xE7, 40], &[NOTE]), 48_000), [0, 96 * 48]);
        let wanted = (96.0 * 1001.0 / 30_000.0 / 4.0 * 48_000.0_f64).round() as usize;
        assert_eq!(positions(&file(0, [0xE3, 4], &[NOTE]), 48_000), [0, wanted]);
    }

    #[test]
    fn one_tick_keeps_the_order_of_tracks_and_messages() {
        let first: &[u8] = &[0, 0xB0, 2, 1, 0, 0xB0, 2, 2, 0, 0xFF, 0x2F, 0];
        let score = read(&file(1, [0, 96], &[first, NOTE]), 48_000).unwrap();
        // The first value waits for a key or for a second one.
        let [a, b, _] = score.events[..] else { panic!("{score:?}") };
        assert_eq!(a.event, Event::Breath(2.0 / 127.0));
        assert!(matches!(b.event, Event::NoteOn { note: SoundingNote(60), .. }));
    }

    #[test]
    fn a_key_that_ends_where_it_begins_again_ends_first_in_whichever_track_it_is() {
        let track = |from: u8| [from, 0x90, 60, 64, 96, 0x80, 60, 0, 0, 0xFF, 0x2F, 0];
        for tracks in [[track(0), track(96)], [track(96), track(0)]] {
            let score = read(&file(1, [0, 96], &[&tracks[0], &tracks[1]]), 48_000).unwrap();
            let heard: Vec<_> =
                score.note_spans(&KeyNotes::default()).iter().map(|span| (span.from, span.to)).collect();
            assert_eq!(heard, [(0, 24_000), (24_000, 48_000)]);
        }
        // A note of no length stays one: the key is not held before it.
        let brief: &[u8] = &[0, 0x90, 60, 64, 0, 0x80, 60, 0, 96, 0xFF, 0x2F, 0];
        let score = read(&file(0, [0, 96], &[brief]), 48_000).unwrap();
        assert!(matches!(score.events[..], [on, off] if matches!(on.event, Event::NoteOn { .. })
            && matches!(off.event, Event::NoteOff { .. })));
    }

    fn spans(bytes: &[u8]) -> Vec<(usize, usize)> {
        let score = read(bytes, 48_000).unwrap();
        score.note_spans(&KeyNotes::default()).iter().map(|span| (span.from, span.to)).collect()
    }

    /// Recorded and quantised parts overlap: the second note is struck a little before the first has come up.
    #[test]
    fn a_key_that_is_struck_again_before_it_comes_up_has_both_notes() {
        let overlap: &[u8] =
            &[0, 0x90, 60, 64, 96, 0x90, 60, 64, 5, 0x80, 60, 0, 91, 0x80, 60, 0, 0, 0xFF, 0x2F, 0];
        assert_eq!(spans(&file(0, [0, 96], &[overlap])), [(0, 24_000), (24_000, 48_000)]);
        // Three, of which the first comes up after the third has begun.
        let three: &[u8] = &[
            0, 0x90, 60, 64, 96, 0x90, 60, 64, 96, 0x90, 60, 64, 1, 60, 0, 1, 60, 0, 94, 60, 0, 0, 0xFF,
            0x2F, 0,
        ];
        let each = [(0, 24_000), (24_000, 48_000), (48_000, 72_000)];
        assert_eq!(spans(&file(0, [0, 96], &[three])), each);
        // An end is missing: no note hangs.
        let missing: &[u8] = &[0, 0x90, 60, 64, 96, 0x90, 60, 64, 96, 0x80, 60, 0, 96, 0xFF, 0x2F, 0];
        assert_eq!(spans(&file(0, [0, 96], &[missing])).last().map(|span| span.1), Some(48_000));
    }

    #[test]
    fn a_file_lasts_as_long_as_its_longest_track_and_nothing_is_held_at_its_end() {
        // A note that the pedal holds, and one that never comes up.
        let pedalled: &[u8] = &[0, 0xB0, 64, 127, 0, 0x90, 60, 64, 96, 0x80, 60, 0, 96, 0xFF, 0x2F, 0];
        let drone: &[u8] = &[0, 0x90, 60, 64, 0x81, 0x40, 0xFF, 0x2F, 0];
        for track in [pedalled, drone] {
            let bytes = file(0, [0, 96], &[track]);
            assert_eq!((spans(&bytes), read(&bytes, 48_000).unwrap().samples), (vec![(0, 48_000)], 48_000));
            let lines =
                read_tracks(&MidiDecoder::new(), (Default::default(), u128::MAX), &bytes, 48_000).unwrap();
            let last = lines.score.events.last().unwrap();
            assert!(matches!(last.event.event, Event::NoteOff { .. }) && last.at == 48_000);
        }
        let silence: &[u8] = &[0x83, 0x00, 0xFF, 0x2F, 0];
        assert_eq!(read(&file(1, [0, 96], &[NOTE, silence]), 48_000).unwrap().samples, 96_000);
    }

    #[test]
    fn keys_that_play_nothing_are_counted_and_left_out() {
        let low: &[u8] = &[0, 0x90, 20, 64, 96, 0x80, 20, 0, 0, 0xFF, 0x2F, 0];
        let mut parts = Parts::new(1);
        parts.set_playing_keys(!(1 << 20));
        let score = read_parts(&mut parts, &file(1, [0, 96], &[NOTE, low]), 48_000).unwrap();
        assert_eq!((score.events.len(), parts.unplayed()[20], parts.unplayed()[60]), (2, 1, 0));
        assert!(read_parts(&mut parts, &file(0, [0, 96], &[low]), 48_000).unwrap().events.is_empty());
    }

    #[test]
    fn running_status_and_velocity_zero_are_understood() {
        let track: &[u8] = &[0, 0x90, 60, 64, 10, 60, 0, 0, 0xFF, 0x2F, 0];
        let score = read(&file(0, [0, 96], &[track]), 48_000).unwrap();
        assert_eq!(score.events[1].event, Event::NoteOff { note: SoundingNote(60) });
    }

    #[test]
    fn a_damaged_file_is_refused_where_it_breaks() {
        let whole = file(0, [0, 96], &[NOTE]);
        for length in 0..whole.len() {
            assert!(read(&whole[..length], 48_000).is_err(), "first {length} bytes");
        }
        let cut = read(&whole[..whole.len() - 1], 48_000).unwrap_err();
        assert_eq!(cut, MidiFileError::Truncated { start: 14, wanted: 34, end: 33 });
        let bad: &[u8] = &[0, 0x90, 60, 64, 0, 0xF4, 0];
        assert_eq!(
            read(&file(0, [0, 96], &[bad]), 48_000).unwrap_err(),
            MidiFileError::Message { track: 1, at: 22 + 4 }
        );
        assert_eq!(read(&file(2, [0, 96], &[NOTE]), 48_000).unwrap_err(), MidiFileError::Format2);
        let mut wide = file(1, [0, 96], &[NOTE]);
        wide[8] = 1;
        assert_eq!(read(&wide, 48_000).unwrap_err(), MidiFileError::Format(0x0101));
        assert_eq!(read(&file(0, [0, 0], &[NOTE]), 48_000).unwrap_err(), MidiFileError::NoTicks);
        assert_eq!(
            read(&file(0, [0, 96], &[&[0, 0xFF, 0x2F, 0]]), 48_000).unwrap_err(),
            MidiFileError::NoNotes
        );
        assert!(read(b"RIFF....WAVE", 48_000).unwrap_err().to_string().contains("begins with \"RIFF\""));
        let mut two = whole.clone();
        two[11] = 2;
        assert_eq!(read(&two, 48_000).unwrap_err(), MidiFileError::Tracks { announced: 2, found: 1 });
    }

    #[test]
    fn a_file_of_days_is_refused() {
        let slow: &[u8] =
            &[0, 0xFF, 0x51, 3, 255, 255, 255, 0xFF, 0xFF, 0xFF, 0x7F, 0x90, 60, 64, 0, 0xFF, 0x2F, 0];
        assert!(matches!(read(&file(0, [0, 1], &[slow]), 48_000), Err(MidiFileError::TooLong { .. })));
    }

    /// Any bytes give a score or an error, never a panic.
    #[test]
    fn no_bytes_cause_a_panic() {
        let whole = file(1, [0, 96], &[NOTE, NOTE]);
        for at in 0..whole.len() {
            for value in 0..=255 {
                let mut bytes = whole.clone();
                bytes[at] = value;
                let _ = read(&bytes, 48_000);
            }
        }
    }
}
