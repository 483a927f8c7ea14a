//! The first view: the clarinet as it is played, how loud it is, and the controls that most players need.
//!
//! The clarinet fills the view and moves as it is played: fingers and pads, the reed's tip, the sound pressure in the bore, the
//! light in the holes that sound comes out of. On its left stands the breath in a musician's words, below it the main controls
//! and the last ten seconds. A click on a hole opens or closes it for a trial and a drag moves it, as in the clarinet view.

mod instrument_title;
mod lit_body;
mod macro_knob;
mod motion;
mod stage;
mod trail;

use egui::{Frame, Margin, Panel, Rect, Ui, pos2, vec2};

use crate::editor::Action;
use crate::editor::alteration_editor;
use crate::editor::alteration_editor::AlterationEditor;
use crate::editor::controls::Hands;
use crate::editor::dynamic_meter;
use crate::editor::snapshot::Snapshot;
use crate::editor::theme;
use crate::editor::theme::{Colours, GAP};
use crate::editor::trial::Trial;
use crate::editor::widgets::one_line;
use macro_knob::Macro;
use motion::Motion;

/// The main controls, in order, with what their ends mean. A control whose parameter does not exist is left out.
const MACROS: [Macro; 11] = [
    Macro { id: "bcurve", name: "Curve", ends: "early to late" },
    Macro { id: "lip", name: "Lip", ends: "firm to loose" },
    Macro { id: "stren", name: "Reed", ends: "soft to hard" },
    Macro { id: "tongue", name: "Tongue", ends: "hard to soft" },
    Macro { id: "lay", name: "Facing", ends: "bright to mellow" },
    Macro { id: "vib", name: "Vibrato", ends: "none to deep" },
    Macro { id: "growl", name: "Growl", ends: "none to rough" },
    Macro { id: "tract", name: "Tract", ends: "open to tuned" },
    Macro { id: "noise", name: "Noise", ends: "none to much" },
    Macro { id: "room", name: "Room", ends: "dry to far" },
    Macro { id: "gain", name: "Gain", ends: "soft to loud" },
];
/// Width of a main control, with its words, points.
const MACRO_WIDTH: f32 = 92.0;

/// A view of this size has all its words and controls as they are designed, points: what is left of a window of the usual size.
const USUAL: (f32, f32) = (1_084.0, 516.0);
/// Most that they grow in a larger one.
const MOST_GROWN: f32 = 2.5;

/// What the view remembers.
#[derive(Clone, Debug, Default)]
pub struct PlayView {
    motion: Motion,
}

