//! Turns MIDI channel messages and the note events of hosts into events, for the plugin and for the offline renderer
//! alike.
//!
//! It is for one player, so all channels play it. The last key struck is heard; see [`notes`](super::notes). For several
//! players, [`parts`](super::parts) has a decoder for each.
//! [`breath`] says which controller the breath comes from, [`snapshot`] what is left out of the start of a project, [`mix`]
//! what volume and pan do, `controllers` what all the others do. [Key switches](super::key_switches) do not reach it. Bend follows the heard note's channel and its MPE zone, see [`bends`](super::bends); RPN 0 sets a
//! bend range, RPN 6 a zone. [`techniques`] says what the mod wheel and CC18 to CC20 do.
//!
//! While the sustain pedal (CC64) is down, the last note goes on after its key has come up, until the pedal comes up or
//! another key is struck, which slurs; the same key again is tongued. A key that is struck again before it has come up is
//! tongued, too, and comes up as often as it was struck. Left out: balance (CC8), portamento, sostenuto and soft pedal,
//! program and bank.
//!
//! Source: MIDI 1.0 Detailed Specification 4.2.1 (1996), control change numbers and registered parameters; RP-015 for
//! CC121; RP-053 for MPE. Data bytes above 127 are read as 127 and channels modulo 16, so that every
//! input is valid.
//!
//! ```
//! use chalumeau_core::{control::midi::MidiDecoder, event::Event, units::SoundingNote};
//!
//! let mut midi = MidiDecoder::new();
//! // Breath controller (CC2) at 64 counts as breath when a key is struck.
//! assert!(midi.controller(0, 2, 64).is_empty());
//! let note_on = Event::NoteOn { note: SoundingNote(60), velocity: 1.0 };
//! assert_eq!(midi.note_on(0, 60, 127), [Event::Breath(64.0 / 127.0), note_on]);
//! ```

pub mod breath;
mod controllers;
pub mod links;
pub mod mix;
mod said;
pub mod snapshot;
pub mod techniques;
#[cfg(test)]
mod tests;

use crate::control::bends::Bends;
use crate::control::keys::Keys;
use crate::control::notes::{HeldNote, Note, NoteAddress, NoteExpression, Notes};
use crate::event::Event;
use crate::units::SoundingNote;
use breath::{BreathChoice, BreathController, BreathFrom};
use controllers::Channel;
pub(super) use controllers::{BREATH_LIKE, ENDS_ALL};
use links::{Link, Links};
use mix::Mix;
use said::Said;
use snapshot::Run;
use techniques::{AskedTechniques, Wheel};

/// Where a breath event came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BreathOrigin {
    /// A controller.
    Controller(BreathController),
    /// What belongs to a note.
    Note,
    /// A controller that the player has [linked](links) to the breath.
    Link,
}

/// Decodes MIDI messages and note events; it keeps the state of notes, controllers, bend wheels and zones. Each message
/// gives its events, in order. Real-time safe.
#[derive(Clone, Debug, Default)]
pub struct MidiDecoder {
    channels: [Channel; 16],
    breath: BreathChoice,
    /// Whether the breath of a note has been above 0. Some hosts send a zero with each note; a zero alone does not count.
    has_note_breath: bool,
    origin: Option<BreathOrigin>,
    mix: Mix,
    techniques: AskedTechniques,
    links: Links,
    /// Breath that a linked controller has sent once, which the next key may show to be meant.
    linked_breath: Option<f32>,
    pedal: bool,
    notes: Notes,
    /// The keys as the player holds them, who gets the events.
    fingers: Keys,
    /// The last pressure on keys there was an event for.
    key_pressure: f32,
    bends: Bends,
    /// The last bend there was an event for.
    bent_cents: f32,
    said: Said,
}

impl MidiDecoder {
    /// As after switching on: no breath source known, no MPE zone, bend range two semitones. Does not allocate.
    #[inline(never)] // Slow to compile: once is enough.
    pub fn new() -> Self {
        Self::default()
    }

    /// The same with MPE's usual lower zone, for what was played on an MPE controller that did not announce itself: channel 1
    /// manages the other fifteen, which bend by 48 semitones until RPN 0 says otherwise.
    #[must_use]
    pub fn with_mpe(mut self) -> Self {
        self.bends.set_zone(0, 15);
        self
    }

    /// Forgets notes, controllers and breath source, and also links, what the wheel does, which controllers may blow, and the usual
    /// bend range; all but MPE zones and the bend ranges that were told, which a device tells once. Real-time safe.
    pub fn reset(&mut self) {
        *self = Self { bends: self.bends.at_rest(), ..Self::new() };
    }

