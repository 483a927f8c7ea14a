//! An instrument written back as the text a person reads and edits.
//!
//! Millimetres and diameters, one line a cone, with as few digits as give back the very same number; what would need more
//! than [`DIGITS`] decimals (a scaled instrument) is rounded there, to a nanometre.

use std::fmt::Write;

use super::InstrumentFile;

/// Decimals of a millimetre at most: a nanometre, far below any workshop.
const DIGITS: usize = 6;

impl InstrumentFile {
    /// The instrument as TOML, see `docs/instrument-file.md`. [`parse`](Self::parse) of it gives the same instrument, every
    /// length to 1e-9 m and the reed volume to 1e-15 m3; exactly the same when it was itself read from a file with
    /// at most six decimals of a millimetre. Of an instrument that [`check`](Self::check) refuses it may be a text that cannot be read.
    pub fn to_toml(&self) -> String {
        // Writing to a `String` cannot fail.
        let mut out = String::new();
        let extension = match self.extension_semitones {
            0 => String::new(),
            semitones => format!(
                "# Semitones that a longer lower joint adds below the notes of an ordinary clarinet.\n\
                 extension_semitones = {semitones}\n\n"
            ),
        };
        let title: String = self.name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        let _ = write!(
            out,
            "# {title}. The format is explained in docs/instrument-file.md.\n#\n\
             # Lengths in millimetres; x is measured along the bore from the tip of the reed. Diameters, not radii.\n\n\
             name = {}\nsource = {}\n\n\
             # Semitones by which the instrument sounds below what is written.\n\
             transposition_semitones = {}\n\n\
             # Volume of air that moves with the reed, in parallel with the tip, mm3 (1000 mm3 = 1 cm3).\n\
             reed_volume_mm3 = {}\n\n\
             # Bore that zeta and the size of the reed refer to.\n\
             nominal_diameter_mm = {}\n\n\
             {}\
             # Straight cones, each starting where the one before ends. A jump in diameter between two of them is a step.\n\
             bore = [\n",
            quoted(&self.name),
            quoted(&self.source),
            self.transposition,
            number(self.reed_volume_m3, 1e9),
            number(self.nominal_radius_m, 2e3),
            extension,
        );
        for segment in &self.bore {
            let _ = writeln!(
                out,
                "  {{ part = {}, x_start_mm = {}, x_end_mm = {}, diameter_start_mm = {}, diameter_end_mm = {} }},",
                quoted(&segment.part),
                number(segment.x_start_m, 1e3),
                number(segment.x_end_m, 1e3),
                number(segment.r_start_m, 2e3),
                number(segment.r_end_m, 2e3),
            );
        }
        out.push_str("]\n");
        self.write_holes(&mut out);
        self.write_fingerings(&mut out);
        out
    }

    fn write_holes(&self, out: &mut String) {
        if !self.holes.is_empty() {
            out.push_str("\n# Tone holes from the reed to the bell; the chimney from the wall of the bore to the outside.\n");
        }
        for (index, hole) in self.holes.iter().enumerate() {
            let kind = hole.kind.name();
            let _ = writeln!(
                out,
                "{}[[hole]]\nname = {}\nkind = \"{kind}\"\nx_mm = {}\ndiameter_mm = {}\nchimney_mm = {}",
                if index == 0 { "" } else { "\n" },
                quoted(&hole.name),
                number(hole.x_m, 1e3),
                number(hole.radius_m, 2e3),
                number(hole.chimney_m, 1e3),
            );
            if hole.register {
                out.push_str("register = true\n");
            }
            if !hole.description.is_empty() {
                let _ = writeln!(out, "description = {}", quoted(&hole.description));
            }
        }
    }

    fn write_fingerings(&self, out: &mut String) {
        out.push_str(
            "\n# One fingering a note: the holes that are open (all others are closed), the register, and the impedance peak\n\
             # that sounds. maker_open is the fingering in the maker's chart, where the note is played with another.\n",
        );
        for (index, fingering) in self.fingerings.iter().enumerate() {
            let names = |open: &[bool]| quoted(&self.names(open));
            let _ = writeln!(
                out,
                "{}[[fingering]]\nwritten = \"{}\"\nregister = {}\nmode = {}\nopen = {}",
                if index == 0 { "" } else { "\n" },
                fingering.written,
                quoted(&fingering.register),
                fingering.mode,
                names(&fingering.open),
            );
            if let Some(open) = &fingering.maker_open {
                let _ = writeln!(out, "maker_open = {}", names(open));
            }
            if !fingering.fingers.is_empty() {
                let _ = writeln!(out, "fingers = {}", quoted(&fingering.fingers));
            }
        }
    }
}

/// A TOML string, whatever is in it.
fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

/// `value * scale` with the fewest decimals that read back as the same `value`, at most [`DIGITS`].
fn number(value: f64, scale: f64) -> String {
    let scaled = value * scale;
    // A float of TOML has a point.
    let written = |digits: usize| format!("{scaled:.digits$}");
    (1..DIGITS)
        .map(written)
        .find(|text| text.parse::<f64>().is_ok_and(|read| read / scale == value))
        .unwrap_or_else(|| written(DIGITS))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_and_read_back_it_is_the_same() {
        let file = InstrumentFile::built_in();
        let text = file.to_toml();
        assert_eq!(InstrumentFile::parse(&text).unwrap(), file, "bit by bit");
        assert!(text.contains("diameter_start_mm = 14.0616,"), "no more digits than it needs");
    }

    #[test]
    fn lengths_no_decimal_holds_come_back_within_a_nanometre() {
        let mut file = InstrumentFile::built_in().scaled(2.0_f64.powf(1.0 / 12.0));
        // As wide as the bore: rounding must not make it wider.
        file.holes[0].radius_m = file.radius_at(file.holes[0].x_m);
        let read = InstrumentFile::parse(&file.to_toml()).unwrap();
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-9;
        for (a, b) in file.bore.iter().zip(&read.bore) {
            assert!(close(a.x_start_m, b.x_start_m) && close(a.x_end_m, b.x_end_m), "{a:?} {b:?}");
            assert!(close(a.r_start_m, b.r_start_m) && close(a.r_end_m, b.r_end_m), "{a:?} {b:?}");
        }
        for (a, b) in file.holes.iter().zip(&read.holes) {
            assert!(close(a.x_m, b.x_m) && close(a.radius_m, b.radius_m), "{a:?} {b:?}");
            assert!(close(a.chimney_m, b.chimney_m), "{a:?} {b:?}");
        }
        assert!((file.reed_volume_m3 - read.reed_volume_m3).abs() < 1e-15);
        assert!(close(file.nominal_radius_m, read.nominal_radius_m));
        assert_eq!(file.fingerings, read.fingerings);
    }

    #[test]
    fn any_text_survives() {
        let mut file = InstrumentFile::built_in();
        for text in
            ["\"quoted\" \\ back", "two\nlines\r\n\tand a tab", "'''\"\"\"", "# \u{7f} \u{1f9f6} é", " "]
        {
            file.name = format!("x{text}");
            file.source = text.to_owned();
            file.bore[3].part = text.to_owned();
            file.holes[2].description = text.to_owned();
            file.fingerings[5].fingers = text.to_owned();
            let written = file.to_toml();
            match InstrumentFile::parse(&written) {
                Ok(read) => assert_eq!(read, file, "{text:?}"),
                Err(error) => panic!("{text:?}: {error}\n{}", &written[..400]),
            }
        }
    }
}
