//! The data of a figure.
//! All numbers are finite: builders drop others (a curve breaks there), so JSON can hold every figure. A range that is not
//! given is taken from the data when the figure is drawn.

use crate::palette::Colour;
use serde::{Deserialize, Serialize};

/// One picture: a title over panels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// What it shows.
    pub title: String,
    /// Lines under the title: of what, by which settings.
    pub notes: Vec<String>,
    /// Panels in reading order.
    pub panels: Vec<Panel>,
    /// Panels beside each other, 1 or more.
    pub columns: usize,
    /// Width and height at which it reads well, pixels.
    pub size: [u32; 2],
}

/// One pair of axes with what is drawn between them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Panel {
    /// Title of the panel, may be empty.
    pub title: String,
    /// To the right.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// A second scale of the same values at the top.
    pub top: Option<SecondAxis>,
    /// A second scale of the same values at the right.
    pub right: Option<SecondAxis>,
    /// Drawn in this order.
    pub layers: Vec<Layer>,
    /// One unit is as long in x as in y.
    pub equal_aspect: bool,
    /// Height of the panel's row over that of a row of weight 1; the largest of a row counts.
    pub weight: f64,
}

/// How values are laid along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// By ratios; values must be positive.
    Log,
    /// Note numbers (MIDI), named.
    Notes,
}

/// An axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// Quantity and unit: "mouth pressure, kPa".
    pub label: String,
    /// From, to; from the data if open.
    pub range: Option<[f64; 2]>,
    /// How values are laid out.
    pub scale: Scale,
    /// Ticks by hand instead of round numbers.
    pub ticks: Vec<Tick>,
}

/// A named place on an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tick {
    /// Value of the axis.
    pub at: f64,
    /// Its name.
    pub text: String,
}

/// A second scale for the values of an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SecondAxis {
    /// Quantity and unit.
    pub label: String,
    /// Second value over first; ignored if there are ticks.
    pub factor: f64,
    /// Ticks by hand, in values of the *first* axis.
    pub ticks: Vec<Tick>,
}

/// Something drawn between axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Layer {
    /// A curve.
    Line(Line),
    /// Single values.
    Points(Points),
    /// A filled shape.
    Polygon(Polygon),
    /// Levels over a plane.
    Heat(Heat),
    /// A line across, with a name.
    Mark(Mark),
    /// A band across, with a name.
    Span(Span),
    /// Words at a place.
    Text(Text),
}

/// How a line is broken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Dash {
    /// Not at all.
    #[default]
    Solid,
    /// Long strokes.
    Dashed,
    /// Dots.
    Dotted,
}

/// A curve, in pieces where it is not defined everywhere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Name in the legend; unnamed curves have no entry.
    pub name: String,
    /// Points of each piece.
    pub pieces: Vec<Vec<[f64; 2]>>,
    /// Its colour.
    pub colour: Colour,
    /// Its strokes.
    pub dash: Dash,
    /// Pixels at nominal size.
    pub width: f64,
}

/// What marks a single value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// Filled circle.
    #[default]
    Disc,
    /// Open circle.
    Ring,
    /// Two strokes crossing.
    Cross,
    /// Filled, pointing up.
    TriangleUp,
    /// Filled, pointing down.
    TriangleDown,
    /// Filled, on its corner.
    Diamond,
}

/// Single values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Points {
    /// Name in the legend.
    pub name: String,
    /// Where they are.
    pub points: Vec<[f64; 2]>,
    /// Their colour.
    pub colour: Colour,
    /// Their shape.
    pub shape: Shape,
    /// Radius, pixels at nominal size.
    pub size: f64,
}

/// A filled shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Polygon {
    /// Name in the legend.
    pub name: String,
    /// Corners in order.
    pub corners: Vec<[f64; 2]>,
    /// Inside; empty if open.
    pub fill: Option<Colour>,
    /// Opacity of the inside, 0..=1.
    pub opacity: f64,
    /// Outline.
    pub stroke: Option<Colour>,
}

/// How levels become colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ColourMap {
    /// Low is paper, high is ink.
    #[default]
    PaperToInk,
}

/// Levels over a plane, as a spectrogram.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Heat {
    /// Quantity and unit of the levels, beside the colour bar.
    pub name: String,
    /// Left and right edge.
    pub x: [f64; 2],
    /// Lower and upper edge.
    pub y: [f64; 2],
    /// Cells from left to right.
    pub columns: usize,
    /// Cells from bottom to top.
    pub rows: usize,
    /// Levels, column by column, each from bottom to top: `columns * rows` of them.
    pub levels: Vec<f32>,
    /// Level of the lightest and the darkest colour.
    pub range: [f64; 2],
    /// Colours.
    pub map: ColourMap,
}

/// Which way a mark measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// At a value of x: upright.
    X,
    /// At a value of y: level.
    Y,
}

/// A line across the panel at one value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mark {
    /// Value of which axis.
    pub of: Direction,
    /// The value.
    pub at: f64,
    /// Its name; drawn outside the data.
    pub name: String,
    /// Its colour.
    pub colour: Colour,
    /// Its strokes.
    pub dash: Dash,
}

/// A band across the panel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Span {
    /// Values of which axis.
    pub of: Direction,
    /// One edge.
    pub from: f64,
    /// Other edge.
    pub to: f64,
    /// Name in the legend.
    pub name: String,
    /// Its colour, drawn light.
    pub colour: Colour,
}

/// On which side of its place a text stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Anchor {
    /// To the right of the place.
    #[default]
    Right,
    /// To the left.
    Left,
    /// Above, centred.
    Above,
    /// Below, centred.
    Below,
    /// On the place, centred.
    Centre,
}

/// Words at a place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Text {
    /// Where.
    pub at: [f64; 2],
    /// What.
    pub text: String,
    /// On which side.
    pub anchor: Anchor,
    /// In which colour.
    pub colour: Colour,
}
