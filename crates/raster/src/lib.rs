//! Draws what egui made on a processor: a picture for a test or for the guide needs no graphics card, and the same triangles give the
//! same pixels on every machine. Letters are drawn by egui, before they come here.
//!
//! Triangles cover pixels by the rules of graphics cards: corners lie on a grid of 1/256 of a pixel, a pixel belongs to the
//! triangle that its centre is in, and on a shared edge to one of the two. Colours are mixed as egui asks: premultiplied, in
//! gamma space, in steps of 1/255.

use egui::epaint::{Mesh, Primitive, Vertex};
use egui::{Color32, ColorImage, Pos2, Rect};

/// Steps from a pixel to the next one; corners lie on steps.
const STEPS: i64 = 256;
/// From a pixel's corner to its centre, in steps.
const CENTRE: i64 = STEPS / 2;

/// The last frame of `ctx`, on a transparent ground. Draws all meshes, with egui's own texture: that of letters.
///
/// # Panics
/// If the frame has a texture of the application's, or calls back to draw.
///
/// # Example
/// ```
/// let ctx = egui::Context::default();
/// let input = egui::RawInput {
///     screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(40.0, 20.0))),
///     ..egui::RawInput::default()
/// };
/// let mut output = ctx.run_ui(input, |ui| {
///     ui.painter().rect_filled(ui.max_rect(), 0.0, egui::Color32::RED);
/// });
/// output.textures_delta.clear();
/// let picture = chalumeau_raster::picture(&ctx, &output);
/// assert_eq!(picture.size, [40, 20]);
/// assert_eq!(picture[(20, 10)], egui::Color32::RED);
/// ```
pub fn picture(ctx: &egui::Context, output: &egui::FullOutput) -> ColorImage {
    let scale = output.pixels_per_point;
    let size = ctx.content_rect().size() * scale;
    let mut picture =
        ColorImage::filled([size.x.round() as usize, size.y.round() as usize], Color32::TRANSPARENT);
    let letters = ctx.fonts(|fonts| fonts.image());
    for primitive in ctx.tessellate(output.shapes.clone(), scale) {
        let Primitive::Mesh(mesh) = &primitive.primitive else { panic!("a callback cannot be drawn here") };
        assert_eq!(mesh.texture_id, egui::TextureId::default(), "only egui's own texture can be drawn here");
        let part = Part::of(primitive.clip_rect, scale, picture.size);
        for corners in mesh.indices.chunks_exact(3) {
            part.triangle(&mut picture, &letters, scale, vertices(mesh, corners));
        }
    }
    picture
}

fn vertices(mesh: &Mesh, indices: &[u32]) -> [Vertex; 3] {
    [0, 1, 2].map(|at| mesh.vertices[indices[at] as usize])
}

/// The pixels that may be drawn: `left..right`, `top..bottom`.
struct Part {
    left: i64,
    top: i64,
    right: i64,
    bottom: i64,
}

impl Part {
    fn of(clip: Rect, scale: f32, [width, height]: [usize; 2]) -> Self {
        let pixel = |points: f32, size: usize| ((points * scale).round() as i64).clamp(0, size as i64);
        Self {
            left: pixel(clip.left(), width),
            top: pixel(clip.top(), height),
            right: pixel(clip.right(), width),
            bottom: pixel(clip.bottom(), height),
        }
    }

    fn triangle(&self, picture: &mut ColorImage, letters: &ColorImage, scale: f32, corners: [Vertex; 3]) {
        let mut corners = corners;
        let mut places = corners.map(|corner| on_grid(corner.pos, scale));
        let mut twice_area = Edge::between(places[0], places[1]).at(places[2]);
        if twice_area == 0 {
            return;
        }
        if twice_area < 0 {
            corners.swap(1, 2);
            places.swap(1, 2);
            twice_area = -twice_area;
        }
        // Each opposite the corner that it weighs.
        let edges = [(1, 2), (2, 0), (0, 1)].map(|(from, to)| Edge::between(places[from], places[to]));
        let (low, high) = range(places.map(|(x, _)| x));
        let (left, right) = (self.left.max(low), self.right.min(high));
        let (low, high) = range(places.map(|(_, y)| y));
        let paint = Paint::of(&corners, twice_area, letters);
        for y in self.top.max(low)..self.bottom.min(high) {
            let begin = (left * STEPS + CENTRE, y * STEPS + CENTRE);
            let weights = edges.each_ref().map(|edge| edge.at(begin));
            let (mut first, mut end) = (0, right - left);
            for (edge, weight) in edges.iter().zip(weights) {
                (first, end) = edge.narrowed(first, end, weight);
            }
            for n in first..end {
                let at = |edge: usize| weights[edge] + n * edges[edge].along_x();
                let pixel = &mut picture[((left + n) as usize, y as usize)];
                *pixel = over(*pixel, paint.colour([at(0), at(1), at(2)]));
            }
        }
    }
}

