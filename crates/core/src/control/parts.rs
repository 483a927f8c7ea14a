//! Distributes messages over the parts of several players, each of which plays one note at a time.
//!
//! Each part has a [`MidiDecoder`] of its own, so that it slurs, bends, blows and ends its notes exactly as a lone player does.
//! With one part every message goes to it. With more:
//!
//! - A note that a part holds already goes to that part. Any other goes to the *free* part whose last note is nearest in pitch;
//!   parts that have played nothing yet come last, and of two alike the lower number is taken. So a line of notes with gaps stays
//!   with one player, and notes that overlap are a chord.
//! - Where no part is free, it goes to the nearest of those whose note only the pedal holds, which it replaces, and else to the
//!   nearest of all, which slurs to it and comes back to its own note afterwards.
//! - Breath and channel pressure of an MPE member channel go to the parts that play on that channel, and to a note that
//!   begins on it later. So do linked controllers there, unless their links set what belongs to all players.
//! - What belongs to notes goes to the parts that hold one of them. If no part does, it goes to all, whose notes may fade.
//! - A key that plays nothing is no note: it takes no part, and slurs or ends nothing.
//! - A [key switch](super::key_switches) is no note and chooses for all. What an MPE controller says of the finger on it goes to
//!   none.
//! - Everything else goes to all parts, and each takes what is for its note, as a lone player does: bends, for example.

use crate::control::key_switches::{KeySwitches, SwitchKeys};
use crate::control::midi::breath::BreathFrom;
use crate::control::midi::links::{Link, Links, MOST as MOST_LINKS, Source};
use crate::control::midi::snapshot;
use crate::control::midi::techniques::Wheel;
use crate::control::midi::{BREATH_LIKE, BreathOrigin, ENDS_ALL, MidiDecoder};
use crate::control::notes::{HeldNote, MOST as MOST_NOTES, Note, NoteAddress, NoteExpression};
use crate::event::{Event, PartEvent, To};

/// Most parts.
pub const MOST: usize = 16;
/// Events that one message can become: a note with the breath that waited for it, and what the other parts say.
const EVENTS: usize = 64 * MOST;
/// Sources that a channel has: its controllers, and its pressure.
const SOURCES: usize = PRESSURE + 1;
/// Place of the pressure, after those of the controllers.
const PRESSURE: usize = snapshot::PRESSURE as usize;
/// Distance of a note from a part that has played none: farther than any key.
const NEVER: u8 = 128;

/// How often each key was struck that plays nothing.
pub type Unplayed = [u32; 128];

/// The state of all parts. Real-time safe, but for `new` and `default`.
///
/// ```
/// use chalumeau_core::control::parts::Parts;
/// use chalumeau_core::event::To;
///
/// let mut parts = Parts::new(2);
/// assert_eq!(parts.note_on(0, 60, 100)[0].to, To::Player(0));
/// assert_eq!(parts.note_on(0, 64, 100)[0].to, To::Player(1));
/// ```
#[derive(Debug)]
pub struct Parts {
    /// At least one.
    decoders: Vec<MidiDecoder>,
    said: Vec<PartEvent>,
    over: Vec<Note>,
    /// The part of the latest note.
    latest: usize,
    origin: Option<BreathOrigin>,
    switches: SwitchKeys,
    /// The keys that play a note, one bit each.
    playing: u128,
    unplayed: Unplayed,
    /// The latest value of each source on each channel, where it is for the notes of that channel.
    of_notes: Vec<[Option<u8>; SOURCES]>,
}

impl Default for Parts {
    fn default() -> Self {
        Self::of(MidiDecoder::new(), 1)
    }
}

impl Parts {
    /// So many parts, 1..=16, as after switching on. Allocates.
    pub fn new(count: usize) -> Self {
        Self::of(MidiDecoder::new(), count)
    }

    /// Parts that begin as this decoder, which has played nothing. Allocates.
    pub fn of(decoder: MidiDecoder, count: usize) -> Self {
        let mut decoders = Vec::with_capacity(MOST);
        decoders.push(decoder);
        let mut parts = Self {
            decoders,
            said: Vec::with_capacity(EVENTS),
            over: Vec::with_capacity((MOST_NOTES + 1) * MOST),
            latest: 0,
            origin: None,
            switches: SwitchKeys::default(),
            playing: u128::MAX,
            unplayed: [0; 128],
            of_notes: vec![[None; SOURCES]; 16],
        };
        parts.set_count(count);
        parts
    }

