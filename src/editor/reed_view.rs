//! The reed view: flow over pressure, from the tables that sound and touch share, with handles for H and k; beside it the
//! same curve as torque.
//! The horizontal axis is the pressure difference over the reed, kPa; the vertical axis is the flow, cm3/s. A reed at rest
//! is on the curve at the mouth pressure. A sounding reed runs along a loop, which leaves the curve because of the reed's
//! inertia and the lay.
//! The peak is the handle of H, closure that of k. Coupled, both move H, and the peak's height is A. If the reed
//! is given in physical units, the peak is the handle of the channel's width and closure that of the stiffness.

use egui::{Align2, Pos2, Stroke, Ui, pos2, vec2};
use egui_plot::{PlotPoint, PlotTransform, PlotUi, Points};

use crate::editor::breath_meter;
use crate::editor::chart;
use crate::editor::chart::{Chart, ChartMark};
use crate::editor::controls::{Hands, choice, handle, heading, slider, switch, teach};
use crate::editor::snapshot::{NO_BREATH_KPA, Snapshot};
use crate::editor::theme::{Colours, GAP, panel};
use chalumeau_core::haptics::torque_law;
use chalumeau_core::instrument::Settings;
use chalumeau_core::reed::law::{K_INIT, coupled_k};
use chalumeau_core::reed::physical::P_REF_PA;
use chalumeau_core::reed::{ReedLaw, ReedTables};
use chalumeau_core::units::Air;

/// Points of a curve.
const POINTS: usize = 160;

/// Height of the legend below the axis of the flow, points: two lines, and what the handle on the axis takes.
const LEGEND: f32 = HANDLE + 2.0 * chart::LEGEND_LINE;
const HANDLE: f32 = 13.0;
/// What the names and numbers around a chart take of its height, points, about.
const AROUND: f32 = 60.0;
/// Least room below the axis, over that above it.
const LEAST_BELOW: f32 = 0.12;

/// What the view remembers.
#[derive(Clone, Debug, Default)]
pub struct ReedView {
    /// Bounds of the chart while a handle is held; otherwise the chart would rescale under the pointer.
    bounds: Option<(f64, f64)>,
}

/// The reed's law in the units of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Picture {
    law: ReedLaw,
    /// H of the law over the parameter H: the lip.
    lip: f64,
    /// k of the law over the parameter k: the strength.
    stiffer: f64,
    /// Flow of 1, cm3/s.
    flow_cm3s: f64,
}

impl Picture {
    fn of(settings: &Settings, nominal_radius_m: f64) -> Self {
        let law = settings.reed_law();
        let seed_h = f64::from(settings.reed_h);
        let seed_k = if settings.coupled { coupled_k(seed_h) } else { f64::from(settings.reed_k) };
        let z_c = Air::at(f64::from(settings.temperature_c)).z_c(nominal_radius_m);
        let flow_cm3s = 1e6 * f64::from(settings.zeta) * K_INIT * P_REF_PA / z_c;
        Self { law, lip: law.h() / seed_h, stiffer: law.k() / seed_k, flow_cm3s }
    }

    fn kpa(p: f64) -> f64 {
        1e-3 * P_REF_PA * p
    }

    fn flow(&self, kpa: f64) -> f64 {
        self.flow_cm3s * self.law.flow(ReedTables::reference(), kpa / Self::kpa(1.0))
    }

    fn peak(&self) -> [f64; 2] {
        [Self::kpa(self.law.peak_at()), self.flow_cm3s * self.law.peak_flow()]
    }

    fn closure_kpa(&self) -> f64 {
        Self::kpa(self.law.closing())
    }

    /// The parameter H that closes the coupled reed at `kpa`.
    fn coupled_h(&self, kpa: f64) -> f64 {
        (27.0 * self.lip * self.stiffer / (4.0 * (kpa / Self::kpa(1.0)).max(1e-3))).sqrt()
    }

    /// The parameter H that puts the free reed's peak at the height `cm3s`, k and A as they are.
    fn free_h(&self, cm3s: f64) -> f64 {
        let flow = (cm3s / self.flow_cm3s / self.law.a().max(1e-3)).max(0.0);
        (27.0 * flow * flow / (4.0 * self.law.k())).cbrt() / self.lip
    }

