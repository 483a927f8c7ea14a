//! Charts: axes with units and fixed bounds, a grid, marks of the note.
//! A chart cannot be dragged or zoomed. Handles on top of it can be dragged.

use egui::{Align2, Color32, Rangef, Rect, Ui, vec2};
use egui_plot::{
    AxisHints, GridMark, Line, LineStyle, Plot, PlotPoint, PlotPoints, PlotTransform, PlotUi, Text, VLine,
};

use crate::editor::theme;
use crate::editor::theme::Colours;
use chalumeau_core::units::clamped_or;

/// Height of the line above a picture, points.
const NAME_HEIGHT: f32 = 14.0;
/// Height of the numbers and the name below a plot, points.
const X_AXIS: f32 = 30.0;

/// Height of a line of a legend, points.
pub const LEGEND_LINE: f32 = 15.0;

/// What a picture shows.
pub struct Chart<'a> {
    /// Unique among the pictures of a view.
    pub id: &'static str,
    /// Left and right end.
    pub x: (f64, f64),
    /// Lower and upper end.
    pub y: (f64, f64),
    /// Name and unit of the horizontal axis; empty hides its numbers too.
    pub x_name: &'a str,
    /// Name and unit of the vertical axis, written above its upper end.
    pub y_name: &'a str,
    /// Height with names and numbers, points.
    pub height: f32,
    /// What a screen reader says.
    pub label: &'a str,
}

/// A vertical line with a name.
pub struct ChartMark<'a> {
    /// Where.
    pub at: f64,
    /// What, in a word or two.
    pub name: &'a str,
    /// In which colour.
    pub colour: Color32,
}

impl Chart<'_> {
    /// Draws the frame and lets `draw` fill it; gives back where things are.
    pub fn show(self, ui: &mut Ui, draw: impl FnOnce(&mut PlotUi<'_>)) -> PlotTransform {
        let c = Colours::here(ui);
        let (line, _) = ui.allocate_exact_size(vec2(ui.available_width(), NAME_HEIGHT), egui::Sense::hover());
        ui.painter().text(line.left_top(), Align2::LEFT_TOP, self.y_name, theme::small(), c.quiet);
        let height = (self.height - NAME_HEIGHT - ui.spacing().item_spacing.y).max(40.0);
        let axis = |hints: AxisHints<'static>| {
            hints
                .tick_label_color(c.quiet)
                .tick_label_font(theme::small())
                .label_spacing(Rangef::new(4.0, 8.0))
        };
        let has_x = !self.x_name.is_empty();
        let digits = |mark: GridMark, _: &std::ops::RangeInclusive<f64>| tidy(mark.value, mark.step_size);
        // Past time is negative on the axis and shown without a sign.
        let is_ago = self.x_name.ends_with("ago");
        let x_axis = axis(AxisHints::new_x()).formatter(move |mark, _| {
            tidy(if is_ago { mark.value.abs() } else { mark.value }, mark.step_size)
        });
        let x_axis = if has_x {
            let name = egui::RichText::new(self.x_name).font(theme::small()).color(c.quiet);
            x_axis.label(name).min_thickness(X_AXIS)
        } else {
            x_axis.formatter(|_, _| String::new())
        };
        let y_axis = axis(AxisHints::new_y()).formatter(digits).min_thickness(30.0);
        let (x, y) = (self.x, self.y);
        let width = ui.available_width();
        let shown = Plot::new(self.id)
            .height(height)
            .width(width)
            .allow_zoom(false)
            .allow_drag(false)
            .allow_scroll(false)
            .allow_boxed_zoom(false)
            .allow_axis_zoom_drag(false)
            .allow_double_click_reset(false)
            .sense(egui::Sense::hover())
            .show_background(false)
            .show_axes([has_x, true])
            .show_grid(true)
            .x_grid_spacer(move |_| ticks(x, ((width / 64.0) as usize).clamp(2, 12)))
            .y_grid_spacer(move |_| ticks(y, ((height / 30.0) as usize).clamp(4, 10)))
            .grid_spacing(Rangef::new(4.0, 8.0))
            .grid_color(c.grid)
            .show_x(false)
            .show_y(false)
            .label_formatter(|_| None)
            .cursor_color(Color32::TRANSPARENT)
            .set_margin_fraction(vec2(0.0, 0.0))
            .custom_x_axes(vec![x_axis])
            .custom_y_axes(vec![y_axis])
            .default_x_bounds(x.0, x.1)
            .default_y_bounds(y.0, y.1)
            .show(ui, |plot| {
                plot.set_plot_bounds_x(x.0..=x.1);
                plot.set_plot_bounds_y(y.0..=y.1);
                draw(plot);
            });
        let label = self.label.to_owned();
        shown.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &label));
        shown.transform
    }
}

