//! Choices, switches, buttons, headings, lines of text, handles in charts, and tool tips that explain a parameter.

use std::sync::Arc;

use egui::text::{LayoutJob, TextWrapping};
use egui::{
    Align2, Color32, CornerRadius, CursorIcon, EventFilter, FontId, Galley, Key, Pos2, Rect, Response, Role,
    Sense, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2,
};

use crate::editor::controls::Hands;
use crate::editor::host_marks;
use crate::editor::linked_controllers;
use crate::editor::terms;
use crate::editor::theme;
use crate::editor::theme::Colours;
use crate::parameters;

/// The tool tip of a parameter: the word, what it does to sound and feel, how to move it.
pub fn teach(ui: &mut Ui, id: &str, how: &str) {
    let can_feel = ui.data(|data| data.get_temp::<bool>(can_feel_id()).unwrap_or_default());
    let c = Colours::here(ui);
    let Some(term) = terms::of(id) else { return };
    ui.set_max_width(300.0);
    ui.label(egui::RichText::new(parameters::plain(term.meaning)).strong());
    // Who has no knob feels nothing.
    let feel = if can_feel { term.feel } else { "" };
    for (what, text) in [("Sound", term.sound), ("Feel", feel)] {
        let text = parameters::plain(text);
        if !text.is_empty() {
            ui.label(if feel.is_empty() { text } else { format!("{what}: {text}") });
        }
    }
    if !how.is_empty() {
        ui.label(egui::RichText::new(how).font(theme::small()).color(c.quiet));
    }
}

/// Where the window keeps whether tips say what the hand feels.
fn can_feel_id() -> egui::Id {
    egui::Id::unique("tips say what the hand feels")
}

/// From now on tips say what the hand feels, or do not.
pub fn say_feel(ui: &Ui, can_feel: bool) {
    ui.data_mut(|data| data.insert_temp(can_feel_id(), can_feel));
}

/// A row of choices side by side under a name; a list to open where they would not fit.
pub fn choice(ui: &mut Ui, hands: &mut Hands, id: &'static str) -> Option<Response> {
    let look = hands.controls.look(id)?;
    let c = Colours::here(ui);
    let steps = look.steps.unwrap_or(1).max(1);
    let texts: Vec<String> =
        (0..=steps).map(|step| hands.controls.text(id, step as f32 / steps as f32)).collect();
    let now = (look.value * steps as f32).round() as usize;
    ui.add_space(1.0);
    let name = ui.label(egui::RichText::new(&look.name).color(c.quiet));
    let marks = hands.controls.marks(id);
    host_marks::paint(ui, &marks, name.rect.right_center());
    let name = name.interact(Sense::CLICK);
    linked_controllers::offer_menu(ui, hands, id, &name);
    name.on_hover_ui(|ui| {
        teach(ui, id, "");
        host_marks::explain(ui, &marks);
    });
    let width = |text: &str| ui.painter().layout_no_wrap(text.to_owned(), theme::body(), c.ink).size().x;
    // Cells are equally wide.
    let needed = texts.iter().map(|text| width(text) + 14.0).fold(0.0, f32::max) * texts.len() as f32;
    let mut chosen = now;
    let response = if needed <= ui.available_width() {
        segments(ui, &look.name, &texts, &mut chosen)
    } else {
        list(ui, &look.name, &texts, &mut chosen)
    };
    linked_controllers::offer_menu(ui, hands, id, &response);
    if chosen != now {
        hands.put(id, chosen as f32 / steps as f32);
    }
    Some(response.on_hover_ui(|ui| teach(ui, id, "")))
}

