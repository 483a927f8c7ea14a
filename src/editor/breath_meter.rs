//! The breath meter of a laboratory: mouth pressure as a column, with the pressures that matter for this note.

use egui::{Align2, Color32, CornerRadius, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use crate::editor::snapshot::{NO_BREATH_KPA, PressureMarks, Snapshot};
use crate::editor::theme;
use crate::editor::theme::Colours;

/// Height of a line of small text, points.
const LINE: f32 = 15.0;
/// Height of a mark's two lines, points.
const MARK: f32 = 26.0;

/// Where the texts of marks stand, each with a line above its place and one below. `wanted`: the places of the marks, from the
/// lowest on the screen to the highest. They move up where the mark below is too near, and down where they would pass `top`.
fn text_places(wanted: &[f32], top: f32) -> Vec<f32> {
    let mut below = f32::INFINITY;
    let mut places: Vec<f32> = wanted
        .iter()
        .map(|&y| {
            below = y.min(below - MARK);
            below
        })
        .collect();
    let mut least = top;
    for place in places.iter_mut().rev() {
        *place = place.max(least);
        least = *place + MARK;
    }
    places
}

/// Top of every scale of mouth pressure, kPa: a little above what matters for this reed and note.
pub fn full_kpa(snapshot: &Snapshot) -> f32 {
    let marks = snapshot.marks();
    (1.25 * marks.closes_kpa).max(1.05 * snapshot.settings.breath_full_kpa).max(1.0)
}

/// The state of the reed at a pressure, in words, and its colour.
pub fn state(marks: &PressureMarks, kpa: f32, c: &Colours) -> (&'static str, Color32) {
    let above = |mark: Option<f32>| mark.is_some_and(|mark| kpa >= mark);
    if kpa < NO_BREATH_KPA {
        ("at rest", c.quiet)
    } else if above(marks.chokes_kpa) {
        ("shut", c.chokes)
    } else if kpa >= marks.closes_kpa {
        ("closing", c.closes)
    } else if above(marks.beats_kpa) {
        ("beating", c.beats)
    } else if above(marks.speaks_kpa) {
        ("sounding", c.speaks)
    } else {
        ("below threshold", c.breath)
    }
}

/// The marks a scale shows: pressure, word, colour; in order of pressure.
pub fn marks(snapshot: &Snapshot, c: &Colours) -> Vec<(f32, &'static str, Color32)> {
    let named = named(&snapshot.marks(), c);
    let mut all: Vec<_> =
        named.into_iter().filter_map(|(kpa, name, colour)| Some((kpa?, name, colour))).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}

/// Pressure of a mark, if the note has it, its word and its colour.
pub type NamedMark = (Option<f32>, &'static str, Color32);

/// All marks, those a note lacks as well.
pub fn named(marks: &PressureMarks, c: &Colours) -> [NamedMark; 4] {
    [
        (Some(marks.closes_kpa), "closes", c.closes),
        (marks.speaks_kpa, "speaks", c.speaks),
        (marks.beats_kpa, "beats", c.beats),
        (marks.chokes_kpa, "chokes", c.chokes),
    ]
}

/// What each mark means, for tool tips.
pub const LEGEND: &str = "speaks (p_on): the note starts to sound at this pressure, or stops.\n\
    beats: above this the reed touches the facing in each cycle, and the sound is bright.\n\
    closes: this pressure would shut a reed that does not vibrate.\n\
    chokes (p_off): above this the reed stays shut, and there is no sound.";

/// The coloured bands of a scale: lower end, upper end, colour.
pub fn bands(speaks: f32, beats: f32, closes: f32, end: f32, c: &Colours) -> [(f32, f32, Color32); 3] {
    let closes = closes.max(beats).min(end.max(beats));
    [(speaks, beats, c.speaks), (beats, closes, c.beats), (closes, end.max(closes), c.closes)]
        .map(|(from, to, colour)| (from, to, colour.gamma_multiply(0.14)))
}

/// The column, as high as its place.
pub fn column(ui: &mut Ui, snapshot: &Snapshot) {
    let c = Colours::here(ui);
    let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::hover());
    let full = full_kpa(snapshot);
    let kpa = snapshot.mouth_now_kpa();
    let marks_of = snapshot.marks();
    let (word, colour) = state(&marks_of, kpa, c);

    let painter = ui.painter();
    painter.text(
        rect.center_top(),
        Align2::CENTER_TOP,
        format!("{kpa:.2}"),
        egui::FontId::proportional(22.0),
        c.ink,
    );
    painter.text(rect.center_top() + vec2(0.0, 24.0), Align2::CENTER_TOP, "kPa", theme::small(), c.quiet);
    painter.text(rect.center_bottom(), Align2::CENTER_BOTTOM, word, theme::small(), colour);

    let scale =
        Rect::from_min_max(rect.left_top() + vec2(4.0, 44.0), pos2(rect.left() + 26.0, rect.bottom() - 20.0));
    let y = |kpa: f32| scale.bottom() - (kpa / full).clamp(0.0, 1.0) * scale.height();
    let round = CornerRadius::same(theme::SMALL_RADIUS);
    painter.rect_filled(scale, round, c.raised);
    // Where the note sounds, and where it beats: faint, so that the breath stands out.
    let speaks = marks_of.speaks_kpa.unwrap_or(marks_of.closes_kpa);
    let beats = marks_of.beats_kpa.unwrap_or(marks_of.closes_kpa).max(speaks);
    let end = marks_of.chokes_kpa.unwrap_or(full).min(full);
    for (from, to, colour) in bands(speaks, beats, marks_of.closes_kpa, end, c) {
        let band = Rect::from_min_max(pos2(scale.left(), y(to)), pos2(scale.right(), y(from)));
        painter.rect_filled(band, CornerRadius::ZERO, colour);
    }
    let air = Rect::from_min_max(pos2(scale.left(), y(kpa)), scale.right_bottom());
    painter.rect_filled(air, round, c.breath.gamma_multiply(0.85));
    painter.rect_stroke(scale, round, Stroke::new(1.0, c.line), egui::StrokeKind::Inside);

    let shown: Vec<_> = marks(snapshot, c).into_iter().filter(|mark| mark.0 <= full).collect();
    let wanted: Vec<f32> = shown.iter().map(|mark| y(mark.0)).collect();
    // The upper line of the highest stays below the unit.
    let places = text_places(&wanted, rect.top() + 24.0 + LINE + LINE);
    for ((at, name, colour), text_y) in shown.into_iter().zip(places) {
        painter.hline(scale.left()..=scale.right() + 5.0, y(at), Stroke::new(1.5, colour));
        let place = pos2(scale.right() + 8.0, text_y);
        painter.text(place, Align2::LEFT_BOTTOM, name, theme::small(), colour);
        painter.text(place - vec2(0.0, 1.0), Align2::LEFT_TOP, format!("{at:.2}"), theme::small(), c.quiet);
    }
    painter.hline(scale.left() - 3.0..=scale.right() + 3.0, y(kpa), Stroke::new(2.0, c.ink));
    response.widget_info(|| {
        WidgetInfo::labeled(Role::Meter, true, format!("Mouth pressure {kpa:.2} kPa, {word}"))
    });
    response.on_hover_text_at_pointer(format!("Mouth pressure, kilopascal.\n{LEGEND}"));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_texts_of_marks_keep_clear_of_each_other_and_of_the_unit() {
        assert_eq!(text_places(&[300.0, 200.0], 50.0), [300.0, 200.0], "where there is room");
        for wanted in [&[45.0_f32][..], &[110.0, 100.0, 48.0, 44.0], &[310.0, 305.0, 300.0, 60.0]] {
            let places = text_places(wanted, 54.0);
            assert!(places.iter().all(|&place| place >= 54.0), "{places:?}");
            assert!(places.windows(2).all(|pair| pair[0] - pair[1] >= MARK), "{places:?}");
        }
    }
}
