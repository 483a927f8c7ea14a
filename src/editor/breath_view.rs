//! The breath view: mouth pressure, its sources, and its history.

mod breath_curve;
mod linked_table;

use egui::{Align2, CornerRadius, FontId, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use crate::controllers::breath_input::BreathInput;
use crate::editor::breath_meter;
use crate::editor::breath_meter::NamedMark;
use crate::editor::chart;
use crate::editor::chart::Chart;
use crate::editor::controls::{Hands, choice, heading, momentary, slider, switch};
use crate::editor::snapshot::{BreathSource, MicrophoneState, Snapshot};
use crate::editor::theme;
use crate::editor::theme::{Colours, GAP, panel};
use breath_curve::{BreathHistogram, OfSource};
use chalumeau_core::control::wind::{LEAST_FLOOR_DBFS, MOST_FLOOR_DBFS, OVER_ROOM_DB};
use chalumeau_core::instrument::BreathResponse;

/// What the view remembers.
#[derive(Clone, Debug, Default)]
pub struct BreathView {
    /// Least and greatest value of each source while the window was open; `None` for those that sent none.
    ranges: [Option<(f32, f32)>; BreathInput::ALL.len()],
    /// What each source has sent while it was live.
    histograms: [BreathHistogram; BreathInput::ALL.len()],
    /// When the sources were looked at last, s.
    looked_s: Option<f64>,
    /// Least and greatest breath since *Calibrate* was pressed; none while it is not on. Both are `None` until the player blows.
    calibration: Option<Option<(f32, f32)>>,
}

impl BreathView {
    /// Draws the view.
    pub fn draw(&mut self, ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot) {
        let mut with = (self, hands);
        crate::editor::beside(
            ui,
            "breath",
            &mut with,
            |ui, (this, hands)| this.pictures(ui, hands, snapshot),
            |ui, (this, hands)| this.column(ui, hands, snapshot),
        );
    }

    /// Updates the ranges and histograms of the sources, at a time in s.
    pub fn look(&mut self, sources: &[BreathSource], now_s: f64) {
        let passed_s =
            self.looked_s.replace(now_s).map_or(0.0, |before_s| (now_s - before_s).max(0.0)) as f32;
        self.histograms.iter_mut().for_each(|histogram| histogram.fade(passed_s));
        for source in sources.iter().filter(|source| source.is_seen) {
            let value = chart::share(source.value);
            let range = &mut self.ranges[source.input as usize];
            *range = Some(range.map_or((value, value), |(low, high)| (low.min(value), high.max(value))));
            if source.is_live {
                self.histograms[source.input as usize].add(value, passed_s);
                if let Some(range) = self.calibration.as_mut().filter(|_| value > 0.0) {
                    let (low, high) = range.unwrap_or((value, value));
                    *range = Some((low.min(value), high.max(value)));
                }
            }
        }
    }

    fn column(&mut self, ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot) {
        let c = Colours::here(ui);
        linked_table::choose_device(ui, hands);
        heading(ui, "Breath sources");
        choice(ui, hands, "bfrom");
        let mut may_calibrate = snapshot.knob.is_live || hands.step("knob") > 0;
        for source in &snapshot.sources {
            meter_of(ui, source, self.ranges[source.input as usize]);
            if source.input == BreathInput::Knob && may_calibrate {
                may_calibrate = false;
                calibrate(ui, hands);
            }
        }
        if snapshot.sources.is_empty() {
            ui.label("No source has sent a value yet. Key velocity sets the breath.");
        }
        // Under the meters: who has just plugged in a controller looks there.
        if hands.step("resp") == PLAYED {
            self.calibrate_breath(ui, hands, snapshot);
        }
        if may_calibrate {
            heading(ui, "Calibrate the knob");
            calibrate(ui, hands);
        }
        heading(ui, "Microphone");
        switch(ui, hands, "mic");
        let is_on = hands.step("mic") == 1;
        ui.add_enabled_ui(is_on, |ui| momentary(ui, hands, "miccal", "Measure the room"));
        let said = microphone_line(is_on, snapshot.microphone);
        let ink = if said.1 { c.danger } else { c.quiet };
        ui.label(egui::RichText::new(said.0).font(theme::small()).color(ink));
        heading(ui, "Response");
        choice(ui, hands, "resp");
        for id in ["breath", "bcurve"] {
            slider(ui, hands, id);
        }
        if let Some(of) = OfSource::live(hands, snapshot).filter(OfSource::is_own) {
            let said = format!("{} has its own curve, in the picture.", of.title());
            ui.label(egui::RichText::new(said).font(theme::small()).color(c.quiet));
        }
        for id in ["bsoft", "bloud", "bdead", "full", "curve"] {
            slider(ui, hands, id);
        }
        heading(ui, "Articulation");
        choice(ui, hands, "attack");
        for id in [
            "tongue", "legato", "gliss", "scoop", "scoops", "fall", "falls", "slap", "noise", "bin",
            "ksound", "life",
        ] {
            slider(ui, hands, id);
        }
        switch(ui, hands, "altf");
        choice(ui, hands, "keysw");
        heading(ui, "Vibrato");
        for id in ["vib", "vibhz", "vibon", "vibun"] {
            slider(ui, hands, id);
        }
        choice(ui, hands, "wheel");
        heading(ui, "Techniques");
        slider(ui, hands, "growl");
        choice(ui, hands, "growlp");
        for id in ["growli", "growlf", "flut", "fluthz", "subt", "tract", "tractp"] {
            slider(ui, hands, id);
        }
        linked_table::draw(ui, hands);
    }
}

/// What the microphone does, in one line, and whether that asks for something.
fn microphone_line(is_on: bool, state: MicrophoneState) -> (String, bool) {
    match state {
        _ if !is_on => ("Switch it on, then measure the room.".to_owned(), false),
        MicrophoneState::Off => ("Waiting for the host to play.".to_owned(), false),
        MicrophoneState::Unconnected => ("Nothing comes in: no microphone is connected.".to_owned(), true),
        MicrophoneState::Measuring { left_s } => (format!("Keep quiet: {left_s:.1} s left."), false),
        MicrophoneState::Listening { floor_dbfs } if floor_dbfs >= MOST_FLOOR_DBFS => {
            ("The room is too loud to blow over it. Lower the gain, and measure again.".to_owned(), true)
        }
        MicrophoneState::Listening { floor_dbfs } => {
            let below = if floor_dbfs <= LEAST_FLOOR_DBFS { " or less" } else { "" };
            let softest = f64::from(floor_dbfs) + OVER_ROOM_DB;
            (format!("Room: {floor_dbfs:.0} dB{below}. Blow louder than {softest:.0} dB."), false)
        }
    }
}

/// The first choice of the breath response.
const PLAYED: usize = 0;
/// Least distance of the ends that are worth taking.
const LEAST_RANGE: f32 = 0.1;

impl BreathView {
    /// A button that watches the breath, and then takes its softest and its loudest as the ends of the curve.
    fn calibrate_breath(&mut self, ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot) {
        let is_keys =
            snapshot.sources.iter().any(|source| source.is_live && source.input == BreathInput::Keys);
        let (name, word) = match self.calibration {
            None if is_keys => {
                ("Calibrate", "Move a breath source first: the keys' velocity needs no calibration.")
            }
            None => ("Calibrate", "Press, then play a note from as soft to as loud as you like to blow."),
            Some(None) => {
                ("Done", "Play a note from as soft to as loud as you like to blow, then press Done.")
            }
            Some(Some(_)) => ("Done", "Go on, or press Done to take these ends."),
        };
        ui.add_space(2.0);
        let button = ui.add_enabled(!is_keys || self.calibration.is_some(), egui::Button::new(name));
        if button.clicked() {
            self.calibration = match self.calibration.take() {
                None => Some(None),
                Some(range) => {
                    let of = OfSource::live(hands, snapshot);
                    if let Some((low, high)) = range.filter(|(low, high)| high - low >= LEAST_RANGE)
                        && !of.is_some_and(|of| {
                            of.change(hands, |own| (own.softest, own.loudest) = (low, high))
                        })
                    {
                        let value =
                            |id, share: f32| hands.controls.parse(id, &format!("{} %", 100.0 * share));
                        let ends = [("bsoft", value("bsoft", low)), ("bloud", value("bloud", high))];
                        let ends: Vec<_> =
                            ends.into_iter().filter_map(|(id, value)| Some((id, value?))).collect();
                        hands.put_all(&ends);
                    }
                    None
                }
            };
        }
        let said = match self.calibration {
            Some(Some((low, high))) => format!("{:.0} to {:.0} %. {word}", 100.0 * low, 100.0 * high),
            _ => word.to_owned(),
        };
        let c = Colours::here(ui);
        ui.label(egui::RichText::new(said).font(theme::small()).color(c.quiet));
    }

    fn pictures(&mut self, ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot) {
        let c = Colours::here(ui);
        let height = ui.available_height();
        ui.spacing_mut().item_spacing.y = GAP;
        let is_played = snapshot.settings.breath_response == BreathResponse::Played;
        panel(c).show(ui, |ui| {
            ui.set_width(ui.available_width());
            if is_played {
                ui.set_height((0.5 * height - 24.0).clamp(120.0, 320.0));
                let live = snapshot
                    .sources
                    .iter()
                    .find(|source| source.is_live && source.input != BreathInput::Keys);
                let input = live.map_or(BreathInput::Keys, |source| source.input);
                breath_curve::draw(ui, hands, snapshot, &self.histograms[input as usize], live);
            } else {
                ui.set_height((0.42 * height - 24.0).clamp(96.0, 230.0));
                gauge(ui, snapshot);
            }
        });
        panel(c).show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.set_height(ui.available_height());
            history(ui, snapshot);
        });
    }
}