    /// The parameter k that closes the free reed at `kpa`.
    fn free_k(&self, kpa: f64) -> f64 {
        kpa / Self::kpa(1.0) / self.law.h() / self.stiffer
    }

    /// The parameter A that puts the peak at the height `cm3s`.
    fn a(&self, cm3s: f64) -> f64 {
        self.law.a() * cm3s / self.peak()[1].max(1e-9)
    }
}

impl ReedView {
    /// Draws the view.
    pub fn draw(&mut self, ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot) {
        let mut with = (self, hands);
        crate::editor::beside(
            ui,
            "reed",
            &mut with,
            |ui, (view, hands)| view.pictures(ui, hands, snapshot),
            |ui, (_, hands)| column(ui, hands),
        );
    }

    fn pictures(&mut self, ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot) {
        let c = Colours::here(ui);
        let (width, height) = (ui.available_width(), ui.available_height());
        let is_wide = width > 560.0;
        let (reed, torque) = if is_wide {
            (vec2(0.62 * width - 0.5 * GAP, height), vec2(0.38 * width - 0.5 * GAP, height))
        } else {
            (vec2(width, 0.6 * height - 0.5 * GAP), vec2(width, 0.4 * height - 0.5 * GAP))
        };
        let layout = if is_wide {
            egui::Layout::left_to_right(egui::Align::Min)
        } else {
            egui::Layout::top_down(egui::Align::Min)
        };
        ui.spacing_mut().item_spacing = vec2(GAP, GAP);
        ui.with_layout(layout, |ui| {
            framed(ui, c, reed, |ui| self.flow(ui, hands, snapshot));
            framed(ui, c, torque, |ui| torque_picture(ui, snapshot));
        });
    }

    fn flow(&mut self, ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot) {
        let c = Colours::here(ui);
        let picture = Picture::of(&snapshot.settings, snapshot.instrument.nominal_radius_m);
        // A player's lip shapes the reed that is set; what is played follows its curve.
        let played = Picture::of(&snapshot.played(), snapshot.instrument.nominal_radius_m);
        let kpa = f64::from(snapshot.mouth_now_kpa());
        let wanted = (
            even(1.4 * picture.closure_kpa().max(1.5 * kpa), 2.0),
            even(1.3 * picture.peak()[1].max(0.6 * picture.flow_cm3s), 50.0),
        );
        let (right, top) = self.bounds.unwrap_or(wanted);
        let marks: Vec<ChartMark> = breath_meter::marks(snapshot, c)
            .into_iter()
            .map(|(at, name, colour)| ChartMark { at: f64::from(at), name, colour })
            .filter(|mark| mark.at < right)
            .collect();
        let period = snapshot.scope.last_period(snapshot.heard.f0_hz.unwrap_or(0.0));
        let is_sounding = snapshot.heard.f0_hz.is_some();
        let height = ui.available_height();
        let has_legend = ui.available_width() > 300.0 && height > 250.0;
        // The legend lies below the axis, where no curve is.
        let below =
            if has_legend { (LEGEND / (height - AROUND - LEGEND)).max(LEAST_BELOW) } else { LEAST_BELOW };
        let below = f64::from(below);
        let transform = Chart {
            id: "flow",
            x: (-0.1 * right, right),
            y: (-below * top, top),
            x_name: "mouth minus mouthpiece pressure, kPa",
            y_name: "flow through the reed, cm\u{b3}/s",
            height,
            label: "Flow through the reed over pressure difference",
        }
        .show(ui, |plot| {
            chart::lines(plot, &marks);
            law_curve(plot, &picture, right, c);
            if snapshot.lip.is_some() {
                plot.line(chart::curve(law_points(&played, right), c.breath, 1.0).id("law under the lip"));
            }
            if is_sounding {
                orbit(plot, snapshot, period, c);
            }
            if kpa > f64::from(NO_BREATH_KPA) {
                let still = Points::new("still reed", [kpa, played.flow(kpa)]);
                plot.points(still.radius(5.0).color(c.breath).filled(false).allow_hover(false));
            }
        });
        chart::names(ui, &transform, &marks);
        if has_legend {
            let sounding = if is_sounding { "one period of the sound" } else { "the reed does not swing" };
            let mut lines = vec![("law of the reed", c.ink), (sounding, c.breath)];
            if snapshot.lip.is_some() {
                lines.push(("thin: under the player's lip", c.breath));
            }
            if kpa > f64::from(NO_BREATH_KPA) {
                lines.push(("circle: equilibrium", c.breath));
            }
            // Clear of the handle on the axis.
            let from = transform.position_from_point(&PlotPoint::new(0.0, 0.0)) + vec2(8.0, HANDLE);
            chart::legend_below(ui, &transform, from, &lines);
        }
        self.handles(ui, hands, snapshot, &picture, &transform, (right, top));
    }

