//! Lines to the standard error, whether somebody reads them or not.

use std::fmt;
use std::io::{self, Write};

/// As `eprintln!`, but where the reader has gone (`2>&1 | head`), nothing is said instead of a panic.
#[cfg(feature = "plugin")]
macro_rules! tell {
    ($($text:tt)*) => { $crate::stderr::line(format_args!($($text)*)) };
}

/// A line in one piece, beside other programs that write there.
pub fn line(text: fmt::Arguments<'_>) {
    let _ = io::stderr().lock().write_all(format!("{text}\n").as_bytes());
}
