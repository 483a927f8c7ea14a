//! The range of an axis: as the figure gives it, or from the data.

use crate::{Direction, Layer, Panel, Scale};

/// From, to: as given or from the data, with a little room.
pub(super) fn range(panel: &Panel, of: Direction) -> (f64, f64) {
    let axis = match of {
        Direction::X => &panel.x,
        Direction::Y => &panel.y,
    };
    let which = usize::from(of == Direction::Y);
    let positive = axis.scale == Scale::Log;
    let sound = |value: &f64| value.is_finite() && (!positive || *value > 0.0);
    if let Some([low, high]) = axis.range
        && sound(&low)
        && sound(&high)
        && low < high
    {
        return (low, high);
    }
    let mut values: Vec<f64> = Vec::new();
    for layer in &panel.layers {
        match layer {
            Layer::Line(line) => values.extend(line.pieces.iter().flatten().map(|point| point[which])),
            Layer::Points(points) => values.extend(points.points.iter().map(|point| point[which])),
            Layer::Polygon(polygon) => values.extend(polygon.corners.iter().map(|point| point[which])),
            Layer::Heat(heat) => values.extend(if which == 0 { heat.x } else { heat.y }),
            Layer::Mark(mark) if mark.of == of => values.push(mark.at),
            Layer::Text(text) => values.push(text.at[which]),
            Layer::Mark(_) | Layer::Span(_) => {}
        }
    }
    let (low, high) = values
        .into_iter()
        .filter(sound)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return if positive { (1.0, 10.0) } else { (0.0, 1.0) };
    }
    let heat = panel.layers.iter().any(|layer| matches!(layer, Layer::Heat(_)));
    match axis.scale {
        Scale::Log => {
            let room = if low == high { 2.0 } else { (high / low).powf(0.03) };
            (low / room, high * room)
        }
        Scale::Notes => (low - 0.7, high + 0.7),
        Scale::Linear => {
            let room = if low == high { low.abs().max(1.0) * 0.5 } else { (high - low) * 0.04 };
            // A curve along x begins at the axis.
            let room = if heat || (of == Direction::X && low < high) { 0.0 } else { room };
            (low - room, high + room)
        }
    }
}
