//! Where everything stands on a picture.
//!
//! From top to bottom: title and notes; then rows of panels, each with its own title, its legend and the names of its
//! upright marks above the axes, so that no word covers data.

use crate::draw::canvas::{Align, At, Canvas, Pen};
use crate::draw::font;
use crate::draw::frame::{Extent, Frame};
use crate::draw::layer::{self, stroke, symbol};
use crate::draw::ticks::{self, Ticks};
use crate::draw::{DrawError, Size};
use crate::palette::{self, FINE_GRID, GRID, INK, PAPER, QUIET_INK, Rgb};
use crate::{Axis, Direction, Figure, Heat, Layer, Line, Mark, Panel, Points, Scale, Tick};
use plotters_backend::DrawingBackend;

const MARGIN: f64 = 26.0;
const TITLE: f64 = 33.0;
const PANEL_TITLE: f64 = 25.0;
const WORDS: f64 = 22.0;
pub(super) const SMALL: f64 = 20.0;
const LINE: f64 = 28.0;
const GAP: f64 = 26.0;
/// Length of a stroke beside its name in a legend.
const SAMPLE: f64 = 34.0;
const BAR: f64 = 20.0;

/// Draws the whole figure.
pub fn draw<B: DrawingBackend>(canvas: &mut Canvas<B>, figure: &Figure, size: Size) -> Result<(), DrawError> {
    let (width, height) = (f64::from(size.width), f64::from(size.height));
    let mut top = MARGIN;
    if !figure.title.is_empty() {
        for line in wrapped(&figure.title, TITLE, width - 2.0 * MARGIN) {
            top += 0.85 * TITLE;
            canvas.text((MARGIN, top), &line, TITLE, INK, Align::Left, false)?;
            top += 0.35 * TITLE;
        }
    }
    for note in &figure.notes {
        for line in wrapped(note, WORDS, width - 2.0 * MARGIN) {
            canvas.text((MARGIN, top + 0.75 * LINE), &line, WORDS, QUIET_INK, Align::Left, false)?;
            top += LINE;
        }
    }
    top += 0.5 * GAP;
    let columns = figure.columns.max(1);
    let rows: Vec<&[Panel]> = figure.panels.chunks(columns).collect();
    let weight = |row: &[Panel]| row.iter().map(|panel| panel.weight.max(0.05)).fold(0.05, f64::max);
    let weights: f64 = rows.iter().map(|row| weight(row)).sum();
    let room = (height - top - MARGIN - GAP * (rows.len().saturating_sub(1)) as f64).max(1.0);
    let column_width = (width - 2.0 * MARGIN - GAP * (columns - 1) as f64) / columns as f64;
    // Panels above each other share their edges.
    let sides: Vec<(f64, f64)> = (0..columns)
        .map(|column| {
            let below = figure.panels.iter().skip(column).step_by(columns);
            let sides = below.map(|panel| side_room(panel, column_width));
            sides.fold((0.0, 0.0), |(a, b): (f64, f64), (l, r)| (a.max(l), b.max(r)))
        })
        .collect();
    for row in rows {
        let row_height = room * weight(row) / weights;
        for (column, panel) in row.iter().enumerate() {
            let left = MARGIN + column as f64 * (column_width + GAP);
            draw_panel(canvas, panel, (left, top), (left + column_width, top + row_height), sides[column])?;
        }
        top += row_height + GAP;
    }
    Ok(())
}

/// Words on lines no wider than `room`.
fn wrapped(text: &str, size: f64, room: f64) -> Vec<String> {
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last_mut().map(std::mem::take).unwrap_or_default();
        let longer = if line.is_empty() { word.to_owned() } else { format!("{line} {word}") };
        let fits = line.is_empty() || font::width(&longer, size) <= room;
        if let Some(last) = lines.last_mut() {
            *last = if fits { longer } else { line };
        }
        if !fits {
            lines.push(word.to_owned());
        }
    }
    lines
}

