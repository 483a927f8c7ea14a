//! The way from breath to dynamic as a curve over what the live source has sent, with handles at both ends and in the middle. A
//! source may have a curve of its own; all others share the one of the parameters.

use egui::{Align2, CornerRadius, Rect, Response, RichText, Sense, Stroke, Ui, pos2, vec2};

use crate::controllers::breath_input::BreathInput;
use crate::controllers::source_curves::{CurveSource, SourceCurve};
use crate::editor::chart;
use crate::editor::controls::{Hands, handle, teach};
use crate::editor::snapshot::{BreathSource, Snapshot};
use crate::editor::theme;
use crate::editor::theme::{Colours, SMALL_RADIUS};
use chalumeau_core::instrument::Settings;
use chalumeau_core::instrument::player::dynamics::MEZZO_FORTE;
use chalumeau_core::instrument::player::response::dynamic;

/// Columns of the histogram: as many as a controller has values.
const COLUMNS: usize = 128;
/// Points of the curve.
const POINTS: usize = 96;
/// Time constant with which columns fade, s: after half a minute a twelfth is left.
const FADES_S: f32 = 12.0;
/// A look counts for this long at most, s: what the source has sent while nobody looked is not known.
const LONGEST_S: f32 = 0.25;
/// A source that has stayed at one value for this long makes its column as tall as any, s.
const FULL_S: f32 = 0.5;
/// Height of the tallest column over that of the chart.
const TALLEST: f32 = 0.45;

/// For how long the live source has had each value, s.
#[derive(Clone, Debug)]
pub struct BreathHistogram {
    columns: [f32; COLUMNS],
}

impl Default for BreathHistogram {
    fn default() -> Self {
        Self { columns: [0.0; COLUMNS] }
    }
}

impl BreathHistogram {
    /// So many seconds have passed.
    pub fn fade(&mut self, passed_s: f32) {
        let left = (-passed_s / FADES_S).exp();
        self.columns.iter_mut().for_each(|column| *column *= left);
    }

    /// The source has had this value, 0..=1, for so many seconds. Rest is not counted: it would hide all else.
    pub fn add(&mut self, value: f32, passed_s: f32) {
        let value = chart::share(value);
        if value > 0.0 {
            self.columns[(value * (COLUMNS - 1) as f32).round() as usize] += passed_s.min(LONGEST_S);
        }
    }

    /// The columns over the tallest one, with their places, 0..=1.
    fn heights(&self) -> impl Iterator<Item = (f32, f32)> {
        let tallest = self.columns.iter().copied().fold(FULL_S, f32::max);
        let place = |at: usize| at as f32 / (COLUMNS - 1) as f32;
        self.columns.iter().enumerate().map(move |(at, &count)| (place(at), count / tallest))
    }
}

/// The source that blows, if it may have its own curve here, and that curve.
#[derive(Clone, Copy, Debug)]
pub struct OfSource {
    input: BreathInput,
    source: CurveSource,
    own: Option<SourceCurve>,
}

impl OfSource {
    /// Of the live source.
    pub fn live(hands: &Hands, snapshot: &Snapshot) -> Option<Self> {
        let curves = hands.controls.curves()?;
        let live = snapshot.sources.iter().find(|source| source.is_live)?;
        let source = CurveSource::of(live.input)?;
        Some(Self { input: live.input, source, own: curves.get(source) })
    }

    /// Whether it has its own curve.
    pub fn is_own(&self) -> bool {
        self.own.is_some()
    }

    /// Its name.
    pub fn title(&self) -> &'static str {
        self.input.title()
    }

    /// Changes its own curve; whether it has one.
    pub fn change(&self, hands: &Hands, change: impl FnOnce(&mut SourceCurve)) -> bool {
        let (Some(mut own), Some(curves)) = (self.own, hands.controls.curves()) else { return false };
        change(&mut own);
        curves.put(self.source, Some(own));
        true
    }

    /// A button that gives it its own curve, or the common one again.
    fn offer(&self, ui: &mut Ui, hands: &Hands, settings: &Settings, rect: Rect) {
        let text = RichText::new(format!("Own curve for {}", self.title())).font(theme::small());
        let button = egui::Button::selectable(self.is_own(), text)
            .frame_when_inactive(true)
            .wrap_mode(egui::TextWrapMode::Extend);
        let size = vec2(220.0_f32.min(0.62 * rect.width()), 22.0);
        let place = Rect::from_min_size(pos2(rect.right() - size.x, rect.top() - 4.0), size);
        let about = "On: this source has a curve of its own. Off: it has the curve that all sources share.";
        if ui.put(place, button).on_hover_text(about).clicked()
            && let Some(curves) = hands.controls.curves()
        {
            let own = (!self.is_own()).then(|| SourceCurve::common(settings));
            curves.put(self.source, own);
        }
    }
}

