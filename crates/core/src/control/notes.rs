//! The notes that are held, and which of them is heard: the last one struck; when it is released, the one before it.
//!
//! A note is known by the id that its host gave it, its channel and its key, so that two notes of one key can be held at
//! once. Without ids, as in MIDI, a key that is struck again before it has come up comes up as often as it was struck:
//! parts that were recorded or quantised overlap so, and the end of the first note must not end the second.
//!
//! What belongs to a note (tuning, volume, pan, breath) stays with it while another one is heard. A pedal can hold the last
//! note after its key has come up. Real-time safe throughout.
//!
//! Source: CLAP 1.2, `events.h`: how note events name notes, and what a host wants to hear about their ends.

use crate::units::clamped_or;

/// Notes that can be held at once, as many as [`Keys`](super::keys::Keys); more push the oldest out.
pub const MOST: usize = crate::control::keys::MOST;

/// One note.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Note {
    /// The host's id, 0 or more; `None` for MIDI, which has no ids.
    pub id: Option<i32>,
    /// Channel, 0..=15.
    pub channel: u8,
    /// Key, 0..=127.
    pub key: u8,
}

/// Which notes a message means. A part that is `None` fits every note.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoteAddress {
    /// The host's id. A note without an id has none of them.
    pub id: Option<i32>,
    /// Channel, 0..=15.
    pub channel: Option<u8>,
    /// Key, 0..=127.
    pub key: Option<u8>,
}

impl NoteAddress {
    /// The notes of one key on one channel, whatever their ids: how MIDI names notes.
    pub fn of_key(channel: u8, key: u8) -> Self {
        Self { id: None, channel: Some(channel), key: Some(key) }
    }

    /// Whether a note is meant.
    pub fn fits(self, note: Note) -> bool {
        self.id.is_none_or(|id| note.id == Some(id))
            && self.channel.is_none_or(|channel| note.channel == channel)
            && self.key.is_none_or(|key| note.key == key)
    }
}

/// Something that belongs to a note. Numbers out of range are clamped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoteExpression {
    /// Pitch above the key, cents.
    Tuning(f32),
    /// Breath, 0..=1.
    Breath(f32),
    /// Factor on the amplitude, 0..=4; 1 leaves it.
    Volume(f32),
    /// Place between left and right, -1..=1.
    Pan(f32),
    /// Brightness, 0..=1; kept for those who ask.
    Brightness(f32),
    /// Pressure that is not breath, 0..=1; kept for those who ask.
    Press(f32),
}

/// A note and what belongs to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldNote {
    /// The note.
    pub note: Note,
    /// How fast its key went down, 0..=1.
    pub velocity: f32,
    /// Pitch above the key, cents.
    pub tuning_cents: f32,
    /// Factor on the amplitude, 0..=4.
    pub gain: f32,
    /// Place between left and right, -1..=1.
    pub pan: f32,
    /// Breath, 0..=1; `None` until the note is told one, as with the next two.
    pub breath: Option<f32>,
    /// Brightness, 0..=1.
    pub brightness: Option<f32>,
    /// Pressure that is not breath, 0..=1.
    pub press: Option<f32>,
    /// The key has come up; the pedal holds the note.
    is_by_pedal: bool,
    /// How often the key is to come up without ending the note: once for each time that it was struck again.
    ends_to_pass: u8,
}

impl HeldNote {
    fn new(note: Note, velocity: f32) -> Self {
        Self {
            note,
            velocity,
            tuning_cents: 0.0,
            gain: 1.0,
            pan: 0.0,
            breath: None,
            brightness: None,
            press: None,
            is_by_pedal: false,
            ends_to_pass: 0,
        }
    }

    fn express(&mut self, expression: NoteExpression) {
        let unit = |value: f32| clamped_or(value, 0.0, 1.0, 0.0);
        match expression {
            NoteExpression::Tuning(cents) => self.tuning_cents = if cents.is_finite() { cents } else { 0.0 },
            NoteExpression::Breath(breath) => self.breath = Some(unit(breath)),
            NoteExpression::Volume(gain) => {
                self.gain = clamped_or(gain, 0.0, 4.0, 1.0);
            }
            NoteExpression::Pan(pan) => self.pan = clamped_or(pan, -1.0, 1.0, 0.0),
            NoteExpression::Brightness(brightness) => self.brightness = Some(unit(brightness)),
            NoteExpression::Press(press) => self.press = Some(unit(press)),
        }
    }
}

/// The held notes, oldest first, and which notes have ended.
#[derive(Clone, Debug)]
pub struct Notes {
    held: [HeldNote; MOST],
    count: usize,
    /// The last note after its release: what belongs to it acts while it fades.
    released: Option<HeldNote>,
    /// The same note until somebody has said that its sound is over.
    fading: Option<Note>,
    /// Notes that have ended since [`begin`](Self::begin): all that can be held, and one that fades.
    over: [Note; MOST + 1],
    over_count: usize,
}

impl Default for Notes {
    fn default() -> Self {
        Self {
            held: [HeldNote::new(Note::default(), 0.0); MOST],
            count: 0,
            released: None,
            fading: None,
            over: [Note::default(); MOST + 1],
            over_count: 0,
        }
    }
}

impl Notes {
    /// Begins a new message: [`over`](Self::over) is empty again.
    pub fn begin(&mut self) {
        self.over_count = 0;
    }

    /// The held notes, oldest first.
    pub fn held(&self) -> &[HeldNote] {
        &self.held[..self.count]
    }

    /// The held note that sounds.
    pub fn sounding(&self) -> Option<&HeldNote> {
        self.held().last()
    }

