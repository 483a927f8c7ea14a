//! The last ten seconds: pitch as a line, loudness as its thickness and light.

use egui::{Align2, Color32, CornerRadius, Mesh, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use crate::editor::chart;
use crate::editor::snapshot::{Snapshot, Track};
use crate::editor::theme;
use crate::editor::theme::Colours;

/// Level at the bottom and at the top of the band, dBFS.
const LEVELS_DB: (f32, f32) = (-60.0, -6.0);
/// The pitch axis is at least this wide, semitones.
const LEAST_SEMITONES: f32 = 5.0;

/// So far below the loudest of the last moments a note decays, and its pitch is nobody's, dB.
const DECAY_DB: f32 = 25.0;
/// The last moments, s: shorter than a player goes down by as much.
const LOUDEST_OF_S: f32 = 1.0;
/// Time in which a note finds its pitch, s.
const ATTACK_S: f32 = 0.08;
/// Time in which fingers change from note to note, s (by judgement).
const CHANGE_S: f32 = 0.06;
/// A pitch so far outside of both its neighbours is that of another mode of the air column, semitones: less than the fifth or so between
/// the upper modes, and more than an ornament leaps.
const MODES_APART: f32 = 6.0;

/// The pitches that were played: those of attacks and decays are left out. An attack follows a pause.
fn played(track: &Track) -> Vec<Option<f32>> {
    let count = track.level_db.len().min(track.pitch.len());
    let steps = |seconds: f32| (seconds / track.step_s.max(1e-3)).round() as usize;
    let (attack, recent) = (steps(ATTACK_S), steps(LOUDEST_OF_S));
    let pitch = |index: usize| {
        let before = &track.level_db[index.saturating_sub(recent)..=index];
        let loudest = before.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let sounds = track.level_db[index] > loudest - DECAY_DB;
        track.pitch[index].filter(|pitch| sounds && pitch.is_finite())
    };
    let sounding: Vec<_> = (0..count).map(pitch).collect();
    let is_past_attack =
        |index: usize| sounding[index.saturating_sub(attack)..index].iter().all(Option::is_some);
    let mut played: Vec<_> =
        (0..count).map(|index| sounding[index].filter(|_| is_past_attack(index))).collect();
    forget_changes(&mut played, steps(CHANGE_S));
    played
}

/// Forgets pitches that are in force for `steps` at most, and outside of what is before and after: while fingers move, the air column
/// has a pitch that nobody plays.
fn forget_changes(played: &mut [Option<f32>], steps: usize) {
    let is_one = |a: &Option<f32>, b: &Option<f32>| match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() < 1.0,
        _ => a.is_none() && b.is_none(),
    };
    let stretches: Vec<_> = played.chunk_by(is_one).map(|of| (of.len(), of[0], of[of.len() - 1])).collect();
    let mut begin = 0;
    for (at, &(length, first, _)) in stretches.iter().enumerate() {
        let before = at.checked_sub(1).and_then(|before| stretches[before].2);
        let after = stretches.get(at + 1).and_then(|after| after.1);
        if let (Some(before), Some(pitch), Some(after)) = (before, first, after)
            && length <= steps
            && (pitch < before.min(after) - MODES_APART || pitch > before.max(after) + MODES_APART)
        {
            played[begin..begin + length].fill(None);
        }
        begin += length;
    }
}

/// Draws the trail into all of the place; its words are `grown` times as large as in a window of the usual size.
pub fn draw(ui: &mut Ui, snapshot: &Snapshot, grown: f32) {
    let c = Colours::here(ui);
    let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::hover());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, CornerRadius::same(theme::PANEL_RADIUS), c.panel);
    let track = &snapshot.history;
    let pitches = played(track);
    let count = pitches.len();
    let text = "last 10 s: pitch and loudness";
    let title = painter.text(
        rect.left_top() + vec2(10.0, 5.0),
        Align2::LEFT_TOP,
        text,
        theme::small_grown(grown),
        c.quiet,
    );
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, text));
    let heard = || pitches.iter().copied().flatten();
    if count < 2 || heard().next().is_none() {
        return;
    }
    let (low, high) =
        heard().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let middle = 0.5 * (low + high);
    let half = (0.5 * (high - low)).max(0.5 * LEAST_SEMITONES) + 0.5;
    let band = egui::Rect::from_min_max(
        pos2(rect.left() + 10.0, title.bottom().min(rect.top() + 20.0 * grown)),
        rect.max - vec2(10.0, 6.0),
    );
    let room = 10.0 / track.step_s.max(1e-3);
    let x = |index: usize| band.right() - (count - 1 - index) as f32 / room * band.width();
    let y = |pitch: f32| band.center().y - (pitch - middle) / half * 0.5 * (band.height() - 8.0);
    let (quiet, loud) = LEVELS_DB;
    let share = |index: usize| chart::share((track.level_db[index] - quiet) / (loud - quiet));
    let mut mesh = Mesh::default();
    let mut line = Vec::new();
    for (index, pitch) in pitches.into_iter().enumerate() {
        let Some(pitch) = pitch else {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pitch_of_an_attack_or_a_decay_is_left_out_and_a_slur_is_not() {
        // Silence, a scoop into a note, a slur, and a decay in which the pitch is lost.
        let note = |level: f32, pitch: Option<f32>, steps: usize| vec![(level, pitch); steps];
        let values = [
            note(-90.0, None, 10),
            note(-20.0, Some(57.0), 4),
            note(-20.0, Some(60.0), 50),
            note(-20.0, Some(64.0), 50),
            note(-40.0, Some(64.0), 5),
            note(-50.0, Some(71.0), 5),
            note(-90.0, None, 10),
        ]
        .concat();
        let track = Track {
            step_s: 0.02,
            kpa: Vec::new(),
            marks: Vec::new(),
            level_db: values.iter().map(|value| value.0).collect(),
            pitch: values.iter().map(|value| value.1).collect(),
        };
        let shown = [vec![None; 14], vec![Some(60.0); 50], vec![Some(64.0); 55], vec![None; 15]].concat();
        assert_eq!(played(&track), shown);
    }

    #[test]
    fn a_pitch_between_two_notes_that_lies_outside_them_is_left_out() {
        let line = |pitches: &[(f32, usize)]| -> Vec<Option<f32>> {
            pitches.iter().flat_map(|&(pitch, count)| vec![Some(pitch); count]).collect()
        };
        for (heard, is_left_out) in [
            ([(60.0, 20), (41.0, 2), (62.0, 20)], true),
            ([(60.0, 20), (79.0, 3), (62.0, 20)], true),
            // A note of an ornament, and a slide.
            ([(60.0, 20), (62.0, 4), (60.0, 20)], false),
            ([(60.0, 20), (61.5, 2), (63.0, 20)], false),
        ] {
            let mut played = line(&heard);
            forget_changes(&mut played, 3);
            let kept = played.iter().filter(|pitch| pitch.is_some()).count();
            let wanted = if is_left_out { 40 } else { line(&heard).len() };
            assert_eq!(kept, wanted, "{heard:?}");
        }
    }
}
