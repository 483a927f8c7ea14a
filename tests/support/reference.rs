//! Columns of the vendored reference tables.

use std::collections::BTreeMap;
use std::path::Path;

/// One column by written note.
pub fn by_written(file: &str, column: &str) -> BTreeMap<u8, f64> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference").join(file);
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_path(path).unwrap();
    reader
        .deserialize()
        .map(|row| row.unwrap())
        .map(|row: BTreeMap<String, String>| {
            (row["written_midi"].parse().unwrap(), row[column].parse().unwrap())
        })
        .collect()
}
