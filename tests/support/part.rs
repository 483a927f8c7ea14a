//! A long test in parts: with `CHALUMEAU_PART=3/40` it does the third of forty. An emulated processor is slow: `cargo xtask cross`
//! runs part after part, says how far it is, and goes on where it was stopped.

use std::ops::Range;

const VARIABLE: &str = "CHALUMEAU_PART";

/// The numbers of the items to do, from 0: all of them without the variable.
pub fn of(count: usize) -> Range<usize> {
    let Ok(text) = std::env::var(VARIABLE) else { return 0..count };
    assert!(
        std::env::var_os("UPDATE_GOLDEN").is_none(),
        "a part alone cannot write a file of hashes; unset {VARIABLE}"
    );
    let numbers =
        text.split_once('/').and_then(|(part, parts)| Some((part.parse().ok()?, parts.parse().ok()?)));
    let (part, parts): (usize, usize) = numbers.unwrap_or_default();
    assert!(
        (1..=parts).contains(&part) && parts <= count,
        "{VARIABLE} is a part and how many parts there are, 3/40 for example and at most {count}, not {text:?}"
    );
    count * (part - 1) / parts..count * part / parts
}
