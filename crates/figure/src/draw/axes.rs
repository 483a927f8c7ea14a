//! The axes of a panel: ticks, grid, names, second scales, colour bar.

use crate::draw::canvas::{Align, Canvas, Pen, PixelPoint};
use crate::draw::plot_area::{Extent, PlotArea};
use crate::draw::sizes::{BAR, LINE, SMALL, WORDS};
use crate::draw::ticks::{self, Ticks};
use crate::draw::{DrawError, font};
use crate::palette::{self, FINE_GRID, GRID, INK, PAPER, Rgb};
use crate::{Axis, Direction, Heat, Layer, Mark, Panel, Scale, SecondAxis, Tick};
use plotters_backend::DrawingBackend;

pub(super) fn heat_of(panel: &Panel) -> Option<&Heat> {
    panel.layers.iter().find_map(|layer| if let Layer::Heat(heat) = layer { Some(heat) } else { None })
}

pub(super) fn named_marks(panel: &Panel, of: Direction) -> impl Iterator<Item = &Mark> {
    panel.layers.iter().filter_map(move |layer| match layer {
        Layer::Mark(mark) if mark.of == of && !mark.name.is_empty() => Some(mark),
        _ => None,
    })
}

pub(super) fn widest(ticks: &[Tick]) -> f64 {
    ticks.iter().map(|tick| font::width(&tick.text, SMALL)).fold(0.0, f64::max)
}

pub(super) fn second_ticks(first: &Extent, axis: &SecondAxis, wanted: usize) -> Vec<Tick> {
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

/// As many ticks as have room for their names.
pub(super) fn fitting_x_ticks(panel: &Panel, frame: &PlotArea, wide: f64) -> Ticks {
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

pub(super) fn draw_grid<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    panel: &Panel,
    frame: &PlotArea,
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

pub(super) fn draw_axes<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    panel: &Panel,
    frame: &PlotArea,
    x_ticks: &Ticks,
    y_ticks: &Ticks,
    (left, bottom): PixelPoint,
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
pub(super) fn words<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    (start, base): PixelPoint,
    text: &str,
    size: f64,
    fill: Rgb,
) -> Result<(), DrawError> {
    let width = font::width(text, size);
    canvas.rect((start - 4.0, base - 0.72 * size), (start + width + 4.0, base + 0.22 * size), PAPER, 0.85)?;
    canvas.text((start, base), text, size, fill, Align::Left, false)
}

/// An axis label from bottom to top, a little smaller where it would not fit.
pub(super) fn upright<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    place: PixelPoint,
    text: &str,
    room: f64,
) -> Result<(), DrawError> {
    let width = font::width(text, WORDS);
    let size = if width > room + 40.0 { (WORDS * (room + 40.0) / width).max(16.0) } else { WORDS };
    canvas.text(place, text, size, INK, Align::Centre, true)
}
