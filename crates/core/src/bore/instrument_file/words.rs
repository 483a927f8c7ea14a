//! How the file that is being read names things: keys of the TOML, or columns of a table in other units.
//!
//! Everything is checked in millimetres and diameters; a message must speak of the line, the name, the unit and the number
//! the user sees.

use std::fmt;

/// The unit of a number in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unit {
    /// Plain numbers.
    None,
    Millimetres,
    Metres,
    CubicMillimetres,
}

/// Units a length or a volume may have been meant in: symbol, name, millimetres or mm3 in it.
const LENGTHS: [(&str, &str, f64); 3] =
    [("m", "metres", 1e3), ("mm", "millimetres", 1.0), ("cm", "centimetres", 10.0)];
const VOLUMES: [(&str, &str, f64); 3] =
    [("cm3", "cubic centimetres", 1e3), ("mm3", "cubic millimetres", 1.0), ("m3", "cubic metres", 1e9)];

impl Unit {
    /// Its symbol, and how many of the format's own unit it is.
    fn symbol(self) -> (&'static str, f64) {
        match self {
            Self::None => ("", 1.0),
            Self::Millimetres => ("mm", 1.0),
            Self::Metres => ("m", 1e3),
            Self::CubicMillimetres => ("mm3", 1.0),
        }
    }

    fn others(self) -> &'static [(&'static str, &'static str, f64)] {
        match self {
            Self::None => &[],
            Self::Millimetres | Self::Metres => &LENGTHS,
            Self::CubicMillimetres => &VOLUMES,
        }
    }
}

/// Name and unit of one number in the file.
#[derive(Clone, Debug)]
pub(super) struct Word {
    /// Key or column.
    pub(super) name: String,
    pub(super) unit: Unit,
    /// Whether it is a radius where the format has a diameter.
    pub(super) radius: bool,
}

impl Word {
    pub(super) fn plain(name: &str) -> Self {
        Self { name: name.to_owned(), unit: Unit::None, radius: false }
    }

    pub(super) fn mm(name: &str) -> Self {
        Self { name: name.to_owned(), unit: Unit::Millimetres, radius: false }
    }

    /// Symbol of the unit, empty for plain numbers.
    pub(super) fn unit(&self) -> &'static str {
        self.unit.symbol().0
    }

    /// What the file calls a width.
    pub(super) fn width(&self) -> &'static str {
        if self.radius { "radius" } else { "diameter" }
    }

    /// How many of the format's unit one of the file's is.
    fn scale(&self) -> f64 {
        self.unit.symbol().1 * if self.radius { 2.0 } else { 1.0 }
    }

    /// A number of the format as this file would have it, without the digits that arithmetic adds.
    pub(super) fn given(&self, value: f64) -> f64 {
        tidy(value / self.scale())
    }

    /// The unit `value` may have been meant in, in words: the first in which it is likely.
    pub(super) fn guess(&self, value: f64, likely: impl Fn(f64) -> bool) -> String {
        let (symbol, scale) = self.unit.symbol();
        let given = self.given(value);
        let meant = self.unit.others().iter().find(|(other, _, others_scale)| {
            *other != symbol && likely(given * others_scale * self.scale() / scale)
        });
        meant.map_or_else(String::new, |(other, name, others_scale)| {
            format!(
                "; this looks like {name}: {given} {other} = {} {symbol}",
                tidy(given * others_scale / scale)
            )
        })
    }
}

/// The same number to 12 digits.
pub(super) fn tidy(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

/// Where in which file something stands.
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// Name of the file, where there is more than one.
    pub(super) file: Option<String>,
    /// Its line, from 1.
    pub(super) line: Option<u64>,
    /// Segment, hole or fingering, with its number and name.
    pub(super) what: String,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.file, self.line) {
            (Some(file), Some(line)) => write!(f, "{file}, line {line}: {}", self.what),
            (Some(file), None) => write!(f, "{file}: {}", self.what),
            (None, Some(line)) => write!(f, "line {line}: {}", self.what),
            (None, None) => f.write_str(&self.what),
        }
    }
}

/// The words of a whole instrument: which file a list stands in, and what its columns are called.
#[derive(Clone, Debug)]
pub(super) struct Words {
    pub(super) bore: Option<String>,
    pub(super) hole: Option<String>,
    pub(super) fingering: Option<String>,
    pub(super) transposition: Word,
    pub(super) reed_volume: Word,
    pub(super) nominal: Word,
    pub(super) extension: Word,
    pub(super) x_start: Word,
    pub(super) x_end: Word,
    pub(super) width_start: Word,
    pub(super) width_end: Word,
    pub(super) hole_name: Word,
    pub(super) x: Word,
    pub(super) hole_width: Word,
    pub(super) chimney: Word,
    pub(super) written: Word,
    pub(super) register: Word,
    pub(super) mode: Word,
    pub(super) open: Word,
    pub(super) maker_open: Word,
}

impl Words {
    /// The keys of the instrument file.
    pub(super) fn toml() -> Self {
        Self {
            bore: None,
            hole: None,
            fingering: None,
            transposition: Word::plain("transposition_semitones"),
            reed_volume: Word { unit: Unit::CubicMillimetres, ..Word::plain("reed_volume_mm3") },
            nominal: Word::mm("nominal_diameter_mm"),
            extension: Word::plain("extension_semitones"),
            x_start: Word::mm("x_start_mm"),
            x_end: Word::mm("x_end_mm"),
            width_start: Word::mm("diameter_start_mm"),
            width_end: Word::mm("diameter_end_mm"),
            hole_name: Word::plain("name"),
            x: Word::mm("x_mm"),
            hole_width: Word::mm("diameter_mm"),
            chimney: Word::mm("chimney_mm"),
            written: Word::plain("written"),
            register: Word::plain("register"),
            mode: Word::plain("mode"),
            open: Word::plain("open"),
            maker_open: Word::plain("maker_open"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistaken_unit_is_guessed_and_the_value_given() {
        let metres = Word { unit: Unit::Metres, radius: true, ..Word::plain("r_m") };
        // 5.2 in a column of metres and radii: a diameter of 10400 mm.
        let likely = |mm: f64| (4.0..150.0).contains(&mm);
        assert_eq!(metres.guess(10_400.0, likely), "; this looks like millimetres: 5.2 mm = 0.0052 m");
        assert_eq!(Word::mm("d").guess(0.015, likely), "; this looks like metres: 0.015 m = 15 mm");
        assert_eq!(Word::mm("d").guess(0.9, likely), "; this looks like centimetres: 0.9 cm = 9 mm");
        assert_eq!(Word::mm("d").guess(-3.0, likely), "");
        assert_eq!(Word::plain("mode").guess(0.0, |_| true), "");
        assert_eq!(metres.given(10.4), 0.0052);
    }
}
