//! Functions that build figures: each takes a part, adds to it and returns it.

use crate::data::{
    Anchor, Axis, Dash, Direction, Figure, Heat, Layer, Line, Mark, Panel, Points, Polygon, Scale,
    SecondAxis, Shape, Span, Text, Tick,
};
use crate::palette::Colour;

impl Figure {
    /// An empty figure with panels below each other.
    pub fn new(title: impl Into<String>) -> Self {
        let (notes, panels) = (Vec::new(), Vec::new());
        Self { title: title.into(), notes, panels, columns: 1, size: [1_600, 1_000] }
    }

    /// Drawn at so many pixels unless asked otherwise, 400..=4000 each way.
    pub fn size(mut self, width: u32, height: u32) -> Self {
        self.size = [width, height];
        self
    }

    /// With one more line under the title.
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// With one more panel.
    pub fn panel(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// With so many panels beside each other.
    pub fn columns(mut self, columns: usize) -> Self {
        self.columns = columns.max(1);
        self
    }
}

impl Axis {
    /// A linear axis over what there is.
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), ..Self::default() }
    }

    /// A logarithmic axis over what there is.
    pub fn log(label: impl Into<String>) -> Self {
        Self { label: label.into(), scale: Scale::Log, ..Self::default() }
    }

    /// An axis of note numbers.
    pub fn notes(label: impl Into<String>) -> Self {
        Self { label: label.into(), scale: Scale::Notes, ..Self::default() }
    }

    /// From `from` to `to`; they must be finite and differ.
    pub fn range(mut self, from: f64, to: f64) -> Self {
        debug_assert!(from.is_finite() && to.is_finite() && from < to, "{from}..{to}");
        self.range = Some([from, to]);
        self
    }

    /// With ticks by hand.
    pub fn ticks(mut self, ticks: impl IntoIterator<Item = (f64, String)>) -> Self {
        self.ticks = ticks.into_iter().map(|(at, text)| Tick { at, text }).collect();
        self
    }
}

impl SecondAxis {
    /// The same values times `factor`.
    pub fn times(factor: f64, label: impl Into<String>) -> Self {
        Self { label: label.into(), factor, ticks: Vec::new() }
    }

    /// Places by name, in values of the first axis.
    pub fn named(label: impl Into<String>, ticks: impl IntoIterator<Item = (f64, String)>) -> Self {
        let ticks = ticks.into_iter().map(|(at, text)| Tick { at, text }).collect();
        Self { label: label.into(), factor: 1.0, ticks }
    }
}

impl Panel {
    /// An empty panel.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self {
            title: title.into(),
            x,
            y,
            top: None,
            right: None,
            layers: Vec::new(),
            equal_aspect: false,
            weight: 1.0,
        }
    }

    /// With one more layer, over those before.
    pub fn with(mut self, layer: impl Into<Layer>) -> Self {
        self.layers.push(layer.into());
        self
    }

    /// With a second scale at the top.
    pub fn top(mut self, axis: SecondAxis) -> Self {
        self.top = Some(axis);
        self
    }

    /// With a second scale at the right.
    pub fn right(mut self, axis: SecondAxis) -> Self {
        self.right = Some(axis);
        self
    }

    /// To scale.
    pub fn equal_aspect(mut self) -> Self {
        self.equal_aspect = true;
        self
    }

    /// With a row height of `weight` times the usual.
    pub fn weight(mut self, weight: f64) -> Self {
        self.weight = weight;
        self
    }
}

impl Line {
    /// A solid blue curve; it breaks where a value is not finite.
    pub fn new(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let mut pieces = vec![Vec::new()];
        for (x, y) in points {
            if x.is_finite() && y.is_finite() {
                if let Some(piece) = pieces.last_mut() {
                    piece.push([x, y]);
                }
            } else if pieces.last().is_some_and(|piece| !piece.is_empty()) {
                pieces.push(Vec::new());
            }
        }
        pieces.retain(|piece| !piece.is_empty());
        Self { name: name.into(), pieces, colour: Colour::Blue, dash: Dash::Solid, width: 2.5 }
    }

    /// In another colour.
    pub fn colour(mut self, colour: Colour) -> Self {
        self.colour = colour;
        self
    }

    /// In other strokes.
    pub fn dash(mut self, dash: Dash) -> Self {
        self.dash = dash;
        self
    }

