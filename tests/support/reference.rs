//! The vendored reference tables, and how far something is from them.
#![allow(dead_code, reason = "each user takes what it needs")]

use std::collections::BTreeMap;
use std::path::Path;

/// One line of a table, by column.
pub type Row = BTreeMap<String, String>;

/// Written E3 to C6, the range the tolerances are set for.
pub const RANGE: std::ops::RangeInclusive<u8> = 52..=84;

/// All lines of a table.
pub fn rows(name: &str) -> Vec<Row> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference").join(name);
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_path(path).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

/// A number in a line.
pub fn number(row: &Row, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column} is {:?}", row[column]))
}

/// The written note of a line.
pub fn midi(row: &Row) -> u8 {
    row["written_midi"].parse().unwrap()
}

/// One column by written note.
pub fn by_written(name: &str, column: &str) -> BTreeMap<u8, f64> {
    rows(name).iter().map(|row| (midi(row), number(row, column))).collect()
}

/// Mean of magnitudes, largest magnitude and its label.
#[derive(Default)]
pub struct Spread {
    sum: f64,
    pub count: usize,
    pub max: f64,
    pub worst: String,
}

impl Spread {
    pub fn add(&mut self, error: f64, label: String) {
        self.sum += error.abs();
        self.count += 1;
        if error.is_nan() || error.abs() > self.max {
            (self.max, self.worst) = (error.abs(), label);
        }
    }

    pub fn mean(&self) -> f64 {
        self.sum / self.count as f64
    }

    pub fn print(&self, what: &str) {
        println!(
            "{what}: mean {:.4}, max {:.4} ({}), {} values",
            self.mean(),
            self.max,
            self.worst,
            self.count
        );
    }
}