/// A list of choices to open, as wide as there is room. Its name is what a screen reader says, and tells it from its neighbours.
pub fn list(ui: &mut Ui, name: &str, texts: &[String], chosen: &mut usize) -> Response {
    let text = texts.get(*chosen).cloned().unwrap_or_default();
    let list = egui::ComboBox::from_id_salt(("list", name)).width(ui.available_width()).truncate();
    let response = list.selected_text(&text).show_ui(ui, |ui| {
        for (index, text) in texts.iter().enumerate() {
            ui.selectable_value(chosen, index, text);
        }
    });
    response.response.widget_info(|| {
        let mut info = WidgetInfo::labeled(Role::ComboBox, true, name);
        info.current_text_value = Some(text.clone());
        info
    });
    response.response
}

/// Buttons in one frame, of which one is down.
pub fn segments(ui: &mut Ui, name: &str, texts: &[String], chosen: &mut usize) -> Response {
    let c = Colours::here(ui);
    let (rect, whole) = ui.allocate_exact_size(vec2(ui.available_width(), 24.0), Sense::hover());
    // The cells lie over the frame: what points at one of them points at the whole.
    let mut all = whole.clone();
    let painter = ui.painter().clone();
    painter.rect_filled(rect, CornerRadius::same(theme::SMALL_RADIUS + 1), c.raised);
    let width = rect.width() / texts.len().max(1) as f32;
    for (index, text) in texts.iter().enumerate() {
        let cell = Rect::from_min_size(
            pos2(rect.left() + index as f32 * width, rect.top()),
            vec2(width, rect.height()),
        );
        let response = ui.interact(cell, whole.id.with(("cell", index)), Sense::click());
        if response.clicked() {
            *chosen = index;
        }
        let is_chosen = *chosen == index;
        let inner = cell.shrink(2.0);
        let round = CornerRadius::same(theme::SMALL_RADIUS);
        if is_chosen {
            painter.rect_filled(inner, round, c.accent);
        } else if response.hovered() {
            painter.rect_filled(inner, round, c.hovered);
        }
        if response.has_focus() {
            painter.rect_stroke(inner, round, Stroke::new(1.5, c.ink), egui::StrokeKind::Inside);
        }
        let ink = if is_chosen { c.on_accent } else { c.ink };
        painter.text(cell.center(), Align2::CENTER_CENTER, text, theme::body(), ink);
        response.widget_info(|| {
            WidgetInfo::selected(Role::RadioButton, true, is_chosen, format!("{name}: {text}"))
        });
        all |= response;
    }
    all
}

/// A switch with its name.
pub fn switch(ui: &mut Ui, hands: &mut Hands, id: &'static str) -> Option<Response> {
    let look = hands.controls.look(id)?;
    let is_on = look.value >= 0.5;
    let mut response = toggle(ui, &look.name, is_on);
    linked_controllers::offer_menu(ui, hands, id, &response);
    if response.clicked() {
        let value = if ui.input(|i| i.modifiers.command) { look.default } else { f32::from(!is_on) };
        hands.put(id, value);
        response.mark_changed();
    }
    Some(response.on_hover_ui(|ui| teach(ui, id, "Click: on, off.")))
}

/// Draws a switch.
fn toggle(ui: &mut Ui, name: &str, is_on: bool) -> Response {
    let c = Colours::here(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 24.0), Sense::click());
    let painter = ui.painter();
    let ink = if response.hovered() { c.ink } else { c.quiet };
    painter.text(pos2(rect.left(), rect.center().y), Align2::LEFT_CENTER, name, theme::body(), ink);
    let track = Rect::from_center_size(pos2(rect.right() - 16.0, rect.center().y), vec2(30.0, 16.0));
    let round = CornerRadius::same(8);
    painter.rect_filled(track, round, if is_on { c.accent } else { c.raised });
    let x = if is_on { track.right() - 8.0 } else { track.left() + 8.0 };
    painter.circle(
        pos2(x, track.center().y),
        6.0,
        c.panel,
        Stroke::new(1.0, if is_on { c.accent } else { c.quiet }),
    );
    if response.has_focus() {
        painter.rect_stroke(
            track.expand(2.0),
            CornerRadius::same(10),
            Stroke::new(1.5, c.accent),
            egui::StrokeKind::Outside,
        );
    }
    response.widget_info(|| WidgetInfo::selected(Role::Switch, true, is_on, name));
    response
}

