//! Figures of breath: the pressures at which notes change, a crescendo and diminuendo of one note, and the pressure over
//! the knob's angle.
//!
//! Colours as in the editor: blue is breath, green where a note speaks, orange where the reed beats, vermilion where it
//! closes, grey where the note chokes.

use crate::palette::Colour;
use crate::{Axis, Dash, Direction, Figure, Line, Mark, Panel, Points, Polygon, SecondAxis, Shape, Span};

/// Centimetres of water in a kilopascal.
const CM_WATER: f64 = 10.197;

/// Mouth pressures at which a note changes, kPa; not finite for a note that cannot sound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NotePressures {
    /// Written note (MIDI).
    pub written: u8,
    /// It begins.
    pub speaks_kpa: f64,
    /// The reed begins to touch the lay.
    pub beats_kpa: f64,
    /// Above this the reed stays shut.
    pub chokes_kpa: f64,
}

impl NotePressures {
    /// With their names, in order.
    fn named(&self) -> [(f64, &'static str, Colour); 3] {
        [
            (self.speaks_kpa, "speaks", Colour::Green),
            (self.beats_kpa, "beats", Colour::Orange),
            (self.chokes_kpa, "chokes", Colour::Grey),
        ]
    }
}

/// Over these notes, whether or not they have values.
pub(super) fn written_axis(notes: impl Iterator<Item = u8>) -> Axis {
    let (low, high) = notes.fold((u8::MAX, 0), |(low, high), note| (low.min(note), high.max(note)));
    let axis = Axis::notes("written note");
    if low > high { axis } else { axis.range(f64::from(low) - 1.0, f64::from(high) + 1.0) }
}

/// All notes: where they speak, beat, close and choke.
pub fn pressures(instrument: &str, note: &str, closing_kpa: f64, notes: &[NotePressures]) -> Figure {
    let series = |value: fn(&NotePressures) -> f64| -> Vec<(f64, f64)> {
        notes.iter().map(|note| (f64::from(note.written), value(note))).collect()
    };
    let (speaks, beats) = (series(|note| note.speaks_kpa), series(|note| note.beats_kpa));
    let chokes = series(|note| note.chokes_kpa);
    let top = chokes.iter().map(|&(_, kpa)| kpa).filter(|kpa| kpa.is_finite()).fold(closing_kpa, f64::max);
    let mut panel = Panel::new(
        "",
        written_axis(notes.iter().map(|note| note.written)),
        Axis::linear("mouth pressure, kPa").range(0.0, 1.06 * top),
    )
    .right(SecondAxis::times(CM_WATER, "cm of water"));
    // Where the reed swings without touching, and where it beats.
    let finite = |curve: &[(f64, f64)]| curve.iter().all(|(_, kpa)| kpa.is_finite());
    if finite(&speaks) && finite(&beats) && finite(&chokes) && notes.len() > 1 {
        let between = |low: &[(f64, f64)], high: &[(f64, f64)]| {
            low.iter().chain(high.iter().rev()).copied().collect::<Vec<_>>()
        };
        panel = panel
            .with(Polygon::filled("", between(&speaks, &beats), Colour::Green, 0.12))
            .with(Polygon::filled("", between(&beats, &chokes), Colour::Orange, 0.12));
    }
    panel = panel.with(
        Mark::new(
            Direction::Y,
            closing_kpa,
            format!("closes: the resting reed is shut, {closing_kpa:.2} kPa"),
        )
        .colour(Colour::Vermilion),
    );
    for (name, curve, colour, shape) in [
        ("chokes: above this the reed stays shut", chokes, Colour::Grey, Shape::Diamond),
        ("beats: the reed touches the lay in each cycle", beats, Colour::Orange, Shape::TriangleUp),
        ("speaks: here the note begins", speaks, Colour::Green, Shape::Disc),
    ] {
        panel = panel
            .with(Line::new(name, curve.clone()).colour(colour))
            .with(Points::new("", curve).colour(colour).shape(shape).size(5.0));
    }
    Figure::new(format!("How hard each note is blown: {instrument}")).note(note).panel(panel).size(1_600, 900)
}

/// A note swelled from silence and faded again.
pub struct Swell {
    /// What is played: "written F3".
    pub title: String,
    /// By which settings.
    pub note: String,
    /// Pressure that shuts the resting reed, kPa.
    pub closing_kpa: f64,
    /// Where theory has the note change.
    pub changes: Option<NotePressures>,
    /// Time, s; mouth pressure, kPa; rms of the pressure in the mouthpiece, kPa; part of the time the reed is shut.
    pub course: Vec<[f64; 4]>,
    /// From this rms on a note sounds, kPa.
    pub sounds_kpa: f64,
}

/// What a moment of a swell is called, and its colour.
const STATES: [(&str, Colour); 3] = [
    ("sounds", Colour::Green),
    ("sounds, the reed shuts in each cycle", Colour::Orange),
    ("blown shut", Colour::Grey),
];

impl Swell {
    /// Index into [`STATES`], or none for a breath too weak.
    fn state(&self, &[_, kpa, rms, shut]: &[f64; 4]) -> Option<usize> {
        match (rms > self.sounds_kpa, shut > 0.0) {
            (true, beats) => Some(usize::from(beats)),
            (false, _) => (shut > 0.5 && kpa > self.closing_kpa).then_some(2),
        }
    }

    /// From, to and state of each stretch of one state.
    fn stretches(&self) -> Vec<(f64, f64, usize)> {
        let mut all: Vec<(f64, f64, usize)> = Vec::new();
        for pair in self.course.windows(2) {
            let Some(state) = self.state(&pair[0]) else { continue };
            let (from, to) = (pair[0][0], pair[1][0]);
            match all.last_mut() {
                Some(stretch) if stretch.2 == state && stretch.1 == from => stretch.1 = to,
                _ => all.push((from, to, state)),
            }
        }
        all
    }

