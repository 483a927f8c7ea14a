//! The layout of a figure.
//!
//! From top to bottom: title and notes; then rows of panels, each with its own title, its legend and the names of its
//! upright marks above the axes, so that no word covers data.

use crate::draw::axes::{
    draw_axes, draw_grid, fitting_x_ticks, heat_of, named_marks, second_ticks, widest, words,
};
use crate::draw::canvas::{Align, Canvas, Pen, PixelPoint};
use crate::draw::legend::{draw_legend, legend};
use crate::draw::plot_area::{Extent, PlotArea};
use crate::draw::range::range;
use crate::draw::sizes::{BAR, GAP, LINE, MARGIN, PANEL_TITLE, SMALL, TITLE, WORDS};
use crate::draw::{DrawError, font, layer, ticks};
use crate::palette::{INK, QUIET_INK};
use crate::{Direction, Figure, Mark, Panel, Scale};
use plotters_backend::DrawingBackend;

/// Draws the whole figure, so wide and high.
pub fn draw<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    figure: &Figure,
    (width, height): (f64, f64),
) -> Result<(), DrawError> {
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

fn draw_panel<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    panel: &Panel,
    (left, top): PixelPoint,
    (right, bottom): PixelPoint,
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
    let (flags, flag_rows) = flags(panel, &x_extent, (left, right));
    let flags_top = y;
    y += flag_rows as f64 * LINE + if flag_rows == 0 { 4.0 } else { 8.0 };
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
    let frame = PlotArea { x: x_extent, y: y_extent };

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
    draw_level_mark_names(canvas, panel, &frame, right)
}

/// Where the name of an upright mark stands: the mark, its row above the axes, and the left end of the words.
type Flag<'a> = (&'a Mark, usize, f64);

/// Places the names of the upright marks, on as many rows as they need; gives back the number of rows too.
fn flags<'a>(panel: &'a Panel, x_extent: &Extent, (left, right): (f64, f64)) -> (Vec<Flag<'a>>, usize) {
    let mut rows: Vec<f64> = Vec::new();
    let mut flags: Vec<Flag> = Vec::new();
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
    (flags, rows.len())
}

/// Names of the level marks: right of the axes where there is room, else above their line.
fn draw_level_mark_names<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    panel: &Panel,
    frame: &PlotArea,
    right: f64,
) -> Result<(), DrawError> {
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
