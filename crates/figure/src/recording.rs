//! The notes of a recording: pitch and level over time, and the harmonics of each note.

use crate::palette::Colour;
use crate::pitch_line;
use crate::{Axis, Dash, Figure, Line, Panel, Points, Shape};
use chalumeau_core::analysis::pitch::{TrackPoint, WINDOW_S};
use chalumeau_core::analysis::recording::Note;
use chalumeau_core::analysis::spectrum::HARMONICS;

/// Softer moments have no level worth drawing, dB re the loudest: 15 dB below the softest notes.
const SOFT_DB: f64 = -60.0;
/// Free room above and below the notes, semitones, and what is shown where there are none: the octave from middle C.
const AROUND: f64 = 1.5;
const NO_NOTES: (f64, f64) = (60.0, 72.0);
/// As many notes have harmonics of their own; of more, the mean is drawn.
const MOST: usize = 6;

const LOOKS: [(Colour, Dash, Shape); MOST] = [
    (Colour::Blue, Dash::Solid, Shape::Disc),
    (Colour::Vermilion, Dash::Dashed, Shape::Diamond),
    (Colour::Green, Dash::Dotted, Shape::TriangleUp),
    (Colour::Purple, Dash::Solid, Shape::Ring),
    (Colour::Sky, Dash::Dashed, Shape::Cross),
    (Colour::Orange, Dash::Dotted, Shape::Disc),
];

/// Three panels. `names` are those of the notes; `a4_hz` is the pitch of A4, `from_s` the time of the first sample in the file.
pub fn figure(
    title: &str,
    remark: &str,
    notes: &[Note],
    names: &[String],
    track: &[TrackPoint],
    a4_hz: f64,
    from_s: f64,
) -> Figure {
    let key = |hz: f64| pitch_line::key(hz, a4_hz);
    let is_of_a_note = |t_s: f64| notes.iter().any(|note| (note.start_s..note.end_s).contains(&t_s));
    let played =
        track.iter().map(|point| (from_s + point.t_s, point.hz.filter(|_| is_of_a_note(point.t_s)).map(key)));
    let played = pitch_line::points(played);
    let held = notes.iter().flat_map(|note| {
        let at = key(note.f0_hz);
        [(from_s + note.start_s, at), (from_s + note.end_s, at), (from_s + note.end_s, f64::NAN)]
    });
    let keys = notes.iter().map(|note| key(note.f0_hz));
    let (low, high) = keys.fold((f64::MAX, f64::MIN), |(low, high), key| (low.min(key), high.max(key)));
    let (low, high) = if low > high { NO_NOTES } else { (low, high) };
    // Both panels over the same time, half a window beyond the last moment.
    let end_s = track.last().map_or(WINDOW_S, |point| point.t_s + 0.5 * WINDOW_S);
    let time = || Axis::linear("time, s").range(from_s, from_s + end_s);
    let pitch = Panel::new("Pitch", time(), Axis::notes("sounding note").range(low - AROUND, high + AROUND))
        .with(Line::new("mean of each note", held).colour(Colour::Sky).width(6.0))
        .with(Line::new("every 10 ms", played).colour(Colour::Ink).width(1.5));
    let in_db = |rms: f64| 20.0 * rms.log10();
    let loudest_db = in_db(track.iter().map(|point| point.rms).fold(0.0, f64::max));
    let levels = track.iter().map(|point| {
        let level = Some(in_db(point.rms)).filter(|level| *level > loudest_db + SOFT_DB);
        (from_s + point.t_s, level.unwrap_or(f64::NAN))
    });
    let level = Panel::new("Level", time(), Axis::linear("dB re full scale"))
        .with(Line::new("", levels).colour(Colour::Blue));
    Figure::new(title)
        .note(remark)
        .panel(pitch.weight(1.5))
        .panel(level)
        .panel(harmonics(notes, names, from_s))
        .size(1_400, 1_500)
}

/// Levels of the harmonics of a few notes, or their mean.
fn harmonics(notes: &[Note], names: &[String], from_s: f64) -> Panel {
    let axis = || Axis::linear("dB re the strongest");
    let number = || Axis::linear("harmonic").range(0.5, HARMONICS as f64 + 0.5);
    if notes.len() > MOST {
        let most = notes.iter().map(|note| note.levels_db.len()).max().unwrap_or(0);
        let mean = (0..most).map(|index| {
            let levels: Vec<f64> =
                notes.iter().filter_map(|note| note.levels_db.get(index).copied()).collect();
            ((index + 1) as f64, levels.iter().sum::<f64>() / levels.len() as f64)
        });
        let mean: Vec<_> = mean.collect();
        let title = format!("Harmonics, mean of {} notes", notes.len());
        return Panel::new(title, number(), axis())
            .with(Line::new("", mean.clone()).colour(Colour::Blue))
            .with(Points::new("", mean).colour(Colour::Blue));
    }
    let mut panel = Panel::new("Harmonics", number(), axis());
    for ((note, name), (colour, dash, shape)) in notes.iter().zip(names).zip(LOOKS) {
        let levels: Vec<_> = (1..).map(f64::from).zip(note.levels_db.iter().copied()).collect();
        let name = format!("{name} at {:.1} s", from_s + note.start_s);
        panel = panel
            .with(Line::new(name, levels.clone()).colour(colour).dash(dash))
            .with(Points::new("", levels).colour(colour).shape(shape));
    }
    panel
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Layer;

    fn note(start_s: f64, f0_hz: f64) -> Note {
        Note {
            start_s,
            end_s: start_s + 0.5,
            f0_hz,
            level_dbfs: -20.0,
            t90_s: 0.05,
            centroid_hz: 900.0,
            levels_db: vec![0.0, -30.0, -6.0],
        }
    }

    #[test]
    fn a_leap_breaks_the_line_and_few_notes_have_harmonics_of_their_own() {
        let track: Vec<_> = (0..100)
            .map(|n| TrackPoint {
                t_s: 0.01 * f64::from(n),
                hz: Some(if n < 50 { 220.0 } else { 330.0 }),
                rms: 0.1,
            })
            .collect();
        let names = ["A3".to_owned(), "E4".to_owned()];
        let two = figure("x.wav", "", &[note(0.0, 220.0), note(0.5, 330.0)], &names, &track, 440.0, 2.0);
        let Layer::Line(line) = &two.panels[0].layers[1] else { panic!("no line") };
        assert_eq!(line.pieces.iter().map(Vec::len).collect::<Vec<_>>(), [50, 50]);
        assert!((line.pieces[0][0][0] - 2.0).abs() < 1e-9);
        assert_eq!(two.panels[2].layers.len(), 4);
        let many: Vec<_> = (0..9).map(|n| note(f64::from(n), 220.0)).collect();
        let many = figure("x.wav", "", &many, &vec!["A3".to_owned(); 9], &track, 440.0, 0.0);
        assert_eq!(many.panels[2].layers.len(), 2);
    }
}