/// Draws the curve into all of the place. `live`: the source that blows, if it is not the keys.
pub fn draw(
    ui: &mut Ui,
    hands: &mut Hands,
    snapshot: &Snapshot,
    histogram: &BreathHistogram,
    live: Option<&BreathSource>,
) {
    let c = Colours::here(ui);
    let of = live.and_then(|_| OfSource::live(hands, snapshot));
    let own = of.and_then(|of| of.own);
    let settings = own.map_or_else(|| snapshot.settings.clamped(), |own| own.over(&snapshot.settings));
    let breath = live.map(|source| source.value);
    let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::hover());
    // The upper handle stays clear of the button of an own curve.
    let top = if of.is_some() { 36.0 } else { 20.0 };
    let frame = Rect::from_min_max(rect.min + vec2(26.0, top), rect.max - vec2(10.0, 38.0));
    let x = |breath: f32| frame.left() + breath * frame.width();
    let y = |dynamic: f32| frame.bottom() - dynamic * frame.height();
    let at = |breath: f32| pos2(x(breath), y(level(breath, &settings)));
    let painter = ui.painter();
    painter.text(rect.left_top(), Align2::LEFT_TOP, "From breath to loudness", theme::small(), c.quiet);
    painter.rect_filled(frame, CornerRadius::same(SMALL_RADIUS), c.raised);
    let mf = MEZZO_FORTE as f32;
    for (at, name) in [(0.0, "pp"), (mf, "mf"), (1.0, "ff")] {
        painter.hline(frame.x_range(), y(at), Stroke::new(1.0, c.grid));
        painter.text(pos2(frame.left() - 6.0, y(at)), Align2::RIGHT_CENTER, name, theme::small(), c.quiet);
    }
    let column = frame.width() / COLUMNS as f32;
    for (place, height) in histogram.heights().filter(|(_, height)| *height > 0.0) {
        let top = pos2(x(place) - 0.5 * column, y(TALLEST * height));
        let bar = Rect::from_min_max(top, pos2(top.x + column, frame.bottom())).intersect(frame);
        painter.rect_filled(bar, CornerRadius::ZERO, c.breath.gamma_multiply(0.35));
    }
    let points: Vec<_> = (0..=POINTS).map(|n| at(n as f32 / POINTS as f32)).collect();
    painter.line(points, Stroke::new(2.0, c.ink));
    for (percent, anchor) in [(0, Align2::LEFT_TOP), (50, Align2::CENTER_TOP), (100, Align2::RIGHT_TOP)] {
        let place = pos2(x(percent as f32 / 100.0), frame.bottom() + 23.0);
        painter.text(place, anchor, format!("{percent} %"), theme::small(), c.quiet);
    }
    // The velocity of a key chooses the dynamic without the curve.
    if let Some(dynamic) = snapshot.dynamic.filter(|_| live.is_none() && snapshot.sounding.is_some()) {
        let at = y(chart::share(dynamic));
        painter.hline(frame.x_range(), at, Stroke::new(1.5, c.breath));
        let place = pos2(frame.left() + 6.0, at);
        painter.text(place, Align2::LEFT_BOTTOM, "keys", theme::small(), c.breath);
    }
    if let Some(breath) = breath.map(chart::share) {
        painter.vline(x(breath), y(level(breath, &settings))..=frame.bottom(), Stroke::new(1.0, c.breath));
        painter.circle_filled(at(breath), 5.0, c.breath);
    }
    if let Some(of) = of {
        of.offer(ui, hands, &snapshot.settings, rect);
    }
    let (softest, loudest) = (settings.breath_softest, settings.breath_loudest);
    let middle = 0.5 * (softest + loudest);
    let painter = ui.painter();
    let speaks = pos2(x(softest), frame.bottom() + 11.0);
    painter.text(speaks + vec2(14.0, 2.0), Align2::LEFT_CENTER, "softest", theme::small(), c.speaks);
    let word = "Drag the ends to what your controller sends when you play softest and loudest, and the middle to bend the curve. Blue: what it has sent. Keys play without the curve: a blue line shows how loud.";
    response.on_hover_text_at_pointer(word);
    let (end, to) = handle(ui, "Curve: where notes begin", speaks, "");
    let hand = Hand { of, id: "bsoft" };
    hand.drag(hands, &end, to.map(|to| share_of(frame, to.x)));
    end.on_hover_ui(|ui| teach(ui, "bsoft", "Sideways. Double click: default."));
    let (end, to) = handle(ui, "Curve: where it is loudest", pos2(x(loudest), frame.top()), "");
    let hand = Hand { of, id: "bloud" };
    hand.drag(hands, &end, to.map(|to| share_of(frame, to.x)));
    end.on_hover_ui(|ui| teach(ui, "bloud", "Sideways. Double click: default."));
    let (bow, to) = handle(ui, "Curve: how it bends", at(middle), "");
    // Half of the way is this dynamic: 0.5 to the power of the curve.
    let curve = to.map(|to| ((frame.bottom() - to.y) / frame.height()).clamp(0.05, 0.95).log(0.5));
    Hand { of, id: "bcurve" }.drag(hands, &bow, curve);
    bow.on_hover_ui(|ui| teach(ui, "bcurve", "Up and down. Double click: default."));
}

