//! The sound view: spectrum with odd and even harmonics in two colours, mouthpiece pressure and reed opening.
//!
//! A closed pipe favours the odd harmonics, which is why a clarinet's low register sounds hollow; the even ones come with
//! the beating reed, the bell and the tone holes.

use chalumeau_core::instrument::ListeningMode;
use egui::Ui;
use egui_plot::Points;

use crate::editor::chart;
use crate::editor::chart::Chart;
use crate::editor::controls::{Hands, choice, heading, slider};
use crate::editor::pitch_needle::{self, NO_SOUND};
use crate::editor::snapshot::Snapshot;
use crate::editor::sound_analysis::FLOOR_DB;
use crate::editor::theme;
use crate::editor::theme::{Colours, GAP, panel};

/// Highest harmonic marked.
const HARMONICS: usize = 24;
/// Periods of the waves at most: more are too narrow to see.
const PERIODS: usize = 6;
/// Points of a spectrum at most: more would fall on one column of the screen.
const COLUMNS: usize = 700;

/// Draws the view.
pub fn draw(ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot) {
    crate::editor::beside(
        ui,
        "sound",
        hands,
        |ui, _| pictures(ui, snapshot),
        |ui, hands| column(ui, hands, snapshot),
    );
}

fn pictures(ui: &mut Ui, snapshot: &Snapshot) {
    let c = Colours::here(ui);
    let height = ui.available_height();
    ui.spacing_mut().item_spacing.y = GAP;
    panel(c).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.set_height(0.54 * height - 24.0);
        spectrum(ui, snapshot);
    });
    panel(c).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.set_height(ui.available_height());
        waves(ui, snapshot);
    });
}

fn spectrum(ui: &mut Ui, snapshot: &Snapshot) {
    let c = Colours::here(ui);
    let heard = &snapshot.heard;
    if heard.level_db.len() < 2 {
        let rect = ui.available_rect_before_wrap();
        chart::empty(ui, rect, "No sound yet. The spectrum appears here.");
        return;
    }
    let f0_hz = heard.f0_hz.map(f64::from);
    let bin_hz = f64::from(heard.bin_hz);
    let highest = bin_hz * (heard.level_db.len() - 1) as f64;
    let right = f0_hz
        .map_or(6_000.0, |f0_hz| (1e3 * (16.0 * f0_hz / 1e3).ceil()).clamp(3_000.0, 12_000.0))
        .min(highest);
    let level = |hz: f64| {
        let at = (hz / bin_hz).round() as usize;
        let around = at.saturating_sub(2)..=(at + 2).min(heard.level_db.len() - 1);
        heard
            .level_db
            .get(around)
            .map_or(f64::from(FLOOR_DB), |bins| f64::from(bins.iter().copied().fold(FLOOR_DB, f32::max)))
    };
    let transform = Chart {
        id: "spectrum",
        x: (0.0, 1e-3 * right),
        y: (-110.0, 0.0),
        x_name: "frequency, kHz",
        y_name: "level, dB of full scale",
        height: ui.available_height(),
        label: "Spectrum of the sound",
    }
    .show(ui, |plot| {
        let shown = (right / bin_hz) as usize;
        let step = shown.div_ceil(COLUMNS).max(1);
        let line: Vec<[f64; 2]> = heard.level_db[..=shown.min(heard.level_db.len() - 1)]
            .chunks(step)
            .enumerate()
            .map(|(n, bins)| {
                [1e-3 * bin_hz * (n * step) as f64, f64::from(bins.iter().copied().fold(FLOOR_DB, f32::max))]
            })
            .collect();
        plot.line(
            chart::curve(line, c.chokes.gamma_multiply(0.8), 1.0)
                .fill(-110.0)
                .fill_alpha(0.06)
                .id("spectrum"),
        );
        let Some(f0_hz) = f0_hz else { return };
        for is_odd in [true, false] {
            let colour = if is_odd { c.odd_harmonic } else { c.even_harmonic };
            let harmonics = (1..=HARMONICS).filter(|k| (k % 2 == 1) == is_odd).map(|k| k as f64 * f0_hz);
            let points: Vec<[f64; 2]> =
                harmonics.filter(|hz| *hz < right).map(|hz| [1e-3 * hz, level(hz)]).collect();
            let points = Points::new(if is_odd { "odd" } else { "even" }, points).stems(-110.0).radius(4.0);
            plot.points(points.color(colour).allow_hover(false));
        }
    });
    chart::legend(
        ui,
        &transform,
        0.02,
        &[("odd harmonics", c.odd_harmonic), ("even harmonics", c.even_harmonic)],
    );
}

