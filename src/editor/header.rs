//! The two lines on top: note, pitch and tools; tabs and status.

use std::path::Path;

use egui::{
    Align, Align2, CornerRadius, FontId, Layout, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2,
};

use crate::editor::ab_comparison::AbComparison;
use crate::editor::ab_comparison::ComparisonSide;
use crate::editor::controls::Hands;
use crate::editor::controls::{momentary, segments};
use crate::editor::lamps;
use crate::editor::note_names::{NoteNames, note_name};
use crate::editor::pitch_needle;
use crate::editor::pitch_needle::{NO_PITCH, NO_SOUND};
use crate::editor::preset_bar;
use crate::editor::preset_browser::PresetBrowser;
use crate::editor::snapshot::{Severity, Snapshot, Status};
use crate::editor::theme;
use crate::editor::theme::Colours;
use crate::editor::undo::{DeviceChoice, Restored, Step};
use crate::editor::window_state::{ZOOMS, has_room};
use crate::editor::{Action, Tab, WindowState};

/// The upper line.
pub fn tools(
    ui: &mut Ui,
    kept: &mut WindowState,
    compare: &mut AbComparison,
    presets: &mut PresetBrowser,
    hands: &mut Hands,
    snapshot: &Snapshot,
    actions: &mut Vec<Action>,
) {
    let is_wide = ui.available_width() > 900.0;
    ui.horizontal_centered(|ui| {
        // The pitch would tell one setting from another.
        note(ui, kept, snapshot, !compare.is_blind());
        // Where there is little room, the measured pitch beside the note says the same.
        if is_wide && !compare.is_blind() {
            pitch_needle::needle(ui, snapshot, 150.0);
        }
        ui.spacing_mut().item_spacing.x = 5.0;
        ui.spacing_mut().button_padding.x = if is_wide { 8.0 } else { 6.0 };
        let is_blind = compare.is_blind();
        with_tools_at_right(
            ui,
            (hands, actions),
            |ui, (hands, actions)| {
                if !is_blind {
                    preset_bar::bar(ui, presets, hands, snapshot, actions);
                }
            },
            |ui, (hands, actions)| {
                // Undo would tell what was set, and on which side.
                if !is_blind {
                    undo(ui, hands, snapshot, actions);
                }
                ui.add_space(4.0);
                sides(ui, compare, hands, snapshot, actions, is_wide);
                ui.add_space(4.0);
                let word = if kept.is_dark { "Light theme" } else { "Dark theme" };
                if icon(ui, Icon::Theme, word).on_hover_text(word).clicked() {
                    kept.is_dark = !kept.is_dark;
                }
                zoom(ui, kept, snapshot.room);
                momentary(ui, hands, "panic", "Panic");
            },
        );
    });
}

/// Tools that end at the right, and what fills the room left of them. Both are laid out from left to right, because the Tab key
/// goes from widget to widget in the order in which they were added. `with` is lent to one after the other.
fn with_tools_at_right<A>(
    ui: &mut Ui,
    mut with: A,
    rest: impl FnOnce(&mut Ui, &mut A),
    tools: impl FnOnce(&mut Ui, &mut A),
) {
    let id = ui.scope_id().with("width of the tools");
    let known = ui.data(|data| data.get_temp::<f32>(id));
    let all = ui.available_rect_before_wrap();
    let left = (all.right() - known.unwrap_or(0.0)).max(all.left());
    let gap = ui.spacing().item_spacing.x;
    let inside = |from: f32, to: f32| {
        let place = Rect::from_x_y_ranges(from..=to.max(from), all.y_range());
        egui::UiBuilder::new().max_rect(place).layout(Layout::left_to_right(Align::Center))
    };
    ui.scope_builder(inside(all.left(), left - gap), |ui| rest(ui, &mut with));
    let used = ui.scope_builder(inside(left, all.right()), |ui| {
        tools(ui, &mut with);
        ui.min_rect().width()
    });
    // The width is known once they are laid out: the first time, and when a text has changed, they are laid out again.
    if known.is_none_or(|known| (known - used.inner).abs() > 0.5) {
        ui.data_mut(|data| data.insert_temp(id, used.inner));
        ui.ctx().request_discard("the width of the tools was not known");
    }
}

