//! The knob view: device, status, arming, feel, and a page of feel tests.

use egui::{
    Align, Align2, Button, Color32, CornerRadius, FontId, RichText, Role, Sense, Stroke, Ui, WidgetInfo,
    pos2, text::LayoutJob, vec2,
};

use crate::editor::Action;
use crate::editor::chart;
use crate::editor::chart::Chart;
use crate::editor::controls::{Hands, choice, heading, momentary, segments, slider, switch, teach};
use crate::editor::feel_test::FeelTest;
use crate::editor::reed_view::{framed, torque_picture};
use crate::editor::snapshot::{KnobDevice, Snapshot};
use crate::editor::theme;
use crate::editor::theme::{Colours, GAP};
use chalumeau_core::haptics::torque_law;
use chalumeau_core::reed::ReedTables;

/// Pages of the panel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Page {
    #[default]
    Play,
    Try,
    Study,
}

const PAGES: [(Page, &str); 3] =
    [(Page::Play, "Feel"), (Page::Try, "Feel test"), (Page::Study, "Connection, takes")];

/// What the panel remembers.
#[derive(Clone, Debug, Default)]
pub struct KnobView {
    page: Page,
    test: Option<FeelTest>,
}

impl KnobView {
    /// Ends a feel test.
    pub fn end_test(&mut self, actions: &mut Vec<Action>) {
        if self.test.take().is_some() {
            actions.push(Action::FeelTest(None));
        }
    }

    /// Draws the panel.
    pub fn draw(&mut self, ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        let mut with = (self, hands, actions);
        crate::editor::beside(
            ui,
            "knob",
            &mut with,
            |ui, (this, hands, actions)| this.left(ui, hands, snapshot, actions),
            |ui, (this, hands, _)| column(ui, hands, this.page),
        );
    }

    fn left(&mut self, ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        let c = Colours::here(ui);
        let (width, height) = (ui.available_width(), ui.available_height());
        ui.spacing_mut().item_spacing = vec2(GAP, GAP);
        let top = (0.44 * height).clamp(126.0, 250.0);
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing = vec2(GAP, 4.0);
            framed(ui, c, vec2(0.56 * width - 0.5 * GAP, top), |ui| devices(ui, hands, snapshot, actions));
            framed(ui, c, vec2(0.44 * width - 0.5 * GAP, top), |ui| arming(ui, hands, snapshot, actions));
        });
        let names: Vec<String> = PAGES.iter().map(|(_, name)| (*name).to_owned()).collect();
        let mut page = PAGES.iter().position(|(page, _)| *page == self.page).unwrap_or(0);
        segments(ui, "Page", &names, &mut page);
        let page = PAGES[page].0;
        if page != self.page {
            self.end_test(actions);
            self.page = page;
        }
        let rest = vec2(width, ui.available_height());
        framed(ui, c, rest, |ui| match self.page {
            Page::Play => torque_picture(ui, snapshot),
            Page::Try => self.tests(ui, snapshot, actions),
            Page::Study => line(ui, snapshot),
        });
    }

    fn tests(&mut self, ui: &mut Ui, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        let c = Colours::here(ui);
        ui.horizontal_wrapped(|ui| {
            for test in FeelTest::ALL {
                let is_on = self.test == Some(test);
                let button = Button::selectable(is_on, test.name()).frame_when_inactive(true);
                let response = ui.add(button);
                response.widget_info(|| {
                    WidgetInfo::selected(
                        Role::RadioButton,
                        true,
                        is_on,
                        format!("Feel test: {}", test.name()),
                    )
                });
                if response.on_hover_text(test.notice()).clicked() && !is_on {
                    self.test = Some(test);
                    actions.push(Action::FeelTest(Some(test.feel())));
                }
            }
            let stop = ui.add_enabled(self.test.is_some(), Button::new("End test"));
            if stop.on_hover_text("Back to the feel of the notes").clicked() {
                self.end_test(actions);
            }
        });
        let Some(test) = self.test else {
            let rect = ui.available_rect_before_wrap();
            chart::empty(
                ui,
                rect,
                "Choose a test, arm the knob, and turn it. Each test says what your hand should feel.",
            );
            return;
        };
        let notice = if snapshot.knob.is_armed { c.ink } else { c.quiet };
        ui.label(RichText::new(test.notice()).color(notice));
        if !snapshot.knob.is_armed {
            ui.label(RichText::new("The knob is not armed, so it makes no torque.").color(c.beats));
        }
        let feel = test.feel();
        let torque = |deg: f64| torque_law::torque_mnm(&feel, ReedTables::reference(), deg);
        let points: Vec<[f64; 2]> =
            (-90..=200).map(|n| 2.0 * f64::from(n)).map(|deg| [deg, torque(deg)]).collect();
        let knob = snapshot.knob.angle_deg.map(f64::from);
        Chart {
            id: "feel test",
            x: (-180.0, 400.0),
            y: (-60.0, 60.0),
            x_name: "angle of the knob, degrees",
            y_name: "torque, mNm",
            height: ui.available_height(),
            label: "Torque of the feel test over the angle",
        }
        .show(ui, |plot| {
            plot.line(chart::curve(vec![[-180.0, 0.0], [400.0, 0.0]], c.line, 1.0).id("nothing"));
            plot.line(chart::curve(points, c.felt, 2.5).id("test"));
            if let Some(deg) = knob {
                plot.points(
                    egui_plot::Points::new("knob", [deg, torque(deg)])
                        .radius(5.0)
                        .color(c.felt)
                        .allow_hover(false),
                );
            }
        });
    }
}