    fn handles(
        &mut self,
        ui: &mut Ui,
        hands: &mut Hands,
        snapshot: &Snapshot,
        picture: &Picture,
        transform: &PlotTransform,
        bounds: (f64, f64),
    ) {
        let face = if hands.step("rface") == 1 {
            Face::Maker
        } else if snapshot.settings.coupled {
            Face::Coupled
        } else {
            Face::Free
        };
        let place = |[x, y]: [f64; 2]| transform.position_from_point(&PlotPoint::new(x, y));
        let [peak_is, end_is] = face.names();
        let (peak, peak_to) =
            handle(ui, &format!("Peak of the flow: {peak_is}"), place(picture.peak()), peak_is);
        let end_at = place([picture.closure_kpa(), 0.0]);
        let (end, end_to) = handle(ui, &format!("Closure of the reed: {end_is}"), end_at, end_is);
        for (response, to, is_peak) in [(&peak, peak_to, true), (&end, end_to, false)] {
            let ids = face.ids(is_peak);
            if response.drag_started() {
                ids.iter().for_each(|id| hands.begin(id));
                self.bounds = Some(bounds);
            }
            if let Some(to) = to {
                let is_key = !response.dragged();
                if is_key {
                    ids.iter().for_each(|id| hands.begin(id));
                }
                let to = transform.value_from_position(to);
                match (face, is_peak) {
                    (Face::Coupled, true) => {
                        hands.set_number("reedh", picture.coupled_h(3.0 * to.x));
                        hands.set_number("reeda", picture.a(to.y));
                    }
                    (Face::Coupled, false) => hands.set_number("reedh", picture.coupled_h(to.x)),
                    (Face::Free, true) => hands.set_number("reedh", picture.free_h(to.y)),
                    (Face::Free, false) => hands.set_number("reedk", picture.free_k(to.x)),
                    // Flow goes with the width, closing pressure with the stiffness.
                    (Face::Maker, true) => scale(hands, "rwidth", to.y / picture.peak()[1]),
                    (Face::Maker, false) => scale(hands, "rstiff", to.x / picture.closure_kpa()),
                }
                if is_key {
                    ids.iter().for_each(|id| hands.end(id));
                }
            }
            if response.drag_stopped() {
                ids.iter().for_each(|id| hands.end(id));
                self.bounds = None;
            }
            if response.double_clicked() {
                let defaults: Vec<_> =
                    ids.iter().filter_map(|&id| Some((id, hands.controls.look(id)?.default))).collect();
                hands.put_all(&defaults);
            }
        }
        let way = match face {
            Face::Coupled => "Sideways: H. Up and down: A. Double click: default.",
            Face::Free | Face::Maker => "Up and down. Double click: default.",
        };
        peak.on_hover_ui(|ui| teach(ui, face.ids(true)[0], way));
        end.on_hover_ui(|ui| teach(ui, face.ids(false)[0], "Sideways. Double click: default."));
    }
}

/// How the reed is given, which decides what the handles change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Face {
    /// H alone; k follows.
    Coupled,
    /// H and k.
    Free,
    /// In physical units, as a maker measures it.
    Maker,
}

impl Face {
    /// The letters on the handles of peak and closure.
    fn names(self) -> [&'static str; 2] {
        match self {
            Self::Coupled | Self::Free => ["H", "k"],
            Self::Maker => ["w", "K"],
        }
    }

    /// The parameters that a handle changes.
    fn ids(self, is_peak: bool) -> &'static [&'static str] {
        match (self, is_peak) {
            (Self::Coupled, true) => &["reedh", "reeda"],
            (Self::Coupled, false) | (Self::Free, true) => &["reedh"],
            (Self::Free, false) => &["reedk"],
            (Self::Maker, true) => &["rwidth"],
            (Self::Maker, false) => &["rstiff"],
        }
    }
}

