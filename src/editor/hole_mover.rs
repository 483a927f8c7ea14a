//! Moving tone holes: the user drags a hole along the bore, or gives its place and width in millimetres, and hears it at
//! once. The instrument keeps the tuning that it had, so that a moved hole can be heard.

use std::sync::Arc;

use egui::{Align, DragValue, Layout, Response, RichText, Ui};

use crate::editor::Action;
use crate::editor::snapshot::Snapshot;
use crate::editor::theme;
use crate::editor::theme::Colours;
use chalumeau_core::bore::instrument_file::{InstrumentFile, ToneHole};
use chalumeau_core::bore::moved_hole::MovedHole;

/// Steps that can be undone.
const KEPT: usize = 100;
/// Width of the line below which units lose their words, points.
const NARROW: f32 = 640.0;
/// How much wider a hole becomes where the pointer goes up by one point with Shift held, m of the radius.
const WIDER_M: f32 = 0.05e-3;

/// What the view remembers of it.
#[derive(Clone, Debug, Default)]
pub struct HoleMover {
    is_open: bool,
    /// The hole whose numbers are shown.
    chosen: Option<usize>,
    /// The hole as the drag found it.
    held: Option<MovedHole>,
    /// The moved holes before each change, and the instrument they belong to.
    undo: Vec<Vec<MovedHole>>,
    of: String,
}

impl HoleMover {
    /// Whether its line is shown.
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// Whether a hole is chosen for its numbers.
    pub fn has_chosen(&self, hole: usize) -> bool {
        self.is_open && self.chosen == Some(hole)
    }

    /// Shows its line.
    pub fn open(&mut self) {
        self.is_open = true;
    }

    /// The instrument with its holes where the user has them now. The sound follows a little later.
    pub fn shown(snapshot: &Snapshot) -> Arc<InstrumentFile> {
        if snapshot.moved.is_empty() {
            return snapshot.instrument.clone();
        }
        let moved = snapshot.as_built.with_holes_moved(&snapshot.moved);
        Arc::new(moved.scaled(scale(snapshot)))
    }

    /// Follows a drag of a hole. `points_a_metre` is the scale of the drawing.
    pub fn follow(
        &mut self,
        response: &Response,
        hole: usize,
        points_a_metre: f32,
        snapshot: &Snapshot,
        actions: &mut Vec<Action>,
    ) {
        if response.drag_started()
            && let Some(here) = place(snapshot, hole)
        {
            self.remember(snapshot);
            (self.is_open, self.chosen, self.held) = (true, Some(hole), Some(here));
        }
        if response.drag_stopped() {
            self.held = None;
        }
        let (Some(held), Some(way)) = (&self.held, response.total_drag_delta()) else { return };
        if !response.dragged() {
            return;
        }
        let mut moved = held.clone();
        if response.ctx.input(|input| input.modifiers.shift) {
            moved.radius_m -= f64::from(WIDER_M * way.y);
        } else {
            moved.x_m += f64::from(way.x / points_a_metre) / scale(snapshot);
        }
        put(moved, snapshot, actions);
    }

    fn remember(&mut self, snapshot: &Snapshot) {
        if self.of != snapshot.as_built.name {
            self.undo.clear();
            self.of.clone_from(&snapshot.as_built.name);
        }
        if self.undo.len() == KEPT {
            self.undo.remove(0);
        }
        self.undo.push(snapshot.moved.to_vec());
    }

