//! The clarinet view: bore, tone holes and their covers to scale, the standing wave, and the picker of fingerings.
//! Both directions have the same scale. Bore, holes and chimneys come from the instrument's file. The file does not give
//! the thickness of the wood; it is drawn as deep as the holes. Finger holes and rings are on the upper edge and closed
//! keys on the lower edge, unlike on the real instrument. A click on a hole opens or closes it for a trial, which lasts
//! until *Back to the note*. A drag moves it, and a drag of a ring pulls the joint ([`AlterationEditor`]). In place of the
//! picker, a search lists the fingerings of a note.

mod fingering_panel;
mod fingering_rows;

use std::sync::Arc;

use egui::{
    Align2, Color32, CornerRadius, CursorIcon, Painter, Pos2, Rect, Response, Role, Sense, Shape, Stroke, Ui,
    Vec2, WidgetInfo, pos2, vec2,
};

use crate::editor::Action;
use crate::editor::alteration_editor::{AlterationEditor, Altered};
use crate::editor::chart;
use crate::editor::clarinet_drawing::{ClarinetDrawing, part_names, ruler, standing};
use crate::editor::hole_names::{fingers_title, hole_title, hole_words};
use crate::editor::multiphonic_choices;
use crate::editor::note_names::{NoteNames, note_name};
use crate::editor::snapshot::Snapshot;
use crate::editor::theme;
use crate::editor::theme::{Colours, GAP, panel};
use crate::editor::trial::Trial;
use chalumeau_core::bore::alternate_fingerings::{self, FingeringChoice};
use chalumeau_core::bore::instrument_file::{HoleKind, InstrumentFile, REGISTERS, ToneHole};
use fingering_panel::{Chosen, FingeringPanel};

/// Least distance of two buttons with their names in one row below, points. In two rows, half of it is enough.
const NAMED: f32 = 38.0;
/// Height of a line of these names, points.
const NAME_LINE: f32 = 13.0;
/// Least height of the picture in which two rows of names leave the clarinet its room, points.
const ROOM_FOR_TWO: f32 = 220.0;
/// Least height of the picture in which there is room for names, points.
const ROOM_FOR_NAMES: f32 = 180.0;
/// Least distance of the body and the buttons, in which lines lead from one to the other, points.
const LINES: f32 = 16.0;
/// Height of a name, points.
const NAME_ROW: f32 = 2.0 * NAME_LINE;

/// Name of a fingering that is not in the chart.
const OWN: &str = "your own fingering";

/// What the view remembers.
#[derive(Clone, Debug, Default)]
pub struct ClarinetView {
    /// The choices of the picker, and the instrument they belong to.
    known: Option<(Arc<InstrumentFile>, Arc<Vec<FingeringChoice>>)>,
    alterations: AlterationEditor,
    search: FingeringPanel,
}

impl ClarinetView {
    /// How the user alters the bore, in every view.
    pub fn alterations(&mut self) -> &mut AlterationEditor {
        &mut self.alterations
    }

    /// What is tried, for example "D4", or "your own fingering".
    pub fn tried_name(&mut self, names: NoteNames, snapshot: &Snapshot, trial: &Trial) -> Option<String> {
        let tried = trial.open()?;
        let all = self.choices(&snapshot.instrument);
        let choice = all.iter().find(|choice| choice.open == tried);
        let name = choice.map(|choice| choice_name(choice, names, snapshot.instrument.transposition));
        Some(name.unwrap_or_else(|| OWN.to_owned()))
    }

