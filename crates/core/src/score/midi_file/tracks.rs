//! A MIDI file as the lines of several players: one for each track.
//!
//! Each track that holds notes is a line. Where all notes are in one track, as in every file of format 0, each channel with
//! notes is a line. A player hears the messages of its line and no others, so that each has a breath, volume and place of its
//! own. Key switches are no notes, and make no line. A message of no line, for example a controller in a track without notes, goes to the lines with notes on its channel,
//! or to all if there are none.

use super::{Hands, MidiFileError, decode, end, merged};
use crate::control::key_switches::KeySwitches;
use crate::control::midi::MidiDecoder;
use crate::control::parts::{MOST, Parts, Unplayed};
use crate::event::{Event, PartEvent, Timed, To};
use crate::score::timeline::Score;
use midly::{MetaMessage, MidiMessage, TrackEventKind};

/// One track, or one channel of the only track with notes.
struct Line {
    track: usize,
    /// Channels with notes, as bits.
    channels: u16,
    /// Whether messages on other channels are of another line, or of none.
    is_channel: bool,
    parts: Parts,
}

impl Line {
    /// Whether a message of this track and channel is this line's.
    fn has(&self, track: usize, channel: u8) -> bool {
        track == self.track && (!self.is_channel || self.is_on(channel))
    }

    fn is_on(&self, channel: u8) -> bool {
        self.channels >> channel & 1 == 1
    }
}

/// A file whose lines have players of their own.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracks {
    /// What they play.
    pub score: Score<PartEvent>,
    /// How many they are.
    pub players: usize,
    /// How often keys are struck that play nothing.
    pub unplayed: Unplayed,
}

/// Reads the bytes of a file as a score at the sample rate `rate`, Hz, with a player for each line, the first one first. Each line has a decoder that begins as `decoder`, key switches choose for all, and `playing` are the keys that
/// play a note, one bit each.
///
/// # Errors
///
/// As [`read`](super::read), and [`MidiFileError::Lines`] if there are more lines than players.
pub fn read_tracks(
    decoder: &MidiDecoder,
    (key_switches, playing): (KeySwitches, u128),
    bytes: &[u8],
    rate: u32,
) -> Result<Tracks, MidiFileError> {
    let (mut clock, messages) = merged(bytes, Hands::OfTrack)?;
    let noted = messages.iter().filter_map(|message| match message.kind {
        TrackEventKind::Midi { channel, message: MidiMessage::NoteOn { key, vel } } => {
            let is_note = vel > 0 && key_switches.chosen(key.as_int()).is_none();
            is_note.then_some((message.track, channel.as_int()))
        }
        _ => None,
    });
    let mut lines = lines(noted, decoder);
    for line in &mut lines {
        line.parts.set_key_switches(key_switches);
        line.parts.set_playing_keys(playing);
    }
    match lines.len() {
        0 => return Err(MidiFileError::NoNotes),
        found if found > MOST => return Err(MidiFileError::Lines { found, most: MOST }),
        _ => {}
    }
    let (mut events, mut tick, mut notes) = (Vec::new(), 0, 0_usize);
    for message in messages {
        clock.advance(message.tick - tick);
        tick = message.tick;
        let (channel, midi) = match message.kind {
            TrackEventKind::Midi { channel, message } => (channel.as_int(), message),
            TrackEventKind::Meta(MetaMessage::Tempo(us)) => {
                clock.set_tempo(us.as_int(), &message)?;
                continue;
            }
            _ => continue,
        };
        let at = clock.sample(rate)?;
        let is_switch = match midi {
            MidiMessage::NoteOn { key, .. } | MidiMessage::NoteOff { key, .. } => {
                key_switches.chosen(key.as_int()).is_some()
            }
            _ => false,
        };
        let (is_owned, is_shared) = (
            lines.iter().any(|line| line.has(message.track, channel)),
            lines.iter().any(|line| line.is_on(channel)),
        );
        for (player, line) in lines.iter_mut().enumerate() {
            let hears = match (is_owned, is_shared) {
                _ if is_switch => true,
                (true, _) => line.has(message.track, channel),
                (false, true) => line.is_on(channel),
                (false, false) => true,
            };
            if !hears {
                continue;
            }
            for &PartEvent { event, .. } in decode(&mut line.parts, channel, midi) {
                notes += usize::from(matches!(event, Event::NoteOn { .. }));
                events.push(Timed { at, event: PartEvent { to: To::Player(player as u8), event } });
            }
        }
    }
    let unplayed = std::array::from_fn(|key| lines.iter().map(|line| line.parts.unplayed()[key]).sum());
    if notes == 0 && unplayed == [0; 128] {
        return Err(MidiFileError::NoNotes);
    }
    let samples = end(&clock, &events, rate);
    for (player, line) in lines.iter_mut().enumerate() {
        let to = To::Player(player as u8);
        let ends = line.parts.let_go().iter().map(|said| PartEvent { to, event: said.event });
        events.extend(ends.map(|event| Timed { at: samples, event }));
    }
    Ok(Tracks { score: Score { events, samples }, players: lines.len(), unplayed })
}

