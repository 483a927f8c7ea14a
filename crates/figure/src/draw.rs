//! Draws figures as the bytes of a PNG, SVG or animated GIF file, or writes their data as JSON.
//!
//! The backends of plotters draw the shapes. This module places axes, words and legends, so that nothing covers data and
//! a figure looks the same in every format.

mod axes;
mod canvas;
mod font;
mod layer;
mod layout;
mod legend;
mod plot_area;
mod range;
mod sizes;
mod ticks;

use crate::Figure;
use crate::palette::{PAPER, Rgb};
use canvas::{Canvas, SvgParts};
use plotters_bitmap::BitMapBackend;
use plotters_svg::SVGBackend;
use std::fmt;
use std::str::FromStr;

/// Bitmaps are drawn so many times larger in each direction and averaged.
const FINEST: u32 = 3;
/// Up to this size; larger ones twice, to spare memory.
const FINEST_PIXELS: u32 = 4_000_000;
/// Smaller than so, words of a bitmap cannot be read: they are 8 pixels high here.
const LEAST_SCALE: f64 = 0.4;
/// Vector pictures are drawn in this part of a pixel.
const TENTH: u32 = 10;

/// The reason why a figure cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum DrawError {
    /// No size.
    #[error("size must be WIDTHxHEIGHT in pixels, 400..4000 each, for example 1600x1000; got {0:?}")]
    Size(String),
    /// The figure could not be drawn: an error of this program.
    #[error("cannot draw: {0}")]
    Backend(String),
}

impl DrawError {
    fn backend(error: impl fmt::Display) -> Self {
        Self::Backend(error.to_string())
    }
}

/// Width and height of a picture, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
}

impl Size {
    /// Below this hardly anything can be told apart.
    pub const MIN: u32 = 400;
    /// Above this bitmaps no longer fit in memory with ease.
    pub const MAX: u32 = 4_000;

    /// The size a figure asks for.
    fn of(figure: &Figure) -> Self {
        let [width, height] = figure.size.map(|pixels| pixels.clamp(Self::MIN, Self::MAX));
        Self { width, height }
    }

    /// How much smaller than in its own size everything in a figure is drawn, words among it, so that each panel keeps its room.
    /// In a larger size nothing grows: there is more room.
    fn scale(self, figure: &Figure) -> f64 {
        let own = Self::of(figure);
        let across = f64::from(self.width) / f64::from(own.width);
        let down = f64::from(self.height) / f64::from(own.height);
        across.min(down).min(1.0)
    }

    /// Width and height in pixels of the figure's own size, in which it is laid out.
    fn laid_out(self, figure: &Figure) -> (f64, f64) {
        let scale = self.scale(figure);
        (f64::from(self.width) / scale, f64::from(self.height) / scale)
    }

