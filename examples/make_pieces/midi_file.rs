//! Tracks of a MIDI file of format 1: one for the tempo, one for each player.

use super::notation::TICKS_PER_QUARTER;
use super::playing::Events;
use midly::num::{u4, u15, u24, u28};
use midly::{Format, Header, MetaMessage, Smf, Timing, TrackEvent, TrackEventKind};

/// What belongs to all players.
pub struct Heading {
    pub title: &'static str,
    /// Beats in a bar, and the power of two that is their part of a whole note.
    pub time_signature: (u8, u8),
    /// MIDI clocks (24 in a quarter) between two clicks of a metronome.
    pub clocks_per_click: u8,
    /// Quarter notes a minute from a tick on.
    pub tempo: Vec<(u32, f64)>,
}

/// The whole file. Each player has a track and a channel of its own.
pub fn file(heading: &Heading, players: Vec<Events>) -> Smf<'static> {
    let (numerator, denominator) = heading.time_signature;
    let signature = MetaMessage::TimeSignature(numerator, denominator, heading.clocks_per_click, 8);
    let mut conductor = vec![
        (0, TrackEventKind::Meta(MetaMessage::TrackName(heading.title.as_bytes()))),
        (0, TrackEventKind::Meta(signature)),
    ];
    for &(tick, quarters_a_minute) in &heading.tempo {
        let us = u24::new((60e6 / quarters_a_minute).round() as u32);
        conductor.push((tick, TrackEventKind::Meta(MetaMessage::Tempo(us))));
    }
    let mut smf = Smf::new(Header::new(Format::Parallel, Timing::Metrical(u15::new(TICKS_PER_QUARTER))));
    smf.tracks.push(track(conductor));
    for (channel, events) in (0..).map(u4::new).zip(players) {
        let messages = events.into_iter();
        smf.tracks.push(track(
            messages.map(|(at, message)| (at, TrackEventKind::Midi { channel, message })).collect(),
        ));
    }
    smf
}

fn track(mut events: Vec<(u32, TrackEventKind<'static>)>) -> Vec<TrackEvent<'static>> {
    events.sort_by_key(|event| event.0);
    let mut before = 0;
    let mut track: Vec<_> = events
        .into_iter()
        .map(|(tick, kind)| TrackEvent { delta: u28::new(tick - std::mem::replace(&mut before, tick)), kind })
        .collect();
    track.push(TrackEvent { delta: 0.into(), kind: TrackEventKind::Meta(MetaMessage::EndOfTrack) });
    track
}