/// Multiplies a parameter.
fn scale(hands: &mut Hands, id: &'static str, by: f64) {
    if by.is_finite() {
        hands.set_number(id, hands.number(id) * by.max(0.0));
    }
}

/// The next multiple of `step` above.
fn even(value: f64, step: f64) -> f64 {
    (value / step).ceil().max(1.0) * step
}

fn law_curve(plot: &mut PlotUi<'_>, picture: &Picture, right: f64, c: &Colours) {
    let points = law_points(picture, right);
    plot.line(chart::curve(points, c.ink, 2.5).fill(0.0).fill_alpha(0.10).id("law"));
}

fn law_points(picture: &Picture, right: f64) -> Vec<[f64; 2]> {
    let end = picture.closure_kpa();
    // Dense where the root rises.
    let back = (0..=POINTS / 8).rev().map(|n| -0.1 * right * (n as f64 / (POINTS / 8) as f64).powi(2));
    let forth = (1..=POINTS).map(|n| end * (n as f64 / POINTS as f64).powi(2));
    let mut points: Vec<[f64; 2]> = back.chain(forth).map(|kpa| [kpa, picture.flow(kpa)]).collect();
    points.push([right, 0.0]);
    points
}

/// The last period, and a fainter trace of those before it.
fn orbit(plot: &mut PlotUi<'_>, snapshot: &Snapshot, period: std::ops::Range<usize>, c: &Colours) {
    let scope = &snapshot.scope;
    let mouth = f64::from(snapshot.mouth_now_kpa());
    let point =
        |index: usize| [mouth - f64::from(scope.mouthpiece_kpa[index]), f64::from(scope.flow_cm3s[index])];
    let last = period.end.checked_sub(1);
    plot.line(chart::curve(period.map(point).collect(), c.breath, 1.8).id("orbit"));
    if let Some(last) = last {
        plot.points(Points::new("reed now", point(last)).radius(4.0).color(c.breath).allow_hover(false));
    }
}

/// A group of its own size.
pub fn framed(ui: &mut Ui, c: &Colours, size: egui::Vec2, draw: impl FnOnce(&mut Ui)) {
    let frame = panel(c);
    let inner = size - frame.total_margin().sum();
    frame.show(ui, |ui| {
        ui.set_min_size(inner);
        ui.set_max_size(inner);
        ui.vertical(draw);
    });
}

/// The torque of the current note over the knob's angle, with the knob's position.
pub fn torque_picture(ui: &mut Ui, snapshot: &Snapshot) {
    let c = Colours::here(ui);
    let note = match &snapshot.feel {
        Ok(note) => *note,
        Err(reason) => {
            let rect = ui.available_rect_before_wrap();
            chart::empty(ui, rect, &format!("The torque of the note appears here.\n{reason}"));
            return;
        }
    };
    let (feel, at) = (note.feel, note.landmarks);
    let right = even(1.08 * f64::from(feel.wall_deg).min(1.3 * at.a_close_deg), 60.0);
    let torque = |deg: f64| torque_law::torque_mnm(&feel, ReedTables::reference(), deg);
    let ceiling = f64::from(snapshot.knob.ceiling_mnm);
    let points: Vec<[f64; 2]> =
        (0..=POINTS).map(|n| right * n as f64 / POINTS as f64).map(|deg| [deg, torque(deg)]).collect();
    let wall = f64::from(feel.wall_deg);
    let most = points.iter().filter(|[deg, _]| *deg < wall).map(|[_, mnm]| *mnm).fold(10.0, f64::max);
    let top = even(1.25 * most, 20.0);
    let marks: Vec<ChartMark> = [
        (at.a_on_deg, "speaks", c.speaks),
        (at.a_beat_deg, "beats", c.beats),
        (at.a_close_deg, "closes", c.closes),
    ]
    .into_iter()
    .map(|(at, name, colour)| ChartMark { at, name, colour })
    .filter(|mark| mark.at > 0.0 && mark.at < right)
    .collect();
    let knob = snapshot.knob.angle_deg.map(f64::from).filter(|deg| (0.0..right).contains(deg));
    let transform = Chart {
        id: "torque",
        x: (0.0, right),
        y: (-0.08 * top, top),
        x_name: "angle of the knob, degrees",
        y_name: "torque felt, mNm",
        height: ui.available_height(),
        label: "Torque felt over the angle of the knob",
    }
    .show(ui, |plot| {
        chart::lines(plot, &marks);
        plot.line(chart::curve(points, c.felt, 2.5).fill(0.0).fill_alpha(0.10).id("torque"));
        if ceiling > 0.0 && ceiling < top {
            plot.line(chart::curve(vec![[0.0, ceiling], [right, ceiling]], c.danger, 1.0).id("ceiling"));
            chart::word(plot, [right, ceiling], Align2::RIGHT_BOTTOM, "ceiling", c.danger);
        }
        if let Some(deg) = knob {
            plot.points(Points::new("knob", [deg, torque(deg)]).radius(5.0).color(c.felt).allow_hover(false));
        }
    });
    chart::names(ui, &transform, &marks);
    if let Some(deg) = knob {
        let x = transform.position_from_point(&PlotPoint::new(deg, 0.0)).x;
        let frame = transform.frame();
        let (top, bottom): (Pos2, Pos2) = (pos2(x, frame.top()), pos2(x, frame.bottom()));
        ui.painter().line_segment([top, bottom], Stroke::new(1.0, c.felt.gamma_multiply(0.5)));
    }
}

