//! Shapes on a plotters backend, in pixels of the nominal size.
//!
//! Backends know whole pixels only. Bitmaps are therefore drawn larger and averaged, vector pictures in tenths of a
//! pixel. Words are drawn from the embedded font: as pixels, or as outlines, so that a picture looks the same where no
//! font is installed.

use crate::draw::{DrawError, encode_png, escaped, font};
use crate::palette::Rgb;
use plotters_backend::{BackendColor, BackendCoord, BackendStyle, DrawingBackend};
use std::fmt::Write;

/// A place, right and down from the upper left corner, pixels.
pub type PixelPoint = (f64, f64);

/// What a vector picture has besides the backend's shapes.
#[derive(Default)]
pub struct SvgParts {
    /// Pictures, drawn under everything else.
    pub under: String,
    /// Words, drawn over everything else.
    pub over: String,
}

/// Something to draw on.
pub struct Canvas<B> {
    backend: B,
    /// Backend's pixels per nominal pixel.
    scale: f64,
    vector: Option<SvgParts>,
}

/// How wide a line is, and in which colour.
#[derive(Clone, Copy)]
pub struct Pen {
    pub colour: Rgb,
    pub width: f64,
}

struct Style {
    colour: BackendColor,
    width: u32,
}

impl BackendStyle for Style {
    fn color(&self) -> BackendColor {
        self.colour
    }

    fn stroke_width(&self) -> u32 {
        self.width
    }
}

fn colour(Rgb(r, g, b): Rgb, opacity: f64) -> BackendColor {
    BackendColor { alpha: opacity.clamp(0.0, 1.0), rgb: (r, g, b) }
}

/// Where words stand relative to their place: the fraction of their width to its left.
#[derive(Clone, Copy)]
pub enum Align {
    Left,
    Centre,
    Right,
}

impl<B: DrawingBackend> Canvas<B> {
    pub fn new(backend: B, scale: f64, vector: Option<SvgParts>) -> Self {
        Self { backend, scale, vector }
    }

    /// Ends drawing.
    pub fn finish(mut self) -> Result<Option<SvgParts>, DrawError> {
        self.backend.present().map_err(DrawError::backend)?;
        Ok(self.vector)
    }

    fn at(&self, (x, y): PixelPoint) -> BackendCoord {
        ((x * self.scale).round() as i32, (y * self.scale).round() as i32)
    }

    fn style(&self, pen: Pen) -> Style {
        Style { colour: colour(pen.colour, 1.0), width: ((pen.width * self.scale).round() as u32).max(1) }
    }