    /// The note that sounds, or the last one while it fades.
    pub fn heard(&self) -> Option<&HeldNote> {
        self.sounding().or(self.released.as_ref())
    }

    /// Whether only the pedal holds the note that sounds.
    pub fn is_by_pedal(&self) -> bool {
        self.sounding().is_some_and(|held| held.is_by_pedal)
    }

    /// The notes that have ended since [`begin`](Self::begin). A note that fades has not.
    pub fn over(&self) -> &[Note] {
        &self.over[..self.over_count]
    }

    /// The note that faded until now; call it when nothing sounds any more.
    pub fn take_faded(&mut self) -> Option<Note> {
        self.fading.take()
    }

    /// Whether any note of this key is held.
    pub fn holds(&self, key: u8) -> bool {
        self.held().iter().any(|held| held.note.key == key)
    }

    /// A note begins; again, if it was held.
    pub fn press(&mut self, note: Note, velocity: f32) {
        let again = self.held().iter().find(|held| held.note == note && note.id.is_none());
        let ends_to_pass = again.map_or(0, |held| held.ends_to_pass.saturating_add(1));
        self.remove_where(|held| held.note == note, |_, _| ());
        if self.count == MOST {
            let oldest = self.held[0].note;
            self.remove_where(|held| held.note == oldest, Self::end);
        }
        if let Some(fading) = self.fading.take().filter(|&fading| fading != note) {
            self.end(fading);
        }
        self.released = None;
        self.held[self.count] = HeldNote { ends_to_pass, ..HeldNote::new(note, velocity) };
        self.count += 1;
    }

    /// Every key that is down comes up at the next end of its notes, however often it was struck: what a host sends when it stops in the
    /// middle of overlapping notes.
    pub fn forget_repeats(&mut self) {
        self.held[..self.count].iter_mut().for_each(|held| held.ends_to_pass = 0);
    }

    /// A key comes up: once, where the address names key and channel, as MIDI does. See [`release`](Self::release).
    pub fn release_one(&mut self, address: NoteAddress, pedal: bool) {
        let is_of_one = address.key.is_some() && address.channel.is_some();
        let passed = self.held[..self.count]
            .iter_mut()
            .find(|held| is_of_one && address.fits(held.note) && held.ends_to_pass > 0);
        match passed {
            Some(held) => held.ends_to_pass -= 1,
            None => self.release(address, pedal),
        }
    }

    /// Keys come up. With `pedal`, the note that sounds stays if no other key holds it up.
    pub fn release(&mut self, address: NoteAddress, pedal: bool) {
        let sounding = self.sounding().map(|held| held.note);
        if pedal && self.held().iter().all(|held| address.fits(held.note)) {
            self.remove_where(|held| Some(held.note) != sounding, Self::end);
            if let Some(last) = self.held[..self.count].last_mut() {
                last.is_by_pedal = true;
            }
            return;
        }
        let last = self.sounding().copied();
        let had = self.count;
        self.remove_where(
            |held| address.fits(held.note),
            |notes, note| {
                if Some(note) != sounding {
                    notes.end(note);
                }
            },
        );
        if self.count == 0 && had > 0 {
            (self.released, self.fading) = (last, sounding);
        } else if let Some(note) = sounding.filter(|&note| address.fits(note)) {
            self.end(note);
        }
    }

    /// Ends notes at once. Returns the key of the one that was heard, if it was among them.
    pub fn choke(&mut self, address: NoteAddress) -> Option<u8> {
        let last = self.heard().copied();
        let heard = self.sounding().map(|held| held.note).or(self.fading).filter(|&note| address.fits(note));
        self.remove_where(|held| address.fits(held.note), Self::end);
        if let Some(fading) = self.fading.take_if(|fading| address.fits(*fading)) {
            self.end(fading);
        }
        if self.count == 0 {
            self.released = last;
        }
        heard.map(|note| note.key)
    }

    /// Forgets what belonged to the last note, which was cut.
    pub fn make_plain(&mut self) {
        self.released = self.released.map(|released| HeldNote::new(released.note, released.velocity));
    }

    /// Takes away the note that the pedal holds, which is then held alone.
    pub fn take_by_pedal(&mut self) -> Option<Note> {
        let held = *self.sounding().filter(|held| held.is_by_pedal)?;
        self.release(NoteAddress::default(), false);
        Some(held.note)
    }

    /// Something changes that belongs to notes. Returns whether the heard note is among them.
    pub fn express(&mut self, address: NoteAddress, expression: NoteExpression) -> bool {
        let last = self.count.checked_sub(1);
        let mut is_heard = false;
        for (at, held) in self.held[..self.count].iter_mut().enumerate() {
            if address.fits(held.note) {
                held.express(expression);
                is_heard |= Some(at) == last;
            }
        }
        if let (None, Some(released)) = (last, &mut self.released)
            && address.fits(released.note)
        {
            released.express(expression);
            is_heard = true;
        }
        is_heard
    }

    fn end(&mut self, note: Note) {
        if let Some(place) = self.over.get_mut(self.over_count) {
            *place = note;
            self.over_count += 1;
        }
    }

    /// Removes notes, oldest first, and hands each to `gone`.
    fn remove_where(&mut self, which: impl Fn(&HeldNote) -> bool, mut gone: impl FnMut(&mut Self, Note)) {
        let mut kept = 0;
        for at in 0..self.count {
            let held = self.held[at];
            if which(&held) {
                gone(self, held.note);
            } else {
                self.held[kept] = held;
                kept += 1;
            }
        }
        self.count = kept;
    }
}