    /// Bend range until RPN 0 says otherwise, semitones; of MPE members it is 48. Real-time safe.
    pub fn usual_bend_range(&mut self, semitones: u8) -> &[Event] {
        self.begin();
        self.bends.set_usual_range(semitones);
        self.rebend();
        self.said.events()
    }

    /// A MIDI key goes down; with velocity 0 it comes up, as running status has it. Real-time safe.
    pub fn note_on(&mut self, channel: u8, key: u8, velocity: u8) -> &[Event] {
        if velocity == 0 {
            return self.note_off(channel, key);
        }
        self.strike(Note { id: None, channel, key }, velocity)
    }

    /// A MIDI key comes up. Real-time safe.
    pub fn note_off(&mut self, channel: u8, key: u8) -> &[Event] {
        self.release(NoteAddress::of_key(channel % 16, key.min(127)))
    }

    /// What the mod wheel does. Real-time safe.
    pub fn set_wheel(&mut self, wheel: Wheel) -> &[Event] {
        self.begin();
        self.techniques.wheel = wheel;
        self.say_techniques();
        self.said.events()
    }

    /// Which controllers may blow. Another choice than before begins anew: keys blow until a controller moves. Breath that belongs
    /// to notes, as polyphonic pressure does, blows beside any controller and beside pressure. Controllers that are linked to the
    /// breath are not asked. Real-time safe.
    pub fn set_breath_from(&mut self, from: BreathFrom) -> &[Event] {
        self.begin();
        if self.breath.set_from(from) {
            self.origin = None;
            self.said.push(Event::BreathFromKeys);
            self.ease_keys();
        }
        self.said.events()
    }

    /// Ties controllers to settings. A controller whose link is new waits until it moves. Whether any link has changed.
    /// Real-time safe.
    pub fn set_links(&mut self, links: &[Option<Link>; links::MOST]) -> bool {
        self.links.set(links)
    }

    /// The links, and what their controllers have said.
    pub fn links(&self) -> &Links {
        &self.links
    }

    /// A note begins, with a velocity of 1..=127. Its bend, breath, volume and pan come before it. Real-time safe.
    pub fn strike(&mut self, note: Note, velocity: u8) -> &[Event] {
        self.begin();
        let note = Note { channel: note.channel % 16, key: note.key.min(127), ..note };
        let velocity = f32::from(velocity.clamp(1, 127)) / 127.0;
        let by_pedal = self.notes.take_by_pedal();
        let is_repeated = self.sounding().or(by_pedal).is_some_and(|before| before.key == note.key);
        self.notes.press(note, velocity);
        self.prepare_note(note.channel);
        self.leave_note_breath();
        // A finger that does not press yet is about to.
        self.blow_member(|unit| unit > 0.0);
        self.remix();
        if is_repeated {
            self.lift(note.key);
        }
        self.finger(note.key, velocity);
        self.lift_others(None);
        self.said.events()
    }

    /// A note begins on this channel, on another [part](super::parts): what controllers have said before it is meant here
    /// too. Real-time safe.
    pub(super) fn strike_elsewhere(&mut self, channel: u8) -> &[Event] {
        self.begin();
        self.prepare_note(channel);
        self.said.events()
    }

    /// Who strikes a note means what controllers have said.
    fn prepare_note(&mut self, channel: u8) {
        self.bends.play(usize::from(channel));
        self.channels.iter_mut().for_each(|channel| channel.run = Run::default());
        self.rebend();
        if let Some((controller, unit)) = self.breath.settle() {
            self.blow(BreathOrigin::Controller(controller), unit);
        }
        if let Some(unit) = self.linked_breath.take() {
            self.blow(BreathOrigin::Link, unit);
        }
    }

    /// The same without notes: another [part](super::parts) of who has played on this one.
    pub(super) fn without_notes(&self) -> Self {
        let (notes, fingers, said) = Default::default();
        Self { notes, fingers, said, ..self.clone() }
    }

    /// Keys come up. The note that sounded before is heard again; the last one ends, or the pedal holds it. Real-time safe.
    pub fn release(&mut self, address: NoteAddress) -> &[Event] {
        self.begin();
        let before = self.sounding();
        self.notes.release_one(address, self.pedal);
        self.hear_next(before);
        self.said.events()
    }

    /// See [`Notes::forget_repeats`]. Real-time safe.
    pub fn forget_repeats(&mut self) {
        self.notes.forget_repeats();
    }

