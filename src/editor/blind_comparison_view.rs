//! The page of a blind comparison: X and Y, and nothing that tells which is which.

use egui::{Align2, CornerRadius, FontId, RichText, Role, Sense, Stroke, Ui, WidgetInfo, vec2};

use crate::editor::Action;
use crate::editor::ab_comparison::{AbComparison, ComparisonSide};
use crate::editor::controls::Hands;
use crate::editor::snapshot::Snapshot;
use crate::editor::theme;
use crate::editor::theme::Colours;

/// Draws the page.
pub fn draw(
    ui: &mut Ui,
    compare: &mut AbComparison,
    hands: &mut Hands,
    snapshot: &Snapshot,
    actions: &mut Vec<Action>,
) {
    let c = Colours::here(ui);
    let height = ui.available_height();
    ui.vertical_centered(|ui| {
        ui.add_space(0.12 * height);
        ui.label(RichText::new("Blind comparison").font(FontId::proportional(22.0)));
        let told = if compare.is_revealed() {
            let [x, y] = [true, false].map(|first| compare.behind(first).name());
            let heard = compare.side.name();
            format!(
                "X was {x}, Y was {y}. Done ends the comparison and goes on with {heard}, which you hear."
            )
        } else {
            "Play, switch between X and Y as often as you like, decide, then press Reveal.".to_owned()
        };
        ui.label(RichText::new(told).color(c.quiet));
        ui.add_space(0.06 * height);
        let size = vec2((0.3 * ui.available_width()).min(220.0), (0.3 * height).min(150.0));
        ui.horizontal(|ui| {
            ui.add_space(0.5 * (ui.available_width() - 2.0 * size.x - 8.0));
            for (first, name) in [(true, "X"), (false, "Y")] {
                let side = compare.behind(first);
                let is_here = compare.side == side;
                let (rect, response) = ui.allocate_exact_size(size, Sense::click());
                let painter = ui.painter();
                let round = CornerRadius::same(theme::PANEL_RADIUS);
                let fill = match (is_here, response.hovered()) {
                    (true, _) => c.accent,
                    (false, true) => c.hovered,
                    (false, false) => c.raised,
                };
                painter.rect_filled(rect, round, fill);
                if response.has_focus() {
                    painter.rect_stroke(rect, round, Stroke::new(2.0, c.ink), egui::StrokeKind::Inside);
                }
                let ink = if is_here { c.on_accent } else { c.ink };
                painter.text(rect.center(), Align2::CENTER_CENTER, name, FontId::proportional(44.0), ink);
                if compare.is_revealed() {
                    let told = format!("is {}", side.name());
                    let at = rect.center_bottom() - vec2(0.0, 10.0);
                    painter.text(at, Align2::CENTER_BOTTOM, told, theme::heading(), ink);
                }
                response.widget_info(|| {
                    WidgetInfo::selected(Role::RadioButton, true, is_here, format!("Side {name}"))
                });
                if response.clicked() {
                    compare.switch(side, hands, &snapshot.preset, actions);
                }
            }
        });
        ui.add_space(0.05 * height);
        if compare.is_revealed() {
            if ui.add(main_button("Done")).clicked() {
                compare.end_blind();
            }
            return;
        }
        if ui.add(main_button("Reveal")).clicked() {
            compare.reveal();
        }
        ui.add_space(2.0);
        // The side that plays would be told by the letter at the top.
        let about = "Ends the comparison on A, without telling which side was which";
        if ui.button("Cancel").on_hover_text(about).clicked() {
            compare.end_blind();
            compare.switch(ComparisonSide::A, hands, &snapshot.preset, actions);
        }
    });
}

/// The button that leads on.
fn main_button(text: &str) -> egui::Button<'_> {
    egui::Button::new(RichText::new(text).font(theme::heading())).min_size(vec2(120.0, 32.0))
}
