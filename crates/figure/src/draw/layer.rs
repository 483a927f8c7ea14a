//! Draws the layers of a panel between its axes: lines, points, shapes, heat maps, marks, bands, words.

use crate::draw::canvas::{Align, Canvas, Pen, PixelPoint};
use crate::draw::plot_area::{Extent, PlotArea, clip_line, clip_polygon};
use crate::draw::sizes::{SMALL, SPAN_OPACITY};
use crate::draw::{DrawError, font};
use crate::palette::{self, PAPER, Rgb};
use crate::{Anchor, Dash, Direction, Heat, Layer, Mark, Shape, Span, Text};
use plotters_backend::DrawingBackend;

pub fn draw<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    layer: &Layer,
    frame: &PlotArea,
) -> Result<(), DrawError> {
    match layer {
        Layer::Line(line) => {
            let pen = Pen { colour: line.colour.rgb(), width: line.width };
            for piece in &line.pieces {
                let points: Vec<PixelPoint> = piece.iter().map(|&point| frame.at(point)).collect();
                for visible in clip_line(&points, frame) {
                    stroke(canvas, &visible, line.dash, pen)?;
                }
            }
        }
        Layer::Points(points) => {
            for &[x, y] in &points.points {
                if frame.x.holds(x) && frame.y.holds(y) {
                    symbol(canvas, frame.at([x, y]), points.shape, points.size, points.colour.rgb())?;
                }
            }
        }
        Layer::Polygon(polygon) => {
            let corners: Vec<PixelPoint> = polygon.corners.iter().map(|&point| frame.at(point)).collect();
            let corners = clip_polygon(corners, frame);
            if let Some(fill) = polygon.fill {
                canvas.fill(&corners, fill.rgb(), polygon.opacity)?;
            }
            if let (Some(colour), Some(&first)) = (polygon.stroke, corners.first()) {
                let closed: Vec<PixelPoint> = corners.iter().copied().chain([first]).collect();
                canvas.line(&closed, Pen { colour: colour.rgb(), width: 1.5 })?;
            }
        }
        Layer::Heat(heat) => draw_heat(canvas, heat, frame)?,
        Layer::Mark(mark) => draw_mark(canvas, mark, frame)?,
        Layer::Span(span) => draw_span(canvas, span, frame)?,
        Layer::Text(text) => draw_text(canvas, text, frame)?,
    }
    Ok(())
}

/// A line across the panel.
fn draw_mark<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    mark: &Mark,
    frame: &PlotArea,
) -> Result<(), DrawError> {
    let pen = Pen { colour: mark.colour.rgb(), width: 1.8 };
    match mark.of {
        Direction::X if frame.x.holds(mark.at) => {
            let x = frame.x.at(mark.at);
            stroke(canvas, &[(x, frame.top()), (x, frame.bottom())], mark.dash, pen)?;
        }
        Direction::Y if frame.y.holds(mark.at) => {
            let y = frame.y.at(mark.at);
            stroke(canvas, &[(frame.left(), y), (frame.right(), y)], mark.dash, pen)?;
        }
        _ => {}
    }
    Ok(())
}

/// A band across the panel, cut at the axes.
fn draw_span<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    span: &Span,
    frame: &PlotArea,
) -> Result<(), DrawError> {
    let (a, b) = (span.from.min(span.to), span.from.max(span.to));
    let (from, to) = match span.of {
        Direction::X => {
            let (a, b) = (a.max(frame.x.low), b.min(frame.x.high));
            ((frame.x.at(a), frame.top()), (frame.x.at(b), frame.bottom()))
        }
        Direction::Y => {
            let (a, b) = (a.max(frame.y.low), b.min(frame.y.high));
            ((frame.left(), frame.y.at(b)), (frame.right(), frame.y.at(a)))
        }
    };
    if to.0 > from.0 && to.1 > from.1 {
        canvas.rect(from, to, span.colour.rgb(), SPAN_OPACITY)?;
    }
    Ok(())
}

/// Words beside their place, moved inside the axes.
fn draw_text<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    text: &Text,
    frame: &PlotArea,
) -> Result<(), DrawError> {
    let (x, y) = frame.at(text.at);
    let width = font::width(&text.text, SMALL);
    let half = 0.5 * font::CAPITAL * SMALL;
    let (start, base) = match text.anchor {
        Anchor::Right => (x + 9.0, y + half),
        Anchor::Left => (x - 9.0 - width, y + half),
        Anchor::Above => (x - 0.5 * width, y - 10.0),
        Anchor::Below => (x - 0.5 * width, y + 10.0 + 2.0 * half),
        Anchor::Centre => (x - 0.5 * width, y + half),
    };
    let start = start.min(frame.right() - width).max(frame.left() + 4.0);
    canvas.text((start, base), &text.text, SMALL, text.colour.rgb(), Align::Left, false)
}

