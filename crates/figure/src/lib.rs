//! Figures as data, and one function that draws them.
//!
//! A [`Figure`] holds titles, panels, axes with units, curves and marks, and no pixels. A figure can be serialised, so
//! tests compare what a figure says and not how it looks. The feature `draw` adds the module `draw`, which makes PNG, SVG
//! or animated GIF bytes; the font is part of the crate. The other modules build figures from measurements. They do not
//! measure, and nothing here opens a file.
//!
//! ```
//! use chalumeau_core::reed::{ReedLaw, ReedTables};
//! use chalumeau_figure::{Axis, Direction, Figure, Line, Mark, Panel};
//!
//! // Flow of the reference reed over the pressure difference, both dimensionless.
//! let reed = ReedLaw::default();
//! let curve: Vec<(f64, f64)> = (0..=100)
//!     .map(|n| f64::from(n) / 100.0)
//!     .map(|p| (p, reed.flow(ReedTables::reference(), p)))
//!     .collect();
//! let panel = Panel::new("", Axis::linear("pressure difference p"), Axis::linear("flow u"))
//!     .with(Mark::new(Direction::X, reed.peak_at(), "peak"))
//!     .with(Line::new("reference reed", curve));
//! let figure = Figure::new("Flow through the reed").panel(panel).size(800, 600);
//!
//! # #[cfg(feature = "draw")]
//! # (|| {
//! // With the feature `draw`: the figure as the text of an SVG file.
//! let svg: String = chalumeau_figure::draw::svg(&figure, None)?;
//! assert!(svg.contains("<title>Flow through the reed</title>"));
//! # Ok::<(), chalumeau_figure::draw::DrawError>(())
//! # })()?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod bifurcation;
pub mod bore;
pub mod breath;
mod builders;
mod data;
#[cfg(feature = "draw")]
pub mod draw;
pub mod felt;
pub mod impedance;
pub mod palette;
pub mod performance;
mod pitch_line;
pub mod realism;
pub mod recording;
pub mod reed;
pub mod reed_orbit;
pub mod reed_sweep;
#[cfg(feature = "draw")]
pub mod report;
pub mod threshold;
pub mod tune;

pub use data::{
    Anchor, Axis, ColourMap, Dash, Direction, Figure, Heat, Layer, Line, Mark, Panel, Points, Polygon, Scale,
    SecondAxis, Shape, Span, Text, Tick,
};
