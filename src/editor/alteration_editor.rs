//! Altering the instrument: the user drags a hole along the bore, or a ring to pull the joint, or gives lengths in
//! millimetres, and hears it at once. The instrument keeps the tuning that it had, so that an alteration can be heard.

use std::sync::Arc;

use egui::{Align, DragValue, Label, Layout, Rect, Response, RichText, Ui, UiBuilder, pos2};

use crate::editor::Action;
use crate::editor::hole_names::hole_title;
use crate::editor::snapshot::Snapshot;
use crate::editor::theme;
use crate::editor::theme::Colours;
use crate::editor::undo::Move;
use chalumeau_core::bore::alterations::Alterations;
use chalumeau_core::bore::instrument_file::{InstrumentFile, ToneHole};
use chalumeau_core::bore::moved_hole::MovedHole;
use chalumeau_core::bore::pulled_joint::PulledJoint;

/// Width of the line below which units lose their words, points.
const NARROW: f32 = 640.0;
/// Height of a row of buttons over a picture, points.
pub const ROW: f32 = 26.0;
/// How much wider a hole becomes where the pointer goes up by one point with Shift held, m of the radius.
const WIDER_M: f32 = 0.05e-3;

/// What is altered.
#[derive(Clone, Debug, PartialEq)]
pub enum Altered {
    /// A hole, by its index.
    Hole(usize),
    /// The joint below a part.
    Joint(String),
}

/// What the view remembers of it.
#[derive(Clone, Debug, Default)]
pub struct AlterationEditor {
    is_open: bool,
    /// What the numbers are of.
    chosen: Option<Altered>,
    /// The alterations as a drag found them.
    held: Option<Arc<Alterations>>,
    /// Number of the gesture, and the alterations before it.
    gesture: u64,
    before: Arc<Alterations>,
    /// What the user has asked for in this frame.
    asked: Option<Move>,
}

impl AlterationEditor {
    /// Whether its line is shown.
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// Whether this is chosen for its numbers.
    pub fn has_chosen(&self, it: &Altered) -> bool {
        self.is_open && self.chosen.as_ref() == Some(it)
    }

    /// Shows its line.
    pub fn open(&mut self) {
        self.is_open = true;
    }

    /// The instrument as the user has altered it. The sound follows a little later.
    pub fn shown(snapshot: &Snapshot) -> Arc<InstrumentFile> {
        if snapshot.alterations.is_empty() {
            return snapshot.instrument.clone();
        }
        Arc::new(snapshot.as_built.altered(&snapshot.alterations).scaled(scale(snapshot)))
    }

    /// Follows a drag. `points_a_metre` is the scale of the drawing.
    pub fn follow(
        &mut self,
        response: &Response,
        it: Altered,
        points_a_metre: f32,
        snapshot: &Snapshot,
        actions: &mut Vec<Action>,
    ) {
        if response.drag_started() {
            self.begin(snapshot);
            (self.is_open, self.held) = (true, Some(snapshot.alterations.clone()));
            self.chosen = Some(it.clone());
        }
        if response.drag_stopped() {
            self.held = None;
        }
        let (Some(held), Some(way)) = (&self.held, response.total_drag_delta()) else { return };
        if !response.dragged() {
            return;
        }
        let way_m = f64::from(way.x / points_a_metre) / scale(snapshot);
        let built = &snapshot.as_built;
        let wanted = match it {
            Altered::Hole(hole) => {
                let Some(mut moved) = place(built, held, hole) else { return };
                if response.ctx.input(|input| input.modifiers.shift) {
                    moved.radius_m -= f64::from(WIDER_M * way.y);
                } else {
                    moved.x_m += way_m;
                }
                with_hole(built, held, moved)
            }
            Altered::Joint(part) => {
                let by_m = pulled_by(held, &part) + way_m;
                with_joint(built, held, PulledJoint { part, by_m })
            }
        };
        self.ask(wanted, snapshot, actions);
    }

    /// A gesture begins.
    fn begin(&mut self, snapshot: &Snapshot) {
        self.gesture += 1;
        self.before = snapshot.alterations.clone();
    }

    fn ask(&mut self, wanted: Alterations, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        if snapshot.can_alter && wanted != *snapshot.alterations {
            self.asked = Some(Move {
                gesture: self.gesture,
                instrument_key: snapshot.instrument_key.clone(),
                before: self.before.clone(),
                after: Arc::new(wanted.clone()),
            });
            actions.push(Action::Alter(wanted));
        }
    }