    /// Notes end at once, whatever the pedal does. Real-time safe.
    pub fn choke(&mut self, address: NoteAddress) -> &[Event] {
        self.begin();
        let before = self.sounding();
        let heard = self.notes.choke(address);
        // The others first: none of them is to be heard in between.
        self.lift_others(heard);
        if let Some(key) = heard {
            self.fingers.release(SoundingNote(key));
            self.said.push(Event::Choke { note: SoundingNote(key) });
        }
        self.hear_next(before);
        self.said.events()
    }

    /// The pedal and all keys come up. Real-time safe.
    pub fn let_go(&mut self) -> &[Event] {
        self.begin();
        self.pedal = false;
        self.lift_all();
        self.said.events()
    }

    /// All notes end at once, as by CC120. Real-time safe.
    pub fn silence(&mut self) -> &[Event] {
        self.begin();
        self.cut_all();
        // A pedal whose end was lost would hold the next note, too. One that is down says so when it moves.
        self.pedal = false;
        self.said.events()
    }

    /// Something changes that belongs to notes. An unheard note keeps it until it is heard; a note struck anew has lost it.
    /// Real-time safe.
    pub fn express(&mut self, address: NoteAddress, expression: NoteExpression) -> &[Event] {
        self.begin();
        if let NoteExpression::Breath(unit) = expression {
            if !self.breath.notes_may_blow() {
                return self.said.events();
            }
            self.has_note_breath |= unit > 0.0;
        }
        if self.notes.express(address, expression) {
            match expression {
                NoteExpression::Tuning(_) => self.bend_anew(),
                NoteExpression::Breath(_) => self.blow_note(),
                NoteExpression::Volume(_) | NoteExpression::Pan(_) => self.remix(),
                NoteExpression::Brightness(_) | NoteExpression::Press(_) => {}
            }
        }
        self.said.events()
    }

    /// The bend wheel, 0..=16383, 8192 at rest. Real-time safe.
    pub fn bend(&mut self, channel: u8, value14: u16) -> &[Event] {
        self.begin();
        let at = usize::from(channel % 16);
        self.bends.turn(at, value14);
        if self.bends.is_heard(at, self.heard_channel()) {
            self.bend_anew();
        }
        self.said.events()
    }

    /// The note that sounds, or the last one while it fades, and what belongs to it.
    pub fn heard(&self) -> Option<&HeldNote> {
        self.notes.heard()
    }

    /// The held notes, oldest first.
    pub fn held(&self) -> &[HeldNote] {
        self.notes.held()
    }

    /// Whether only the pedal holds the note that sounds.
    pub fn is_by_pedal(&self) -> bool {
        self.notes.is_by_pedal()
    }

    /// Whether a channel, 0..=15, is a member of an MPE zone.
    pub fn is_member(&self, channel: u8) -> bool {
        self.bends.is_member(usize::from(channel % 16))
    }

    /// The notes that the latest message has ended. A released note that fades is not among them.
    pub fn over(&self) -> &[Note] {
        self.notes.over()
    }

    /// The released note that faded until now. Call it when the instrument is silent: then it has ended. Real-time safe.
    pub fn take_faded(&mut self) -> Option<Note> {
        self.notes.take_faded()
    }

    /// Where the latest breath event came from.
    pub fn breath_origin(&self) -> Option<BreathOrigin> {
        self.origin
    }

    /// Whether what this channel's controllers have sent since the last note is a snapshot.
    pub fn is_snapshot(&self, channel: u8) -> bool {
        self.channels[usize::from(channel % 16)].run.is_snapshot()
    }

    fn begin(&mut self) {
        self.said.clear();
        self.notes.begin();
    }

    fn sounding(&self) -> Option<Note> {
        self.notes.sounding().map(|held| held.note)
    }

    fn heard_channel(&self) -> Option<usize> {
        self.notes.heard().map(|held| usize::from(held.note.channel))
    }

    /// The breath of the finger whose note is heard now, if `is_meant`.
    fn blow_member(&mut self, is_meant: impl Fn(f32) -> bool) {
        let Some(at) = self.heard_channel().filter(|&at| self.bends.is_member(at)) else { return };
        let own = self.breath.of(at).filter(|&(_, unit)| is_meant(unit));
        // What the key has settled is said already.
        if let Some((controller, unit)) =
            own.filter(|&(_, unit)| !self.said.events().contains(&Event::Breath(unit)))
        {
            self.blow(BreathOrigin::Controller(controller), unit);
        }
    }

