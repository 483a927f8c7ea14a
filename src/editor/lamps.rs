//! Lamps and output meter of the header: whether MIDI arrives, whether breath blows, and how loud the output is.
//!
//! They answer the first questions of who hears nothing: do my keys arrive, does my breath, does it leave?

use egui::{Align2, Color32, CornerRadius, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use crate::editor::pitch_needle::NO_SOUND;
use crate::editor::snapshot::{NO_BREATH_KPA, Snapshot};
use crate::editor::theme;
use crate::editor::theme::Colours;

/// Softest output that the meter shows, dB.
const FLOOR_DB: f32 = -48.0;
/// Width of the meter and of a lamp, points, with words and where there is no room for them.
const METER: [f32; 2] = [72.0, 44.0];
/// Width of the meter's word, points.
const METER_WORD: f32 = 46.0;
const LAMP: [f32; 2] = [54.0, 12.0];
/// Time for which the highest output stays marked, s.
const HOLD_S: f64 = 1.5;

/// The highest output of the last moments, and when it was.
#[derive(Clone, Copy)]
struct Held {
    db: f32,
    at_s: f64,
}

/// Draws them from right to left, with words where there is room. A blind comparison hides the output meter, because a level would
/// tell one setting from another.
pub fn draw(ui: &mut Ui, snapshot: &Snapshot, is_wide: bool, is_blind: bool) {
    let c = Colours::here(ui);
    let narrow = usize::from(!is_wide);
    if !is_blind {
        meter(ui, snapshot, METER[narrow], is_wide);
    }
    let source = snapshot.sources.iter().find(|source| source.is_live);
    let source = source.map_or("keys", |source| source.input.title());
    let blows = snapshot.mouth_kpa > NO_BREATH_KPA;
    let about = format!("Lit while the player blows. Breath comes from: {source}");
    let word = |word| if is_wide { word } else { "" };
    lamp(ui, LAMP[narrow], word("Breath"), blows.then_some(c.breath), ["Breath blows", "No breath"], &about);
    let about = "Lit while notes or controllers arrive from the host or a MIDI input. The keys of this window do not light it.";
    let inputs = snapshot.connections.as_ref().map(|now| format!(" MIDI inputs: {}.", now.midi_line()));
    let about = format!("{about}{}", inputs.unwrap_or_default());
    lamp(
        ui,
        LAMP[narrow],
        word("MIDI"),
        snapshot.hears_midi.then_some(c.speaks),
        ["MIDI arrives", "No MIDI"],
        &about,
    );
}

fn lamp(ui: &mut Ui, width: f32, word: &str, light: Option<Color32>, said: [&str; 2], about: &str) {
    let c = Colours::here(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(width, 16.0), Sense::hover());
    let centre = pos2(rect.left() + 5.0, rect.center().y);
    let painter = ui.painter();
    match light {
        Some(colour) => painter.circle_filled(centre, 4.5, colour),
        None => painter.circle_stroke(centre, 4.0, Stroke::new(1.0, c.quiet)),
    };
    painter.text(
        pos2(rect.left() + 13.0, rect.center().y),
        Align2::LEFT_CENTER,
        word,
        theme::small(),
        c.quiet,
    );
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, said[usize::from(light.is_none())]));
    response.on_hover_text(about);
}

fn meter(ui: &mut Ui, snapshot: &Snapshot, width: f32, has_word: bool) {
    let c = Colours::here(ui);
    let word = if has_word { METER_WORD } else { 0.0 };
    let (rect, response) = ui.allocate_exact_size(vec2(word + width, 16.0), Sense::hover());
    if has_word {
        ui.painter().text(rect.left_center(), Align2::LEFT_CENTER, "Output", theme::small(), c.quiet);
    }
    let db = 20.0 * snapshot.output_peak.max(1e-6).log10();
    let now_s = ui.input(|input| input.time);
    let held = ui.data_mut(|data| {
        let held = data.get_temp_mut_or_insert_with(response.id, || Held { db: FLOOR_DB, at_s: now_s });
        if db >= held.db || now_s - held.at_s > HOLD_S {
            *held = Held { db, at_s: now_s };
        }
        *held
    });
    let track = Rect::from_center_size(rect.right_center() - vec2(0.5 * width, 0.0), vec2(width, 6.0));
    let x = |db: f32| track.left() + track.width() * ((db - FLOOR_DB) / -FLOOR_DB).clamp(0.0, 1.0);
    let round = CornerRadius::same(2);
    let painter = ui.painter();
    painter.rect_filled(track, round, c.raised);
    painter.rect_filled(Rect::from_min_max(track.min, pos2(x(db), track.bottom())), round, c.breath);
    if held.db > FLOOR_DB {
        painter.vline(x(held.db), track.y_range(), Stroke::new(2.0, c.ink));
    }
    let said = if db <= FLOOR_DB { format!("Output: {NO_SOUND}") } else { format!("Output {db:.0} dB") };
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &said));
    let goes = snapshot.connections.as_ref().map(|now| format!(". Sound goes to: {}", now.sound));
    let about = format!("{said}. The output of both channels, {FLOOR_DB:.0} to 0 dB of full scale");
    response.on_hover_text(about + &goes.unwrap_or_default());
}
