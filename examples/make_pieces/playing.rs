//! What a player does with phrases: keys, breath and techniques, as MIDI messages at ticks.
//!
//! A slur holds each key until shortly after the next is down; a tongued note lets go early. Breath is a swell over each
//! phrase with a little weight on the beats and on single notes; between phrases the player breathes.

use super::notation::{Joint, Note, Phrase, QUARTER};
use midly::MidiMessage;
use midly::num::u7;

/// Messages and their ticks.
pub type Events = Vec<(u32, MidiMessage)>;

/// Lengths that belong to the player rather than to the music, in ticks: a piece chooses them for its tempo.
#[derive(Clone, Copy)]
pub struct Moments {
    /// Between breath values.
    pub step: u32,
    /// How long before its first note a phrase begins to be blown.
    pub lead: u32,
    /// How long the breath takes to end a phrase.
    pub release: u32,
    /// Overlap of slurred notes.
    pub overlap: u32,
    /// Gap between tongued notes.
    pub gap: u32,
    /// How long before the end of its phrase the key of a falling note comes up.
    pub fall: u32,
}

/// Where notes begin beside the beat as it is written.
#[derive(Clone, Copy)]
pub struct Timing {
    /// Share of a quarter that the first of two eighths has: 0.5 is straight.
    pub swing: f64,
    /// How early or late a note may be, ticks either way.
    pub looseness: u32,
    /// Players with different seeds are early or late on different notes.
    pub seed: u32,
}

impl Timing {
    pub const STRICT: Self = Self { swing: 0.5, looseness: 0, seed: 0 };

    /// The tick at which a written tick is played.
    fn swung(self, tick: u32) -> u32 {
        let within = f64::from(tick % QUARTER) / f64::from(QUARTER);
        let moved = if within < 0.5 {
            2.0 * within * self.swing
        } else {
            1.0 - 2.0 * (1.0 - within) * (1.0 - self.swing)
        };
        tick - tick % QUARTER + (moved * f64::from(QUARTER)).round() as u32
    }

    /// The tick at which a note of this tick begins.
    fn begins(self, tick: u32) -> u32 {
        // Multiplicative hashing (Knuth): it looks like chance, and is the same in every run.
        let hash = (tick ^ self.seed).wrapping_mul(0x9E37_79B1) >> 16;
        self.swung(tick) + hash % (2 * self.looseness + 1) - self.looseness
    }
}

/// How finely the breath is written.
#[derive(Clone, Copy, PartialEq)]
pub enum Breath {
    /// CC2.
    Coarse,
    /// CC2 and CC34, as wind controllers with 14 bits send.
    Fine,
}

pub struct Player {
    /// Written semitones above the key of the file.
    pub transposition: u8,
    pub moments: Moments,
    pub timing: Timing,
    pub breath: Breath,
    /// From one beat with weight to the next, ticks, and how much more breath such a beat has.
    pub beat: u32,
    pub beat_weight: f64,
}

/// Controllers of the techniques. Glissando, scoop and fall are linked to theirs by `saints.toml`.
const VIBRATO: u8 = 1;
const GLISSANDO: u8 = 5;
const GROWL: u8 = 18;
const SCOOP: u8 = 21;
const FALL: u8 = 22;

/// Smooth from 0 to 1.
fn ease(x: f64) -> f64 {
    0.5 - 0.5 * (std::f64::consts::PI * x.clamp(0.0, 1.0)).cos()
}

/// A message of a controller.
pub fn controller(controller: u8, value: u8) -> MidiMessage {
    MidiMessage::Controller { controller: controller.into(), value: value.into() }
}

impl Player {
    /// All phrases from tick `from` on; gives the end.
    pub fn play(&self, phrases: &[Phrase], from: u32, events: &mut Events) -> u32 {
        phrases.iter().fold(from, |at, phrase| {
            let from = at + phrase.rest;
            self.blow(phrase, from, events);
            self.finger(phrase, from, events);
            from + phrase.ticks()
        })
    }

    /// Where the breath of a phrase from tick `from` on has ended. The next phrase begins to be blown there.
    fn silent(&self, phrase: &Phrase, from: u32) -> u32 {
        from + phrase.ticks() - self.moments.lead
    }