/// Where the knob rests, and how far a full blow is.
fn calibrate(ui: &mut Ui, hands: &mut Hands) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        ui.spacing_mut().button_padding.x = 8.0;
        momentary(ui, hands, "rest", "Rest here");
        momentary(ui, hands, "blow", "Blow hard here");
    });
    ui.add_space(2.0);
}

/// Mouth pressure from left to right.
fn gauge(ui: &mut Ui, snapshot: &Snapshot) {
    let c = Colours::here(ui);
    let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::hover());
    let painter = ui.painter();
    let full = breath_meter::full_kpa(snapshot);
    let kpa = snapshot.mouth_now_kpa();
    let all = snapshot.marks();
    let (word, colour) = breath_meter::state(&all, kpa, c);
    let number = painter.text(
        rect.left_top() - vec2(0.0, 6.0),
        Align2::LEFT_TOP,
        format!("{kpa:.2} kPa"),
        FontId::proportional(28.0),
        c.ink,
    );
    painter.text(
        number.right_center() + vec2(14.0, 2.0),
        Align2::LEFT_CENTER,
        word,
        theme::heading(),
        colour,
    );
    let gamma = if all.closes_kpa > 0.0 { kpa / all.closes_kpa } else { 0.0 };
    let share = format!("\u{3b3} = {gamma:.2} of closing pressure");
    painter.text(rect.right_top(), Align2::RIGHT_TOP, share, theme::small(), c.quiet);

    let bar =
        Rect::from_min_max(pos2(rect.left(), rect.top() + 58.0), pos2(rect.right(), rect.bottom() - 18.0));
    let x = |kpa: f32| bar.left() + (kpa / full).clamp(0.0, 1.0) * bar.width();
    let round = CornerRadius::same(theme::SMALL_RADIUS);
    painter.rect_filled(bar, round, c.raised);
    let speaks = all.speaks_kpa.unwrap_or(all.closes_kpa);
    let beats = all.beats_kpa.unwrap_or(all.closes_kpa).max(speaks);
    let end = all.chokes_kpa.unwrap_or(full).min(full);
    for (from, to, colour) in breath_meter::bands(speaks, beats, all.closes_kpa, end, c) {
        let band = Rect::from_min_max(pos2(x(from), bar.top()), pos2(x(to), bar.bottom()));
        painter.rect_filled(band, CornerRadius::ZERO, colour);
    }
    let air = Rect::from_min_max(bar.min, pos2(x(kpa), bar.bottom()));
    painter.rect_filled(air.shrink2(vec2(0.0, 0.18 * bar.height())), round, c.breath.gamma_multiply(0.85));
    painter.vline(x(kpa), bar.y_range(), Stroke::new(2.0, c.ink));
    let mut end_of_last = f32::NEG_INFINITY;
    for (at, name, colour) in breath_meter::marks(snapshot, c).into_iter().filter(|mark| mark.0 <= full) {
        painter.vline(x(at), bar.top() - 4.0..=bar.bottom(), Stroke::new(1.5, colour));
        let text = format!("{name} {at:.2}");
        let galley = painter.layout_no_wrap(text, theme::small(), colour);
        // A second line where the first is taken.
        let left = (x(at) - 0.5 * galley.size().x).min(bar.right() - galley.size().x).max(bar.left());
        let y = if left < end_of_last + 6.0 { bar.top() - 28.0 } else { bar.top() - 17.0 };
        if y > bar.top() - 20.0 {
            end_of_last = left + galley.size().x;
        }
        painter.galley(pos2(left, y), galley, colour);
    }
    let step = if full > 12.0 { 2.0 } else { 1.0 };
    let ticks = (0..=(full / step) as usize).map(|n| n as f32 * step);
    for at in ticks {
        painter.vline(x(at), bar.bottom()..=bar.bottom() + 4.0, Stroke::new(1.0, c.quiet));
        painter.text(
            pos2(x(at), bar.bottom() + 5.0),
            Align2::CENTER_TOP,
            format!("{at:.0}"),
            theme::small(),
            c.quiet,
        );
    }
    response.widget_info(|| WidgetInfo::labeled(Role::Meter, true, format!("Breath {kpa:.2} kPa, {word}")));
    response.on_hover_text_at_pointer(breath_meter::LEGEND);
}