fn devices(ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot, actions: &mut Vec<Action>) {
    let c = Colours::here(ui);
    let knob = &snapshot.knob;
    egui::ScrollArea::vertical().id_salt("devices").auto_shrink([false, false]).show(ui, |ui| {
        ui.horizontal_top(|ui| {
            let left = (ui.available_width() - 88.0).max(100.0);
            ui.vertical(|ui| {
                ui.set_width(left);
                choice(ui, hands, "knob");
            });
            ui.vertical(|ui| {
                // In line with the list beside its name.
                ui.add_space(20.0);
                momentary(ui, hands, "takeov", "Take over");
            });
        });
        let colour = if knob.is_live { c.speaks } else { c.quiet };
        ui.horizontal(|ui| {
            let (dot, _) = ui.allocate_exact_size(vec2(10.0, 14.0), Sense::hover());
            ui.painter().circle_filled(dot.center(), 4.0, colour);
            let told = hands.controls.look("kstat").map(|look| hands.controls.text("kstat", look.value));
            let told = Some(knob.text.clone()).filter(|text| !text.is_empty()).or(told);
            let told = told.filter(|text| text != "off").unwrap_or_else(|| "no knob chosen".into());
            let response = ui.add(egui::Label::new(&told).truncate());
            response.on_hover_ui(|ui| {
                ui.label(&told);
                teach(ui, "kstat", "");
            });
        });
        for device in &knob.devices {
            device_row(ui, c, device, actions);
        }
        if let Some(notice) = &knob.notice {
            ui.label(RichText::new(notice).color(c.beats));
        }
    });
}

fn device_row(ui: &mut Ui, c: &Colours, device: &KnobDevice, actions: &mut Vec<Action>) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 36.0), Sense::click());
    let painter = ui.painter_at(rect);
    let round = CornerRadius::same(theme::SMALL_RADIUS);
    let fill = if response.hovered() { c.hovered } else { c.raised };
    painter.rect_filled(rect, round, fill);
    if device.is_chosen || response.has_focus() {
        painter.rect_stroke(rect, round, Stroke::new(1.5, c.accent), egui::StrokeKind::Inside);
    }
    painter.text(rect.left_top() + vec2(8.0, 4.0), Align2::LEFT_TOP, &device.name, theme::body(), c.ink);
    let state = if device.is_free { c.quiet } else { c.beats };
    painter.text(
        rect.left_bottom() + vec2(8.0, -4.0),
        Align2::LEFT_BOTTOM,
        &device.state,
        theme::small(),
        state,
    );
    response.widget_info(|| {
        let name = format!("Device {}: {}", device.name, device.state);
        WidgetInfo::selected(Role::RadioButton, true, device.is_chosen, name)
    });
    if response.on_hover_text(&device.state).clicked() {
        actions.push(Action::ChooseDevice(device.key.clone()));
    }
}

