//! The preset bar of the header: previous, the name with its tags, next. A click on the name opens the browser.

use egui::{
    CornerRadius, Pos2, Rect, Response, Role, Sense, Shape, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2,
};

use crate::editor::Action;
use crate::editor::controls::Hands;
use crate::editor::preset_browser::PresetBrowser;
use crate::editor::preset_values::{choose, is_changed};
use crate::editor::snapshot::Snapshot;
use crate::editor::theme;
use crate::editor::theme::Colours;
use crate::editor::widgets::one_line;

/// Widest bar, points: a longest name and its tags.
const WIDEST: f32 = 380.0;
/// In less room there is no bar.
const NARROWEST: f32 = 84.0;
/// Width of an arrow.
const ARROW: f32 = 22.0;

/// Draws the bar into the room that is left.
pub fn bar(
    ui: &mut Ui,
    browser: &mut PresetBrowser,
    hands: &mut Hands,
    snapshot: &Snapshot,
    actions: &mut Vec<Action>,
) {
    if ui.available_width() < NARROWEST {
        return;
    }
    let size = vec2(ui.available_width(), ui.available_height().min(38.0));
    let (room, _) = ui.allocate_exact_size(size, Sense::hover());
    let rect = Rect::from_center_size(room.center(), vec2(room.width().min(WIDEST), room.height()));
    let c = Colours::here(ui);
    ui.painter().rect_filled(rect, CornerRadius::same(theme::SMALL_RADIUS), c.raised);

    let (shelf, name) = (&snapshot.presets, snapshot.preset.as_str());
    let step = |ui: &Ui, by: isize, browser: &PresetBrowser, hands: &mut Hands, actions: &mut Vec<Action>| {
        let x = if by < 0 { rect.left() } else { rect.right() - ARROW };
        let place = Rect::from_min_size(pos2(x, rect.top()), vec2(ARROW, rect.height()));
        let word = if by < 0 { "Previous preset" } else { "Next preset" };
        let preset = shelf.beside(name, by, |preset| browser.is_shown(preset, shelf));
        let among = browser.among().map_or_else(String::new, |among| format!(", only {among}"));
        let hint = match preset {
            Some(preset) => format!("{word}{among}: {}", preset.name),
            None => format!("{word}{among}: there is none"),
        };
        if arrow(ui, place, by as f32, word).on_hover_text(hint).clicked()
            && let Some(preset) = preset
        {
            choose(preset, &snapshot.preset, hands, actions);
        }
    };
    // In the order of the Tab key.
    step(ui, -1, browser, hands, actions);
    name_button(ui, rect.shrink2(vec2(ARROW, 0.0)), browser, hands, snapshot, actions);
    step(ui, 1, browser, hands, actions);
}

/// The name of the preset with its tags, which opens the browser.
fn name_button(
    ui: &Ui,
    middle: Rect,
    browser: &mut PresetBrowser,
    hands: &Hands,
    snapshot: &Snapshot,
    actions: &mut Vec<Action>,
) {
    let c = Colours::here(ui);
    let (shelf, name) = (&snapshot.presets, snapshot.preset.as_str());
    let response = ui.interact(middle, ui.scope_id().with("preset"), Sense::click());
    frame(ui, middle, &response, browser.is_open);
    let preset = shelf.find(name);
    let has_changed = preset.is_some_and(|preset| is_changed(preset, hands.controls));
    let shown = if name.is_empty() { "Presets" } else { name };
    let tags = preset.map_or_else(String::new, |preset| preset.tags.join(", "));
    let below = match (preset, has_changed) {
        (None, _) if name.is_empty() => "choose one".to_owned(),
        (None, _) => "not found".to_owned(),
        (Some(_), true) if tags.is_empty() => "changed".to_owned(),
        (Some(_), true) => format!("changed \u{b7} {tags}"),
        (Some(_), false) => tags,
    };
    // The arrows go through these alone.
    let below = match browser.among() {
        Some(among) => format!("only {among} \u{b7} {below}"),
        None => below,
    };
    let width = middle.width() - 12.0;
    let at = |y: f32| pos2(middle.left() + 6.0, y);
    let upper = one_line(ui, shown, theme::body(), c.ink, width);
    let lower = one_line(ui, &below, theme::small(), c.quiet, width);
    let top = middle.center().y - 0.5 * (upper.size().y + lower.size().y);
    ui.painter().galley(at(top), upper.clone(), c.ink);
    ui.painter().galley(at(top + upper.size().y), lower, c.quiet);
    let said = format!("Preset {shown}{}", if has_changed { ", changed" } else { "" });
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, browser.is_open, &said));
    if response.clicked() {
        browser.toggle(name, actions);
    }
    response.on_hover_ui(|ui| {
        ui.set_max_width(300.0);
        ui.label(egui::RichText::new(shown).strong());
        if let Some(preset) = preset {
            ui.label(&preset.shows);
        }
        ui.label("Click for all presets.");
    });
}

fn frame(ui: &Ui, rect: Rect, response: &Response, is_open: bool) {
    let c = Colours::here(ui);
    let round = CornerRadius::same(theme::SMALL_RADIUS);
    if response.hovered() {
        ui.painter().rect_filled(rect, round, c.hovered);
    }
    if response.has_focus() || is_open {
        ui.painter().rect_stroke(rect, round, Stroke::new(1.5, c.accent), StrokeKind::Inside);
    }
}

/// A triangle that points left (-1) or right (1).
pub(super) fn arrow(ui: &Ui, rect: Rect, side: f32, word: &str) -> Response {
    let response = ui.interact(rect, ui.scope_id().with(word), Sense::click());
    frame(ui, rect, &response, false);
    let c = Colours::here(ui);
    let at = |x: f32, y: f32| -> Pos2 { rect.center() + vec2(side * x, y) };
    let triangle = vec![at(4.0, 0.0), at(-3.0, 5.0), at(-3.0, -5.0)];
    ui.painter().add(Shape::convex_polygon(triangle, c.ink, Stroke::NONE));
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, word));
    response
}