/// From, to: as given or from the data, with a little room.
fn range(panel: &Panel, of: Direction) -> (f64, f64) {
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

fn heat_of(panel: &Panel) -> Option<&Heat> {
    panel.layers.iter().find_map(|layer| if let Layer::Heat(heat) = layer { Some(heat) } else { None })
}

fn named_marks(panel: &Panel, of: Direction) -> impl Iterator<Item = &Mark> {
    panel.layers.iter().filter_map(move |layer| match layer {
        Layer::Mark(mark) if mark.of == of && !mark.name.is_empty() => Some(mark),
        _ => None,
    })
}

fn widest(ticks: &[Tick]) -> f64 {
    ticks.iter().map(|tick| font::width(&tick.text, SMALL)).fold(0.0, f64::max)
}

fn second_ticks(first: &Extent, axis: &crate::SecondAxis, wanted: usize) -> Vec<Tick> {
    if !axis.ticks.is_empty() {
        return axis.ticks.iter().filter(|tick| first.holds(tick.at)).cloned().collect();
    }
    if axis.factor == 0.0 || !axis.factor.is_finite() {
        return Vec::new();
    }
    let scale = if first.log { Scale::Log } else { Scale::Linear };
    let (a, b) = (first.low * axis.factor, first.high * axis.factor);
    let plain = Axis { scale, ..Axis::default() };
    let ticks = ticks::of(&plain, a.min(b), a.max(b), wanted);
    ticks.named.into_iter().map(|tick| Tick { at: tick.at / axis.factor, text: tick.text }).collect()
}

/// Space left and right of the axes for a panel of this width.
fn side_room(panel: &Panel, width: f64) -> (f64, f64) {
    let (low, high) = range(panel, Direction::Y);
    let y = Extent { low, high, from: 300.0, to: 0.0, log: panel.y.scale == Scale::Log };
    let label = |text: &str| if text.is_empty() { 0.0 } else { LINE + 4.0 };
    let left = widest(&ticks::of(&panel.y, low, high, 8).named) + 12.0 + label(&panel.y.label);
    let mut right: f64 = 24.0;
    if let Some(axis) = &panel.right {
        right = right.max(widest(&second_ticks(&y, axis, 8)) + 12.0 + label(&axis.label) + 6.0);
    } else if let Some(heat) = heat_of(panel) {
        let ticks = ticks::linear(heat.range[0], heat.range[1], 6).named;
        right = right.max(16.0 + BAR + 10.0 + widest(&ticks) + label(&heat.name) + 6.0);
    } else {
        let names = named_marks(panel, Direction::Y).map(|mark| font::width(&mark.name, SMALL) + 10.0);
        right = right.max(names.fold(0.0, f64::max).min(0.3 * width));
    }
    (left, right)
}

/// What a legend shows beside a name.
enum Sample<'a> {
    Line(&'a Line),
    Points(&'a Points),
    Area(Rgb, f64, Option<Rgb>),
}

fn legend(panel: &Panel) -> Vec<(&str, Sample<'_>)> {
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

pub(super) const SPAN_OPACITY: f64 = 0.18;

fn draw_panel<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    panel: &Panel,
    (left, top): At,
    (right, bottom): At,
    (room_left, room_right): (f64, f64),
) -> Result<(), DrawError> {
    let (x_from, x_to) = (left + room_left, (right - room_right).max(left + room_left + 10.0));
    let mut y = top;
    if !panel.title.is_empty() {
        for line in wrapped(&panel.title, PANEL_TITLE, right - left) {
            canvas.text((left, y + 0.8 * PANEL_TITLE), &line, PANEL_TITLE, INK, Align::Left, false)?;
            y += 1.25 * PANEL_TITLE;
        }
    }
    y = draw_legend(canvas, &legend(panel), (x_from, y + 4.0), right)?;

    let (low, high) = range(panel, Direction::X);
    let mut x_extent = Extent { low, high, from: x_from, to: x_to, log: panel.x.scale == Scale::Log };
    // Names of upright marks: on as many rows as they need.
    let mut rows: Vec<f64> = Vec::new();
    let mut flags: Vec<(&Mark, usize, f64)> = Vec::new();
    let mut marks: Vec<&Mark> =
        named_marks(panel, Direction::X).filter(|mark| x_extent.holds(mark.at)).collect();
    marks.sort_by(|a, b| a.at.total_cmp(&b.at));
    for mark in marks {
        let width = font::width(&mark.name, SMALL);
        let start = (x_extent.at(mark.at) - 0.5 * width).min(right - width).max(left);
        let row = rows.iter().position(|&end| end + 14.0 <= start).unwrap_or(rows.len());
        if row == rows.len() {
            rows.push(0.0);
        }
        rows[row] = start + width;
        flags.push((mark, row, start));
    }
    let flags_top = y;
    y += rows.len() as f64 * LINE + if rows.is_empty() { 4.0 } else { 8.0 };
    if let Some(axis) = &panel.top {
        y += if axis.label.is_empty() { 0.0 } else { LINE } + SMALL + 8.0;
    }
    let label_room = if panel.x.label.is_empty() { 0.0 } else { LINE + 4.0 };
    let y_to = y;
    let y_from = (bottom - label_room - SMALL - 12.0).max(y_to + 10.0);
    let (low, high) = range(panel, Direction::Y);
    let mut y_extent = Extent { low, high, from: y_from, to: y_to, log: panel.y.scale == Scale::Log };
    if panel.equal_aspect {
        keep_aspect(&mut x_extent, &mut y_extent);
    }
    let frame = Frame { x: x_extent, y: y_extent };

    let wide = frame.right() - frame.left();
    let tall = frame.bottom() - frame.top();
    let x_ticks = fitting_x_ticks(panel, &frame, wide);
    let y_ticks = ticks::of(&panel.y, frame.y.low, frame.y.high, ((tall / 48.0) as usize).clamp(2, 12));
    draw_grid(canvas, panel, &frame, &x_ticks, &y_ticks)?;
    for layer in &panel.layers {
        layer::draw(canvas, layer, &frame)?;
    }
    let base = |row: usize| flags_top + (row as f64 + 0.78) * LINE;
    for &(mark, row, _) in &flags {
        let x = frame.x.at(mark.at);
        let pen = Pen { colour: mark.colour.rgb(), width: 1.5 };
        canvas.line(&[(x, base(row) + 6.0), (x, frame.top())], pen)?;
    }
    draw_axes(canvas, panel, &frame, &x_ticks, &y_ticks, (left, bottom))?;
    for &(mark, row, start) in &flags {
        words(canvas, (start, base(row)), &mark.name, SMALL, mark.colour.rgb())?;
    }
    for mark in named_marks(panel, Direction::Y).filter(|mark| frame.y.holds(mark.at)) {
        let y = frame.y.at(mark.at);
        let fill = mark.colour.rgb();
        let width = font::width(&mark.name, SMALL);
        let beside =
            panel.right.is_none() && heat_of(panel).is_none() && width + 8.0 <= right - frame.right();
        if beside {
            let base = y + 0.5 * font::CAPITAL * SMALL;
            canvas.text((frame.right() + 8.0, base), &mark.name, SMALL, fill, Align::Left, false)?;
        } else {
            let place = (frame.right() - 8.0, y - 7.0);
            words(canvas, (place.0 - width, place.1), &mark.name, SMALL, fill)?;
        }
    }
    Ok(())
}

/// As many ticks as have room for their names.
fn fitting_x_ticks(panel: &Panel, frame: &Frame, wide: f64) -> Ticks {
    let mut wanted = 16_usize;
    loop {
        let ticks = ticks::of(&panel.x, frame.x.low, frame.x.high, wanted);
        let places: Vec<(f64, f64)> =
            ticks.named.iter().map(|tick| (frame.x.at(tick.at), font::width(&tick.text, SMALL))).collect();
        let fit = places.windows(2).all(|pair| pair[1].0 - pair[0].0 > 0.5 * (pair[0].1 + pair[1].1) + 12.0);
        if fit || wanted <= 2 || wide < 60.0 {
            return ticks;
        }
        wanted -= 1;
    }
}

/// Shrinks one side until a unit is as long in x as in y.
fn keep_aspect(x: &mut Extent, y: &mut Extent) {
    let x_unit = (x.to - x.from).abs() / (x.high - x.low);
    let y_unit = (y.to - y.from).abs() / (y.high - y.low);
    if y_unit > x_unit {
        let spare = (y.from - y.to) - x_unit * (y.high - y.low);
        y.to += 0.5 * spare;
        y.from -= 0.5 * spare;
    } else {
        let spare = (x.to - x.from) - y_unit * (x.high - x.low);
        x.from += 0.5 * spare;
        x.to -= 0.5 * spare;
    }
}

/// Entries side by side, on as many lines as they need; where they end.
fn draw_legend<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    entries: &[(&str, Sample<'_>)],
    (left, top): At,
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

fn draw_grid<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    panel: &Panel,
    frame: &Frame,
    x_ticks: &Ticks,
    y_ticks: &Ticks,
) -> Result<(), DrawError> {
    if heat_of(panel).is_some() {
        return Ok(());
    }
    let fine = Pen { colour: FINE_GRID, width: 1.0 };
    let bold = Pen { colour: GRID, width: 1.2 };
    let named = |ticks: &Ticks| ticks.named.iter().map(|tick| tick.at).collect::<Vec<_>>();
    for (places, pen) in [(x_ticks.fine.clone(), fine), (named(x_ticks), bold)] {
        for x in places.into_iter().filter(|&x| frame.x.holds(x)).map(|x| frame.x.at(x)) {
            canvas.line(&[(x, frame.top()), (x, frame.bottom())], pen)?;
        }
    }
    for (places, pen) in [(y_ticks.fine.clone(), fine), (named(y_ticks), bold)] {
        for y in places.into_iter().filter(|&y| frame.y.holds(y)).map(|y| frame.y.at(y)) {
            canvas.line(&[(frame.left(), y), (frame.right(), y)], pen)?;
        }
    }
    // Where a scale crosses zero the eye looks for a line.
    let zero = Pen { colour: palette::Colour::Pale.rgb(), width: 2.0 };
    if panel.x.scale == Scale::Linear && frame.x.low < 0.0 && frame.x.high > 0.0 {
        canvas.line(&[(frame.x.at(0.0), frame.top()), (frame.x.at(0.0), frame.bottom())], zero)?;
    }
    if panel.y.scale == Scale::Linear && frame.y.low < 0.0 && frame.y.high > 0.0 {
        canvas.line(&[(frame.left(), frame.y.at(0.0)), (frame.right(), frame.y.at(0.0))], zero)?;
    }
    Ok(())
}

fn draw_axes<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    panel: &Panel,
    frame: &Frame,
    x_ticks: &Ticks,
    y_ticks: &Ticks,
    (left, bottom): At,
) -> Result<(), DrawError> {
    let pen = Pen { colour: INK, width: 1.5 };
    let (x0, x1, y0, y1) = (frame.left(), frame.right(), frame.bottom(), frame.top());
    canvas.line(&[(x0, y1), (x0, y0), (x1, y0)], pen)?;
    for tick in x_ticks.named.iter().filter(|tick| frame.x.holds(tick.at)) {
        let x = frame.x.at(tick.at);
        canvas.line(&[(x, y0), (x, y0 + 6.0)], pen)?;
        canvas.text((x, y0 + 10.0 + 0.72 * SMALL), &tick.text, SMALL, INK, Align::Centre, false)?;
    }
    for tick in y_ticks.named.iter().filter(|tick| frame.y.holds(tick.at)) {
        let y = frame.y.at(tick.at);
        canvas.line(&[(x0 - 6.0, y), (x0, y)], pen)?;
        let base = y + 0.5 * font::CAPITAL * SMALL;
        canvas.text((x0 - 10.0, base), &tick.text, SMALL, INK, Align::Right, false)?;
    }
    let (middle_x, middle_y) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
    let below = if panel.equal_aspect { y0 + SMALL + 12.0 + LINE } else { bottom };
    canvas.text((middle_x, below - 6.0), &panel.x.label, WORDS, INK, Align::Centre, false)?;
    upright(canvas, (left + 0.75 * WORDS, middle_y), &panel.y.label, y0 - y1)?;
    if let Some(axis) = &panel.top {
        canvas.line(&[(x0, y1), (x1, y1)], pen)?;
        let mut end = f64::NEG_INFINITY;
        for tick in second_ticks(&frame.x, axis, ((x1 - x0) / 90.0) as usize) {
            let (x, half) = (frame.x.at(tick.at), 0.5 * font::width(&tick.text, SMALL));
            canvas.line(&[(x, y1), (x, y1 - 6.0)], pen)?;
            if x - half > end + 10.0 {
                words(canvas, (x - half, y1 - 11.0), &tick.text, SMALL, INK)?;
                end = x + half;
            }
        }
        let start = middle_x - 0.5 * font::width(&axis.label, WORDS);
        words(canvas, (start, y1 - SMALL - 16.0), &axis.label, WORDS, INK)?;
    }
    if let Some(axis) = &panel.right {
        canvas.line(&[(x1, y0), (x1, y1)], pen)?;
        let ticks = second_ticks(&frame.y, axis, (((y0 - y1) / 48.0) as usize).clamp(2, 12));
        for tick in &ticks {
            let y = frame.y.at(tick.at);
            canvas.line(&[(x1, y), (x1 + 6.0, y)], pen)?;
            let base = y + 0.5 * font::CAPITAL * SMALL;
            canvas.text((x1 + 11.0, base), &tick.text, SMALL, INK, Align::Left, false)?;
        }
        let x = x1 + 12.0 + widest(&ticks) + LINE;
        upright(canvas, (x, middle_y), &axis.label, y0 - y1)?;
    } else if let Some(heat) = heat_of(panel) {
        let bar = (x1 + 16.0, x1 + 16.0 + BAR);
        canvas.picture((bar.0, y1), (bar.1, y0), |_, down| palette::heat(1.0 - down))?;
        canvas.line(
            &[(bar.0, y1), (bar.1, y1), (bar.1, y0), (bar.0, y0), (bar.0, y1)],
            Pen { width: 1.0, ..pen },
        )?;
        let ticks =
            ticks::linear(heat.range[0], heat.range[1], (((y0 - y1) / 48.0) as usize).clamp(2, 8)).named;
        for tick in &ticks {
            let y = y0 + (tick.at - heat.range[0]) / (heat.range[1] - heat.range[0]) * (y1 - y0);
            canvas.line(&[(bar.1, y), (bar.1 + 5.0, y)], pen)?;
            let base = y + 0.5 * font::CAPITAL * SMALL;
            canvas.text((bar.1 + 10.0, base), &tick.text, SMALL, INK, Align::Left, false)?;
        }
        upright(canvas, (bar.1 + 12.0 + widest(&ticks) + LINE, middle_y), &heat.name, y0 - y1)?;
    }
    Ok(())
}

/// Words with paper behind them, where lines may pass.
fn words<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    (start, base): At,
    text: &str,
    size: f64,
    fill: Rgb,
) -> Result<(), DrawError> {
    let width = font::width(text, size);
    canvas.rect((start - 4.0, base - 0.72 * size), (start + width + 4.0, base + 0.22 * size), PAPER, 0.85)?;
    canvas.text((start, base), text, size, fill, Align::Left, false)
}

/// An axis label from bottom to top, a little smaller where it would not fit.
fn upright<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    place: At,
    text: &str,
    room: f64,
) -> Result<(), DrawError> {
    let width = font::width(text, WORDS);
    let size = if width > room + 40.0 { (WORDS * (room + 40.0) / width).max(16.0) } else { WORDS };
    canvas.text(place, text, size, INK, Align::Centre, true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_wrapped_at_the_room() {
        let lines = wrapped("one two three four five six seven", 20.0, 120.0);
        assert!(lines.len() > 1 && lines.iter().all(|line| font::width(line, 20.0) <= 120.0), "{lines:?}");
        assert_eq!(lines.join(" "), "one two three four five six seven");
    }

    #[test]
    fn to_scale_means_to_scale() {
        let mut x = Extent { low: 0.0, high: 700.0, from: 100.0, to: 1500.0, log: false };
        let mut y = Extent { low: -30.0, high: 30.0, from: 900.0, to: 100.0, log: false };
        keep_aspect(&mut x, &mut y);
        assert!(((x.to - x.from) / 700.0 - (y.from - y.to) / 60.0).abs() < 1e-9);
        assert!(y.to >= 100.0 && y.from <= 900.0);
    }
}