/// Height of a word in a chart, points, with what the chart needs for its edge.
const WORD_HEIGHT: f32 = 20.0;

fn history(ui: &mut Ui, snapshot: &Snapshot) {
    let c = Colours::here(ui);
    let track = &snapshot.history;
    let seconds = f64::from(track.step_s) * track.kpa.len().saturating_sub(1) as f64;
    if track.kpa.len() < 2 {
        let rect = ui.available_rect_before_wrap();
        chart::empty(ui, rect, "Your breath appears here when you blow.");
        return;
    }
    let full = f64::from(breath_meter::full_kpa(snapshot));
    let time = |n: usize| f64::from(track.step_s) * n as f64 - seconds;
    let height = ui.available_height();
    Chart {
        id: "breath history",
        x: (-seconds, 0.0),
        y: (0.0, full),
        x_name: "seconds ago",
        y_name: "mouth pressure, kPa",
        height,
        label: "Mouth pressure of the last seconds",
    }
    .show(ui, |plot| {
        let marks: Vec<_> = track.marks.iter().map(|marks| breath_meter::named(marks, c)).collect();
        draw_marks(plot, &marks, time, (full, f64::from(height)));
        let points = track.kpa.iter().enumerate().map(|(n, &kpa)| [time(n), f64::from(kpa)]);
        plot.line(chart::curve(points.collect(), c.breath, 2.0).fill(0.0).fill_alpha(0.15).id("breath"));
    });
}

