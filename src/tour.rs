//! A tour of the instrument: what a clarinettist would try first, and what to listen for. `chalumeau report --tour` and the page in
//! a browser play it.

use chalumeau_core::event::{Event, SettingNumber, Timed};
use chalumeau_core::instrument::player::response::breath_of_dynamic;
use chalumeau_core::instrument::player::vibrato::Vibrato;
use chalumeau_core::instrument::{Attack, Model, Room, Settings, Techniques, Tract};
use chalumeau_core::score::Score;
use chalumeau_core::units::WrittenNote;

/// Dynamics of soft, middle and loud sounds, 0..=1: a little inside the ends, so that *Life* moves both ways.
const SOFT: f32 = 0.15;
const MIDDLE: f32 = 0.6;
const LOUD: f32 = 0.95;
/// Time after the last key in which the sound fades, s; in a room.
const FADE_S: (f64, f64) = (0.4, 3.0);
/// Steps of a swell or of a controller that moves, a second.
const STEPS_HZ: f64 = 100.0;
/// Between two tongued notes, s.
const GAP_S: f64 = 0.03;

/// Written F major from E3 to C6, the first of each scale.
const SCALE: [u8; 20] = [52, 53, 55, 57, 58, 60, 62, 64, 65, 67, 69, 70, 72, 74, 76, 77, 79, 81, 82, 84];
/// The first phrase of the example melody's kind: written notes, and how many eighths each lasts.
const PHRASE: [(u8, f64); 9] =
    [(67, 2.0), (72, 3.0), (74, 1.0), (76, 2.0), (79, 3.0), (77, 1.0), (76, 1.0), (74, 1.0), (72, 4.0)];

/// One sound, and what to listen for.
#[derive(Clone, Debug)]
pub struct Stop {
    /// Its heading.
    pub title: &'static str,
    /// What to listen for.
    pub words: &'static str,
    /// The settings it is played with.
    pub settings: Settings,
    /// What is played, with the time in which it fades.
    pub score: Score,
}

/// Notes, breath and moving settings in time, s. Notes that the instrument lacks are left out.
struct Line {
    events: Vec<(f64, Event)>,
    end_s: f64,
}

impl Line {
    fn new(dynamic: f32) -> Self {
        Self { events: vec![(0.0, breath(dynamic))], end_s: 0.0 }
    }

    /// A written note from the end of what was before, for `length_s`; slurred to the one before it by `legato`.
    fn note(mut self, model: &Model, written: u8, length_s: f64, legato: bool) -> Self {
        let (from_s, to_s) = (self.end_s, self.end_s + length_s);
        self.end_s = to_s;
        let fingered = model.file.fingering(WrittenNote(written));
        let Some(note) = fingered.and_then(|_| WrittenNote(written).sounding(model.file.transposition))
        else {
            return self;
        };
        self.events.push((from_s, Event::NoteOn { note, velocity: 0.8 }));
        // A slurred note comes up just after the next one is down.
        self.events.push((if legato { to_s + 1e-3 } else { to_s - GAP_S }, Event::NoteOff { note }));
        self
    }

    fn notes(mut self, model: &Model, all: impl IntoIterator<Item = (u8, f64)>, legato: bool) -> Self {
        for (written, length_s) in all {
            self = self.note(model, written, length_s, legato);
        }
        self
    }

    fn phrase(self, model: &Model) -> Self {
        self.notes(model, PHRASE.map(|(written, eighths)| (written, 0.2 * eighths)), true)
    }

    /// Something moves from 0 to 1 and, at `back`, to 0 again, along a line of its own between two times.
    fn moves(mut self, from_s: f64, to_s: f64, back: bool, event: impl Fn(f32) -> Event) -> Self {
        let steps = ((to_s - from_s) * STEPS_HZ).round().max(1.0);
        for step in 0..=steps as usize {
            let way = step as f64 / steps;
            let value = if back { 1.0 - (2.0 * way - 1.0).abs() } else { way };
            self.events.push((from_s + way * (to_s - from_s), event(value as f32)));
        }
        self
    }

    fn rest(mut self, length_s: f64) -> Self {
        self.end_s += length_s;
        self
    }

    fn score(self, fade_s: f64, rate: u32) -> Score {
        let at = |time_s: f64| (time_s * f64::from(rate)).round() as usize;
        let mut events: Vec<Timed<Event>> =
            self.events.into_iter().map(|(time_s, event)| Timed { at: at(time_s), event }).collect();
        events.sort_by_key(|timed| timed.at);
        Score { events, samples: at(self.end_s + fade_s) }
    }
}

fn breath(dynamic: f32) -> Event {
    Event::Breath(breath_of_dynamic(f64::from(dynamic), &Settings::default()) as f32)
}