/// Torque off, now: by the button, by Escape, and with the switch that asked for it.
pub fn stop(hands: &mut Hands, actions: &mut Vec<Action>) {
    actions.push(Action::StopKnob);
    hands.put("arm", 0.0);
}

/// The button that arms and the one that stops, and the ceiling of the torque. They stand apart, so that no hand that stops the knob twice
/// arms it.
fn arming(ui: &mut Ui, hands: &mut Hands, snapshot: &Snapshot, actions: &mut Vec<Action>) {
    let c = Colours::here(ui);
    let knob = &snapshot.knob;
    let is_wanted = hands.step("arm") == 1;
    let is_held = knob.is_armed || knob.is_arming || is_wanted;
    let has_line = ui.available_height() > 160.0;
    let height = (ui.available_height() - if has_line { 118.0 } else { 66.0 }).clamp(42.0, 84.0);
    let line = match (knob.is_armed, knob.is_arming, is_wanted) {
        (true, _, _) => "armed",
        (false, true, _) => "may turn a little",
        // Stock firmware sends its angle, and gets a feel from a bridge alone.
        _ if !knob.is_live && knob.angle_deg.is_some() => "only with a bridge",
        _ if !knob.is_live => "no knob connected",
        (false, false, true) => "disarmed: press STOP first",
        (false, false, false) => "allows torque",
    };
    let (fill, ink) = match (is_held, knob.is_live) {
        (false, true) => (c.accent, c.on_accent),
        (true, _) | (_, false) => (c.raised, c.quiet),
    };
    ui.horizontal_top(|ui| {
        ui.spacing_mut().item_spacing.x = GAP;
        let size = vec2(0.5 * (ui.available_width() - GAP), height);
        let (rect, response) = ui.allocate_exact_size(size, Sense::click());
        face(ui, rect, &response, ("ARM", line), (fill, ink));
        response.widget_info(|| WidgetInfo::selected(Role::Switch, !is_held, knob.is_armed, "Arm the knob"));
        if response.clicked() && !is_held {
            hands.put("arm", 1.0);
        }
        response.on_hover_ui(|ui| teach(ui, "arm", ""));

        let (fill, ink) = if is_held { (c.danger, c.panel) } else { (c.raised, c.danger) };
        // It acts when it is pressed: a hasty hand slips, and a frightened one does not let go.
        let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        face(ui, rect, &response, ("STOP", "or Escape"), (fill, ink));
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, "Stop the knob"));
        let is_pressed = response.is_pointer_button_down_on() && ui.input(|i| i.pointer.any_pressed());
        if is_pressed || response.clicked() || is_held && response.is_pointer_button_down_on() {
            stop(hands, actions);
        }
    });
    slider(ui, hands, "ceil");
    ui.spacing_mut().item_spacing.y = 2.0;
    let quiet = |text: String| RichText::new(text).font(theme::small()).color(c.quiet);
    let Some(deg) = knob.angle_deg else {
        ui.label(quiet("angle and connection quality appear here when a knob is connected".into()));
        return;
    };
    let torque = knob.torque_mnm.map_or_else(String::new, |mnm| format!(", {mnm:.0} mNm"));
    ui.label(quiet(format!("knob at {deg:.0}\u{b0}{torque}")));
    if !has_line {
        return;
    }
    let late = |us: u32| 1e-3 * f64::from(us);
    let (median, worst) = (late(knob.jitter_us.0), late(knob.jitter_us.1));
    ui.label(quiet(format!(
        "{:.0} positions a second, jitter {median:.1} ms, 99th percentile {worst:.1}",
        knob.rate_hz
    )));
    let echo = knob.round_trip_us.map_or_else(|| "?".into(), |us| format!("{:.1} ms", late(us)));
    let errors = knob.lost + knob.damaged;
    ui.label(quiet(format!("new feel after {echo}; {errors} line errors, {} disconnects", knob.losses)));
}