/// A ring around a button with the focus, which is seen on a selected one too.
fn focus_ring(ui: &Ui, response: &egui::Response) {
    if response.has_focus() {
        let round = CornerRadius::same(theme::SMALL_RADIUS + 1);
        let stroke = Stroke::new(2.0, Colours::here(ui).ink);
        ui.painter().rect_stroke(response.rect.expand(2.0), round, stroke, egui::StrokeKind::Inside);
    }
}

fn named(response: egui::Response, name: &str) -> egui::Response {
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, name));
    response
}

#[derive(Clone, Copy, PartialEq)]
enum Icon {
    Undo,
    Redo,
    Theme,
}

/// A button with a drawn symbol, because no symbol is in all fonts.
fn icon(ui: &mut Ui, icon: Icon, name: &str) -> egui::Response {
    let (rect, response) = ui.allocate_exact_size(vec2(28.0, 24.0), Sense::click());
    let visuals = *ui.style().interact(&response);
    let ink =
        if ui.is_enabled() { visuals.fg_stroke.color } else { Colours::here(ui).quiet.gamma_multiply(0.6) };
    let painter = ui.painter();
    painter.rect(
        rect,
        visuals.corner_radius,
        visuals.weak_bg_fill,
        visuals.bg_stroke,
        egui::StrokeKind::Inside,
    );
    let centre = rect.center();
    let stroke = Stroke::new(1.6, ink);
    let arc = |from: f32, to: f32, radius: f32| -> Vec<egui::Pos2> {
        (0..=16).map(|n| centre + radius * egui::Vec2::angled(from + (to - from) * n as f32 / 16.0)).collect()
    };
    if icon == Icon::Theme {
        painter.circle_stroke(centre, 6.5, stroke);
        let half = arc(-std::f32::consts::FRAC_PI_2, std::f32::consts::FRAC_PI_2, 6.5);
        painter.add(egui::Shape::convex_polygon(half, ink, Stroke::NONE));
    } else {
        // Three quarters of a turn, with the arrow at its upper end.
        let side = if icon == Icon::Undo { -1.0 } else { 1.0 };
        let mirrored = |point: egui::Pos2| pos2(centre.x + side * (point.x - centre.x), point.y);
        let turn = arc(-0.35, -4.6, 6.0).into_iter().map(mirrored).collect();
        painter.add(egui::Shape::line(turn, stroke));
        let tip = mirrored(centre + vec2(6.6, 2.2));
        let head = vec![tip, mirrored(centre + vec2(9.2, -3.2)), mirrored(centre + vec2(2.6, -2.4))];
        painter.add(egui::Shape::convex_polygon(head, ink, Stroke::NONE));
    }
    named(response, name)
}

/// The note by its name in large, its other name, and the measured pitch. A click exchanges the names, in all views.
fn note(ui: &mut Ui, kept: &mut WindowState, snapshot: &Snapshot, has_pitch: bool) {
    let c = Colours::here(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(150.0, ui.available_height()), Sense::click());
    let transposition = snapshot.instrument.transposition;
    // The fingering in place before the first note is nobody's note.
    let has_played = ui.data_mut(|data| {
        let (of, has_played) = data.get_temp_mut_or_default::<(String, bool)>(response.id);
        if *of != snapshot.instrument_key {
            (*of, *has_played) = (snapshot.instrument_key.clone(), false);
        }
        *has_played |= snapshot.sounding.is_some();
        *has_played
    });
    let note = snapshot.written().filter(|_| has_played);
    let named = |names: NoteNames| note.and_then(|note| names.of_written(note, transposition));
    let painter = ui.painter();
    let ink = if snapshot.sounding.is_some() { c.ink } else { c.quiet };
    let big = named(kept.names).map_or_else(|| "\u{2013}".into(), note_name);
    painter.text(
        pos2(rect.left(), rect.center().y),
        Align2::LEFT_CENTER,
        &big,
        FontId::proportional(30.0),
        ink,
    );
    let x = rect.left() + 62.0;
    let verb = match kept.names {
        NoteNames::Written => "sounds",
        NoteNames::Sounding => "written",
    };
    let other =
        named(kept.names.other()).map_or_else(String::new, |note| format!("{verb} {}", note_name(note)));
    let ink = if response.hovered() { c.ink } else { c.quiet };
    painter.text(pos2(x, rect.center().y - 1.0), Align2::LEFT_BOTTOM, &other, theme::small(), ink);
    let pitch = snapshot.heard.f0_hz.map_or_else(|| NO_PITCH.to_owned(), |hz| format!("{hz:.1} Hz"));
    let pitch = if has_pitch && has_played { pitch } else { String::new() };
    painter.text(pos2(x, rect.center().y + 1.0), Align2::LEFT_TOP, &pitch, theme::small(), c.quiet);
    let said = match has_played {
        true => {
            let pitch = if pitch == NO_PITCH { NO_SOUND } else { &pitch };
            format!("{} {big}, {other}, {pitch}", kept.names.title())
        }
        false => format!("{}, no note yet", kept.names.title()),
    };
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &said));
    focus_ring(ui, &response);
    if response.clicked() {
        kept.names = kept.names.other();
    }
    let about = match kept.names {
        NoteNames::Written => {
            "The written note, the note that this instrument sounds, and the measured pitch. Click to name notes by sounding pitch everywhere."
        }
        NoteNames::Sounding => {
            "The sounding note, the note as it is written, and the measured pitch. Click to name notes as they are written everywhere."
        }
    };
    response.on_hover_text(about);
}

