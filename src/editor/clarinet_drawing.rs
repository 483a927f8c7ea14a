//! The drawing of the clarinet: bore, wood, holes and their covers, and the standing wave above. Both directions have the
//! same scale.

use egui::{Align2, Color32, CornerRadius, Mesh, Painter, Pos2, Rect, Shape, Stroke, pos2, vec2};

use crate::editor::body_shape::BodyShape;
use crate::editor::chart;
use crate::editor::theme;
use crate::editor::theme::Colours;
use chalumeau_core::bore::instrument_file::{HoleKind, InstrumentFile, ToneHole};

/// A ruler of ten centimetres.
pub(super) fn ruler(painter: &Painter, c: &Colours, area: Rect, scale: f32) {
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
pub(super) fn part_names(painter: &Painter, c: &Colours, body: &ClarinetDrawing<'_>, y: f32) {
    let mut segments = body.file.bore.iter().peekable();
    while let Some(first) = segments.next() {
        let mut end_m = first.x_end_m;
        while let Some(next) = segments.next_if(|next| next.part == first.part) {
            end_m = next.x_end_m;
        }
        let (left, right) = (body.x(first.x_start_m), body.x(end_m));
        let galley = painter.layout_no_wrap(first.part.clone(), theme::small(), c.quiet);
        if galley.size().x < right - left {
            painter.galley(pos2(0.5 * (left + right - galley.size().x), y), galley, c.quiet);
        }
    }
}

/// The sound pressure, aligned with the bore.
pub(super) fn standing(
    painter: &Painter,
    c: &Colours,
    body: &ClarinetDrawing<'_>,
    rect: Rect,
    wave: &[(f32, f32)],
) {
    if rect.height() < 16.0 {
        return;
    }
    painter.hline(rect.x_range(), rect.bottom(), Stroke::new(1.0, c.line));
    if wave.len() < 2 {
        chart::word_at(
            painter,
            rect.center(),
            Align2::CENTER_CENTER,
            "no standing wave calculated for these holes",
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

/// The drawing, with the same scale in both directions.
pub(super) struct ClarinetDrawing<'a> {
    pub(super) file: &'a InstrumentFile,
    left: f32,
    axis: f32,
    /// Points per metre.
    pub(super) scale: f32,
    shape: BodyShape,
}

/// A hole on the screen.
pub(super) struct HolePlace {
    pub(super) rect: Rect,
    /// Where a line from the button ends.
    pub(super) foot: Pos2,
    /// Towards the outside: -1 up, 1 down.
    out: f32,
}

impl<'a> ClarinetDrawing<'a> {
    pub(super) fn new(file: &'a InstrumentFile, area: Rect) -> Self {
        Self::of(file, BodyShape::new(file), area)
    }

    /// The same in another place.
    pub(super) fn moved(self, area: Rect) -> Self {
        Self::of(self.file, self.shape, area)
    }

    fn of(file: &'a InstrumentFile, shape: BodyShape, area: Rect) -> Self {
        let by_width = area.width() / shape.length_m as f32;
        // A short, wide instrument takes at most half of the height.
        let scale = by_width.min(0.5 * area.height() / (2.0 * shape.widest_m) as f32);
        let left = area.left() + 0.5 * (area.width() - scale * shape.length_m as f32);
        let axis = area.top() + 0.50 * area.height();
        Self { file, left, axis, scale, shape }
    }

    pub(super) fn x(&self, x_m: f64) -> f32 {
        self.left + self.scale * x_m as f32
    }

    pub(super) fn top(&self) -> f32 {
        self.axis - self.scale * self.shape.widest_m as f32
    }

    pub(super) fn bottom(&self) -> f32 {
        self.axis + self.scale * self.shape.widest_m as f32
    }

    pub(super) fn paint(&self, painter: &Painter, c: &Colours, wave: &[(f32, f32)]) {
        let most = loudest(wave);
        let level = |x_m: f64| {
            let at = wave.partition_point(|w| f64::from(w.0) < x_m).min(wave.len().saturating_sub(1));
            wave.get(at).map_or(0.0, |w| chart::share(w.1 / most))
        };
        let mut wood = Mesh::default();
        let mut air = Mesh::default();
        // A mesh ends in steps of whole pixels; lines do not.
        let mut edges: [Vec<Pos2>; 4] = Default::default();
        for segment in &self.file.bore {
            for (x_m, r_m, is_end) in
                [(segment.x_start_m, segment.r_start_m, false), (segment.x_end_m, segment.r_end_m, true)]
            {
                let (x, bore) = (self.x(x_m), self.scale * r_m as f32);
                let out = self.scale * self.shape.around_bore_m(x_m, r_m) as f32;
                for (edge, along) in edges.iter_mut().zip([-out, -bore, bore, out]) {
                    edge.push(pos2(x, self.axis + along));
                }
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
        for edge in edges {
            painter.add(Shape::line(edge, Stroke::new(1.0, c.wood)));
        }
        self.parts(painter, c);
        // The reed lies on the mouthpiece's lower side.
        let reed = [pos2(self.x(0.0), self.axis + 3.0), pos2(self.x(0.066), self.axis + self.scale * 0.0125)];
        painter.line_segment(reed, Stroke::new(3.0, c.cane));
    }

    /// Place of the joint below a part, over all of the body.
    pub(super) fn joint(&self, part: &str) -> Option<Rect> {
        let x_m = self.file.joint_x_m(part)?;
        let out = self.scale * self.shape.around_bore_m(x_m, self.file.radius_at(x_m)) as f32 + 1.5;
        Some(Rect::from_center_size(pos2(self.x(x_m), self.axis), vec2(4.0, 2.0 * out)))
    }

    /// Joints, as rings.
    fn parts(&self, painter: &Painter, c: &Colours) {
        for pair in self.file.bore.windows(2).filter(|pair| pair[0].part != pair[1].part) {
            let x = self.x(pair[0].x_end_m);
            let out = self.scale
                * self.shape.around_bore_m(pair[0].x_end_m, pair[0].r_end_m.max(pair[1].r_start_m)) as f32;
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

    pub(super) fn hole(&self, hole: &ToneHole) -> HolePlace {
        let out = if hole.kind == HoleKind::KeyClosed { 1.0 } else { -1.0 };
        let x = self.x(hole.x_m);
        let half = (self.scale * hole.radius_m as f32).max(1.5);
        let bore_m = self.file.radius_at(hole.x_m);
        let outside = self.scale * (bore_m + hole.chimney_m.max(self.shape.wall_m)) as f32;
        let inside = self.scale * bore_m as f32;
        let rect = Rect::from_two_pos(
            pos2(x - half, self.axis + out * inside),
            pos2(x + half, self.axis + out * outside),
        );
        let foot = pos2(x, self.axis + outside + 7.0);
        HolePlace { rect, foot, out }
    }

    pub(super) fn paint_hole(
        &self,
        painter: &Painter,
        c: &Colours,
        hole: &ToneHole,
        opening: f32,
        is_hot: bool,
    ) {
        let HolePlace { rect, out, .. } = self.hole(hole);
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
                    painter.rect(tip, CornerRadius::same(3), c.skin, edge, egui::StrokeKind::Inside);
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