    /// Another number of parts, clamped to 1..=16. The notes of parts that go are [over](Self::over); who plays lets them go.
    /// New parts know what the first one has heard of controllers.
    pub fn set_count(&mut self, count: usize) {
        let count = count.clamp(1, MOST);
        self.begin();
        while self.decoders.len() > count {
            let Some(mut gone) = self.decoders.pop() else { break };
            gone.silence();
            self.note_over(gone.over());
        }
        while self.decoders.len() < count {
            let new = self.decoders[0].without_notes();
            self.decoders.push(new);
        }
        self.latest = self.latest.min(count - 1);
    }

    /// How many parts.
    pub fn count(&self) -> usize {
        self.decoders.len()
    }

    /// Forgets everything but the number of parts, the place of the key switches, which keys play, and what [`MidiDecoder::reset`] keeps.
    pub fn reset(&mut self) {
        self.begin();
        self.switches.release_all();
        self.decoders.iter_mut().for_each(MidiDecoder::reset);
        (self.latest, self.origin) = (0, None);
        self.of_notes.fill([None; SOURCES]);
    }

    /// See [`MidiDecoder::usual_bend_range`].
    pub fn usual_bend_range(&mut self, semitones: u8) -> &[PartEvent] {
        self.tell_all(|part| part.usual_bend_range(semitones))
    }

    /// See [`MidiDecoder::set_wheel`].
    pub fn set_wheel(&mut self, wheel: Wheel) -> &[PartEvent] {
        self.tell_all(|part| part.set_wheel(wheel))
    }

    /// Which keys choose fingerings and are no notes. Notes that are held go on.
    pub fn set_key_switches(&mut self, key_switches: KeySwitches) {
        self.switches.set_row(key_switches);
    }

    /// Which keys play a note, one bit each from key 0; until then all. Notes that are held go on.
    pub fn set_playing_keys(&mut self, playing: u128) {
        self.playing = playing;
    }

    /// How often keys were struck that play nothing.
    pub fn unplayed(&self) -> &Unplayed {
        &self.unplayed
    }

    /// See [`MidiDecoder::set_breath_from`].
    pub fn set_breath_from(&mut self, from: BreathFrom) -> &[PartEvent] {
        self.tell_all(|part| part.set_breath_from(from));
        if self.said.iter().any(|said| said.event == Event::BreathFromKeys) {
            self.origin = None;
        }
        &self.said
    }

    /// See [`MidiDecoder::set_links`].
    pub fn set_links(&mut self, links: &[Option<Link>; MOST_LINKS]) -> bool {
        let before = *self.links();
        let has_changed = self.decoders.iter_mut().fold(false, |any, part| part.set_links(links) | any);
        if has_changed {
            // What a controller said of a link that is no more is no word for a later note.
            for cc in 0..SOURCES as u8 {
                let source =
                    if usize::from(cc) == PRESSURE { Source::Pressure } else { Source::Controller(cc) };
                if before.has(source) {
                    self.of_notes.iter_mut().for_each(|channel| channel[usize::from(cc)] = None);
                }
            }
        }
        has_changed
    }

    /// See [`MidiDecoder::links`]; of the first part.
    pub fn links(&self) -> &Links {
        self.decoders[0].links()
    }

    /// See [`MidiDecoder::links`]; of a part, which must be one of them.
    pub fn links_of(&self, part: usize) -> &Links {
        self.decoders[part].links()
    }

    /// A message that says nothing, and ends no note.
    pub fn nothing(&mut self) -> &[PartEvent] {
        self.begin();
        &self.said
    }

    /// See [`MidiDecoder::note_on`].
    pub fn note_on(&mut self, channel: u8, key: u8, velocity: u8) -> &[PartEvent] {
        if velocity == 0 {
            return self.note_off(channel, key);
        }
        self.strike(Note { id: None, channel, key }, velocity)
    }

    /// See [`MidiDecoder::note_off`].
    pub fn note_off(&mut self, channel: u8, key: u8) -> &[PartEvent] {
        self.release(NoteAddress::of_key(channel % 16, key.min(127)))
    }

    /// A note begins on the part that the rule above chooses. See [`MidiDecoder::strike`].
    pub fn strike(&mut self, note: Note, velocity: u8) -> &[PartEvent] {
        let note = Note { channel: note.channel % 16, key: note.key.min(127), ..note };
        self.begin();
        if let Some(fingerings) = self.switches.press(note) {
            // A host waits for the end of every key.
            self.over.push(note);
            self.said.push(Event::Fingerings(fingerings).into());
            return &self.said;
        }
        if self.playing >> note.key & 1 == 0 {
            self.over.push(note);
            let struck = &mut self.unplayed[usize::from(note.key)];
            *struck = struck.saturating_add(1);
            return &self.said;
        }
        let chosen = self.part_for(note);
        self.latest = chosen;
        for part in (0..self.count()).filter(|&part| part != chosen) {
            self.tell(part, |part| part.strike_elsewhere(note.channel));
        }
        if self.count() > 1 {
            let said = self.of_notes[usize::from(note.channel)];
            if let Some(value) = said[PRESSURE] {
                self.tell(chosen, |part| part.pressure(note.channel, value));
            }
            let others = (0..PRESSURE as u8).filter(|cc| !BREATH_LIKE.contains(cc));
            for cc in BREATH_LIKE.into_iter().chain(others) {
                if let Some(value) = said[usize::from(cc)] {
                    self.tell(chosen, |part| part.controller(note.channel, cc, value));
                }
            }
        }
        self.tell(chosen, |part| part.strike(note, velocity));
        &self.said
    }

