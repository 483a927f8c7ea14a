//! The clarinet to scale, from the instrument's file: bore, tone holes, what covers them, and the sound that stands in it.
//!
//! Both directions have one scale. Bore, holes and chimneys are the file's; the outside of the wood is drawn as thick as
//! the holes are deep, which the file does not say. Finger holes and rings stand on the upper edge, closed keys on the
//! lower one, wherever they are on the real instrument. A click on a hole tries it: it opens or closes whatever is
//! fingered, until *Back to the note*.

use egui::{
    Align2, Color32, CornerRadius, CursorIcon, FontId, Mesh, Painter, Pos2, Rect, Response, Role, Sense,
    Shape, Stroke, Ui, WidgetInfo, pos2, vec2,
};

use crate::bore::instrument_file::{HoleKind, InstrumentFile, REGISTERS, ToneHole};
use crate::editor::Action;
use crate::editor::chart;
use crate::editor::header::note_name;
use crate::editor::snapshot::Snapshot;
use crate::editor::theme;
use crate::editor::theme::{Colours, GAP, panel};

/// Wood around the bore where no hole tells, m, and at the rim of the bell.
const WALL_M: f64 = 7e-3;
const RIM_M: f64 = 2.5e-3;

/// Least distance of two buttons with their names below, points.
const NAMED: f32 = 34.0;

/// What the view remembers.
#[derive(Clone, Debug, Default)]
pub struct ClarinetView {
    /// Holes as they are tried, whatever is fingered.
    tried: Option<Vec<bool>>,
}

impl ClarinetView {
    /// Ends what is tried.
    pub fn end_try(&mut self, actions: &mut Vec<Action>) {
        if self.tried.take().is_some() {
            actions.push(Action::EndTry);
        }
    }

