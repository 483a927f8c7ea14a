//! The browser of presets, in place of a view: search, tags and favourites over the list; beside it what the chosen preset
//! is, and saving, renaming and deleting one's own.
//!
//! A click on a preset puts it on at once, so that it can be played. Work on files leaves as an [`Action`].

use std::collections::BTreeSet;
use std::ops::Range;

use egui::{
    CornerRadius, Key, Rect, Response, RichText, Role, Sense, Shape, Stroke, StrokeKind, TextEdit, Ui,
    WidgetInfo, pos2, vec2,
};

use crate::editor::Action;
use crate::editor::controls::{Hands, heading};
use crate::editor::preset_values::{capture, choose, is_changed};
use crate::editor::slider::select_all;
use crate::editor::snapshot::Snapshot;
use crate::editor::theme;
use crate::editor::theme::{Colours, GAP, panel};
use crate::editor::widgets::one_line;
use crate::presets::{Preset, PresetShelf, checked_name, factory};

/// Height of a row of the list, points: two lines of text.
const ROW: f32 = 38.0;

/// What the browser remembers.
#[derive(Clone, Debug, Default)]
pub struct PresetBrowser {
    /// It is in front.
    pub is_open: bool,
    search: String,
    tags: BTreeSet<String>,
    favourites: bool,
    yours: bool,
    form: Option<Form>,
    /// The preset of this name is to be scrolled to, once the list has it.
    reveal: Option<String>,
    /// Presets in the list of the frame before.
    listed: usize,
    /// Rows that were seen in the frame before.
    seen: Range<usize>,
    /// The preset that was chosen in the frame before.
    chosen: String,
    /// The window has no host, whose keys they would be: arrow keys choose.
    pub has_keys: bool,
}

/// What is being typed.
#[derive(Clone, Debug, PartialEq)]
enum Form {
    Save { name: String, tags: String, author: String, shows: String },
    Rename { old: String, new: String },
    Delete(String),
}

impl Form {
    /// What its first field holds when it opens.
    fn first(&self) -> &str {
        match self {
            Self::Save { name, .. } => name,
            Self::Rename { new, .. } => new,
            Self::Delete(_) => "",
        }
    }
}

impl PresetBrowser {
    /// Opens or closes it. `chosen`: name of the preset that is chosen, which it shows.
    pub fn toggle(&mut self, chosen: &str, actions: &mut Vec<Action>) {
        self.is_open = !self.is_open;
        self.form = None;
        if self.is_open {
            (self.reveal, self.chosen, self.listed) = (Some(chosen.to_owned()), chosen.to_owned(), 0);
            actions.push(Action::ReadPresets);
        }
    }

    /// Shows a preset in the list. What was looked for the last time might hide it.
    fn show(&mut self, name: String) {
        self.search.clear();
        self.tags.clear();
        (self.favourites, self.yours) = (false, false);
        (self.reveal, self.listed) = (Some(name), 0);
    }

    /// What is looked for, in words; `None` where all presets are shown.
    pub fn among(&self) -> Option<String> {
        let search = self.search.trim();
        let words = [(self.favourites, "favourites"), (self.yours, "yours"), (!search.is_empty(), search)];
        let words = words.into_iter().filter(|(is_on, _)| *is_on).map(|(_, word)| word);
        let all: Vec<&str> = words.chain(self.tags.iter().map(String::as_str)).collect();
        (!all.is_empty()).then(|| all.join(", "))
    }

    /// Draws it.
    pub fn draw(&mut self, ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        // Escape leaves a text field first, then a form, then the browser.
        if ui.input(|input| input.key_pressed(Key::Escape)) && !ui.ctx().text_edit_focused() {
            self.is_open = self.form.take().is_some();
        }
        let mut with = (self, hands, actions);
        crate::editor::beside(
            ui,
            "presets",
            &mut with,
            |ui, (this, hands, actions)| this.left(ui, hands, snapshot, actions),
            |ui, (this, hands, actions)| this.column(ui, hands, snapshot, actions),
        );
    }