/// Takes the last step back.
pub fn undo_step(hands: &mut Hands, snapshot: &Snapshot, actions: &mut Vec<Action>) {
    let restored = hands.history.undo(snapshot.altered_key(), &snapshot.alterations);
    restore(restored, hands, snapshot, actions);
}

/// Does the last step that was taken back again.
pub fn redo_step(hands: &mut Hands, snapshot: &Snapshot, actions: &mut Vec<Action>) {
    let restored = hands.history.redo(snapshot.altered_key(), &snapshot.alterations);
    restore(restored, hands, snapshot, actions);
}

fn restore(restored: Restored, hands: &mut Hands, snapshot: &Snapshot, actions: &mut Vec<Action>) {
    let Restored { values, file, .. } = &restored;
    let (choices, others): (Vec<_>, Vec<_>) =
        values.iter().partition(|(id, _)| *id == "instr" && file.is_some());
    hands.restore(&others);
    if let Some(file) = file {
        // First the file, then the choice of it, so that no other one is read.
        actions.push(Action::NameInstrumentFile(file.clone()));
        let last = snapshot.instruments.len().saturating_sub(1) as f32;
        actions.extend(
            choices.iter().map(|(_, value)| Action::ChooseInstrument((value * last).round() as usize)),
        );
    }
    actions.extend(restored.preset.map(Action::ChosePreset));
    actions.extend(restored.alterations.map(Action::Alter));
    if let (Some([left, wanted]), Some(links)) = (&restored.links, hands.controls.links())
        && links.to_text() == *left
    {
        links.restore(wanted);
    }
}

/// What a step did, for the tip of the arrows.
fn step_name(hands: &Hands, step: &Step) -> String {
    match step {
        Step { moved: Some(moved), .. } => format!("the alteration of {}", moved.titles().join(", ")),
        Step { copied_from: Some(side), .. } => format!("the copy of {}", side.name()),
        Step { file: Some([_, path]), .. } => {
            let name = Path::new(path).file_name().map_or_else(|| path.into(), |name| name.to_string_lossy());
            format!("the choice of {name}")
        }
        Step { device: Some(DeviceChoice { name, .. }), .. } => format!("the choice of {name}"),
        Step { preset: Some([_, chosen]), .. } => format!("the choice of {chosen}"),
        Step { changes, .. } => {
            changes.iter().map(|change| hands.name(change.id)).collect::<Vec<_>>().join(", ")
        }
    }
}