    /// In another width, pixels.
    pub fn width(mut self, width: f64) -> Self {
        self.width = width;
        self
    }
}

impl Points {
    /// Blue discs; values that are not finite are left out.
    pub fn new(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let finite = points.into_iter().filter(|(x, y)| x.is_finite() && y.is_finite());
        Self {
            name: name.into(),
            points: finite.map(|(x, y)| [x, y]).collect(),
            colour: Colour::Blue,
            shape: Shape::Disc,
            size: 5.0,
        }
    }

    /// In another colour.
    pub fn colour(mut self, colour: Colour) -> Self {
        self.colour = colour;
        self
    }

    /// In another shape.
    pub fn shape(mut self, shape: Shape) -> Self {
        self.shape = shape;
        self
    }

    /// In another size, pixels.
    pub fn size(mut self, size: f64) -> Self {
        self.size = size;
        self
    }
}

impl Polygon {
    /// A filled shape without outline.
    pub fn filled(
        name: impl Into<String>,
        corners: impl IntoIterator<Item = (f64, f64)>,
        fill: Colour,
        opacity: f64,
    ) -> Self {
        let finite = corners.into_iter().filter(|(x, y)| x.is_finite() && y.is_finite());
        Self {
            name: name.into(),
            corners: finite.map(|(x, y)| [x, y]).collect(),
            fill: Some(fill),
            opacity,
            stroke: None,
        }
    }

    /// What lies between a curve and a level line.
    pub fn area(
        name: impl Into<String>,
        curve: impl IntoIterator<Item = (f64, f64)>,
        base: f64,
        fill: Colour,
        opacity: f64,
    ) -> Self {
        let mut area = Self::filled(name, curve, fill, opacity);
        if let (Some(&[first, _]), Some(&[last, _])) = (area.corners.first(), area.corners.last()) {
            area.corners.extend([[last, base], [first, base]]);
        }
        area
    }

    /// With an outline.
    pub fn stroke(mut self, colour: Colour) -> Self {
        self.stroke = Some(colour);
        self
    }
}

impl Mark {
    /// A dashed grey line; `name` may be empty.
    pub fn new(of: Direction, at: f64, name: impl Into<String>) -> Self {
        Self { of, at, name: name.into(), colour: Colour::Grey, dash: Dash::Dashed }
    }

    /// In another colour.
    pub fn colour(mut self, colour: Colour) -> Self {
        self.colour = colour;
        self
    }

    /// In other strokes.
    pub fn dash(mut self, dash: Dash) -> Self {
        self.dash = dash;
        self
    }
}

impl Text {
    /// Ink, to the right of its place.
    pub fn new(x: f64, y: f64, text: impl Into<String>) -> Self {
        Self { at: [x, y], text: text.into(), anchor: Anchor::Right, colour: Colour::Ink }
    }

    /// On another side.
    pub fn anchor(mut self, anchor: Anchor) -> Self {
        self.anchor = anchor;
        self
    }

    /// In another colour.
    pub fn colour(mut self, colour: Colour) -> Self {
        self.colour = colour;
        self
    }
}

macro_rules! layers {
    ($($kind:ident),*) => {
        $(impl From<$kind> for Layer {
            fn from(layer: $kind) -> Self {
                Self::$kind(layer)
            }
        })*
    };
}
layers!(Line, Points, Polygon, Heat, Mark, Span, Text);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_breaks_where_it_is_not_defined() {
        let nan = f64::NAN;
        let line = Line::new("", [(nan, 0.0), (0.0, 1.0), (1.0, 2.0), (2.0, nan), (3.0, nan), (4.0, 0.0)]);
        assert_eq!(line.pieces, [vec![[0.0, 1.0], [1.0, 2.0]], vec![[4.0, 0.0]]]);
        assert!(Line::new("", [(nan, nan)]).pieces.is_empty());
        assert_eq!(Points::new("", [(0.0, nan), (1.0, 1.0)]).points, [[1.0, 1.0]]);
    }

    #[test]
    fn an_area_closes_at_its_base() {
        let area = Polygon::area("", [(0.0, 1.0), (1.0, 2.0)], -1.0, Colour::Pale, 1.0);
        assert_eq!(area.corners, [[0.0, 1.0], [1.0, 2.0], [1.0, -1.0], [0.0, -1.0]]);
    }
}
