//! An instrument read from three tables, as measurements are often kept: bore, holes and fingering chart as CSV.
//!
//! One line a cone, a hole, a note; lines beginning with `#` are comments; the first other line names the columns
//! (`docs/instrument-file.md`). A column says its unit (`_m` or `_mm`) and whether it holds radii or diameters. Numbers are
//! shifted by powers of ten as text, so that a metre table gives the same instrument as the millimetre file, bit by bit.
//! What is checked is what [`InstrumentFile::parse`] checks; messages speak of the table's lines, columns and units.

use csv::StringRecord;

use super::raw::{Lined, RawFile, RawHole, RawSegment};
use super::words::{Place, Unit, Word, Words};
use super::{HoleKind, InstrumentError, InstrumentFile};
use crate::bore::transfer_matrix::TransferMatrix;
use crate::units::{Air, cents};

mod chart;

use chart::read_chart;

/// One table: its name for messages, and its text.
#[derive(Clone, Copy, Debug)]
pub struct Sheet<'a> {
    /// What messages call it, e.g. `holes.csv`.
    pub name: &'a str,
    /// CSV.
    pub text: &'a str,
}

/// What the tables do not say.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportDetails {
    /// What a player calls the instrument.
    pub name: String,
    /// Where the measurements come from.
    pub source: String,
    /// Semitones it sounds below what is written; `None`: as the chart's sounding notes say, or 0.
    pub transposition: Option<i8>,
    /// Volume of air that moves with the reed, mm3.
    pub reed_volume_mm3: f64,
    /// Bore that zeta and the reed's size refer to, mm; `None`: a B flat clarinet's.
    pub nominal_diameter_mm: Option<f64>,
}

/// Why tables are not an instrument.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// Quotes that do not close, or what else the reader of tables refuses.
    #[error("{file} is not a table: {error}")]
    Table {
        /// The table.
        file: String,
        /// What is wrong.
        error: csv::Error,
    },
    /// No line of data.
    #[error("{file} has no line of data; its first line must name the columns, e.g. {example}")]
    Empty {
        /// The table.
        file: String,
        /// How it could begin.
        example: &'static str,
    },
    /// A line with more or fewer fields than columns.
    #[error("{file}, line {line}: {given} fields; there must be {expected}, one for each column")]
    Fields {
        /// The table.
        file: String,
        /// The line.
        line: u64,
        /// Fields found.
        given: usize,
        /// Columns.
        expected: usize,
    },
    /// A column that must be there.
    #[error("{file} has no column {wanted}; it has {found}")]
    MissingColumn {
        /// The table.
        file: String,
        /// What would be right.
        wanted: String,
        /// What is there.
        found: String,
    },
    /// A column nobody knows.
    #[error(
        "{file}: column {column} is unknown; columns may be {known}; remove it, or begin its name with _ to have it \
         passed over"
    )]
    UnknownColumn {
        /// The table.
        file: String,
        /// The column.
        column: String,
        /// What would be right.
        known: String,
    },
    /// Two columns for one thing.
    #[error("{file} has both {first} and {second}; keep one of them")]
    TwoColumns {
        /// The table.
        file: String,
        /// One.
        first: String,
        /// The other.
        second: String,
    },
    /// A field that is not what its column holds.
    #[error("{file}, line {line}: {column} is {given:?}; it must be {expected}")]
    Field {
        /// The table.
        file: String,
        /// The line.
        line: u64,
        /// The column.
        column: String,
        /// The field.
        given: String,
        /// What would be right.
        expected: String,
    },
    /// Read, but not an instrument.
    #[error(transparent)]
    Instrument(#[from] InstrumentError),
}

impl InstrumentFile {
    /// Reads and checks an instrument from three tables. Never panics. Allocates.
    pub fn from_csv(
        bore: Sheet<'_>,
        holes: Sheet<'_>,
        fingerings: Sheet<'_>,
        details: &ImportDetails,
    ) -> Result<Self, ImportError> {
        let mut words = Words::toml();
        words.bore = Some(bore.name.to_owned());
        words.hole = Some(holes.name.to_owned());
        words.fingering = Some(fingerings.name.to_owned());
        words.transposition = Word::plain("transposition");
        words.reed_volume.name = "reed volume".to_owned();
        words.nominal.name = "nominal diameter".to_owned();
        let bore = read_bore(bore, &mut words)?;
        let hole = read_holes(holes, &mut words)?;
        let names: Vec<&str> = hole.iter().map(|hole| hole.value.name.as_str()).collect();
        let chart = read_chart(fingerings, &names, details.transposition, &mut words)?;
        let raw = RawFile {
            name: details.name.clone(),
            source: details.source.clone(),
            transposition_semitones: details
                .transposition
                .map_or(chart.transposition.unwrap_or(0), i64::from),
            reed_volume_mm3: details.reed_volume_mm3,
            nominal_diameter_mm: details.nominal_diameter_mm,
            extension_semitones: 0,
            bore,
            hole,
            fingering: chart.notes,
        };
        let mut file = Self::from_raw(raw, &words)?;
        if !chart.has_modes {
            file.find_altissimo_modes();
        }
        Ok(file)
    }

