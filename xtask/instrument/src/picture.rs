//! The demo's pictures, drawn by the library as `render --plot` draws: a performance, and one played on a knob.

use std::path::Path;

use anyhow::Result;
use chalumeau_core::analysis::overview::{Envelope, Overview, Watcher};
use chalumeau_core::event::Event;
use chalumeau_core::instrument::{KeyNotes, Settings};
use chalumeau_core::score::{Score, closing_kpa};
use chalumeau_figure::palette::Colour;
use chalumeau_figure::performance::{Note, PerformanceFigure as Played, outline, performance};
use chalumeau_figure::{Axis, Dash, Figure, Line, Panel, draw};

use crate::touch_demo::Performance;

/// Columns of a picture of usual width.
const COLUMNS: usize = 1_300;

fn seen(samples: &[f32], rate_hz: f64) -> Overview {
    let mut watcher = Watcher::new(samples.len(), rate_hz, COLUMNS);
    watcher.see(samples);
    watcher.finish()
}

/// Draws `samples` and the score they come from.
pub fn write(path: &Path, samples: &[f32], rate_hz: f64, score: &Score, a4_hz: f64) -> Result<()> {
    let settings = Settings::default();
    // Full breath over the pressure that shuts the reed.
    let full = settings.breath_full_kpa / closing_kpa(&settings);
    let mut gamma = Envelope::new(samples.len(), COLUMNS);
    let mut breaths = score.events.iter().filter_map(|event| match event.event {
        Event::Breath(unit) => Some((event.at, full * unit)),
        _ => None,
    });
    let (mut now, mut next) = (0.0, breaths.next());
    for at in 0..samples.len() {
        while let Some((_, value)) = next.filter(|&(from, _)| from <= at) {
            (now, next) = (value, breaths.next());
        }
        gamma.push(now);
    }
    let notes = score.note_spans(&KeyNotes::default()).into_iter().map(|sounding| Note {
        note: sounding.note,
        from_s: sounding.from as f64 / rate_hz,
        to_s: sounding.to as f64 / rate_hz,
    });
    let figure = performance(&Played {
        title: "The melody, played by the bundled plugin",
        notes: vec![format!("{rate_hz} Hz, A4 = {a4_hz} Hz; breath as the score asks for it")],
        overview: &seen(samples, rate_hz),
        score: &notes.collect::<Vec<_>>(),
        a4_hz,
        gamma: &gamma,
        closing_pa: settings.closing_pa(),
        moment: None,
    });
    Ok(std::fs::write(path, draw::png(&figure, None)?)?)
}

/// Draws what a hand did on the knob, and what came of it: angle, mouth pressure, torque, sound.
pub fn write_touch(path: &Path, performance: &Performance, rate_hz: f64) -> Result<()> {
    let seconds = performance.left.len() as f64 / rate_hz;
    let within = |t: f64| (0.0..=seconds).contains(&t);
    // A threshold holds from its note to the next.
    let threshold = |which: usize| {
        let mut line = Vec::new();
        for (index, row) in performance.threshold.iter().enumerate() {
            let until = performance.threshold.get(index + 1).map_or(seconds, |next| next[0]);
            line.extend([(row[0], row[which]), (until, row[which])]);
        }
        Line::new("threshold of each note", line).colour(Colour::Vermilion).dash(Dash::Dashed).width(2.0)
    };
    let knob = |which: usize| {
        let rows = performance.knob.iter().filter(|row| within(row[0]));
        Line::new("", rows.map(|row| (row[0], row[which])).collect::<Vec<_>>()).width(2.0)
    };
    let mut held: Vec<(f64, f64)> = Vec::new();
    for &[t, gamma] in performance.gamma.iter().filter(|row| within(row[0])) {
        let before = held.last().map_or(0.0, |&(_, gamma)| gamma);
        held.extend([(t, before), (t, gamma)]);
    }
    let time = |label: &str| Axis::linear(label).range(0.0, seconds);
    let figure = Figure::new("The melody, blown by a hand on the simulated knob")
        .panel(
            Panel::new("Angle of the knob", time(""), Axis::linear("degrees"))
                .with(knob(1))
                .with(threshold(1)),
        )
        .panel(
            Panel::new(
                "Mouth pressure over the pressure that shuts the reed",
                time(""),
                Axis::linear("gamma"),
            )
            .with(Line::new("", held).width(2.0))
            .with(threshold(2)),
        )
        .panel(
            Panel::new("Torque of the motor, against the hand", time(""), Axis::linear("mNm")).with(knob(2)),
        )
        .panel(Panel { x: time("time, s"), ..outline(&seen(&performance.left, rate_hz)) })
        .size(1_600, 1_500);
    Ok(std::fs::write(path, draw::png(&figure, None)?)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::score::midi_file;
    use std::f32::consts::TAU;

    /// A tone with the demo's score, and a hand that turns the knob with it.
    #[test]
    fn both_pictures_of_the_demo_are_drawn() {
        let melody = chalumeau_test_host::machine::root().join("examples/melody.mid");
        let score = midi_file::read(&std::fs::read(melody).unwrap(), 48_000).unwrap();
        let left: Vec<f32> =
            (0..score.samples).map(|n| 0.3 * (TAU * 233.1 * n as f32 / 48_000.0).sin()).collect();
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        write(&path("a.png"), &left, 48_000.0, &score, 440.0).unwrap();
        let times = || (0..2_900).map(|n| 0.01 * f64::from(n));
        let performance = Performance {
            left,
            knob: times().map(|t| [t, 150.0 + 20.0 * t.sin(), -40.0 * t.cos()]).collect(),
            gamma: times().map(|t| [t, 0.5 + 0.1 * t.sin()]).collect(),
            threshold: vec![[0.0, 120.0, 0.36], [10.0, 130.0, 0.38]],
        };
        write_touch(&path("b.png"), &performance, 48_000.0).unwrap();
        for name in ["a.png", "b.png"] {
            let png = std::fs::read(path(name)).unwrap();
            assert!(&png[1..4] == b"PNG" && png.len() > 50_000, "{name}: {} bytes", png.len());
        }
        // To be looked at: `CHALUMEAU_PICTURES=folder cargo test -p xtask-instrument picture`.
        if let Some(to) = std::env::var_os("CHALUMEAU_PICTURES") {
            for name in ["a.png", "b.png"] {
                std::fs::copy(path(name), Path::new(&to).join(name)).unwrap();
            }
        }
    }
}