/// At most `count` round values inside `range`, a step of 1, 2 or 5 times a power of ten apart.
fn ticks((low, high): (f64, f64), count: usize) -> Vec<GridMark> {
    let rough = (high - low) / count.max(1) as f64;
    let power = 10_f64.powf(rough.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].map(|n| n * power).into_iter().find(|step| *step >= rough).unwrap_or(rough);
    let inside = (low / step).ceil() as i64..=(high / step).floor() as i64;
    inside.map(|n| GridMark { value: n as f64 * step, step_size: step }).collect()
}

/// A number as an axis shows it: no more digits than the step needs.
fn tidy(value: f64, step: f64) -> String {
    let digits = if step >= 1.0 { 0 } else { (-step.log10()).ceil().clamp(0.0, 4.0) as usize };
    let value = if value.abs() < 1e-9 * step { 0.0 } else { value };
    format!("{value:.digits$}")
}

/// A curve.
pub fn curve(points: Vec<[f64; 2]>, colour: Color32, width: f32) -> Line<'static> {
    Line::new("", PlotPoints::from(points)).color(colour).width(width).allow_hover(false).allow_band(false)
}

/// Vertical dashed lines for `marks`.
pub fn lines(plot: &mut PlotUi<'_>, marks: &[ChartMark<'_>]) {
    for (index, mark) in marks.iter().enumerate() {
        let line = VLine::new(mark.name, mark.at).color(mark.colour).width(1.0).id(("mark", index));
        plot.vline(line.style(LineStyle::dashed_loose()).allow_hover(false));
    }
}

/// Right of this share of the width, a mark's name is left of its line if there is room, because curves end on the right.
const LEFT_FROM: f32 = 0.67;