    /// Draws the view.
    pub fn draw(&mut self, ui: &mut Ui, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        let c = Colours::here(ui);
        let file = &*snapshot.instrument;
        if self.tried.as_ref().is_some_and(|tried| tried.len() != file.holes.len()) {
            self.end_try(actions);
        }
        let height = ui.available_height();
        let picker = (0.36 * height).clamp(120.0, 156.0);
        ui.spacing_mut().item_spacing.y = GAP;
        panel(c).show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.set_height((height - picker - GAP - 44.0).max(150.0));
            self.picture(ui, snapshot, actions);
        });
        panel(c).show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.set_height(ui.available_height());
            self.picker(ui, snapshot, actions);
        });
    }

    fn picture(&mut self, ui: &mut Ui, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        let c = Colours::here(ui);
        let file = &*snapshot.instrument;
        let area = ui.available_rect_before_wrap();
        ui.allocate_rect(area, Sense::hover());
        let painter = ui.painter_at(area.expand(2.0));
        let body = Body::new(file, area);
        let wave = wave_rect(area, &body);
        ruler(&painter, c, area, body.scale);
        painter.text(
            area.left_top(),
            Align2::LEFT_TOP,
            "sound pressure along the bore",
            theme::small(),
            c.quiet,
        );
        standing(&painter, c, &body, wave, &snapshot.standing);
        part_names(&painter, c, &body, wave.bottom() + 1.0);
        body.paint(&painter, c, &snapshot.standing);
        let buttons = hole_buttons(area, file.holes.len());
        for (hole, tone_hole) in file.holes.iter().enumerate() {
            let opening = match &self.tried {
                Some(tried) => f32::from(tried[hole]),
                None => chart::share(snapshot.openings.get(hole).copied().unwrap_or(0.0)),
            };
            let at = body.hole(tone_hole);
            let is_named = area.width() >= NAMED * file.holes.len() as f32;
            let response = button(ui, buttons[hole], tone_hole, opening, is_named);
            let on_bore =
                ui.interact(at.rect.expand2(vec2(2.0, 6.0)), response.id.with("bore"), Sense::CLICK);
            let is_hot = response.hovered() || on_bore.hovered() || response.has_focus();
            leader(&painter, c, at.foot, buttons[hole], is_hot, opening);
            body.paint_hole(&painter, c, tone_hole, opening, is_hot);
            if response.clicked() || on_bore.clicked() {
                self.toggle(hole, snapshot, actions);
            }
            for response in [response, on_bore.on_hover_cursor(CursorIcon::PointingHand)] {
                response.on_hover_ui(|ui| about(ui, tone_hole, opening));
            }
        }
    }

    fn toggle(&mut self, hole: usize, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        let holes = snapshot.instrument.holes.len();
        let now = || {
            (0..holes)
                .map(|hole| snapshot.openings.get(hole).is_some_and(|&opening| opening >= 0.5))
                .collect()
        };
        let mut tried: Vec<bool> = self.tried.take().unwrap_or_else(now);
        if let Some(open) = tried.get_mut(hole) {
            *open = !*open;
        }
        actions.push(Action::TryFingering(tried.clone()));
        self.tried = Some(tried);
    }

    fn picker(&mut self, ui: &mut Ui, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        let c = Colours::here(ui);
        let file = &*snapshot.instrument;
        let shown = match &self.tried {
            Some(tried) => file.fingerings.iter().position(|fingering| fingering.open == *tried),
            None => Some(snapshot.fingering),
        };
        ui.horizontal(|ui| {
            ui.set_height(22.0);
            let told = match shown.and_then(|index| file.fingerings.get(index)) {
                Some(fingering) => {
                    let fingers =
                        if fingering.fingers.trim().is_empty() { "no finger" } else { &fingering.fingers };
                    let alternates =
                        file.fingerings.iter().filter(|other| other.written == fingering.written).count();
                    let more =
                        if alternates > 1 { format!(", {alternates} fingerings") } else { String::new() };
                    format!("{} {}{more}: {fingers}", note_name(fingering.written.0), fingering.register)
                }
                None => "a fingering of your own".into(),
            };
            if self.tried.is_some() {
                if ui.button("Back to the note").on_hover_text("The keys finger again").clicked() {
                    self.end_try(actions);
                }
                ui.colored_label(c.beats, "trying");
            }
            ui.label(told);
        });
        egui::ScrollArea::vertical().id_salt("picker").auto_shrink([false, false]).show(ui, |ui| {
            ui.spacing_mut().item_spacing = vec2(3.0, 4.0);
            // The longest register on one line.
            let chip_width = ((ui.available_width() - 72.0) / 14.0 - 3.0).clamp(28.0, 38.0);
            for register in REGISTERS {
                let of_register = file.fingerings.iter().enumerate().filter(|(_, f)| f.register == register);
                if of_register.clone().next().is_none() {
                    continue;
                }
                ui.horizontal_wrapped(|ui| {
                    let (rect, _) = ui.allocate_exact_size(vec2(66.0, 22.0), Sense::hover());
                    ui.painter().text(
                        rect.left_center(),
                        Align2::LEFT_CENTER,
                        register,
                        theme::small(),
                        c.quiet,
                    );
                    for (index, fingering) in of_register {
                        let first =
                            file.fingerings.iter().position(|other| other.written == fingering.written);
                        let alternate = if first == Some(index) { "" } else { "'" };
                        let name = format!("{}{alternate}", note_name(fingering.written.0));
                        let is_here = shown == Some(index);
                        let response = chip(ui, c, &name, chip_width, is_here);
                        response.widget_info(|| {
                            WidgetInfo::selected(
                                Role::RadioButton,
                                true,
                                is_here,
                                format!("Fingering {name}"),
                            )
                        });
                        if response.on_hover_text(format!("{name}: {}", fingering.fingers)).clicked() {
                            self.tried = Some(fingering.open.clone());
                            actions.push(Action::TryFingering(fingering.open.clone()));
                        }
                    }
                });
            }
        });
    }
}

/// Place of the wave above the body.
fn wave_rect(area: Rect, body: &Body<'_>) -> Rect {
    Rect::from_min_max(area.left_top() + vec2(0.0, 14.0), pos2(area.right(), body.top() - 14.0))
}