    /// Lines from point to point, with round corners.
    pub fn line(&mut self, points: &[PixelPoint], pen: Pen) -> Result<(), DrawError> {
        let mut path: Vec<BackendCoord> = Vec::with_capacity(points.len());
        for (index, &point) in points.iter().enumerate() {
            let at = self.at(point);
            // Steps shorter than a pixel would follow the backend's grid instead of the curve; corners stay.
            let near = |before: &BackendCoord| {
                let (dx, dy) = (f64::from(at.0 - before.0), f64::from(at.1 - before.1));
                dx.hypot(dy) < self.scale
            };
            if path.last().is_none_or(|before| !near(before)) {
                path.push(at);
            } else if index + 1 == points.len() && path.len() > 1 {
                path.pop();
                path.push(at);
            }
        }
        if path.len() < 2 {
            return Ok(());
        }
        let style = self.style(pen);
        if self.vector.is_some() {
            return self.backend.draw_path(path, &style).map_err(DrawError::backend);
        }
        // The backend's own wide lines tear where they turn back. Stroke by stroke they do not.
        let (half, fill) =
            (0.5 * pen.width * self.scale, Style { colour: colour(pen.colour, 1.0), width: 1 });
        for pair in path.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            let (dx, dy) = (f64::from(b.0 - a.0), f64::from(b.1 - a.1));
            let length = dx.hypot(dy).max(1e-9);
            let (nx, ny) = (-dy / length * half, dx / length * half);
            let corner = |p: BackendCoord, side: f64| {
                ((f64::from(p.0) + side * nx).round() as i32, (f64::from(p.1) + side * ny).round() as i32)
            };
            let corners = [corner(a, 1.0), corner(b, 1.0), corner(b, -1.0), corner(a, -1.0)];
            self.backend.fill_polygon(corners, &fill).map_err(DrawError::backend)?;
        }
        if half >= 2.0 && path.len() > 2 {
            for &joint in &path[1..path.len() - 1] {
                let radius = (half - 0.5).round() as u32;
                self.backend.draw_circle(joint, radius, &fill, true).map_err(DrawError::backend)?;
            }
        }
        Ok(())
    }

    /// A filled shape.
    pub fn fill(&mut self, corners: &[PixelPoint], fill: Rgb, opacity: f64) -> Result<(), DrawError> {
        let mut path: Vec<BackendCoord> = corners.iter().map(|&point| self.at(point)).collect();
        path.dedup();
        if path.len() < 3 {
            return Ok(());
        }
        let style = Style { colour: colour(fill, opacity), width: 1 };
        self.backend.fill_polygon(path, &style).map_err(DrawError::backend)
    }

    /// A filled rectangle.
    pub fn rect(
        &mut self,
        from: PixelPoint,
        to: PixelPoint,
        fill: Rgb,
        opacity: f64,
    ) -> Result<(), DrawError> {
        let style = Style { colour: colour(fill, opacity), width: 1 };
        let (from, to) = (self.at(from), self.at(to));
        // The last pixel is drawn too.
        let to = (to.0.max(from.0 + 1) - 1, to.1.max(from.1 + 1) - 1);
        self.backend.draw_rect(from, to, &style, true).map_err(DrawError::backend)
    }

    /// A filled circle.
    pub fn disc(&mut self, centre: PixelPoint, radius: f64, fill: Rgb) -> Result<(), DrawError> {
        let style = Style { colour: colour(fill, 1.0), width: 1 };
        let (centre, radius) = (self.at(centre), (radius * self.scale).round().max(1.0) as u32);
        self.backend.draw_circle(centre, radius, &style, true).map_err(DrawError::backend)
    }

    /// Words; `place` is on their base line. `upright` words run from bottom to top.
    pub fn text(
        &mut self,
        place: PixelPoint,
        text: &str,
        size: f64,
        fill: Rgb,
        align: Align,
        upright: bool,
    ) -> Result<(), DrawError> {
        let back = font::width(text, size)
            * match align {
                Align::Left => 0.0,
                Align::Centre => 0.5,
                Align::Right => 1.0,
            };
        let turn = |right: f64, down: f64| if upright { (down, -right) } else { (right, down) };
        let (dx, dy) = turn(-back, 0.0);
        let start = (place.0 + dx, place.1 + dy);
        if let Some(vector) = &mut self.vector {
            let path = font::path(text, size, |right, down| {
                let (dx, dy) = turn(right, down);
                (start.0 + dx, start.1 + dy)
            });
            let Rgb(r, g, b) = fill;
            let name = escaped(text);
            let _ = writeln!(
                vector.over,
                "<path aria-label=\"{name}\" fill=\"#{r:02x}{g:02x}{b:02x}\" stroke=\"none\" d=\"{path}\"/>"
            );
            return Ok(());
        }
        let (x, y) = self.at(start);
        let (width, height) = self.backend.get_size();
        let mut done = Ok(());
        font::pixels(text, size * self.scale, |right, down, covered| {
            let (dx, dy) = if upright { (down, -right) } else { (right, down) };
            let (x, y) = (x + dx, y + dy);
            if done.is_ok() && x >= 0 && y >= 0 && (x as u32) < width && (y as u32) < height {
                let drawn = self.backend.draw_pixel((x, y), colour(fill, f64::from(covered)));
                done = drawn.map_err(DrawError::backend);
            }
        });
        done
    }

    /// A picture from `from` to `to`, its colours by distance from its upper left corner, 0..1 each.
    pub fn picture(
        &mut self,
        from: PixelPoint,
        to: PixelPoint,
        colour_at: impl Fn(f64, f64) -> Rgb,
    ) -> Result<(), DrawError> {
        if self.vector.is_some() {
            // Two pixels a pixel are as much as a screen or a printer shows.
            let width = (2.0 * (to.0 - from.0)).round().max(1.0) as u32;
            let height = (2.0 * (to.1 - from.1)).round().max(1.0) as u32;
            let mut bytes = Vec::with_capacity((width * height * 3) as usize);
            for y in 0..height {
                for x in 0..width {
                    let unit = |n: u32, of: u32| (f64::from(n) + 0.5) / f64::from(of);
                    let Rgb(r, g, b) = colour_at(unit(x, width), unit(y, height));
                    bytes.extend([r, g, b]);
                }
            }
            let png = encode_png(&bytes, width, height)?;
            let data = base64::Engine::encode(&base64::engine::general_purpose::STANDARD, png);
            if let Some(vector) = &mut self.vector {
                let _ = writeln!(
                    vector.under,
                    "<image x=\"{:.2}\" y=\"{:.2}\" width=\"{:.2}\" height=\"{:.2}\" preserveAspectRatio=\"none\" \
                     href=\"data:image/png;base64,{data}\"/>",
                    from.0,
                    from.1,
                    to.0 - from.0,
                    to.1 - from.1
                );
            }
            return Ok(());
        }
        let ((left, top), (right, bottom)) = (self.at(from), self.at(to));
        for y in top..bottom {
            for x in left..right {
                let unit = |n: i32, from: i32, to: i32| (f64::from(n - from) + 0.5) / f64::from(to - from);
                let pixel = colour_at(unit(x, left, right), unit(y, top, bottom));
                self.backend.draw_pixel((x, y), colour(pixel, 1.0)).map_err(DrawError::backend)?;
            }
        }
        Ok(())
    }
}
