//! The clarinet on its stage: body, rings, keys, holes, fingers, and the sound pressure above.
//!
//! Places and sizes along the bore are those of the instrument file. The body is drawn somewhat thicker than it is, and the outer
//! shape is plausible: the file knows the bore and the depth of the holes, but not the wood. A short clarinet is drawn short;
//! one that is longer than the usual ones fills the stage, is slender, and has neck and bell of metal, as bass clarinets have.
//! Finger holes are in front, with pads that stand open, and plates where no finger tip covers the hole; closed keys are on the
//! upper edge.

use egui::{
    Color32, CursorIcon, Mesh, Painter, Pos2, Rect, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2,
};

use super::lit_body::{band, glow, lit, plate, shadow, turned};
use super::motion::Motion;
use crate::editor::Action;
use crate::editor::alteration_editor::{AlterationEditor, Altered};
use crate::editor::body_shape::{BEAK_M, BodyShape};
use crate::editor::chart;
use crate::editor::clarinet_view;
use crate::editor::hole_names::{hole_title, is_thumb};
use crate::editor::snapshot::Snapshot;
use crate::editor::theme;
use crate::editor::theme::Colours;
use chalumeau_core::bore::instrument_file::{HoleKind, InstrumentFile, ToneHole};

/// The body is at least this thick over its length on the screen, or it would be a line in a small window. A longer one than
/// [`USUAL_M`] is less thick, by the cube root.
const LEAST_THICKNESS: f32 = 0.056;
/// Length of the usual clarinets, in B flat and A, m: these fill the stage.
const USUAL_M: f64 = 0.64;
/// Clarinets from this length on have neck and bell of metal, m: alto clarinets, basset horns and larger ones.
const METAL_M: f64 = 0.9;
/// The widest hole that a finger tip covers, m of the radius. A wider one has a plate under the finger.
const UNDER_FINGER_M: f64 = 6e-3;
/// Thickness of the body in a window of the usual size, points: keys and rings grow with it.
const USUAL_THICKNESS: f32 = 56.0;
/// Most that keys and rings grow.
const MOST_GROWN: f32 = 2.5;
/// Most that the thickness is exaggerated.
const MOST_EXAGGERATED: f32 = 2.4;
/// Steps along the bore that the outline has.
const STATIONS: usize = 160;
/// The reed over the length of the mouthpiece.
const REED_SHARE: f64 = 0.78;
/// Height of the hint at the lower edge, points.
const HINT: f32 = 30.0;
/// How far a finger or pad lifts, points.
const LIFT: f32 = 9.0;
/// Level at which the picture's light begins, and where it is full, dBFS.
const LIGHT_DB: (f32, f32) = (-50.0, -12.0);

/// The stage without the instrument.
pub fn ground(ui: &Ui, rect: Rect) {
    let c = Colours::here(ui);
    let painter = ui.painter_at(rect);
    let light = c.panel;
    glow(&painter, rect.center(), 0.62 * rect.width(), light);
}

/// How loud it is now, 0..=1, for the light in the picture.
fn loudness(snapshot: &Snapshot) -> f32 {
    let (quiet, loud) = LIGHT_DB;
    let level = snapshot.history.level_db.last().copied().unwrap_or(quiet);
    if snapshot.heard.f0_hz.is_none() { 0.0 } else { chart::share((level - quiet) / (loud - quiet)) }
}