fn undo(ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot, actions: &mut Vec<Action>) {
    let key = snapshot.altered_key();
    let name = |step: Option<&Step>| step.map(|step| step_name(hands, step));
    let steps = [name(hands.history.undoable(key)), name(hands.history.redoable(key))];
    let go: [fn(&mut Hands, &Snapshot, &mut Vec<Action>); 2] = [undo_step, redo_step];
    let arrows = [(Icon::Undo, "Undo"), (Icon::Redo, "Redo")];
    for (((symbol, word), step), go) in arrows.into_iter().zip(steps).zip(go) {
        ui.add_enabled_ui(step.is_some(), |ui| {
            let response = icon(ui, symbol, word)
                .on_hover_text(format!("{word} {}", step.unwrap_or_default()))
                .on_disabled_hover_text(format!("{word}: settings, presets, moved holes and joints"));
            if response.clicked() {
                go(hands, snapshot, actions);
            }
        });
    }
}

fn sides(
    ui: &mut Ui,
    compare: &mut AbComparison,
    hands: &mut Hands,
    snapshot: &Snapshot,
    actions: &mut Vec<Action>,
    is_wide: bool,
) {
    if compare.is_blind() {
        let c = Colours::here(ui);
        ui.label(egui::RichText::new("blind").color(c.beats));
        return;
    }
    let now = hands.setting();
    let why_not = if !compare.differs(&now) {
        Some("Make A and B different first, then compare them blind")
    } else if compare.differs_in_instrument(&now) {
        Some("A and B are different instruments: the keys would tell which is which")
    } else {
        None
    };
    for side in [ComparisonSide::A, ComparisonSide::B] {
        let (name, is_here) = (side.name(), compare.side == side);
        let button = egui::Button::selectable(is_here, format!(" {name} ")).frame_when_inactive(true);
        let response = ui.add(button);
        focus_ring(ui, &response);
        response.widget_info(|| {
            WidgetInfo::selected(Role::RadioButton, true, is_here, format!("Setting {name}"))
        });
        if response.on_hover_text(format!("Setting {name}: change it, and switch between A and B")).clicked()
        {
            compare.switch(side, hands, &snapshot.preset, actions);
        }
    }
    let (text, other) = match compare.side {
        ComparisonSide::A if is_wide => ("A to B", "B"),
        ComparisonSide::B if is_wide => ("B to A", "A"),
        ComparisonSide::A => ("to B", "B"),
        ComparisonSide::B => ("to A", "A"),
    };
    let copy = named(ui.button(text), &format!("Copy to {other}"));
    if copy.on_hover_text(format!("Copies the settings you hear now to {other}")).clicked() {
        compare.copy(hands, &snapshot.preset);
    }
    let blind = ui.add_enabled(why_not.is_none(), egui::Button::new("Blind"));
    let blind = blind
        .on_hover_text("Compare without knowing which is which: A and B appear as X and Y in random order");
    if blind.on_disabled_hover_text(why_not.unwrap_or_default()).clicked() {
        compare.hide();
        compare.switch(compare.behind(true), hands, &snapshot.preset, actions);
    }
}

fn zoom(ui: &mut Ui, kept: &mut WindowState, room: Option<(f32, f32)>) {
    let text = format!("{:.0} %", 100.0 * kept.zoom);
    // High enough for all of them.
    let list = egui::ComboBox::from_id_salt("zoom").width(64.0).height(300.0).selected_text(&text);
    let shown = list.show_ui(ui, |ui| {
        let now = kept.zoom;
        for zoom in ZOOMS.into_iter().filter(|&zoom| has_room(zoom, room) || zoom == now) {
            ui.selectable_value(&mut kept.zoom, zoom, format!("{:.0} %", 100.0 * zoom));
        }
    });
    shown.response.widget_info(|| {
        let mut info = WidgetInfo::labeled(Role::ComboBox, true, "Zoom");
        info.current_text_value = Some(text.clone());
        info
    });
    shown.response.on_hover_text(
        "Size of everything in this window, as large as the screen has room for; saved with the project",
    );
}

