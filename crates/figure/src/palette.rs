//! Colours, the same in every figure: told apart by readers with any kind of colour vision, and in grey print by dashes.
//!
//! The single colours are those of Okabe and Ito (Color Universal Design, 2008), the two light ones darkened until a
//! thin line stands out on white. The ramp for ordered families runs from blue over green to orange and grows lighter
//! all the way; the heat map runs from paper to ink, as printed spectrograms do.

use serde::{Deserialize, Serialize};

/// Red, green, blue, 0..=255 each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rgb(pub u8, pub u8, pub u8);

/// Paper.
pub const PAPER: Rgb = Rgb(255, 255, 255);
/// Text and frames.
pub const INK: Rgb = Rgb(34, 38, 46);
/// Text of less weight. Contrast 5.7 to 1 on paper.
pub const QUIET_INK: Rgb = Rgb(94, 99, 108);
/// Lines of the grid.
pub const GRID: Rgb = Rgb(226, 229, 233);
/// Finer lines of a logarithmic grid.
pub const FINE_GRID: Rgb = Rgb(240, 242, 245);

/// A colour by name.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Colour {
    /// The colour of text.
    Ink,
    /// For what is in the background.
    Grey,
    /// Light grey, for areas.
    Pale,
    /// First choice for a curve.
    Blue,
    /// Second choice.
    Vermilion,
    /// Third.
    Green,
    /// Fourth.
    Purple,
    /// Fifth.
    Orange,
    /// Sixth.
    Sky,
    /// A member of an ordered family, 0..=1.
    Ramp(f64),
}

/// Order in which unordered curves take their colours.
pub const SERIES: [Colour; 6] =
    [Colour::Blue, Colour::Vermilion, Colour::Green, Colour::Purple, Colour::Orange, Colour::Sky];

impl Colour {
    /// The colour of the `index`-th of `count` ordered curves.
    pub fn of_family(index: usize, count: usize) -> Self {
        Self::Ramp(if count > 1 { index as f64 / (count - 1) as f64 } else { 0.0 })
    }

    /// What it looks like on a screen.
    pub fn rgb(self) -> Rgb {
        match self {
            Self::Ink => INK,
            Self::Grey => Rgb(98, 103, 112),
            Self::Pale => Rgb(206, 211, 218),
            Self::Blue => Rgb(0, 114, 178),
            Self::Vermilion => Rgb(213, 94, 0),
            Self::Green => Rgb(0, 140, 104),
            Self::Purple => Rgb(178, 86, 140),
            Self::Orange => Rgb(206, 138, 0),
            Self::Sky => Rgb(44, 150, 208),
            Self::Ramp(unit) => between(&RAMP, unit),
        }
    }
}

/// Dark blue to orange, lighter all the way; the last step still stands out on white.
const RAMP: [(f64, Rgb); 5] = [
    (0.0, Rgb(38, 40, 110)),
    (0.25, Rgb(28, 98, 148)),
    (0.5, Rgb(20, 142, 130)),
    (0.75, Rgb(122, 166, 52)),
    (1.0, Rgb(230, 150, 20)),
];

/// Paper, orange, red, ink: darker all the way.
const HEAT: [(f64, Rgb); 6] = [
    (0.0, Rgb(255, 255, 255)),
    (0.25, Rgb(254, 224, 170)),
    (0.5, Rgb(245, 140, 70)),
    (0.7, Rgb(190, 50, 70)),
    (0.88, Rgb(90, 20, 90)),
    (1.0, Rgb(15, 5, 35)),
];

/// Colour of a level in a heat map, 0 (paper) ..=1 (ink); clamped.
pub fn heat(unit: f64) -> Rgb {
    between(&HEAT, unit)
}

fn between(stops: &[(f64, Rgb)], unit: f64) -> Rgb {
    let unit = if unit.is_finite() { unit.clamp(0.0, 1.0) } else { 0.0 };
    let upper = stops.iter().position(|(at, _)| unit <= *at).unwrap_or(stops.len() - 1).max(1);
    let ((from, a), (to, b)) = (stops[upper - 1], stops[upper]);
    let part = (unit - from) / (to - from);
    let mix = |a: u8, b: u8| (f64::from(a) + part * (f64::from(b) - f64::from(a))).round() as u8;
    Rgb(mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance (WCAG 2).
    fn luminance(Rgb(r, g, b): Rgb) -> f64 {
        let linear = |x: u8| {
            let x = f64::from(x) / 255.0;
            if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b)
    }

    #[test]
    fn text_and_curves_stand_out_on_paper() {
        let contrast = |rgb| 1.05 / (luminance(rgb) + 0.05);
        assert!(contrast(INK) > 12.0 && contrast(QUIET_INK) > 4.5);
        for colour in SERIES.into_iter().chain((0..=10).map(|n| Colour::Ramp(f64::from(n) / 10.0))) {
            assert!(contrast(colour.rgb()) > 2.2, "{colour:?} {}", contrast(colour.rgb()));
        }
    }

    #[test]
    fn ramps_are_ordered_in_grey_too() {
        let grey = |n: i32, ramp: &dyn Fn(f64) -> Rgb| luminance(ramp(f64::from(n) / 50.0));
        for n in 0..50 {
            assert!(
                grey(n + 1, &|u| Colour::Ramp(u).rgb()) > grey(n, &|u| Colour::Ramp(u).rgb()),
                "ramp {n}"
            );
            assert!(grey(n + 1, &heat) < grey(n, &heat), "heat {n}");
        }
    }

    /// Viénot, Brettel and Mollon (1999): what remains of a colour without the long- or middle-wave cones.
    #[test]
    fn first_colours_differ_without_red_or_green_cones() {
        let seen = |rgb: Rgb, protan: bool| {
            let linear = |x: u8| (f64::from(x) / 255.0).powf(2.2);
            let (r, g, b) = (linear(rgb.0), linear(rgb.1), linear(rgb.2));
            let red_green = if protan { 0.112_38 * r + 0.887_62 * g } else { 0.292_75 * r + 0.707_25 * g };
            (red_green.powf(1.0 / 2.2), b.powf(1.0 / 2.2))
        };
        for protan in [false, true] {
            for (i, a) in SERIES[..4].iter().enumerate() {
                for b in &SERIES[..i] {
                    let (a1, b1) = seen(a.rgb(), protan);
                    let (a2, b2) = seen(b.rgb(), protan);
                    assert!((a1 - a2).hypot(b1 - b2) > 0.12, "{a:?} {b:?} protan {protan}");
                }
            }
        }
    }
}
