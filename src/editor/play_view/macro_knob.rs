//! A main control as a round knob. It moves by dragging up and down (Shift: ten times finer), by the wheel of a mouse, and by arrow keys
//! when it has the focus. A double click or Ctrl-click sets the default. A click on its value, or Enter, opens a text field.

use egui::{
    Align2, Color32, CursorIcon, FontId, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2,
};

use crate::editor::controls::{Hands, Look, teach};
use crate::editor::host_marks;
use crate::editor::key_steps::KeySteps;
use crate::editor::linked_controllers;
use crate::editor::slider::{is_typing, moved_by_pointer, open_entry, pressed_enter, type_value};
use crate::editor::theme;
use crate::editor::theme::Colours;
use crate::editor::widgets::one_line;

/// From end to end, points of dragging.
const TRAVEL: f32 = 160.0;
const KEYS: KeySteps = KeySteps { share: 0.02, has_vertical: true };
/// The arc, from its low end to its high end, radians clockwise from the right.
const ARC: (f32, f32) = (0.75 * std::f32::consts::PI, 2.25 * std::f32::consts::PI);
const HOW: &str = "Drag up or down, turn the wheel of the mouse, or press the arrow keys once Tab has brought you here; Shift: finer. Double click or Ctrl-click: default. Click the value or Enter: type.";
/// Size of the field for a typed value, points.
const FIELD: Vec2 = vec2(84.0, 24.0);
/// Between an arc and the edge of its place: the tick at the default, and a gap, points.
const CLEAR: f32 = 7.0;

/// A main control.
pub struct Macro {
    /// The parameter it moves.
    pub id: &'static str,
    /// A word of the parameter's name.
    pub name: &'static str,
    /// What its two ends mean.
    pub ends: &'static str,
}

/// Height of a control with its words in a view of this height, points. `grown`: how much larger words are than in a window of
/// the usual size.
pub fn height(view: f32, grown: f32) -> f32 {
    (0.27 * view).clamp(82.0, 160.0 * grown)
}

/// In a control of this height, or a higher one, there is room for three lines of words, points.
const ROOM_FOR_ENDS: f32 = 110.0;

/// Whether what the ends mean fits below every control of this size.
pub fn ends_fit(ui: &Ui, all: &[&Macro], size: Vec2, grown: f32) -> bool {
    let fits = |of: &&Macro| {
        let words =
            ui.painter().layout_no_wrap(of.ends.to_owned(), theme::small_grown(grown), Color32::WHITE);
        words.size().x + 4.0 <= size.x
    };
    size.y >= ROOM_FOR_ENDS && all.iter().all(fits)
}