    fn left(&mut self, ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        let c = Colours::here(ui);
        panel(c).show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.set_height(ui.available_height());
            ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
            ui.horizontal(|ui| {
                let width = (ui.available_width() - 190.0).clamp(90.0, 320.0);
                let field = TextEdit::singleline(&mut self.search).desired_width(width).hint_text("search");
                let field = ui.add(field);
                field.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, "Search presets"));
                chip(ui, "Favourites", &mut self.favourites);
                chip(ui, "Yours", &mut self.yours);
                if self.among().is_some() && ui.button("All").on_hover_text("Shows all presets").clicked() {
                    self.show(snapshot.preset.clone());
                }
            });
            ui.horizontal_wrapped(|ui| {
                for tag in snapshot.presets.tags() {
                    let mut is_on = self.tags.contains(tag);
                    if chip(ui, tag, &mut is_on) {
                        if is_on {
                            self.tags.insert(tag.to_owned());
                        } else {
                            self.tags.remove(tag);
                        }
                    }
                }
            });
            ui.add_space(0.5 * GAP);
            self.list(ui, hands, snapshot, actions);
        });
    }

    /// Whether it is among those that are looked for.
    pub fn is_shown(&self, preset: &Preset, shelf: &PresetShelf) -> bool {
        (!self.favourites || shelf.is_liked(&preset.name))
            && (!self.yours || shelf.is_users(&preset.name))
            && self.tags.iter().all(|tag| preset.has_tag(tag))
            && preset.is_found_by(&self.search)
    }

    fn list(&mut self, ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        let shelf = &snapshot.presets;
        let shown: Vec<&Preset> = shelf.all().filter(|preset| self.is_shown(preset, shelf)).collect();
        if shown.is_empty() {
            let c = Colours::here(ui);
            let text = if self.favourites && !shelf.all().any(|preset| shelf.is_liked(&preset.name)) {
                "No favourites yet: the star beside the name of a preset makes it one."
            } else {
                "No preset is like that. Take a tag off, or search for less."
            };
            ui.label(RichText::new(text).color(c.quiet));
            return;
        }
        ui.spacing_mut().item_spacing.y = 0.0;
        let mut area = egui::ScrollArea::vertical().id_salt("presets").auto_shrink([false, false]);
        // The arrows choose while nothing else has the focus.
        let is_free = self.has_keys && ui.memory(|memory| memory.focused().is_none());
        let pressed = |key| ui.input_mut(|input| input.consume_key(egui::Modifiers::NONE, key));
        for (key, by) in [(Key::ArrowDown, 1), (Key::ArrowUp, -1)] {
            if is_free
                && pressed(key)
                && let Some(preset) =
                    shelf.beside(&snapshot.preset, by, |preset| self.is_shown(preset, shelf))
            {
                choose(preset, &snapshot.preset, hands, actions);
            }
        }
        let found = |name: &String| shown.iter().position(|preset| preset.name == *name);
        // What is chosen by an arrow, or by undo, comes into sight.
        if self.chosen != snapshot.preset {
            self.chosen.clone_from(&snapshot.preset);
            let is_away = found(&self.chosen).is_some_and(|at| !self.seen.contains(&at));
            self.reveal = is_away.then(|| self.chosen.clone());
        }
        let before = std::mem::replace(&mut self.listed, shown.len());
        let wanted = self.reveal.as_ref().and_then(found);
        // A list that has grown knows its length a frame later: it would spring back from beyond the end of before.
        if wanted.is_some() && before != shown.len() {
            ui.ctx().request_repaint();
        } else if let Some(at) = wanted {
            // In the middle, so that its neighbours are seen too.
            let height = ui.available_height();
            let most = (shown.len() as f32 * ROW - height).max(0.0);
            let middle = at as f32 * ROW - 0.5 * (height - ROW);
            area = area.vertical_scroll_offset(middle.clamp(0.0, most));
            self.reveal = None;
        }
        let (seen, chosen, count) = (&mut self.seen, &mut self.chosen, shown.len());
        area.show_rows(ui, ROW, shown.len(), |ui, rows| {
            // The rows at both ends may be cut, and the last one that is drawn is out of sight.
            let last = if rows.end == count { 1 } else { 2 };
            *seen = rows.start + usize::from(rows.start > 0)..rows.end.saturating_sub(last);
            for preset in &shown[rows] {
                let is_here = snapshot.preset == preset.name;
                let (row, star) = row(ui, preset, is_here, shelf);
                if star.clicked() {
                    let is_liked = !shelf.is_liked(&preset.name);
                    actions.push(Action::LikePreset { name: preset.name.clone(), is_liked });
                } else if row.clicked() {
                    // It is where the pointer is, and stays there.
                    chosen.clone_from(&preset.name);
                    choose(preset, &snapshot.preset, hands, actions);
                }
            }
        });
    }

    fn column(&mut self, ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        let c = Colours::here(ui);
        let shelf = &snapshot.presets;
        let chosen = shelf.find(&snapshot.preset);
        if ui.button("Close the list").clicked() {
            self.is_open = false;
        }
        heading(ui, if snapshot.preset.is_empty() { "No preset chosen" } else { &snapshot.preset });
        // Above what the preset sets, which may be long.
        match self.form.take() {
            Some(form) => {
                let before = actions.len();
                self.form = draw_form(ui, form, hands, shelf, actions);
                let saved = actions[before..].iter().find_map(|action| match action {
                    Action::SavePreset(preset) => Some(preset.name.clone()),
                    _ => None,
                });
                if let Some(name) = saved {
                    self.show(name);
                }
            }
            None => {
                self.form = offer_forms(ui, snapshot);
                if let Some(form) = &self.form {
                    ui.memory_mut(|memory| memory.request_focus(first_field()));
                    select_all(ui, first_field(), form.first().chars().count());
                }
            }
        }
        if let Some(notice) = &shelf.notice {
            ui.label(RichText::new(notice).color(c.danger));
        }
        ui.add_space(GAP);
        if let Some(preset) = chosen {
            about(ui, preset, hands);
        }
        if !shelf.user.broken.is_empty() {
            heading(ui, "Files that are no presets");
            for broken in &shelf.user.broken {
                ui.label(RichText::new(broken).font(theme::small()).color(c.danger));
            }
        }
    }
}