    /// The size from which on the words of a figure can be read in a bitmap, if this one is smaller.
    pub fn too_small_for(self, figure: &Figure) -> Option<Self> {
        let own = Self::of(figure);
        let least = |pixels: u32| ((LEAST_SCALE * f64::from(pixels)).ceil() as u32).max(Self::MIN);
        (self.scale(figure) < LEAST_SCALE)
            .then(|| Self { width: least(own.width), height: least(own.height) })
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

impl FromStr for Size {
    type Err = DrawError;

    fn from_str(text: &str) -> Result<Self, DrawError> {
        let bad = || DrawError::Size(text.to_owned());
        let (width, height) = text.split_once(['x', 'X']).ok_or_else(bad)?;
        let number = |text: &str| {
            let number = text.trim().parse::<u32>().ok();
            number.filter(|pixels| (Self::MIN..=Self::MAX).contains(pixels)).ok_or_else(bad)
        };
        Ok(Self { width: number(width)?, height: number(height)? })
    }
}

/// Figures as the frames of an animated GIF file, `frame_s` seconds per frame, in an endless loop. Returns the bytes. Calls
/// `drawn` after each frame.
pub fn gif(
    frames: &[Figure],
    size: Option<Size>,
    frame_s: f64,
    mut drawn: impl FnMut(),
) -> Result<Vec<u8>, DrawError> {
    let size = size.or_else(|| frames.first().map(Size::of));
    let Some(size) = size else { return Err(DrawError::Backend("no frames".to_owned())) };
    let (width, height) = (size.width as u16, size.height as u16);
    let mut bytes = Vec::new();
    let mut encoder = gif::Encoder::new(&mut bytes, width, height, &[]).map_err(DrawError::backend)?;
    encoder.set_repeat(gif::Repeat::Infinite).map_err(DrawError::backend)?;
    let mut before: Vec<u8> = Vec::new();
    for figure in frames {
        let pixels = rgb(figure, size)?;
        // Only what has changed: the rest of the frame before stays.
        let (left, top, across, down) = changed(&before, &pixels, size);
        let part: Vec<u8> = (top..top + down)
            .flat_map(|y| {
                let start = 3 * (y * size.width + left) as usize;
                &pixels[start..start + 3 * across as usize]
            })
            .copied()
            .collect();
        // 10: the middle of the encoder's scale from good (1) to fast (30) choice of colours.
        let mut frame = gif::Frame::from_rgb_speed(across as u16, down as u16, &part, 10);
        (frame.left, frame.top) = (left as u16, top as u16);
        frame.dispose = gif::DisposalMethod::Keep;
        frame.delay = (100.0 * frame_s).round().clamp(2.0, 6_000.0) as u16;
        encoder.write_frame(&frame).map_err(DrawError::backend)?;
        before = pixels;
        drawn();
    }
    drop(encoder);
    Ok(bytes)
}

/// The figure's data as the bytes of a JSON file.
pub fn json(figure: &Figure) -> Result<Vec<u8>, DrawError> {
    serde_json::to_vec_pretty(figure).map_err(DrawError::backend)
}

/// Left, top, width and height of what differs between two bitmaps; one pixel if nothing does, all if there is no
/// `before`.
fn changed(before: &[u8], now: &[u8], size: Size) -> (u32, u32, u32, u32) {
    if before.len() != now.len() {
        return (0, 0, size.width, size.height);
    }
    let (mut left, mut right, mut top, mut bottom) = (size.width, 0, size.height, 0);
    for (index, (a, b)) in before.chunks_exact(3).zip(now.chunks_exact(3)).enumerate() {
        if a != b {
            let (x, y) = (index as u32 % size.width, index as u32 / size.width);
            (left, right) = (left.min(x), right.max(x));
            (top, bottom) = (top.min(y), bottom.max(y));
        }
    }
    if left > right { (0, 0, 1, 1) } else { (left, top, right - left + 1, bottom - top + 1) }
}

/// The figure as a bitmap, three bytes a pixel, row by row.
fn rgb(figure: &Figure, size: Size) -> Result<Vec<u8>, DrawError> {
    let Rgb(paper, ..) = PAPER;
    let finer = if size.width * size.height <= FINEST_PIXELS { FINEST } else { 2 };
    let (width, height) = (size.width * finer, size.height * finer);
    let mut fine = vec![paper; (width * height * 3) as usize];
    {
        let backend = BitMapBackend::with_buffer(&mut fine, (width, height));
        let mut canvas = Canvas::new(backend, f64::from(finer) * size.scale(figure), None);
        layout::draw(&mut canvas, figure, size.laid_out(figure))?;
        canvas.finish()?;
    }
    let stride = (3 * width) as usize;
    let area = finer * finer;
    let finer = finer as usize;
    let mut pixels = Vec::with_capacity((size.width * size.height * 3) as usize);
    for row in fine.chunks_exact(finer * stride) {
        for x in 0..size.width as usize {
            for channel in 0..3 {
                let places =
                    (0..finer).flat_map(|y| (0..finer).map(move |sub| y * stride + 3 * (finer * x + sub)));
                let sum: u32 = places.map(|place| u32::from(row[place + channel])).sum();
                pixels.push(((sum + area / 2) / area) as u8);
            }
        }
    }
    Ok(pixels)
}

fn encode_png(pixels: &[u8], width: u32, height: u32) -> Result<Vec<u8>, DrawError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Default);
    let mut writer = encoder.write_header().map_err(DrawError::backend)?;
    writer.write_image_data(pixels).map_err(DrawError::backend)?;
    writer.finish().map_err(DrawError::backend)?;
    Ok(bytes)
}

