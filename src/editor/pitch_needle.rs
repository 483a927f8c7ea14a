//! The needle that shows how far the sound is from the note.

use egui::{Align2, CornerRadius, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use crate::editor::snapshot::Snapshot;
use crate::editor::theme;
use crate::editor::theme::Colours;

/// What stands where a pitch would, when nothing sounds.
pub const NO_SOUND: &str = "no sound";
/// What stands in place of a pitch then.
pub const NO_PITCH: &str = "\u{2013}";
/// The scale reaches so far each way, cents.
const SCALE_CENTS: f32 = 50.0;
/// Within this distance a listener hears the note as in tune, cents.
const IN_TUNE_CENTS: f32 = 5.0;

/// Cents above or below the note: a needle over its scale.
pub fn needle(ui: &mut Ui, snapshot: &Snapshot, width: f32) {
    let c = Colours::here(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(width, 36.0), Sense::hover());
    let painter = ui.painter();
    let line_y = rect.bottom() - 9.0;
    let at =
        |cents: f32| rect.center().x + (cents / SCALE_CENTS).clamp(-1.0, 1.0) * (0.5 * rect.width() - 6.0);
    painter.hline(rect.left()..=rect.right(), line_y, Stroke::new(1.0, c.line));
    for cents in [-50.0, -40.0, -30.0, -20.0, -10.0, 0.0, 10.0, 20.0, 30.0, 40.0, 50.0_f32] {
        let height = if cents == 0.0 {
            9.0
        } else if cents % 50.0 == 0.0 {
            7.0
        } else {
            4.0
        };
        painter.vline(at(cents), line_y - height..=line_y, Stroke::new(1.0, c.quiet));
    }
    let near = Rect::from_min_max(pos2(at(-IN_TUNE_CENTS), line_y), pos2(at(IN_TUNE_CENTS), line_y + 3.0));
    painter.rect_filled(near, CornerRadius::ZERO, c.speaks);
    let text = match snapshot.heard.cents.filter(|cents| cents.is_finite()) {
        Some(cents) => {
            let colour = if cents.abs() <= IN_TUNE_CENTS { c.speaks } else { c.beats };
            let x = at(cents);
            painter.line_segment([pos2(x, line_y - 14.0), pos2(x, line_y + 4.0)], Stroke::new(2.5, colour));
            painter.circle_filled(pos2(x, line_y - 14.0), 3.0, colour);
            if cents.abs() < 0.5 { "in tune".into() } else { format!("{cents:+.0} cents") }
        }
        None => NO_PITCH.into(),
    };
    let place = pos2(rect.right(), rect.top() - 1.0);
    painter.text(place, Align2::RIGHT_TOP, &text, theme::small(), c.quiet);
    response.widget_info(|| {
        WidgetInfo::labeled(
            Role::Meter,
            true,
            format!("Pitch: {}", if text == NO_PITCH { NO_SOUND } else { &text }),
        )
    });
    response.on_hover_text(format!(
        "Distance of the sound from the note, at A4 = {:.1} Hz",
        snapshot.settings.a4_hz
    ));
}