    /// Gives each altissimo note the peak from the third on that is nearest to it: which one that is depends on the fingering.
    fn find_altissimo_modes(&mut self) {
        if self.fingerings.iter().all(|fingering| fingering.register != "altissimo") {
            return;
        }
        let matrix = TransferMatrix::new(self, Air::default());
        for index in 0..self.fingerings.len() {
            let fingering = &self.fingerings[index];
            let Some(sounding) = fingering.written.sounding(self.transposition) else { continue };
            if fingering.register != "altissimo" {
                continue;
            }
            let wanted_hz = sounding.frequency_hz(440.0);
            let peaks = matrix.peaks(&fingering.open, self.reed_volume_m3, 12);
            let off = |mode: &usize| cents(peaks[mode - 1].f_hz, wanted_hz).abs();
            let nearest = (3..=peaks.len()).min_by(|a, b| off(a).total_cmp(&off(b)));
            self.fingerings[index].mode = nearest.unwrap_or(3);
        }
    }
}

/// A table being read.
struct Table {
    file: String,
    columns: Vec<String>,
    rows: Vec<(u64, StringRecord)>,
}

impl Table {
    fn read(sheet: Sheet<'_>, example: &'static str) -> Result<Self, ImportError> {
        let file = sheet.name.to_owned();
        let text = sheet.text.trim_start_matches('\u{feff}');
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let wrong = |error| ImportError::Table { file: sheet.name.to_owned(), error };
        let columns: Vec<String> = reader.headers().map_err(wrong)?.iter().map(str::to_owned).collect();
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(wrong)?;
            let line = record.position().map_or(0, |at| line_of_record(text, at.byte() as usize));
            if record.len() != columns.len() {
                let (given, expected) = (record.len(), columns.len());
                return Err(ImportError::Fields { file, line, given, expected });
            }
            rows.push((line, record));
        }
        if rows.is_empty() {
            return Err(ImportError::Empty { file, example });
        }
        for (index, column) in columns.iter().enumerate() {
            if columns[..index].contains(column) && !passed_over(column) {
                return Err(ImportError::TwoColumns { file, first: column.clone(), second: column.clone() });
            }
        }
        Ok(Self { file, columns, rows })
    }

    /// The column of one of these names, if there is one.
    fn optional(&self, names: &[&str]) -> Result<Option<usize>, ImportError> {
        let mut found = names.iter().filter_map(|name| self.columns.iter().position(|column| column == name));
        match (found.next(), found.next()) {
            (Some(first), Some(second)) => Err(ImportError::TwoColumns {
                file: self.file.clone(),
                first: self.columns[first].clone(),
                second: self.columns[second].clone(),
            }),
            (first, _) => Ok(first),
        }
    }

    fn required(&self, names: &[&str]) -> Result<usize, ImportError> {
        self.optional(names)?.ok_or_else(|| ImportError::MissingColumn {
            file: self.file.clone(),
            wanted: names.join(" or "),
            found: self.columns.join(", "),
        })
    }

    /// The column of a length, in one of the ways to give it.
    fn length(&self, stems: &[(&str, bool)]) -> Result<Length, ImportError> {
        let ways: Vec<(String, Unit, bool)> = stems
            .iter()
            .flat_map(|&(stem, radius)| {
                [
                    (format!("{stem}_m"), Unit::Metres, radius),
                    (format!("{stem}_mm"), Unit::Millimetres, radius),
                ]
            })
            .collect();
        let names: Vec<&str> = ways.iter().map(|(name, ..)| name.as_str()).collect();
        let index = self.required(&names)?;
        let name = &self.columns[index];
        let (unit, radius) = ways
            .iter()
            .find(|(way, ..)| way == name)
            .map_or((Unit::Millimetres, false), |&(_, unit, radius)| (unit, radius));
        Ok(Length { index, word: Word { name: name.clone(), unit, radius } })
    }

    /// Refuses columns that are not among those known.
    fn only(&self, known: &[&str], explained: impl Fn() -> String) -> Result<(), ImportError> {
        let strange =
            self.columns.iter().find(|column| !known.contains(&column.as_str()) && !passed_over(column));
        strange.map_or(Ok(()), |column| {
            Err(ImportError::UnknownColumn {
                file: self.file.clone(),
                column: column.clone(),
                known: explained(),
            })
        })
    }

    fn field(&self, line: u64, index: usize, given: &str, expected: impl Into<String>) -> ImportError {
        ImportError::Field {
            file: self.file.clone(),
            line,
            column: self.columns[index].clone(),
            given: given.to_owned(),
            expected: expected.into(),
        }
    }

    /// Millimetres (of a diameter, for widths) from the field of a length.
    fn mm(&self, line: u64, row: &StringRecord, length: &Length) -> Result<f64, ImportError> {
        let given = row.get(length.index).unwrap_or_default();
        let shift = if length.word.unit == Unit::Metres { 3 } else { 0 };
        shifted(given, shift)
            .map(|mm| if length.word.radius { 2.0 * mm } else { mm })
            .ok_or_else(|| self.field(line, length.index, given, NUMBER))
    }
}

