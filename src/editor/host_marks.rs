//! What a host ties to a parameter, shown beside its name, and the host's own menu.

use egui::{Pos2, Ui, vec2};

use crate::editor::controls::{Hands, Mark};
use crate::editor::theme;
use crate::editor::theme::Colours;

/// Distance from a name to the first dot and between dots, and a dot's radius, points.
const STEP: f32 = 9.0;
const RADIUS: f32 = 3.0;

/// Paints a dot for each mark to the right of `after`; returns where the last one is.
pub fn paint(ui: &Ui, marks: &[Mark], after: Pos2) -> Pos2 {
    let c = Colours::here(ui);
    for (mark, at) in marks.iter().zip(1_u8..) {
        let colour =
            mark.colour.map_or(c.accent, |[red, green, blue]| egui::Color32::from_rgb(red, green, blue));
        ui.painter().circle_filled(after + vec2(STEP * f32::from(at), 0.0), RADIUS, colour);
    }
    after + vec2(STEP * marks.len() as f32, 0.0)
}

/// The marks as lines of a tool tip.
pub fn explain(ui: &mut Ui, marks: &[Mark]) {
    let c = Colours::here(ui);
    for mark in marks {
        ui.label(egui::RichText::new(&mark.text).font(theme::small()).color(c.quiet));
    }
}

/// Opens the host's menu of a parameter.
pub fn open_menu(ui: &Ui, hands: &Hands, id: &str, at: Pos2) {
    // Windows of macOS are counted in points of the system, all others in pixels.
    let scale = if cfg!(target_os = "macos") { ui.ctx().zoom_factor() } else { ui.ctx().pixels_per_point() };
    hands.controls.menu(id, ((scale * at.x).round() as i32, (scale * at.y).round() as i32));
}
