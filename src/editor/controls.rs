//! Parameters, as the editor may see them, and the widgets that move them.
//!
//! [`Controls`] is all the editor knows of a host: look, write, and say when a hand begins and ends. Values are
//! normalised, 0..=1; text is the parameter's own both ways. Every widget goes through [`Hands`], which remembers what
//! was done. A slider drags relative to where it stands (Shift: ten times finer), goes to its default by a double click
//! or Ctrl-click, takes typed text by a click on its value or Enter, and moves by arrow keys when it has the focus.

use egui::accesskit::Action as AccessAction;
use egui::{
    Align2, CornerRadius, CursorIcon, EventFilter, FontId, Key, Pos2, Rect, Response, Role, Sense, Stroke,
    TextEdit, Ui, Vec2, WidgetInfo, pos2, vec2,
};

use crate::editor::compare::Values;
use crate::editor::history::History;
use crate::editor::terms;
use crate::editor::theme;
use crate::editor::theme::Colours;

/// What a parameter looks like now.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Its name, as hosts list it.
    pub name: String,
    /// Its value, normalised.
    pub value: f32,
    /// Its default, normalised.
    pub default: f32,
    /// Distance from one end to the other in steps: 1 for a switch; `None` for a continuous one.
    pub steps: Option<usize>,
}

/// The host, as the editor sees it.
pub trait Controls {
    /// All parameters, in the order hosts list them.
    fn ids(&self) -> &[&'static str];
    /// A parameter; `None` for an unknown id.
    fn look(&self, id: &str) -> Option<Look>;
    /// A normalised value as text, with its unit.
    fn text(&self, id: &str, value: f32) -> String;
    /// Text as a normalised value, with or without its unit; `None` if it is no such.
    fn parse(&self, id: &str, text: &str) -> Option<f32>;
    /// A hand is on the parameter.
    fn begin(&self, id: &str);
    /// Sets it. Only between [`begin`](Self::begin) and [`end`](Self::end).
    fn set(&self, id: &str, value: f32);
    /// The hand is off.
    fn end(&self, id: &str);
}

/// Text being typed for one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Which.
    pub id: &'static str,
    /// As it stands.
    pub text: String,
    /// It was no value: what it would take is shown.
    pub is_wrong: bool,
    /// The field has had the focus.
    pub is_shown: bool,
}

/// The controls, and what is remembered of touching them.
pub struct Hands<'a> {
    /// The host.
    pub controls: &'a dyn Controls,
    /// What was done.
    pub history: &'a mut History,
    /// The open text field.
    pub entry: &'a mut Option<Entry>,
    /// Parameters that a hand is on.
    pub held: &'a mut Vec<&'static str>,
}

