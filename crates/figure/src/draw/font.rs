//! The embedded font: how wide words are, and what they look like.

use ab_glyph::{Font, FontRef, OutlineCurve, PxScale, ScaleFont};
use std::fmt::Write;
use std::sync::OnceLock;

/// Ubuntu Light, under the Ubuntu Font Licence.
fn font() -> &'static FontRef<'static> {
    static FONT: OnceLock<FontRef<'static>> = OnceLock::new();
    FONT.get_or_init(|| {
        // PANIC: the bytes are part of the program; the tests below read them.
        FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).expect("the embedded font is a font")
    })
}

/// Height of a capital over the size of the font.
pub const CAPITAL: f64 = 0.6;

fn scale(size: f64) -> PxScale {
    PxScale::from(size as f32)
}

/// Calls `each` with every glyph and its distance from the start; returns the whole width.
fn lay(text: &str, size: f64, mut each: impl FnMut(ab_glyph::GlyphId, f32)) -> f64 {
    let scaled = font().as_scaled(scale(size));
    let (mut x, mut before) = (0.0, None);
    for c in text.chars() {
        let glyph = font().glyph_id(c);
        if let Some(before) = before.replace(glyph) {
            x += scaled.kern(before, glyph);
        }
        each(glyph, x);
        x += scaled.h_advance(glyph);
    }
    f64::from(x)
}

/// Width of `text` on one line.
pub fn width(text: &str, size: f64) -> f64 {
    lay(text, size, |_, _| {})
}

/// Calls `cover` with offset from the start of the base line (right, down) and coverage 0..=1 of every pixel.
pub fn pixels(text: &str, size: f64, mut cover: impl FnMut(i32, i32, f32)) {
    lay(text, size, |glyph, x| {
        let glyph = glyph.with_scale_and_position(scale(size), ab_glyph::point(x, 0.0));
        let Some(outline) = font().outline_glyph(glyph) else { return };
        let bounds = outline.px_bounds();
        outline.draw(|dx, dy, covered| {
            cover(bounds.min.x as i32 + dx as i32, bounds.min.y as i32 + dy as i32, covered);
        });
    });
}

/// The same as an SVG path, `right` and `down` mapped by `place`.
pub fn path(text: &str, size: f64, place: impl Fn(f64, f64) -> (f64, f64)) -> String {
    let mut path = String::new();
    let unit = {
        let scaled = font().as_scaled(scale(size));
        f64::from(scaled.h_scale_factor())
    };
    lay(text, size, |glyph, x| {
        let Some(outline) = font().outline(glyph) else { return };
        let mut pen = None;
        for curve in &outline.curves {
            let at = |point: &ab_glyph::Point| {
                let (right, down) =
                    place(f64::from(x) + unit * f64::from(point.x), -unit * f64::from(point.y));
                format!("{right:.2} {down:.2}")
            };
            let (from, drawn, to) = match curve {
                OutlineCurve::Line(a, b) => (a, format!("L{}", at(b)), b),
                OutlineCurve::Quad(a, b, c) => (a, format!("Q{} {}", at(b), at(c)), c),
                OutlineCurve::Cubic(a, b, c, d) => (a, format!("C{} {} {}", at(b), at(c), at(d)), d),
            };
            if pen != Some(*from) {
                let _ = write!(path, "M{}", at(from));
            }
            path.push_str(&drawn);
            pen = Some(*to);
        }
    });
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sign_of_figures_is_in_the_font() {
        for sign in "abcxyzABCXYZ0123456789.,:;()/+=#%\u{2212}\u{00b0}\u{00b2}\u{00b3}\u{00d7}\u{03b3}\u{03b6}\u{03a9}\u{0394}\u{00b5}".chars() {
            assert_ne!(font().glyph_id(sign), ab_glyph::GlyphId(0), "{sign:?}");
        }
    }

    #[test]
    fn words_are_as_wide_as_their_ink() {
        let text = "pressure, kPa";
        let (mut left, mut right, mut top) = (i32::MAX, 0, 0);
        pixels(text, 40.0, |x, y, covered| {
            if covered > 0.5 {
                (left, right, top) = (left.min(x), right.max(x), top.min(y));
            }
        });
        let width = width(text, 40.0);
        assert!(
            left >= 0 && f64::from(right) <= width && f64::from(right) > width - 6.0,
            "{left}..{right} of {width}"
        );
        assert!((f64::from(-top) / 40.0 - CAPITAL).abs() < 0.1, "{top}");
        assert!(path(text, 40.0, |x, y| (x, y)).starts_with('M'));
    }
}