/// What a preset is, and what it sets.
fn about(ui: &mut Ui, preset: &Preset, hands: &Hands) {
    let c = Colours::here(ui);
    let quiet = |text: &str| RichText::new(text).font(theme::small()).color(c.quiet);
    if is_changed(preset, hands.controls) {
        ui.label(RichText::new("changed since it was chosen").color(c.quiet));
    }
    if !preset.shows.is_empty() {
        ui.label(&preset.shows);
    }
    let mut words = preset.tags.join(", ");
    if !preset.author.is_empty() {
        words += &format!(" \u{b7} by {}", preset.author);
    }
    ui.label(quiet(&words));
    ui.add_space(4.0);
    for (parameter, value) in preset.changes() {
        ui.label(quiet(&format!("{}: {}", parameter.name, parameter.text(*value))));
    }
}

/// Buttons that begin a form.
fn offer_forms(ui: &mut Ui, snapshot: &Snapshot) -> Option<Form> {
    let shelf = &snapshot.presets;
    let mut form = None;
    let mine = shelf.find(&snapshot.preset).filter(|preset| shelf.is_users(&preset.name));
    if ui.button("Save as").on_hover_text("Save all controls as a preset of your own").clicked() {
        form = Some(match mine {
            Some(preset) => Form::Save {
                name: preset.name.clone(),
                tags: preset.tags.join(", "),
                author: preset.author.clone(),
                shows: preset.shows.clone(),
            },
            None => Form::Save {
                name: String::new(),
                tags: shelf.find(&snapshot.preset).map_or_else(String::new, |preset| preset.tags.join(", ")),
                author: String::new(),
                shows: String::new(),
            },
        });
    }
    if let Some(preset) = mine {
        if ui.button("Rename").clicked() {
            form = Some(Form::Rename { old: preset.name.clone(), new: preset.name.clone() });
        }
        if ui.button("Delete").clicked() {
            form = Some(Form::Delete(preset.name.clone()));
        }
    }
    form
}

