//! Random notes and MIDI.

use clack_host::events::Match;
use clack_host::events::event_types::*;
use clack_host::prelude::*;
use fastrand::Rng;

use super::bench::Session;

/// Notes and MIDI as a keyboard may send them, or as no keyboard should.
#[derive(Clone, Copy, PartialEq)]
pub enum Manners {
    /// Each note ends that has begun.
    Consistent,
    /// Ends without beginnings, beginnings without ends.
    Inconsistent,
    /// Some ids, channels, keys and ports are left open.
    Wildcard,
}

/// Random notes and MIDI, one stream of them.
pub struct Keyboard {
    rng: Rng,
    manners: Manners,
    held: Vec<(u16, u16, u32)>,
    next_id: u32,
}

impl Keyboard {
    pub fn new(manners: Manners) -> Self {
        Self { rng: Rng::with_seed(7), manners, held: Vec::new(), next_id: 0 }
    }

    /// Up to eight events of a block, in order of time.
    pub fn play(&mut self, frames: usize, into: &mut EventBuffer) {
        let mut times: Vec<u32> = (0..self.rng.usize(0..8)).map(|_| self.rng.u32(0..frames as u32)).collect();
        times.sort_unstable();
        for at in times {
            self.say(at, into);
        }
    }

    fn say(&mut self, at: u32, into: &mut EventBuffer) {
        match self.rng.u8(0..8) {
            0..3 => {
                let note = (self.rng.u16(0..16), self.rng.u16(0..128), self.next_id);
                self.next_id += 1;
                self.held.push(note);
                into.push(&NoteOnEvent::new(at, self.pckn(note), self.rng.f64()));
            }
            3..5 => {
                if let Some(note) = self.known() {
                    into.push(&NoteOffEvent::new(at, self.pckn(note), self.rng.f64()));
                }
            }
            5 => {
                if let Some(note) = self.known() {
                    into.push(&NoteChokeEvent::new(at, self.pckn(note)));
                }
            }
            6 => {
                let kinds = [
                    NoteExpressionType::Volume,
                    NoteExpressionType::Pan,
                    NoteExpressionType::Tuning,
                    NoteExpressionType::Vibrato,
                    NoteExpressionType::Expression,
                    NoteExpressionType::Brightness,
                    NoteExpressionType::Pressure,
                ];
                let kind = kinds[self.rng.usize(0..kinds.len())];
                let note = (self.rng.u16(0..16), self.rng.u16(0..128), self.rng.u32(0..64));
                into.push(&NoteExpressionEvent::new(at, self.pckn(note), kind, self.rng.f64()));
            }
            _ => {
                // Any channel message: note off, note on, pressures, controllers, programs, the wheel.
                let status = 0x80 + 0x10 * self.rng.u8(0..7) + self.rng.u8(0..16);
                into.push(&MidiEvent::new(at, 0, [status, self.rng.u8(0..128), self.rng.u8(0..128)]));
            }
        }
    }

    /// A note that may end.
    fn known(&mut self) -> Option<(u16, u16, u32)> {
        if self.manners == Manners::Inconsistent {
            return Some((self.rng.u16(0..16), self.rng.u16(0..128), self.rng.u32(0..1_000)));
        }
        let index = (!self.held.is_empty()).then(|| self.rng.usize(0..self.held.len()))?;
        Some(self.held.swap_remove(index))
    }

    pub fn pckn(&mut self, (channel, key, id): (u16, u16, u32)) -> Pckn {
        let leaves_open = self.manners == Manners::Wildcard;
        let rng = &mut self.rng;
        let mut open = || leaves_open && rng.u8(0..3) == 0;
        let some = |is_open: bool, value: u16| if is_open { Match::All } else { Match::Specific(value) };
        let [port, channel, key] = [0, channel, key].map(|value| some(open(), value));
        let id = if open() { Match::All } else { Match::Specific(id) };
        Pckn { port_index: port, channel, key, note_id: id }
    }
}

/// Plays blocks of these lengths with random notes.
pub fn play_notes(session: &mut Session, manners: Manners, blocks: impl IntoIterator<Item = usize>) -> f32 {
    let mut keyboard = Keyboard::new(manners);
    let mut peak = 0.0_f32;
    for frames in blocks {
        let mut said = EventBuffer::new();
        keyboard.play(frames, &mut said);
        let block = session.block(frames, &said, None);
        peak = block.channels[0].iter().fold(peak, |peak, x| peak.max(x.abs()));
    }
    peak
}