fn draw_heat<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    heat: &Heat,
    frame: &PlotArea,
) -> Result<(), DrawError> {
    if heat.columns == 0 || heat.rows == 0 || heat.levels.len() != heat.columns * heat.rows {
        return Err(DrawError::Backend(format!(
            "{} x {} levels wanted, {} given",
            heat.columns,
            heat.rows,
            heat.levels.len()
        )));
    }
    let (left, right) = (frame.x.at(heat.x[0]).max(frame.left()), frame.x.at(heat.x[1]).min(frame.right()));
    let (top, bottom) = (frame.y.at(heat.y[1]).max(frame.top()), frame.y.at(heat.y[0]).min(frame.bottom()));
    if right <= left || bottom <= top {
        return Ok(());
    }
    let back = |extent: &Extent, pixel: f64| {
        let unit = (pixel - extent.from) / (extent.to - extent.from);
        if extent.log {
            extent.low * (extent.high / extent.low).powf(unit)
        } else {
            extent.low + unit * (extent.high - extent.low)
        }
    };
    let cell = |value: f64, edges: [f64; 2], count: usize| {
        let unit = (value - edges[0]) / (edges[1] - edges[0]);
        (unit * count as f64 - 0.5).clamp(0.0, (count - 1) as f64)
    };
    canvas.picture((left, top), (right, bottom), |unit_x, unit_y| {
        let column =
            cell(back(&frame.x, left + unit_x * (right - left)), heat.x, heat.columns).round() as usize;
        let row = cell(back(&frame.y, top + unit_y * (bottom - top)), heat.y, heat.rows);
        let level = |row: usize| f64::from(heat.levels[column * heat.rows + row.min(heat.rows - 1)]);
        let (below, part) = (row as usize, row.fract());
        let level = level(below) + part * (level(below + 1) - level(below));
        palette::heat((level - heat.range[0]) / (heat.range[1] - heat.range[0]))
    })
}

/// A line in its strokes.
pub fn stroke<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    points: &[PixelPoint],
    dash: Dash,
    pen: Pen,
) -> Result<(), DrawError> {
    let (on, off) = match dash {
        Dash::Solid => return canvas.line(points, pen),
        Dash::Dashed => (10.0, 7.0),
        Dash::Dotted => (2.5, 5.5),
    };
    let (mut drawn, mut left) = (true, on);
    let mut part: Vec<PixelPoint> = points.first().copied().into_iter().collect();
    for pair in points.windows(2) {
        let [a, b] = [pair[0], pair[1]];
        let length = (b.0 - a.0).hypot(b.1 - a.1);
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let at = (a.0 + done / length * (b.0 - a.0), a.1 + done / length * (b.1 - a.1));
            if drawn {
                part.push(at);
                canvas.line(&part, pen)?;
            }
            part = vec![at];
            drawn = !drawn;
            left = if drawn { on } else { off };
        }
        left -= length - done;
        if drawn {
            part.push(b);
        }
    }
    if drawn { canvas.line(&part, pen) } else { Ok(()) }
}

pub fn symbol<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    (x, y): PixelPoint,
    shape: Shape,
    size: f64,
    colour: Rgb,
) -> Result<(), DrawError> {
    let pen = Pen { colour, width: 2.0 };
    match shape {
        Shape::Disc => canvas.disc((x, y), size, colour),
        Shape::Ring => {
            canvas.disc((x, y), size, colour)?;
            canvas.disc((x, y), size - 2.0, PAPER)
        }
        Shape::Cross => {
            canvas.line(&[(x - size, y - size), (x + size, y + size)], pen)?;
            canvas.line(&[(x - size, y + size), (x + size, y - size)], pen)
        }
        Shape::TriangleUp => {
            let size = 1.2 * size;
            canvas.fill(&[(x, y - size), (x + size, y + 0.8 * size), (x - size, y + 0.8 * size)], colour, 1.0)
        }
        Shape::TriangleDown => {
            let size = 1.2 * size;
            canvas.fill(&[(x, y + size), (x + size, y - 0.8 * size), (x - size, y - 0.8 * size)], colour, 1.0)
        }
        Shape::Diamond => {
            let size = 1.3 * size;
            canvas.fill(&[(x, y - size), (x + size, y), (x, y + size), (x - size, y)], colour, 1.0)
        }
    }
}
