//! The forms in which users and hosts write numbers, units and names.
//!
//! Numbers: a decimal comma or point; a hyphen or a true minus sign. Units: the parameter's own in any case, or one of its
//! usual names. Names: any case, with or without spaces and hyphens, and `♭` or `Bb` for a flat.

/// Names of a unit beside the one that the plugin writes.
const UNIT_NAMES: &[(&str, &[&str])] = &[
    ("%", &["percent", "per cent"]),
    ("\u{b0}C", &["C", "\u{2103}", "\u{b0}", "deg C", "degC", "degrees C", "degrees", "celsius"]),
    ("st", &["semitones", "semitone", "semi"]),
    ("x", &["\u{d7}", "times"]),
    ("Hz", &["hertz"]),
    ("dB", &["decibels", "decibel"]),
    ("ms", &["milliseconds", "millisecond"]),
    ("kPa", &["kilopascals", "kilopascal"]),
    ("mm", &["millimetres", "millimeters", "millimetre", "millimeter"]),
    ("mm\u{b2}", &["mm2", "mm^2"]),
    ("mNm", &["mN m", "mN\u{b7}m"]),
    ("mNm s", &["mNms", "mN m s", "mNm\u{b7}s", "mNm s/rad"]),
    ("N/m", &["N per m"]),
];

/// A typed number without its unit, as `str::parse` reads numbers. What is no number stays none.
pub fn bare_number(text: &str, unit: &str) -> String {
    let plain = |c: char| match c {
        // Minus sign, small hyphen-minus, full-width hyphen-minus, en dash.
        '\u{2212}' | '\u{fe63}' | '\u{ff0d}' | '\u{2013}' => '-',
        // No-break spaces, which stand between a number and its unit.
        '\u{a0}' | '\u{202f}' | '\u{2009}' => ' ',
        ',' => '.',
        c => c,
    };
    let text: String = text.chars().map(plain).collect();
    let (text, unit) = (text.trim(), unit.trim());
    let others = UNIT_NAMES.iter().find(|(name, _)| *name == unit).map_or(&[][..], |(_, others)| others);
    // The longest name first: `deg C` ends in `C`.
    let mut names: Vec<&str> = [unit].into_iter().chain(others.iter().copied()).collect();
    names.sort_by_key(|name| std::cmp::Reverse(name.len()));
    let bare = names.iter().find_map(|name| without_end(text, name)).unwrap_or(text).trim();
    // A sign may stand apart from its number.
    match bare.strip_prefix('-') {
        Some(number) => format!("-{}", number.trim_start()),
        None => bare.to_owned(),
    }
}

/// `text` without `end`, whatever the case of its ASCII letters; `None` if it does not end so.
fn without_end<'a>(text: &'a str, end: &str) -> Option<&'a str> {
    let (head, tail) = text.split_at_checked(text.len().checked_sub(end.len())?)?;
    (!end.is_empty() && tail.eq_ignore_ascii_case(end)).then_some(head)
}

/// A name without what people vary: lower case, letters and digits only, flats as `flat`.
pub fn canonical(name: &str) -> String {
    words(name).concat()
}

/// Whether `name` begins with the words of `typed`, which is [`canonical`].
pub fn begins_with(name: &str, typed: &str) -> bool {
    let mut begun = String::new();
    words(name).iter().any(|word| {
        begun += word;
        begun == typed
    })
}

fn words(name: &str) -> Vec<String> {
    let spelt = name.to_lowercase().replace('\u{266d}', " flat ");
    let words = spelt.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    words
        .map(|word| match word {
            "bb" => "bflat".to_owned(),
            "eb" => "eflat".to_owned(),
            word => word.to_owned(),
        })
        .collect()
}

/// The name that was most likely meant by `typed`; `None` if none is near.
pub fn nearest<'a>(typed: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let typed = typed.to_lowercase();
    // What begins alike is near, however long it is.
    let nearness = |name: &str| strsim::jaro_winkler(&typed, &name.to_lowercase());
    let near = names.into_iter().map(|name| (nearness(name), name));
    // Below this, names of different words begin to look alike.
    near.filter(|(near, _)| *near > 0.75).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_lose_their_unit_however_it_is_written() {
        for (text, unit, bare) in [
            ("20 C", " \u{b0}C", "20"),
            ("20\u{b0}c", " \u{b0}C", "20"),
            ("20 deg C", " \u{b0}C", "20"),
            ("12 semitones", " st", "12"),
            ("12ST", " st", "12"),
            ("\u{2212}3,5 dB", " dB", "-3.5"),
            ("\u{2212} 3 dB", " dB", "-3"),
            ("5\u{a0}mm\u{b2}", " mm\u{b2}", "5"),
            ("5 mm2", " mm\u{b2}", "5"),
            ("1 mNm s", " mNm s", "1"),
            ("1 mNm", " mNm", "1"),
            ("0.8\u{d7}", " x", "0.8"),
            ("7", "", "7"),
            ("7 Hz", "", "7 Hz"),
            ("7 kPa", " Hz", "7 kPa"),
            ("Hz", " Hz", ""),
        ] {
            assert_eq!(bare_number(text, unit), bare, "{text:?}");
        }
    }

    #[test]
    fn names_are_the_same_in_every_usual_spelling() {
        let flat = canonical("B flat clarinet");
        for name in ["b-flat clarinet", "B\u{266d} Clarinet", "Bb clarinet", "bflat  clarinet"] {
            assert_eq!(canonical(name), flat, "{name}");
        }
        assert_eq!(canonical("CC74 (MPE y)"), "cc74mpey");
        assert_eq!(canonical(" -- "), "");
        assert!(begins_with("Bass clarinet", "bass") && begins_with("B flat clarinet", "bflat"));
        assert!(!begins_with("CC74 (MPE y)", "cc7") && !begins_with("Bass clarinet", "clarinet"));
    }

    #[test]
    fn a_mistyped_name_is_near_and_another_word_is_not() {
        let names = ["Soft subtone", "Klezmer dance", "Deep bass"];
        assert_eq!(nearest("soft subtown", names), Some("Soft subtone"));
        assert_eq!(nearest("klezmer", names), Some("Klezmer dance"));
        assert_eq!(nearest("xyzzy", names), None);
    }
}