/// Draws the instrument as the user has altered it, lets holes be dragged, and gives back the hole that was clicked. Its words are
/// `grown` times as large as in a window of the usual size.
pub fn draw(
    ui: &mut Ui,
    rect: Rect,
    snapshot: &Snapshot,
    motion: &Motion,
    grown: f32,
    (alterations, actions): (&mut AlterationEditor, &mut Vec<Action>),
) -> Option<usize> {
    let file = &*AlterationEditor::shown(snapshot);
    let c = Colours::here(ui);
    let body = Body::new(file, rect);
    let loudness = loudness(snapshot);
    {
        let painter = ui.painter_at(rect);
        body.wave(&painter, c, &snapshot.standing, rect, loudness, grown);
        let size = vec2(1.04 * body.length(), 0.9 * body.thickness());
        // Above the hint at the lower edge.
        let low = rect.bottom() - HINT - 0.5 * size.y;
        let under = pos2(body.middle(), (body.axis + 1.9 * body.thickness()).min(low));
        shadow(&painter, Rect::from_center_size(under, size), 0.28);
        body.paint(&painter, c, motion.reed(), chart::share(snapshot.mouth_now_kpa() / 3.0));
        body.rods(&painter, c);
    }
    let flows = flows(file, &snapshot.standing, motion);
    let mut clicked = None;
    // Pads before fingers: a finger lies on its ring.
    let mut order: Vec<usize> = (0..file.holes.len()).collect();
    order.sort_by_key(|&hole| file.holes[hole].kind == HoleKind::Finger);
    for hole in order {
        let tone_hole = &file.holes[hole];
        let opening = motion.opening(hole);
        let place = body.place(tone_hole);
        let response =
            ui.interact(place.expand(3.0), ui.scope_id().with(("stage hole", hole)), Sense::click_and_drag());
        let is_hot = response.hovered() || response.has_focus() || response.dragged();
        alterations.follow(&response, Altered::Hole(hole), body.scale, snapshot, actions);
        body.hole(&ui.painter_at(rect), c, tone_hole, opening, loudness * flows[hole], is_hot);
        let state = if opening >= 0.5 { "open" } else { "closed" };
        response.widget_info(|| {
            WidgetInfo::selected(
                Role::Switch,
                true,
                opening >= 0.5,
                format!("Hole {}", hole_title(&tone_hole.name)),
            )
        });
        let response = response
            .on_hover_cursor(CursorIcon::PointingHand)
            .accessible_name(format!("Hole {}, {state}", hole_title(&tone_hole.name)));
        if response.on_hover_ui(|ui| clarinet_view::about(ui, tone_hole, opening)).clicked() {
            clicked = Some(hole);
        }
    }
    clicked
}

/// Flow through each open hole over the largest, 0..=1: the pressure inside drives the air of the hole, whose mass over its area
/// goes as one over its radius.
fn flows(file: &InstrumentFile, wave: &[(f32, f32)], motion: &Motion) -> Vec<f32> {
    let pressure = |x_m: f64| {
        let at = wave.partition_point(|&(x, _)| f64::from(x) < x_m).min(wave.len().saturating_sub(1));
        wave.get(at).map_or(0.0, |&(_, magnitude)| magnitude)
    };
    let flow = |(hole, of): (usize, &ToneHole)| motion.opening(hole) * of.radius_m as f32 * pressure(of.x_m);
    let flows: Vec<f32> = file.holes.iter().enumerate().map(flow).collect();
    let most = flows.iter().copied().filter(|flow| flow.is_finite()).fold(1e-9, f32::max);
    flows.into_iter().map(|flow| chart::share(flow / most)).collect()
}

/// The body on the screen.
struct Body<'a> {
    file: &'a InstrumentFile,
    left: f32,
    axis: f32,
    /// Points per metre, along and across.
    scale: f32,
    across: f32,
    /// Size of keys and rings over that in a window of the usual size.
    grown: f32,
    shape: BodyShape,
}

impl<'a> Body<'a> {
    fn new(file: &'a InstrumentFile, rect: Rect) -> Self {
        let shape = BodyShape::new(file);
        let margin = (0.03 * rect.width()).clamp(16.0, 40.0);
        let share = (shape.length_m / USUAL_M).min(1.0) as f32;
        let scale = share * (rect.width() - 2.0 * margin) / shape.length_m as f32;
        let thin = 2.0 * (file.nominal_radius_m + shape.wall_m) / shape.length_m;
        let least = LEAST_THICKNESS * (USUAL_M / shape.length_m).min(1.0).cbrt() as f32;
        let exaggerated = (least / thin as f32).clamp(1.0, MOST_EXAGGERATED);
        // The bell has at most half of the height.
        let across = (scale * exaggerated).min(0.25 * rect.height() / shape.widest_m as f32);
        let axis = rect.top() + 0.62 * rect.height();
        let left = rect.center().x - 0.5 * scale * shape.length_m as f32;
        let thickness = 2.0 * across * (file.nominal_radius_m + shape.wall_m) as f32;
        let grown = (thickness / USUAL_THICKNESS).clamp(1.0, MOST_GROWN);
        Self { file, left, axis, scale, across, grown, shape }
    }

    fn x(&self, x_m: f64) -> f32 {
        self.left + self.scale * x_m as f32
    }

    fn length(&self) -> f32 {
        self.scale * self.shape.length_m as f32
    }

    fn middle(&self) -> f32 {
        self.left + 0.5 * self.length()
    }

    /// Diameter of the straight part.
    fn thickness(&self) -> f32 {
        2.0 * self.across * (self.file.nominal_radius_m + self.shape.wall_m) as f32
    }