    /// What the user has asked for in this frame, for the steps that can be undone.
    pub fn take_move(&mut self) -> Option<Move> {
        self.asked.take()
    }

    /// What is chosen in numbers, and what to do with it.
    pub fn line(&mut self, ui: &mut Ui, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        let c = Colours::here(ui);
        ui.horizontal(|ui| {
            ui.set_height(22.0);
            let is_shown = match self.chosen.clone() {
                Some(Altered::Hole(hole)) => self.hole_numbers(ui, hole, snapshot, actions),
                Some(Altered::Joint(part)) => self.joint_number(ui, part, snapshot, actions),
                None => false,
            };
            if !is_shown {
                let how = "Drag a hole along the bore; with Shift, up makes it wider. Drag a ring to pull the joint.";
                let how = RichText::new(how).color(c.quiet);
                ui.add(Label::new(how).truncate());
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if ui.button("Done").clicked() {
                    self.is_open = false;
                }
                self.save_and_put_back(ui, snapshot, actions);
            });
        });
    }

    /// Where the altered instrument was saved or why it was not, from the right of the row at the top of `within`.
    pub fn saved(ui: &mut Ui, within: Rect, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        // Nothing is altered any more: what was saved is no longer here.
        let Some(saved) = snapshot.saved.as_ref().filter(|_| !snapshot.alterations.is_empty()) else {
            return;
        };
        let c = Colours::here(ui);
        let row = Rect::from_min_max(within.min, pos2(within.right(), within.top() + ROW));
        let layout = Layout::right_to_left(Align::Center);
        ui.scope_builder(UiBuilder::new().max_rect(row).layout(layout), |ui| match saved {
            Ok(path) => {
                let about = "Plays the saved instrument, tuned as a whole";
                if ui.button("Open it").on_hover_text(about).clicked() {
                    actions.push(Action::OpenInstrument(path.clone()));
                }
                let name = path.file_name().unwrap_or(path.as_os_str()).display();
                let told = RichText::new(format!("Saved as {name}")).color(c.ink);
                ui.add(Label::new(told).truncate()).on_hover_text(path.display().to_string());
            }
            Err(refused) => {
                ui.add(Label::new(RichText::new(refused).color(c.danger)).truncate());
            }
        });
    }

    /// Buttons that save what is altered and put it back, from the right.
    pub fn save_and_put_back(&mut self, ui: &mut Ui, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        let is_altered = !snapshot.alterations.is_empty();
        let about = "Saves the instrument as it is now. A saved instrument can be opened in the Instrument view and is \
             tuned as a whole.";
        if ui.add_enabled(is_altered, egui::Button::new("Save")).on_hover_text(about).clicked() {
            let mut file = snapshot.as_built.altered(&snapshot.alterations);
            file.name = format!("{}, altered", file.name);
            file.source =
                format!("{} Altered by hand: {}.", file.source, snapshot.alterations.names().join(", "));
            actions.push(Action::SaveInstrument(Arc::new(file)));
        }
        let back = ui.add_enabled(is_altered, egui::Button::new("Put back"));
        if back.on_hover_text("All holes and joints go back to where they were").clicked() {
            self.begin(snapshot);
            self.ask(Alterations::default(), snapshot, actions);
        }
    }

    /// Whether there is such a hole.
    fn hole_numbers(
        &mut self,
        ui: &mut Ui,
        hole: usize,
        snapshot: &Snapshot,
        actions: &mut Vec<Action>,
    ) -> bool {
        let (file, alterations) = (&snapshot.as_built, &snapshot.alterations);
        let (Some(built), Some(here)) = (file.holes.get(hole), place(file, alterations, hole)) else {
            return false;
        };
        let title = hole_title(&built.name);
        ui.strong(&title);
        // Where it is while joints above it are pulled.
        let by_joints_m = file.moved_by_joints(built.x_m, &alterations.joints);
        let mut now = here.clone();
        let numbers = [
            (&mut now.x_m, by_joints_m, 1e3, "mm from the reed", "Place", built.x_m),
            (&mut now.radius_m, 0.0, 2e3, "mm wide", "Width", built.radius_m),
        ];
        for (metres, more_m, factor, unit, name, built_m) in numbers {
            let mut mm = (*metres + more_m) * factor;
            let label = format!("{name} of the hole {title}, {unit}");
            let about = format!("As built: {:.1} {unit}", factor * built_m);
            if self.number(ui, &mut mm, unit, &label, &about, snapshot) {
                *metres = mm / factor - more_m;
            }
        }
        if now != here {
            self.ask(with_hole(file, alterations, now), snapshot, actions);
        }
        true
    }

    /// Whether there is such a joint.
    fn joint_number(
        &mut self,
        ui: &mut Ui,
        part: String,
        snapshot: &Snapshot,
        actions: &mut Vec<Action>,
    ) -> bool {
        let (file, alterations) = (&snapshot.as_built, &snapshot.alterations);
        let Some((least_m, most_m)) = file.room_of_joint(&part) else { return false };
        ui.strong(&part);
        let mut mm = 1e3 * pulled_by(alterations, &part);
        let label = format!("How much longer the {part} is, mm");
        let about =
            format!("From {:.1} to {:.1} mm; all below the ring moves with it", 1e3 * least_m, 1e3 * most_m);
        if self.number(ui, &mut mm, "mm longer", &label, &about, snapshot) {
            self.ask(with_joint(file, alterations, PulledJoint { part, by_m: 1e-3 * mm }), snapshot, actions);
        }
        true
    }

    /// A number with its unit; whether the user has changed it.
    fn number(
        &mut self,
        ui: &mut Ui,
        mm: &mut f64,
        unit: &str,
        label: &str,
        about: &str,
        snapshot: &Snapshot,
    ) -> bool {
        let c = Colours::here(ui);
        let is_narrow = ui.available_width() < NARROW;
        let value = DragValue::new(mm).speed(0.05).fixed_decimals(1).min_decimals(1);
        let response = ui.add(value).on_hover_text(about);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::SpinButton, true, label));
        // A screen reader steps the number without focus or drag.
        let is_stepped =
            response.changed() && !response.dragged() && !response.has_focus() && !response.lost_focus();
        if response.drag_started() || response.gained_focus() || is_stepped {
            self.begin(snapshot);
        }
        let unit = if is_narrow { "mm" } else { unit };
        ui.label(RichText::new(unit).font(theme::small()).color(c.quiet));
        response.changed()
    }
}

