//! What grows: players, tone holes, length, sample rate, bend. A plot and a table for each.

use anyhow::Result;
use chalumeau_figure::palette::Colour;
use chalumeau_figure::report::{Plate, ReportTable, TableCell};
use chalumeau_figure::{Axis, Dash, Figure, Line, Panel, Points};

use super::playing::{COUNTED_S, Cost, counted, ours};

const COST_AXIS: &str = "cost, one voice = 1";

/// One thing that grows.
pub(super) struct Series {
    title: &'static str,
    axis: &'static str,
    /// What to see, under the figure.
    about: &'static str,
    /// Word of the playing program.
    pub(super) word: &'static str,
    /// What is measured: by default, and besides with `--full`.
    values: (&'static [f64], &'static [f64]),
    /// A step of the axis in units of the playing program.
    unit: f64,
    kind: Kind,
}

#[derive(PartialEq)]
enum Kind {
    Growth,
    /// With a line for as many players who play alone.
    Players,
    /// Costs are for a second, not for a sample, and no line joins the points: nothing is measured between them.
    Rates,
}

pub(super) const SERIES: [Series; 5] = [
    Series {
        title: "Players in unison",
        axis: "number of players",
        about: "Dashed: as many players, each computed alone. Where the processor has AVX2, five to eight players are computed at once, so that the sixth to eighth cost little.",
        word: "voices",
        values: (&[1.0, 2.0, 4.0, 5.0, 8.0, 9.0, 12.0, 13.0, 16.0], &[3.0, 6.0, 7.0, 10.0, 14.0]),
        unit: 1.0,
        kind: Kind::Players,
    },
    Series {
        title: "Tone holes",
        axis: "number of tone holes",
        about: "Holes are computed in groups of eight, and in two groups at least, since neighbours are never in the same: the cost steps up at 17 and at 25. The instrument is rebuilt with fewer or more holes, and not tuned.",
        word: "holes",
        values: (&[2.0, 8.0, 9.0, 16.0, 17.0, 24.0, 25.0, 26.0], &[4.0, 6.0, 10.0, 12.0, 14.0, 20.0]),
        unit: 1.0,
        kind: Kind::Growth,
    },
    Series {
        title: "Length of the bore",
        axis: "length of the bore over that of a B flat clarinet",
        about: "A longer bore has longer delays, which cost the same at any length. The whole instrument is scaled, and not tuned.",
        word: "length",
        values: (&[0.6, 1.0, 1.5, 3.0], &[0.8, 1.2, 2.0]),
        unit: 1.0,
        kind: Kind::Growth,
    },
    Series {
        title: "The host's sample rate",
        axis: "sample rate of the host, kHz",
        about: "The cost of a second of sound. The instrument always computes at 88.2 or 96 kHz; only the filter to the host's rate grows.",
        word: "rate",
        values: (&[44.1, 48.0, 88.2, 96.0, 176.4, 192.0], &[]),
        unit: 1_000.0,
        kind: Kind::Rates,
    },
    Series {
        title: "Pitch bend",
        axis: "bend, cents",
        about: "The lip makes small bends (up to 40 cents, on some notes less), at no cost. Beyond these the bore changes its size: its clock runs faster or slower, so there is more or less to compute in a second, and the filter to the host's rate finds its weights anew for each sample.",
        word: "bend",
        values: (
            &[-1_200.0, -700.0, -200.0, -50.0, -30.0, 0.0, 30.0, 50.0, 200.0, 700.0, 1_200.0],
            &[-400.0, -20.0, 20.0, 400.0],
        ),
        unit: 1.0,
        kind: Kind::Growth,
    },
];

/// Line and points of one colour.
fn curve(name: &str, points: &[(f64, f64)], colour: Colour) -> (Line, Points) {
    let points = points.iter().copied();
    (Line::new(name, points.clone()).colour(colour), Points::new("", points).colour(colour))
}

/// Costs over the first of all: one voice.
pub(super) fn series(of: &Series, one: Cost, full: bool) -> Result<(Plate, ReportTable)> {
    let mut values = of.values.0.to_vec();
    values.extend(of.values.1.iter().filter(|_| full));
    values.sort_by(f64::total_cmp);
    let words = |value: f64| [format!("{}={}", of.word, of.unit * value)];
    let instructions = counted(values.len(), |at| ours(&words(values[at])).instructions(COUNTED_S))?;
    let (mut by_instructions, mut by_time) = (Vec::new(), Vec::new());
    for (&value, instructions) in values.iter().zip(instructions) {
        let per = if of.kind == Kind::Rates { value / 48.0 } else { 1.0 };
        by_instructions.push((value, per * instructions / one.instructions));
        by_time.push((value, per * ours(&words(value)).ns("ns")? / one.ns));
    }
    let pairs = by_instructions.iter().zip(&by_time);
    for ((value, instructions), (_, time)) in pairs.clone() {
        println!("{}: {value}: {instructions:.3} by instructions, {time:.3} by thread time", of.axis);
    }
    let mut most = pairs.clone().map(|(a, b)| a.1.max(b.1)).fold(1.0, f64::max);
    let mut alone = None;
    if of.kind == Kind::Players {
        most = values.iter().copied().fold(most, f64::max);
        let line = Line::new("each alone", values.iter().map(|&count| (count, count)));
        alone = Some(line.colour(Colour::Grey).dash(Dash::Dashed));
    }
    let mut x = Axis::linear(of.axis);
    if of.kind == Kind::Rates {
        x = x.range(40.0, 200.0);
    }
    let mut panel = Panel::new("", x, Axis::linear(COST_AXIS).range(0.0, 1.1 * most));
    if let Some(line) = alone {
        panel = panel.with(line);
    }
    for (name, points, colour) in
        [("instructions", &by_instructions, Colour::Blue), ("thread time", &by_time, Colour::Orange)]
    {
        let (line, points) = curve(name, points, colour);
        panel = if of.kind == Kind::Rates {
            panel.with(Points { name: name.to_owned(), ..points })
        } else {
            panel.with(line).with(points)
        };
    }
    let figure = Figure::new(of.title).panel(panel).size(1_200, 600);
    let rows = pairs.map(|((value, instructions), (_, time))| {
        [value.to_string(), format!("{instructions:.2}"), format!("{time:.2}")].map(TableCell::Number).into()
    });
    let table = ReportTable {
        title: of.title.to_owned(),
        about: "1 is the cost of one voice of a B flat clarinet at 48 kHz.".to_owned(),
        head: [of.axis, "by instructions", "by thread time"].map(str::to_owned).into(),
        rows: rows.collect(),
    };
    let alternative = format!("{}: cost over {}. A table below has the numbers.", of.title, of.axis);
    Ok((Plate { figure, caption: of.about.to_owned(), alternative }, table))
}