    fn blow(&self, phrase: &Phrase, from: u32, events: &mut Events) {
        let Moments { step, lead, .. } = self.moments;
        let mut before = None;
        for tick in (from - lead..=self.silent(phrase, from)).step_by(step as usize) {
            let unit = self.breath_at(phrase, from, tick);
            let value = match self.breath {
                Breath::Coarse => (127.0 * unit).round().clamp(0.0, 127.0) as u16 * 128,
                Breath::Fine => (16383.0 * unit).round().clamp(0.0, 16383.0) as u16,
            };
            if before == Some(value) {
                continue;
            }
            let at = self.timing.swung(tick);
            let [coarse, fine] = [value / 128, value % 128].map(|part| part as u8);
            if before.map(|value| value / 128) != Some(value / 128) {
                events.push((at, controller(2, coarse)));
            }
            if self.breath == Breath::Fine {
                events.push((at, controller(34, fine)));
            }
            before = Some(value);
        }
    }

    /// Breath over full breath at a tick of a phrase that begins at `from`.
    fn breath_at(&self, phrase: &Phrase, from: u32, tick: u32) -> f64 {
        let Moments { lead, release, .. } = self.moments;
        let silent = self.silent(phrase, from);
        let [first, height, last] = phrase.swell;
        let along = (f64::from(tick) - f64::from(from)) / f64::from(silent - release - from);
        let swell = if along < phrase.height_at {
            first + (height - first) * ease(along / phrase.height_at)
        } else {
            height + (last - height) * ease((along - phrase.height_at) / (1.0 - phrase.height_at))
        };
        // The weight of a beat is gone half way to the next.
        let beat = f64::from(tick.saturating_sub(from + phrase.upbeat) % self.beat) / f64::from(self.beat);
        let weight = 1.0 + self.beat_weight * (1.0 - ease(2.0 * beat));
        let rise = ease((f64::from(tick) - f64::from(from - lead)) / f64::from(2 * lead));
        let fall = ease((f64::from(silent) - f64::from(tick)) / f64::from(release));
        swell * weight * rise * fall * self.note_weight(phrase, from, tick)
    }

    /// The weight of the note at a tick. It goes from note to note within the lead before the note, so that a note begins
    /// with the breath it wants.
    fn note_weight(&self, phrase: &Phrase, from: u32, tick: u32) -> f64 {
        let lead = f64::from(self.moments.lead);
        let mut weight = phrase.notes.first().map_or(1.0, |note| note.weight);
        let mut at = from;
        for note in &phrase.notes {
            let there = ease((f64::from(tick) - f64::from(at) + lead) / lead);
            weight += (note.weight - weight) * there;
            at += note.ticks;
        }
        weight
    }

    fn finger(&self, phrase: &Phrase, from: u32, events: &mut Events) {
        let Moments { lead, overlap, gap, fall, .. } = self.moments;
        let mut at = from;
        for (index, note) in phrase.notes.iter().enumerate() {
            let key = u7::new(note.written - self.transposition);
            let after_slur = index > 0 && phrase.notes[index - 1].joint == Joint::Slurred;
            let vel = u7::new(if after_slur {
                60
            } else if note.ticks >= QUARTER {
                96
            } else {
                80
            });
            let down = self.timing.begins(at);
            let end = at + note.ticks;
            let up = match note.joint {
                Joint::Staccato(share) => down + (share * f64::from(note.ticks)).round() as u32,
                _ if index + 1 < phrase.notes.len() => match note.joint {
                    Joint::Slurred => self.timing.begins(end) + overlap,
                    _ => self.timing.begins(end) - gap,
                },
                _ if note.techniques.fall > 0 => self.timing.swung(end - fall),
                _ => self.timing.swung(end - lead),
            };
            self.techniques(note, [down, up], events);
            events.push((down, MidiMessage::NoteOn { key, vel }));
            events.push((up, MidiMessage::NoteOff { key, vel: 64.into() }));
            at = end;
        }
    }

    /// Controllers of one note, from shortly before its key comes down until its key is up.
    fn techniques(&self, note: &Note, [down, up]: [u32; 2], events: &mut Events) {
        let techniques = note.techniques;
        let before = down - self.moments.gap / 2;
        for (number, value) in [
            (GLISSANDO, techniques.glissando),
            (GROWL, techniques.growl),
            (SCOOP, techniques.scoop),
            (FALL, techniques.fall),
        ] {
            if value > 0 {
                // A fall begins where the key comes up.
                let after = if number == FALL { up + self.moments.fall } else { up };
                events.extend([(before, controller(number, value)), (after, controller(number, 0))]);
            }
        }
        if techniques.vibrato > 0 {
            // The note stands first, as a player's does; the vibrato has its depth two thirds of the way.
            let (begins, steps) = (down + (up - down) / 3, 8);
            for step in 1..=steps {
                let value = f64::from(techniques.vibrato) * f64::from(step) / f64::from(steps);
                events.push((
                    begins + step * (up - down) / 3 / steps,
                    controller(VIBRATO, value.round() as u8),
                ));
            }
            events.push((up, controller(VIBRATO, 0)));
        }
    }
}