/// The lines of notes on these tracks and channels, in the order of the file.
fn lines(noted: impl Iterator<Item = (usize, u8)>, decoder: &MidiDecoder) -> Vec<Line> {
    let mut tracks: Vec<(usize, u16)> = Vec::new();
    for (track, channel) in noted {
        match tracks.iter_mut().find(|(known, _)| *known == track) {
            Some((_, channels)) => *channels |= 1 << channel,
            None => tracks.push((track, 1 << channel)),
        }
    }
    tracks.sort_unstable();
    let is_channel = tracks.len() == 1;
    if let [(track, channels)] = tracks[..] {
        let each = (0..16).map(|channel| channels & 1 << channel).filter(|&channel| channel != 0);
        tracks = each.map(|channel| (track, channel)).collect();
    }
    let line = |(track, channels)| Line { track, channels, is_channel, parts: Parts::of(decoder.clone(), 1) };
    tracks.into_iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::file;
    use super::*;
    use crate::event::Fingerings;
    use crate::units::SoundingNote;

    const END: [u8; 4] = [0, 0xFF, 0x2F, 0];

    /// A track with a note of this key on this channel, after other messages at its beginning.
    fn track(channel: u8, key: u8, first: &[u8]) -> Vec<u8> {
        let note = [0, 0x90 | channel, key, 64, 96, 0x80 | channel, key, 0];
        [first, &note, &END].concat()
    }

    fn lines_of(format: u8, tracks: &[&[u8]]) -> (Vec<PartEvent>, usize) {
        let Tracks { score, players, .. } = read_tracks(
            &MidiDecoder::new(),
            (KeySwitches::Off, u128::MAX),
            &file(format, [0, 96], tracks),
            48_000,
        )
        .unwrap();
        (score.events.iter().map(|timed| timed.event).collect(), players)
    }

    /// Who begins which note.
    fn notes(events: &[PartEvent]) -> Vec<(To, u8)> {
        let begins = |event: &PartEvent| match event.event {
            Event::NoteOn { note: SoundingNote(key), .. } => Some((event.to, key)),
            _ => None,
        };
        events.iter().filter_map(begins).collect()
    }

    /// Who gets a pan, and which.
    fn pans(events: &[PartEvent]) -> Vec<(To, bool)> {
        let pan = |event: &PartEvent| match event.event {
            Event::Pan { position } => Some((event.to, position > 0.0)),
            _ => None,
        };
        events.iter().filter_map(pan).collect()
    }

    #[test]
    fn each_track_with_notes_has_a_player_and_hears_itself_alone() {
        // Both play on channel 1; the second is panned to the right. The first track has a tempo and no notes.
        let tempo = [&[0, 0xFF, 0x51, 3, 0x0F, 0x42, 0x40][..], &END].concat();
        let (one, two) = (track(0, 60, &[]), track(0, 64, &[0, 0xB0, 10, 100]));
        let (events, lines) = lines_of(1, &[&tempo, &one, &two]);
        assert_eq!(lines, 2);
        assert_eq!(notes(&events), [(To::Player(0), 60), (To::Player(1), 64)]);
        assert_eq!(pans(&events), [(To::Player(1), true)]);
        let bytes = file(1, [0, 96], &[&tempo, &one, &two]);
        let Tracks { score, .. } =
            read_tracks(&MidiDecoder::new(), (KeySwitches::Off, u128::MAX), &bytes, 48_000).unwrap();
        assert_eq!(score.samples, 48_000, "a beat of a second");
    }

    /// Two parts that meet on one note, in tracks that share a channel.
    #[test]
    fn tracks_that_play_one_key_of_one_channel_end_it_each_for_itself() {
        let one = [&[0, 0x90, 60, 64, 96, 0x80, 60, 0][..], &END].concat();
        let two = [&[48, 0x90, 60, 64, 96, 0x80, 60, 0][..], &END].concat();
        let (events, _) = lines_of(1, &[&one, &two]);
        let of = |player: u8| {
            let of_player = events.iter().filter(move |event| event.to == To::Player(player));
            of_player
                .filter(|event| matches!(event.event, Event::NoteOn { .. } | Event::NoteOff { .. }))
                .count()
        };
        assert_eq!((of(0), of(1)), (2, 2), "{events:?}");
        // The same for one player is a note that is struck again.
        let score = super::super::read(&file(1, [0, 96], &[&one, &two]), 48_000).unwrap();
        let at = |want: fn(&Event) -> bool| {
            score.events.iter().filter(|timed| want(&timed.event)).map(|timed| timed.at).collect::<Vec<_>>()
        };
        assert_eq!(at(|event| matches!(event, Event::NoteOn { .. })), [0, 12_000]);
        assert_eq!(at(|event| matches!(event, Event::NoteOff { .. })), [12_000, 36_000]);
    }

    #[test]
    fn in_one_track_each_channel_has_a_player() {
        let body = [&[0, 0x90, 60, 64, 0, 0x93, 64, 64, 0, 0xB3, 10, 0][..], &END].concat();
        let (events, lines) = lines_of(0, &[&body]);
        assert_eq!((lines, notes(&events)), (2, vec![(To::Player(0), 60), (To::Player(1), 64)]));
        assert_eq!(pans(&events), [(To::Player(1), false)]);
    }

    #[test]
    fn a_message_of_no_line_goes_to_its_channel_or_to_all() {
        let (one, two) = (track(0, 60, &[]), track(1, 64, &[]));
        let of_second = [&[0, 0xB1, 10, 0][..], &END].concat();
        let (events, _) = lines_of(1, &[&of_second, &one, &two]);
        assert_eq!(pans(&events), [(To::Player(1), false)]);
        let of_none = [&[0, 0xB5, 10, 0][..], &END].concat();
        let (events, _) = lines_of(1, &[&of_none, &one, &two]);
        assert_eq!(pans(&events), [(To::Player(0), false), (To::Player(1), false)]);
    }

    #[test]
    fn more_lines_than_players_are_refused() {
        let one = track(0, 60, &[]);
        let tracks = vec![&one[..]; MOST + 1];
        let refused = read_tracks(
            &MidiDecoder::new(),
            (KeySwitches::Off, u128::MAX),
            &file(1, [0, 96], &tracks),
            48_000,
        )
        .unwrap_err();
        assert_eq!(refused, MidiFileError::Lines { found: 17, most: 16 });
    }

    /// The row in a track of its own, as a user writes it.
    #[test]
    fn key_switches_in_a_track_of_their_own_are_no_line_and_choose_for_all() {
        let tracks: [&[u8]; 3] = [&track(0, 60, &[]), &track(0, 64, &[]), &track(0, 25, &[])];
        let bytes = file(1, [0, 96], &tracks);
        let read = |row| read_tracks(&MidiDecoder::new(), (row, u128::MAX), &bytes, 48_000).unwrap();
        let Tracks { score, players, .. } = read(KeySwitches::C1);
        assert_eq!(players, 2);
        let choices: Vec<_> = score
            .events
            .iter()
            .filter(|timed| matches!(timed.event.event, Event::Fingerings(Fingerings::Alternate(1))))
            .map(|timed| (timed.at, timed.event.to))
            .collect();
        assert_eq!(choices, [(0, To::Player(0)), (0, To::Player(1))]);
        assert_eq!(read(KeySwitches::Off).players, 3, "off, they are notes");
        // Nor does it matter in which track or on which channel they are.
        let with_notes: &[u8] = &[0, 0x90, 25, 64, 0, 0x90, 60, 64, 96, 0x80, 60, 0, 0, 0xFF, 0x2F, 0];
        let bytes = file(1, [0, 96], &[with_notes, &track(1, 64, &[])]);
        let Tracks { score, .. } =
            read_tracks(&MidiDecoder::new(), (KeySwitches::C1, u128::MAX), &bytes, 48_000).unwrap();
        let chosen = score.events.iter().filter(|timed| matches!(timed.event.event, Event::Fingerings(_)));
        let chosen: Vec<_> = chosen.map(|timed| timed.event.to).collect();
        assert_eq!(chosen, [To::Player(0), To::Player(1)]);
    }
}
