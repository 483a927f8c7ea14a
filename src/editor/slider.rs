//! The slider. It moves by dragging (Shift: ten times finer) and by arrow keys when it has the focus. A double click or
//! Ctrl-click sets the default. A click on its value, or Enter, opens a text field.

use egui::{
    Align2, CornerRadius, CursorIcon, Key, Rect, Response, Role, Sense, Stroke, TextEdit, Ui, WidgetInfo,
    pos2, vec2,
};

use crate::editor::controls::{Entry, Hands, Look, Mark, teach};
use crate::editor::host_marks;
use crate::editor::key_steps::KeySteps;
use crate::editor::linked_controllers;
use crate::editor::terms;
use crate::editor::theme;
use crate::editor::theme::Colours;

const HOW_SLIDER: &str =
    "Drag; Shift: finer. Double click or Ctrl-click: default. Click the value or Enter: type.";
/// Height of a slider, name and track together.
const SLIDER_HEIGHT: f32 = 36.0;
/// The arrows up and down go to the slider above or below.
const KEYS: KeySteps = KeySteps { share: 0.01, has_vertical: false };

/// A slider with its name, as wide as its place. `None` if there is no such parameter.
pub fn slider(ui: &mut Ui, hands: &mut Hands, id: &'static str) -> Option<Response> {
    let look = hands.controls.look(id)?;
    let c = Colours::here(ui);
    let width = ui.available_width().max(60.0);
    let (rect, mut response) = ui.allocate_exact_size(vec2(width, SLIDER_HEIGHT), Sense::click_and_drag());
    let text = hands.controls.text(id, look.value);
    let galley = ui.painter().layout_no_wrap(text.clone(), theme::body(), c.ink);
    let value_size = galley.size() + vec2(10.0, 4.0);
    let value_rect = Rect::from_min_size(pos2(rect.right() - value_size.x + 5.0, rect.top()), value_size);
    let is_typing = is_typing(hands, id);
    // The Tab key stops once per slider; Enter opens its value.
    let value_response = ui.interact(value_rect, response.id.with("value"), Sense::CLICK);

    let track = Rect::from_min_max(
        pos2(rect.left() + 6.0, rect.bottom() - 11.0),
        pos2(rect.right() - 6.0, rect.bottom() - 7.0),
    );
    let mut value = look.value;
    if !is_typing {
        let share = response.drag_delta().x / track.width();
        value = moved_by_pointer(ui, hands, id, &look, &response, share).unwrap_or(value);
        if response.has_focus() {
            value = KEYS.moved(ui, hands, id, &look, &response).unwrap_or(value);
        }
        let is_reset = response.double_clicked() || (response.clicked() && ui.input(|i| i.modifiers.command));
        if is_reset {
            value = look.default;
            hands.put(id, value);
        } else if value_response.clicked()
            || (response.clicked() && response.has_focus() && ui.input(pressed_enter))
        {
            open_entry(hands, id, &text);
        }
    }
    if value != look.value {
        response.mark_changed();
    }

    let marks = hands.controls.marks(id);
    let after = paint_slider(ui, c, [rect, track], &look, &marks, value, &response);
    linked_controllers::name(ui, hands, id, after);
    for linked in linked_controllers::values(hands, id) {
        let x = track.left() + linked.clamp(0.0, 1.0) * track.width();
        ui.painter().vline(x, track.top() - 4.0..=track.bottom() + 4.0, Stroke::new(2.0, c.ink));
    }
    linked_controllers::offer_menu(ui, hands, id, &response);
    if is_typing {
        type_value(
            ui,
            hands,
            id,
            Rect::from_min_max(
                pos2(rect.right() - 96.0, rect.top() - 1.0),
                pos2(rect.right(), rect.top() + 21.0),
            ),
            Align2::RIGHT_CENTER,
        );
    } else {
        let ink = if value_response.hovered() { c.accent } else { c.ink };
        ui.painter().text(
            pos2(rect.right(), rect.top() + 9.0),
            Align2::RIGHT_CENTER,
            &text,
            theme::body(),
            ink,
        );
    }
    response.widget_info(|| {
        let mut info = WidgetInfo::slider(ui.is_enabled(), f64::from(value), &look.name);
        info.current_text_value = Some(text.clone());
        info
    });
    value_response.on_hover_cursor(CursorIcon::Text);
    let response = response.on_hover_and_drag_cursor(CursorIcon::ResizeHorizontal);
    Some(response.on_hover_ui(|ui| {
        teach(ui, id, HOW_SLIDER);
        host_marks::explain(ui, &marks);
    }))
}

/// Whether a value is being typed for this parameter.
pub fn is_typing(hands: &Hands, id: &str) -> bool {
    hands.entry.as_ref().is_some_and(|entry| entry.id == id)
}

/// Opens the field of a parameter, with its value.
pub fn open_entry(hands: &mut Hands, id: &'static str, text: &str) {
    *hands.entry = Some(Entry { id, text: text.to_owned(), is_wrong: false, is_shown: false });
}

/// Whether Enter was pressed in this frame.
pub fn pressed_enter(input: &egui::InputState) -> bool {
    input.key_pressed(Key::Enter)
}