/// Lines of the marks at each time: notes have different ones, and some notes lack some. Words are where a line begins first.
fn draw_marks(
    plot: &mut egui_plot::PlotUi<'_>,
    marks: &[[NamedMark; 4]],
    time: impl Fn(usize) -> f64,
    (full, height): (f64, f64),
) {
    let mut words = Vec::new();
    for mark in 0..4 {
        let has = |n: &usize| marks[*n][mark].0.is_some();
        let times: Vec<usize> = (0..marks.len()).collect();
        let stretches = times.chunk_by(|a, b| has(a) == has(b)).filter(|times| times.iter().all(has));
        for (index, times) in stretches.enumerate() {
            let at = |&n: &usize| Some([time(n), f64::from(marks[n][mark].0?)]);
            let points: Vec<[f64; 2]> = times.iter().filter_map(at).collect();
            let ((_, name, colour), first) = (marks[times[0]][mark], points[0]);
            let line = chart::curve(points, colour, 1.0).id(("mark", mark, index));
            plot.line(line.style(egui_plot::LineStyle::dashed_loose()));
            if index == 0 && first[1] < full {
                words.push((first, name, colour));
            }
        }
    }
    // From the top: each above its line where there is room, and below the word before it.
    let word_kpa = f64::from(WORD_HEIGHT) * full / height;
    words.sort_by(|(a, ..), (b, ..)| b[1].total_cmp(&a[1]));
    let mut room = full;
    for ([time, kpa], name, colour) in words {
        // "speaks" and "beats" are neighbours: one below its line, one above.
        let above = if name == "speaks" { kpa } else { kpa + word_kpa };
        let top = if above > room { room.min(kpa) } else { above };
        room = top - word_kpa;
        chart::word(plot, [time, top], Align2::LEFT_TOP, &format!(" {name}"), colour);
    }
}