    /// Radius of the outside on the screen.
    fn outside(&self, x_m: f64) -> f32 {
        let bore_m = self.file.radius_at(x_m.min(self.shape.length_m - 1e-9));
        self.across * self.shape.outside_m(x_m, bore_m) as f32
    }

    /// End of the part that the reed lies on, m.
    fn mouthpiece_end_m(&self) -> f64 {
        let first = self.file.bore.first().map_or("", |segment| &segment.part);
        let part = self.file.bore.iter().take_while(|segment| segment.part == first);
        part.map(|segment| segment.x_end_m).last().unwrap_or(0.0).min(0.18)
    }

    /// Where the neck of metal ends and the bell of metal begins, m. The neck is the part below the mouthpiece, unless it has holes.
    fn metal_m(&self, mouthpiece_m: f64) -> [f64; 2] {
        let (bore, all_m) = (&self.file.bore, self.shape.length_m);
        if all_m < METAL_M {
            return [mouthpiece_m, all_m];
        }
        let neck =
            bore.iter().find(|segment| segment.x_end_m > mouthpiece_m + 1e-6).map(|segment| &segment.part);
        let neck = bore.iter().filter(|segment| Some(&segment.part) == neck);
        let neck_m = neck.map(|segment| segment.x_end_m).next_back().unwrap_or(mouthpiece_m);
        let bell = bore.last().map(|segment| &segment.part);
        let bell = bore.iter().find(|segment| Some(&segment.part) == bell);
        let bell_m = bell.map_or(all_m, |segment| segment.x_start_m);
        let is_free =
            |from_m: f64, to_m: f64| !self.file.holes.iter().any(|hole| (from_m..to_m).contains(&hole.x_m));
        [
            if is_free(mouthpiece_m, neck_m) { neck_m } else { mouthpiece_m },
            if is_free(bell_m, all_m) { bell_m } else { all_m },
        ]
    }

    /// The sound pressure over the body, higher and lighter when it is loud.
    fn wave(
        &self,
        painter: &Painter,
        c: &Colours,
        wave: &[(f32, f32)],
        rect: Rect,
        loudness: f32,
        grown: f32,
    ) {
        // Straight, so that only pressure bends the line: above the keys and above the bell.
        let body = self.outside(0.5 * self.shape.length_m) + 18.0 * self.grown;
        let foot = self.axis - body.max(self.across * self.shape.widest_m as f32 + 4.0);
        let room = foot - rect.top() - 18.0;
        if wave.len() < 2 || room < 20.0 || loudness <= 0.0 {
            return;
        }
        let most =
            wave.iter().map(|&(_, magnitude)| magnitude).filter(|m| m.is_finite()).fold(1e-6, f32::max);
        let height = room * (0.25 + 0.75 * loudness);
        let share = |magnitude: f32| chart::share(magnitude / most);
        let point =
            |&(x_m, magnitude): &(f32, f32)| pos2(self.x(f64::from(x_m)), foot - share(magnitude) * height);
        let mut mesh = Mesh::default();
        for (index, of) in wave.iter().enumerate() {
            let at = point(of);
            mesh.colored_vertex(at, c.breath.gamma_multiply(0.42 * loudness * share(of.1)));
            mesh.colored_vertex(pos2(at.x, foot), c.breath.gamma_multiply(0.05 * share(of.1)));
            if index > 0 {
                let n = 2 * index as u32;
                mesh.add_triangle(n - 2, n - 1, n);
                mesh.add_triangle(n - 1, n, n + 1);
            }
        }
        painter.add(mesh);
        let ends = self.x(0.0)..=self.x(self.shape.length_m);
        painter.hline(ends, foot, Stroke::new(1.0, c.breath.gamma_multiply(0.3)));
        painter.add(Shape::line(wave.iter().map(point).collect(), Stroke::new(2.0, c.breath)));
        let font = theme::small_grown(grown);
        if room > 60.0 {
            let at = rect.left_top() + vec2(self.left - rect.left() + 2.0, 2.0);
            painter.text(at, egui::Align2::LEFT_TOP, "sound pressure in the bore", font, c.breath);
        }
    }