    /// See [`MidiDecoder::release`].
    pub fn release(&mut self, address: NoteAddress) -> &[PartEvent] {
        self.switches.release(address);
        self.tell_all(|part| part.release(address))
    }

    /// See [`MidiDecoder::forget_repeats`].
    pub fn forget_repeats(&mut self) {
        self.decoders.iter_mut().for_each(MidiDecoder::forget_repeats);
    }

    /// See [`MidiDecoder::choke`].
    pub fn choke(&mut self, address: NoteAddress) -> &[PartEvent] {
        self.switches.release(address);
        self.tell_all(|part| part.choke(address))
    }

    /// See [`MidiDecoder::let_go`].
    pub fn let_go(&mut self) -> &[PartEvent] {
        self.switches.release_all();
        self.tell_all(MidiDecoder::let_go)
    }

    /// See [`MidiDecoder::silence`].
    pub fn silence(&mut self) -> &[PartEvent] {
        self.tell_all(MidiDecoder::silence)
    }

    /// See [`MidiDecoder::express`].
    pub fn express(&mut self, address: NoteAddress, expression: NoteExpression) -> &[PartEvent] {
        if address.key.is_some_and(|key| self.switches.row().chosen(key).is_some()) {
            self.begin();
            return &self.said;
        }
        self.tell_players(address, |part| part.express(address, expression))
    }

    /// See [`MidiDecoder::controller`].
    pub fn controller(&mut self, channel: u8, cc: u8, value: u8) -> &[PartEvent] {
        let (channel, cc, value) = (channel % 16, cc.min(127), value.min(127));
        if ENDS_ALL.contains(&cc) {
            self.switches.release_all();
        }
        let is_of_finger = BREATH_LIKE.contains(&cc) || self.links().has(Source::Controller(cc));
        if is_of_finger && self.is_of_switch(channel) {
            self.begin();
            return &self.said;
        }
        if self.is_of_notes(channel, Source::Controller(cc)) {
            self.of_notes[usize::from(channel)][usize::from(cc)] = Some(value);
            return self.tell_channel(channel, |part| part.controller(channel, cc, value));
        }
        self.tell_all(|part| part.controller(channel, cc, value))
    }

    /// See [`MidiDecoder::pressure`].
    pub fn pressure(&mut self, channel: u8, value: u8) -> &[PartEvent] {
        let (channel, value) = (channel % 16, value.min(127));
        if self.is_of_switch(channel) {
            self.begin();
            return &self.said;
        }
        if self.is_of_notes(channel, Source::Pressure) {
            self.of_notes[usize::from(channel)][PRESSURE] = Some(value);
            return self.tell_channel(channel, |part| part.pressure(channel, value));
        }
        let is_key_down = self.decoders.iter().any(|part| !part.held().is_empty());
        self.tell_all(|part| part.pressure_beside(channel, value, is_key_down))
    }

    /// See [`MidiDecoder::other_pressure`].
    pub fn other_pressure(&mut self, channel: u8) -> &[PartEvent] {
        self.tell_all(|part| part.other_pressure(channel))
    }

    /// See [`MidiDecoder::bend`].
    pub fn bend(&mut self, channel: u8, value14: u16) -> &[PartEvent] {
        self.tell_all(|part| part.bend(channel, value14))
    }

    /// What the part of the latest note hears. See [`MidiDecoder::heard`].
    pub fn heard(&self) -> Option<&HeldNote> {
        self.decoders[self.latest].heard()
    }

    /// What a part hears; it must be one of them.
    pub fn heard_by(&self, part: usize) -> Option<&HeldNote> {
        self.decoders[part].heard()
    }

    /// Whether what comes on a channel is for the notes of that channel: there are several parts, and it is a member of an MPE zone.
    pub fn is_of_one_part(&self, channel: u8) -> bool {
        self.count() > 1 && self.decoders[0].is_member(channel)
    }

