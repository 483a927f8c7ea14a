//! How far each note is from where it should be.

use crate::palette::Colour;
use crate::{Axis, Dash, Direction, Figure, Line, Mark, Panel, Points, Shape, Span};

/// One round through the notes.
pub struct Round {
    /// What was different about it: "natural".
    pub name: String,
    /// Written note (MIDI) and what sounded.
    pub notes: Vec<(u8, TunedNote)>,
}

/// What sounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TunedNote {
    /// The note, so far from its pitch, cents.
    Own(f64),
    /// Another note, so far away, cents.
    Other(f64),
    /// Nothing.
    Silence,
}

/// Band called in tune, cents: about what a listener notices in a melody (by judgement).
const IN_TUNE_CENTS: f64 = 5.0;

/// Cents over notes: the rounds in one panel, if there are any, and in another what the bore does without its notes being
/// tuned. Notes in another register or silent stand at the lower edge.
pub fn figure(instrument: &str, note: &str, rounds: &[Round], as_built: &Round) -> Figure {
    let mut figure = Figure::new(format!("Intonation: {instrument}")).note(note);
    if !rounds.is_empty() {
        let what = "As played: natural is in tune at mezzo-forte, and drifts with the breath; tempered is in tune at every breath";
        figure = figure.panel(panel(what, rounds));
    }
    let what = "As built: what bore and reed do before each note is corrected";
    figure.panel(panel(what, std::slice::from_ref(as_built)))
}

fn panel(title: &str, rounds: &[Round]) -> Panel {
    let own = rounds.iter().flat_map(|round| &round.notes).filter_map(|(_, heard)| match heard {
        TunedNote::Own(cents) => Some(*cents),
        _ => None,
    });
    let (low, high) = own.fold((-6.0_f64, 6.0_f64), |(low, high), cents| (low.min(cents), high.max(cents)));
    let failed =
        rounds.iter().flat_map(|round| &round.notes).any(|(_, heard)| !matches!(heard, TunedNote::Own(_)));
    let room = 0.06 * (high - low);
    // One line of marks for each round, below the notes.
    let rows = rounds.len() as f64;
    let edge = low - if failed { rows * room } else { room };
    let mut panel = Panel::new(
        title,
        Axis::notes("written note"),
        Axis::linear("cents from equal temperament")
            .range(edge - if failed { room } else { 0.0 }, high + room),
    )
    .with(Span {
        of: Direction::Y,
        from: -IN_TUNE_CENTS,
        to: IN_TUNE_CENTS,
        name: format!("within {IN_TUNE_CENTS} cents"),
        colour: Colour::Grey,
    })
    .with(Mark::new(Direction::Y, 0.0, "").colour(Colour::Ink).dash(Dash::Solid));
    let looks = [
        (Colour::Blue, Dash::Solid, Shape::Disc),
        (Colour::Vermilion, Dash::Dashed, Shape::Diamond),
        (Colour::Green, Dash::Dotted, Shape::TriangleUp),
    ];
    for ((row, round), (colour, dash, shape)) in rounds.iter().enumerate().zip(looks.into_iter().cycle()) {
        let level = low - (row + 1) as f64 * room;
        let cents = |heard: &TunedNote| if let TunedNote::Own(cents) = heard { *cents } else { f64::NAN };
        let points = || round.notes.iter().map(|(written, heard)| (f64::from(*written), cents(heard)));
        let at_edge = |which: fn(&TunedNote) -> bool| {
            let notes = round.notes.iter().filter(move |(_, heard)| which(heard));
            notes.map(|(written, _)| (f64::from(*written), level)).collect::<Vec<_>>()
        };
        let worst = points().map(|(_, cents)| cents).filter(|cents| cents.is_finite());
        let name = match worst.map(f64::abs).reduce(f64::max) {
            Some(worst) => format!("{} (largest {worst:.1} cents)", round.name),
            None => format!("{} (none sounds)", round.name),
        };
        panel = panel
            .with(Line::new(name, points()).colour(colour).dash(dash))
            .with(Points::new("", points()).colour(colour).shape(shape).size(5.5));
        let others = at_edge(|heard| matches!(heard, TunedNote::Other(_)));
        if !others.is_empty() {
            let name = format!("{}: another note sounds", round.name);
            panel = panel.with(Points::new(name, others).colour(colour).shape(Shape::Cross).size(8.0));
        }
        let silent = at_edge(|heard| *heard == TunedNote::Silence);
        if !silent.is_empty() {
            let name = format!("{}: silent", round.name);
            panel = panel.with(Points::new(name, silent).colour(colour).shape(Shape::Ring).size(8.0));
        }
    }
    panel
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Layer;

    #[test]
    fn lost_notes_stand_at_the_edge_and_break_the_line() {
        let notes = vec![
            (60, TunedNote::Own(1.0)),
            (61, TunedNote::Other(-1900.0)),
            (62, TunedNote::Silence),
            (63, TunedNote::Own(-2.0)),
        ];
        let round = || Round { name: "natural".to_owned(), notes: notes.clone() };
        assert_eq!(figure("test", "", &[], &round()).panels.len(), 1);
        let figure = figure("test", "", &[round()], &round());
        assert_eq!(figure.panels.len(), 2);
        let panel = &figure.panels[0];
        let [low, high] = panel.y.range.unwrap();
        assert!((-9.0..-6.0).contains(&low) && high < 9.0, "{low} {high}");
        let mut marks = Vec::new();
        for layer in &panel.layers {
            match layer {
                Layer::Line(line) => assert_eq!(line.pieces.len(), 2, "the line breaks"),
                Layer::Points(points) if !points.name.is_empty() => {
                    marks.push((points.shape, points.points[0]))
                }
                _ => {}
            }
        }
        assert_eq!(marks.len(), 2);
        let names = |round: &Round| -> Vec<String> {
            let layers = super::figure("test", "", &[], round).panels.remove(0).layers;
            let line = |layer| if let Layer::Line(line) = layer { Some(line.name) } else { None };
            layers.into_iter().filter_map(line).collect()
        };
        assert_eq!(names(&round()), ["natural (largest 2.0 cents)"]);
        let silent = Round { name: "natural".to_owned(), notes: notes[1..3].to_vec() };
        assert_eq!(names(&silent), ["natural (none sounds)"]);
        assert!(marks[0].0 == Shape::Cross && marks[0].1[0] == 61.0 && marks[0].1[1] > low);
        assert!(marks[1].0 == Shape::Ring && marks[1].1[0] == 62.0);
    }
}