fn on_grid(point: Pos2, scale: f32) -> (i64, i64) {
    let steps = |points: f32| (points * scale * STEPS as f32).round() as i64;
    (steps(point.x), steps(point.y))
}

/// Pixels whose centres may lie among `places`, from the first to one after the last.
fn range(places: [i64; 3]) -> (i64, i64) {
    let [a, b, c] = places;
    (a.min(b).min(c).div_euclid(STEPS), a.max(b).max(c).div_euclid(STEPS) + 1)
}

/// One edge of a triangle, which lies to its right (on a screen, whose y grows downwards).
struct Edge {
    from: (i64, i64),
    x: i64,
    y: i64,
}

impl Edge {
    fn between(from: (i64, i64), to: (i64, i64)) -> Self {
        Self { from, x: to.0 - from.0, y: to.1 - from.1 }
    }

    /// Positive on the triangle's side.
    fn at(&self, (x, y): (i64, i64)) -> i64 {
        self.x * (y - self.from.1) - self.y * (x - self.from.0)
    }

    /// What [`Self::at`] gains from one pixel to the next.
    fn along_x(&self) -> i64 {
        -self.y * STEPS
    }

    /// Of the pixels `first..end` of a row whose first has `weight`, those on the triangle's side. A centre on the edge itself
    /// belongs to the triangle if the edge is a left one or a horizontal one above it.
    fn narrowed(&self, first: i64, end: i64, weight: i64) -> (i64, i64) {
        let owns = self.y < 0 || (self.y == 0 && self.x > 0);
        let weight = if owns { weight } else { weight - 1 };
        match self.along_x() {
            0 => (first, if weight < 0 { first } else { end }),
            gain if gain > 0 => {
                (first.max((-weight).div_euclid(gain) + i64::from((-weight).rem_euclid(gain) > 0)), end)
            }
            gain => (first, end.min(weight.div_euclid(-gain) + 1)),
        }
    }
}

/// What colours a triangle.
enum Paint<'a> {
    Plain([f32; 4]),
    Mixed { corners: &'a [Vertex; 3], area: f32, letters: &'a ColorImage },
}

impl<'a> Paint<'a> {
    fn of(corners: &'a [Vertex; 3], twice_area: i64, letters: &'a ColorImage) -> Self {
        let [a, b, c] = corners;
        if a.color == b.color && b.color == c.color && a.uv == b.uv && b.uv == c.uv {
            return Self::Plain(times(numbers(a.color), texel(letters, a.uv)));
        }
        Self::Mixed { corners, area: twice_area as f32, letters }
    }

    /// Premultiplied, 0 to 1.
    fn colour(&self, weights: [i64; 3]) -> [f32; 4] {
        match self {
            Self::Plain(colour) => *colour,
            Self::Mixed { corners, area, letters } => {
                let (mut colour, mut uv) = ([0.0; 4], egui::Vec2::ZERO);
                for (corner, weight) in corners.iter().zip(weights) {
                    let weight = weight as f32 / area;
                    for (sum, part) in colour.iter_mut().zip(numbers(corner.color)) {
                        *sum += weight * part;
                    }
                    uv += weight * corner.uv.to_vec2();
                }
                times(colour, texel(letters, uv.to_pos2()))
            }
        }
    }
}

fn numbers(colour: Color32) -> [f32; 4] {
    colour.to_array().map(|part| f32::from(part) / 255.0)
}

fn times(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    [0, 1, 2, 3].map(|part| a[part] * b[part])
}

/// The texture at a place of 0 to 1, between its four nearest texels.
fn texel(texture: &ColorImage, uv: Pos2) -> [f32; 4] {
    let along = |place: f32, size: usize| {
        let place = (place * size as f32 - 0.5).clamp(0.0, (size - 1) as f32);
        let low = place as usize;
        (low, (low + 1).min(size - 1), place - place.floor())
    };
    let [width, height] = texture.size;
    let ((left, right, x), (top, bottom, y)) = (along(uv.x, width), along(uv.y, height));
    let at = |x, y| numbers(texture[(x, y)]);
    let between = |a: [f32; 4], b: [f32; 4], part: f32| [0, 1, 2, 3].map(|n| a[n] + part * (b[n] - a[n]));
    between(between(at(left, top), at(right, top), x), between(at(left, bottom), at(right, bottom), x), y)
}

/// `above` on `below`.
fn over(below: Color32, above: [f32; 4]) -> Color32 {
    let clear = 1.0 - above[3];
    let [red, green, blue, alpha] = below.to_array().map(f32::from);
    let mixed = |below: f32, above: f32| (255.0 * above + clear * below).round().clamp(0.0, 255.0) as u8;
    Color32::from_rgba_premultiplied(
        mixed(red, above[0]),
        mixed(green, above[1]),
        mixed(blue, above[2]),
        mixed(alpha, above[3]),
    )
}
