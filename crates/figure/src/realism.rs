//! Played notes against recorded ones: error, centroid, level, and which harmonics differ.

use crate::palette::Colour;
use crate::{Axis, Dash, Direction, Figure, Line, Mark, Panel, Points, Shape, Span};

/// One note of one dynamic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ComparedNote {
    /// Sounding note, MIDI.
    pub midi: u8,
    /// Mean distance of h2..h10, dB.
    pub error_db: f64,
    /// Centroid over the recorded one; `None` for a note that failed.
    pub centroid_ratio: Option<f64>,
    /// Level; `None` for a note that failed, dB.
    pub level_db: Option<f64>,
    /// Level of the recording, dB.
    pub recorded_level_db: f64,
}

/// All notes of one dynamic.
#[derive(Clone, Debug, PartialEq)]
pub struct ComparedDynamic {
    /// "pp".
    pub name: String,
    /// Its notes, low to high.
    pub notes: Vec<ComparedNote>,
    /// Mean error, dB.
    pub error_db: f64,
    /// Mean difference of each harmonic from the first on, played less recorded, dB.
    pub differences_db: Vec<f64>,
}

const LOOKS: [(Colour, Dash, Shape); 3] = [
    (Colour::Blue, Dash::Solid, Shape::Disc),
    (Colour::Green, Dash::Dashed, Shape::Diamond),
    (Colour::Vermilion, Dash::Dotted, Shape::TriangleUp),
];

/// Four panels over the sounding note: error, centroid ratio with the range that counts as right, level; and the mean
/// difference of each harmonic. Recorded levels are moved by one number for all, so that their mean is the played one's.
pub fn figure(title: &str, notes: &[String], right: (f64, f64), dynamics: &[ComparedDynamic]) -> Figure {
    let sounding = || Axis::notes("sounding note");
    let mut error = Panel::new("Harmonics 2 to 10", sounding(), Axis::linear("mean distance, dB"));
    let mut centroid = Panel::new("Centroid", sounding(), Axis::log("played over recorded")).with(Span {
        of: Direction::Y,
        from: right.0,
        to: right.1,
        name: format!("within {} to {}", right.0, right.1),
        colour: Colour::Grey,
    });
    let mut level = Panel::new("Level; rings: recorded", sounding(), Axis::linear("dB re full scale"));
    let mut harmonics =
        Panel::new("Mean difference", Axis::linear("harmonic"), Axis::linear("played less recorded, dB"))
            .with(Mark::new(Direction::Y, 0.0, "").colour(Colour::Ink).dash(Dash::Solid));
    let all = dynamics.iter().flat_map(|dynamic| &dynamic.notes);
    let (count, sum) = all
        .filter_map(|note| Some(note.level_db? - note.recorded_level_db))
        .fold((0, 0.0), |(count, sum), offset| (count + 1, sum + offset));
    let offset = if count > 0 { sum / f64::from(count) } else { 0.0 };
    for (dynamic, (colour, dash, shape)) in dynamics.iter().zip(LOOKS.into_iter().cycle()) {
        let over = |value: fn(&ComparedNote) -> f64| {
            dynamic.notes.iter().map(|note| (f64::from(note.midi), value(note))).collect::<Vec<_>>()
        };
        let name = format!("{} (mean {:.1} dB)", dynamic.name, dynamic.error_db);
        let errors = over(|note| note.error_db);
        error = error
            .with(Line::new(name, means(&errors)).colour(colour).dash(dash))
            .with(Points::new("", errors).colour(colour).shape(shape));
        let ratios = over(|note| note.centroid_ratio.unwrap_or(f64::NAN));
        centroid = centroid
            .with(Line::new(dynamic.name.clone(), means(&ratios)).colour(colour).dash(dash))
            .with(Points::new("", ratios).colour(colour).shape(shape));
        let levels = over(|note| note.level_db.unwrap_or(f64::NAN));
        let recorded = means(&over(|note| note.recorded_level_db)).into_iter().map(|(x, y)| (x, y + offset));
        level = level
            .with(Line::new(dynamic.name.clone(), means(&levels)).colour(colour).dash(dash))
            .with(Points::new("", recorded).colour(colour).shape(Shape::Ring));
        let differences = (1..).map(f64::from).zip(dynamic.differences_db.iter().copied());
        harmonics = harmonics.with(Line::new(dynamic.name.clone(), differences).colour(colour).dash(dash));
    }
    let figure = Figure::new(title).columns(2).panel(error).panel(centroid).panel(level).panel(harmonics);
    notes.iter().fold(figure, |figure, note| figure.note(note.clone()))
}

/// The mean of the takes of each note, which follow each other; NaN where all failed.
fn means(takes: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mean = |takes: &[(f64, f64)]| {
        let heard: Vec<f64> =
            takes.iter().map(|(_, value)| *value).filter(|value| value.is_finite()).collect();
        (takes[0].0, heard.iter().sum::<f64>() / heard.len() as f64)
    };
    takes.chunk_by(|a, b| a.0 == b.0).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Layer;

    #[test]
    fn recorded_levels_are_moved_to_the_played_ones_and_failures_break_lines() {
        let note = |midi: u8, level_db: Option<f64>| ComparedNote {
            midi,
            error_db: 5.0,
            centroid_ratio: level_db.map(|_| 1.0),
            level_db,
            recorded_level_db: -50.0,
        };
        let notes = vec![note(60, Some(-20.0)), note(62, None), note(64, Some(-22.0))];
        let dynamic = ComparedDynamic {
            name: "mf".to_owned(),
            notes,
            error_db: 5.0,
            differences_db: vec![0.0, 3.0, -2.0],
        };
        let figure = figure("test", &[], (0.8, 1.25), &[dynamic]);
        let layers = &figure.panels[2].layers;
        let Layer::Line(played) = &layers[0] else { panic!() };
        assert_eq!(played.pieces, [vec![[60.0, -20.0]], vec![[64.0, -22.0]]]);
        assert_eq!(
            means(&[(60.0, 1.0), (60.0, 3.0), (61.0, f64::NAN), (61.0, 5.0)]),
            [(60.0, 2.0), (61.0, 5.0)]
        );
        let Layer::Points(recorded) = &layers[1] else { panic!() };
        assert_eq!(recorded.points, [[60.0, -21.0], [62.0, -21.0], [64.0, -21.0]]);
    }
}