impl Hands<'_> {
    /// A hand is on it.
    pub fn begin(&mut self, id: &'static str) {
        if let Some(look) = self.controls.look(id).filter(|_| !self.held.contains(&id)) {
            self.controls.begin(id);
            self.held.push(id);
            if terms::is_setting(id) {
                self.history.begin(id, look.value);
            }
        }
    }

    /// Moves it; only while a hand is on it.
    pub fn set(&mut self, id: &'static str, value: f32) {
        if self.held.contains(&id) {
            self.controls.set(id, value.clamp(0.0, 1.0));
        }
    }

    /// The hand is off.
    pub fn end(&mut self, id: &'static str) {
        if let Some(at) = self.held.iter().position(|held| *held == id) {
            self.held.remove(at);
            self.controls.end(id);
            let after = self.controls.look(id).map_or(0.0, |look| look.value);
            self.history.end(id, after);
        }
    }

    /// All hands off: what held them is gone, or the pointer is up.
    pub fn let_go(&mut self) {
        for id in self.held.clone() {
            self.end(id);
        }
    }

    /// One touch: on, there, off.
    pub fn put(&mut self, id: &'static str, value: f32) {
        self.begin(id);
        self.set(id, value);
        self.end(id);
    }

    /// Several at once, as one step.
    pub fn put_all(&mut self, values: &[(&'static str, f32)]) {
        values.iter().for_each(|&(id, _)| self.begin(id));
        values.iter().for_each(|&(id, value)| self.set(id, value));
        values.iter().for_each(|&(id, _)| self.end(id));
    }

    /// Sets values that are no new step: undo, redo, A/B.
    pub fn restore(&mut self, values: &[(&'static str, f32)]) {
        for &(id, value) in values {
            self.controls.begin(id);
            self.controls.set(id, value);
            self.controls.end(id);
        }
    }

    /// Everything that belongs to a setting.
    pub fn setting(&self) -> Values {
        let ids = self.controls.ids().iter().filter(|id| terms::is_setting(id));
        ids.filter_map(|&id| Some((id, self.controls.look(id)?.value))).collect()
    }

    /// Sets a parameter to a number in its own unit; nothing happens where that is no value of it.
    pub fn set_number(&mut self, id: &'static str, number: f64) {
        if let Some(value) = self.controls.parse(id, &format!("{number}")) {
            self.set(id, value);
        }
    }

    /// A switch or choice is on its `index`-th step.
    pub fn step(&self, id: &str) -> usize {
        self.controls
            .look(id)
            .map_or(0, |look| (look.value * look.steps.unwrap_or(1) as f32).round() as usize)
    }

    /// The name of a parameter.
    pub fn name(&self, id: &str) -> String {
        self.controls.look(id).map_or_else(|| id.to_owned(), |look| look.name)
    }
}

/// The tool tip of a parameter: the word, what it does to sound and feel, how to move it.
pub fn teach(ui: &mut Ui, id: &str, how: &str) {
    let c = Colours::here(ui);
    let Some(term) = terms::of(id) else { return };
    ui.set_max_width(300.0);
    ui.label(egui::RichText::new(term.word).strong());
    for (what, text) in [("Sound", term.sound), ("Feel", term.feel)] {
        if !text.is_empty() {
            ui.label(egui::RichText::new(if term.feel.is_empty() {
                text.to_owned()
            } else {
                format!("{what}: {text}")
            }));
        }
    }
    if !how.is_empty() {
        ui.label(egui::RichText::new(how).font(theme::small()).color(c.quiet));
    }
}

const HOW_SLIDER: &str =
    "Drag; Shift: finer. Double click or Ctrl-click: default. Click the value or Enter: type.";
/// Height of a slider, name and track together.
const SLIDER_HEIGHT: f32 = 36.0;
/// Share of the track an arrow key moves; a hundredth of that with Shift.
const KEY_STEP: f32 = 0.01;

/// A named slider as wide as its place. Nothing where there is no such parameter.
pub fn slider(ui: &mut Ui, hands: &mut Hands, id: &'static str) -> Option<Response> {
    let look = hands.controls.look(id)?;
    let c = Colours::here(ui);
    let width = ui.available_width().max(60.0);
    let (rect, mut response) = ui.allocate_exact_size(vec2(width, SLIDER_HEIGHT), Sense::click_and_drag());
    let text = hands.controls.text(id, look.value);
    let galley = ui.painter().layout_no_wrap(text.clone(), theme::body(), c.ink);
    let value_size = galley.size() + vec2(10.0, 4.0);
    let value_rect = Rect::from_min_size(pos2(rect.right() - value_size.x + 5.0, rect.top()), value_size);
    let is_typing = hands.entry.as_ref().is_some_and(|entry| entry.id == id);
    // One stop of the Tab key a slider: its value opens by Enter.
    let value_response = ui.interact(value_rect, response.id.with("value"), Sense::CLICK);

    let track = Rect::from_min_max(
        pos2(rect.left() + 6.0, rect.bottom() - 11.0),
        pos2(rect.right() - 6.0, rect.bottom() - 7.0),
    );
    let mut value = look.value;
    if !is_typing {
        value = moved_by_pointer(ui, hands, id, &look, &response, track.width()).unwrap_or(value);
        if response.has_focus() {
            value = moved_by_keys(ui, hands, id, &look, &response).unwrap_or(value);
        }
        let is_reset = response.double_clicked() || (response.clicked() && ui.input(|i| i.modifiers.command));
        if is_reset {
            value = look.default;
            hands.put(id, value);
        } else if value_response.clicked()
            || (response.clicked() && response.has_focus() && ui.input(pressed_enter))
        {
            *hands.entry = Some(Entry { id, text: text.clone(), is_wrong: false, is_shown: false });
        }
    }
    if value != look.value {
        response.mark_changed();
    }

    paint_slider(ui, c, rect, track, &look, value, &response);
    if is_typing {
        type_value(
            ui,
            hands,
            id,
            Rect::from_min_max(
                pos2(rect.right() - 96.0, rect.top() - 1.0),
                pos2(rect.right(), rect.top() + 21.0),
            ),
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
    Some(response.on_hover_ui(|ui| teach(ui, id, HOW_SLIDER)))
}

fn pressed_enter(input: &egui::InputState) -> bool {
    input.key_pressed(Key::Enter)
}

fn moved_by_pointer(
    ui: &Ui,
    hands: &mut Hands,
    id: &'static str,
    look: &Look,
    response: &Response,
    width: f32,
) -> Option<f32> {
    // Where the hand would be on a track without steps: else a stepped slider never leaves its step.
    let exact = response.id.with("exact");
    if response.drag_started() {
        hands.begin(id);
        ui.data_mut(|data| data.insert_temp(exact, look.value));
    }
    let mut value = None;
    if response.dragged() && response.drag_delta().x != 0.0 {
        let fine = if ui.input(|i| i.modifiers.shift) { 0.1 } else { 1.0 };
        let from = ui.data(|data| data.get_temp::<f32>(exact)).unwrap_or(look.value);
        let to = (from + fine * response.drag_delta().x / width).clamp(0.0, 1.0);
        ui.data_mut(|data| data.insert_temp(exact, to));
        let to = stepped(look, to);
        hands.set(id, to);
        value = Some(to);
    }
    if response.drag_stopped() {
        hands.end(id);
    }
    value
}

fn stepped(look: &Look, value: f32) -> f32 {
    match look.steps {
        Some(steps) if steps > 0 => (value * steps as f32).round() / steps as f32,
        _ => value,
    }
}

fn moved_by_keys(
    ui: &Ui,
    hands: &mut Hands,
    id: &'static str,
    look: &Look,
    response: &Response,
) -> Option<f32> {
    let filter = EventFilter { horizontal_arrows: true, ..EventFilter::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
    let unit = look.steps.map_or(KEY_STEP, |steps| 1.0 / steps.max(1) as f32);
    let (mut by, mut to) = (0.0, None);
    ui.input(|input| {
        let fine = if input.modifiers.shift && look.steps.is_none() { 0.1 } else { 1.0 };
        by += unit
            * fine
            * (input.num_presses(Key::ArrowRight) as f32 - input.num_presses(Key::ArrowLeft) as f32);
        by += unit * input.num_accesskit_action_requests(response.id, AccessAction::Increment) as f32;
        by -= unit * input.num_accesskit_action_requests(response.id, AccessAction::Decrement) as f32;
        if input.key_pressed(Key::Home) {
            to = Some(0.0);
        } else if input.key_pressed(Key::End) {
            to = Some(1.0);
        } else if input.key_pressed(Key::Delete) || input.key_pressed(Key::Backspace) {
            to = Some(look.default);
        }
    });
    let value = to.or((by != 0.0).then(|| (look.value + by).clamp(0.0, 1.0)))?;
    hands.put(id, value);
    Some(value)
}

fn paint_slider(ui: &Ui, c: &Colours, rect: Rect, track: Rect, look: &Look, value: f32, response: &Response) {
    let painter = ui.painter();
    let name = if response.hovered() || response.has_focus() { c.ink } else { c.quiet };
    painter.text(pos2(rect.left(), rect.top() + 9.0), Align2::LEFT_CENTER, &look.name, theme::body(), name);
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
}

/// The text field over a value. Enter takes it, Escape leaves it, and so does a click elsewhere.
fn type_value(ui: &mut Ui, hands: &mut Hands, id: &'static str, rect: Rect) {
    let Some(mut entry) = hands.entry.take() else { return };
    let c = Colours::here(ui);
    let field = TextEdit::singleline(&mut entry.text)
        .id(egui::Id::unique(("value of", id)))
        .font(theme::body())
        .text_color(if entry.is_wrong { c.danger } else { c.ink })
        .align(egui::Align2::RIGHT_CENTER)
        .desired_width(rect.width());
    // In a place of its own: `put` here would move what follows.
    let response = ui.new_child(egui::UiBuilder::new().max_rect(rect)).put(rect, field);
    let name = hands.name(id);
    response.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, format!("{name}, value")));
    if !entry.is_shown {
        entry.is_shown = true;
        response.request_focus();
        select_all(ui, response.id, entry.text.chars().count());
    }
    let is_left = response.lost_focus();
    let is_taken = is_left && ui.input(pressed_enter);
    if is_taken {
        match hands.controls.parse(id, &entry.text) {
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

fn select_all(ui: &Ui, id: egui::Id, chars: usize) {
    use egui::text::{CCursor, CCursorRange};
    let mut state = egui::text_edit::TextEditState::load(ui.ctx(), id).unwrap_or_default();
    state.cursor.set_char_range(Some(CCursorRange::two(CCursor::new(0), CCursor::new(chars))));
    state.store(ui.ctx(), id);
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
    name.on_hover_ui(|ui| teach(ui, id, ""));
    let width = |text: &str| ui.painter().layout_no_wrap(text.to_owned(), theme::body(), c.ink).size().x;
    // Cells are equally wide.
    let needed = texts.iter().map(|text| width(text) + 14.0).fold(0.0, f32::max) * texts.len() as f32;
    let mut chosen = now;
    let response = if needed <= ui.available_width() {
        segments(ui, &look.name, &texts, &mut chosen)
    } else {
        let list = egui::ComboBox::from_id_salt(("choice", id)).width(ui.available_width() - 8.0);
        let list = list.selected_text(texts.get(now).cloned().unwrap_or_default());
        let response = list.show_ui(ui, |ui| {
            for (step, text) in texts.iter().enumerate() {
                ui.selectable_value(&mut chosen, step, text);
            }
        });
        let text = texts.get(now).cloned().unwrap_or_default();
        response.response.widget_info(|| {
            let mut info = WidgetInfo::labeled(Role::ComboBox, true, &look.name);
            info.current_text_value = Some(text.clone());
            info
        });
        response.response
    };
    if chosen != now {
        hands.put(id, chosen as f32 / steps as f32);
    }
    Some(response.on_hover_ui(|ui| teach(ui, id, "")))
}

/// Buttons in one frame, of which one is down.
pub fn segments(ui: &mut Ui, name: &str, texts: &[String], chosen: &mut usize) -> Response {
    let c = Colours::here(ui);
    let (rect, whole) = ui.allocate_exact_size(vec2(ui.available_width(), 24.0), Sense::hover());
    let painter = ui.painter().clone();
    painter.rect_filled(rect, CornerRadius::same(theme::SMALL_RADIUS + 1), c.raised);
    let width = rect.width() / texts.len().max(1) as f32;
    for (index, text) in texts.iter().enumerate() {
        let cell = Rect::from_min_size(
            pos2(rect.left() + index as f32 * width, rect.top()),
            vec2(width, rect.height()),
        );
        let response = ui.interact(cell, whole.id.with(index), Sense::click());
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
    }
    whole
}

/// A switch with its name.
pub fn switch(ui: &mut Ui, hands: &mut Hands, id: &'static str) -> Option<Response> {
    let look = hands.controls.look(id)?;
    let is_on = look.value >= 0.5;
    let mut response = toggle(ui, &look.name, is_on);
    if response.clicked() {
        let value = if ui.input(|i| i.modifiers.command) { look.default } else { f32::from(!is_on) };
        hands.put(id, value);
        response.mark_changed();
    }
    Some(response.on_hover_ui(|ui| teach(ui, id, "Click: on, off.")))
}

/// The picture and the hand of a switch.
pub fn toggle(ui: &mut Ui, name: &str, is_on: bool) -> Response {
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

/// A button that is on while it is held: what it stands for happens once.
pub fn momentary(ui: &mut Ui, hands: &mut Hands, id: &'static str, text: &str) -> Option<Response> {
    hands.controls.look(id)?;
    let response = ui.button(text);
    if response.clicked() {
        hands.begin(id);
        hands.set(id, 1.0);
        hands.set(id, 0.0);
        hands.end(id);
    }
    Some(response.on_hover_ui(|ui| teach(ui, id, "")))
}

/// A heading between controls.
pub fn heading(ui: &mut Ui, text: &str) {
    let c = Colours::here(ui);
    ui.add_space(4.0);
    ui.label(egui::RichText::new(text).font(FontId::proportional(12.0)).color(c.accent).strong());
}

/// A handle in a picture: its response, and where a hand takes it this frame.
pub fn handle(ui: &mut Ui, name: &str, at: Pos2, text: &str) -> (Response, Option<Pos2>) {
    let c = Colours::here(ui);
    let rect = Rect::from_center_size(at, Vec2::splat(26.0));
    let response = ui.interact(rect, ui.scope_id().with(("handle", name)), Sense::click_and_drag());
    // Where the hand is, which need not be where the parameter could follow.
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
