//! What a user should know of notes that an instrument cannot play.

use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::control::keys::Keys;
use chalumeau_core::control::parts::Unplayed;
use chalumeau_core::event::{Event, PartEvent, Timed, To};
use chalumeau_core::instrument::{Model, Reach};
use chalumeau_core::units::{SoundingNote, WrittenNote};
use std::collections::BTreeSet;

/// Says which notes the instrument cannot play, which stay silent.
pub fn silent_notes(
    events: &[Timed<PartEvent>],
    unplayed: &Unplayed,
    model: &Model,
    reach: Reach,
) -> Vec<String> {
    let keys = (0..128).map(SoundingNote).zip(unplayed);
    let struck = keys.flat_map(|(key, &count)| std::iter::repeat_n(key, count as usize));
    let asked = events.iter().filter_map(|timed| match timed.event.event {
        Event::NoteOn { note, .. } => Some(note),
        _ => None,
    });
    let asked = struck.chain(asked);
    silent_keys(&asked.collect::<Vec<_>>(), model, reach)
}

/// Says how many notes are never heard, because they have no length, or because a later one of the same moment is held as long.
pub fn never_heard(events: &[Timed<PartEvent>], model: &Model, reach: Reach) -> Vec<String> {
    let mut hands: Vec<Hand> = Vec::new();
    let (mut hidden, mut brief, mut now) = (0, 0, 0);
    for timed in events {
        if timed.at > now {
            hands.iter_mut().for_each(Hand::hear);
            now = timed.at;
        }
        let to = timed.event.to;
        let at = hands.iter().position(|hand| hand.to == to).unwrap_or(hands.len());
        if at == hands.len() {
            hands.push(Hand { to, keys: Keys::default(), unheard: Vec::new() });
        }
        let hand = &mut hands[at];
        let ended: Vec<Unheard> = match timed.event.event {
            Event::NoteOn { note, .. } if reach.fingering(note, model).is_some() => hand.press(note, now),
            Event::NoteOff { note } | Event::Choke { note } => hand.release(note),
            Event::Panic => {
                hand.keys = Keys::default();
                std::mem::take(&mut hand.unheard)
            }
            _ => Vec::new(),
        };
        // What began in this moment has no length.
        let of_now = ended.iter().filter(|(_, at)| *at == now).count();
        (brief, hidden) = (brief + of_now, hidden + ended.len() - of_now);
    }
    hands.iter_mut().for_each(Hand::hear);
    hidden += hands.iter().map(|hand| hand.unheard.len()).sum::<usize>();
    let notes = |count: usize| if count == 1 { "1 note is".to_owned() } else { format!("{count} notes are") };
    let brief = (brief > 0).then(|| {
        format!(
            "{} no more than a moment long: beginning and end lie at the same time (a note without an end ends with the file)",
            notes(brief)
        )
    });
    let hidden = (hidden > 0).then(|| {
        format!(
            "{} never heard: another begins in the same moment and lasts as long. A clarinet plays one note at a time, of a chord the last in the file; --players 2 or more play chords",
            notes(hidden)
        )
    });
    brief.into_iter().chain(hidden).collect()
}

/// The keys that a player holds.
struct Hand {
    to: To,
    keys: Keys,
    unheard: Vec<Unheard>,
}

/// A key that has not been heard yet, and the sample at which it went down.
type Unheard = (SoundingNote, usize);

impl Hand {
    /// Time passes.
    fn hear(&mut self) {
        let heard = self.keys.last();
        self.unheard.retain(|&(key, _)| Some(key) != heard);
    }

    /// Returns the notes that end unheard.
    fn press(&mut self, note: SoundingNote, now: usize) -> Vec<Unheard> {
        let ended = self.release(note);
        self.keys.press(note);
        self.unheard.push((note, now));
        ended
    }

    /// Likewise.
    fn release(&mut self, note: SoundingNote) -> Vec<Unheard> {
        self.keys.release(note);
        self.unheard.extract_if(.., |(key, _)| *key == note).collect()
    }
}

/// As many notes are named.
const NAMED: usize = 6;

/// Says which of these keys the instrument cannot play, which stay silent.
pub fn silent_keys(asked: &[SoundingNote], model: &Model, reach: Reach) -> Vec<String> {
    let file = &model.file;
    let sounds =
        |note: WrittenNote| note.sounding(file.transposition).map(|n| n.to_string()).unwrap_or_default();
    let silent = asked.iter().copied().filter(|&key| reach.fingering(key, model).is_none());
    let silent: Vec<_> =
        silent.filter_map(|key| reach.find(key, &model.keys, Some).map(|(pitch, _)| pitch.note)).collect();
    let written = |note: SoundingNote| note.written(file.transposition);
    let (muted, missing): (Vec<_>, Vec<_>) = silent
        .into_iter()
        .partition(|&note| written(note).is_some_and(|note| file.fingering(note).is_some()));
    let mut said = Vec::new();
    // A scale may have put them beyond the range of MIDI, where they have no name.
    let is_nowhere = |key: &&SoundingNote| {
        reach.key_switches.chosen(key.0).is_none() && reach.find(**key, &model.keys, Some).is_none()
    };
    let nowhere: Vec<SoundingNote> = asked.iter().copied().filter(|key| is_nowhere(&key)).collect();
    if !nowhere.is_empty() {
        said.push(format!(
            "the scale or its keyboard mapping gives {} no pitch within the range of MIDI, and {} silent{}",
            if nowhere.len() == 1 { "1 key".to_owned() } else { format!("{} keys", nowhere.len()) },
            if nowhere.len() == 1 { "it stays" } else { "they stay" },
            names_of(&nowhere),
        ));
    }
    let count = missing.len();
    if count > 0 {
        let (low, high) = (file.lowest(), file.highest());
        said.push(format!(
            "{} no fingering and {} silent{}; this instrument sounds {} to {} (written {low} to {high}){}",
            if count == 1 { "1 note has".to_owned() } else { format!("{count} notes have") },
            if count == 1 { "stays" } else { "stay" },
            names_of(&missing),
            sounds(low),
            sounds(high),
            who_has(&missing)
        ));
    }
    if !muted.is_empty() {
        let names: BTreeSet<_> = muted.iter().filter_map(|&note| written(note)).collect();
        let names: Vec<_> = names.iter().map(|note| format!("{note} (sounds {})", sounds(*note))).collect();
        said.push(format!(
            "notes that stay silent, because their fingering does not speak in tune on this instrument: {}, written {}",
            muted.len(),
            names.join(", ")
        ));
    }
    said
}

/// Which bundled instrument has all these notes, in words for the end of a sentence.
fn who_has(notes: &[SoundingNote]) -> String {
    let has = |instrument: &&Bundled| {
        let file = instrument.file();
        let fingering =
            |note: &SoundingNote| note.written(file.transposition).and_then(|note| file.fingering(note));
        notes.iter().all(|note| fingering(note).is_some())
    };
    let found = Bundled::ALL.iter().find(has);
    found.map_or_else(
        || "; --set beyond=octave plays them in the nearest octave that it has".to_owned(),
        |instrument| format!("; --instrument {} has them", instrument.id()),
    )
}

/// The names of some notes, in brackets, as they sound.
fn names_of(notes: &[SoundingNote]) -> String {
    let notes: BTreeSet<_> = notes.iter().collect();
    let named: Vec<_> = notes.iter().take(NAMED).map(ToString::to_string).collect();
    match notes.len() {
        0 => String::new(),
        count => format!(" ({}{})", named.join(", "), if count > NAMED { ", ..." } else { "" }),
    }
}
