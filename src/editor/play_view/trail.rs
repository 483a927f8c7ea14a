//! The last ten seconds: pitch as a line, loudness as its thickness and light.

use egui::{Align2, Color32, CornerRadius, Mesh, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use crate::editor::chart;
use crate::editor::snapshot::Snapshot;
use crate::editor::theme;
use crate::editor::theme::Colours;

/// Level at the bottom and at the top of the band, dBFS.
const LEVELS_DB: (f32, f32) = (-60.0, -6.0);
/// The pitch axis is at least this wide, semitones.
const LEAST_SEMITONES: f32 = 5.0;

/// Draws the trail into all of the place.
pub fn draw(ui: &mut Ui, snapshot: &Snapshot) {
    let c = Colours::here(ui);
    let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::hover());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, CornerRadius::same(theme::PANEL_RADIUS), c.panel);
    let track = &snapshot.history;
    let count = track.level_db.len().min(track.pitch.len());
    let text = "last 10 s: pitch and loudness";
    let title =
        painter.text(rect.left_top() + vec2(10.0, 5.0), Align2::LEFT_TOP, text, theme::small(), c.quiet);
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, text));
    let heard = || track.pitch.iter().copied().flatten().filter(|pitch| pitch.is_finite());
    if count < 2 || heard().next().is_none() {
        return;
    }
    let (low, high) =
        heard().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let middle = 0.5 * (low + high);
    let half = (0.5 * (high - low)).max(0.5 * LEAST_SEMITONES) + 0.5;
    let band = egui::Rect::from_min_max(
        pos2(rect.left() + 10.0, title.bottom().min(rect.top() + 20.0)),
        rect.max - vec2(10.0, 6.0),
    );
    let room = 10.0 / track.step_s.max(1e-3);
    let x = |index: usize| band.right() - (count - 1 - index) as f32 / room * band.width();
    let y = |pitch: f32| band.center().y - (pitch - middle) / half * 0.5 * (band.height() - 8.0);
    let (quiet, loud) = LEVELS_DB;
    let share = |index: usize| chart::share((track.level_db[index] - quiet) / (loud - quiet));
    let mut mesh = Mesh::default();
    let mut line = Vec::new();
    for index in 0..count {
        let Some(pitch) = track.pitch[index].filter(|pitch| pitch.is_finite()) else {
            stroke(&painter, c.breath, std::mem::take(&mut line));
            continue;
        };
        let (at, thick) = (pos2(x(index), y(pitch)), 1.0 + 7.0 * share(index));
        let light = c.breath.gamma_multiply(0.35 * share(index));
        let n = mesh.vertices.len() as u32;
        mesh.colored_vertex(at - vec2(0.0, thick), Color32::TRANSPARENT);
        mesh.colored_vertex(at, light);
        mesh.colored_vertex(at + vec2(0.0, thick), Color32::TRANSPARENT);
        if !line.is_empty() {
            for (a, b) in [(n - 3, n - 2), (n - 2, n - 1)] {
                mesh.add_triangle(a, b, a + 3);
                mesh.add_triangle(b, a + 3, b + 3);
            }
        }
        line.push(at);
    }
    painter.add(mesh);
    stroke(&painter, c.breath, line);
    response.on_hover_text("Pitch of the last ten seconds; a thicker line is louder");
}

fn stroke(painter: &egui::Painter, colour: Color32, points: Vec<egui::Pos2>) {
    if points.len() > 1 {
        painter.add(egui::Shape::line(points, Stroke::new(2.0, colour)));
    }
}