/// What a length must be: some programs write decimals with a comma.
const NUMBER: &str = "a number; write it with a point for decimals, such as 7.45";

/// Line, from 1, of the record the reader found beginning at `byte`: past the comments and empty lines before it, which the
/// reader's own count passes over.
fn line_of_record(text: &str, byte: usize) -> u64 {
    let bytes = text.as_bytes();
    let start = byte.min(bytes.len());
    let before = bytes[..start].iter().filter(|&&byte| byte == b'\n').count();
    let skipped = bytes[start..]
        .split(|&byte| byte == b'\n')
        .take_while(|line| line.starts_with(b"#") || line.iter().all(u8::is_ascii_whitespace))
        .count();
    (before + skipped + 1) as u64
}

/// A column that holds lengths.
struct Length {
    index: usize,
    word: Word,
}

fn passed_over(column: &str) -> bool {
    column.starts_with('_')
}

/// The number in `text` times ten to the `shift`, rounded once: `0.0052` shifted by 3 is the very 5.2 of a millimetre file.
fn shifted(text: &str, shift: i32) -> Option<f64> {
    let (digits, exponent) = match text.split_once(['e', 'E']) {
        Some((digits, exponent)) => (digits, exponent.parse::<i32>().ok()?),
        None => (text, 0),
    };
    // Words like `inf` are numbers to the parser, but not to a maker.
    if !digits.bytes().all(|byte| byte.is_ascii_digit() || b"+-.".contains(&byte)) {
        return None;
    }
    let value: f64 = format!("{digits}e{}", exponent.checked_add(shift)?).parse().ok()?;
    value.is_finite().then_some(value)
}

const BORE_EXAMPLE: &str = "part,x_start_mm,x_end_mm,diameter_start_mm,diameter_end_mm";
const HOLE_EXAMPLE: &str = "hole,kind,x_mm,diameter_mm,chimney_mm,register,description";

fn read_bore(sheet: Sheet<'_>, words: &mut Words) -> Result<Vec<Lined<RawSegment>>, ImportError> {
    let table = Table::read(sheet, BORE_EXAMPLE)?;
    let x_start = table.length(&[("x_start", false)])?;
    let x_end = table.length(&[("x_end", false)])?;
    let start = table.length(&[("r_start", true), ("diameter_start", false)])?;
    let end = table.length(&[("r_end", true), ("diameter_end", false)])?;
    let part = table.optional(&["part"])?;
    let lengths = [&x_start, &x_end, &start, &end];
    let mut known = vec!["segment", "part"];
    known.extend(lengths.iter().map(|length| length.word.name.as_str()));
    table.only(&known, || {
        "segment, part, and in _m or _mm x_start, x_end, r_start or diameter_start, r_end or diameter_end"
            .to_owned()
    })?;
    let mut bore = Vec::with_capacity(table.rows.len());
    for &(line, ref row) in &table.rows {
        let value = RawSegment {
            part: part.and_then(|part| row.get(part)).unwrap_or_default().replace('_', " "),
            x_start_mm: table.mm(line, row, &x_start)?,
            x_end_mm: table.mm(line, row, &x_end)?,
            diameter_start_mm: table.mm(line, row, &start)?,
            diameter_end_mm: table.mm(line, row, &end)?,
        };
        bore.push(Lined { line: Some(line), value });
    }
    [words.x_start, words.x_end, words.width_start, words.width_end] =
        [x_start.word, x_end.word, start.word, end.word];
    Ok(bore)
}

