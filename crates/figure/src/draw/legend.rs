//! The legend of a panel.

use crate::draw::canvas::{Align, Canvas, Pen, PixelPoint};
use crate::draw::layer::{stroke, symbol};
use crate::draw::sizes::{LINE, SAMPLE, SMALL, SPAN_OPACITY};
use crate::draw::{DrawError, font};
use crate::palette::{self, INK, PAPER, Rgb};
use crate::{Layer, Line, Panel, Points};
use plotters_backend::DrawingBackend;

/// What a legend shows beside a name.
pub(super) enum Sample<'a> {
    Line(&'a Line),
    Points(&'a Points),
    Area(Rgb, f64, Option<Rgb>),
}

pub(super) fn legend(panel: &Panel) -> Vec<(&str, Sample<'_>)> {
    let mut entries = Vec::new();
    for layer in &panel.layers {
        let entry = match layer {
            Layer::Line(line) if !line.name.is_empty() => Some((line.name.as_str(), Sample::Line(line))),
            Layer::Points(points) if !points.name.is_empty() => {
                Some((points.name.as_str(), Sample::Points(points)))
            }
            Layer::Polygon(polygon) if !polygon.name.is_empty() => {
                let (fill, opacity) = polygon.fill.map_or((PAPER, 1.0), |fill| (fill.rgb(), polygon.opacity));
                Some((
                    polygon.name.as_str(),
                    Sample::Area(fill, opacity, polygon.stroke.map(palette::Colour::rgb)),
                ))
            }
            Layer::Span(span) if !span.name.is_empty() => {
                Some((span.name.as_str(), Sample::Area(span.colour.rgb(), SPAN_OPACITY, None)))
            }
            _ => None,
        };
        entries.extend(entry);
    }
    entries
}

/// Entries side by side, on as many lines as they need; where they end.
pub(super) fn draw_legend<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    entries: &[(&str, Sample<'_>)],
    (left, top): PixelPoint,
    right: f64,
) -> Result<f64, DrawError> {
    if entries.is_empty() {
        return Ok(top);
    }
    let (mut x, mut y) = (left, top);
    for (name, sample) in entries {
        let width = SAMPLE + 8.0 + font::width(name, SMALL);
        if x > left && x + width > right {
            (x, y) = (left, y + LINE);
        }
        let middle = y + 0.5 * LINE;
        match sample {
            Sample::Line(line) => {
                let points = [(x, middle), (x + SAMPLE, middle)];
                stroke(canvas, &points, line.dash, Pen { colour: line.colour.rgb(), width: line.width })?;
            }
            Sample::Points(points) => {
                symbol(
                    canvas,
                    (x + 0.5 * SAMPLE, middle),
                    points.shape,
                    points.size.min(9.0),
                    points.colour.rgb(),
                )?;
            }
            Sample::Area(fill, opacity, outline) => {
                let (a, b) = ((x + 4.0, middle - 8.0), (x + SAMPLE - 4.0, middle + 8.0));
                canvas.rect(a, b, *fill, *opacity)?;
                if let Some(colour) = outline {
                    let corners = [a, (b.0, a.1), b, (a.0, b.1), a];
                    canvas.line(&corners, Pen { colour: *colour, width: 1.5 })?;
                }
            }
        }
        let base = middle + 0.5 * font::CAPITAL * SMALL;
        canvas.text((x + SAMPLE + 8.0, base), name, SMALL, INK, Align::Left, false)?;
        x += width + 26.0;
    }
    Ok(y + LINE + 4.0)
}