/// The dynamic of a breath, 0..=1 both.
fn level(breath: f32, settings: &Settings) -> f32 {
    dynamic(f64::from(breath), settings).0 as f32
}

/// Percent of the way through the frame.
fn share_of(frame: Rect, x: f32) -> f32 {
    100.0 * ((x - frame.left()) / frame.width()).clamp(0.0, 1.0)
}

/// What a handle moves: a number of the source's own curve, or the parameter of all sources.
struct Hand {
    of: Option<OfSource>,
    id: &'static str,
}

impl Hand {
    /// Moves it to a number in the parameter's unit while its handle is dragged or moved by keys.
    fn drag(&self, hands: &mut Hands, handle: &Response, to: Option<f32>) {
        if let Some(of) = self.of.filter(OfSource::is_own) {
            let to = to.map(|to| if self.id == "bcurve" { to } else { 0.01 * to });
            let default = SourceCurve::common(&Settings::default());
            let to = if handle.double_clicked() { Some(*self.number(&mut { default })) } else { to };
            if let Some(to) = to {
                of.change(hands, |own| *self.number(own) = to);
            }
            return;
        }
        if handle.drag_started() {
            hands.begin(self.id);
        }
        if let Some(to) = to {
            let is_key = !handle.dragged();
            if is_key {
                hands.begin(self.id);
            }
            hands.set_number(self.id, f64::from(to));
            if is_key {
                hands.end(self.id);
            }
        }
        if handle.drag_stopped() {
            hands.end(self.id);
        }
        if handle.double_clicked()
            && let Some(look) = hands.controls.look(self.id)
        {
            hands.put(self.id, look.default);
        }
    }

    fn number<'a>(&self, own: &'a mut SourceCurve) -> &'a mut f32 {
        match self.id {
            "bsoft" => &mut own.softest,
            "bloud" => &mut own.loudest,
            _ => &mut own.curve,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_histogram_shows_what_was_played_and_not_the_rest() {
        let mut histogram = BreathHistogram::default();
        for value in [0.0, 0.0, 0.5, 0.5, f32::NAN, 1.0] {
            histogram.add(value, 0.1);
        }
        let seen: Vec<_> = histogram.heights().filter(|(_, height)| *height > 0.0).collect();
        assert_eq!(seen.len(), 2);
        assert!((seen[0].0 - 0.5).abs() < 0.01 && seen[1].0 == 1.0 && seen[0].1 > seen[1].1, "{seen:?}");
        histogram.fade(100.0);
        assert!(histogram.heights().all(|(_, height)| height < 1e-3), "it forgets");
    }

    #[test]
    fn the_histogram_counts_time_however_often_it_looks() {
        let after = |looks: usize| {
            let mut histogram = BreathHistogram::default();
            let step_s = 4.0 / looks as f32;
            for value in [0.25, 0.75] {
                for _ in 0..looks {
                    histogram.fade(step_s);
                    histogram.add(value, step_s);
                }
            }
            histogram.columns
        };
        let (slow, fast) = (after(20), after(400));
        assert!(slow.iter().zip(fast).all(|(slow, fast)| (slow - fast).abs() < 0.05), "{slow:?} {fast:?}");
        let mut stalled = BreathHistogram::default();
        stalled.add(0.5, 3_600.0);
        assert!(stalled.columns.iter().sum::<f32>() <= LONGEST_S);
    }

    #[test]
    fn the_middle_of_the_curve_is_where_the_handle_is() {
        for curve in [0.5_f32, 1.0, 2.0] {
            let settings = Settings { breath_curve: curve, ..Settings::default() };
            let middle = 0.5 * (settings.breath_softest + settings.breath_loudest);
            assert!((level(middle, &settings).log(0.5) - curve).abs() < 1e-4);
        }
    }
}