/// The lower line. Whether a tab was clicked.
pub fn tabs(
    ui: &mut Ui,
    kept: &mut WindowState,
    has_knob: bool,
    is_blind: bool,
    is_trying: bool,
    snapshot: &Snapshot,
) -> bool {
    let mut is_clicked = false;
    let is_wide = ui.available_width() > 900.0;
    ui.horizontal_centered(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        // A blind comparison stands in place of every view.
        ui.add_enabled_ui(!is_blind, |ui| {
            ui.spacing_mut().item_spacing.x = 2.0;
            let offered = Tab::ALL.map(|tab| kept.offers(tab, has_knob).then_some(tab));
            for tab in offered.into_iter().flatten() {
                if tab_button(ui, tab, kept.tab == tab, is_wide).clicked() {
                    kept.tab = tab;
                    is_clicked = true;
                }
            }
        });
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            laboratory(ui, kept, has_knob);
            ui.add_space(8.0);
            lamps::draw(ui, snapshot, is_wide, is_blind);
            ui.add_space(8.0);
            let trying =
                Status { level: Severity::Note, text: "trying a fingering: its holes sound".to_owned() };
            let (first, others): (Vec<_>, Vec<_>) =
                snapshot.status.iter().cloned().partition(|status| status.level == Severity::Warn);
            status(ui, first.into_iter().chain(is_trying.then_some(trying)).chain(others).collect());
        });
    });
    is_clicked
}

fn tab_button(ui: &mut Ui, tab: Tab, is_here: bool, is_wide: bool) -> egui::Response {
    let c = Colours::here(ui);
    let galley = ui.painter().layout_no_wrap(tab.name().to_owned(), theme::body(), c.ink);
    let size = vec2(galley.size().x + if is_wide { 26.0 } else { 16.0 }, ui.available_height());
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let ink = if is_here || response.hovered() { c.ink } else { c.quiet };
    ui.painter().text(rect.center(), Align2::CENTER_CENTER, tab.name(), theme::body(), ink);
    if is_here {
        let under = Rect::from_min_max(
            pos2(rect.left() + 6.0, rect.bottom() - 3.0),
            rect.right_bottom() - vec2(6.0, 0.0),
        );
        ui.painter().rect_filled(under, CornerRadius::same(1), c.accent);
    }
    if response.has_focus() {
        let round = CornerRadius::same(theme::SMALL_RADIUS);
        ui.painter().rect_stroke(
            rect.shrink(2.0),
            round,
            Stroke::new(1.0, c.accent),
            egui::StrokeKind::Inside,
        );
    }
    let is_enabled = ui.is_enabled();
    response.widget_info(|| WidgetInfo::selected(Role::Tab, is_enabled, is_here, tab.name()));
    response.on_hover_text(tab.about())
}

/// Musician or laboratory.
fn laboratory(ui: &mut Ui, kept: &mut WindowState, has_knob: bool) {
    let mut chosen = usize::from(kept.is_lab);
    let texts = ["Musician", "Lab"].map(str::to_owned);
    let (place, _) = ui.allocate_exact_size(vec2(132.0, 24.0), Sense::hover());
    let mut inside =
        ui.new_child(egui::UiBuilder::new().max_rect(place).layout(Layout::left_to_right(Align::Center)));
    let response = segments(&mut inside, "Views", &texts, &mut chosen);
    response.on_hover_text("Musician: what music needs. Lab: also the reed's law, torque and studies.");
    let is_lab = chosen == 1;
    if is_lab {
        kept.is_lab = true;
    } else if kept.is_lab {
        kept.leave_lab(has_knob);
    }
}

/// The first of these; all in its tip.
fn status(ui: &mut Ui, all: Vec<Status>) {
    let c = Colours::here(ui);
    let colour = |level| match level {
        Severity::Good => c.speaks,
        Severity::Note => c.breath,
        Severity::Warn => c.danger,
    };
    let Some(Status { level, text }) = all.first().cloned() else { return };
    let width = ui.available_width() - 20.0;
    let label = egui::Label::new(egui::RichText::new(&text).font(theme::small()).color(c.quiet)).truncate();
    // Its own tip below has all lines.
    let label = label.show_tooltip_when_elided(false);
    let galley = ui.painter().layout_no_wrap(text.clone(), theme::small(), c.quiet);
    let response = ui.add_sized(vec2(width.min(galley.size().x + 4.0), 16.0), label);
    let (dot, _) = ui.allocate_exact_size(vec2(10.0, 10.0), Sense::hover());
    ui.painter().circle_filled(dot.center(), 3.5, colour(level));
    response.on_hover_ui(|ui| {
        ui.label(&text);
        for status in all.iter().filter(|status| status.text != text) {
            ui.label(egui::RichText::new(&status.text).color(colour(status.level)));
        }
    });
}