fn column(ui: &mut Ui, hands: &mut Hands) {
    let is_maker = hands.step("rface") == 1;
    heading(ui, "Embouchure");
    for id in ["stren", "lip"] {
        slider(ui, hands, id);
    }
    // A maker's reed has its zeta from its width and opening.
    ui.add_enabled_ui(!is_maker, |ui| slider(ui, hands, "zeta"));
    slider(ui, hands, "damp");
    heading(ui, "Reed");
    choice(ui, hands, "rface");
    if is_maker {
        for id in ["rstiff", "rarea", "rwidth", "ropen"] {
            slider(ui, hands, id);
        }
    } else {
        switch(ui, hands, "reedc");
        slider(ui, hands, "reedh");
        let is_coupled = hands.step("reedc") == 1;
        ui.add_enabled_ui(!is_coupled, |ui| slider(ui, hands, "reedk"));
    }
    for id in ["reeda", "lay"] {
        slider(ui, hands, id);
    }
    heading(ui, "Controllers for H and k");
    for id in ["hsrc", "ksrc"] {
        choice(ui, hands, id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::units::REFERENCE_RADIUS_M;

    fn of(settings: &Settings) -> Picture {
        Picture::of(settings, REFERENCE_RADIUS_M)
    }

    #[test]
    fn a_handle_put_somewhere_is_found_there() {
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
        for (strength, lip, zeta) in [(2.5, 1.0, 0.3), (3.5, 0.8, 0.5)] {
            let mut settings = Settings { strength, lip, zeta, ..Settings::default() };
            let picture = of(&settings);
            settings.reed_h = picture.coupled_h(5.0) as f32;
            close(of(&settings).closure_kpa(), 5.0);
            settings.coupled = false;
            settings.reed_k = of(&settings).free_k(7.5) as f32;
            close(of(&settings).closure_kpa(), 7.5);
            let wanted = 1.1 * of(&settings).peak()[1];
            settings.reed_h = of(&settings).free_h(wanted) as f32;
            close(of(&settings).peak()[1], wanted);
            settings.reed_a = of(&settings).a(wanted / 2.0) as f32;
            close(of(&settings).peak()[1], wanted / 2.0);
        }
    }

    #[test]
    fn the_curve_is_the_reed_of_the_physics_notes() {
        // zeta (1 - 1/3) sqrt(1/3) p_M / Zc at a third of 6 kPa.
        let picture = of(&Settings::default());
        let z_c = Air::default().z_c(REFERENCE_RADIUS_M);
        let wanted = 1e6 * f64::from(0.3_f32) * (2.0 / 3.0) * (1.0_f64 / 3.0).sqrt() * 6_000.0 / z_c;
        assert!((picture.flow(2.0) / wanted - 1.0).abs() < 1e-3, "{} {wanted}", picture.flow(2.0));
        assert!((picture.peak()[0] - 2.0).abs() < 1e-6 && picture.flow(6.1) == 0.0);
    }
}