/// The field of a form that text goes to first.
fn first_field() -> egui::Id {
    egui::Id::unique("name of a preset")
}

/// A field with its name above it.
fn field(ui: &mut Ui, name: &str, text: &mut String) {
    let edit = TextEdit::singleline(text);
    add_field(ui, name, edit);
}

/// The same for a preset's name, which Enter finishes. Whether it has.
fn name_field(ui: &mut Ui, name: &str, text: &mut String) -> bool {
    let response = add_field(ui, name, TextEdit::singleline(text).id(first_field()));
    response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter))
}

fn add_field(ui: &mut Ui, name: &str, edit: TextEdit) -> Response {
    let c = Colours::here(ui);
    ui.label(RichText::new(name).color(c.quiet));
    let response = ui.add(edit.desired_width(ui.available_width() - 8.0));
    response.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, name));
    response
}

/// Draws a form; `None` once it is done.
fn draw_form(
    ui: &mut Ui,
    mut form: Form,
    hands: &Hands,
    shelf: &PresetShelf,
    actions: &mut Vec<Action>,
) -> Option<Form> {
    let c = Colours::here(ui);
    let refused = |ui: &mut Ui, why: &str| ui.label(RichText::new(why).font(theme::small()).color(c.danger));
    let mut is_done = false;
    match &mut form {
        Form::Save { name, tags, author, shows } => {
            let is_entered = name_field(ui, "Name of the preset", name);
            field(ui, "Tags, with commas", tags);
            field(ui, "Author", author);
            field(ui, "Description", shows);
            let checked = checked_name(name).and_then(|name| match factory::find(&name) {
                Some(_) => Err("this is a factory preset; choose another name".to_owned()),
                None => Ok(name),
            });
            let tags = tags.split(',').map(str::trim).filter(|tag| !tag.is_empty()).map(str::to_owned);
            let made = checked.and_then(|name| {
                let mut preset = capture(&name, hands.controls);
                preset.tags = tags.collect();
                (preset.author, preset.shows) = (author.trim().to_owned(), shows.trim().to_owned());
                // What could not be read back is not saved.
                Preset::parse(&preset.to_text()).map_err(|reason| reason.what)
            });
            let word = if shelf.is_users(name.trim()) { "Replace" } else { "Save" };
            // Enter replaces nothing: who means that presses the button.
            let is_entered = is_entered && word == "Save";
            if (ui.add_enabled(made.is_ok(), egui::Button::new(word)).clicked() || is_entered)
                && let Ok(preset) = &made
            {
                actions.push(Action::SavePreset(preset.clone()));
                is_done = true;
            }
            if let Err(why) = made.as_ref().map_err(String::as_str)
                && !name.is_empty()
            {
                refused(ui, why);
            }
        }
        Form::Rename { old, new } => {
            let is_entered = name_field(ui, "New name", new);
            let is_taken = |name: &str| name != old.as_str() && shelf.find(name).is_some();
            let checked = checked_name(new).and_then(|name| match is_taken(&name) {
                true => Err("another preset has this name".to_owned()),
                false => Ok(name),
            });
            if (ui.add_enabled(checked.is_ok(), egui::Button::new("Rename")).clicked() || is_entered)
                && let Ok(name) = &checked
            {
                actions.push(Action::RenamePreset { old: old.clone(), new: name.clone() });
                is_done = true;
            }
            if let Err(why) = &checked {
                refused(ui, why);
            }
        }
        Form::Delete(name) => {
            ui.label(format!("Delete \u{201c}{name}\u{201d} for good?"));
            if ui.button("Delete it").clicked() {
                actions.push(Action::DeletePreset(name.clone()));
                is_done = true;
            }
        }
    }
    is_done |= ui.button("Cancel").clicked();
    (!is_done).then_some(form)
}