/// Places of the buttons along the lower edge, in the order of the file.
fn hole_buttons(area: Rect, holes: usize) -> Vec<Rect> {
    let width = area.width() / holes.max(1) as f32;
    let size = width.min(24.0) - 3.0;
    let room = if width >= NAMED { 24.0 } else { 2.0 };
    (0..holes)
        .map(|hole| {
            let x = area.left() + (hole as f32 + 0.5) * width;
            Rect::from_center_size(pos2(x, area.bottom() - room - 0.5 * size), vec2(size, size))
        })
        .collect()
}

/// What the fingers see: full is covered.
fn button(ui: &mut Ui, rect: Rect, hole: &ToneHole, opening: f32, is_named: bool) -> Response {
    let c = Colours::here(ui);
    let response = ui.interact(rect, ui.scope_id().with(("hole", &hole.name)), Sense::click());
    let painter = ui.painter();
    let ink = if response.hovered() { c.accent } else { c.ink };
    let radius = 0.5 * rect.width();
    let draw = |shrink: f32, fill: Color32| match hole.kind {
        HoleKind::Finger | HoleKind::PadOpen => {
            painter.circle(rect.center(), radius - shrink, fill, Stroke::new(1.5, ink));
        }
        HoleKind::KeyClosed => {
            let key = rect.shrink2(vec2(2.0 + shrink, shrink));
            painter.rect(key, CornerRadius::same(5), fill, Stroke::new(1.5, ink), egui::StrokeKind::Inside);
        }
    };
    let covered = 1.0 - opening.clamp(0.0, 1.0);
    draw(0.0, c.panel.lerp_to_gamma(ink, covered));
    if hole.kind == HoleKind::PadOpen {
        painter.circle_stroke(
            rect.center(),
            radius - 3.5,
            Stroke::new(1.0, c.panel.lerp_to_gamma(ink, 1.0 - covered)),
        );
    }
    if response.has_focus() {
        painter.circle_stroke(rect.center(), radius + 3.0, Stroke::new(1.5, c.accent));
    }
    let (first, second) = hole.name.split_once('_').unwrap_or((&hole.name, ""));
    if is_named {
        let font = FontId::proportional(9.0);
        let below = rect.center_bottom() + vec2(0.0, 2.0);
        painter.text(below, Align2::CENTER_TOP, first, font.clone(), c.quiet);
        painter.text(below + vec2(0.0, 10.0), Align2::CENTER_TOP, second, font, c.quiet);
    }
    let state = if opening >= 0.5 { "open" } else { "closed" };
    response.widget_info(|| {
        WidgetInfo::selected(Role::Switch, true, opening >= 0.5, format!("Hole {}", hole.name))
    });
    response.on_hover_cursor(CursorIcon::PointingHand).accessible_name(format!("Hole {}, {state}", hole.name))
}

/// A small button of the picker.
fn chip(ui: &mut Ui, c: &Colours, name: &str, width: f32, is_here: bool) -> Response {
    let (rect, response) = ui.allocate_exact_size(vec2(width, 22.0), Sense::click());
    let fill = match (is_here, response.hovered()) {
        (true, _) => c.accent,
        (false, true) => c.hovered,
        (false, false) => c.raised,
    };
    let round = CornerRadius::same(theme::SMALL_RADIUS);
    ui.painter().rect_filled(rect, round, fill);
    if response.has_focus() {
        ui.painter().rect_stroke(rect, round, Stroke::new(1.5, c.ink), egui::StrokeKind::Inside);
    }
    let ink = if is_here { c.on_accent } else { c.ink };
    ui.painter().text(rect.center(), Align2::CENTER_CENTER, name, theme::small(), ink);
    response
}