    /// Draws the view.
    pub fn draw(
        &mut self,
        ui: &mut Ui,
        names: NoteNames,
        snapshot: &Snapshot,
        trial: &mut Trial,
        actions: &mut Vec<Action>,
    ) {
        let c = Colours::here(ui);
        let height = ui.available_height();
        // A list is worth more room than buttons.
        let most = if self.search.is_open() { 320.0 } else { 184.0 };
        let picker = (0.36 * height).clamp(120.0, most);
        ui.spacing_mut().item_spacing.y = GAP;
        panel(c).show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.set_height((height - picker - GAP - 44.0).max(150.0));
            self.picture(ui, snapshot, trial, actions);
        });
        panel(c).show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.set_height(ui.available_height());
            if self.alterations.is_open() || !self.search.is_open() {
                self.picker(ui, names, snapshot, trial, actions);
                return;
            }
            match self.search.draw(ui, names, snapshot, trial.open(), actions) {
                Some(Chosen::Try(open)) => trial.set(open, actions),
                Some(Chosen::EndTry) => trial.end(actions),
                None => {}
            }
        });
    }

    fn picture(&mut self, ui: &mut Ui, snapshot: &Snapshot, trial: &mut Trial, actions: &mut Vec<Action>) {
        let c = Colours::here(ui);
        let file = &*AlterationEditor::shown(snapshot);
        let area = ui.available_rect_before_wrap();
        ui.allocate_rect(area, Sense::hover());
        let painter = ui.painter_at(area.expand(2.0));
        let rows = name_rows(area.width() / file.holes.len().max(1) as f32, area.height());
        let buttons = hole_buttons(area, file.holes.len(), 4.0 + rows as f32 * NAME_ROW);
        let mut body = ClarinetDrawing::new(file, area);
        let room = buttons.first().map_or(area.bottom(), |button| button.top() - LINES);
        if body.bottom() > room {
            body = body.moved(Rect::from_min_max(area.min, pos2(area.right(), room)));
        }
        let wave = wave_rect(area, &body);
        ruler(&painter, c, area, body.scale);
        painter.text(
            area.left_top(),
            Align2::LEFT_TOP,
            "sound pressure along the bore",
            theme::small(),
            c.quiet,
        );
        standing(&painter, c, &body, wave, &snapshot.standing);
        part_names(&painter, c, &body, wave.bottom() + 1.0);
        body.paint(&painter, c, &snapshot.standing);
        self.joints(ui, &body, snapshot, actions);
        for (hole, tone_hole) in file.holes.iter().enumerate() {
            let opening = match trial.open() {
                Some(tried) => f32::from(tried.get(hole).copied().unwrap_or(false)),
                None => chart::share(snapshot.openings.get(hole).copied().unwrap_or(0.0)),
            };
            let at = body.hole(tone_hole);
            let names_below = (rows > 0).then(|| (hole % rows) as f32 * NAME_ROW);
            let response = button(ui, buttons[hole], tone_hole, opening, names_below);
            let on_bore = ui.interact(
                at.rect.expand2(vec2(2.0, 6.0)),
                response.id.with("bore"),
                Sense::CLICK | Sense::DRAG,
            );
            let is_hot = response.hovered()
                || on_bore.hovered()
                || response.has_focus()
                || self.alterations.has_chosen(&Altered::Hole(hole));
            on_bore.widget_info(|| {
                WidgetInfo::labeled(
                    Role::Image,
                    true,
                    format!("Hole {} in the bore", hole_title(&tone_hole.name)),
                )
            });
            self.alterations.follow(&on_bore, Altered::Hole(hole), body.scale, snapshot, actions);
            leader(&painter, c, at.foot, buttons[hole], is_hot, opening);
            body.paint_hole(&painter, c, tone_hole, opening, is_hot);
            if response.clicked() || on_bore.clicked() {
                trial.toggle(hole, snapshot, actions);
            }
            for response in [response, on_bore.on_hover_cursor(CursorIcon::PointingHand)] {
                response.on_hover_ui(|ui| about(ui, tone_hole, opening));
            }
        }
        if self.alterations.is_open() {
            // Between the words of the picture and its ruler.
            let right = area.right() - 0.24 * area.width();
            let place = Rect::from_min_max(area.min + vec2(190.0, 0.0), pos2(right, area.bottom()));
            AlterationEditor::saved(ui, place, snapshot, actions);
        }
    }

    /// The rings, to be dragged.
    fn joints(
        &mut self,
        ui: &mut Ui,
        body: &ClarinetDrawing<'_>,
        snapshot: &Snapshot,
        actions: &mut Vec<Action>,
    ) {
        let c = Colours::here(ui);
        for part in body.file.jointed_parts() {
            let Some(place) = body.joint(part) else { continue };
            let it = Altered::Joint(part.to_owned());
            let id = ui.scope_id().with(("joint", part));
            let response = ui.interact(place.expand2(vec2(3.0, 2.0)), id, Sense::DRAG);
            if response.hovered() || response.dragged() || self.alterations.has_chosen(&it) {
                let stroke = Stroke::new(2.0, c.accent);
                ui.painter().rect_stroke(place, CornerRadius::same(1), stroke, egui::StrokeKind::Outside);
            }
            response
                .widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("Joint below the {part}")));
            self.alterations.follow(&response, it, body.scale, snapshot, actions);
            response.on_hover_cursor(CursorIcon::ResizeHorizontal).on_hover_ui(|ui| {
                ui.set_max_width(260.0);
                ui.strong(format!("Joint below the {part}"));
                ui.label("Drag it to make the part longer or shorter, and hear it");
            });
        }
    }

    fn picker(
        &mut self,
        ui: &mut Ui,
        names: NoteNames,
        snapshot: &Snapshot,
        trial: &mut Trial,
        actions: &mut Vec<Action>,
    ) {
        let c = Colours::here(ui);
        let all = self.choices(&snapshot.instrument);
        let shown = match trial.open() {
            Some(tried) => all.iter().position(|choice| choice.open == tried),
            None => snapshot
                .fingering()
                .and_then(|fingering| all.iter().position(|choice| choice.open == fingering.open)),
        };
        let name = |choice: &FingeringChoice| choice_name(choice, names, snapshot.instrument.transposition);
        if self.alterations.is_open() {
            self.alterations.line(ui, snapshot, actions);
        } else {
            let told = match shown.map(|index| &all[index]) {
                Some(choice) if choice.register == multiphonic_choices::REGISTER => {
                    multiphonic_choices::about(choice, names, snapshot.instrument.transposition)
                }
                Some(choice) => {
                    let fingers = fingers_title(&choice.fingers);
                    let of_note = all.iter().filter(|other| other.written == choice.written).count();
                    let more = match (of_note, choice.nth) {
                        (1, _) => String::new(),
                        (_, 0) => format!(", one of {of_note} fingerings"),
                        _ => ", alternate fingering".into(),
                    };
                    format!("{} {}{more}: {fingers}", name(choice), choice.register)
                }
                None => OWN.to_owned(),
            };
            self.fingering_line(ui, told, snapshot, trial, actions);
        }
        egui::ScrollArea::vertical().id_salt("picker").auto_shrink([false, false]).show(ui, |ui| {
            // Four registers in the least window, and multiphonics below them where there is more room.
            let line = ((ui.available_height() - 8.0) / 5.0 - 3.0).clamp(19.0, 24.0);
            ui.spacing_mut().item_spacing = vec2(3.0, 3.0);
            ui.spacing_mut().interact_size.y = line;
            // The longest register on one line.
            let registers = || REGISTERS.into_iter().chain([multiphonic_choices::REGISTER]);
            let of = |register: &str| all.iter().filter(|choice| choice.register == register).count();
            let longest = registers().map(of).max().unwrap_or(1).max(1);
            let width = (ui.available_width() - 76.0) / longest as f32 - 3.0;
            for register in registers().filter(|register| of(register) > 0) {
                ui.horizontal_wrapped(|ui| {
                    let (rect, _) = ui.allocate_exact_size(vec2(66.0, line), Sense::hover());
                    let at = rect.left_center();
                    ui.painter().text(at, Align2::LEFT_CENTER, register, theme::small(), c.quiet);
                    let of_register =
                        all.iter().enumerate().filter(|(_, choice)| choice.register == register);
                    for (index, choice) in of_register {
                        let (name, is_here) = (name(choice), shown == Some(index));
                        let size = vec2(width.clamp(26.0, 46.0), line);
                        // Of a multiphonic it is the number.
                        let is_alternate = choice.nth > 0 && register != multiphonic_choices::REGISTER;
                        let response = chip(ui, c, &name, size, is_here, is_alternate);
                        response.widget_info(|| {
                            let label = format!("Fingering {name}");
                            WidgetInfo::selected(Role::RadioButton, true, is_here, label)
                        });
                        let alternate = if choice.nth > 0 { " (alternate, not tuned)" } else { "" };
                        let told = if register == multiphonic_choices::REGISTER {
                            multiphonic_choices::about(choice, names, snapshot.instrument.transposition)
                        } else {
                            format!("{name}{alternate}: {}", fingers_title(&choice.fingers))
                        };
                        if response.on_hover_text(told).clicked() {
                            trial.set(choice.open.clone(), actions);
                        }
                    }
                });
            }
        });
    }

    /// What is fingered, and the ways to something else.
    fn fingering_line(
        &mut self,
        ui: &mut Ui,
        told: String,
        snapshot: &Snapshot,
        trial: &mut Trial,
        actions: &mut Vec<Action>,
    ) {
        let c = Colours::here(ui);
        ui.horizontal(|ui| {
            ui.set_height(22.0);
            if trial.is_on() {
                if ui
                    .button("Back to the note")
                    .on_hover_text("Ends the trial; the played note sets the holes again")
                    .clicked()
                {
                    trial.end(actions);
                }
                ui.colored_label(c.beats, "trying");
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let words = match snapshot.alterations.count() {
                    0 => "Alter the bore".to_owned(),
                    1 => "1 alteration".to_owned(),
                    count => format!("{count} alterations"),
                };
                let about = "Move a hole, make it wider or narrower, or pull a joint, and hear it";
                if ui.button(words).on_hover_text(about).clicked() {
                    self.alterations.open();
                }
                let about =
                    "Look through every fingering that fingers and keys can make, for a note or a trill";
                if ui.button("Find fingerings").on_hover_text(about).clicked() {
                    self.search.open(snapshot, actions);
                }
                ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                    ui.add(egui::Label::new(told).truncate());
                });
            });
        });
    }

    /// The choices of the picker; calculated once for each instrument.
    fn choices(&mut self, file: &Arc<InstrumentFile>) -> Arc<Vec<FingeringChoice>> {
        match &self.known {
            Some((of, choices)) if Arc::ptr_eq(of, file) || of == file => choices.clone(),
            _ => {
                let mut choices = alternate_fingerings::fingering_choices(file);
                choices.extend(multiphonic_choices::choices(file));
                let choices = Arc::new(choices);
                self.known = Some((file.clone(), choices.clone()));
                choices
            }
        }
    }
}

