//! MIDI files as raw messages at sample positions, read without the renderer's own reader, so that playing them
//! through a host checks that reader too.

use anyhow::{Context, Result, bail};
use midly::{MetaMessage, Smf, Timing, TrackEventKind, live::LiveEvent};

use crate::clap::{At, Say};

/// Channel messages of a metrical file, in order of time.
pub fn messages(bytes: &[u8], rate: u32) -> Result<Vec<At>> {
    let file = Smf::parse(bytes).context("not a standard MIDI file")?;
    let Timing::Metrical(ticks) = file.header.timing else { bail!("a file in film time is not read here") };
    let mut merged = Vec::new();
    for track in &file.tracks {
        let mut tick = 0u64;
        for event in track {
            tick += u64::from(event.delta.as_int());
            merged.push((tick, event.kind));
        }
    }
    merged.sort_by_key(|(tick, _)| *tick);

    // Time as microseconds times ticks per quarter note, exactly; one rounding, to the nearest sample.
    let per_second = u128::from(ticks.as_int()) * 1_000_000;
    let (mut now, mut last, mut tempo_us) = (0u128, 0, 500_000u128);
    let mut said = Vec::new();
    for (tick, kind) in merged {
        now += u128::from(tick - last) * tempo_us;
        last = tick;
        match kind {
            TrackEventKind::Meta(MetaMessage::Tempo(us)) => tempo_us = u128::from(us.as_int()),
            TrackEventKind::Midi { channel, message } => {
                let mut bytes = Vec::with_capacity(3);
                LiveEvent::Midi { channel, message }.write_std(&mut bytes)?;
                bytes.resize(3, 0);
                let at = (now * u128::from(rate) + per_second / 2) / per_second;
                said.push(At(usize::try_from(at)?, Say::Midi([bytes[0], bytes[1], bytes[2]])));
            }
            _ => {}
        }
    }
    Ok(said)
}
