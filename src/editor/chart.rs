//! The frame of every picture with axes: fixed bounds, quiet grid, units on the axes, marks of the note.
//!
//! Nothing can be dragged or zoomed by accident; what can be dragged is a handle on top.

use egui::{Align2, Color32, Rect, Ui, vec2};
use egui_plot::{AxisHints, GridMark, Line, LineStyle, Plot, PlotPoint, PlotPoints, PlotTransform, PlotUi, Text, VLine};

use crate::editor::theme;
use crate::editor::theme::Colours;

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
    /// Name and unit of the vertical axis, written into the picture's upper left.
    pub y_name: &'a str,
    /// Height, points.
    pub height: f32,
    /// What a screen reader says.
    pub label: &'a str,
}

/// A vertical line that means something.
pub struct Mark<'a> {
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
        let axis = |hints: AxisHints<'static>| hints.tick_label_color(c.quiet).tick_label_font(theme::small());
        let has_x = !self.x_name.is_empty();
        let digits = |mark: GridMark, _: &std::ops::RangeInclusive<f64>| tidy(mark.value, mark.step_size);
        let x_axis = axis(AxisHints::new_x()).formatter(digits);
        let x_axis = if has_x {
            x_axis.label(egui::RichText::new(self.x_name).font(theme::small()).color(c.quiet))
        } else {
            x_axis.formatter(|_, _| String::new())
        };
        let y_axis = axis(AxisHints::new_y()).formatter(digits).min_thickness(30.0);
        let (x, y) = (self.x, self.y);
        let shown = Plot::new(self.id)
            .height(self.height.max(40.0))
            .width(ui.available_width())
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
        let frame = *shown.transform.frame();
        let painter = ui.painter_at(frame);
        painter.text(frame.left_top() + vec2(6.0, 4.0), Align2::LEFT_TOP, self.y_name, theme::small(), c.quiet);
        shown.transform
    }
}

/// A number as an axis shows it: no more digits than the step needs.
fn tidy(value: f64, step: f64) -> String {
    let digits = if step >= 1.0 { 0 } else { (-step.log10()).ceil().clamp(0.0, 4.0) as usize };
    let value = if value.abs() < 1e-9 * step { 0.0 } else { value };
    format!("{value:.digits$}")
}

/// A curve.
pub fn curve(points: Vec<[f64; 2]>, colour: Color32, width: f32) -> Line<'static> {
    Line::new("", PlotPoints::from(points)).color(colour).width(width).allow_hover(false)
}

/// Vertical dashed lines for `marks`.
pub fn lines(plot: &mut PlotUi<'_>, marks: &[Mark<'_>]) {
    for (index, mark) in marks.iter().enumerate() {
        let line = VLine::new(mark.name, mark.at).color(mark.colour).width(1.0).id(("mark", index));
        plot.vline(line.style(LineStyle::dashed_loose()).allow_hover(false));
    }
}

/// The marks' names along the upper edge, each beside its line, lower where the one before is in the way.
pub fn names(ui: &Ui, transform: &PlotTransform, marks: &[Mark<'_>]) {
    let frame = *transform.frame();
    let painter = ui.painter_at(frame);
    let mut order: Vec<&Mark> = marks.iter().collect();
    order.sort_by(|a, b| a.at.total_cmp(&b.at));
    let mut taken: Vec<Rect> = Vec::new();
    for mark in order {
        let x = transform.position_from_point(&PlotPoint::new(mark.at, 0.0)).x;
        let galley = painter.layout_no_wrap(mark.name.to_owned(), theme::small(), mark.colour);
        let size = galley.size();
        let left = if x + 4.0 + size.x > frame.right() { x - 4.0 - size.x } else { x + 4.0 };
        let mut rect = Rect::from_min_size(egui::pos2(left, frame.top() + 4.0), size);
        while taken.iter().any(|other| other.intersects(rect.expand2(vec2(3.0, 0.0)))) {
            rect = rect.translate(vec2(0.0, size.y + 1.0));
        }
        painter.galley(rect.min, galley, mark.colour);
        taken.push(rect);
    }
}

/// A word inside a picture.
pub fn word(plot: &mut PlotUi<'_>, at: [f64; 2], anchor: Align2, text: &str, colour: Color32) {
    let text = egui::RichText::new(text).font(theme::small()).color(colour);
    plot.text(Text::new("", PlotPoint::new(at[0], at[1]), text).anchor(anchor).allow_hover(false));
}

/// What stands where there is nothing to show yet.
pub fn empty(ui: &Ui, frame: Rect, text: &str) {
    let c = Colours::here(ui);
    let galley = ui.painter().layout(text.to_owned(), theme::body(), c.quiet, frame.width() - 24.0);
    ui.painter().galley(frame.center() - 0.5 * galley.size(), galley, c.quiet);
}

/// A word anywhere.
pub fn word_at(painter: &egui::Painter, at: egui::Pos2, anchor: Align2, text: &str, colour: Color32) {
    painter.text(at, anchor, text, theme::small(), colour);
}