/// Draws the marks' names along the upper edge, each beside its line, and lower where the name before is in the way.
pub fn names(ui: &Ui, transform: &PlotTransform, marks: &[ChartMark<'_>]) {
    let frame = *transform.frame();
    let painter = ui.painter_at(frame);
    let ground = behind_words(ui);
    let mut order: Vec<&ChartMark> = marks.iter().collect();
    order.sort_by(|a, b| a.at.total_cmp(&b.at));
    let mut taken: Vec<Rect> = Vec::new();
    for mark in order {
        let x = transform.position_from_point(&PlotPoint::new(mark.at, 0.0)).x;
        let galley = painter.layout_no_wrap(mark.name.to_owned(), theme::small(), mark.colour);
        let size = galley.size();
        let at = |left: f32| Rect::from_min_size(egui::pos2(left, frame.top() + 4.0), size);
        let is_taken = |rect: Rect| taken.iter().any(|other| other.intersects(rect.expand2(vec2(3.0, 0.0))));
        let (before, behind) = (at(x - 4.0 - size.x), at(x + 4.0));
        let is_far = x > frame.left() + LEFT_FROM * frame.width() && !is_taken(before);
        let mut rect = if is_far || behind.right() > frame.right() { before } else { behind };
        while is_taken(rect) {
            rect = rect.translate(vec2(0.0, size.y + 1.0));
        }
        // Curves pass behind the word.
        painter.rect_filled(rect.expand2(vec2(2.0, 0.0)), egui::CornerRadius::same(2), ground);
        painter.galley(rect.min, galley, mark.colour);
        taken.push(rect);
    }
}

/// The ground behind words in a chart: nearly the panel's colour.
fn behind_words(ui: &Ui) -> Color32 {
    Colours::here(ui).panel.gamma_multiply(0.85)
}

/// A word inside a picture.
pub fn word(plot: &mut PlotUi<'_>, at: [f64; 2], anchor: Align2, text: &str, colour: Color32) {
    let text = egui::RichText::new(text).font(theme::small()).color(colour);
    plot.text(Text::new("", PlotPoint::new(at[0], at[1]), text).anchor(anchor).allow_hover(false));
}

/// Names of the curves in their colours, right-aligned, at a share of the chart's height: 0 (top) ..=1. They have a ground
/// of their own, so that no curve crosses the words.
pub fn legend(ui: &Ui, transform: &PlotTransform, height: f32, lines: &[(&str, Color32)]) {
    let frame = *transform.frame();
    let painter = ui.painter_at(frame);
    let ground = behind_words(ui);
    for (line, (text, colour)) in lines.iter().enumerate() {
        let galley = painter.layout_no_wrap((*text).to_owned(), theme::small(), *colour);
        let top = frame.top() + height * frame.height() + LEGEND_LINE * line as f32;
        let at = egui::pos2(frame.right() - 8.0 - galley.size().x, top);
        let behind = Rect::from_min_size(at, galley.size()).expand2(vec2(3.0, 1.0));
        painter.rect_filled(behind, egui::CornerRadius::same(2), ground);
        painter.galley(at, galley, *colour);
    }
}

/// Names of curves in their colours, one beside the other from a place on, as many in a line as there is room for.
pub fn legend_below(ui: &Ui, transform: &PlotTransform, from: egui::Pos2, lines: &[(&str, Color32)]) {
    let frame = *transform.frame();
    let painter = ui.painter_at(frame);
    let ground = behind_words(ui);
    let mut at = from;
    for (text, colour) in lines {
        let galley = painter.layout_no_wrap((*text).to_owned(), theme::small(), *colour);
        let size = galley.size();
        if at.x > from.x && at.x + size.x > frame.right() - 4.0 {
            at = egui::pos2(from.x, at.y + LEGEND_LINE);
        }
        let behind = Rect::from_min_size(at, size).expand2(vec2(3.0, 0.0));
        painter.rect_filled(behind, egui::CornerRadius::same(2), ground);
        painter.galley(at, galley, *colour);
        at.x += size.x + 14.0;
    }
}

/// A number from outside as a share 0..=1; 0 if it is not finite.
pub fn share(value: f32) -> f32 {
    clamped_or(value, 0.0, 1.0, 0.0)
}

/// A text where there is nothing to draw yet.
pub fn empty(ui: &Ui, frame: Rect, text: &str) {
    let c = Colours::here(ui);
    let galley = ui.painter().layout(text.to_owned(), theme::body(), c.quiet, frame.width() - 24.0);
    ui.painter().galley(frame.center() - 0.5 * galley.size(), galley, c.quiet);
}

/// A word anywhere.
pub fn word_at(painter: &egui::Painter, at: egui::Pos2, anchor: Align2, text: &str, colour: Color32) {
    painter.text(at, anchor, text, theme::small(), colour);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_few_and_inside() {
        for (range, count, wanted) in [
            ((0.0, 10.0), 10, vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]),
            ((-110.0, 0.0), 5, vec![-100.0, -50.0, 0.0]),
            ((-0.84, 8.4), 4, vec![0.0, 5.0]),
        ] {
            let found: Vec<f64> = ticks(range, count).iter().map(|mark| mark.value).collect();
            assert_eq!(found, wanted);
        }
        assert_eq!((tidy(0.30000000004, 0.1), tidy(-0.0, 5.0)), ("0.3".into(), "0".into()));
    }
}