/// Name of a fingering: that of its note with a prime for each fingering before it, or the number of a multiphonic.
fn choice_name(choice: &FingeringChoice, names: NoteNames, transposition: i8) -> String {
    if choice.register == multiphonic_choices::REGISTER {
        return format!("M{}", choice.nth + 1);
    }
    let note = names.of_written(choice.written, transposition);
    format!("{}{}", note.map_or_else(String::new, note_name), "'".repeat(choice.nth))
}

/// Place of the wave above the body.
fn wave_rect(area: Rect, body: &ClarinetDrawing<'_>) -> Rect {
    Rect::from_min_max(area.left_top() + vec2(0.0, 14.0), pos2(area.right(), body.top() - 14.0))
}

/// Rows of names below buttons at this distance, in a picture of this height.
fn name_rows(width: f32, height: f32) -> usize {
    if height < ROOM_FOR_NAMES {
        0
    } else if width >= NAMED {
        1
    } else if 2.0 * width >= NAMED && height >= ROOM_FOR_TWO {
        2
    } else {
        0
    }
}

/// Places of the buttons along the lower edge, over `room` for their names, in the order of the file.
fn hole_buttons(area: Rect, holes: usize, room: f32) -> Vec<Rect> {
    let width = area.width() / holes.max(1) as f32;
    let size = width.min(24.0) - 3.0;
    (0..holes)
        .map(|hole| {
            let x = area.left() + (hole as f32 + 0.5) * width;
            Rect::from_center_size(pos2(x, area.bottom() - room - 0.5 * size), vec2(size, size))
        })
        .collect()
}