/// A button whose parameter is 1 while it is held, and for a tenth of a second at least.
pub fn momentary(ui: &mut Ui, hands: &mut Hands, id: &'static str, text: &str) -> Option<Response> {
    let is_on = hands.controls.look(id)?.value >= 0.5;
    // A click ends after a short time, even if the pointer stays.
    let button = egui::Button::new(text).selected(is_on).sense(Sense::click_and_drag());
    let response = ui.add(button);
    let by_key = response.has_focus() && ui.input(|i| i.key_down(Key::Space) || i.key_down(Key::Enter));
    let is_down = response.is_pointer_button_down_on() || by_key;
    // A click may begin and end within one frame.
    if is_down || response.clicked() {
        hands.press(id, ui.input(|i| i.time), is_down);
    }
    Some(response.on_hover_ui(|ui| teach(ui, id, "")))
}

/// Text in one line, cut where it is too long.
pub fn one_line(ui: &Ui, text: &str, font: FontId, ink: Color32, width: f32) -> Arc<Galley> {
    let mut job = LayoutJob::simple_singleline(text.to_owned(), font, ink);
    job.wrap = TextWrapping::truncate_at_width(width.max(1.0));
    ui.painter().layout_job(job)
}

/// A heading between controls.
pub fn heading(ui: &mut Ui, text: &str) {
    let c = Colours::here(ui);
    // Above it, not before it in a row.
    if ui.layout().is_vertical() {
        ui.add_space(4.0);
    }
    ui.label(egui::RichText::new(text).font(FontId::proportional(13.0)).color(c.ink).strong());
}

/// A handle in a chart: its response, and the place it is dragged to in this frame.
pub fn handle(ui: &mut Ui, name: &str, at: Pos2, text: &str) -> (Response, Option<Pos2>) {
    let c = Colours::here(ui);
    let rect = Rect::from_center_size(at, Vec2::splat(26.0));
    let response = ui.interact(rect, ui.scope_id().with(("handle", name)), Sense::click_and_drag());
    // The place of the pointer; the parameter may not be able to follow it.
    let hand = response.id.with("hand");
    let mut to = None;
    if response.drag_started() {
        ui.data_mut(|data| data.insert_temp(hand, at));
    }
    if response.dragged() && response.drag_delta() != Vec2::ZERO {
        let place = ui.data(|data| data.get_temp::<Pos2>(hand)).unwrap_or(at) + response.drag_delta();
        ui.data_mut(|data| data.insert_temp(hand, place));
        to = Some(place);
    }
    if response.has_focus() {
        let filter = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
        let by = ui.input(|input| {
            let presses = |key| input.num_presses(key) as f32;
            let fine = if input.modifiers.shift { 0.5 } else { 4.0 };
            fine * vec2(
                presses(Key::ArrowRight) - presses(Key::ArrowLeft),
                presses(Key::ArrowDown) - presses(Key::ArrowUp),
            )
        });
        if by != Vec2::ZERO {
            to = Some(at + by);
        }
    }
    let is_held = response.hovered() || response.dragged() || response.has_focus();
    let radius = if is_held { 10.0 } else { 9.0 };
    ui.painter().circle(at, radius, c.panel, Stroke::new(2.0, c.accent));
    ui.painter().text(at, Align2::CENTER_CENTER, text, theme::small(), c.ink);
    if response.has_focus() {
        ui.painter().circle_stroke(at, radius + 3.0, Stroke::new(1.0, c.accent));
    }
    response.widget_info(|| WidgetInfo::labeled(Role::Slider, true, name));
    (response.on_hover_and_drag_cursor(CursorIcon::Grab), to)
}
