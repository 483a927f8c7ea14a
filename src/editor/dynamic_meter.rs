//! How hard the player blows, in a musician's words: from where the note speaks to fortissimo. The Play view has it at its left, and
//! for a musician the other views at their right.

use egui::{
    Align2, Color32, CornerRadius, FontId, Mesh, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2,
};

use crate::editor::breath_meter;
use crate::editor::chart;
use crate::editor::snapshot::{NO_BREATH_KPA, Snapshot};
use crate::editor::theme;
use crate::editor::theme::Colours;
use chalumeau_core::instrument::BreathResponse;
use chalumeau_core::instrument::player::dynamics::NAMED;

/// Least distance of two words, points.
const LINE: f32 = 18.0;
/// Part of the column below the threshold.
const BELOW: f32 = 0.07;

/// A mark beside the column.
struct MeterMark {
    /// Height, 0..=1.
    at: f32,
    name: &'static str,
    colour: Color32,
    is_dynamic: bool,
}

/// What the column shows.
struct Reading {
    /// Height of the breath, 0..=1.
    level: f32,
    marks: Vec<MeterMark>,
    /// The same in words.
    word: String,
}

/// Draws the meter into all of the place.
pub fn draw(ui: &mut Ui, snapshot: &Snapshot, grown: f32) {
    let c = Colours::here(ui);
    let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::hover());
    let reading = match (snapshot.settings.breath_response, snapshot.dynamic) {
        (BreathResponse::Played, dynamic) => played(snapshot, dynamic.map(chart::share), c),
        (BreathResponse::Physical, _) => physical(snapshot, c),
    };
    let painter = ui.painter();
    let width = if rect.width() > 96.0 { 34.0 * grown } else { 26.0 };
    let small = theme::small_grown(grown);
    let column = Rect::from_min_max(
        pos2(rect.left() + 12.0, rect.top() + 12.0),
        pos2(rect.left() + 12.0 + width, rect.bottom() - 34.0 * grown),
    );
    let y = |level: f32| column.bottom() - level.clamp(0.0, 1.0) * column.height();
    let round = CornerRadius::same((0.5 * width) as u8);
    painter.rect_filled(column, round, c.raised);
    let top = y(reading.level);
    if column.bottom() - top > 1.0 {
        // A rounded bar, lighter at its top.
        let air = Rect::from_min_max(pos2(column.left(), top.min(column.bottom() - 4.0)), column.max);
        painter.rect_filled(air.expand(3.0), round, c.breath.gamma_multiply(0.10));
        painter.rect_filled(air, round, c.breath.gamma_multiply(0.62));
        if air.height() > width {
            let lit = air.shrink2(vec2(0.0, 0.5 * width));
            let mut mesh = Mesh::default();
            for (y, colour) in [(lit.top(), c.breath), (lit.bottom(), Color32::TRANSPARENT)] {
                mesh.colored_vertex(pos2(lit.left(), y), colour);
                mesh.colored_vertex(pos2(lit.right(), y), colour);
            }
            mesh.add_triangle(0, 1, 2);
            mesh.add_triangle(1, 2, 3);
            painter.add(mesh);
            let cap = Rect::from_min_max(air.min, pos2(air.right(), lit.top() + 0.5));
            let round = CornerRadius { nw: round.nw, ne: round.ne, sw: 0, se: 0 };
            painter.rect_filled(cap, round, c.breath);
        }
    }
    let mut lowest = f32::INFINITY;
    // Between two dynamics.
    let steps = reading.marks.windows(2).filter(|pair| pair.iter().all(|mark| mark.is_dynamic));
    let step = steps.map(|pair| y(pair[0].at) - y(pair[1].at)).fold(f32::INFINITY, f32::min);
    let is_low = step < LINE * grown;
    let has_dynamics = reading.marks.iter().any(|mark| mark.is_dynamic);
    for mark in &reading.marks {
        let is_word = match mark.is_dynamic {
            true => !is_low || ["pp", "mf", "ff"].contains(&mark.name),
            // Beside *pp* there is no room; the tip says what the line means.
            false => !has_dynamics,
        };
        let reach = if mark.is_dynamic { 4.0 } else { 7.0 };
        let from = if mark.is_dynamic { column.right() } else { column.left() - 4.0 };
        let line = Stroke::new(if mark.is_dynamic { 1.0 } else { 2.0 }, mark.colour);
        painter.hline(from..=column.right() + reach, y(mark.at), line);
        if !is_word {
            continue;
        }
        let is_reached = reading.level >= mark.at - 0.02;
        let ink = match (mark.is_dynamic, is_reached) {
            (true, true) => c.ink,
            (true, false) => c.quiet,
            (false, _) => mark.colour,
        };
        let font = if mark.is_dynamic { FontId::proportional(15.0 * grown) } else { small.clone() };
        let text_y = y(mark.at).min(lowest - 15.0 * grown);
        lowest = text_y;
        let at = pos2(column.right() + reach + 4.0, text_y);
        if mark.is_dynamic {
            let job = italics(mark.name, font, ink);
            let galley = painter.layout_job(job);
            painter.galley(at - vec2(0.0, 0.5 * galley.size().y), galley, ink);
        } else {
            painter.text(at, Align2::LEFT_CENTER, mark.name, font, ink);
        }
    }
    let source =
        snapshot.sources.iter().find(|source| source.is_live).map_or("Breath", |source| source.input.title());
    let at = pos2(rect.left() + 10.0, rect.bottom() - 4.0);
    let name = painter.layout(source.to_owned(), small, c.quiet, rect.width() - 10.0);
    painter.galley(at - vec2(0.0, name.size().y), name, c.quiet);
    let (told, more) = match has_dynamics {
        true => (format!("{}, from {source}", reading.word), "The note speaks from the green line on."),
        false => (
            format!("Mouth pressure {:.2} kPa, {}, from {source}", snapshot.mouth_now_kpa(), reading.word),
            "",
        ),
    };
    response.widget_info(|| WidgetInfo::labeled(Role::Meter, true, &told));
    response.on_hover_text_at_pointer(format!("{told}\n{more}").trim_end());
}