/// Follows a drag. `share` is how much of the range the pointer has moved by in this frame. Returns the new value, if the drag
/// has set one.
pub fn moved_by_pointer(
    ui: &Ui,
    hands: &mut Hands,
    id: &'static str,
    look: &Look,
    response: &Response,
    share: f32,
) -> Option<f32> {
    // Where the hand would be on a control without steps: else a stepped one never leaves its step.
    let exact = response.id.with("exact");
    if response.drag_started() {
        hands.begin(id);
        ui.data_mut(|data| data.insert_temp(exact, look.value));
    }
    let mut value = None;
    if response.dragged() && share != 0.0 {
        let fine = if ui.input(|i| i.modifiers.shift) { 0.1 } else { 1.0 };
        let from = ui.data(|data| data.get_temp::<f32>(exact)).unwrap_or(look.value);
        let to = (from + fine * share).clamp(0.0, 1.0);
        ui.data_mut(|data| data.insert_temp(exact, to));
        let to = match look.steps {
            Some(steps) if steps > 0 => (to * steps as f32).round() / steps as f32,
            _ => to,
        };
        hands.set(id, to);
        value = Some(to);
    }
    if response.drag_stopped() {
        hands.end(id);
    }
    value
}

/// Paints it; returns where its name and marks end.
fn paint_slider(
    ui: &Ui,
    c: &Colours,
    [rect, track]: [Rect; 2],
    look: &Look,
    marks: &[Mark],
    value: f32,
    response: &Response,
) -> egui::Pos2 {
    let painter = ui.painter();
    let name = if response.hovered() || response.has_focus() { c.ink } else { c.quiet };
    let at = pos2(rect.left(), rect.top() + 9.0);
    let name = painter.text(at, Align2::LEFT_CENTER, &look.name, theme::body(), name);
    let after = host_marks::paint(ui, marks, name.right_center());
    let at = |unit: f32| track.left() + unit.clamp(0.0, 1.0) * track.width();
    let round = CornerRadius::same(2);
    painter.rect_filled(track, round, c.raised);
    painter.rect_filled(Rect::from_min_max(track.min, pos2(at(value), track.bottom())), round, c.accent);
    // Where the default is.
    painter.vline(at(look.default), track.top() - 3.0..=track.top() - 0.5, Stroke::new(1.0, c.quiet));
    let is_held = response.dragged() || response.has_focus();
    let radius = if is_held || response.hovered() { 7.0 } else { 6.0 };
    let centre = pos2(at(value), track.center().y);
    painter.circle(centre, radius, c.panel, Stroke::new(2.0, c.accent));
    if response.has_focus() {
        painter.circle_stroke(centre, radius + 3.0, Stroke::new(1.0, c.accent));
    }
    after
}

/// The text field over a value. Enter takes it, Escape leaves it, and so does a click elsewhere.
pub fn type_value(ui: &mut Ui, hands: &mut Hands, id: &'static str, rect: Rect, align: Align2) {
    let Some(mut entry) = hands.entry.take() else { return };
    let c = Colours::here(ui);
    let field = TextEdit::singleline(&mut entry.text)
        .id(egui::Id::unique(("value of", id)))
        .font(theme::body())
        .text_color(if entry.is_wrong { c.danger } else { c.ink })
        .align(align)
        .desired_width(rect.width());
    ui.painter().rect(
        rect.expand(1.0),
        CornerRadius::same(theme::SMALL_RADIUS),
        c.ground,
        Stroke::new(1.0, c.accent),
        egui::StrokeKind::Outside,
    );
    // In a place of its own: `put` here would move what follows.
    let response = ui.new_child(egui::UiBuilder::new().max_rect(rect)).put(rect, field);
    let name = hands.name(id);
    response.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, format!("{name}, value")));
    if entry.is_wrong {
        say_range(ui, id, rect, align);
    }
    if !entry.is_shown {
        entry.is_shown = true;
        response.request_focus();
        select_all(ui, response.id, entry.text.chars().count());
    }
    let is_left = response.lost_focus();
    let is_taken = is_left && ui.input(pressed_enter);
    if is_taken {
        match typed(hands, id, &entry.text) {
            Some(value) => hands.put(id, value),
            None => {
                entry.is_wrong = true;
                response.request_focus();
                *hands.entry = Some(entry);
            }
        }
    } else if !is_left {
        *hands.entry = Some(entry);
    }
}

/// What was typed as a normalised value; `None` where it is none, or lies outside the range. Hosts take the end of the range for
/// what lies outside, which would be a surprise here.
fn typed(hands: &Hands, id: &str, text: &str) -> Option<f32> {
    let is_right = terms::of(id).is_none_or(|parameter| parameter.read(text).is_ok());
    hands.controls.parse(id, text).filter(|_| is_right)
}

/// Says below a field what it takes.
fn say_range(ui: &mut Ui, id: &str, field: Rect, align: Align2) {
    let Some(parameter) = terms::of(id) else { return };
    let c = Colours::here(ui);
    let said = egui::RichText::new(parameter.range()).font(theme::small()).color(c.danger);
    let galley = ui.painter().layout_no_wrap(parameter.range(), theme::small(), c.danger);
    let size = galley.size() + vec2(10.0, 4.0);
    let left =
        if align == Align2::CENTER_CENTER { field.center().x - 0.5 * size.x } else { field.right() - size.x };
    let place = Rect::from_min_size(pos2(left, field.bottom() + 2.0), size);
    // Over the slider's track or the words below, which are at rest meanwhile.
    ui.painter().rect_filled(place, CornerRadius::same(2), c.raised);
    let inside = egui::UiBuilder::new().max_rect(place);
    ui.new_child(inside).put(place, egui::Label::new(said).extend());
}

/// Selects all characters of a text field, of which there are so many.
pub fn select_all(ui: &Ui, id: egui::Id, chars: usize) {
    use egui::text::{CCursor, CCursorRange};
    let mut state = egui::text_edit::TextEditState::load(ui.ctx(), id).unwrap_or_default();
    state.cursor.set_char_range(Some(CCursorRange::two(CCursor::new(0), CCursor::new(chars))));
    state.store(ui.ctx(), id);
}