/// A hole as fingering charts draw it: filled means covered.
fn button(ui: &mut Ui, rect: Rect, hole: &ToneHole, opening: f32, names_below: Option<f32>) -> Response {
    let c = Colours::here(ui);
    let response = ui.interact(rect, ui.scope_id().with(("hole", &hole.name)), Sense::click());
    let painter = ui.painter();
    let ink = if response.hovered() { c.accent } else { c.ink };
    let radius = 0.5 * rect.width();
    let draw = |shrink: f32, fill: Color32| match hole.kind {
        HoleKind::Finger | HoleKind::PadOpen => {
            painter.circle(rect.center(), radius - shrink, fill, Stroke::new(1.5, ink));
        }
        HoleKind::KeyClosed => {
            let key = rect.shrink2(vec2(2.0 + shrink, shrink));
            painter.rect(key, CornerRadius::same(5), fill, Stroke::new(1.5, ink), egui::StrokeKind::Inside);
        }
    };
    let covered = 1.0 - opening.clamp(0.0, 1.0);
    draw(0.0, c.panel.lerp_to_gamma(ink, covered));
    if hole.kind == HoleKind::PadOpen {
        painter.circle_stroke(
            rect.center(),
            radius - 3.5,
            Stroke::new(1.0, c.panel.lerp_to_gamma(ink, 1.0 - covered)),
        );
    }
    if response.has_focus() {
        painter.circle_stroke(rect.center(), radius + 3.0, Stroke::new(1.5, c.accent));
    }
    if let Some(distance) = names_below {
        let mut below = rect.center_bottom() + vec2(0.0, 2.0 + distance);
        let words = hole_words(&hole.name);
        // On two lines: "Low C#", "pad".
        let (first, last) = words.split_at(words.len().div_ceil(2));
        for line in [first, last] {
            painter.text(below, Align2::CENTER_TOP, line.join(" "), theme::small(), c.quiet);
            below.y += NAME_LINE;
        }
    }
    let title = hole_title(&hole.name);
    let state = if opening >= 0.5 { "open" } else { "closed" };
    response
        .widget_info(|| WidgetInfo::selected(Role::Switch, true, opening >= 0.5, format!("Hole {title}")));
    response.on_hover_cursor(CursorIcon::PointingHand).accessible_name(format!("Hole {title}, {state}"))
}