    /// The chosen hole in numbers, and the way back.
    pub fn line(&mut self, ui: &mut Ui, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        let c = Colours::here(ui);
        ui.horizontal(|ui| {
            ui.set_height(22.0);
            let holes = &snapshot.as_built.holes;
            match self.chosen.and_then(|hole| Some((holes.get(hole)?, place(snapshot, hole)?))) {
                Some((built, here)) => self.numbers(ui, built, here, snapshot, actions),
                None => {
                    let how = "Drag a hole along the bore. With Shift, up makes it wider.";
                    ui.add(egui::Label::new(RichText::new(how).color(c.quiet)).truncate());
                }
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if ui.button("Done").clicked() {
                    self.is_open = false;
                }
                self.files_and_undo(ui, snapshot, actions);
            });
        });
        match &snapshot.saved {
            Some(Ok(path)) => {
                ui.horizontal(|ui| {
                    if ui
                        .button("Open it")
                        .on_hover_text("Plays the saved instrument, tuned as a whole")
                        .clicked()
                    {
                        actions.push(Action::OpenInstrument(path.clone()));
                    }
                    let told = RichText::new(format!("Saved as {}", path.display())).color(c.quiet);
                    ui.add(egui::Label::new(told).truncate());
                });
            }
            Some(Err(refused)) => {
                ui.add(egui::Label::new(RichText::new(refused).color(c.danger)).truncate());
            }
            None => {}
        }
    }

    fn files_and_undo(&mut self, ui: &mut Ui, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        let is_moved = !snapshot.moved.is_empty();
        let about = "Saves the instrument with its holes where they are now. A saved instrument can be opened in the Instrument \
                     view and is tuned as a whole.";
        if ui.add_enabled(is_moved, egui::Button::new("Save")).on_hover_text(about).clicked() {
            let mut file = snapshot.as_built.with_holes_moved(&snapshot.moved);
            let names: Vec<_> = snapshot.moved.iter().map(|hole| hole.name.as_str()).collect();
            file.name = format!("{}, holes moved", file.name);
            file.source = format!("{} Moved by hand: {}.", file.source, names.join(", "));
            actions.push(Action::SaveInstrument(Arc::new(file)));
        }
        let back = ui.add_enabled(is_moved, egui::Button::new("Put back"));
        if back.on_hover_text("All holes go back to where they were").clicked() {
            self.remember(snapshot);
            actions.push(Action::MoveHoles(Vec::new()));
        }
        let can_undo = self.of == snapshot.as_built.name && !self.undo.is_empty();
        let undo = ui.add_enabled(can_undo, egui::Button::new("Undo move"));
        if undo.on_hover_text("Undo the last move of a hole").clicked()
            && let Some(before) = self.undo.pop()
        {
            actions.push(Action::MoveHoles(before));
        }
    }

    fn numbers(
        &mut self,
        ui: &mut Ui,
        built: &ToneHole,
        here: MovedHole,
        snapshot: &Snapshot,
        actions: &mut Vec<Action>,
    ) {
        let c = Colours::here(ui);
        let is_narrow = ui.available_width() < NARROW;
        ui.strong(built.name.replace('_', " "));
        let mut now = here.clone();
        let numbers = [
            (&mut now.x_m, 1e3, "mm from the reed", "Place", built.x_m),
            (&mut now.radius_m, 2e3, "mm wide", "Width", built.radius_m),
        ];
        for (metres, factor, unit, name, built_m) in numbers {
            let mut mm = *metres * factor;
            let value = DragValue::new(&mut mm).speed(0.05).fixed_decimals(1).min_decimals(1);
            let response = ui.add(value).on_hover_text(format!("As built: {:.1} {unit}", factor * built_m));
            let label = format!("{name} of the hole {}, {unit}", built.name.replace('_', " "));
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::SpinButton, true, label.clone()));
            if response.drag_started() || response.gained_focus() {
                self.remember(snapshot);
            }
            if response.changed() {
                *metres = mm / factor;
            }
            let unit = if is_narrow { "mm" } else { unit };
            ui.label(RichText::new(unit).font(theme::small()).color(c.quiet));
        }
        if now != here {
            put(now, snapshot, actions);
        }
    }
}

/// Length of the instrument that sounds over that of its file.
fn scale(snapshot: &Snapshot) -> f64 {
    let built_m = snapshot.as_built.length_m();
    if built_m > 0.0 { snapshot.instrument.length_m() / built_m } else { 1.0 }
}

/// Where the user has a hole now.
fn place(snapshot: &Snapshot, hole: usize) -> Option<MovedHole> {
    let built = snapshot.as_built.holes.get(hole)?;
    let moved = snapshot.as_built.with_holes_moved(&snapshot.moved);
    let ToneHole { x_m, radius_m, .. } = *moved.holes.get(hole)?;
    Some(MovedHole { name: built.name.clone(), x_m, radius_m })
}

/// Asks for one hole elsewhere; where it was built it is no longer moved.
fn put(hole: MovedHole, snapshot: &Snapshot, actions: &mut Vec<Action>) {
    let mut all: Vec<MovedHole> =
        snapshot.moved.iter().filter(|other| other.name != hole.name).cloned().collect();
    all.push(hole);
    // What can be drilled.
    let file = snapshot.as_built.with_holes_moved(&all);
    for moved in &mut all {
        if let Some(hole) = file.hole(&moved.name).and_then(|index| file.holes.get(index)) {
            (moved.x_m, moved.radius_m) = (hole.x_m, hole.radius_m);
        }
    }
    all.retain(|moved| {
        let built = snapshot.as_built.holes.iter().find(|built| built.name == moved.name);
        built.is_some_and(|built| (built.x_m, built.radius_m) != (moved.x_m, moved.radius_m))
    });
    if all != *snapshot.moved {
        actions.push(Action::MoveHoles(all));
    }
}