/// The figure as the bytes of a PNG file.
pub fn png(figure: &Figure, size: Option<Size>) -> Result<Vec<u8>, DrawError> {
    let size = size.unwrap_or(Size::of(figure));
    encode_png(&rgb(figure, size)?, size.width, size.height)
}

/// The figure as the text of an SVG file, which needs no font and no other file.
pub fn svg(figure: &Figure, size: Option<Size>) -> Result<String, DrawError> {
    let size = size.unwrap_or(Size::of(figure));
    let mut drawn = String::new();
    let vector = {
        let tenths = |pixels: f64| (pixels * f64::from(TENTH)).ceil() as u32;
        let (width, height) = size.laid_out(figure);
        let backend = SVGBackend::with_string(&mut drawn, (tenths(width), tenths(height)));
        let mut canvas = Canvas::new(backend, f64::from(TENTH), Some(SvgParts::default()));
        layout::draw(&mut canvas, figure, (width, height))?;
        canvas.finish()?.unwrap_or_default()
    };
    // The backend's head names its size in tenths; its shapes stay in them, pictures and words are in pixels.
    let body =
        drawn.find("<svg").and_then(|head| drawn[head..].find('>').map(|end| &drawn[head + end + 1..]));
    let body = body.and_then(|body| body.rfind("</svg>").map(|end| &body[..end]));
    let body = body.ok_or_else(|| DrawError::Backend("the SVG backend wrote no <svg>".to_owned()))?;
    let (width, height) = (size.width, size.height);
    let (wide, high) = size.laid_out(figure);
    let title = escaped(&figure.title);
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {wide} \
         {high}\">\n<title>{title}</title>\n<rect width=\"{wide}\" height=\"{high}\" fill=\"#ffffff\"/>\n{}<g \
         transform=\"scale({})\" stroke-linejoin=\"round\" stroke-linecap=\"round\">\n{}\n</g>\n{}</svg>\n",
        vector.under,
        1.0 / f64::from(TENTH),
        body.trim(),
        vector.over
    ))
}

/// Text as SVG and HTML want it, in elements and in attributes.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            // Not allowed in either, whatever a file name has in it.
            c if c.is_control() && !matches!(c, '\n' | '\t') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, Line, Panel};

    /// As the figure of a bifurcation: three rows.
    fn tall() -> Figure {
        let figure = Figure::new("Three rows").note("a note").size(1_600, 1_500);
        ["rms", "shut", "gamma"].into_iter().fold(figure, |figure, name| {
            let curve = (0..200).map(|n| (f64::from(n) / 100.0, f64::from(n * n)));
            let panel = Panel::new(name, Axis::linear("pressure, kPa"), Axis::linear("value"));
            figure.panel(panel.with(Line::new(name, curve)))
        })
    }

    /// Share of what is not paper in each of so many equal stripes, from the top.
    fn ink(size: Size, stripes: usize) -> Vec<f64> {
        let pixels = rgb(&tall(), size).unwrap();
        let dark: Vec<f64> = pixels
            .chunks(3 * size.width as usize)
            .map(|row| row.chunks(3).map(|pixel| 255.0 - f64::from(pixel[1])).sum())
            .collect();
        let all: f64 = dark.iter().sum();
        dark.chunks(dark.len() / stripes).take(stripes).map(|part| part.iter().sum::<f64>() / all).collect()
    }

    #[test]
    fn every_row_of_a_small_figure_has_its_room() {
        let (own, small) = (Size { width: 1_600, height: 1_500 }, Size { width: 432, height: 405 });
        for (own, small) in ink(own, 15).into_iter().zip(ink(small, 15)) {
            // Thin lines are a little wider there.
            assert!((own - small).abs() < 0.06, "{own} {small}");
        }
    }
}