fn about(ui: &mut Ui, hole: &ToneHole, opening: f32) {
    let c = Colours::here(ui);
    ui.set_max_width(260.0);
    ui.strong(hole.name.replace('_', " "));
    ui.label(&hole.description);
    let state = if opening >= 0.99 {
        "open".into()
    } else if opening <= 0.01 {
        "closed".into()
    } else {
        format!("{:.0} % open", 100.0 * opening)
    };
    ui.label(format!(
        "{:.1} mm wide, {:.1} mm deep, {:.1} mm from the reed; {state}",
        2e3 * hole.radius_m,
        1e3 * hole.chimney_m,
        1e3 * hole.x_m
    ));
    ui.label(egui::RichText::new("Click: try it").font(theme::small()).color(c.quiet));
}

fn leader(painter: &Painter, c: &Colours, foot: Pos2, button: Rect, is_hot: bool, opening: f32) {
    let knee = pos2(button.center().x, button.top() - 8.0);
    let colour = if is_hot { c.accent } else { c.line.lerp_to_gamma(c.speaks, 0.6 * opening) };
    painter.add(Shape::line(
        vec![foot, knee, button.center_top()],
        Stroke::new(if is_hot { 1.5 } else { 1.0 }, colour),
    ));
}

/// How long ten centimetres are here.
fn ruler(painter: &Painter, c: &Colours, area: Rect, scale: f32) {
    let (right, y) = (area.right() - 2.0, area.top() + 6.0);
    let left = right - 0.1 * scale;
    let stroke = Stroke::new(1.0, c.quiet);
    painter.hline(left..=right, y, stroke);
    for x in [left, right] {
        painter.vline(x, y - 3.0..=y + 3.0, stroke);
    }
    painter.text(pos2(left - 6.0, y), Align2::RIGHT_CENTER, "10 cm", theme::small(), c.quiet);
}

/// Names of the parts, where there is room for them.
fn part_names(painter: &Painter, c: &Colours, body: &Body<'_>, y: f32) {
    let mut segments = body.file.bore.iter().peekable();
    while let Some(first) = segments.next() {
        let mut end_m = first.x_end_m;
        while let Some(next) = segments.next_if(|next| next.part == first.part) {
            end_m = next.x_end_m;
        }
        let (left, right) = (body.x(first.x_start_m), body.x(end_m));
        let galley = painter.layout_no_wrap(first.part.clone(), FontId::proportional(10.0), c.quiet);
        if galley.size().x < right - left {
            painter.galley(pos2(0.5 * (left + right - galley.size().x), y), galley, c.quiet);
        }
    }
}

/// The sound pressure, aligned with the bore.
fn standing(painter: &Painter, c: &Colours, body: &Body<'_>, rect: Rect, wave: &[(f32, f32)]) {
    if rect.height() < 16.0 {
        return;
    }
    painter.hline(rect.x_range(), rect.bottom(), Stroke::new(1.0, c.line));
    if wave.len() < 2 {
        chart::word_at(
            painter,
            rect.center(),
            Align2::CENTER_CENTER,
            "no standing wave known for these holes",
            c.quiet,
        );
        return;
    }
    let most = loudest(wave);
    let point = |&(x_m, magnitude): &(f32, f32)| {
        pos2(body.x(f64::from(x_m)), rect.bottom() - chart::share(magnitude / most) * (rect.height() - 4.0))
    };
    let mut mesh = Mesh::default();
    for (index, of) in wave.iter().enumerate() {
        let at = point(of);
        let (fill, clear) = (c.breath.gamma_multiply(0.35 * chart::share(of.1 / most)), Color32::TRANSPARENT);
        mesh.colored_vertex(at, fill);
        mesh.colored_vertex(pos2(at.x, rect.bottom()), clear);
        if index > 0 {
            let n = 2 * index as u32;
            mesh.add_triangle(n - 2, n - 1, n);
            mesh.add_triangle(n - 1, n, n + 1);
        }
    }
    painter.add(mesh);
    painter.add(Shape::line(wave.iter().map(point).collect(), Stroke::new(2.0, c.breath)));
}

