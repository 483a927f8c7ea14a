//! Amplitude of a note over mouth pressure, for rising and for falling pressure.

use crate::palette::Colour;
use crate::{Axis, Dash, Direction, Figure, Line, Mark, Panel, SecondAxis, Span};

/// Amplitude over mouth pressure: gamma, rms over closing pressure, part of the time the reed is shut.
pub type RampPoints = Vec<[f64; 3]>;

/// A ramp up and down, and where it changed.
pub struct Ramp {
    /// What is played.
    pub title: String,
    /// By which settings, and how slowly.
    pub note: String,
    /// Pressure that closes the reed, kPa.
    pub closing_kpa: f64,
    /// Breath growing.
    pub up: RampPoints,
    /// Breath fading.
    pub down: RampPoints,
    /// Where the linear theory lets the note begin.
    pub threshold: Option<f64>,
    /// Growing: the note begins.
    pub begins: Option<f64>,
    /// Growing: the reed shuts for a part of each period.
    pub shuts: Option<f64>,
    /// Growing: the note ends because the reed stays shut, or because another register takes over.
    pub chokes: Option<f64>,
    /// It is another register.
    pub gives_way: bool,
    /// Fading: it comes back.
    pub returns: Option<f64>,
    /// Fading: it ends.
    pub ends: Option<f64>,
}

/// Levels below this, over closing pressure, are left out on the logarithmic axis.
const FLOOR: f64 = 1e-5;

impl Ramp {
    /// Amplitude, the same on a logarithmic axis, and how long the reed is shut.
    pub fn figure(&self) -> Figure {
        let highest = self.up.iter().chain(&self.down).map(|point| point[0]).fold(0.1, f64::max);
        let axis = || Axis::linear("mouth pressure over closing pressure, gamma").range(0.0, highest);
        let along = |way: &RampPoints, which: usize| -> Vec<(f64, f64)> {
            way.iter().map(|point| (point[0], point[which])).collect()
        };
        let both = |panel: Panel, which: usize, floor: f64| {
            let over = |way: &RampPoints| {
                along(way, which)
                    .into_iter()
                    .map(move |(gamma, y)| (gamma, if y < floor { f64::NAN } else { y }))
            };
            panel.with(Line::new("breath growing", over(&self.up)).width(3.0)).with(
                Line::new("breath fading", over(&self.down))
                    .colour(Colour::Vermilion)
                    .dash(Dash::Dashed)
                    .width(3.0),
            )
        };
        let mut amplitude =
            Panel::new("Amplitude", axis(), Axis::linear("rms in the mouthpiece over closing pressure"))
                .weight(1.5)
                .top(SecondAxis::times(self.closing_kpa, "mouth pressure, kPa"));
        let mut band = |from: Option<f64>, to: Option<f64>, name: &str, colour| {
            if let (Some(from), Some(to)) = (from, to)
                && from < to
            {
                let name = format!("{name} ({from:.3} to {to:.3})");
                amplitude.layers.push(Span { of: Direction::X, from, to, name, colour }.into());
            }
        };
        band(self.returns, self.chokes, "growing breath still plays, fading breath not yet", Colour::Grey);
        band(self.ends, self.begins, "fading breath still plays, growing breath not yet", Colour::Sky);
        for (at, name, colour) in [
            (self.threshold, "linear threshold", Colour::Ink),
            (self.begins, "begins", Colour::Blue),
            (self.shuts, "shuts in each period", Colour::Blue),
            (self.chokes, if self.gives_way { "gives way" } else { "chokes" }, Colour::Blue),
            (self.returns, "returns", Colour::Vermilion),
            (self.ends, "ends", Colour::Vermilion),
        ] {
            if let Some(at) = at {
                let mark = Mark::new(Direction::X, at, format!("{name} {at:.3}")).colour(colour);
                amplitude = amplitude.with(mark.dash(Dash::Dotted));
            }
        }
        let small = Panel::new(
            "The same, logarithmic: how a note grows",
            axis(),
            Axis::log("rms over closing pressure"),
        );
        let shut = Panel::new(
            "How long the reed is shut",
            axis(),
            Axis::linear("part of the time shut").range(0.0, 1.05),
        )
        .weight(0.8);
        Figure::new(format!("Up and down the breath: {}", self.title))
            .note(self.note.clone())
            .panel(both(amplitude, 1, 0.0))
            .panel(both(small, 1, FLOOR))
            .panel(both(shut, 2, 0.0))
            .size(1_600, 1_500)
    }
}