    /// The body itself, from the reed to the bell. `breath` lights the tip.
    fn paint(&self, painter: &Painter, c: &Colours, reed: f32, breath: f32) {
        let mouthpiece_m = self.mouthpiece_end_m();
        let ebonite = c.ebony.lerp_to_gamma(c.wood, 0.35);
        let [neck_m, bell_m] = self.metal_m(mouthpiece_m);
        let colour = |x_m: f64| match x_m {
            _ if x_m < mouthpiece_m => ebonite,
            _ if x_m < neck_m || x_m > bell_m => c.metal,
            _ => c.wood,
        };
        // Two stations where the colour changes, so that it ends sharply.
        let mut places: Vec<f64> =
            (0..=STATIONS).map(|n| self.shape.length_m * n as f64 / STATIONS as f64).collect();
        places.push(BEAK_M);
        places.extend([mouthpiece_m, neck_m, bell_m].into_iter().flat_map(|x_m| [x_m - 1e-6, x_m + 1e-6]));
        places.retain(|x_m| (0.0..=self.shape.length_m).contains(x_m));
        places.sort_by(f64::total_cmp);
        let stations: Vec<_> =
            places.into_iter().map(|x_m| (self.x(x_m), self.outside(x_m), colour(x_m))).collect();
        turned(painter, self.axis, &stations);
        self.bell(painter, c);
        for pair in self.file.bore.windows(2).filter(|pair| pair[0].part != pair[1].part) {
            let (x, out) = (self.x(pair[0].x_end_m), self.outside(pair[0].x_end_m));
            let half = 3.5 * self.grown;
            band(painter, self.axis, x - half..=x + half, out + 3.0 * self.grown, c.metal);
        }
        self.reed(painter, c, reed);
        for share in [0.52, 0.64, 0.76] {
            let x = self.x(share * mouthpiece_m);
            let upper = self.axis - self.outside(share * mouthpiece_m) - 2.5 * self.grown;
            // Around the reed, too.
            let lower = self.reed_below(share * mouthpiece_m) + 2.0 * self.grown;
            let half = 3.0 * self.grown;
            band(painter, 0.5 * (upper + lower), x - half..=x + half, 0.5 * (lower - upper), c.metal);
        }
        if breath > 0.0 {
            glow(
                painter,
                pos2(self.x(0.0), self.axis + 2.0),
                self.grown * (9.0 + 9.0 * breath),
                c.breath.gamma_multiply(0.75 * breath),
            );
        }
    }

    /// Lower edge of the reed on the mouthpiece, where the ligature holds it.
    fn reed_below(&self, x_m: f64) -> f32 {
        let end_m = REED_SHARE * self.mouthpiece_end_m();
        let along = ((x_m / end_m - 0.4) / 0.6).clamp(0.0, 1.0) as f32;
        self.axis + self.outside(x_m) + 1.5 + (0.10 + 0.06 * along) * self.thickness()
    }

    /// The reed on the lower side of the mouthpiece; its tip moves.
    fn reed(&self, painter: &Painter, c: &Colours, opening: f32) {
        let mouthpiece_m = self.mouthpiece_end_m();
        let end_m = REED_SHARE * mouthpiece_m;
        let lower = |x_m: f64| self.axis + self.outside(x_m);
        let tip = pos2(self.x(0.0) - 1.0, self.axis + self.outside(0.0) + self.grown * (1.0 + 3.5 * opening));
        let heel = pos2(self.x(end_m), lower(end_m) + 1.5);
        let middle = pos2(self.x(0.4 * end_m), lower(0.4 * end_m) + 1.5);
        let heel_low = heel + vec2(0.0, 0.16 * self.thickness());
        let middle_low = middle + vec2(0.0, 0.10 * self.thickness());
        let mut mesh = Mesh::default();
        for (upper, lower) in [(tip, tip + vec2(0.0, 1.5)), (middle, middle_low), (heel, heel_low)] {
            mesh.colored_vertex(upper, lit(c.cane, 1.1));
            mesh.colored_vertex(lower, lit(c.cane, 0.78));
        }
        for n in [0, 2] {
            mesh.add_triangle(n, n + 1, n + 2);
            mesh.add_triangle(n + 1, n + 2, n + 3);
        }
        painter.add(mesh);
        // A mesh ends in steps of whole pixels; lines do not.
        let low = vec![tip + vec2(0.0, 1.5), middle_low, heel_low];
        painter.add(Shape::line(low, Stroke::new(1.0, lit(c.cane, 0.78))));
        painter.add(Shape::line(vec![tip, middle, heel], Stroke::new(1.0, lit(c.cane, 1.1))));
    }