    /// Breath over time with what sounds under it, and the sound's amplitude.
    pub fn figure(&self) -> Figure {
        let end_s = self.course.last().map_or(1.0, |moment| moment[0]).max(1e-3);
        let time = |label: &str| Axis::linear(label).range(0.0, end_s);
        let series = |which: usize| self.course.iter().map(move |moment| (moment[0], moment[which]));
        let mut breath =
            Panel::new("Breath, and what sounds", time(""), Axis::linear("mouth pressure, kPa")).weight(1.5);
        let mut named = [false; STATES.len()];
        for (from, to, state) in self.stretches() {
            let (name, colour) = STATES[state];
            let name = if std::mem::replace(&mut named[state], true) { "" } else { name };
            breath = breath.with(Span { of: Direction::X, from, to, name: name.to_owned(), colour });
        }
        if let Some(changes) = self.changes {
            for (kpa, name, colour) in changes.named().into_iter().filter(|(kpa, ..)| kpa.is_finite()) {
                breath = breath.with(Mark::new(Direction::Y, kpa, format!("{name} {kpa:.2}")).colour(colour));
            }
        }
        breath = breath
            .with(
                Mark::new(Direction::Y, self.closing_kpa, format!("closes {:.2}", self.closing_kpa))
                    .colour(Colour::Vermilion),
            )
            .with(Line::new("", series(1)).width(3.5));
        let sound = Panel::new("Sound", time("time, s"), Axis::linear("rms in the mouthpiece, kPa"))
            .with(Polygon::area("", series(2), 0.0, Colour::Blue, 0.2))
            .with(Line::new("", series(2)));
        Figure::new(format!("Crescendo and decrescendo: {}", self.title))
            .note(self.note.clone())
            .panel(breath)
            .panel(sound)
            .size(1_600, 1_150)
    }
}

/// What one note makes of the knob's angle.
pub struct Turn {
    /// Which note: "E3".
    pub name: String,
    /// Angle, degrees, and mouth pressure, kPa.
    pub map: Vec<(f64, f64)>,
    /// Where it speaks: felt threshold and sounding threshold at once.
    pub speaks: (f64, f64),
    /// Where the resting reed is shut.
    pub closes: (f64, f64),
}

/// Mouth pressure against angle for several notes.
pub fn turns(note: &str, closing_kpa: f64, turns: &[Turn]) -> Figure {
    let mut panel = Panel::new(
        "",
        Axis::linear("angle of the knob from rest, degrees"),
        Axis::linear("mouth pressure, kPa"),
    )
    .with(Mark::new(Direction::Y, closing_kpa, "closes").colour(Colour::Vermilion));
    for (index, turn) in turns.iter().enumerate() {
        let colour = Colour::of_family(index, turns.len());
        let (deg, kpa) = turn.speaks;
        panel = panel
            .with(
                Line::new(
                    format!("{}: speaks at {deg:.0} degrees, {kpa:.2} kPa", turn.name),
                    turn.map.iter().copied(),
                )
                .colour(colour)
                .dash(if index % 2 == 1 { Dash::Dashed } else { Dash::Solid }),
            )
            .with(Points::new("", [turn.speaks]).colour(colour).size(8.0))
            .with(Points::new("", [turn.closes]).colour(colour).shape(Shape::Ring).size(8.0));
    }
    Figure::new("From the angle of the knob to mouth pressure").note(note).panel(panel).size(1_600, 900)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Layer;

    fn swell() -> Swell {
        let course = [
            [0.0, 0.0, 0.0, 0.0],
            [1.0, 2.5, 1.0, 0.0],
            [2.0, 3.0, 1.2, 0.0],
            [3.0, 5.0, 2.0, 0.3],
            [4.0, 6.5, 2.2, 0.4],
            [5.0, 13.0, 0.0, 1.0],
            [6.0, 14.0, 0.0, 1.0],
            [7.0, 1.0, 0.0, 0.0],
        ];
        Swell {
            title: String::new(),
            note: String::new(),
            closing_kpa: 6.0,
            changes: None,
            course: course.to_vec(),
            sounds_kpa: 0.06,
        }
    }

    #[test]
    fn a_swell_says_when_it_sounds_beats_and_is_blown_shut() {
        assert_eq!(swell().stretches(), [(1.0, 3.0, 0), (3.0, 5.0, 1), (5.0, 7.0, 2)]);
        let figure = swell().figure();
        let spans: Vec<&str> = figure.panels[0]
            .layers
            .iter()
            .filter_map(|layer| if let Layer::Span(span) = layer { Some(span.name.as_str()) } else { None })
            .collect();
        assert_eq!(spans, ["sounds", "sounds, the reed shuts in each cycle", "blown shut"]);
    }

    #[test]
    fn notes_that_cannot_sound_leave_a_gap() {
        let nan = f64::NAN;
        let note =
            |written, speaks_kpa| NotePressures { written, speaks_kpa, beats_kpa: 4.0, chokes_kpa: 8.0 };
        let figure = pressures("", "", 6.0, &[note(60, 2.2), note(61, nan), note(62, 2.3)]);
        let lines = figure.panels[0].layers.iter().filter_map(|layer| match layer {
            Layer::Line(line) if line.name.starts_with("speaks") => Some(line.pieces.len()),
            _ => None,
        });
        assert_eq!(lines.collect::<Vec<_>>(), [2]);
    }
}