/// A source, with the range it has gone through.
fn meter_of(ui: &mut Ui, source: &BreathSource, range: Option<(f32, f32)>) {
    let c = Colours::here(ui);
    let size = vec2(ui.available_width(), if source.is_seen { 28.0 } else { 18.0 });
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let painter = ui.painter();
    let ink = if source.is_live { c.ink } else { c.quiet };
    let dot = pos2(rect.left() + 5.0, rect.top() + 8.0);
    if source.is_live {
        painter.circle_filled(dot, 4.0, c.breath);
    } else {
        painter.circle_stroke(dot, 3.5, Stroke::new(1.0, c.quiet));
    }
    let at = pos2(rect.left() + 15.0, rect.top() + 8.0);
    painter.text(at, Align2::LEFT_CENTER, source.input.title(), theme::body(), ink);
    let value = chart::share(source.value);
    let state = if source.is_seen { format!("{:.0} %", 100.0 * value) } else { "not seen".to_owned() };
    // Beside the longest name there is no room for words in a narrow column.
    let short = if source.is_seen || rect.width() > 190.0 { &*state } else { "\u{2013}" };
    painter.text(pos2(rect.right(), rect.top() + 8.0), Align2::RIGHT_CENTER, short, theme::small(), ink);
    if source.is_seen {
        let bar =
            Rect::from_min_max(pos2(rect.left(), rect.bottom() - 9.0), rect.right_bottom() - vec2(0.0, 4.0));
        let x = |unit: f32| bar.left() + unit * bar.width();
        painter.rect_filled(bar, CornerRadius::same(2), c.raised);
        let fill = if source.is_live { c.breath } else { c.chokes };
        let now = Rect::from_min_max(bar.min, pos2(x(value), bar.bottom()));
        painter.rect_filled(now, CornerRadius::same(2), fill);
        for end in range.into_iter().flat_map(|(low, high)| [low, high]) {
            painter.vline(x(end), bar.top() - 1.0..=bar.bottom() + 2.0, Stroke::new(1.5, c.ink));
        }
    }
    let blows = if source.is_live { ", sets the breath" } else { "" };
    let went = range.filter(|_| source.is_seen).map_or_else(String::new, |(low, high)| {
        format!(", from {:.0} to {:.0} %", 100.0 * low, 100.0 * high)
    });
    response.widget_info(|| {
        WidgetInfo::labeled(Role::Meter, true, format!("{}: {state}{went}{blows}", source.input.title()))
    });
    response.on_hover_ui(|ui| {
        ui.set_max_width(280.0);
        ui.label(if source.is_live {
            "This source sets the breath. Another source takes over as soon as it moves."
        } else if source.is_seen {
            "This source has sent values. Move it, and it sets the breath."
        } else {
            "This source has sent nothing yet."
        });
        if let Some((low, high)) = range {
            let went = format!("Its values so far: {:.0} to {:.0} %.", 100.0 * low, 100.0 * high);
            ui.label(format!("{went} If a controller does not reach its ends, press Calibrate."));
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_microphone_says_what_it_does() {
        let said = |state| microphone_line(true, state);
        assert!(microphone_line(false, MicrophoneState::Unconnected).0.contains("Switch it on"));
        assert!(said(MicrophoneState::Unconnected).0.contains("no microphone is connected"));
        assert_eq!(said(MicrophoneState::Measuring { left_s: 1.25 }).0, "Keep quiet: 1.2 s left.");
        let quiet = said(MicrophoneState::Listening { floor_dbfs: LEAST_FLOOR_DBFS });
        assert_eq!(quiet, ("Room: -50 dB or less. Blow louder than -38 dB.".to_owned(), false));
        let room = said(MicrophoneState::Listening { floor_dbfs: -41.4 });
        assert_eq!(room.0, "Room: -41 dB. Blow louder than -29 dB.");
        assert!(said(MicrophoneState::Listening { floor_dbfs: MOST_FLOOR_DBFS }).1, "too loud");
    }

    #[test]
    fn a_source_is_known_by_the_range_it_went_through() {
        let mut view = BreathView::default();
        let say =
            |value, is_seen| [BreathSource { input: BreathInput::Breath, value, is_live: false, is_seen }];
        view.look(&say(0.0, false), 0.0);
        assert_eq!(view.ranges, [None; BreathInput::ALL.len()]);
        for value in [0.4, 0.1, 0.7, f32::NAN, 9.0] {
            view.look(&say(value, true), 0.1);
        }
        assert_eq!(view.ranges[BreathInput::Breath as usize], Some((0.0, 1.0)));
        assert_eq!(view.ranges.iter().flatten().count(), 1);
    }
}