/// Lengths of the instrument that sounds over those of its file.
fn scale(snapshot: &Snapshot) -> f64 {
    let built_m = snapshot.as_built.nominal_radius_m;
    if built_m > 0.0 { snapshot.instrument.nominal_radius_m / built_m } else { 1.0 }
}

/// Where a hole is, before joints are pulled.
fn place(built: &InstrumentFile, alterations: &Alterations, hole: usize) -> Option<MovedHole> {
    let moved = built.with_holes_moved(&alterations.holes);
    let ToneHole { name, x_m, radius_m, .. } = moved.holes.get(hole)?;
    Some(MovedHole { name: name.clone(), x_m: *x_m, radius_m: *radius_m })
}

/// How much longer a part is, m.
fn pulled_by(alterations: &Alterations, part: &str) -> f64 {
    alterations.joints.iter().find(|joint| joint.part == part).map_or(0.0, |joint| joint.by_m)
}

/// These alterations with one hole elsewhere; where it was built it is no longer moved.
fn with_hole(built: &InstrumentFile, alterations: &Alterations, hole: MovedHole) -> Alterations {
    let mut all = alterations.clone();
    all.holes.retain(|other| other.name != hole.name);
    all.holes.push(hole);
    // What can be drilled.
    let file = built.with_holes_moved(&all.holes);
    for moved in &mut all.holes {
        if let Some(hole) = file.hole(&moved.name).and_then(|index| file.holes.get(index)) {
            (moved.x_m, moved.radius_m) = (hole.x_m, hole.radius_m);
        }
    }
    all.holes.retain(|moved| {
        let built = built.holes.iter().find(|built| built.name == moved.name);
        built.is_some_and(|built| (built.x_m, built.radius_m) != (moved.x_m, moved.radius_m))
    });
    all
}

/// These alterations with one joint elsewhere; at 0 it is no longer pulled.
fn with_joint(built: &InstrumentFile, alterations: &Alterations, joint: PulledJoint) -> Alterations {
    let mut all = alterations.clone();
    all.joints.retain(|other| other.part != joint.part);
    let room = built.with_holes_moved(&all.holes).room_of_joint(&joint.part);
    if let Some((least_m, most_m)) = room {
        let by_m = joint.by_m.clamp(least_m, most_m);
        if by_m != 0.0 {
            all.joints.push(PulledJoint { by_m, ..joint });
        }
    }
    all
}