    /// The notes that the latest message, or the latest change of the number of parts, has ended.
    pub fn over(&self) -> &[Note] {
        &self.over
    }

    /// The released note of a part that faded until now. Call it when that player is silent: then it has ended.
    pub fn take_faded(&mut self, part: usize) -> Option<Note> {
        self.decoders.get_mut(part)?.take_faded()
    }

    /// Where the latest breath event came from.
    pub fn breath_origin(&self) -> Option<BreathOrigin> {
        self.origin
    }

    /// See [`MidiDecoder::is_snapshot`].
    pub fn is_snapshot(&self, channel: u8) -> bool {
        self.decoders[0].is_snapshot(channel)
    }

    /// The part that a note goes to.
    fn part_for(&self, note: Note) -> usize {
        let claim = |part: &MidiDecoder| {
            let rank = match part.held() {
                // A host may give each note another id. A key whose note only the pedal holds is struck again.
                held if held.iter().any(|held| held.note == note) => 0,
                [held]
                    if part.is_by_pedal() && NoteAddress::of_key(note.channel, note.key).fits(held.note) =>
                {
                    0
                }
                [] => 1,
                _ if part.is_by_pedal() => 2,
                _ => 3,
            };
            (rank, part.heard().map_or(NEVER, |last| last.note.key.abs_diff(note.key)))
        };
        let nearest = self.decoders.iter().enumerate().min_by_key(|(_, part)| claim(part));
        nearest.map_or(0, |(part, _)| part)
    }

    /// Whether what this channel says is for its notes alone: breath, and what is linked to what each player has for itself.
    fn is_of_notes(&self, channel: u8, source: Source) -> bool {
        let is_breath = match source {
            Source::Pressure => true,
            Source::Controller(cc) => BREATH_LIKE.contains(&cc),
        };
        self.is_of_one_part(channel) && self.links().is_of_player(source).unwrap_or(is_breath)
    }

    /// Whether what a channel says is of the finger on a key switch: it is a member of an MPE zone and has no note.
    fn is_of_switch(&self, channel: u8) -> bool {
        let is_of_note = |part: &MidiDecoder| part.held().iter().any(|held| held.note.channel == channel);
        self.switches.is_down_on(channel)
            && self.decoders[0].is_member(channel)
            && !self.decoders.iter().any(is_of_note)
    }

    fn begin(&mut self) {
        self.said.clear();
        self.over.clear();
    }

    fn note_over(&mut self, notes: &[Note]) {
        let room = self.over.capacity() - self.over.len();
        self.over.extend_from_slice(&notes[..notes.len().min(room)]);
    }

    /// One part gets a message.
    fn tell(&mut self, number: usize, say: impl FnOnce(&mut MidiDecoder) -> &[Event]) {
        let room = self.said.capacity() - self.said.len();
        let part = &mut self.decoders[number];
        let events = say(part);
        debug_assert!(events.len() <= room, "a message has more events than it can");
        let blows = events.iter().any(|event| matches!(event, Event::Breath(_)));
        let to = To::Player(number as u8);
        self.said.extend(events.iter().take(room).map(|&event| PartEvent { to, event }));
        if blows {
            self.origin = part.breath_origin();
        }
        let room = self.over.capacity() - self.over.len();
        self.over.extend(part.over().iter().take(room));
    }

    /// Some parts get a message.
    fn tell_those(
        &mut self,
        which: impl Fn(&MidiDecoder) -> bool,
        say: impl Fn(&mut MidiDecoder) -> &[Event],
    ) -> &[PartEvent] {
        self.begin();
        for part in 0..self.count() {
            if which(&self.decoders[part]) {
                self.tell(part, &say);
            }
        }
        &self.said
    }

    fn tell_all(&mut self, say: impl Fn(&mut MidiDecoder) -> &[Event]) -> &[PartEvent] {
        self.tell_those(|_| true, say)
    }

    /// The parts that hold a note on this channel get a message.
    fn tell_channel(&mut self, channel: u8, say: impl Fn(&mut MidiDecoder) -> &[Event]) -> &[PartEvent] {
        self.tell_those(|part| part.held().iter().any(|held| held.note.channel == channel), say)
    }

    /// The parts that hold one of these notes get a message, or all if none does.
    fn tell_players(
        &mut self,
        address: NoteAddress,
        say: impl Fn(&mut MidiDecoder) -> &[Event],
    ) -> &[PartEvent] {
        let holds = |part: &MidiDecoder| part.held().iter().any(|held| address.fits(held.note));
        let is_held = self.decoders.iter().any(holds);
        self.tell_those(|part| !is_held || holds(part), say)
    }
}

#[cfg(test)]
mod tests;