/// Slanted, as dynamics are printed.
fn italics(text: &str, font: FontId, ink: Color32) -> egui::text::LayoutJob {
    let format = egui::TextFormat { font_id: font, color: ink, italics: true, ..Default::default() };
    egui::text::LayoutJob::single_section(text.to_owned(), format)
}

/// Where the breath is a dynamic.
fn played(snapshot: &Snapshot, dynamic: Option<f32>, c: &Colours) -> Reading {
    let height = |dynamic: f32| BELOW + (1.0 - BELOW - 0.03) * dynamic;
    let kpa = snapshot.mouth_now_kpa();
    // The pressure at which the note speaks, with the lip as it is now.
    let speaks_kpa = snapshot.marks().speaks_kpa.unwrap_or(0.0);
    let is_above = kpa >= 0.98 * speaks_kpa && kpa > NO_BREATH_KPA;
    let (level, word) = match dynamic {
        Some(dynamic) if is_above => (height(dynamic), nearest(dynamic).to_owned()),
        _ if kpa > NO_BREATH_KPA && speaks_kpa > 0.0 => {
            (BELOW * (kpa / speaks_kpa).min(1.0), "below the note".to_owned())
        }
        _ => (0.0, "at rest".to_owned()),
    };
    let mut marks =
        vec![MeterMark { at: BELOW - 0.012, name: "speaks", colour: c.speaks, is_dynamic: false }];
    let names =
        NAMED.map(|(name, at)| MeterMark { at: height(at as f32), name, colour: c.quiet, is_dynamic: true });
    marks.extend(names);
    Reading { level, marks, word }
}

/// The name of the nearest dynamic.
fn nearest(dynamic: f32) -> &'static str {
    let distance = |of: &(&str, f64)| (of.1 - f64::from(dynamic)).abs();
    NAMED.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).map_or("", |of| of.0)
}

/// Where the breath is a pressure.
fn physical(snapshot: &Snapshot, c: &Colours) -> Reading {
    let full = breath_meter::full_kpa(snapshot);
    let kpa = snapshot.mouth_now_kpa();
    let known = breath_meter::marks(snapshot, c).into_iter().filter(|mark| mark.0 <= full);
    let marks = known.map(|(at, name, colour)| MeterMark { at: at / full, name, colour, is_dynamic: false });
    let (word, _) = breath_meter::state(&snapshot.marks(), kpa, c);
    Reading { level: chart::share(kpa / full), marks: marks.collect(), word: word.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dynamics_have_the_names_that_musicians_use() {
        for (dynamic, name) in [(0.0, "pp"), (0.09, "pp"), (0.28, "p"), (0.6, "mf"), (0.83, "f"), (1.0, "ff")]
        {
            assert_eq!(nearest(dynamic), name);
        }
        assert!(NAMED.is_sorted_by(|a, b| a.1 < b.1));
    }
}