    /// The opening of the bell and its rim.
    fn bell(&self, painter: &Painter, c: &Colours) {
        let (x, out) = (self.x(self.shape.length_m), self.across * self.shape.widest_m as f32);
        let centre = pos2(x, self.axis);
        painter.add(Shape::ellipse_filled(centre, vec2(0.17 * out, out), c.metal));
        painter.add(Shape::ellipse_filled(
            centre + vec2(0.5, 0.0),
            vec2(0.13 * out, 0.94 * out),
            lit(c.ebony, 0.7),
        ));
        let stroke = Stroke::new(1.0, lit(c.metal, 1.4));
        painter.add(Shape::ellipse_stroke(centre, vec2(0.17 * out, out), stroke));
    }

    /// The rods that carry the keys: one along each part that has some.
    fn rods(&self, painter: &Painter, c: &Colours) {
        let mut parts: Vec<&str> = self.file.bore.iter().map(|segment| &*segment.part).collect();
        parts.dedup();
        for part in parts {
            let mut segments = self.file.bore.iter().filter(|segment| segment.part == part);
            let Some(first) = segments.next() else { continue };
            let end_m = segments.next_back().map_or(first.x_end_m, |last| last.x_end_m);
            let keys = self.file.holes.iter().filter(|hole| hole.kind == HoleKind::KeyClosed);
            let places: Vec<f64> =
                keys.map(|hole| hole.x_m).filter(|&x_m| (first.x_start_m..end_m).contains(&x_m)).collect();
            let (Some(&from), Some(&to)) = (places.first(), places.last()) else { continue };
            if places.len() < 2 {
                continue;
            }
            let one = self.grown;
            let y = self.axis - self.outside(0.5 * (from + to)) - 5.0 * one;
            let (left, right) = (self.x(from) - 8.0 * one, self.x(to) + 8.0 * one);
            band(painter, y, left..=right, 2.0 * one, c.metal);
            for x in [left, right] {
                band(painter, y + one, x - 2.5 * one..=x + 2.5 * one, 4.0 * one, c.metal);
            }
        }
    }

    /// Half the width of a hole or its pad on the screen.
    fn half(&self, hole: &ToneHole) -> f32 {
        (self.across * hole.radius_m as f32).clamp(3.0 * self.grown, 0.42 * self.thickness())
    }

    /// Where a hole is.
    fn place(&self, hole: &ToneHole) -> Rect {
        let half = self.half(hole);
        match hole.kind {
            HoleKind::KeyClosed => {
                let centre = pos2(self.x(hole.x_m), self.axis - self.outside(hole.x_m) - 4.0 * self.grown);
                Rect::from_center_size(centre, vec2(2.0 * half + 6.0, 12.0 * self.grown))
            }
            HoleKind::Finger | HoleKind::PadOpen => {
                // The thumb is behind: its hole looks round the lower edge.
                let low = if is_thumb(&hole.name) { 0.80 * self.outside(hole.x_m) } else { 0.0 };
                Rect::from_center_size(
                    pos2(self.x(hole.x_m), self.axis + low),
                    egui::Vec2::splat(2.0 * half + 6.0),
                )
            }
        }
    }

    /// One hole with its finger, pad or key. `flow` is the sound that comes out, 0..=1.
    fn hole(&self, painter: &Painter, c: &Colours, hole: &ToneHole, opening: f32, flow: f32, is_hot: bool) {
        let (place, half, one) = (self.place(hole), self.half(hole), self.grown);
        let centre = place.center();
        let edge = if is_hot { Stroke::new(2.0, c.accent) } else { Stroke::new(1.0, lit(c.metal, 0.6)) };
        let air = lit(c.ebony, 0.6).lerp_to_gamma(c.breath, 0.85 * flow);
        if flow > 0.02 {
            glow(
                painter,
                self.mouth_of(hole, centre),
                half + 12.0 * one * flow,
                c.breath.gamma_multiply(0.6 * flow),
            );
        }
        match hole.kind {
            HoleKind::KeyClosed => {
                let lifted = centre - vec2(0.0, 0.7 * one * LIFT * opening);
                if opening > 0.05 {
                    let mouth =
                        Rect::from_center_size(centre + vec2(0.0, 4.0 * one), vec2(2.0 * half, 4.0 * one));
                    painter.add(Shape::ellipse_filled(mouth.center(), 0.5 * mouth.size(), air));
                }
                plate(painter, lifted, vec2(half + 3.0 * one, 4.5 * one), c.metal, edge);
            }
            HoleKind::PadOpen => {
                painter.circle(centre, half + one, air, Stroke::new(1.5 * one, lit(c.metal, 0.8)));
                let lifted = centre - vec2(0.0, one * LIFT * opening);
                let tilt = 1.0 - 0.45 * opening;
                plate(painter, lifted, vec2(half + 3.0 * one, (half + 3.0 * one) * tilt), c.metal, edge);
            }
            HoleKind::Finger => {
                painter.circle_filled(centre, half + 3.0 * one, lit(c.metal, 0.85));
                painter.circle(centre, half, air, edge);
                let lifted = centre - vec2(0.0, one * LIFT * opening);
                let has_plate = hole.radius_m > UNDER_FINGER_M;
                if has_plate {
                    let tilt = 1.0 - 0.45 * opening;
                    plate(painter, lifted, vec2(half + 2.0 * one, (half + 2.0 * one) * tilt), c.metal, edge);
                }
                if opening < 0.99 {
                    let half = if has_plate { 0.7 * half } else { half };
                    finger(painter, c, lifted, half, one, 1.0 - 0.8 * opening);
                }
            }
        }
    }