/// Columns of the hole table that say nothing the instrument file keeps.
const HOLE_EXTRAS: [&str; 6] =
    ["index", "joint", "bore_radius_m", "radius_scale_vs_published", "pad_height_est_m", "pad_radius_est_m"];

fn read_holes(sheet: Sheet<'_>, words: &mut Words) -> Result<Vec<Lined<RawHole>>, ImportError> {
    let table = Table::read(sheet, HOLE_EXAMPLE)?;
    let name = table.required(&["hole", "name"])?;
    let kind = table.optional(&["kind"])?;
    let register = table.optional(&["register"])?;
    let description = table.optional(&["description"])?;
    let x = table.length(&[("x", false)])?;
    let width = table.length(&[
        ("hole_radius", true),
        ("radius", true),
        ("hole_diameter", false),
        ("diameter", false),
    ])?;
    let chimney = table.length(&[("chimney_height", false), ("chimney", false)])?;
    let mut known = vec!["hole", "name", "kind", "register", "description"];
    known.extend(HOLE_EXTRAS);
    known.extend([&x, &width, &chimney].map(|length| length.word.name.as_str()));
    table.only(&known, || {
        format!(
            "hole, kind, register, description, in _m or _mm x, radius or diameter, chimney, and, passed over, {}",
            HOLE_EXTRAS.join(", ")
        )
    })?;
    let mut holes = Vec::with_capacity(table.rows.len());
    for &(line, ref row) in &table.rows {
        let text = |index: usize| row.get(index).unwrap_or_default();
        let called = text(name).to_owned();
        let kind = match kind {
            None => HoleKind::Finger,
            Some(kind) => match text(kind) {
                "finger" => HoleKind::Finger,
                "key-closed" | "key_nc" => HoleKind::KeyClosed,
                "pad-open" | "pad_so" => HoleKind::PadOpen,
                other => {
                    let expected = "finger, key-closed (or key_nc) or pad-open (or pad_so)";
                    return Err(table.field(line, kind, other, expected));
                }
            },
        };
        let register = match register {
            // Without the column the name tells, as charts have it.
            None => matches!(called.to_ascii_uppercase().as_str(), "REG" | "REGISTER" | "SPEAKER"),
            Some(register) => match text(register) {
                "1" | "true" => true,
                "0" | "false" | "" => false,
                other => {
                    return Err(table.field(line, register, other, "1 for a register hole, 0 for others"));
                }
            },
        };
        let value = RawHole {
            kind,
            x_mm: table.mm(line, row, &x)?,
            diameter_mm: table.mm(line, row, &width)?,
            chimney_mm: table.mm(line, row, &chimney)?,
            register,
            description: description.map(text).unwrap_or_default().to_owned(),
            name: called,
        };
        // Before the chart is read, whose columns are named after holes.
        let what = format!("hole {} ({})", holes.len() + 1, value.name);
        let place = Place { file: Some(table.file.clone()), line: Some(line), what };
        if holes.iter().any(|other: &Lined<RawHole>| other.value.name == value.name) {
            let (place, what) = (place.to_string(), "hole".to_owned());
            return Err(InstrumentError::Duplicate { place, what, name: value.name }.into());
        }
        holes.push(Lined { line: Some(line), value });
    }
    words.hole_name = Word::plain(&table.columns[name]);
    [words.x, words.hole_width, words.chimney] = [x.word, width.word, chimney.word];
    Ok(holes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shifting_is_rounded_once() {
        assert_eq!(shifted("0.0052000", 3), Some(5.2));
        assert_eq!(shifted("14.9e-3", 3), Some(14.9));
        assert_eq!(shifted("-1.5E1", 0), Some(-15.0));
        for wrong in [
            "",
            "e",
            "1e",
            "inf",
            "nan",
            "1e999",
            "0x10",
            "1,5",
            "5 mm",
            "1e99999999999",
            "1e2147483647",
            "--1",
        ] {
            assert_eq!(shifted(wrong, 3), None, "{wrong:?}");
        }
    }
}
