//! Figures: what a picture says, as data, and one function that draws it.
//!
//! A [`Figure`] holds titles, panels, axes with units, curves and marks, and nothing of pixels. It can be serialised, so
//! tests compare what a picture says instead of how it looks. `draw` (with feature `draw`) puts it on paper as PNG, SVG or
//! an animated GIF; fonts come embedded. Modules beside it build figures from measurements; none of them measures.

pub mod bifurcation;
pub mod bore;
pub mod breath;
mod data;
#[cfg(feature = "draw")]
pub mod draw;
pub mod felt;
pub mod impedance;
pub mod palette;
pub mod performance;
pub mod reed;
#[cfg(feature = "draw")]
pub mod report;
pub mod threshold;
pub mod tune;

pub use data::{
    Anchor, Axis, ColourMap, Dash, Direction, Figure, Heat, Layer, Line, Mark, Panel, Points, Polygon, Scale,
    SecondAxis, Shape, Span, Text, Tick,
};