impl PlayView {
    /// Draws the view. `tried`: what the trial tries, if there is one.
    pub fn draw(
        &mut self,
        ui: &mut Ui,
        hands: &mut Hands,
        snapshot: &Snapshot,
        (trial, tried): (&mut Trial, Option<String>),
        alterations: &mut AlterationEditor,
        actions: &mut Vec<Action>,
    ) {
        let c = Colours::here(ui);
        self.motion.follow(ui, snapshot, trial.open());
        let height = ui.available_height();
        let is_small = height < 420.0;
        let grown = (ui.available_width() / USUAL.0).min(height / USUAL.1).clamp(1.0, MOST_GROWN);
        let clear = Frame::new().inner_margin(Margin::ZERO);

        let trail_height = if is_small { 34.0 } else { (0.12 * height).clamp(48.0, 90.0 * grown) };
        let bottom = Panel::bottom("trail").exact_size(trail_height + GAP).show_separator_line(false);
        bottom
            .frame(Frame::new().inner_margin(Margin { top: GAP as i8, ..Margin::ZERO }))
            .show(ui, |ui| trail::draw(ui, snapshot, grown));
        let macros: Vec<&Macro> = MACROS.iter().filter(|of| hands.controls.look(of.id).is_some()).collect();
        let macro_height = macro_knob::height(height, grown);
        let below = Panel::bottom("macros").exact_size(macro_height).show_separator_line(false);
        below.frame(clear).show(ui, |ui| {
            let width =
                (ui.available_width() / macros.len().max(1) as f32).min(1.35 * macro_height.max(MACRO_WIDTH));
            let has_ends = macro_knob::ends_fit(ui, &macros, vec2(width, macro_height), grown);
            let left = 0.5 * (ui.available_width() - width * macros.len() as f32);
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = 0.0;
                ui.add_space(left.max(0.0));
                for of in macros {
                    macro_knob::draw(ui, hands, of, vec2(width, macro_height), grown, has_ends);
                }
            });
        });
        let side = Panel::left("dynamics")
            .exact_size(if is_small { 84.0 } else { 108.0 * grown })
            .show_separator_line(false);
        side.frame(clear).show(ui, |ui| dynamic_meter::draw(ui, snapshot, grown));
        egui::CentralPanel::default().frame(clear).show(ui, |ui| {
            let rect = ui.available_rect_before_wrap();
            stage::ground(ui, rect);
            let clicked = stage::draw(ui, rect, snapshot, &self.motion, grown, (alterations, actions));
            let title = instrument_title::draw(ui, rect, &snapshot.instrument, grown);
            if let Some(hole) = clicked {
                trial.toggle(hole, snapshot, actions);
            }
            if !snapshot.alterations.is_empty() {
                // Between what the wave is and the name of the instrument.
                let place = Rect::from_min_max(
                    rect.min + vec2(190.0 * grown, 2.0),
                    pos2(title.left() - 16.0, rect.top() + 2.0 + alteration_editor::ROW),
                );
                // From the left: the name, which is longer while holes are moved, moves no button under the pointer.
                let layout = egui::Layout::left_to_right(egui::Align::Center);
                ui.scope_builder(egui::UiBuilder::new().max_rect(place).layout(layout), |ui| {
                    alterations.save_and_put_back(ui, snapshot, actions);
                });
                let below = place.translate(vec2(0.0, alteration_editor::ROW + 4.0));
                AlterationEditor::saved(ui, below, snapshot, actions);
            }
            if trial.is_on() {
                let row = Rect::from_center_size(
                    rect.center_bottom() - vec2(0.0, 21.0),
                    vec2(rect.width() - 16.0, 26.0),
                );
                // A trial that this click has begun is named in the next frame.
                if let Some(tried) = &tried {
                    back_to_the_note(ui, row, snapshot, (trial, tried), actions);
                }
            } else if snapshot.sounding.is_none() {
                let at = rect.center_bottom() - vec2(0.0, 10.0);
                let text = "Play a key below, or blow. Click a hole to try it, drag it to move it.";
                let font = egui::FontId::proportional(13.0 * grown);
                ui.painter().text(at, egui::Align2::CENTER_BOTTOM, text, font, c.ink);
            }
        });
    }
}

/// Says what is tried, and offers the way back, in the middle of a row.
fn back_to_the_note(
    ui: &mut Ui,
    row: Rect,
    snapshot: &Snapshot,
    (trial, tried): (&mut Trial, &str),
    actions: &mut Vec<Action>,
) {
    const BUTTON: f32 = 150.0;
    let c = Colours::here(ui);
    let trying = format!("Trying {tried}");
    let hinted = format!("{trying}: play a key to hear it");
    let line = |text: &str| one_line(ui, text, theme::body(), c.ink, row.width() - BUTTON - 12.0);
    // The button stays where it is when the hint goes.
    let left = row.center().x - 0.5 * (line(&hinted).size().x + 12.0 + BUTTON);
    let button = Rect::from_min_size(pos2(left, row.top()), vec2(BUTTON, row.height()));
    let told = if snapshot.sounding.is_none() { hinted } else { trying };
    let words = line(&told);
    let left = button.right() + 12.0;
    let place = Rect::from_min_size(pos2(left, row.center().y - 0.5 * words.size().y), words.size());
    let label = ui.interact(place, ui.scope_id().with("tried"), egui::Sense::hover());
    label.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &told));
    ui.painter().galley(place.min, words, c.ink);
    let back = ui.put(button, egui::Button::new("Back to the note"));
    if back.on_hover_text("Ends the trial; the played note sets the holes again").clicked() {
        trial.end(actions);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::PARAMETERS;

    /// Who learns a control here finds it by the same name in a host's list.
    #[test]
    fn every_control_has_a_word_of_its_parameters_name() {
        for Macro { id, name, .. } in MACROS {
            let parameter = PARAMETERS.iter().find(|parameter| parameter.id == id).expect(id);
            let words = parameter.name.split(' ');
            assert!(words.map(str::to_lowercase).any(|word| word == name.to_lowercase()), "{id}: {name}");
        }
    }
}