    /// Pressure is no longer that of pressed keys.
    fn ease_keys(&mut self) {
        if std::mem::take(&mut self.key_pressure) != 0.0 {
            self.said.push(Event::KeyPressure(0.0));
        }
    }

    fn blow(&mut self, origin: BreathOrigin, unit: f32) {
        self.origin = Some(origin);
        self.said.push(Event::Breath(unit));
    }

    /// The breath of the heard note, if it has one.
    fn blow_note(&mut self) {
        let breath = self.notes.heard().and_then(|held| held.breath);
        match breath.filter(|_| self.has_note_breath) {
            Some(unit) => self.blow(BreathOrigin::Note, unit),
            None => self.leave_note_breath(),
        }
    }

    /// A note that has no breath of its own plays by its velocity and not with that of the note before. In MPE its breath is on
    /// its way.
    fn leave_note_breath(&mut self) {
        let is_member = self.heard_channel().is_some_and(|channel| self.bends.is_member(channel));
        if self.origin == Some(BreathOrigin::Note) && !is_member {
            self.origin = None;
            self.said.push(Event::BreathFromKeys);
        }
    }

    /// Volume and pan, if they have changed.
    fn remix(&mut self) {
        for event in self.mix.changed(self.notes.heard()).into_iter().flatten() {
            self.said.push(event);
        }
    }

    /// What controllers ask of the techniques, if it has changed.
    fn say_techniques(&mut self) {
        for event in self.techniques.changed().into_iter().flatten() {
            self.said.push(event);
        }
    }

    fn bend_anew(&mut self) {
        let tuning_cents = self.notes.heard().map_or(0.0, |held| held.tuning_cents);
        self.bent_cents = self.bends.cents(self.heard_channel()) + tuning_cents;
        self.said.push(Event::Bend { cents: self.bent_cents });
    }

    /// The bend, if it has changed.
    fn rebend(&mut self) {
        let tuning_cents = self.notes.heard().map_or(0.0, |held| held.tuning_cents);
        if self.bends.cents(self.heard_channel()) + tuning_cents != self.bent_cents {
            self.bend_anew();
        }
    }

    fn set_pedal(&mut self, is_down: bool) {
        self.pedal = is_down;
        let before = self.sounding();
        if !is_down && self.notes.take_by_pedal().is_some() {
            self.hear_next(before);
        }
    }

    fn lift_all(&mut self) {
        let before = self.sounding();
        self.notes.release(NoteAddress::default(), false);
        self.hear_next(before);
        self.ease_keys();
    }

    fn cut_all(&mut self) {
        self.notes.choke(NoteAddress::default());
        self.fingers = Keys::default();
        self.said.push(Event::Panic);
        self.ease_keys();
        // Without tuning, volume and pan of the note that was cut.
        self.notes.make_plain();
        self.rebend();
        self.remix();
    }

    /// Keys have come up, and `before` sounded until now: what is heard now, and which keys are no longer down.
    fn hear_next(&mut self, before: Option<Note>) {
        self.rebend();
        let now = self.notes.sounding().map(|held| (held.note, held.velocity));
        if let Some((Note { key, .. }, velocity)) = now.filter(|&(now, _)| Some(now) != before) {
            self.blow_note();
            self.blow_member(|_| true);
            self.remix();
            let next = self.fingers.held().iter().rev().find(|finger| self.notes.holds(finger.0));
            if next != Some(&SoundingNote(key)) {
                // Of two notes of one key the later one has come up; the earlier one lies below others.
                self.finger(key, velocity);
            }
        }
        self.lift_others(None);
    }

    /// A key goes down for the player.
    fn finger(&mut self, key: u8, velocity: f32) {
        let note = SoundingNote(key);
        // The player may not play all keys, so that it would push another one out, or none.
        if let Some(note) = self.fingers.press(note) {
            self.said.push(Event::NoteOff { note });
        }
        self.said.push(Event::NoteOn { note, velocity });
    }

    /// A key comes up for the player.
    fn lift(&mut self, key: u8) {
        let note = SoundingNote(key);
        self.fingers.release(note);
        self.said.push(Event::NoteOff { note });
    }

    /// Lifts the keys of which no note is held any more, but `kept`; the one that sounds comes last.
    fn lift_others(&mut self, kept: Option<u8>) {
        let fingers = self.fingers;
        for &SoundingNote(key) in fingers.held() {
            if Some(key) != kept && !self.notes.holds(key) {
                self.lift(key);
            }
        }
    }
}