    /// Where the sound of a hole comes out.
    fn mouth_of(&self, hole: &ToneHole, centre: Pos2) -> Pos2 {
        if hole.kind == HoleKind::KeyClosed { centre + vec2(0.0, 4.0 * self.grown) } else { centre }
    }
}

/// The tip of a finger on a hole; `one` is a point in a window of the usual size.
fn finger(painter: &Painter, c: &Colours, centre: Pos2, half: f32, one: f32, presence: f32) {
    let colour = |light: f32| lit(c.skin, light).gamma_multiply(presence);
    let size = vec2(half + 5.0 * one, half + 3.0 * one);
    painter.add(Shape::ellipse_filled(
        centre + vec2(0.0, 2.0),
        size,
        Color32::from_black_alpha((70.0 * presence) as u8),
    ));
    painter.add(Shape::ellipse_filled(centre, size, colour(0.86)));
    painter.add(Shape::ellipse_filled(centre - vec2(0.0, 1.0), 0.82 * size, colour(1.0)));
    painter.add(Shape::ellipse_filled(
        centre - vec2(0.0, 0.28 * size.y),
        vec2(0.55 * size.x, 0.42 * size.y),
        colour(1.16),
    ));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thumb_hole_is_behind_and_l1_in_front() {
        let file = InstrumentFile::built_in();
        let rect = Rect::from_min_size(Pos2::ZERO, vec2(1000.0, 400.0));
        let body = Body::new(&file, rect);
        let below_axis = |name: &str| {
            let hole = &file.holes[file.hole(name).expect(name)];
            body.place(hole).center().y - body.axis
        };
        assert_eq!(below_axis("L1"), 0.0);
        assert!(below_axis("THUMB") > 0.3 * body.thickness(), "{}", below_axis("THUMB"));
    }

    /// What tells instruments apart: a short one is short, a bass is slender, silver at both ends, and has plates.
    #[test]
    fn instruments_are_told_by_their_looks() {
        use chalumeau_core::bore::bundled::Bundled;
        let rect = Rect::from_min_size(Pos2::ZERO, vec2(1000.0, 320.0));
        let looks = |of: Bundled, see: fn(&Body<'_>) -> f32| see(&Body::new(&of.file(), rect));
        let length = |of| looks(of, |body| body.length());
        assert!(length(Bundled::EFlat) < 0.82 * length(Bundled::BFlat));
        assert!(
            length(Bundled::EFlat) < 0.9 * length(Bundled::C) && length(Bundled::C) < length(Bundled::BFlat)
        );
        let slender = |of| looks(of, |body| body.thickness() / body.length());
        assert!(slender(Bundled::Bass) < 0.85 * slender(Bundled::BFlat));
        let silver = |of| {
            looks(of, |body| {
                let mouthpiece_m = body.mouthpiece_end_m();
                let [neck_m, bell_m] = body.metal_m(mouthpiece_m);
                (neck_m - mouthpiece_m + body.shape.length_m - bell_m) as f32
            })
        };
        assert!(silver(Bundled::Bass) > 0.2 && silver(Bundled::A) == 0.0);
        let plates = |of: Bundled| {
            let file = of.file();
            let holes = file.holes.iter().filter(|hole| hole.kind == HoleKind::Finger);
            holes.filter(|hole| hole.radius_m > UNDER_FINGER_M).count()
        };
        assert!(plates(Bundled::Bass) > 3 && plates(Bundled::A) == 0);
    }
}