/// All sounds on an instrument, by chapter, at a sample rate in Hz. `base` are the settings where a sound has none of its own.
pub fn chapters(model: &Model, base: Settings, rate: u32) -> Vec<(&'static str, Vec<Stop>)> {
    let stop = |title, words, settings: Settings, line: Line| {
        let fade_s = if settings.room.amount > 0.0 { FADE_S.1 } else { FADE_S.0 };
        Stop { title, words, settings, score: line.score(fade_s, rate) }
    };
    let scale = |dynamic| Line::new(dynamic).notes(model, SCALE.map(|written| (written, 0.25)), true);
    let held = |settings: Settings, title, words| {
        stop(title, words, settings, Line::new(MIDDLE).note(model, 79, 3.0, false))
    };
    let phrase =
        |settings: Settings, title, words| stop(title, words, settings, Line::new(MIDDLE).phrase(model));
    let technique = |techniques: Techniques| Settings { techniques, ..base };
    let attack = |attack| Settings { attack, ..base };
    let attacks = || Line::new(MIDDLE).notes(model, [(60, 0.6), (67, 0.6), (76, 0.6)], false);
    let room =
        |amount, size_m, decay_s| Settings { room: Room { amount, size_m, decay_s, ..base.room }, ..base };
    let interval = SettingNumber::TractIntervalSemitones;
    vec![
        (
            "From pianissimo to fortissimo",
            vec![
                stop(
                    "Scale, pp",
                    "The lowest note to the highest of the clarion. It is dark and even; you can just hear the air.",
                    base,
                    scale(SOFT),
                ),
                stop(
                    "Scale, mf",
                    "The same, about 12 dB louder, with the upper partials of a comfortable breath.",
                    base,
                    scale(MIDDLE),
                ),
                stop("Scale, ff", "The reed beats: the tone turns bright.", base, scale(LOUD)),
                stop(
                    "Swell on C5",
                    "One breath from pp to ff and back. Loudness and colour grow together, without a step.",
                    base,
                    Line::new(0.0)
                        .note(model, 72, 6.0, false)
                        .moves(0.02, 5.9, true, |way| breath(0.03 + 0.97 * way)),
                ),
            ],
        ),
        (
            "From note to note",
            vec![
                stop(
                    "Slurs over the break",
                    "A4 to B4 and back: from one finger to nine. Then octaves up and down.",
                    base,
                    Line::new(MIDDLE)
                        .notes(model, [69, 71, 69, 71, 69, 71, 72, 71].map(|written| (written, 0.3)), true)
                        .rest(0.3)
                        .notes(
                            model,
                            [60, 72, 60, 67, 79, 67, 72, 84, 72].map(|written| (written, 0.5)),
                            true,
                        ),
                ),
                stop(
                    "Staccato",
                    "Ten tongued notes a second.",
                    base,
                    Line::new(MIDDLE).notes(
                        model,
                        SCALE
                            .map(|written| (written, 0.1))
                            .into_iter()
                            .chain(SCALE.map(|written| (written, 0.1)).into_iter().rev()),
                        false,
                    ),
                ),
                stop("Soft attack", "The partials come one after another.", attack(Attack::Soft), attacks()),
                stop(
                    "Normal attack",
                    "The tongue lets go, and the tone is there.",
                    attack(Attack::Normal),
                    attacks(),
                ),
                stop(
                    "Hard attack",
                    "The breath is there before the tongue lets go.",
                    attack(Attack::Hard),
                    attacks(),
                ),
            ],
        ),
        (
            "A held note",
            vec![
                held(
                    Settings { life: 0.0, ..base },
                    "Held, without life",
                    "G5 as a machine holds it: pitch, level and tone colour do not change.",
                ),
                held(
                    Settings { life: 1.0, ..base },
                    "Held, with life",
                    "The same with breath and lip that wander a little, as recorded players' do.",
                ),
                held(
                    Settings { vibrato: Vibrato { depth: 0.5, ..base.vibrato }, ..base },
                    "With vibrato",
                    "It comes after the note has begun. Breath and lip swing together, and each cycle differs a little from the one before.",
                ),
            ],
        ),
        (
            "Techniques",
            vec![
                phrase(base, "A phrase, plain", "To compare with what follows."),
                phrase(
                    technique(Techniques { subtone: 1.0, ..base.techniques }),
                    "Subtone",
                    "The lip covers the reed: the upper partials are gone, the lowest stays.",
                ),
                phrase(
                    technique(Techniques { growl: 0.7, ..base.techniques }),
                    "Growl",
                    "The player sings into the instrument: sums and differences of both tones.",
                ),
                phrase(
                    technique(Techniques { flutter: 0.9, ..base.techniques }),
                    "Flutter tongue",
                    "The tongue rolls an R in the breath.",
                ),
                stop(
                    "The vocal tract bends C6 by ten semitones",
                    "The fingers stay. The tract's resonance goes down, and the reed follows it, not the bore.",
                    Settings { tract: Tract { amount: 1.0, interval_semitones: 7.0 }, ..base },
                    Line::new(MIDDLE)
                        .note(model, 84, 4.0, false)
                        .moves(0.8, 3.2, true, |way| Event::Set(interval, 7.0 - 15.5 * way)),
                ),
                stop(
                    "The rising glissando",
                    "Two octaves and a half in one gesture: the fingers slide off the holes one after another, and the tract leads them.",
                    Settings { glissando_s: 2.2, ..base },
                    Line::new(LOUD).note(model, 53, 0.6, true).note(model, 84, 3.4, false),
                ),
            ],
        ),
        (
            "Rooms",
            vec![
                phrase(room(0.0, 10.0, 1.0), "Dry", "As the microphones of a laboratory hear it."),
                phrase(room(0.35, 8.0, 0.5), "A living room", "Early reflections, and half a second."),
                phrase(room(0.45, 30.0, 2.0), "A concert hall", "Two seconds."),
                phrase(room(0.6, 40.0, 4.0), "A church", "Four seconds."),
            ],
        ),
    ]
}