/// Draws a control into a place of this size, with words `grown` times as large as in a window of the usual size; `has_ends`: it
/// says what its ends mean, too.
pub fn draw(ui: &mut Ui, hands: &mut Hands, of: &Macro, size: Vec2, grown: f32, has_ends: bool) {
    let Some(look) = hands.controls.look(of.id) else { return };
    let c = Colours::here(ui);
    let (rect, mut response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    let drag = response.drag_delta();
    let share = (drag.x - drag.y) / TRAVEL;
    let is_typing = is_typing(hands, of.id);
    let mut value = look.value;
    if !is_typing {
        value = moved_by_pointer(ui, hands, of.id, &look, &response, share).unwrap_or(value);
    }
    if response.has_focus() && !is_typing {
        value = KEYS.moved(ui, hands, of.id, &look, &response).unwrap_or(value);
    }
    if !is_typing {
        value = KEYS.wheeled(ui, hands, of.id, &look, &response).unwrap_or(value);
    }
    if response.double_clicked() || (response.clicked() && ui.input(|input| input.modifiers.command)) {
        value = look.default;
        hands.put(of.id, value);
    }
    if value != look.value {
        response.mark_changed();
    }
    let marks = hands.controls.marks(of.id);
    linked_controllers::offer_menu(ui, hands, of.id, &response);
    let is_touched = response.hovered() || response.dragged() || response.has_focus();
    let text = hands.controls.text(of.id, value);

    let is_small = size.y < 100.0;
    // What the words leave.
    let words = match (is_small, has_ends) {
        (true, _) => 44.0,
        (false, true) => 62.0 * grown,
        (false, false) => 56.0 * grown,
    };
    // In a tall window the width is what there is least of; the rest of the height is above and below.
    let most = 0.5 * (size.y - words);
    let radius = most.min(0.5 * size.x - CLEAR);
    let top = rect.top() + most - radius;
    let centre = pos2(rect.center().x, top + radius + 6.0);
    paint(ui, c, centre, radius, &look, value, is_touched);
    let painter = ui.painter().clone();
    let at = pos2(centre.x, top + 2.0 * radius + 10.0);
    let font = FontId::proportional(if is_small { 13.0 } else { 14.0 * grown });
    let name = painter.text(at, Align2::CENTER_TOP, of.name, font, c.ink);
    let after = host_marks::paint(ui, &marks, name.right_center());
    let is_learning = linked_controllers::is_learning(hands, of.id);
    if !is_learning {
        linked_controllers::name(ui, hands, of.id, after);
    }
    // Beside the name there is no room to ask for a controller.
    let (words, ink) = match is_touched {
        _ if is_learning => (linked_controllers::ASKS, c.accent),
        true => (text.as_str(), c.ink),
        false => (text.as_str(), c.quiet),
    };
    let words = one_line(ui, words, theme::small_grown(grown), ink, size.x - 4.0);
    let at = pos2(centre.x - 0.5 * words.size().x, name.bottom() + 1.0);
    let of_value = Rect::from_min_size(at, words.size());
    let bottom = of_value.bottom();
    let value_response =
        ui.interact(of_value.expand2(vec2(4.0, 1.0)), response.id.with("value"), Sense::CLICK);
    if is_typing {
        type_value(
            ui,
            hands,
            of.id,
            Rect::from_center_size(of_value.center() + vec2(0.0, 3.0), FIELD),
            Align2::CENTER_CENTER,
        );
    } else {
        painter.galley(at, words, ink);
        let is_entered = response.clicked() && response.has_focus() && ui.input(pressed_enter);
        if value_response.clicked() || is_entered {
            open_entry(hands, of.id, &text);
        }
    }
    value_response.on_hover_cursor(CursorIcon::Text);
    if has_ends && !is_typing {
        let at = pos2(centre.x, bottom + 1.0);
        painter.text(at, Align2::CENTER_TOP, of.ends, theme::small_grown(grown), c.quiet);
    }
    response.widget_info(|| {
        let mut info = WidgetInfo::slider(ui.is_enabled(), f64::from(value), of.name);
        info.current_text_value = Some(text.clone());
        info
    });
    response.on_hover_and_drag_cursor(CursorIcon::ResizeVertical).on_hover_ui(|ui| {
        ui.label(egui::RichText::new(format!("{}: {text}", look.name)).strong());
        ui.label(of.ends);
        teach(ui, of.id, HOW);
        host_marks::explain(ui, &marks);
    });
}

fn arc(centre: Pos2, radius: f32, from: f32, to: f32) -> Vec<Pos2> {
    (0..=40).map(|n| centre + radius * Vec2::angled(from + (to - from) * n as f32 / 40.0)).collect()
}

fn paint(ui: &Ui, c: &Colours, centre: Pos2, radius: f32, look: &Look, value: f32, is_touched: bool) {
    let painter = ui.painter();
    let (from, to) = ARC;
    let angle = |value: f32| from + (to - from) * value.clamp(0.0, 1.0);
    let thick = 0.15 * radius;
    painter.add(Shape::line(arc(centre, radius, from, to), Stroke::new(thick, c.raised)));
    // From the default, so that an untouched control shows that nothing is set.
    let (low, high) = (angle(value.min(look.default)), angle(value.max(look.default)));
    if high - low > 1e-3 {
        painter.add(Shape::line(arc(centre, radius, low, high), Stroke::new(thick, c.accent)));
    }
    let tick = Vec2::angled(angle(look.default));
    painter.line_segment(
        [centre + (radius + 1.5) * tick, centre + (radius + 5.0) * tick],
        Stroke::new(1.5, c.quiet),
    );
    let cap = 0.74 * radius;
    painter.circle(centre + vec2(0.0, 2.0), cap, egui::Color32::from_black_alpha(60), Stroke::NONE);
    let edge = if is_touched { Stroke::new(1.5, c.quiet) } else { Stroke::new(1.0, c.line) };
    painter.circle(centre, cap, c.raised, edge);
    painter.circle_filled(centre - vec2(0.0, 0.18 * cap), 0.72 * cap, c.hovered.gamma_multiply(0.5));
    let hand = Vec2::angled(angle(value));
    painter.line_segment([centre + 0.35 * cap * hand, centre + 0.86 * cap * hand], Stroke::new(3.0, c.ink));
}