/// A small switch with its word on it; whether it was clicked.
fn chip(ui: &mut Ui, word: &str, is_on: &mut bool) -> bool {
    let button = egui::Button::selectable(*is_on, word).frame_when_inactive(true);
    let response = ui.add(button);
    response.widget_info(|| WidgetInfo::selected(Role::CheckBox, true, *is_on, word));
    let is_clicked = response.clicked();
    *is_on ^= is_clicked;
    is_clicked
}

/// A preset in the list: the row, and its star.
fn row(ui: &mut Ui, preset: &Preset, is_here: bool, shelf: &PresetShelf) -> (Response, Response) {
    let c = Colours::here(ui);
    // Room for the scroll bar.
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width() - 10.0, ROW), Sense::click());
    let round = CornerRadius::same(theme::SMALL_RADIUS);
    if is_here {
        ui.painter().rect_filled(rect, round, c.accent);
    } else if response.hovered() {
        ui.painter().rect_filled(rect, round, c.hovered);
    }
    if response.has_focus() {
        ui.painter().rect_stroke(rect, round, Stroke::new(1.5, c.ink), StrokeKind::Inside);
    }
    let place = Rect::from_min_size(rect.min, vec2(26.0, ROW));
    let star = ui.interact(place, response.id.with("star"), Sense::click());
    let is_liked = shelf.is_liked(&preset.name);
    let (ink, quiet) = if is_here { (c.on_accent, c.on_accent) } else { (c.ink, c.quiet) };
    paint_star(ui, place, is_liked, if star.hovered() { ink } else { quiet });
    let name = format!("Favourite {}", preset.name);
    star.widget_info(|| WidgetInfo::selected(Role::CheckBox, true, is_liked, &name));
    let tags = preset.tags.join(", ");
    let tags = if shelf.is_users(&preset.name) && tags.is_empty() { "yours".to_owned() } else { tags };
    let beside = one_line(ui, &tags, theme::small(), quiet, 0.4 * rect.width());
    let (left, right) = (rect.left() + 28.0, rect.right() - 6.0);
    let upper = one_line(ui, &preset.name, theme::body(), ink, right - left - beside.size().x - 8.0);
    let lower = one_line(ui, &preset.shows, theme::small(), quiet, right - left);
    let top = rect.center().y - 0.5 * (upper.size().y + lower.size().y);
    let middle = top + 0.5 * (upper.size().y - beside.size().y);
    ui.painter().galley(pos2(right - beside.size().x, middle), beside, quiet);
    let below = top + upper.size().y;
    ui.painter().galley(pos2(left, top), upper, ink);
    ui.painter().galley(pos2(left, below), lower, quiet);
    response.widget_info(|| WidgetInfo::selected(Role::ListItem, true, is_here, &preset.name));
    (response, star.on_hover_text("Favourite"))
}

/// A five-pointed star, filled if `is_full`.
fn paint_star(ui: &Ui, rect: Rect, is_full: bool, ink: egui::Color32) {
    let turn = std::f32::consts::TAU / 10.0;
    let point = |n: usize| {
        let radius = if n.is_multiple_of(2) { 7.0 } else { 3.0 };
        rect.center() + radius * egui::Vec2::angled(n as f32 * turn - 0.25 * std::f32::consts::TAU)
    };
    let outline: Vec<_> = (0..10).map(point).collect();
    if is_full {
        // From its middle: a star is not convex.
        for n in 0..10 {
            let part = vec![rect.center(), outline[n], outline[(n + 1) % 10]];
            ui.painter().add(Shape::convex_polygon(part, ink, Stroke::NONE));
        }
    }
    ui.painter().add(Shape::closed_line(outline, Stroke::new(1.2, ink)));
}