/// A large button: a word, and a line that says what it does.
fn face(
    ui: &Ui,
    rect: egui::Rect,
    response: &egui::Response,
    (title, line): (&str, &str),
    (fill, ink): (Color32, Color32),
) {
    let c = Colours::here(ui);
    let painter = ui.painter();
    let round = CornerRadius::same(theme::PANEL_RADIUS);
    let fill = if response.hovered() { fill.lerp_to_gamma(c.ink, 0.10) } else { fill };
    painter.rect(rect, round, fill, Stroke::new(1.0, c.line), egui::StrokeKind::Inside);
    if response.has_focus() {
        painter.rect_stroke(rect.shrink(2.0), round, Stroke::new(2.0, c.ink), egui::StrokeKind::Inside);
    }
    let is_low = rect.height() < 60.0;
    let mut words = LayoutJob::simple(line.to_owned(), theme::small(), ink, rect.width() - 12.0);
    words.halign = Align::Center;
    let words = painter.layout_job(words);
    // A low button has room for one line.
    let is_told = !is_low || words.rows.len() == 1;
    let title_height = if is_low { 22.0 } else { 28.0 };
    let top = rect.center().y - 0.5 * (title_height + if is_told { words.size().y } else { 0.0 });
    let at = pos2(rect.center().x, top + 0.5 * title_height);
    painter.text(at, Align2::CENTER_CENTER, title, FontId::proportional(0.86 * title_height), ink);
    if !is_told {
        return;
    }
    painter.galley(pos2(rect.center().x, top + title_height), words, ink);
}

/// Quality of the connection to the knob.
fn line(ui: &mut Ui, snapshot: &Snapshot) {
    let c = Colours::here(ui);
    let knob = &snapshot.knob;
    let late = |us: u32| f64::from(us) * 1e-3;
    let rows = [
        ("Positions", format!("{:.0} a second", knob.rate_hz), "As many as the device sends; 500 by cable"),
        (
            "Jitter",
            format!("{:.1} ms, 99th percentile {:.1} ms", late(knob.jitter_us.0), late(knob.jitter_us.1)),
            "Delay of positions against a steady clock; their time stamps remove it",
        ),
        (
            "Delay of a new feel",
            knob.round_trip_us.map_or_else(|| "not known".into(), |us| format!("{:.1} ms", late(us))),
            "Time from a new note to the knob's reply",
        ),
        (
            "Frames lost, damaged",
            format!("{}, {}", knob.lost, knob.damaged),
            "Frames with a wrong checksum are ignored",
        ),
        ("Disconnects", knob.losses.to_string(), "The knob is disarmed after each one"),
        (
            "Latency of the plugin",
            format!("{:.1} ms", snapshot.latency_ms),
            "The plugin reports it to the host",
        ),
    ];
    egui::Grid::new("line").num_columns(2).spacing([18.0, 7.0]).show(ui, |ui| {
        for (name, value, about) in rows {
            ui.label(RichText::new(name).color(c.quiet)).on_hover_text(about);
            ui.label(value);
            ui.end_row();
        }
    });
}

fn column(ui: &mut Ui, hands: &mut Hands, page: Page) {
    match page {
        Page::Play | Page::Try => {
            heading(ui, "Torque");
            for id in ["law", "order"] {
                choice(ui, hands, id);
            }
            // Each law has a mark of its own at the threshold.
            let mark = if hands.step("law") == 1 { "detent" } else { "mark" };
            for id in ["contr", "place", "torque", mark, "kdamp", "kfric", "refnot"] {
                slider(ui, hands, id);
            }
            heading(ui, "Calibration");
            ui.horizontal_wrapped(|ui| {
                momentary(ui, hands, "rest", "Rest here");
                momentary(ui, hands, "blow", "Blow hard here");
            });
            slider(ui, hands, "curve");
            heading(ui, "OSC");
            slider(ui, hands, "oscprt");
            switch(ui, hands, "oscany");
            slider(ui, hands, "oscfl");
        }
        Page::Study => {
            heading(ui, "Takes");
            switch(ui, hands, "rec");
            switch(ui, hands, "replay");
            heading(ui, "Study");
            switch(ui, hands, "study");
            for id in ["part", "seed", "trial"] {
                slider(ui, hands, id);
            }
            choice(ui, hands, "side");
        }
    }
}