fn waves(ui: &mut Ui, snapshot: &Snapshot) {
    let c = Colours::here(ui);
    let scope = &snapshot.scope;
    let count = scope.mouthpiece_kpa.len().min(scope.opening.len());
    if count < 2 || scope.rate_hz <= 0.0 {
        let rect = ui.available_rect_before_wrap();
        chart::empty(ui, rect, "No sound yet. Mouthpiece pressure and reed opening appear here.");
        return;
    }
    let shown = scope.standing_periods(snapshot.heard.f0_hz.unwrap_or(0.0), PERIODS);
    let step_ms = 1e3 / f64::from(scope.rate_hz);
    let to = step_ms * (shown.len() - 1) as f64;
    let stride = shown.len().div_ceil(COLUMNS).max(1);
    let track = |values: &[f32]| -> Vec<[f64; 2]> {
        let values = values[shown.clone()].iter().enumerate().step_by(stride);
        values.map(|(n, &value)| [step_ms * n as f64, f64::from(value)]).collect()
    };
    let largest =
        |values: &[f32], least: f64| values.iter().map(|x| f64::from(x.abs())).fold(least, f64::max);
    let mouth = f64::from(snapshot.mouth_now_kpa());
    let most = 1.15 * largest(&scope.mouthpiece_kpa, 0.5).max(mouth);
    // Two pictures where there is room for two.
    let has_gap = ui.available_height() > 150.0;
    let height = if has_gap { 0.5 * (ui.available_height() - GAP) - 10.0 } else { ui.available_height() };
    Chart {
        id: "mouthpiece wave",
        x: (0.0, to),
        y: (-most, most),
        x_name: if has_gap { "" } else { "ms" },
        y_name: "mouthpiece pressure, kPa; straight line: mouth pressure",
        height,
        label: "Pressure in the mouthpiece over time",
    }
    .show(ui, |plot| {
        plot.line(
            chart::curve(vec![[0.0, mouth], [to, mouth]], c.speaks.gamma_multiply(0.8), 1.0).id("mouth"),
        );
        plot.line(chart::curve(track(&scope.mouthpiece_kpa), c.breath, 1.6).id("wave"));
    });
    if !has_gap {
        return;
    }
    Chart {
        id: "gap",
        x: (0.0, to),
        y: (-0.25, (1.1 * largest(&scope.opening, 1.0)).max(1.2)),
        x_name: "ms",
        y_name: "reed opening over opening at rest; at 0 it is shut",
        height: ui.available_height(),
        label: "Opening of the reed over time",
    }
    .show(ui, |plot| {
        plot.line(chart::curve(vec![[0.0, 0.0], [to, 0.0]], c.closes, 1.0).id("shut"));
        plot.line(chart::curve(track(&scope.opening), c.ink, 1.6).fill(0.0).fill_alpha(0.10).id("gap"));
    });
}

fn column(ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot) {
    let c = Colours::here(ui);
    heading(ui, "Pitch");
    let width = ui.available_width();
    pitch_needle::needle(ui, snapshot, width);
    let heard = &snapshot.heard;
    let pitch = heard.f0_hz.map_or_else(|| NO_SOUND.into(), |hz| format!("{hz:.2} Hz"));
    ui.label(egui::RichText::new(pitch).color(c.quiet));
    // The line stays when the sound ends: nothing below it moves under the pointer.
    let balance =
        balance_db(&heard.harmonics_db).map_or_else(|| "\u{2013}".to_owned(), |db| format!("{db:+.0} dB"));
    let text = format!("odd over even harmonics {balance}");
    ui.label(egui::RichText::new(text).color(c.quiet)).on_hover_text(
        "Power of harmonics 1, 3, 5 ... over the power of harmonics 2, 4, 6 ...: 14 to 28 dB for a low note of a clarinet, most when it is soft; about 0 dB for a saxophone",
    );
    choice(ui, hands, "tune");
    slider(ui, hands, "a4");
    heading(ui, "Sound");
    for id in ["noise", "zeta", "lay", "vent", "gain"] {
        slider(ui, hands, id);
    }
    heading(ui, "Listening");
    choice(ui, hands, "heard");
    if snapshot.settings.listening.mode == ListeningMode::Position {
        for id in ["ldist", "langle", "lheigh", "lwidth"] {
            slider(ui, hands, id);
        }
    }
    heading(ui, "Room");
    for id in ["room", "rsize", "rdecay", "rtone"] {
        slider(ui, hands, id);
    }
    heading(ui, "Players");
    slider(ui, hands, "player");
    if hands.step("player") == 0 {
        let c = Colours::here(ui);
        let alone = "With one player, these change nothing.";
        ui.label(egui::RichText::new(alone).font(theme::small()).color(c.quiet));
    }
    choice(ui, hands, "split");
    slider(ui, hands, "spread");
    if hands.step("split") == 1 {
        slider(ui, hands, "late");
    }
    slider(ui, hands, "seats");
}

/// Power of the odd over that of the even harmonics, dB.
fn balance_db(harmonics_db: &[f32]) -> Option<f32> {
    let power =
        |from: usize| harmonics_db.iter().skip(from).step_by(2).map(|db| 10_f32.powf(0.1 * db)).sum::<f32>();
    (harmonics_db.len() >= 2).then(|| 10.0 * (power(0) / power(1).max(1e-12)).log10())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn balance_is_of_powers() {
        assert_eq!(balance_db(&[0.0]), None);
        assert!((balance_db(&[0.0, -20.0]).unwrap() - 20.0).abs() < 1e-4);
        assert!((balance_db(&[0.0, 0.0, 0.0, 0.0]).unwrap()).abs() < 1e-4);
    }
}