/// Largest magnitude.
fn loudest(wave: &[(f32, f32)]) -> f32 {
    wave.iter().map(|&(_, magnitude)| magnitude).filter(|x| x.is_finite()).fold(1e-6, f32::max)
}

/// The body on the screen: one scale both ways.
struct Body<'a> {
    file: &'a InstrumentFile,
    left: f32,
    axis: f32,
    /// Points per metre.
    scale: f32,
    wall_m: f64,
    length_m: f64,
    last_hole_m: f64,
    widest_m: f64,
}

/// A hole on the screen.
struct Place {
    rect: Rect,
    /// Where a line from the button ends.
    foot: Pos2,
    /// Towards the outside: -1 up, 1 down.
    out: f32,
}

impl<'a> Body<'a> {
    fn new(file: &'a InstrumentFile, area: Rect) -> Self {
        let length_m = file.length_m();
        let mut depths: Vec<f64> = file.holes.iter().map(|hole| hole.chimney_m).collect();
        depths.sort_by(f64::total_cmp);
        let wall_m = depths.get(depths.len() / 2).copied().unwrap_or(WALL_M);
        let last_hole_m = file.holes.iter().map(|hole| hole.x_m).fold(0.0, f64::max);
        let widest_m = file.bore.iter().map(|s| s.r_start_m.max(s.r_end_m)).fold(0.0, f64::max) + RIM_M;
        let by_width = area.width() / length_m as f32;
        // A short fat instrument in a long low window is as high as half of it.
        let scale = by_width.min(0.5 * area.height() / (2.0 * widest_m) as f32);
        let left = area.left() + 0.5 * (area.width() - scale * length_m as f32);
        let axis = area.top() + 0.50 * area.height();
        Self { file, left, axis, scale, wall_m, length_m, last_hole_m, widest_m }
    }

    fn x(&self, x_m: f64) -> f32 {
        self.left + self.scale * x_m as f32
    }

    fn top(&self) -> f32 {
        self.axis - self.scale * self.widest_m as f32
    }

    /// Radius of the outside, m.
    fn outside_m(&self, x_m: f64, bore_m: f64) -> f64 {
        let beak = (x_m / 0.06).clamp(0.15, 1.0);
        let from_hole =
            ((x_m - self.last_hole_m) / (self.length_m - self.last_hole_m).max(1e-6)).clamp(0.0, 1.0);
        bore_m + beak * (self.wall_m + (RIM_M - self.wall_m) * from_hole.sqrt())
    }

    fn paint(&self, painter: &Painter, c: &Colours, wave: &[(f32, f32)]) {
        let most = loudest(wave);
        let level = |x_m: f64| {
            let at = wave.partition_point(|w| f64::from(w.0) < x_m).min(wave.len().saturating_sub(1));
            wave.get(at).map_or(0.0, |w| chart::share(w.1 / most))
        };
        let mut wood = Mesh::default();
        let mut air = Mesh::default();
        for segment in &self.file.bore {
            for (x_m, r_m, is_end) in
                [(segment.x_start_m, segment.r_start_m, false), (segment.x_end_m, segment.r_end_m, true)]
            {
                let (x, bore) = (self.x(x_m), self.scale * r_m as f32);
                let out = self.scale * self.outside_m(x_m, r_m) as f32;
                for side in [-1.0, 1.0] {
                    let base = wood.vertices.len() as u32;
                    let shade = if side < 0.0 { 1.0 } else { 0.82 };
                    let edge = Color32::from_rgb(
                        (f32::from(c.wood.r()) * shade) as u8,
                        (f32::from(c.wood.g()) * shade) as u8,
                        (f32::from(c.wood.b()) * shade) as u8,
                    );
                    wood.colored_vertex(pos2(x, self.axis + side * out), edge);
                    wood.colored_vertex(pos2(x, self.axis + side * bore), c.wood);
                    if is_end {
                        wood.add_triangle(base - 4, base - 3, base);
                        wood.add_triangle(base - 3, base, base + 1);
                    }
                }
                let base = air.vertices.len() as u32;
                let fill = c.air.lerp_to_gamma(c.breath, 0.55 * level(x_m));
                air.colored_vertex(pos2(x, self.axis - bore), fill);
                air.colored_vertex(pos2(x, self.axis + bore), fill);
                if is_end {
                    air.add_triangle(base - 2, base - 1, base);
                    air.add_triangle(base - 1, base, base + 1);
                }
            }
        }
        painter.add(wood);
        painter.add(air);
        self.parts(painter, c);
        // The reed lies on the mouthpiece's lower side.
        let reed = [pos2(self.x(0.0), self.axis + 3.0), pos2(self.x(0.066), self.axis + self.scale * 0.0125)];
        painter.line_segment(reed, Stroke::new(3.0, c.accent));
    }