/// A small button of the picker.
fn chip(ui: &mut Ui, c: &Colours, name: &str, size: Vec2, is_here: bool, is_alternate: bool) -> Response {
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let fill = match (is_here, response.hovered()) {
        (true, _) => c.accent,
        (false, true) => c.hovered,
        (false, false) => c.raised,
    };
    let round = CornerRadius::same(theme::SMALL_RADIUS);
    ui.painter().rect_filled(rect, round, fill);
    if response.has_focus() {
        ui.painter().rect_stroke(rect, round, Stroke::new(1.5, c.ink), egui::StrokeKind::Inside);
    }
    let ink = match (is_here, is_alternate) {
        (true, _) => c.on_accent,
        (false, true) => c.quiet,
        (false, false) => c.ink,
    };
    ui.painter().text(rect.center(), Align2::CENTER_CENTER, name, theme::small(), ink);
    response
}

/// The tool tip of a hole.
pub(super) fn about(ui: &mut Ui, hole: &ToneHole, opening: f32) {
    let c = Colours::here(ui);
    ui.set_max_width(260.0);
    ui.strong(hole_title(&hole.name));
    ui.label(&hole.description);
    let state = if opening >= 0.99 {
        "open".into()
    } else if opening <= 0.01 {
        "closed".into()
    } else {
        format!("{:.0} % open", 100.0 * opening)
    };
    ui.label(format!(
        "{:.1} mm wide, {:.1} mm deep, {:.1} mm from the reed; {state}",
        2e3 * hole.radius_m,
        1e3 * hole.chimney_m,
        1e3 * hole.x_m
    ));
    let how = "Click to open or close this hole; drag it to move it, with Shift up to make it wider";
    ui.label(egui::RichText::new(how).font(theme::small()).color(c.quiet));
}

fn leader(painter: &Painter, c: &Colours, foot: Pos2, button: Rect, is_hot: bool, opening: f32) {
    let knee = pos2(button.center().x, button.top() - 8.0);
    let colour = if is_hot { c.accent } else { c.line.lerp_to_gamma(c.speaks, 0.6 * opening) };
    painter.add(Shape::line(
        vec![foot, knee, button.center_top()],
        Stroke::new(if is_hot { 1.5 } else { 1.0 }, colour),
    ));
}