    /// Joints, as rings.
    fn parts(&self, painter: &Painter, c: &Colours) {
        for pair in self.file.bore.windows(2).filter(|pair| pair[0].part != pair[1].part) {
            let x = self.x(pair[0].x_end_m);
            let out =
                self.scale * self.outside_m(pair[0].x_end_m, pair[0].r_end_m.max(pair[1].r_start_m)) as f32;
            for side in [-1.0_f32, 1.0] {
                let bore = self.scale * pair[0].r_end_m as f32;
                let ring = Rect::from_two_pos(
                    pos2(x - 2.0, self.axis + side * bore),
                    pos2(x + 2.0, self.axis + side * (out + 1.5)),
                );
                painter.rect_filled(ring, CornerRadius::same(1), c.metal);
            }
        }
    }

    fn hole(&self, hole: &ToneHole) -> Place {
        let out = if hole.kind == HoleKind::KeyClosed { 1.0 } else { -1.0 };
        let x = self.x(hole.x_m);
        let half = (self.scale * hole.radius_m as f32).max(1.5);
        let bore_m = self.file.radius_at(hole.x_m);
        let outside = self.scale * (bore_m + hole.chimney_m.max(self.wall_m)) as f32;
        let inside = self.scale * bore_m as f32;
        let rect = Rect::from_two_pos(
            pos2(x - half, self.axis + out * inside),
            pos2(x + half, self.axis + out * outside),
        );
        let foot = pos2(x, self.axis + outside + 7.0);
        Place { rect, foot, out }
    }

    fn paint_hole(&self, painter: &Painter, c: &Colours, hole: &ToneHole, opening: f32, is_hot: bool) {
        let Place { rect, out, .. } = self.hole(hole);
        // The chimney stands in wood, out of the body where it is deeper than the wall.
        let chimney = rect.expand2(vec2(2.5, 0.0));
        painter.rect_filled(chimney, CornerRadius::same(1), c.wood);
        painter.rect_filled(rect, CornerRadius::ZERO, c.air.lerp_to_gamma(c.speaks, 0.6 * opening));
        let outer_y = if out < 0.0 { rect.top() } else { rect.bottom() };
        let lift = 7.0 * opening;
        let width = rect.width() + 5.0;
        let edge = Stroke::new(if is_hot { 2.0 } else { 1.0 }, if is_hot { c.accent } else { c.ink });
        match hole.kind {
            HoleKind::Finger => {
                // A finger tip that comes down on the hole.
                if opening < 0.99 {
                    let centre = pos2(rect.center().x, outer_y + out * (3.0 + lift));
                    let tip = Rect::from_center_size(centre, vec2(width + 2.0, 7.0));
                    painter.rect(tip, CornerRadius::same(3), c.accent, edge, egui::StrokeKind::Inside);
                } else {
                    painter.hline(rect.x_range().expand(2.0), outer_y, edge);
                }
            }
            HoleKind::KeyClosed | HoleKind::PadOpen => {
                let centre = pos2(rect.center().x, outer_y + out * (2.5 + lift));
                let pad = Rect::from_center_size(centre, vec2(width, 5.0));
                painter.rect(pad, CornerRadius::same(2), c.metal, edge, egui::StrokeKind::Inside);
            }
        }
    }
}
